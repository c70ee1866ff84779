//! Path tracing: every hit goes on in one direction (Kajiya 1986), and samples one light on the way.
//!
//! Light that a ray meets by itself and light that was sampled are one and the same; each is weighed by how well its
//! way of sampling finds it (multiple importance sampling, Veach 1997). Surfaces that single rays alone find (mirrors,
//! polished glass) leave lights to the rays. Paths end by chance where little is left of their light, which keeps the
//! mean (Russian roulette), and at `max_depth` rays, the camera's being the first; the last surface samples lights with
//! its full weight, since no ray follows that could meet it.

use glam::Vec3;

use crate::trace::counters::Counters;
use crate::trace::light::Lights;
use crate::trace::material::TransportMode;
use crate::trace::material::bsdf::Bsdf;
use crate::trace::sampler::{Domain, Frame, power_heuristic};
use crate::trace::soa::Ray;
use crate::trace::wavefront::{
    MIN_ROULETTE_DEPTH, PathState, RayQueue, RenderContext, ShadowRayQueue, SurfaceInteraction, accumulator_slot,
    shadow_ray_from,
};

/// Adds the light of lamps that a ray crosses on its way to its end; they do not stop it.
#[inline]
pub fn cross_lamps(context: RenderContext, ray: &Ray, end: f32, state: &PathState, camera: bool, colors: &mut [Vec3]) {
    context.lights.crossed(&Ray { t_max: end, ..*ray }, camera, |radiance, distance, asked, pass| {
        let mut weight = state.throughput * power_heuristic(state.pdf, asked);
        if let Some(medium) = state.medium.material(context.materials) {
            weight *= context.materials[medium as usize].transmittance(distance);
        }
        let light = context.settings.clamps.limited(state.scatterings, weight * radiance);
        colors[accumulator_slot(state.sample, pass) as usize] += light;
    });
}

/// Asks a light, and adds the ray that the path goes on with, if it does.
pub fn shade(
    context: RenderContext,
    met: &SurfaceInteraction,
    depth: u32,
    shadows: &mut [ShadowRayQueue],
    next: &mut RayQueue,
    counters: &mut Counters,
) {
    let bsdf = Bsdf::new(met.material, met.front, context.settings.fresnel, TransportMode::Radiance);
    let (frame, wo) = met.frame();
    let last = depth == context.settings.max_depth;
    if !bsdf.is_specular() && !shadows.is_empty() {
        sample_direct(context, context.lights, met, &ShadingContext { bsdf, frame, wo, last }, shadows);
    }
    if !last && let Some((ray, state)) = scatter(context, met, &bsdf, &frame, wo, depth, counters) {
        next.push(ray, state);
    }
}

/// A surface as a path sees it.
pub struct ShadingContext {
    pub bsdf: Bsdf,
    pub frame: Frame,
    pub wo: Vec3,
    /// Whether no ray follows.
    pub last: bool,
}

/// Asks one of the lights whether it reaches the surface.
#[inline]
pub fn sample_direct(
    context: RenderContext,
    lights: &Lights,
    met: &SurfaceInteraction,
    seen: &ShadingContext,
    shadows: &mut [ShadowRayQueue],
) {
    let ShadingContext { bsdf, frame, wo, last } = seen;
    let (wo, last) = (*wo, *last);
    let SurfaceInteraction { state, surface, sampler, .. } = met;
    let domain = Domain::Light(0);
    let pick = if lights.len() > 1 { sampler.extra(state.node, domain) } else { 0.0 };
    let Some(light) = lights.sample(surface.point, pick, sampler.stratified(state.node, domain)) else { return };
    let wi = frame.to_local(light.direction);
    let above = surface.geometric_normal.dot(light.direction) > 0.0;
    // A smooth normal and the true one may disagree about the side: no light leaks through.
    let start = if above == (wi.z > 0.0) {
        surface.offset_origin(light.direction)
    } else {
        match (wi.z > 0.0).then(|| met.smooth_start(context)).flatten() {
            Some(start) => start,
            None => return,
        }
    };
    let value = bsdf.eval(wo, wi);
    if value == Vec3::ZERO {
        return;
    }
    let share = if light.pdf > 0.0 && !last { power_heuristic(light.pdf, bsdf.pdf(wo, wi)) } else { 1.0 };
    let value = value * surface.terminator(light.direction);
    let mut ray = Ray { origin: start, direction: light.direction, t_max: light.distance };
    if above != (wi.z > 0.0) {
        ray = shadow_ray_from(start, surface.point, light.target, ray);
    }
    let bin = light.light as usize % shadows.len();
    let sample = accumulator_slot(state.sample, lights.group(light.light));
    let contribution = state.throughput * (value * light.contribution * share);
    let contribution = context.settings.clamps.limited(state.scatterings + 1.0, contribution);
    shadows[bin].push(context, ray, light.target, sample, contribution);
}

/// The ray that a path goes on with, if it does.
#[inline]
pub fn scatter(
    context: RenderContext,
    met: &SurfaceInteraction,
    bsdf: &Bsdf,
    frame: &Frame,
    wo: Vec3,
    depth: u32,
    counters: &mut Counters,
) -> Option<(Ray, PathState)> {
    let SurfaceInteraction { state, surface, material, sampler, front, .. } = met;
    let node = state.node.scattered();
    let lobe = if let Bsdf::Lambert(_) = bsdf { 0.0 } else { sampler.extra(state.node, Domain::Lobe) };
    let sampled = bsdf.sample(wo, sampler.stratified(state.node, Domain::Bounce), lobe)?;
    let mut direction = frame.to_world(sampled.wi).normalize();
    let height = surface.geometric_normal.dot(direction);
    let mut start = None;
    if (height < 0.0) != sampled.transmitted {
        if !sampled.specular {
            start = Some((!sampled.transmitted).then(|| met.smooth_start(context)).flatten()?);
        } else {
            // A mirror's ray that a smooth normal sends to the wrong side is brought back.
            direction -= surface.geometric_normal * (2.0 * height);
        }
    }
    let shown = if sampled.specular { 1.0 } else { surface.terminator(direction) };
    let mut throughput = state.throughput * sampled.weight * shown;
    // What radiance loses on its way into glass it gets back on its way out: no reason to end a path.
    let inside = sampled.transmitted == *front && material.transmission > 0.0;
    let worth = throughput.max_element() * if inside { (material.ior * material.ior).max(1.0) } else { 1.0 };
    if worth.is_nan() || worth <= 0.0 {
        return None;
    }
    if depth >= MIN_ROULETTE_DEPTH && worth < 1.0 {
        if sampler.random(node, Domain::Roulette)[0] >= worth {
            return None;
        }
        throughput /= worth;
    }
    let medium = if sampled.transmitted { met.behind } else { state.medium };
    let scatterings = state.scatterings + if sampled.specular { 0.0 } else { 1.0 };
    if sampled.transmitted {
        counters.refraction_rays += 1;
    } else if sampled.specular {
        counters.reflection_rays += 1;
    } else {
        counters.diffuse_rays += 1;
    }
    let ray = Ray::new(start.unwrap_or_else(|| surface.offset_origin(direction)), direction);
    Some((
        ray,
        PathState {
            node,
            throughput,
            pdf: sampled.pdf,
            medium,
            scatterings,
            cone: state.scattered_cone(sampled.pdf),
            ..*state
        },
    ))
}
