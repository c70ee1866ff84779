//! Shapes with an inside under an affine map, tested in their own space.

use glam::{DAffine3, Mat3, Vec3};

use super::bounds::Bounds;
use super::shapes::ConeFrustum;

/// A shape that stands in its own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalShape {
    Sphere { center: Vec3, radius: f32 },
    Box { min: Vec3, max: Vec3 },
    Cone { base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool },
}

/// The same, ready to be tested.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PreparedShape {
    Sphere { center: Vec3, radius: f32 },
    Box { min: Vec3, max: Vec3 },
    Cone(ConeFrustum),
}

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
}

/// A shape under an affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformedShape {
    pub shape: PreparedShape,
    pub map: AffineMap,
}

impl TransformedShape {
    pub fn new(shape: LocalShape, to_world: &DAffine3) -> Self {
        let shape = match shape {
            LocalShape::Sphere { center, radius } => PreparedShape::Sphere { center, radius },
            LocalShape::Box { min, max } => PreparedShape::Box { min, max },
            LocalShape::Cone { base, base_radius, apex, apex_radius, capped } => {
                PreparedShape::Cone(ConeFrustum::new(base, base_radius, apex, apex_radius, capped))
            }
        };
        TransformedShape { shape, map: AffineMap::new(to_world) }
    }

    pub fn bounds(&self) -> Bounds {
        self.map.bounds(match self.shape {
            PreparedShape::Sphere { center, radius } => {
                Bounds { min: center - radius.abs(), max: center + radius.abs() }
            }
            PreparedShape::Box { min, max } => Bounds { min, max },
            PreparedShape::Cone(cone) => cone_bounds(&cone),
        })
    }
}

pub fn cone_bounds(cone: &ConeFrustum) -> Bounds {
    let apex = cone.base + cone.axis * cone.height;
    let (r0, r1) = (cone.base_radius, cone.radius_at(cone.height).max(0.0));
    // Half extent of a disk across the axis.
    let across = (Vec3::ONE - cone.axis * cone.axis).max(Vec3::ZERO).map(f32::sqrt);
    let base = Bounds { min: cone.base - across * r0, max: cone.base + across * r0 };
    base.union(Bounds { min: apex - across * r1, max: apex + across * r1 }).padded()
}
