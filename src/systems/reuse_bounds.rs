//! Bounds of entities for reuse: where rays can meet an entity, and a digest of all that decides what they find there.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rustc_hash::FxHashMap;

use super::contacts::{ContactNudges, contact_nudges};
use super::deform;
use super::hierarchy::Placement;
use super::origin::{relative, render_origin};
use super::stage::{AuthoredIndex, MaterialIndex, Stage, Tags, get};
use super::visibility::has_links;
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
        /// All that decides what rays find there.
        digest: Digest,
        /// Where rays can meet it, in the space that is traced.
        place: Kdop,
        /// Address of its mesh: how a mesh is traced depends on how many share it.
        mesh: Option<usize>,
    },
    /// It reaches everywhere, or emits light: rays that never come near it depend on it too.
    Everywhere {
        /// All that decides what rays find.
        digest: Digest,
    },
}

/// What else goes into the digest of a value, as the content of a file that it names.
type FeedValue<'a> = &'a mut dyn FnMut(&Value, &mut Hasher);

/// The reuse bounds of all entities, as the World is now, for windows that outlive the files that the World is made of:
/// `feed` adds what a named file holds, and a mesh is known by what it holds and how many entities share it.
pub fn all_reuse_bounds(stage: &Stage, feed: FeedValue) -> Vec<ReuseBounds> {
    let nudges = contact_nudges(stage);
    let mut all: Vec<ReuseBounds> =
        (0..stage.entities.len()).map(|index| reuse_bounds_with(stage, &nudges, index, feed)).collect();
    let mut shared: FxHashMap<usize, u64> = FxHashMap::default();
    for object in &all {
        if let ReuseBounds::Bounded { mesh: Some(mesh), .. } = object {
            *shared.entry(*mesh).or_default() += 1;
        }
    }
    for object in &mut all {
        if let ReuseBounds::Bounded { digest, mesh: Some(mesh), .. } = object {
            let mut hasher = Hasher::default();
            hasher.digest(*digest);
            hasher.word(shared[mesh]);
            *digest = hasher.finish();
        }
    }
    all
}

/// The reuse bounds of the entity at an authored index, as the World is now; `nudges` are those of the World.
pub fn reuse_bounds(stage: &Stage, nudges: &ContactNudges, index: usize) -> ReuseBounds {
    reuse_bounds_with(stage, nudges, index, &mut |_, _| {})
}

