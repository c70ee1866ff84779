//! `anim watch`: renders again whenever a file of the input changes, without a page.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use clap::ValueEnum;

use super::progress::Mode;
use super::render::{self, FrameArguments, RenderArguments};
use super::{Exit, note, print, say};
use crate::base::base64;
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::project::Project;
use crate::base::{files, limits};
use crate::output::FileState;
use crate::preview::watching::FileWatch;

#[derive(clap::Args)]
#[command(
    after_help = "Files are watched: the script and its modules, the scene, meshes, textures, data. What an edit did not \
            touch is kept, as by `anim render`. Ends with Ctrl-C.

Examples:
  anim watch show.rhai --frames 12            one frame, again after every edit
  anim watch scene.ron --size 320x180 --inline    the picture in the terminal (kitty, iTerm2 and their like)"
)]
pub struct WatchArguments {
    #[command(flatten)]
    wanted: FrameArguments,
    /// Draw the picture in the terminal: the first of the frames that were rendered
    #[arg(long, value_name = "PROTOCOL", value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "auto")]
    inline: Option<InlineProtocol>,
    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value = "auto")]
    progress: Mode,
}

/// How a terminal is told to draw a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum InlineProtocol {
    /// What the terminal says that it is
    Auto,
    /// kitty, Ghostty, WezTerm, Konsole
    Kitty,
    /// iTerm2, WezTerm, mintty
    Iterm2,
}

pub fn run(arguments: &WatchArguments) -> Result<Exit, Diagnostics> {
    let protocol = match arguments.inline {
        Some(InlineProtocol::Auto) => Some(of_terminal().ok_or_else(unknown_terminal)?),
        other => other,
    };
    let input = &arguments.wanted.input.input;
    let cancel = render::on_interrupt()?;
    let (send, edits) = channel();
    let stop = cancel.clone();
    let watch = FileWatch::start(move |changed| {
        // The flag first: were it raised behind an edit that was taken already, it would look like an interrupt.
        stop.store(true, Ordering::SeqCst);
        let _ = send.send(changed);
    })?;
    loop {
        let project = Project::of(input, &arguments.wanted.input.access.access())?;
        project.record(input, crate::base::project::FileRole::Script);
        let start = Instant::now();
        let rendered = once(arguments, &project, &cancel);
        watch.follow(project.recorded().into_iter().map(|(path, _)| path));
        let is_cancelled = cancel.load(Ordering::SeqCst);
        // An edit that has raised the flag is there at once: without one it was an interrupt.
        let mut edit = if is_cancelled { edits.recv_timeout(EDIT_FOLLOWS).ok() } else { edits.try_recv().ok() };
        if edit.is_none() && is_cancelled {
            return Ok(Exit::Interrupted);
        }
        match rendered {
            Ok(written) if edit.is_none() => report(&written, start.elapsed(), protocol)?,
            Ok(_) => {}
            Err(problems) => say(&problems),
        }
        if edit.is_none() {
            edit = wait(&edits, &cancel);
        }
        let Some(changed) = edit else { return Ok(Exit::Interrupted) };
        cancel.store(false, Ordering::Relaxed);
        let names: Vec<String> = changed.iter().map(|path| path.display().to_string()).collect();
        note(&format!("changed: {}", names.join(", ")));
    }
}

/// How long an edit may be behind the flag that it raises, on a machine that has other things to do.
const EDIT_FOLLOWS: Duration = Duration::from_millis(500);

/// The next edit; `None` after an interrupt.
fn wait(edits: &Receiver<Vec<PathBuf>>, cancel: &AtomicBool) -> Option<Vec<PathBuf>> {
    loop {
        match edits.recv_timeout(Duration::from_millis(50)) {
            Ok(changed) => return Some(changed),
            Err(_) if cancel.load(Ordering::Relaxed) => return edits.recv_timeout(EDIT_FOLLOWS).ok(),
            Err(_) => {}
        }
    }
}

/// Files that were written, and how many frames were there already.
struct WatchedFrames {
    written: Vec<(u32, PathBuf)>,
    kept: usize,
}

/// Renders what is not done.
fn once(
    arguments: &WatchArguments,
    project: &std::sync::Arc<Project>,
    cancel: &AtomicBool,
) -> Result<WatchedFrames, Diagnostics> {
    let wanted = &arguments.wanted;
    let (mut shot, mut plan) = render::plan_in(wanted, wanted.out.as_deref(), cancel, project.clone())?;
    plan.inspect(&shot.source);
    let is_done = |state: &FileState| *state == FileState::Done;
    let kept: Vec<u32> = plan.frames.iter().filter(|one| is_done(&one.state)).map(|one| one.frame).collect();
    let target = plan.target.clone();
    let quiet = RenderArguments::quiet(wanted.clone(), false, arguments.progress);
    let finished = Mutex::new(Vec::new());
    render::render(&quiet, &mut shot, plan, cancel, &|frame| {
        if let Ok(mut finished) = finished.lock() {
            finished.push(frame);
        }
    })?;
    let mut written = finished.into_inner().unwrap_or_default();
    written.retain(|frame| !kept.contains(frame));
    written.sort_unstable();
    Ok(WatchedFrames {
        written: written.into_iter().map(|frame| (frame, target.path(frame))).collect(),
        kept: kept.len(),
    })
}

