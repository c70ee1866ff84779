//! Matt surfaces on paths, eight at a time.
//!
//! What [`super::path`] does for any surface, done in lanes for those that follow Lambert's law and nothing else: most
//! of most pictures. The arithmetic is the same, from points over lights to directions; what takes random numbers takes
//! the same ones.

use std::f32::consts::FRAC_1_PI;

use super::errand::{Asked, DIFFUSE_SPREAD, Errands, Shadows, Wave};
use super::group::{Group, Met};
use super::path::SAFE_DEPTH;
use super::wave::found;
use crate::trace::Counters;
use crate::trace::bsdf::{cosine_directions, tangents};
use crate::trace::sampler::{Domain, Node};
use crate::trace::simd::{Kernel, LANES, V3, Wide, lanes};

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
        let asked = Asked {
            origin: group.points.leave(light.direction),
            direction: light.direction,
            distance: light.distance,
            target: light.target,
            gain: group.errands.weight * (value * light.gain).scale(share),
        };
        // Those of one light after those of another.
        let mut left = lit;
        while left != 0 {
            let number = arrivals.lights[left.trailing_zeros() as usize % LANES];
            let mut same = 0;
            for (i, light) in arrivals.lights.iter().enumerate() {
                same |= u32::from(*light == number) << i;
            }
            let bin = number as usize % self.shadows.len();
            let which = left & same;
            self.shadows[bin].put(self.met.view, which, &asked, group.samples.which(), lights.pass(number));
            left &= !same;
        }
    }

    /// As [`super::path::scatter`].
    #[inline(always)]
    fn scatter<L: Wide>(&mut self, group: &Group<L>) {
        let zero = L::splat(0.0);
        let local = cosine_directions(group.samples.stratified::<L>(Domain::Bounce));
        let [x, y] = tangents(group.normal);
        let direction = (x.scale(local.x) + y.scale(local.y) + group.normal.scale(local.z)).normalize();
        let mut weight = group.errands.weight * group.albedo;
        let worth = weight.max_element();
        let above = zero.le(group.points.geometric_normal.dot(direction));
        let going = L::both(L::both(zero.lt(local.z), above), zero.lt(worth));
        let mut going = L::bits(going) & group.used;
        let nodes = group.samples.onward(Node::scattered);
        if self.depth >= SAFE_DEPTH {
            let doubtful = worth.lt(L::splat(1.0));
            let chances = worth.store();
            for i in lanes(going & L::bits(doubtful)) {
                if group.samples.sampler(i).random(nodes[i], Domain::Roulette)[0] >= chances[i] {
                    going &= !(1 << i);
                }
            }
            let by = L::select(doubtful, worth, L::splat(1.0));
            weight = V3 { x: weight.x / by, y: weight.y / by, z: weight.z / by };
        }
        self.counters.diffuse_rays += u64::from(going.count_ones());
        let pdf = local.z * L::splat(FRAC_1_PI);
        let wider = (L::splat(0.5) / pdf.sqrt()).min(L::splat(DIFFUSE_SPREAD));
        let spread = group.errands.spread + wider;
        let errands = Errands { weight, pdf, spread, ..group.errands }.at(&nodes);
        self.next.put(going, group.points.leave(direction), direction, &errands);
    }
}
