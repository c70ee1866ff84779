//! Matt surfaces on paths, eight at a time.
//!
//! What [`super::path`] does for any surface, done in lanes for those that follow Lambert's law and nothing else: most
//! of most pictures. The arithmetic is the same, from points over lights to directions; what takes random numbers takes
//! the same ones.

use std::f32::consts::FRAC_1_PI;

use super::group::{Group, Met};
use super::path::SAFE_DEPTH;
use super::wave::{DIFFUSE_SPREAD, Errand, Shadows, Wave, found, place};
use crate::trace::bsdf::{cosine_directions, tangents};
use crate::trace::sampler::Domain;
use crate::trace::simd::{Kernel, LANES, Wide, lane, lanes};
use crate::trace::{Counters, Ray};

/// The matt surfaces that a wave met.
pub struct Matt<'a> {
    pub met: Met<'a>,
    pub depth: u32,
    pub shadows: &'a mut [Shadows],
    pub next: &'a mut Wave,
    pub counters: &'a mut Counters,
}

impl Kernel for Matt<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(mut self) {
        for places in self.met.places.chunks(LANES) {
            let group = self.met.group::<L>(places);
            if !self.shadows.is_empty() {
                self.ask(&group);
            }
            if self.depth < self.met.view.settings.max_depth {
                self.scatter(&group);
            }
        }
    }
}

impl Matt<'_> {
    /// As [`super::path::ask`].
    #[inline(always)]
    fn ask<L: Wide>(&mut self, group: &Group<L>) {
        let (lights, domain, zero) = (self.met.view.lights, Domain::Light(0), L::splat(0.0));
        let pick = if lights.len() > 1 { group.samples.extra::<L>(domain).store() } else { [0.0; LANES] };
        let arrivals = lights.sample_eight(group.points.point, &pick, group.samples.stratified(domain));
        let light = arrivals.all;
        let cosine = light.direction.dot(group.normal);
        let above = zero.lt(group.points.geometric_normal.dot(light.direction));
        let pdf = cosine * L::splat(FRAC_1_PI);
        let value = group.albedo.scale(pdf);
        let lit = L::both(L::both(light.good, above), L::both(zero.lt(cosine), zero.lt(value.max_element())));
        let lit = L::bits(lit) & group.used;
        if lit == 0 {
            return;
        }
        let mut share = L::splat(1.0);
        if self.depth < self.met.view.settings.max_depth {
            share = L::select(zero.lt(light.pdf), found(light.pdf, pdf), share);
        }
        let gain = (group.weight * (value * light.gain).scale(share)).store();
        let (origin, direction) = (group.points.leave(light.direction).store(), light.direction.store());
        let (target, distance) = (light.target.store(), light.distance.store());
        for i in lanes(lit) {
            let number = arrivals.lights[i];
            let ray = Ray { origin: lane(&origin, i), direction: lane(&direction, i), t_max: distance[i] };
            let sample = place(group.errands[i].sample, lights.pass(number));
            let bin = number as usize % self.shadows.len();
            self.shadows[bin].push(self.met.view, ray, lane(&target, i), sample, lane(&gain, i));
        }
    }

    /// As [`super::path::scatter`].
    #[inline(always)]
    fn scatter<L: Wide>(&mut self, group: &Group<L>) {
        let zero = L::splat(0.0);
        let local = cosine_directions(group.samples.stratified::<L>(Domain::Bounce));
        let [x, y] = tangents(group.normal);
        let direction = (x.scale(local.x) + y.scale(local.y) + group.normal.scale(local.z)).normalize();
        let weight = group.weight * group.albedo;
        let above = zero.le(group.points.geometric_normal.dot(direction));
        let going = L::both(L::both(zero.lt(local.z), above), zero.lt(weight.max_element()));
        let pdf = local.z * L::splat(FRAC_1_PI);
        let wider = (L::splat(0.5) / pdf.sqrt()).min(L::splat(DIFFUSE_SPREAD)).store();
        let (origin, direction) = (group.points.leave(direction).store(), direction.store());
        let (pdf, weight) = (pdf.store(), weight.store());
        let going = L::bits(going) & group.used;
        for i in lanes(going) {
            let errand = group.errands[i];
            let node = errand.node.scattered();
            let mut weight = lane(&weight, i);
            let worth = weight.max_element();
            if self.depth >= SAFE_DEPTH && worth < 1.0 {
                let sampler = &self.met.samples[errand.sample as usize].1;
                if sampler.random(node, Domain::Roulette)[0] >= worth {
                    continue;
                }
                weight /= worth;
            }
            self.counters.diffuse_rays += 1;
            let ray = Ray::new(lane(&origin, i), lane(&direction, i));
            let cone = group.cone(i).widened(wider[i]);
            self.next.push(ray, Errand { node, weight, pdf: pdf[i], cone, ..*errand });
        }
    }
}
