//! Scripts: Rhai functions that turn a frame number into edits.
//!
//! ```text
//! animation(#{ scene: "chess.ron", fps: 24, frames: 96, mode: "clip" });   // once, at the top; mode "clip" or "loop"
//! fn setup(s) { ... }      // once: build by procedure
//! fn frame(s, f) { ... }   // every frame, from what setup left; nothing is kept from frame to frame
//! ```
//!
//! A script never holds the World: it writes into an overlay over the scene, and what differs in the end is its list of
//! [`Edit`]s. It sees no clock, no file but modules below the project root, and random numbers only from a seed.
//!
//! # Where scripts run
//!
//! Rhai bounds what a script does, but not all of it: one operation may fill memory or overflow the stack, which ends the
//! process without a word. So the program evaluates scripts in processes of their own ([`host`]), which take no harm with
//! them. A library says where ([`Evaluation`]); by itself it evaluates in its own process, where [`limits`] of operations,
//! sizes and processor time hold, and no budget of bytes unless its allocator counts ([`memory`]).
//!
//! [`limits`]: crate::base::limits
//! [`memory`]: crate::base::memory
//!
//! | files | |
//! |---|---|
//! | `interpreter`, `engine`, [`host`] | a script that is evaluated, the engine put together, and the process it runs in |
//! | `entry`, `modules`, `tokens`, `rewrite`, `closures` | before evaluation: modules found, the grammar that Rhai lacks |
//! | `sandbox`, `allowance` | limits |
//! | `overlay`, `handles`, `scene_api`, `fields`, `convert` | the scene in the hands of a script, and its edits |
//! | `context`, `time`, `parameters`, `simulation` | header, the time of a frame, `-D`, a state from step to step |
//! | `inspect`, `map_keys`, `errors`, `words`, `vocabulary`, `said` | what went wrong, in our words and at its place; `print` |
//! | the others | chapters of the API, a subject each |
//!
//! # What a script can say
//!
//! It stands in one table (`table`): each function with its registration, its text and an example that runs as a test; the
//! guide is made from it.

pub mod allowance;
mod cameras;
mod clip_frames;
mod clips;
mod closures;
mod constraints;
mod context;
mod convert;
mod csv_text;
mod curve;
mod data;
mod easing;
mod elsewhere;
mod engine;
mod entry;
mod errors;
pub mod examples;
mod fields;
mod foreign_grammar;
mod geometry;
mod handles;
pub mod host;
pub mod idioms;
mod inspect;
mod instances;
mod interpolate;
mod interpreter;
mod map_keys;
mod mathematics;
mod modules;
mod morphing;
mod noise;
mod options;
mod overlay;
mod parameters;
mod paths;
mod placing;
mod random;
mod rewrite;
mod said;
mod sandbox;
mod scene_api;
mod simulation;
mod subjects;
mod table;
mod time;
mod tokens;
mod unknown;
mod vector;
mod vocabulary;
mod words;
mod world;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, Subject};
use crate::base::digest::Digest;
use crate::base::files;
use crate::base::project::{FileRole, Folder, Project};
use crate::base::rate::Rate;
use crate::components::{Edit, Scene};
pub use clip_frames::ClipFrames;
pub use host::MadeStates;
use host::{HostCommand, HostPool};
use interpreter::Interpreter;
pub use parameters::{Parameter, ParameterKind};
use said::{Journal, Remarks, When};
pub use simulation::NumberedStates;
pub use table::{CHAPTERS, Chapter, Function};
pub use time::{Header, TimeMode};

/// Where scripts are evaluated.
#[derive(Clone, Debug, Default)]
pub enum Evaluation {
    /// In this process. The limits of a script hold, but one that overflows the engine's stack or asks for more memory in
    /// one operation than there is ends the process.
    #[default]
    InProcess,
    /// In processes of their own, which may end without harm.
    Hosted(HostCommand),
}

/// A script, compiled, its top level run once.
pub struct Program {
    evaluator: Evaluator,
    header: Header,
    has_setup: bool,
    simulates: bool,
    /// Where the script names its scene.
    place_of_scene: Place,
    folder: PathBuf,
    project: Arc<Project>,
    /// Values of parameters, which are the user's own words.
    given: Vec<String>,
    journal: Journal,
}

