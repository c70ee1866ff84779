//! Whitted and distribution ray tracing: every mirror is followed, and at glass both ways.
//!
//! Surfaces of facets send out one ray over their facets; Whitted pictures take them for polished. What shines among
//! the primitives lights a distribution picture; in a Whitted one it is seen, in mirrors too, and lights nothing.

use std::f32::consts::PI;

use glam::Vec3;

use crate::components::{Fresnel, Integrator, Model};
use crate::trace::counters::Counters;
use crate::trace::light::Lamp;
use crate::trace::material::bsdf::{Bsdf, BsdfSample};
use crate::trace::material::{HoleCoverage, ShadingParams, TransportMode, fresnel, reflect, refract};
use crate::trace::sampler::{Domain, Frame, power_heuristic, uniform_sphere};
use crate::trace::soa::Ray;
use crate::trace::wavefront::{
    LightSampling, PathState, RayQueue, RenderContext, ShadowRayQueue, SurfaceInteraction, accumulator_slot,
    shadow_ray_from,
};

/// The law that a surface other than Blinn-Phong's scatters by, and its axes.
struct WhittedBsdf {
    all: Bsdf,
    /// What is followed by a ray.
    glossy: Option<Bsdf>,
    frame: Frame,
    wo: Vec3,
}

impl WhittedBsdf {
    fn new(context: RenderContext, met: &SurfaceInteraction) -> WhittedBsdf {
        let whitted = is_whitted(context);
        let polished = ShadingParams { alpha: 0.0, ..*met.material };
        let material = if whitted { &polished } else { met.material };
        let all = Bsdf::new(material, met.front, context.settings.fresnel, TransportMode::Radiance);
        let (frame, wo) = met.frame();
        WhittedBsdf { all, glossy: all.glossy(), frame, wo }
    }
}

/// Asks the lights and adds the rays that a hit gives rise to.
pub fn shade(
    context: RenderContext,
    met: &SurfaceInteraction,
    last: bool,
    shadows: &mut [ShadowRayQueue],
    next: &mut RayQueue,
    counters: &mut Counters,
) {
    let material = met.material;
    if material.coverage == HoleCoverage::Partial && material.opacity < 1.0 && context.settings.splits_holes {
        let state = PathState { throughput: met.state.throughput * material.opacity, ..met.state };
        let whole = ShadingParams { opacity: 1.0, ..*material };
        let there = SurfaceInteraction { state, material: &whole, ..*met };
        shade(context, &there, last, shadows, next, counters);
        if !last {
            go_straight_on(met, 1.0 - material.opacity, next);
        }
        return;
    }
    if material.model != Model::BlinnPhong {
        return shade_microfacets(context, met, last, shadows, next, counters);
    }
    if material.diffuse != Vec3::ZERO || material.specular != Vec3::ZERO {
        for (i, light) in context.lights.lamps().iter().enumerate() {
            sample_lamp(context, met, None, light, Domain::Light(i as u32), &mut shadows[i]);
        }
        if !context.lights.emitters().is_empty() {
            let all = Bsdf::new(
                &ShadingParams { gloss: 0.0, ..*material },
                met.front,
                context.settings.fresnel,
                TransportMode::Radiance,
            );
            let (frame, wo) = met.frame();
            sample_emitters(context, met, &WhittedBsdf { all, glossy: None, frame, wo }, shadows);
        }
    }
    if !last {
        spawn(context, met, next, counters);
    }
}

fn is_whitted(context: RenderContext) -> bool {
    context.settings.integrator == Integrator::Whitted
}

/// Adds the ray that a surface which is not wholly there leaves as it is.
fn go_straight_on(met: &SurfaceInteraction, share: f32, next: &mut RayQueue) {
    let state = &met.state;
    let ray = Ray::new(met.surface.offset_origin(met.direction), met.direction);
    // It leaves a body that it was in, and enters none.
    let medium = if met.front { state.medium } else { met.behind };
    next.push(ray, PathState { medium, ..state.onward(state.node.refracted(), Vec3::splat(share)) });
}

