//! `anim film`: frames as one film; what a script has not rendered yet is rendered first.

mod encode;
mod options;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use super::render::{self, RenderArguments};
use super::{Exit, frames, say, usage};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::rate::Rate;
use crate::farm::archive::is_archive;
use crate::output::film::{Reel, ffmpeg_available};
use crate::output::{self, FilmFormat};
use crate::shot::Shot;
use crate::shot::plan::Plan;
use encode::{FrameFile, Job, Made};
pub use options::FilmOptionArguments;

#[derive(clap::Args)]
#[command(after_help = "The ending of -o says what is written:
  .apng .gif .webp     animations, by this program alone; APNG and WebP keep every pixel
  .y4m                 raw video for encoders, by this program alone
  .mp4 .webm .mov      video, by `ffmpeg` on the PATH

INPUT is a script, whose missing frames are rendered first, or a folder of numbered frames, or a pattern of their \
            names. Colours are those of BT.709, and said to be. The film gets its name when it is whole.

Examples:
  anim film show.rhai -o show.mp4                    all frames, at the script's rate
  anim film show.rhai --size 480x270 -o show.gif     small, for a page
  anim film frames/show -o show.webm --fps 24000/1001
  anim film 'other/shot.####.png' -o shot.y4m --frames 1-48
  anim film show.rhai -o show.mov --codec prores     for an editing program")]
pub struct FilmArguments {
    #[command(flatten)]
    rendering: RenderArguments,
    #[command(flatten)]
    options: FilmOptionArguments,
}

pub fn run(arguments: &FilmArguments) -> Result<Exit, Diagnostics> {
    let FilmArguments { rendering, options } = arguments;
    let input = &rendering.wanted.input.input;
    if !is_archive(input) && (input.is_dir() || Reel::is_pattern(input)) {
        return from_frames(rendering, options, input);
    }
    render(rendering, options)
}

/// Where the film goes, and what kind it is.
fn film_of(rendering: &RenderArguments) -> Result<(PathBuf, FilmFormat), Diagnostics> {
    let Some(out) = &rendering.wanted.out else {
        return Err(usage("where shall the film go? Name it with -o, as in -o show.mp4 or -o show.gif"));
    };
    let film = PathBuf::from(out);
    let format = FilmFormat::of_path(&film).ok_or_else(|| output::film::unknown_ending(&film))?;
    if film.is_dir() {
        return Err(usage(format!("-o {out}: that is a folder, and a film is one file")));
    }
    Ok((film, format))
}

/// What can be seen to before any work is done.
fn prepare(job: &Job) -> Result<(), Diagnostics> {
    output::sweep(output::folder_of(&job.film));
    output::probe(&job.film)?;
    match job.codec() {
        Some(codec) => ffmpeg_available(codec, &job.film).map_err(Diagnostics::from),
        None => Ok(()),
    }
}

/// A film of frames that are there.
fn from_frames(rendering: &RenderArguments, options: &FilmOptionArguments, input: &Path) -> Result<Exit, Diagnostics> {
    if let Some(flag) = rendering.first_that_renders() {
        return Err(usage(format!("{flag} is about rendering, and {} is a row of finished frames", input.display())));
    }
    let (film, format) = film_of(rendering)?;
    let mut reel = Reel::find(input)?;
    match &rendering.wanted.frames {
        Some(list) => {
            let last = reel.frames.last().map_or(0, |(number, _)| *number);
            reel.select(&frames::parse(list, last).map_err(usage)?)?;
        }
        None => reel.check_whole()?,
    }
    let files = reel.frames.into_iter().map(|(number, file)| FrameFile { number, file, hash: None }).collect();
    let job = Job::new(film, format, options, options.fps.unwrap_or(Rate::USUAL), files)?;
    prepare(&job)?;
    let cancel = render::on_interrupt()?;
    match encode::encode(&job, &mut |_| !cancel.load(Ordering::Relaxed))? {
        Some(made) => Ok(finished(&job, &made)),
        None => Ok(Exit::Interrupted),
    }
}

/// A film of a script: frames go to the encoder as they are done.
pub fn render(rendering: &RenderArguments, options: &FilmOptionArguments) -> Result<Exit, Diagnostics> {
    let (film, format) = film_of(rendering)?;
    if rendering.wanted.shard.is_some() {
        return Err(usage("--shard: a film needs all of its frames; render the parts, then film their folder"));
    }
    if rendering.is_tile() {
        return Err(usage("--tiles: a film is made of whole frames"));
    }
    if rendering.claims {
        return Err(usage("--claims: a film needs all of its frames; render them together, then film their folder"));
    }
    render::on_threads(rendering.threads, || {
        let cancel = render::on_interrupt()?;
        let (mut shot, plan) = render::plan_into(&rendering.wanted, options.frames_in.as_deref(), &cancel)?;
        rendering.expect.as_ref().map_or(Ok(()), |expected| render::expect_plan(expected, &plan))?;
        let files = planned_files(&shot, &plan)?;
        let rate = rate_of(&shot, &files, options)?;
        let job = Job::new(film, format, options, rate, files)?;
        prepare(&job)?;
        film_while_rendering(rendering, &mut shot, plan, &job, &cancel)
    })
}

