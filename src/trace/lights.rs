//! Lights as columns of the kernel: a point, or a parallelogram of points.

use glam::Vec3;

/// A light resolved into world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    pub center: Vec3,
    /// Edges of the parallelogram around the centre; both zero for a point.
    pub edges: [Vec3; 2],
    /// Unit normal of the parallelogram; zero for a point.
    pub normal: Vec3,
    pub color: Vec3,
    /// Whether the light weakens with the square of the distance.
    pub inverse_square: bool,
}

impl Light {
    pub fn is_point(&self) -> bool {
        self.edges == [Vec3::ZERO; 2]
    }

    /// The point of the light at (u, v) in the unit square.
    pub fn point(&self, [u, v]: [f32; 2]) -> Vec3 {
        self.center + self.edges[0] * (u - 0.5) + self.edges[1] * (v - 0.5)
    }
}
