//! One script's process, from the program's side.

use std::io::{self, BufReader, Read};
use std::process::{Child, ChildStdin, ChildStdout, ExitStatus};
use std::sync::Arc;

use super::HostCommand;
use super::protocol::{MadeStates, Opened, Opening, Probing, Reply, Request, receive, send};
use crate::base::codec::{Codec, Decoder, Encoder, Malformed, SharedTable};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, Place, Subject};
use crate::base::digest::Digest;
use crate::base::project::Project;
use crate::components::{Edit, Scene};
use crate::script::Moment;
use crate::script::said::{Journal, When};
use crate::script::simulation::NumberedStates;

/// A scene as bytes, and what answers may name by number.
pub struct SentScene {
    pub scene: Arc<Scene>,
    bytes: Vec<u8>,
    table: SharedTable,
}

impl SentScene {
    pub fn new(scene: &Arc<Scene>) -> Self {
        let mut encoder = Encoder { teaches: true, ..Encoder::default() };
        encoder.put(&**scene);
        SentScene { scene: scene.clone(), bytes: encoder.bytes, table: encoder.table }
    }

    /// Of all that is in it.
    pub fn digest(&self) -> Digest {
        Digest::of(&self.bytes)
    }
}

/// How a process came to its end instead of an answer.
#[derive(Debug)]
pub struct Death {
    pub status: Option<ExitStatus>,
    /// The end of what it said on its standard error.
    pub said: String,
    /// The step that it was at when its time was over.
    pub overdue_at: Option<u64>,
    /// The last step that it has told.
    pub last_step: Option<u64>,
}

pub struct HostWorker {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    scene: Option<Arc<SentScene>>,
}

/// So much of what a process says in the end is read.
const LAST_WORDS: u64 = 16 << 10;
/// Room for messages on their way: edits of a thousand entities.
const BUFFER: usize = 256 << 10;

impl HostWorker {
    /// # Errors
    /// The process cannot be started.
    pub fn start(command: &HostCommand) -> Result<HostWorker, Diagnostic> {
        let failed = |error: &io::Error| {
            Diagnostic::error(format!("cannot start the script's process: {error}")).because(Cause::Io)
        };
        let mut child = command.start().map_err(|e| failed(&e))?;
        match (child.stdin.take(), child.stdout.take()) {
            (Some(input), Some(output)) => {
                widen(&output);
                Ok(HostWorker {
                    child,
                    input: Some(input),
                    output: BufReader::with_capacity(BUFFER, output),
                    scene: None,
                })
            }
            _ => Err(failed(&io::ErrorKind::BrokenPipe.into())),
        }
    }

    /// Opens a script.
    ///
    /// # Errors
    /// The process has come to its end.
    pub fn open(
        &mut self,
        opening: &Opening,
        project: &Project,
        journal: &Journal,
    ) -> Result<Result<Opened, Diagnostics>, Death> {
        self.ask(&Request::Open(opening.clone()), project, journal, When::Top)
    }

    /// # Errors
    /// As [`Self::open`].
    pub fn probe(&mut self, probing: Probing) -> Result<(), Death> {
        let sent = self.send(&Request::Probe(probing));
        sent.map_err(|_| self.death(None, None))
    }

    /// Evaluates a call from a scene.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn call(
        &mut self,
        (scene, resumed): (&Arc<SentScene>, Option<&NumberedStates>),
        time: Option<Moment>,
        project: &Project,
        journal: &Journal,
    ) -> Result<Result<Vec<Edit>, Diagnostics>, Death> {
        if self.show(scene)?
            && let Some(states) = resumed
        {
            self.send(&Request::Resume(states.clone())).map_err(|_| self.death(None, None))?;
        }
        self.ask(&Request::Call(time), project, journal, When::of(time))
    }

    /// Where a call writes to a part of the scene.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn place_of(
        &mut self,
        scene: &Arc<SentScene>,
        time: Option<Moment>,
        subject: Subject,
        project: &Project,
        journal: &Journal,
    ) -> Result<Result<Option<Place>, Diagnostics>, Death> {
        self.show(scene)?;
        self.ask(&Request::PlaceOf(time, subject.part, subject.component), project, journal, When::of(time))
    }

    /// The states of these numbers that it has made from a scene; none if it was never shown that.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn states(
        &mut self,
        scene: &Arc<SentScene>,
        steps: &[u64],
        project: &Project,
        journal: &Journal,
    ) -> Result<Result<MadeStates, Diagnostics>, Death> {
        if self.scene.as_ref().is_none_or(|known| !Arc::ptr_eq(known, scene)) {
            return Ok(Ok(MadeStates::default()));
        }
        self.ask(&Request::States(steps.to_vec()), project, journal, When::Top)
    }

    /// Sends a scene, unless it is there; whether it was sent.
    fn show(&mut self, scene: &Arc<SentScene>) -> Result<bool, Death> {
        if self.scene.as_ref().is_none_or(|known| !Arc::ptr_eq(known, scene)) {
            let sent = self.send(&Request::Scene).and_then(|()| match &mut self.input {
                Some(input) => send(input, &scene.bytes),
                None => Ok(()),
            });
            sent.map_err(|_| self.death(None, None))?;
            self.scene = Some(scene.clone());
            return Ok(true);
        }
        Ok(false)
    }

    fn send(&mut self, request: &Request) -> io::Result<()> {
        let mut encoder = Encoder::default();
        encoder.put(request);
        match &mut self.input {
            Some(input) => send(input, &encoder.bytes),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    fn ask<T: Codec>(
        &mut self,
        request: &Request,
        project: &Project,
        journal: &Journal,
        when: When,
    ) -> Result<Result<T, Diagnostics>, Death> {
        let (mut overdue_at, mut last_step) = (None, None);
        // Where it hangs up while it is asked, its answer may tell why.
        let _ = self.send(request);
        while let Ok(Some(message)) = receive(&mut self.output) {
            let table = self.scene.as_ref().map(|scene| scene.table.clone()).unwrap_or_default();
            match Decoder::new(&message, table, false).get::<Reply<T>>() {
                Ok(Reply::Done { outcome, files, remarks }) => {
                    journal.add(remarks, when);
                    files.iter().for_each(|(path, role)| project.record(path, *role));
                    return Ok(outcome);
                }
                Ok(Reply::Step(step)) => last_step = Some(step),
                Ok(Reply::Overdue(step)) => overdue_at = Some(step),
                Err(Malformed) => break,
            }
        }
        Err(self.death(overdue_at, last_step))
    }

    /// Waits for the end of a process that has hung up.
    fn death(&mut self, overdue_at: Option<u64>, last_step: Option<u64>) -> Death {
        drop(self.input.take());
        let mut said = Vec::new();
        if let Some(errors) = self.child.stderr.take() {
            let _ = errors.take(LAST_WORDS).read_to_end(&mut said);
        }
        let status = self.child.wait().ok();
        Death { status, said: String::from_utf8_lossy(&said).into_owned(), overdue_at, last_step }
    }
}

impl Drop for HostWorker {
    fn drop(&mut self) {
        drop(self.input.take());
        // It has nothing left to say: it would end by itself, when it comes to read what it is asked next.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Lets the pipe hold more than the usual 64 KiB, so that long answers do not wait for their reader in the middle.
#[cfg(target_os = "linux")]
fn widen(output: &ChildStdout) {
    let _ = rustix::pipe::fcntl_setpipe_size(output, BUFFER);
}

#[cfg(not(target_os = "linux"))]
fn widen(_: &ChildStdout) {}
