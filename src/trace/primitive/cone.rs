//! Cones cut between two planes across their axis, cylinders among them.

use glam::{Vec2, Vec3};

use super::aabox::BoxPrim;
use super::affine::AffineMap;
use super::area::NoArea;
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveShape;
use super::prepared_ray::{PreparedRay, PreparedRayLanes};
use super::surface::{BarePoint, ROUNDING};
use super::tag::Sides;
use super::uv::{SurfaceUv, TURN, UvPoint};
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::{Hit, Ray};

/// A cone cut between two planes across its axis; a cylinder where the radii are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeFrustum {
    /// Centre of the base.
    pub base: Vec3,
    /// Unit, from base to apex.
    pub axis: Vec3,
    /// From the base to the other end, along the axis.
    pub height: f32,
    /// Radius of the base.
    pub base_radius: f32,
    /// Change of the radius per unit of height.
    pub slope: f32,
    /// Whether disks close it.
    pub capped: bool,
}

/// Part of a frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConePart {
    Side,
    Base,
    Apex,
}

impl ConePart {
    /// What stands for it in `v` of a hit.
    #[inline(always)]
    pub fn code(self) -> f32 {
        self as u8 as f32
    }
}

/// How much wider than its rim a cap is tested, so that no ray slips between cap and side.
const RIM: f32 = 1.0 + 8.0 * f32::EPSILON;

impl ConeFrustum {
    /// The frustum between two disks; one of the radii may be 0.
    pub fn new(base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool) -> Self {
        let height = base.distance(apex);
        // Ends that differ in `f64` may fall together in `f32`: then only the caps are left.
        let axis = (apex - base).normalize_or(Vec3::Y);
        let slope = if height > 0.0 { (apex_radius - base_radius) / height } else { 0.0 };
        ConeFrustum { base, axis, height, base_radius, slope, capped }
    }

    /// The radius at a height over the base.
    pub fn radius_at(&self, z: f32) -> f32 {
        self.base_radius + self.slope * z
    }

    /// Every crossing at a distance above 0: distance, whether it enters, and the part. Unordered, at most four.
    #[inline]
    pub fn crossings(&self, probe: &PreparedRay, mut found: impl FnMut(f32, bool, ConePart)) {
        for (crossing, part) in intersect_cone::<f32>(&probe.beam(), &self.columns()).into_iter().zip(PARTS) {
            if crossing.met {
                found(crossing.t, crossing.enters, part);
            }
        }
    }

    #[inline]
    fn columns(&self) -> ConeLanes<f32> {
        ConeLanes {
            base: V3::splat(self.base),
            axis: V3::splat(self.axis),
            height: self.height,
            base_radius: self.base_radius,
            slope: self.slope,
            capped: f32::from(u8::from(self.capped)),
        }
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        let apex = self.base + self.axis * self.height;
        let (r0, r1) = (self.base_radius, self.radius_at(self.height).max(0.0));
        // Half extent of a disk across the axis.
        let across = (Vec3::ONE - self.axis * self.axis).max(Vec3::ZERO).map(f32::sqrt);
        let base = Bounds { min: self.base - across * r0, max: self.base + across * r0 };
        base.union(Bounds { min: apex - across * r1, max: apex + across * r1 }).padded()
    }

    /// The frustum in the local space of a map that keeps shapes similar.
    fn carried(&self, map: &AffineMap) -> ConeFrustum {
        let axis = map.to_local * self.axis;
        let scale = axis.length();
        ConeFrustum {
            base: map.local(self.base),
            axis: axis.normalize_or(Vec3::Y),
            height: self.height * scale,
            base_radius: self.base_radius * scale,
            ..*self
        }
    }

    /// The point of a part next to another point.
    pub fn nearest(&self, near: Vec3, part: f32) -> BarePoint {
        let cone = self;
        let from_base = near - cone.base;
        let z = from_base.dot(cone.axis).clamp(0.0, cone.height);
        let radial = from_base - cone.axis * from_base.dot(cone.axis);
        let widest = cone.base_radius.max(cone.radius_at(cone.height));
        let error = (cone.base.abs() + cone.height + widest) * ROUNDING;
        if part == ConePart::Base.code() {
            return BarePoint { point: cone.base + radial, normal: -cone.axis, error };
        }
        if part == ConePart::Apex.code() {
            return BarePoint { point: cone.base + cone.axis * cone.height + radial, normal: cone.axis, error };
        }
        let outward = radial.normalize_or(cone.axis.any_orthonormal_vector());
        let point = cone.base + cone.axis * z + outward * cone.radius_at(z);
        BarePoint { point, normal: (outward - cone.axis * cone.slope).normalize(), error }
    }
}

/// Frusta side by side.
#[derive(Clone, Copy, Debug)]
pub struct ConeLanes<L> {
    /// Centre of the base.
    pub base: V3<L>,
    /// Unit, from the base to the other end.
    pub axis: V3<L>,
    /// Along the axis.
    pub height: L,
    /// Radius of the base.
    pub base_radius: L,
    /// What the radius gains per unit of height.
    pub slope: L,
    /// 1 or 0.
    pub capped: L,
}

/// Where lines may cross frusta.
#[derive(Clone, Copy)]
pub struct ConeCrossing<L: Lanes> {
    pub t: L,
    pub enters: L::Mask,
    /// Whether they do, at a distance above 0.
    pub met: L::Mask,
}

/// What each of the four crossings of `frustum` lies on.
pub const PARTS: [ConePart; 4] = [ConePart::Side, ConePart::Side, ConePart::Base, ConePart::Apex];

