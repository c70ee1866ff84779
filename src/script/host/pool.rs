//! As many of a script's processes as are asked at once.

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub use super::protocol::Opened;

use super::HostCommand;
use super::autopsy::{self, Autopsy, SentCall};
use super::protocol::{MadeStates, Opening};
use super::worker::{Death, HostWorker, SentScene};
use crate::base::diagnostics::{Diagnostics, Place, Subject};
use crate::base::digest::{Digest, Hasher};
use crate::base::project::Project;
use crate::components::{Edit, Scene};
use crate::script::Moment;
use crate::script::allowance::Allowance;
use crate::script::said::Journal;
use crate::script::simulation::NumberedStates;

/// One script, open in some processes.
pub struct HostPool {
    command: HostCommand,
    opening: Opening,
    project: Arc<Project>,
    idle: Mutex<Vec<HostWorker>>,
    /// The scene that was sent last.
    scene: Mutex<Option<Arc<SentScene>>>,
    /// Ends that were looked into.
    looked_into: AtomicU32,
    /// States of a simulation that were made before, and the scene that they were made from.
    resumed: Mutex<Option<ResumedStates>>,
    /// What calls of the script may use.
    allowance: Allowance,
}

/// States by their numbers, and the scene that they were made from.
type ResumedStates = (Arc<Scene>, Arc<NumberedStates>);

/// Ends of processes whose lines are looked for: the others, most likely, are the same again.
const LOOKED_INTO: u32 = 2;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl HostPool {
    /// Opens a script in a first process.
    ///
    /// # Errors
    /// Mistakes of the script; a process that cannot be started or that the script has ended.
    pub fn open(
        command: &HostCommand,
        path: &Path,
        defines: &[(String, String)],
        project: &Arc<Project>,
        journal: &Journal,
    ) -> Result<(HostPool, Opened), Diagnostics> {
        let opening = Opening {
            version: env!("CARGO_PKG_VERSION").into(),
            path: path.to_path_buf(),
            defines: defines.to_vec(),
            root: project.root().to_path_buf(),
            allowed: project.allowed().to_vec(),
        };
        let mut pool = HostPool {
            command: command.clone(),
            opening,
            project: project.clone(),
            idle: Mutex::default(),
            scene: Mutex::default(),
            looked_into: AtomicU32::new(0),
            resumed: Mutex::default(),
            allowance: Allowance::default(),
        };
        pool.allowance.define(defines)?;
        let opened = pool.another(journal).map_err(|problems| problems.after(journal.take_printed()));
        let (worker, opened) = opened?;
        lock(&pool.idle).push(worker);
        pool.allowance = opened.header.limits;
        Ok((pool, opened))
    }

    /// Evaluates a call: `setup`, or `frame` at a time.
    ///
    /// # Errors
    /// Mistakes of the script; a process that cannot be started or that the script has ended.
    pub fn call(&self, scene: &Arc<Scene>, time: Option<Moment>, journal: &Journal) -> Result<Vec<Edit>, Diagnostics> {
        let scene = self.sent(scene);
        let idle = lock(&self.idle).pop();
        let mut worker = match idle {
            Some(worker) => worker,
            None => self.another(journal)?.0,
        };
        let resumed = lock(&self.resumed).clone().filter(|(known, _)| Arc::ptr_eq(known, &scene.scene));
        let states = resumed.as_ref().map(|(_, states)| &**states);
        match worker.call((&scene, states), time, &self.project, journal) {
            Ok(outcome) => {
                lock(&self.idle).push(worker);
                outcome
            }
            Err(death) => Err(self.explain(&death, Some((&scene, time)))),
        }
    }

    /// Where a call writes to a part of the scene; nobody knows if its process ends.
    pub fn place_of(&self, scene: &Arc<Scene>, time: Option<Moment>, subject: Subject) -> Option<Place> {
        let scene = self.sent(scene);
        let idle = lock(&self.idle).pop();
        // What it says was said before.
        let journal = Journal::new("");
        let mut worker = idle.or_else(|| self.another(&journal).ok().map(|(worker, _)| worker))?;
        let place = worker.place_of(&scene, time, subject, &self.project, &journal).ok()?;
        lock(&self.idle).push(worker);
        place.ok().flatten()
    }

    /// The digest of what states of a simulation follow from, beside the files that the script reads.
    pub fn simulation_key(&self, scene: &Arc<Scene>) -> Digest {
        let mut hasher = Hasher::default();
        hasher.text(&self.opening.version);
        hasher.text(&self.opening.path.to_string_lossy());
        for (name, value) in &self.opening.defines {
            hasher.text(name);
            hasher.text(value);
        }
        hasher.digest(self.sent(scene).digest());
        hasher.finish()
    }

    /// Lets simulations from a scene go on from states that were made before.
    pub fn resume(&self, scene: &Arc<Scene>, states: NumberedStates) {
        *lock(&self.resumed) = Some((scene.clone(), Arc::new(states)));
    }

    /// The states of these numbers that were made from a scene, and what the script has read.
    pub fn states(&self, scene: &Arc<Scene>, steps: &[u64]) -> MadeStates {
        let (scene, journal, mut all) = (self.sent(scene), Journal::new(""), MadeStates::default());
        for worker in lock(&self.idle).iter_mut() {
            if let Ok(Ok(made)) = worker.states(&scene, steps, &self.project, &journal) {
                all.states.extend(made.states);
                all.read.extend(made.read);
            }
        }
        all
    }

    fn another(&self, journal: &Journal) -> Result<(HostWorker, Opened), Diagnostics> {
        let mut worker = HostWorker::start(&self.command)?;
        match worker.open(&self.opening, &self.project, journal) {
            Ok(opened) => opened.map(|opened| (worker, opened)),
            Err(death) => Err(self.explain(&death, None)),
        }
    }

    fn sent(&self, scene: &Arc<Scene>) -> Arc<SentScene> {
        let mut known = lock(&self.scene);
        if let Some(known) = &*known
            && Arc::ptr_eq(&known.scene, scene)
        {
            return known.clone();
        }
        let sent = Arc::new(SentScene::new(scene));
        *known = Some(sent.clone());
        sent
    }

    fn explain(&self, death: &Death, call: Option<SentCall>) -> Diagnostics {
        let is_new = self.looked_into.fetch_add(1, Ordering::Relaxed) < LOOKED_INTO;
        let HostPool { command, opening, project, allowance, .. } = self;
        let autopsy = Autopsy { command, opening, project, call, allowance: *allowance };
        autopsy::explain(&autopsy, death, is_new)
    }
}
