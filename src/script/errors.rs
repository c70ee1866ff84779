//! What went wrong in a script, in plain words and at its place.

use std::sync::Arc;

use ::rhai::{AST, Dynamic, Engine, EvalAltResult, ParseError, Position};

use super::allowance;
use super::closures::without_names;
use super::foreign_grammar;
use super::inspect;
use super::map_keys::MapKeys;
use super::rewrite::{self, Rewritten, TextRole};
use super::vocabulary::Vocabulary;
use super::words::{self, Words};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, Place, nearest, suggestion};
use crate::base::limits;

/// A mistake that a function of the API reports: it travels through Rhai as the payload of a run-time error.
#[derive(Clone, Debug)]
pub struct Complaint {
    pub message: String,
    pub help: Option<String>,
    /// Where the mistake is, if that is not where the script calls.
    pub at: Option<Place>,
}

pub type Fallible<T> = Result<T, Box<EvalAltResult>>;

pub fn complain<T>(message: impl Into<String>, help: Option<String>) -> Fallible<T> {
    let complaint = Complaint { message: message.into(), help, at: None };
    Err(EvalAltResult::ErrorRuntime(Dynamic::from(complaint), Position::NONE).into())
}

/// A mistake in a file that a script reads.
pub fn complain_at<T>(place: Place, message: String, help: Option<String>) -> Fallible<T> {
    let complaint = Complaint { message, help, at: Some(place) };
    Err(EvalAltResult::ErrorRuntime(Dynamic::from(complaint), Position::NONE).into())
}

/// A message that people can read: a script may throw, or put where it does not belong, a text of any length.
fn shortened(message: String) -> String {
    match message.char_indices().nth(limits::MESSAGE_LETTERS) {
        Some((end, _)) => format!("{}... ({} letters)", &message[..end], message.chars().count()),
        None => message,
    }
}

/// The place of a mistake in another file.
fn place_elsewhere(error: &EvalAltResult) -> Option<Place> {
    match error {
        EvalAltResult::ErrorRuntime(payload, _) => payload.clone().try_cast::<Complaint>()?.at,
        _ => None,
    }
}

/// The script as text, for the places of its mistakes.
pub struct ScriptSource {
    pub file: Arc<str>,
    pub text: String,
    /// What was compiled in its place.
    rewritten: Rewritten,
    keys: MapKeys,
}

/// A script and its modules as text.
pub struct ScriptSources {
    main: ScriptSource,
    modules: Vec<ScriptSource>,
    pub vocabulary: Vocabulary,
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
    pub fn new(main: ScriptSource, vocabulary: Vocabulary) -> Self {
        ScriptSources { main, modules: Vec::new(), vocabulary }
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
        let is_known = |name: &str| read.contains(&name) || allowance::is_limit(name);
        match defines.iter().find(|(name, _)| !is_known(name)) {
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
        let (message, help) = words::of_error(inner, "", &self.vocabulary);
        let place = match (at.is_none(), call.place.filter(|at| !at.is_none()), call.function) {
            (false, ..) => source.place(at),
            (true, Some(at), _) => self.main.place(at),
            (true, None, Some(function)) => self.main.place_without_position(inner, function),
            (true, None, None) => Place::file(source.file.clone()),
        };
        let place = source.place_of_key(&place, &message).unwrap_or(place);
        let message = shortened(without_names(&message));
        let message = match call.frame {
            Some(number) => format!("in frame {number}: {message}"),
            None => message,
        };
        match place_elsewhere(inner) {
            Some(elsewhere) => {
                let read_by = format!("it is read at {}:{}", place.file, place.line);
                let help = help.map_or(read_by.clone(), |help| format!("{help}; {read_by}"));
                diagnostic((message, Some(help)), elsewhere).into()
            }
            None => diagnostic((message, help), place).into(),
        }
    }

    /// An error of a module's own text.
    pub fn diagnose_in(&self, file: &str, error: EvalAltResult) -> Diagnostics {
        let (file, at) = deepest_position(&error, file);
        let source = self.of(file).unwrap_or(&self.main);
        let (message, help) = words::of_error(error.unwrap_inner(), "", &self.vocabulary);
        let place = source.place(at);
        let place = source.place_of_key(&place, &message).unwrap_or(place);
        diagnostic((shortened(without_names(&message)), help), place).into()
    }
}

impl ScriptSource {
    /// A text, and what the engine makes of it. `outer` are names that come from elsewhere.
    ///
    /// # Errors
    /// All mistakes of grammar that can be found, or all names that stand for nothing.
    pub fn compile(
        engine: &Engine,
        file: &str,
        text: String,
        role: TextRole,
        vocabulary: &mut Vocabulary,
    ) -> (ScriptSource, Result<AST, Diagnostics>) {
        vocabulary.read(&text);
        let (ast, rewritten) = rewrite::compile(engine, &text, role);
        let keys = MapKeys::new(engine, &text);
        let source = ScriptSource { file: file.into(), text, rewritten, keys };
        let ast = ast.map_err(|first| source.mistakes_of_grammar(engine, first, vocabulary)).and_then(|ast| {
            let mistakes = inspect::certain_mistakes(&ast, vocabulary);
            let mistakes = mistakes.into_iter().map(|(at, words)| diagnostic(words, source.place(at)));
            let mistakes: Vec<Diagnostic> = mistakes.collect();
            if mistakes.is_empty() { Ok(ast) } else { Err(Diagnostics(mistakes)) }
        });
        (source, ast)
    }