/// A frame, counted from 1, and how many frames from its own time.
pub type Moment = (u32, f64);

enum Evaluator {
    Here(Box<Interpreter>),
    Hosted(Box<HostPool>),
    Clip(ClipFrames),
}

impl Program {
    /// Reads a script and runs its top level; `defines` are the values given by `-D`.
    ///
    /// # Errors
    /// A file that cannot be read, mistakes of the script with their places, a define that it does not use.
    pub fn open(
        path: &Path,
        defines: &[(String, String)],
        project: &Arc<Project>,
        evaluation: &Evaluation,
    ) -> Result<Program, Diagnostics> {
        let journal = Journal::new(&path.to_string_lossy());
        let (evaluator, header, has_setup, place_of_scene, simulates) = match evaluation {
            Evaluation::InProcess => {
                let mut remarks = Remarks::default();
                let opened = Interpreter::open(path, defines, project, &mut remarks);
                journal.add(remarks, When::Top);
                let here = Box::new(opened.map_err(|problems| problems.after(journal.take_printed()))?);
                let (header, has_setup, place) = (here.header().clone(), here.has_setup(), here.place_of_scene());
                let simulates = here.simulates();
                (Evaluator::Here(here), header, has_setup, place, simulates)
            }
            Evaluation::Hosted(command) => {
                let (pool, opened) = HostPool::open(command, path, defines, project, &journal)?;
                let host::Opened { header, has_setup, place_of_scene, simulates } = opened;
                (Evaluator::Hosted(Box::new(pool)), header, has_setup, place_of_scene, simulates)
            }
        };
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let given = defines.iter().map(|(_, value)| value.clone()).collect();
        let project = project.clone();
        Ok(Program { evaluator, header, has_setup, simulates, place_of_scene, folder, project, given, journal })
    }

    /// The sequence that a clip is from its start to its end, in so many frames; `file` is where it was read from.
    pub fn of_clip(clip: ClipFrames, frames: u32, file: &Path, project: &Arc<Project>) -> Program {
        let seconds = clip.span[1] - clip.span[0];
        let rate = Rate::from_number(f64::from(frames - 1) / seconds).unwrap_or(Rate::USUAL);
        Program {
            evaluator: Evaluator::Clip(clip),
            header: Header { rate, frames, ..Header::default() },
            has_setup: false,
            simulates: false,
            place_of_scene: Place::file(&*file.to_string_lossy()),
            folder: file.parent().unwrap_or(Path::new("")).to_path_buf(),
            project: project.clone(),
            given: Vec::new(),
            journal: Journal::new(&file.to_string_lossy()),
        }
    }

    /// What the script says of its sequence.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The scene's file, and the project that it is read in: in the script's folder, in `scenes` beside it, or where the
    /// working folder has it, below the project root. What the user has named with `-D` may lie anywhere.
    ///
    /// # Errors
    /// None of them is there; the place of `animation` and the nearest name.
    pub fn scene_path(&self) -> Result<Option<(PathBuf, Arc<Project>)>, Diagnostics> {
        let Some(name) = &self.header.scene else { return Ok(None) };
        let beside = self.folder.join("..").join("scenes");
        let plain = self.folder.parent().filter(|_| self.folder.file_name().is_some());
        let beside = plain.map_or(beside, |parent| parent.join("scenes"));
        let folders = [self.folder.clone(), beside, PathBuf::new()];
        let paths = folders.iter().map(|folder| folder.join(name));
        if self.given.contains(name)
            && let Some(path) = paths.clone().find(|path| path.is_file())
        {
            return Ok(Some((path.clone(), self.project_of_own(&path)?)));
        }
        let mut refused = None;
        for folder in &folders {
            match Folder::new(folder.as_path(), self.project.clone()).find(name, FileRole::Scene) {
                Ok(path) if path.is_file() => return Ok(Some((path, self.project.clone()))),
                Ok(_) => {}
                Err(problem) => drop(refused.get_or_insert(problem)),
            }
        }
        if let Some(refused) = refused.filter(|_| paths.clone().any(|path| path.is_file())) {
            return Err(refused.at(self.place_of_scene.clone()).into());
        }
        let missing = Diagnostic::error(format!("there is no scene `{name}`")).at(self.place_of_scene.clone());
        Err(match paths.clone().find_map(|path| files::nearest_file(&path)) {
            Some(near) => missing.help(format!("did you mean `{near}`?")),
            None => missing.help("scenes are looked for beside the script, in `scenes` beside its folder, and here"),
        }
        .into())
    }