/// Where lines cross the sides and the caps of frusta.
#[inline(always)]
pub fn intersect_cone<L: Lanes>(ray: &PreparedRayLanes<L>, cone: &ConeLanes<L>) -> [ConeCrossing<L>; 4] {
    let zero = L::splat(0.0);
    let d = ray.direction;
    let from_base = ray.origin - cone.base;
    // Solve from the point of the line nearest to the base: precise however far the origin is.
    let shift = zero - from_base.dot(d);
    let o = from_base + d.scale(shift);
    let (oz, dz) = (o.dot(cone.axis), d.dot(cone.axis));
    let (op, dp) = (o - cone.axis.scale(oz), d - cone.axis.scale(dz));
    let (ro, rd) = (cone.base_radius + cone.slope * oz, cone.slope * dz);
    let a = dp.dot(dp) - rd * rd;
    let b = op.dot(dp) - ro * rd;
    let c = op.dot(op) - ro * ro;
    let discriminant = b * b - a * c;
    let real = zero.le(discriminant);
    let root = discriminant.sqrt();
    let q = L::select(zero.lt(b), zero - b - root, root - b);
    let rounds = [(q / a, L::and(real, a.ne(zero))), (c / q, L::and(real, q.ne(zero)))];
    let capped = L::and(zero.lt(cone.capped), dz.ne(zero));
    let ends = [(zero, zero.lt(dz)), (cone.height, dz.lt(zero))];
    let mut crossings = [ConeCrossing { t: zero, enters: real, met: real }; 4];
    let (round, flat) = crossings.split_at_mut(2);
    for (crossing, (s, exists)) in round.iter_mut().zip(rounds) {
        let (z, t) = (oz + dz * s, s + shift);
        let between = L::and(zero.le(z), z.le(cone.height));
        let met = L::and(L::and(exists, between), L::and(zero.le(ro + rd * s), zero.lt(t)));
        *crossing = ConeCrossing { t, enters: (a * s + b).lt(zero), met };
    }
    for (crossing, (z, enters)) in flat.iter_mut().zip(ends) {
        let s = (z - oz) / dz;
        let radius = (cone.base_radius + cone.slope * z) * L::splat(RIM);
        let (t, across) = (s + shift, op + dp.scale(s));
        let met = L::and(capped, L::and(zero.lt(t), across.dot(across).le(radius * radius)));
        *crossing = ConeCrossing { t, enters, met };
    }
    crossings
}

/// A frustum that stands in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConePrim {
    pub cone: ConeFrustum,
    /// What its hits are held to: where an accelerator will look for them.
    bounds: Bounds,
}

impl ConePrim {
    pub fn new(cone: ConeFrustum) -> Self {
        ConePrim { cone, bounds: cone.bounds() }
    }
}

impl PrimitiveShape for ConePrim {
    const IS_SAMPLED: bool = false;
    type Area = NoArea;

    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides, number: u32, closest: &mut ClosestHit) {
        offer_within(&self.bounds, ray, sides, number, closest, |keep| {
            self.cone.crossings(ray, |t, enters, part| keep(t, enters, part.code()));
        });
    }

    fn locate(&self, _: &Ray, near: impl Fn() -> Vec3, hit: &Hit) -> BarePoint {
        self.cone.nearest(near(), hit.v)
    }

    fn uv(&self, at: &UvPoint, hit: &Hit) -> SurfaceUv {
        tube(at.local, hit.v, &self.cone.carried(at.map))
    }
}

/// Offers crossings, held to bounds: `each` calls what it is given with distance, whether the ray enters, and a code that
/// becomes `v` of the hit.
pub fn offer_within(
    bounds: &Bounds,
    ray: &PreparedRay,
    sides: Sides,
    number: u32,
    closest: &mut ClosestHit,
    each: impl FnOnce(&mut dyn FnMut(f32, bool, f32)),
) {
    let Some([near, far]) = (BoxPrim { min: bounds.min, max: bounds.max }).span(ray) else { return };
    if far <= 0.0 || near > closest.t {
        return;
    }
    each(&mut |t, enters, code| {
        if sides.shows(enters) {
            let t = t.clamp(near, far);
            closest.offer(t, number, 0, t, code);
        }
    });
}

/// Texture coordinates of a frustum, or of one of its caps.
pub fn tube(q: Vec3, part: f32, cone: &ConeFrustum) -> SurfaceUv {
    let axis = cone.axis;
    let right = Vec3::Y.cross(axis).normalize_or(Vec3::X);
    let front = right.cross(axis);
    let q = q - cone.base;
    let (x, z) = (q.dot(right), q.dot(front));
    let cap = |radius: f32, up: Vec3| {
        let share = 0.5 / radius.max(f32::MIN_POSITIVE);
        SurfaceUv {
            uv: Vec2::new(0.5 + x * share, 0.5 + q.dot(up) * share),
            gradients: [right * share, up * share],
            ends: [true; 2],
        }
    };
    if part == ConePart::Base.code() {
        return cap(cone.base_radius, front);
    }
    if part == ConePart::Apex.code() {
        return cap(cone.radius_at(cone.height), -front);
    }
    let across = (x * x + z * z).max(1e-12 * cone.height * cone.height);
    let along = axis / cone.height.max(f32::MIN_POSITIVE);
    SurfaceUv {
        uv: Vec2::new(0.5 + libm::atan2f(x, z) / TURN, q.dot(along)),
        gradients: [(right * z - front * x) / (TURN * across), along],
        ends: [false, true],
    }
}
