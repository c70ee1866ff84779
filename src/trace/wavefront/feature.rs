//! What a camera ray meets first, for the film's layers.

use glam::{Vec2, Vec3};

use super::context::RenderContext;
use super::interaction::SurfaceInteraction;
use super::slots::CatcherRow;
use crate::components::Model;
use crate::film::Feature;
use crate::trace::material::{SMOOTH, ShadingParams};

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
        catcher: CatcherRow::of(context.catchers, met.state.sample) == CatcherRow::Both,
    }
}

/// Share of white light that comes back. Glass counts as white: what is seen through it has colours of its own.
fn albedo(material: &ShadingParams) -> Vec3 {
    if material.transmission > 0.0 {
        return Vec3::ONE;
    }
    (material.diffuse + material.mirror_color * material.reflection).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Share of white light that a surface sends back otherwise than by mirror and clear glass, which show what they show.
pub fn scattered_albedo(material: &ShadingParams) -> Vec3 {
    let smooth = material.alpha < SMOOTH;
    let scattered = match material.model {
        Model::Lambert | Model::Plastic | Model::Unlit => material.diffuse,
        Model::BlinnPhong if material.gloss > 0.0 => {
            material.diffuse + material.mirror_color * material.reflection + Vec3::splat(material.transmission)
        }
        Model::BlinnPhong => material.diffuse,
        Model::Conductor | Model::Dielectric if smooth => Vec3::ZERO,
        Model::Conductor => material.diffuse,
        Model::Dielectric => Vec3::ONE,
        Model::Principled => {
            let (metal, base) = (material.metallic, 1.0 - material.metallic);
            let glossy = if smooth { 0.0 } else { metal + base * material.transmission };
            material.diffuse * (base * (1.0 - material.transmission) + glossy)
        }
    };
    scattered + material.emission
}
