//! What a folder of frames has and lacks, from its manifest and the records of workers alone: neither script nor scene is
//! needed, and nothing is rendered.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::now;
use crate::base::digest::Digest;
use crate::base::{files, limits};
use crate::output::claims::{self, WorkerEvent, WorkerHeader, WorkerRecord};
use crate::output::manifest::{Entry, Manifest};

/// A worker, and how fast it is.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkerStatus {
    /// What it said of itself at first.
    pub header: WorkerHeader,
    /// `working`, `silent` (nothing was heard for longer than its lease), `gone`, or how it ended: `done`, `failed`,
    /// `interrupted`.
    pub state: String,
    /// Frames that it rendered.
    pub done: usize,
    /// Frames that it has in hand.
    pub in_hand: Vec<u32>,
    /// Seconds since it was heard of, by this machine's clock and its own.
    pub silent_seconds: f64,
    /// Frames a minute since it began.
    pub frames_per_minute: f64,
}

/// A frame that could not be rendered, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FailedStatus {
    /// Its number.
    pub frame: u32,
    /// Who tried it.
    pub worker: String,
    /// The message that it ended with.
    pub why: String,
}

/// What is known of a folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FolderStatus {
    /// The script or scene, if it is known.
    pub input: Option<String>,
    /// How many frames are wanted; what workers say, or else all up to the highest number that is there.
    pub wanted: usize,
    /// Whether workers said so.
    pub is_known: bool,
    /// Numbers of whole frames, ascending.
    pub done: Vec<u32>,
    /// Frames whose files are not those that the manifest speaks of; only looked for on demand.
    pub damaged: Vec<u32>,
    /// Numbers of frames in hand, each with the worker that has it.
    pub running: BTreeMap<u32, String>,
    /// In the order of their numbers.
    pub failed: Vec<FailedStatus>,
    /// Numbers of wanted frames that nobody has or has made, ascending.
    pub missing: Vec<u32>,
    /// All that left a record in the folder.
    pub workers: Vec<WorkerStatus>,
    /// Frames that two workers have rendered, though one would have been enough.
    pub twice: Vec<u32>,
    /// Seconds until all is done, if those who work go on as they did.
    pub seconds_left: Option<f64>,
}

impl FolderStatus {
    /// Whether every wanted frame is there.
    pub fn is_done(&self) -> bool {
        self.done.len() == self.wanted
    }
}

/// Looks at a folder. `verify` reads every file and compares it with its checksum.
pub fn look(folder: &Path, verify: bool) -> FolderStatus {
    let manifest = Manifest::peek(folder);
    let claims_folder = folder.join(claims::FOLDER);
    let mut records = claims::workers_in(&claims_folder);
    // Workers on another plan, as of before an edit, say nothing of this one.
    let newest = records.iter().max_by(|a, b| a.header.since.total_cmp(&b.header.since));
    let newest = newest.map(|record| record.header.clone());
    records.retain(|record| newest.as_ref().is_some_and(|header| header.plan == record.header.plan));
    let entries: BTreeMap<u32, &Entry> = manifest
        .entries()
        .filter(|entry| newest.as_ref().is_none_or(|header| !entry.is_of_another(&header.input)))
        .map(|entry| (entry.provenance.frame, entry))
        .collect();
    let last = entries.keys().next_back().copied().unwrap_or(0);
    let wanted: BTreeSet<u32> = match &newest {
        Some(header) => numbers_of(&header.frames),
        None => (1..=last).collect(),
    };
    let here: Vec<(u32, bool)> = wanted
        .iter()
        .filter_map(|frame| Some((*frame, *entries.get(frame)?)))
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter_map(|(frame, entry)| Some((frame, is_whole(&folder.join(&entry.file), entry, verify)?)))
        .collect();
    let mut status = FolderStatus {
        input: newest.as_ref().map(|header| header.input.clone()),
        wanted: wanted.len(),
        is_known: newest.is_some(),
        done: here.iter().filter(|(_, whole)| *whole).map(|(frame, _)| *frame).collect(),
        damaged: here.iter().filter(|(_, whole)| !whole).map(|(frame, _)| *frame).collect(),
        ..FolderStatus::default()
    };
    add_workers(&mut status, &claims_folder, &records);
    let done: BTreeSet<u32> = status.done.iter().copied().collect();
    status.failed = failures(&records, &done);
    let is_listed = |frame: &u32| {
        done.contains(frame) || status.running.contains_key(frame) || status.failed.iter().any(|f| f.frame == *frame)
    };
    status.missing = wanted.iter().copied().filter(|frame| !is_listed(frame)).collect();
    status.seconds_left = estimate(&status);
    status
}

