//! All other surfaces on paths, eight at a time: what they have in common is done side by side, and the law that each of
//! them scatters by is asked one by one.

use glam::Vec3;

use super::batch::{ShadingBatch, ShadingEntry, ShadingInput};
use super::bodies::BodyLanes;
use super::path_shading::{BsdfLanes, DirectionSample, sample_direct, scatter};
use super::ray_queue::RayQueue;
use super::shadow_ray_queue::ShadowRayQueue;
use crate::trace::counters::Counters;
use crate::trace::material::bsdf::Bsdf;
use crate::trace::material::{ShadingParams, TransportMode};
use crate::trace::sampler::Domain;
use crate::trace::simd::{Kernel, LANES, V3, Wide, lane, lanes, set_lane};

/// The surfaces that a wave met, of any material that sends out no light.
pub struct MixedKernel<'a> {
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

impl Kernel for MixedKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let MixedKernel { met, depth, shadows, next, counters } = self;
        let last = depth >= met.context.settings.max_depth;
        for places in met.places.chunks(LANES) {
            let mut hits = met.group::<L>(places);
            let bodies = BodyLanes::new(&met, places, &mut hits);
            let laws = Laws::new(&met, places, L::bits(hits.front), &bodies.ior);
            let bsdf = Mixed::new(&hits, bodies, laws);
            if !shadows.is_empty() && !bsdf.laws.are_specular {
                sample_direct(met.context, met.context.lights, (&hits, &bsdf), last, shadows);
            }
            if !last && let Some(rays) = scatter(met.context, &hits, &bsdf, depth) {
                let going = rays.spawned.going;
                let transmitted = L::bits(rays.sample.transmitted) & going;
                let mirrored = L::bits(rays.sample.specular) & going & !transmitted;
                counters.refraction_rays += u64::from(transmitted.count_ones());
                counters.reflection_rays += u64::from(mirrored.count_ones());
                counters.diffuse_rays += u64::from((going & !transmitted & !mirrored).count_ones());
                rays.push(next);
            }
        }
    }
}

/// The law of each lane.
struct Laws {
    each: [Bsdf; LANES],
    /// Whether all of them scatter light in single directions only.
    are_specular: bool,
}

/// Samples of laws, lane by lane, in the axes of the surfaces.
#[derive(Default)]
struct LawSamples {
    wi: [[f32; LANES]; 3],
    weight: [[f32; LANES]; 3],
    pdf: [f32; LANES],
    good: u32,
    specular: u32,
    transmitted: u32,
}

impl Laws {
    #[inline(never)]
    fn new(met: &ShadingInput, places: &[ShadingEntry], fronts: u32, ior: &[f32; LANES]) -> Laws {
        let (context, mut each) = (met.context, [Bsdf::Lambert(Vec3::ZERO); LANES]);
        let mut are_specular = true;
        for (i, [_, material]) in places.iter().enumerate() {
            let (mut material, own) = (&context.materials[*material as usize], ior[i]);
            let nested;
            if own != material.ior {
                nested = ShadingParams { ior: own, ..*material };
                material = &nested;
            }
            let front = fronts >> i & 1 == 1;
            each[i] = Bsdf::new(material, front, context.settings.fresnel, TransportMode::Radiance);
            are_specular &= each[i].is_specular();
        }
        Laws { each, are_specular }
    }

    #[inline(never)]
    fn eval(&self, used: u32, wo: &[[f32; LANES]; 3], wi: &[[f32; LANES]; 3]) -> [[f32; LANES]; 3] {
        let mut values = [[0.0; LANES]; 3];
        lanes(used).for_each(|i| set_lane(&mut values, i, self.each[i].eval(lane(wo, i), lane(wi, i))));
        values
    }

    #[inline(never)]
    fn pdf(&self, used: u32, wo: &[[f32; LANES]; 3], wi: &[[f32; LANES]; 3]) -> [f32; LANES] {
        let mut densities = [0.0; LANES];
        lanes(used).for_each(|i| densities[i] = self.each[i].pdf(lane(wo, i), lane(wi, i)));
        densities
    }

    #[inline(never)]
    fn sample(&self, used: u32, wo: &[[f32; LANES]; 3], u: &[[f32; LANES]; 2], lobe: &[f32; LANES]) -> LawSamples {
        let mut samples = LawSamples::default();
        for i in lanes(used) {
            let Some(sample) = self.each[i].sample(lane(wo, i), [u[0][i], u[1][i]], lobe[i]) else { continue };
            set_lane(&mut samples.wi, i, sample.wi);
            set_lane(&mut samples.weight, i, sample.weight);
            samples.pdf[i] = sample.pdf;
            samples.good |= 1 << i;
            samples.specular |= u32::from(sample.specular) << i;
            samples.transmitted |= u32::from(sample.transmitted) << i;
        }
        samples
    }
}

/// Eight hits with their laws.
struct Mixed<'a, L: Wide> {
    hits: &'a ShadingBatch<'a, L>,
    bodies: BodyLanes,
    laws: Laws,
    axes: [V3<L>; 3],
    /// Back along the rays, in these axes.
    wo: [[f32; LANES]; 3],
}

impl<'a, L: Wide> Mixed<'a, L> {
    #[inline(always)]
    fn new(hits: &'a ShadingBatch<'a, L>, bodies: BodyLanes, laws: Laws) -> Self {
        let (axes, wo) = hits.axes();
        Mixed { hits, bodies, laws, axes, wo: wo.store() }
    }
}

impl<L: Wide> BsdfLanes<L> for Mixed<'_, L> {
    type Local = V3<L>;
    const HAS_SPECULAR: bool = true;

    #[inline(always)]
    fn local(&self, direction: V3<L>) -> V3<L> {
        let [x, y, z] = self.axes;
        V3 { x: direction.dot(x), y: direction.dot(y), z: direction.dot(z) }
    }
    #[inline(always)]
    fn cosine(&self, wi: V3<L>) -> L {
        wi.z
    }
    #[inline(always)]
    fn eval(&self, wi: V3<L>) -> V3<L> {
        V3::load(&self.laws.eval(self.hits.used, &self.wo, &wi.store()))
    }
    #[inline(always)]
    fn pdf(&self, wi: V3<L>) -> L {
        L::load(&self.laws.pdf(self.hits.used, &self.wo, &wi.store()))
    }
    #[inline(always)]
    fn sample(&self) -> DirectionSample<L> {
        let ([a, b], lobe) =
            (self.hits.samples.stratified::<L>(Domain::Bounce), self.hits.samples.extra::<L>(Domain::Lobe));
        let all = self.laws.sample(self.hits.used, &self.wo, &[a.store(), b.store()], &lobe.store());
        let (wi, [x, y, z]) = (V3::<L>::load(&all.wi), self.axes);
        DirectionSample {
            direction: (x.scale(wi.x) + y.scale(wi.y) + z.scale(wi.z)).normalize(),
            weight: V3::load(&all.weight),
            pdf: L::load(&all.pdf),
            good: L::mask(all.good),
            specular: L::mask(all.specular),
            transmitted: L::mask(all.transmitted),
        }
    }
    #[inline(always)]
    fn worth(&self, throughput: V3<L>, sample: &DirectionSample<L>) -> L {
        self.bodies.worth(throughput, sample.transmitted, self.hits.front)
    }
    #[inline(always)]
    fn medium(&self, medium: [L; 2], sample: &DirectionSample<L>) -> [L; 2] {
        self.bodies.onward(medium, sample.transmitted)
    }
}
