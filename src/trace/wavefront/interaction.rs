//! Where a ray met a surface, with all that shading wants to know.

use glam::Vec3;

use super::context::RenderContext;
use super::medium_stack::MediumStack;
use super::path_state::PathState;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::SurfacePoint;
use crate::trace::sampler::{Frame, Sampler};
use crate::trace::soa::{Hit, Ray};

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
    pub hit: Hit,
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

    /// Where rays start towards light that the smooth normal faces and the surface itself does not: see
    /// [`crate::trace::primitive::SmoothFacet`]. `None` where no such light is seen.
    #[inline(never)]
    pub fn smooth_start(&self, context: RenderContext) -> Option<Vec3> {
        let is_opaque = self.material.transmission == 0.0;
        (is_opaque && !self.surface.bent).then(|| context.geometry.smooth_start(&self.hit, &self.surface))?
    }
}

/// A shadow ray towards sampled light from another start than the point that it was sampled for.
#[inline]
pub fn shadow_ray_from(start: Vec3, point: Vec3, target: Vec3, along: Ray) -> Ray {
    let way = target - start;
    let (length, before) = (way.length(), (target - point).length());
    // Light from infinitely far comes from the same direction everywhere.
    if !along.t_max.is_finite() || !length.is_finite() || length == 0.0 || before == 0.0 {
        return Ray { origin: start, ..along };
    }
    // It ends as short of the light as it did.
    Ray { origin: start, direction: way / length, t_max: along.t_max * (length / before) }
}
