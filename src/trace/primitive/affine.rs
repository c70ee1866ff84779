//! Affine maps between local spaces and the world.

use glam::{DAffine3, Mat3, Vec3};

use super::bounds::Bounds;
use super::prepared_ray::PreparedRay;
use super::surface::ROUNDING;

/// An affine map between a local space and the world, with what rays, points and normals need of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffineMap {
    /// Where the local origin stands in the world.
    pub anchor: Vec3,
    pub to_world: Mat3,
    pub to_local: Mat3,
    /// Inverse transpose of `to_world`, up to a positive factor.
    pub normals: Mat3,
}

impl AffineMap {
    /// The map must be invertible.
    pub fn new(to_world: &DAffine3) -> Self {
        let m = to_world.matrix3;
        let inverse = m.inverse();
        AffineMap {
            anchor: to_world.translation.as_vec3(),
            to_world: m.as_mat3(),
            to_local: inverse.as_mat3(),
            normals: inverse.transpose().as_mat3(),
        }
    }

    /// Bounds in the world of what has these bounds in local space.
    pub fn bounds(&self, local: Bounds) -> Bounds {
        let half = local.size() * 0.5;
        let center = self.to_world * local.center() + self.anchor;
        let extent = self.spread(half);
        Bounds { min: center - extent, max: center + extent }.padded()
    }

    /// How far a local uncertainty reaches along the world's axes.
    pub fn spread(&self, v: Vec3) -> Vec3 {
        let m = self.to_world;
        m.x_axis.abs() * v.x + m.y_axis.abs() * v.y + m.z_axis.abs() * v.z
    }

    /// A point of the world in local space.
    pub fn local(&self, point: Vec3) -> Vec3 {
        self.to_local * (point - self.anchor)
    }

    /// The ray in local space, and the length in the world of one unit along it there.
    pub fn local_ray(&self, ray: &PreparedRay) -> (PreparedRay, f32) {
        let direction = self.to_local * ray.direction;
        let per_unit = direction.length().recip();
        let mut local = PreparedRay::new(self.to_local * (ray.origin - self.anchor), direction * per_unit);
        local.is_mapped = true;
        (local, per_unit)
    }

    /// A local normal in the world, unit.
    pub fn world_normal(&self, normal: Vec3) -> Vec3 {
        (self.normals * normal).normalize_or(Vec3::Y)
    }

    /// A local point with its uncertainty carried into the world.
    pub fn world_point(&self, local: Vec3, error: Vec3) -> (Vec3, Vec3) {
        let point = self.to_world * local + self.anchor;
        // The local error, and that of the map and of the test from the other side of it.
        let error = self.spread(error + local.abs() * ROUNDING) * 2.0 + (point.abs() + self.anchor.abs()) * ROUNDING;
        (point, error)
    }
}