    fn mistakes_of_grammar(&self, engine: &Engine, first: ParseError, vocabulary: &Vocabulary) -> Diagnostics {
        let at = first.position();
        let (line, column) = self.rewritten.original(at.line().unwrap_or(1), at.position().unwrap_or(1));
        let small = |n: usize| n.min(u16::MAX.into()) as u16;
        // The last line of a text may be an empty one behind its end.
        let at = if at.is_none() { at } else { Position::new(small(line.max(1)), small(column.max(1))) };
        let all = inspect::all_mistakes(engine, &self.text, ParseError(first.0, at));
        let tokens = rewrite::tokens(engine, &self.text);
        let one = |error: &ParseError| {
            if let Some((at, words)) = foreign_grammar::form_at(&tokens, error.position(), &self.text) {
                return diagnostic(words, self.original_place(at));
            }
            let place = inspect::place_of_missing(engine, &self.text, error).unwrap_or(error.position());
            diagnostic(inspect::words_of(error, place, &self.text, vocabulary), self.original_place(place))
        };
        Diagnostics(all.iter().map(one).collect())
    }

    /// A place in the text as its author wrote it.
    fn original_place(&self, at: Position) -> Place {
        match (at.line(), at.position()) {
            (Some(line), column) => {
                Place::of_position(self.file.clone(), &self.text, line as u32, column.unwrap_or(1).max(1) as u32)
            }
            _ => Place::of_span(self.file.clone(), &self.text, self.text.len(), self.text.len()),
        }
    }

    pub fn place(&self, at: Position) -> Place {
        match (at.line(), at.position()) {
            (Some(line), column) => {
                let (line, column) = self.rewritten.original(line, column.unwrap_or(1).max(1));
                let column = self.behind_sign(line, column);
                Place::of_position(self.file.clone(), &self.text, line as u32, column as u32)
            }
            _ => Place::file(self.file.clone()),
        }
    }

    /// Where the arguments of a call give the key that a message is about: the engine only knows of the call.
    fn place_of_key(&self, call: &Place, message: &str) -> Option<Place> {
        if *call.file != *self.file || call.line == 0 {
            return None;
        }
        let small = |n: u32| n.min(u16::MAX.into()) as u16;
        let at = Position::new(small(call.line), small(call.column));
        let keys = self.keys.of_call(rewrite::offset(&self.text, &rewrite::line_starts(&self.text), at));
        let named = message.split('`').skip(1).step_by(2);
        let (start, end) = named.filter_map(|word| keys.iter().find(|key| self.text[key.0..key.1] == *word)).next()?;
        Some(Place::of_span(self.file.clone(), &self.text, *start, *end))
    }

