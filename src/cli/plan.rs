//! `anim plan`: every frame as data, and what rendering would do about it.

use std::fmt::Write;

use serde_json::json;

use super::render::{self, FrameArguments};
use super::{Exit, print, say};
use crate::base::diagnostics::Diagnostics;
use crate::output::FileState;
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
  anim plan show.rhai --json            one JSON object a line")]
pub struct PlanArguments {
    #[command(flatten)]
    wanted: FrameArguments,
    /// One JSON object a line for each frame
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &PlanArguments) -> Result<Exit, Diagnostics> {
    let (shot, mut plan) = render::plan(&arguments.wanted, &*render::on_interrupt()?)?;
    plan.inspect(&shot.source);
    print(&if arguments.json { lines(&plan) } else { table(&plan) });
    let mistakes = plan.summary();
    say(&mistakes);
    Ok(if mistakes.has_errors() { Exit::Input } else { Exit::Done })
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
