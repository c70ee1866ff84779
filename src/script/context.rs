//! What all functions of one script share, wherever they are called: its header, its parameters, and what it prints.

use std::cell::RefCell;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rustc_hash::FxHashMap;

use super::errors::{Fallible, complain};
use super::handles::SceneHandle;
use super::parameters::Parameter;
use super::said::{Remarks, Said};
use super::sandbox;
use super::time::Header;
use crate::base::limits;
use crate::base::project::Folder;

thread_local! {
    /// The script that runs on this thread, and the scene of the call. The engine has a tag for such things, which is lost
    /// where it runs a text instead of a call.
    static CURRENT: RefCell<Option<(ScriptContext, Option<SceneHandle>)>> = const { RefCell::new(None) };
}

/// Keeps a script the one that runs on this thread.
pub struct CurrentScript(Option<(ScriptContext, Option<SceneHandle>)>);

impl Drop for CurrentScript {
    fn drop(&mut self) {
        let before = self.0.take();
        // What was entered is dropped outside of the borrow.
        drop(CURRENT.with_borrow_mut(|current| std::mem::replace(current, before)));
    }
}

/// What one script has said of itself so far.
#[derive(Default)]
struct ScriptState {
    header: Option<Header>,
    /// The top level has run: `animation` comes too late now.
    closed: bool,
    parameters: Vec<Parameter>,
    /// Names of the columns of each table that was read.
    columns: Vec<Vec<String>>,
}

/// A handle to the state of one script, for the functions that change it.
#[derive(Clone, Default)]
pub struct ScriptContext {
    /// The script's folder, for files that it names.
    folder: Option<Folder>,
    /// Files that were read, by their paths: a frame that asks for one again gets what the first one got.
    texts: Arc<Mutex<FxHashMap<Arc<str>, String>>>,
    /// Values that were given to parameters, by their names.
    pub defines: Arc<Vec<(String, String)>>,
    state: Arc<Mutex<ScriptState>>,
    /// What one call of one of its functions prints.
    said: Arc<Mutex<Vec<Said>>>,
}

impl ScriptContext {
    pub fn new(defines: &[(String, String)], folder: Folder) -> Self {
        ScriptContext { defines: Arc::new(defines.to_vec()), folder: Some(folder), ..ScriptContext::default() }
    }

    pub fn folder(&self) -> Option<&Folder> {
        self.folder.as_ref()
    }

    /// What was read from a file before.
    pub fn known_text(&self, file: &str) -> Option<String> {
        self.texts.lock().unwrap_or_else(PoisonError::into_inner).get(file).cloned()
    }

    pub fn keep_text(&self, file: &Arc<str>, text: &str) {
        self.texts.lock().unwrap_or_else(PoisonError::into_inner).insert(file.clone(), text.to_string());
    }

    /// The same script, with what is printed kept apart: for one call among others on other threads.
    pub fn apart(&self) -> Self {
        ScriptContext { said: Arc::default(), ..self.clone() }
    }

    /// What belongs to the script that runs on this thread, for one of its functions.
    pub fn current(function: &str) -> Fallible<ScriptContext> {
        match CURRENT.with_borrow(|current| current.as_ref().map(|(shared, _)| shared.clone())) {
            Some(shared) => Ok(shared),
            None => complain(format!("`{function}` cannot be called here"), None),
        }
    }

    /// The scene of the call that runs on this thread, for one of its functions.
    pub fn current_scene(function: &str) -> Fallible<SceneHandle> {
        match CURRENT.with_borrow(|current| current.as_ref().and_then(|(_, scene)| scene.clone())) {
            Some(scene) => Ok(scene),
            None => complain(format!("`{function}` measures in a scene: call it inside `setup` or `frame`"), None),
        }
    }

    /// Makes this the script that runs on this thread, with the scene of the call, until the guard is dropped.
    pub fn enter(&self, scene: Option<&SceneHandle>) -> CurrentScript {
        let entered = Some((self.clone(), scene.cloned()));
        CurrentScript(CURRENT.with_borrow_mut(|current| std::mem::replace(current, entered)))
    }

    fn lock(&self) -> MutexGuard<'_, ScriptState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes what `animation` was called with.
    ///
    /// # Errors
    /// A second call, or one from within a function of the script.
    pub fn set_header(&self, header: Header) -> Fallible<()> {
        let mut state = self.lock();
        if state.closed {
            return complain("`animation` belongs to the top of the script, outside its functions", None);
        }
        if state.header.is_some() {
            return complain("`animation` is called once", None);
        }
        let mut header = header;
        if let Err(refused) = header.limits.define(&self.defines) {
            return complain(refused.message, refused.help);
        }
        // They hold for the rest of the top level, too.
        sandbox::allow(header.limits);
        state.header = Some(header);
        Ok(())
    }

    /// Notes what the columns of a table are called.
    pub fn note_columns(&self, names: &[String]) {
        let mut state = self.lock();
        if state.columns.len() < limits::SCRIPT_TABLES && !state.columns.iter().any(|known| known == names) {
            state.columns.push(names.to_vec());
        }
    }

    /// Names of the columns of all tables that were read.
    pub fn columns(&self) -> Vec<String> {
        self.lock().columns.concat()
    }

    /// The header, when the top level has run; `animation` is refused from here on.
    pub fn close(&self) -> Option<Header> {
        let mut state = self.lock();
        state.closed = true;
        state.header.clone()
    }

    /// Takes the declaration of a parameter.
    ///
    /// # Errors
    /// Another declaration of the same name that says something else.
    pub fn declare(&self, parameter: &Parameter) -> Fallible<()> {
        let mut state = self.lock();
        match state.parameters.iter().find(|known| known.name == parameter.name) {
            None => {
                state.parameters.push(parameter.clone());
                Ok(())
            }
            Some(known) if known == parameter => Ok(()),
            Some(known) => complain(
                format!(
                    "the parameter `{}` is declared twice: {}, and {}",
                    parameter.name,
                    known.describe(),
                    parameter.describe()
                ),
                Some("declare it once, at the top of the script, as in const SIZE = param(\"size\", 1.0);".into()),
            ),
        }
    }

    /// Parameters that were declared so far, in the order of their first declaration.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.lock().parameters.clone()
    }

    /// Keeps a line that the script prints.
    pub fn say(&self, said: Said) {
        let mut all = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() < limits::SCRIPT_PRINTS {
            all.push(said);
        }
    }

    /// What there is to be told of the run.
    pub fn remarks(&self) -> Remarks {
        Remarks { said: self.take_said(), parameters: self.parameters() }
    }

    fn take_said(&self) -> Vec<Said> {
        std::mem::take(&mut *self.said.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
