//! Sorting rays into packets, and walking with them.

use super::group::{GROUPS, RayGroup};
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::stream::{BATCH, LooseRays};
use crate::trace::primitive::{ClosestHit, Geometry, PreparedRay};
use crate::trace::simd::{Kernel, LANES, Wide, Width};
use crate::trace::soa::{Hit, Hits, Ray, Rays};

/// What rays walk through. Everything in it is to be marked `#[inline(always)]`, see [`Kernel::run`].
pub trait Traversal {
    fn width(&self) -> Width;

    /// Sees to it that what a walk needs of the worker never overflows.
    fn make_room(&self, scratch: &mut TraversalScratch);

    /// The nearest hit of one ray before `best.t`, or with `ANY` any one; the best so far may already be a hit.
    fn one<L: Wide, const ANY: bool>(
        &self,
        geometry: &Geometry,
        probe: &PreparedRay,
        best: &mut ClosestHit,
        scratch: &mut TraversalScratch,
    );

    /// The same for the rays of a packet, which all run mostly along one axis, the same way, and which the groups hold;
    /// false if the packet was given up.
    fn many<L: Wide, const ANY: bool>(
        &self,
        packet: RayPacket,
        groups: &mut [RayGroup<L>; GROUPS],
        scratch: &mut TraversalScratch,
    ) -> bool;

    /// As [`Self::one`] for the rays of a batch that share nothing.
    fn loose<L: Wide, F: HitSink + ?Sized, const ANY: bool>(
        &self,
        batch: RayBatch,
        loose: &LooseRays,
        scratch: &mut TraversalScratch,
        found: &mut F,
    );
}

/// Rays in a row that are dealt with together, at most [`BATCH`].
#[derive(Clone, Copy)]
pub struct RayBatch<'a> {
    pub geometry: &'a Geometry,
    pub rays: &'a Rays,
    pub first: usize,
    pub count: usize,
}

/// Some of many rays, [`GROUPS`] eights at most.
#[derive(Clone, Copy)]
pub struct RayPacket<'a> {
    pub geometry: &'a Geometry,
    rays: &'a Rays,
    /// Which they are; they grow.
    numbers: &'a [u32],
}

impl RayPacket<'_> {
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// One of them, moved up to the primitives, and how far.
    #[inline(always)]
    fn approached(&self, i: usize) -> Option<(f32, Ray)> {
        self.numbers.get(i).map(|n| self.geometry.approach(&self.rays.get(*n as usize)))
    }

    /// One of them, for tests of primitives.
    #[inline(always)]
    pub fn probe(&self, i: usize) -> Option<PreparedRay> {
        self.approached(i).map(|(_, ray)| PreparedRay::from(&ray))
    }
}

/// What is to be known of each ray.
pub trait HitSink {
    /// What one ray found that was moved up this far.
    fn one(&mut self, ray: usize, skip: f32, best: &ClosestHit);

    /// The same of the rays of a group.
    fn eight<L: Wide>(&mut self, rays: &[u32], group: &RayGroup<L>);
}

impl HitSink for Hits {
    #[inline(always)]
    fn one(&mut self, ray: usize, skip: f32, best: &ClosestHit) {
        let ClosestHit { t, primitive, element, u, v, found } = *best;
        self.set(ray, found.then_some(Hit { t: skip + t, primitive, element, u, v }));
    }

    #[inline(always)]
    fn eight<L: Wide>(&mut self, rays: &[u32], group: &RayGroup<L>) {
        self.set_lanes(rays, group.found(), group.hits());
    }
}

/// Whether each ray met anything.
impl HitSink for [bool] {
    #[inline(always)]
    fn one(&mut self, ray: usize, _: f32, best: &ClosestHit) {
        self[ray] = best.found;
    }

    #[inline(always)]
    fn eight<L: Wide>(&mut self, rays: &[u32], group: &RayGroup<L>) {
        for (lane, ray) in rays.iter().enumerate() {
            self[*ray as usize] = group.found() >> lane & 1 == 1;
        }
    }
}

/// The nearest hit of one ray among the finite primitives, or with `ANY` any one: how far the ray was moved up to them,
/// and what it found from there.
#[inline]
pub fn alone<S: Traversal, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    ray: &Ray,
    scratch: &mut TraversalScratch,
) -> (f32, ClosestHit) {
    structure.make_room(scratch);
    structure.width().run(SingleRay::<S, ANY> { structure, geometry, ray, scratch })
}

struct SingleRay<'a, S, const ANY: bool> {
    structure: &'a S,
    geometry: &'a Geometry,
    ray: &'a Ray,
    scratch: &'a mut TraversalScratch,
}

impl<S: Traversal, const ANY: bool> Kernel for SingleRay<'_, S, ANY> {
    type Output = (f32, ClosestHit);

    #[inline(always)]
    fn run<L: Wide>(self) -> (f32, ClosestHit) {
        let (skip, ray) = self.geometry.approach(self.ray);
        let mut best = ClosestHit::within(ray.t_max);
        self.structure.one::<L, ANY>(self.geometry, &PreparedRay::from(&ray), &mut best, self.scratch);
        (skip, best)
    }
}

/// Ways in which rays can mostly run: along an axis, up or down.
const WAYS: usize = 6;

