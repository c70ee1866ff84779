//! Modules: found, read and compiled before anything is evaluated.
//!
//! A module is a `.rhai` file beside the one that imports it, or else beside the script, below the project root. What
//! imports what is known from the text: names are written out. So circles are named instead of followed, and depth,
//! number and size are bounded before the first line runs.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ::rhai::{AST, ASTNode, Engine, EvalAltResult, Expr, Module, ModuleResolver, Position, Scope, Shared, Stmt};
use rustc_hash::FxHashMap;

use super::engine::TopNames;
use super::errors::{ScriptSource, ScriptSources};
use super::rewrite::TextRole;
use super::sandbox;
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::project::{FileRole, Folder, Project};
use crate::base::{files, limits};

/// What the script's text and its modules were compiled to, and how they hang together.
#[derive(Clone, Default)]
pub struct ModuleGraph(Arc<Mutex<Graph>>);

#[derive(Default)]
struct Graph {
    /// The file that a name stands for, by who imports it.
    found: FxHashMap<(String, String), String>,
    ready: FxHashMap<String, Shared<Module>>,
}

impl ModuleGraph {
    fn lock(&self) -> MutexGuard<'_, Graph> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a file imports at its top: the names that it gives, and the modules. Functions of a script would not see them
    /// otherwise; those of a module do.
    pub fn imported_at_the_top(&self, file: &str, ast: &AST) -> Vec<(String, Shared<Module>)> {
        let graph = self.lock();
        let module = |statement: &Stmt| {
            let Stmt::Import(import, _) = statement else { return None };
            let Expr::StringConstant(name, _) = &import.0 else { return None };
            let known = graph.found.get(&(file.to_string(), name.to_string()))?;
            let alias = import.1.name.to_string();
            Some((alias, graph.ready.get(known)?.clone())).filter(|(alias, _)| !alias.is_empty())
        };
        ast.statements().iter().filter_map(module).collect()
    }
}

impl ModuleResolver for ModuleGraph {
    fn resolve(
        &self,
        _: &Engine,
        source: Option<&str>,
        path: &str,
        at: Position,
    ) -> Result<Shared<Module>, Box<EvalAltResult>> {
        let graph = self.lock();
        let file = graph.found.get(&(source.unwrap_or_default().to_string(), path.to_string()));
        let module = file.and_then(|file| graph.ready.get(file)).cloned();
        module.ok_or_else(|| EvalAltResult::ErrorModuleNotFound(path.into(), at).into())
    }
}

/// One reading of all modules of a script.
pub struct ModuleLoader<'a> {
    pub engine: &'a Engine,
    pub graph: &'a ModuleGraph,
    pub project: &'a Arc<Project>,
    /// The script's folder.
    pub folder: &'a Path,
    pub sources: &'a mut ScriptSources,
    /// Where the names of each module's top are kept for its functions.
    pub names: &'a TopNames,
    /// From the script to the module that is being read.
    chain: Vec<String>,
    bytes: usize,
}

impl<'a> ModuleLoader<'a> {
    pub fn new(
        engine: &'a Engine,
        graph: &'a ModuleGraph,
        project: &'a Arc<Project>,
        folder: &'a Path,
        sources: &'a mut ScriptSources,
        names: &'a TopNames,
    ) -> Self {
        ModuleLoader { engine, graph, project, folder, sources, names, chain: Vec::new(), bytes: 0 }
    }

    /// Reads and evaluates what a file imports, and what that imports, before itself.
    ///
    /// # Errors
    /// A module that is not there, outside of the project, in a circle, too deep or too much; mistakes in it.
    pub fn load(&mut self, file: &str, ast: &AST) -> Result<(), Diagnostics> {
        self.chain.push(file.to_string());
        for (name, at) in imports(ast) {
            let name = name.ok_or_else(|| {
                self.mistake(
                    file,
                    at,
                    "the name of a module must be written out, so that it is known before anything runs",
                )
            })?;
            let path = self.path_of(file, &name, at)?;
            let known = path.to_string_lossy().into_owned();
            self.graph.lock().found.insert((file.to_string(), name.clone()), known.clone());
            if let Some(first) = self.chain.iter().position(|above| *above == known) {
                let round = self.chain[first..].iter().chain([&known]).map(String::as_str).collect::<Vec<_>>();
                let message = format!("modules import each other in a circle: {}", round.join(" -> "));
                return Err(self.mistake(file, at, &message).into());
            }
            if self.graph.lock().ready.contains_key(&known) {
                continue;
            }
            if self.chain.len() > limits::SCRIPT_MODULE_DEPTH {
                let message = format!("more than {} modules import each other in a row", limits::SCRIPT_MODULE_DEPTH);
                return Err(self.mistake(file, at, &message).into());
            }
            let module = self.read(file, &path, &known, at)?;
            self.graph.lock().ready.insert(known, module);
        }
        self.chain.pop();
        Ok(())
    }

