//! What finds the primitive along a ray: brute force, a uniform grid of two levels, or a tree of boxes.
//!
//! All share one front: far rays are moved up to the scene, then finite primitives and infinite planes are met, always
//! by the same tests and with the same rule for ties. The answer is therefore the same to the bit; only the cost
//! differs. A [`Worker`] belongs to one thread; what it counts for the rays of a tile depends on that tile alone.
//!
//! # What was found
//!
//! Measured with the `rays` bench on one thread of a Zen 3, in turns with Embree 3.13; in millions of rays a second,
//! Embree's single rays / its packets of eight / the tree here, the median of three (they differed by up to a half on
//! that machine, which others used too):
//!
//! | | primary | diffuse bounce | shadow |
//! |---|---|---|---|
//! | bunny, 69 k triangles | 13 / 29 / 21 | 9.1 / 10 / 5.8 | 14 / 20 / 12 |
//! | blob, 874 k triangles | 9.7 / 13 / 17 | 5.6 / 5.6 / 3.0 | 8.6 / 11 / 6.2 |
//! | bunny in a stadium | 6.9 / 19 / 14 | 6.3 / 6.9 / 3.3 | 12 / 25 / 21 |
//!
//! Spheres, before rays lay in columns, against a build of Embree that picked AVX-512:
//!
//! | | primary | diffuse bounce | shadow |
//! |---|---|---|---|
//! | sphereflake, 7 k spheres | 12.3 / 18 / 32 | 9.8 / 11.5 / 12 | 14.3 / 26 / 29 |
//! | sphereflake, 598 k spheres | 9.6 / 12.3 / 16 | 6.3 / 7 / 7.3 | 11.1 / 17 / 13 |
//!
//! Rays that share nothing are what is left to do.
//!
//! The grid reaches 0.56 / 0.55 / 0.42 of the tree's rates on the bunny, 0.59 / 0.68 / 0.46 on the sphereflake of 7 k
//! spheres and 0.32 / 0.32 / 0.49 in the stadium (0.20 / 0.11 / 0.09 on the bunny before cells had blocks, packets and
//! grids of their own). Finer cells than one a primitive lose: their blocks stay nearly empty. Blocks of cones are met
//! 2.3 to 3.3 times as fast as cones one by one.
//!
//! Over whole frames the tree was ahead of the grid, or within a twentieth, in all of some forty scenes, which is why
//! [`Accel::Auto`] is the tree. User seconds of one thread, tree / grid: 0.12 to 0.17 for a crowd of 1,000 instances
//! whose boxes overlap, 0.26 for 3,000 tufts side by side, 0.54 for 100 large instances in one place, 0.8 to 0.86 for
//! 10,000 instances apart; 0.66 for the sphereflake, 0.68 for 2,000 spheres through each other, 0.85 to 0.9 and 0.77 to
//! 0.96 for clouds of 1,000 and 100,000 small spheres, 0.82 for 5,000 cones, 0.97 for 5,000 boxes, 0.76 for the bunny,
//! 0.59 for the stadium, 1.0 for the Cornell box, 0.55 to 1.03 for the scenes of the SPD. An estimate of costs would
//! have nothing to choose.
//!
//! Where few rays are expected, a tree is built in `bvh::fast` from a curve that fills space, at 1.7 times the rate of a
//! full build (874 k triangles, on one thread and two: 1.6 and 2.5 millions a second in full, 2.7 and 4.4 fast). Diffuse
//! bounces then visit 1.12 to 1.17 times as many nodes and test 1.1 to 1.5 times as many primitives, at 0.87 of the rate
//! on meshes. A third of what is left goes into reading and writing primitives. Blocks that dynamic programming cuts from
//! the curve, and cuts at multiples of eight, cost less to find and made up to 3 times as many tests; in the stadium rays
//! visit 1.4 times as many nodes as in the full tree if nodes are cut from the curve whatever surface that wastes.
//!
//! Full builds took 1.4 times as long while numbers of primitives stood beside their coordinates as subnormal floats.
//! Nodes of eight that are made of a tree of twos at least surface, not by opening the widest range, let shadow rays
//! visit 0.73 (bunny) and 0.81 (blob) of the nodes, bounces 0.94 to 0.99, and take 74 bytes a triangle instead of 78.
//!
//! What helped most, in order: arithmetic that is inlined into the one function that enables AVX2 (a closure handed to
//! the standard library is not: every addition becomes a call); one frustum test of a node for sixteen rays instead of
//! sixteen tests of eight boxes; a ray in each lane at the leaves of packets; spreading the ray over the lanes again at
//! every leaf instead of keeping it in registers that spill; a cost of splits that counts a leaf half by its primitives
//! and half by its block (blocks alone put the floor into a leaf with the model that stands on it); 32 bins. Leaves of
//! four were slower everywhere; prefetching the children of a node pays where the tree is larger than the cache.

