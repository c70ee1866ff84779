//! Entities as bodies: where rays can meet them, and a digest of all that decides what they find there.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::hierarchy::Placement;
use super::stage::{Order, Stage, get};
use crate::base::digest::{Digest, Hasher};
use crate::components::content::{feed_component, feed_record};
use crate::components::*;
use crate::trace::footprint::Place;

/// What an entity is to rays.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// Not there, or nothing that a ray could meet.
    Nothing,
    Bounded {
        digest: Digest,
        place: Place,
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
    let (mut place, mut mesh): (Option<Place>, _) = (None, None);
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
        if has_surface(&component) {
            let turned = placement.matrix3.transpose();
            let reach = |d: DVec3| farthest(&component, turned * d) + placement.translation.dot(d);
            place = Some(place.unwrap_or_default().union(Place::new(reach)));
        }
    }
    place.map_or(Body::Nothing, |place| Body::Bounded { digest: hasher.finish(), place, mesh })
}

/// Whether surfaces of the material are lights to others.
fn shines(material: &Material) -> bool {
    material.emission != DVec3::ZERO
}

/// Whether it is a shape of finite size.
fn has_surface(component: &Component) -> bool {
    match component {
        Component::Mesh(mesh) => !mesh.data.vertices.is_empty(),
        Component::Sphere(_)
        | Component::Triangle(_)
        | Component::AABox(_)
        | Component::Cylinder(_)
        | Component::Cone(_) => true,
        Component::Plane(_)
        | Component::Transform(_)
        | Component::Motion(_)
        | Component::MaterialName(_)
        | Component::Texture(_)
        | Component::PointLight(_)
        | Component::AreaLight(_) => false,
    }
}

/// The greatest product of a point of a shape and a direction of any length, in its local space.
fn farthest(component: &Component, along: DVec3) -> f64 {
    let of_box = |[min, max]: [DVec3; 2]| (min * along).max(max * along).element_sum();
    let of_disks = |ends: [(DVec3, f64); 2]| {
        let axis = (ends[1].0 - ends[0].0).normalize_or_zero();
        let across = (along - axis * along.dot(axis)).length();
        ends.into_iter().map(|(center, radius)| center.dot(along) + radius.abs() * across).fold(f64::NEG_INFINITY, f64::max)
    };
    match component {
        Component::Sphere(shape) => shape.center.dot(along) + shape.radius.abs() * along.length(),
        Component::Triangle(shape) => shape.vertices.iter().map(|v| v.dot(along)).fold(f64::NEG_INFINITY, f64::max),
        Component::AABox(shape) => of_box([shape.min.min(shape.max), shape.max.max(shape.min)]),
        Component::Cylinder(shape) => of_disks([(shape.base, shape.radius), (shape.apex, shape.radius)]),
        Component::Cone(shape) => of_disks([(shape.base, shape.base_radius), (shape.apex, shape.apex_radius)]),
        Component::Mesh(mesh) => {
            let boxes = mesh.data.boxes().iter().map(|corners| of_box(corners.map(|corner| corner.as_dvec3())));
            boxes.fold(f64::NEG_INFINITY, f64::max)
        }
        _ => f64::NEG_INFINITY,
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
