//! Texture coordinates of hits, and how they change along the surface. Asked for only where something is textured.
//!
//! What is what on each shape stands with the shapes in [`crate::components`]. All are functions of the point in local
//! space, so that a texture keeps its place on an entity that moves, turns or is stretched.

use glam::{Vec2, Vec3};

use super::affine::AffineMap;
use super::surface::SurfacePoint;

/// A turn, in radians.
pub const TURN: f32 = std::f32::consts::TAU;

/// The local space of an entity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSpace {
    /// From the shape's own axes.
    pub map: AffineMap,
    /// Middle of the mesh that has no texture coordinates and is wrapped like a sphere, local space.
    pub center: Option<Vec3>,
}

/// Texture coordinates at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceUv {
    /// Texture coordinates.
    pub uv: Vec2,
    /// Gradients of u and v in the tangent plane, world space, per world unit.
    pub gradients: [Vec3; 2],
    /// Which coordinates end at 0 and 1; others go round, or on.
    pub ends: [bool; 2],
}

/// A point of a surface as texture coordinates depend on it.
pub struct UvPoint<'a> {
    /// Of the world.
    pub surface: &'a SurfacePoint,
    /// The local space of its entity.
    pub map: &'a AffineMap,
    /// Position in that space.
    pub local: Vec3,
    /// Outward normal in that space, unit.
    pub normal: Vec3,
}

impl<'a> UvPoint<'a> {
    /// `surface` faces outwards.
    pub fn new(surface: &'a SurfacePoint, map: &'a AffineMap) -> Self {
        let normal = (map.to_world.transpose() * surface.geometric_normal).normalize_or(Vec3::Y);
        UvPoint { surface, map, local: map.local(surface.point), normal }
    }
}

impl SurfaceUv {
    /// How u and v change along a step in the tangent plane. What goes round goes round once: around a pole a footprint
    /// has all of u in it, and no more.
    pub fn along(&self, step: Vec3) -> Vec2 {
        let [u, v] = self.gradients.map(|g| g.dot(step));
        Vec2::new(if self.ends == [false, true] { u.clamp(-1.0, 1.0) } else { u }, v)
    }

    /// Local gradients carried into the world's tangent plane.
    pub fn carried(self, map: &AffineMap, surface: &SurfacePoint) -> Self {
        let n = surface.geometric_normal;
        let gradients = self.gradients.map(|g| {
            let g = map.to_local.transpose() * g;
            let g = g - n * n.dot(g);
            if g.is_finite() { g } else { Vec3::ZERO }
        });
        SurfaceUv { gradients, ..self }
    }
}
