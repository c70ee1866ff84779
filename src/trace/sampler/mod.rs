//! Random decisions, and warps of the unit square to what they decide about.
//!
//! | file | |
//! |---|---|
//! | `stateless` | [`Sampler`]: stateless sampling by seed, pixel, sample and [`Domain`]; [`RayNode`]: a ray in the tree of a sample |
//! | `lanes` | the samplers of eight samples side by side |
//! | [`sobol`] | scrambled Sobol points with blue-noise error over the screen |
//! | `warp` | disk, hemisphere, sphere, triangle; [`Frame`]; the power heuristic |

mod lanes;
pub mod sobol;
mod stateless;
mod warp;

pub use lanes::{PixelSample, SampleLanes, SampleSet};
pub use stateless::{Domain, RayNode, Sampler};
pub use warp::{
    Frame, Iris, around, concentric_disk, cosine_directions, cosine_hemisphere, cosine_pdf, in_triangle,
    power_heuristic, sin_cos_half_turns, tangents, uniform_sphere,
};
