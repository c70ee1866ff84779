//! The plan of a run: every wanted frame as data, and what is there of it already.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::Shot;
use super::checkpoints;
use super::chunks::{self, Chunks, FrameCost};
use super::fingerprint::{Fingerprint, FramePart};
use super::reuse::light_mix::{self, LightMix, LightMixes, window_of};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, ranges};
use crate::base::digest::{Digest, Hasher};
use crate::components::Scene;
use crate::output::manifest::Manifest;
use crate::output::names::Target;
use crate::output::{FileState, Provenance, inspect};
use crate::systems;

/// One wanted frame.
#[derive(Clone, Debug)]
pub struct PlannedFrame {
    /// Its number, from 1.
    pub frame: u32,
    /// Where it goes.
    pub file: PathBuf,
    /// The frame as data, or its mistakes.
    pub fingerprint: Result<Fingerprint, Diagnostics>,
    /// Digest of all that decides its pixels.
    pub hash: Digest,
    /// What differs from the wanted frame before; `None` for the first, and behind a mistake.
    pub changes: Option<Vec<FramePart>>,
    /// The light groups that the frame is a sum of, if only colours of emitters change in a part of the sequence.
    pub light_mix: Option<Arc<LightMix>>,
    /// The first frame of the plan with the same pixels, if it is another one.
    pub twin: Option<u32>,
    /// What rendering is expected to take from frames before it.
    pub reuse: PlannedReuse,
    /// What is found under its name.
    pub state: FileState,
    /// The hash of the whole frame, if this is a tile of one.
    pub whole: Option<Digest>,
}

/// Where the work for a frame is from, as far as a plan can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlannedReuse {
    /// It is traced.
    None,
    /// A frame with the same pixels.
    Copy,
    /// Light groups of a frame that differs in colours of emitters alone.
    LightGroups,
    /// Tiles of the frame before, where they cannot have changed.
    Tiles,
    /// Photons of the frame before, which sees the same scene otherwise.
    PhotonMaps,
}

impl PlannedReuse {
    /// The word for it in reports.
    pub fn word(self) -> &'static str {
        match self {
            PlannedReuse::None => "none",
            PlannedReuse::Copy => "copy",
            PlannedReuse::LightGroups => "passes",
            PlannedReuse::Tiles => "tiles",
            PlannedReuse::PhotonMaps => "photons",
        }
    }
}

impl PlannedFrame {
    /// What its file says of it.
    pub fn provenance(&self, source: &str) -> Provenance {
        Provenance { source: source.to_string(), frame: self.frame, hash: self.hash }
    }

    /// What it costs beside the other frames. How many tiles will be kept nobody knows before, nor what share photons are of the
    /// whole.
    pub fn cost(&self) -> f64 {
        match (&self.fingerprint, self.reuse) {
            (Ok(fingerprint), PlannedReuse::None | PlannedReuse::Tiles | PlannedReuse::PhotonMaps) => fingerprint.cost,
            (Ok(_), PlannedReuse::Copy | PlannedReuse::LightGroups) | (Err(_), _) => 0.0,
        }
    }
}

/// The wanted frames in their order.
pub struct Plan {
    /// The frames, in the order in which they were asked for.
    pub frames: Vec<PlannedFrame>,
    /// Where pictures go.
    pub target: Target,
    /// Of the folder that the frames of a sequence go to.
    pub manifest: Option<Manifest>,
}

fn interrupted() -> Diagnostics {
    let message = "interrupted while the frames were evaluated; nothing is written";
    Diagnostic::error(message).because(Cause::Interrupted).into()
}

/// So many frames, spread over the sequence, are tried before the others.
const TRIED: usize = 8;
/// When all that were tried are wrong, and all the others would take longer than this at their pace, the others are not
/// waited for: they are as endless, most likely.
const PATIENCE: Duration = Duration::from_secs(5);
/// Entities that may be held once more for each further thread.
const COPIED_ENTITIES: usize = 1_000_000;

/// Evaluates frames; mistakes stay with their frames.
///
/// # Errors
/// The mistakes of the first frame, if all frames have some.
pub fn make(shot: &mut Shot, wanted: &[u32], target: Target) -> Result<Plan, Diagnostics> {
    make_until(shot, wanted, target, &AtomicBool::new(false))
}

