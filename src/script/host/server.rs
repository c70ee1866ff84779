//! A script's process, from its own side.

use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use super::confine;
use super::protocol::{MadeStates, Opened, Opening, Probing, Reply, Request, receive, send};
use crate::base::codec::{Codec, Decoder, Encoder, Malformed, SharedTable};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::project::{FileRole, Project};
use crate::base::{clock, limits, memory};
use crate::components::Scene;
use crate::script::allowance::Allowance;
use crate::script::interpreter::Interpreter;
use crate::script::said::Remarks;
use crate::script::sandbox;

/// Processor time of the process when the run began, in nanoseconds; 0 while there is none.
static RUNNING_SINCE: AtomicU64 = AtomicU64::new(0);
/// The step that the run is at, as it is told to who watches over it.
static STEP: AtomicU64 = AtomicU64::new(0);

/// Seconds of processor time that a run may take.
static SECONDS: AtomicU64 = AtomicU64::new(limits::SCRIPT_SECONDS + limits::SCRIPT_SECONDS_OF_GRACE);

/// When the run began that has had the time of a call: it ends at its next step, and the process with it if there is none
/// soon.
static LATE: AtomicU64 = AtomicU64::new(0);

/// How often the watching thread looks.
const GLANCE: Duration = Duration::from_millis(100);

