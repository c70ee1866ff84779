//! A glTF file that is open: its JSON, its buffers, and where in it something is wrong.
//!
//! Own reader over `serde_json`: the `gltf` crate refuses valid files (required extensions that it does not know,
//! attributes of one's own, accessors without a buffer view) and does not know compressed or instanced meshes.

use std::borrow::Cow;
use std::cell::Cell;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde::Deserialize;

use super::glb::chunks;
use super::json::{Index, RootJson, VersionJson, ViewJson, extension};
use super::meshopt::{self, MeshoptFilter, MeshoptMode};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place};
use crate::base::project::{FileRole, Folder};
use crate::base::{files, limits};
use crate::load::resolve::{Problem, key};
use crate::load::spans::{self, Step};

/// A glTF file with its buffers.
pub struct Document {
    /// What diagnostics call it.
    name: String,
    base: Folder,
    /// Folder that its files are relative to, as seen from `base`.
    inner: PathBuf,
    /// The whole of its JSON.
    pub root: RootJson,
    /// The JSON, for the places of mistakes in a file that a person can open; `None` for a .glb.
    text: Option<String>,
    buffers: Vec<BufferBytes>,
    /// Views that had to be decompressed.
    views: Vec<OnceLock<Vec<u8>>>,
    /// Numbers that accessors were read as so far.
    read: Cell<u64>,
}

enum BufferBytes {
    /// Of nothing that is there: a placeholder whose views are stored elsewhere.
    Missing,
    Here(Vec<u8>),
}

/// A path into the JSON: one of the file's lists and a number in it.
pub fn at(list: &str, index: usize) -> Vec<Step> {
    vec![key(list), Step::Index(index)]
}

/// A longer path: with a field.
pub fn field(mut path: Vec<Step>, name: &str) -> Vec<Step> {
    path.push(key(name));
    path
}

/// A longer path: with a number.
pub fn item(mut path: Vec<Step>, index: usize) -> Vec<Step> {
    path.push(Step::Index(index));
    path
}

/// A path as one would write it.
fn shown(path: &[Step]) -> String {
    let mut out = String::new();
    for step in path {
        match step {
            Step::Key(name) if out.is_empty() => out.push_str(name),
            Step::Key(name) => {
                out.push('.');
                out.push_str(name);
            }
            Step::Index(i) => out.push_str(&format!("[{i}]")),
        }
    }
    out
}

impl Document {
    /// Opens a .gltf or .glb that is named relative to a folder, and reads its buffers.
    ///
    /// # Errors
    /// A file that cannot be read, that is no glTF 2.0, or a buffer that is missing or too short.
    pub fn open(base: &Folder, file: &str) -> Result<Document, Diagnostics> {
        let path = base.find(file, FileRole::Mesh)?;
        let bytes = files::read_bytes(&path, limits::MESH_FILE_BYTES)?;
        let inner = Path::new(file).parent().unwrap_or(Path::new("")).to_path_buf();
        Document::of_bytes(bytes, path.to_string_lossy().into_owned(), base.clone(), inner)
    }

