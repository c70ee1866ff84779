//! Sorting rays into packets, and walking with them.

use super::group::{GROUPS, RayGroup};
use crate::trace::accel::TraversalScratch;
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

/// The nearest hit of one ray before `best.t`, or with `ANY` any one.
#[inline]
pub fn alone<S: Traversal, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    probe: &PreparedRay,
    best: &mut ClosestHit,
    scratch: &mut TraversalScratch,
) {
    structure.make_room(scratch);
    structure.width().run(SingleRay::<S, ANY> { structure, geometry, probe, best, scratch });
}

struct SingleRay<'a, S, const ANY: bool> {
    structure: &'a S,
    geometry: &'a Geometry,
    probe: &'a PreparedRay,
    best: &'a mut ClosestHit,
    scratch: &'a mut TraversalScratch,
}

impl<S: Traversal, const ANY: bool> Kernel for SingleRay<'_, S, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        self.structure.one::<L, ANY>(self.geometry, self.probe, self.best, self.scratch);
    }
}

/// Ways in which rays can mostly run: along an axis, up or down.
const WAYS: usize = 6;

/// Rays that are sorted together: neighbours in the wave stay near each other.
const SORTED: usize = 512;

/// Twice the axis along which each of eight rays mostly runs (see [`crate::trace::primitive::shapes::dominant`]), and
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
/// There are [`SORTED`] of them at most.
#[inline(always)]
fn sort<L: Wide>(rays: &Rays, first: usize, count: usize, order: &mut Vec<u32>) -> [usize; WAYS] {
    let (mut all, mut next) = ([0u8; SORTED], [0; WAYS]);
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
        for first in (0..rays.len()).step_by(SORTED) {
            let ends = sort::<L>(rays, first, SORTED.min(rays.len() - first), &mut order);
            let mut start = 0;
            for (way, end) in ends.into_iter().enumerate() {
                for numbers in order[start..end].chunks(GROUPS * LANES) {
                    let packet = RayPacket { geometry, rays, numbers };
                    if self.scratch.wait > 0 {
                        self.scratch.wait -= 1;
                        self.apart(packet);
                    } else {
                        self.together::<L>(packet, way / 2);
                    }
                }
                start = end;
            }
        }
        self.scratch.order = order;
    }
}

impl<S: Traversal, F: HitSink + ?Sized, const ANY: bool> PacketKernel<'_, S, F, ANY> {
    /// Each ray alone.
    #[inline(always)]
    fn apart(&mut self, packet: RayPacket) {
        for (i, n) in packet.numbers.iter().enumerate() {
            let Some((skip, ray)) = packet.approached(i) else { continue };
            let mut best = ClosestHit::within(ray.t_max);
            alone::<S, ANY>(self.structure, self.geometry, &PreparedRay::from(&ray), &mut best, self.scratch);
            self.found.one(*n as usize, skip, &best);
        }
    }

    /// As [`Self::apart`] for rays that all run mostly along this axis, the same way.
    #[inline(always)]
    fn together<L: Wide>(&mut self, packet: RayPacket, axis: usize) {
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
                self.rest::<L>(packet, numbers, &groups[g]);
            }
        }
        // The next packets are likely to fare as this one did.
        let scratch = &mut *self.scratch;
        scratch.failures = if done { scratch.failures.saturating_sub(1) } else { (scratch.failures + 2).min(8) };
        scratch.wait = if done { 0 } else { (1 << scratch.failures) - 1 };
    }

    /// Goes on with the rays of a group, each alone.
    #[inline(always)]
    fn rest<L: Wide>(&mut self, packet: RayPacket, numbers: &[u32], group: &RayGroup<L>) {
        for (n, mut best) in numbers.iter().zip(group.bests()) {
            let (skip, ray) = packet.geometry.approach(&packet.rays.get(*n as usize));
            let settled = ANY && best.found;
            if !settled {
                alone::<S, ANY>(self.structure, self.geometry, &PreparedRay::from(&ray), &mut best, self.scratch);
            }
            self.found.one(*n as usize, skip, &best);
        }
    }
}
