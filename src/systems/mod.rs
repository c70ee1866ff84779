//! Systems: plain functions over the hecs World.
//!
//! The World is the single truth about the scene. [`spawn`] fills it from data, [`animate`] applies a frame's edits
//! and can take them back, and [`render`] runs the rest in order:
//!
//! `hierarchy` (world placements) -> `extract` (columns of primitives) -> `accelerate` -> `lights` -> tiles.
//!
//! hecs yields entities in no promised order, so the [`Stage`] keeps the authored order and every column is filled in
//! it. What is derived from the World is kept with what it was derived from, and derived again only when that differs:
//! placements by the hierarchy and what moved in it, columns by the shapes and placements, the accelerator by the columns.
//! Names are looked up when an edit changes them. Nothing here reads a file: what the World names and has not loaded is
//! told ([`missing_images`], [`missing_environment`]) and given to it.
//!
//! A frame whose shutter is open is several moments of the World: each is set up as above and adds its share of every
//! pixel's samples to a [`PartialFrame`].

mod accelerate;
mod animate;
mod collect;
mod contacts;
mod deform;
mod environment;
mod extract;
mod hierarchy;
mod lens;
mod light_sum;
mod lights;
mod open_window;
mod origin;
mod previous_frame;
mod references;
mod render;
mod reuse_bounds;
mod shapes;
mod spawn;
mod stage;
mod static_camera;
mod textures;
mod tiles;
mod visibility;

pub use animate::{Undo, animate, undo};
pub use collect::collect;
pub use contacts::{ContactNudges, ContactsLeftOut, contact_nudges, contacts_left_out};
pub use hierarchy::update as update_hierarchy;
pub use light_sum::weighted_sum;
pub use lights::{EmitterId, LightGroups};
pub use origin::origin_for;
pub use previous_frame::PreviousFrame;
pub use render::{FrameStats, PartialFrame, TileSink, bytes_of_pixel, check, forget, render, render_samples};
pub use reuse_bounds::{ReuseBounds, affected_entities, all_reuse_bounds, reuse_bounds};
pub use spawn::spawn;
pub use stage::{LoadedFiles, Stage};
pub use static_camera::{ObjectStates, StaticCameraCache};
pub use textures::{FileRequest, missing_environment, missing_images, named_images};
pub use tiles::TileGrid;

#[cfg(test)]
mod tests;
