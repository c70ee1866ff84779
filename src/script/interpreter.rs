//! A script, compiled, its top level run once, and evaluated in this process.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use ::rhai::{AST, ASTNode, CallFnOptions, Dynamic, Engine, Map, Position, Scope, Stmt};

use super::allowance::Allowance;
use super::context::ScriptContext;
use super::convert::to_dynamic;
use super::engine::{self, TopNames};
use super::errors::{Call, Fallible, ScriptSource, ScriptSources};
use super::handles::SceneHandle;
use super::modules::{ModuleGraph, ModuleLoader};
use super::overlay::{NameIndex, Overlay};
use super::rewrite::TextRole;
use super::said::Remarks;
use super::simulation::{NumberedStates, Simulation, state_of};
use super::time::{self, Header};
use super::vocabulary::Vocabulary;
use super::{Moment, constraints, entry, errors, sandbox};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, ScenePart};
use crate::base::project::{FileRole, Folder, Project};
use crate::base::{files, limits, random as hash, text as look_alikes};
use crate::components::{Edit, Scene, Value};

/// How a function of a script is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RunMode {
    Called,
    /// As a text of its own, so that places are not lost.
    Unwrapped,
    /// The same, noting when parts of the scene are written to.
    Marking,
}

pub struct Interpreter {
    engine: Engine,
    ast: AST,
    constants: Map,
    header: Header,
    sources: ScriptSources,
    shared: ScriptContext,
    /// Where the script has `start` and `step`.
    simulation: Option<Simulation>,
    /// Names of the scene that frames start from, made once.
    index: Mutex<Option<(Arc<Scene>, Arc<NameIndex>)>>,
}

impl Interpreter {
    /// Reads a script and its modules and runs its top level; `defines` are the values given by `-D`. What it says on
    /// its way goes to `remarks`, whether it comes to an end or not.
    ///
    /// # Errors
    /// A file that cannot be read, mistakes of the script with their places, a define that it does not use.
    pub fn open(
        path: &Path,
        defines: &[(String, String)],
        project: &Arc<Project>,
        remarks: &mut Remarks,
    ) -> Result<Self, Diagnostics> {
        let shared = ScriptContext::new(defines, Folder::around(path, project.clone()));
        let opened = Self::open_shared(path, defines, project, &shared);
        *remarks = shared.remarks();
        opened
    }

    fn open_shared(
        path: &Path,
        defines: &[(String, String)],
        project: &Arc<Project>,
        shared: &ScriptContext,
    ) -> Result<Self, Diagnostics> {
        engine::fix_hashes();
        project.record(path, FileRole::Script);
        let text = files::read_text(path, limits::SCRIPT_FILE_BYTES)?;
        project.note_content(path, FileRole::Script, text.as_bytes());
        let folder: PathBuf = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let file = path.to_string_lossy().into_owned();
        let names = TopNames::default();
        let graph = ModuleGraph::default();
        let mut engine = engine::new(&names);
        engine.set_module_resolver(graph.clone());
        let doubles = look_alikes::doubles(&text, &file);
        let mut vocabulary = Vocabulary::of(&engine);
        let (source, compiled) = ScriptSource::compile(&engine, &file, text, TextRole::Script, &mut vocabulary);
        let mut sources = ScriptSources::new(source, vocabulary);
        let mut ast = compiled.map_err(|problems| if doubles.is_empty() { problems } else { Diagnostics(doubles) })?;
        ast.set_source(&file);
        let mut allowance = Allowance::default();
        allowance.define(defines)?;
        sandbox::allow(allowance);
        let _current = shared.enter(None);
        ModuleLoader::new(&engine, &graph, project, &folder, &mut sources, &names).load(&file, &ast)?;
        for (alias, module) in graph.imported_at_the_top(&file, &ast) {
            engine.register_static_module(alias, module);
        }
        sources.check_defines(defines)?;
        let mut scope = Scope::new();
        sandbox::start_call();
        let run = sandbox::guarded(|| engine.run_ast_with_scope(&mut scope, &ast));
        run.map_err(|e| sources.diagnose(*e, Call::default()))?;
        let globals: Map = scope.iter().map(|(name, _, value)| (name.into(), value)).collect();
        let whole = || sources.main().whole();
        entry::check(&ast, sources.main())?;
        let header = shared.close().ok_or_else(|| {
            let place = sources.main().place_of_call("animation").unwrap_or_else(whole);
            Diagnostic::error("the script does not call `animation` at its top")
                .at(place)
                .help("start it with animation(#{ scene: \"scene.ron\", frames: 48, fps: 24, mode: \"clip\" });")
        })?;
        let simulation = entry::has(&ast, "start", 1).then(Simulation::default);
        names.of_script(globals.clone());
        let ast = ast.clone_functions_only();
        let (shared, index) = (shared.clone(), Mutex::new(None));
        Ok(Interpreter { engine, ast, constants: globals, header, sources, shared, simulation, index })
    }

