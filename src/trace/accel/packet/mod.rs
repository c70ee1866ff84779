//! Rays that go nearly the same way, sixteen together, through any accelerator.
//!
//! Boxes are tested once for all of them, by the frustum around them (Reshetov, Soupikov and Hurley 2005; see
//! [`frustum`]); primitives are tested with a ray in each lane. What a ray hits cannot differ from its own walk: the
//! frustum only ever opens more boxes, and the tests are the same in every lane. Where the rays turn out to part ways,
//! the packet is given up and each goes on alone with what it has found.

mod frustum;
mod group;

use super::Worker;
use crate::trace::columns::Hits;
use crate::trace::geometry::Best;
use crate::trace::shapes::Probe;
use crate::trace::simd::{Kernel, LANES, Wide, Width};
use crate::trace::{Geometry, Hit, Ray, Rays};
pub use frustum::Sight;
pub use group::Group;

/// Eights of rays that go together. Four of them share more nodes and part ways more often: it comes to the same.
pub const GROUPS: usize = 2;

/// What rays walk through. Everything in it is to be marked `#[inline(always)]`, see [`Kernel::run`].
pub trait Structure {
    fn width(&self) -> Width;

    /// Sees to it that what a walk needs of the worker never overflows.
    fn make_room(&self, worker: &mut Worker);

    /// The nearest hit of one ray before `best.t`, or with `ANY` any one; the best so far may already be a hit.
    fn one<L: Wide, const ANY: bool>(&self, geometry: &Geometry, probe: &Probe, best: &mut Best, worker: &mut Worker);

    /// The same for the rays of a packet, which all run mostly along one axis, the same way, and which the groups hold;
    /// false if the packet was given up.
    fn many<L: Wide, const ANY: bool>(
        &self,
        packet: Packet,
        groups: &mut [Group<L>; GROUPS],
        worker: &mut Worker,
    ) -> bool;
}

/// Some of many rays, [`GROUPS`] eights at most.
#[derive(Clone, Copy)]
pub struct Packet<'a> {
    pub geometry: &'a Geometry,
    rays: &'a Rays,
    /// Which they are; they grow.
    numbers: &'a [u32],
}

impl Packet<'_> {
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
    pub fn probe(&self, i: usize) -> Option<Probe> {
        self.approached(i).map(|(_, ray)| Probe::from(&ray))
    }
}

/// What is to be known of each ray.
pub trait Found {
    /// What one ray found that was moved up this far.
    fn one(&mut self, ray: usize, skip: f32, best: &Best);

    /// The same of the rays of a group.
    fn eight<L: Wide>(&mut self, rays: &[u32], group: &Group<L>);
}

impl Found for Hits {
    #[inline(always)]
    fn one(&mut self, ray: usize, skip: f32, best: &Best) {
        let Best { t, primitive, element, u, v, found } = *best;
        self.set(ray, found.then_some(Hit { t: skip + t, primitive, element, u, v }));
    }

    #[inline(always)]
    fn eight<L: Wide>(&mut self, rays: &[u32], group: &Group<L>) {
        self.set_eight(rays, group.found(), group.hits());
    }
}

/// Whether each ray met anything.
impl Found for [bool] {
    #[inline(always)]
    fn one(&mut self, ray: usize, _: f32, best: &Best) {
        self[ray] = best.found;
    }

    #[inline(always)]
    fn eight<L: Wide>(&mut self, rays: &[u32], group: &Group<L>) {
        for (lane, ray) in rays.iter().enumerate() {
            self[*ray as usize] = group.found() >> lane & 1 == 1;
        }
    }
}

/// The nearest hit of one ray before `best.t`, or with `ANY` any one.
#[inline]
pub fn alone<S: Structure, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    probe: &Probe,
    best: &mut Best,
    worker: &mut Worker,
) {
    structure.make_room(worker);
    structure.width().run(One::<S, ANY> { structure, geometry, probe, best, worker });
}

struct One<'a, S, const ANY: bool> {
    structure: &'a S,
    geometry: &'a Geometry,
    probe: &'a Probe,
    best: &'a mut Best,
    worker: &'a mut Worker,
}

impl<S: Structure, const ANY: bool> Kernel for One<'_, S, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        self.structure.one::<L, ANY>(self.geometry, self.probe, self.best, self.worker);
    }
}

