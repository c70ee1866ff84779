//! Assets: files that hold entities, and how a scene takes them in.
//!
//! The nodes of an asset become entities behind those of the scene, its materials materials behind those of the scene.
//! What the scene writes under such a name stands, so that a scene can change whatever it likes of an asset.

use std::path::Path;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::resolve::{Problem, component_path, key};
use super::spans::Step;
use super::{aff, gltf, sets_asset};
use crate::base::diagnostics::{Diagnostic, Diagnostics, suggestion};
use crate::base::digest::Hasher;
use crate::base::limits;
use crate::components::*;

/// Endings of the files that hold entities.
pub const EXTENSIONS: [&str; 4] = ["gltf", "glb", "obj", "aff"];

/// What an asset file holds.
pub struct AssetFile {
    /// Parents before their children.
    pub nodes: Vec<AssetNode>,
    /// Under the names that they have in a scene.
    pub materials: Vec<(Text, Material)>,
    /// What moves its nodes, in the order of the file.
    pub clips: Vec<Clip>,
    /// What of the file is not used.
    pub warnings: Vec<Diagnostic>,
}

/// What came of the assets of a scene.
#[derive(Default)]
pub struct Expanded {
    /// What is wrong in the scene's own text.
    pub problems: Vec<Problem>,
    /// What is wrong in the files, and what of them is not used.
    pub found: Diagnostics,
    /// Files that hold pictures, open until those are read.
    pub documents: FxHashMap<Text, gltf::Document>,
}

/// A file that was read: its entities, shared by all who use it.
struct KnownAsset {
    data: Arc<AssetData>,
    prefix: String,
}

/// Puts the entities and materials of all assets into a scene.
pub fn expand(scene: &mut Scene) -> Expanded {
    let mut out = Expanded::default();
    let mut known: FxHashMap<(Text, Option<Text>), Option<Arc<KnownAsset>>> = FxHashMap::default();
    let mut prefixes: FxHashMap<String, Text> = FxHashMap::default();
    let authored = scene.entities.len();
    for index in 0..authored {
        let Some(Component::Asset(asset)) = scene.entities[index].get(Kind::Asset) else { continue };
        if asset.check().is_err() {
            // The scene's own check says so.
            continue;
        }
        let asset = asset.clone();
        let prefix = prefix_of(&asset.file, &mut prefixes);
        let read = known
            .entry((asset.file.clone(), asset.scene.clone()))
            .or_insert_with(|| open(scene, index, &asset, prefix, &mut out));
        if let Some(file) = read.clone() {
            take_in(scene, (index, authored), asset, &file, &mut out.problems);
        }
    }
    out
}

/// What the names of a file's materials start with: its own name without its ending, or all of its path where another
/// file has that name.
fn prefix_of(file: &Text, taken: &mut FxHashMap<String, Text>) -> String {
    let path = Path::new(&**file);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let whole = path.with_extension("").to_string_lossy().replace('\\', "/");
    let free = |word: &String| taken.get(word).is_none_or(|owner| owner == file);
    let prefix = [stem, whole].into_iter().find(free).unwrap_or_else(|| file.to_string());
    taken.insert(prefix.clone(), file.clone());
    prefix
}