    pub fn header(&self) -> &Header {
        &self.header
    }

    pub fn has_setup(&self) -> bool {
        self.ast.iter_functions().any(|f| f.name == "setup")
    }

    /// Where the script names its scene.
    pub fn place_of_scene(&self) -> Place {
        self.sources.main().place_of_scene(self.header.scene.as_deref().unwrap_or_default())
    }

    /// The edits of `setup`, or those of `frame` at a time: a frame, counted from 1, and how many frames from its own
    /// time. What it says on its way goes to `remarks`.
    ///
    /// # Errors
    /// Mistakes of the script, with their places and the frame.
    pub fn call(
        &self,
        scene: &Arc<Scene>,
        time: Option<Moment>,
        remarks: &mut Remarks,
    ) -> Result<Vec<Edit>, Diagnostics> {
        let state = self.state(scene, time)?;
        let mode = if sandbox::is_probing() { RunMode::Unwrapped } else { RunMode::Called };
        let (outcome, handle) = self.run(scene, time, mode, state.clone());
        *remarks = handle.shared().remarks();
        let error = match outcome {
            Ok(()) => return Ok(handle.into_edits()),
            Err(error) => error,
        };
        drop(handle);
        let place = if sandbox::is_limit(&error) { self.place_by_running_again(scene, time, state) } else { None };
        let function = Some(if time.is_some() { "frame" } else { "setup" });
        let mut problems =
            self.sources.diagnose(*error, Call { frame: time.map(|(number, _)| number), function, place });
        errors::name_columns(&mut problems, &self.shared.columns());
        Err(problems)
    }

    /// Where a call has written to a part of the scene last: the component of an entity, if one is named.
    pub fn place_of(
        &self,
        scene: &Arc<Scene>,
        time: Option<Moment>,
        part: ScenePart,
        component: Option<&'static str>,
    ) -> Option<Place> {
        let state = self.state(scene, time).ok()?;
        let (_, handle) = self.run(scene, time, RunMode::Marking, state.clone());
        let step = *handle.take_marks().get(&(part, component))?;
        sandbox::set_probe(sandbox::Probe { stop_at: Some(step), report: None });
        let (outcome, _) = self.run(scene, time, RunMode::Unwrapped, state);
        sandbox::set_probe(sandbox::Probe::default());
        let at = outcome.err().map(|error| errors::position(&error)).filter(|at| !at.is_none())?;
        Some(self.sources.main().place(at))
    }

