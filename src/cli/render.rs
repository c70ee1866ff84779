//! `anim render`: frames of a script, or one picture of a scene.

mod look;
mod shared;
mod tiles;

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::json;

pub use look::LookArguments;
use look::name_of_part;

use super::progress::{Mode, Progress};
use super::{Exit, InputArguments, exit_code, film, frames, print, say, say_printed, usage};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, Severity};
use crate::base::limits;
#[cfg(feature = "preview")]
use crate::base::project::Project;
use crate::output::{FileState, FilmFormat, names};
use crate::shot::plan::Plan;
use crate::shot::run::{self, Event, FrameSource, Report, ReusePolicy};
use crate::shot::{self, Shot, advice};
use crate::trace::simd::Width;

/// Which frames, how they look, and where they go: what decides the plan.
#[derive(Clone, clap::Args)]
pub struct FrameArguments {
    #[command(flatten)]
    pub input: InputArguments,
    /// Which frames: numbers, ranges and steps, as in 1-10,20,30-60x5 [default: all]
    #[arg(long, value_name = "LIST")]
    pub frames: Option<String>,
    /// The i-th of n parts of these frames, of about the same cost; together the parts are the whole
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub shard: Option<[u32; 2]>,
    /// A folder, a pattern with #### for the number, or a file; a film if its name ends so [default: frames/NAME]
    #[arg(short, long, value_name = "PLACE")]
    pub out: Option<String>,
    #[command(flatten)]
    pub look: LookArguments,
}

impl RenderArguments {
    /// Rendering of frames for something else, which says nothing of single ones.
    pub fn quiet(wanted: FrameArguments, force: bool, progress: Mode) -> Self {
        let reuse_memory = limits::REUSE_MEMORY;
        RenderArguments {
            wanted,
            force,
            overwrite: false,
            no_reuse: false,
            reuse_memory,
            tiles: None,
            claims: false,
            expect: None,
            threads: None,
            stats: None,
            progress,
            quiet: true,
        }
    }

    /// A flag that was given and only makes sense where something is rendered.
    pub fn first_that_renders(&self) -> Option<&'static str> {
        let FrameArguments { input, shard, look, .. } = &self.wanted;
        let given = [
            (!input.defines.is_empty(), "-D"),
            (input.strict, "--strict"),
            (shard.is_some(), "--shard"),
            (look.is_given(), "a setting such as --size"),
            (self.force, "--force"),
            (self.no_reuse, "--no-reuse"),
            (self.tiles.is_some(), "--tiles"),
            (self.claims, "--claims"),
            (self.expect.is_some(), "--expect"),
            (self.threads.is_some(), "--threads"),
            (self.stats.is_some(), "--stats"),
        ];
        given.into_iter().find(|(given, _)| *given).map(|(_, flag)| flag)
    }
}

#[derive(clap::Args)]
#[command(after_help = "Frames that lie finished under their names are kept; what an edit changed is rendered.

Examples:
  anim render show.rhai --frames 1-48x4 --spp 4      a quick look at every fourth frame
  anim render show.rhai -D aperture=0.2 -o wide      a parameter of the script, another folder
  anim render show.rhai -o 'out/f.######.png'        six digits
  anim render show.rhai --shard 2/3                  the second third, on the second of three machines
  anim render show.rhai --shard 2/3 --claims         the same; when it is done, it helps the others
  anim render scene.p3f --size 1024x768 --depth 16   a still in 16 bits
  anim render scene.p3f --region 100,80,64,48        a part of it, equal to that of the whole
  anim render scene.ron -o still.exr --aovs depth,normal   linear values, with layers
  anim render show.rhai -o show.mp4                  a film of the frames: see anim help film")]