/// Whether a file is what the manifest says; `None` if there is none.
fn is_whole(path: &PathBuf, entry: &Entry, verify: bool) -> Option<bool> {
    let length = std::fs::metadata(path).ok()?.len();
    let is_as_long = length == entry.bytes;
    let holds = || files::read_bytes(path, limits::FRAME_FILE_BYTES).is_ok_and(|b| Digest::of(&b) == entry.checksum);
    Some(is_as_long && (!verify || holds()))
}

fn add_workers(status: &mut FolderStatus, folder: &Path, records: &[WorkerRecord]) {
    let mut held: BTreeMap<u32, String> = BTreeMap::new();
    for (frame, _, owner) in claims::claims_in(folder) {
        // The highest number counts, and comes last.
        held.insert(frame, owner);
    }
    let mut makers: BTreeMap<u32, BTreeSet<&str>> = BTreeMap::new();
    for record in records {
        let WorkerRecord { header, events } = record;
        let heard = events.iter().map(time_of).fold(header.since, f64::max);
        let silent_seconds = (now() - heard).max(0.0);
        let lives = claims::lives_here(folder, header).unwrap_or(true);
        let state = match (record.ended(), lives) {
            (Some(how), _) => how,
            (None, false) => "gone",
            (None, true) if silent_seconds > limits::CLAIM_PATIENCE_SECONDS as f64 => "silent",
            (None, true) => "working",
        };
        let frames = events.iter().filter_map(|event| match event {
            WorkerEvent::Done { frame, .. } => Some(*frame),
            WorkerEvent::Failed { .. } | WorkerEvent::Beat { .. } | WorkerEvent::Ended { .. } => None,
        });
        let frames: Vec<u32> = frames.collect();
        for frame in &frames {
            makers.entry(*frame).or_default().insert(&header.worker);
        }
        let mine = held.iter().filter(|(_, owner)| **owner == header.worker).map(|(frame, _)| *frame);
        let in_hand: Vec<u32> = if state == "working" || state == "silent" { mine.collect() } else { Vec::new() };
        status.running.extend(in_hand.iter().map(|frame| (*frame, header.worker.clone())));
        let minutes = (if state == "working" { now() } else { heard } - header.since).max(0.001) / 60.0;
        status.workers.push(WorkerStatus {
            header: header.clone(),
            state: state.to_string(),
            done: frames.len(),
            in_hand,
            silent_seconds,
            frames_per_minute: frames.len() as f64 / minutes,
        });
    }
    status.twice = makers.into_iter().filter(|(_, makers)| makers.len() > 1).map(|(frame, _)| frame).collect();
    let done: BTreeSet<u32> = status.done.iter().copied().collect();
    status.running.retain(|frame, _| !done.contains(frame));
}

fn time_of(event: &WorkerEvent) -> f64 {
    match event {
        WorkerEvent::Done { at, .. }
        | WorkerEvent::Failed { at, .. }
        | WorkerEvent::Beat { at }
        | WorkerEvent::Ended { at, .. } => *at,
    }
}

