//! Edits a scene file in place: a file that holds no scene afterwards is not written.

use std::path::Path;
use std::sync::Arc;

use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::project::{Folder, Project};
use crate::base::{files, limits};
use crate::load;
use crate::load::ron::edit::{self, Assignment, ValueChange};
use crate::output;

/// A scene file as it was and as it is to be.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneEdit {
    /// The text as it was.
    pub before: String,
    /// The text as it is to be.
    pub after: String,
    /// Each value that differs, in the order in which they were given.
    pub changes: Vec<ValueChange>,
}

/// The scene file with other values, checked as a whole and not written.
///
/// # Errors
/// As [`edit::assign`]; a file that is no RON scene in UTF-8; what would be wrong with the scene, with its places.
pub fn edit_scene(path: &Path, assignments: &[Assignment], project: &Arc<Project>) -> Result<SceneEdit, Diagnostics> {
    let name = path.to_string_lossy().into_owned();
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron")) {
        let problem = Diagnostic::error(format!("{name}: only RON scenes are edited in place"));
        return Err(problem.because(Cause::Usage).help("`anim convert` writes any other scene as RON").into());
    }
    let before = read(path)?;
    // A mark at the start of a text is no part of what is parsed.
    let text = before.strip_prefix('\u{feff}').unwrap_or(&before);
    let (after, changes) = edit::assign(text, &name, assignments)?;
    let base = Folder::around(path, project.clone());
    load::ron::parse(&after, &name, &base)?;
    let mark = &before[..before.len() - text.len()];
    Ok(SceneEdit { after: format!("{mark}{after}"), before, changes })
}

/// The text of a file, with whatever it starts with.
///
/// # Errors
/// A file that cannot be read; one that is not UTF-8, which writing it again would change.
pub fn read(path: &Path) -> Result<String, Diagnostic> {
    let bytes = files::read_bytes(path, limits::SCENE_FILE_BYTES)?;
    String::from_utf8(bytes).map_err(|_| {
        let problem = Diagnostic::error(format!("{}: a file that is edited in place must be UTF-8", path.display()));
        problem.help("save it as UTF-8 in an editor")
    })
}

/// Puts a text in the place of another one in a file, whole or not at all; its permissions stay, and a link stays one.
///
/// # Errors
/// The file holds something else by now; it cannot be written.
pub fn replace_text(path: &Path, before: &str, after: &str) -> Result<(), Diagnostic> {
    if read(path)? != before {
        let problem = Diagnostic::error(format!("{} was changed meanwhile, and is left alone", path.display()));
        return Err(problem.because(Cause::Io));
    }
    let failed = |error: std::io::Error| Diagnostic::io(path.display(), "write", &error);
    let file = path.canonicalize().map_err(failed)?;
    let permissions = std::fs::metadata(&file).map_err(failed)?.permissions();
    if permissions.readonly() {
        let problem = Diagnostic::error(format!("cannot write {}: it is marked as read-only", path.display()));
        return Err(problem.because(Cause::Io));
    }
    output::write_atomic(&file, after.as_bytes())?;
    std::fs::set_permissions(&file, permissions).map_err(failed)
}