/// As [`make`], until `cancel` is raised.
///
/// # Errors
/// As [`make`]; the interruption.
pub fn make_until(shot: &mut Shot, wanted: &[u32], target: Target, cancel: &AtomicBool) -> Result<Plan, Diagnostics> {
    let fingerprints = evaluate(shot, wanted, Some(&target), cancel);
    if cancel.load(Ordering::Relaxed) {
        return Err(interrupted());
    }
    let fingerprints = fingerprints?;
    let light_mixes = light_mixes_of(shot, wanted, &fingerprints, cancel);
    if cancel.load(Ordering::Relaxed) {
        return Err(interrupted());
    }
    let mut before = None;
    let mut frames: Vec<PlannedFrame> = Vec::with_capacity(wanted.len());
    for (frame, fingerprint) in wanted.iter().zip(fingerprints) {
        let now = fingerprint.as_ref().ok().cloned();
        let changes =
            now.as_ref().zip(before.as_ref()).map(|(now, before): (&Fingerprint, &Fingerprint)| now.changes(before));
        let of_window = light_mixes.get(&window_of(*frame));
        let light_mix = now.as_ref().filter(|now| now.is_sum).zip(of_window);
        let light_mix = light_mix.and_then(|(now, mixes)| mixes.get(&now.hash_without_colors())).cloned();
        let hash =
            now.as_ref().map(|now| light_mix.as_ref().map_or_else(|| now.hash(), |light_mix| light_mix.hash_of(now)));
        let hash = hash.unwrap_or_default();
        before = now;
        let file = target.path(*frame);
        frames.push(PlannedFrame {
            frame: *frame,
            file,
            fingerprint,
            hash,
            changes,
            light_mix,
            twin: None,
            reuse: PlannedReuse::None,
            state: FileState::Missing,
            whole: None,
        });
    }
    find_shared_work(&mut frames);
    let input = shot.input_path();
    let manifest = target.manifest_folder().map(|folder| Manifest::read(&folder, &input));
    Ok(Plan { frames, target, manifest })
}

impl Plan {
    /// What each frame costs, alone and behind the one that it shares work with, whatever is there already.
    pub fn costs(&self) -> Vec<FrameCost> {
        let mut known: FxHashMap<Digest, usize> = FxHashMap::default();
        let mut last: Option<(usize, &Fingerprint)> = None;
        let mut costs = Vec::with_capacity(self.frames.len());
        for (i, planned) in self.frames.iter().enumerate() {
            let Ok(fingerprint) = &planned.fingerprint else {
                costs.push(FrameCost { alone: WRITING, shared: WRITING, with: None });
                continue;
            };
            let alone = fingerprint.cost + WRITING;
            let twin = known.insert(planned.hash, i);
            let mix = planned.light_mix.as_ref().and_then(|mix| known.insert(mix.hash, i));
            let before = last.filter(|_| planned.light_mix.is_none());
            let (shared, with) = match (twin.or(mix), before) {
                (Some(with), _) => (WRITING, Some(with)),
                (None, Some((with, other))) if other.differs_in_objects_only(fingerprint) => {
                    (TRACED_OF_TILES * fingerprint.cost + WRITING, Some(with))
                }
                (None, Some((with, other))) if other.shares_photons_with(fingerprint) => {
                    (TRACED_OF_PHOTONS * fingerprint.cost + WRITING, Some(with))
                }
                (None, _) => (alone, None),
            };
            costs.push(FrameCost { alone, shared, with });
            last = planned.light_mix.is_none().then_some((i, fingerprint));
        }
        costs
    }

    /// The frames in `parts` of about the same cost that follow each other.
    ///
    /// It depends on the plan alone, not on what is there already: as many processes agree on it.
    pub fn chunks(&self, parts: u32) -> Chunks {
        chunks::split(&self.costs(), parts as usize)
    }

    /// Keeps the i-th of n parts of [`Self::chunks`].
    pub fn keep_shard(&mut self, i: u32, n: u32) {
        let range = self.chunks(n).ranges[i as usize - 1].clone();
        self.frames.truncate(range.end);
        self.frames.drain(..range.start);
        find_shared_work(&mut self.frames);
    }

    /// Digest of what all frames are to be, with the version of the program in it: who has the same plan makes the same
    /// frames.
    pub fn digest(&self) -> Digest {
        let mut hasher = Hasher::default();
        for planned in &self.frames {
            hasher.word(u64::from(planned.frame));
            hasher.digest(planned.hash);
        }
        hasher.finish()
    }

    /// Keeps the frames with these numbers.
    pub fn keep(&mut self, numbers: &[u32]) {
        self.frames.retain(|planned| numbers.contains(&planned.frame));
        find_shared_work(&mut self.frames);
    }

    /// Looks at what is there under the names of the frames.
    pub fn inspect(&mut self, source: &str) {
        let manifest = self.manifest.as_ref();
        self.frames.par_iter_mut().filter(|planned| planned.fingerprint.is_ok()).for_each(|planned| {
            let known = manifest.and_then(|manifest| manifest.get(&planned.file));
            let input = manifest.map_or("", Manifest::input);
            planned.state = inspect(&planned.file, known, &planned.provenance(source), input);
        });
        find_shared_work(&mut self.frames);
    }

