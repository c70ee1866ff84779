//! One shape for every mistake: where it is, what was found, what was expected, and the nearest right word.
//!
//! A [`Diagnostic`] is plain data; rooms below `cli/` return them and never print. Its text form is
//!
//! ```text
//! scenes/a.ron:3:17: error: unknown field `colour` in `material`
//!   3 |     "brass": (colour: (0.9, 0.7, 0.4)),
//!     |               ^^^^^^
//!   help: did you mean `color`?
//! ```

use std::fmt;
use std::sync::Arc;

use serde_json::{Map, Value};

use super::limits;
use super::synonyms::{by_meaning, by_parts};

/// Whether a diagnostic stops what it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// It does.
    Error,
    /// It does not.
    Warning,
    /// A line that the input itself says, as a script does with `print`.
    Note,
}

impl Severity {
    /// The word for it in messages.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        }
    }
}

/// What kind of failure a diagnostic belongs to; the command line turns it into an exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The scene, script, mesh or another input is wrong.
    Input,
    /// The arguments of the command are wrong.
    Usage,
    /// Reading or writing a file failed, or the system has not given what is needed.
    Io,
    /// The user has interrupted the work.
    Interrupted,
}

/// A place in a text file: line and column count from 1, columns in characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file, as a message calls it.
    pub file: Arc<str>,
    /// 1-based; 0 when the mistake belongs to the file as a whole.
    pub line: u32,
    /// 1-based, in characters.
    pub column: u32,
    /// How many characters to underline, at least 1.
    pub width: u32,
    /// The source line itself, without its line end; empty when it is not known.
    pub source: String,
}

impl Place {
    /// The file as a whole.
    pub fn file(file: impl Into<Arc<str>>) -> Self {
        Place { file: file.into(), line: 0, column: 0, width: 1, source: String::new() }
    }

    /// The bytes `start..end` of `text`; offsets past the end point behind the last character.
    pub fn of_span(file: impl Into<Arc<str>>, text: &str, start: usize, end: usize) -> Self {
        let start = floor_boundary(text, start);
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line = text[..start].matches('\n').count() as u32 + 1;
        let line_end = text[start..].find(['\n', '\r']).map_or(text.len(), |i| start + i);
        let column = text[line_start..start].chars().count() as u32 + 1;
        let end = floor_boundary(text, end.clamp(start, line_end));
        let width = text[start..end].chars().count().max(1) as u32;
        Place { file: file.into(), line, column, width, source: text[line_start..line_end].to_string() }
    }

    /// Line and column (both from 1) of `text`; the underline covers the word that starts there.
    pub fn of_position(file: impl Into<Arc<str>>, text: &str, line: u32, column: u32) -> Self {
        let source = text.lines().nth(line.saturating_sub(1) as usize).unwrap_or("").to_string();
        let word = source.chars().skip(column.saturating_sub(1) as usize);
        let width = word.take_while(|c| c.is_alphanumeric() || *c == '_').count().max(1) as u32;
        Place { file: file.into(), line, column, width, source }
    }
}

fn floor_boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// The part of a scene that a mistake is in; numbers count in authored order, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ScenePart {
    /// The camera of the scene.
    Camera,
    /// The settings of the scene.
    Render,
    /// A material, by its number.
    Material(usize),
    /// An entity, by its number.
    Entity(usize),
}

/// What a mistake is about, where its place in a text is not known to whoever finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subject {
    /// Where in the scene.
    pub part: ScenePart,
    /// The component of an entity, by its name in a scene.
    pub component: Option<&'static str>,
    /// The field of the part or component, by its name in a scene; none if all of it is meant.
    pub field: Option<&'static str>,
}

/// All that a mistake may be about, the likeliest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Subjects(pub Vec<Subject>);

impl From<ScenePart> for Subject {
    fn from(part: ScenePart) -> Self {
        Subject { part, component: None, field: None }
    }
}

/// One mistake or warning, ready to be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Whether it is an error or a warning.
    pub severity: Severity,
    /// Whose mistake it is.
    pub cause: Cause,
    /// What was found and what was expected, without the place.
    pub message: String,
    /// Where it is, if it is in a text.
    pub place: Option<Place>,
    /// What to do about it: the nearest right word, the allowed range, an example.
    pub help: Option<String>,
    /// What it is about, the likeliest first, until its place is known.
    pub about: Option<Box<Subjects>>,
}

