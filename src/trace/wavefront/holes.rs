//! Surfaces that are not there everywhere: rays go on where they are not.
//!
//! A ray that meets such a surface looks for the next one, as often as it takes, and keeps its start: distances, media and
//! densities are those of the whole way. Where a surface is there in part, chance decides ray by ray, but in Whitted
//! pictures, which follow both ways. Rays to lights are dimmed by the share that is there: nothing is left to chance.

use super::context::RenderContext;
use super::ray_queue::RayQueue;
use super::worker::Worker;
use crate::base::limits;
use crate::components::Integrator;
use crate::trace::material::texture::RayCone;
use crate::trace::material::{HoleCoverage, ShadingParams};
use crate::trace::primitive::SurfacePoint;
use crate::trace::sampler::{Domain, Sampler};
use crate::trace::soa::{Hit, Hits, Ray};

/// Whether any of these materials has holes.
pub fn any_has_holes(materials: &[ShadingParams]) -> bool {
    materials.iter().any(|material| material.coverage != HoleCoverage::Full)
}

/// Leads the rays of a wave on through the holes that they met; `sampler` is that of a sample.
pub fn pass_holes(
    context: RenderContext,
    wave: &RayQueue,
    hits: &mut Hits,
    sampler: impl Fn(u32) -> Sampler,
    worker: &mut Worker,
) {
    if !context.holes {
        return;
    }
    for i in 0..wave.rays().len() {
        let Some(hit) = hits.get(i) else { continue };
        if coverage(context, &hit) == HoleCoverage::Full {
            continue;
        }
        let (ray, state) = wave.get(i);
        let chance = |step: u32| sampler(state.sample).random(state.node, Domain::Hole(step))[0];
        let found = beyond(context, &ray, hit, state.cone, chance, worker);
        hits.set(i, found);
    }
}

fn coverage(context: RenderContext, hit: &Hit) -> HoleCoverage {
    context.materials[context.geometry.tag(hit.primitive).material as usize].coverage
}

/// The first surface along a ray that is there, from the one that it met.
fn beyond(
    context: RenderContext,
    ray: &Ray,
    mut hit: Hit,
    cone: RayCone,
    chance: impl Fn(u32) -> f32,
    worker: &mut Worker,
) -> Option<Hit> {
    let split = context.settings.integrator == Integrator::Whitted;
    for step in 0..limits::HOLES {
        let coverage = coverage(context, &hit);
        if coverage == HoleCoverage::Full || (split && coverage == HoleCoverage::Partial) {
            return Some(hit);
        }
        let surface = context.geometry.surface_point(ray, &hit);
        let cover = cover(context, ray, &hit, cone, &surface);
        // Whether all of it is there needs no chance.
        if cover >= 1.0 || (cover > 0.0 && chance(step) < cover) {
            return Some(hit);
        }
        let on = onward(ray, &surface);
        let next = context.accelerator.closest(context.geometry, &on, &mut worker.traversal)?;
        hit = context.geometry.seen_from(ray, &on, next);
    }
    Some(hit)
}

/// How much of the surface is there at a hit, 0 to 1.
fn cover(context: RenderContext, ray: &Ray, hit: &Hit, cone: RayCone, surface: &SurfacePoint) -> f32 {
    let material = &context.materials[surface.material as usize];
    let opacity = context.textures.opacity(context.geometry, (ray, hit), cone.at(hit.t), surface, material);
    ShadingParams { opacity, ..*material }.cover()
}

/// The rest of a ray from a surface on.
fn onward(ray: &Ray, surface: &SurfacePoint) -> Ray {
    let origin = surface.offset_origin(ray.direction);
    let advanced = (origin - ray.origin).dot(ray.direction).max(0.0);
    Ray { origin, t_max: ray.t_max - advanced, ..*ray }
}

/// Share of a surface that a ray to a light does not find there: what it met, and where it goes on from.
pub fn missing(context: RenderContext, ray: &Ray, hit: &Hit, surface: &SurfacePoint) -> f32 {
    if !context.holes || coverage(context, hit) == HoleCoverage::Full {
        return 0.0;
    }
    1.0 - cover(context, ray, hit, RayCone::default(), surface)
}
