//! Instances of meshes that several entities share: a mesh is stored once, in its own space.

use std::sync::Arc;

use glam::{DAffine3, Vec2, Vec3, Vec4};

use super::aabox::BoxPrim;
use super::affine::AffineMap;
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveColumn;
use super::mesh::{corner_uvs, mixed_color, mixed_normal, same_mesh};
use super::prepared_ray::PreparedRay;
use super::surface::{BarePoint, SurfacePoint};
use super::tag::Tag;
use super::terminator::SmoothFacet;
use super::triangle::{AreaTriangle, ShadedPoint, intersect_corners, on_triangle, patch, wrapped};
use super::uv::{ObjectSpace, SurfaceUv};
use crate::components::MeshData;
use crate::trace::soa::{Hit, Ray};

/// A mesh in its own space.
#[derive(Clone, Debug)]
pub struct MeshPrototype {
    /// In its own space.
    pub mesh: Arc<MeshData>,
    /// Whether normals are interpolated.
    pub smooth: bool,
    /// In the space of the mesh.
    pub bounds: Bounds,
}

impl PartialEq for MeshPrototype {
    fn eq(&self, other: &Self) -> bool {
        same_mesh(&self.mesh, &other.mesh) && self.smooth == other.smooth
    }
}

impl MeshPrototype {
    /// A mesh that instances share.
    pub fn new(mesh: &Arc<MeshData>, smooth: bool) -> Self {
        let smooth = smooth && !mesh.shading_normals().is_empty();
        MeshPrototype { mesh: mesh.clone(), smooth, bounds: Bounds::around(&mesh.vertices) }
    }

    /// Corners of a triangle, in the space of the mesh.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|i| self.mesh.vertices[i as usize])
    }

    /// As `BakedMesh::uvs`.
    pub fn uvs(&self, triangle: u32, second: bool) -> Option<[Vec2; 3]> {
        corner_uvs(&self.mesh, triangle, second)
    }

    /// As `BakedMesh::shading_normal`, in local space.
    pub fn shading_normal(&self, triangle: u32, u: f32, v: f32) -> Option<Vec3> {
        self.smooth.then(|| mixed_normal(&self.mesh, triangle, u, v))
    }
}

/// A mesh prototype under an affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the prototype.
    pub prototype: u32,
    /// From the space of the mesh to that which is traced.
    pub map: AffineMap,
    /// In the world.
    pub bounds: Bounds,
}

impl Instance {
    /// The prototype of number `index`, placed.
    pub fn new(index: u32, prototype: &MeshPrototype, to_world: &DAffine3) -> Self {
        let map = AffineMap::new(to_world);
        Instance { prototype: index, map, bounds: map.bounds(prototype.bounds) }
    }

    /// The ray in the prototype's space, the length in the world of one unit along it there, and the distance in the world
    /// before which nothing of the instance is met: hits are held to its bounds, where an accelerator will look for
    /// them. `None` if it is not met before `limit`.
    pub fn enter(&self, ray: &PreparedRay, limit: f32) -> Option<(PreparedRay, f32, f32)> {
        let [near, far] = (BoxPrim { min: self.bounds.min, max: self.bounds.max }).span(ray)?;
        if far <= 0.0 || near > limit {
            return None;
        }
        let (local, per_unit) = self.map.local_ray(ray);
        Some((local, per_unit, near.max(0.0)))
    }
}

/// All instances, and the prototypes that they are of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instances {
    prototypes: Vec<MeshPrototype>,
    instances: Vec<Instance>,
    tags: Vec<Tag>,
}

impl Instances {
    pub fn push(&mut self, tag: Tag, mesh: &Arc<MeshData>, smooth: bool, to_world: &DAffine3) {
        // The latest are the likeliest.
        let known = self.prototypes.iter().rposition(|m| Arc::ptr_eq(&m.mesh, mesh) && m.smooth == smooth);
        let prototype = known.unwrap_or_else(|| {
            self.prototypes.push(MeshPrototype::new(mesh, smooth));
            self.prototypes.len() - 1
        });
        self.instances.push(Instance::new(prototype as u32, &self.prototypes[prototype], to_world));
        self.tags.push(tag);
    }