    /// What is there under the name of one frame, by its place in the plan.
    pub fn state_of(&self, place: usize, source: &str) -> FileState {
        let planned = &self.frames[place];
        let known = self.manifest.as_ref().and_then(|manifest| manifest.get(&planned.file));
        let input = self.manifest.as_ref().map_or("", Manifest::input);
        inspect(&planned.file, known, &planned.provenance(source), input)
    }

    /// Files in the way that are no pictures of this script or scene.
    pub fn foreign(&self) -> Vec<&Path> {
        let foreign = self.frames.iter().filter(|planned| planned.state == FileState::Foreign);
        foreign.map(|planned| planned.file.as_path()).filter(|file| file.is_file()).collect()
    }

    /// Nothing that is there counts as done.
    pub fn force(&mut self) {
        self.frames.iter_mut().for_each(|planned| planned.state = FileState::Missing);
        find_shared_work(&mut self.frames);
    }

    /// The mistakes, for people.
    pub fn summary(&self) -> Diagnostics {
        summary(self.mistakes(), self.frames.len(), "have mistakes")
    }

    /// Frames with mistakes, with their numbers.
    pub fn mistakes(&self) -> impl Iterator<Item = (u32, &Diagnostics)> {
        self.frames.iter().filter_map(|planned| Some((planned.frame, planned.fingerprint.as_ref().err()?)))
    }

    /// The folder of the frames, or that of the one picture.
    pub fn folder(&self) -> PathBuf {
        let first = self.frames.first().map_or(Path::new(""), |planned| &planned.file);
        self.target.folder().unwrap_or_else(|| crate::output::folder_of(first).to_path_buf())
    }
}

/// What a frame costs that is not traced.
const WRITING: f64 = 0.1;
/// The share of a frame's samples that are traced where tiles of the frame before are kept: nobody knows it before, and
/// from a ball that crosses a scene to a crowd in it it goes from a tenth to nearly all.
const TRACED_OF_TILES: f64 = 0.5;
/// The share of a frame's work that is left where its photons are there already.
const TRACED_OF_PHOTONS: f64 = 0.6;

/// Finds out what frames can take from each other. Frames that are done are not rendered, so nothing is kept of them.
fn find_shared_work(frames: &mut [PlannedFrame]) {
    let mut first: FxHashMap<Digest, u32> = FxHashMap::default();
    let mut light_mixes: FxHashSet<Digest> = FxHashSet::default();
    let mut before: Option<Fingerprint> = None;
    for planned in frames.iter_mut() {
        let Ok(fingerprint) = &planned.fingerprint else { continue };
        let known = *first.entry(planned.hash).or_insert(planned.frame);
        planned.twin = (known != planned.frame).then_some(known);
        if planned.state == FileState::Done {
            continue;
        }
        planned.reuse = match &planned.light_mix {
            _ if planned.twin.is_some() => PlannedReuse::Copy,
            Some(light_mix) if !light_mixes.insert(light_mix.hash) => PlannedReuse::LightGroups,
            None if before.as_ref().is_some_and(|before| before.differs_in_objects_only(fingerprint)) => {
                PlannedReuse::Tiles
            }
            None if before.as_ref().is_some_and(|before| before.shares_photons_with(fingerprint)) => {
                PlannedReuse::PhotonMaps
            }
            _ => PlannedReuse::None,
        };
        before = planned.light_mix.is_none().then(|| fingerprint.clone());
    }
}

/// The light mixes of all windows with wanted frames in them, whatever part of a window is wanted; none of windows of
/// which no wanted frame could belong to one.
fn light_mixes_of(
    shot: &Shot,
    wanted: &[u32],
    fingerprints: &[Result<Fingerprint, Diagnostics>],
    cancel: &AtomicBool,
) -> FxHashMap<u32, LightMixes> {
    let mut windows: BTreeMap<u32, FxHashMap<u32, &Fingerprint>> = BTreeMap::new();
    for (frame, fingerprint) in wanted.iter().zip(fingerprints) {
        if let Ok(fingerprint) = fingerprint {
            windows.entry(window_of(*frame)).or_default().insert(*frame, fingerprint);
        }
    }
    if shot.frames() < 2 {
        return FxHashMap::default();
    }
    windows.retain(|_, known| known.values().any(|fingerprint| fingerprint.is_sum));
    let of_window = |(window, known): (u32, FxHashMap<u32, &Fingerprint>)| {
        let frames = light_mix::frames_of(window, shot.frames());
        let missing: Vec<u32> = frames.filter(|frame| !known.contains_key(frame)).collect();
        let others: Vec<Fingerprint> = missing
            .par_iter()
            .filter(|_| !cancel.load(Ordering::Relaxed))
            .filter_map(|frame| shot.input.fingerprint(*frame))
            .collect();
        (window, light_mix::find(&shot.input.base, known.into_values().chain(&others)))
    };
    windows.into_iter().map(of_window).collect()
}

