//! The point that a ray met: where it is, how exactly that is known, and which way is out.

use glam::Vec3;

use super::tag::Tag;
use crate::trace::simd::{Lanes, V3};

/// A bound for the rounding error of a handful of operations, relative to the size of their operands: twice the
/// gamma(4) of Higham that `pbrt` uses (pbrt-v4, section 6.8), since the test that a leaving ray meets errs too.
pub const ROUNDING: f32 = 8.0 * (f32::EPSILON / 2.0);

/// The point that a ray met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    pub point: Vec3,
    /// Bound of the rounding error of `point`, per axis.
    pub error: Vec3,
    /// Unit, towards the front (outside) whatever side the ray came from.
    pub geometric_normal: Vec3,
    /// Unit, on the same side as the geometric normal.
    pub shading_normal: Vec3,
    /// Whether a map has bent the shading normal.
    pub bent: bool,
    pub material: u32,
    pub entity: u32,
}

/// A point of a primitive, before it is known what that belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarePoint {
    pub point: Vec3,
    /// Unit, outwards.
    pub normal: Vec3,
    /// Bound of the rounding error of `point`, per axis.
    pub error: Vec3,
}

impl BarePoint {
    /// The point of a primitive that belongs to this.
    #[inline(always)]
    pub fn of(self, tag: Tag) -> SurfacePoint {
        let (BarePoint { point, normal, error }, Tag { material, entity, .. }) = (self, tag);
        SurfacePoint { point, error, geometric_normal: normal, shading_normal: normal, bent: false, material, entity }
    }
}

/// Points side by side; as [`SurfacePoint`].
#[derive(Clone, Copy, Debug)]
pub struct SurfacePointLanes<L> {
    pub point: V3<L>,
    pub error: V3<L>,
    pub geometric_normal: V3<L>,
    pub shading_normal: V3<L>,
}

impl<L: Lanes> SurfacePointLanes<L> {
    /// Takes point, error, geometric and shading normal into some lanes.
    #[inline(always)]
    pub fn put(&mut self, mask: L::Mask, [point, error, geometric, shading]: [V3<L>; 4]) {
        self.point = V3::select(mask, point, self.point);
        self.error = V3::select(mask, error, self.error);
        self.geometric_normal = V3::select(mask, geometric, self.geometric_normal);
        self.shading_normal = V3::select(mask, shading, self.shading_normal);
    }

    /// The sides that face against these directions.
    #[inline(always)]
    pub fn facing(self, direction: V3<L>) -> Self {
        let front = direction.dot(self.geometric_normal).lt(L::splat(0.0));
        let (geometric, shading) = (self.geometric_normal, self.shading_normal);
        SurfacePointLanes {
            geometric_normal: V3::select(front, geometric, -geometric),
            shading_normal: V3::select(front, shading, -shading),
            ..self
        }
    }

    /// See [`SurfacePoint::leave`].
    #[inline(always)]
    pub fn offset_origin(&self, direction: V3<L>) -> V3<L> {
        offset_origin(self.point, self.error, self.geometric_normal, direction)
    }
}

impl SurfacePoint {
    /// The same point seen from the other side: both normals turned round.
    #[inline(always)]
    pub fn flipped(self) -> SurfacePoint {
        SurfacePoint { geometric_normal: -self.geometric_normal, shading_normal: -self.shading_normal, ..self }
    }

    /// A start for a ray that leaves towards `direction`, off the surface by no more than the rounding error.
    #[inline(always)]
    pub fn offset_origin(&self, direction: Vec3) -> Vec3 {
        let [point, error, normal] = [self.point, self.error, self.geometric_normal].map(V3::<f32>::from);
        offset_origin(point, error, normal, direction.into()).into()
    }
}

/// See [`SurfacePoint::leave`].
#[inline(always)]
pub fn offset_origin<L: Lanes>(point: V3<L>, error: V3<L>, normal: V3<L>, direction: V3<L>) -> V3<L> {
    let zero = L::splat(0.0);
    let side = V3::select(normal.dot(direction).lt(zero), -normal, normal);
    let offset = side.scale(normal.abs().dot(error));
    // Where nothing was rounded the point lies on the surface to the last bit: off it, by the least that counts.
    let offset = offset + side.scale(L::splat(LEAST_OFFSET));
    V3 { x: away(point.x, offset.x), y: away(point.y, offset.y), z: away(point.z, offset.z) }
}

/// Far below what `f32` resolves beside any coordinate but 0, and far above its denormal numbers.
const LEAST_OFFSET: f32 = 1e-30;

/// The sum, rounded away from the first.
#[inline(always)]
fn away<L: Lanes>(p: L, offset: L) -> L {
    let (zero, sum) = (L::splat(0.0), p + offset);
    L::select(zero.lt(offset), sum.next_up(), L::select(offset.lt(zero), sum.next_down(), p))
}
