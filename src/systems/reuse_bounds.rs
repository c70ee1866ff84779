//! Bounds of entities for reuse: where rays can meet an entity, and a digest of all that decides what they find there.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::hierarchy::Placement;
use super::stage::{AuthoredIndex, Stage, get};
use crate::base::digest::{Digest, Hasher};
use crate::components::content::{feed_component, feed_record};
use crate::components::*;
use crate::trace::reuse::Kdop;

/// Where an entity can change what rays find.
#[derive(Clone, Debug, PartialEq)]
pub enum ReuseBounds {
    /// Not there, or nothing that a ray could meet.
    Nothing,
    /// It has a finite size.
    Bounded {
        digest: Digest,
        place: Kdop,
        /// Address of its mesh: how a mesh is traced depends on how many share it.
        mesh: Option<usize>,
    },
    /// It reaches everywhere, or emits light: rays that never come near it depend on it too.
    Everywhere { digest: Digest },
}

/// The reuse bounds of the entity at an authored index, as the World is now.
pub fn reuse_bounds(stage: &Stage, index: usize) -> ReuseBounds {
    let Some(entity) = stage.live(index) else { return ReuseBounds::Nothing };
    let placement = stage.world.get::<&Placement>(entity).map_or(DAffine3::IDENTITY, |p| p.0);
    let mut hasher = Hasher::default();
    placement.to_cols_array().into_iter().for_each(|x| hasher.number(x));
    let (mut place, mut mesh, mut everywhere): (Option<Kdop>, _, _) = (None, None, false);
    for component in Kind::ALL.iter().filter_map(|kind| get(&stage.world, entity, *kind)) {
        feed_component(&component, |_| true, &mut hasher, &mut |_, _| {});
        // Whether a material emits light, or is not there.
        let mut is_seen_everywhere = |name: &Text| {
            let number = stage.material_names.get(name);
            let material = number.and_then(|i| stage.world.get::<&Material>(stage.materials[*i]).ok());
            material.is_none_or(|material| {
                feed_record(&*material, |_| true, &mut hasher, &mut |_, _| {});
                is_emissive(&material)
            })
        };
        match &component {
            Component::MaterialName(name) => everywhere |= is_seen_everywhere(&name.0),
            Component::Mesh(shape) => {
                mesh = shape.pieces().first().map(|piece| Arc::as_ptr(&piece.data) as usize);
                for name in shape.worn().filter(|name| stage.material_names.contains_key(*name)) {
                    everywhere |= is_seen_everywhere(name);
                }
            }
            Component::Plane(_) | Component::PointLight(_) | Component::AreaLight(_) | Component::Motion(_) => {
                everywhere = true;
            }
            _ => {}
        }
        if has_surface(&component) {
            let turned = placement.matrix3.transpose();
            let reach = |d: DVec3| support(&component, turned * d) + placement.translation.dot(d);
            place =
                Some(place.unwrap_or_default().union(Kdop::new(reach).wider(rounding_error(&component, &placement))));
        }
    }
    let digest = hasher.finish();
    if everywhere {
        return ReuseBounds::Everywhere { digest };
    }
    place.map_or(ReuseBounds::Nothing, |place| ReuseBounds::Bounded { digest, place, mesh })
}

/// Whether surfaces of the material light others.
fn is_emissive(material: &Material) -> bool {
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

/// How far off its place a shape may be intersected by rays in its local space, in world units: the error of `f32` grows
/// with the distance from that space's origin.
fn rounding_error(component: &Component, placement: &DAffine3) -> f64 {
    let far = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).map(|d| support(component, d).abs());
    let stretch = placement.matrix3.to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    4e-6 * stretch * far.fold(0.0, f64::max)
}

