//! `anim render --claims`: one of several workers on one folder.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::super::progress::Progress;
use super::super::{Exit, exit_code, say, usage};
use super::{RenderArguments, refuse_foreign, show, warn};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::farm::share::SharedWork;
use crate::output::FileState;
use crate::output::claims::Lease;
use crate::shot::Shot;
use crate::shot::plan::{self, Plan};
use crate::shot::run::{self, Event, ReusePolicy};

/// Renders frames of a whole plan that nobody else renders.
pub fn render(
    arguments: &RenderArguments,
    shot: &mut Shot,
    mut plan: Plan,
    cancel: &AtomicBool,
) -> Result<Exit, Diagnostics> {
    if arguments.force {
        return Err(usage("--force renders what is there, and --claims what is not: take one of them"));
    }
    plan.inspect(&shot.source);
    if !arguments.overwrite {
        refuse_foreign(&plan)?;
    }
    say(&plan.summary());
    warn(arguments, shot, &plan)?;
    let policy = ReusePolicy { reuse: !arguments.no_reuse, memory: arguments.reuse_memory };
    let left = plan.frames.iter().filter(|planned| planned.state != FileState::Done).count();
    let kept = plan.frames.len() - left;
    let mistakes = plan.mistakes().count();
    let progress = Progress::new(arguments.progress, left - mistakes);
    let written = AtomicUsize::new(0);
    let work = SharedWork::join(&plan, shot, arguments.wanted.shard, Lease::default())?;
    let watch = |event: Event| {
        work.hear(&event);
        show(arguments, &progress, &written, &event);
    };
    let ended = AtomicBool::new(false);
    let ending = std::thread::scope(|scope| {
        scope.spawn(|| work.beat_until(&ended));
        let ending = run::run_batches(shot, &plan, &mut || work.next(cancel), policy, cancel, &watch);
        ended.store(true, Ordering::Relaxed);
        ending
    });
    let written = written.into_inner();
    progress.end(written, kept, &plan.folder().to_string_lossy());
    let is_cancelled = cancel.load(Ordering::Relaxed);
    let (exit, how) = match &ending {
        Err(problems) => (exit_code(problems), "failed"),
        Ok(_) if is_cancelled => (Exit::Interrupted, "interrupted"),
        Ok(ending) if ending.failed.is_empty() && mistakes == 0 => (Exit::Done, "done"),
        Ok(_) => (Exit::Failed, "failed"),
    };
    work.leave(how);
    let ending = ending?;
    let failed = ending.failed.iter().map(|(frame, problems)| (*frame, problems));
    say(&plan::summary(failed, plan.frames.len(), "failed"));
    if is_cancelled {
        let message = format!("interrupted: this worker has written {written} frames, and they are whole");
        say(&Diagnostic::warning(message).into());
    }
    Ok(exit)
}
