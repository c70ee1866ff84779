//! STL: triangles without connections, in bytes or as text. Corners at one place become one vertex.
//!
//! The front of a triangle is where its corners run counter-clockwise; the normals beside them say the same, or nothing.

use glam::{Vec3, Vec4};
use rustc_hash::FxHashMap;

use super::cursor::{Cursor, Number};
use super::source::{Notes, SourceFile, decode};
use crate::base::color::srgb_decode;
use crate::base::diagnostics::Diagnostic;
use crate::base::limits;
use crate::components::record::ranges::FARTHEST;
use crate::components::{FaceSet, MeshData};

/// Bytes before the triangles, and of each of them.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Triangles while they are read.
#[derive(Default)]
struct Builder {
    data: MeshData,
    /// Vertices by position and colour.
    known: FxHashMap<([u32; 3], u32), u32>,
}

impl Builder {
    /// `color` is a number that stands for `rgb`, so that corners of one colour share a vertex.
    fn triangle(&mut self, corners: [Vec3; 3], color: u32, rgb: Option<Vec4>) {
        let numbers = corners.map(|p| {
            let next = self.data.vertices.len() as u32;
            let place = p.to_array().map(|x| (x + 0.0).to_bits());
            let number = *self.known.entry((place, color)).or_insert(next);
            if number == next {
                self.data.vertices.push(p);
                self.data.colors.extend(rgb);
            }
            number
        });
        self.data.triangles.push(numbers);
    }
}

/// Reads an STL file; with `decoded` its colours stand for the sRGB curve.
///
/// # Errors
/// What cannot be read, with its line, or its byte where the file is not text.
pub fn parse(source: SourceFile, decoded: bool, notes: &mut Notes) -> Result<MeshData, Diagnostic> {
    let bytes = source.bytes;
    let declared = bytes.get(80..HEADER).map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]));
    let fits = declared.is_some_and(|count| HEADER as u64 + u64::from(count) * TRIANGLE as u64 == bytes.len() as u64);
    // Many binary files begin with `solid` too.
    let is_text = bytes.trim_ascii_start().starts_with(b"solid") && !fits;
    let looks_like_text = is_text && !bytes[..bytes.len().min(1000)].contains(&0);
    if looks_like_text {
        return text(source, notes);
    }
    match declared {
        Some(count) => binary(source, count, decoded, notes),
        None => Err(source.whole("this is no STL file: it has neither `solid` nor a header of 84 bytes")),
    }
}

fn check(source: SourceFile, corners: &[Vec3; 3], triangle: usize, at: String) -> Result<(), Diagnostic> {
    let far = corners.iter().flat_map(|p| p.to_array()).find(|x| x.is_nan() || x.abs() > FARTHEST as f32);
    match far {
        Some(x) => Err(source.whole(format!("triangle {triangle} has the coordinate {x}{at}"))),
        None => Ok(()),
    }
}

