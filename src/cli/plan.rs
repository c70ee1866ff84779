//! `anim plan`: every frame as data, and what rendering would do about it.

use std::fmt::Write;

use serde_json::json;

use super::render::{self, FrameArguments};
use super::{Exit, print, say};
use crate::base::diagnostics::Diagnostics;
use crate::base::limits;
use crate::farm::frame_list;
use crate::farm::job::{Task, TaskPlan};
use crate::output::FileState;
use crate::shot::Shot;
use crate::shot::animation_measures::AnimationMeasures;
use crate::shot::fingerprint::FramePart;
use crate::shot::plan::{Plan, PlannedFrame, PlannedReuse};

#[derive(clap::Args)]
#[command(after_help = "State of a frame:
  done      its file is the frame, to the byte; rendering keeps it
  stale     its file is a frame of another content, as before an edit
  missing   there is no file
  corrupt   its file was a frame and is damaged
  foreign   its file is no frame of this program

Examples:
  anim plan show.rhai                   a line for each frame
  anim plan show.rhai --json            one JSON object a line
  anim plan show.rhai --exit-code       0 if every frame is there, 1 if not
  anim plan show.rhai --left            the frames that are left, as --frames takes them
  anim plan show.rhai --tasks 12        in 12 parts of about the same cost, and what splitting costs
  anim plan show.rhai --tasks 12 --json the same for any queue: see anim guide farm
  anim plan kitchen.aff                 also what makes the animation hard to trace: what moves, sizes, overlap")]
pub struct PlanArguments {
    #[command(flatten)]
    wanted: FrameArguments,
    /// One JSON object a line for each frame
    #[arg(long)]
    json: bool,
    /// Show parts of about the same cost instead of frames: what --shard I/N is
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=limits::FRAMES as i64))]
    tasks: Option<u32>,
    /// Show nothing but the frames that are not done, and exit with 1 if there are any
    #[arg(long, conflicts_with_all = ["json", "tasks"])]
    left: bool,
    /// Exit with 1 if a frame is not done
    #[arg(long)]
    exit_code: bool,
    /// Refuse a plan other than this one, as after an edit or with another version
    #[arg(long, value_name = "PLAN")]
    expect: Option<String>,
}

pub fn run(arguments: &PlanArguments) -> Result<Exit, Diagnostics> {
    let cancel = render::on_interrupt()?;
    let whole = FrameArguments { shard: None, ..arguments.wanted.clone() };
    let (mut shot, mut plan) = render::plan(&whole, &cancel)?;
    if let Some(expected) = &arguments.expect {
        render::expect_plan(expected, &plan)?;
    }
    if let Some([i, n]) = arguments.wanted.shard {
        plan.keep_shard(i, n);
    }
    plan.inspect(&shot.source);
    let left: Vec<u32> =
        plan.frames.iter().filter(|p| p.state != FileState::Done).map(|planned| planned.frame).collect();
    print(&match arguments.tasks {
        _ if arguments.left && left.is_empty() => String::new(),
        _ if arguments.left => format!("{}\n", frame_list(&left)),
        Some(count) if arguments.json => task_lines(arguments, &shot, &plan, count),
        Some(count) => task_table(&plan, count),
        None if arguments.json => lines(&plan),
        None => table(&plan),
    });
    let mistakes = plan.summary();
    say(&mistakes);
    let is_benchmark = shot.source.to_lowercase().ends_with(".aff");
    if is_benchmark && !arguments.left && arguments.tasks.is_none() && !mistakes.has_errors() {
        let measures = AnimationMeasures::of(&mut shot, &plan)?;
        print(&if arguments.json { measures_line(&measures) } else { measures_text(&measures) });
    }
    let is_asked = arguments.exit_code || arguments.left;
    Ok(match mistakes.has_errors() {
        true => Exit::Input,
        false if is_asked && !left.is_empty() => Exit::Differences,
        false => Exit::Done,
    })
}

/// What makes an animation of BART hard to trace, for people.
fn measures_text(measures: &AnimationMeasures) -> String {
    let AnimationMeasures { pairs, bodies, primitives, lights, levels, .. } = measures;
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    format!(
        "measures of animated ray tracing, over {pairs} pairs of neighbouring frames\n\
         \x20 scene     {bodies} bodies of {primitives} primitives, {lights} lights, {levels} levels of transforms\n\
         \x20 motion    {} of the bodies move and {} bend from frame to frame, {} of the lights move, the camera in {}\n\
         \x20 sizes     the scene is {:.1} times as large as its median body\n\
         \x20 overlap   the box of a body meets {:.1} others\n\
         \x20 cost      deviation {} of the mean, the largest frame {:.2} times the mean\n",
        percent(measures.moving),
        percent(measures.bending),
        percent(measures.lights_moving),
        percent(measures.camera_moving),
        measures.size_ratio,
        measures.overlap,
        percent(measures.cost_deviation),
        measures.cost_peak,
    )
}

/// The same as a last line of JSON.
fn measures_line(measures: &AnimationMeasures) -> String {
    let value = json!({ "measures": {
        "pairs": measures.pairs,
        "bodies": measures.bodies,
        "primitives": measures.primitives,
        "lights": measures.lights,
        "levels": measures.levels,
        "moving": measures.moving,
        "bending": measures.bending,
        "lights_moving": measures.lights_moving,
        "camera_moving": measures.camera_moving,
        "size_ratio": measures.size_ratio,
        "overlap": measures.overlap,
        "cost_deviation": measures.cost_deviation,
        "cost_peak": measures.cost_peak,
    } });
    format!("{value}\n")
}

