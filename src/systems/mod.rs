//! Systems (interface; filled in at once).
#![allow(unused_variables)]
use crate::base::diagnostics::Diagnostics;
use crate::components::{Edit, Scene};
use crate::film::Film;
use crate::trace::Counters;
use std::sync::atomic::AtomicBool;

/// The World and the authored order of its entities.
pub struct Stage {}

/// What `animate` changed, so that it can be taken back.
pub struct Undo {}

/// What one frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    pub counters: Counters,
    pub accel: &'static str,
    pub seed: u64,
    pub build_seconds: f64,
    pub render_seconds: f64,
}

pub fn spawn(scene: Scene) -> Stage {
    Stage {}
}

/// The World as a scene again.
pub fn collect(stage: &Stage) -> Scene {
    Scene::default()
}

/// Applies edits to the World; on error nothing is changed.
pub fn animate(stage: &mut Stage, edits: Vec<Edit>) -> Result<Undo, Diagnostics> {
    Ok(Undo {})
}

pub fn undo(stage: &mut Stage, undo: Undo) {}

/// Renders the World as it stands; `None` if `cancel` was raised. `progress(done, total)` is called from any thread.
pub fn render(
    stage: &mut Stage,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Option<(Film, FrameStats)>, Diagnostics> {
    Ok(None)
}
