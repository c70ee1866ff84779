//! `anim farm`: jobs for schedulers.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::{Subcommand, ValueEnum};

use super::render::{self, FrameArguments};
use super::{Exit, print, say, usage};
use crate::base::clock;
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::farm::archive::is_archive;
use crate::farm::job::{FarmJob, TaskPlan, absolute};
use crate::farm::openjd::{self, OpenJdOptions, WorkerSystem};
use crate::farm::slurm::{self, SlurmOptions};
use crate::farm::{frame_list, make, quote};
use crate::output;
use crate::output::names::Target;
use crate::shot::Shot;
use crate::shot::plan::Plan;
use crate::shot::run::{self, ReusePolicy};

#[derive(clap::Args)]
#[command(
    after_help = "Frames are pure: any machine makes the same bytes, in any order, so that a task that was lost is only started again. Each \
            of these commands writes a text that you can read and change; nothing is submitted.

  anim farm slurm show.rhai --tasks 12 -o /shared/frames/     then: bash show.slurm.sh
  anim farm openjd show.rhai --tasks 12                       then: openjd run show.openjd.yaml --step Render
  anim farm make show.rhai --tasks 8                          then: make -f show.mk -j4
  anim farm make show.rhai --tasks 8 --to build.ninja         then: ninja
  anim plan show.rhai --json --tasks 12                       the same as data, for any other queue

Settings (--size, --spp, -D, ...) and frames are those of `anim render`, and are written into the job. Paths become \
            absolute: machines must see the input and the output under the same names. Where they do not, pack the input \
            (`anim pack`) and send the archive; frames come back as files. `anim guide farm` tells the whole story."
)]
pub struct FarmArguments {
    #[command(subcommand)]
    engine: FarmEngine,
}

#[derive(Subcommand)]
enum FarmEngine {
    /// A job script for Slurm: an array of tasks of about the same cost, and a last job that checks the frames
    #[command(
        after_help = "The script says of each task which frames are in it. It asks for the cores and the memory that the plan estimates. A \
            task that is preempted, or whose time is over, stops at a whole frame and goes back into the queue. Tasks claim frames, \
            so that one that is done early helps the others, and what a lost one leaves is taken over.

Examples:
  anim farm slurm show.rhai --tasks 100 --throttle 20 -o /shared/show/
  anim farm slurm show.rhai --minutes-per-task 10 --partition cpu --film /shared/show.mp4
  anim farm slurm show.rhai --tasks 40 --scratch '$TMPDIR' --sbatch=--exclusive"
    )]
    Slurm(Box<SlurmArguments>),
    /// A template of Open Job Description (2023-09), as AWS Deadline Cloud runs it
    #[command(after_help = "Parameters of the template: Input, Output, Frames, Tasks, Width, Height, Samples, Anim.

Examples:
  anim farm openjd show.rhai --tasks 20
  anim farm openjd show.rhai --chunk-seconds 600    for schedulers that make chunks (TASK_CHUNKING)
  anim farm openjd show.rhai --for windows")]
    Openjd(Box<OpenJdArguments>),
    /// Rules for GNU make, or for ninja if --to ends in .ninja: one for each task
    Make(Box<MakeArguments>),
}

/// Which frames, in how many tasks, and where the job is written.
#[derive(clap::Args)]
struct JobArguments {
    #[command(flatten)]
    wanted: FrameArguments,
    /// Into how many tasks of about the same cost the frames go [default: 10, or a frame each if there are fewer]
    #[arg(long, value_name = "N", conflicts_with = "minutes_per_task", value_parser = clap::value_parser!(u32).range(1..=limits::FRAMES as i64))]
    tasks: Option<u32>,
    /// How long a task is to take; three small frames are rendered to tell how fast this machine is
    #[arg(long, value_name = "MINUTES", value_parser = parse_minutes)]
    minutes_per_task: Option<f64>,
    /// Cores of a task [default: as many as its frames keep busy]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=limits::THREADS as i64))]
    cpus: Option<u32>,
    /// The program on the machines that render [default: this one]
    #[arg(long, value_name = "PROGRAM")]
    anim: Option<String>,
    /// A film of the frames, made when all are there
    #[arg(long, value_name = "FILE")]
    film: Option<String>,
    /// Where the job is written; `-` for the standard output [default: the input's name, here]
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
}

