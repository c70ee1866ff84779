//! Accelerators (interface; the kernel helper fills it in).
#![allow(unused_variables)]
use super::{Counters, Geometry, Hit, Ray};
use crate::components::Accel;

pub enum Accelerator {
    Brute,
}

/// What one thread owns while it traces: mailboxes and counters.
#[derive(Default)]
pub struct Worker {
    pub counters: Counters,
}

impl Accelerator {
    pub fn build(geometry: &Geometry, choice: Accel, density: f64) -> Self {
        Accelerator::Brute
    }
    pub fn name(&self) -> &'static str {
        "brute"
    }
    pub fn closest(&self, geometry: &Geometry, ray: &Ray, worker: &mut Worker) -> Option<Hit> {
        None
    }
    /// Whether anything lies between the origin and `t_max`.
    pub fn occluded(&self, geometry: &Geometry, ray: &Ray, worker: &mut Worker) -> bool {
        false
    }
}