    fn read(&mut self, importer: &str, path: &Path, known: &str, at: Position) -> Result<Shared<Module>, Diagnostics> {
        let text = files::read_text(path, limits::SCRIPT_FILE_BYTES)?;
        self.project.note_content(path, FileRole::Module, text.as_bytes());
        self.bytes += text.len();
        let count = self.graph.lock().ready.len();
        if count >= limits::SCRIPT_MODULES || self.bytes as u64 > limits::SCRIPT_FILE_BYTES {
            let most = limits::SCRIPT_FILE_BYTES >> 20;
            let message = format!("more than {} modules, or {most} MiB of them", limits::SCRIPT_MODULES);
            return Err(self.mistake(importer, at, &message).into());
        }
        let (source, compiled) =
            ScriptSource::compile(self.engine, known, text, TextRole::Module, &mut self.sources.vocabulary);
        self.sources.add(source);
        let mut ast = compiled?;
        ast.set_source(known);
        self.load(known, &ast)?;
        sandbox::start_call();
        let module = sandbox::guarded(|| Module::eval_ast_as_new(Scope::new(), &ast, self.engine));
        let module = module.map_err(|error| self.sources.diagnose_in(known, *error))?;
        let constants = ast.statements().iter().filter_map(|statement| match statement {
            Stmt::Var(variable, ..) => Some(variable.0.name.to_string()),
            _ => None,
        });
        let constants = constants.filter_map(|name| Some((name.as_str().into(), module.get_var(&name)?)));
        self.names.of_module(known, constants.collect());
        Ok(module.into())
    }

    /// Beside the file that imports it, or else beside the script.
    fn path_of(&self, importer: &str, name: &str, at: Position) -> Result<PathBuf, Diagnostics> {
        let beside = Path::new(importer).parent().unwrap_or(Path::new("")).to_path_buf();
        let file = Path::new(name).with_extension("rhai").to_string_lossy().into_owned();
        let mut first = None;
        for folder in [beside.as_path(), self.folder] {
            let found = Folder::new(folder, self.project.clone()).admit(&file);
            let path = found.map_err(|refused| self.placed(importer, at, refused))?;
            if path.is_file() {
                let path = crate::base::project::tidy(&path);
                self.project.record(&path, FileRole::Module);
                return Ok(path);
            }
            first.get_or_insert(path);
        }
        let missing = self.mistake(importer, at, &format!("there is no module `{name}`"));
        Err(match first.as_deref().and_then(files::nearest_file) {
            Some(near) => missing.help(format!("did you mean `{}`?", near.trim_end_matches(".rhai"))),
            None => missing.help("modules are .rhai files beside the script that imports them, or below its folder"),
        }
        .into())
    }

    fn mistake(&self, file: &str, at: Position, message: &str) -> Diagnostic {
        self.placed(file, at, Diagnostic::error(message))
    }

    fn placed(&self, file: &str, at: Position, diagnostic: Diagnostic) -> Diagnostic {
        match self.sources.of(file) {
            Some(source) => diagnostic.at(source.place(at)),
            None => diagnostic,
        }
    }
}

/// What a text imports, anywhere in it: the names, where they are written out, and their places.
fn imports(ast: &AST) -> Vec<(Option<String>, Position)> {
    let mut found = Vec::new();
    ast.walk(&mut |path: &[ASTNode]| {
        if let Some(ASTNode::Stmt(Stmt::Import(import, at))) = path.last() {
            found.push(match &import.0 {
                Expr::StringConstant(name, at) => (Some(name.to_string()), *at),
                _ => (None, *at),
            });
        }
        true
    });
    found
}
