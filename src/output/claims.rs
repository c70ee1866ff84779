//! Claims: which worker renders which frame of a folder that several share.
//!
//! ```text
//! .anim-claims/ID.worker      what a worker says of itself, a JSON line for each thing that happens; it grows while it lives
//! .anim-claims/ID.alive       held (locked) by the worker while it lives
//! .anim-claims/0000012.1      the first claim to frame 12: the ID of who holds it
//! .anim-claims/0000012.2      the second, made when the owner of the first was gone
//! ```
//!
//! A claim is a file that only one process can make: a hard link to a finished file, which shared file systems decide at
//! their server, or where there are no links, a file that is made if it is not there. A claim is never taken away from
//! its owner: who finds it gone makes the next one, which again only one can. The highest number counts.
//!
//! An owner is gone when its record has not grown for [`Lease::patience`] while it was watched, so that no two machines
//! need to agree on what time it is; or at once, if it lived on this machine and holds its lock no more.
//!
//! Claims save work and decide nothing else: without them, or where they fail, frames are the same to the byte.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use crate::base::diagnostics::Diagnostic;
use crate::base::{files, limits};

/// The folder of claims in a folder of frames.
pub const FOLDER: &str = ".anim-claims";
const RECORD: &str = ".worker";
const ALIVE: &str = ".alive";

/// How long an owner may be silent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lease {
    /// Between two signs of life.
    pub beat: Duration,
    /// Without a sign, as seen by whoever watches, until an owner counts as gone.
    pub patience: Duration,
}

impl Default for Lease {
    fn default() -> Self {
        let seconds = Duration::from_secs;
        Lease { beat: seconds(limits::CLAIM_BEAT_SECONDS), patience: seconds(limits::CLAIM_PATIENCE_SECONDS) }
    }
}

/// What a worker says of itself at first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorkerHeader {
    /// Its name, which no other has.
    pub worker: String,
    /// The machine's name.
    pub host: String,
    /// What tells this run of the machine from others.
    pub machine: String,
    /// The number of its process on that machine.
    pub pid: u32,
    /// Seconds since 1970, by the worker's own clock.
    pub since: f64,
    /// The script or scene, from the project's root.
    pub input: String,
    /// Digest of the plan.
    pub plan: String,
    /// Files of all wanted frames, by number, with `#` for it: `show.####.png`.
    pub pattern: String,
    /// The wanted frames, as `1-48`.
    pub frames: String,
    /// What they cost together.
    pub cost: f64,
}

/// What happened to a worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "event")]
pub enum WorkerEvent {
    /// It rendered a frame.
    Done {
        /// Its number.
        frame: u32,
        /// Seconds since 1970, by the worker's own clock.
        at: f64,
        /// What it took.
        seconds: f64,
        /// In the unit of the plan.
        cost: f64,
    },
    /// A frame cannot be rendered.
    Failed {
        /// Its number.
        frame: u32,
        /// Seconds since 1970, by the worker's own clock.
        at: f64,
        /// The message.
        why: String,
    },
    /// It is alive.
    Beat {
        /// Seconds since 1970, by the worker's own clock.
        at: f64,
    },
    /// It has come to an end.
    Ended {
        /// Seconds since 1970, by the worker's own clock.
        at: f64,
        /// `done`, `failed` or `interrupted`.
        how: String,
    },
}

/// A worker as its record tells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorkerRecord {
    /// What it said at first.
    pub header: WorkerHeader,
    /// What happened to it since, in order.
    pub events: Vec<WorkerEvent>,
}

impl WorkerRecord {
    /// How it ended, if it says so.
    pub fn ended(&self) -> Option<&str> {
        self.events.iter().rev().find_map(|event| match event {
            WorkerEvent::Ended { how, .. } => Some(how.as_str()),
            WorkerEvent::Done { .. } | WorkerEvent::Failed { .. } | WorkerEvent::Beat { .. } => None,
        })
    }
}