#[derive(clap::Args)]
struct SlurmArguments {
    #[command(flatten)]
    job: JobArguments,
    /// Slurm's partition
    #[arg(long, value_name = "NAME")]
    partition: Option<String>,
    /// Slurm's account
    #[arg(long, value_name = "NAME")]
    account: Option<String>,
    /// Memory of a task, as in 4G [default: as the plan estimates]
    #[arg(long, value_name = "SIZE")]
    mem: Option<String>,
    /// Time limit of a task, as in 1:30:00 [default: none, or thrice what --minutes-per-task has measured]
    #[arg(long, value_name = "TIME")]
    time: Option<String>,
    /// How many tasks may run at once
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    throttle: Option<u32>,
    /// How often what failed of a task is tried
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    attempts: u32,
    /// How often a task that was preempted goes back into the queue
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(0..=1000))]
    requeues: u32,
    /// Make frames in this folder of each node and copy them back when they are whole; the node's shell reads it
    #[arg(long, value_name = "DIR")]
    scratch: Option<String>,
    /// A contact sheet of the frames, made when all are there
    #[arg(long, value_name = "FILE")]
    sheet: Option<String>,
    /// One more option of sbatch, as in --sbatch=--qos=low; may be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
}

#[derive(clap::Args)]
struct OpenJdArguments {
    #[command(flatten)]
    job: JobArguments,
    /// Let the scheduler make chunks that take so many seconds, by the extension TASK_CHUNKING
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    chunk_seconds: Option<u32>,
    /// Which machines the scripts in it are for
    #[arg(long = "for", value_enum, default_value = "linux")]
    system: SystemArgument,
}

#[derive(Clone, Copy, ValueEnum)]
enum SystemArgument {
    /// bash
    Linux,
    /// PowerShell
    Windows,
}

#[derive(clap::Args)]
struct MakeArguments {
    #[command(flatten)]
    job: JobArguments,
}

fn parse_minutes(text: &str) -> Result<f64, String> {
    let minutes = text.parse().ok().filter(|minutes: &f64| (0.01..=100_000.0).contains(minutes));
    minutes.ok_or_else(|| "expected minutes, as in 10 or 0.5".into())
}

pub fn run(arguments: &FarmArguments) -> Result<Exit, Diagnostics> {
    match &arguments.engine {
        FarmEngine::Slurm(arguments) => {
            let mut job = job(&arguments.job)?;
            job.sheet = arguments.sheet.as_deref().map(absolute);
            let options = SlurmOptions {
                partition: arguments.partition.clone(),
                account: arguments.account.clone(),
                memory: arguments.mem.clone(),
                time: arguments.time.clone(),
                cores: arguments.job.cpus,
                throttle: arguments.throttle,
                attempts: arguments.attempts,
                requeues: arguments.requeues,
                scratch: arguments.scratch.clone(),
                more: arguments.sbatch.clone(),
            };
            check_slurm(&job, &options)?;
            let to = written(&arguments.job, &job, "slurm.sh", &slurm::script(&job, &options))?;
            told(&to, &job, &format!("bash {}", to.display()))
        }
        FarmEngine::Openjd(arguments) => {
            let mut job = job(&arguments.job)?;
            let system = match arguments.system {
                SystemArgument::Linux => WorkerSystem::Linux,
                SystemArgument::Windows => WorkerSystem::Windows,
            };
            // The path of this program says nothing on machines of the other system.
            if arguments.job.anim.is_none() && cfg!(windows) != (system == WorkerSystem::Windows) {
                job.anim = "anim".into();
            }
            let to = arguments.job.to.clone().filter(|to| to != Path::new("-")).unwrap_or_default();
            let folder = absolute(&output::folder_of(&to).to_string_lossy());
            let options =
                OpenJdOptions { system, chunk_seconds: arguments.chunk_seconds, cores: arguments.job.cpus, folder };
            check_openjd(&job, system)?;
            let to = written(&arguments.job, &job, "openjd.yaml", &openjd::template(&job, &options))?;
            let given: String = options.missing(&job).iter().map(|word| format!(" {}", quote::shell(word))).collect();
            told(&to, &job, &format!("openjd run {} --step Render{given}", to.display()))
        }
        FarmEngine::Make(arguments) => {
            let job = job(&arguments.job)?;
            let is_ninja = arguments.job.to.as_ref().is_some_and(|to| to.extension().is_some_and(|e| e == "ninja"));
            let text = if is_ninja { make::ninja_file(&job) } else { make::makefile(&job) };
            let to = written(&arguments.job, &job, "mk", &text)?;
            let tool = if is_ninja { "ninja" } else { "make" };
            told(&to, &job, &format!("{tool} -f {} -j4", to.display()))
        }
    }
}

