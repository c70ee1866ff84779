//! What the worker makes, and how the page is told of it.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::board::{Order, PageReplyBytes};
use super::messages::note_json;
use super::pictures::{CurrentPicture, ShownPicture};
use super::refining::{self, REFRESH};
use super::worker::{FrameRow, PreviewWorker};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::{files, limits};
use crate::film::{DisplayTransform, Film};
use crate::output::{FileState, Format};
use crate::shot::fingerprint::Fingerprint;
use crate::shot::live::{LivePicture, LiveViewer};
use crate::shot::plan::{self, PlannedFrame};
use crate::shot::run::{self, Event};
use crate::shot::{self, NoiseMap};
use crate::systems::TileSink;

/// A quick picture is made smaller above the second and larger below the first, for the next time.
const SKETCH_TIME: [Duration; 2] = [Duration::from_millis(15), Duration::from_millis(60)];
/// What it then is to take.
const SKETCH_SECONDS: f64 = 0.035;
/// Its sides are not divided by more: less would show nothing.
const MOST_DIVISOR: f64 = 10.0;

impl PreviewWorker {
    /// Tells the page all that there is to know.
    pub(super) fn publish(&self) {
        let shot = self.shot.as_ref();
        let parameters: Vec<Value> = shot.map_or_else(Vec::new, |shot| {
            let value = |name: &str| {
                let given = self.options.open.defines.iter().rev().find(|(known, _)| known == name);
                given.map(|(_, value)| value.clone())
            };
            let one = |parameter: crate::script::Parameter| {
                let mut json = parameter.to_json();
                json["given"] = json!(value(&parameter.name));
                json
            };
            shot.parameters().into_iter().map(one).collect()
        });
        let root = shot.map(|shot| shot.project().root().to_path_buf());
        let rows: Vec<Value> = self.rows.iter().map(row_json).collect();
        let mut state = json!({
            "input": self.options.input.to_string_lossy(),
            "scene": shot.and_then(|shot| shot.scene_file()).map(|path| path.to_string_lossy().into_owned()),
            "is_sequence": shot.map(|shot| shot.is_sequence()),
            "count": shot.map(|shot| shot.frames()),
            "fps": shot.and_then(|shot| shot.rate()).map(|rate| rate.per_second()),
            "revision": self.revision(),
            "current": self.current.to_json(),
            "frame": self.frame,
            "problems": self.problems,
            "warnings": self.warnings,
            "printed": self.printed,
            "parameters": parameters,
            "rendering": self.rendering,
            "undo": self.undo_depth(),
            "target": self.plan.as_ref().map(|plan| plan.target.path(self.frame).to_string_lossy().into_owned()),
            "golden": root.filter(|root| root.join("golden.ron").is_file()).zip(shot).map(|(root, shot)| {
                root.join("golden").join(&shot.name).to_string_lossy().into_owned()
            }),
            "reuse_bytes": self.cache.bytes(),
            "can_relight": self.cache.can_relight(),
            "memory_bytes": self.options.policy.memory << 20,
            "frames": rows,
        });
        if shot.is_none() {
            // What was known of the shot before it was broken goes on being shown.
            self.board.show(|shown| {
                for key in ["count", "fps", "is_sequence", "scene", "parameters"] {
                    state[key] = shown.state[key].take();
                }
                shown.state = state;
            });
            return;
        }
        self.board.show(|shown| {
            state["picture_bytes"] = json!(shown.pictures.bytes());
            shown.state = state;
        });
    }

    /// Shows the exact picture of the frame if it is in memory.
    pub(super) fn show_from_memory(&mut self) -> bool {
        let Some(row) = self.rows.get(self.frame as usize - 1).filter(|_| self.plan.is_some()) else { return false };
        let there = row.picture.filter(|id| self.board.read(|shown| shown.pictures.get(*id).is_some()).0);
        let Some(picture) = there else { return false };
        self.current = CurrentPicture {
            frame: self.frame,
            picture,
            kind: "exact",
            before: if self.current.frame == self.frame { self.current.before } else { 0 },
            seconds: row.seconds.unwrap_or(0.0),
            kept: 0.0,
            has_file: self.board.read(|shown| shown.pictures.get(picture).is_some_and(|one| one.file.is_some())).0,
        };
        self.publish();
        true
    }