    /// Runs a function: called, or as a text of its own, which loses no places but is another thing in corners of the
    /// language.
    fn run(
        &self,
        scene: &Arc<Scene>,
        time: Option<Moment>,
        mode: RunMode,
        state: Value,
    ) -> (Fallible<()>, SceneHandle) {
        let number = time.map_or(0, |(number, _)| number);
        let seed = hash::hash_words([self.header.seed, u64::from(number)]);
        let shared = self.shared.apart();
        let overlay = Overlay::new(scene.clone(), self.index_of(scene));
        let moment = time.map_or(0.0, |(_, offset)| offset);
        let handle = SceneHandle::new(overlay, seed, moment, shared.clone());
        if mode == RunMode::Marking {
            handle.keep_marks();
        }
        let _current = shared.enter(Some(&handle));
        let mut scope = Scope::new();
        for (name, value) in &self.constants {
            scope.push_constant_dynamic(name.as_str(), value.clone());
        }
        let scene = Dynamic::from(handle.clone());
        let frame = time.map(|(number, offset)| {
            Dynamic::from(time::FrameTime::new(&self.header, number, offset, seed, to_dynamic(state)))
        });
        let function = if time.is_some() { "frame" } else { "setup" };
        sandbox::allow(self.header.limits);
        sandbox::start_call();
        let outcome = sandbox::guarded(|| match frame {
            _ if mode != RunMode::Called => self.run_body(function, scope, [Some(scene), frame]),
            None => self.call_function(function, &mut scope, (scene,)),
            Some(frame) => self.call_function(function, &mut scope, (scene, frame)),
        });
        let outcome = outcome.and_then(|()| sandbox::guarded(|| constraints::resolve(&handle)));
        (outcome, handle)
    }

    /// The state of the simulation that a frame is given; nothing where there is none.
    fn state(&self, scene: &Arc<Scene>, time: Option<Moment>) -> Result<Value, Diagnostics> {
        let (Some(simulation), Some((number, offset))) = (&self.simulation, time) else { return Ok(Value::Unit) };
        let per_frame = f64::from(self.header.steps_per_frame);
        let at = (f64::from(number - 1) + offset) * per_frame;
        simulation.at(scene, at, |before| self.next_state(scene, before))
    }

    /// Whether it has a simulation.
    pub fn simulates(&self) -> bool {
        self.simulation.is_some()
    }

    /// Goes on from states that were made before, from the same scene.
    pub fn resume(&self, scene: &Arc<Scene>, states: NumberedStates) {
        if let Some(simulation) = &self.simulation {
            simulation.resume(scene, states);
        }
    }

    /// Those of these steps' states that were made from a scene.
    pub fn states(&self, scene: &Arc<Scene>, steps: &[u64]) -> NumberedStates {
        self.simulation.as_ref().map_or_else(Vec::new, |simulation| simulation.known(scene, steps))
    }

    /// The first state, or the one after another.
    fn next_state(&self, scene: &Arc<Scene>, before: Option<(u64, &Value)>) -> Result<Value, Diagnostics> {
        let per_frame = f64::from(self.header.steps_per_frame);
        let step = before.map_or(0, |(number, _)| number + 1);
        let frame = (step as f64 / per_frame).ceil() as u32 + 1;
        let seed = hash::hash_words([self.header.seed, 0x7374_6570, step]);
        let shared = self.shared.apart();
        let handle = SceneHandle::new(Overlay::new(scene.clone(), self.index_of(scene)), seed, 0.0, shared.clone());
        let _current = shared.enter(Some(&handle));
        let mut scope = Scope::new();
        for (name, value) in &self.constants {
            scope.push_constant_dynamic(name.as_str(), value.clone());
        }
        let options = || CallFnOptions::new().eval_ast(false);
        sandbox::allow(self.header.limits);
        sandbox::start_call();
        let outcome = sandbox::guarded(|| {
            let given = match before {
                None => {
                    let scene = (Dynamic::from(handle.clone()),);
                    self.engine.call_fn_with_options::<Dynamic>(options(), &mut scope, &self.ast, "start", scene)?
                }
                Some((number, state)) => {
                    let at = number as f64 / per_frame;
                    let time = time::FrameTime::new(&self.header, 1, at, seed, Dynamic::UNIT);
                    let arguments = (to_dynamic(state.clone()), Dynamic::from(time));
                    self.engine.call_fn_with_options::<Dynamic>(options(), &mut scope, &self.ast, "step", arguments)?
                }
            };
            let help = "build in `setup`; `start` only looks at the scene".to_string();
            match handle.clone().into_edits().is_empty() {
                true if given.is_unit() => {
                    let which = if before.is_some() { "step" } else { "start" };
                    let help = format!("end it with the state itself: fn {which}(...) {{ ... state }}");
                    errors::complain(format!("`{which}` gives nothing, and a state is wanted"), Some(help))
                }
                true => state_of(&given),
                false => errors::complain("a simulation cannot change the scene", Some(help)),
            }
        });
        let function = Some(if before.is_some() { "step" } else { "start" });
        let call = Call { frame: Some(frame), function, place: None };
        outcome.map_err(|error| self.sources.diagnose(*error, call))
    }