/// Writes a job where it is wanted; says where.
fn written(arguments: &JobArguments, job: &FarmJob, ending: &str, text: &str) -> Result<PathBuf, Diagnostics> {
    let to = arguments.to.clone().unwrap_or_else(|| format!("{}.{ending}", job.name).into());
    if to == Path::new("-") {
        print(text);
    } else {
        output::write_atomic(&to, text.as_bytes())?;
    }
    Ok(to)
}

fn told(to: &Path, job: &FarmJob, next: &str) -> Result<Exit, Diagnostics> {
    if to == Path::new("-") {
        return Ok(Exit::Done);
    }
    let frames: usize = job.tasks.tasks.iter().map(|task| task.frames.len()).sum();
    let mut text = format!("{}: {frames} frames in {} tasks", to.display(), job.tasks.tasks.len());
    if let Some(line) = job.price_line() {
        text += &format!("; {line}");
    }
    print(&format!("{text}\nnext: {next}\n"));
    Ok(Exit::Done)
}

fn check_slurm(job: &FarmJob, options: &SlurmOptions) -> Result<(), Diagnostics> {
    let words = [&options.partition, &options.account, &options.memory, &options.time];
    let words = words.into_iter().flatten().chain(&options.more);
    if let Some(wrong) = words.into_iter().find(|word| word.contains(['\n', '\r'])) {
        return Err(usage(format!(
            "`{}` has a line end in it, and a job script has an option on each line",
            wrong.trim()
        )));
    }
    if options.scratch.is_some() && job.pattern.is_empty() {
        return Err(usage("--scratch: frames must go to one folder, as with -o FOLDER/"));
    }
    if job.tasks.tasks.len() > 1_000 {
        let message = format!("{} tasks: many sites allow 1000 in an array (MaxArraySize)", job.tasks.tasks.len());
        say(&Diagnostic::warning(message).into());
    }
    Ok(())
}

/// Templates name frames by ranges that ascend, and their outputs by a folder.
fn check_openjd(job: &FarmJob, system: WorkerSystem) -> Result<(), Diagnostics> {
    let numbers: Vec<u32> = job.tasks.tasks.iter().flat_map(|task| task.frames.iter().copied()).collect();
    if !numbers.is_sorted() {
        return Err(usage("--frames: schedulers sort frames, so give them in their order"));
    }
    if job.settings.iter().any(|word| word.contains("{{")) {
        return Err(usage("`{{` stands for a parameter in a template, and cannot be in a setting"));
    }
    if system == WorkerSystem::Windows && job.settings.iter().any(|word| word.contains('"')) {
        return Err(usage("a double quote in a setting: Windows PowerShell does not hand it on to programs"));
    }
    if job.film.is_some() {
        return Err(usage("--film: make it of the output, as in anim film FOLDER -o show.mp4"));
    }
    Ok(())
}

/// The job of an input.
fn job(arguments: &JobArguments) -> Result<FarmJob, Diagnostics> {
    let wanted = &arguments.wanted;
    if wanted.shard.is_some() {
        return Err(usage("--shard: a job makes the parts itself, by --tasks"));
    }
    let cancel = render::on_interrupt()?;
    let out = wanted.out.as_deref();
    let (shot, mut plan) = render::plan(wanted, &cancel)?;
    if !shot.is_sequence() {
        return Err(usage(format!("{} is one picture: --tiles makes parts of it (anim help render)", shot.source)));
    }
    let mistakes = plan.summary();
    if mistakes.has_errors() {
        return Err(mistakes);
    }
    plan.inspect(&shot.source);
    let seconds_per_cost = match arguments.minutes_per_task {
        Some(_) => Some(measure(wanted, &plan, &cancel)?),
        None => None,
    };
    let count = count(arguments, &plan, seconds_per_cost);
    let tasks = TaskPlan::new(&plan, count);
    let folder = absolute(&plan.folder().to_string_lossy());
    let (out, pattern) = places(out, &plan, &folder);
    let numbers: Vec<u32> = plan.frames.iter().map(|planned| planned.frame).collect();
    let files = tasks
        .tasks
        .iter()
        .map(|task| task.frames.iter().map(|frame| absolute(&plan.target.path(*frame).to_string_lossy())).collect());
    let this = std::env::current_exe().map(|path| path.to_string_lossy().into_owned());
    Ok(FarmJob {
        name: shot.name.clone(),
        anim: arguments.anim.clone().unwrap_or_else(|| this.unwrap_or_else(|_| "anim".into())),
        input: absolute(&wanted.input.input.to_string_lossy()),
        settings: settings(wanted),
        frames: frame_list(&numbers),
        is_part: wanted.frames.is_some(),
        out,
        folder,
        pattern,
        files: files.collect(),
        sources: sources(&shot, wanted),
        film: arguments.film.as_deref().map(absolute),
        sheet: None,
        seconds_per_cost,
        tasks,
    })
}

