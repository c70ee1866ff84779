//! All primitives of a frame, one column per kind, numbered through.
//!
//! After [`Geometry::finish`] numbers run over the kinds in the order of their list, so that the kind of a primitive is a
//! comparison of its number. Where two primitives are met at the same distance the lower number wins, whatever finds them:
//! pictures do not depend on the accelerator.
//!
//! A mesh of one entity stands in the world: its triangles have numbers of their own. A mesh that several entities
//! share is a [`MeshPrototype`] in its own space, and each [`Instance`] of it is one number.

use std::ops::Range;
use std::sync::Arc;

use glam::{DAffine3, Vec2, Vec3, Vec4};

use super::aabox::BoxPrim;
use super::area_shape::AreaShape;
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::{PrimitiveColumn, ShapeColumn};
use super::cone::{ConeFrustum, ConePrim};
use super::instance::{Instance, Instances, MeshPrototype};
use super::interaction::InteractionLanes;
use super::mesh::{BakedMesh, BakedMeshes};
use super::plane::PlanePrim;
use super::prepared_ray::PreparedRay;
use super::sphere::SpherePrim;
use super::surface::SurfacePoint;
use super::tag::Tag;
use super::transformed::{LocalShape, TransformedShape};
use super::triangle::Triangles;
use super::uv::{ObjectSpace, SurfaceUv};
use crate::components::MeshData;
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::{Hit, Ray};

/// Declares the kinds of primitives, `Kind in column: Column`, in the order of their numbers, and what is asked of any of
/// them.
macro_rules! primitives {
    ($( $(#[$doc:meta])* $Kind:ident in $column:ident: $Column:ty ),* $(,)?) => {
        /// The kinds of primitives, in the order of their numbers.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum PrimitiveKind { $( $(#[$doc])* $Kind ),* }

        impl PrimitiveKind {
            /// All kinds, in the order of their numbers.
            pub const ALL: [PrimitiveKind; [$( stringify!($Kind) ),*].len()] = [$( PrimitiveKind::$Kind ),*];

            /// Whether lights can be sampled on primitives of this kind.
            pub fn is_sampled(self) -> bool {
                match self { $( PrimitiveKind::$Kind => <$Column>::IS_SAMPLED ),* }
            }
        }

        /// All primitives of a frame.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct Geometry {
            $( $column: $Column, )*
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
            fn len_of(&self, kind: PrimitiveKind) -> usize {
                match kind { $( PrimitiveKind::$Kind => self.$column.len() ),* }
            }

            fn bounds_of_all(&self, kind: PrimitiveKind) -> Bounds {
                match kind { $( PrimitiveKind::$Kind => self.$column.all_bounds() ),* }
            }

            /// What the primitive belongs to.
            #[inline]
            pub fn tag(&self, number: u32) -> Tag {
                let (kind, i) = self.place(number);
                match kind { $( PrimitiveKind::$Kind => self.$column.tag(i) ),* }
            }

            /// Bounds of one primitive, exact up to rounding; empty for what has none.
            pub fn bounds_of(&self, number: u32) -> Bounds {
                let (kind, i) = self.place(number);
                match kind { $( PrimitiveKind::$Kind => self.$column.bounds(i) ),* }
            }

            /// Tests one primitive and keeps it if it is nearer than the closest so far, or as near and lower in number.
            pub fn intersect(&self, number: u32, ray: &PreparedRay, closest: &mut ClosestHit) {
                let (kind, i) = self.place(number);
                match kind { $( PrimitiveKind::$Kind => self.$column.intersect(i, number, ray, closest) ),* }
            }

            /// The point of a hit of this ray.
            #[inline]
            pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
                let (kind, i) = self.place(hit.primitive);
                let near = || {
                    let (_, ray) = self.approach(ray);
                    ray.origin + ray.direction * hit.u
                };
                match kind { $( PrimitiveKind::$Kind => self.$column.surface_point(i, ray, near, hit) ),* }
            }

            /// Texture coordinates of a hit. `surface` faces outwards; `space` is that of its entity.
            ///
            /// With `second` those of a mesh are its second ones, if it has any.
            pub fn surface_uv(
                &self,
                hit: &Hit,
                surface: &SurfacePoint,
                space: &ObjectSpace,
                second: bool,
            ) -> SurfaceUv {
                let (kind, i) = self.place(hit.primitive);
                let second = second.then(|| match kind {
                    $( PrimitiveKind::$Kind => self.$column.second_uv(i, hit, surface, space) ),*
                });
                if let Some(found) = second.flatten() {
                    return found;
                }
                match kind { $( PrimitiveKind::$Kind => self.$column.uv(i, hit, surface, space) ),* }
            }

            /// Where rays start that leave a hit towards light which its smooth normal faces and its facet does not, if the
            /// surface bulges there. `surface` faces the side that is seen.
            pub fn smooth_start(&self, hit: &Hit, surface: &SurfacePoint) -> Option<Vec3> {
                let (kind, i) = self.place(hit.primitive);
                let facet = match kind { $( PrimitiveKind::$Kind => self.$column.smooth_facet(i, hit) ),* };
                facet?.start(hit, surface)
            }

            /// The colour that the vertices of a mesh give the point of a hit: red, green, blue, and alpha.
            pub fn vertex_color(&self, hit: &Hit) -> Vec4 {
                let (kind, i) = self.place(hit.primitive);
                match kind { $( PrimitiveKind::$Kind => self.$column.vertex_color(i, hit) ),* }
            }

            /// Puts the primitive that a ray met at these parameters into its lane; false for kinds without lanes.
            #[inline(always)]
            pub(super) fn gather(&self, number: u32, uv: [f32; 2], lane: usize, lanes: &mut InteractionLanes) -> bool {
                let (kind, i) = self.place(number);
                match kind { $( PrimitiveKind::$Kind => self.$column.gather(i, uv, lane, lanes) ),* }
            }

            /// Calls `visit` with all that can be sampled and whose tags are `wanted`, in the order of hits: number,
            /// element, tag and shape.
            pub fn area_shapes(
                &self,
                wanted: &dyn Fn(Tag) -> bool,
                visit: &mut dyn FnMut(u32, u32, Tag, AreaShape),
            ) {
                $(
                    let first = self.range(PrimitiveKind::$Kind).start;
                    self.$column.area_shapes(wanted, &mut |i, element, tag, shape| {
                        visit(first + i as u32, element, tag, shape.into());
                    });
                )*
            }
        }
    };
}

