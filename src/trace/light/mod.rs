//! Lights as columns of the kernel: lamps that are written as such, and primitives whose material shines.
//!
//! A lamp is a point, which may shine into a cone alone, a parallelogram, or so far away that its light comes from one
//! direction. One that falls off with the square of the distance is physical: a point of
//! `color` c has the intensity pi c, a parallelogram of area A the radiance pi c / A to both sides. One that does not
//! fall off cannot be met by rays and sends out no photons: it is only ever sampled. Lamps stop no rays.
//!
//! Spheres, triangles (of meshes too) and boxes that shine are sampled; other shapes that do are left to the rays that
//! happen to meet them. One of few lights is chosen by power, one of many by a tree (`many`, `tree`). [`Lights::sample`] is for light towards a point, [`Lights::emit`] for photons.

mod cone;
mod distribution;
mod emitter;
pub mod environment;
mod in_scatter;
mod lamp;
mod lamp_lanes;
mod lights;
mod lights_lanes;
mod linking;
mod many;
mod sample;
mod tree;

pub use cone::LampCone;
pub use emitter::Emitter;
pub use lamp::Lamp;
pub use lights::Lights;
pub use linking::{LightLinking, LightLinks};

#[cfg(test)]
mod tests;
