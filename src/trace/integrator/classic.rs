//! Blinn-Phong surfaces of Whitted and distribution pictures, eight at a time.
//!
//! What [`super::recursive`] does for any surface, done in lanes for those that let nothing through and mirror, if they
//! do, without gloss.

use glam::Vec3;

use super::errand::{Asked, Errands, Shadows, Wave};
use super::group::{Group, Met};
use super::{LightSampling, View};
use crate::components::Model;
use crate::trace::Counters;
use crate::trace::lights::Light;
use crate::trace::sampler::{Domain, Node};
use crate::trace::simd::{Kernel, LANES, V3, Wide, lanes, set_lane};
use crate::trace::surfacing::Surfacing;

/// The surfaces that a wave met.
pub struct Classic<'a> {
    pub met: Met<'a>,
    /// Whether no ray follows.
    pub last: bool,
    pub shadows: &'a mut [Shadows],
    pub next: &'a mut Wave,
    pub counters: &'a mut Counters,
}

/// Whether a surface of this material belongs here, where nothing shines among the primitives.
#[inline]
pub fn is_classic(view: View, material: &Surfacing) -> bool {
    let matt = material.model == Model::Lambert;
    let gloss = view.settings.gloss && material.gloss > 0.0;
    let opaque = material.model == Model::BlinnPhong && material.transmission == 0.0 && !gloss;
    (matt || opaque) && material.emission == Vec3::ZERO
}

impl Kernel for Classic<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(mut self) {
        for places in self.met.places.chunks(LANES) {
            let group = self.met.group::<L>(places);
            // What only mirrors asks no lamps.
            let scattering = self.scattering(&group);
            if scattering != 0 {
                for (i, lamp) in self.met.view.lights.lamps().iter().enumerate() {
                    self.direct(&group, scattering, lamp, i);
                }
            }
            if !self.last {
                self.mirror(&group);
            }
        }
    }
}

impl Classic<'_> {
    #[inline(always)]
    fn material<L: Wide>(&self, group: &Group<L>, i: usize) -> &Surfacing {
        &self.met.view.materials[group.materials[i] as usize]
    }

    /// As [`super::recursive`]: shadow rays to a lamp, from the lanes that scatter its light.
    #[inline(always)]
    fn direct<L: Wide>(&mut self, group: &Group<L>, scattering: u32, lamp: &Light, number: usize) {
        let domain = Domain::Light(number as u32);
        let center = [L::splat(0.5); 2];
        let at = match self.met.view.settings.light_sampling {
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
        group: &Group<L>,
        scattering: u32,
        (lamp, number): (&Light, usize),
        [u, v]: [L; 2],
        share: f32,
    ) {
        let (zero, half, points) = (L::splat(0.0), L::splat(0.5), &group.points);
        let (a, b) = (V3::splat(lamp.edges[0]), V3::splat(lamp.edges[1]));
        let target = V3::splat(lamp.center) + a.scale(u - half) + b.scale(v - half);
        let above = zero.lt(points.geometric_normal.dot(target - points.point));
        let origin = points.leave(points.geometric_normal);
        let offset = target - origin;
        let square = offset.dot(offset);
        let distance = square.sqrt();
        let direction = offset.scale(L::splat(1.0) / distance);
        let cosine = points.shading_normal.dot(direction);
        let lit = L::bits(L::both(above, zero.lt(cosine))) & scattering;
        if lit == 0 {
            return;
        }
        let mut color = group.albedo.scale(cosine);
        let shine = self.highlights(group, lit, direction);
        if let Some(shine) = shine {
            color = color + shine;
        }
        let strength = if lamp.inverse_square { L::splat(share) / square } else { L::splat(share) };
        let gain = group.errands.weight * (color * V3::splat(lamp.color)).scale(strength);
        let asked = Asked { origin, direction, distance, target, gain };
        self.shadows[number].put(self.met.view, lit, &asked, group.samples.which(), lamp.pass);
    }

    /// Lanes of surfaces that show light of lamps.
    #[inline(always)]
    fn scattering<L: Wide>(&self, group: &Group<L>) -> u32 {
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
    fn highlights<L: Wide>(&self, group: &Group<L>, lit: u32, direction: V3<L>) -> Option<V3<L>> {
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
    fn mirror<L: Wide>(&mut self, group: &Group<L>) {
        let material = |i: usize| &self.met.view.materials[group.materials[i] as usize];
        let mirrors = |i: &usize| material(*i).model != Model::Lambert && material(*i).reflection > 0.0;
        let (mut mirroring, mut weight) = (0u32, [[0.0; LANES]; 3]);
        for i in lanes(group.used).filter(mirrors) {
            mirroring |= 1 << i;
            set_lane(&mut weight, i, material(i).mirror_color * material(i).reflection);
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
        let weight = group.errands.weight * V3::load(&weight);
        let errands = Errands { weight, pdf: L::splat(0.0), ..group.errands };
        let errands = errands.at(&group.samples.onward(Node::reflected));
        self.next.put(mirroring, points.leave(direction), direction, &errands);
    }
}
