//! Mirrors and clear glass, polished, on paths, eight at a time: light goes on in one of two single directions.

use glam::Vec3;

use super::batch::{ShadingBatch, ShadingEntry, ShadingInput};
use super::bodies::BodyLanes;
use super::path_shading::{BsdfLanes, DirectionSample, scatter};
use super::ray_queue::RayQueue;
use crate::components::{Fresnel, Model};
use crate::trace::counters::Counters;
use crate::trace::material::bsdf::polished_metal;
use crate::trace::material::{TransportMode, behind_lanes, fresnel_lanes, scale};
use crate::trace::sampler::Domain;
use crate::trace::simd::{Kernel, LANES, Lanes, V3, Wide, set_lane};

/// The polished surfaces that a wave met; light that is asked for finds none of them.
pub struct PolishedKernel<'a> {
    /// What the wave met.
    pub met: ShadingInput<'a>,
    /// Number of rays of the paths so far, fewer than they may have.
    pub depth: u32,
    /// Where rays go on.
    pub next: &'a mut RayQueue,
    /// What is counted.
    pub counters: &'a mut Counters,
}

impl Kernel for PolishedKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let PolishedKernel { met, depth, next, counters } = self;
        for places in met.places.chunks(LANES) {
            let mut hits = met.group::<L>(places);
            let bodies = BodyLanes::new(&met, places, &mut hits);
            let surfaces = Surfaces::new(&met, places, L::bits(hits.front), &bodies.ior);
            let bsdf = Polished::new(&hits, bodies, surfaces, met.context.settings.fresnel);
            if let Some(rays) = scatter(met.context, &hits, &bsdf, depth) {
                let transmitted = L::bits(rays.sample.transmitted) & rays.spawned.going;
                counters.refraction_rays += u64::from(transmitted.count_ones());
                counters.reflection_rays += u64::from((rays.spawned.going & !transmitted).count_ones());
                rays.push(next);
            }
        }
    }
}

/// What surfaces are of, lane by lane.
#[derive(Default)]
struct Surfaces {
    /// Lanes of each model; all others are of Blinn-Phong's.
    dielectrics: u32,
    conductors: u32,
    /// Index ahead over index behind.
    eta: [f32; LANES],
    /// Factor of what goes through.
    scale: [f32; LANES],
    reflection: [f32; LANES],
    mirror_color: [[f32; LANES]; 3],
}

impl Surfaces {
    #[inline(never)]
    fn new(met: &ShadingInput, places: &[ShadingEntry], fronts: u32, ior: &[f32; LANES]) -> Surfaces {
        let mut surfaces = Surfaces::default();
        for (i, [_, material]) in places.iter().enumerate() {
            let (m, front) = (&met.context.materials[*material as usize], fronts >> i & 1 == 1);
            match m.model {
                Model::Dielectric => surfaces.dielectrics |= 1 << i,
                Model::Conductor => surfaces.conductors |= 1 << i,
                Model::BlinnPhong | Model::Lambert | Model::Plastic | Model::Principled | Model::Unlit => {}
            }
            surfaces.eta[i] = match m.transmission > 0.0 {
                true if front => ior[i],
                true => 1.0 / ior[i],
                false => 1.0,
            };
            surfaces.scale[i] = scale(surfaces.eta[i], TransportMode::Radiance);
            surfaces.reflection[i] = m.reflection;
            set_lane(&mut surfaces.mirror_color, i, m.mirror_color);
        }
        surfaces
    }
}

/// The two ways on from eight hits.
struct Polished<'a, L: Wide> {
    hits: &'a ShadingBatch<'a, L>,
    bodies: BodyLanes,
    surfaces: Surfaces,
    fresnel: Fresnel,
    axes: [V3<L>; 3],
    /// Back along the rays, in these axes.
    wo: V3<L>,
}

/// Which of two ways light goes on, and with what weight.
struct Choice<L: Lanes> {
    is_mirror: L::Mask,
    good: L::Mask,
    weight: V3<L>,
}

impl<'a, L: Wide> Polished<'a, L> {
    #[inline(always)]
    fn new(hits: &'a ShadingBatch<'a, L>, bodies: BodyLanes, surfaces: Surfaces, fresnel: Fresnel) -> Self {
        let (axes, wo) = hits.axes();
        Polished { hits, bodies, surfaces, fresnel, axes, wo }
    }