fn shade_microfacets(
    context: RenderContext,
    met: &SurfaceInteraction,
    last: bool,
    shadows: &mut [ShadowRayQueue],
    next: &mut RayQueue,
    counters: &mut Counters,
) {
    let law = WhittedBsdf::new(context, met);
    if !law.all.is_specular() {
        for (i, light) in context.lights.lamps().iter().enumerate() {
            sample_lamp(context, met, Some(&law), light, Domain::Light(i as u32), &mut shadows[i]);
        }
        sample_emitters(context, met, &law, shadows);
    }
    let Some(glossy) = law.glossy.filter(|_| !last) else { return };
    if met.material.model == Model::Dielectric && glossy.is_specular() {
        return dielectric(context, met, next, counters);
    }
    if let Bsdf::Principled(polished) = glossy
        && polished.is_specular()
    {
        let both = polished.polished(law.wo).into_iter().flatten();
        return both.for_each(|sampled| follow(context, met, &law.frame, sampled, next, counters));
    }
    let node = met.state.node.reflected();
    let lobe = met.sampler.extra(node, Domain::Lobe);
    if let Some(sampled) = glossy.sample(law.wo, met.sampler.stratified(node, Domain::Gloss), lobe) {
        follow(context, met, &law.frame, sampled, next, counters);
    }
}

/// Adds the ray of a sample.
fn follow(
    context: RenderContext,
    met: &SurfaceInteraction,
    frame: &Frame,
    sampled: BsdfSample,
    next: &mut RayQueue,
    counters: &mut Counters,
) {
    let SurfaceInteraction { state, surface, .. } = met;
    let mut direction = frame.to_world(sampled.wi).normalize();
    let height = surface.geometric_normal.dot(direction);
    let mut start = None;
    if (height < 0.0) != sampled.transmitted {
        if sampled.specular {
            direction -= surface.geometric_normal * (2.0 * height);
        } else {
            start = (!sampled.transmitted).then(|| met.smooth_start(context)).flatten();
            if start.is_none() {
                return;
            }
        }
    }
    let shown = if sampled.specular { 1.0 } else { surface.terminator(direction) };
    if !shows(context, met, sampled.weight * shown) {
        return;
    }
    let (node, medium) = if sampled.transmitted {
        counters.refraction_rays += 1;
        (state.node.refracted(), met.behind)
    } else {
        counters.reflection_rays += 1;
        (state.node.reflected(), state.medium)
    };
    let ray = Ray::new(start.unwrap_or_else(|| surface.offset_origin(direction)), direction);
    let onward = state.onward(node, sampled.weight * shown);
    let (cone, scatterings) =
        (state.scattered_cone(sampled.pdf), state.scatterings + if sampled.specular { 0.0 } else { 1.0 });
    next.push(ray, PathState { pdf: sampled.pdf, medium, scatterings, cone, ..onward });
}

/// A shadow ray to one of the primitives that shine.
fn sample_emitters(
    context: RenderContext,
    met: &SurfaceInteraction,
    law: &WhittedBsdf,
    shadows: &mut [ShadowRayQueue],
) {
    let SurfaceInteraction { state, surface, sampler, .. } = met;
    if is_whitted(context) {
        return;
    }
    let lamps = context.lights.lamps().len();
    let domain = Domain::Light(lamps as u32);
    let pick = sampler.extra(state.node, domain);
    let at = sampler.stratified(state.node, domain);
    let Some(light) = context.lights.sample_emitters(surface.point, pick, at) else { return };
    let wi = law.frame.to_local(light.direction);
    let mut ray = Ray { origin: surface.point, direction: light.direction, t_max: light.distance };
    if (surface.geometric_normal.dot(light.direction) > 0.0) == (wi.z > 0.0) {
        ray.origin = surface.offset_origin(light.direction);
    } else {
        let Some(start) = (wi.z > 0.0).then(|| met.smooth_start(context)).flatten() else { return };
        ray = shadow_ray_from(start, surface.point, light.target, ray);
    }
    // Where a ray looks for the same light, the two share it.
    let mut value = law.all.eval(law.wo, wi);
    if let Some(glossy) = &law.glossy {
        let both = glossy.eval(law.wo, wi);
        value += both * (power_heuristic(light.pdf, glossy.pdf(law.wo, wi)) - 1.0);
    }
    if value.max_element() > 0.0 {
        let shown = surface.terminator(light.direction);
        let contribution = state.throughput * (value.max(Vec3::ZERO) * light.contribution * shown);
        let sample = accumulator_slot(state.sample, context.lights.group(light.light));
        let contribution = context.settings.clamps.limited(state.scatterings + 1.0, contribution);
        shadows[lamps].push(context, ray, light.target, sample, contribution);
    }
}

