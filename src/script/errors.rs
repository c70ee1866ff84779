//! What went wrong in a script, in plain words and at its place.

use std::sync::Arc;

use ::rhai::{Dynamic, EvalAltResult, Position};

use super::{did_you_mean, engine};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, Place, suggestion};
use crate::base::limits;

/// A mistake that a function of the API reports: it travels through Rhai as the payload of a run-time error.
#[derive(Clone, Debug)]
pub struct Complaint {
    pub message: String,
    pub help: Option<String>,
}

pub type Fallible<T> = Result<T, Box<EvalAltResult>>;

pub fn complain<T>(message: impl Into<String>, help: Option<String>) -> Fallible<T> {
    let complaint = Complaint { message: message.into(), help };
    Err(EvalAltResult::ErrorRuntime(Dynamic::from(complaint), Position::NONE).into())
}

/// The script as text, for the places of its mistakes.
pub struct ScriptSource {
    pub file: Arc<str>,
    pub text: String,
}

impl ScriptSource {
    fn place(&self, at: Position) -> Place {
        match (at.line(), at.position()) {
            (Some(line), column) => {
                Place::of_position(self.file.clone(), &self.text, line as u32, column.unwrap_or(1).max(1) as u32)
            }
            _ => Place::file(self.file.clone()),
        }
    }

    /// A likely place for an error that Rhai gives none: the function that calls itself, the loop without a body, or
    /// else the function that was called.
    fn place_without_position(&self, error: &EvalAltResult, called: &str) -> Place {
        let likely = match error {
            EvalAltResult::ErrorStackOverflow(_) => self.recursion(),
            EvalAltResult::ErrorTooManyOperations(_) | EvalAltResult::ErrorTerminated(..) => self.endless_loop(),
            _ => None,
        };
        let called =
            || self.functions().find(|(_, name, _)| *name == called).map(|(at, name, _)| (at, at + 3 + name.len()));
        match likely.or_else(called) {
            Some((start, end)) => Place::of_span(self.file.clone(), &self.text, start, end),
            None => Place::file(self.file.clone()),
        }
    }

    /// Where each function starts, its name, and the text from there to the next one.
    fn functions(&self) -> impl Iterator<Item = (usize, &str, &str)> {
        let starts = self.text.match_indices("fn ").map(|(at, _)| at);
        let ends = self.text.match_indices("fn ").map(|(at, _)| at).skip(1).chain([self.text.len()]);
        starts.zip(ends).map(|(at, end)| {
            let name = self.text[at + 3..end].split('(').next().unwrap_or("");
            (at, name, &self.text[at..end])
        })
    }

    fn recursion(&self) -> Option<(usize, usize)> {
        let calls_itself = |(_, name, text): &(usize, &str, &str)| text[3 + name.len()..].contains(&format!("{name}("));
        self.functions().find(calls_itself).map(|(at, name, _)| (at, at + 3 + name.len()))
    }

    /// The first loop without a body, or else the first that says `loop` or `while true`.
    fn endless_loop(&self) -> Option<(usize, usize)> {
        let word = |word: &'static str| self.text.match_indices(word).map(move |(at, word)| (at, at + word.len()));
        let loops = || word("loop").chain(word("while"));
        let has_no_body = |(_, end): &(usize, usize)| {
            let body = self.text[*end..].split_once('{').map(|(_, body)| body.trim_start());
            body.is_some_and(|body| body.starts_with('}'))
        };
        let ends_never = |(start, end): &(usize, usize)| {
            &self.text[*start..*end] == "loop" || self.text[*end..].trim_start().starts_with("true")
        };
        loops().find(has_no_body).or_else(|| loops().find(ends_never))
    }

    /// Where the header names the scene.
    pub fn place_of_scene(&self, name: &str) -> Place {
        let quoted = format!("\"{name}\"");
        let at = self.text.find(&quoted).map(|i| (i, quoted.len())).or(self.text.find("animation").map(|i| (i, 9)));
        match at {
            Some((start, length)) => Place::of_span(self.file.clone(), &self.text, start, start + length),
            None => Place::file(self.file.clone()),
        }
    }

    /// Sees to it that the script reads every parameter that is given; modules may read them too.
    pub fn check_defines(&self, defines: &[(String, String)]) -> Result<(), Diagnostics> {
        let read: Vec<&str> = self.text.split("param(\"").skip(1).filter_map(|tail| tail.split('"').next()).collect();
        if self.text.contains("import ") {
            return Ok(());
        }
        match defines.iter().find(|(name, _)| !read.contains(&name.as_str())) {
            None => Ok(()),
            Some((name, _)) => {
                let unknown = Diagnostic::error(format!("-D {name}: {} has no such parameter", self.file));
                let help = suggestion(name, read).unwrap_or_else(|| "it reads none: param(\"name\", default)".into());
                Err(unknown.because(Cause::Usage).help(help).into())
            }
        }
    }

