//! Rendering the frames of a plan that are not there yet, and writing them.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Instant;

use rustc_hash::FxHashMap;

use super::Shot;
use super::bands::{self, BandedFrame, FrameSize};
use super::checkpoints;
use super::moments;
use super::plan::{Plan, PlannedFrame};
use super::reuse::ReuseCache;
pub use super::reuse::ReusePolicy;
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, ranges};
use crate::base::digest::Digest;
use crate::base::{files, limits};
use crate::components::Render;
use crate::film::Film;
use crate::output::manifest::Manifest;
use crate::output::{
    self, FileState, Format, Metadata, Provenance, WriteFailure, frame_metadata, provenance_metadata, with_whole,
};
use crate::systems::{self, FrameStats, PartialFrame};

/// What happens while a shot is rendered.
pub enum Event {
    /// Tiles of a frame that are done, out of all of its tiles.
    Tiles {
        /// Number of the frame, from 1.
        frame: u32,
        /// How many are done.
        done: usize,
        /// How many there are.
        total: usize,
    },
    /// A frame's file is whole.
    Written(Box<Report>),
    /// A frame could not be rendered or written.
    Failed(Box<FailedFrame>),
}

/// Frames that are to be made next.
pub struct Batch<'a> {
    /// The frames with what is there of them.
    pub frames: Cow<'a, [PlannedFrame]>,
    /// Files of frames elsewhere that are done, by what they show.
    pub done: Vec<(Digest, PathBuf)>,
}

/// Gives the next frames to make; `None` if there are no more.
pub type NextBatch<'a, 'plan> = &'a mut dyn FnMut() -> Result<Option<Batch<'plan>>, Diagnostics>;

/// Where a frame's pixels are from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameSource {
    /// Traced for this frame.
    None,
    /// The file was there and is the frame.
    Cache,
    /// From another frame that is the same.
    Copy,
}

impl FrameSource {
    /// The word for it in reports.
    pub fn word(self) -> &'static str {
        match self {
            FrameSource::None => "none",
            FrameSource::Cache => "cache",
            FrameSource::Copy => "copy",
        }
    }
}

/// One frame whose file is whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Its number, from 1.
    pub frame: u32,
    /// Where it is.
    pub file: PathBuf,
    /// Where its pixels are from.
    pub reused: FrameSource,
    /// What it cost; nothing, if it was not traced.
    pub stats: FrameStats,
    /// From the frame's edits to its whole file.
    pub total_seconds: f64,
}

/// How a run ended.
#[derive(Debug, Default)]
pub struct RunOutcome {
    /// `cancel` was raised; only whole frames are there.
    pub cancelled: bool,
    /// Frames that could be planned and not be rendered or written.
    pub failed: Vec<FailedFrame>,
}

/// A frame, from 1, and why it is not there.
pub type FailedFrame = (u32, Diagnostics);

/// A rendered picture on its way to the files of all frames that show it.
struct RenderedFrame {
    frames: Vec<(Provenance, PathBuf)>,
    /// The hash of the whole frame, of a tile.
    whole: Option<Digest>,
    content: FrameContent,
    render: Render,
    stats: FrameStats,
    start: Instant,
}

/// A picture before it is written.
enum FrameContent {
    /// Means of samples.
    Film(Box<Film>),
    /// The file of the first of its frames: it was made in bands.
    Encoded(Vec<u8>),
}

type Watch<'a> = &'a (dyn Fn(Event) + Sync);

/// Renders and writes what the plan says is not done. `watch` is called from several threads.
///
/// A frame that cannot be rendered or written does not keep the others from it.
///
/// # Errors
/// No file can be written, or files that were written are gone: what is there by then is whole.
pub fn run(
    shot: &mut Shot,
    plan: &Plan,
    policy: ReusePolicy,
    cancel: &AtomicBool,
    watch: Watch,
) -> Result<RunOutcome, Diagnostics> {
    let mut all = Some(Batch { frames: Cow::Borrowed(&plan.frames[..]), done: Vec::new() });
    let ending = run_batches(shot, plan, &mut || Ok(all.take()), policy, cancel, watch)?;
    if !ending.cancelled {
        check_that_all_are_there(plan, &ending.failed)?;
    }
    Ok(ending)
}