/// Whether a frame is somebody's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Claim {
    /// It is ours.
    Taken,
    /// It is this worker's, who is alive as far as is known.
    Held(String),
}

/// The claims of one worker on the frames of one folder.
pub struct Claims {
    folder: PathBuf,
    header: WorkerHeader,
    lease: Lease,
    record: File,
    alive: File,
    /// Length of the records of others, and when it was seen to be that.
    watched: FxHashMap<String, (u64, Instant)>,
    /// Number of the claim to each frame that is ours.
    mine: BTreeMap<u32, u32>,
}

/// What tells this machine, and this run of it, from others.
pub fn this_machine() -> (String, String) {
    let host = host_name();
    let boot = std::fs::read_to_string("/proc/sys/kernel/random/boot_id");
    let machine = boot.map_or_else(|_| host.clone(), |boot| boot.trim().to_string());
    (host, machine)
}

#[cfg(unix)]
fn host_name() -> String {
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}

#[cfg(not(unix))]
fn host_name() -> String {
    std::env::var("COMPUTERNAME").unwrap_or_else(|_| "unknown".into())
}

impl Claims {
    /// A new worker on a folder of frames, which is made if it is not there. `header` lacks a name and a machine.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn join(frames: &Path, header: WorkerHeader, lease: Lease) -> Result<Claims, Diagnostic> {
        let folder = frames.join(FOLDER);
        let shown = folder.display().to_string();
        let failed = |error: std::io::Error| Diagnostic::io(&shown, "write", &error);
        std::fs::create_dir_all(&folder).map_err(failed)?;
        let (host, machine) = this_machine();
        let pid = std::process::id();
        let plain: String = host.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '-' }).collect();
        let mut alive = tempfile::Builder::new();
        let alive = alive.prefix(&format!("{plain}-{pid}-")).suffix(ALIVE).tempfile_in(&folder).map_err(failed)?;
        // Where there are no locks the lease alone tells.
        let _ = alive.as_file().try_lock();
        let (alive, path) = alive.keep().map_err(|e| failed(e.error))?;
        let worker = path.file_name().unwrap_or_default().to_string_lossy().trim_end_matches(ALIVE).to_string();
        let header = WorkerHeader { worker, host, machine, pid, ..header };
        let path = folder.join(format!("{}{RECORD}", header.worker));
        let record = OpenOptions::new().append(true).create_new(true).open(path).map_err(failed)?;
        let claims =
            Claims { folder, header, lease, record, alive, watched: FxHashMap::default(), mine: BTreeMap::new() };
        claims.append(&claims.header).map_err(failed)?;
        claims.forget_other_plans();
        Ok(claims)
    }

    /// What this worker says of itself.
    pub fn header(&self) -> &WorkerHeader {
        &self.header
    }

    /// How long its claims hold without a sign of life.
    pub fn lease(&self) -> Lease {
        self.lease
    }

    fn append(&self, line: &impl Serialize) -> std::io::Result<()> {
        let text = serde_json::to_string(line)? + "\n";
        (&self.record).write_all(text.as_bytes())
    }

    /// Adds to this worker's record. A record that cannot be written loses claims, not frames.
    pub fn note(&self, event: &WorkerEvent) {
        let _ = self.append(event);
    }

    /// Takes a frame, unless somebody who is alive holds it.
    ///
    /// # Errors
    /// The folder cannot be read or written.
    pub fn take(&mut self, frame: u32) -> Result<Claim, Diagnostic> {
        if self.mine.contains_key(&frame) {
            return Ok(Claim::Taken);
        }
        let mut number = 1;
        loop {
            let path = self.path(frame, number);
            let failed = |error: std::io::Error| Diagnostic::io(path.display(), "write", &error);
            if self.create(&path).map_err(failed)? {
                if !self.path(frame, number + 1).exists() {
                    self.mine.insert(frame, number);
                    return Ok(Claim::Taken);
                }
                // A lower number was free only because its owner is gone and the next one is about to finish.
                std::fs::remove_file(&path).or_else(ignore_missing).map_err(failed)?;
            } else if !self.path(frame, number + 1).exists() {
                let Some(owner) = owner_of(&path) else { continue };
                if owner == self.header.worker {
                    // The server had made the link, and its answer was lost.
                    self.mine.insert(frame, number);
                    return Ok(Claim::Taken);
                }
                if !self.is_gone(&owner) {
                    return Ok(Claim::Held(owner));
                }
            }
            number += 1;
            if number > limits::CLAIM_TAKEOVERS {
                let message = format!("frame {frame} was claimed {number} times, and every owner is gone");
                return Err(Diagnostic::error(message).help("remove the folder .anim-claims to begin anew"));
            }
        }
    }

    /// Gives a frame back, finished or not.
    pub fn release(&mut self, frame: u32) {
        let Some(number) = self.mine.remove(&frame) else { return };
        // The lowest first: as long as the highest is there, the frame is held.
        for number in 1..=number {
            let _ = std::fs::remove_file(self.path(frame, number));
        }
    }

    /// Removes claims to frames that are done, as workers leave them that are killed in the moment after writing one.
    pub fn tidy(&mut self, done: &dyn Fn(u32) -> bool) {
        for (frame, number, owner) in claims_in(&self.folder) {
            if done(frame) && self.is_gone(&owner) && !self.path(frame, number + 1).exists() {
                let _ = std::fs::remove_file(self.path(frame, number));
            }
        }
    }

    fn path(&self, frame: u32, number: u32) -> PathBuf {
        self.folder.join(format!("{frame:07}.{number}"))
    }

    /// Makes a file that says who owns it, if there is none; whether it did.
    fn create(&self, path: &Path) -> std::io::Result<bool> {
        // Made in the folder of the frames: a shared file system then looks afresh at what is in there.
        let frames = self.folder.parent().unwrap_or(Path::new("."));
        let mut file = super::held_in(frames)?;
        file.write_all(self.header.worker.as_bytes())?;
        match std::fs::hard_link(file.path(), path) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
            // Not every file system has links.
            Err(_) => match OpenOptions::new().write(true).create_new(true).open(path) {
                Ok(mut file) => file.write_all(self.header.worker.as_bytes()).map(|()| true),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
                Err(error) => Err(error),
            },
        }
    }

    /// Whether a worker is there no more.
    fn is_gone(&mut self, worker: &str) -> bool {
        let path = self.folder.join(format!("{worker}{RECORD}"));
        // Opened, not only asked for: shared file systems then bring what they know up to date.
        let length = File::open(&path).and_then(|file| file.metadata()).map_or(0, |metadata| metadata.len());
        let now = Instant::now();
        let (known, since) = *self.watched.entry(worker.to_string()).or_insert((length, now));
        let is_silent = known == length && now.duration_since(since) >= self.lease.patience;
        if known != length {
            self.watched.insert(worker.to_string(), (length, now));
        }
        is_silent || self.has_died_here(worker, &path)
    }

    /// Whether a worker of this machine has ended or was killed.
    fn has_died_here(&self, worker: &str, record: &Path) -> bool {
        let is_here = read_header(record).is_some_and(|header| header.machine == self.header.machine);
        is_here && !is_held(&self.folder.join(format!("{worker}{ALIVE}")))
    }

    /// Removes records of workers on other plans that live no more.
    fn forget_other_plans(&self) {
        for record in workers_in(&self.folder).into_iter().filter(|record| record.header.plan != self.header.plan) {
            let worker = &record.header.worker;
            let path = self.folder.join(format!("{worker}{RECORD}"));
            if record.ended().is_some() || self.has_died_here(worker, &path) {
                let _ = std::fs::remove_file(path);
                let _ = std::fs::remove_file(self.folder.join(format!("{worker}{ALIVE}")));
            }
        }
    }

    /// Says how it ended and gives back what is still held.
    pub fn end(&mut self, at: f64, how: &str) {
        for frame in self.mine.keys().copied().collect::<Vec<u32>>() {
            self.release(frame);
        }
        self.note(&WorkerEvent::Ended { at, how: how.into() });
    }
}