    /// As the polished `BlinnPhong` samples; `passes` where light is not wholly reflected.
    #[inline(always)]
    fn blinn_phong(&self, lobe: L, passes: L::Mask) -> Choice<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let Surfaces { eta, scale, reflection, mirror_color, .. } = &self.surfaces;
        let (reflection, transmission) = (L::load(reflection), L::load(&self.bodies.transmission));
        let (whole, share, rest) = match self.fresnel {
            Fresnel::Off => ((reflection + transmission).min(one), reflection, transmission),
            model => {
                let share = fresnel_lanes(model, self.wo.z, one / L::load(eta));
                (one, share, (one - share) * transmission)
            }
        };
        let clear = zero.lt(transmission);
        let reflected = L::select(clear, L::select(passes, share, whole), reflection);
        let through = L::select(L::and(clear, passes), rest, zero);
        let mirror = V3::load(mirror_color).scale(reflected);
        let weight = mirror.max_element();
        let sum = weight + through;
        let chances = [weight, through].map(|way| L::select(zero.lt(sum), way / sum, zero));
        let is_mirror = L::and(zero.lt(chances[0]), L::or(lobe.lt(chances[0]), chances[1].le(zero)));
        let through = through * L::load(scale) / chances[1];
        Choice {
            is_mirror,
            good: L::or(is_mirror, zero.lt(chances[1])),
            weight: V3::select(is_mirror, over(mirror, chances[0]), V3 { x: through, y: through, z: through }),
        }
    }

    /// As the polished `Dielectric` samples: the chance of the way cancels its weight.
    #[inline(always)]
    fn dielectric(&self, lobe: L) -> Choice<L> {
        let one = L::splat(1.0);
        let share = fresnel_lanes(Fresnel::Exact, self.wo.z, one / L::load(&self.surfaces.eta));
        let is_mirror = lobe.lt(share);
        let weight = L::select(is_mirror, one, L::load(&self.surfaces.scale));
        Choice { is_mirror, good: L::mask(u32::MAX), weight: V3 { x: weight, y: weight, z: weight } }
    }

    /// What polished metals reflect.
    #[inline(never)]
    fn metals(&self, cosines: &[f32; LANES]) -> [[f32; LANES]; 3] {
        let mut reflected = [[0.0; LANES]; 3];
        for (i, cosine) in cosines.iter().enumerate() {
            if self.surfaces.conductors >> i & 1 == 1 {
                set_lane(&mut reflected, i, polished_metal(self.hits.material(i), *cosine));
            }
        }
        reflected
    }
}

/// Divided by a number of each lane.
#[inline(always)]
fn over<L: Lanes>(v: V3<L>, by: L) -> V3<L> {
    V3 { x: v.x / by, y: v.y / by, z: v.z / by }
}

impl<L: Wide> BsdfLanes<L> for Polished<'_, L> {
    type Local = ();
    const HAS_SPECULAR: bool = true;

    #[inline(always)]
    fn local(&self, _: V3<L>) {}
    #[inline(always)]
    fn cosine(&self, (): ()) -> L {
        L::splat(0.0)
    }
    #[inline(always)]
    fn eval(&self, (): ()) -> V3<L> {
        V3::splat(Vec3::ZERO)
    }
    #[inline(always)]
    fn pdf(&self, (): ()) -> L {
        L::splat(0.0)
    }
    #[inline(always)]
    fn sample(&self) -> DirectionSample<L> {
        let (zero, wo) = (L::splat(0.0), self.wo);
        let Surfaces { dielectrics, conductors, eta, .. } = &self.surfaces;
        let chooses = L::any(zero.lt(L::load(&self.bodies.transmission)));
        let lobe = if chooses { self.hits.samples.extra(Domain::Lobe) } else { zero };
        let (through, passes) = behind_lanes(wo, V3::splat(Vec3::Z), L::load(eta));
        let mut choice = self.blinn_phong(lobe, passes);
        if *dielectrics != 0 {
            let (mask, other) = (L::mask(*dielectrics), self.dielectric(lobe));
            choice.is_mirror = L::or(L::and(mask, other.is_mirror), L::and(L::not(mask), choice.is_mirror));
            choice.good = L::or(mask, choice.good);
            choice.weight = V3::select(mask, other.weight, choice.weight);
        }
        if *conductors != 0 {
            let (mask, color) = (L::mask(*conductors), V3::load(&self.metals(&wo.z.store())));
            choice.is_mirror = L::or(mask, choice.is_mirror);
            choice.good = L::or(mask, choice.good);
            choice.weight = V3::select(mask, color, choice.weight);
        }
        let wi = V3::select(choice.is_mirror, V3 { x: -wo.x, y: -wo.y, z: wo.z }, through);
        let [x, y, z] = self.axes;
        let direction = (x.scale(wi.x) + y.scale(wi.y) + z.scale(wi.z)).normalize();
        DirectionSample {
            direction,
            weight: choice.weight,
            pdf: zero,
            good: L::and(choice.good, L::or(choice.is_mirror, passes)),
            specular: L::mask(u32::MAX),
            transmitted: L::not(choice.is_mirror),
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