primitives! {
    /// A sphere.
    Sphere in spheres: ShapeColumn<SpherePrim>,
    /// A triangle of its own.
    Triangle in triangles: Triangles,
    /// A box along the axes.
    Box in boxes: ShapeColumn<BoxPrim>,
    /// A cone or cylinder.
    Cone in cones: ShapeColumn<ConePrim>,
    /// A shape under an affine map.
    Transformed in transformed: ShapeColumn<TransformedShape>,
    /// A triangle of a mesh that stands in the world.
    MeshTriangle in baked: BakedMeshes,
    /// A mesh under an affine map.
    Instance in instances: Instances,
    /// Without bounds, and therefore last.
    Plane in planes: ShapeColumn<PlanePrim>,
}

/// Number at which each kind ends: two geometries of one layout have the same kinds under the same numbers.
pub type PrimitiveLayout = [u32; PrimitiveKind::ALL.len()];

impl Geometry {
    /// Adds a sphere.
    pub fn push_sphere(&mut self, tag: Tag, center: Vec3, radius: f32) {
        self.spheres.push(tag, SpherePrim { center, radius });
    }

    /// Corners are counter-clockwise seen from the front; `normals` of any length shade it smoothly.
    pub fn push_triangle(&mut self, tag: Tag, corners: [Vec3; 3], normals: Option<[Vec3; 3]>) {
        self.triangles.push(tag, corners, normals);
    }

    /// Texture coordinates of the corners of the triangle that was pushed last.
    pub fn texture_triangle(&mut self, uvs: [Vec2; 3]) {
        self.triangles.texture_last(uvs);
    }

    /// A box along the world's axes.
    pub fn push_box(&mut self, tag: Tag, min: Vec3, max: Vec3) {
        self.boxes.push(tag, BoxPrim { min, max });
    }

    /// See [`ConeFrustum::new`].
    pub fn push_cone(&mut self, tag: Tag, base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool) {
        self.cones.push(tag, ConePrim::new(ConeFrustum::new(base, base_radius, apex, apex_radius, capped)));
    }

    /// Any shape under any invertible affine map.
    pub fn push_transformed(&mut self, tag: Tag, shape: LocalShape, to_world: &DAffine3) {
        self.transformed.push(tag, TransformedShape::new(shape, to_world));
    }

    /// A mesh whose triangles become primitives; `smooth` shades it by the normals of its vertices.
    pub fn push_mesh(&mut self, tag: Tag, mesh: &Arc<MeshData>, smooth: bool, to_world: &DAffine3) {
        self.baked.push(BakedMesh::new(tag, mesh, smooth, to_world));
    }

    /// A mesh that is stored once however often it is used.
    pub fn push_instance(&mut self, tag: Tag, mesh: &Arc<MeshData>, smooth: bool, to_world: &DAffine3) {
        self.instances.push(tag, mesh, smooth, to_world);
    }

    /// `normal` is unit.
    pub fn push_plane(&mut self, tag: Tag, point: Vec3, normal: Vec3) {
        self.planes.push(tag, PlanePrim { point, normal });
    }

