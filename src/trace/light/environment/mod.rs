//! What lies around the scene, infinitely far away: a cube map, a picture of the whole sphere, daylight, or a simple
//! sky.
//!
//! Values are radiance, linear; directions are unit vectors away from the scene. A light transport that samples the
//! environment needs its distribution ([`Environment::prepare`]) and then calls [`Environment::sample`] and
//! [`Environment::pdf`]; densities are per solid angle (steradian).

mod cube;
mod daylight;
mod distribution;
mod source;

pub use cube::{CubeMap, FACES, Face};
pub use daylight::daylight_map;
pub use source::{Environment, EnvironmentMap};

#[cfg(test)]
mod tests;
