//! What a camera ray meets first, for the film's layers.

use glam::{Vec2, Vec3};

use super::context::RenderContext;
use super::interaction::SurfaceInteraction;
use crate::film::Feature;
use crate::trace::material::ShadingParams;

/// The feature of a camera ray's encounter.
pub fn first_hit_feature(context: RenderContext, met: &SurfaceInteraction) -> Feature {
    let (point, entity) = (met.surface.point, met.surface.entity);
    Feature {
        depth: context.camera.depth(point),
        point: point + context.origin,
        normal: met.surface.shading_normal,
        albedo: albedo(met.material),
        motion: context.motion.map_or(Vec2::ZERO, |motion| motion.motion(context.camera, point, entity)),
        entity,
        material: met.surface.material,
    }
}

/// Share of white light that comes back. Glass counts as white: what is seen through it has colours of its own.
fn albedo(material: &ShadingParams) -> Vec3 {
    if material.transmission > 0.0 {
        return Vec3::ONE;
    }
    (material.diffuse + material.mirror_color * material.reflection).clamp(Vec3::ZERO, Vec3::ONE)
}
