//! One worker of several on one folder: it claims frames, renders them, and helps others when its own are done.
//!
//! Frames are taken in units: one frame, or a row that shares work, as long as it is not so dear that it would keep the
//! others waiting. First those of the worker's own part of the sequence; then whatever nobody has claimed of the other
//! parts, or what a worker has left that is gone. Dear units come before cheap ones, in both: what is begun last is then
//! soon done, so that nobody waits long for a slow machine. A frame with the same pixels as another one waits for it and
//! is copied. The worker ends when its own frames are there; it waits for those that others have in hand.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rustc_hash::FxHashMap;

use super::now;
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::output::FileState;
use crate::output::claims::{Claim, Claims, Lease, WorkerEvent, WorkerHeader};
use crate::output::names::Target;
use crate::shot::Shot;
use crate::shot::chunks::{self, FrameCost};
use crate::shot::plan::Plan;
use crate::shot::run::{Batch, Event, FrameSource};

/// Workers that are reckoned with where nobody says how many there are.
const USUAL_WORKERS: usize = 8;
/// A unit is at most such a part of what one worker has to do: what is left over at the end is then small beside it.
const UNITS_OF_A_WORKER: usize = 16;
/// How often is looked whether frames of others are done.
const POLL: Duration = Duration::from_millis(250);
/// How long a frame counts as held by who held it, as long as there is other work.
const HELD_FOR: Duration = Duration::from_secs(5);

/// What is known of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FrameProgress {
    /// Nobody has finished it, as far as is known.
    Open,
    /// This worker has it in hand.
    InHand,
    Done,
    /// This worker could not render it, or it has mistakes.
    Failed,
}

/// What threads of a worker know together.
struct SharedState {
    claims: Claims,
    progress: Vec<FrameProgress>,
    /// When places were last seen to be in the hands of others.
    held: FxHashMap<usize, Instant>,
    /// Places in the plan by frame number.
    places: FxHashMap<u32, usize>,
    costs: Vec<f64>,
}

/// The work of one worker.
pub struct SharedWork<'a> {
    plan: &'a Plan,
    source: String,
    /// Places in the plan, in the order in which they are tried.
    units: Vec<Range<usize>>,
    /// The places that this worker answers for.
    own: Range<usize>,
    state: Mutex<SharedState>,
}

/// Frames that one worker takes together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkUnit {
    /// Their places in the plan.
    pub places: Range<usize>,
    /// How dear it is, in powers of two: units that cost about the same keep the order of their frames.
    pub level: i32,
}

/// Units of a range of frames: rows that share work, cut where they cost more than `most`.
pub fn units(frames: &[FrameCost], range: Range<usize>, most: f64) -> Vec<WorkUnit> {
    let joins = |at: usize| {
        let with = frames[at].with.filter(|with| *with >= range.start);
        with.is_some_and(|with| at - with <= limits::REUSE_WINDOW_FRAMES)
    };
    let mut rows: Vec<Range<usize>> = Vec::new();
    for at in range.clone() {
        match rows.last_mut() {
            Some(row) if joins(at) => row.end = at + 1,
            _ => rows.push(at..at + 1),
        }
    }
    let cut = |row: Range<usize>| {
        let inside: Vec<FrameCost> = frames[row.clone()]
            .iter()
            .map(|frame| FrameCost { with: frame.with.and_then(|with| with.checked_sub(row.start)), ..*frame })
            .collect();
        let cost = chunks::split(&inside, 1).whole;
        let parts = if most > 0.0 { (cost / most).ceil().clamp(1.0, row.len() as f64) as usize } else { 1 };
        let pieces = chunks::split(&inside, parts);
        // All pieces of a row are of one level, so that who makes them one after another keeps what they share.
        let level = libm::ilogb(pieces.longest());
        let pieces = pieces.ranges.into_iter().filter(|piece| !piece.is_empty());
        let unit =
            move |piece: Range<usize>| WorkUnit { places: row.start + piece.start..row.start + piece.end, level };
        pieces.map(unit).collect::<Vec<_>>()
    };
    rows.into_iter().flat_map(cut).collect()
}

/// The order in which the worker of a part tries the units of all parts: its own ones, then those of the others from the
/// part behind it on; the dear ones first.
pub fn order(parts: &[Vec<WorkUnit>], mine: usize) -> Vec<Range<usize>> {
    let (before, behind) = parts.split_at(mine.min(parts.len()));
    let (own, behind) = behind.split_first().map_or((&[][..], behind), |(own, behind)| (own.as_slice(), behind));
    let dear_first = |units: &mut Vec<&WorkUnit>| units.sort_by_key(|unit| std::cmp::Reverse(unit.level));
    let mut own: Vec<&WorkUnit> = own.iter().collect();
    let mut others: Vec<&WorkUnit> = behind.iter().chain(before).flatten().collect();
    dear_first(&mut own);
    dear_first(&mut others);
    own.into_iter().chain(others).map(|unit| unit.places.clone()).collect()
}

