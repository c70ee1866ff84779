//! Systems: plain functions over the hecs World.
//!
//! The World is the single truth about the scene. [`spawn`] fills it from data, [`animate`] applies a frame's edits
//! and can take them back, and [`render`] runs the rest in order:
//!
//! `hierarchy` (world placements) -> `extract` (columns of primitives) -> `accelerate` -> `lights` -> tiles.
//!
//! hecs yields entities in no promised order, so the [`Stage`] keeps the authored order and every column is filled in
//! it. What an edit cannot have changed is kept: columns are extracted only after an edit that could touch them, and
//! the accelerator is rebuilt only if the columns differ.
//!
//! A frame whose shutter is open is several moments of the World: each is set up as above and adds its share of every
//! pixel's samples to a [`PartialFrame`].

mod accelerate;
mod animate;
mod collect;
mod extract;
mod hierarchy;
mod lens;
mod lights;
mod previous_frame;
mod render;
mod reuse_bounds;
mod spawn;
mod stage;
mod static_camera;
mod textures;

pub use animate::{Undo, animate, undo};
pub use collect::collect;
pub use hierarchy::update as update_hierarchy;
pub use lights::{EmitterId, LightGroups};
pub use previous_frame::PreviousFrame;
pub use render::{FrameStats, PartialFrame, check, forget, render, render_samples, weighted_sum};
pub use reuse_bounds::{ReuseBounds, affected_entities, reuse_bounds};
pub use spawn::spawn;
pub use stage::Stage;
pub use static_camera::{ObjectStates, StaticCameraCache};

#[cfg(test)]
mod tests;