/// As [`run`], of frames that are chosen while it goes on. Nothing is kept from one batch to the next.
///
/// # Errors
/// As [`run`], and those of `next`.
pub fn run_batches(
    shot: &mut Shot,
    plan: &Plan,
    next: NextBatch,
    policy: ReusePolicy,
    cancel: &AtomicBool,
    watch: Watch,
) -> Result<RunOutcome, Diagnostics> {
    output::sweep(&plan.folder());
    if let Some(folder) = plan.target.folder() {
        checkpoints::save(&shot.input, &folder, plan.frames.iter().map(|planned| planned.frame));
    }
    let failed = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel::<RenderedFrame>(1);
        let writer = std::thread::Builder::new()
            .spawn_scoped(scope, || write_all(receive, plan.manifest.as_ref(), watch, &failed))
            .map_err(|e| Diagnostic::error(format!("cannot start the writer of frames: {e}")).because(Cause::Io))?;
        let mut ending = RunOutcome::default();
        let stopped = render_batches(shot, plan, next, policy, cancel, watch, &mut ending, &|rendered| {
            // The writer only hangs up after a failure, which it reports itself.
            let is_heard = !failed.load(Ordering::Relaxed);
            if is_heard {
                let _ = send.send(rendered);
            }
            is_heard
        });
        drop(send);
        let written = writer.join().unwrap_or_else(|_| Err(Diagnostic::error("the writer of frames failed")));
        ending.failed.extend(written.map_err(Diagnostics::from)?);
        stopped?;
        ending.failed.sort_by_key(|(frame, _)| *frame);
        Ok(ending)
    })
}

/// Renders batch after batch and hands frames to the writer, until it does not listen.
#[allow(clippy::too_many_arguments, reason = "the parts of one run, which are of no use together elsewhere")]
fn render_batches(
    shot: &mut Shot,
    plan: &Plan,
    next: NextBatch,
    policy: ReusePolicy,
    cancel: &AtomicBool,
    watch: Watch,
    ending: &mut RunOutcome,
    write: &dyn Fn(RenderedFrame) -> bool,
) -> Result<(), Diagnostics> {
    let source = shot.source.clone();
    let fail = |ending: &mut RunOutcome, frame: u32, problems: &Diagnostics| {
        ending.failed.push((frame, problems.clone()));
        watch(Event::Failed(Box::new((frame, problems.clone()))));
    };
    while let Some(batch) = next()? {
        for planned in batch.frames.iter().filter(|planned| planned.state == FileState::Done) {
            watch(report(planned, FrameSource::Cache, Instant::now()));
        }
        let (distinct, uncopied) = copy_what_is_done(plan, &batch, &source, watch)?;
        uncopied.iter().for_each(|(frame, problems)| fail(ending, *frame, problems));
        if let Some(first) = distinct.first() {
            output::probe(&first[0].file)?;
        }
        let mut reuse_cache = ReuseCache::new(policy);
        for (index, frames) in distinct.iter().enumerate() {
            match render_frame(shot, &distinct, index, &mut reuse_cache, cancel, watch) {
                Ok(Some(rendered)) => {
                    if !write(rendered) {
                        return Ok(());
                    }
                }
                Ok(None) => {
                    ending.cancelled = true;
                    return Ok(());
                }
                Err(problems) => {
                    reuse_cache.forget_tiles();
                    frames.iter().for_each(|planned| fail(ending, planned.frame, &problems));
                }
            }
        }
    }
    Ok(())
}

/// A folder may be deleted while frames are written into it.
fn check_that_all_are_there(plan: &Plan, failed: &[FailedFrame]) -> Result<(), Diagnostic> {
    let has_failed = |frame: u32| failed.iter().any(|(number, _)| *number == frame);
    let wanted = plan.frames.iter().filter(|planned| planned.fingerprint.is_ok() && !has_failed(planned.frame));
    let gone: Vec<&PlannedFrame> = wanted.filter(|planned| !planned.file.is_file()).collect();
    let Some(first) = gone.first() else { return Ok(()) };
    let numbers: Vec<u32> = gone.iter().map(|planned| planned.frame).collect();
    let message = format!("{} was written and is gone (of frames {})", first.file.display(), ranges(&numbers));
    Err(Diagnostic::error(message).because(Cause::Io).help("was its folder deleted meanwhile? run again"))
}

fn report(planned: &PlannedFrame, reused: FrameSource, start: Instant) -> Event {
    let (frame, file, stats) = (planned.frame, planned.file.clone(), FrameStats::default());
    Event::Written(Box::new(Report { frame, file, reused, stats, total_seconds: start.elapsed().as_secs_f64() }))
}

/// Frames to be rendered, equal ones together, and those that could not be copied.
type LeftToRender<'a> = (Vec<Vec<&'a PlannedFrame>>, Vec<FailedFrame>);

