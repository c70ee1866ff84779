//! A ray and what it met.

use glam::Vec3;

/// A half-line in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    pub origin: Vec3,
    /// Unit length.
    pub direction: Vec3,
    /// Hits at or beyond this distance do not count.
    pub t_max: f32,
}

impl Ray {
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Ray { origin, direction, t_max: f32::INFINITY }
    }
}

/// The nearest intersection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hit {
    /// Distance along the ray, above 0.
    pub t: f32,
    /// Number of the primitive in its [`super::Geometry`].
    pub primitive: u32,
    /// Triangle within an instance.
    pub element: u32,
    /// Parameters that the primitive's kind gives a meaning to (barycentrics of a triangle).
    pub u: f32,
    pub v: f32,
}
