//! Files -> one resolved scene, with diagnostics; and scenes -> RON.
//!
//! The happy path is one pass: [`ron`] through serde, [`nff`] through its own reader. Then [`resolve`] checks ranges
//! and references as data, and meshes are read. Only when something is wrong is the text looked at again, for the
//! place of every mistake and the word that was meant (`ron::explain`).

pub mod aff;
mod assemble;
pub mod asset;
pub mod gltf;
pub mod golden;
pub mod image;
pub mod measures;
pub mod mesh;
mod names;
pub mod nff;
pub mod resolve;
pub mod ron;
mod sets_asset;
mod show;
pub mod spans;
pub mod write;
mod write_assets;

use std::path::Path;
use std::sync::Arc;

use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, ScenePart, Severity, Subject, nearest};
use crate::base::project::{Access, FileRole, Folder, Project};
use crate::base::{files, limits};
use crate::components::Scene;
pub use aff::AffShow;

/// Endings of the scene files that are read.
pub const EXTENSIONS: [&str; 9] = ["ron", "nff", "p3f", "gltf", "glb", "obj", "ply", "stl", "aff"];

/// The text of a scene in RON, and the way to what a mistake is about.
fn text_and_steps(path: &Path, scene: &Scene, subject: Subject) -> Option<(String, Vec<spans::Step>)> {
    let text = files::read_text(path, limits::SCENE_FILE_BYTES).ok()?;
    let mut steps = match subject.part {
        ScenePart::Camera => vec![resolve::key("camera")],
        ScenePart::Render => vec![resolve::key("render")],
        ScenePart::Material(index) => vec![resolve::key("materials"), resolve::key(&scene.materials.get(index)?.0)],
        ScenePart::Entity(index) => vec![resolve::key("entities"), spans::Step::Index(index)],
    };
    steps.extend(subject.component.into_iter().chain(subject.field).map(resolve::key));
    Some((text, steps))
}

fn is_ron(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron"))
}

/// Where a scene's text says what a mistake is about; the file as a whole where its form does not tell.
pub fn place_of(path: &Path, scene: &Scene, subject: Subject) -> Option<Place> {
    let name = path.to_string_lossy().into_owned();
    if !is_ron(path) {
        return Some(Place::file(name));
    }
    let (text, steps) = text_and_steps(path, scene, subject)?;
    let (start, end) = spans::parse(&text).ok()?.locate(&steps);
    Some(Place::of_span(name, &text, start, end))
}

/// Whether a scene's text gives a field, be it the value that it has by itself.
pub fn is_written(path: &Path, scene: &Scene, subject: Subject) -> bool {
    let written = || {
        let (text, steps) = text_and_steps(path, scene, subject).filter(|_| is_ron(path))?;
        Some(spans::parse(&text).ok()?.has(&steps))
    };
    written().unwrap_or(false)
}

/// Sees to it that an input is of a kind that is read: a script, or a scene.
///
/// # Errors
/// An ending that is neither's, with the nearest that is.
pub fn check_ending(path: &Path) -> Result<(), Diagnostic> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if EXTENSIONS.contains(&ending.as_str()) {
        return Ok(());
    }
    let known: Vec<String> = ["rhai"].iter().chain(&EXTENSIONS).map(|known| format!(".{known}")).collect();
    let help = match (advice(&ending), nearest(&ending, ["rhai"].into_iter().chain(EXTENSIONS))) {
        (Some(advice), _) => advice.to_string(),
        (None, Some(near)) => format!("did you mean `.{near}`? Scripts and scenes end in {}", known.join(", ")),
        (None, None) => format!("scripts and scenes end in {}", known.join(", ")),
    };
    Err(Diagnostic::error(format!("{}: not a scene or script that can be read", path.display())).help(help))
}

/// Reads a scene in its usual project, as [`load_scene_in`].
///
/// # Errors
/// As [`load_scene_in`].
pub fn load_scene(path: &Path, strict: bool) -> Result<(Scene, Diagnostics), Diagnostics> {
    load_scene_in(path, strict, &Project::of(path, &Access::default())?)
}

