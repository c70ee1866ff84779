//! glTF 2.0, as text (.gltf) or binary (.glb).
//!
//! [`Document`] holds the JSON and the buffers and answers for places; the other files of this room turn what it holds
//! into what a scene is made of: [`mesh`](self) and its shapes, materials, nodes, lights, clips. Nothing that a file
//! declares is believed before the bytes for it are there.

mod accessor;
mod clips;
mod document;
mod extensions;
mod glb;
mod json;
mod lights;
mod material;
mod mesh;
mod meshopt;
mod nodes;
mod warnings;

use rustc_hash::FxHashMap;

use super::asset::AssetFile;
use super::names::Names;
use super::resolve::Problem;
use crate::base::diagnostics::Diagnostics;
use crate::base::project::Folder;
use crate::components::{Component, EntityDesc, Kind, Text};
pub use document::Document;
use material::MaterialReader;
use warnings::Warnings;

/// Reads an asset. `file` is what the scene calls it, relative to `base`, `prefix` what the names of its materials start with, `scene` the
/// name or number of the one scene of the file that is wanted.
///
/// # Errors
/// What is wrong in the file, with its place.
pub fn read(
    base: &Folder,
    file: &str,
    prefix: &str,
    scene: Option<&str>,
) -> Result<(AssetFile, Document), Diagnostics> {
    let document = Document::open(base, file)?;
    let mut warnings = Warnings::default();
    let read = parts(&document, file, prefix, scene, &mut warnings);
    let mut asset = read.map_err(|problem| document.error(problem))?;
    asset.warnings = warnings.into_problems().map(|problem| document.warning(problem)).collect();
    Ok((asset, document))
}

fn parts(
    document: &Document,
    file: &str,
    prefix: &str,
    scene: Option<&str>,
    warnings: &mut Warnings,
) -> Result<AssetFile, Problem> {
    document.check_extensions(warnings)?;
    let mut names = Names::default();
    let mut called = |i: usize, name: &Option<String>| {
        let plain = name.clone().filter(|name| !name.is_empty()).unwrap_or(format!("material{i}"));
        Text::from(format!("{prefix}/{}", names.give(&plain)))
    };
    let all: Vec<Text> = document.root.materials.iter().enumerate().map(|(i, m)| called(i, &m.name)).collect();
    let default = Text::from(format!("{prefix}/{}", names.give("default")));
    let name = |number: Option<usize>| number.map_or(default.clone(), |i| all[i].clone());
    let nodes = document.nodes(scene, &name, warnings)?;
    let clips = document.clips(&|number| document.animated(&nodes, number), warnings)?;
    // Materials that nothing wears are left out, with their pictures.
    let worn = worn(nodes.nodes.iter().map(|node| &node.desc));
    let mut reader = MaterialReader { document, file, warnings };
    let mut materials = Vec::new();
    for (i, name) in all.iter().enumerate().filter(|(_, name)| worn.contains_key(*name)) {
        materials.push((name.clone(), reader.material(i)?));
    }
    if worn.contains_key(&default) {
        materials.push((default, MaterialReader::plain()));
    }
    Ok(AssetFile { nodes: nodes.nodes, materials, clips, warnings: Vec::new() })
}

/// Names of the materials that entities wear.
fn worn<'a>(all: impl Iterator<Item = &'a EntityDesc>) -> FxHashMap<Text, ()> {
    let meshes = all.filter_map(|desc| match desc.get(Kind::Mesh) {
        Some(Component::Mesh(mesh)) => Some(mesh),
        _ => None,
    });
    meshes.flat_map(|mesh| mesh.worn().map(|name| (name.clone(), ()))).collect()
}

#[cfg(test)]
mod tests;
