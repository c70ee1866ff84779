//! Spheres.
//!
//! The test is that of Hearn and Baker (Ray Tracing Gems, chapter 7), chosen for what it does to rounding.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::area::{AreaSample, AreaSampling, area_pdf};
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveShape;
use super::interaction::InteractionLanes;
use super::prepared_ray::{PreparedRay, PreparedRayLanes};
use super::surface::{BarePoint, ROUNDING};
use super::tag::Sides;
use super::uv::{SurfaceUv, TURN, UvPoint};
use crate::trace::sampler::{Frame, around};
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::{Hit, Ray};

/// A sphere in some space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpherePrim {
    /// In the space that is traced.
    pub center: Vec3,
    /// A negative one turns the sphere inside out: it is a bubble in the material around it.
    pub radius: f32,
}

impl SpherePrim {
    /// Distances at which a line enters and leaves it.
    pub fn span(&self, ray: &PreparedRay) -> Option<[f32; 2]> {
        let (met, span) = intersect_sphere::<f32>(&ray.beam(), V3::splat(self.center), self.radius);
        met.then_some(span)
    }

    /// Its point next to another.
    pub fn nearest(&self, near: Vec3) -> BarePoint {
        let (point, normal, error) = sphere_point::<f32>(near.into(), self.center.into(), self.radius);
        BarePoint { point: point.into(), normal: normal.into(), error: error.into() }
    }
}

impl PrimitiveShape for SpherePrim {
    const IS_SAMPLED: bool = true;
    type Area = SpherePrim;

    fn bounds(&self) -> Bounds {
        let reach = self.radius.abs();
        Bounds { min: self.center - reach, max: self.center + reach }
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides, number: u32, closest: &mut ClosestHit) {
        if let Some(span) = self.span(ray) {
            closest.offer_span(span, sides, number);
        }
    }

    fn locate(&self, _: &Ray, near: impl Fn() -> Vec3, _: &Hit) -> BarePoint {
        self.nearest(near())
    }

    fn uv(&self, at: &UvPoint, _: &Hit) -> SurfaceUv {
        globe(at.map.to_local * (at.surface.point - self.center))
    }

    fn area_shape(&self) -> Option<SpherePrim> {
        Some(SpherePrim { radius: self.radius.abs(), ..*self })
    }

    #[inline(always)]
    fn gather(&self, lane: usize, lanes: &mut InteractionLanes) -> bool {
        lanes.add_sphere(lane, self.center, self.radius);
        true
    }
}

/// Whether lines meet spheres, and the distances at which they enter and leave.
#[inline(always)]
pub fn intersect_sphere<L: Lanes>(ray: &PreparedRayLanes<L>, center: V3<L>, radius: L) -> (L::Mask, [L; 2]) {
    let zero = L::splat(0.0);
    let f = ray.origin - center;
    let b = zero - f.dot(ray.direction);
    // From the centre to the nearest point of the line: precise however far the origin is.
    let nearest = f + ray.direction.scale(b);
    let square = radius * radius;
    let discriminant = square - nearest.dot(nearest);
    let met = zero.le(discriminant);
    if !L::any(met) {
        return (met, [zero; 2]);
    }
    let root = discriminant.sqrt();
    let c = f.dot(f) - square;
    let ahead = zero.lt(b);
    let q = L::select(ahead, b + root, b - root);
    let other = L::select(q.ne(zero), c / q, zero);
    (met, [L::select(ahead, other, q), L::select(ahead, q, other)])
}

/// Point, normal and error next to a point; the normal points inwards where the radius is negative.
#[inline(always)]
pub fn sphere_point<L: Lanes>(near: V3<L>, center: V3<L>, radius: L) -> (V3<L>, V3<L>, V3<L>) {
    let outward = L::select(radius.lt(L::splat(0.0)), L::splat(-1.0), L::splat(1.0));
    let normal = (near - center).normalize_or(V3::splat(Vec3::Y)).scale(outward);
    let size = radius.abs();
    let error = center.abs() + V3 { x: size, y: size, z: size };
    (center + normal.scale(radius), normal, error.scale(L::splat(ROUNDING)))
}

/// Texture coordinates of a sphere, for a point given from its centre.
pub fn globe(q: Vec3) -> SurfaceUv {
    let square = q.length_squared();
    let across = (q.x * q.x + q.z * q.z).max(1e-12 * square);
    let radius = across.sqrt();
    let angle = libm::atan2f(q.x, q.z);
    let height = libm::atan2f(radius, -q.y);
    let east = Vec3::new(q.z, 0.0, -q.x) / (TURN * across);
    let north = Vec3::new(-q.x * q.y / radius, radius, -q.z * q.y / radius) * (2.0 / (TURN * square));
    SurfaceUv { uv: Vec2::new(0.5 + angle / TURN, 2.0 * height / TURN), gradients: [east, north], ends: [false, true] }
}

impl AreaSampling for SpherePrim {
    const IS_CLOSED: bool = true;

    fn area(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }

    fn point(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        let normal = around(1.0 - 2.0 * u[0], u[1]);
        (self.center + normal * self.radius, normal)
    }

    fn area_bounds(&self) -> Bounds {
        self.bounds()
    }

    fn extent(&self) -> Vec3 {
        self.center.abs() + self.radius
    }

    fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<AreaSample> {
        if let Some(cone) = SphereCone::new(from, self.center, self.radius) {
            let point = cone.sample(u);
            let normal = (point - self.center).normalize_or(Vec3::Y);
            return Some(AreaSample { point: self.center + normal * self.radius, normal, pdf: cone.pdf() });
        }
        let (point, normal) = self.point(u);
        AreaSample::by_area(from, point, normal, self.area())
    }

    fn pdf(&self, from: Vec3, point: Vec3, normal: Vec3) -> f32 {
        let cone = SphereCone::new(from, self.center, self.radius);
        cone.map_or_else(|| area_pdf(from, point, normal, self.area()), |cone| cone.pdf())
    }
}

/// The cone in which a sphere is seen from outside.
struct SphereCone {
    from: Vec3,
    axis: Vec3,
    distance: f32,
    radius: f32,
    /// 1 - cosine of the half angle, without cancellation for small spheres.
    height: f32,
}

impl SphereCone {
    fn new(from: Vec3, center: Vec3, radius: f32) -> Option<Self> {
        let offset = center - from;
        let distance = offset.length();
        // On the surface and within it there is no cone.
        if distance <= radius * (1.0 + 1e-5) {
            return None;
        }
        let sin = radius / distance;
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        Some(SphereCone { from, axis: offset / distance, distance, radius, height: sin * sin / (1.0 + cos) })
    }

    fn pdf(&self) -> f32 {
        1.0 / (2.0 * PI * self.height)
    }

    /// The nearer point of the sphere in a uniform direction of the cone.
    fn sample(&self, u: [f32; 2]) -> Vec3 {
        // 1 - cosine of the direction's angle to the axis.
        let h = u[0] * self.height;
        let sin2 = (h * (2.0 - h)).max(0.0);
        let local = {
            let (sin, cos) = libm::sincosf(2.0 * PI * u[1]);
            let r = sin2.sqrt();
            Vec3::new(r * cos, r * sin, 1.0 - h)
        };
        let direction = Frame::new(self.axis).to_world(local);
        let under = (self.radius * self.radius - self.distance * self.distance * sin2).max(0.0).sqrt();
        self.from + direction * (self.distance * (1.0 - h) - under)
    }
}