fn binary(source: SourceFile, count: u32, decoded: bool, notes: &mut Notes) -> Result<MeshData, Diagnostic> {
    let bytes = source.bytes;
    let there = (bytes.len() - HEADER) / TRIANGLE;
    if there < count as usize {
        let message = format!("declares {count} triangles, but its {} bytes have room for {there}", bytes.len());
        return Err(source.whole(message));
    }
    if count as usize > limits::TRIANGLES {
        return Err(source.whole(format!("the mesh has more than {} triangles", limits::TRIANGLES)));
    }
    let rest = bytes.len() - HEADER - count as usize * TRIANGLE;
    if rest > 0 {
        let message = format!("{rest} bytes behind the last triangle are not used");
        notes.add("rest", || source.whole(message).into_warning());
    }
    let triangles = bytes[HEADER..].chunks_exact(TRIANGLE).take(count as usize);
    let attribute = |t: &[u8]| u16::from_le_bytes([t[48], t[49]]);
    // Two programs' ways of writing colours into the bytes that are left over: one says so in the header.
    let magics = bytes[..80].windows(6).position(|w| w == b"COLOR=").map(|i| i + 6);
    let whole = magics.and_then(|at| bytes.get(at..at + 4)).map(|c| [c[0], c[1], c[2]].map(|x| f32::from(x) / 255.0));
    let has_own = |a: u16| if whole.is_some() { a & 0x8000 == 0 } else { a & 0x8000 != 0 };
    let any = triangles.clone().any(|t| attribute(t) != 0 && has_own(attribute(t)));
    let colored = any || whole.is_some();
    let rgb = |a: u16| {
        let five = |shift: u16| f32::from((a >> shift) & 31) / 31.0;
        let value = |x: f32| if decoded { srgb_decode(x) } else { x };
        let color = match (whole, has_own(a) && any) {
            (Some(_), true) => [five(0), five(5), five(10)],
            (None, true) => [five(10), five(5), five(0)],
            (Some(whole), false) => whole,
            (None, false) => [1.0; 3],
        };
        let [r, g, b] = color.map(value);
        Vec4::new(r, g, b, 1.0)
    };
    let mut builder = Builder::default();
    for (number, t) in triangles.enumerate() {
        let at = |i: usize| f32::from_le_bytes([t[i], t[i + 1], t[i + 2], t[i + 3]]);
        let corners = [12, 24, 36].map(|i| Vec3::new(at(i), at(i + 4), at(i + 8)));
        check(source, &corners, number, format!(" (at byte {})", HEADER + number * TRIANGLE))?;
        let color = if colored { attribute(t) } else { 0 };
        builder.triangle(corners, color.into(), colored.then(|| rgb(color)));
    }
    Ok(builder.data)
}

fn text(source: SourceFile, notes: &mut Notes) -> Result<MeshData, Diagnostic> {
    let mut cursor = Cursor::new(source.bytes);
    let mut builder = Builder::default();
    let mut corners: Vec<Vec3> = Vec::new();
    let mut solids: Vec<FaceSet> = Vec::new();
    let mut facet = 0;
    while cursor.peek().is_some() {
        cursor.blanks();
        let start = cursor.at;
        let word = decode(cursor.word()).to_ascii_lowercase();
        let now = builder.data.triangles.len() as u32;
        match word.as_str() {
            "vertex" => {
                let mut point = Vec3::ZERO;
                for axis in 0..3 {
                    point[axis] = match cursor.number() {
                        Number::Value(x) => x as f32,
                        Number::Word(from, to) => return Err(super::no_number(&source, from, to)),
                        Number::Missing => {
                            let message = format!("`vertex` needs 3 numbers and has {axis}");
                            return Err(source.error(start, start + 6, message));
                        }
                    };
                }
                if !point.to_array().iter().all(|x| x.abs() <= FARTHEST as f32) {
                    let message = format!("a vertex stands at ({}, {}, {})", point.x, point.y, point.z);
                    return Err(source.error(start, start + 6, message));
                }
                corners.push(point);
            }
            "facet" => {
                facet = start;
                corners.clear();
            }
            "endfacet" => {
                let [a, b, c] = corners[..] else {
                    let message = format!("a facet has {} corners and not 3", corners.len());
                    return Err(source.error(facet, facet + 5, message));
                };
                builder.triangle([a, b, c], 0, None);
                corners.clear();
            }
            "solid" => {
                let [from, to] = cursor.rest();
                solids.push(FaceSet { name: decode(&source.bytes[from..to]).into(), runs: vec![[now, now]] });
            }
            "endsolid" => {
                if let Some(run) = solids.last_mut().and_then(|solid| solid.runs.last_mut()) {
                    run[1] = now;
                }
            }
            "" | "outer" | "endloop" => {}
            _ => notes.add(&word, || {
                let message =
                    format!("`{}` is no word of an STL file; the line is skipped", source.short(start, cursor.at));
                source.error(start, cursor.at, message).into_warning()
            }),
        }
        cursor.next_line();
    }
    if !corners.is_empty() {
        return Err(source.error(facet, facet + 5, "the file ends in this facet"));
    }
    let is_named = |solid: &FaceSet| !solid.name.is_empty() && solid.runs.iter().any(|[start, end]| start < end);
    builder.data.groups = merged(solids.into_iter().filter(is_named));
    Ok(builder.data)
}

