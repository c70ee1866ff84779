//! Integrators: what a hit gives rise to, wave by wave.
//!
//! The rays of many samples go through the scene together: all that left the camera, then all that these gave rise to,
//! and so on down to the depth cap. Neighbours in a wave run alike, so that they are traced in packets, and so are
//! their shadow rays, light by light. What a ray contributes is added to its sample in the order of the wave, so that
//! the sums do not depend on how samples are batched.
//!
//! | file | |
//! |---|---|
//! | `tile` | [`render_pixels`]: samples of the pixels of a tile, in rounds and batches; [`SampleSubset`] |
//! | `bounces` | [`Estimator`]: the loop over depths; which hits are shaded in lanes and which alone |
//! | `whitted` | Whitted and distribution ray tracing: every hit spawns all the rays that its material has; gloss of mirrors |
//! | `path` | path tracing (Kajiya 1986): every hit goes on in one direction, sampled by its BSDF ([`super::material::bsdf`]; gloss in its `blinn_phong`) |
//! | `fog` | what fog takes of rays, and what it adds |
//! | `photon` | photon mapping: indirect light is read from photons |
//! | `adaptive` | when pixels have had samples enough |
//! | `retrace` | [`retrace`]: only those samples that may look otherwise than in a picture before |
//!
//! `whitted` serves both pictures: the lens, gloss and soft shadows are switched off for Whitted's when the settings are
//! resolved. Rays are cut off for being faint only below `min_weight`.
//!
//! # Side by side
//!
//! Camera rays, and hits on paths (in other pictures those on Blinn-Phong surfaces), go through lanes of eight in
//! [`super::wavefront`]: points, light, directions and Sobol points by the same generic code that a single hit runs, so
//! that the bits agree. Rays, their path states and their hits lie in columns all the way: eight neighbours are loaded
//! at once, and the lanes that go on are compressed and stored at once. Rays that left the scene, crossed a lamp or ran
//! through an absorbing medium are found by a kernel of their own, laws of microfacets are asked lane by lane, and what
//! is textured or sends out light is shaded alone. A sample's colour does not depend on which others stand beside it.
//!
//! With one ray after the other, three fifths of a frame were spent outside traversal, most of it on Sobol points and
//! on copies of hits and surfaces. Lanes took 0.75 (diffuse meshes), 0.6 (Cornell box) and 0.5 (thin lens) of that
//! time, columns in place of rows 0.73, 0.8 and 0.59 of what was left. A closure or a function of arrays that is handed
//! values of lanes costs more than all of that gains: see [`crate::trace::simd::Kernel::run`].

mod adaptive;
mod bounces;
mod fog;
mod path;
pub mod photon;
mod retrace;
mod tile;
mod whitted;

pub use bounces::Estimator;
pub use photon::{PhotonCache, PhotonPass, ProgressiveState};
pub use retrace::retrace;
pub use tile::{SampleSubset, render_pixels};

#[cfg(test)]
mod tests;
