//! Rendering the frames of a plan that are not there yet, and writing them.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Instant;

use rustc_hash::FxHashMap;

use super::Shot;
use super::photons::Photons;
use super::plan::{Plan, Planned};
use super::reuse::Keeper;
pub use super::reuse::Policy;
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::digest::Digest;
use crate::base::{files, limits};
use crate::components::Render;
use crate::film::Film;
use crate::output::manifest::{Making, Manifest};
use crate::output::names::is_exr;
use crate::output::{self, Notes, State, encode_exr, encode_png, making_notes, settings_note};
use crate::systems::{self, Exposure, FrameStats};

/// What happens while a shot is rendered.
pub enum Event {
    /// Tiles of a frame that are done, out of all of its tiles.
    Tiles { frame: u32, done: usize, total: usize },
    /// A frame's file is whole.
    Written(Box<Report>),
}

/// Where a frame's pixels are from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reused {
    /// Traced for this frame.
    None,
    /// The file was there and is the frame.
    Cache,
    /// From another frame that is the same.
    Copy,
}

impl Reused {
    pub fn word(self) -> &'static str {
        match self {
            Reused::None => "none",
            Reused::Cache => "cache",
            Reused::Copy => "copy",
        }
    }
}

/// One frame whose file is whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    pub frame: u32,
    pub file: PathBuf,
    pub reused: Reused,
    pub stats: FrameStats,
    /// From the frame's edits to its whole file.
    pub total_seconds: f64,
}

/// How a run ended.
#[derive(Debug, Default)]
pub struct Ending {
    /// `cancel` was raised; only whole frames are there.
    pub cancelled: bool,
    /// Frames that could be planned and not be rendered.
    pub failed: Vec<(u32, Diagnostics)>,
}

/// A rendered picture on its way to the files of all frames that show it.
struct Exposed {
    frames: Vec<(Making, PathBuf)>,
    film: Film,
    render: Render,
    stats: FrameStats,
    start: Instant,
}

type Watch<'a> = &'a (dyn Fn(Event) + Sync);

/// Renders and writes what the plan says is not done. `watch` is called from several threads.
///
/// A frame that cannot be rendered does not keep the others from it.
///
/// # Errors
/// A file that cannot be written: what is there by then is whole.
pub fn run(
    shot: &mut Shot,
    plan: &Plan,
    policy: Policy,
    cancel: &AtomicBool,
    watch: Watch,
) -> Result<Ending, Diagnostics> {
    output::sweep(&plan.folder());
    for planned in plan.frames.iter().filter(|planned| planned.state == State::Done) {
        watch(report(planned, Reused::Cache, Instant::now()));
    }
    let source = shot.source.clone();
    let groups = copy_what_is_done(plan, &source, watch)?;
    if let Some(first) = groups.first() {
        output::probe(&first[0].file)?;
    }
    let failed = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel::<Exposed>(1);
        let writer = scope.spawn(|| write_all(receive, plan.manifest.as_ref(), watch, &failed));
        let mut ending = Ending::default();
        let mut kept = (Keeper::new(policy), Photons::default());
        for (index, group) in groups.iter().enumerate() {
            match expose(shot, &groups, index, policy, &mut kept, cancel, watch) {
                Ok(Some(exposed)) if !failed.load(Ordering::Relaxed) => {
                    // The writer only hangs up after a failure, which it reports itself.
                    let _ = send.send(exposed);
                }
                Ok(Some(_)) => break,
                Ok(None) => {
                    ending.cancelled = true;
                    break;
                }
                Err(problems) => {
                    kept.0.drop_tiles();
                    ending.failed.extend(group.iter().map(|planned| (planned.frame, problems.clone())));
                }
            }
        }
        drop(send);
        let written = writer.join().unwrap_or_else(|_| Err(Diagnostic::error("the writer of frames failed")));
        written.map_err(Diagnostics::from)?;
        Ok(ending)
    })
}

fn report(planned: &Planned, reused: Reused, start: Instant) -> Event {
    let (frame, file, stats) = (planned.frame, planned.file.clone(), FrameStats::default());
    Event::Written(Box::new(Report { frame, file, reused, stats, total_seconds: start.elapsed().as_secs_f64() }))
}

/// Writes the frames that are the same as one that is done; gives the others, equal ones together.
fn copy_what_is_done<'a>(plan: &'a Plan, source: &str, watch: Watch) -> Result<Vec<Vec<&'a Planned>>, Diagnostic> {
    let good = || plan.frames.iter().filter(|planned| planned.outline.is_ok());
    let done = good().filter(|planned| planned.state == State::Done);
    let done: FxHashMap<Digest, &Path> = done.map(|planned| (planned.hash, planned.file.as_path())).collect();
    let mut groups: Vec<Vec<&Planned>> = Vec::new();
    let mut places: FxHashMap<Digest, usize> = FxHashMap::default();
    for planned in good().filter(|planned| planned.state != State::Done) {
        let start = Instant::now();
        let making = planned.making(source);
        if let Some(bytes) = done.get(&planned.hash).and_then(|file| copy_of(file, &making)) {
            write(plan.manifest.as_ref(), &making, &planned.file, &bytes)?;
            watch(report(planned, Reused::Copy, start));
            continue;
        }
        let place = *places.entry(planned.hash).or_insert(groups.len());
        if place == groups.len() {
            groups.push(Vec::new());
        }
        groups[place].push(planned);
    }
    Ok(groups)
}

/// The bytes of a frame from the file of one that is the same; `None` if that file is not what it was.
fn copy_of(file: &Path, making: &Making) -> Option<Vec<u8>> {
    let bytes = files::read_bytes(file, limits::FRAME_FILE_BYTES).ok()?;
    output::renamed(&bytes, making)
}