    /// The engine points at the dot before a property, and at the bracket of a look-up; what stands behind it is meant.
    fn behind_sign(&self, line: usize, column: usize) -> usize {
        let source = self.text.lines().nth(line.saturating_sub(1)).unwrap_or("");
        let mut rest = source.chars().skip(column - 1).skip_while(|c| *c == '?').peekable();
        let question = source.chars().skip(column - 1).take_while(|c| *c == '?').count();
        match (rest.next(), rest.next()) {
            (Some('.'), Some(next)) if next.is_alphabetic() || next == '_' => column + question + 1,
            (Some('('), Some(next)) if next != ')' => column + question + 1,
            _ => column,
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

    /// Where a function is declared.
    pub fn place_of_function(&self, name: &str) -> Place {
        match self.functions().find(|(_, found, _)| *found == name) {
            Some((at, name, _)) => Place::of_span(self.file.clone(), &self.text, at + 3, at + 3 + name.len()),
            None => self.whole(),
        }
    }

    /// How often a word stands in the text, comments and strings included.
    pub fn mentions(&self, word: &str) -> usize {
        self.words(word).count()
    }

    /// Where a function is called first.
    pub fn place_of_call(&self, name: &str) -> Option<Place> {
        let is_called = |at: &usize| self.text[at + name.len()..].trim_start().starts_with('(');
        let at = self.words(name).find(is_called)?;
        Some(Place::of_span(self.file.clone(), &self.text, at, at + name.len()))
    }

    /// Where a word stands.
    fn words<'a>(&'a self, word: &'a str) -> impl Iterator<Item = usize> + 'a {
        let is_inside = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
        self.text.match_indices(word).map(|(at, _)| at).filter(move |at| {
            !is_inside(self.text[..*at].chars().next_back()) && !is_inside(self.text[at + word.len()..].chars().next())
        })
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

/// Names the columns of tables that are most likely meant where a value turns out to be nothing: a row gives () for a column
/// that it does not have.
pub fn name_columns(problems: &mut Diagnostics, columns: &[String]) {
    for problem in problems.0.iter_mut().filter(|problem| problem.message.contains("nothing")) {
        let Some(place) = &problem.place else { continue };
        let words = place.source.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| word.len() > 2);
        let unknown = words.filter(|word| !columns.iter().any(|column| column == word));
        let near = |word: &&str| Some((word.to_string(), nearest(word, columns.iter().map(String::as_str))?));
        if let Some((word, column)) = unknown.into_iter().find_map(|word| near(&word)) {
            problem.help = Some(format!("the table has no column `{word}`; did you mean `{column}`?"));
        }
    }
}

fn diagnostic((message, help): Words, place: Place) -> Diagnostic {
    let diagnostic = Diagnostic::error(message).at(place);
    help.map_or(diagnostic.clone(), |help| diagnostic.help(help))
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

#[cfg(test)]
mod tests {
    use crate::script::tests::{open, scene};

    #[test]
    fn mistakes_in_a_map_are_placed_at_their_key() {
        let setup = |text: &str, words: &[&str]| {
            let program =
                open(&format!("animation(#{{ frames: 5 }});\nfn frame(s, f) {{ }}\nfn setup(s) {{\n{text}\n}}"), &[]);
            let message = program.unwrap().setup(&scene()).map(drop).unwrap_err().to_string();
            words.iter().for_each(|word| assert!(message.contains(word), "{word}\n{message}"));
        };
        let ball =
            "s.spawn(#{\n  name: \"a, centre: b\", // centre: 3\n  sphere: #{ radius: 2,\n    centre: [0, 1, 2] }\n});";
        setup(ball, &["show.rhai:7:5", "centre", "did you mean `center`?"]);
        setup("s.spawn(#{ sphere: #{ \"radus\": 2 } });", &["show.rhai:4:24", "radus"]);
        setup("let t = shake(1.0,\n  #{ sped: 3 });", &["show.rhai:5:6", "sped"]);
        let header =
            open("animation(#{\n  scene: \"x.ron\",\n  fsp: 24 });\nfn frame(s, f) { }", &[]).map(drop).unwrap_err();
        assert!(header.contains("show.rhai:3:3"), "{header}");
    }
}
