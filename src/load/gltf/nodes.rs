//! The nodes of a glTF file -> entities of an asset.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};
use serde::Deserialize;
use serde_json::Map;

use super::clips::AnimatedNode;
use super::document::{Document, at, field};
use super::json::{Index, NodeJson, attribute, extension};
use super::mesh::GltfMesh;
use super::warnings::Warnings;
use crate::base::{limits, math};
use crate::components::animation::{euler_of, unit};
use crate::components::*;
use crate::load::names::Names;
use crate::load::resolve::Problem;

/// The nodes that are shown, parents before their children.
pub struct Nodes {
    pub nodes: Vec<AssetNode>,
    /// Place in `nodes` by the number in the file.
    pub place: FxHashMap<usize, usize>,
}

/// What a walk over the nodes has at hand.
struct Walk<'a> {
    document: &'a Document,
    warnings: &'a mut Warnings,
    material: &'a dyn Fn(Option<usize>) -> Text,
    meshes: FxHashMap<usize, GltfMesh>,
    names: Names,
    found: Nodes,
    seen: FxHashSet<usize>,
    /// Nodes with a skin: place, and number of the skin.
    skinned: Vec<(usize, usize)>,
}

#[derive(Deserialize)]
struct InstancingJson {
    attributes: Map<String, serde_json::Value>,
}

#[derive(Deserialize)]
struct VisibilityJson {
    #[serde(default = "visible")]
    visible: bool,
}

/// What a node is that does not say it.
fn visible() -> bool {
    true
}

impl Document {
    /// The nodes of a scene of the file; `scene` is its name or number.
    ///
    /// # Errors
    /// A scene or node that does not exist, nodes that go round in a circle, and what [`Document::mesh`] refuses.
    pub fn nodes(
        &self,
        scene: Option<&str>,
        material: &dyn Fn(Option<usize>) -> Text,
        warnings: &mut Warnings,
    ) -> Result<Nodes, Problem> {
        let mut roots = self.roots(scene)?;
        let parents = self.parents()?;
        let mut walk = Walk {
            document: self,
            warnings,
            material,
            meshes: FxHashMap::default(),
            names: Names::default(),
            found: Nodes { nodes: Vec::new(), place: FxHashMap::default() },
            seen: FxHashSet::default(),
            skinned: Vec::new(),
        };
        walk.all(&roots, &parents)?;
        // Joints need not be in the scene: then nothing of them shows, but the mesh hangs on them.
        roots = walk.roots_of_joints(&parents);
        walk.all(&roots, &parents)?;
        walk.attach_skins()?;
        Ok(walk.found)
    }

    fn roots(&self, wanted: Option<&str>) -> Result<Vec<usize>, Problem> {
        let scenes = &self.root.scenes;
        let number = match wanted {
            Some(word) => {
                let named = scenes.iter().position(|scene| scene.name.as_deref() == Some(word));
                let number = named.or_else(|| word.parse().ok().filter(|n: &usize| *n < scenes.len()));
                let names = scenes.iter().enumerate().map(|(i, s)| s.name.clone().unwrap_or(i.to_string()));
                let names: Vec<String> = names.collect();
                Some(number.ok_or_else(|| {
                    let help = crate::base::diagnostics::suggestion(word, names.iter().map(String::as_str));
                    Problem::new(vec![crate::load::resolve::key("scenes")], format!("there is no scene `{word}`"))
                        .help(help)
                })?)
            }
            None => self.root.scene.map(|scene| scene.0).or((!scenes.is_empty()).then_some(0)),
        };
        match number {
            Some(number) => match scenes.get(number) {
                Some(scene) => Ok(scene.nodes.iter().map(|node| node.0).collect()),
                None => {
                    Err(Problem::new(vec![crate::load::resolve::key("scene")], format!("there is no scene {number}")))
                }
            },
            None => {
                let parents = self.parents()?;
                Ok((0..self.root.nodes.len()).filter(|node| !parents.contains_key(node)).collect())
            }
        }
    }

    /// The parent of each node that has one.
    fn parents(&self) -> Result<FxHashMap<usize, usize>, Problem> {
        let mut parents = FxHashMap::default();
        for (parent, node) in self.root.nodes.iter().enumerate() {
            for child in &node.children {
                if parents.insert(child.0, parent).is_some() {
                    let message = format!("node {} has two parents", child.0);
                    return Err(Problem::new(field(at("nodes", parent), "children"), message));
                }
            }
        }
        Ok(parents)
    }