    /// Shows the frame if it is in memory, or in the folder that frames are written to.
    pub(super) fn show_done(&mut self) -> bool {
        let is_done = self.plan.is_some()
            && self.rows.get(self.frame as usize - 1).is_some_and(|row| row.state == FileState::Done.word());
        self.show_from_memory() || (is_done && self.read_frame(self.frame) && self.show_from_memory())
    }

    /// Shows a picture that is mixed from what each emitter gives, or a quick one; false if it was given up.
    pub(super) fn show_quick(&mut self) -> bool {
        let start = Instant::now();
        let mixed = self.trial_edits().and_then(|edits| match &mut self.shot {
            Some(shot) => shot.relight(self.frame, &edits, &self.cache),
            None => Ok(None),
        });
        match mixed {
            Ok(Some(picture)) => {
                self.problems.clear();
                self.put(&picture, "mixed", start.elapsed().as_secs_f64());
                true
            }
            // What is wrong with the frame, the quick picture says.
            Ok(None) | Err(_) => self.show_sketch(),
        }
    }

    /// Finds out what each emitter gives to the frame that is looked at; false if that is known.
    pub(super) fn look_at_emitters(&mut self) -> bool {
        let planned = self.plan.as_ref().and_then(|plan| plan.frames.get(self.frame as usize - 1));
        let Some(planned) = planned.filter(|planned| self.cache.lacks_emitters(planned)).cloned() else { return false };
        let Some(shot) = &mut self.shot else { return false };
        // Mistakes were told when the frame was traced.
        let known = shot.know_emitters(&planned, &mut self.cache, &self.board.cancel);
        if matches!(known, Ok(true)) {
            self.publish();
        }
        known.is_ok()
    }

    /// Shows a quick picture; false if it was given up.
    fn show_sketch(&mut self) -> bool {
        let start = Instant::now();
        let made = self.trial_edits().and_then(|edits| {
            let Some(shot) = &mut self.shot else { return Ok(None) };
            shot.sketch(self.frame, &edits, self.sketch, &self.board.cancel)
        });
        match made {
            Ok(None) => false,
            Err(problems) => {
                self.fail(&problems);
                true
            }
            Ok(Some(picture)) => {
                let took = start.elapsed();
                if !(SKETCH_TIME[0]..=SKETCH_TIME[1]).contains(&took) {
                    // What does not go with the number of pixels takes its share of the time.
                    let traced = picture.stats.render_seconds.max(1e-4);
                    let fixed = (took.as_secs_f64() - traced).max(0.0);
                    let allowed = (SKETCH_SECONDS - fixed).max(0.3 * SKETCH_SECONDS);
                    let divisor = f64::from(self.sketch.divisor) * (traced / allowed).sqrt();
                    self.sketch.divisor = divisor.ceil().clamp(2.0, MOST_DIVISOR) as u32;
                }
                self.sketch_seconds = took.as_secs_f64();
                self.problems.clear();
                self.put(&picture, "sketch", took.as_secs_f64());
                true
            }
        }
    }

    /// Puts a picture in the place of the current one.
    fn put(&mut self, picture: &LivePicture, kind: &'static str, seconds: f64) -> u64 {
        let shown = ShownPicture {
            frame: self.frame,
            size: [picture.film.width, picture.film.height],
            rgb: Arc::new(picture.film.to_rgb8(DisplayTransform::new(&picture.render))),
            film: Some(Arc::new(light_of(&picture.film))),
            file: None,
        };
        self.display = Some(DisplayTransform::new(&picture.render));
        let old = &self.current;
        let wanted: Vec<u64> = self.rows.iter().filter_map(|row| row.picture).chain([old.before]).collect();
        let mut id = 0;
        self.board.show(|board| {
            let last = &board.state["current"];
            let passes = matches!(last["kind"].as_str(), Some("sketch" | "mixed" | "refining"));
            let passing = last["picture"].as_u64().filter(|_| passes);
            id = board.pictures.add(shown, |id| wanted.contains(&id));
            passing.into_iter().for_each(|id| board.pictures.remove(id));
        });
        let before = if old.frame == self.frame { old.before } else { 0 };
        let kept = picture.stats.share_kept;
        self.current = CurrentPicture { frame: self.frame, picture: id, kind, before, seconds, kept, has_file: false };
        self.publish();
        id
    }

