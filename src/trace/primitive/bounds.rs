//! Axis-aligned boxes. Where rays meet them: those of the scene in `aabox`, those of trees in `accel::bvh::walk`.

use glam::Vec3;

/// An axis-aligned box that may be empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The least coordinates.
    pub min: Vec3,
    /// The greatest coordinates.
    pub max: Vec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Bounds { min: Vec3::splat(f32::INFINITY), max: Vec3::splat(f32::NEG_INFINITY) }
    }
}

impl Bounds {
    /// The box around points; empty around none.
    pub fn around(points: &[Vec3]) -> Self {
        points.iter().fold(Bounds::default(), |b, p| Bounds { min: b.min.min(*p), max: b.max.max(*p) })
    }

    /// The box around both.
    pub fn union(self, other: Bounds) -> Self {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether it holds no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Side lengths; zero if empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// Its middle.
    pub fn center(&self) -> Vec3 {
        self.min + self.size() * 0.5
    }

    /// Widened by [`MARGIN`] of its own greatest coordinate.
    #[inline]
    pub fn padded(self) -> Self {
        let pad = self.min.abs().max(self.max.abs()).max_element() * MARGIN;
        Bounds { min: self.min - pad, max: self.max + pad }
    }
}

/// Margin of boxes, relative to the greatest coordinate of the ray's origin and of the box. What tests of primitives are
/// held to errs by a quarter of it.
pub const MARGIN: f32 = 8.0 * f32::EPSILON;