    /// As [`Self::open`], from bytes.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn of_bytes(mut bytes: Vec<u8>, name: String, base: Folder, inner: PathBuf) -> Result<Document, Diagnostics> {
        let binary = bytes.starts_with(b"glTF");
        let (json, chunk) = if binary { chunks(&bytes).map_err(|e| whole(&name, e))? } else { (0..bytes.len(), None) };
        let text = text(&bytes[json], &name)?;
        let root = parse(&text, &name, binary)?;
        let chunk = chunk.map(|range: Range<usize>| {
            bytes.truncate(range.end);
            bytes.split_off(range.start)
        });
        let views = root.buffer_views.iter().map(|_| OnceLock::new()).collect();
        let text = (!binary).then_some(text);
        let read = Cell::new(0);
        let mut document = Document { name, base, inner, root, text, buffers: Vec::new(), views, read };
        document.check_version().map_err(|p| document.error(p))?;
        document.load_buffers(chunk).map_err(|p| document.error(p))?;
        Ok(document)
    }

    fn check_version(&self) -> Result<(), Problem> {
        let version = &self.root.asset.version;
        let wanted = self.root.asset.min_version.as_ref().unwrap_or(version);
        if version.starts_with("2.") && wanted.starts_with("2.") {
            return Ok(());
        }
        let path = vec![key("asset"), key("version")];
        let message = if version.is_empty() {
            "this is no glTF: it has no `asset` with a `version`".to_string()
        } else {
            format!("glTF {wanted} is not read; version 2.0 is")
        };
        Err(Problem::new(path, message).help(Some("export it again as glTF 2.0".into())))
    }

    fn load_buffers(&mut self, mut chunk: Option<Vec<u8>>) -> Result<(), Problem> {
        for i in 0..self.root.buffers.len() {
            let buffer = &self.root.buffers[i];
            let bytes = match &buffer.uri {
                Some(uri) => {
                    let path = field(at("buffers", i), "uri");
                    BufferBytes::Here(
                        self.fetch(uri).map_err(|(message, help)| Problem::new(path, message).help(help))?,
                    )
                }
                None => match chunk.take().filter(|_| i == 0) {
                    Some(bytes) => BufferBytes::Here(bytes),
                    None => BufferBytes::Missing,
                },
            };
            if let BufferBytes::Here(bytes) = &bytes
                && bytes.len() < buffer.byte_length.0
            {
                let message =
                    format!("the buffer has {} bytes of the {} it declares", bytes.len(), buffer.byte_length.0);
                return Err(Problem::new(at("buffers", i), message));
            }
            self.buffers.push(bytes);
        }
        Ok(())
    }

    /// What a URI stands for: base64 in the file itself, or a file beside it.
    fn fetch(&self, uri: &str) -> Result<Vec<u8>, (String, Option<String>)> {
        if let Some(data) = uri.strip_prefix("data:") {
            return data_uri(data).ok_or(("a data URI that is not base64".into(), None));
        }
        let named = self.inner.join(relative(uri)?);
        let path = self.base.find(&named.to_string_lossy(), FileRole::Mesh);
        path.and_then(|path| files::read_bytes(&path, limits::MESH_FILE_BYTES)).map_err(|e| (e.message, e.help))
    }

    /// The bytes of an image that is in the file.
    ///
    /// # Errors
    /// An image that is not there or has no data here.
    pub fn image(&self, index: usize) -> Result<Vec<u8>, Diagnostics> {
        let read = || {
            let path = at("images", index);
            let Some(image) = self.root.images.get(index) else {
                return Err(Problem::new(
                    path,
                    format!("there is no image {index}; there are {}", self.root.images.len()),
                ));
            };
            match (&image.uri, image.buffer_view) {
                (Some(uri), _) => {
                    self.fetch(uri).map_err(|(message, help)| Problem::new(field(path, "uri"), message).help(help))
                }
                (None, Some(view)) => self.view(view.0).map(|(bytes, _)| bytes.to_vec()),
                (None, None) => Err(Problem::new(path, "an image has a `uri` or a `bufferView`")),
            }
        };
        read().map_err(|problem| self.error(problem))
    }

    /// The bytes of a buffer view as they stand.
    fn stored(&self, buffer: Index, offset: Index, length: Index, path: &[Step]) -> Result<&[u8], Problem> {
        let fail = |message: String| Problem::new(path.to_vec(), message);
        let Some(bytes) = self.buffers.get(buffer.0) else {
            return Err(fail(format!("there is no buffer {}; there are {}", buffer.0, self.buffers.len())));
        };
        let BufferBytes::Here(bytes) = bytes else {
            return Err(fail(format!("buffer {} has no data", buffer.0)));
        };
        let end = offset.0.checked_add(length.0);
        end.and_then(|end| bytes.get(offset.0..end)).ok_or_else(|| {
            fail(format!(
                "bytes {} to {} lie outside of buffer {} of {}",
                offset.0,
                offset.0 as u128 + length.0 as u128,
                buffer.0,
                bytes.len()
            ))
        })
    }

    /// The bytes of a buffer view, decompressed, and its stride if it has one.
    ///
    /// # Errors
    /// A view that does not exist, lies outside of its buffer, or cannot be decompressed.
    pub fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), Problem> {
        let path = at("bufferViews", index);
        let Some(view) = self.root.buffer_views.get(index) else {
            let count = self.root.buffer_views.len();
            return Err(Problem::new(path, format!("there is no buffer view {index}; there are {count}")));
        };
        let stride = view.byte_stride.map(|s| s.0);
        if let Some(compressed) = compressed(view).map_err(|m| Problem::new(path.clone(), m))? {
            if let Some(bytes) = self.views[index].get() {
                return Ok((bytes, stride));
            }
            let Compressed { buffer, byte_offset, byte_length, byte_stride, count, mode, filter } = compressed;
            let data = self.stored(buffer, byte_offset, byte_length, &path)?;
            let bytes = meshopt::decode(data, count.0, byte_stride.0, mode, filter);
            let bytes = bytes.map_err(|message| Problem::new(path, message))?;
            return Ok((self.views[index].get_or_init(|| bytes), stride));
        }
        self.stored(view.buffer, view.byte_offset, view.byte_length, &path).map(|bytes| (bytes, stride))
    }

    /// Counts numbers that are about to be read: a file may name the same ones again and again.
    pub(super) fn account(&self, numbers: usize, path: &[Step]) -> Result<(), Problem> {
        let read = self.read.get().saturating_add(numbers as u64);
        self.read.set(read);
        if read <= limits::ASSET_NUMBERS {
            return Ok(());
        }
        let message = format!("its accessors are read as more than {} numbers in all", limits::ASSET_NUMBERS);
        Err(Problem::new(path.to_vec(), message))
    }

    /// The problem with its place in the file.
    pub fn error(&self, problem: Problem) -> Diagnostics {
        self.placed(problem).into()
    }

    /// The problem as a warning with its place.
    pub fn warning(&self, problem: Problem) -> Diagnostic {
        Diagnostic { severity: crate::base::diagnostics::Severity::Warning, ..self.placed(problem) }
    }

    fn placed(&self, problem: Problem) -> Diagnostic {
        let path = problem.path.clone();
        let tree = self.text.as_deref().and_then(|text| Some((text, spans::parse(text).ok()?)));
        if let Some((text, tree)) = tree {
            let (start, end) = tree.locate(&path);
            return problem.diagnostic().at(Place::of_span(self.name.as_str(), text, start, end));
        }
        let lead = if path.is_empty() { String::new() } else { format!("{}: ", shown(&path)) };
        let problem = Problem { message: format!("{lead}{}", problem.message), ..problem };
        problem.diagnostic().at(Place::file(self.name.as_str()))
    }
}