/// Shadow rays from a surface to a lamp.
fn sample_lamp(
    context: RenderContext,
    met: &SurfaceInteraction,
    law: Option<&WhittedBsdf>,
    light: &Lamp,
    domain: Domain,
    shadows: &mut ShadowRayQueue,
) {
    let sampler = &met.sampler;
    let at = match context.settings.light_sampling {
        _ if light.is_point() => [0.5; 2],
        LightSampling::Center => [0.5; 2],
        LightSampling::Fixed(n) => {
            let cell = |i: u32| (i as f32 + 0.5) / n as f32;
            for k in 0..n * n {
                add_lamp_light(context, met, law, light, [cell(k % n), cell(k / n)], 1.0 / (n * n) as f32, shadows);
            }
            return;
        }
        LightSampling::Random => sampler.random(met.state.node, domain),
        LightSampling::Jittered => sampler.stratified(met.state.node, domain),
    };
    add_lamp_light(context, met, law, light, at, 1.0, shadows);
}

/// Light from one point of a lamp, and the ray that tells whether anything stands between.
fn add_lamp_light(
    context: RenderContext,
    met: &SurfaceInteraction,
    law: Option<&WhittedBsdf>,
    light: &Lamp,
    at: [f32; 2],
    share: f32,
    shadows: &mut ShadowRayQueue,
) {
    let SurfaceInteraction { state, surface, .. } = met;
    let target = light.target(surface.point, at);
    let above = surface.geometric_normal.dot(target - surface.point);
    // Only ground glass is lit from behind.
    let through = law.is_some() && met.material.transmission > 0.0;
    if above.is_nan() {
        return;
    }
    let mut from =
        surface.offset_origin(if above > 0.0 { surface.geometric_normal } else { -surface.geometric_normal });
    let mut ahead = above > 0.0;
    if above <= 0.0 && !through {
        // Only the smooth normal may face it.
        let faces = surface.shading_normal.dot(target - surface.point) > 0.0;
        let Some(start) = faces.then(|| met.smooth_start(context)).flatten() else { return };
        (from, ahead) = (start, true);
    }
    let offset = target - from;
    let square = offset.length_squared();
    let distance = square.sqrt();
    let direction = offset * (1.0 / distance);
    let cosine = surface.shading_normal.dot(direction);
    // Not so where the light touches the surface either: the distance is 0, and the cosine no number.
    if cosine.is_nan() || (cosine > 0.0) != ahead || cosine == 0.0 {
        return;
    }
    let color = match law {
        Some(law) => law.all.eval(law.wo, law.frame.to_local(direction)) * PI,
        None => blinn_phong(met, direction, cosine),
    };
    let color = color * surface.terminator(direction);
    let strength = if light.inverse_square { share / square } else { share };
    let strength = strength * light.cone.share(-direction);
    let ray = Ray { origin: from, direction, t_max: distance };
    let sample = accumulator_slot(state.sample, light.group);
    let contribution = state.throughput * (color * light.color * strength);
    shadows.push(context, ray, target, sample, context.settings.clamps.limited(state.scatterings + 1.0, contribution));
}

fn blinn_phong(met: &SurfaceInteraction, direction: Vec3, cosine: f32) -> Vec3 {
    let SurfaceInteraction { surface, material, .. } = met;
    let mut color = material.diffuse * cosine;
    if material.specular != Vec3::ZERO {
        let half = (direction - met.direction).normalize_or_zero();
        let base = half.dot(surface.shading_normal).max(0.0);
        color += material.specular * libm::powf(base, material.shininess);
    }
    color
}