    /// A scene that the user has named brings its own project.
    fn project_of_own(&self, scene: &Path) -> Result<Arc<Project>, Diagnostic> {
        if self.project.holds(scene) {
            return Ok(self.project.clone());
        }
        let own = Project::of(scene, &Default::default())?;
        Ok(Arc::new(self.project.and(own.root())))
    }

    /// The edits of `setup`; none if the script has no such function.
    ///
    /// # Errors
    /// Mistakes of the script, with their places.
    pub fn setup(&self, scene: &Arc<Scene>) -> Result<Vec<Edit>, Diagnostics> {
        if !self.has_setup {
            return Ok(Vec::new());
        }
        self.call(scene, None).map_err(|problems| problems.after(self.take_printed()))
    }

    /// Parameters that were declared so far, by the top of the script and by what was evaluated since, in the order of
    /// their declarations.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.journal.parameters()
    }

    /// What the script has printed since this was asked last: each distinct line once, with the frames that said it.
    pub fn take_printed(&self) -> Vec<String> {
        self.journal.take_printed()
    }

    /// The edits of one frame, counted from 1, `offset` frames from its own time: a pure function of all three.
    ///
    /// # Errors
    /// Mistakes of the script, with their places and the frame.
    pub fn frame(&self, rest: &Arc<Scene>, number: u32, offset: f64) -> Result<Vec<Edit>, Diagnostics> {
        self.call(rest, Some((number, offset)))
    }

    /// The digest of what the states of the script's simulation follow from, started from a scene: all but the files that
    /// it reads. `None` without a simulation whose states can be kept.
    pub fn simulation_key(&self, scene: &Arc<Scene>) -> Option<Digest> {
        match &self.evaluator {
            Evaluator::Hosted(pool) if self.simulates => Some(pool.simulation_key(scene)),
            Evaluator::Hosted(_) | Evaluator::Here(_) | Evaluator::Clip(_) => None,
        }
    }

    /// Lets the simulation go on from states that were made before, from the same scene, by the numbers of their steps.
    pub fn resume(&self, scene: &Arc<Scene>, states: NumberedStates) {
        if let Evaluator::Hosted(pool) = &self.evaluator {
            pool.resume(scene, states);
        }
    }

    /// Those of these steps' states that were made from a scene, and what the script has read.
    pub fn states(&self, scene: &Arc<Scene>, steps: &[u64]) -> MadeStates {
        match &self.evaluator {
            Evaluator::Hosted(pool) => pool.states(scene, steps),
            Evaluator::Here(_) | Evaluator::Clip(_) => MadeStates::default(),
        }
    }

    /// Where `setup`, or `frame` at a moment, writes to what a mistake is about.
    pub fn place_of(&self, scene: &Arc<Scene>, time: Option<Moment>, subject: Subject) -> Option<Place> {
        let of = |component| {
            let subject = Subject { component, ..subject };
            match &self.evaluator {
                Evaluator::Here(interpreter) => interpreter.place_of(scene, time, subject.part, subject.component),
                Evaluator::Hosted(pool) => pool.place_of(scene, time, subject),
                Evaluator::Clip(_) => None,
            }
        };
        subject.component.and_then(|component| of(Some(component))).or_else(|| of(None))
    }

    /// The script as a whole.
    pub fn place(&self) -> Place {
        Place::file(self.place_of_scene.file.clone())
    }

    /// Where the script names its scene; the script as a whole if it names none.
    pub fn place_of_scene(&self) -> Place {
        self.place_of_scene.clone()
    }

    fn call(&self, scene: &Arc<Scene>, time: Option<Moment>) -> Result<Vec<Edit>, Diagnostics> {
        match &self.evaluator {
            Evaluator::Here(interpreter) => {
                let mut remarks = Remarks::default();
                let outcome = interpreter.call(scene, time, &mut remarks);
                self.journal.add(remarks, When::of(time));
                outcome
            }
            Evaluator::Hosted(pool) => pool.call(scene, time, &self.journal),
            Evaluator::Clip(clip) => clip.call(&self.header, scene, time),
        }
    }
}

#[cfg(test)]
mod tests;
