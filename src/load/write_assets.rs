//! What of a scene comes with its assets, so that only what differs from them is written.

use rustc_hash::{FxHashMap, FxHashSet};

use super::asset::below;
use crate::components::*;

/// What the assets of a scene say of its entities and materials.
#[derive(Default)]
pub struct OfAssets<'a> {
    /// Entities by their names, as their assets have them.
    nodes: FxHashMap<Text, EntityDesc>,
    materials: FxHashMap<&'a str, &'a Material>,
    /// Nodes that are left out, by the name of the entity whose asset has them.
    without: FxHashMap<&'a str, Vec<Text>>,
}

/// Meshes that a node names by their file are read by the entity.
fn complete(expected: &mut EntityDesc, desc: &EntityDesc) {
    let (Some(named), Some(read)) = (expected.component::<Mesh>(), desc.component::<Mesh>()) else { return };
    if named.file.is_some() && named.file == read.file {
        let mesh = Mesh { data: read.data.clone(), ..named.clone() };
        expected.put(mesh.into());
    }
}

impl<'a> OfAssets<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let mut all = OfAssets::default();
        let there: FxHashMap<&str, &EntityDesc> =
            scene.entities.iter().filter_map(|desc| Some((desc.name.as_deref()?, desc))).collect();
        for desc in &scene.entities {
            if let (Some(name), Some(Component::Asset(asset))) = (&desc.name, desc.get(Kind::Asset)) {
                all.add(name, asset, &there);
            }
        }
        all
    }

    fn add(&mut self, name: &'a Text, asset: &'a Asset, there: &FxHashMap<&str, &EntityDesc>) {
        let nodes = &asset.data.nodes;
        self.materials.extend(asset.data.materials.iter().map(|(name, material)| (&**name, material)));
        let full = |node: &AssetNode| Text::from(format!("{name}/{}", node.name));
        let mut gone: FxHashSet<usize> = FxHashSet::default();
        let mut without = Vec::new();
        for (i, node) in nodes.iter().enumerate() {
            let called = full(node);
            let parent = node.parent.map_or(name.clone(), |parent| full(&nodes[parent]));
            let mut expected = below(&node.desc, name, parent);
            if let Some(desc) = there.get(&*called) {
                complete(&mut expected, desc);
            }
            let is_there = there.get(&*called).is_some_and(|desc| has_all(desc, &expected));
            let goes_along = node.parent.is_some_and(|parent| gone.contains(&parent));
            if !is_there && !goes_along {
                without.push(node.name.clone());
            }
            if !is_there || goes_along {
                gone.insert(i);
            } else {
                self.nodes.insert(called, expected);
            }
        }
        self.without.insert(name, without);
    }

    /// What is to be written of an entity: `None` if its asset says it all.
    pub fn differing(&self, desc: &EntityDesc) -> Option<EntityDesc> {
        let name = desc.name.as_ref();
        if let Some((name, Component::Asset(asset))) = name.zip(desc.get(Kind::Asset)) {
            let mut desc = desc.clone();
            let without = self.without.get(&**name).cloned().unwrap_or_default();
            desc.put(Asset { without, ..asset.clone() }.into());
            return Some(desc);
        }
        let Some(expected) = name.and_then(|name| self.nodes.get(name)) else { return Some(desc.clone()) };
        let own = desc.components().iter();
        let mut out = EntityDesc::new(own.filter_map(|component| differing(component, expected, desc)));
        if out.components().is_empty() && desc.tags.is_empty() {
            return None;
        }
        (out.name, out.tags) = (desc.name.clone(), desc.tags.clone());
        Some(out)
    }

    /// Whether the asset that has the material has it like this.
    pub fn is_material(&self, name: &str, material: &Material) -> bool {
        self.materials.get(name).is_some_and(|known| **known == *material)
    }

    /// An entity as its asset has it, as far as one can write that down.
    pub fn offered(&self, desc: &EntityDesc) -> Option<EntityDesc> {
        let name = desc.name.as_ref()?;
        let expected = self.nodes.get(name)?;
        let written = |component: &&Component| !matches!(component.kind(), Kind::Mesh | Kind::Skin);
        let mut out = EntityDesc::new(expected.components().iter().filter(written).cloned());
        if let Some(Component::Transform(transform)) = out.get(Kind::Transform).cloned() {
            out.put(Transform { parent: None, ..transform }.into());
        }
        out.name = Some(name.clone());
        Some(out)
    }
}

/// Whether an entity has a component of every kind that its asset gives it.
fn has_all(desc: &EntityDesc, expected: &EntityDesc) -> bool {
    expected.components().iter().all(|component| desc.get(component.kind()).is_some())
}

/// A component of an entity, as far as its asset says something else.
fn differing(own: &Component, expected: &EntityDesc, desc: &EntityDesc) -> Option<Component> {
    match (own, expected.get(own.kind())) {
        (Component::Transform(own), Some(Component::Transform(theirs))) if own != theirs => {
            let parent = own.parent.clone().filter(|_| own.parent != theirs.parent);
            Some(Transform { parent, ..own.clone() }.into())
        }
        (Component::Mesh(own), Some(Component::Mesh(theirs))) if desc.get(Kind::MaterialName).is_some() => {
            // Who chooses a material for a node means all of its mesh: see `merge`.
            let as_theirs = Mesh { file_materials: theirs.file_materials, ..own.clone() };
            (as_theirs != *theirs).then(|| own.clone().into())
        }
        (own, Some(theirs)) => (own != theirs).then(|| own.clone()),
        (own, None) => Some(own.clone()),
    }
}