impl Drop for Claims {
    fn drop(&mut self) {
        let _ = self.alive.unlock();
        let _ = std::fs::remove_file(self.folder.join(format!("{}{ALIVE}", self.header.worker)));
    }
}

fn ignore_missing(error: std::io::Error) -> std::io::Result<()> {
    if error.kind() == ErrorKind::NotFound { Ok(()) } else { Err(error) }
}

/// Whether somebody holds a lock; where that cannot be told, yes.
fn is_held(path: &Path) -> bool {
    match File::open(path) {
        Ok(file) => !matches!(file.try_lock_shared(), Ok(())),
        Err(error) => error.kind() != ErrorKind::NotFound,
    }
}

/// Who made a claim; `None` if it is there no more. Where there are no links it may say so a moment later.
fn owner_of(path: &Path) -> Option<String> {
    std::fs::read_to_string(path).ok()
}

fn read_header(path: &Path) -> Option<WorkerHeader> {
    let text = files::read_text(path, limits::MANIFEST_BYTES).ok()?;
    serde_json::from_str(text.lines().next()?).ok()
}

/// Every claim of a folder of claims: frame, number and owner.
pub fn claims_in(folder: &Path) -> Vec<(u32, u32, String)> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let claim = |path: PathBuf| {
        let name = path.file_name()?.to_str()?;
        let (frame, number) = name.split_once('.')?;
        Some((frame.parse().ok()?, number.parse().ok()?, owner_of(&path)?))
    };
    let mut claims: Vec<(u32, u32, String)> = entries.flatten().filter_map(|entry| claim(entry.path())).collect();
    claims.sort();
    claims
}

