//! Accessors -> numbers: every component type, normalised and not, packed or strided, sparse or without a buffer.

use super::document::{Document, at, field};
use super::json::{AccessorJson, Index};
use crate::load::resolve::Problem;
use crate::load::spans::Step;

/// What a component is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stored {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Stored {
    fn of(code: Index) -> Option<Stored> {
        Some(match code.0 {
            5120 => Stored::I8,
            5121 => Stored::U8,
            5122 => Stored::I16,
            5123 => Stored::U16,
            5125 => Stored::U32,
            5126 => Stored::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Stored::I8 | Stored::U8 => 1,
            Stored::I16 | Stored::U16 => 2,
            Stored::U32 | Stored::F32 => 4,
        }
    }

    /// The largest value of a normalised component.
    fn most(self) -> f32 {
        match self {
            Stored::I8 => 127.0,
            Stored::U8 => 255.0,
            Stored::I16 => 32_767.0,
            Stored::U16 => 65_535.0,
            Stored::U32 => 4_294_967_295.0,
            Stored::F32 => 1.0,
        }
    }

    /// The component that starts with these bytes, as a float.
    #[inline(always)]
    fn float(self, b: &[u8]) -> f32 {
        match self {
            Stored::I8 => f32::from(b[0] as i8),
            Stored::U8 => f32::from(b[0]),
            Stored::I16 => f32::from(i16::from_le_bytes([b[0], b[1]])),
            Stored::U16 => f32::from(u16::from_le_bytes([b[0], b[1]])),
            Stored::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
            Stored::F32 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        }
    }

    /// The component that starts with these bytes, if it is a whole number from 0.
    #[inline(always)]
    fn whole(self, b: &[u8]) -> Option<u32> {
        match self {
            Stored::U8 => Some(u32::from(b[0])),
            Stored::U16 => Some(u32::from(u16::from_le_bytes([b[0], b[1]]))),
            Stored::U32 => Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Stored::I8 | Stored::I16 => None,
            // Some writers give joints as floats.
            Stored::F32 => {
                let x = f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                (x == x.trunc() && (0.0..=16_777_216.0).contains(&x)).then_some(x as u32)
            }
        }
    }
}

/// The components of an element: how many, and in how many columns.
fn shape(name: &str) -> Option<(usize, usize)> {
    Some(match name {
        "SCALAR" => (1, 1),
        "VEC2" => (2, 1),
        "VEC3" => (3, 1),
        "VEC4" => (4, 1),
        "MAT2" => (4, 2),
        "MAT3" => (9, 3),
        "MAT4" => (16, 4),
        _ => return None,
    })
}

/// How the elements of an accessor lie in bytes.
struct Layout {
    stored: Stored,
    components: usize,
    columns: usize,
    normalized: bool,
}

impl Layout {
    /// Bytes of a column: those of matrices start at multiples of four.
    fn column(&self) -> usize {
        let bytes = self.components / self.columns * self.stored.size();
        if self.columns > 1 { bytes.next_multiple_of(4) } else { bytes }
    }

    fn element(&self) -> usize {
        // The last column needs no filling up.
        self.column() * (self.columns - 1) + self.components / self.columns * self.stored.size()
    }

    /// Bytes from one element to the next where they are packed.
    fn packed(&self) -> usize {
        self.column() * self.columns
    }

    /// Offset of a component in its element.
    fn offset(&self, component: usize) -> usize {
        let rows = self.components / self.columns;
        component / rows * self.column() + component % rows * self.stored.size()
    }
}

impl Document {
    fn layout(&self, index: usize, allowed: &[&str]) -> Result<(&AccessorJson, Layout, Vec<Step>), Problem> {
        let path = at("accessors", index);
        let Some(accessor) = self.root.accessors.get(index) else {
            let count = self.root.accessors.len();
            return Err(Problem::new(path, format!("there is no accessor {index}; there are {count}")));
        };
        let Some((components, columns)) = shape(&accessor.shape).filter(|_| allowed.contains(&&*accessor.shape)) else {
            let message = format!("expected an accessor of {}, found `{}`", allowed.join(" or "), accessor.shape);
            return Err(Problem::new(field(path, "type"), message));
        };
        let Some(stored) = Stored::of(accessor.component_type) else {
            let message = format!("unknown component type {}", accessor.component_type.0);
            return Err(Problem::new(field(path, "componentType"), message));
        };
        let normalized = accessor.normalized && stored != Stored::F32;
        Ok((accessor, Layout { stored, components, columns, normalized }, path))
    }

