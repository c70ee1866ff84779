//! Which command the first word of the arguments means.

use std::ffi::OsString;
use std::path::Path;

use crate::base::diagnostics::{Cause, Diagnostic};

const COMMANDS: [&str; 21] = [
    "render",
    "check",
    "plan",
    "pack",
    "status",
    "farm",
    "merge",
    "film",
    "sheet",
    "dump",
    "convert",
    "set",
    "preview",
    "watch",
    "diff",
    "test",
    "info",
    "guide",
    "completions",
    "man",
    "help",
];

/// A first word that is no command, and cannot be a file that is to be rendered.
pub fn unknown_command(arguments: &[OsString]) -> Option<Diagnostic> {
    let word = arguments.get(1)?.to_str()?;
    let is_name = word.chars().all(|c| c.is_alphanumeric() || c == '-' || c == '_') && !word.starts_with('-');
    if !is_name || word.is_empty() || COMMANDS.contains(&word) || Path::new(word).exists() {
        return None;
    }
    let problem = Diagnostic::error(format!("there is no command `{word}`")).because(Cause::Usage);
    Some(problem.suggest(word, COMMANDS))
}

/// `anim S.rhai ...` is `anim render S.rhai ...`.
pub fn with_default_command(mut arguments: Vec<OsString>) -> Vec<OsString> {
    let first = arguments.get(1).and_then(|a| a.to_str()).unwrap_or("--help").to_string();
    let known = COMMANDS.contains(&first.as_str()) || ["-h", "--help", "-V", "--version"].contains(&first.as_str());
    if !known {
        arguments.insert(1, "render".into());
    }
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(words: &[&str]) -> String {
        let arguments: Vec<OsString> = ["anim"].iter().chain(words).map(OsString::from).collect();
        unknown_command(&arguments).map(|problem| problem.to_string()).unwrap_or_default()
    }

    #[test]
    fn a_misspelt_command_is_no_file() {
        assert!(said(&["chek", "x.rhai"]).contains("did you mean `check`?"), "{}", said(&["chek", "x.rhai"]));
        assert!(said(&["rendr"]).contains("did you mean `render`?"));
        assert!(said(&["wombat", "x.rhai"]).contains("`render`"));
        for words in [&["check", "x"][..], &["show.rhai"], &["scenes/a"], &["--help"], &["-V"], &[]] {
            assert_eq!(said(words), "", "{words:?}");
        }
    }
}
