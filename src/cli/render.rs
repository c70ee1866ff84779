//! `anim render`: frames of a script, or one picture of a scene.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use serde_json::json;

use super::progress::{Mode, Progress};
use super::{Exit, InputArguments, exit_code, film, frames, print, say, say_printed, usage};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, suggestion};
use crate::base::limits;
use crate::components::{Accel, Aov, Integrator};
use crate::output::{FileState, FilmFormat, names};
use crate::shot::plan::Plan;
use crate::shot::run::{self, Event, FrameSource, Report, ReusePolicy};
use crate::shot::{self, Overrides, Shot};
use crate::trace::simd::Width;

/// Which frames, how they look, and where they go: what decides the plan.
#[derive(clap::Args)]
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

/// Settings over those of the scene and the script.
#[derive(Clone, clap::Args)]
pub struct LookArguments {
    /// Width and height in pixels, over the scene's
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Render a part of each frame only: left, top, width and height in pixels. It is equal to the same part of the whole;
    /// a PNG holds the part alone, an EXR says where in the frame it lies
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    region: Option<Region>,
    /// Samples per pixel, over the scene's; rounded down to a square
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=limits::SAMPLES as i64))]
    spp: Option<u32>,
    /// Seed of all sampling [default: follows from the camera's pose]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Side of the squares that point lights are widened to, over the scene's; gives soft shadows
    #[arg(long, value_name = "LENGTH")]
    light_size: Option<f64>,
    /// whitted, distribution, path or photon
    #[arg(long, value_name = "NAME", value_parser = |s: &str| Integrator::parse(s).ok_or_else(|| choices(Integrator::NAMES)))]
    integrator: Option<Integrator>,
    /// auto, bvh, grid or brute; the pictures do not depend on it
    #[arg(long, value_name = "NAME", value_parser = |s: &str| Accel::parse(s).ok_or_else(|| choices(Accel::NAMES)))]
    accel: Option<Accel>,
    /// Bits per channel of the picture: 8 or 16 of a PNG, 32 for floats instead of halves in an EXR
    #[arg(long, value_name = "BITS", value_parser = parse_depth)]
    depth: Option<u32>,
    /// Layers beside the colours of an EXR file, over the scene's: depth, normal, albedo, position, entity, material,
    /// motion, variance; `none` for none
    #[arg(long, value_name = "LIST", value_parser = parse_aovs)]
    aovs: Option<Aovs>,
    /// Filter noise out of the finished picture
    #[arg(long)]
    denoise: bool,
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
            threads: None,
            stats: None,
            progress,
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
            (self.threads.is_some(), "--threads"),
            (self.stats.is_some(), "--stats"),
        ];
        given.into_iter().find(|(given, _)| *given).map(|(_, flag)| flag)
    }
}

impl LookArguments {
    /// Whether any setting was given.
    pub fn is_given(&self) -> bool {
        self.overrides() != Overrides::default()
    }

    pub fn overrides(&self) -> Overrides {
        Overrides {
            size: self.size,
            region: self.region.map(|region| region.0),
            samples: self.spp,
            seed: self.seed,
            integrator: self.integrator,
            accel: self.accel,
            light_size: self.light_size,
            bit_depth: self.depth,
            aovs: self.aovs.as_ref().map(|aovs| aovs.0.clone()),
            denoise: self.denoise.then_some(true),
        }
    }
}

#[derive(clap::Args)]
#[command(after_help = "Frames that lie finished under their names are kept; what an edit changed is rendered.

Examples:
  anim render show.rhai --frames 1-48x4 --spp 4      a quick look at every fourth frame
  anim render show.rhai -D aperture=0.2 -o wide      a parameter of the script, another folder
  anim render show.rhai -o 'out/f.######.png'        six digits
  anim render show.rhai --shard 2/3                  the second third, on the second of three machines
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
    /// Worker threads; the pictures do not depend on them [default: one per core]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Print what each frame cost, one JSON object a line
    #[arg(long, value_name = "FORMAT", value_parser = ["json"])]
    stats: Option<String>,
    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value = "auto")]
    progress: Mode,
}

