//! Tiles are kept from frame to frame while the camera stands still and only objects of finite size change.
//!
//! A window is a row of frames of the run that differ in objects alone. Before its first frame is traced, every object
//! that changes in one of them is known with its bounds in each ([`systems::reuse_bounds`]); while it is traced, each
//! sample notes which of those bounds its rays crossed. In a later frame only samples are traced again that crossed the
//! bounds of an object in a state that it has left or taken since.

use std::collections::{BTreeMap, BTreeSet};

use super::ReusePolicy;
use crate::base::limits;
use crate::shot::plan::PlannedFrame;
use crate::shot::{Input, Shot};
use crate::systems::{self, ObjectStates, PartialFrame, ReuseBounds, Stage, StaticCameraCache};

/// Above this share of samples that are traced in later frames of a window, noting what rays cross costs more than it
/// saves.
const MAX_TRACED_SHARE: f64 = 0.85;
/// How many frames in a row may lie above that share before the window is given up.
const MAX_POOR_FRAMES: u32 = 2;
/// Bytes of the sums of a pixel, about.
const PIXEL_BYTES: u64 = 64;

/// Frames of the run, from `first` on, that differ in objects alone.
struct StaticWindow {
    first: usize,
    end: usize,
    tiles: StaticCameraCache,
    /// How many frames in a row were not worth it.
    poor: u32,
}

/// The tiles of the window that the run is in, if it is in one.
#[derive(Default)]
pub struct TileReuse {
    window: Option<StaticWindow>,
    /// Frames of the run before this one are not looked ahead from again.
    settled: usize,
}

impl TileReuse {
    /// Lends the kept tiles to the frame at `index` of the run.
    pub fn lend(
        &mut self,
        policy: ReusePolicy,
        shot: &mut Shot,
        run: &[Vec<&PlannedFrame>],
        index: usize,
        frame: &mut PartialFrame,
    ) {
        if !policy.reuse {
            return;
        }
        if self.window.as_ref().is_some_and(|window| index >= window.end) {
            self.window = None;
        }
        if self.window.is_none() && index >= self.settled {
            (self.window, self.settled) = look_ahead(shot, run, index, policy.memory);
        }
        if let Some(window) = self.window.take() {
            frame.tile_cache = Some((window.tiles, index - window.first));
            // The rest of the window waits for its tiles to come back.
            self.window = Some(StaticWindow { tiles: StaticCameraCache::default(), ..window });
        }
    }

    /// Takes the tiles back; a frame that failed gives none, and the next one starts afresh.
    pub fn take_back(&mut self, frame: &mut PartialFrame, index: usize) {
        let traced = frame.share_traced();
        let Some((tiles, of_window)) = frame.tile_cache.take() else {
            self.window = None;
            return;
        };
        match &mut self.window {
            Some(window) if of_window == 0 || traced < MAX_TRACED_SHARE => (window.tiles, window.poor) = (tiles, 0),
            Some(window) if window.poor < MAX_POOR_FRAMES => (window.tiles, window.poor) = (tiles, window.poor + 1),
            Some(window) => {
                self.settled = window.end.max(index);
                self.window = None;
            }
            None => {}
        }
    }

    /// Forgets the tiles of the window, as after a frame that failed.
    pub fn forget(&mut self) {
        self.window = None;
    }
}

/// The window that starts at `index`, if it has two frames at least; and the frame behind it.
fn look_ahead(shot: &mut Shot, run: &[Vec<&PlannedFrame>], index: usize, memory: u64) -> (Option<StaticWindow>, usize) {
    let fingerprint = |at: usize| run[at][0].fingerprint.as_ref().ok();
    let Some(first) = fingerprint(index) else { return (None, index + 1) };
    let alike = |at: &usize| {
        run[*at][0].light_mix.is_none() && fingerprint(*at).is_some_and(|other| other.differs_in_objects_only(first))
    };
    let most = run.len().min(index + limits::REUSE_WINDOW_FRAMES);
    let mut end = (index..most).take_while(alike).last().map_or(index + 1, |last| last + 1);
    let [width, height] = first.size.map(u64::from);
    if end < index + 2 || width * height * PIXEL_BYTES > memory << 20 {
        return (None, end);
    }
    let Shot { stage, input, .. } = shot;
    let frames: Vec<u32> = run[index..end].iter().map(|frames| frames[0].frame).collect();
    let Some(objects) = reuse_bounds_in(input, stage, &frames) else { return (None, end) };
    while end >= index + 2 {
        if let Some(states) = ObjectStates::new(&objects[..end - index], limits::REUSE_BOUNDS) {
            let tiles = StaticCameraCache::new(states, memory << 20);
            return (Some(StaticWindow { first: index, end, tiles, poor: 0 }), end);
        }
        end = index + (end - index) / 2;
    }
    (None, index + 1)
}

/// Every object that differs from the base scene in one of the frames, in each of them; `None` if there are too many.
fn reuse_bounds_in(input: &Input, stage: &mut Stage, frames: &[u32]) -> Option<Vec<Vec<ReuseBounds>>> {
    let mut changed: Vec<BTreeMap<usize, ReuseBounds>> = Vec::with_capacity(frames.len());
    systems::update_hierarchy(stage).ok()?;
    let nudges_at_rest = systems::contact_nudges(stage);
    for frame in frames {
        let mut slices = input.slices(*frame).ok()?;
        if slices.len() != 1 {
            return None;
        }
        let edits = slices[0].edits.clone();
        let mut found = None;
        input
            .with_slices(stage, *frame, std::mem::take(&mut slices), |stage, _| {
                let nudges = systems::contact_nudges(stage);
                // What comes to touch something else is set apart from it, whether it was edited itself or not.
                let affected = systems::affected_entities(stage, &edits).map(|mut affected| {
                    affected.extend(nudges.differing(&nudges_at_rest));
                    affected
                });
                let few = affected.filter(|affected| affected.len() <= limits::REUSE_CHANGED_ENTITIES);
                found = few.map(|few| few.into_iter().map(|i| (i, systems::reuse_bounds(stage, &nudges, i))).collect());
                Ok(true)
            })
            .ok()?;
        changed.push(found?);
    }
    let all: BTreeSet<usize> = changed.iter().flat_map(BTreeMap::keys).copied().collect();
    // Taking edits back leaves placements to whoever asks next.
    systems::update_hierarchy(stage).ok()?;
    let at_rest: BTreeMap<usize, ReuseBounds> =
        all.iter().map(|i| (*i, systems::reuse_bounds(stage, &nudges_at_rest, *i))).collect();
    let in_frame = |changed: &BTreeMap<usize, ReuseBounds>| {
        all.iter().map(|i| changed.get(i).unwrap_or(&at_rest[i]).clone()).collect()
    };
    Some(changed.iter().map(in_frame).collect())
}
