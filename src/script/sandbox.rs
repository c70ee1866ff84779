//! What keeps a script in bounds: limits set explicitly, words switched off, and a watch over every operation.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use ::rhai::{Dynamic, Engine, EvalAltResult, Position};

use super::allowance::{Allowance, Limit};
use super::errors::{Fallible, complain};
use crate::base::{clock, limits, memory};

/// Words of Rhai that a pure script does without: the clock, the system's mathematics and code from text.
const OFF: [&str; 4] = ["eval", "timestamp", "**", "**="];

/// Why the watch has stopped a script; it travels through Rhai as the token of a termination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    Operations,
    Time,
    Memory,
    /// As far as it was to run.
    Mark,
}

/// What is to be known of a run beside its result.
#[derive(Clone, Copy, Default)]
pub struct Probe {
    /// The step at which the run ends.
    pub stop_at: Option<u64>,
    pub report: Option<StepReport>,
}

/// Tells of steps: every so many, from one of them on.
#[derive(Clone, Copy)]
pub struct StepReport {
    pub from: u64,
    pub every: u64,
    pub tell: fn(u64),
}

struct CallWatch {
    /// Processor time of this thread when the call began.
    started: Cell<Option<Duration>>,
    allowance: Cell<Option<Allowance>>,
    /// Bytes that may be held.
    ceiling: Cell<usize>,
    steps: Cell<u64>,
    probe: Cell<Probe>,
    /// Where the steps are shown to other threads.
    shown: Cell<Option<&'static AtomicU64>>,
    /// Where other threads say that the time of a call is over: when the one that runs began, and the one that is late.
    late: Cell<Option<[&'static AtomicU64; 2]>>,
    /// What is told that a call starts.
    told: Cell<Option<fn()>>,
    /// What is told that limits are set.
    raised: Cell<Option<fn(Allowance)>>,
}

thread_local! {
    /// Over the call that this thread evaluates; a script cannot see it.
    static WATCH: CallWatch = const {
        CallWatch {
            started: Cell::new(None),
            allowance: Cell::new(None),
            ceiling: Cell::new(usize::MAX),
            steps: Cell::new(0),
            probe: Cell::new(Probe { stop_at: None, report: None }),
            shown: Cell::new(None),
            late: Cell::new(None),
            told: Cell::new(None),
            raised: Cell::new(None),
        }
    };
}

/// Sets what calls on this thread may use from now on.
pub fn allow(allowance: Allowance) {
    WATCH.with(|watch| {
        if watch.allowance.replace(Some(allowance)) != Some(allowance)
            && let Some(tell) = watch.raised.get()
        {
            tell(allowance);
        }
    });
}

/// Lets somebody know of limits that are set on this thread.
pub fn tell_of_limits(tell: fn(Allowance)) {
    WATCH.with(|watch| watch.raised.set(Some(tell)));
}

/// What calls on this thread may use.
pub fn allowance() -> Allowance {
    WATCH.with(|watch| watch.allowance.get().unwrap_or_default())
}

/// Starts the time and the steps that a call on this thread may take, and the bytes that it may hold.
pub fn start_call() {
    let bytes = allowance().bytes();
    WATCH.with(|watch| {
        watch.started.set(Some(clock::thread_time()));
        watch.ceiling.set(memory::held().map_or(usize::MAX, |held| held.saturating_add(bytes)));
        watch.steps.set(0);
        if let Some(tell) = watch.told.get() {
            tell();
        }
    });
}

/// What is wanted of the runs on this thread from now on.
pub fn set_probe(probe: Probe) {
    WATCH.with(|watch| watch.probe.set(probe));
}

/// Lets other threads see the steps of runs on this one.
pub fn show_steps(at: &'static AtomicU64) {
    WATCH.with(|watch| watch.shown.set(Some(at)));
}

/// Lets another thread end a call on this one at its next step, by saying of the time when it `began` that it is `late`.
/// Where steps are slow, those between two looks at the clock may take longer than a call may.
pub fn heed(began: &'static AtomicU64, late: &'static AtomicU64) {
    WATCH.with(|watch| watch.late.set(Some([began, late])));
}

/// Lets somebody know of each call that starts on this thread.
pub fn tell_of_calls(tell: fn()) {
    WATCH.with(|watch| watch.told.set(Some(tell)));
}

/// Whether runs are looked into rather than made for their result.
pub fn is_probing() -> bool {
    WATCH.with(|watch| watch.probe.get().stop_at.is_some() || watch.probe.get().report.is_some())
}

/// Steps of the call that was started last on this thread.
pub fn steps() -> u64 {
    WATCH.with(|watch| watch.steps.get())
}

impl CallWatch {
    fn look(&self) -> Option<Stopped> {
        let steps = self.steps.get() + 1;
        self.steps.set(steps);
        if let Some(shown) = self.shown.get() {
            shown.store(steps, Ordering::Relaxed);
        }
        let Probe { stop_at, report } = self.probe.get();
        if let Some(StepReport { from, every, tell }) = report
            && steps >= from
            && steps.is_multiple_of(every)
        {
            tell(steps);
        }
        if stop_at.is_some_and(|at| steps >= at) {
            return Some(Stopped::Mark);
        }
        let allowance = || self.allowance.get().unwrap_or_default();
        if steps.is_multiple_of(16) && steps >= allowance().get(Limit::Operations) {
            return Some(Stopped::Operations);
        }
        // At every step, for a text doubles in one.
        if self.ceiling.get() < usize::MAX && memory::held().is_some_and(|held| held > self.ceiling.get()) {
            return Some(Stopped::Memory);
        }
        if let Some([began, late]) = self.late.get() {
            let late = late.load(Ordering::Relaxed);
            if late > 0 && late == began.load(Ordering::Relaxed) {
                return Some(Stopped::Time);
            }
        }
        let is_late = || {
            let started = self.started.get()?;
            Some(clock::thread_time().saturating_sub(started) >= Duration::from_secs(allowance().seconds()))
        };
        (steps.is_multiple_of(4096) && is_late() == Some(true)).then_some(Stopped::Time)
    }
}

/// Runs the engine. If it falls over, that is an error like others.
///
/// # Errors
/// Those of the run.
pub fn guarded<T>(run: impl FnOnce() -> Fallible<T>) -> Fallible<T> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|cause| {
        let text = cause.downcast_ref::<String>().map(String::as_str).or(cause.downcast_ref::<&str>().copied());
        let text = text.unwrap_or("no reason given").to_string();
        // What the engine's texts say where the allocator has no more for them.
        if text.contains("allocate memory") {
            return Err(EvalAltResult::ErrorTerminated(Dynamic::from(Stopped::Memory), Position::NONE).into());
        }
        Err(EvalAltResult::ErrorSystem("the script engine fell over".into(), text.into()).into())
    })
}

