//! What a run keeps from frame to frame: passes of lights, and the samples of a picture while the camera stands still.
//!
//! Nothing here decides what a frame looks like. Whatever is kept is what tracing the frame anew would give, to the bit;
//! with `--no-reuse` it is traced anew.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::groups::Group;
use super::plan::Planned;
use super::{Input, Shot};
use crate::base::digest::Digest;
use crate::base::limits;
use crate::components::Render;
use crate::film::Film;
use crate::systems::{self, Body, Exposure, FrameStats, Scenes, Stage, Still};

/// How far frames may be made from one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Policy {
    pub reuse: bool,
    /// Memory for what is kept, in MiB.
    pub memory: u64,
}

/// What is kept at one time.
pub struct Keeper {
    policy: Policy,
    passes: Option<Passes>,
    window: Option<Window>,
    /// Frames of the run before this one are not looked ahead from again.
    settled: usize,
}

/// Films of the frames of a group.
struct Passes {
    hash: Digest,
    films: Vec<Film>,
    render: Render,
    seed: u64,
}

/// Frames of the run, from `first` on, that differ in bodies alone.
struct Window {
    first: usize,
    end: usize,
    still: Still,
    /// How many frames in a row were not worth it.
    poor: u32,
}

/// Share of the samples that are traced in later frames of a window, above which noting what rays cross costs too much;
/// and how many frames in a row may be like that.
const WORTHWHILE: f64 = 0.85;
const PATIENCE: u32 = 2;

impl Keeper {
    pub fn new(policy: Policy) -> Self {
        Keeper { policy, passes: None, window: None, settled: 0 }
    }

    /// A frame of a group whose passes are kept.
    pub fn sum(&self, group: &Group, factors: &[Vec3]) -> Option<(Film, Render, FrameStats)> {
        let passes = self.passes.as_ref().filter(|passes| passes.hash == group.hash)?;
        let (first, others) = passes.films.split_first()?;
        let film = systems::sum_of(first, others, factors);
        let (count, seed) = (passes.films.len(), passes.seed);
        let stats = FrameStats {
            seed,
            passes: count,
            passes_kept: count,
            reuse_bytes: passes.bytes(),
            ..FrameStats::default()
        };
        Some((film, passes.render.clone(), stats))
    }

    /// Keeps the passes of a frame, should another one of its group follow.
    pub fn keep_passes(&mut self, group: &Group, films: Vec<Film>, render: &Render, seed: u64, rest: &[Vec<&Planned>]) {
        let follows = rest.iter().any(|frames| frames[0].group.as_ref().is_some_and(|other| other.hash == group.hash));
        let passes = Passes { hash: group.hash, films, render: render.clone(), seed };
        let fits = passes.bytes() as u64 <= self.policy.memory << 20;
        self.passes = (self.policy.reuse && follows && fits).then_some(passes);
    }

    /// Lends the kept tiles to the exposure of the frame at `index` of the run.
    pub fn lend(&mut self, shot: &mut Shot, run: &[Vec<&Planned>], index: usize, exposure: &mut Exposure) {
        if !self.policy.reuse {
            return;
        }
        if self.window.as_ref().is_some_and(|window| index >= window.end) {
            self.window = None;
        }
        if self.window.is_none() && index >= self.settled {
            (self.window, self.settled) = look_ahead(shot, run, index, self.policy.memory);
        }
        if let Some(window) = self.window.take() {
            exposure.still = Some((window.still, index - window.first));
            // The rest of the window waits for its tiles to come back.
            self.window = Some(Window { still: Still::default(), ..window });
        }
    }

    /// Takes the tiles back; a frame that failed gives none, and the next one starts afresh.
    pub fn take_back(&mut self, exposure: &mut Exposure, index: usize) {
        let traced = exposure.share_traced();
        let Some((still, picture)) = exposure.still.take() else {
            self.window = None;
            return;
        };
        match &mut self.window {
            Some(window) if picture == 0 || traced < WORTHWHILE => (window.still, window.poor) = (still, 0),
            Some(window) if window.poor < PATIENCE => (window.still, window.poor) = (still, window.poor + 1),
            Some(window) => {
                self.settled = window.end.max(index);
                self.window = None;
            }
            None => {}
        }
    }

    /// Forgets the tiles of the window, as after a frame that failed.
    pub fn drop_tiles(&mut self) {
        self.window = None;
    }
}

impl Passes {
    fn bytes(&self) -> usize {
        self.films.iter().map(|film| size_of_val(&*film.pixels)).sum()
    }
}

/// Bytes of the sums of a pixel, about.
const PIXEL_BYTES: u64 = 64;

/// The frames from `index` on in which nothing but bodies changes, if they are two at least; and the frame behind them.
fn look_ahead(shot: &mut Shot, run: &[Vec<&Planned>], index: usize, memory: u64) -> (Option<Window>, usize) {
    let outline = |at: usize| run[at][0].outline.as_ref().ok();
    let Some(base) = outline(index) else { return (None, index + 1) };
    let alike =
        |at: &usize| run[*at][0].group.is_none() && outline(*at).is_some_and(|other| other.stands_still_with(base));
    let most = run.len().min(index + limits::STILL_FRAMES);
    let mut end = (index..most).take_while(alike).last().map_or(index + 1, |last| last + 1);
    let [width, height] = base.size.map(u64::from);
    if end < index + 2 || width * height * PIXEL_BYTES > memory << 20 {
        return (None, end);
    }
    let Shot { stage, input, .. } = shot;
    let frames: Vec<u32> = run[index..end].iter().map(|frames| frames[0].frame).collect();
    let Some(bodies) = bodies_in(input, stage, &frames) else { return (None, end) };
    while end >= index + 2 {
        if let Some(scenes) = Scenes::new(&bodies[..end - index], limits::STILL_BOXES) {
            return (Some(Window { first: index, end, still: Still::new(scenes, memory << 20), poor: 0 }), end);
        }
        end = index + (end - index) / 2;
    }
    (None, index + 1)
}

/// Every body that is elsewhere or otherwise in one of the frames than at rest, in each of them.
fn bodies_in(input: &Input, stage: &mut Stage, frames: &[u32]) -> Option<Vec<Vec<Body>>> {
    let mut moved: Vec<BTreeMap<usize, Body>> = Vec::with_capacity(frames.len());
    for frame in frames {
        let mut slices = input.slices(*frame).ok()?;
        if slices.len() != 1 {
            return None;
        }
        let edits = slices[0].edits.clone();
        let mut found = None;
        input
            .with_slices(stage, *frame, std::mem::take(&mut slices), |stage, _| {
                let affected = systems::affected(stage, &edits);
                let few = affected.filter(|affected| affected.len() <= limits::STILL_MOVING);
                found = few.map(|few| few.into_iter().map(|i| (i, systems::body(stage, i))).collect());
                Ok(true)
            })
            .ok()?;
        moved.push(found?);
    }
    let all: BTreeSet<usize> = moved.iter().flat_map(BTreeMap::keys).copied().collect();
    // Taking edits back leaves placements to whoever asks next.
    systems::place(stage).ok()?;
    let at_rest: BTreeMap<usize, Body> = all.iter().map(|i| (*i, systems::body(stage, *i))).collect();
    let in_frame =
        |moved: &BTreeMap<usize, Body>| all.iter().map(|i| moved.get(i).unwrap_or(&at_rest[i]).clone()).collect();
    Some(moved.iter().map(in_frame).collect())
}