fn open(scene: &mut Scene, index: usize, asset: &Asset, prefix: String, out: &mut Expanded) -> Option<Arc<KnownAsset>> {
    let place = |field: &str| component_path(index, Kind::Asset).into_iter().chain([key(field)]).collect::<Vec<Step>>();
    let extension = Path::new(&*asset.file).extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !EXTENSIONS.contains(&extension.as_str()) {
        let known = EXTENSIONS.map(|e| format!(".{e}")).join(", ");
        let message = format!("{}: not an asset that can be read", asset.file);
        out.problems.push(Problem::new(place("file"), message).help(Some(format!("known: {known}"))));
        return None;
    }
    let read = match extension.as_str() {
        "aff" => aff::read(&scene.base, &asset.file, &prefix).map(|(file, _)| (file, None)),
        "obj" => match sets_asset::read(&scene.base, &asset.file, place("file")) {
            Ok(file) => Ok((file, None)),
            Err(problem) => {
                out.problems.push(problem);
                return None;
            }
        },
        _ => gltf::read(&scene.base, &asset.file, &prefix, asset.scene.as_deref())
            .map(|(file, document)| (file, Some(document))),
    };
    match read {
        Ok((file, document)) => {
            let AssetFile { nodes, materials, clips, warnings } = file;
            out.found.0.extend(warnings);
            out.documents.extend(document.map(|document| (asset.file.clone(), document)));
            adopt(scene, &materials);
            let digest = digest(&nodes, &clips, &materials);
            Some(Arc::new(KnownAsset { data: Arc::new(AssetData { digest, nodes, clips, materials }), prefix }))
        }
        Err(mut wrong) => {
            // A file that is not there is the scene's mistake.
            match wrong.0.first() {
                Some(first) if first.place.is_none() && wrong.0.len() == 1 => {
                    let Diagnostic { message, help, .. } = wrong.0.remove(0);
                    out.problems.push(Problem::new(place("file"), message).help(help));
                }
                _ => out.found.0.extend(wrong.0),
            }
            None
        }
    }
}

/// Adds the materials that the scene does not write itself.
fn adopt(scene: &mut Scene, materials: &[(Text, Material)]) {
    let own: FxHashSet<Text> = scene.materials.iter().map(|(name, _)| name.clone()).collect();
    scene.materials.extend(materials.iter().filter(|(name, _)| !own.contains(name)).cloned());
}

fn digest(nodes: &[AssetNode], clips: &[Clip], materials: &[(Text, Material)]) -> crate::base::digest::Digest {
    let mut hasher = Hasher::default();
    for node in nodes {
        hasher.text(&node.name);
        hasher.word(node.parent.map_or(u64::MAX, |parent| parent as u64));
        for component in node.desc.components() {
            content::feed_component(component, |_| true, &mut hasher, &mut |_, _| {});
        }
    }
    clips.iter().for_each(|clip| clip.feed(&mut hasher));
    for (name, material) in materials {
        hasher.text(name);
        content::feed_record(material, |_, _| true, &mut hasher, &mut |_, _| {});
    }
    hasher.finish()
}