/// Makes the frame at `index` of the run, from what is kept as far as that goes.
fn expose(
    shot: &mut Shot,
    run: &[Vec<&Planned>],
    index: usize,
    policy: Policy,
    (keeper, photons): &mut (Keeper, Photons),
    cancel: &AtomicBool,
    watch: Watch,
) -> Result<Option<Exposed>, Diagnostics> {
    let start = Instant::now();
    let planned = run[index][0];
    let frames = run[index].iter().map(|planned| (planned.making(&shot.source), planned.file.clone())).collect();
    let group = planned.group.as_deref();
    let outline = planned.outline.as_ref().ok();
    let factors =
        group.zip(outline).map(|(group, outline)| group.factors(&shot.input.rest, outline)).unwrap_or_default();
    if let Some((film, render, stats)) = group.and_then(|group| keeper.sum(group, &factors)) {
        check_assets(shot)?;
        return Ok(Some(Exposed { frames, film, render, stats, start }));
    }
    let mut exposure = Exposure::default();
    match group {
        Some(group) => exposure.passes = group.passes.clone(),
        None => keeper.lend(shot, run, index, &mut exposure),
    }
    photons.lend(policy, run, index, &mut exposure);
    let frame = planned.frame;
    let progress = |done, total| watch(Event::Tiles { frame, done, total });
    let (mut render, mut whole) = (Render::default(), true);
    let Shot { stage, input, .. } = shot;
    stage.set_pictures((run.len() - index) as u32);
    let slices = input.slices(frame)?;
    input.with_slices(stage, frame, slices, |stage, share| {
        render = stage.settings();
        whole = systems::expose(stage, share, &mut exposure, cancel, &progress)?;
        Ok(whole)
    })?;
    check_assets(shot)?;
    if !whole {
        return Ok(None);
    }
    if group.is_none() {
        keeper.take_back(&mut exposure, index);
    }
    photons.take_back(run, index, &mut exposure);
    let Some((mut films, stats)) = exposure.develop() else { return Ok(None) };
    let Some(group) = group else {
        return Ok(films.pop().map(|film| Exposed { frames, film, render, stats, start }));
    };
    let Some((first, others)) = films.split_first() else { return Ok(None) };
    let film = systems::sum_of(first, others, &factors);
    keeper.keep_passes(group, films, &render, stats.seed, &run[index + 1..]);
    Ok(Some(Exposed { frames, film, render, stats, start }))
}

fn check_assets(shot: &Shot) -> Result<(), Diagnostics> {
    let Some(name) = shot.input.rest.changed_asset() else { return Ok(()) };
    let message = format!("`{name}` changed while its frames were rendered");
    Err(Diagnostic::error(message).because(Cause::Io).help("run again").into())
}

fn write_all(
    pictures: Receiver<Exposed>,
    manifest: Option<&Manifest>,
    watch: Watch,
    failed: &AtomicBool,
) -> Result<(), Diagnostic> {
    for Exposed { frames, film, render, stats, start } in pictures {
        let mut reused = Reused::None;
        for (making, file) in frames {
            let written = encode(&film, &render, &notes(&making, &stats, &render), &file)
                .map_err(|e| Diagnostic::error(format!("cannot encode {}: {e}", file.display())).because(Cause::Io))
                .and_then(|bytes| write(manifest, &making, &file, &bytes));
            if let Err(problem) = written {
                failed.store(true, Ordering::Relaxed);
                return Err(problem);
            }
            let stats = if reused == Reused::None { stats.clone() } else { FrameStats::default() };
            let total_seconds = start.elapsed().as_secs_f64();
            watch(Event::Written(Box::new(Report { frame: making.frame, file, reused, stats, total_seconds })));
            reused = Reused::Copy;
        }
    }
    Ok(())
}

fn encode(film: &Film, render: &Render, notes: &Notes, file: &Path) -> Result<Vec<u8>, String> {
    if is_exr(file) {
        return encode_exr(film, render, notes);
    }
    encode_png(film, render, notes).map_err(|e| e.to_string())
}

/// Sees to it that a file can hold what the settings ask for.
///
/// # Errors
/// What it cannot hold, and which file could.
pub fn suits(render: &Render, file: &Path) -> Result<(), Diagnostic> {
    let png = || {
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        format!("write an EXR file, as in -o {name}.exr or -o 'folder/f.####.exr'")
    };
    let wrong = |what: String, help: String| Err(Diagnostic::error(what).help(help).because(Cause::Usage));
    if is_exr(file) {
        return Ok(());
    }
    if !render.aovs.is_empty() {
        let list: Vec<&str> = render.aovs.iter().map(|aov| aov.name()).collect();
        let what = format!("a PNG file cannot hold the layers of `aovs`: {}", list.join(", "));
        return wrong(what, png() + ", or leave them out with --aovs none");
    }
    if render.bit_depth == 32 {
        return wrong("a PNG file has 8 or 16 bits per channel, not 32".into(), png());
    }
    Ok(())
}

/// The manifest knows of the file before it has its name, so that a kill between the two loses nothing.
fn write(manifest: Option<&Manifest>, making: &Making, file: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
    output::write_after(file, bytes, || manifest.map_or(Ok(()), |manifest| manifest.add(file, making, bytes)))
}

/// What a picture says of its making: nothing of the machine, the time, or the way it was found.
fn notes(making: &Making, stats: &FrameStats, render: &Render) -> Notes {
    let mut notes = making_notes(making);
    notes.push(("Seed".into(), stats.seed.to_string()));
    notes.push(("Settings".into(), settings_note(render)));
    notes
}