/// A line about all tasks, then one for each.
fn task_lines(arguments: &PlanArguments, shot: &Shot, plan: &Plan, count: u32) -> String {
    let tasks = TaskPlan::new(plan, count);
    let out = arguments.wanted.out.clone();
    let command = |number: u32| {
        let mut words = vec!["render".to_string(), arguments.wanted.input.input.to_string_lossy().into_owned()];
        words.extend(super::farm::settings(&arguments.wanted));
        arguments.wanted.frames.iter().for_each(|list| words.extend(["--frames".into(), list.clone()]));
        words.extend(["--shard".into(), format!("{number}/{count}"), "--expect".into(), tasks.plan.clone()]);
        out.iter().for_each(|out| words.extend(["-o".into(), out.clone()]));
        words
    };
    let head = json!({
        "plan": tasks.plan,
        "anim": env!("CARGO_PKG_VERSION"),
        "input": shot.input_path(),
        "folder": plan.folder().to_string_lossy(),
        "tasks": count,
        "frames": plan.frames.len(),
        "left": tasks.tasks.iter().map(|task| task.left).sum::<usize>(),
        "cost": tasks.whole,
        "price": tasks.price,
        "longest": tasks.longest,
        "cores": tasks.cores,
        "memory_bytes": tasks.memory_bytes,
    });
    let line = |task: &Task| {
        let value = json!({
            "task": task.number,
            "frames": task.list(),
            "first": task.frames.first(),
            "last": task.frames.last(),
            "count": task.frames.len(),
            "left": task.left,
            "cost": task.cost,
            "arguments": command(task.number),
        });
        format!("{value}\n")
    };
    format!("{head}\n{}", tasks.tasks.iter().map(line).collect::<String>())
}

fn task_table(plan: &Plan, count: u32) -> String {
    let tasks = TaskPlan::new(plan, count);
    let whole = tasks.whole.max(f64::MIN_POSITIVE);
    let mut text = String::from(" task   share  left  frames\n");
    for task in &tasks.tasks {
        let share = 100.0 * task.cost / whole;
        let _ = writeln!(text, "{:>5}  {share:>4.1} %  {:>4}  {}", task.number, task.left, task.list());
    }
    let (price, longest) = (100.0 * tasks.price / whole, whole / tasks.longest.max(f64::MIN_POSITIVE));
    let gibibytes = tasks.memory_bytes as f64 / f64::from(1 << 30);
    let _ = writeln!(
        text,
        "{count} tasks side by side are {longest:.1} times as fast; splitting does {price:.1} % of the work again\n\
         each can use {} cores and needs about {gibibytes:.2} GiB; plan {}",
        tasks.cores, tasks.plan
    );
    text
}

fn words(changes: &[FramePart]) -> Vec<&'static str> {
    changes.iter().map(|part| part.word()).collect()
}

fn lines(plan: &Plan) -> String {
    let line = |planned: &PlannedFrame| {
        let file = planned.file.to_string_lossy();
        let value = match &planned.fingerprint {
            Err(problems) => json!({
                "frame": planned.frame, "file": file, "state": "wrong", "problems": problems.to_string(),
            }),
            Ok(_) => json!({
                "frame": planned.frame,
                "file": file,
                "hash": planned.hash.to_string(),
                "state": planned.state.word(),
                "changed": planned.changes.as_deref().map(words),
                "same_as": planned.twin,
                "reuse": planned.reuse.word(),
                "passes": planned.light_mix.as_ref().map_or(1, |mix| mix.light_groups.count()),
                "cost": planned.cost(),
            }),
        };
        format!("{value}\n")
    };
    plan.frames.iter().map(line).collect()
}

fn table(plan: &Plan) -> String {
    let total: f64 = plan.frames.iter().map(PlannedFrame::cost).sum();
    let mut text = String::from("frame  state    cost    hash      what changed\n");
    for planned in &plan.frames {
        let PlannedFrame { frame, state, twin, changes, .. } = planned;
        let share = 100.0 * planned.cost() / if total > 0.0 { total } else { 1.0 };
        let what = match (&planned.fingerprint, twin, changes) {
            (Err(_), ..) => "(has mistakes)".to_string(),
            (_, Some(first), _) => format!("(same as frame {first})"),
            (_, _, None) => String::new(),
            (_, _, Some(changes)) if planned.reuse == PlannedReuse::None => words(changes).join(" "),
            (_, _, Some(changes)) => format!("{} (keeps {})", words(changes).join(" "), planned.reuse.word()),
        };
        let state = if planned.fingerprint.is_ok() { state.word() } else { "wrong" };
        let hash = &planned.hash.to_string()[..8];
        let line = format!("{frame:>5}  {state:<7} {share:>5.1} %  {hash}  {what}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    let count = |wanted: FileState| plan.frames.iter().filter(|p| p.fingerprint.is_ok() && p.state == wanted).count();
    let states = [FileState::Done, FileState::Stale, FileState::Missing, FileState::Corrupt, FileState::Foreign];
    let counted = states.into_iter().map(|state| (count(state), state.word()));
    let wrong = (plan.mistakes().count(), "wrong");
    let parts: Vec<String> =
        counted.chain([wrong]).filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}")).collect();
    let is_traced =
        |p: &PlannedFrame| matches!(p.reuse, PlannedReuse::None | PlannedReuse::Tiles | PlannedReuse::PhotonMaps);
    let to_trace = plan.frames.iter().filter(|p| p.fingerprint.is_ok() && p.state != FileState::Done && is_traced(p));
    let _ = writeln!(text, "{}; {} to trace", parts.join(", "), to_trace.count());
    text
}
