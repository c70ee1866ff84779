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
//! pixel's samples to an [`Exposure`].

mod accelerate;
mod animate;
mod before;
mod bodies;
mod collect;
mod extract;
mod hierarchy;
mod lens;
mod lights;
mod render;
mod skins;
mod spawn;
mod stage;
mod still;

pub use animate::{Undo, animate, undo};
pub use before::Past;
pub use bodies::{Body, affected, body};
pub use collect::collect;
pub use hierarchy::update as place;
pub use lights::{Passes, Shiner};
pub use render::{Exposure, FrameStats, check, expose, forget, render, sum_of};
pub use spawn::spawn;
pub use stage::Stage;
pub use still::{Scenes, Still};

#[cfg(test)]
mod tests;