/// Writes the frames that are the same as one that is done; gives the others.
fn copy_what_is_done<'a>(
    plan: &Plan,
    batch: &'a Batch,
    source: &str,
    watch: Watch,
) -> Result<LeftToRender<'a>, Diagnostic> {
    let good = || batch.frames.iter().filter(|planned| planned.fingerprint.is_ok());
    let done = good().filter(|planned| planned.state == FileState::Done);
    let done = done.map(|planned| (planned.hash, planned.file.as_path()));
    let elsewhere = batch.done.iter().map(|(hash, file)| (*hash, file.as_path()));
    let done: FxHashMap<Digest, &Path> = done.chain(elsewhere).collect();
    let mut distinct: Vec<Vec<&PlannedFrame>> = Vec::new();
    let mut places: FxHashMap<Digest, usize> = FxHashMap::default();
    let mut failed = Vec::new();
    for planned in good().filter(|planned| planned.state != FileState::Done) {
        let start = Instant::now();
        let provenance = planned.provenance(source);
        if let Some(bytes) = done.get(&planned.hash).and_then(|file| copy_of(file, &provenance)) {
            match write(plan.manifest.as_ref(), &provenance, &planned.file, &bytes) {
                Ok(()) => watch(report(planned, FrameSource::Copy, start)),
                Err(failure) if failure.is_general => return Err(*failure.problem),
                Err(failure) => failed.push((planned.frame, (*failure.problem).into())),
            }
            continue;
        }
        let place = *places.entry(planned.hash).or_insert(distinct.len());
        if place == distinct.len() {
            distinct.push(Vec::new());
        }
        distinct[place].push(planned);
    }
    Ok((distinct, failed))
}

/// The bytes of a frame from the file of one that is the same; `None` if that file is not what it was.
fn copy_of(file: &Path, provenance: &Provenance) -> Option<Vec<u8>> {
    let bytes = files::read_bytes(file, limits::FRAME_FILE_BYTES).ok()?;
    output::relabelled(&bytes, provenance)
}

/// Makes the frame at `index` of the run, from what is kept as far as that goes; `None` if `cancel` was raised.
fn render_frame(
    shot: &mut Shot,
    run: &[Vec<&PlannedFrame>],
    index: usize,
    reuse_cache: &mut ReuseCache,
    cancel: &AtomicBool,
    watch: Watch,
) -> Result<Option<RenderedFrame>, Diagnostics> {
    let start = Instant::now();
    let planned = run[index][0];
    let frames = run[index].iter().map(|planned| (planned.provenance(&shot.source), planned.file.clone())).collect();
    let whole_frame = planned.whole;
    let fingerprint = planned.fingerprint.as_ref().map_err(Clone::clone)?;
    let mix = planned.light_mix.as_deref();
    let factors = mix.map(|mix| mix.factors(&shot.input.base, fingerprint)).unwrap_or_default();
    let mixed = mix.and_then(|mix| Some((mix, reuse_cache.mixed(mix, &factors)?)));
    if let Some((mix, (film, render, stats))) = mixed {
        check_assets(shot)?;
        let render = mix.settings(&shot.input.base, fingerprint, &render);
        let content = FrameContent::Film(film.into());
        return Ok(Some(RenderedFrame { frames, whole: whole_frame, content, render, stats, start }));
    }
    let mut partial = PartialFrame::default();
    if let Some(mix) = mix {
        partial.light_groups = mix.light_groups.clone();
    }
    let frame = planned.frame;
    let progress = |done, total| watch(Event::Tiles { frame, done, total });
    shot.stage.set_frames_left((run.len() - index) as u32);
    let slices = shot.input.slices(frame)?;
    let settings = bands::settings_of(&slices, &shot.input.settings).clone();
    let slices = moments::refined(slices, settings.parts_of_moment());
    let size = bands::size_of_frame(&settings, factors.len() + 1);
    if size != FrameSize::Huge {
        reuse_cache.lend(shot, run, index, &mut partial);
    }
    // Where slices or photons are many, each band would have to make them again.
    let is_at_one_go = mix.is_none() && slices.len() == 1 && settings.turns(1) == 1;
    let in_bands = match size {
        FrameSize::Usual => false,
        FrameSize::Large => is_at_one_go && partial.tile_cache.is_none(),
        FrameSize::Huge => true,
    };
    if in_bands {
        let light_groups = std::mem::take(&mut partial.light_groups);
        let (provenance, file) = (&planned.provenance(&shot.source), planned.file.as_path());
        let banded =
            BandedFrame { frame, slices, settings, light_groups, factors, provenance, whole: whole_frame, file };
        let made = bands::render(shot, &banded, format_of(file)?, cancel, &progress)?;
        check_assets(shot)?;
        let rendered = made.map(|(bytes, stats)| {
            let (content, render) = (FrameContent::Encoded(bytes), banded.settings.clone());
            RenderedFrame { frames, whole: whole_frame, content, render, stats, start }
        });
        return Ok(rendered);
    }
    let (mut render, mut whole) = (Render::default(), true);
    let Shot { stage, input, .. } = shot;
    input.with_slices(stage, frame, slices, |stage, share| {
        super::files::load_all(stage)?;
        render = stage.settings();
        whole = systems::render_samples(stage, share, &mut partial, cancel, &progress)?;
        Ok(whole)
    })?;
    check_assets(shot)?;
    if !whole {
        return Ok(None);
    }
    reuse_cache.take_back(run, index, &mut partial);
    let (films, stats) = partial.resolve()?;
    let (first, others) = films.split_first().ok_or_else(|| Diagnostic::bug("a frame has a film at least"))?;
    let film = systems::weighted_sum(first, others, &factors);
    if let Some(mix) = mix {
        reuse_cache.keep_light_groups(mix, films, &render, stats.seed, &run[index + 1..]);
    }
    let content = FrameContent::Film(film.into());
    Ok(Some(RenderedFrame { frames, whole: whole_frame, content, render, stats, start }))
}

