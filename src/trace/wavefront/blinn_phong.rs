//! Blinn-Phong surfaces of Whitted and distribution pictures, eight at a time.
//!
//! What the integrator `whitted` does for any surface, done in lanes for those that let nothing through and mirror, if
//! they do, without gloss.

use glam::Vec3;

use super::batch::{ShadingBatch, ShadingInput};
use super::context::{LightSampling, RenderContext};
use super::path_state::PathStateLanes;
use super::ray_queue::RayQueue;
use super::shadow_ray_queue::{ShadowRayBatch, ShadowRayQueue};
use crate::components::Model;
use crate::trace::counters::Counters;
use crate::trace::light::Lamp;
use crate::trace::material::{HoleCoverage, ShadingParams};
use crate::trace::sampler::{Domain, RayNode};
use crate::trace::simd::{Kernel, LANES, V3, Wide, lanes, set_lane};

/// The surfaces that a wave met.
pub struct BlinnPhongKernel<'a> {
    pub met: ShadingInput<'a>,
    /// Whether no ray follows.
    pub last: bool,
    pub shadows: &'a mut [ShadowRayQueue],
    pub next: &'a mut RayQueue,
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
    fn run<L: Wide>(mut self) {
        for places in self.met.places.chunks(LANES) {
            let group = self.met.group::<L>(places);
            // What only mirrors samples no lamps.
            let scattering = self.scattering(&group);
            if scattering != 0 {
                for (i, lamp) in self.met.context.lights.lamps().iter().enumerate() {
                    self.direct(&group, scattering, lamp, i);
                }
            }
            if !self.last {
                self.mirror(&group);
            }
        }
    }
}