    fn call_function(&self, function: &str, scope: &mut Scope, arguments: impl ::rhai::FuncArgs) -> Fallible<()> {
        let options = CallFnOptions::new().eval_ast(false);
        self.engine.call_fn_with_options::<Dynamic>(options, scope, &self.ast, function, arguments).map(drop)
    }

    fn run_body(&self, function: &str, mut scope: Scope, arguments: [Option<Dynamic>; 2]) -> Fallible<()> {
        let arguments: Vec<Dynamic> = arguments.into_iter().flatten().collect();
        let functions = self.ast.iter_functions();
        let Some(found) = functions.into_iter().find(|f| f.name == function && f.params.len() == arguments.len())
        else {
            return Ok(());
        };
        for (name, value) in found.params.iter().zip(&arguments) {
            scope.push_dynamic(*name, value.clone());
        }
        let count = arguments.len();
        // Not `clone_functions_only_filtered`: with rhai 1.27 it keeps all functions, and their bodies would run in a row.
        let mut alone = self.ast.clone_functions_only();
        alone.retain_functions(|_, _, name, params| name == function && params == count);
        let mut body: Vec<Stmt> = Vec::new();
        alone.walk(&mut |path: &[ASTNode]| {
            if let [ASTNode::Stmt(statement)] = path {
                body.push((*statement).clone());
            }
            true
        });
        let text = AST::new(body, self.ast.shared_lib().clone());
        self.engine.run_ast_with_scope(&mut scope, &text)
    }

    /// A limit ends a run from inside of any depth of functions, and the place is lost on the way out. The run is the
    /// same every time, so that it can be stopped at the same step where its place is not lost.
    fn place_by_running_again(&self, scene: &Arc<Scene>, time: Option<Moment>, state: Value) -> Option<Position> {
        if sandbox::is_probing() {
            return None;
        }
        let steps = sandbox::steps();
        // A step less is one that the run unwrapped comes to before an operation that falls over.
        [steps, steps.saturating_sub(1)].into_iter().find_map(|stop_at| {
            sandbox::set_probe(sandbox::Probe { stop_at: Some(stop_at), report: None });
            let (outcome, _) = self.run(scene, time, RunMode::Unwrapped, state.clone());
            sandbox::set_probe(sandbox::Probe::default());
            outcome.err().map(|error| errors::position(&error)).filter(|at| !at.is_none())
        })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::project::Access;

    /// Whoever looks for the place of a step by running again counts on it.
    #[test]
    fn a_body_run_by_itself_takes_one_step_less_than_a_call() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rhai");
        std::fs::write(&path, "animation(#{}); fn frame(s, f) { let a = 1; for i in 0..9 { a += i; } print(a); }")
            .unwrap();
        let project = Project::of(&path, &Access::default()).unwrap();
        let script = Interpreter::open(&path, &[], &project, &mut Remarks::default()).unwrap();
        let steps = |mode: RunMode| {
            script.run(&Arc::default(), Some((1, 0.0)), mode, Value::Unit).0.unwrap();
            sandbox::steps()
        };
        assert_eq!(steps(RunMode::Called), steps(RunMode::Unwrapped) + 1);
    }
}