/// Twice the axis along which each of eight rays mostly runs (see [`crate::trace::primitive::dominant`]), and
/// one more if it runs down.
#[inline(always)]
fn ways<L: Wide>(rays: &Rays, first: usize) -> [f32; LANES] {
    let direction = rays.direction::<L>(first);
    let (size, zero, one) = (direction.abs(), L::splat(0.0), L::splat(1.0));
    let on_x = L::and(size.y.lt(size.x), size.z.lt(size.x));
    let on_y = size.z.lt(size.y);
    let along = L::select(on_x, direction.x, L::select(on_y, direction.y, direction.z));
    let axis = L::select(on_x, zero, L::select(on_y, L::splat(2.0), L::splat(4.0)));
    (axis + L::select(along.lt(zero), one, zero)).store()
}

/// Sorts the numbers of `count` rays by the way that they run; gives where each way ends.
///
/// To sort those of a way by where they start, too, gained nothing: neighbours in the wave start together already.
/// There are [`BATCH`] of them at most.
#[inline(always)]
fn sort<L: Wide>(rays: &Rays, first: usize, count: usize, order: &mut Vec<u32>) -> [usize; WAYS] {
    let (mut all, mut next) = ([0u8; BATCH], [0; WAYS]);
    for (eight, at) in all[..count].chunks_mut(LANES).zip((first..).step_by(LANES)) {
        for (to, way) in eight.iter_mut().zip(ways::<L>(rays, at)) {
            *to = way as u8;
            next[way as usize] += 1;
        }
    }
    let mut sum = 0;
    for count in &mut next {
        sum += std::mem::replace(count, sum);
    }
    order.resize(count, 0);
    for (i, way) in all[..count].iter().enumerate() {
        let at = &mut next[usize::from(*way)];
        order[*at] = (first + i) as u32;
        *at += 1;
    }
    next
}

/// Walks of many rays, those that run the same way together.
pub fn each_packet<S: Traversal, F: HitSink + ?Sized, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    rays: &Rays,
    scratch: &mut TraversalScratch,
    found: &mut F,
) {
    structure.make_room(scratch);
    structure.width().run(PacketKernel::<S, F, ANY> { structure, geometry, rays, scratch, found });
}

struct PacketKernel<'a, S, F: ?Sized, const ANY: bool> {
    structure: &'a S,
    geometry: &'a Geometry,
    rays: &'a Rays,
    scratch: &'a mut TraversalScratch,
    found: &'a mut F,
}

impl<S: Traversal, F: HitSink + ?Sized, const ANY: bool> Kernel for PacketKernel<'_, S, F, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(mut self) {
        let (geometry, rays) = (self.geometry, self.rays);
        let mut order = std::mem::take(&mut self.scratch.order);
        let mut loose = std::mem::take(&mut self.scratch.loose);
        for first in (0..rays.len()).step_by(BATCH) {
            let count = BATCH.min(rays.len() - first);
            let packets = count.div_ceil(GROUPS * LANES) as u32;
            loose.clear();
            if self.scratch.wait >= packets {
                self.scratch.wait -= packets;
                loose.extend(first as u32..(first + count) as u32);
            } else {
                let ends = sort::<L>(rays, first, count, &mut order);
                let mut start = 0;
                for (way, end) in ends.into_iter().enumerate() {
                    for numbers in order[start..end].chunks(GROUPS * LANES) {
                        if self.scratch.wait > 0 {
                            self.scratch.wait -= 1;
                            loose.extend(numbers.iter().copied());
                        } else {
                            self.together::<L>(RayPacket { geometry, rays, numbers }, way / 2, &mut loose);
                        }
                    }
                    start = end;
                }
            }
            if !loose.is_empty() {
                let batch = RayBatch { geometry, rays, first, count };
                self.structure.loose::<L, F, ANY>(batch, &loose, self.scratch, self.found);
            }
        }
        (self.scratch.order, self.scratch.loose) = (order, loose);
    }
}

impl<S: Traversal, F: HitSink + ?Sized, const ANY: bool> PacketKernel<'_, S, F, ANY> {
    /// A packet of rays that all run mostly along this axis, the same way. Where it is given up, its rays go on loose.
    #[inline(always)]
    fn together<L: Wide>(&mut self, packet: RayPacket, axis: usize, loose: &mut LooseRays) {
        let axes = [(axis + 1) % 3, (axis + 2) % 3, axis];
        let RayPacket { geometry, rays, numbers } = packet;
        let second = LANES.min(numbers.len() - 1);
        let mut groups: [RayGroup<L>; GROUPS] =
            [RayGroup::new(geometry, rays, numbers, axes), RayGroup::new(geometry, rays, &numbers[second..], axes)];
        let done = self.structure.many::<L, ANY>(packet, &mut groups, self.scratch);
        for (g, numbers) in numbers.chunks(LANES).enumerate() {
            if done {
                self.found.eight(numbers, &groups[g]);
            } else {
                self.loosen::<L>(numbers, &groups[g], loose);
            }
        }
        // The next packets are likely to fare as this one did.
        let scratch = &mut *self.scratch;
        scratch.failures = if done { scratch.failures.saturating_sub(1) } else { (scratch.failures + 2).min(8) };
        scratch.wait = if done { 0 } else { (1 << scratch.failures) - 1 };
    }

    /// Lets the rays of a group go on, each with what it has found.
    #[inline(always)]
    fn loosen<L: Wide>(&mut self, numbers: &[u32], group: &RayGroup<L>, loose: &mut LooseRays) {
        for (n, best) in numbers.iter().zip(group.bests()) {
            if ANY && best.found {
                self.found.one(*n as usize, 0.0, &best);
            } else {
                loose.push_begun(*n, best);
            }
        }
    }
}