/// Evaluates scripts for the process at the other end of standard input and output, until that hangs up.
pub fn serve() -> ExitCode {
    let parent = confine::parent();
    confine::process();
    confine::addresses(limits::SCRIPT_ADDRESSES);
    // What a panic says goes back as an error; a backtrace here would be nobody's.
    std::panic::set_hook(Box::new(|_| {}));
    let work = std::thread::Builder::new().name("script".into()).stack_size(limits::SCRIPT_STACK).spawn(work);
    let Ok(work) = work else { return ExitCode::FAILURE };
    while !work.is_finished() {
        std::thread::park_timeout(GLANCE);
        if confine::parent() != parent {
            return ExitCode::FAILURE;
        }
        let since = RUNNING_SINCE.load(Ordering::Relaxed);
        let allowed = SECONDS.load(Ordering::Relaxed);
        let has_run = |seconds: u64| now().saturating_sub(since) > Duration::from_secs(seconds).as_nanos() as u64;
        if since > 0 && has_run(allowed) {
            say(&Reply::<bool>::Overdue(STEP.load(Ordering::Relaxed)), &mut Encoder::default());
            return ExitCode::FAILURE;
        }
        if since > 0 && has_run(allowed.saturating_sub(limits::SCRIPT_SECONDS_OF_GRACE)) {
            LATE.store(since, Ordering::Relaxed);
        }
    }
    match work.join() {
        Ok(Ok(())) => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

fn now() -> u64 {
    clock::process_time().as_nanos() as u64
}

fn say<T: Codec>(reply: &Reply<T>, encoder: &mut Encoder) {
    encoder.start_message();
    encoder.put(reply);
    let mut out = io::stdout().lock();
    // Whoever has hung up needs no answer; the next request ends the process.
    let _ = send(&mut out, &encoder.bytes).and_then(|()| out.flush());
}

/// What is open in this process.
#[derive(Default)]
struct Session {
    script: Option<Interpreter>,
    project: Arc<Project>,
    /// Files that the program knows of already.
    told: usize,
    /// Parameters that it knows of.
    told_parameters: usize,
    scene: Arc<Scene>,
    /// What calls of the script may use.
    allowance: Allowance,
    /// For answers: it knows what came with the scene.
    encoder: Encoder,
}

fn work() -> io::Result<()> {
    let main = std::thread::current();
    let mut input = io::stdin().lock();
    let mut session = Session::default();
    sandbox::show_steps(&STEP);
    sandbox::heed(&RUNNING_SINCE, &LATE);
    sandbox::tell_of_calls(restart);
    sandbox::tell_of_limits(raise);
    while let Some(message) = receive(&mut input)? {
        let request = Decoder::new(&message, SharedTable::default(), false).get::<Request>();
        match request.map_err(|Malformed| io::Error::from(io::ErrorKind::InvalidData))? {
            Request::Probe(probing) => sandbox::set_probe(probe(probing)),
            Request::Scene => {
                confine::all_addresses();
                let message = receive(&mut input)?.unwrap_or_default();
                let mut decoder = Decoder::new(&message, SharedTable::default(), true);
                let scene = decoder.get::<Scene>().map_err(|Malformed| io::Error::from(io::ErrorKind::InvalidData))?;
                session.scene = Arc::new(scene);
                session.encoder = Encoder { table: decoder.table, ..Encoder::default() };
                confine::addresses(addresses(session.allowance));
            }
            Request::Open(opening) => {
                let mut remarks = Remarks::default();
                session.allowance = Allowance::default();
                // What is wrong with it is said where the script is opened.
                let _ = session.allowance.define(&opening.defines);
                let outcome = bounded(session.allowance, || session.open(opening, &mut remarks));
                let files = session.new_files();
                session.keep_new(&mut remarks);
                say(&Reply::Done { outcome, files, remarks }, &mut session.encoder);
            }
            Request::Call(time) => {
                let mut remarks = Remarks::default();
                let outcome = bounded(session.allowance, || match &session.script {
                    Some(script) => script.call(&session.scene, time, &mut remarks),
                    None => Err(Diagnostic::error("no script is open").into()),
                });
                let files = session.new_files();
                session.keep_new(&mut remarks);
                say(&Reply::Done { outcome, files, remarks }, &mut session.encoder);
            }
            Request::Resume(states) => {
                if let Some(script) = &session.script {
                    script.resume(&session.scene, states);
                }
            }
            Request::States(steps) => {
                let states = session.script.as_ref().map(|script| script.states(&session.scene, &steps));
                let made = MadeStates { states: states.unwrap_or_default(), read: session.project.contents() };
                let reply = Reply::Done { outcome: Ok(made), files: Vec::new(), remarks: Remarks::default() };
                say(&reply, &mut session.encoder);
            }
            Request::PlaceOf(time, part, component) => {
                let place = |script: &Interpreter| script.place_of(&session.scene, time, part, component);
                let outcome = bounded(session.allowance, || Ok(session.script.as_ref().and_then(place)));
                let reply = Reply::Done { outcome, files: Vec::new(), remarks: Remarks::default() };
                say(&reply, &mut session.encoder);
            }
        }
    }
    main.unpark();
    Ok(())
}

/// Address space for a script beyond its scene.
fn addresses(allowance: Allowance) -> u64 {
    let more = allowance.bytes().saturating_sub(limits::SCRIPT_BYTES) as u64;
    limits::SCRIPT_ADDRESSES + 2 * more
}

/// Lets a run that starts now take the time of one call.
fn give_time(allowance: Allowance) {
    let seconds = allowance.seconds() + limits::SCRIPT_SECONDS_OF_GRACE;
    confine::processor(2 * seconds);
    SECONDS.store(seconds, Ordering::Relaxed);
}

/// Lets a run hold what one call may hold.
fn give_memory(allowance: Allowance) {
    if let Some(held) = memory::held() {
        let answer = limits::SCRIPT_BYTES_OF_ANSWER.max(allowance.bytes());
        memory::limit(held.saturating_add(allowance.bytes() + answer));
    }
}

/// Runs a script under the limits of its process.
fn bounded<T>(allowance: Allowance, run: impl FnOnce() -> Result<T, Diagnostics>) -> Result<T, Diagnostics> {
    give_time(allowance);
    give_memory(allowance);
    RUNNING_SINCE.store(now().max(1), Ordering::Relaxed);
    let outcome = run();
    RUNNING_SINCE.store(0, Ordering::Relaxed);
    memory::limit(usize::MAX);
    outcome
}

/// Gives a run its time anew: each step of a simulation has that of a call.
fn restart() {
    if RUNNING_SINCE.load(Ordering::Relaxed) > 0 {
        give_time(sandbox::allowance());
        RUNNING_SINCE.store(now().max(1), Ordering::Relaxed);
    }
}

/// The header of a script that runs has raised its limits.
fn raise(allowance: Allowance) {
    if RUNNING_SINCE.load(Ordering::Relaxed) > 0 {
        confine::all_addresses();
        confine::addresses(addresses(allowance));
        give_time(allowance);
        give_memory(allowance);
    }
}

fn probe(probing: Probing) -> sandbox::Probe {
    match probing {
        Probing::Tell { from, every } => {
            let tell = |step: u64| say(&Reply::<bool>::Step(step), &mut Encoder::default());
            sandbox::Probe { stop_at: None, report: Some(sandbox::StepReport { from, every, tell }) }
        }
        Probing::StopAt(step) => sandbox::Probe { stop_at: Some(step), report: None },
    }
}

impl Session {
    fn open(&mut self, opening: Opening, remarks: &mut Remarks) -> Result<Opened, Diagnostics> {
        let Opening { version, path, defines, root, allowed } = opening;
        if version != env!("CARGO_PKG_VERSION") {
            let message = format!("the script's process is of version {}, not {version}", env!("CARGO_PKG_VERSION"));
            return Err(Diagnostic::error(message).because(Cause::Io).into());
        }
        self.project = Arc::new(Project::new(root, allowed));
        let script = Interpreter::open(&path, &defines, &self.project, remarks)?;
        let (header, has_setup) = (script.header().clone(), script.has_setup());
        let (place_of_scene, simulates) = (script.place_of_scene(), script.simulates());
        self.allowance = header.limits;
        confine::all_addresses();
        confine::addresses(addresses(self.allowance));
        self.script = Some(script);
        Ok(Opened { header, has_setup, place_of_scene, simulates })
    }

    /// Leaves out the parameters, if the program was told of all of them.
    fn keep_new(&mut self, remarks: &mut Remarks) {
        if remarks.parameters.len() == self.told_parameters {
            remarks.parameters.clear();
        } else {
            self.told_parameters = remarks.parameters.len();
        }
    }

    /// All files, if there are any that the program was not told of.
    fn new_files(&mut self) -> Vec<(std::path::PathBuf, FileRole)> {
        let count = self.project.count();
        if count == self.told {
            return Vec::new();
        }
        self.told = count;
        self.project.recorded()
    }
}
