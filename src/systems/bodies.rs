//! Entities as bodies: where rays can meet them, and a digest of all that decides what they find there.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::hierarchy::Placement;
use super::stage::{Order, Stage, get};
use crate::base::digest::{Digest, Hasher};
use crate::components::content::{feed_component, feed_record};
use crate::components::*;
use crate::trace::geometry::Bounds;

/// What an entity is to rays.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// Not there, or nothing that a ray could meet.
    Nothing,
    Bounded {
        digest: Digest,
        bounds: Bounds,
        /// Address of its mesh: how a mesh is traced depends on how many share it.
        mesh: Option<usize>,
    },
    /// It reaches everywhere, or shines.
    Everywhere,
}

/// What stands at an authored index, as the World is now.
pub fn body(stage: &Stage, index: usize) -> Body {
    let Some(entity) = stage.live(index) else { return Body::Nothing };
    let placement = stage.world.get::<&Placement>(entity).map_or(DAffine3::IDENTITY, |p| p.0);
    let mut hasher = Hasher::default();
    placement.to_cols_array().into_iter().for_each(|x| hasher.number(x));
    let (mut corners, mut mesh): (Option<[DVec3; 2]>, _) = (None, None);
    for component in Kind::ALL.iter().filter_map(|kind| get(&stage.world, entity, *kind)) {
        feed_component(&component, |_| true, &mut hasher, &mut |_, _| {});
        match &component {
            Component::MaterialName(worn) => {
                let number = stage.material_names.get(&worn.0);
                let material = number.and_then(|i| stage.world.get::<&Material>(stage.materials[*i]).ok());
                let Some(material) = material else { return Body::Everywhere };
                if shines(&material) {
                    return Body::Everywhere;
                }
                feed_record(&*material, |_| true, &mut hasher, &mut |_, _| {});
            }
            Component::Mesh(shape) => mesh = Some(Arc::as_ptr(&shape.data) as usize),
            Component::Plane(_) | Component::PointLight(_) | Component::AreaLight(_) | Component::Motion(_) => {
                return Body::Everywhere;
            }
            _ => {}
        }
        if let Some([low, high]) = extent(&component) {
            let [a, b] = corners.unwrap_or([low, high]);
            corners = Some([a.min(low), b.max(high)]);
        }
    }
    let Some([low, high]) = corners else { return Body::Nothing };
    let corner = |i: usize| DVec3::from_array(std::array::from_fn(|axis| [low, high][i >> axis & 1][axis]));
    let all: [_; 8] = std::array::from_fn(|i| placement.transform_point3(corner(i)).as_vec3());
    Body::Bounded { digest: hasher.finish(), bounds: Bounds::around(&all), mesh }
}

/// Whether surfaces of the material are lights to others.
fn shines(material: &Material) -> bool {
    material.emission != DVec3::ZERO
}

/// Lower and upper corner of a shape in its local space.
fn extent(component: &Component) -> Option<[DVec3; 2]> {
    let around = |points: &[DVec3], by: f64| {
        let low = points.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = points.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        Some([low - by, high + by])
    };
    match component {
        Component::Sphere(sphere) => around(&[sphere.center], sphere.radius.abs()),
        Component::Triangle(triangle) => around(&triangle.vertices, 0.0),
        Component::AABox(shape) => around(&[shape.min, shape.max], 0.0),
        Component::Cylinder(shape) => around(&[shape.base, shape.apex], shape.radius.abs()),
        Component::Cone(shape) => {
            around(&[shape.base, shape.apex], shape.base_radius.abs().max(shape.apex_radius.abs()))
        }
        Component::Mesh(mesh) if mesh.data.vertices.is_empty() => None,
        Component::Mesh(mesh) => {
            let bounds = Bounds::around(&mesh.data.vertices);
            Some([bounds.min.as_dvec3(), bounds.max.as_dvec3()])
        }
        Component::Plane(_)
        | Component::Transform(_)
        | Component::Motion(_)
        | Component::MaterialName(_)
        | Component::Texture(_)
        | Component::PointLight(_)
        | Component::AreaLight(_) => None,
    }
}

/// Authored indices of all entities that these edits, which the World stands under, may have made other than at rest;
/// `None` if there is no telling.
pub fn affected(stage: &Stage, edits: &[Edit]) -> Option<BTreeSet<usize>> {
    let spawned = edits.iter().filter(|edit| matches!(edit, Edit::Spawn(_))).count();
    let mut found: BTreeSet<usize> = (stage.entities.len() - spawned..stage.entities.len()).collect();
    let mut materials = BTreeSet::new();
    for edit in edits {
        match edit {
            Edit::Put { entity, .. } | Edit::Take { entity, .. } | Edit::Despawn { entity } => {
                found.insert(*entity);
            }
            Edit::Material { index, .. } => drop(materials.insert(*index)),
            // The numbers of materials are part of a picture's layers.
            Edit::AddMaterial { .. } => return None,
            Edit::Camera(_) | Edit::Render(_) | Edit::Tags { .. } | Edit::Spawn(_) => {}
        }
    }
    if !materials.is_empty() {
        for (order, worn) in stage.world.query::<(&Order, &MaterialName)>().iter() {
            if stage.material_names.get(&worn.0).is_some_and(|index| materials.contains(index)) {
                found.insert(order.0 as usize);
            }
        }
    }
    let mut open: Vec<usize> = found.iter().copied().collect();
    while let Some(index) = open.pop() {
        let children = stage.kept.children.get(&index).into_iter().flatten();
        open.extend(children.filter(|child| found.insert(**child)));
    }
    Some(found)
}