mod bvh;
mod grid;
mod leaves;
mod packet;

use super::footprint::Footprint;
use super::geometry::{Best, Kind};
use super::integrator::Buffers;
use super::shapes::Probe;
use super::simd::Width;
use super::{Counters, Geometry, Hit, Hits, Ray, Rays};
use crate::components::Accel;
use bvh::Bvh;
use grid::Grid;
use packet::{alone, each_packet};

pub enum Accelerator {
    Brute,
    Grid(Box<Grid>),
    Bvh(Box<Bvh>),
}

/// Margin of boxes, relative to the greatest coordinate of ray and structure. What tests of primitives are held to errs
/// by a quarter of it.
const MARGIN: f32 = 8.0 * f32::EPSILON;

/// Slots of a mailbox: enough for the primitives that a ray meets again in neighbouring cells.
const SLOTS: usize = 64;

/// What one thread owns while it traces.
pub struct Worker {
    pub counters: Counters,
    /// Primitive and ray of the last test in each slot; a slot that was taken over only costs a second test.
    mailbox: [(u32, u32); SLOTS],
    ray: u32,
    /// Children of nodes that are still to be visited, nearest last.
    stack: Vec<u64>,
    /// Rays in the order in which packets take them.
    order: Vec<u32>,
    /// Packets in a row whose rays parted ways, and how many to trace ray by ray before the next attempt.
    failures: u32,
    wait: u32,
    pub(super) waves: Buffers,
    /// What the rays of the tile crossed, where that is noted.
    pub footprint: Footprint,
}

impl Default for Worker {
    fn default() -> Self {
        Worker {
            counters: Counters::default(),
            mailbox: [(u32::MAX, 0); SLOTS],
            ray: 0,
            stack: Vec::new(),
            order: Vec::new(),
            failures: 0,
            wait: 0,
            waves: Buffers::default(),
            footprint: Footprint::default(),
        }
    }
}

impl Worker {
    /// Forgets how packets fared: what a tile costs does not depend on the tiles before.
    pub fn start_tile(&mut self) {
        (self.failures, self.wait) = (0, 0);
    }

    fn next_ray(&mut self) {
        self.ray = self.ray.wrapping_add(1);
        if self.ray == 0 {
            self.mailbox = [(u32::MAX, 0); SLOTS];
            self.ray = 1;
        }
    }

    /// Whether this ray has not met the primitive yet, as far as the mailbox remembers.
    #[inline]
    fn is_new(&mut self, primitive: u32) -> bool {
        let slot = &mut self.mailbox[primitive as usize % SLOTS];
        let new = *slot != (primitive, self.ray);
        *slot = (primitive, self.ray);
        new
    }
}

impl Accelerator {
    /// `density` is in cells per primitive.
    pub fn build(geometry: &Geometry, choice: Accel, density: f64) -> Self {
        Self::rebuild(geometry, choice, density, f64::INFINITY, None)
    }

    /// As [`Self::build`], for as many rays as are expected to go through it: for few, a tree is built fast instead of
    /// well. What `before` holds of meshes that are still there is kept, and a tree whose primitives only
    /// moved is fitted to them while that is good enough. Costs of rays may depend on `before`, hits do not.
    pub fn rebuild(geometry: &Geometry, choice: Accel, density: f64, rays: f64, before: Option<&Accelerator>) -> Self {
        let width = Width::detect();
        match choice {
            Accel::Brute => Accelerator::Brute,
            Accel::Grid => {
                let before = if let Some(Accelerator::Grid(grid)) = before { Some(&**grid) } else { None };
                Accelerator::Grid(Box::new(Grid::build(geometry, density, width, before)))
            }
            // No choice to make: see "What was found".
            Accel::Auto | Accel::Bvh => {
                let before = if let Some(Accelerator::Bvh(bvh)) = before { Some(&**bvh) } else { None };
                Accelerator::Bvh(Box::new(Bvh::build(geometry, width, rays, before)))
            }
        }
    }

    /// Whether it is an older one that was fitted to primitives that moved.
    pub fn is_fitted(&self) -> bool {
        matches!(self, Accelerator::Bvh(bvh) if bvh.is_fitted)
    }

    /// Whether it was built for few rays, and would be built better for so many.
    pub fn is_outgrown(&self, rays: f64) -> bool {
        matches!(self, Accelerator::Bvh(bvh) if bvh.is_outgrown(rays))
    }

    /// Memory of the structure, without the primitives it is built over.
    pub fn bytes(&self) -> usize {
        match self {
            Accelerator::Brute => 0,
            Accelerator::Grid(grid) => grid.bytes(),
            Accelerator::Bvh(bvh) => bvh.bytes(),
        }
    }

