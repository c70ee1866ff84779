//! The kernel: rays against columns of primitives.
//!
//! No I/O, no entities, no `dyn` in an inner loop, `f32` throughout. [`geometry`] holds the primitives as columns,
//! [`accel`] finds the nearest one along a ray, and whatever finds it, the answer is the same to the bit.

pub mod accel;
pub mod camera;
pub mod geometry;
pub mod integrator;
pub mod lights;
pub mod ray;
pub mod sampler;
pub mod stats;
pub mod surfacing;

pub use accel::{Accelerator, Worker};
pub use geometry::{Geometry, Sides, Surface, Tag};
pub use ray::{Hit, Ray};
pub use stats::Counters;
