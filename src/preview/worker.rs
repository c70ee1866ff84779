//! The worker: the one thread that has the shot, does what pages ask for, and has something to do while they do not.
//!
//! Every order raises the flag that tracing looks at, so that it is answered within a few tiles; then the worker goes on
//! with the most urgent thing that is not done (`PreviewWorker::step`): open what changed, a quick picture of the frame that is
//! looked at, the plan of all frames, the exact picture, frames that are to be written, and the frames ahead.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use serde_json::{Value, json};

use super::board::{Board, Order, Trial};
use super::pictures::CurrentPicture;
use super::watching::FileWatch;
use super::{PreviewOptions, describe, trial};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, Severity};
use crate::base::digest::Digest;
use crate::base::limits;
use crate::base::project::{FileRole, Project};
use crate::film::DisplayTransform;
use crate::shot::live::{LiveCache, Sketch};
use crate::shot::plan::Plan;
use crate::shot::reuse::ReusePolicy;
use crate::shot::set::SceneEdit;
use crate::shot::{self, Shot};

/// A quick picture in seconds that nobody need be told to wait for.
const PROMPT: f64 = 0.15;

/// The worker with all that it knows.
pub struct PreviewWorker {
    pub(super) options: PreviewOptions,
    pub(super) board: Arc<Board>,
    pub(super) watch: FileWatch,
    /// What is kept of the work for pictures.
    policy: ReusePolicy,
    pub(super) shot: Option<Shot>,
    /// The one before, for what it has derived, while mistakes keep it from being opened again.
    last_shot: Option<Shot>,
    /// No file has changed since it was read but texts.
    keeps_files: bool,
    pub(super) plan: Option<Plan>,
    pub(super) cache: LiveCache,
    /// Exact pictures in memory, by the hash of their frame.
    pub(super) pictures: BTreeMap<Digest, u64>,
    pub(super) rows: Vec<FrameRow>,
    /// The frame that is looked at, from 1.
    pub(super) frame: u32,
    /// What is shown of it.
    pub(super) current: CurrentPicture,
    trial: Vec<Trial>,
    todo: Todo,
    /// Edits that were written, the last one at the end, with the file.
    undo: Vec<(PathBuf, SceneEdit)>,
    /// What was written here, and need not be opened again.
    own_write: Option<(PathBuf, Digest)>,
    pub(super) sketch: Sketch,
    /// What the last quick picture took.
    pub(super) sketch_seconds: f64,
    /// How the picture that was shown last comes to the screen.
    pub(super) display: Option<DisplayTransform>,
    pub(super) problems: Vec<Value>,
    pub(super) warnings: Vec<Value>,
    pub(super) printed: Vec<String>,
    pub(super) rendering: Option<[usize; 2]>,
    revision: u64,
}

/// What is known of a frame of the timeline.
#[derive(Clone, Debug, Default)]
pub struct FrameRow {
    /// Of all that decides its pixels.
    pub hash: Digest,
    /// `memory`, `done`, `stale` or `missing`.
    pub state: &'static str,
    /// The picture in the store, if it is in memory.
    pub picture: Option<u64>,
    /// What it took to make it, if it was made here.
    pub seconds: Option<f64>,
    /// What differs from the frame before.
    pub changes: Vec<&'static str>,
}

/// What is not done yet.
#[derive(Clone, Copy, Debug, Default)]
struct Todo {
    open: bool,
    sketch: bool,
    render: bool,
    /// What is most likely not meant has been looked for.
    advised: bool,
    /// Nothing ahead can be rendered any more.
    idle: bool,
}

impl PreviewWorker {
    /// A worker that has opened nothing yet.
    pub fn new(options: PreviewOptions, board: Arc<Board>, watch: FileWatch) -> PreviewWorker {
        // Pictures get half of the memory, and what they are made of gets what they leave.
        let memory = options.policy.memory;
        let most = limits::PREVIEW_PICTURE_BYTES.min(usize::try_from(memory << 19).unwrap_or(usize::MAX));
        board.show(|shown| shown.pictures.set_most(most));
        let policy = ReusePolicy { memory: memory.saturating_sub(most as u64 >> 20), ..options.policy };
        let cache = LiveCache::new(policy);
        PreviewWorker {
            options,
            board,
            watch,
            policy,
            shot: None,
            last_shot: None,
            keeps_files: true,
            plan: None,
            cache,
            pictures: BTreeMap::new(),
            rows: Vec::new(),
            frame: 1,
            current: CurrentPicture::default(),
            trial: Vec::new(),
            todo: Todo { open: true, ..Todo::default() },
            undo: Vec::new(),
            own_write: None,
            sketch: Sketch { divisor: 4, samples: 4 },
            sketch_seconds: f64::INFINITY,
            display: None,
            problems: Vec::new(),
            warnings: Vec::new(),
            printed: Vec::new(),
            rendering: None,
            revision: 0,
        }
    }

