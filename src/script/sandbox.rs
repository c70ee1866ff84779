//! What keeps a script in bounds: limits set explicitly, words switched off, modules only from below its folder.

use std::cell::Cell;
use std::path::{Component, Path, PathBuf};
use std::time::Instant;

use ::rhai::module_resolvers::FileModuleResolver;
use ::rhai::{Dynamic, Engine, EvalAltResult, Module, ModuleResolver, Position, Shared};

use super::errors::{Fallible, complain};
use crate::base::limits;

/// Words of Rhai that a pure script does without: the clock, the system's mathematics, code from text.
const OFF: [&str; 4] = ["eval", "timestamp", "**", "**="];

thread_local! {
    /// When the call that this thread evaluates was started; a script cannot see it.
    static STARTED: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// Starts the time that a call on this thread may take.
pub fn start_call() {
    STARTED.set(Some(Instant::now()));
}

pub fn close(engine: &mut Engine, folder: &Path) {
    for word in OFF {
        engine.disable_symbol(word);
    }
    engine.register_fn("sleep", |_: i64| no_sleep()).register_fn("sleep", |_: f64| no_sleep());
    engine
        .set_max_operations(limits::SCRIPT_OPERATIONS)
        .set_max_call_levels(limits::SCRIPT_CALL_DEPTH)
        .set_max_expr_depths(limits::SCRIPT_EXPRESSION_DEPTH, limits::SCRIPT_EXPRESSION_DEPTH)
        .set_max_string_size(limits::SCRIPT_STRING_BYTES)
        .set_max_array_size(limits::SCRIPT_ARRAY)
        .set_max_map_size(limits::SCRIPT_MAP)
        .set_max_variables(limits::SCRIPT_ITEMS)
        .set_max_functions(limits::SCRIPT_ITEMS)
        .set_max_modules(limits::SCRIPT_ITEMS);
    engine.on_progress(|operations| {
        let is_late =
            operations % 1024 == 0 && STARTED.get().is_some_and(|at| at.elapsed().as_secs() >= limits::SCRIPT_SECONDS);
        is_late.then_some(Dynamic::UNIT)
    });
    // Nobody listens: a script speaks through its edits.
    engine.on_print(|_| {}).on_debug(|_, _, _| {});
    engine.set_module_resolver(BelowFolder {
        folder: folder.to_path_buf(),
        files: FileModuleResolver::new_with_path(folder),
    });
}

fn no_sleep() -> Fallible<()> {
    complain("a script has no clock and cannot sleep", None)
}

/// Modules from files below one folder.
struct BelowFolder {
    folder: PathBuf,
    files: FileModuleResolver,
}

impl BelowFolder {
    fn allows(&self, name: &str) -> bool {
        let path = Path::new(name);
        if !path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
            return false;
        }
        let root = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let file = root.join(path).with_extension("rhai");
        match (root.canonicalize(), file.canonicalize()) {
            (Ok(root), Ok(file)) => file.starts_with(root),
            // Not there: the resolver says so.
            _ => true,
        }
    }
}

impl ModuleResolver for BelowFolder {
    fn resolve(
        &self,
        engine: &Engine,
        source: Option<&str>,
        path: &str,
        at: Position,
    ) -> Result<Shared<Module>, Box<EvalAltResult>> {
        if !self.allows(path) {
            let help = Some("modules are .rhai files below the script's folder".into());
            let refused = complain(format!("`{path}` cannot be imported"), help);
            return refused.map_err(|mut error| {
                error.set_position(at);
                error
            });
        }
        self.files.resolve(engine, source, path, at)
    }
}