pub struct RenderArguments {
    #[command(flatten)]
    pub wanted: FrameArguments,
    /// Render every frame, whatever is there already
    #[arg(long)]
    force: bool,
    /// Write over files that are no pictures of this script or scene
    #[arg(long)]
    overwrite: bool,
    /// Trace every frame by itself, whatever it shares with others; the pictures are the same
    #[arg(long)]
    no_reuse: bool,
    /// Memory for what is kept from frame to frame; the pictures do not depend on it
    #[arg(long, value_name = "MIB", default_value_t = limits::REUSE_MEMORY, value_parser = clap::value_parser!(u64).range(0..=1 << 24))]
    reuse_memory: u64,
    /// Render the i-th of n parts of each frame, to an EXR file; `anim merge` joins them to the bytes of the whole
    #[arg(long, value_name = "I/N", value_parser = parse_shard, conflicts_with = "region")]
    tiles: Option<[u32; 2]>,
    /// Share the folder with other workers: claim frames before they are rendered, so that each is rendered once; with
    /// --shard, the own part comes first, then what nobody has claimed of the others
    #[arg(long)]
    pub claims: bool,
    /// Refuse to render if the plan of these frames is another one than this, as after an edit or with another version;
    /// `anim plan --json --tasks N` and the jobs of `anim farm` name it
    #[arg(long, value_name = "PLAN")]
    pub expect: Option<String>,
    /// Worker threads; the pictures do not depend on them [default: one per core]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Print what each frame cost, one JSON object a line
    #[arg(long, value_name = "FORMAT", value_parser = ["json"])]
    stats: Option<String>,
    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value = "auto")]
    progress: Mode,
    /// Say nothing of what is most likely not meant: settings that count for nothing, no light, nothing that moves
    #[arg(long, conflicts_with = "strict")]
    quiet: bool,
}

impl RenderArguments {
    /// Whether parts of frames are wanted.
    pub fn is_tile(&self) -> bool {
        self.tiles.is_some()
    }

    pub fn threads(&self) -> Option<usize> {
        self.threads
    }
}

fn parse_shard(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some([i.parse().ok()?, n.parse().ok()?]));
    let [i, n]: [u32; 2] = parts.ok_or("expected I/N, as in 2/3")?;
    if i == 0 || i > n || n > limits::FRAMES {
        return Err(format!("shards of {n} are numbered from 1 to {n}"));
    }
    Ok([i, n])
}

pub fn parse_threads(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| (1..=limits::THREADS).contains(n));
    number.ok_or_else(|| format!("expected a number from 1 to {}", limits::THREADS))
}

/// Opens the input and plans the frames that were asked for, without looking at what is there.
pub fn plan(arguments: &FrameArguments, cancel: &AtomicBool) -> Result<(Shot, Plan), Diagnostics> {
    plan_into(arguments, arguments.out.as_deref(), cancel)
}

/// As [`plan`], with frames that go to another place than `-o` says.
pub fn plan_into(
    arguments: &FrameArguments,
    out: Option<&str>,
    cancel: &AtomicBool,
) -> Result<(Shot, Plan), Diagnostics> {
    let options = arguments.input.options(arguments.look.overrides())?;
    plan_opened(arguments, out, cancel, super::open(&arguments.input.input, options)?)
}

/// As [`plan_into`], in a project that is known.
#[cfg(feature = "preview")]
pub fn plan_in(
    arguments: &FrameArguments,
    out: Option<&str>,
    cancel: &AtomicBool,
    project: Arc<Project>,
) -> Result<(Shot, Plan), Diagnostics> {
    let options = arguments.input.options(arguments.look.overrides())?;
    plan_opened(arguments, out, cancel, shot::open_in(&arguments.input.input, options, project)?)
}

fn plan_opened(
    arguments: &FrameArguments,
    out: Option<&str>,
    cancel: &AtomicBool,
    (mut shot, warnings): (Shot, Diagnostics),
) -> Result<(Shot, Plan), Diagnostics> {
    say(&warnings);
    let count = shot.frames();
    let wanted = match &arguments.frames {
        Some(list) => frames::parse(list, count).map_err(usage)?,
        None => (1..=count).collect(),
    };
    let name = name_of_part(&shot.name, &arguments.look);
    let target = names::resolve(out, &name, shot.is_sequence().then_some(count), wanted.len()).map_err(usage)?;
    let plan = shot::plan::make_until(&mut shot, &wanted, target, cancel);
    say_printed(&shot, arguments.input.log.as_deref())?;
    let mut plan = plan?;
    if let Some([i, n]) = arguments.shard {
        plan.keep_shard(i, n);
    }
    Ok((shot, plan))
}

/// Does work on as many threads as the user asks for.
pub fn on_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> Result<T, Diagnostics> + Send,
) -> Result<T, Diagnostics> {
    let Some(threads) = threads else { return work() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| {
        let problem = Diagnostic::error(format!("cannot start {threads} worker threads: {e}"));
        Diagnostics::from(problem.because(Cause::Io).help("--threads 1 takes the fewest"))
    })?
    .install(work)
}