/// Sees to it that every one of these frames can be rendered; gives them as data.
///
/// # Errors
/// The mistakes of the first frame that has any.
pub fn check(shot: &mut Shot, frames: &[u32]) -> Result<Vec<Fingerprint>, Diagnostics> {
    evaluate(shot, frames, None, &AtomicBool::new(false))?.into_iter().collect()
}

fn evaluate(
    shot: &mut Shot,
    wanted: &[u32],
    target: Option<&Target>,
    cancel: &AtomicBool,
) -> Result<Vec<Result<Fingerprint, Diagnostics>>, Diagnostics> {
    if let Some(folder) = target.and_then(Target::folder) {
        checkpoints::load(&shot.input, &folder, wanted);
    }
    let start = Instant::now();
    let spread = |i: usize| wanted[i * (wanted.len() - 1) / (TRIED - 1)];
    let tried: Vec<u32> = if wanted.len() > TRIED { (0..TRIED).map(spread).collect() } else { wanted.to_vec() };
    let mut known: FxHashMap<u32, Result<Fingerprint, Diagnostics>> = FxHashMap::default();
    for frame in tried {
        if cancel.load(Ordering::Relaxed) {
            return Err(interrupted());
        }
        known.insert(frame, shot.input.evaluate(&mut shot.stage, frame, target));
        let pace = start.elapsed().as_secs_f64() / known.len() as f64;
        let is_slow = pace * wanted.len() as f64 > PATIENCE.as_secs_f64();
        if (known.len() == TRIED || pace > 1.0) && is_slow && known.values().all(Result::is_err) {
            return Err(known.remove(&wanted[0]).and_then(Result::err).unwrap_or_default());
        }
    }
    let mut fingerprints = rest_of(shot, wanted, known, target, cancel);
    if !fingerprints.is_empty() && fingerprints.iter().all(Result::is_err) {
        return Err(fingerprints.swap_remove(0).err().unwrap_or_default());
    }
    Ok(fingerprints)
}

/// Evaluates what is not known yet, on all threads if it is much.
fn rest_of(
    shot: &mut Shot,
    wanted: &[u32],
    known: FxHashMap<u32, Result<Fingerprint, Diagnostics>>,
    target: Option<&Target>,
    cancel: &AtomicBool,
) -> Vec<Result<Fingerprint, Diagnostics>> {
    let Shot { stage, input, .. } = shot;
    let one = |stage: &mut systems::Stage, frame: &u32| match known.get(frame) {
        Some(fingerprint) => fingerprint.clone(),
        None if cancel.load(Ordering::Relaxed) => Err(interrupted()),
        None => input.evaluate(stage, *frame, target),
    };
    let copies = COPIED_ENTITIES / (stage.entity_count() + 1) + 1;
    let workers = rayon::current_num_threads().min(wanted.len() / 32).min(copies);
    let Some((_, scene)) = input.program.as_ref().filter(|_| workers > 1) else {
        return wanted.iter().map(|frame| one(stage, frame)).collect();
    };
    let part = |frames: &[u32]| match systems::spawn(Scene::clone(scene)) {
        Ok(mut copy) => frames.iter().map(|frame| one(&mut copy, frame)).collect::<Vec<_>>(),
        Err(problems) => frames.iter().map(|_| Err(problems.clone())).collect(),
    };
    let parts: Vec<_> = wanted.par_chunks(wanted.len().div_ceil(workers)).map(part).collect();
    parts.into_iter().flatten().collect()
}

/// What is wrong with some frames of a plan, for people: the first few problems, each once, then how many frames there
/// are and that they `did` so.
pub fn summary<'a>(wrong: impl Iterator<Item = (u32, &'a Diagnostics)>, total: usize, did: &str) -> Diagnostics {
    let mut shown = Diagnostics::default();
    let mut numbers = Vec::new();
    for (frame, problems) in wrong {
        if numbers.len() < SHOWN {
            let new: Vec<Diagnostic> = problems.0.iter().filter(|one| !shown.0.contains(one)).cloned().collect();
            shown.0.extend(new);
        }
        numbers.push(frame);
    }
    if numbers.len() > SHOWN {
        let more = format!("{} of {total} frames {did}: {}", numbers.len(), ranges(&numbers));
        shown.push(Diagnostic::error(more));
    }
    shown
}

/// Frames of which the problems are shown.
const SHOWN: usize = 3;