/// The path of a file that a glTF names, relative to its folder.
///
/// # Errors
/// An address that is none: nothing is fetched from elsewhere.
pub fn relative(uri: &str) -> Result<String, (String, Option<String>)> {
    let relative = decoded(uri);
    let scheme = relative.find(':').is_some_and(|i| i > 1 && !relative[..i].contains(['/', '.']));
    if scheme || relative.starts_with('/') || relative.is_empty() {
        let shown: String = uri.chars().take(60).collect();
        let message = format!("`{shown}` is not a file beside the glTF");
        return Err((message, Some("only files relative to it and data in it are read".into())));
    }
    Ok(relative.into_owned())
}

fn whole(name: &str, message: String) -> Diagnostics {
    Diagnostic::error(message).at(Place::file(name)).into()
}

/// The text of the JSON, without a mark of its encoding before it.
fn text(bytes: &[u8], name: &str) -> Result<String, Diagnostics> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_string()),
        Err(_) => Err(whole(name, "the JSON of a glTF must be UTF-8, and this is not".into())),
    }
}

fn parse(text: &str, name: &str, binary: bool) -> Result<RootJson, Diagnostics> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let read = RootJson::deserialize(&mut reader).and_then(|root| reader.end().map(|()| root));
    read.or_else(|e| {
        // Files of another version have another form; of what version they are is judged later.
        let asset = serde_json::from_str::<VersionJson>(text).unwrap_or_default().asset;
        let is_other = !asset.version.is_empty() && !asset.version.starts_with("2.");
        if is_other { Ok(RootJson { asset, ..RootJson::default() }) } else { Err(e) }
    })
    .map_err(|e| {
        let said = e.to_string();
        let message = said.split(" at line ").next().unwrap_or(&said).to_string();
        if binary || e.line() == 0 {
            return whole(name, format!("the JSON of this glTF is wrong: {message}"));
        }
        Diagnostic::error(message).at(Place::of_position(name, text, e.line() as u32, e.column().max(1) as u32)).into()
    })
}

/// Where compressed data of a view are, and how they are to be read.
struct Compressed {
    buffer: Index,
    byte_offset: Index,
    byte_length: Index,
    byte_stride: Index,
    count: Index,
    mode: MeshoptMode,
    filter: MeshoptFilter,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct CompressedJson {
    buffer: Index,
    byte_offset: Index,
    byte_length: Index,
    byte_stride: Index,
    count: Index,
    mode: String,
    filter: Option<String>,
}

/// Names of the one extension that compresses views: as a vendor's, and as ratified later.
pub const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

fn compressed(view: &ViewJson) -> Result<Option<Compressed>, String> {
    let mut json = None;
    for name in MESHOPT {
        json = json.or(extension::<CompressedJson>(&view.extensions, name)?);
    }
    let Some(CompressedJson { buffer, byte_offset, byte_length, byte_stride, count, mode, filter }) = json else {
        return Ok(None);
    };
    let mode = match mode.as_str() {
        "ATTRIBUTES" => MeshoptMode::Attributes,
        "TRIANGLES" => MeshoptMode::Triangles,
        "INDICES" => MeshoptMode::Indices,
        other => return Err(format!("unknown mode `{other}` of a compressed view")),
    };
    let filter = match filter.as_deref().unwrap_or("NONE") {
        "NONE" => MeshoptFilter::None,
        "OCTAHEDRAL" => MeshoptFilter::Octahedral,
        "QUATERNION" => MeshoptFilter::Quaternion,
        "EXPONENTIAL" => MeshoptFilter::Exponential,
        other => return Err(format!("unknown filter `{other}` of a compressed view")),
    };
    Ok(Some(Compressed { buffer, byte_offset, byte_length, byte_stride, count, mode, filter }))
}

/// The bytes of a data URI, from behind `data:`; `None` if they are not in base64.
pub fn data_uri(uri: &str) -> Option<Vec<u8>> {
    let (kind, data) = uri.split_once(',')?;
    kind.ends_with(";base64").then(|| base64(data)).flatten()
}

fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0);
    for byte in decoded(text).bytes() {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b'\n' | b'\r' | b' ' => continue,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    Some(out)
}

