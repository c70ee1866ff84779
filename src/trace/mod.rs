//! The kernel: rays against columns of primitives.
//!
//! No I/O, no entities, no `dyn` in an inner loop, `f32` throughout. Rooms stand on floors of their own: imports go
//! down this list only, and no two modules import each other in a circle (`tests/all/house.rs`).
//!
//! | room | what happens there |
//! |---|---|
//! | [`integrator`] | whitted and distribution, path, photon: what a hit gives rise to; adaptive sampling, retracing |
//! | [`wavefront`] | ray queues, classification, shading in lanes, shadow rays |
//! | [`light`] | lamps, emissive surfaces, the environment; choosing among them |
//! | [`material`] | parameters, BSDFs, textures |
//! | [`reuse`] | footprints of samples, their history, motion vectors |
//! | [`accel`] | what finds the primitive along a ray: BVH, grid, brute force |
//! | [`primitive`] | bounds, intersection, surface points and texture coordinates of every kind of primitive |
//! | [`camera`] | rays through pinhole and thin lens |
//! | [`soa`] | work items, column by column: rays, hits |
//! | [`sampler`] | stateless random numbers, Sobol points, warps |
//! | [`simd`] | one number or eight side by side, with the same bits |
//! | [`counters`] | what a frame cost |

pub mod accel;
pub mod camera;
pub mod counters;
pub mod integrator;
pub mod light;
pub mod material;
pub mod primitive;
pub mod reuse;
pub mod sampler;
pub mod simd;
pub mod soa;
pub mod wavefront;
