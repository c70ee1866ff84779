//! What went wrong in a script, in plain words and at its place.

use std::sync::Arc;

use ::rhai::{Dynamic, EvalAltResult, Position};

use super::sandbox::Stopped;
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

/// A script and its modules as text.
pub struct ScriptSources {
    main: ScriptSource,
    modules: Vec<ScriptSource>,
}

/// What was evaluated when something went wrong.
#[derive(Clone, Copy, Default)]
pub struct Call<'a> {
    /// The frame, from 1.
    pub frame: Option<u32>,
    /// The function of the script; the top level if there is none.
    pub function: Option<&'a str>,
    /// Where it went wrong, if it was found out by other means than the error itself.
    pub place: Option<Position>,
}

impl ScriptSources {
    pub fn new(main: ScriptSource) -> Self {
        ScriptSources { main, modules: Vec::new() }
    }

    pub fn main(&self) -> &ScriptSource {
        &self.main
    }

    pub fn add(&mut self, module: ScriptSource) {
        self.modules.push(module);
    }

    pub fn of(&self, file: &str) -> Option<&ScriptSource> {
        std::iter::once(&self.main).chain(&self.modules).find(|source| *source.file == *file)
    }

    fn texts(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.main).chain(&self.modules).map(|source| source.text.as_str())
    }

    /// Sees to it that the script, or one of its modules, reads every parameter that is given.
    ///
    /// # Errors
    /// The first that is not read, with the nearest one that is.
    pub fn check_defines(&self, defines: &[(String, String)]) -> Result<(), Diagnostics> {
        let in_one = |text| str::split(text, "param(\"").skip(1).filter_map(|tail: &str| tail.split('"').next());
        let read: Vec<&str> = self.texts().flat_map(in_one).collect();
        match defines.iter().find(|(name, _)| !read.contains(&name.as_str())) {
            None => Ok(()),
            Some((name, _)) => {
                let unknown = Diagnostic::error(format!("-D {name}: {} has no such parameter", self.main.file));
                let help = suggestion(name, read).unwrap_or_else(|| "it reads none: param(\"name\", default)".into());
                Err(unknown.because(Cause::Usage).help(help).into())
            }
        }
    }

    /// An error of Rhai as a diagnostic.
    pub fn diagnose(&self, error: EvalAltResult, call: Call) -> Diagnostics {
        let inner = error.unwrap_inner();
        let (file, at) = deepest_position(&error, &self.main.file);
        let source = self.of(file).unwrap_or(&self.main);
        let (message, help) = self.words(inner);
        let place = match (at.is_none(), call.place.filter(|at| !at.is_none()), call.function) {
            (false, ..) => source.place(at),
            (true, Some(at), _) => self.main.place(at),
            (true, None, Some(function)) => self.main.place_without_position(inner, function),
            (true, None, None) => Place::file(source.file.clone()),
        };
        let message = match call.frame {
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

    /// An error of a module's own text.
    pub fn diagnose_in(&self, file: &str, error: EvalAltResult) -> Diagnostics {
        let (message, help) = self.words(error.unwrap_inner());
        let (file, at) = deepest_position(&error, file);
        let source = self.of(file).unwrap_or(&self.main);
        let diagnostic = Diagnostic::error(message).at(source.place(at));
        help.map_or(diagnostic.clone(), |help| diagnostic.help(help)).into()
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
            EvalAltResult::ErrorTerminated(token, _)
                if token.clone().try_cast::<Stopped>() == Some(Stopped::Memory) =>
            {
                let message = format!("the script holds more than {} MiB", limits::SCRIPT_BYTES >> 20);
                (message, Some("look for a list or text that grows without end".into()))
            }
            EvalAltResult::ErrorTooManyOperations(_) | EvalAltResult::ErrorTerminated(..) => {
                let help = "look for a loop that never ends".to_string();
                ("the script runs for too long".into(), Some(help))
            }
            EvalAltResult::ErrorSystem(what, why) => (format!("{what}: {why}"), None),
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
        let in_one = |text| str::split(text, "fn ").skip(1).filter_map(|tail: &str| tail.split('(').next());
        let own = self.texts().flat_map(in_one).map(str::trim);
        let known: Vec<&str> = engine::FUNCTIONS.iter().copied().chain(own).collect();
        if known.contains(&name) {
            return (format!("`{name}` does not take ({})", arguments.join(", ")), None);
        }
        (format!("there is no function `{name}` for ({})", arguments.join(", ")), did_you_mean(name, known))
    }

    fn words_of_text(&self) -> impl Iterator<Item = &str> {
        let in_one = |text| str::split(text, |c: char| !c.is_alphanumeric() && c != '_');
        self.texts().flat_map(in_one).filter(|word| word.len() > 1)
    }
}

impl ScriptSource {
    pub fn place(&self, at: Position) -> Place {
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

    /// The file as a whole, as its first line shows it.
    pub fn whole(&self) -> Place {
        Place::of_span(self.file.clone(), &self.text, 0, 0)
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
}

/// The innermost place of an error.
pub fn position(error: &EvalAltResult) -> Position {
    deepest_position(error, "").1
}

/// The innermost place in a chain of calls, and the file that it is in.
fn deepest_position<'a>(error: &'a EvalAltResult, file: &'a str) -> (&'a str, Position) {
    let (inner_file, inner, at) = match error {
        EvalAltResult::ErrorInFunctionCall(_, source, inner, at) if !source.is_empty() => (source.as_str(), inner, at),
        EvalAltResult::ErrorInFunctionCall(_, _, inner, at) | EvalAltResult::ErrorInModule(_, inner, at) => {
            (file, inner, at)
        }
        other => return (file, other.position()),
    };
    let (found, position) = deepest_position(inner, inner_file);
    if position.is_none() { (file, *at) } else { (found, position) }
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
