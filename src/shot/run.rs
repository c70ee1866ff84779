//! Rendering the frames of a shot and writing them.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Instant;

use super::Shot;
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::components::Render;
use crate::film::Film;
use crate::output::names::{self, Target};
use crate::output::{Notes, encode_exr, encode_png, settings_note, write_atomic};
use crate::systems::{self, Exposure, FrameStats};

/// What happens while a shot is rendered.
pub enum Event {
    /// Tiles of a frame that are done, out of all of its tiles.
    Tiles { frame: u32, done: usize, total: usize },
    /// A frame is rendered and its file is whole.
    Written(Report),
}

/// One frame that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    pub frame: u32,
    pub file: PathBuf,
    pub stats: FrameStats,
    /// From the frame's edits to its whole file.
    pub total_seconds: f64,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    Complete,
    /// `cancel` was raised; only whole frames are there.
    Cancelled,
}

/// A rendered frame on its way to its file.
struct Exposed {
    frame: u32,
    film: Film,
    render: Render,
    stats: FrameStats,
    start: Instant,
}

/// Checks all frames, then renders and writes them in the order given. `watch` is called from several threads.
///
/// # Errors
/// A mistake in any frame, before anything is rendered; a file that cannot be written.
pub fn run(
    shot: &mut Shot,
    frames: &[u32],
    target: &Target,
    cancel: &AtomicBool,
    watch: &(dyn Fn(Event) + Sync),
) -> Result<Ending, Diagnostics> {
    for frame in frames {
        let file = target.path(*frame);
        shot.each_slice(*frame, |stage, _| {
            systems::check(stage)?;
            suits(&stage.settings(), &file)?;
            Ok(true)
        })?;
    }
    let source = shot.source.clone();
    let failed = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel::<Exposed>(1);
        let writer = scope.spawn(|| write_all(receive, &source, target, watch, &failed));
        let mut rendered = Ok(Ending::Complete);
        for frame in frames {
            match expose(shot, *frame, cancel, watch) {
                Ok(Some(exposed)) if !failed.load(Ordering::Relaxed) => {
                    // The writer only hangs up after a failure, which it reports itself.
                    let _ = send.send(exposed);
                }
                Ok(Some(_)) => break,
                Ok(None) => {
                    rendered = Ok(Ending::Cancelled);
                    break;
                }
                Err(problems) => {
                    rendered = Err(problems);
                    break;
                }
            }
        }
        drop(send);
        let written = writer.join().unwrap_or_else(|_| Err(Diagnostic::error("the writer of frames failed")));
        written.map_err(Diagnostics::from)?;
        rendered
    })
}

fn expose(
    shot: &mut Shot,
    frame: u32,
    cancel: &AtomicBool,
    watch: &(dyn Fn(Event) + Sync),
) -> Result<Option<Exposed>, Diagnostics> {
    let start = Instant::now();
    let progress = |done, total| watch(Event::Tiles { frame, done, total });
    let (mut exposure, mut render, mut whole) = (Exposure::default(), Render::default(), true);
    shot.each_slice(frame, |stage, share| {
        render = stage.settings();
        whole = systems::expose(stage, share, &mut exposure, cancel, &progress)?;
        Ok(whole)
    })?;
    let developed = exposure.develop().filter(|_| whole);
    Ok(developed.map(|(film, stats)| Exposed { frame, film, render, stats, start }))
}

fn write_all(
    frames: Receiver<Exposed>,
    source: &str,
    target: &Target,
    watch: &(dyn Fn(Event) + Sync),
    failed: &AtomicBool,
) -> Result<(), Diagnostic> {
    for exposed in frames {
        let file = target.path(exposed.frame);
        let written = encode(&exposed, source, &file)
            .map_err(|e| Diagnostic::error(format!("cannot encode {}: {e}", file.display())).because(Cause::Io))
            .and_then(|bytes| write_atomic(&file, &bytes));
        if let Err(problem) = written {
            failed.store(true, Ordering::Relaxed);
            return Err(problem);
        }
        let Exposed { frame, stats, start, .. } = exposed;
        watch(Event::Written(Report { frame, file, stats, total_seconds: start.elapsed().as_secs_f64() }));
    }
    Ok(())
}

/// Sees to it that a file can hold what the settings ask for.
fn suits(render: &Render, file: &Path) -> Result<(), Diagnostic> {
    let png = || {
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        format!("write an EXR file, as in -o {name}.exr or -o 'folder/f.####.exr'")
    };
    let wrong = |what: String, help: String| Err(Diagnostic::error(what).help(help).because(Cause::Usage));
    if names::is_exr(file) {
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

fn encode(exposed: &Exposed, source: &str, file: &Path) -> Result<Vec<u8>, String> {
    let Exposed { film, render, .. } = exposed;
    let notes = notes(exposed, source);
    if names::is_exr(file) {
        return encode_exr(film, render, &notes);
    }
    encode_png(film, render, &notes).map_err(|e| e.to_string())
}

/// What a picture says of its making: nothing of the machine, the time, or the way it was found.
fn notes(exposed: &Exposed, source: &str) -> Notes {
    let note = |keyword: &str, text: String| (keyword.to_string(), text);
    vec![
        note("Software", concat!("anim ", env!("CARGO_PKG_VERSION")).into()),
        note("Source", source.into()),
        note("Frame", exposed.frame.to_string()),
        note("Seed", exposed.stats.seed.to_string()),
        note("Settings", settings_note(&exposed.render)),
    ]
}
