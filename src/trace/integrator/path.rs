//! Path tracing: every hit goes on in one direction (Kajiya 1986), and samples one light on the way.
//!
//! Light that a ray meets by itself and light that was sampled are one and the same; each is weighed by how well its
//! way of sampling finds it (multiple importance sampling, Veach 1997). Surfaces that single rays alone find (mirrors,
//! polished glass) leave lights to the rays. Paths end by chance where little is left of their light, which keeps the
//! mean (Russian roulette: `wavefront::path_shading::scatter`), and at `max_depth` rays, the camera's being the first; the
//! last surface samples lights with its full weight, since no ray follows that could meet it.

use glam::Vec3;

use crate::trace::counters::Counters;
use crate::trace::material::TransportMode;
use crate::trace::material::bsdf::{Bsdf, BsdfSample};
use crate::trace::sampler::{Domain, Frame, power_heuristic};
use crate::trace::simd::V3;
use crate::trace::soa::Ray;
use crate::trace::wavefront::{
    BsdfLanes, DirectionSample, PathState, RayQueue, RenderContext, ShadowRayQueue, SurfaceInteraction,
    accumulator_slot, sample_direct, scatter,
};

/// Adds the light of lamps that a ray crosses on its way to its end; they do not stop it.
#[inline]
pub fn cross_lamps(context: RenderContext, ray: &Ray, end: f32, state: &PathState, camera: bool, colors: &mut [Vec3]) {
    let receiver = state.scope.receiver;
    context.lights.crossed(&Ray { t_max: end, ..*ray }, camera, receiver, |radiance, distance, asked, group| {
        let mut weight = state.throughput * power_heuristic(state.pdf, asked);
        if let Some(medium) = state.medium.material(context.materials) {
            weight *= context.materials[medium as usize].transmittance(distance);
        } else if let Some(fog) = context.fog {
            weight *= fog.transmittance(ray.origin, ray.direction, distance);
        }
        let light = context.settings.clamps.limited(state.scatterings, weight * radiance);
        colors[accumulator_slot(state.sample, group) as usize] += light;
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
    let seen = HitBsdf::new(context, met, TransportMode::Radiance);
    let last = depth == context.settings.max_depth;
    if !seen.bsdf.is_specular() && !shadows.is_empty() {
        sample_direct(context, context.lights, (met, &seen), last, shadows);
    }
    if !last && let Some((ray, state)) = scatter_one(context, &seen, depth, counters) {
        next.push(ray, state);
    }
}

/// What a surface does to light, as a path sees it from its side.
pub struct HitBsdf<'a> {
    pub met: &'a SurfaceInteraction<'a>,
    pub bsdf: Bsdf,
    pub frame: Frame,
    pub wo: Vec3,
}

impl<'a> HitBsdf<'a> {
    #[inline]
    pub fn new(context: RenderContext, met: &'a SurfaceInteraction, transport: TransportMode) -> Self {
        let bsdf = Bsdf::new(met.material, met.front, context.settings.fresnel, transport);
        let (frame, wo) = met.frame();
        HitBsdf { met, bsdf, frame, wo }
    }
}

/// A sample in the world.
#[inline(always)]
pub fn direction_sample(frame: &Frame, sampled: &BsdfSample) -> DirectionSample<f32> {
    let BsdfSample { wi, weight, pdf, specular, transmitted } = *sampled;
    let direction = frame.to_world(wi).normalize().into();
    DirectionSample { direction, weight: weight.into(), pdf, good: true, specular, transmitted }
}

impl BsdfLanes<f32> for HitBsdf<'_> {
    type Local = Vec3;
    const HAS_SPECULAR: bool = true;

    #[inline(always)]
    fn local(&self, direction: V3<f32>) -> Vec3 {
        self.frame.to_local(direction.into())
    }
    #[inline(always)]
    fn cosine(&self, wi: Vec3) -> f32 {
        wi.z
    }
    #[inline(always)]
    fn eval(&self, wi: Vec3) -> V3<f32> {
        self.bsdf.eval(self.wo, wi).into()
    }
    #[inline(always)]
    fn pdf(&self, wi: Vec3) -> f32 {
        self.bsdf.pdf(self.wo, wi)
    }
    #[inline(always)]
    fn sample(&self) -> DirectionSample<f32> {
        let (sampler, node) = (&self.met.sampler, self.met.state.node);
        let (point, lobe) = (|| sampler.stratified(node, Domain::Bounce), || sampler.extra(node, Domain::Lobe));
        match self.bsdf.draw(self.wo, point, lobe) {
            Some(sampled) => direction_sample(&self.frame, &sampled),
            None => DirectionSample::default(),
        }
    }
    /// What radiance loses on its way into glass it gets back on its way out: no reason to end a path.
    #[inline(always)]
    fn worth(&self, throughput: V3<f32>, sample: &DirectionSample<f32>) -> f32 {
        let material = self.met.material;
        let inside = sample.transmitted == self.met.front && material.transmission > 0.0;
        throughput.max_element() * if inside { (material.ior * material.ior).max(1.0) } else { 1.0 }
    }
    #[inline(always)]
    fn medium(&self, medium: [f32; 2], sample: &DirectionSample<f32>) -> [f32; 2] {
        if sample.transmitted { self.met.behind.halves() } else { medium }
    }
}

/// The ray that a path goes on with, if it does.
#[inline]
pub fn scatter_one(
    context: RenderContext,
    seen: &HitBsdf,
    depth: u32,
    counters: &mut Counters,
) -> Option<(Ray, PathState)> {
    let rays = scatter::<f32, _, _>(context, seen.met, seen, depth).filter(|rays| rays.spawned.going != 0)?;
    if rays.sample.transmitted {
        counters.refraction_rays += 1;
    } else if rays.sample.specular {
        counters.reflection_rays += 1;
    } else {
        counters.diffuse_rays += 1;
    }
    Some((Ray::new(rays.spawned.origin.into(), rays.spawned.direction.into()), rays.states.single()))
}
