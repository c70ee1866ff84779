//! What finds the primitive along a ray: brute force, or a uniform grid.
//!
//! Both share one front: far rays are moved up to the scene, then finite primitives and infinite planes are met, always
//! by the same tests and with the same rule for ties. The answer is therefore the same to the bit; only the cost
//! differs. A [`Worker`] belongs to one thread; what it counts for a ray is a function of that ray alone.

mod grid;

use super::geometry::{Best, Kind};
use super::shapes::Probe;
use super::{Counters, Geometry, Hit, Ray};
use crate::components::Accel;
use grid::Grid;

/// Below this many primitives a walk through cells costs more than it saves.
const FEW: u32 = 12;

pub enum Accelerator {
    Brute,
    Grid(Box<Grid>),
}

/// Slots of a mailbox: enough for the primitives that a ray meets again in neighbouring cells.
const SLOTS: usize = 64;

/// What one thread owns while it traces.
pub struct Worker {
    pub counters: Counters,
    /// Primitive and ray of the last test in each slot; a slot that was taken over only costs a second test.
    mailbox: [(u32, u32); SLOTS],
    ray: u32,
}

impl Default for Worker {
    fn default() -> Self {
        Worker { counters: Counters::default(), mailbox: [(u32::MAX, 0); SLOTS], ray: 0 }
    }
}

impl Worker {
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
        match choice {
            Accel::Brute => Accelerator::Brute,
            Accel::Auto if geometry.finite() <= FEW => Accelerator::Brute,
            Accel::Auto | Accel::Grid => Accelerator::Grid(Box::new(Grid::build(geometry, density))),
        }
    }

    pub fn name(&self) -> &'static str {
        match self {
            Accelerator::Brute => "brute",
            Accelerator::Grid(_) => "grid",
        }
    }

    /// The nearest hit before `t_max`.
    pub fn closest(&self, geometry: &Geometry, ray: &Ray, worker: &mut Worker) -> Option<Hit> {
        let (skip, near_ray) = geometry.approach(ray);
        let mut finite = Best::within(near_ray.t_max);
        self.finite::<false>(geometry, &Probe::from(&near_ray), &mut finite, worker);
        let mut best = Best::within(ray.t_max);
        if finite.found {
            best = Best { t: skip + finite.t, ..finite };
        }
        let planes = geometry.range(Kind::Plane);
        if !planes.is_empty() {
            let probe = Probe::from(ray);
            worker.counters.intersection_tests += u64::from(planes.end - planes.start);
            planes.for_each(|n| geometry.test(n, &probe, &mut best));
        }
        best.found.then_some(Hit { t: best.t, primitive: best.primitive, element: best.element, u: best.u, v: best.v })
    }

    /// Whether anything lies between the origin and `t_max`: true exactly if [`Self::closest`] finds something.
    pub fn occluded(&self, geometry: &Geometry, ray: &Ray, worker: &mut Worker) -> bool {
        let planes = geometry.range(Kind::Plane);
        if !planes.is_empty() {
            let (probe, mut best) = (Probe::from(ray), Best::within(ray.t_max));
            worker.counters.intersection_tests += u64::from(planes.end - planes.start);
            planes.for_each(|n| geometry.test(n, &probe, &mut best));
            if best.found {
                return true;
            }
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
            Accelerator::Grid(grid) => grid.walk::<ANY>(geometry, probe, best, worker),
        }
    }
}

#[cfg(test)]
mod tests;