/// Whether the ray that a hit gives rise to stands for enough of the picture to be followed.
fn shows(context: RenderContext, met: &SurfaceInteraction, weight: Vec3) -> bool {
    let least = context.settings.min_weight;
    least == 0.0 || (met.state.throughput * weight).max_element() >= least
}

/// Adds the rays that a hit gives rise to.
fn spawn(context: RenderContext, met: &SurfaceInteraction, next: &mut RayQueue, counters: &mut Counters) {
    let material = met.material;
    if material.transmission > 0.0 {
        dielectric(context, met, next, counters);
    } else if material.reflection > 0.0 {
        mirrored(context, met, material.mirror_color * material.reflection, next, counters);
    }
}

/// Adds the ray that shows what a mirror shows.
fn mirrored(
    context: RenderContext,
    met: &SurfaceInteraction,
    weight: Vec3,
    next: &mut RayQueue,
    counters: &mut Counters,
) {
    if !shows(context, met, weight) {
        return;
    }
    counters.reflection_rays += 1;
    let SurfaceInteraction { state, surface, material, .. } = met;
    let node = state.node.reflected();
    let mut direction = reflect(met.direction, surface.shading_normal);
    let mut cone = state.cone;
    if material.gloss > 0.0 && context.settings.gloss {
        cone = cone.widened(material.gloss);
        let square = met.sampler.stratified(node, Domain::Gloss);
        let radius = libm::cbrtf(met.sampler.extra(node, Domain::Gloss));
        direction = (direction + uniform_sphere(square) * (material.gloss * radius)).normalize_or(direction);
    }
    // Smooth normals and gloss may send the ray below the surface: mirror it back up.
    let height = direction.dot(surface.geometric_normal);
    if height < 0.0 {
        direction -= surface.geometric_normal * (2.0 * height);
    }
    let ray = Ray::new(surface.offset_origin(direction), direction);
    next.push(ray, PathState { cone, ..state.onward(node, weight) });
}

/// Adds the ray that goes through the surface in the refracted direction.
fn transmitted(met: &SurfaceInteraction, mut direction: Vec3, weight: Vec3, next: &mut RayQueue) {
    let SurfaceInteraction { state, surface, .. } = met;
    // A smooth normal may bend the ray back out: keep it on the far side.
    let height = direction.dot(surface.geometric_normal);
    if height > 0.0 {
        direction -= surface.geometric_normal * (2.0 * height);
    }
    let ray = Ray::new(surface.offset_origin(direction), direction);
    let node = state.node.refracted();
    next.push(ray, PathState { medium: met.behind, ..state.onward(node, weight) });
}

/// How a transparent surface divides light: the refracted direction, and weights of reflection and refraction.
fn division(context: RenderContext, met: &SurfaceInteraction) -> (Option<Vec3>, f32, f32) {
    let (direction, material) = (met.direction, met.material);
    let eta = if met.front { 1.0 / material.ior } else { material.ior };
    let normal = met.surface.shading_normal;
    let refracted = refract(direction, normal, eta);
    let model = context.settings.fresnel;
    let classic = material.model == Model::BlinnPhong;
    match refracted {
        None if model == Fresnel::Off && classic => (None, (material.reflection + material.transmission).min(1.0), 0.0),
        None => (None, 1.0, 0.0),
        Some(_) if model == Fresnel::Off && classic => (refracted, material.reflection, material.transmission),
        Some(_) => {
            let model = if classic { model } else { Fresnel::Exact };
            let share = fresnel(model, -direction.dot(normal), eta);
            (refracted, share, (1.0 - share) * material.transmission)
        }
    }
}

fn dielectric(context: RenderContext, met: &SurfaceInteraction, next: &mut RayQueue, counters: &mut Counters) {
    let (refracted, reflected, through) = division(context, met);
    if reflected > 0.0 {
        mirrored(context, met, met.material.mirror_color * reflected, next, counters);
    }
    if let Some(direction) = refracted.filter(|_| shows(context, met, Vec3::splat(through))) {
        counters.refraction_rays += 1;
        transmitted(met, direction, Vec3::splat(through), next);
    }
}
