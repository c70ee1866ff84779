//! Stanford PLY, as text or in bytes: elements `vertex`, `face` and `tristrips`.

mod build;
mod header;

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::cursor::decimal;
use super::source::{Notes, SourceFile};
use crate::base::diagnostics::Diagnostic;
use crate::base::{limits, math};
use crate::components::MeshData;
use build::Faces;
use header::{Element, PlyEncoding, PlyHeader, Scalar};

/// What a number of a vertex or a face is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Meaning {
    Position(usize),
    Normal(usize),
    Uv(usize),
    /// Red, green, blue, alpha.
    Color(usize),
    /// Corners of a face, or of a strip.
    Corners,
    /// Texture coordinates of the corners of a face, one after the other.
    CornerUvs,
    /// Which of several textures.
    Texture,
    Unused,
}

impl Meaning {
    fn of(name: &str, is_list: bool) -> Meaning {
        match (name, is_list) {
            ("vertex_indices" | "vertex_index", true) => Meaning::Corners,
            ("texcoord", true) => Meaning::CornerUvs,
            ("x", false) => Meaning::Position(0),
            ("y", false) => Meaning::Position(1),
            ("z", false) => Meaning::Position(2),
            ("nx", false) => Meaning::Normal(0),
            ("ny", false) => Meaning::Normal(1),
            ("nz", false) => Meaning::Normal(2),
            ("u" | "s" | "texture_u", false) => Meaning::Uv(0),
            ("v" | "t" | "texture_v", false) => Meaning::Uv(1),
            ("red" | "r" | "diffuse_red", false) => Meaning::Color(0),
            ("green" | "g" | "diffuse_green", false) => Meaning::Color(1),
            ("blue" | "b" | "diffuse_blue", false) => Meaning::Color(2),
            ("alpha" | "a" | "diffuse_alpha", false) => Meaning::Color(3),
            ("texnumber", false) => Meaning::Texture,
            _ => Meaning::Unused,
        }
    }
}

/// The numbers behind the header.
struct Body<'a> {
    source: SourceFile<'a>,
    at: usize,
    encoding: PlyEncoding,
}

/// A row of an element.
#[derive(Clone, Debug, Default)]
struct Row {
    position: DVec3,
    normal: Vec3,
    uv: Vec2,
    /// As it is written, in shares of a full one.
    color: Vec4,
    corners: Vec<i64>,
    corner_uvs: Vec<f32>,
    texture: i64,
}

/// Reads a PLY file; with `decoded` its colours stand for the sRGB curve.
///
/// # Errors
/// What cannot be read, with its line, or its byte where the file is not text.
pub fn parse(source: SourceFile, decoded: bool, notes: &mut Notes) -> Result<MeshData, Diagnostic> {
    let header = header::read(source, notes)?;
    let mut body = Body { source, at: header.end, encoding: header.encoding };
    let vertices = header.elements.iter().find(|element| element.name == "vertex").map_or(0, |element| element.count);
    let mut data = MeshData::default();
    let mut faces = Faces::new(vertices, decoded);
    let mut known = [false; 2];
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" if !known[0] => body.vertices(element, decoded, &mut data, notes)?,
            "face" if !known[1] => body.faces(element, false, &mut faces, notes)?,
            "tristrips" => body.faces(element, true, &mut faces, notes)?,
            name => {
                let [start, end] = element.span;
                let message = format!("elements `{name}` are not used");
                notes.add(name, || source.error(start, end, message).into_warning());
                body.pass_over(element)?;
            }
        }
        known = [known[0] || element.name == "vertex", known[1] || element.name == "face"];
    }
    if !known[0] {
        return Err(source.whole("there are no elements `vertex`"));
    }
    faces.build(source, &header, data, notes)
}