impl Diagnostic {
    /// An error of an input, without a place.
    pub fn error(message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Error,
            cause: Cause::Input,
            message: message.into(),
            place: None,
            help: None,
            about: None,
        }
    }

    /// A warning about an input, without a place.
    pub fn warning(message: impl Into<String>) -> Self {
        Diagnostic { severity: Severity::Warning, ..Self::error(message) }
    }

    /// A failed read or write of `path`.
    pub fn io(path: impl fmt::Display, action: &str, error: &std::io::Error) -> Self {
        Self::error(format!("cannot {action} {path}: {error}")).because(Cause::Io)
    }

    /// Something that cannot happen has happened: a mistake of the program, which says so.
    pub fn bug(message: impl Into<String>) -> Self {
        Self::error(message).help("this is a mistake in anim, not in the scene")
    }

    /// With another cause.
    pub fn because(mut self, cause: Cause) -> Self {
        self.cause = cause;
        self
    }

    /// With a place.
    pub fn at(mut self, place: Place) -> Self {
        self.place = Some(place);
        self
    }

    /// Says what it is about, after what was said before.
    pub fn about(mut self, subject: impl Into<Subject>) -> Self {
        self.about.get_or_insert_default().0.push(subject.into());
        self
    }

    /// With what to do about it.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds "did you mean ...?" or the list of what is allowed, if that helps.
    pub fn suggest<'a>(self, found: &str, known: impl IntoIterator<Item = &'a str>) -> Self {
        match suggestion(found, known) {
            Some(text) => self.help(text),
            None => self,
        }
    }

    /// The same as a warning.
    pub fn into_warning(self) -> Self {
        Diagnostic { severity: Severity::Warning, ..self }
    }

    /// As editors and pages want it: `severity`, `message`, its `text` form, and as far as they are known `help`, `file`,
    /// `line`, `column` (from 1), `width` and the `source` line.
    pub fn to_json(&self) -> Value {
        let mut out = Map::new();
        let mut put = |name: &str, value: Value| drop(out.insert(name.into(), value));
        put("severity", self.severity.word().into());
        put("message", self.message.as_str().into());
        put("text", self.to_string().into());
        if let Some(help) = &self.help {
            put("help", help.as_str().into());
        }
        if let Some(place) = &self.place {
            put("file", place.file.to_string().into());
            if place.line > 0 {
                let numbers = [("line", place.line), ("column", place.column), ("width", place.width)];
                numbers.into_iter().for_each(|(name, number)| put(name, number.into()));
                put("source", place.source.as_str().into());
            }
        }
        Value::Object(out)
    }

    /// Whether it is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.severity == Severity::Note {
            return f.write_str(&self.message);
        }
        if let Some(place) = &self.place {
            write!(f, "{}:", place.file)?;
            if place.line > 0 {
                write!(f, "{}:{}:", place.line, place.column)?;
            }
            write!(f, " ")?;
        }
        write!(f, "{}: {}", self.severity.word(), self.message)?;
        if let Some(place) = &self.place
            && place.line > 0
            && !place.source.is_empty()
        {
            write_source(f, place)?;
        }
        if let Some(help) = &self.help {
            write!(f, "\n  help: {help}")?;
        }
        Ok(())
    }
}

/// Columns of source shown at most; a 3 MB line must not flood the terminal.
const SHOWN: usize = 100;

fn write_source(f: &mut fmt::Formatter<'_>, place: &Place) -> fmt::Result {
    let gutter = place.line.to_string();
    let column = (place.column.max(1) - 1) as usize;
    let first = if column > SHOWN - 20 { column - SHOWN / 2 } else { 0 };
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    let shown: String = place.source.chars().skip(first).take(SHOWN).map(clean).collect();
    let (lead, mark) = (if first > 0 { "..." } else { "" }, "^".repeat((place.width as usize).min(SHOWN)));
    let indent = column - first + lead.len();
    let pad = " ".repeat(gutter.len());
    write!(f, "\n  {gutter} | {lead}{}", shown.trim_end())?;
    write!(f, "\n  {pad} | {}{mark}", " ".repeat(indent))
}

/// Errors and warnings gathered while one thing was read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostics {
    /// Adds one at the end.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.0.push(diagnostic);
    }

    /// These diagnostics behind lines that the input itself has said.
    pub fn after(self, said: Vec<String>) -> Self {
        let note = |message| Diagnostic { severity: Severity::Note, ..Diagnostic::error(message) };
        Diagnostics(said.into_iter().map(note).chain(self.0).collect())
    }

    /// The same with every warning as an error.
    pub fn refused(self) -> Self {
        let refused = |one: Diagnostic| match one.severity {
            Severity::Warning => Diagnostic { severity: Severity::Error, ..one },
            Severity::Error | Severity::Note => one,
        };
        Diagnostics(self.0.into_iter().map(refused).collect())
    }

    /// Whether one of them is an error.
    pub fn has_errors(&self) -> bool {
        self.0.iter().any(Diagnostic::is_error)
    }

    /// `value` with the warnings, or all diagnostics as the error if one of them is an error.
    pub fn into_result<T>(self, value: T) -> Result<(T, Diagnostics), Diagnostics> {
        if self.has_errors() { Err(self) } else { Ok((value, self)) }
    }
}

impl From<Diagnostic> for Diagnostics {
    fn from(one: Diagnostic) -> Self {
        Diagnostics(vec![one])
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = 0;
        for (i, diagnostic) in self.0.iter().enumerate() {
            let is_note = diagnostic.severity == Severity::Note;
            if !is_note && shown == limits::DIAGNOSTICS {
                break;
            }
            shown += usize::from(!is_note);
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{diagnostic}")?;
        }
        let more = self.0.iter().filter(|one| one.severity != Severity::Note).count() - shown;
        if more > 0 {
            write!(f, "\n... and {more} more")?;
        }
        Ok(())
    }
}

