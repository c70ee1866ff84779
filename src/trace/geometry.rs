//! Columns of primitives (interface; the kernel helper fills it in).
#![allow(unused_variables)]
use super::{Hit, Ray};
use glam::{DAffine3, Vec3};

/// Which sides of a primitive are there for rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    #[default]
    Both,
    Front,
    Back,
}

/// What a primitive belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tag {
    /// Authored index of the entity.
    pub entity: u32,
    /// Index of the material.
    pub material: u32,
    pub sides: Sides,
}

/// A shape that stands in its own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalShape {
    Sphere { center: Vec3, radius: f32 },
    Box { min: Vec3, max: Vec3 },
    Cone { base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool },
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {}

impl Geometry {
    pub fn push_sphere(&mut self, tag: Tag, center: Vec3, radius: f32) {}
    pub fn push_triangle(&mut self, tag: Tag, corners: [Vec3; 3], normals: Option<[Vec3; 3]>) {}
    pub fn push_plane(&mut self, tag: Tag, point: Vec3, normal: Vec3) {}
    /// Box along the world's axes.
    pub fn push_box(&mut self, tag: Tag, min: Vec3, max: Vec3) {}
    pub fn push_cone(&mut self, tag: Tag, base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool) {}
    /// Any shape under any invertible affine map.
    pub fn push_placed(&mut self, tag: Tag, shape: LocalShape, to_world: &DAffine3) {}
    /// Numbers the primitives and computes what is derived; call once after the last push.
    pub fn finish(&mut self) {}
    pub fn len(&self) -> usize {
        0
    }
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        Surface::default()
    }
}

/// The point that a ray met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    pub point: Vec3,
    /// Bound of the rounding error of `point`, per axis.
    pub error: Vec3,
    /// Unit, towards the front (outside) whatever side the ray came from.
    pub geometric_normal: Vec3,
    /// Unit, on the same side as the geometric normal.
    pub shading_normal: Vec3,
    pub material: u32,
    pub entity: u32,
}

impl Surface {
    /// The same point seen from the other side: both normals turned round.
    pub fn flipped(self) -> Surface {
        Surface { geometric_normal: -self.geometric_normal, shading_normal: -self.shading_normal, ..self }
    }

    /// A start for a ray that leaves towards `direction`, moved off the surface by no more than the rounding error.
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        self.point
    }
}
