//! Photon mapping (Jensen 1996), in passes whose mean has no bias in the end (Knaus and Zwicker, "Progressive Photon
//! Mapping: A Probabilistic Approach", ACM TOG 2011).
//!
//! Each pass sends photons of its own from the lights and traces its share of every pixel's samples. A path from the
//! eye is traced as `super::path` does, through mirrors, glass and gloss, up to the diffuse part of a surface: there
//! it samples lights, and the light that reached the surface by way of others is read from how densely photons lie
//! around. From pass to pass the radius of that search shrinks, so that noise and blur of the mean both vanish. Photons
//! of caustics are spread farther where they are few, by what the first pass has seen.
//!
//! Where a surface ends within that radius, the density is that over the part that is there (`domain`), so that corners
//! and edges are as bright as the middle.
//!
//! What sends no photons is left to the paths, which then go on: the sky, and lamps that do not fall off. Photons know
//! nothing of the camera: they stand still while it moves, and [`PhotonCache`] keeps them.

mod cache;
mod domain;
mod map;
mod pass;
mod shade;
mod tracer;

pub use cache::PhotonCache;
pub use pass::{PhotonPass, ProgressiveState};
pub use shade::{PathOutput, shade};
