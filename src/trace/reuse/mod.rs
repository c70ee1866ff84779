//! What one frame may take from another: the kernel's part of it. What is reused, and why that is safe, is decided in
//! [`crate::shot::reuse`].
//!
//! | file | |
//! |---|---|
//! | `footprint` | which of the regions that change later the rays of a sample crossed |
//! | `history` | [`SampleHistory`]: what is kept of the samples of a tile, and which of them are stale |
//! | `motion` | [`MotionVectors`]: where surfaces were in the picture of the frame before |

mod footprint;
mod history;
mod motion;

pub use footprint::{DirtyRegions, Footprint, Kdop, TouchMask, TrackedRegions};
pub use history::{Change, Changes, SampleHistory};
pub use motion::MotionVectors;

#[cfg(test)]
mod tests;