fn check_assets(shot: &Shot) -> Result<(), Diagnostics> {
    let Some(name) = shot.input.base.changed_asset() else { return Ok(()) };
    let message = format!("`{name}` changed while its frames were rendered");
    Err(Diagnostic::error(message).because(Cause::Io).help("run again").into())
}

fn write_all(
    pictures: Receiver<RenderedFrame>,
    manifest: Option<&Manifest>,
    watch: Watch,
    failed: &AtomicBool,
) -> Result<Vec<FailedFrame>, Diagnostic> {
    let mut unwritten = Vec::new();
    for RenderedFrame { frames, whole, content, render, stats, start } in pictures {
        let mut reused = FrameSource::None;
        for (provenance, file) in frames {
            let metadata = with_whole(frame_metadata(&provenance, stats.seed, &render), whole);
            let encoded = match &content {
                FrameContent::Film(film) => encode(film, &render, &metadata, &file).map(Cow::Owned),
                FrameContent::Encoded(bytes) if reused == FrameSource::None => Ok(Cow::Borrowed(bytes.as_slice())),
                FrameContent::Encoded(bytes) => relabel(bytes, &provenance, &file).map(Cow::Owned),
            };
            let written = encoded
                .map_err(|problem| WriteFailure { problem: problem.into(), is_general: false })
                .and_then(|bytes| write(manifest, &provenance, &file, &bytes));
            match written {
                Ok(()) => {}
                Err(failure) if failure.is_general => {
                    failed.store(true, Ordering::Relaxed);
                    return Err(*failure.problem);
                }
                Err(failure) => {
                    let problems = Diagnostics::from(*failure.problem);
                    unwritten.push((provenance.frame, problems.clone()));
                    watch(Event::Failed(Box::new((provenance.frame, problems))));
                    continue;
                }
            }
            let stats = if reused == FrameSource::None { stats.clone() } else { FrameStats::default() };
            let total_seconds = start.elapsed().as_secs_f64();
            watch(Event::Written(Box::new(Report { frame: provenance.frame, file, reused, stats, total_seconds })));
            reused = FrameSource::Copy;
        }
    }
    Ok(unwritten)
}

/// The bytes of a frame's file.
///
/// # Errors
/// What the format cannot hold.
pub fn encode(film: &Film, render: &Render, metadata: &Metadata, file: &Path) -> Result<Vec<u8>, Diagnostic> {
    let failed = |why: String| Diagnostic::error(format!("cannot encode {}: {why}", file.display())).because(Cause::Io);
    (format_of(file)?.encode)(film, render, metadata).map_err(failed)
}

/// The file of another frame with the same pixels, made from the first one that was encoded.
fn relabel(bytes: &[u8], provenance: &Provenance, file: &Path) -> Result<Vec<u8>, Diagnostic> {
    let format = format_of(file)?;
    let known = (format.read_header)(bytes).ok().map(|header| header.metadata);
    let changed = provenance_metadata(provenance);
    let relabelled = known.and_then(|known| (format.relabel)(bytes, &known, &changed));
    relabelled.ok_or_else(|| Diagnostic::bug("a file that was just encoded cannot be read"))
}

/// Sees to it that a file can hold what the settings ask for.
///
/// # Errors
/// What it cannot hold, and which file could.
pub fn check_settings(render: &Render, file: &Path) -> Result<(), Diagnostic> {
    format_of(file)?.check_settings(render, file)
}

fn format_of(file: &Path) -> Result<&'static Format, Diagnostic> {
    let unknown = || format!("{}: pictures are written as {}", file.display(), Format::known_extensions());
    Format::of_path(file).ok_or_else(|| Diagnostic::error(unknown()).because(Cause::Usage))
}

/// The manifest knows of the file before it has its name, so that a kill between the two loses nothing.
fn write(manifest: Option<&Manifest>, provenance: &Provenance, file: &Path, bytes: &[u8]) -> Result<(), WriteFailure> {
    output::write_after(file, bytes, || manifest.map_or(Ok(()), |manifest| manifest.add(file, provenance, bytes)))
}
