//! Blinn-Phong surfaces of Whitted and distribution pictures, eight at a time.
//!
//! These let nothing through and mirror, if they do, without gloss.

use glam::Vec3;

use super::batch::{ShadingBatch, ShadingInput};
use super::context::RenderContext;
use super::lamp_shading::{BlinnPhongShading, mirror_directions, push_mirrored, sample_lamp};
use super::ray_queue::RayQueue;
use super::shadow_ray_queue::ShadowRayQueue;
use crate::components::Model;
use crate::trace::counters::Counters;
use crate::trace::material::{HoleCoverage, ShadingParams};
use crate::trace::simd::{Kernel, LANES, V3, Wide, lanes, set_lane};

/// The surfaces that a wave met.
pub struct BlinnPhongKernel<'a> {
    /// What the wave met.
    pub met: ShadingInput<'a>,
    /// Whether no ray follows.
    pub last: bool,
    /// Where shadow rays are asked for, a queue for each light.
    pub shadows: &'a mut [ShadowRayQueue],
    /// Where rays go on.
    pub next: &'a mut RayQueue,
    /// What is counted.
    pub counters: &'a mut Counters,
}

/// Whether a surface of this material belongs here, where nothing shines among the primitives.
#[inline]
pub fn is_blinn_phong(context: RenderContext, material: &ShadingParams) -> bool {
    let diffuse = material.model == Model::Lambert;
    let gloss = context.settings.gloss && material.gloss > 0.0;
    let opaque = material.model == Model::BlinnPhong && material.transmission == 0.0 && !gloss;
    let split = context.settings.splits_holes && material.coverage == HoleCoverage::Partial;
    (diffuse || opaque) && material.emission == Vec3::ZERO && !split
}

impl Kernel for BlinnPhongKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let BlinnPhongKernel { met, last, shadows, next, counters } = self;
        for places in met.places.chunks(LANES) {
            let hits = met.group::<L>(places);
            // What only mirrors samples no lamps.
            let scattering = scattering(&hits);
            if scattering != 0 {
                let shading = BlinnPhongShading::<L, _>::new(&hits);
                for (i, lamp) in met.context.lights.lamps().iter().enumerate() {
                    sample_lamp(met.context, (&hits, &shading), scattering, (lamp, i), shadows);
                }
            }
            if !last {
                mirror(met.context, &hits, (next, counters));
            }
        }
    }
}

/// Lanes of surfaces that show light of lamps.
#[inline(always)]
fn scattering<L: Wide>(hits: &ShadingBatch<L>) -> u32 {
    let mut bits = 0;
    for i in lanes(hits.used) {
        let material = hits.material(i);
        let scatters = material.diffuse != Vec3::ZERO || material.specular != Vec3::ZERO;
        bits |= u32::from(scatters) << i;
    }
    bits
}

/// The rays that show what mirrors show.
#[inline(always)]
fn mirror<L: Wide>(context: RenderContext, hits: &ShadingBatch<L>, into: (&mut RayQueue, &mut Counters)) {
    let mirrors = |i: &usize| hits.material(*i).model != Model::Lambert && hits.material(*i).reflection > 0.0;
    let (mut mirroring, mut weight) = (0u32, [[0.0; LANES]; 3]);
    for i in lanes(hits.used).filter(mirrors) {
        mirroring |= 1 << i;
        set_lane(&mut weight, i, hits.material(i).mirror_color * hits.material(i).reflection);
    }
    if mirroring != 0 {
        let toward = (mirror_directions(hits), hits.states.cone);
        push_mirrored(context, hits, mirroring, toward, V3::load(&weight), into);
    }
}
