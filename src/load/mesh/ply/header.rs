//! The header of a PLY file: which elements follow, with which properties, in which encoding.

use crate::base::diagnostics::Diagnostic;
use crate::load::mesh::source::{Notes, SourceFile, decode};

/// How the numbers behind the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlyEncoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &str) -> Option<Scalar> {
        Some(match word {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    pub fn bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// The number that stands for a full share of a colour.
    pub fn full(self) -> f64 {
        match self {
            Scalar::I8 | Scalar::U8 => 255.0,
            Scalar::I16 | Scalar::U16 => 65535.0,
            Scalar::I32 | Scalar::U32 => 4_294_967_295.0,
            Scalar::F32 | Scalar::F64 => 1.0,
        }
    }
}

/// One number of an element, or a list of them.
#[derive(Clone, Debug)]
pub struct Property {
    pub name: String,
    pub scalar: Scalar,
    /// Type of the length, of a list.
    pub length: Option<Scalar>,
    /// Where it is declared.
    pub span: [usize; 2],
}

#[derive(Clone, Debug)]
pub struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    pub span: [usize; 2],
}

pub struct PlyHeader {
    pub encoding: PlyEncoding,
    pub elements: Vec<Element>,
    /// Files of textures that comments name.
    pub textures: Vec<String>,
    /// Where what follows begins.
    pub end: usize,
}

/// Lines of a header; the first one says how they end.
struct Lines<'a> {
    source: SourceFile<'a>,
    at: usize,
    /// What ends them: the byte, and whether the other one follows.
    ends: Option<(u8, bool)>,
}

impl Lines<'_> {
    /// The next line that is not blank: its words, and where it stands.
    fn next(&mut self) -> Option<(Vec<String>, [usize; 2])> {
        loop {
            let bytes = self.source.bytes;
            let start = self.at;
            let is_end = |b: &u8| match self.ends {
                Some((end, _)) => *b == end,
                None => matches!(b, b'\n' | b'\r'),
            };
            let end = bytes.get(start..)?.iter().position(is_end).map(|i| start + i)?;
            if bytes[start..end].trim_ascii().is_empty() && self.ends.is_none() {
                self.at = end + 1;
                continue;
            }
            let (byte, pair) = *self.ends.get_or_insert_with(|| {
                let pair = bytes[end] == b'\r' && bytes.get(end + 1) == Some(&b'\n');
                (bytes[end], pair)
            });
            self.at = end + 1;
            if pair && byte == b'\r' && bytes.get(self.at) == Some(&b'\n') {
                self.at += 1;
            }
            let line = bytes[start..end].trim_ascii_end();
            if !line.trim_ascii().is_empty() {
                let words = decode(line).split_whitespace().map(str::to_string).collect();
                return Some((words, [start, start + line.len()]));
            }
        }
    }
}

/// Reads the header.
///
/// # Errors
/// What is no header, at its place.
pub fn read(source: SourceFile, notes: &mut Notes) -> Result<PlyHeader, Diagnostic> {
    let mut lines = Lines { source, at: 0, ends: None };
    let is_ply = |words: &[String]| words.first().is_some_and(|word| word.trim_start_matches('\u{feff}') == "ply");
    if !lines.next().is_some_and(|(words, _)| is_ply(&words)) {
        return Err(source.whole("this is no PLY file: it does not start with `ply`"));
    }
    let mut header = PlyHeader { encoding: PlyEncoding::Ascii, elements: Vec::new(), textures: Vec::new(), end: 0 };
    let mut has_format = false;
    loop {
        let Some((words, [start, end])) = lines.next() else {
            return Err(source.whole("the file ends before `end_header`"));
        };
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let wrong = |message: &str| Err(source.error(start, end, message));
        match words[..] {
            ["end_header", ..] => break,
            ["comment" | "obj_info", "TextureFile", ..] => {
                let line = decode(&source.bytes[start..end]);
                let name = line.split_once("TextureFile").map_or("", |(_, name)| name.trim());
                header.textures.push(name.to_string());
            }
            ["comment" | "obj_info", ..] => {}
            ["format", kind, ..] => {
                has_format = true;
                header.encoding = match kind {
                    "ascii" => PlyEncoding::Ascii,
                    "binary_little_endian" => PlyEncoding::LittleEndian,
                    "binary_big_endian" => PlyEncoding::BigEndian,
                    _ => return wrong("the format is `ascii`, `binary_little_endian` or `binary_big_endian`"),
                };
            }
            ["element", name, count] => {
                let Ok(count) = count.parse::<usize>() else { return wrong("this is no count of elements") };
                let (name, properties) = (name.to_string(), Vec::new());
                header.elements.push(Element { name, count, properties, span: [start, end] });
            }
            ["property", ref rest @ ..] => {
                let Some(property) = property(rest, [start, end]) else {
                    return wrong("a property is written `property TYPE NAME` or `property list TYPE TYPE NAME`");
                };
                match header.elements.last_mut() {
                    Some(element) => element.properties.push(property),
                    None => return wrong("a property before any element"),
                }
            }
            // A comment that lost its word, perhaps; not what was meant for an element and is misspelt.
            _ if header.elements.is_empty() => notes.add("header", || {
                source.error(start, end, "this line is none of a PLY header; it is skipped").into_warning()
            }),
            _ => return wrong("this line is none of a PLY header"),
        }
    }
    if !has_format {
        return Err(source.whole("the header has no `format`"));
    }
    header.end = lines.at;
    for element in &header.elements {
        plausible(source, element, header.encoding)?;
    }
    Ok(header)
}

fn property(words: &[&str], span: [usize; 2]) -> Option<Property> {
    match *words {
        ["list", length, scalar, name] => {
            let (length, scalar) = (Some(Scalar::parse(length)?), Scalar::parse(scalar)?);
            Some(Property { name: name.to_string(), scalar, length, span })
        }
        [scalar, name] => Some(Property { name: name.to_string(), scalar: Scalar::parse(scalar)?, length: None, span }),
        _ => None,
    }
}

/// A declared count is believed only if the file has room for it.
fn plausible(source: SourceFile, element: &Element, encoding: PlyEncoding) -> Result<(), Diagnostic> {
    let least = |property: &Property| match encoding {
        PlyEncoding::Ascii => 2,
        _ => property.length.unwrap_or(property.scalar).bytes(),
    };
    let row = element.properties.iter().map(least).sum::<usize>().max(1);
    let bytes = source.bytes.len();
    if element.count > bytes.div_ceil(row) {
        let [start, end] = element.span;
        let message = format!("declares {} elements `{}`, but has only {bytes} bytes", element.count, element.name);
        return Err(source.error(start, end, message));
    }
    Ok(())
}