fn failures(records: &[WorkerRecord], done: &BTreeSet<u32>) -> Vec<FailedStatus> {
    let mut failed = BTreeMap::new();
    for WorkerRecord { header, events } in records {
        for event in events {
            if let WorkerEvent::Failed { frame, why, .. } = event
                && !done.contains(frame)
            {
                let (frame, worker, why) = (*frame, header.worker.clone(), why.clone());
                failed.insert(frame, FailedStatus { frame, worker, why });
            }
        }
    }
    failed.into_values().collect()
}

/// What is left, at the pace of those who work.
fn estimate(status: &FolderStatus) -> Option<f64> {
    let working = status.workers.iter().filter(|worker| worker.state == "working");
    let pace: f64 = working.map(|worker| worker.frames_per_minute).sum();
    let left = status.wanted - status.done.len();
    (pace > 0.0 && left > 0).then(|| left as f64 / pace * 60.0)
}

/// The numbers of a list that [`super::frame_list`] wrote; what cannot be read of it is left out.
fn numbers_of(list: &str) -> BTreeSet<u32> {
    let mut numbers = BTreeSet::new();
    for part in list.split(',') {
        let (range, step) = part.split_once('x').unwrap_or((part, "1"));
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let (Ok(first), Ok(last), Ok(step)) = (first.parse::<u32>(), last.parse::<u32>(), step.parse::<usize>()) else {
            continue;
        };
        numbers.extend((first..=last.min(limits::FRAMES)).step_by(step.max(1)));
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::frame_list;
    use crate::output::claims::{Claims, Lease};

    #[test]
    fn lists_are_read_as_they_are_written() {
        for numbers in [vec![1, 2, 3, 9], vec![1, 3, 5, 7, 8, 9], vec![4], vec![]] {
            assert_eq!(numbers_of(&frame_list(&numbers)).into_iter().collect::<Vec<_>>(), numbers);
        }
        assert!(numbers_of("x,3-,-4,5x0").contains(&5));
    }

    #[test]
    fn a_folder_tells_what_it_lacks_and_who_is_at_work() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(look(folder.path(), false), FolderStatus::default());
        let manifest = Manifest::read(folder.path(), "show.rhai");
        let write = |frame: u32| {
            let file = folder.path().join(format!("show.{frame:04}.png"));
            let provenance = crate::output::Provenance { source: "show.rhai".into(), frame, hash: Digest(7) };
            manifest.add(&file, &provenance, b"picture").unwrap();
            std::fs::write(file, b"picture").unwrap();
        };
        [1, 2, 4].into_iter().for_each(write);
        let alone = look(folder.path(), false);
        assert_eq!((alone.wanted, alone.is_known, &alone.missing[..]), (4, false, &[3][..]));
        let header = |plan: &str| WorkerHeader {
            frames: "1-8".into(),
            plan: plan.into(),
            input: "show.rhai".into(),
            since: now() - 30.0,
            ..WorkerHeader::default()
        };
        let mut worker = Claims::join(folder.path(), header("a"), Lease::default()).unwrap();
        worker.take(5).unwrap();
        worker.note(&WorkerEvent::Done { frame: 4, at: now(), seconds: 2.0, cost: 1.0 });
        worker.note(&WorkerEvent::Failed { frame: 6, at: now(), why: "no such mesh".into() });
        let seen = look(folder.path(), true);
        assert_eq!((seen.wanted, seen.is_known, seen.done.len()), (8, true, 3));
        assert_eq!(seen.running.keys().copied().collect::<Vec<_>>(), [5]);
        assert_eq!(
            (seen.failed[0].frame, &*seen.failed[0].why, &seen.missing[..]),
            (6, "no such mesh", &[3, 7, 8][..])
        );
        assert!(seen.workers[0].state == "working" && seen.seconds_left.unwrap() > 60.0);
        // A worker that was killed holds nothing any more, and a painted picture is none of ours.
        drop(worker);
        std::fs::write(folder.path().join("show.0001.png"), b"painted").unwrap();
        let seen = look(folder.path(), true);
        assert_eq!((&*seen.workers[0].state, seen.running.len(), &seen.damaged[..]), ("gone", 0, &[1][..]));
    }
}
