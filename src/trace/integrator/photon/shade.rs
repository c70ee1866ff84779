//! What a path does where it meets a surface on which photons lie.

use glam::Vec3;

use super::pass::PhotonPass;
use crate::trace::accel::TraversalScratch;
use crate::trace::integrator::path::{HitBsdf, scatter_one};
use crate::trace::material::TransportMode;
use crate::trace::material::bsdf::Bsdf;
use crate::trace::sampler::Domain;
use crate::trace::wavefront::{
    EmissionFilter, PathState, RayQueue, RenderContext, ShadowRayQueue, SurfaceInteraction, sample_direct,
};

/// Where light goes that a path finds, and the rays that follow.
pub struct PathOutput<'a> {
    /// Of the path's sample.
    pub color: &'a mut Vec3,
    /// Where shadow rays are asked for, a queue for each light.
    pub shadows: &'a mut [ShadowRayQueue],
    /// Where rays go on.
    pub next: &'a mut RayQueue,
}

/// What a path does where it meets a surface.
pub fn shade(
    context: RenderContext,
    photons: &PhotonPass,
    met: &SurfaceInteraction,
    depth: u32,
    sinks: PathOutput,
    traversal: &mut TraversalScratch,
) {
    let seen = HitBsdf::new(context, met, TransportMode::Radiance);
    let HitBsdf { bsdf, frame, wo, .. } = &seen;
    let last = depth == context.settings.max_depth;
    let all = met.state.scope.filter == EmissionFilter::All;
    let lights = if all { context.lights } else { &photons.non_photon };
    if !bsdf.is_specular() && !sinks.shadows.is_empty() && !lights.is_empty() {
        sample_direct(context, lights, (met, &seen), last, sinks.shadows);
    }
    if all && bsdf.is_diffuse() {
        let most_rays = context.settings.max_depth + 1 - depth;
        let light = met.state.throughput * photons.gather(context, &seen, most_rays, traversal);
        *sinks.color += context.settings.clamps.limited(met.state.scatterings + 2.0, light);
    }
    if last || !(all || photons.goes_on) {
        return;
    }
    let Some((ray, mut state)) = scatter_one(context, &seen, depth, &mut traversal.counters) else { return };
    if !all {
        state.scope.filter = EmissionFilter::NonPhoton;
    } else if state.pdf > 0.0 && bsdf.is_diffuse() {
        divide(met, bsdf, *wo, frame.to_local(ray.direction), &mut state);
    }
    if state.throughput != Vec3::ZERO {
        sinks.next.push(ray, state);
    }
}

/// Of what a surface sends along a ray, photons have told the diffuse part but for what comes straight from lights; the
/// rest goes on in full. Chance decides which of the two the ray is for.
fn divide(met: &SurfaceInteraction, bsdf: &Bsdf, wo: Vec3, wi: Vec3, state: &mut PathState) {
    let (whole, diffuse) = (bsdf.eval(wo, wi), bsdf.diffuse(wo, wi));
    let rest = (whole - diffuse).max(Vec3::ZERO);
    let chance = rest.element_sum() / (rest + diffuse).element_sum();
    // Not so where nothing is left at all: the chance is no number.
    let followed = chance > 0.0 && met.sampler.random(state.node, Domain::Part)[0] < chance;
    if !followed {
        state.scope.filter = EmissionFilter::DirectOnly;
    }
    if chance > 0.0 {
        let (part, chance) = if followed { (rest, chance) } else { (diffuse, 1.0 - chance) };
        state.throughput *= Vec3::select(whole.cmpgt(Vec3::ZERO), part / whole, Vec3::ZERO) / chance;
    }
}