/// Every worker that has left a record in a folder of claims, by name. Lines that were cut short are left out.
pub fn workers_in(folder: &Path) -> Vec<WorkerRecord> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let is_record = |path: &PathBuf| path.to_string_lossy().ends_with(RECORD);
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_record).collect();
    paths.sort();
    let read = |path: PathBuf| {
        let text = files::read_text(&path, limits::MANIFEST_BYTES).ok()?;
        let mut lines = text.lines();
        let header = serde_json::from_str(lines.next()?).ok()?;
        Some(WorkerRecord { header, events: lines.filter_map(|line| serde_json::from_str(line).ok()).collect() })
    };
    paths.into_iter().filter_map(read).collect()
}

/// Whether the worker of a record lives, if that can be told on this machine.
pub fn lives_here(folder: &Path, header: &WorkerHeader) -> Option<bool> {
    let (_, machine) = this_machine();
    (header.machine == machine).then(|| is_held(&folder.join(format!("{}{ALIVE}", header.worker))))
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUICK: Lease = Lease { beat: Duration::from_millis(5), patience: Duration::from_millis(60) };

    fn join(folder: &Path) -> Claims {
        Claims::join(folder, WorkerHeader::default(), QUICK).unwrap()
    }

    /// Makes a worker one of another machine, of which only its record tells.
    fn send_away(folder: &Path, claims: &Claims) {
        let path = folder.join(FOLDER).join(format!("{}{RECORD}", claims.header.worker));
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replace(&claims.header.machine, "elsewhere")).unwrap();
    }

    #[test]
    fn a_frame_has_one_owner_until_it_is_given_back() {
        let folder = tempfile::tempdir().unwrap();
        let (mut a, mut b) = (join(folder.path()), join(folder.path()));
        assert_eq!(a.take(7).unwrap(), Claim::Taken);
        assert_eq!(a.take(7).unwrap(), Claim::Taken);
        assert_eq!(b.take(7).unwrap(), Claim::Held(a.header.worker.clone()));
        assert_eq!(b.take(8).unwrap(), Claim::Taken);
        a.release(7);
        assert_eq!(b.take(7).unwrap(), Claim::Taken);
        b.end(1.0, "done");
        assert!(claims_in(&folder.path().join(FOLDER)).is_empty());
    }

    #[test]
    fn who_dies_on_this_machine_is_followed_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let (mut a, mut b) = (join(folder.path()), join(folder.path()));
        a.take(1).unwrap();
        drop(a);
        assert_eq!(b.take(1).unwrap(), Claim::Taken);
        assert_eq!(b.mine[&1], 2);
        let mut c = join(folder.path());
        assert_eq!(c.take(1).unwrap(), Claim::Held(b.header.worker.clone()));
        b.release(1);
        assert_eq!(c.take(1).unwrap(), Claim::Taken);
        assert_eq!(c.mine[&1], 1);
    }

    #[test]
    fn who_is_silent_elsewhere_is_followed_after_the_lease_and_who_beats_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let (mut a, mut b) = (join(folder.path()), join(folder.path()));
        a.take(1).unwrap();
        send_away(folder.path(), &a);
        let path = folder.path().join(FOLDER).join(format!("{}{RECORD}", a.header.worker));
        let mut beats = OpenOptions::new().append(true).open(path).unwrap();
        let start = Instant::now();
        while start.elapsed() < 3 * QUICK.patience {
            writeln!(beats, "{{}}").unwrap();
            assert_eq!(b.take(1).unwrap(), Claim::Held(a.header.worker.clone()));
            std::thread::sleep(QUICK.beat);
        }
        std::thread::sleep(2 * QUICK.patience);
        assert_eq!(b.take(1).unwrap(), Claim::Taken);
    }

    #[test]
    fn many_who_follow_one_that_died_do_not_follow_together() {
        let folder = tempfile::tempdir().unwrap();
        for _ in 0..20 {
            let mut dead = join(folder.path());
            dead.take(5).unwrap();
            drop(dead);
            let barrier = std::sync::Barrier::new(6);
            let taken = std::sync::atomic::AtomicUsize::new(0);
            std::thread::scope(|scope| {
                for _ in 0..6 {
                    scope.spawn(|| {
                        let mut claims = join(folder.path());
                        barrier.wait();
                        let is_ours = claims.take(5).unwrap() == Claim::Taken;
                        taken.fetch_add(usize::from(is_ours), std::sync::atomic::Ordering::Relaxed);
                        // Nobody leaves before all have tried.
                        barrier.wait();
                        claims.end(0.0, "done");
                    });
                }
            });
            assert_eq!(taken.into_inner(), 1);
        }
    }

    #[test]
    fn records_tell_what_happened_and_go_with_their_plan() {
        let folder = tempfile::tempdir().unwrap();
        let header = |plan: &str| WorkerHeader { plan: plan.into(), frames: "1-9".into(), ..WorkerHeader::default() };
        let mut a = Claims::join(folder.path(), header("one"), QUICK).unwrap();
        a.note(&WorkerEvent::Done { frame: 3, at: 2.0, seconds: 1.5, cost: 7.0 });
        a.end(3.0, "done");
        let seen = workers_in(&folder.path().join(FOLDER));
        assert_eq!((seen.len(), seen[0].ended(), seen[0].events.len()), (1, Some("done"), 2));
        assert_eq!(seen[0].header.frames, "1-9");
        drop(a);
        let _b = Claims::join(folder.path(), header("two"), QUICK).unwrap();
        let seen = workers_in(&folder.path().join(FOLDER));
        assert_eq!(seen.iter().map(|record| record.header.plan.as_str()).collect::<Vec<_>>(), ["two"]);
    }
}
