//! Mesh files: OBJ with its material libraries, PLY and STL, each by a reader of its own.
//!
//! A file that several entities use is read once and shared. Materials that a file brings are added to those of the
//! scene, unless the scene has one of that name, which then stands for it.

mod adopt;
mod cursor;
mod frames;
mod obj;
mod ply;
pub mod polygon;
mod source;
mod stl;

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::resolve::{Problem, component_path, key};
use crate::base::diagnostics::Diagnostic;
use crate::base::project::{FileRole, Folder};
use crate::base::{files, limits};
use crate::components::*;
use adopt::Adopted;
pub use frames::MeshFiles;
use frames::{SequencePosition, between};
use source::{Notes, SourceFile};

/// Endings of the mesh files that are read.
const EXTENSIONS: [&str; 3] = ["obj", "ply", "stl"];

/// A mesh file that was read.
pub struct Loaded {
    /// The geometry.
    pub data: MeshData,
    /// Materials that it brings; files that they name are relative to the scene.
    materials: Vec<Brought>,
    /// What of its faces is not used.
    warnings: Vec<Diagnostic>,
    /// What of its materials is not used.
    material_warnings: Vec<Diagnostic>,
}

impl Loaded {
    /// The mesh without materials, and what of it is not used.
    pub fn faces(self) -> (MeshData, Vec<Diagnostic>) {
        let mut data = self.data;
        data.materials.clear();
        (data, self.warnings)
    }
}

/// A material that a file brings.
struct Brought {
    name: Text,
    material: Material,
    /// Maps that may turn out to be of no use, and the warning that says so without its reason.
    maps: Vec<(obj::mtl::Slot, Texture, Diagnostic)>,
}

/// Reads the files of all meshes of a scene; gives what is wrong, and what is not used.
pub fn load_all(scene: &mut Scene) -> (Vec<Problem>, Vec<Diagnostic>) {
    let mut known: FxHashMap<Text, Result<Arc<MeshData>, Diagnostic>> = FxHashMap::default();
    let (mut problems, mut warnings) = (Vec::new(), Vec::new());
    let mut adopted = Adopted::new(scene);
    for index in 0..scene.entities.len() {
        let Some(mesh) = scene.entities[index].component::<Mesh>() else { continue };
        let Some(SequencePosition { file, next }) = SequencePosition::of(mesh) else { continue };
        let path = |field: &str| component_path(index, Kind::Mesh).into_iter().chain([key(field)]).collect();
        if !mesh.data.vertices.is_empty() || !mesh.data.triangles.is_empty() {
            let message = "a mesh comes from a `file` or has `vertices` and `triangles`, not both";
            problems.push(Problem::new(path("file"), message));
            continue;
        }
        let mesh = mesh.clone();
        let mut read = |scene: &mut Scene, file: &Text| {
            let entry = known.entry(file.clone()).or_insert_with(|| {
                let decoded = scene.render.transfer == Transfer::Srgb;
                load(&scene.base, file, decoded).map(|loaded| {
                    warnings.extend_from_slice(&loaded.warnings);
                    Arc::new(adopted.take(scene, file, loaded))
                })
            });
            entry.clone()
        };
        let here = read(scene, &file);
        // A sequence ends with its last file.
        let next = next.and_then(|(next, share)| Some((read(scene, &next).ok()?, share)));
        match here {
            Ok(data) => {
                if mesh.file_materials {
                    warnings.extend(adopted.warnings_of(&file));
                }
                let data = between(&data, next.as_ref().map(|(data, share)| (&**data, *share)));
                let mesh = Mesh { data, ..mesh };
                if let Err(invalid) = mesh.check() {
                    problems.push(Problem::new(path(invalid.field), invalid.message));
                }
                scene.entities[index].put(mesh.into());
            }
            Err(problem) => problems.push(Problem::from_file(path("file"), problem)),
        }
    }
    (problems, warnings)
}

/// Reads one mesh file, named relative to a folder, by its ending; with `decoded` its colours stand for the sRGB curve.
///
/// # Errors
/// What is wrong with the file, at its place in there if it has one.
pub fn load(base: &Folder, file: &str, decoded: bool) -> Result<Loaded, Diagnostic> {
    let path = base.find(file, FileRole::Mesh)?;
    let shown = path.display().to_string();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !EXTENSIONS.contains(&extension.as_str()) {
        let known = EXTENSIONS.map(|e| format!(".{e}")).join(", ");
        let help = super::advice(&extension).map_or(format!("known: {known}"), str::to_string);
        return Err(Diagnostic::error(format!("{shown}: not a mesh that can be read")).help(help));
    }
    let bytes = files::read_bytes(&path, limits::MESH_FILE_BYTES)?;
    let source = SourceFile { file: &shown, bytes: &bytes };
    if bytes.starts_with(b"version https://git-lfs") {
        return Err(source
            .whole("this is a pointer of Git LFS, not the file itself")
            .help("fetch it with `git lfs pull`"));
    }
    let mut notes = Notes::default();
    let (mut materials, mut material_notes) = (Vec::new(), Notes::default());
    let data = match extension.as_str() {
        "obj" => {
            let source = SourceFile { bytes: text_of(source)?, ..source };
            let obj = obj::parse(source, decoded, &mut notes)?;
            materials = adopt::libraries(base, file, source, &obj, &mut material_notes);
            obj.data
        }
        "ply" => {
            let data = ply::parse(source, decoded, &mut notes)?;
            materials = adopt::textures(base, file, source, &data);
            data
        }
        _ => stl::parse(source, decoded, &mut notes)?,
    };
    if data.triangles.is_empty() {
        notes.add("no faces", || source.whole("the mesh has no faces, and shows nothing").into_warning());
    }
    let mesh = Mesh { data: Arc::new(data), ..Mesh::default() };
    mesh.check().map_err(|invalid| source.whole(invalid.message))?;
    let data = Arc::unwrap_or_clone(mesh.data);
    let (warnings, material_warnings) = (notes.into_warnings(), material_notes.into_warnings());
    Ok(Loaded { data, materials, warnings, material_warnings })
}

/// The bytes of a text without a byte order mark.
fn text_of(source: SourceFile<'_>) -> Result<&[u8], Diagnostic> {
    let bytes = source.bytes;
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(source.whole("the file is in UTF-16").help("save it in UTF-8"));
    }
    Ok(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

/// An error where a number was expected.
fn no_number(source: &SourceFile, start: usize, end: usize) -> Diagnostic {
    let word = &source.bytes[start..end];
    let error = source.error(start, end, format!("`{}` is not a number", source.short(start, end)));
    match word.contains(&b',') && word.iter().any(u8::is_ascii_digit) {
        true => error.help("numbers have a point before their decimals, and blanks between them"),
        false => error,
    }
}

#[cfg(test)]
mod tests;
