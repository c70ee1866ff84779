//! Surfaces that follow Lambert's law and nothing else, on paths, eight at a time: most of most pictures.

use std::f32::consts::FRAC_1_PI;

use super::batch::{ShadingBatch, ShadingInput};
use super::path_shading::{BsdfLanes, DirectionSample, sample_direct, scatter};
use super::ray_queue::RayQueue;
use super::shadow_ray_queue::ShadowRayQueue;
use crate::trace::counters::Counters;
use crate::trace::sampler::{Domain, cosine_directions, tangents};
use crate::trace::simd::{Kernel, LANES, V3, Wide};

/// The diffuse surfaces that a wave met.
pub struct LambertKernel<'a> {
    /// What the wave met.
    pub met: ShadingInput<'a>,
    /// Number of rays of the paths so far.
    pub depth: u32,
    /// Where shadow rays are asked for, a queue for each light.
    pub shadows: &'a mut [ShadowRayQueue],
    /// Where rays go on.
    pub next: &'a mut RayQueue,
    /// What is counted.
    pub counters: &'a mut Counters,
}

impl Kernel for LambertKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let LambertKernel { met, depth, shadows, next, counters } = self;
        let last = depth >= met.context.settings.max_depth;
        for places in met.places.chunks(LANES) {
            let hits = met.group::<L>(places);
            let bsdf = Lambert { hits: &hits };
            if !shadows.is_empty() {
                sample_direct(met.context, met.context.lights, (&hits, &bsdf), last, shadows);
            }
            if !last && let Some(rays) = scatter(met.context, &hits, &bsdf, depth) {
                counters.diffuse_rays += u64::from(rays.spawned.going.count_ones());
                rays.push(next);
            }
        }
    }
}

/// Lambert's law at eight hits.
struct Lambert<'a, L: Wide> {
    hits: &'a ShadingBatch<'a, L>,
}

impl<L: Wide> BsdfLanes<L> for Lambert<'_, L> {
    type Local = L;
    const HAS_SPECULAR: bool = false;

    #[inline(always)]
    fn local(&self, direction: V3<L>) -> L {
        direction.dot(self.hits.normal)
    }
    #[inline(always)]
    fn cosine(&self, cosine: L) -> L {
        cosine
    }
    #[inline(always)]
    fn eval(&self, cosine: L) -> V3<L> {
        self.hits.albedo.scale(self.pdf(cosine))
    }
    #[inline(always)]
    fn pdf(&self, cosine: L) -> L {
        cosine.max(L::splat(0.0)) * L::splat(FRAC_1_PI)
    }
    #[inline(always)]
    fn sample(&self) -> DirectionSample<L> {
        let (zero, normal) = (L::splat(0.0), self.hits.normal);
        let local = cosine_directions(self.hits.samples.stratified::<L>(Domain::Bounce));
        let [x, y] = tangents(normal);
        let direction = (x.scale(local.x) + y.scale(local.y) + normal.scale(local.z)).normalize();
        DirectionSample {
            direction,
            weight: self.hits.albedo,
            pdf: local.z * L::splat(FRAC_1_PI),
            good: zero.lt(local.z),
            specular: L::mask(0),
            transmitted: L::mask(0),
        }
    }
    #[inline(always)]
    fn worth(&self, throughput: V3<L>, _: &DirectionSample<L>) -> L {
        throughput.max_element()
    }
    #[inline(always)]
    fn medium(&self, medium: [L; 2], _: &DirectionSample<L>) -> [L; 2] {
        medium
    }
}