/// Ways in which rays can mostly run: along an axis, up or down.
const WAYS: usize = 6;

/// Rays that are sorted together: neighbours in the wave stay near each other.
const SORTED: usize = 512;

/// Twice the axis along which each of eight rays mostly runs (see [`crate::trace::shapes::dominant`]), and one more if
/// it runs down.
#[inline(always)]
fn ways<L: Wide>(rays: &Rays, first: usize) -> [f32; LANES] {
    let direction = rays.directions::<L>(first);
    let (size, zero, one) = (direction.abs(), L::splat(0.0), L::splat(1.0));
    let on_x = L::both(size.y.lt(size.x), size.z.lt(size.x));
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
pub fn each_packet<S: Structure, F: Found + ?Sized, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    rays: &Rays,
    worker: &mut Worker,
    found: &mut F,
) {
    structure.make_room(worker);
    structure.width().run(Packets::<S, F, ANY> { structure, geometry, rays, worker, found });
}

struct Packets<'a, S, F: ?Sized, const ANY: bool> {
    structure: &'a S,
    geometry: &'a Geometry,
    rays: &'a Rays,
    worker: &'a mut Worker,
    found: &'a mut F,
}

impl<S: Structure, F: Found + ?Sized, const ANY: bool> Kernel for Packets<'_, S, F, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(mut self) {
        let (geometry, rays) = (self.geometry, self.rays);
        let mut order = std::mem::take(&mut self.worker.order);
        for first in (0..rays.len()).step_by(SORTED) {
            let ends = sort::<L>(rays, first, SORTED.min(rays.len() - first), &mut order);
            let mut start = 0;
            for (way, end) in ends.into_iter().enumerate() {
                for numbers in order[start..end].chunks(GROUPS * LANES) {
                    let packet = Packet { geometry, rays, numbers };
                    if self.worker.wait > 0 {
                        self.worker.wait -= 1;
                        self.apart(packet);
                    } else {
                        self.together::<L>(packet, way / 2);
                    }
                }
                start = end;
            }
        }
        self.worker.order = order;
    }
}

impl<S: Structure, F: Found + ?Sized, const ANY: bool> Packets<'_, S, F, ANY> {
    /// Each ray alone.
    #[inline(always)]
    fn apart(&mut self, packet: Packet) {
        for (i, n) in packet.numbers.iter().enumerate() {
            let Some((skip, ray)) = packet.approached(i) else { continue };
            let mut best = Best::within(ray.t_max);
            alone::<S, ANY>(self.structure, self.geometry, &Probe::from(&ray), &mut best, self.worker);
            self.found.one(*n as usize, skip, &best);
        }
    }

    /// As [`Self::apart`] for rays that all run mostly along this axis, the same way.
    #[inline(always)]
    fn together<L: Wide>(&mut self, packet: Packet, axis: usize) {
        let axes = [(axis + 1) % 3, (axis + 2) % 3, axis];
        let Packet { geometry, rays, numbers } = packet;
        let second = LANES.min(numbers.len() - 1);
        let mut groups: [Group<L>; GROUPS] =
            [Group::new(geometry, rays, numbers, axes), Group::new(geometry, rays, &numbers[second..], axes)];
        let done = self.structure.many::<L, ANY>(packet, &mut groups, self.worker);
        for (g, numbers) in numbers.chunks(LANES).enumerate() {
            if done {
                self.found.eight(numbers, &groups[g]);
            } else {
                self.rest::<L>(packet, numbers, &groups[g]);
            }
        }
        // The next packets are likely to fare as this one did.
        let worker = &mut *self.worker;
        worker.failures = if done { worker.failures.saturating_sub(1) } else { (worker.failures + 2).min(8) };
        worker.wait = if done { 0 } else { (1 << worker.failures) - 1 };
    }

    /// Goes on with the rays of a group, each alone.
    #[inline(always)]
    fn rest<L: Wide>(&mut self, packet: Packet, numbers: &[u32], group: &Group<L>) {
        for (n, mut best) in numbers.iter().zip(group.bests()) {
            let (skip, ray) = packet.geometry.approach(&packet.rays.get(*n as usize));
            let settled = ANY && best.found;
            if !settled {
                alone::<S, ANY>(self.structure, self.geometry, &Probe::from(&ray), &mut best, self.worker);
            }
            self.found.one(*n as usize, skip, &best);
        }
    }
}