    /// The elements of an accessor as floats, one after the other, and how many components each has.
    ///
    /// `allowed` are the types that make sense where it is used.
    ///
    /// # Errors
    /// An accessor that does not exist, is of another type, or lies outside of its data.
    pub fn floats(&self, index: usize, allowed: &[&str]) -> Result<(Vec<f32>, usize), Problem> {
        let (accessor, layout, path) = self.layout(index, allowed)?;
        let scale = layout.normalized.then(|| layout.stored.most());
        let stored = layout.stored;
        // The least of the negative numbers stands for -1, as its neighbour does.
        let read = |b: &[u8]| match scale {
            Some(most) => (stored.float(b) / most).max(-1.0),
            None => stored.float(b),
        };
        let floats = self.elements(accessor, &layout, &path, 0.0, |b| Some(read(b)))?;
        Ok((floats, layout.components))
    }

    /// As [`Self::floats`], for whole numbers from 0.
    ///
    /// # Errors
    /// As [`Self::floats`]; and numbers of another kind.
    pub fn whole_numbers(&self, index: usize, allowed: &[&str]) -> Result<(Vec<u32>, usize), Problem> {
        let (accessor, layout, path) = self.layout(index, allowed)?;
        let stored = layout.stored;
        let numbers = self.elements(accessor, &layout, &path, 0, |b| stored.whole(b))?;
        Ok((numbers, layout.components))
    }

