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

/// Of eight rays, which run mostly along the first axis, which along the second, and which down the axis that they run
/// along (see [`crate::trace::primitive::dominant`]): a bit each.
#[inline(always)]
fn ways<L: Wide>(rays: &Rays, first: usize) -> [u32; 3] {
    let direction = rays.direction::<L>(first);
    let size = direction.abs();
    let on_x = L::and(size.y.lt(size.x), size.z.lt(size.x));
    let on_y = size.z.lt(size.y);
    let along = L::select(on_x, direction.x, L::select(on_y, direction.y, direction.z));
    [L::bits(on_x), L::bits(on_y), L::bits(along.lt(L::splat(0.0)))]
}

/// Twice the axis along which a ray of eight runs, and one more if it runs down.
#[inline(always)]
fn way([on_x, on_y, down]: [u32; 3], lane: usize) -> u8 {
    let (x, y) = (on_x >> lane & 1, on_y >> lane & 1);
    (4 - 4 * x - 2 * (y & !x) + (down >> lane & 1)) as u8
}

/// The way of eight rays that all run the same one.
#[inline(always)]
fn one_way(ways: [u32; 3]) -> Option<u8> {
    let alike = |bits: u32| bits == 0 || bits == 255;
    let [on_x, on_y, down] = ways;
    // Which runs along the second axis does not matter where all run along the first.
    (alike(on_x) && alike(on_y | on_x) && alike(down)).then(|| way(ways, 0))
}

/// Sorts the numbers of `count` rays by the way that they run; gives where each way ends.
///
/// Eight neighbours mostly run alike and are then moved at once: one by one took 4 to 9 % of the time of a frame. To sort
/// those of a way by where they start, too, gained nothing: neighbours in the wave start together already. There are
/// [`BATCH`] of them at most.
#[inline(always)]
fn sort<L: Wide>(rays: &Rays, first: usize, count: usize, order: &mut Vec<u32>) -> [usize; WAYS] {
    let (mut all, mut next) = ([0u8; BATCH], [0; WAYS]);
    for (eight, at) in all[..count].chunks_mut(LANES).zip((first..).step_by(LANES)) {
        let ways = ways::<L>(rays, at);
        match one_way(ways) {
            Some(way) if eight.len() == LANES => {
                eight.fill(way);
                next[usize::from(way)] += LANES;
            }
            _ => {
                for (lane, to) in eight.iter_mut().enumerate() {
                    *to = way(ways, lane);
                    next[usize::from(*to)] += 1;
                }
            }
        }
    }
    let mut sum = 0;
    for count in &mut next {
        sum += std::mem::replace(count, sum);
    }
    order.resize(count, 0);
    for (eight, number) in all[..count].chunks(LANES).zip((first as u32..).step_by(LANES)) {
        let at = &mut next[usize::from(eight[0])];
        if *eight == [eight[0]; LANES] {
            for (to, lane) in order[*at..*at + LANES].iter_mut().zip(0..) {
                *to = number + lane;
            }
            *at += LANES;
            continue;
        }
        for (way, lane) in eight.iter().zip(0..) {
            let at = &mut next[usize::from(*way)];
            order[*at] = number + lane;
            *at += 1;
        }
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

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::trace::primitive::dominant;
    use crate::trace::simd::Width;

    struct Sorted<'a>(&'a Rays, &'a mut Vec<u32>);

    impl Kernel for Sorted<'_> {
        type Output = [usize; WAYS];

        #[inline(always)]
        fn run<L: Wide>(self) -> [usize; WAYS] {
            sort::<L>(self.0, 0, self.0.len(), self.1)
        }
    }

    /// Directions of which neighbours often run alike.
    fn directions() -> impl Strategy<Value = Vec<Vec3>> {
        let one = prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from);
        let run = (one, 1usize..20).prop_map(|(direction, count)| vec![direction; count]);
        prop::collection::vec(run, 1..8).prop_map(|runs| runs.concat())
    }

    proptest! {
        #[test]
        fn rays_of_a_way_follow_each_other_in_their_order(directions in directions()) {
            let mut rays = Rays::default();
            directions.iter().for_each(|d| rays.push(Ray::new(Vec3::ZERO, *d)));
            let way = |i: &u32| {
                let (d, axis) = (directions[*i as usize], dominant(directions[*i as usize]));
                2 * axis + usize::from(d[axis] < 0.0)
            };
            let mut expected: Vec<u32> = (0..directions.len() as u32).collect();
            expected.sort_by_key(way);
            let ends: [usize; WAYS] = std::array::from_fn(|w| expected.iter().filter(|i| way(i) <= w).count());
            for width in Width::all() {
                let mut order = Vec::new();
                prop_assert_eq!(width.run(Sorted(&rays, &mut order)), ends);
                prop_assert_eq!(&order, &expected);
            }
        }
    }
}
