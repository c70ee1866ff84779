//! Infinite planes.

use glam::{Vec2, Vec3};

use super::area::NoArea;
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveShape;
use super::prepared_ray::PreparedRay;
use super::surface::{BarePoint, ROUNDING};
use super::tag::Sides;
use super::uv::{SurfaceUv, UvPoint};
use crate::trace::soa::{Hit, Ray};

/// A plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanePrim {
    /// Any point of it.
    pub point: Vec3,
    /// Unit, to the front.
    pub normal: Vec3,
}

impl PrimitiveShape for PlanePrim {
    const IS_SAMPLED: bool = false;
    type Area = NoArea;

    /// None: planes are no part of any bounds.
    fn bounds(&self) -> Bounds {
        Bounds::default()
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides, number: u32, closest: &mut ClosestHit) {
        let facing = self.normal.dot(ray.direction);
        let t = (self.point - ray.origin).dot(self.normal) / facing;
        if t > 0.0 && t < f32::INFINITY && sides.shows(facing < 0.0) {
            closest.offer(t, number, 0, 0.0, 0.0);
        }
    }

    fn locate(&self, ray: &Ray, _: impl Fn() -> Vec3, hit: &Hit) -> BarePoint {
        let p = ray.origin + ray.direction * hit.t;
        let p = p - self.normal * (p - self.point).dot(self.normal);
        BarePoint { point: p, normal: self.normal, error: (p.abs() + self.point.abs()) * ROUNDING }
    }

    fn uv(&self, at: &UvPoint, _: &Hit) -> SurfaceUv {
        floor(at.local - at.map.local(self.point), at.normal)
    }
}

/// Texture coordinates of a plane through the origin.
pub fn floor(q: Vec3, normal: Vec3) -> SurfaceUv {
    let right = Vec3::Y.cross(normal).normalize_or(Vec3::X);
    let up = normal.cross(right);
    SurfaceUv { uv: Vec2::new(q.dot(right), q.dot(up)), gradients: [right, up], ends: [false; 2] }
}