/// Solids of one name are one group.
fn merged(solids: impl Iterator<Item = FaceSet>) -> Vec<FaceSet> {
    let mut groups: Vec<FaceSet> = Vec::new();
    for solid in solids {
        match groups.iter_mut().find(|group| group.name == solid.name) {
            Some(group) => group.runs.extend(solid.runs),
            None => groups.push(solid),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<(MeshData, Vec<String>), String> {
        let mut notes = Notes::default();
        let data = parse(SourceFile { file: "a.stl", bytes }, false, &mut notes).map_err(|d| d.to_string())?;
        Ok((data, notes.into_warnings().iter().map(ToString::to_string).collect()))
    }

    fn bytes(triangles: &[([[f32; 3]; 3], u16)], header: &[u8]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for (corners, attribute) in triangles {
            bytes.extend([0; 12]);
            corners.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes.extend(attribute.to_le_bytes());
        }
        bytes
    }

    const SQUARE: [[[f32; 3]; 3]; 2] =
        [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]];

    #[test]
    fn corners_at_one_place_are_one_vertex() {
        for header in [&b"solid but not text"[..], b"made by hand"] {
            let (data, warnings) = read(&bytes(&SQUARE.map(|t| (t, 0)), header)).unwrap();
            assert_eq!((data.vertices.len(), data.triangles, data.colors.len()), (4, vec![[0, 1, 2], [0, 2, 3]], 0));
            assert!(warnings.is_empty(), "{warnings:?}");
        }
        let facet = |t: &[[f32; 3]; 3]| {
            let corner = |p: &[f32; 3]| format!("vertex {} {} {}\r\n", p[0], p[1], p[2]);
            format!(
                "  facet normal 0 0 1\r\nouter loop\r\n{}endloop\nendfacet\n",
                t.iter().map(corner).collect::<String>()
            )
        };
        let text = format!("solid two words\n{}endsolid two words\n", SQUARE.iter().map(facet).collect::<String>());
        let (data, _) = read(text.as_bytes()).unwrap();
        assert_eq!((data.vertices.len(), data.triangles.len()), (4, 2));
        assert_eq!(data.groups, [FaceSet { name: "two words".into(), runs: vec![[0, 2]] }]);
    }

    #[test]
    fn colours_of_both_kinds_are_read() {
        let red = 0x8000 | 31 << 10;
        let (data, _) = read(&bytes(&[(SQUARE[0], red), (SQUARE[1], 0)], b"")).unwrap();
        assert_eq!((data.vertices.len(), data.colors[0]), (6, Vec4::new(1.0, 0.0, 0.0, 1.0)));
        assert_eq!(data.colors[3], Vec4::ONE);
        let (data, _) = read(&bytes(&[(SQUARE[0], 31), (SQUARE[1], 0x8000)], b"COLOR=\xff\xff\x00\xff")).unwrap();
        assert_eq!((data.colors[0], data.colors[3]), (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(1.0, 1.0, 0.0, 1.0)));
    }

    #[test]
    fn broken_files_are_refused_at_their_place() {
        let said = |bytes: &[u8]| read(bytes).unwrap_err();
        let whole = bytes(&SQUARE.map(|t| (t, 0)), b"");
        assert!(said(&whole[..whole.len() - 1]).contains("declares 2 triangles"));
        assert!(said(&whole[..50]).contains("no STL file"));
        assert!(said(b"solid a\nfacet\nvertex 1 2\n").contains("a.stl:3:1: error: `vertex` needs 3 numbers and has 2"));
        assert!(said(b"solid a\nfacet\nvertex 1 2 x\n").contains("a.stl:3:12: error: `x` is not a number"));
        assert!(said(b"solid a\nfacet\nvertex 1 2 3\nendfacet\n").contains("a.stl:2:1: error: a facet has 1 corners"));
        let nan = bytes(&[([[f32::NAN; 3]; 3], 0)], b"");
        assert!(said(&nan).contains("triangle 0 has the coordinate NaN (at byte 84)"));
        let (_, warnings) = read(&[&whole[..], b"xx"].concat()).unwrap();
        assert!(warnings[0].contains("2 bytes behind"));
    }
}
