//! Whitted and distribution ray tracing: every mirror is followed, and at glass both ways.
//!
//! Surfaces of facets send out one ray over their facets; Whitted pictures take them for polished. What shines among
//! the primitives lights a distribution picture; in a Whitted one it is seen, in mirrors too, and lights nothing.

use std::f32::consts::PI;

use glam::Vec3;

use super::path::direction_sample;
use crate::components::{Fresnel, Integrator, Model};
use crate::trace::counters::Counters;
use crate::trace::material::bsdf::{Bsdf, BsdfSample};
use crate::trace::material::{HoleCoverage, ShadingParams, TransportMode, fresnel, refract};
use crate::trace::sampler::{Domain, Frame, power_heuristic, uniform_sphere};
use crate::trace::simd::V3;
use crate::trace::soa::Ray;
use crate::trace::wavefront::{
    BlinnPhongShading, LampShading, PathState, RayQueue, RenderContext, ShadowRayQueue, SpawnedRays,
    SurfaceInteraction, accumulator_slot, mirror_directions, push_mirrored, sample_lamp, shadow_ray_from,
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

/// A surface other than Blinn-Phong's in the light of lamps.
struct MicrofacetShading<'a> {
    law: &'a WhittedBsdf,
    /// Only ground glass is lit from behind.
    transmits: bool,
}

impl LampShading<f32> for MicrofacetShading<'_> {
    #[inline(always)]
    fn lets_through(&self) -> bool {
        self.transmits
    }
    #[inline(always)]
    fn color(&self, _: u32, direction: V3<f32>, _: f32) -> V3<f32> {
        let WhittedBsdf { all, frame, wo, .. } = self.law;
        (all.eval(*wo, frame.to_local(direction.into())) * PI).into()
    }
}

/// Adds the shadow rays to all lamps.
fn sample_lamps(
    context: RenderContext,
    met: &SurfaceInteraction,
    shading: &impl LampShading<f32>,
    shadows: &mut [ShadowRayQueue],
) {
    for (i, lamp) in context.lights.lamps().iter().enumerate() {
        sample_lamp(context, (met, shading), 1, (lamp, i), shadows);
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
        sample_lamps(context, met, &BlinnPhongShading::new(met), shadows);
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
        let transmits = met.material.transmission > 0.0;
        sample_lamps(context, met, &MicrofacetShading { law: &law, transmits }, shadows);
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
    let (point, lobe) = (|| met.sampler.stratified(node, Domain::Gloss), || met.sampler.extra(node, Domain::Lobe));
    if let Some(sampled) = glossy.draw(law.wo, point, lobe) {
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
    let SpawnedRays { origin, direction, going } = direction_sample(frame, &sampled).spawn_rays(context, met, 1);
    if going == 0 {
        return;
    }
    let direction = Vec3::from(direction);
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
    let ray = Ray::new(origin.into(), direction);
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
    let linking = context.lights.linking(light.light);
    if !context.lights.is_linked(linking, surface.entity) {
        return;
    }
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
        let queue = context.shadow_queue(shadows.len(), lamps, || linking);
        shadows[queue].push(context, ray, light.target, sample, contribution);
    }
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
    let SurfaceInteraction { state, material, .. } = met;
    let mut direction = Vec3::from(mirror_directions::<f32, _>(met));
    let mut cone = state.cone;
    if material.gloss > 0.0 && context.settings.gloss {
        cone = cone.widened(material.gloss);
        let node = state.node.reflected();
        let square = met.sampler.stratified(node, Domain::Gloss);
        let radius = libm::cbrtf(met.sampler.extra(node, Domain::Gloss));
        direction = (direction + uniform_sphere(square) * (material.gloss * radius)).normalize_or(direction);
    }
    push_mirrored::<f32, _>(context, met, 1, (direction.into(), cone.into()), weight.into(), (next, counters));
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
