//! Primitives as columns, one set per kind, numbered through.
//!
//! After [`Geometry::finish`] numbers run over the kinds in a fixed order (spheres, triangles, boxes, cones, placed
//! shapes, triangles of meshes, instances of meshes, planes), so that the kind of a primitive is a comparison of its
//! number. Where two primitives are met at the same distance the lower number wins, whatever finds them: pictures do
//! not depend on the accelerator.
//!
//! A mesh of one entity stands in the world: its triangles have numbers of their own. A mesh that several entities
//! share is a [`MeshPrototype`] in its own space, and each [`Instance`] of it is one number.

use std::ops::Range;
use std::sync::Arc;

use glam::{DAffine3, Vec2, Vec3};

use super::bounds::Bounds;
use super::mesh::{BakedMesh, Instance, MeshPrototype};
use super::shapes::ConeFrustum;
use super::tag::Tag;
use super::transformed::{LocalShape, TransformedShape, cone_bounds};
use crate::components::MeshData;
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::Ray;

/// The kinds of primitives, in the order of their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PrimitiveKind {
    Sphere,
    Triangle,
    Box,
    Cone,
    TransformedShape,
    /// A triangle of a mesh that stands in the world.
    MeshTriangle,
    Instance,
    /// Without bounds.
    Plane,
}

const KINDS: [PrimitiveKind; 8] = [
    PrimitiveKind::Sphere,
    PrimitiveKind::Triangle,
    PrimitiveKind::Box,
    PrimitiveKind::Cone,
    PrimitiveKind::TransformedShape,
    PrimitiveKind::MeshTriangle,
    PrimitiveKind::Instance,
    PrimitiveKind::Plane,
];

/// Number at which each kind ends: two geometries of one layout have the same kinds under the same numbers.
pub type PrimitiveLayout = [u32; KINDS.len()];

/// Number of a flat triangle's shading normals.
const FLAT: u32 = u32::MAX;

/// All primitives of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Centre and radius.
    pub(super) spheres: Vec<[f32; 4]>,
    pub(super) triangles: Vec<[Vec3; 3]>,
    /// Index into `normals` per triangle.
    pub(super) shading: Vec<u32>,
    pub(super) normals: Vec<[Vec3; 3]>,
    /// Texture coordinates of the triangles that have any, by their index, rising.
    pub(super) uvs: Vec<(u32, [Vec2; 3])>,
    pub(super) boxes: Vec<[Vec3; 2]>,
    pub(super) cones: Vec<ConeFrustum>,
    pub(super) placed: Vec<TransformedShape>,
    parts: Vec<BakedMesh>,
    pub(super) models: Vec<MeshPrototype>,
    pub(super) instances: Vec<Instance>,
    /// Point and unit normal.
    pub(super) planes: Vec<[Vec3; 2]>,
    /// Bounds of cones, then of placed shapes: what their hits are held to.
    pub(super) solid_bounds: Vec<Bounds>,
    /// Tags by kind; those of mesh triangles are with their part.
    tags: [Vec<Tag>; KINDS.len()],
    mesh_triangles: usize,
    /// Number at which each kind ends.
    ends: PrimitiveLayout,
    bounds: Bounds,
    /// Middle and diagonal of the bounds.
    center: Vec3,
    reach: f32,
    /// Square of the distance from the middle at which rays start far away.
    far: f32,
}

impl Geometry {
    /// A negative radius turns the inside out: what is around the sphere is made of its material, as around a bubble.
    pub fn push_sphere(&mut self, tag: Tag, center: Vec3, radius: f32) {
        self.spheres.push([center.x, center.y, center.z, radius]);
        self.tags[PrimitiveKind::Sphere as usize].push(tag);
    }

    /// Corners are counter-clockwise seen from the front; `normals` of any length shade it smoothly.
    pub fn push_triangle(&mut self, tag: Tag, corners: [Vec3; 3], normals: Option<[Vec3; 3]>) {
        self.triangles.push(corners);
        self.shading.push(normals.map_or(FLAT, |_| self.normals.len() as u32));
        self.normals.extend(normals);
        self.tags[PrimitiveKind::Triangle as usize].push(tag);
    }

    /// Texture coordinates of the corners of the triangle that was pushed last.
    pub fn texture_triangle(&mut self, uvs: [Vec2; 3]) {
        if let Some(last) = self.triangles.len().checked_sub(1) {
            self.uvs.push((last as u32, uvs));
        }
    }

