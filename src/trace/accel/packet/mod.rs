//! Rays that go nearly the same way, sixteen together, through any accelerator.
//!
//! Boxes are tested once for all of them, by the frustum around them (Reshetov, Soupikov and Hurley 2005; see
//! [`frustum`]); primitives are tested with a ray in each lane. What a ray hits cannot differ from its own walk: the
//! frustum only ever opens more boxes, and the tests are the same in every lane. Where the rays turn out to part ways,
//! the packet is given up and each goes on alone with what it has found.

mod frustum;
mod group;

use glam::Vec3;

use super::Worker;
use crate::trace::geometry::Best;
use crate::trace::shapes::{Probe, dominant};
use crate::trace::simd::{Kernel, LANES, Wide, Width};
use crate::trace::{Geometry, Ray};
pub use frustum::Sight;
pub use group::Group;

/// Eights of rays that go together.
pub const GROUPS: usize = 2;

/// How many rays go together.
pub const RAYS: usize = GROUPS * LANES;

/// What rays walk through. Everything in it is to be marked `#[inline(always)]`, see [`Kernel::run`].
pub trait Structure {
    fn width(&self) -> Width;

    /// Sees to it that what a walk needs of the worker never overflows.
    fn make_room(&self, worker: &mut Worker);

    /// The nearest hit of one ray before `best.t`, or with `ANY` any one; the best so far may already be a hit.
    fn one<L: Wide, const ANY: bool>(&self, geometry: &Geometry, probe: &Probe, best: &mut Best, worker: &mut Worker);

    /// The same for the rays of the groups, which all run mostly along one axis, the same way; false if the packet was
    /// given up.
    fn many<L: Wide, const ANY: bool>(
        &self,
        geometry: &Geometry,
        rays: &[Ray],
        groups: &mut [Group<L>; GROUPS],
        worker: &mut Worker,
    ) -> bool;
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

#[inline(always)]
fn way(ray: &Ray) -> usize {
    let axis = dominant(ray.direction);
    2 * axis + usize::from(ray.direction[axis] < 0.0)
}

/// Sorts rays by the way that they run; gives where each way ends.
///
/// To sort those of a way by where they start, too, gained nothing: neighbours in the wave start together already.
/// There are [`SORTED`] of them at most.
fn sort(rays: &[Ray], order: &mut Vec<u32>) -> [usize; WAYS] {
    let (mut ways, mut next) = ([0u8; SORTED], [0; WAYS]);
    for (to, ray) in ways.iter_mut().zip(rays) {
        let way = way(ray);
        *to = way as u8;
        next[way] += 1;
    }
    let mut sum = 0;
    for count in &mut next {
        sum += std::mem::replace(count, sum);
    }
    order.resize(rays.len(), 0);
    for (i, way) in (0..rays.len()).zip(ways) {
        let at = &mut next[usize::from(way)];
        order[*at] = i as u32;
        *at += 1;
    }
    next
}

/// Walks of many rays, those that run the same way together: calls `done` for each with its number, how far it was
/// moved up to the primitives, and what it found.
pub fn each_packet<S: Structure, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    rays: &[Ray],
    worker: &mut Worker,
    mut done: impl FnMut(usize, f32, &Best, &mut Worker),
) {
    structure.make_room(worker);
    let mut order = std::mem::take(&mut worker.order);
    for (chunk, rays) in rays.chunks(SORTED).enumerate() {
        let ends = sort(rays, &mut order);
        each_sorted::<S, ANY>(structure, geometry, rays, &order, ends, worker, |i, skip, best, worker| {
            done(chunk * SORTED + i, skip, best, worker);
        });
    }
    worker.order = order;
}

fn each_sorted<S: Structure, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    rays: &[Ray],
    order: &[u32],
    ends: [usize; WAYS],
    worker: &mut Worker,
    mut done: impl FnMut(usize, f32, &Best, &mut Worker),
) {
    let mut start = 0;
    let (mut skips, mut near) = ([0.0; RAYS], [Ray::new(Vec3::ZERO, Vec3::ZERO); RAYS]);
    let mut bests = [Best::within(0.0); RAYS];
    for (way, end) in ends.into_iter().enumerate() {
        for numbers in order[start..end].chunks(RAYS) {
            for (lane, n) in numbers.iter().enumerate() {
                (skips[lane], near[lane]) = geometry.approach(&rays[*n as usize]);
            }
            let near = &near[..numbers.len()];
            if worker.wait > 0 {
                worker.wait -= 1;
                for (ray, best) in near.iter().zip(&mut bests) {
                    *best = Best::within(ray.t_max);
                    alone::<S, ANY>(structure, geometry, &Probe::from(ray), best, worker);
                }
            } else {
                together::<S, ANY>(structure, geometry, near, way / 2, &mut bests, worker);
            }
            for (lane, n) in numbers.iter().enumerate() {
                done(*n as usize, skips[lane], &bests[lane], worker);
            }
        }
        start = end;
    }
}

/// As [`alone`] for up to [`RAYS`] rays that all run mostly along this axis, the same way.
fn together<S: Structure, const ANY: bool>(
    structure: &S,
    geometry: &Geometry,
    rays: &[Ray],
    axis: usize,
    bests: &mut [Best; RAYS],
    worker: &mut Worker,
) {
    let axes = [(axis + 1) % 3, (axis + 2) % 3, axis];
    let done = structure.width().run(Many::<S, ANY> { structure, geometry, rays, axes, bests, worker });
    for (ray, best) in rays.iter().zip(bests) {
        let settled = done || (ANY && best.found);
        if !settled {
            alone::<S, ANY>(structure, geometry, &Probe::from(ray), best, worker);
        }
    }
    // The next packets are likely to fare as this one did.
    worker.failures = if done { worker.failures.saturating_sub(1) } else { (worker.failures + 2).min(8) };
    worker.wait = if done { 0 } else { (1 << worker.failures) - 1 };
}

struct Many<'a, S, const ANY: bool> {
    structure: &'a S,
    geometry: &'a Geometry,
    rays: &'a [Ray],
    axes: [usize; 3],
    bests: &'a mut [Best; RAYS],
    worker: &'a mut Worker,
}

impl<S: Structure, const ANY: bool> Kernel for Many<'_, S, ANY> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Wide>(self) -> bool {
        let Many { structure, geometry, rays, axes, bests, worker } = self;
        let second = LANES.min(rays.len() - 1);
        let mut groups: [Group<L>; GROUPS] = [Group::new(rays, axes), Group::new(&rays[second..], axes)];
        let done = structure.many::<L, ANY>(geometry, rays, &mut groups, worker);
        for (group, bests) in groups.iter().zip(bests.chunks_exact_mut(LANES)) {
            bests.copy_from_slice(&group.bests());
        }
        done
    }
}
