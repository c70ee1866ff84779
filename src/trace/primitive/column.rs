//! What every kind of primitive provides: a column of shapes, or something that answers like one.

use glam::{Vec3, Vec4};

use super::area::AreaSampling;
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::interaction::InteractionLanes;
use super::prepared_ray::PreparedRay;
use super::surface::{BarePoint, SurfacePoint};
use super::tag::{Sides, Tag};
use super::terminator::SmoothFacet;
use super::uv::{ObjectSpace, SurfaceUv, UvPoint};
use crate::trace::soa::{Hit, Ray};

/// The primitives of one kind, counted from 0.
pub trait PrimitiveColumn {
    /// Whether lights can be sampled on them, if their material emits light.
    const IS_SAMPLED: bool;
    /// What is sampled; [`super::area::NoArea`] for nothing.
    type Area: AreaSampling;

    fn len(&self) -> usize;
    fn tag(&self, i: usize) -> Tag;

    /// Bounds of one, exact up to rounding; empty for what has none.
    fn bounds(&self, i: usize) -> Bounds;

    /// Bounds of all.
    fn all_bounds(&self) -> Bounds {
        (0..self.len()).map(|i| self.bounds(i)).fold(Bounds::default(), Bounds::union)
    }

    /// Keeps the hit of one, which has this number among all primitives, if it is nearer than the closest so far.
    fn intersect(&self, i: usize, number: u32, ray: &PreparedRay, closest: &mut ClosestHit);

    /// The point that was met, facing outwards. `near` is where the ray says that it is, as exactly as `f32` can tell.
    fn surface_point(&self, i: usize, ray: &Ray, near: impl Fn() -> Vec3, hit: &Hit) -> SurfacePoint;

    /// Texture coordinates of that point; `space` is the local space of its entity.
    fn uv(&self, i: usize, hit: &Hit, surface: &SurfacePoint, space: &ObjectSpace) -> SurfaceUv;

    /// As [`Self::uv`] by the second texture coordinates of a mesh, if it has any.
    fn second_uv(&self, _: usize, _: &Hit, _: &SurfacePoint, _: &ObjectSpace) -> Option<SurfaceUv> {
        None
    }

    /// The facet that was met, if it is one of a surface that is shaded as if it were round.
    fn smooth_facet(&self, i: usize, hit: &Hit) -> Option<SmoothFacet> {
        let _ = (i, hit);
        None
    }

    /// The colour that the vertices of a mesh give that point: red, green, blue, and alpha.
    fn vertex_color(&self, i: usize, hit: &Hit) -> Vec4 {
        let _ = (i, hit);
        Vec4::ONE
    }

    /// Puts one that was met at these parameters into its lane, where points are found side by side; false if it is not
    /// of the kinds for which they are.
    #[inline(always)]
    fn gather(&self, i: usize, uv: [f32; 2], lane: usize, lanes: &mut InteractionLanes) -> bool {
        let _ = (i, uv, lane, lanes);
        false
    }

    /// Calls `visit` with all that can be sampled and whose tags are `wanted`: number among its kind, element, tag and
    /// shape in the world.
    fn area_shapes(&self, wanted: &dyn Fn(Tag) -> bool, visit: &mut dyn FnMut(usize, u32, Tag, Self::Area)) {
        let _ = (wanted, visit);
    }
}

/// A shape that is stored by itself.
pub trait PrimitiveShape {
    /// As [`PrimitiveColumn::IS_SAMPLED`].
    const IS_SAMPLED: bool;
    /// As [`PrimitiveColumn::Area`].
    type Area: AreaSampling;

    /// As [`PrimitiveColumn::bounds`].
    fn bounds(&self) -> Bounds;

    /// As [`PrimitiveColumn::intersect`].
    fn intersect(&self, ray: &PreparedRay, sides: Sides, number: u32, closest: &mut ClosestHit);

    /// As [`PrimitiveColumn::surface_point`].
    fn locate(&self, ray: &Ray, near: impl Fn() -> Vec3, hit: &Hit) -> BarePoint;

    /// Texture coordinates in the local space of the entity.
    fn uv(&self, at: &UvPoint, hit: &Hit) -> SurfaceUv;

    /// As [`PrimitiveColumn::gather`].
    #[inline(always)]
    fn gather(&self, lane: usize, lanes: &mut InteractionLanes) -> bool {
        let _ = (lane, lanes);
        false
    }

    /// The shape as it is sampled.
    fn area_shape(&self) -> Option<Self::Area> {
        None
    }
}

/// Shapes of one kind, and what they belong to.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeColumn<S> {
    pub shapes: Vec<S>,
    tags: Vec<Tag>,
}

impl<S> Default for ShapeColumn<S> {
    fn default() -> Self {
        ShapeColumn { shapes: Vec::new(), tags: Vec::new() }
    }
}

impl<S> ShapeColumn<S> {
    pub fn push(&mut self, tag: Tag, shape: S) {
        self.shapes.push(shape);
        self.tags.push(tag);
    }
}

impl<S: PrimitiveShape> PrimitiveColumn for ShapeColumn<S> {
    const IS_SAMPLED: bool = S::IS_SAMPLED;
    type Area = S::Area;

    fn len(&self) -> usize {
        self.shapes.len()
    }

    #[inline]
    fn tag(&self, i: usize) -> Tag {
        self.tags[i]
    }

    fn bounds(&self, i: usize) -> Bounds {
        self.shapes[i].bounds()
    }

    fn intersect(&self, i: usize, number: u32, ray: &PreparedRay, closest: &mut ClosestHit) {
        self.shapes[i].intersect(ray, self.tags[i].sides, number, closest);
    }

    #[inline]
    fn surface_point(&self, i: usize, ray: &Ray, near: impl Fn() -> Vec3, hit: &Hit) -> SurfacePoint {
        self.shapes[i].locate(ray, near, hit).of(self.tags[i])
    }

    fn uv(&self, i: usize, hit: &Hit, surface: &SurfacePoint, space: &ObjectSpace) -> SurfaceUv {
        self.shapes[i].uv(&UvPoint::new(surface, &space.map), hit).carried(&space.map, surface)
    }

    #[inline(always)]
    fn gather(&self, i: usize, _: [f32; 2], lane: usize, lanes: &mut InteractionLanes) -> bool {
        self.shapes[i].gather(lane, lanes)
    }

    fn area_shapes(&self, wanted: &dyn Fn(Tag) -> bool, visit: &mut dyn FnMut(usize, u32, Tag, S::Area)) {
        for (i, (shape, tag)) in self.shapes.iter().zip(&self.tags).enumerate() {
            if let Some(shape) = shape.area_shape().filter(|_| wanted(*tag)) {
                visit(i, 0, *tag, shape);
            }
        }
    }
}