    /// Evaluates all frames.
    pub(super) fn make_plan(&mut self) {
        let Some(shot) = &mut self.shot else { return };
        let count = shot.frames();
        let wanted: Vec<u32> = (1..=count).collect();
        let sequence = shot.is_sequence().then_some(count);
        let target = crate::output::names::resolve(self.options.out.as_deref(), &shot.name, sequence, wanted.len());
        let made = target.map_err(|message| Diagnostic::error(message).into()).and_then(|target| {
            let made = plan::make_until(shot, &wanted, target, &self.board.cancel);
            made.map(|mut plan| {
                plan.inspect(&shot.source);
                plan
            })
        });
        if self.is_cancelled() && made.is_err() {
            return;
        }
        self.printed = self.shot.as_ref().map_or_else(Vec::new, |shot| shot.take_printed());
        match made {
            Err(problems) => {
                self.shot = None;
                self.fail(&problems);
            }
            Ok(plan) => {
                self.problems = plan.summary().0.iter().map(Diagnostic::to_json).collect();
                self.rows = plan.frames.iter().take(limits::PREVIEW_FRAMES as usize).map(|one| self.row(one)).collect();
                self.plan = Some(plan);
                if !self.show_from_memory() {
                    self.publish();
                }
            }
        }
    }

    /// Adds what can be rendered and is most likely not meant to the warnings.
    pub(super) fn advise(&mut self) {
        let (Some(shot), Some(plan)) = (&mut self.shot, &self.plan) else { return };
        let fingerprints: Result<Vec<Fingerprint>, _> = plan.frames.iter().map(|one| one.fingerprint.clone()).collect();
        let Ok(fingerprints) = fingerprints else { return };
        let found = shot::advice::advice(shot, &fingerprints);
        if !found.0.is_empty() {
            self.warnings.extend(found.0.iter().map(Diagnostic::to_json));
            self.publish();
        }
    }

    fn row(&self, planned: &PlannedFrame) -> FrameRow {
        let state = if planned.fingerprint.is_err() { "wrong" } else { planned.state.word() };
        let changes = planned.changes.iter().flatten().map(|part| part.word()).collect();
        let picture = self.pictures.get(&planned.hash).copied();
        let picture = picture.filter(|id| self.board.read(|shown| shown.pictures.get(*id).is_some()).0);
        FrameRow { hash: planned.hash, state, picture, seconds: None, changes }
    }

    /// Makes the exact picture of the frame that is looked at; false if there is nothing to make.
    pub(super) fn show_exact(&mut self) -> bool {
        if self.show_done() {
            return true;
        }
        let Some(made) = self.exact(self.frame, true) else { return true };
        match made {
            Ok(picture) => {
                let seconds = self.rows.get(self.frame as usize - 1).and_then(|row| row.seconds).unwrap_or(0.0);
                let id = self.put(&picture, "exact", seconds);
                self.keep(self.frame, id, Some(&picture));
            }
            Err(problems) => {
                self.fail(&problems);
                self.current.kind = "exact";
                self.current.frame = self.frame;
            }
        }
        true
    }

    /// A frame as it would be written, from its file or traced; `None` if it was given up.
    fn exact(&mut self, frame: u32, is_seen: bool) -> Option<Result<LivePicture, Diagnostics>> {
        let start = Instant::now();
        let planned = self.plan.as_ref()?.frames.get(frame as usize - 1)?.clone();
        let viewer = if is_seen { LiveViewer::Eye(self.sink()) } else { LiveViewer::Ahead };
        let shot = self.shot.as_mut()?;
        let made = shot.live_picture(&planned, &mut self.cache, viewer, &self.board.cancel);
        let seconds = start.elapsed().as_secs_f64();
        // Tiles that were shown meanwhile are in another picture than the one that was there before.
        let (shown, _) = self
            .board
            .read(|shown| (shown.state["current"]["picture"].as_u64(), shown.state["current"]["kind"] == "refining"));
        if let (Some(picture), true) = shown {
            (self.current.picture, self.current.kind) = (picture, "refining");
        }
        if let Some(row) = self.rows.get_mut(frame as usize - 1) {
            row.seconds = Some(seconds);
        }
        made.transpose()
    }