pub fn run(arguments: RenderArguments) -> Result<Exit, Diagnostics> {
    if arguments.wanted.out.as_ref().is_some_and(|out| FilmFormat::of_path(Path::new(out)).is_some()) {
        return film::render(&arguments, &film::FilmOptionArguments::default());
    }
    let rendered = render_frames(&arguments);
    if let Err(problems) = &rendered {
        Progress::fail(arguments.progress, problems);
    }
    rendered
}

fn render_frames(arguments: &RenderArguments) -> Result<Exit, Diagnostics> {
    let cancel = on_interrupt()?;
    if let Some(tile) = arguments.tiles {
        return tiles::render_tile(arguments, tile, &cancel);
    }
    let whole = FrameArguments { shard: None, ..arguments.wanted.clone() };
    let (mut shot, mut plan) = plan(&whole, &cancel)?;
    if let Some(expected) = &arguments.expect {
        expect_plan(expected, &plan)?;
    }
    if arguments.claims {
        return shared::render(arguments, &mut shot, plan, &cancel);
    }
    if let Some([i, n]) = arguments.wanted.shard {
        plan.keep_shard(i, n);
    }
    render(arguments, &mut shot, plan, &cancel, &|_| {})
}

/// A job is refused whose frames would not be those that it was written for.
pub fn expect_plan(expected: &str, plan: &Plan) -> Result<(), Diagnostics> {
    let found = plan.digest().to_string();
    if found == expected {
        return Ok(());
    }
    let version = env!("CARGO_PKG_VERSION");
    let message =
        format!("the plan is {found} and not {expected}: other frames than those of the job (anim {version})");
    let help = "the input, its settings or the version of anim have changed since: write the job anew";
    Err(Diagnostic::error(message).help(help).into())
}

/// Renders what is not done. `finished` hears of every frame that is whole, those that were there already too, from
/// several threads.
pub fn render(
    arguments: &RenderArguments,
    shot: &mut Shot,
    mut plan: Plan,
    cancel: &AtomicBool,
    finished: &(dyn Fn(u32) + Sync),
) -> Result<Exit, Diagnostics> {
    plan.inspect(&shot.source);
    if !arguments.overwrite {
        refuse_foreign(&plan)?;
    }
    if arguments.force {
        plan.force();
    }
    say(&plan.summary());
    warn(arguments, shot, &plan)?;
    let policy = ReusePolicy { reuse: !arguments.no_reuse, memory: arguments.reuse_memory };
    let wanted = plan.frames.len();
    let kept = plan.frames.iter().filter(|planned| planned.state == FileState::Done).count();
    let progress = Progress::new(arguments.progress, wanted - kept - plan.mistakes().count());
    let written = AtomicUsize::new(0);
    let watch = |event: Event| {
        if let Some(frame) = show(arguments, &progress, &written, &event) {
            finished(frame);
        }
    };
    let ending = run::run(shot, &plan, policy, cancel, &watch);
    let written = written.into_inner();
    let place = if shot.is_sequence() { plan.folder() } else { plan.target.path(1) };
    progress.end(written, kept, &place.to_string_lossy());
    let ending = ending?;
    let failed = ending.failed.iter().map(|(frame, problems)| (*frame, problems));
    say(&shot::plan::summary(failed, wanted, "failed"));
    if ending.cancelled {
        let there = written + kept;
        say(&Diagnostic::warning(format!("interrupted: {there} of {wanted} frames are there, and whole")).into());
        return Ok(Exit::Interrupted);
    }
    Ok(outcome(&plan, &ending.failed, written + kept))
}

/// Warnings that are shown before frames are rendered.
const WARNINGS: usize = 8;

/// Says what is most likely not meant in what is going to be rendered; with `--strict` that is wrong.
fn warn(arguments: &RenderArguments, shot: &mut Shot, plan: &Plan) -> Result<(), Diagnostics> {
    let is_done = plan.frames.iter().all(|planned| planned.state == FileState::Done);
    if arguments.quiet || is_done {
        return Ok(());
    }
    let mut found = advice::quick_advice(shot, plan);
    let is_warned = found.0.iter().any(|one| one.severity == Severity::Warning);
    if arguments.wanted.input.strict && is_warned {
        return Err(found.refused());
    }
    let more = found.0.len().saturating_sub(WARNINGS);
    found.0.truncate(WARNINGS);
    say(&found);
    if more > 0 {
        super::note(&format!("{more} more warnings: anim check {}", arguments.wanted.input.input.display()));
    }
    Ok(())
}