/// Says what there is to look at, and draws it.
fn report(frames: &WatchedFrames, time: Duration, protocol: Option<InlineProtocol>) -> Result<(), Diagnostics> {
    let seconds = time.as_secs_f64();
    let Some((first, file)) = frames.written.first() else {
        if frames.kept > 0 {
            print(&format!("nothing to render: {} there already ({seconds:.2} s)\n", frames.kept));
        }
        return Ok(());
    };
    match frames.written.len() {
        1 => print(&format!("{} ({seconds:.2} s)\n", file.display())),
        more => print(&format!("{} and {} more ({seconds:.2} s)\n", file.display(), more - 1)),
    }
    match protocol.map(|protocol| inline(file, protocol)) {
        None => Ok(()),
        Some(Ok(sequence)) => {
            print(&sequence);
            Ok(())
        }
        Some(Err(problem)) => {
            say(&Diagnostic::warning(format!("frame {first} is not drawn: {}", problem.message)).into());
            Ok(())
        }
    }
}

fn unknown_terminal() -> Diagnostics {
    super::usage(
        "--inline: this terminal does not say that it draws pictures; if it does, name its protocol, as in --inline=kitty",
    )
}

/// What the terminal says that it is.
fn of_terminal() -> Option<InlineProtocol> {
    let variable = |name: &str| std::env::var(name).unwrap_or_default().to_lowercase();
    let (term, program) = (variable("TERM"), variable("TERM_PROGRAM"));
    let is = |names: &[&str]| names.iter().any(|name| term.contains(name) || program.contains(name));
    if is(&["kitty", "ghostty", "konsole"]) || std::env::var_os("KITTY_WINDOW_ID").is_some() {
        Some(InlineProtocol::Kitty)
    } else if is(&["iterm", "wezterm", "mintty"]) {
        Some(InlineProtocol::Iterm2)
    } else {
        None
    }
}

/// Bytes of base64 in one piece of kitty's protocol.
const PIECE: usize = 4096;

/// The picture in a file as the sequence that makes a terminal draw it.
fn inline(file: &Path, protocol: InlineProtocol) -> Result<String, Diagnostic> {
    let bytes = files::read_bytes(file, limits::IMAGE_FILE_BYTES)?;
    if !bytes.starts_with(b"\x89PNG") {
        return Err(Diagnostic::error(format!("terminals draw PNG, which {} is not", file.display())));
    }
    let text = base64::encode(&bytes);
    if protocol == InlineProtocol::Iterm2 {
        return Ok(format!("\x1b]1337;File=inline=1;size={};preserveAspectRatio=1:{text}\x07\n", bytes.len()));
    }
    let mut sequence = String::new();
    let pieces: Vec<&[u8]> = text.as_bytes().chunks(PIECE).collect();
    for (i, piece) in pieces.iter().enumerate() {
        // Only the first piece says what it is: a PNG, to be drawn here, without an answer.
        let head = if i == 0 { "f=100,a=T,q=2," } else { "" };
        let more = u8::from(i + 1 < pieces.len());
        sequence += &format!("\x1b_G{head}m={more};{}\x1b\\", String::from_utf8_lossy(piece));
    }
    Ok(sequence + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_come_in_pieces_that_terminals_put_together() {
        let desk = tempfile::tempdir().unwrap();
        let file = desk.path().join("a.png");
        let bytes: Vec<u8> = b"\x89PNG".iter().copied().chain((0..8_000).map(|i| i as u8)).collect();
        std::fs::write(&file, &bytes).unwrap();
        let kitty = inline(&file, InlineProtocol::Kitty).unwrap();
        let pieces: Vec<&str> = kitty.trim_end().split_terminator("\x1b\\").collect();
        let bodies: Vec<&str> = pieces.iter().map(|piece| piece.split_once(';').unwrap().1).collect();
        assert_eq!(bodies.concat(), base64::encode(&bytes));
        assert!(pieces[0].starts_with("\x1b_Gf=100,a=T,q=2,m=1;") && pieces[1].starts_with("\x1b_Gm=1;"));
        assert!(pieces.last().unwrap().starts_with("\x1b_Gm=0;") && bodies.iter().all(|body| body.len() <= PIECE));
        let iterm = inline(&file, InlineProtocol::Iterm2).unwrap();
        assert!(iterm.starts_with("\x1b]1337;File=inline=1;size=8004;") && iterm.ends_with("\x07\n"));
        std::fs::write(&file, "no picture").unwrap();
        assert!(inline(&file, InlineProtocol::Kitty).is_err());
    }
}