/// A URI without its percent signs.
fn decoded(uri: &str) -> Cow<'_, str> {
    if !uri.contains('%') {
        return Cow::Borrowed(uri);
    }
    let bytes = uri.as_bytes();
    let (mut out, mut i) = (Vec::with_capacity(bytes.len()), 0);
    while i < bytes.len() {
        let pair = bytes.get(i + 1..i + 3).and_then(|pair| std::str::from_utf8(pair).ok());
        match pair.filter(|_| bytes[i] == b'%').and_then(|pair| u8::from_str_radix(pair, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                i += 3;
            }
            None => {
                out.push(bytes[i]);
                i += 1;
            }
        }
    }
    Cow::Owned(String::from_utf8_lossy(&out).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(bytes: impl AsRef<[u8]>) -> Result<Document, String> {
        Document::of_bytes(bytes.as_ref().to_vec(), "a.gltf".into(), Folder::default(), PathBuf::new())
            .map_err(|e| e.to_string())
    }

    fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
        let mut out = b"glTF\x02\0\0\0".to_vec();
        let padded = |n: usize| n.next_multiple_of(4);
        out.extend(((12 + 8 + padded(json.len()) + 8 + padded(binary.len())) as u32).to_le_bytes());
        out.extend((padded(json.len()) as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(json.bytes());
        out.resize(out.len().next_multiple_of(4), b' ');
        out.extend((padded(binary.len()) as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(binary);
        out.resize(out.len().next_multiple_of(4), 0);
        out
    }

    const VIEW: &str = r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 3}],
        "bufferViews": [{"buffer": 0, "byteOffset": 1, "byteLength": 2}, {"buffer": 0, "byteLength": 9}]}"#;

    #[test]
    fn a_binary_file_holds_its_buffer() {
        let bytes = glb(VIEW, &[7, 8, 9]);
        let document = open(&bytes).unwrap();
        assert_eq!(document.view(0).unwrap(), (&[8, 9][..], None));
        let said = |i| document.error(document.view(i).unwrap_err()).to_string();
        assert!(said(1).contains("bufferViews[1]: bytes 0 to 9 lie outside of buffer 0"), "{}", said(1));
        assert!(said(5).contains("there is no buffer view 5"));
        for cut in 0..bytes.len() {
            assert!(open(&bytes[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn a_text_file_says_where_it_is_wrong() {
        let said = open("{\"asset\": {\"version\": \"2.0\"},\n \"nodes\": [{\"mesh\": \"x\"}]}").err().unwrap();
        assert!(said.contains("a.gltf:2:") && said.contains("a whole number"), "{said}");
        let said = open("{\"asset\": {\"version\": \"1.0\"}}").err().unwrap();
        assert!(said.contains("a.gltf:1:23") && said.contains("glTF 1.0 is not read"), "{said}");
        assert!(open("{}").err().unwrap().contains("no glTF"));
        assert!(open("[1").is_err() && open("").is_err() && open(b"\xff\xfe{").is_err());
        assert!(open("\u{feff}{\"asset\": {\"version\": \"2.0\"}}").is_ok());
        let short = VIEW.replace("\"byteLength\": 3", "\"byteLength\": 3, \"uri\": \"data:x;base64,AQI=\"");
        assert!(open(&short).err().unwrap().contains("2 bytes of the 3"));
        let elsewhere = VIEW.replace("\"byteLength\": 3", "\"byteLength\": 3, \"uri\": \"https://x.org/a.bin\"");
        assert!(open(&elsewhere).err().unwrap().contains("not a file beside"));
    }

    #[test]
    fn data_uris_and_percent_signs_are_decoded() {
        assert_eq!(data_uri("application/octet-stream;base64,AQIDBA==").unwrap(), [1, 2, 3, 4]);
        assert_eq!(data_uri(";base64,_-8%3D").unwrap(), [0xff, 0xef]);
        assert!(data_uri("text/plain,hello").is_none() && data_uri(";base64,A*").is_none());
        assert_eq!(decoded("my%20wood%2.png%"), "my wood%2.png%");
    }
}