    /// A box along the world's axes.
    pub fn push_box(&mut self, tag: Tag, min: Vec3, max: Vec3) {
        self.boxes.push([min, max]);
        self.tags[PrimitiveKind::Box as usize].push(tag);
    }

    pub fn push_cone(&mut self, tag: Tag, base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool) {
        self.cones.push(ConeFrustum::new(base, base_radius, apex, apex_radius, capped));
        self.tags[PrimitiveKind::Cone as usize].push(tag);
    }

    /// Any shape under any invertible affine map.
    pub fn push_transformed(&mut self, tag: Tag, shape: LocalShape, to_world: &DAffine3) {
        self.placed.push(TransformedShape::new(shape, to_world));
        self.tags[PrimitiveKind::TransformedShape as usize].push(tag);
    }

    /// A mesh whose triangles become primitives; `smooth` shades it by the normals of its vertices.
    pub fn push_mesh(&mut self, tag: Tag, mesh: &Arc<MeshData>, smooth: bool, to_world: &DAffine3) {
        self.mesh_triangles += mesh.triangles.len();
        self.parts.push(BakedMesh::new(tag, mesh, smooth, to_world));
    }

    /// A mesh that is stored once however often it is used.
    pub fn push_instance(&mut self, tag: Tag, mesh: &Arc<MeshData>, smooth: bool, to_world: &DAffine3) {
        // The latest are the likeliest.
        let known = self.models.iter().rposition(|m| Arc::ptr_eq(&m.mesh, mesh) && m.smooth == smooth);
        let model = known.unwrap_or_else(|| {
            self.models.push(MeshPrototype::new(mesh, smooth));
            self.models.len() - 1
        });
        self.instances.push(Instance::new(model as u32, &self.models[model], to_world));
        self.tags[PrimitiveKind::Instance as usize].push(tag);
    }

    /// `normal` is unit.
    pub fn push_plane(&mut self, tag: Tag, point: Vec3, normal: Vec3) {
        self.planes.push([point, normal]);
        self.tags[PrimitiveKind::Plane as usize].push(tag);
    }

    /// Numbers the primitives and computes what is derived; to be called once, after the last push.
    pub fn finish(&mut self) {
        let mut end = 0;
        for kind in KINDS {
            if kind == PrimitiveKind::MeshTriangle {
                for part in &mut self.parts {
                    part.first = end;
                    end += part.mesh.triangles.len() as u32;
                }
            }
            end += self.tags[kind as usize].len() as u32;
            self.ends[kind as usize] = end;
        }
        let cones = self.cones.iter().map(cone_bounds);
        self.solid_bounds = cones.chain(self.placed.iter().map(TransformedShape::bounds)).collect();
        let loose = (0..self.range(PrimitiveKind::TransformedShape).end)
            .fold(Bounds::default(), |b, n| b.union(self.bounds_of(n)));
        let parts = self.parts.iter().map(BakedMesh::bounds);
        self.bounds = parts.chain(self.instances.iter().map(|i| i.bounds)).fold(loose, Bounds::union);
        self.reach = self.bounds.size().length();
        (self.center, self.far) = match self.bounds.is_empty() {
            true => (Vec3::ZERO, f32::INFINITY),
            false => (self.bounds.center(), 16.0 * self.reach * self.reach),
        };
    }