    /// Remembers an exact picture, with the bytes of its file.
    fn keep(&mut self, frame: u32, id: u64, picture: Option<&LivePicture>) {
        let (Some(plan), Some(shot)) = (&self.plan, &self.shot) else { return };
        let Some(planned) = plan.frames.get(frame as usize - 1) else { return };
        let file = picture.and_then(|picture| {
            let metadata = planned.provenance(&shot.source);
            let metadata = crate::output::frame_metadata(&metadata, picture.stats.seed, &picture.render);
            run::encode(&picture.film, &picture.render, &metadata, &planned.file).ok()
        });
        let hash = planned.hash;
        self.current.has_file |= file.is_some() && self.current.picture == id;
        self.board.show(|shown| shown.pictures.set_file(id, file.map(Arc::new)));
        self.pictures.insert(hash, id);
        for row in self.rows.iter_mut().filter(|row| row.hash == hash) {
            row.picture = Some(id);
        }
        self.publish();
    }

    /// Draws tiles over the quick picture while the exact one is traced.
    fn sink(&self) -> Option<TileSink> {
        if self.current.kind == "mixed" {
            // That is as sharp, and less noisy than tiles before noise is filtered out of them.
            return None;
        }
        let small = self.board.read(|shown| shown.pictures.get(self.current.picture).cloned()).0?;
        let size = self.plan.as_ref()?.frames.get(self.frame as usize - 1)?.fingerprint.as_ref().ok()?.size;
        Some(refining::sink(&self.board, &small, size, self.current.clone(), self.display?))
    }

    /// Makes or reads the next frame ahead that is not in memory; false if there is none.
    pub(super) fn look_ahead(&mut self) -> bool {
        let count = self.rows.len() as u32;
        let room = self.board.read(|shown| shown.pictures.bytes() < shown.pictures.most() / 10 * 9).0;
        let after = (0..count).map(|i| (self.frame - 1 + i) % count.max(1) + 1);
        let is_missing = |frame: &u32| {
            let row = &self.rows[*frame as usize - 1];
            row.picture.is_none() && row.state != "wrong"
        };
        let Some(frame) = after.filter(|_| room).find(is_missing) else { return false };
        if self.rows[frame as usize - 1].state == FileState::Done.word() && self.read_frame(frame) {
            return true;
        }
        match self.exact(frame, false) {
            None => true,
            Some(Err(problems)) => {
                self.rows[frame as usize - 1].state = "wrong";
                self.fail(&problems);
                true
            }
            Some(Ok(picture)) => {
                let shown = ShownPicture {
                    frame,
                    size: [picture.film.width, picture.film.height],
                    rgb: Arc::new(picture.film.to_rgb8(DisplayTransform::new(&picture.render))),
                    film: None,
                    file: None,
                };
                let mut id = 0;
                self.board.show(|board| id = board.pictures.add(shown, |_| true));
                self.keep(frame, id, Some(&picture));
                true
            }
        }
    }

    /// Takes a frame's picture from its file.
    fn read_frame(&mut self, frame: u32) -> bool {
        let Some(file) = self.plan.as_ref().and_then(|plan| plan.frames.get(frame as usize - 1)).map(|one| &one.file)
        else {
            return false;
        };
        let Some((size, rgb, bytes)) = read_picture(file) else { return false };
        let shown = ShownPicture { frame, size, rgb: Arc::new(rgb), film: None, file: Some(Arc::new(bytes)) };
        let mut id = 0;
        self.board.show(|board| id = board.pictures.add(shown, |_| true));
        let Some(row) = self.rows.get(frame as usize - 1) else { return false };
        self.pictures.insert(row.hash, id);
        let hash = row.hash;
        self.rows.iter_mut().filter(|row| row.hash == hash).for_each(|row| row.picture = Some(id));
        self.publish();
        true
    }