impl BlinnPhongKernel<'_> {
    #[inline(always)]
    fn material<L: Wide>(&self, group: &ShadingBatch<L>, i: usize) -> &ShadingParams {
        &self.met.context.materials[group.materials[i] as usize]
    }

    /// As in `whitted`: shadow rays to a lamp, from the lanes that scatter its light.
    #[inline(always)]
    fn direct<L: Wide>(&mut self, group: &ShadingBatch<L>, scattering: u32, lamp: &Lamp, number: usize) {
        let domain = Domain::Light(number as u32);
        let center = [L::splat(0.5); 2];
        let at = match self.met.context.settings.light_sampling {
            _ if lamp.is_point() => center,
            LightSampling::Center => center,
            LightSampling::Fixed(n) => {
                let cell = |i: u32| (i as f32 + 0.5) / n as f32;
                for k in 0..n * n {
                    let at = [L::splat(cell(k % n)), L::splat(cell(k / n))];
                    self.lit(group, scattering, (lamp, number), at, 1.0 / (n * n) as f32);
                }
                return;
            }
            LightSampling::Random => group.samples.random(domain),
            LightSampling::Jittered => group.samples.stratified(domain),
        };
        self.lit(group, scattering, (lamp, number), at, 1.0);
    }

    #[inline(always)]
    fn lit<L: Wide>(
        &mut self,
        group: &ShadingBatch<L>,
        scattering: u32,
        (lamp, number): (&Lamp, usize),
        [u, v]: [L; 2],
        share: f32,
    ) {
        let (zero, points) = (L::splat(0.0), &group.points);
        let target = lamp.targets(points.point, [u, v]);
        let above = zero.lt(points.geometric_normal.dot(target - points.point));
        let mut origin = points.offset_origin(points.geometric_normal);
        let faces = L::bits(zero.lt(points.shading_normal.dot(target - points.point))) & scattering;
        let mut reached = L::bits(above) & scattering;
        if faces & !reached != 0 {
            let found;
            (found, origin) = self.met.smooth_starts(group, faces & !reached, origin);
            reached |= found;
        }
        let offset = target - origin;
        let square = offset.dot(offset);
        let distance = square.sqrt();
        let direction = offset.scale(L::splat(1.0) / distance);
        let cosine = points.shading_normal.dot(direction);
        let lit = L::bits(zero.lt(cosine)) & reached;
        if lit == 0 {
            return;
        }
        let mut color = group.albedo.scale(cosine);
        let shine = self.highlights(group, lit, direction);
        if let Some(shine) = shine {
            color = color + shine;
        }
        let strength = if lamp.inverse_square { L::splat(share) / square } else { L::splat(share) };
        let strength = strength * lamp.cone.shares(direction);
        let contribution = group.states.throughput * (color * V3::splat(lamp.color)).scale(strength);
        let scatterings = group.states.scatterings + L::splat(1.0);
        let contribution = self.met.context.settings.clamps.limited_lanes(scatterings, contribution);
        let asked = ShadowRayBatch { origin, direction, distance, target, contribution };
        self.shadows[number].compress_store(self.met.context, lit, &asked, group.samples.which(), lamp.group);
    }

    /// Lanes of surfaces that show light of lamps.
    #[inline(always)]
    fn scattering<L: Wide>(&self, group: &ShadingBatch<L>) -> u32 {
        let mut bits = 0;
        for i in lanes(group.used) {
            let material = self.material(group, i);
            let scatters = material.diffuse != Vec3::ZERO || material.specular != Vec3::ZERO;
            bits |= u32::from(scatters) << i;
        }
        bits
    }

    /// Blinn's highlights, if any of the surfaces has one.
    #[inline(always)]
    fn highlights<L: Wide>(&self, group: &ShadingBatch<L>, lit: u32, direction: V3<L>) -> Option<V3<L>> {
        let material = |i: usize| self.material(group, i);
        let shiny = |i: &usize| material(*i).model != Model::Lambert && material(*i).specular != Vec3::ZERO;
        lanes(lit).find(shiny)?;
        let zero = V3::splat(Vec3::ZERO);
        let half = (direction - group.direction).normalize_or(zero);
        let base = half.dot(group.points.shading_normal).max(L::splat(0.0)).store();
        let mut shine = [[0.0; LANES]; 3];
        for i in lanes(lit).filter(shiny) {
            set_lane(&mut shine, i, material(i).specular * libm::powf(base[i], material(i).shininess));
        }
        Some(V3::load(&shine))
    }

    /// The rays that show what mirrors show.
    #[inline(always)]
    fn mirror<L: Wide>(&mut self, group: &ShadingBatch<L>) {
        let material = |i: usize| &self.met.context.materials[group.materials[i] as usize];
        let mirrors = |i: &usize| material(*i).model != Model::Lambert && material(*i).reflection > 0.0;
        let (mut mirroring, mut weight) = (0u32, [[0.0; LANES]; 3]);
        for i in lanes(group.used).filter(mirrors) {
            mirroring |= 1 << i;
            set_lane(&mut weight, i, material(i).mirror_color * material(i).reflection);
        }
        let (weight, least) = (V3::load(&weight), self.met.context.settings.min_weight);
        if least > 0.0 {
            // Fainter rays are not followed.
            mirroring &= L::bits(L::splat(least).le((group.states.throughput * weight).max_element()));
        }
        if mirroring == 0 {
            return;
        }
        self.counters.reflection_rays += u64::from(mirroring.count_ones());
        let (two, points) = (L::splat(2.0), &group.points);
        let normal = points.shading_normal;
        let mut direction = group.direction - normal.scale(two * group.direction.dot(normal));
        // Smooth normals may send the ray below the surface: mirror it back up.
        let height = direction.dot(points.geometric_normal);
        let risen = direction - points.geometric_normal.scale(two * height);
        direction = V3::select(height.lt(L::splat(0.0)), risen, direction);
        let throughput = group.states.throughput * weight;
        let states = PathStateLanes { throughput, pdf: L::splat(0.0), ..group.states };
        let states = states.at(&group.samples.onward(RayNode::reflected));
        self.next.compress_store(mirroring, points.offset_origin(direction), direction, &states);
    }
}