    /// Number of primitives so far.
    pub fn len(&self) -> usize {
        self.mesh_triangles + self.tags.iter().map(Vec::len).sum::<usize>()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Primitives below this number have bounds; planes follow.
    pub fn finite(&self) -> u32 {
        self.ends[PrimitiveKind::Instance as usize]
    }

    pub fn layout(&self) -> PrimitiveLayout {
        self.ends
    }

    /// Numbers of one kind.
    pub fn range(&self, kind: PrimitiveKind) -> Range<u32> {
        let start = if kind == PrimitiveKind::Sphere { 0 } else { self.ends[kind as usize - 1] };
        start..self.ends[kind as usize]
    }

    #[inline]
    pub fn kind_of(&self, number: u32) -> PrimitiveKind {
        KINDS[self.ends.iter().position(|end| number < *end).unwrap_or(KINDS.len() - 1)]
    }

    /// What the primitive belongs to.
    #[inline]
    pub fn tag(&self, number: u32) -> Tag {
        match self.kind_of(number) {
            PrimitiveKind::MeshTriangle => self.part_of(number).tag,
            kind => self.tags[kind as usize][(number - self.range(kind).start) as usize],
        }
    }

    /// The mesh that a mesh triangle is part of.
    pub(super) fn part_of(&self, number: u32) -> &BakedMesh {
        &self.parts[self.parts.partition_point(|part| part.first <= number) - 1]
    }

    pub fn models(&self) -> &[MeshPrototype] {
        &self.models
    }

    pub fn parts(&self) -> &[BakedMesh] {
        &self.parts
    }

    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    pub fn instance(&self, number: u32) -> &Instance {
        &self.instances[(number - self.range(PrimitiveKind::Instance).start) as usize]
    }

    /// Centre and radius.
    pub fn sphere(&self, number: u32) -> [f32; 4] {
        self.spheres[number as usize]
    }

    /// Corners of a triangle, whether it stands alone or in a mesh.
    pub fn corners(&self, number: u32) -> [Vec3; 3] {
        self.tagged_triangle(number).0
    }

    /// Corners of a triangle and what it belongs to, whether it stands alone or in a mesh.
    #[inline]
    pub fn tagged_triangle(&self, number: u32) -> ([Vec3; 3], Tag) {
        let alone = self.range(PrimitiveKind::Triangle);
        if alone.contains(&number) {
            let index = (number - alone.start) as usize;
            return (self.triangles[index], self.tags[PrimitiveKind::Triangle as usize][index]);
        }
        let part = self.part_of(number);
        (part.corners(number - part.first), part.tag)
    }

    /// Least and greatest corner of a box.
    pub fn aabox(&self, number: u32) -> [Vec3; 2] {
        self.boxes[(number - self.range(PrimitiveKind::Box).start) as usize]
    }

    pub fn cone(&self, number: u32) -> ConeFrustum {
        self.cones[(number - self.range(PrimitiveKind::Cone).start) as usize]
    }

    /// Bounds of all primitives but the planes.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Bounds of one finite primitive, exact up to rounding.
    pub fn bounds_of(&self, number: u32) -> Bounds {
        match self.kind_of(number) {
            PrimitiveKind::Sphere => {
                let [x, y, z, r] = self.sphere(number);
                let c = Vec3::new(x, y, z);
                Bounds { min: c - r.abs(), max: c + r.abs() }
            }
            PrimitiveKind::Triangle | PrimitiveKind::MeshTriangle => Bounds::around(&self.corners(number)),
            PrimitiveKind::Box => {
                let [min, max] = self.aabox(number);
                Bounds { min, max }
            }
            PrimitiveKind::Cone | PrimitiveKind::TransformedShape => {
                self.solid_bounds[(number - self.range(PrimitiveKind::Cone).start) as usize]
            }
            PrimitiveKind::Instance => self.instance(number).bounds,
            PrimitiveKind::Plane => Bounds::default(),
        }
    }

    /// Distance from the centre of `bounds` within which no ray that starts there would be moved by [`Self::approach`],
    /// for primitives within `bounds`.
    pub fn nearness(bounds: Bounds) -> f32 {
        // With room for the roundings of the one that decides.
        if bounds.is_empty() { f32::INFINITY } else { 3.99 * bounds.size().length() }
    }

    /// A ray that starts far from all finite primitives, moved up to them: distance moved, and the ray from there.
    ///
    /// Precision then does not depend on how far away the camera is. Whatever finds primitives goes through this.
    #[inline(always)]
    pub fn approach(&self, ray: &Ray) -> (f32, Ray) {
        let (skip, origin) = self.approached::<f32>(ray.origin.into(), ray.direction.into());
        (skip, Ray { origin: origin.into(), t_max: ray.t_max - skip, ..*ray })
    }

    /// As [`Self::approach`]: distances moved, and where rays with these origins and directions start then.
    #[inline(always)]
    pub fn approached<L: Lanes>(&self, origin: V3<L>, direction: V3<L>) -> (L, V3<L>) {
        let zero = L::splat(0.0);
        let to_center = V3::splat(self.center) - origin;
        let far = L::splat(self.far).le(to_center.dot(to_center));
        if !L::any(far) {
            return (zero, origin);
        }
        let skip = L::select(far, (to_center.dot(direction) - L::splat(self.reach)).max(zero), zero);
        let moved = L::and(far, zero.lt(skip));
        (skip, V3::select(moved, origin + direction.scale(skip), origin))
    }
}