/// `-o` as an absolute path, and the name of files in the folder if they all lie in it.
fn places(out: Option<&str>, plan: &Plan, folder: &str) -> (String, String) {
    let Target::Pattern { before, digits, after } = &plan.target else { return (folder.to_string(), String::new()) };
    let has_number_in_folder = after.contains(['/', '\\']);
    let name = before.rsplit(['/', '\\']).next().unwrap_or_default();
    let pattern = if has_number_in_folder { String::new() } else { format!("{name}{}{after}", "#".repeat(*digits)) };
    // What names a folder goes on to name it, whatever it is called.
    let is_pattern = out.is_some_and(|out| out.contains('#'));
    (if is_pattern { absolute(out.unwrap_or_default()) } else { format!("{}/", folder.trim_end_matches('/')) }, pattern)
}

/// The words of a command line that decide the plan, beside frames and output.
pub fn settings(wanted: &FrameArguments) -> Vec<String> {
    let mut words = Vec::new();
    for (name, value) in &wanted.input.defines {
        words.extend(["-D".to_string(), format!("{name}={value}")]);
    }
    if wanted.input.strict {
        words.push("--strict".into());
    }
    let access = &wanted.input.access;
    if let Some(root) = &access.root {
        words.extend(["--root".to_string(), absolute(&root.to_string_lossy())]);
    }
    for folder in &access.allow_read {
        words.extend(["--allow-read".to_string(), absolute(&folder.to_string_lossy())]);
    }
    words.extend(wanted.look.words());
    words
}

/// The files that the shot is made of, or the archive.
fn sources(shot: &Shot, wanted: &FrameArguments) -> Vec<String> {
    let input = &wanted.input.input;
    let files =
        if is_archive(input) { vec![input.clone()] } else { shot.files().into_iter().map(|(path, _)| path).collect() };
    files.iter().filter(|path| path.is_file()).map(|path| absolute(&path.to_string_lossy())).collect()
}

/// How many tasks.
fn count(arguments: &JobArguments, plan: &Plan, seconds_per_cost: Option<f64>) -> u32 {
    let frames = (plan.frames.len() as u32).max(1);
    let usual = USUAL_TASKS.min(frames);
    let (Some(minutes), Some(seconds)) = (arguments.minutes_per_task, seconds_per_cost) else {
        return arguments.tasks.unwrap_or(usual);
    };
    let whole = TaskPlan::new(plan, 1);
    let cores = arguments.cpus.unwrap_or(whole.cores);
    let all = whole.whole * seconds / f64::from(cores.max(1)) / 60.0;
    ((all / minutes).ceil() as u32).clamp(1, frames)
}

/// Tasks where nobody says how many.
const USUAL_TASKS: u32 = 10;
/// Frames that are rendered to tell how fast this machine is.
const MEASURED_FRAMES: usize = 3;
/// They are so much smaller on each side.
const SMALLER: u32 = 4;

/// Processor seconds of one unit of cost on this machine: a few frames of the plan are rendered, small, and forgotten.
fn measure(wanted: &FrameArguments, plan: &Plan, cancel: &AtomicBool) -> Result<f64, Diagnostics> {
    let middle = |part: usize| plan.frames.get((2 * part + 1) * plan.frames.len() / (2 * MEASURED_FRAMES));
    let numbers: Vec<u32> = (0..MEASURED_FRAMES).filter_map(|part| Some(middle(part)?.frame)).collect();
    let size = plan.frames.iter().find_map(|planned| Some(planned.fingerprint.as_ref().ok()?.size)).unwrap_or([64, 36]);
    let folder = tempfile::tempdir().map_err(|e| Diagnostic::io("a temporary folder", "make", &e))?;
    let small = FrameArguments {
        frames: Some(frame_list(&numbers)),
        look: wanted.look.sized(size.map(|side| (side / SMALLER).max(1))),
        ..wanted.clone()
    };
    let out = format!("{}/", folder.path().display());
    let (mut shot, plan) = render::plan_into(&small, Some(&out), cancel)?;
    let before = clock::process_time();
    let policy = ReusePolicy { reuse: false, memory: 0 };
    let ending = run::run(&mut shot, &plan, policy, cancel, &|_| {})?;
    if let Some((_, problems)) = ending.failed.into_iter().next() {
        return Err(problems);
    }
    let seconds = (clock::process_time() - before).as_secs_f64();
    let cost: f64 = plan.costs().iter().map(|frame| frame.alone).sum();
    Ok(seconds / cost.max(f64::MIN_POSITIVE))
}