/// Puts the nodes of an asset below its entity, which is the one of number `index`.
fn take_in(
    scene: &mut Scene,
    (index, authored): (usize, usize),
    asset: Asset,
    file: &KnownAsset,
    problems: &mut Vec<Problem>,
) {
    let name = match scene.entities[index].name.clone() {
        Some(name) => name,
        None => {
            // Its nodes need a name to stand below.
            let stem = Path::new(&*asset.file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let taken: FxHashSet<&str> = scene.entities.iter().filter_map(|desc| desc.name.as_deref()).collect();
            let numbers = (2..).map(|n| format!("{stem}.{n}"));
            let name = std::iter::once(stem.clone()).chain(numbers).find(|name| !taken.contains(name.as_str()));
            Text::from(name.unwrap_or(stem))
        }
    };
    scene.entities[index].name = Some(name.clone());
    let left_out = left_out(&asset, index, file, problems);
    let own: FxHashMap<Text, usize> = scene.entities[..authored]
        .iter()
        .enumerate()
        .filter_map(|(i, desc)| Some((desc.name.clone().filter(|own| is_below(own, &name))?, i)))
        .collect();
    if scene.entities.len() + file.data.nodes.len() > limits::ENTITIES {
        let message = format!("more than {} entities", limits::ENTITIES);
        return problems.push(Problem::new(component_path(index, Kind::Asset), message));
    }
    let full = |node: &AssetNode| Text::from(format!("{name}/{}", node.name));
    let mut met: FxHashSet<usize> = FxHashSet::default();
    for (i, node) in file.data.nodes.iter().enumerate() {
        let called = full(node);
        let mine = own.get(&called).copied();
        met.extend(mine);
        if left_out.contains(&i) {
            continue;
        }
        let parent = node.parent.map_or(name.clone(), |parent| full(&file.data.nodes[parent]));
        let desc = below(&node.desc, &name, parent);
        match mine {
            Some(mine) => merge(&mut scene.entities[mine], desc),
            None => scene.entities.push(desc.named(called)),
        }
    }
    for (called, i) in own.iter().filter(|(_, i)| !met.contains(i)) {
        let known: Vec<Text> = file.data.nodes.iter().map(full).collect();
        let message = format!("`{}` has no node for `{called}`", asset.file);
        let help = suggestion(called, known.iter().map(|name| &**name));
        problems.push(Problem::new(vec![key("entities"), Step::Index(*i), key("name")], message).help(help));
    }
    let strays = scene.materials.iter().filter(|(called, _)| is_below(called, &file.prefix));
    for (called, _) in strays.filter(|(called, _)| !file.data.materials.iter().any(|(known, _)| known == called)) {
        let message = format!("`{}` has no material for `{called}`", asset.file);
        let help = suggestion(called, file.data.materials.iter().map(|(name, _)| &**name));
        problems.push(Problem::new(vec![key("materials"), key(called)], message).help(help));
    }
    scene.entities[index].put(Asset { data: file.data.clone(), ..asset }.into());
}

/// Whether a name is one of what stands below another.
fn is_below(name: &str, above: &str) -> bool {
    name.strip_prefix(above).is_some_and(|rest| rest.len() > 1 && rest.starts_with('/'))
}

/// Numbers of the nodes that an entity does without.
fn left_out(asset: &Asset, index: usize, file: &KnownAsset, problems: &mut Vec<Problem>) -> FxHashSet<usize> {
    let nodes = &file.data.nodes;
    for (i, name) in asset.without.iter().enumerate() {
        if !nodes.iter().any(|node| node.name == *name) {
            let path = component_path(index, Kind::Asset).into_iter().chain([key("without"), Step::Index(i)]).collect();
            let help = suggestion(name, nodes.iter().map(|node| &*node.name));
            problems.push(Problem::new(path, format!("`{}` has no node `{name}`", asset.file)).help(help));
        }
    }
    let mut out = FxHashSet::default();
    for (i, node) in nodes.iter().enumerate() {
        if asset.without.contains(&node.name) || node.parent.is_some_and(|parent| out.contains(&parent)) {
            out.insert(i);
        }
    }
    out
}

/// A node as an entity below the one that is called `name`.
pub(super) fn below(desc: &EntityDesc, name: &Text, parent: Text) -> EntityDesc {
    let mut desc = desc.clone();
    let transform = match desc.take(Kind::Transform) {
        Some(Component::Transform(transform)) => transform,
        _ => Transform::default(),
    };
    desc.put(Transform { parent: Some(parent), ..transform }.into());
    if let Some(Component::Skin(skin)) = desc.take(Kind::Skin) {
        let joints = skin.joints.iter().map(|joint| format!("{name}/{joint}").into()).collect();
        desc.put(Skin { joints, ..skin }.into());
    }
    desc
}

/// Adds to an entity of the scene what it does not say itself.
fn merge(own: &mut EntityDesc, node: EntityDesc) {
    // Who chooses a material for a node means all of its mesh.
    let recolored = own.get(Kind::MaterialName).is_some();
    for component in node.into_components() {
        let kind = component.kind();
        match (own.take(kind), component) {
            (None, Component::Mesh(mesh)) => {
                own.put(Mesh { file_materials: mesh.file_materials && !recolored, ..mesh }.into());
            }
            (None, component) => own.put(component),
            (Some(Component::Transform(mine)), Component::Transform(theirs)) => {
                own.put(Transform { parent: mine.parent.or(theirs.parent), ..mine }.into());
            }
            (Some(Component::Skin(mine)), Component::Skin(theirs)) => {
                let joints = if mine.joints.is_empty() { theirs.joints } else { mine.joints };
                own.put(Skin { joints, data: theirs.data }.into());
            }
            (Some(Component::Morph(mine)), Component::Morph(theirs)) => {
                let weights = if mine.weights.is_empty() { theirs.weights } else { mine.weights };
                own.put(Morph { weights, data: theirs.data }.into());
            }
            (Some(mine), _) => own.put(mine),
        }
    }
}