fn reuse_bounds_with(stage: &Stage, nudges: &ContactNudges, index: usize, feed: FeedValue) -> ReuseBounds {
    let Some(entity) = stage.live(index) else { return ReuseBounds::Nothing };
    let placed = stage.world.get::<&Placement>(entity).ok();
    let placement = relative(placed.as_deref(), render_origin(stage));
    let mut hasher = Hasher::default();
    placement.to_cols_array().into_iter().for_each(|x| hasher.number(x));
    let placement = nudges.of(index).map_or(placement, |nudge| {
        nudge.to_cols_array().into_iter().for_each(|x| hasher.number(x));
        *nudge * placement
    });
    let (mut place, mut mesh, mut everywhere): (Option<Kdop>, _, _) = (None, None, false);
    if has_links(stage)
        && let Ok(tags) = stage.world.get::<&Tags>(entity)
    {
        tags.0.iter().for_each(|tag| hasher.text(tag));
    }
    // What cannot be bent ends the frame with an error.
    let bent = deform::now(stage, index).ok().flatten();
    if let Some(bent) = &bent {
        hasher.digest(bent.digest());
    }
    for component in Kind::ALL.iter().filter_map(|kind| get(&stage.world, entity, *kind)) {
        feed_component(&component, |_| true, &mut hasher, feed);
        match component.kind().role() {
            // Where the entity is at the moment is in its placement; what it did before is not.
            Role::Placement => everywhere |= component.kind() == Kind::Motion,
            Role::Light | Role::Linking => everywhere = true,
            Role::Surface => {
                let number = stage.world.get::<&MaterialIndex>(entity).ok();
                let number = number.filter(|_| component.kind() == MaterialName::KIND).map(|number| number.0 as usize);
                if let Some(material) = number.and_then(|i| stage.world.get::<&Material>(stage.materials[i]).ok()) {
                    everywhere |= is_emissive(&material);
                    feed_record(&*material, |_, _| true, &mut hasher, feed);
                }
            }
            Role::Shape => {
                let (component, placement) = match &bent {
                    Some(bent) if component.kind() == Kind::Mesh => {
                        let there = nudges.of(index).copied().unwrap_or(DAffine3::IDENTITY);
                        (bent.mesh.clone().into(), if bent.in_world { there } else { placement })
                    }
                    _ => (component, placement),
                };
                let Some(shape) = component.shape() else { continue };
                match shape.reach() {
                    Reach::Empty => {}
                    Reach::Infinite => everywhere = true,
                    Reach::Finite => place = Some(place.unwrap_or_default().union(bounds_of(shape, &placement))),
                }
                let Some(shape) = Mesh::of(&component) else { continue };
                // A bent mesh is nobody else's.
                let shared = bent.is_none().then(|| shape.pieces());
                mesh = mesh.or(shared.and_then(|all| all.first().map(|piece| Arc::as_ptr(&piece.data) as usize)));
                for index in shape.worn().filter_map(|name| stage.material_names.get(name)) {
                    if let Ok(material) = stage.world.get::<&Material>(stage.materials[*index]) {
                        everywhere |= is_emissive(&material);
                        feed_record(&*material, |_, _| true, &mut hasher, feed);
                    }
                }
            }
            // What bends it is in its digest.
            Role::Deformation | Role::Visibility | Role::View | Role::Source => {}
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

/// Where rays can meet a shape of finite size.
fn bounds_of(shape: &dyn Shape, placement: &DAffine3) -> Kdop {
    let to_local = placement.matrix3.transpose();
    let support = |d: DVec3| shape.support(to_local * d) + placement.translation.dot(d);
    Kdop::new(support).wider(rounding_error(shape, placement))
}

/// How far off its place a shape may be intersected by rays in its local space, in world units: the error of `f32` grows
/// with the distance from that space's origin.
fn rounding_error(shape: &dyn Shape, placement: &DAffine3) -> f64 {
    let far = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).map(|d| shape.support(d).abs());
    let stretch = placement.matrix3.to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    4e-6 * stretch * far.fold(0.0, f64::max)
}

/// Authored indices of all entities that may differ from the base scene under these edits, which the World stands under;
/// `None` if any may.
pub fn affected_entities(stage: &Stage, edits: &[Edit]) -> Option<BTreeSet<usize>> {
    let spawned = edits.iter().filter(|edit| matches!(edit, Edit::Spawn(_))).count();
    let mut found: BTreeSet<usize> = (stage.entities.len() - spawned..stage.entities.len()).collect();
    let mut materials = BTreeSet::new();
    for edit in edits {
        match edit {
            Edit::Put { entity, .. }
            | Edit::Take { entity, .. }
            | Edit::Tags { entity, .. }
            | Edit::Despawn { entity } => {
                found.insert(*entity);
            }
            Edit::Material { index, .. } => drop(materials.insert(*index)),
            // The numbers of materials are part of a picture's layers.
            Edit::AddMaterial { .. } => return None,
            Edit::Camera(_) | Edit::Cameras(_) | Edit::Render(_) | Edit::Spawn(_) => {}
        }
    }
    if !materials.is_empty() {
        for (order, material) in stage.world.query::<(&AuthoredIndex, &MaterialIndex)>().iter() {
            if materials.contains(&(material.0 as usize)) {
                found.insert(order.0 as usize);
            }
        }
        for (order, mesh) in stage.world.query::<(&AuthoredIndex, &Mesh)>().iter() {
            let mut worn = mesh.worn().filter_map(|name| stage.material_names.get(name));
            if worn.any(|index| materials.contains(index)) {
                found.insert(order.0 as usize);
            }
        }
    }
    let mut open: Vec<usize> = found.iter().copied().collect();
    while let Some(index) = open.pop() {
        let children = stage.derived.hierarchy.children.get(&index).into_iter().flatten();
        open.extend(children.filter(|child| found.insert(**child)));
    }
    let mut carried = Vec::new();
    for (order, skin) in stage.world.query::<(&AuthoredIndex, &Skin)>().iter() {
        if skin.joints.iter().any(|joint| stage.names.get(joint).is_some_and(|index| found.contains(index))) {
            carried.push(order.0 as usize);
        }
    }
    found.extend(carried);
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
            Component::Plane(_)
            | Component::Cylinder(_)
            | Component::Transform(_)
            | Component::Motion(_)
            | Component::MaterialName(_)
            | Component::Texture(_)
            | Component::Asset(_)
            | Component::Skin(_)
            | Component::Morph(_)
            | Component::PointLight(_)
            | Component::AreaLight(_)
            | Component::SpotLight(_)
            | Component::DirectionalLight(_)
            | Component::Visible(_)
            | Component::LightLink(_)
            | Component::ShadowLink(_)
            | Component::Viewpoint(_) => Vec::new(),
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
            assert_eq!(shape.shape().map(Shape::reach), Some(Reach::Finite));
            for i in 0..40 {
                let t = f64::from(i);
                let along = DVec3::new(libm::sin(t), libm::cos(t * 1.3), libm::sin(t * 0.7 + 1.0));
                let found = points(&shape).into_iter().map(|p| p.dot(along)).fold(f64::NEG_INFINITY, f64::max);
                let most = shape.shape().unwrap().support(along);
                assert!(found <= most + 1e-9 && most < found + slack, "{shape:?} {along} {found} {most}");
            }
        }
    }
}