fn film_while_rendering(
    rendering: &RenderArguments,
    shot: &mut Shot,
    plan: Plan,
    job: &Job,
    cancel: &AtomicBool,
) -> Result<Exit, Diagnostics> {
    let (send, receive) = channel::<u32>();
    let (rendered, filmed) = std::thread::scope(|scope| {
        let job = &job;
        let encoder = scope.spawn(move || {
            let mut done = rustc_hash::FxHashSet::default();
            let mut ready = |index: usize| {
                while !done.contains(&job.frames[index].number) {
                    let Ok(number) = receive.recv() else { return false };
                    done.insert(number);
                }
                true
            };
            let filmed = encode::encode(job, &mut ready);
            if filmed.is_err() {
                // Without a film nobody waits for the other frames.
                cancel.store(true, Ordering::Relaxed);
            }
            filmed
        });
        // The encoder hangs up only after an error, which it reports itself.
        let rendered = render::render(rendering, shot, plan, cancel, &|frame| {
            let _ = send.send(frame);
        });
        drop(send);
        let fallen = || Err(Diagnostic::error("the encoder fell over: this is a mistake in anim").into());
        (rendered, encoder.join().unwrap_or_else(|_| fallen()))
    });
    // What the encoder has to say comes first: it may be why rendering stopped.
    let filmed = filmed?;
    match (rendered?, filmed) {
        (Exit::Done, Some(made)) => Ok(finished(job, &made)),
        (exit, _) => {
            let message = format!("{} is not written: it lacks frames", job.film.display());
            say(&Diagnostic::warning(message).into());
            Ok(exit)
        }
    }
}

/// The frames of a plan in their order.
fn planned_files(shot: &Shot, plan: &Plan) -> Result<Vec<FrameFile>, Diagnostics> {
    if !shot.is_sequence() {
        let message = format!("{} is one picture: a film needs a script, or a folder of frames", shot.source);
        return Err(usage(message));
    }
    let mut sizes =
        plan.frames.iter().filter_map(|planned| Some((planned.frame, planned.fingerprint.as_ref().ok()?.size)));
    if let Some((first, size)) = sizes.next()
        && let Some((other, [width, height])) = sizes.find(|(_, other)| *other != size)
    {
        let [w, h] = size;
        let message =
            format!("frame {first} has {w}x{h} pixels and frame {other} {width}x{height}: a film has one size");
        return Err(Diagnostic::error(message).help("give all frames one with --size").into());
    }
    let file = |planned: &crate::shot::plan::PlannedFrame| FrameFile {
        number: planned.frame,
        file: planned.file.clone(),
        hash: Some(planned.hash.to_string()),
    };
    Ok(plan.frames.iter().map(file).collect())
}

/// The script's rate, slower where only every so many frames is wanted: the film takes as long as all of them.
fn rate_of(shot: &Shot, files: &[FrameFile], options: &FilmOptionArguments) -> Result<Rate, Diagnostics> {
    if let Some(rate) = options.fps {
        return Ok(rate);
    }
    let rate = shot.rate().unwrap_or(Rate::USUAL);
    let step = match files {
        [first, second, ..] if second.number > first.number => second.number - first.number,
        _ => 1,
    };
    let is_even = files.windows(2).all(|pair| pair[1].number == pair[0].number.saturating_add(step));
    let rate = if is_even { rate.slower(step) } else { Some(rate) };
    rate.ok_or_else(|| usage("the film would be too slow for its rate to be written; give it with --fps"))
}

/// Says what was made.
fn finished(job: &Job, made: &Made) -> Exit {
    say(&made.warnings);
    let [width, height] = made.size;
    let seconds = made.frames as f64 / job.rate.per_second();
    let bytes = std::fs::metadata(&job.film).map_or(0, |metadata| metadata.len());
    let size = match bytes {
        0..=1023 => format!("{bytes} bytes"),
        1024..=1_048_575 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        _ => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
    };
    let (film, frames, rate) = (job.film.display(), made.frames, job.rate);
    super::print(&format!("{film}: {frames} frames of {width}x{height}, {rate} a second, {seconds:.2} s, {size}\n"));
    Exit::Done
}

/// An error of the arguments that concern the film.
fn wrong(message: String, help: &str) -> Diagnostics {
    Diagnostic::error(message).help(help).because(Cause::Usage).into()
}