impl RenderArguments {
    pub fn threads(&self) -> Option<usize> {
        self.threads
    }
}

fn choices(names: &[&str]) -> String {
    format!("expected {}", names.join(", ").to_lowercase())
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let size: [u32; 2] = parts.ok_or("expected WIDTHxHEIGHT, as in 640x360")?;
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    if size.iter().any(|s| !(1..=limits::FRAME_SIDE).contains(s)) || pixels > limits::FRAME_PIXELS {
        return Err(format!("sides go from 1 to {}, and at most {} pixels", limits::FRAME_SIDE, limits::FRAME_PIXELS));
    }
    Ok(size)
}

/// The four numbers of `--region`; a type of its own, since clap takes a list for an argument that is repeated.
#[derive(Clone, Copy)]
struct Region([u32; 4]);

fn parse_region(text: &str) -> Result<Region, String> {
    let numbers: Vec<u32> = text.split(',').map_while(|number| number.trim().parse().ok()).collect();
    let whole = <[u32; 4]>::try_from(numbers).ok().filter(|_| text.split(',').count() == 4);
    let [x, y, width, height] = whole.ok_or("expected X,Y,WIDTH,HEIGHT in pixels, as in 0,0,320,180")?;
    if width == 0 || height == 0 {
        return Err("a region has one pixel at least".into());
    }
    Ok(Region([x, y, width, height]))
}

/// What files of a part of frames are called, so that they do not take the place of whole ones.
fn name_of_part(name: &str, look: &LookArguments) -> String {
    match look.region {
        Some(Region([x, y, width, height])) => format!("{name}.region-{x}-{y}-{width}-{height}"),
        None => name.to_string(),
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

fn parse_depth(text: &str) -> Result<u32, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        "32" => Ok(32),
        _ => Err("expected 8, 16 or 32".into()),
    }
}

/// The list of `--aovs`; a type of its own, since clap takes a `Vec` for an argument that is repeated.
#[derive(Clone)]
struct Aovs(Vec<Aov>);

fn parse_aovs(text: &str) -> Result<Aovs, String> {
    if text.eq_ignore_ascii_case("none") {
        return Ok(Aovs(Vec::new()));
    }
    let one = |word: &str| {
        Aov::parse(word.trim()).ok_or_else(|| {
            let near = suggestion(word, Aov::NAMES.iter().copied()).map_or(String::new(), |help| format!("; {help}"));
            format!("`{word}` is none of {}{near}", Aov::NAMES.join(", ").to_lowercase())
        })
    };
    text.split(',').map(one).collect::<Result<_, _>>().map(Aovs)
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
    let (mut shot, warnings) = shot::open_with(&arguments.input.input, options)?;
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
    let cancel = on_interrupt()?;
    let (mut shot, plan) = plan(&arguments.wanted, &cancel)?;
    render(&arguments, &mut shot, plan, &cancel, &|_| {})
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
    let policy = ReusePolicy { reuse: !arguments.no_reuse, memory: arguments.reuse_memory };
    let wanted = plan.frames.len();
    let kept = plan.frames.iter().filter(|planned| planned.state == FileState::Done).count();
    let progress = Progress::new(arguments.progress, wanted - kept - plan.mistakes().count());
    let written = AtomicUsize::new(0);
    let watch = |event: Event| match event {
        Event::Tiles { frame, done, total } => progress.tiles(frame, done, total),
        Event::Written(report) => {
            if report.reused != FrameSource::Cache {
                written.fetch_add(1, Ordering::Relaxed);
                progress.written(report.frame, &report.file.to_string_lossy());
            }
            if arguments.stats.is_some() {
                print(&format!("{}\n", stats(&report)));
            }
            finished(report.frame);
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

/// A flag that the first interrupt raises; the second ends the program at once.
pub fn on_interrupt() -> Result<Arc<AtomicBool>, Diagnostics> {
    let cancel = Arc::new(AtomicBool::new(false));
    let raised = cancel.clone();
    let handler = move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(Exit::Interrupted as i32);
        }
    };
    ctrlc::set_handler(handler).map_err(|e| Diagnostic::error(format!("cannot listen for interrupts: {e}")))?;
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