/// Shows what happens, and gives the number of a frame that is whole now.
fn show(arguments: &RenderArguments, progress: &Progress, written: &AtomicUsize, event: &Event) -> Option<u32> {
    match event {
        Event::Tiles { frame, done, total } => {
            progress.tiles(*frame, *done, *total);
            None
        }
        Event::Failed(_) => None,
        Event::Written(report) => {
            if report.reused != FrameSource::Cache {
                written.fetch_add(1, Ordering::Relaxed);
                progress.written(report.frame, &report.file.to_string_lossy());
            }
            if arguments.stats.is_some() {
                print(&format!("{}\n", stats(report)));
            }
            Some(report.frame)
        }
    }
}

/// What somebody else has made is not written over unasked.
fn refuse_foreign(plan: &Plan) -> Result<(), Diagnostics> {
    let foreign = plan.foreign();
    let Some(first) = foreign.first() else { return Ok(()) };
    let others = if foreign.len() > 1 { format!(", and {} more", foreign.len() - 1) } else { String::new() };
    let entry = plan.manifest.as_ref().and_then(|manifest| manifest.get(first));
    let whose = match entry.and_then(|entry| entry.input.as_deref()) {
        Some(input) => format!("is a picture of {input}"),
        None => "is no picture that anim has made".to_string(),
    };
    let problem = Diagnostic::error(format!("{} is there and {whose}{others}", first.display()));
    Err(problem.because(Cause::Usage).help("name another place with -o, or write over it with --overwrite").into())
}

/// Some frames failed, or nothing could be done at all.
fn outcome(plan: &Plan, failed: &[(u32, Diagnostics)], there: usize) -> Exit {
    let mistakes = plan.mistakes().count();
    match (mistakes + failed.len(), there) {
        (0, _) => Exit::Done,
        (_, 0) if mistakes == 0 => failed.first().map_or(Exit::Failed, |(_, problems)| exit_code(problems)),
        _ => Exit::Failed,
    }
}

/// A flag that the first interrupt raises, the same for whoever asks; the second one ends the program at once.
pub fn on_interrupt() -> Result<Arc<AtomicBool>, Diagnostics> {
    static RAISED: Mutex<Option<Arc<AtomicBool>>> = Mutex::new(None);
    let mut known = RAISED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(cancel) = &*known {
        return Ok(cancel.clone());
    }
    let cancel = Arc::new(AtomicBool::new(false));
    let raised = cancel.clone();
    let handler = move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(Exit::Interrupted as i32);
        }
    };
    ctrlc::set_handler(handler).map_err(|e| Diagnostic::error(format!("cannot listen for interrupts: {e}")))?;
    *known = Some(cancel.clone());
    Ok(cancel)
}

/// One frame's cost as JSON.
fn stats(report: &Report) -> serde_json::Value {
    let (s, c) = (&report.stats, &report.stats.counters);
    json!({
        "frame": report.frame,
        "file": report.file.to_string_lossy(),
        "reused": report.reused.word(),
        "primary_rays": c.primary_rays,
        "primary_hits": c.primary_hits,
        "shadow_rays": c.shadow_rays,
        "shadow_hits": c.shadow_hits,
        "reflection_rays": c.reflection_rays,
        "refraction_rays": c.refraction_rays,
        "diffuse_rays": c.diffuse_rays,
        "photon_rays": c.photon_rays,
        "intersection_tests": c.intersection_tests,
        "steps": c.steps,
        "accel": s.accel,
        "bands": s.bands,
        "simd": Width::detect().name(),
        "builds": s.builds,
        "tiles": s.tiles,
        "tiles_kept": s.tiles_kept,
        "share_kept": s.share_kept,
        "passes": s.passes,
        "passes_kept": s.passes_kept,
        "photon_maps": s.photon_maps,
        "photon_maps_kept": s.photon_maps_kept,
        "reuse_bytes": s.reuse_bytes,
        "seed": s.seed,
        "build_seconds": s.build_seconds,
        "render_seconds": s.render_seconds,
        "total_seconds": report.total_seconds,
        "peak_bytes": peak_bytes(),
    })
}

/// The most memory that the process has held, where the system says so.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