    /// Works until it is told to stop.
    pub fn run(mut self) {
        let mut busy = true;
        loop {
            while let Some(order) = self.board.next_order(!busy) {
                if matches!(order, Order::Stop) {
                    return;
                }
                busy = true;
                self.guarded(|worker| worker.obey(order));
            }
            busy = self.guarded(PreviewWorker::step).unwrap_or(false);
        }
    }

    /// Whatever falls over in here is told to the page, and the next edit starts afresh.
    fn guarded<T>(&mut self, work: impl FnOnce(&mut PreviewWorker) -> T) -> Option<T> {
        match catch_unwind(AssertUnwindSafe(|| work(self))) {
            Ok(done) => Some(done),
            Err(cause) => {
                let why = cause.downcast_ref::<String>().cloned();
                let why = why.or(cause.downcast_ref::<&str>().map(|text| text.to_string())).unwrap_or_default();
                self.board.is_sketching.store(false, Ordering::Relaxed);
                (self.shot, self.plan, self.todo) = (None, None, Todo::default());
                self.cache = LiveCache::new(self.policy);
                self.last_shot = None;
                self.fail(&Diagnostic::bug(format!("the preview failed: {why}")).into());
                None
            }
        }
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Changed(paths) => {
                let own = self.own_write.take().filter(|(path, digest)| {
                    paths == [path.clone()] && std::fs::read(path).is_ok_and(|bytes| Digest::of(&bytes) == *digest)
                });
                let is_text = |path: &PathBuf| path.extension().is_some_and(|e| e == "ron" || e == "rhai");
                if !paths.iter().all(is_text) {
                    // What was read of it before may have been taken for what it holds now.
                    self.keeps_files = false;
                    self.pictures.clear();
                    self.cache = LiveCache::new(self.policy);
                }
                if own.is_none() {
                    self.reopen();
                }
            }
            Order::Look(frame) => self.look(frame),
            Order::Define(name, value) => {
                self.options.open.defines.retain(|(known, _)| *known != name);
                self.options.open.defines.extend(value.map(|value| (name, value)));
                self.reopen();
            }
            Order::Try(trial) => {
                let ends = trial.is_empty() && !self.trial.is_empty();
                self.todo.sketch |= !trial.is_empty() || ends;
                self.trial = trial;
            }
            Order::Set(assignments, reply) => {
                let done = self.set(&assignments);
                // A tab that has gone away hears nothing.
                let _ = reply.send(done.map_err(|problems| problems.to_string()));
            }
            Order::Undo(reply) => {
                let done = self.take_back();
                let _ = reply.send(done.map_err(|problem| problem.to_string()));
            }
            Order::Render(wanted) => {
                self.todo.render = wanted;
                self.rendering = self.rendering.filter(|_| wanted);
                self.publish();
            }
            Order::Describe(subject, reply) => {
                let frame = self.frame;
                let described = match &mut self.shot {
                    Some(shot) => describe::describe(shot, frame, subject),
                    None => Err(Diagnostic::error("mend the mistakes first").into()),
                };
                let _ = reply.send(described.map_err(|problems| problems.to_string()));
            }
            Order::Layers(reply) => self.layers(reply),
            Order::Noise(reply) => self.noise(reply),
            Order::Stop => {}
        }
    }

    fn look(&mut self, frame: u32) {
        let last = self.shot.as_ref().map_or(1, Shot::frames);
        self.frame = frame.clamp(1, last);
        self.todo.idle = false;
        self.todo.sketch = self.shot.is_some() && !self.show_done();
    }

    pub(super) fn reopen(&mut self) {
        self.todo.open = true;
        self.revision += 1;
    }

    /// Does the most urgent thing that is not done; false if there is none.
    fn step(&mut self) -> bool {
        if self.todo.open {
            self.todo.open = false;
            self.open();
            return true;
        }
        if self.shot.is_none() {
            return false;
        }
        if self.todo.sketch {
            let board = self.board.clone();
            self.todo.sketch = !board.sketching(|| self.show_quick());
            return true;
        }
        if !self.trial.is_empty() {
            return false;
        }
        if self.plan.is_none() {
            self.make_plan();
            return true;
        }
        if self.current.kind != "exact" || self.current.frame != self.frame {
            return self.show_exact();
        }
        if !self.todo.advised {
            self.todo.advised = true;
            self.advise();
            return true;
        }
        if self.todo.render {
            let ended = self.render();
            self.todo.render = !ended;
            return true;
        }
        if self.look_at_emitters() {
            return true;
        }
        if !self.todo.idle {
            self.todo.idle = !self.look_ahead();
            return true;
        }
        false
    }

    fn open(&mut self) {
        let start = Instant::now();
        let input = self.options.input.clone();
        let options = self.options.open.clone();
        let opened = Project::of(&input, &options.access).map_err(Diagnostics::from).and_then(|project| {
            project.record(&input, FileRole::Script);
            let opened = shot::open_in(&input, options, project.clone());
            // Also where it could not be opened: it is what was looked for until then that is to be mended.
            self.watch.follow(project.recorded().into_iter().map(|(path, _)| path));
            opened
        });
        self.plan = None;
        self.trial.clear();
        self.last_shot = self.shot.take().or(self.last_shot.take());
        match opened {
            Err(problems) => self.fail(&problems),
            Ok((mut shot, warnings)) => {
                if let Some(before) = self.last_shot.take() {
                    shot.adopt(before, self.keeps_files);
                }
                self.keeps_files = true;
                self.frame = self.frame.clamp(1, shot.frames());
                self.warnings = warnings.0.iter().map(Diagnostic::to_json).collect();
                self.problems.clear();
                let count = shot.frames().min(limits::PREVIEW_FRAMES) as usize;
                if self.rows.len() != count {
                    self.rows = vec![FrameRow { state: "unknown", ..FrameRow::default() }; count];
                }
                if self.current.kind == "exact" {
                    self.current.before = self.current.picture;
                }
                self.current.kind = "stale";
                self.current.seconds = start.elapsed().as_secs_f64();
                self.shot = Some(shot);
                self.todo = Todo { sketch: true, render: self.todo.render, ..Todo::default() };
                // The page hears of it with the quick picture, unless that takes long.
                if self.sketch_seconds > PROMPT {
                    self.publish();
                }
            }
        }
    }

    /// Shows what is wrong over the last good picture.
    pub(super) fn fail(&mut self, problems: &Diagnostics) {
        let (said, wrong): (Vec<_>, Vec<_>) = problems.0.iter().partition(|one| one.severity == Severity::Note);
        self.printed = said.iter().map(|one| one.message.clone()).collect();
        self.problems = wrong.iter().map(|one| one.to_json()).collect();
        self.publish();
    }

    /// Edits that the values that are tried out make of the frame.
    pub(super) fn trial_edits(&mut self) -> Result<Vec<crate::components::Edit>, Diagnostics> {
        match &mut self.shot {
            Some(shot) if !self.trial.is_empty() => trial::edits(&shot.scene_of(self.frame)?, &self.trial),
            _ => Ok(Vec::new()),
        }
    }

    fn scene_path(&self) -> Result<PathBuf, Diagnostic> {
        let path = self.shot.as_ref().and_then(|shot| shot.scene_file()).map(std::path::Path::to_path_buf);
        path.ok_or_else(|| {
            Diagnostic::error("there is no scene file to write to, or it has mistakes").because(Cause::Usage)
        })
    }

    fn set(&mut self, assignments: &[crate::load::ron::edit::Assignment]) -> Result<Value, Diagnostics> {
        let path = self.scene_path()?;
        let project = Project::of(&path, &self.options.open.access)?;
        let edit = shot::set::edit_scene(&path, assignments, &project)?;
        let changes: Vec<Value> = edit
            .changes
            .iter()
            .map(|change| {
                json!({ "path": change.path, "file": &*change.place.file, "line": change.place.line,
                    "before": change.before, "after": change.after })
            })
            .collect();
        if edit.before != edit.after {
            shot::set::replace_text(&path, &edit.before, &edit.after)?;
            self.own_write = Some((path.clone(), Digest::of(edit.after.as_bytes())));
            self.undo.push((path, edit));
            self.reopen();
        }
        Ok(json!({ "changes": changes, "undo": self.undo.len() }))
    }

    fn take_back(&mut self) -> Result<Value, Diagnostic> {
        let Some((path, edit)) = self.undo.pop() else {
            return Err(Diagnostic::error("nothing was written from this page that could be taken back"));
        };
        if let Err(problem) = shot::set::replace_text(&path, &edit.after, &edit.before) {
            // What an editor has changed since is not thrown away.
            self.undo.clear();
            self.publish();
            return Err(problem);
        }
        self.own_write = Some((path, Digest::of(edit.before.as_bytes())));
        self.reopen();
        Ok(json!({ "undo": self.undo.len() }))
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.board.cancel.load(Ordering::Relaxed)
    }

    /// How many edits can be taken back.
    pub(super) fn undo_depth(&self) -> usize {
        self.undo.len()
    }

    pub(super) fn revision(&self) -> u64 {
        self.revision
    }
}
