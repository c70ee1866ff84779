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
//! # What a script can say
//!
//! - `s.camera`, `s.render`, `s.material(name)`, `s.get(name)`, `s.has(name)`, `s.entities()`, `s.tagged(tag)`,
//!   `s.spawn(#{...})`, `s.despawn(entity)`, `s.add_material(name, #{...})`, `s.rng`.
//! - An entity: its transform's fields (`translation rotation scale parent`), `yaw pitch roll`, `name`, `tags`,
//!   `material` (a name), `color` of its light, and every component by name: `e.sphere.radius`, `e.area_light.color`.
//!   Assigning `()` to a component takes it off.
//! - A frame: `f.number f.index f.count f.seconds f.t f.fps f.rng f.span(a, b)`. Loop time is index / count, so that
//!   the last frame joins the first; clip time is index / (count - 1). While `s.camera.shutter` is open, `frame` is
//!   called for moments in between too: `f.t` and `f.seconds` are theirs, everything else is the frame's, and of
//!   `s.render` and the shutter itself only what the frame's own time gives counts.
//! - Parameters: `param(name, default)`, given by `-D name=value`.
//! - Vectors: `vec3(x, y, z)` or `[x, y, z]`; `+ - * /`, `.x .y .z`, `dot cross length normalize distance`.
//! - Motion: `lerp clamp smoothstep remap ease bezier spring keys orbit polar look_at aim rack`, `sind cosd tand`.
//! - Random: `rng.float() rng.range(a, b) rng.int(a, b) rng.pick(list) rng.unit_vector()`, `rng(seed)`.

mod closures;
mod convert;
mod engine;
mod errors;
mod handles;
pub mod host;
pub mod idioms;
mod interpreter;
mod modules;
mod motion;
mod overlay;
mod random;
mod sandbox;
mod time;
mod tokens;
mod vector;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, Subject, nearest};
use crate::base::files;
use crate::base::project::{FileRole, Folder, Project};
use crate::components::{Edit, Scene};
use host::{HostCommand, HostPool};
use interpreter::Interpreter;
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
    /// Where the script names its scene.
    place_of_scene: Place,
    folder: PathBuf,
    project: Arc<Project>,
    /// Values of parameters, which are the user's own words.
    given: Vec<String>,
}

/// A frame, counted from 1, and how many frames from its own time.
pub type Moment = (u32, f64);

enum Evaluator {
    Here(Box<Interpreter>),
    Hosted(Box<HostPool>),
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
        let (evaluator, header, has_setup, place_of_scene) = match evaluation {
            Evaluation::InProcess => {
                let here = Box::new(Interpreter::open(path, defines, project)?);
                let (header, has_setup, place) = (here.header().clone(), here.has_setup(), here.place_of_scene());
                (Evaluator::Here(here), header, has_setup, place)
            }
            Evaluation::Hosted(command) => {
                let (pool, opened) = HostPool::open(command, path, defines, project)?;
                (Evaluator::Hosted(Box::new(pool)), opened.header, opened.has_setup, opened.place_of_scene)
            }
        };
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let given = defines.iter().map(|(_, value)| value.clone()).collect();
        Ok(Program { evaluator, header, has_setup, place_of_scene, folder, project: project.clone(), given })
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
        self.call(scene, None)
    }

    /// The edits of one frame, counted from 1, `offset` frames from its own time: a pure function of all three.
    ///
    /// # Errors
    /// Mistakes of the script, with their places and the frame.
    pub fn frame(&self, rest: &Arc<Scene>, number: u32, offset: f64) -> Result<Vec<Edit>, Diagnostics> {
        self.call(rest, Some((number, offset)))
    }

    /// Where `setup`, or `frame` at a moment, writes to what a mistake is about.
    pub fn place_of(&self, scene: &Arc<Scene>, time: Option<Moment>, subject: Subject) -> Option<Place> {
        let of = |component| {
            let subject = Subject { component, ..subject };
            match &self.evaluator {
                Evaluator::Here(interpreter) => interpreter.place_of(scene, time, subject.part, subject.component),
                Evaluator::Hosted(pool) => pool.place_of(scene, time, subject),
            }
        };
        subject.component.and_then(|component| of(Some(component))).or_else(|| of(None))
    }

    /// The script as a whole.
    pub fn place(&self) -> Place {
        Place::file(self.place_of_scene.file.clone())
    }

    fn call(&self, scene: &Arc<Scene>, time: Option<Moment>) -> Result<Vec<Edit>, Diagnostics> {
        match &self.evaluator {
            Evaluator::Here(interpreter) => interpreter.call(scene, time),
            Evaluator::Hosted(pool) => pool.call(scene, time),
        }
    }
}

/// The nearest known word as a help text.
fn did_you_mean<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(found, known).map(|word| format!("did you mean `{word}`?"))
}

#[cfg(test)]
mod tests;