impl<'a> SharedWork<'a> {
    /// Joins the workers on the folder of a plan that has looked at what is there; `shard` is the own part of all, from 1.
    ///
    /// # Errors
    /// The frames go to no folder; it cannot be written to.
    pub fn join(
        plan: &'a Plan,
        shot: &Shot,
        shard: Option<[u32; 2]>,
        lease: Lease,
    ) -> Result<SharedWork<'a>, Diagnostics> {
        let Target::Pattern { before, digits, after } = &plan.target else {
            let message = "claims are for frames of a sequence in a folder, and this is one picture";
            return Err(Diagnostic::error(message).because(crate::base::diagnostics::Cause::Usage).into());
        };
        let costs = plan.costs();
        let parts = shard.map_or(1, |[_, n]| n as usize);
        let ranges = chunks::split(&costs, parts);
        let mine = shard.map_or(0, |[i, _]| i as usize - 1);
        let own = ranges.ranges[mine].clone();
        let workers = if parts > 1 { parts } else { USUAL_WORKERS };
        let most = ranges.whole / (workers * UNITS_OF_A_WORKER) as f64;
        let of_parts: Vec<Vec<WorkUnit>> = ranges.ranges.iter().map(|part| units(&costs, part.clone(), most)).collect();
        let units = order(&of_parts, mine);
        let numbers: Vec<u32> = plan.frames.iter().map(|planned| planned.frame).collect();
        let folder = plan.folder();
        let shown = before.rsplit(std::path::is_separator).next().unwrap_or_default();
        let header = WorkerHeader {
            since: now(),
            input: shot.input_path(),
            plan: plan.digest().to_string(),
            pattern: format!("{shown}{}{after}", "#".repeat(*digits)),
            frames: super::frame_list(&numbers),
            cost: ranges.whole,
            ..WorkerHeader::default()
        };
        let progress = plan.frames.iter().map(|planned| match (&planned.fingerprint, planned.state) {
            (Err(_), _) => FrameProgress::Failed,
            (Ok(_), FileState::Done) => FrameProgress::Done,
            (Ok(_), _) => FrameProgress::Open,
        });
        let state = SharedState {
            claims: Claims::join(&folder, header, lease)?,
            progress: progress.collect(),
            held: FxHashMap::default(),
            places: plan.frames.iter().enumerate().map(|(place, planned)| (planned.frame, place)).collect(),
            costs: costs.iter().map(|cost| cost.alone).collect(),
        };
        Ok(SharedWork { plan, source: shot.source.clone(), units, own, state: Mutex::new(state) })
    }

    fn lock(&self) -> MutexGuard<'_, SharedState> {
        // What a thread that fell over has left is as true as before.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next frames to render, with claims on them; `None` when this worker is done, or `cancel` is raised.
    ///
    /// # Errors
    /// Claims cannot be made.
    pub fn next(&self, cancel: &AtomicBool) -> Result<Option<Batch<'a>>, Diagnostics> {
        while !cancel.load(Ordering::Relaxed) {
            // Whatever others had in hand a moment ago is asked for again only when there is nothing else: each question
            // is a file on a shared disk.
            for asks_again in [false, true] {
                for unit in &self.units {
                    if let Some(batch) = self.claim(unit.clone(), asks_again)? {
                        return Ok(Some(batch));
                    }
                }
            }
            let is_open = |place: usize, state: &SharedState| matches!(state.progress[place], FrameProgress::Open);
            let state = self.lock();
            if !self.own.clone().any(|place| is_open(place, &state)) {
                return Ok(None);
            }
            drop(state);
            std::thread::sleep(POLL);
        }
        Ok(None)
    }

    /// Claims what is open in a unit; `None` if that is nothing. `asks_again` for what others held a moment ago, too.
    fn claim(&self, unit: Range<usize>, asks_again: bool) -> Result<Option<Batch<'a>>, Diagnostics> {
        let mut state = self.lock();
        let mut frames = Vec::new();
        let mut done = Vec::new();
        for place in unit.filter(|place| state.progress[*place] == FrameProgress::Open).collect::<Vec<_>>() {
            let planned = &self.plan.frames[place];
            let twin = planned.twin.and_then(|frame| state.places.get(&frame).copied());
            let twin_state = twin.map(|twin| state.progress[twin]);
            let is_with_us = |twin: usize| frames.iter().any(|(taken, _)| *taken == twin);
            let waits = matches!(twin_state, Some(FrameProgress::Open | FrameProgress::InHand))
                && !twin.is_some_and(is_with_us);
            let is_asked = asks_again || state.held.get(&place).is_none_or(|seen| seen.elapsed() >= HELD_FOR);
            if waits || !is_asked {
                continue;
            }
            if state.claims.take(planned.frame)? != Claim::Taken {
                state.held.insert(place, Instant::now());
                continue;
            }
            // Only who holds it knows what is there: others may have finished it a moment ago.
            let found = self.plan.state_of(place, &self.source);
            if found == FileState::Done {
                state.progress[place] = FrameProgress::Done;
                state.claims.release(planned.frame);
                continue;
            }
            state.progress[place] = FrameProgress::InHand;
            if let Some(twin) = twin.filter(|_| twin_state == Some(FrameProgress::Done)) {
                done.push((planned.hash, self.plan.frames[twin].file.clone()));
            }
            let mut planned = planned.clone();
            planned.state = found;
            frames.push((place, planned));
        }
        let frames: Vec<_> = frames.into_iter().map(|(_, planned)| planned).collect();
        Ok((!frames.is_empty()).then_some(Batch { frames: Cow::Owned(frames), done }))
    }

    /// Hears what happens to frames.
    pub fn hear(&self, event: &Event) {
        let mut state = self.lock();
        let (frame, progress, note) = match event {
            Event::Tiles { .. } => return,
            Event::Written(report) if report.reused == FrameSource::Cache => return,
            Event::Written(report) => {
                let cost = state.places.get(&report.frame).map_or(0.0, |place| state.costs[*place]);
                let cost = if report.reused == FrameSource::None { cost } else { 0.0 };
                let (frame, seconds) = (report.frame, report.total_seconds);
                (frame, FrameProgress::Done, WorkerEvent::Done { frame, at: now(), seconds, cost })
            }
            Event::Failed(failed) => {
                let (frame, problems) = &**failed;
                let why = problems.0.first().map_or_else(String::new, |problem| problem.message.clone());
                (*frame, FrameProgress::Failed, WorkerEvent::Failed { frame: *frame, at: now(), why })
            }
        };
        if let Some(place) = state.places.get(&frame).copied() {
            state.progress[place] = progress;
        }
        state.claims.note(&note);
        state.claims.release(frame);
    }

    /// Says that this worker is alive, until `ended` is raised.
    pub fn beat_until(&self, ended: &AtomicBool) {
        let lease = self.lock().claims.lease();
        let mut last = Instant::now();
        while !ended.load(Ordering::Relaxed) {
            std::thread::sleep(POLL.min(lease.beat));
            if last.elapsed() >= lease.beat {
                last = Instant::now();
                self.lock().claims.note(&WorkerEvent::Beat { at: now() });
            }
        }
    }

    /// Frames of this worker's own part that are there.
    pub fn own_done(&self) -> usize {
        let state = self.lock();
        self.own.clone().filter(|place| state.progress[*place] == FrameProgress::Done).count()
    }

    /// Leaves the others: `how` it ended is `done`, `failed` or `interrupted`.
    pub fn leave(self, how: &str) {
        let mut state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let SharedState { claims, progress, places, .. } = &mut state;
        let is_done = |frame: u32| places.get(&frame).is_some_and(|place| progress[*place] == FrameProgress::Done);
        claims.tidy(&is_done);
        claims.end(now(), how);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_share_are_one_unit_unless_they_are_long() {
        let alone = FrameCost { alone: 1.0, shared: 1.0, with: None };
        let shares = |with: usize| FrameCost { alone: 1.0, shared: 0.1, with: Some(with) };
        let frames = [alone, alone, shares(1), shares(2), alone, shares(4)];
        let places = |units: Vec<WorkUnit>| units.into_iter().map(|unit| unit.places).collect::<Vec<_>>();
        assert_eq!(places(units(&frames, 0..6, 9.0)), vec![0..1, 1..4, 4..6]);
        assert_eq!(places(units(&frames, 2..6, 9.0)), vec![2..4, 4..6]);
        let row: Vec<FrameCost> =
            (0..40).map(|i| if i == 0 { alone } else { FrameCost { shared: 0.9, ..shares(i - 1) } }).collect();
        assert_eq!(units(&row, 0..40, 9.2).len(), 4);
        // To begin again would cost more than others could save.
        let row: Vec<FrameCost> =
            (0..40).map(|i| if i == 0 { alone } else { FrameCost { shared: 0.001, ..shares(i - 1) } }).collect();
        assert_eq!(places(units(&row, 0..40, 0.6)), vec![0..40]);
    }

    #[test]
    fn a_worker_tries_its_own_part_and_then_the_dearest_that_is_left() {
        let unit = |first: usize, level: i32| WorkUnit { places: first..first + 1, level };
        let parts = [vec![unit(0, 3), unit(1, 9)], vec![unit(2, 1), unit(3, 2)], vec![unit(4, 3), unit(5, 4)]];
        let tried = |mine: usize| order(&parts, mine).into_iter().map(|places| places.start).collect::<Vec<_>>();
        assert_eq!(tried(1), [3, 2, 1, 5, 4, 0]);
        assert_eq!(tried(2), [5, 4, 1, 0, 3, 2]);
        assert_eq!(tried(3), [1, 5, 0, 4, 3, 2]);
        // About the same cost: in the order of frames.
        let alike: Vec<FrameCost> =
            [4.0, 5.0, 4.1, 7.9, 8.0].map(|alone| FrameCost { alone, shared: alone, with: None }).to_vec();
        let one = order(&[units(&alike, 0..5, 9.0)], 0);
        assert_eq!(one.into_iter().map(|places| places.start).collect::<Vec<_>>(), [4, 0, 1, 2, 3]);
    }
}