pub fn close(engine: &mut Engine) {
    for word in OFF {
        engine.disable_symbol(word);
    }
    engine.register_fn("sleep", |_: i64| no_sleep()).register_fn("sleep", |_: f64| no_sleep());
    engine
        // They are counted by the watch, whose limit may be raised while the script runs.
        .set_max_operations(0)
        .set_max_call_levels(limits::SCRIPT_CALL_DEPTH)
        .set_max_expr_depths(limits::SCRIPT_EXPRESSION_DEPTH, limits::SCRIPT_EXPRESSION_DEPTH)
        .set_max_variables(limits::SCRIPT_ITEMS)
        .set_max_functions(limits::SCRIPT_ITEMS)
        .set_max_modules(limits::SCRIPT_ITEMS);
    // Rhai looks through all of a value for these at every step; where memory is counted, nothing is lost without them.
    if memory::held().is_none() {
        engine
            .set_max_string_size(limits::SCRIPT_STRING_BYTES)
            .set_max_array_size(limits::SCRIPT_ARRAY)
            .set_max_map_size(limits::SCRIPT_MAP);
    }
    engine.on_progress(|_| WATCH.with(CallWatch::look).map(Dynamic::from));
}

/// Whether an error is a limit that was reached, of which Rhai loses the place on the way out of functions.
pub fn is_limit(error: &EvalAltResult) -> bool {
    use EvalAltResult as E;
    let is_limit = |error: &E| {
        matches!(
            error,
            E::ErrorTooManyOperations(_)
                | E::ErrorStackOverflow(_)
                | E::ErrorTerminated(..)
                | E::ErrorDataTooLarge(..)
                | E::ErrorSystem(..)
        )
    };
    is_limit(error.unwrap_inner())
}

fn no_sleep() -> Fallible<()> {
    complain("a script has no clock and cannot sleep", None)
}