    pub fn prototypes(&self) -> &[MeshPrototype] {
        &self.prototypes
    }

    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    fn of(&self, i: usize) -> (&Instance, &MeshPrototype) {
        let instance = &self.instances[i];
        (instance, &self.prototypes[instance.prototype as usize])
    }
}

impl PrimitiveColumn for Instances {
    const IS_SAMPLED: bool = true;
    type Area = AreaTriangle;

    fn len(&self) -> usize {
        self.instances.len()
    }

    #[inline]
    fn tag(&self, i: usize) -> Tag {
        self.tags[i]
    }

    fn bounds(&self, i: usize) -> Bounds {
        self.instances[i].bounds
    }

    fn intersect(&self, i: usize, number: u32, ray: &PreparedRay, closest: &mut ClosestHit) {
        let ((instance, prototype), sides) = (self.of(i), self.tags[i].sides);
        let Some((local, per_unit, near)) = instance.enter(ray, closest.t) else { return };
        for element in 0..prototype.mesh.triangles.len() as u32 {
            if let Some((t, u, v, front)) = intersect_corners(&local, &prototype.corners(element))
                && sides.shows(front)
            {
                closest.offer((t * per_unit).max(near), number, element, u, v);
            }
        }
    }

    #[inline]
    fn surface_point(&self, i: usize, _: &Ray, _: impl Fn() -> Vec3, hit: &Hit) -> SurfacePoint {
        let (instance, prototype) = self.of(i);
        let shading = prototype.shading_normal(hit.element, hit.u, hit.v);
        let ShadedPoint { bare, shading_normal } = on_triangle(&prototype.corners(hit.element), hit, shading);
        let map = &instance.map;
        let (point, error) = map.world_point(bare.point, bare.error);
        let bare = BarePoint { point, normal: map.world_normal(bare.normal), error };
        ShadedPoint { bare, shading_normal: map.world_normal(shading_normal) }.of(self.tags[i])
    }

    fn uv(&self, i: usize, hit: &Hit, surface: &SurfacePoint, space: &ObjectSpace) -> SurfaceUv {
        let (_, prototype) = self.of(i);
        let uvs = prototype.uvs(hit.element, false);
        wrapped(surface, space)
            .filter(|_| uvs.is_none())
            .unwrap_or_else(|| patch(prototype.corners(hit.element), uvs, hit).carried(&space.map, surface))
    }

    fn second_uv(&self, i: usize, hit: &Hit, surface: &SurfacePoint, space: &ObjectSpace) -> Option<SurfaceUv> {
        let (_, prototype) = self.of(i);
        let uvs = prototype.uvs(hit.element, true)?;
        Some(patch(prototype.corners(hit.element), Some(uvs), hit).carried(&space.map, surface))
    }

    fn smooth_facet(&self, i: usize, hit: &Hit) -> Option<SmoothFacet> {
        let (Instance { map, .. }, prototype) = self.of(i);
        let mesh = prototype.smooth.then_some(&prototype.mesh)?;
        let at = mesh.triangles[hit.element as usize];
        let corners = prototype.corners(hit.element).map(|p| map.to_world * p + map.anchor);
        Some(SmoothFacet { corners, normals: at.map(|i| map.world_normal(mesh.shading_normals()[i as usize])) })
    }

    fn vertex_color(&self, i: usize, hit: &Hit) -> Vec4 {
        mixed_color(&self.of(i).1.mesh, hit.element, hit.u, hit.v)
    }

    fn area_shapes(&self, wanted: &dyn Fn(Tag) -> bool, visit: &mut dyn FnMut(usize, u32, Tag, AreaTriangle)) {
        for (i, tag) in self.tags.iter().enumerate().filter(|(_, tag)| wanted(**tag)) {
            let (Instance { map, .. }, prototype) = self.of(i);
            for element in 0..prototype.mesh.triangles.len() as u32 {
                let [a, b, c] = prototype.corners(element);
                let outward = map.normals * (b - a).cross(c - a);
                let [a, b, c] = [a, b, c].map(|p| map.to_world * p + map.anchor);
                let turned = (b - a).cross(c - a).dot(outward) < 0.0;
                let corners = if turned { [a, c, b] } else { [a, b, c] };
                visit(i, element, *tag, AreaTriangle::new(corners));
            }
        }
    }
}