    /// An error of Rhai as a diagnostic; `frame` is the frame that was evaluated.
    pub fn diagnose(&self, error: EvalAltResult, frame: Option<u32>) -> Diagnostics {
        let inner = error.unwrap_inner();
        let at = deepest_position(&error);
        let (message, help) = self.words(inner);
        let place = match at.is_none() {
            true => self.place_without_position(inner, if frame.is_some() { "frame" } else { "setup" }),
            false => self.place(at),
        };
        let message = match frame {
            Some(number) => format!("in frame {number}: {message}"),
            None => message,
        };
        let diagnostic = Diagnostic::error(message).at(place);
        match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
        .into()
    }

    fn words(&self, error: &EvalAltResult) -> (String, Option<String>) {
        match error {
            EvalAltResult::ErrorRuntime(payload, _) => match payload.clone().try_cast::<Complaint>() {
                Some(complaint) => (complaint.message, complaint.help),
                None => (payload.to_string(), None),
            },
            EvalAltResult::ErrorFunctionNotFound(signature, _) => self.unknown_function(signature),
            EvalAltResult::ErrorVariableNotFound(name, _) => {
                let words: Vec<&str> = self.words_of_text().collect();
                let known = words.into_iter().filter(|word| *word != name);
                (format!("there is no variable `{name}`"), did_you_mean(name, known))
            }
            EvalAltResult::ErrorTooManyOperations(_) | EvalAltResult::ErrorTerminated(..) => {
                let help = "look for a loop that never ends".to_string();
                ("the script runs for too long".into(), Some(help))
            }
            EvalAltResult::ErrorDataTooLarge(what, _) => {
                let what = what.trim_start_matches("Size of ").trim_start_matches("Length of ");
                let (what, most) = match what {
                    "string" => ("a text", limits::SCRIPT_STRING_BYTES),
                    "object map" => ("a map", limits::SCRIPT_MAP),
                    _ => ("a list", limits::SCRIPT_ARRAY),
                };
                (format!("{what} grows beyond {most} elements"), None)
            }
            EvalAltResult::ErrorStackOverflow(_) => {
                ("functions call each other too deep".into(), Some("look for a recursion that never ends".into()))
            }
            EvalAltResult::ErrorParsing(kind, _) => (kind.to_string(), None),
            EvalAltResult::ErrorMismatchDataType(expected, found, _) => {
                (format!("expected {}, found {}", plain_type(expected), plain_type(found)), None)
            }
            other => {
                let text = other.to_string();
                let end = text.rfind(" (line ").unwrap_or(text.len());
                (text[..end].to_string(), None)
            }
        }
    }

    fn unknown_function(&self, signature: &str) -> (String, Option<String>) {
        let (name, arguments) = signature.split_once(" (").unwrap_or((signature, ")"));
        let arguments: Vec<String> = arguments.trim_end_matches(')').split(", ").map(plain_type).collect();
        let own = self.text.split("fn ").skip(1).filter_map(|tail| tail.split('(').next()).map(str::trim);
        let known = engine::FUNCTIONS.iter().copied().chain(own);
        if known.clone().any(|k| k == name) {
            return (format!("`{name}` does not take ({})", arguments.join(", ")), None);
        }
        (format!("there is no function `{name}` for ({})", arguments.join(", ")), did_you_mean(name, known))
    }

    fn words_of_text(&self) -> impl Iterator<Item = &str> {
        self.text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| word.len() > 1)
    }
}

/// The innermost place in a chain of calls.
fn deepest_position(error: &EvalAltResult) -> Position {
    match error {
        EvalAltResult::ErrorInFunctionCall(.., inner, at) | EvalAltResult::ErrorInModule(_, inner, at) => {
            let inner = deepest_position(inner);
            if inner.is_none() { *at } else { inner }
        }
        other => other.position(),
    }
}

/// What a person calls a type of Rhai's.
fn plain_type(name: &str) -> String {
    if name.contains("String") {
        return "text".into();
    }
    let last = name.rsplit("::").next().unwrap_or(name).trim();
    match last {
        "i64" => "whole number",
        "f64" => "number",
        "string" => "text",
        "array" | "Array" => "list",
        "map" | "Map" => "map",
        "SceneHandle" => "scene",
        "EntityHandle" => "entity",
        "RecordHandle" => "component",
        "DVec3" => "vector",
        "FrameTime" => "frame",
        other => other,
    }
    .to_string()
}
