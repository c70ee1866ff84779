//! Scenes -> RON that one would like to edit: one entity a line, only what differs from the defaults.

use std::fmt::Write;
use std::path::{Component as Part, Path, PathBuf};

use ::ron::ser::PrettyConfig;
use serde::Serialize;

use super::ron::options;
use super::write_assets::OfAssets;
use crate::base::diagnostics::Diagnostic;
use crate::components::*;

/// The scene as RON; file names in it are made relative to `target` if that is another folder than the scene's.
///
/// Of what an asset brings only what differs from it is written.
///
/// # Errors
/// A value that RON cannot hold, which is a mistake of the program.
pub fn to_ron(scene: &Scene, target: Option<&Path>) -> Result<String, Diagnostic> {
    written(scene, target, false)
}

/// As [`to_ron`], with what assets bring as comments that one can let stand.
///
/// # Errors
/// As [`to_ron`].
pub fn to_editable_ron(scene: &Scene, target: Option<&Path>) -> Result<String, Diagnostic> {
    written(scene, target, true)
}

fn written(scene: &Scene, target: Option<&Path>, offers: bool) -> Result<String, Diagnostic> {
    let of_assets = OfAssets::new(scene);
    let rebase = |file: &Text| -> Text {
        match target {
            Some(target) if *target != *scene.base => relative(&scene.base.join(&**file), target).into(),
            _ => file.clone(),
        }
    };
    let mut render = scene.render.clone();
    render.environment = render.environment.as_ref().map(rebase);
    let mut out = String::from("(\n");
    section(&mut out, "camera", &scene.camera, &Camera::default())?;
    if !scene.cameras.is_empty() {
        out.push_str("    cameras: {\n");
        for (name, camera) in &scene.cameras {
            let _ = writeln!(out, "        {}: {},", line(name)?, line(camera)?);
        }
        out.push_str("    },\n");
    }
    section(&mut out, "render", &render, &Render::default())?;
    if !scene.materials.is_empty() {
        out.push_str("    materials: {\n");
        for (name, material) in &scene.materials {
            let is_known = of_assets.is_material(name, material);
            if is_known && !offers {
                continue;
            }
            let mut material = material.clone();
            material.images().for_each(|image| *image = rebase(image));
            let mark = if is_known { "// " } else { "" };
            let _ = writeln!(out, "        {mark}{}: {},", line(name)?, line(&material)?);
        }
        out.push_str("    },\n");
    }
    if !scene.entities.is_empty() {
        out.push_str("    entities: [\n");
        for desc in &scene.entities {
            if let Some(differing) = of_assets.differing(desc) {
                let _ = writeln!(out, "        {},", line(&rebased(&differing, &rebase))?);
            } else if let Some(offered) = of_assets.offered(desc).filter(|_| offers) {
                let _ = writeln!(out, "        // {},", line(&offered)?);
            }
        }
        out.push_str("    ],\n");
    }
    out.push_str(")\n");
    Ok(out)
}

fn section<T: Serialize + PartialEq>(out: &mut String, name: &str, value: &T, default: &T) -> Result<(), Diagnostic> {
    if value != default {
        let _ = writeln!(out, "    {name}: {},", line(value)?);
    }
    Ok(())
}

/// A value on one line, with spaces after commas and colons.
fn line<T: Serialize + ?Sized>(value: &T) -> Result<String, Diagnostic> {
    let config = PrettyConfig::new().depth_limit(0).separate_tuple_members(false).compact_arrays(true);
    // Plain structs of numbers and texts are always writable.
    let failed = |error: ::ron::Error| Diagnostic::bug(format!("a scene cannot be written as RON: {error}"));
    options().to_string_pretty(value, config).map_err(failed)
}

fn rebased<'a>(desc: &'a EntityDesc, rebase: &impl Fn(&Text) -> Text) -> std::borrow::Cow<'a, EntityDesc> {
    let mut desc = std::borrow::Cow::Borrowed(desc);
    if let Some(mesh) = desc.component::<Mesh>()
        && let Some(file) = &mesh.file
    {
        let moved = Mesh { file: Some(rebase(file)), ..mesh.clone() };
        desc.to_mut().put(moved.into());
    }
    if let Some(asset) = desc.component::<Asset>() {
        let moved = Asset { file: rebase(&asset.file), ..asset.clone() };
        desc.to_mut().put(moved.into());
    }
    if let Some(texture) = desc.component::<Texture>() {
        let moved = Texture { image: texture.image.as_ref().map(rebase), ..texture.clone() };
        desc.to_mut().put(moved.into());
    }
    desc
}

/// `file` as seen from `folder`; absolute if the two share no root.
fn relative(file: &Path, folder: &Path) -> String {
    let (file, folder) = (tidy(file), tidy(folder));
    let (from, to): (Vec<Part>, Vec<Part>) = (folder.components().collect(), file.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = &from[shared..];
    if file.is_absolute() != folder.is_absolute() || up.contains(&Part::ParentDir) {
        return std::path::absolute(&file).unwrap_or(file).to_string_lossy().into_owned();
    }
    let path: PathBuf = up.iter().map(|_| Part::ParentDir).chain(to[shared..].iter().copied()).collect();
    path.to_string_lossy().replace('\\', "/")
}

/// The path without `.` and without `x/..`.
fn tidy(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Part::CurDir => {}
            Part::ParentDir if matches!(out.components().next_back(), Some(Part::Normal(_))) => {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_seen_from_elsewhere() {
        let see = |file: &str, folder: &str| relative(Path::new(file), Path::new(folder));
        assert_eq!(see("scenes/a.obj", "scenes"), "a.obj");
        assert_eq!(see("scenes/m/a.obj", "out/x"), "../../scenes/m/a.obj");
        assert_eq!(see("scenes/../a.obj", ""), "a.obj");
        assert_eq!(see("/r/s/a.obj", "/r/t"), "../s/a.obj");
    }
}