    pub fn name(&self) -> &'static str {
        match self {
            Accelerator::Brute => "brute",
            Accelerator::Grid(_) => "grid",
            Accelerator::Bvh(_) => "bvh",
        }
    }

    /// The nearest hit before `t_max`.
    pub fn closest(&self, geometry: &Geometry, ray: &Ray, worker: &mut Worker) -> Option<Hit> {
        let (skip, near_ray) = geometry.approach(ray);
        let mut finite = Best::within(near_ray.t_max);
        self.finite::<false>(geometry, &Probe::from(&near_ray), &mut finite, worker);
        let Best { t, primitive, element, u, v, found } = finite;
        let finite = found.then_some(Hit { t: skip + t, primitive, element, u, v });
        with_planes(geometry, ray, finite, worker)
    }

    /// [`Self::closest`] of many rays: those that go the same way cost less together.
    pub fn closest_all(&self, geometry: &Geometry, rays: &Rays, worker: &mut Worker, hits: &mut Hits) {
        hits.reset(rays.len());
        match self {
            Accelerator::Brute => {
                rays.iter().enumerate().for_each(|(i, ray)| hits.set(i, self.closest(geometry, &ray, worker)));
                return;
            }
            Accelerator::Grid(grid) => each_packet::<_, _, false>(&**grid, geometry, rays, worker, hits),
            Accelerator::Bvh(bvh) => each_packet::<_, _, false>(&**bvh, geometry, rays, worker, hits),
        }
        if !geometry.range(Kind::Plane).is_empty() {
            for (i, ray) in rays.iter().enumerate() {
                hits.set(i, with_planes(geometry, &ray, hits.get(i), worker));
            }
        }
    }

    /// [`Self::occluded`] of many rays.
    pub fn occluded_all(&self, geometry: &Geometry, rays: &Rays, worker: &mut Worker, blocked: &mut Vec<bool>) {
        blocked.resize(rays.len(), true);
        match self {
            Accelerator::Brute => {
                rays.iter().zip(blocked).for_each(|(ray, blocked)| *blocked = self.occluded(geometry, &ray, worker));
                return;
            }
            Accelerator::Grid(grid) => each_packet::<_, _, true>(&**grid, geometry, rays, worker, &mut blocked[..]),
            Accelerator::Bvh(bvh) => each_packet::<_, _, true>(&**bvh, geometry, rays, worker, &mut blocked[..]),
        }
        if !geometry.range(Kind::Plane).is_empty() {
            for (ray, blocked) in rays.iter().zip(blocked) {
                *blocked = *blocked || planes_block(geometry, &ray, worker);
            }
        }
    }

    /// Whether anything lies between the origin and `t_max`: true exactly if [`Self::closest`] finds something.
    pub fn occluded(&self, geometry: &Geometry, ray: &Ray, worker: &mut Worker) -> bool {
        if planes_block(geometry, ray, worker) {
            return true;
        }
        let (_, ray) = geometry.approach(ray);
        let mut best = Best::within(ray.t_max);
        self.finite::<true>(geometry, &Probe::from(&ray), &mut best, worker);
        best.found
    }

    #[inline]
    fn finite<const ANY: bool>(&self, geometry: &Geometry, probe: &Probe, best: &mut Best, worker: &mut Worker) {
        match self {
            Accelerator::Brute => {
                for n in 0..geometry.finite() {
                    worker.counters.intersection_tests += 1;
                    geometry.test(n, probe, best);
                    if ANY && best.found {
                        return;
                    }
                }
            }
            Accelerator::Grid(grid) => alone::<_, ANY>(&**grid, geometry, probe, best, worker),
            Accelerator::Bvh(bvh) => alone::<_, ANY>(&**bvh, geometry, probe, best, worker),
        }
    }
}

/// The nearer of the hit among the finite primitives and those of the planes.
#[inline(always)]
fn with_planes(geometry: &Geometry, ray: &Ray, finite: Option<Hit>, worker: &mut Worker) -> Option<Hit> {
    let mut best = match finite {
        Some(Hit { t, primitive, element, u, v }) => Best { t, primitive, element, u, v, found: true },
        None => Best::within(ray.t_max),
    };
    meet_planes(geometry, ray, &mut best, worker);
    let Best { t, primitive, element, u, v, found } = best;
    found.then_some(Hit { t, primitive, element, u, v })
}

/// Whether a plane lies between the origin and `t_max`.
#[inline(always)]
fn planes_block(geometry: &Geometry, ray: &Ray, worker: &mut Worker) -> bool {
    let mut best = Best::within(ray.t_max);
    meet_planes(geometry, ray, &mut best, worker);
    best.found
}

#[inline(always)]
fn meet_planes(geometry: &Geometry, ray: &Ray, best: &mut Best, worker: &mut Worker) {
    let planes = geometry.range(Kind::Plane);
    if !planes.is_empty() {
        let probe = Probe::from(ray);
        worker.counters.intersection_tests += u64::from(planes.end - planes.start);
        planes.for_each(|n| geometry.test(n, &probe, best));
    }
}

#[cfg(test)]
mod tests;