    fn elements<T: Copy>(
        &self,
        accessor: &AccessorJson,
        layout: &Layout,
        path: &[Step],
        zero: T,
        read: impl Fn(&[u8]) -> Option<T>,
    ) -> Result<Vec<T>, Problem> {
        let count = accessor.count.0;
        let numbers = count.saturating_mul(layout.components);
        self.account(numbers, path)?;
        let wrong = || Problem::new(path.to_vec(), "expected whole numbers from 0");
        let mut out = match accessor.buffer_view {
            None => vec![zero; numbers],
            Some(view) => {
                let (bytes, stride) = self.view(view.0)?;
                let bytes = within(bytes, accessor.byte_offset.0, count, layout, stride, path)?;
                let stride = stride.unwrap_or(layout.packed());
                let mut out = Vec::with_capacity(numbers);
                let offsets: Vec<usize> = (0..layout.components).map(|k| layout.offset(k)).collect();
                for i in 0..count {
                    let element = &bytes[i * stride..];
                    for offset in &offsets {
                        out.push(read(&element[*offset..]).ok_or_else(wrong)?);
                    }
                }
                out
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let path = field(path.to_vec(), "sparse");
            let few = sparse.count.0;
            self.account(few.saturating_mul(layout.components + 1), &path)?;
            let Some(stored) = Stored::of(sparse.indices.component_type) else {
                return Err(Problem::new(path, "unknown component type of its indices"));
            };
            let scalar = Layout { stored, components: 1, columns: 1, normalized: false };
            let (places, _) = self.view(sparse.indices.buffer_view.0)?;
            let places = within(places, sparse.indices.byte_offset.0, few, &scalar, None, &path)?;
            let (values, _) = self.view(sparse.values.buffer_view.0)?;
            let values = within(values, sparse.values.byte_offset.0, few, layout, None, &path)?;
            for i in 0..few {
                let place = stored.whole(&places[i * stored.size()..]).map(|place| place as usize);
                let place = place.filter(|place| *place < count).ok_or_else(|| {
                    Problem::new(path.clone(), format!("one of its indices is none of the {count} elements"))
                })?;
                for k in 0..layout.components {
                    let value = read(&values[i * layout.packed() + layout.offset(k)..]);
                    out[place * layout.components + k] = value.ok_or_else(wrong)?;
                }
            }
        }
        Ok(out)
    }
}

/// The bytes from the first element on, if all of them are there.
fn within<'a>(
    bytes: &'a [u8],
    offset: usize,
    count: usize,
    layout: &Layout,
    stride: Option<usize>,
    path: &[Step],
) -> Result<&'a [u8], Problem> {
    let element = layout.element();
    let stride = stride.unwrap_or(layout.packed());
    if stride < element && count > 1 {
        let message = format!("elements of {element} bytes overlap at a stride of {stride}");
        return Err(Problem::new(path.to_vec(), message));
    }
    let length = if count == 0 { Some(0) } else { stride.checked_mul(count - 1).and_then(|n| n.checked_add(element)) };
    let end = length.and_then(|n| n.checked_add(offset)).filter(|end| *end <= bytes.len());
    match end {
        Some(_) => Ok(&bytes[offset..]),
        None => {
            let message = format!("{count} elements from byte {offset} do not fit its view of {} bytes", bytes.len());
            Err(Problem::new(path.to_vec(), message))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    use crate::base::project::Folder;

    /// A document over these bytes with one view for all of them, and accessors.
    fn document(bytes: &[u8], views: &str, accessors: &str) -> Document {
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {}, "uri": "data:;base64,{}"}}],
                "bufferViews": [{views}], "accessors": [{accessors}]}}"#,
            bytes.len(),
            super::super::tests::base64(bytes)
        );
        Document::of_bytes(json.into_bytes(), "a.gltf".into(), Folder::default(), PathBuf::new()).unwrap()
    }

    #[test]
    fn every_component_type_is_read_and_normalised() {
        let bytes = [0x80, 0x81, 0x7f, 0xff, 0, 0x80, 1, 0x80, 0xff, 0x7f, 0xff, 0xff];
        let view = r#"{"buffer": 0, "byteLength": 12}"#;
        let one = |kind: u32, at: u32, count: u32, normalized: bool| {
            format!(
                r#"{{"bufferView": 0, "byteOffset": {at}, "componentType": {kind}, "count": {count}, "type": "SCALAR",
                     "normalized": {normalized}}}"#
            )
        };
        let read = |accessor: String| document(&bytes, view, &accessor).floats(0, &["SCALAR"]).map(|(f, _)| f);
        assert_eq!(read(one(5120, 0, 3, true)).unwrap(), [-1.0, -1.0, 1.0]);
        assert_eq!(read(one(5120, 0, 3, false)).unwrap(), [-128.0, -127.0, 127.0]);
        assert_eq!(read(one(5121, 3, 2, true)).unwrap(), [1.0, 0.0]);
        assert_eq!(read(one(5122, 4, 3, true)).unwrap(), [-1.0, -1.0, 1.0]);
        assert_eq!(read(one(5123, 10, 1, true)).unwrap(), [1.0]);
        assert_eq!(read(one(5126, 4, 1, false)).unwrap(), [f32::from_le_bytes([0, 0x80, 1, 0x80])]);
        let said = read(one(5126, 4, 3, false)).unwrap_err().message;
        assert!(said.contains("do not fit its view of 12 bytes"), "{said}");
        assert!(read(one(5124, 0, 1, false)).unwrap_err().message.contains("component type 5124"));
        let huge = one(5126, 0, 1, false).replace("\"count\": 1", "\"count\": 1000000000000000");
        assert!(read(huge).is_err());
    }

    #[test]
    fn columns_of_small_matrices_start_at_multiples_of_four() {
        let bytes: Vec<u8> = (0..24).collect();
        let view = r#"{"buffer": 0, "byteLength": 24}"#;
        let accessor = r#"{"bufferView": 0, "componentType": 5121, "count": 2, "type": "MAT3"}"#;
        let (floats, components) = document(&bytes, view, accessor).floats(0, &["MAT3"]).unwrap();
        assert_eq!(components, 9);
        assert_eq!(floats[..9], [0.0, 1.0, 2.0, 4.0, 5.0, 6.0, 8.0, 9.0, 10.0]);
        assert_eq!(floats[9], 12.0);
    }

    #[test]
    fn strides_are_kept_and_overlaps_refused() {
        let bytes: Vec<u8> = (0..20).collect();
        let accessor = r#"{"bufferView": 0, "byteOffset": 2, "componentType": 5121, "count": 3, "type": "VEC2"}"#;
        let view = |stride: u32| format!(r#"{{"buffer": 0, "byteLength": 20, "byteStride": {stride}}}"#);
        let read = |stride| document(&bytes, &view(stride), accessor).whole_numbers(0, &["VEC2"]).map(|(n, _)| n);
        assert_eq!(read(8).unwrap(), [2, 3, 10, 11, 18, 19]);
        assert!(read(1).unwrap_err().message.contains("overlap"));
        assert!(read(9).is_err());
        let other = document(&bytes, &view(8), accessor).floats(0, &["VEC3", "VEC4"]).unwrap_err();
        assert!(other.message.contains("VEC3 or VEC4, found `VEC2`"));
    }

    #[test]
    fn sparse_values_stand_over_others_or_over_zeros() {
        let bytes = [9, 8, 7, 6, 1, 3, 50, 60];
        let views = r#"{"buffer": 0, "byteLength": 4}, {"buffer": 0, "byteOffset": 4, "byteLength": 2},
            {"buffer": 0, "byteOffset": 6, "byteLength": 2}"#;
        let sparse = r#""sparse": {"count": 2, "indices": {"bufferView": 1, "componentType": 5121},
            "values": {"bufferView": 2}}"#;
        let read = |start: &str, count: u32| {
            let accessor = format!(r#"{{{start}"componentType": 5121, "count": {count}, "type": "SCALAR", {sparse}}}"#);
            document(&bytes, views, &accessor).whole_numbers(0, &["SCALAR"]).map(|(n, _)| n)
        };
        assert_eq!(read("\"bufferView\": 0, ", 4).unwrap(), [9, 50, 7, 60]);
        assert_eq!(read("", 5).unwrap(), [0, 50, 0, 60, 0]);
        assert!(read("", 3).unwrap_err().message.contains("none of the 3 elements"));
        assert!(read("", u32::MAX).unwrap_err().message.contains("more than"));
    }
}