/// The support function of a shape in its local space: the greatest dot product of its points and a direction, which may
/// have any length.
fn support(component: &Component, along: DVec3) -> f64 {
    let of_box = |[min, max]: [DVec3; 2]| (min * along).max(max * along).element_sum();
    let of_disks = |ends: [(DVec3, f64); 2]| {
        let axis = (ends[1].0 - ends[0].0).normalize_or_zero();
        let across = (along - axis * along.dot(axis)).length();
        ends.into_iter()
            .map(|(center, radius)| center.dot(along) + radius.abs() * across)
            .fold(f64::NEG_INFINITY, f64::max)
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

/// Authored indices of all entities that may differ from the base scene under these edits, which the World stands under;
/// `None` if any may.
pub fn affected_entities(stage: &Stage, edits: &[Edit]) -> Option<BTreeSet<usize>> {
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
        for (order, material) in stage.world.query::<(&AuthoredIndex, &MaterialName)>().iter() {
            if stage.material_names.get(&material.0).is_some_and(|index| materials.contains(index)) {
                found.insert(order.0 as usize);
            }
        }
    }
    let mut open: Vec<usize> = found.iter().copied().collect();
    while let Some(index) = open.pop() {
        let children = stage.derived.children.get(&index).into_iter().flatten();
        open.extend(children.filter(|child| found.insert(**child)));
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a shape, some of them at its rim.
    fn points(component: &Component) -> Vec<DVec3> {
        let around = |center: DVec3, a: DVec3, b: DVec3| {
            (0..72).map(move |i| {
                let (sin, cos) = crate::base::math::sin_cos_degrees(f64::from(i) * 5.0);
                center + a * cos + b * sin
            })
        };
        match component {
            Component::Sphere(s) => {
                let ring = |i: u32| {
                    let (sin, cos) = crate::base::math::sin_cos_degrees(f64::from(i) * 5.0);
                    around(
                        s.center + DVec3::Z * (s.radius * cos),
                        DVec3::X * (s.radius * sin),
                        DVec3::Y * (s.radius * sin),
                    )
                };
                (0..=36).flat_map(ring).collect()
            }
            Component::Cone(s) => {
                let (a, b) = (s.apex - s.base).normalize().any_orthonormal_pair();
                let ring = |center, radius| around(center, a * radius, b * radius);
                ring(s.base, s.base_radius).chain(ring(s.apex, s.apex_radius)).collect()
            }
            Component::AABox(s) => {
                let corner =
                    |i: usize| DVec3::from_array(std::array::from_fn(|axis| [s.min, s.max][i >> axis & 1][axis]));
                (0..8).map(corner).collect()
            }
            Component::Triangle(s) => s.vertices.to_vec(),
            Component::Mesh(mesh) => mesh.data.vertices.iter().map(|v| v.as_dvec3()).collect(),
            _ => Vec::new(),
        }
    }

    #[test]
    fn shapes_reach_as_far_as_their_support_points() {
        let vertex = |i: u32| {
            let t = f64::from(i);
            (DVec3::new(libm::cos(t), libm::sin(t * 1.7), libm::cos(t * 2.3)) * 3.0).as_vec3()
        };
        let data = MeshData::new((0..3_000).map(vertex).collect(), vec![[0, 1, 2]], Vec::new());
        assert!(data.boxes().len() < 1_728, "{}", data.boxes().len());
        let (base, apex) = (DVec3::new(0.2, -1.0, 0.3), DVec3::new(-0.4, 1.0, 0.9));
        let shapes = [
            (Component::Sphere(Sphere { center: DVec3::new(1.0, -2.0, 0.5), radius: 0.7 }), 0.01),
            (Component::Cone(Cone { base, apex, base_radius: 0.8, apex_radius: 0.3, capped: true }), 0.01),
            (Component::AABox(AABox { min: -DVec3::ONE, max: DVec3::new(0.5, 2.0, 0.1) }), 1e-9),
            (Component::Triangle(Triangle { vertices: [base, apex, DVec3::X], ..Triangle::default() }), 1e-9),
            (Component::Mesh(Mesh { data: Arc::new(data), ..Mesh::default() }), 0.9),
        ];
        for (shape, slack) in shapes {
            assert!(has_surface(&shape));
            for i in 0..40 {
                let t = f64::from(i);
                let along = DVec3::new(libm::sin(t), libm::cos(t * 1.3), libm::sin(t * 0.7 + 1.0));
                let found = points(&shape).into_iter().map(|p| p.dot(along)).fold(f64::NEG_INFINITY, f64::max);
                let most = support(&shape, along);
                assert!(found <= most + 1e-9 && most < found + slack, "{shape:?} {along} {found} {most}");
            }
        }
    }
}