impl Body<'_> {
    fn is_text(&self) -> bool {
        self.encoding == PlyEncoding::Ascii
    }

    /// What each property of an element means; those of no use are noted.
    fn meanings(&self, element: &Element, used: fn(Meaning) -> bool, notes: &mut Notes) -> Vec<Meaning> {
        let meaning = |property: &header::Property| {
            let meaning = Some(Meaning::of(&property.name, property.length.is_some())).filter(|m| used(*m));
            if meaning.is_none() {
                let [start, end] = property.span;
                let message = format!("`{}` of `{}` is not used", property.name, element.name);
                notes.add(&message, || self.source.error(start, end, message.clone()).into_warning());
            }
            meaning.unwrap_or(Meaning::Unused)
        };
        element.properties.iter().map(meaning).collect()
    }

    fn vertices(
        &mut self,
        element: &Element,
        decoded: bool,
        data: &mut MeshData,
        notes: &mut Notes,
    ) -> Result<(), Diagnostic> {
        let used =
            |m: Meaning| matches!(m, Meaning::Position(_) | Meaning::Normal(_) | Meaning::Uv(_) | Meaning::Color(_));
        let meanings = self.meanings(element, used, notes);
        let has = |meaning: Meaning| meanings.contains(&meaning);
        if let Some(missing) = (0..3).find(|axis| !has(Meaning::Position(*axis))) {
            let [start, end] = element.span;
            return Err(self.source.error(start, end, format!("vertices have no `{}`", ["x", "y", "z"][missing])));
        }
        let normals = (0..3).all(|axis| has(Meaning::Normal(axis)));
        let uvs = has(Meaning::Uv(0));
        let colors = (0..3).all(|channel| has(Meaning::Color(channel)));
        let mut row = Row { color: Vec4::ONE, ..Row::default() };
        let room = element.count.min(self.source.bytes.len());
        data.vertices.reserve(room);
        for number in 0..element.count {
            self.row(element, &meanings, number, &mut row)?;
            if number == 0 {
                data.origin = math::lattice_origin(row.position);
            }
            data.vertices.push((row.position - data.origin).as_vec3());
            if normals {
                let is_direction = row.normal.is_finite() && row.normal.abs().max_element() < 1e9;
                data.normals.push(if is_direction { row.normal } else { Vec3::ZERO });
            }
            if uvs {
                let is_place = row.uv.is_finite() && row.uv.abs().max_element() < 1e9;
                data.uvs.push(if is_place { row.uv } else { MeshData::NO_UV });
            }
            if colors {
                data.colors.push(build::linear(row.color, decoded));
            }
        }
        Ok(())
    }

    fn faces(
        &mut self,
        element: &Element,
        strips: bool,
        faces: &mut Faces,
        notes: &mut Notes,
    ) -> Result<(), Diagnostic> {
        let used =
            |m: Meaning| matches!(m, Meaning::Corners | Meaning::CornerUvs | Meaning::Color(_) | Meaning::Texture);
        let meanings = self.meanings(element, used, notes);
        let [start, end] = element.span;
        if !meanings.contains(&Meaning::Corners) {
            let message = format!("elements `{}` have no list `vertex_indices`", element.name);
            return Err(self.source.error(start, end, message));
        }
        faces.has_uvs |= !strips && meanings.contains(&Meaning::CornerUvs);
        faces.has_colors |= !strips && (0..3).all(|channel| meanings.contains(&Meaning::Color(channel)));
        let mut row = Row { color: Vec4::ONE, ..Row::default() };
        for number in 0..element.count {
            let at = self.at;
            self.row(element, &meanings, number, &mut row)?;
            let added = if strips { faces.add_strips(&row.corners) } else { faces.add(&row) };
            added.map_err(|message| self.error(at, &format!("`{}` {number}: {message}", element.name)))?;
            if faces.triangles() > limits::TRIANGLES {
                return Err(self.error(at, &format!("the mesh has more than {} triangles", limits::TRIANGLES)));
            }
        }
        Ok(())
    }

    fn pass_over(&mut self, element: &Element) -> Result<(), Diagnostic> {
        let meanings = vec![Meaning::Unused; element.properties.len()];
        let mut row = Row::default();
        for number in 0..element.count {
            self.row(element, &meanings, number, &mut row)?;
            // Rows without properties take no bytes, however many are declared.
            if element.properties.is_empty() {
                break;
            }
        }
        Ok(())
    }

    fn row(&mut self, element: &Element, meanings: &[Meaning], number: usize, row: &mut Row) -> Result<(), Diagnostic> {
        for (property, meaning) in element.properties.iter().zip(meanings) {
            let early = |body: &Self| body.early(element, number);
            let Some(length) = property.length else {
                let x = self.scalar(property.scalar)?.ok_or_else(|| early(self))?;
                match *meaning {
                    Meaning::Position(axis) => row.position[axis] = x,
                    Meaning::Normal(axis) => row.normal[axis] = x as f32,
                    Meaning::Uv(axis) => row.uv[axis] = x as f32,
                    Meaning::Color(channel) => row.color[channel] = (x / property.scalar.full()) as f32,
                    Meaning::Texture => row.texture = x as i64,
                    Meaning::Corners | Meaning::CornerUvs | Meaning::Unused => {}
                }
                continue;
            };
            let start = self.at;
            let count = self.scalar(length)?.ok_or_else(|| early(self))?;
            let room = (self.source.bytes.len() - self.at) / if self.is_text() { 1 } else { property.scalar.bytes() };
            if !(count >= 0.0 && count.fract() == 0.0 && count <= room as f64) {
                let message = format!("a list of {count} numbers, in a file with room for {room}");
                return Err(self.error(start, &message));
            }
            match meaning {
                Meaning::Corners => row.corners.clear(),
                Meaning::CornerUvs => row.corner_uvs.clear(),
                _ => {}
            }
            for _ in 0..count as usize {
                let x = self.scalar(property.scalar)?.ok_or_else(|| early(self))?;
                match meaning {
                    Meaning::Corners if x.fract() == 0.0 => row.corners.push(x as i64),
                    Meaning::Corners => return Err(self.error(start, &format!("{x} is no number of a vertex"))),
                    Meaning::CornerUvs => row.corner_uvs.push(x as f32),
                    _ => {}
                }
            }
        }
        if self.is_text() {
            self.end_row(element, number)?;
        }
        Ok(())
    }

    /// Sees to it that a row of text ends with its line.
    fn end_row(&mut self, element: &Element, number: usize) -> Result<(), Diagnostic> {
        let rest = &self.source.bytes[self.at..];
        let next = rest.iter().position(|b| !matches!(b, b' ' | b'\t')).unwrap_or(rest.len());
        match rest.get(next) {
            None | Some(b'\n' | b'\r') => {
                self.at += next;
                Ok(())
            }
            Some(_) if element.properties.is_empty() => Ok(()),
            Some(_) => {
                let message = format!("`{}` {number} has more numbers than properties", element.name);
                Err(self.error(self.at + next, &message))
            }
        }
    }

    fn early(&self, element: &Element, number: usize) -> Diagnostic {
        let message = format!("the file ends in `{}` {number} of {}", element.name, element.count);
        self.error(self.source.bytes.len(), &message)
    }

    /// An error at a byte: at its line where the file is text.
    fn error(&self, at: usize, message: &str) -> Diagnostic {
        if self.is_text() {
            let skipped =
                self.source.bytes[at.min(self.source.bytes.len())..].iter().take_while(|b| b.is_ascii_whitespace());
            let at = at + skipped.count();
            return self.source.error(at, at + 1, message);
        }
        self.source.whole(format!("{message} (at byte {at})"))
    }

    /// The next number; `None` at the end of the file.
    #[inline(always)]
    fn scalar(&mut self, scalar: Scalar) -> Result<Option<f64>, Diagnostic> {
        if self.encoding == PlyEncoding::Ascii {
            return self.text_scalar();
        }
        let big = self.encoding == PlyEncoding::BigEndian;
        let Some(bytes) = self.source.bytes.get(self.at..self.at + scalar.bytes()) else { return Ok(None) };
        self.at += bytes.len();
        let mut word = [0; 8];
        for (i, byte) in bytes.iter().enumerate() {
            word[if big { bytes.len() - 1 - i } else { i }] = *byte;
        }
        let bits = u64::from_le_bytes(word);
        Ok(Some(match scalar {
            Scalar::I8 => f64::from(bits as u8 as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as u16 as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as u32 as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        }))
    }

    fn text_scalar(&mut self) -> Result<Option<f64>, Diagnostic> {
        let bytes = self.source.bytes;
        while bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        if self.at >= bytes.len() {
            return Ok(None);
        }
        let start = self.at;
        if let Some((value, length)) = decimal(&bytes[start..])
            && bytes.get(start + length).is_none_or(u8::is_ascii_whitespace)
        {
            self.at += length;
            return Ok(Some(value));
        }
        let mut cursor = super::cursor::Cursor { bytes, at: start };
        let number = cursor.number();
        self.at = cursor.at;
        match number {
            super::cursor::Number::Value(x) => Ok(Some(x)),
            super::cursor::Number::Word(from, to) => Err(super::no_number(&self.source, from, to)),
            super::cursor::Number::Missing => {
                let end = start + bytes[start..].iter().take_while(|b| !b.is_ascii_whitespace()).count();
                Err(super::no_number(&self.source, start, end))
            }
        }
    }
}

impl PlyHeader {
    /// Names of the textures by the number that faces give.
    fn texture(&self, number: i64) -> Option<&str> {
        let index = usize::try_from(number).ok()?;
        self.textures.get(index).map(String::as_str)
    }
}