    /// What clips need to know of a node; `None` if there is no such node.
    pub fn animated(&self, nodes: &Nodes, number: usize) -> Option<AnimatedNode> {
        self.root.nodes.get(number)?;
        let place = nodes.place.get(&number);
        let node = place.map(|place| &nodes.nodes[*place]);
        Some(AnimatedNode {
            name: node.map(|node| node.name.clone()),
            targets: node.map_or(0, |node| match node.desc.get(Kind::Morph) {
                Some(Component::Morph(morph)) => morph.weights.len(),
                _ => 0,
            }),
        })
    }
}

impl Walk<'_> {
    /// Adds trees of nodes, depth first, so that parents stand before their children.
    fn all(&mut self, roots: &[usize], parents: &FxHashMap<usize, usize>) -> Result<(), Problem> {
        let mut open: Vec<(usize, Option<usize>)> = roots.iter().rev().map(|root| (*root, None)).collect();
        while let Some((number, parent)) = open.pop() {
            let path = at("nodes", number);
            let nodes = &self.document.root.nodes;
            let Some(node) = nodes.get(number) else {
                return Err(Problem::new(path, format!("there is no node {number}; there are {}", nodes.len())));
            };
            if !self.seen.insert(number) {
                if parent.is_none() {
                    // A scene may name a node that is below another one of it.
                    continue;
                }
                return Err(Problem::new(path, "the nodes go round in a circle"));
            }
            if parent.is_none() && self.is_below_itself(number, parents) {
                return Err(Problem::new(path, "the nodes go round in a circle"));
            }
            let hidden: Option<VisibilityJson> =
                extension(&node.extensions, "KHR_node_visibility").map_err(|m| Problem::new(path.clone(), m))?;
            if hidden.is_some_and(|hidden| !hidden.visible) {
                continue;
            }
            let place = self.node(node, number, parent)?;
            open.extend(node.children.iter().rev().map(|child| (child.0, Some(place))));
            if self.found.nodes.len() > limits::ENTITIES {
                return Err(Problem::new(path, format!("more than {} nodes", limits::ENTITIES)));
            }
        }
        Ok(())
    }

    fn is_below_itself(&self, number: usize, parents: &FxHashMap<usize, usize>) -> bool {
        let mut at = parents.get(&number);
        for _ in 0..self.document.root.nodes.len() {
            match at {
                Some(above) if *above == number => return true,
                Some(above) => at = parents.get(above),
                None => return false,
            }
        }
        at.is_some()
    }

    /// Adds one node; its place among those that were found.
    fn node(&mut self, node: &NodeJson, number: usize, parent: Option<usize>) -> Result<usize, Problem> {
        let path = at("nodes", number);
        let word = node.name.clone().filter(|name| !name.is_empty()).unwrap_or(format!("node{number}"));
        let name = self.names.give(&word);
        let transform = transform(node).map_err(|(name, m)| Problem::new(field(path.clone(), name), m))?;
        let mut desc = EntityDesc::new([transform.into()]);
        self.document.light_and_camera(node, &path, &mut desc, self.warnings)?;
        let place = self.found.nodes.len();
        self.found.place.insert(number, place);
        self.found.nodes.push(AssetNode { name: name.clone(), parent, desc });
        let Some(mesh) = node.mesh else { return Ok(place) };
        let mesh = self.mesh(mesh.0)?;
        if mesh.data.triangles.is_empty() {
            return Ok(place);
        }
        let mut parts: Vec<Component> = vec![Mesh { data: mesh.data.clone(), ..Mesh::default() }.into()];
        if let Some(data) = &mesh.morph {
            let weights =
                if node.weights.len() == mesh.weights.len() { node.weights.clone() } else { mesh.weights.clone() };
            parts.push(Morph { weights, data: data.clone() }.into());
        }
        match self.instances(node, number)? {
            None => {
                let desc = &mut self.found.nodes[place].desc;
                parts.into_iter().for_each(|part| desc.put(part));
                if let Some(skin) = node.skin {
                    self.skinned.push((place, skin.0));
                }
            }
            Some(instances) => {
                for (i, instance) in instances.into_iter().enumerate() {
                    let name = self.names.give(&format!("{name}/{i}"));
                    let desc = EntityDesc::new(parts.iter().cloned().chain([instance.into()]));
                    self.found.nodes.push(AssetNode { name, parent: Some(place), desc });
                }
            }
        }
        Ok(place)
    }

    fn mesh(&mut self, index: usize) -> Result<GltfMesh, Problem> {
        if let Some(known) = self.meshes.get(&index) {
            return Ok(known.clone());
        }
        let mesh = self.document.mesh(index, self.material, self.warnings)?;
        self.meshes.insert(index, mesh.clone());
        Ok(mesh)
    }

    /// Where copies of a node's mesh stand, relative to the node, if it has several (EXT_mesh_gpu_instancing).
    fn instances(&self, node: &NodeJson, number: usize) -> Result<Option<Vec<Transform>>, Problem> {
        let path = at("nodes", number);
        let read: Option<InstancingJson> =
            extension(&node.extensions, "EXT_mesh_gpu_instancing").map_err(|m| Problem::new(path.clone(), m))?;
        let Some(InstancingJson { attributes }) = read else { return Ok(None) };
        let path = field(field(path, "extensions"), "EXT_mesh_gpu_instancing");
        let values = |name: &str, shape: &str| -> Result<Vec<Vec<f64>>, Problem> {
            let index = attribute(&attributes, name).map_err(|m| Problem::new(path.clone(), m))?;
            let Some(index) = index else { return Ok(Vec::new()) };
            let (flat, width) = self.document.floats(index, &[shape])?;
            Ok(flat.chunks_exact(width).map(|row| row.iter().map(|x| f64::from(*x)).collect()).collect())
        };
        let (moved, turned, scaled) =
            (values("TRANSLATION", "VEC3")?, values("ROTATION", "VEC4")?, values("SCALE", "VEC3")?);
        let count = moved.len().max(turned.len()).max(scaled.len());
        let uneven = [&moved, &turned, &scaled].into_iter().any(|some| !some.is_empty() && some.len() != count);
        if uneven || count > limits::ENTITIES {
            return Err(Problem::new(path, "its attributes have different numbers of instances"));
        }
        let one = |i: usize| {
            let at = |some: &[Vec<f64>], rest: f64| some.get(i).map_or(DVec3::splat(rest), |v| DVec3::from_slice(v));
            let turn = turned.get(i).map_or(DVec3::ZERO, |q| euler_of(unit([q[0], q[1], q[2], q[3]])));
            Transform {
                translation: at(&moved, 0.0),
                rotation: turn,
                scale: Scale(at(&scaled, 1.0)),
                ..Transform::default()
            }
        };
        let all: Vec<Transform> = (0..count).map(one).collect();
        match all.iter().find_map(|transform| transform.check().err()) {
            Some(invalid) => Err(Problem::new(path, invalid.message)),
            None => Ok(Some(all)),
        }
    }

    /// Roots of the trees that joints are in, as far as those were not met.
    fn roots_of_joints(&self, parents: &FxHashMap<usize, usize>) -> Vec<usize> {
        let skins = self.skinned.iter().filter_map(|(_, skin)| self.document.root.skins.get(*skin));
        let joints = skins.flat_map(|skin| skin.joints.iter().map(|joint| joint.0));
        let mut roots = Vec::new();
        for joint in joints.filter(|joint| !self.found.place.contains_key(joint)) {
            let mut root = joint;
            for _ in 0..self.document.root.nodes.len() {
                match parents.get(&root) {
                    Some(above) if !self.found.place.contains_key(above) => root = *above,
                    _ => break,
                }
            }
            if !roots.contains(&root) {
                roots.push(root);
            }
        }
        roots
    }

    /// Gives each skinned node the names of its joints.
    fn attach_skins(&mut self) -> Result<(), Problem> {
        let mut binds: FxHashMap<usize, Vec<DAffine3>> = FxHashMap::default();
        for (place, number) in std::mem::take(&mut self.skinned) {
            let path = at("skins", number);
            let Some(skin) = self.document.root.skins.get(number) else {
                let count = self.document.root.skins.len();
                return Err(Problem::new(path, format!("there is no skin {number}; there are {count}")));
            };
            let mut joints = Vec::with_capacity(skin.joints.len());
            for Index(joint) in &skin.joints {
                let Some(node) = self.found.place.get(joint).map(|place| &self.found.nodes[*place]) else {
                    return Err(Problem::new(field(path, "joints"), format!("joint {joint} is not there")));
                };
                joints.push(node.name.clone());
            }
            let mesh = match self.found.nodes[place].desc.get(Kind::Mesh) {
                Some(Component::Mesh(mesh)) => self.meshes.values().find(|known| Arc::ptr_eq(&known.data, &mesh.data)),
                _ => None,
            };
            let Some((mesh, influences)) = mesh.and_then(|mesh| Some((mesh, mesh.influences.clone()?))) else {
                self.warnings.add("skin without weights", || {
                    Problem::new(path.clone(), "a mesh with a skin has no joints and weights: it is not bent")
                });
                continue;
            };
            if mesh.joints > joints.len() {
                let message = format!("the mesh speaks of joint {}; there are {}", mesh.joints - 1, joints.len());
                return Err(Problem::new(field(path, "joints"), message));
            }
            if let std::collections::hash_map::Entry::Vacant(entry) = binds.entry(number) {
                entry.insert(self.document.binds(number)?);
            }
            let data = Arc::new(SkinData::new(binds[&number].clone(), influences));
            self.found.nodes[place].desc.put(Skin { joints, data }.into());
        }
        Ok(())
    }
}

