//! The kernel: rays against columns of primitives.
//!
//! No I/O, no entities, no `dyn` in an inner loop, `f32` throughout. [`geometry`] holds the primitives as columns,
//! [`columns`] rays and hits; [`shapes`] has the tests of single primitives, written over the lanes of [`simd`]. [`accel`]
//! finds the nearest along a ray, and whatever finds it, on whatever processor, the answer is the same to the bit.
//! [`surface`] says where a hit is and how exactly that is known. [`integrator`] follows light through waves of [`camera`]
//! rays and what they give rise to, over [`lights`], [`surfacing`] (materials) and the [`bsdf`] of a point, with
//! [`texture`]s, in an [`environment`], fed by the stateless [`sampler`]. [`footprint`] notes what the rays of a sample
//! crossed, [`before`] tells what has moved since the frame before.

pub mod accel;
pub mod before;
pub mod bsdf;
pub mod camera;
pub mod columns;
pub mod environment;
pub mod footprint;
pub mod geometry;
pub mod integrator;
pub mod lights;
pub mod ray;
pub mod sampler;
pub mod shapes;
pub mod simd;
pub mod stats;
pub mod surface;
pub mod surfacing;
pub mod texture;

pub use accel::{Accelerator, Worker};
pub use columns::{Hits, Rays};
pub use geometry::{Geometry, Sides, Tag};
pub use ray::{Hit, Ray};
pub use stats::Counters;
pub use surface::Surface;
