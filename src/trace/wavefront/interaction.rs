//! Where a ray met a surface, with all that shading wants to know.

use glam::Vec3;

use super::medium_stack::MediumStack;
use super::path_state::PathState;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::SurfacePoint;
use crate::trace::sampler::{Frame, Sampler};

/// Cosine below which a smooth normal is not trusted.
pub const LEAST_FACING: f32 = 1e-3;

/// A ray, the surface that it met, and what the surface is of.
pub struct SurfaceInteraction<'a> {
    pub direction: Vec3,
    pub state: PathState,
    /// Faces the ray.
    pub surface: SurfacePoint,
    /// Its index of refraction is that against what is around it here.
    pub material: &'a ShadingParams,
    /// The transparent bodies that a ray is in which goes through.
    pub behind: MediumStack,
    /// Whether the ray comes from the outside.
    pub front: bool,
    pub sampler: Sampler,
}

impl SurfaceInteraction<'_> {
    /// Axes of the surface, and the direction back along the ray in them; its z is positive.
    #[inline]
    pub fn frame(&self) -> (Frame, Vec3) {
        // A smooth normal may turn away from the ray: the true one does not.
        let facing = self.surface.shading_normal.dot(self.direction) < -LEAST_FACING;
        let normal = if facing { self.surface.shading_normal } else { self.surface.geometric_normal };
        let frame = Frame::new(normal);
        let wo = frame.to_local(-self.direction);
        (frame, Vec3::new(wo.x, wo.y, wo.z.max(1e-7)))
    }
}
