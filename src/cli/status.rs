//! `anim status`: what a folder of frames has and lacks.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use serde_json::json;

use super::progress::clock;
use super::{Exit, print, render, stdout_is_terminal, usage};
use crate::base::diagnostics::{Diagnostics, ranges};
use crate::farm::frame_list;
use crate::farm::status::{self, FolderStatus, WorkerStatus};

#[derive(clap::Args)]
#[command(
    after_help = "It reads the folder's manifest and what workers (`anim render --claims`) leave in .anim-claims, and nothing else: no \
            script, no scene. `anim plan show.rhai --exit-code` is the stricter question, whether every frame is the one that the \
            script makes now.

Examples:
  anim status frames/show                  once
  anim status frames/show --watch          again and again, until all is there
  anim status frames/show --json           for programs
  anim status frames/show --verify --exit-code && anim film frames/show -o show.mp4     after workers, who say what is wanted
  anim plan show.rhai --exit-code && anim film show.rhai -o show.mp4                    after a run that may have been cut short"
)]
pub struct StatusArguments {
    /// A folder of frames
    folder: PathBuf,
    /// Show it again every so many seconds, until all frames are there
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, default_missing_value = "2", value_parser = clap::value_parser!(u64).range(1..=86_400))]
    watch: Option<u64>,
    /// Answer in JSON, one object a line
    #[arg(long)]
    json: bool,
    /// Read every file and compare it with its checksum
    #[arg(long)]
    verify: bool,
    /// Exit with 1 if a frame is not there: of those that workers want, or else of all up to the highest number that is there
    #[arg(long)]
    exit_code: bool,
}

pub fn run(arguments: &StatusArguments) -> Result<Exit, Diagnostics> {
    if !arguments.folder.is_dir() {
        let shown = arguments.folder.display();
        return Err(usage(format!("{shown}: there is no such folder; `anim status` looks at a folder of frames")));
    }
    let cancel = render::on_interrupt()?;
    loop {
        let status = status::look(&arguments.folder, arguments.verify);
        let text = if arguments.json { json_line(arguments, &status) } else { table(arguments, &status) };
        let clears = arguments.watch.is_some() && !arguments.json && stdout_is_terminal();
        print(&if clears { format!("\x1b[H\x1b[J{text}") } else { text });
        let left = !status.is_done();
        let Some(seconds) = arguments.watch.filter(|_| left) else {
            return Ok(if arguments.exit_code && left { Exit::Differences } else { Exit::Done });
        };
        for _ in 0..seconds * 10 {
            std::thread::sleep(Duration::from_millis(100));
            if cancel.load(Ordering::Relaxed) {
                return Ok(Exit::Interrupted);
            }
        }
    }
}

fn table(arguments: &StatusArguments, status: &FolderStatus) -> String {
    let FolderStatus { wanted, done, running, failed, missing, damaged, .. } = status;
    let mut text = format!("{}: ", arguments.folder.display());
    if let Some(input) = &status.input {
        let _ = write!(text, "{input}, ");
    }
    let _ = write!(text, "{} of {wanted} frames done", done.len());
    let counts =
        [(running.len(), "running"), (failed.len(), "failed"), (missing.len(), "missing"), (damaged.len(), "damaged")];
    for (n, word) in counts.into_iter().filter(|(n, _)| *n > 0) {
        let _ = write!(text, ", {n} {word}");
    }
    if let Some(seconds) = status.seconds_left {
        let _ = write!(text, "; about {} left", clock(seconds));
    }
    text.push('\n');
    if !status.is_known && *wanted > 0 {
        text.push_str("  no worker with --claims was here: frames behind the last one are not known of\n");
    }
    let lists = [("missing", missing), ("damaged", damaged), ("rendered by two workers", &status.twice)];
    for (word, frames) in lists.into_iter().filter(|(_, frames)| !frames.is_empty()) {
        let _ = writeln!(text, "  {word}: {}", ranges(frames));
    }
    for failure in failed {
        let why = failure.why.lines().next().unwrap_or_default();
        let _ = writeln!(text, "  frame {} failed: {why} ({})", failure.frame, failure.worker);
    }
    for worker in &status.workers {
        let WorkerStatus { header, state, done, in_hand, frames_per_minute, silent_seconds } = worker;
        let hand = if in_hand.is_empty() { String::new() } else { format!(", has {}", ranges(in_hand)) };
        let silent = if state == "silent" { format!(" for {}", clock(*silent_seconds)) } else { String::new() };
        let name = &header.worker;
        let _ = writeln!(text, "  {name:<32} {state}{silent}: {done} frames, {frames_per_minute:.1} a minute{hand}");
    }
    text
}

fn json_line(arguments: &StatusArguments, status: &FolderStatus) -> String {
    let worker = |worker: &WorkerStatus| {
        json!({
            "worker": worker.header.worker,
            "host": worker.header.host,
            "pid": worker.header.pid,
            "since": worker.header.since,
            "state": worker.state,
            "done": worker.done,
            "in_hand": worker.in_hand,
            "silent_seconds": worker.silent_seconds,
            "frames_per_minute": worker.frames_per_minute,
        })
    };
    let running = |(frame, worker): (&u32, &String)| json!({ "frame": frame, "worker": worker });
    let failed = |failure: &status::FailedStatus| json!({ "frame": failure.frame, "worker": failure.worker, "why": failure.why });
    let value = json!({
        "folder": arguments.folder.to_string_lossy(),
        "input": status.input,
        "wanted": status.wanted,
        "is_known": status.is_known,
        "done": status.done.len(),
        "missing": frame_list(&status.missing),
        "damaged": frame_list(&status.damaged),
        "twice": frame_list(&status.twice),
        "running": status.running.iter().map(running).collect::<Vec<_>>(),
        "failed": status.failed.iter().map(failed).collect::<Vec<_>>(),
        "workers": status.workers.iter().map(worker).collect::<Vec<_>>(),
        "seconds_left": status.seconds_left,
    });
    format!("{value}\n")
}