impl Document {
    /// The maps from the space of a mesh to those of the joints of a skin.
    fn binds(&self, number: usize) -> Result<Vec<DAffine3>, Problem> {
        let skin = &self.root.skins[number];
        let Some(index) = skin.inverse_bind_matrices else {
            return Ok(vec![DAffine3::IDENTITY; skin.joints.len()]);
        };
        let (flat, _) = self.floats(index.0, &["MAT4"])?;
        let matrices: Vec<DAffine3> =
            flat.chunks_exact(16).map(|m| affine(&m.iter().map(|x| f64::from(*x)).collect::<Vec<_>>())).collect();
        let path = field(at("skins", number), "inverseBindMatrices");
        if matrices.len() < skin.joints.len() {
            let message = format!("{} matrices for {} joints", matrices.len(), skin.joints.len());
            return Err(Problem::new(path, message));
        }
        if !matrices.iter().all(|m| m.is_finite()) {
            return Err(Problem::new(path, "a matrix is not made of finite numbers"));
        }
        Ok(matrices[..skin.joints.len()].to_vec())
    }
}

/// Sixteen numbers column by column, the last row left out.
fn affine(m: &[f64]) -> DAffine3 {
    let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}

/// Where a node stands; the field that is wrong and why.
fn transform(node: &NodeJson) -> Result<Transform, (&'static str, String)> {
    let transform = match &node.matrix {
        Some(m) => of_matrix(&affine(m)),
        None => Transform {
            translation: node.translation.map_or(DVec3::ZERO, DVec3::from_array),
            rotation: node.rotation.map_or(DVec3::ZERO, |q| euler_of(unit(q))),
            scale: Scale(node.scale.map_or(DVec3::ONE, DVec3::from_array)),
            ..Transform::default()
        },
    };
    let field = if node.matrix.is_some() { "matrix" } else { "translation" };
    transform.check().map(|()| transform).map_err(|invalid| (field, invalid.message))
}

/// A map as translation, rotation and scale, where it is no more than that; else as it is.
fn of_matrix(map: &DAffine3) -> Transform {
    let m = map.matrix3;
    let lengths = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
    let kept = Transform { matrix: Some([m.x_axis, m.y_axis, m.z_axis, map.translation]), ..Transform::default() };
    if !(lengths.min_element() > 0.0 && lengths.is_finite()) {
        return kept;
    }
    // A mirror turns one axis round; which one is a matter of taste.
    let scale = if m.determinant() < 0.0 { DVec3::new(-lengths.x, lengths.y, lengths.z) } else { lengths };
    let turned = DMat3::from_cols(m.x_axis / scale.x, m.y_axis / scale.y, m.z_axis / scale.z);
    let rotation = math::euler_degrees(turned);
    let taken_apart = Transform { translation: map.translation, rotation, scale: Scale(scale), ..Transform::default() };
    let off =
        (taken_apart.matrix().matrix3 - m).to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if off <= 1e-6 * lengths.max_element() { taken_apart } else { kept }
}
