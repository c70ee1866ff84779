//! Diffuse surfaces on paths, eight at a time.
//!
//! What the integrator `path` does for any surface, done in lanes for those that follow Lambert's law and nothing else:
//! most of most pictures. The arithmetic is the same, from points over lights to directions; what takes random numbers
//! takes the same ones.

use std::f32::consts::FRAC_1_PI;

use super::batch::{ShadingBatch, ShadingInput};
use super::interaction::shadow_ray_from;
use super::path_state::{DIFFUSE_SPREAD, PathStateLanes, RayConeLanes};
use super::ray_queue::RayQueue;
use super::shadow_ray_queue::{ShadowRayBatch, ShadowRayQueue};
use crate::trace::counters::Counters;
use crate::trace::sampler::{Domain, RayNode, cosine_directions, power_heuristic, tangents};
use crate::trace::simd::{Kernel, LANES, V3, Wide, lane, lanes, set_lane};
use crate::trace::soa::Ray;

/// The diffuse surfaces that a wave met.
pub struct LambertKernel<'a> {
    pub met: ShadingInput<'a>,
    pub depth: u32,
    pub shadows: &'a mut [ShadowRayQueue],
    pub next: &'a mut RayQueue,
    pub counters: &'a mut Counters,
}

impl Kernel for LambertKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(mut self) {
        for places in self.met.places.chunks(LANES) {
            let group = self.met.group::<L>(places);
            if !self.shadows.is_empty() {
                self.ask(&group);
            }
            if self.depth < self.met.context.settings.max_depth {
                self.scatter(&group);
            }
        }
    }
}

impl LambertKernel<'_> {
    /// As `path::sample_direct`, for eight.
    #[inline(always)]
    fn ask<L: Wide>(&mut self, group: &ShadingBatch<L>) {
        let (lights, domain, zero) = (self.met.context.lights, Domain::Light(0), L::splat(0.0));
        let pick = if lights.len() > 1 { group.samples.extra::<L>(domain).store() } else { [0.0; LANES] };
        let arrivals = lights.sample_eight(group.points.point, &pick, group.samples.stratified(domain));
        let light = arrivals.all;
        let cosine = light.direction.dot(group.normal);
        let above = zero.lt(group.points.geometric_normal.dot(light.direction));
        let pdf = cosine * L::splat(FRAC_1_PI);
        let value = group.albedo.scale(pdf);
        let seen = L::and(light.good, L::and(zero.lt(cosine), zero.lt(value.max_element())));
        let seen = L::bits(seen) & group.used;
        let mut lit = seen & L::bits(above);
        let (mut origin, mut direction, mut distance) =
            (group.points.offset_origin(light.direction), light.direction, light.distance);
        if seen != lit {
            let found;
            (found, origin) = self.met.smooth_starts(group, seen & !lit, origin);
            lit |= found;
            (direction, distance) =
                from_start::<L>(found, group.points.point, (origin, light.target), direction, distance);
        }
        if lit == 0 {
            return;
        }
        let mut share = L::splat(1.0);
        if self.depth < self.met.context.settings.max_depth {
            share = L::select(zero.lt(light.pdf), power_heuristic(light.pdf, pdf), share);
        }
        let asked = ShadowRayBatch {
            origin,
            direction,
            distance,
            target: light.target,
            contribution: self.met.context.settings.clamps.limited_lanes(
                group.states.scatterings + L::splat(1.0),
                group.states.throughput * (value * light.contribution).scale(share),
            ),
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
            self.shadows[bin].compress_store(
                self.met.context,
                which,
                &asked,
                group.samples.which(),
                lights.group(number),
            );
            left &= !same;
        }
    }

    /// As `path::scatter`, for eight.
    #[inline(always)]
    fn scatter<L: Wide>(&mut self, group: &ShadingBatch<L>) {
        let zero = L::splat(0.0);
        let local = cosine_directions(group.samples.stratified::<L>(Domain::Bounce));
        let [x, y] = tangents(group.normal);
        let direction = (x.scale(local.x) + y.scale(local.y) + group.normal.scale(local.z)).normalize();
        let mut throughput = group.states.throughput * group.albedo;
        let worth = throughput.max_element();
        let above = zero.le(group.points.geometric_normal.dot(direction));
        let seen = L::bits(L::and(zero.lt(local.z), zero.lt(worth))) & group.used;
        let mut going = seen & L::bits(above);
        let mut origin = group.points.offset_origin(direction);
        if seen != going {
            let found;
            (found, origin) = self.met.smooth_starts(group, seen & !going, origin);
            going |= found;
        }
        let nodes = group.samples.onward(RayNode::scattered);
        if self.depth >= MIN_ROULETTE_DEPTH {
            let doubtful = worth.lt(L::splat(1.0));
            let chances = worth.store();
            for i in lanes(going & L::bits(doubtful)) {
                if group.samples.sampler(i).random(nodes[i], Domain::Roulette)[0] >= chances[i] {
                    going &= !(1 << i);
                }
            }
            let by = L::select(doubtful, worth, L::splat(1.0));
            throughput = V3 { x: throughput.x / by, y: throughput.y / by, z: throughput.z / by };
        }
        self.counters.diffuse_rays += u64::from(going.count_ones());
        let pdf = local.z * L::splat(FRAC_1_PI);
        let wider = (L::splat(0.5) / pdf.sqrt()).min(L::splat(DIFFUSE_SPREAD));
        let cone = RayConeLanes { spread: group.states.cone.spread + wider, ..group.states.cone };
        let scatterings = group.states.scatterings + L::splat(1.0);
        let states = PathStateLanes { throughput, pdf, cone, scatterings, ..group.states }.at(&nodes);
        self.next.compress_store(going, origin, direction, &states);
    }
}

/// Rays that every path may have before chance decides about it.
pub const MIN_ROULETTE_DEPTH: u32 = 3;

/// Directions and lengths of shadow rays, those of some lanes from other starts than the points that light was sampled for.
#[inline(always)]
fn from_start<L: Wide>(
    bits: u32,
    point: V3<L>,
    (origin, target): (V3<L>, V3<L>),
    direction: V3<L>,
    distance: L,
) -> (V3<L>, L) {
    let ends = [point.store(), origin.store(), target.store()];
    let (mut directions, mut distances) = (direction.store(), distance.store());
    each_from_start(bits, &ends, &mut directions, &mut distances);
    (V3::load(&directions), L::load(&distances))
}

#[cold]
fn each_from_start(
    bits: u32,
    [point, origin, target]: &[[[f32; LANES]; 3]; 3],
    directions: &mut [[f32; LANES]; 3],
    distances: &mut [f32; LANES],
) {
    for i in lanes(bits) {
        let along = Ray { origin: lane(origin, i), direction: lane(directions, i), t_max: distances[i] };
        let ray = shadow_ray_from(along.origin, lane(point, i), lane(target, i), along);
        set_lane(directions, i, ray.direction);
        distances[i] = ray.t_max;
    }
}
