//! What it costs to evaluate scripts in processes of their own: `cargo bench --bench host -- --frames 1000`.
//!
//! A sequence that moves 1,000 entities in every frame is planned in this process and in processes of its script, in
//! turns; medians of five. Time is that of the clock, on as many threads as the machine has cores.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anim::script::Evaluation;
use anim::script::host::{HOST_WORD, HostCommand, serve};
use anim::shot::{self, OpenOptions};
use clap::Parser;

#[derive(Parser)]
struct Args {
    /// Frames that are planned.
    #[arg(long, default_value_t = 1_000)]
    frames: u32,
    /// Entities that move in each.
    #[arg(long, default_value_t = 1_000)]
    entities: u32,
    /// What `cargo bench` adds.
    #[arg(long, hide = true)]
    bench: bool,
}

const TURNS: usize = 5;

fn script(args: &Args) -> String {
    let Args { frames, entities, .. } = args;
    format!(
        "animation(#{{ frames: {frames} }});
fn setup(s) {{
    for i in 0..{entities} {{ s.spawn(#{{ name: `ball${{i}}`, sphere: #{{ radius: 0.1 }}, translation: [i, 0, 0] }}); }}
}}
fn frame(s, f) {{
    for i in 0..{entities} {{ s.get(`ball${{i}}`).translation = [i, f.t, 0.5]; }}
}}
"
    )
}

/// Seconds that it takes to plan all frames.
fn planned(input: &Path, evaluation: Evaluation) -> f64 {
    let start = Instant::now();
    let options = OpenOptions { evaluation, ..OpenOptions::default() };
    let (mut shot, _) = shot::open_with(input, options).unwrap_or_else(|problems| panic!("{problems}"));
    let wanted: Vec<u32> = (1..=shot.frames()).collect();
    let checked = shot::plan::check(&mut shot, &wanted).unwrap_or_else(|problems| panic!("{problems}"));
    assert_eq!(checked.len(), wanted.len());
    start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() -> ExitCode {
    if std::env::args().nth(1).is_some_and(|word| word == HOST_WORD) {
        return serve();
    }
    let args = Args::parse();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = folder.path().join("show.rhai");
    std::fs::write(&input, script(&args)).expect("a file in it");
    let host = HostCommand::this_program().expect("this program");
    let (mut here, mut hosted) = (Vec::new(), Vec::new());
    for _ in 0..TURNS {
        here.push(planned(&input, Evaluation::InProcess));
        hosted.push(planned(&input, Evaluation::Hosted(host.clone())));
    }
    let (here, hosted) = (median(here), median(hosted));
    println!("{} frames of {} entities, medians of {TURNS} in turns", args.frames, args.entities);
    println!(
        "in this process   {here:.3} s\nin its own        {hosted:.3} s   {:+.1} %",
        (hosted / here - 1.0) * 100.0
    );
    ExitCode::SUCCESS
}