/// Reads a scene: what it says, and warnings. `strict` turns what a tolerant reader skips into errors. The files that it
/// names are read below the project's root only.
///
/// # Errors
/// Every mistake that was found, each with its place.
pub fn load_scene_in(path: &Path, strict: bool, project: &Arc<Project>) -> Result<(Scene, Diagnostics), Diagnostics> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let base = Folder::around(path, project.clone());
    project.record(path, FileRole::Scene);
    let name = path.to_string_lossy().into_owned();
    match extension.as_str() {
        "ron" => strictly(strict, ron::parse(&files::read_text(path, limits::SCENE_FILE_BYTES)?, &name, &base)?),
        "gltf" | "glb" | "obj" | "ply" | "stl" => strictly(strict, show::load(path, &base)?),
        "aff" => load_aff_in(path, strict, project).map(|(scene, warnings, _)| (scene, warnings)),
        "nff" | "p3f" => nff::parse(&files::read_text(path, limits::SCENE_FILE_BYTES)?, &name, &base, strict),
        _ => {
            let known = EXTENSIONS.map(|e| format!(".{e}")).join(", ");
            let help = advice(&extension).map_or(format!("known: {known}"), str::to_string);
            Err(Diagnostic::error(format!("{name}: not a scene that can be read")).help(help).into())
        }
    }
}

/// As [`load_scene_in`], of a model what it holds alone, without the light and the camera that it is shown with.
///
/// # Errors
/// As [`load_scene_in`].
pub fn load_contents(path: &Path, project: &Arc<Project>) -> Result<(Scene, Diagnostics), Diagnostics> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if asset::EXTENSIONS.contains(&extension.as_str()) {
        return show::contents(path, &Folder::around(path, project.clone()));
    }
    load_scene_in(path, false, project)
}

/// As [`load_scene_in`] for an AFF file, with how it wants to be shown.
///
/// # Errors
/// As [`load_scene_in`].
pub fn load_aff_in(
    path: &Path,
    strict: bool,
    project: &Arc<Project>,
) -> Result<(Scene, Diagnostics, AffShow), Diagnostics> {
    project.record(path, FileRole::Scene);
    let (scene, warnings, show) = show::load_aff(path, &Folder::around(path, project.clone()))?;
    let (scene, warnings) = strictly(strict, (scene, warnings))?;
    Ok((scene, warnings, show))
}

/// With `strict`, what is not used is wrong.
fn strictly(strict: bool, read: (Scene, Diagnostics)) -> Result<(Scene, Diagnostics), Diagnostics> {
    if !strict || read.1.0.is_empty() {
        return Ok(read);
    }
    let refused = |warning| Diagnostic { severity: Severity::Error, ..warning };
    Err(Diagnostics(read.1.0.into_iter().map(refused).collect()))
}

/// What to do about a file of a kind that is known and not read, by its ending.
pub fn advice(extension: &str) -> Option<&'static str> {
    Some(match extension {
        "usd" | "usda" | "usdc" | "usdz" => {
            "OpenUSD is not read: export glTF (.glb), OBJ or PLY from the program that made it (from Blender: File, Export)"
        }
        "abc" => {
            "Alembic is not read: export one OBJ or PLY a frame (frame.0001.obj, ...), which a script chooses from by \
             `mesh.file`"
        }
        "fbx" => {
            "FBX is not read: export glTF (.glb) or OBJ from the program that made it (from Blender: File, Export)"
        }
        "blend" | "max" | "ma" | "mb" | "c4d" | "3dm" | "skp" => {
            "this is a project of a modelling program: export glTF (.glb), OBJ, PLY or STL from it"
        }
        "dae" | "3ds" | "3mf" | "x3d" | "wrl" | "off" | "lwo" | "x" | "vtk" => {
            "this format is not read: convert it to glTF, OBJ or PLY (Blender and MeshLab read it)"
        }
        "step" | "stp" | "iges" | "igs" | "brep" => {
            "solids of CAD programs are not read: export a mesh (STL, OBJ or PLY) from the program that made them"
        }
        _ => return None,
    })
}
