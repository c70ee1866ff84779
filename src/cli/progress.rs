//! Progress on stderr: one line that renews itself at a terminal, or JSON lines, with an estimate of what is left.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::ValueEnum;

use crate::base::diagnostics::Diagnostics;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// A line that renews itself, only at a terminal
    Auto,
    /// One JSON object per finished frame
    Json,
    /// Lines of Open Job Description on stdout: openjd_progress, openjd_status, openjd_fail
    Openjd,
    None,
}

pub fn stderr_is_terminal() -> bool {
    std::io::stderr().is_terminal()
}

/// Whether stderr is a terminal that understands more than text.
pub fn is_for_escapes() -> bool {
    stderr_is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// How far a run of frames has come.
pub struct Progress {
    mode: Mode,
    frames: usize,
    start: Instant,
    state: Mutex<ProgressState>,
}

struct ProgressState {
    /// Frames rendered, and the share of the current one.
    current: u32,
    finished: usize,
    share: f64,
    /// Frames on disk.
    written: usize,
    shown: Option<Instant>,
}

const RENEW: Duration = Duration::from_millis(100);

impl Progress {
    pub fn new(mode: Mode, frames: usize) -> Self {
        let mode = if mode == Mode::Auto && !is_for_escapes() { Mode::None } else { mode };
        let state = ProgressState { current: 0, finished: 0, share: 0.0, written: 0, shown: None };
        Progress { mode, frames, start: Instant::now(), state: Mutex::new(state) }
    }

    /// Tiles of a frame are done.
    pub fn tiles(&self, frame: u32, done: usize, total: usize) {
        let Ok(mut state) = self.state.lock() else { return };
        if state.current != frame {
            state.finished += usize::from(state.current != 0);
            state.current = frame;
            state.share = 0.0;
        }
        state.share = state.share.max(done as f64 / total as f64);
        let due = state.shown.is_none_or(|at| at.elapsed() >= RENEW);
        if self.mode == Mode::Auto && due {
            state.shown = Some(Instant::now());
            let _ = write!(std::io::stderr(), "\r{}\x1b[K", self.line(&state));
        }
    }

    /// A frame is on disk.
    pub fn written(&self, frame: u32, file: &str) {
        if self.mode == Mode::Openjd {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            state.written += 1;
            let percent = 100.0 * (state.written as f64 / self.frames.max(1) as f64).min(1.0);
            super::print(&format!("openjd_progress: {percent:.2}\nopenjd_status: frame {frame} is written\n"));
        }
        if self.mode == Mode::Json {
            let line = serde_json::json!({
                "frame": frame, "file": file, "frames": self.frames, "elapsed_seconds": self.start.elapsed().as_secs_f64(),
            });
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }

    /// Why nothing can be rendered, for whoever reads progress.
    pub fn fail(mode: Mode, problems: &Diagnostics) {
        let first = problems.0.iter().find(|problem| problem.is_error());
        if let Some(problem) = first.filter(|_| mode == Mode::Openjd) {
            let place =
                problem.place.as_ref().map_or_else(String::new, |p| format!("{}:{}:{}: ", p.file, p.line, p.column));
            super::print(&format!("openjd_fail: {place}{}\n", problem.message.replace('\n', " ")));
        }
    }

    /// Clears the line.
    pub fn clear(&self) {
        if self.mode == Mode::Auto {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }

    /// Clears the line and sums up.
    pub fn end(&self, written: usize, kept: usize, place: &str) {
        self.clear();
        if !matches!(self.mode, Mode::Json | Mode::Openjd) && stderr_is_terminal() {
            let (frames, time) = (plural(written), clock(self.start.elapsed().as_secs_f64()));
            let kept = if kept > 0 { format!(", {kept} kept") } else { String::new() };
            let _ = writeln!(std::io::stderr(), "{frames} in {time}{kept}: {place}");
        }
    }

    fn line(&self, state: &ProgressState) -> String {
        let elapsed = self.start.elapsed().as_secs_f64();
        let done = (state.finished as f64 + state.share) / self.frames.max(1) as f64;
        let left = if done > 0.0 { elapsed * (1.0 - done) / done } else { 0.0 };
        let at = (state.finished + 1).min(self.frames);
        let percent = (state.share * 100.0) as u32;
        format!("frame {at}/{}  {percent:3} %  {} elapsed, about {} left", self.frames, clock(elapsed), clock(left))
    }
}

fn plural(frames: usize) -> String {
    if frames == 1 { "1 frame".into() } else { format!("{frames} frames") }
}

/// Seconds as a person says them.
pub fn clock(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..=9 => format!("{seconds:.1} s"),
        10..=59 => format!("{whole} s"),
        60..=3599 => format!("{}:{:02} min", whole / 60, whole % 60),
        _ => format!("{}:{:02} h", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_said_plainly() {
        assert_eq!(clock(1.25), "1.2 s");
        assert_eq!(clock(12.0), "12 s");
        assert_eq!(clock(61.0), "1:01 min");
        assert_eq!(clock(7260.0), "2:01 h");
    }

    #[test]
    fn the_estimate_counts_whole_frames_and_the_share_of_this_one() {
        let progress = Progress::new(Mode::None, 4);
        progress.tiles(1, 10, 10);
        progress.tiles(2, 5, 10);
        let state = progress.state.lock().unwrap();
        assert_eq!((state.finished, state.share), (1, 0.5));
        assert!(progress.line(&state).starts_with("frame 2/4   50 %"));
    }
}
