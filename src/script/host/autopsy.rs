//! Why a script's process has come to its end, and at which line.
//!
//! A run is the same every time. So it is made again, telling every thousandth step, then again, telling each step from
//! the last one told, and at last once more, stopped at the last step of all: there its place is known.

use std::path::Path;
use std::sync::Arc;

use super::HostCommand;
use super::protocol::{Opening, Probing};
use super::worker::{Death, HostWorker, SentScene};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place};
use crate::base::limits;
use crate::base::project::Project;
use crate::script::Moment;
use crate::script::allowance::{Allowance, Limit};
use crate::script::said::Journal;

/// A call with the scene that it started from.
pub type SentCall<'a> = (&'a Arc<SentScene>, Option<Moment>);

/// What was run.
pub struct Autopsy<'a> {
    pub command: &'a HostCommand,
    pub opening: &'a Opening,
    pub project: &'a Project,
    /// The call; the opening itself if there is none.
    pub call: Option<SentCall<'a>>,
    /// What the call may use, as far as that is known.
    pub allowance: Allowance,
}

/// Steps between two that are told at first.
const STRIDE: u64 = 1_024;

/// The end of a process as an error of its script.
pub fn explain(autopsy: &Autopsy, death: &Death, looks_for_line: bool) -> Diagnostics {
    let (message, help) = cause(death, autopsy.allowance);
    let frame = autopsy.call.and_then(|(_, time)| time).map(|(number, _)| format!("in frame {number}: "));
    let place = if looks_for_line { autopsy.place(death) } else { None };
    let place = place.unwrap_or_else(|| Place::file(shown(&autopsy.opening.path)));
    Diagnostic::error(format!("{}{message}", frame.unwrap_or_default())).at(place).help(help).into()
}

fn shown(path: &Path) -> Arc<str> {
    path.to_string_lossy().into()
}

/// What has ended the process, as far as that can be told.
fn cause(death: &Death, allowance: Allowance) -> (String, String) {
    let said = |text: &str| death.said.contains(text);
    if death.overdue_at.is_some() || is_signal(death, "SIGXCPU") {
        let seconds = allowance.seconds() + limits::SCRIPT_SECONDS_OF_GRACE;
        let message = format!("one operation of the script takes longer than {seconds} s");
        let more = Limit::Seconds.how_to_raise(allowance.get(Limit::Seconds));
        return (message, format!("look for an operation on a very long list or text, or {more}"));
    }
    if said("memory allocation of") {
        let mebibytes = allowance.get(Limit::Memory);
        let message = format!("one operation of the script needs more than {mebibytes} MiB");
        let more = Limit::Memory.how_to_raise(mebibytes);
        return (message, format!("look for an operation that makes a very long list or text, or {more}"));
    }
    if said("overflowed its stack") || is_signal(death, "SIGSEGV") || is_signal(death, "SIGBUS") {
        let message = "values of the script are nested so deep that its stack overflows".to_string();
        return (message, "look for a list, a map or a closure that is put into itself again and again".into());
    }
    let how = death.status.map_or("its process is lost".to_string(), |status| status.to_string());
    (
        format!("the script has ended its process: {how}"),
        "if the machine has run out of memory, try fewer threads".into(),
    )
}

#[cfg(unix)]
fn is_signal(death: &Death, name: &str) -> bool {
    use std::os::unix::process::ExitStatusExt;
    death.status.is_some_and(|status| status.signal().is_some())
        && death.status.is_some_and(|s| s.to_string().contains(name))
}

/// A stack that overflows ends a process so.
#[cfg(windows)]
fn is_signal(death: &Death, name: &str) -> bool {
    const STATUS_STACK_OVERFLOW: u32 = 0xc000_00fd;
    name == "SIGSEGV"
        && death.status.and_then(|status| status.code()).is_some_and(|code| code as u32 == STATUS_STACK_OVERFLOW)
}

#[cfg(not(any(unix, windows)))]
fn is_signal(_: &Death, _: &str) -> bool {
    false
}

impl Autopsy<'_> {
    fn place(&self, death: &Death) -> Option<Place> {
        let step = match death.overdue_at {
            // The call itself was a step, and is none where the function runs as a text of its own.
            Some(step) if self.call.is_some() => step.saturating_sub(1),
            Some(step) => step,
            None => {
                let about = self.again(Probing::Tell { from: 1, every: STRIDE }).err()?.last_step.unwrap_or(0);
                self.again(Probing::Tell { from: about + 1, every: 1 }).err()?.last_step.unwrap_or(about)
            }
        };
        let stopped = self.again(Probing::StopAt(step)).ok()?;
        stopped.err()?.0.into_iter().find_map(|problem| problem.place)
    }

    /// Makes the run once more, in a process of its own.
    fn again(&self, probing: Probing) -> Result<Result<(), Diagnostics>, Death> {
        let nothing = Ok(Err(Diagnostics::default()));
        // What it says was said before.
        let journal = Journal::new("");
        let Ok(mut worker) = HostWorker::start(self.command) else { return nothing };
        let Some((scene, time)) = self.call else {
            worker.probe(probing)?;
            return worker.open(self.opening, self.project, &journal).map(|opened| opened.map(drop));
        };
        if worker.open(self.opening, self.project, &journal)?.is_err() {
            return nothing;
        }
        worker.probe(probing)?;
        worker.call((scene, None), time, self.project, &journal).map(|edits| edits.map(drop))
    }
}
