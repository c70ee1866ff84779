//! As many of a script's processes as are asked at once.

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub use super::protocol::Opened;

use super::HostCommand;
use super::autopsy::{self, Autopsy, SentCall};
use super::protocol::Opening;
use super::worker::{Death, HostWorker, SentScene};
use crate::base::diagnostics::{Diagnostics, Place, Subject};
use crate::base::project::Project;
use crate::components::{Edit, Scene};
use crate::script::Moment;
use crate::script::allowance::Allowance;
use crate::script::said::Journal;

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
    /// What calls of the script may use.
    allowance: Allowance,
}

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
        match worker.call(&scene, time, &self.project, journal) {
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
