//! Scripts: Rhai functions that turn a frame number into edits.
//!
//! ```text
//! animation(#{ scene: "chess.ron", fps: 24, frames: 96, mode: "clip" });   // once, at the top; mode "clip" or "loop"
//! fn setup(s) { ... }      // once: build by procedure
//! fn frame(s, f) { ... }   // every frame, from what setup left; nothing is kept from frame to frame
//! ```
//!
//! A script never holds the World: it writes into an overlay over the scene, and what differs in the end is its list of
//! [`Edit`]s. It sees no clock, no file but modules below its folder, and random numbers only from a seed.
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

mod convert;
mod engine;
mod errors;
mod handles;
mod motion;
mod overlay;
mod random;
mod sandbox;
mod time;
mod tokens;
mod vector;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use ::rhai::{AST, CallFnOptions, Dynamic, Engine, Map, Scope};
use engine::TopLevel;
use errors::ScriptSource;
use handles::SceneHandle;
use overlay::{NameIndex, Overlay};
pub use time::{Header, TimeMode};

use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, nearest};
use crate::base::{files, limits, random as hash};
use crate::components::{Edit, Scene};

/// A script, compiled, its top level run once.
pub struct Program {
    engine: Engine,
    ast: AST,
    constants: Map,
    header: Header,
    source: ScriptSource,
    folder: PathBuf,
    /// Names of the scene that frames start from, made once.
    index: Mutex<Option<(Arc<Scene>, Arc<NameIndex>)>>,
}

impl Program {
    /// Reads a script and runs its top level; `defines` are the values given by `-D`.
    ///
    /// # Errors
    /// A file that cannot be read, mistakes of the script with their places, a define that it does not use.
    pub fn open(path: &Path, defines: &[(String, String)]) -> Result<Program, Diagnostics> {
        let text = files::read_text(path, limits::SCRIPT_FILE_BYTES)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let source = ScriptSource { file: path.to_string_lossy().into(), text };
        source.check_defines(defines)?;
        let top = Arc::new(Mutex::new(TopLevel::default()));
        let constants = Arc::new(Mutex::new(Map::new()));
        let mut engine = engine::new(&folder, defines, &top, &constants);
        let ast = engine.compile(&source.text).map_err(|e| source.diagnose(e.into(), None))?;
        let mut scope = Scope::new();
        sandbox::start_call();
        engine.run_ast_with_scope(&mut scope, &ast).map_err(|e| source.diagnose(*e, None))?;
        let globals: Map = scope.iter().map(|(name, _, value)| (name.into(), value)).collect();
        let header = match top.lock() {
            Ok(mut top) => top.header.take(),
            Err(_) => None,
        };
        let header = header.ok_or_else(|| {
            Diagnostic::error("the script does not call `animation`")
                .at(Place::file(source.file.clone()))
                .help("start it with animation(#{ scene: \"scene.ron\", frames: 48, fps: 24, mode: \"clip\" });")
        })?;
        if !ast.iter_functions().any(|f| f.name == "frame" && f.params.len() == 2) {
            let missing = Diagnostic::error("the script has no function `frame(s, f)`");
            return Err(missing.at(Place::file(source.file.clone())).help("add fn frame(s, f) { ... }").into());
        }
        engine::freeze(&mut engine);
        if let Ok(mut constants) = constants.lock() {
            constants.clone_from(&globals);
        }
        let ast = ast.clone_functions_only();
        Ok(Program { engine, ast, constants: globals, header, source, folder, index: Mutex::new(None) })
    }

    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The scene's file: in the script's folder, in `scenes` beside it, or where the working folder has it.
    ///
    /// # Errors
    /// None of them is there; the place of `animation` and the nearest name.
    pub fn scene_path(&self) -> Result<Option<PathBuf>, Diagnostics> {
        let Some(name) = &self.header.scene else { return Ok(None) };
        let beside = self.folder.join("..").join("scenes").join(name);
        let plain = self.folder.parent().filter(|_| self.folder.file_name().is_some());
        let beside = plain.map_or(beside, |parent| parent.join("scenes").join(name));
        let places = [self.folder.join(name), beside, PathBuf::from(name)];
        if let Some(found) = places.iter().find(|path| path.is_file()) {
            return Ok(Some(found.clone()));
        }
        let missing = Diagnostic::error(format!("there is no scene `{name}`")).at(self.source.place_of_scene(name));
        Err(match places.iter().find_map(|path| files::nearest_file(path)) {
            Some(near) => missing.help(format!("did you mean `{near}`?")),
            None => missing.help("scenes are looked for beside the script, in `scenes` beside its folder, and here"),
        }
        .into())
    }

    /// The edits of `setup`; none if the script has no such function.
    ///
    /// # Errors
    /// Mistakes of the script, with their places.
    pub fn setup(&self, scene: &Arc<Scene>) -> Result<Vec<Edit>, Diagnostics> {
        if !self.ast.iter_functions().any(|f| f.name == "setup") {
            return Ok(Vec::new());
        }
        self.call("setup", scene, None)
    }

    /// The edits of one frame, counted from 1, `offset` frames from its own time: a pure function of all three.
    ///
    /// # Errors
    /// Mistakes of the script, with their places and the frame.
    pub fn frame(&self, rest: &Arc<Scene>, number: u32, offset: f64) -> Result<Vec<Edit>, Diagnostics> {
        self.call("frame", rest, Some((number, offset)))
    }

    fn call(&self, function: &str, scene: &Arc<Scene>, time: Option<(u32, f64)>) -> Result<Vec<Edit>, Diagnostics> {
        let number = time.map(|(number, _)| number);
        let seed = hash::hash_words([self.header.seed, u64::from(number.unwrap_or(0))]);
        let handle = SceneHandle::new(Overlay::new(scene.clone(), self.index_of(scene)), seed);
        let options = CallFnOptions::new().eval_ast(false).with_tag(handle.clone());
        let mut scope = Scope::new();
        for (name, value) in &self.constants {
            scope.push_constant_dynamic(name.as_str(), value.clone());
        }
        let scene_argument = Dynamic::from(handle.clone());
        sandbox::start_call();
        let outcome = match time {
            Some((number, offset)) => {
                let frame = Dynamic::from(time::FrameTime::new(&self.header, number, offset, seed));
                self.engine.call_fn_with_options::<Dynamic>(
                    options,
                    &mut scope,
                    &self.ast,
                    function,
                    (scene_argument, frame),
                )
            }
            None => {
                self.engine.call_fn_with_options::<Dynamic>(options, &mut scope, &self.ast, function, (scene_argument,))
            }
        };
        outcome.map(|_| handle.edits()).map_err(|e| self.source.diagnose(*e, number))
    }

    fn index_of(&self, scene: &Arc<Scene>) -> Arc<NameIndex> {
        let Ok(mut kept) = self.index.lock() else { return Arc::new(NameIndex::new(scene)) };
        if let Some((known, index)) = &*kept
            && Arc::ptr_eq(known, scene)
        {
            return index.clone();
        }
        let index = Arc::new(NameIndex::new(scene));
        *kept = Some((scene.clone(), index.clone()));
        index
    }
}

/// The nearest known word as a help text.
fn did_you_mean<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(found, known).map(|word| format!("did you mean `{word}`?"))
}

#[cfg(test)]
mod tests;