    /// Numbers the primitives and computes what is derived; to be called once, after the last push.
    pub fn finish(&mut self) {
        let mut end = 0;
        for kind in PrimitiveKind::ALL {
            end += self.len_of(kind) as u32;
            self.ends[kind as usize] = end;
        }
        let bounds = PrimitiveKind::ALL.map(|kind| self.bounds_of_all(kind));
        self.bounds = bounds.into_iter().fold(Bounds::default(), Bounds::union);
        self.reach = self.bounds.size().length();
        (self.center, self.far) = match self.bounds.is_empty() {
            true => (Vec3::ZERO, f32::INFINITY),
            false => (self.bounds.center(), 16.0 * self.reach * self.reach),
        };
    }

    /// Number of primitives so far.
    pub fn len(&self) -> usize {
        PrimitiveKind::ALL.iter().map(|kind| self.len_of(*kind)).sum()
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Primitives below this number have bounds; planes follow.
    pub fn finite(&self) -> u32 {
        self.range(PrimitiveKind::Plane).start
    }

    /// Which numbers are of which kind.
    pub fn layout(&self) -> PrimitiveLayout {
        self.ends
    }

    /// Numbers of one kind.
    pub fn range(&self, kind: PrimitiveKind) -> Range<u32> {
        let start = (kind as usize).checked_sub(1).map_or(0, |before| self.ends[before]);
        start..self.ends[kind as usize]
    }

    /// The kind of a primitive by its number.
    #[inline]
    pub fn kind_of(&self, number: u32) -> PrimitiveKind {
        const LAST: usize = PrimitiveKind::ALL.len() - 1;
        PrimitiveKind::ALL[self.ends.iter().position(|end| number < *end).unwrap_or(LAST)]
    }

    /// The kind of a primitive, and its number among its kind.
    #[inline(always)]
    fn place(&self, number: u32) -> (PrimitiveKind, usize) {
        let kind = self.kind_of(number);
        (kind, (number - self.range(kind).start) as usize)
    }

    fn index(&self, kind: PrimitiveKind, number: u32) -> usize {
        (number - self.range(kind).start) as usize
    }

    /// Meshes that instances are of.
    pub fn prototypes(&self) -> &[MeshPrototype] {
        self.instances.prototypes()
    }

    /// All instances of meshes, in order.
    pub fn instances(&self) -> &[Instance] {
        self.instances.instances()
    }

    /// An instance by its number among all primitives.
    pub fn instance(&self, number: u32) -> &Instance {
        &self.instances()[self.index(PrimitiveKind::Instance, number)]
    }

    /// A sphere by its number among all primitives.
    pub fn sphere(&self, number: u32) -> SpherePrim {
        self.spheres.shapes[self.index(PrimitiveKind::Sphere, number)]
    }

    /// Corners of a triangle, whether it stands alone or in a mesh.
    pub fn corners(&self, number: u32) -> [Vec3; 3] {
        self.tagged_triangle(number).0
    }

    /// Corners of a triangle and what it belongs to, whether it stands alone or in a mesh.
    #[inline]
    pub fn tagged_triangle(&self, number: u32) -> ([Vec3; 3], Tag) {
        if self.range(PrimitiveKind::Triangle).contains(&number) {
            let i = self.index(PrimitiveKind::Triangle, number);
            return (self.triangles.corners(i), self.triangles.tag(i));
        }
        let (mesh, triangle) = self.baked.part(self.index(PrimitiveKind::MeshTriangle, number));
        (mesh.corners(triangle), mesh.tag)
    }

    /// A box by its number among all primitives.
    pub fn aabox(&self, number: u32) -> BoxPrim {
        self.boxes.shapes[self.index(PrimitiveKind::Box, number)]
    }

    /// A cone or cylinder by its number among all primitives.
    pub fn cone(&self, number: u32) -> ConeFrustum {
        self.cones.shapes[self.index(PrimitiveKind::Cone, number)].cone
    }

    /// Bounds of all primitives but the planes.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Distance from the centre of `bounds` within which no ray that starts there would be moved by [`Self::approach`],
    /// for primitives within `bounds`.
    pub fn nearness(bounds: Bounds) -> f32 {
        // With room for the roundings of the one that decides.
        if bounds.is_empty() { f32::INFINITY } else { 3.99 * bounds.size().length() }
    }

    /// A hit of a ray as one of the ray that it is the rest of.
    pub fn seen_from(&self, whole: &Ray, rest: &Ray, hit: Hit) -> Hit {
        let advanced = (rest.origin - whole.origin).dot(rest.direction);
        let t = hit.t + advanced;
        match self.kind_of(hit.primitive) {
            // These keep where along the ray they were met.
            PrimitiveKind::Sphere | PrimitiveKind::Box | PrimitiveKind::Cone | PrimitiveKind::Transformed => {
                let [(from, _), (to, _)] = [self.approach(rest), self.approach(whole)];
                Hit { t, u: hit.u + from + advanced - to, ..hit }
            }
            PrimitiveKind::Triangle | PrimitiveKind::MeshTriangle | PrimitiveKind::Instance | PrimitiveKind::Plane => {
                Hit { t, ..hit }
            }
        }
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
