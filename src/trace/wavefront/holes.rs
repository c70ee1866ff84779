//! Surfaces that a ray goes through as if they were not there: holes, and those that other bodies of glass cover.
//!
//! A ray that meets such a surface looks for the next one, as often as it takes, and keeps its start: distances and
//! densities are those of the whole way. Where a surface is there in part, chance decides ray by ray, but in Whitted
//! pictures, which follow both ways. Rays to lights are dimmed by the share that is there: nothing is left to chance.
//!
//! By a hole a ray leaves a transparent body, and does not enter one: what is seen through a hole in glass is what would
//! be seen without the glass. Which surfaces other bodies cover is told in [`Crossing`].

use super::context::RenderContext;
use super::medium_stack::{Crossing, MediumStack};
use super::path_state::PathState;
use super::ray_queue::RayQueue;
use super::slots::is_left_out;
use super::worker::Worker;
use crate::base::limits;
use crate::trace::accel::Accelerator;
use crate::trace::material::texture::RayCone;
use crate::trace::material::{HoleCoverage, ShadingParams};
use crate::trace::primitive::SurfacePoint;
use crate::trace::sampler::{Domain, Sampler};
use crate::trace::soa::{Hit, Hits, Ray};

/// Whether any of these materials has holes.
pub fn any_has_holes(materials: &[ShadingParams]) -> bool {
    materials.iter().any(|material| material.coverage != HoleCoverage::Full)
}

/// Leads the rays of a wave on through the surfaces that they met and that are not there; `sampler` is that of a sample.
/// The accelerator is the one that they go by.
pub fn pass_surfaces(
    (context, accelerator): (RenderContext, &Accelerator),
    wave: &mut RayQueue,
    hits: &mut Hits,
    sampler: impl Fn(u32) -> Sampler,
    worker: &mut Worker,
) {
    if !context.holes && !context.glass && !context.catchers {
        return;
    }
    for i in 0..wave.rays().len() {
        let Some(hit) = hits.get(i) else { continue };
        let material = &context.materials[context.geometry.tag(hit.primitive).material as usize];
        let whole = material.coverage == HoleCoverage::Full;
        let state = wave.states().get(i);
        if whole && (!material.is_clear() || state.medium.is_air()) && !is_left_out(&state, material) {
            continue;
        }
        let (ray, mut state) = wave.get(i);
        let known = state;
        let chance = |step: u32| sampler(known.sample).random(known.node, Domain::Hole(step))[0];
        let found = beyond((context, accelerator), &ray, hit, &mut state, chance, worker);
        hits.set(i, found);
        if state != known {
            wave.set_state(i, &state);
        }
    }
}

fn coverage(context: RenderContext, hit: &Hit) -> HoleCoverage {
    context.materials[context.geometry.tag(hit.primitive).material as usize].coverage
}

/// The first surface along a ray that is there, from the one that it met.
pub fn beyond(
    (context, accelerator): (RenderContext, &Accelerator),
    ray: &Ray,
    mut hit: Hit,
    state: &mut PathState,
    chance: impl Fn(u32) -> f32,
    worker: &mut Worker,
) -> Option<Hit> {
    for step in 0..limits::HOLES {
        let tag = context.geometry.tag(hit.primitive);
        let material = &context.materials[tag.material as usize];
        let has_holes = material.coverage != HoleCoverage::Full;
        let may_be_covered = material.is_clear() && !state.medium.is_air();
        let is_left_out = is_left_out(state, material);
        if !has_holes && !may_be_covered && !is_left_out {
            return Some(hit);
        }
        let surface = context.geometry.surface_point(ray, &hit);
        let cover = match is_left_out {
            true => 0.0,
            false if has_holes => cover(context, ray, &hit, state.cone, &surface),
            false => 1.0,
        };
        // Whether all of it is there needs no chance.
        let is_split = context.settings.splits_holes && material.coverage == HoleCoverage::Partial;
        let is_there = cover >= 1.0 || (cover > 0.0 && (is_split || chance(step) < cover));
        let front = ray.direction.dot(surface.geometric_normal) < 0.0;
        let crossing = Crossing::new(context.materials, state.medium, tag, front);
        if is_there {
            if !may_be_covered || !crossing.is_passed(material) {
                return Some(hit);
            }
            // No light is sampled through the surface: the ray alone finds what lies behind.
            state.pdf = 0.0;
            change_medium(context, state, crossing.behind, hit.t);
        } else if !front && !is_left_out {
            change_medium(context, state, crossing.behind, hit.t);
        }
        let on = onward(ray, &surface);
        let next = accelerator.closest(context.geometry, &on, &mut worker.traversal)?;
        hit = context.geometry.seen_from(ray, &on, next);
    }
    Some(hit)
}

/// Takes a ray into other bodies at a distance from its start. Its whole way is taken to run in the new medium later on,
/// so that its weight makes up for the difference.
fn change_medium(context: RenderContext, state: &mut PathState, behind: MediumStack, distance: f32) {
    let [before, after] = [state.medium, behind].map(|stack| stack.material(context.materials));
    state.medium = behind;
    if before == after {
        return;
    }
    if let Some(medium) = before {
        state.throughput *= context.materials[medium as usize].transmittance(distance);
    }
    if let Some(medium) = after {
        // Where nothing would be left of the whole way, nothing is left.
        let passed = context.materials[medium as usize].transmittance(distance);
        state.throughput *= passed.map(|share| if share > 0.0 { 1.0 / share } else { 0.0 });
    }
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
