//! How wide a ray is: what a texture has to be averaged over.
//!
//! A ray stands for a cone around it (Amanatides, SIGGRAPH 1984; Akenine-Moller et al., Ray Tracing Gems, chapter 20).
//! Camera rays start with the angle between neighbouring samples; mirrors pass the cone on as it is, and rough surfaces
//! widen it.

use glam::Vec3;

/// Diameter of a ray's cone where the ray starts, and how much it grows per unit of distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayCone {
    /// World units.
    pub width: f32,
    /// Radians, taken as small.
    pub spread: f32,
}

/// Below this cosine an ellipse grows no longer: the horizon is infinitely far.
const GRAZING: f32 = 1e-3;

impl RayCone {
    /// The cone at a distance along its ray.
    #[inline]
    pub fn at(self, distance: f32) -> RayCone {
        RayCone { width: self.width + self.spread * distance, spread: self.spread }
    }

    /// The cone after a surface that scatters by this angle.
    #[inline]
    pub fn widened(self, angle: f32) -> RayCone {
        RayCone { spread: self.spread + angle, ..self }
    }

    /// Axes (diameters) of the ellipse that the cone cuts out of the tangent plane at its end: across the ray, and
    /// along it.
    pub fn footprint(self, direction: Vec3, normal: Vec3) -> [Vec3; 2] {
        let cosine = direction.dot(normal);
        let across = normal.cross(direction).normalize_or(normal.any_orthonormal_vector());
        let along = across.cross(normal);
        [across * self.width, along * (self.width / cosine.abs().max(GRAZING))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_cuts_a_longer_ellipse_the_flatter_it_comes() {
        let cone = RayCone { width: 0.0, spread: 0.01 }.at(10.0);
        let [a, b] = cone.footprint(Vec3::NEG_Y, Vec3::Y);
        assert!((a.length() - 0.1).abs() < 1e-6 && (b.length() - 0.1).abs() < 1e-6 && a.dot(b).abs() < 1e-8);
        let [a, b] = cone.footprint(Vec3::new(0.8, -0.6, 0.0), Vec3::Y);
        assert!((a.length() - 0.1).abs() < 1e-6 && (b - Vec3::X * b.x).length() < 1e-6);
        assert!((b.length() - 0.1 / 0.6).abs() < 1e-6);
        assert!(cone.footprint(Vec3::X, Vec3::Y)[1].is_finite());
    }
}
