//! What a path does where it meets a surface on which photons lie.

use glam::Vec3;

use super::pass::PhotonPass;
use crate::trace::counters::Counters;
use crate::trace::integrator::path::{self, ShadingContext};
use crate::trace::material::TransportMode;
use crate::trace::material::bsdf::Bsdf;
use crate::trace::sampler::Domain;
use crate::trace::wavefront::{EmissionFilter, PathState, RayQueue, RenderContext, ShadowRayQueue, SurfaceInteraction};

/// Where light goes that a path finds, and the rays that follow.
pub struct PathOutput<'a> {
    /// Of the path's sample.
    pub color: &'a mut Vec3,
    pub shadows: &'a mut [ShadowRayQueue],
    pub next: &'a mut RayQueue,
}

/// What a path does where it meets a surface.
pub fn shade(
    context: RenderContext,
    photons: &PhotonPass,
    met: &SurfaceInteraction,
    depth: u32,
    sinks: PathOutput,
    counters: &mut Counters,
) {
    let bsdf = Bsdf::new(met.material, met.front, context.settings.fresnel, TransportMode::Radiance);
    let (frame, wo) = met.frame();
    let last = depth == context.settings.max_depth;
    let all = met.state.emission_filter == EmissionFilter::All;
    let lights = if all { context.lights } else { &photons.non_photon };
    if !bsdf.is_specular() && !sinks.shadows.is_empty() && !lights.is_empty() {
        path::sample_direct(context, lights, met, &ShadingContext { bsdf, frame, wo, last }, sinks.shadows);
    }
    if all && bsdf.is_diffuse() {
        let most_rays = context.settings.max_depth + 1 - depth;
        let light = met.state.throughput * photons.gather(met, &bsdf, &frame, wo, most_rays);
        *sinks.color += context.settings.clamps.limited(met.state.scatterings + 2.0, light);
    }
    if last || !(all || photons.goes_on) {
        return;
    }
    let Some((ray, mut state)) = path::scatter(context, met, &bsdf, &frame, wo, depth, counters) else { return };
    if !all {
        state.emission_filter = EmissionFilter::NonPhoton;
    } else if state.pdf > 0.0 && bsdf.is_diffuse() {
        divide(met, &bsdf, wo, frame.to_local(ray.direction), &mut state);
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
        state.emission_filter = EmissionFilter::DirectOnly;
    }
    if chance > 0.0 {
        let (part, chance) = if followed { (rest, chance) } else { (diffuse, 1.0 - chance) };
        state.throughput *= Vec3::select(whole.cmpgt(Vec3::ZERO), part / whole, Vec3::ZERO) / chance;
    }
}