    /// Writes the frames that are not there, as the command would; false if it was given up for an order.
    pub(super) fn render(&mut self) -> bool {
        let (Some(shot), Some(plan)) = (&mut self.shot, &mut self.plan) else { return true };
        plan.inspect(&shot.source);
        if let Some(foreign) = plan.foreign().first() {
            let message = format!("{} is there and is no picture of this input", foreign.display());
            self.problems = vec![note_json("error", &message)];
            self.rendering = None;
            self.publish();
            return true;
        }
        let total = plan.frames.iter().filter(|one| one.fingerprint.is_ok()).count();
        let done = AtomicUsize::new(0);
        let last = Mutex::new(Instant::now());
        let board = self.board.clone();
        let watch = |event: Event| {
            let Event::Written(_) = event else { return };
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
            if last.elapsed() >= REFRESH {
                *last = Instant::now();
                board.show(|shown| shown.state["rendering"] = json!([done, total]));
            }
        };
        let ending = run::run(shot, plan, self.options.policy, &self.board.cancel, &watch);
        plan.inspect(&shot.source);
        let states: Vec<&'static str> = plan.frames.iter().map(|one| one.state.word()).collect();
        for (row, state) in self.rows.iter_mut().zip(states).filter(|(row, _)| row.state != "wrong") {
            row.state = state;
        }
        let ended = match ending {
            Err(problems) => {
                self.problems = problems.0.iter().map(Diagnostic::to_json).collect();
                true
            }
            Ok(ending) => {
                self.problems
                    .extend(ending.failed.iter().flat_map(|(_, wrong)| wrong.0.iter().map(Diagnostic::to_json)));
                !ending.cancelled
            }
        };
        self.rendering = (!ended).then_some([done.into_inner(), total]);
        self.publish();
        ended
    }

    /// Answers how the picture was sampled: width and height, then columns of the numbers of samples and of standard
    /// errors, in little-endian words.
    pub(super) fn noise(&mut self, reply: PageReplyBytes) {
        let Some(shot) = &mut self.shot else {
            let _ = reply.send(Err("mend the mistakes first".into()));
            return;
        };
        match shot.noise_of(self.frame, &self.board.cancel) {
            Ok(None) if reply.is_closed() => {}
            Ok(None) => self.board.put_back(Order::Noise(reply)),
            Ok(Some(map)) => drop(reply.send(Ok(noise_bytes(&map)))),
            Err(problems) => drop(reply.send(Err(problems.to_string()))),
        }
    }

    /// Answers what the pixels show: width and height, then columns of entities, materials (from 1; 0 is nothing), depths,
    /// normals and positions, in little-endian words.
    pub(super) fn layers(&mut self, reply: PageReplyBytes) {
        let Some(shot) = &mut self.shot else {
            let _ = reply.send(Err("mend the mistakes first".into()));
            return;
        };
        match shot.seen_in(self.frame, limits::PREVIEW_LAYER_PIXELS, &self.board.cancel) {
            Ok(None) => self.board.put_back(Order::Layers(reply)),
            Ok(Some(picture)) => drop(reply.send(Ok(layer_bytes(&picture.film)))),
            Err(problems) => drop(reply.send(Err(problems.to_string()))),
        }
    }
}

fn noise_bytes(map: &NoiseMap) -> Vec<u8> {
    let mut bytes: Vec<u8> = map.size.iter().chain(&map.samples).flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(map.noise.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// A film without its layers.
fn light_of(film: &Film) -> Film {
    Film { pixels: film.pixels.clone(), origin: film.origin, ..Film::new(film.width, film.height) }
}

fn row_json(row: &FrameRow) -> Value {
    json!([row.state, row.picture, row.seconds, row.changes])
}

/// Size, RGB in 8 bits, and the bytes of a picture file.
fn read_picture(file: &Path) -> Option<([u32; 2], Vec<u8>, Vec<u8>)> {
    let bytes = files::read_bytes(file, limits::FRAME_FILE_BYTES).ok()?;
    let format = Format::of_path(file)?;
    // Linear light would have to be shown by the settings of its frame, which are not at hand.
    if format.name != "PNG" {
        return None;
    }
    let decoded = (format.decode)(&bytes).ok()?;
    let rgb = decoded.pixels.iter().flatten().map(|x| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect();
    Some((decoded.size, rgb, bytes))
}

fn layer_bytes(film: &Film) -> Vec<u8> {
    let layers = &film.layers;
    let mut bytes: Vec<u8> = [film.width, film.height].iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(layers.entity.iter().chain(&layers.material).flat_map(|x| x.to_le_bytes()));
    bytes.extend(layers.depth.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(layers.normal.iter().chain(&layers.position).flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}