/// The known word nearest to `found`, if it is near enough to be what was meant.
pub fn nearest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let found = found.to_lowercase();
    let score = |word: &str| strsim::damerau_levenshtein(&found, &word.to_lowercase());
    let letters = found.chars().count();
    let best = known.into_iter().map(|word| (score(word), word)).min_by_key(|(distance, _)| *distance)?;
    // Of short words almost any other is two letters away, and hardly anybody slips at the first.
    let starts_alike = best.1.to_lowercase().chars().next() == found.chars().next();
    let limit = match letters {
        0..=3 => 1,
        4..=8 => 1 + usize::from(starts_alike),
        _ => letters / 3,
    };
    // A letter alone is meant by a word that begins with it, at most.
    (best.0 <= limit && (best.0 < letters || starts_alike)).then_some(best.1)
}

/// "did you mean `x`?" for the known word that is meant, by its letters or by its meaning.
pub fn did_you_mean(found: &str, known: &[&str]) -> Option<String> {
    let close = nearest(found, known.iter().copied());
    // A letter amiss is a slip, where a letter is not half the word; anything further is a word that someone means.
    let is_slip = |word: &&str| {
        found.chars().count() > 3 && strsim::damerau_levenshtein(&found.to_lowercase(), &word.to_lowercase()) <= 1
    };
    let meant =
        || by_meaning(found, known).or_else(|| Some((begun(found, known)?, ""))).or_else(|| by_parts(found, known));
    match close.filter(is_slip).map(|word| (word, "")).or_else(meant).or(close.map(|word| (word, ""))) {
        Some((word, "")) => Some(format!("did you mean `{word}`?")),
        Some((word, note)) => Some(format!("did you mean `{word}`? ({note})")),
        None => None,
    }
}

/// The one word that begins with four letters or more that were found.
fn begun<'a>(found: &str, known: &[&'a str]) -> Option<&'a str> {
    let found = found.to_lowercase();
    let mut longer = known.iter().filter(|word| found.len() > 3 && word.to_lowercase().starts_with(&found));
    longer.next().copied().filter(|_| longer.next().is_none())
}

/// "did you mean `x`?", or the list of all known words if none is near and the list is short.
pub fn suggestion<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let known: Vec<&str> = known.into_iter().collect();
    if let Some(help) = did_you_mean(found, &known) {
        return Some(help);
    }
    let list = || known.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ");
    (!known.is_empty() && known.len() <= 40).then(|| format!("expected one of {}", list()))
}

/// Ascending numbers as `1-4, 7`.
pub fn ranges(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [one] => one.to_string(),
        _ => format!("{}-{}", run[0], run[run.len() - 1]),
    });
    let runs: Vec<String> = runs.collect();
    match runs.len() {
        0..=20 => runs.join(", "),
        _ => format!("{}, ...", runs[..20].join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_form_points_at_the_word() {
        let text = "(\n  brass: (colour: 1),\n)";
        let start = text.find("colour").unwrap();
        let place = Place::of_span("a.ron", text, start, start + 6);
        let shown = Diagnostic::error("unknown field `colour`").at(place).suggest("colour", ["color", "gloss"]);
        assert_eq!(
            shown.to_string(),
            "a.ron:2:11: error: unknown field `colour`\n  2 |   brass: (colour: 1),\n    |           ^^^^^^\n  help: did you mean `color`?"
        );
    }

    #[test]
    fn spans_survive_any_offset() {
        let text = "aé\nb";
        for start in 0..10 {
            for end in 0..10 {
                let place = Place::of_span("x", text, start, end);
                assert!(place.line >= 1 && place.column >= 1 && place.width >= 1);
            }
        }
    }

    #[test]
    fn a_long_line_is_cut_around_the_mistake() {
        let text = format!("{}bad{}", "x ".repeat(5_000), " y".repeat(5_000));
        let at = text.find("bad").unwrap();
        let shown = Diagnostic::error("no").at(Place::of_span("x", &text, at, at + 3)).to_string();
        let lines: Vec<&str> = shown.lines().collect();
        assert!(lines[1].len() < 140);
        let caret = lines[2].find('^').unwrap();
        assert_eq!(&lines[1][caret..caret + 3], "bad");
    }

    #[test]
    fn nearest_is_near_and_not_wild() {
        let words = ["color", "specular", "shininess", "gloss", "radius"];
        assert_eq!(nearest("colour", words), Some("color"));
        assert_eq!(nearest("Shinyness", words), Some("shininess"));
        assert_eq!(nearest("raduis", words), Some("radius"));
        assert_eq!(nearest("banana", words), None);
        assert_eq!(nearest("x", words), None);
        assert_eq!(nearest("x", ["k", "eta"]), None);
        assert_eq!(nearest("hide", ["while", "wide"]), Some("wide"));
        assert_eq!(nearest("rotate", ["state", "translation"]), None);
    }
}
