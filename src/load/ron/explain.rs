//! A second look at a scene that serde refused: every piece on its own, every mistake at its place.

use ::ron::error::{Error, SpannedError};
use serde::de::DeserializeOwned;

use super::{SECTIONS, options};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, suggestion};
use crate::base::text;
use crate::components::*;
use crate::load::spans::{self, SyntaxField, SyntaxNode, mistake_in_name};

/// All mistakes of a text that could not be read; `first` is what serde said of it.
///
/// With them comes the scene as far as it could be read, so that its values and references can be judged too.
pub fn explain(text: &str, file: &str, first: &SpannedError) -> (Diagnostics, Option<Scene>) {
    let doubles = text::doubles(text, file);
    if !doubles.is_empty() {
        return (Diagnostics(doubles), None);
    }
    let tree = match spans::parse(text) {
        Ok(tree) => tree,
        Err(broken) => {
            let place = Place::of_span(file, text, broken.at, broken.at + 1);
            let diagnostic = Diagnostic { help: broken.help, ..Diagnostic::error(broken.message) };
            return (diagnostic.at(place).into(), None);
        }
    };
    let mut explainer = Explainer { text, file, found: Diagnostics::default(), scene: Scene::default() };
    explainer.scene(&tree);
    if explainer.found.0.is_empty() {
        let start = &first.span.start;
        let place = Place::of_position(file, text, start.line as u32, start.col as u32);
        explainer.found.push(Diagnostic::error(plain(&first.code)).at(place));
    }
    (explainer.found, Some(explainer.scene))
}

struct Explainer<'a> {
    text: &'a str,
    file: &'a str,
    found: Diagnostics,
    /// What could be read; a piece that could not is left at its default.
    scene: Scene,
}

impl Explainer<'_> {
    fn place(&self, start: usize, end: usize) -> Place {
        Place::of_span(self.file, self.text, start, end)
    }

    fn report(&mut self, (start, end): (usize, usize), message: String, help: Option<String>) {
        let wrapped = self.text[start..end].strip_prefix("Some").is_some_and(|rest| rest.trim_start().starts_with('('));
        let help = if wrapped { Some("write the value itself, without `Some`".into()) } else { help };
        let diagnostic = Diagnostic::error(message).at(self.place(start, end));
        self.found.push(match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
    }

    fn scene(&mut self, tree: &SyntaxNode) {
        let opening = &self.text[tree.start..];
        if opening.starts_with('{') || tree.children.iter().any(|child| self.text[child.key_start..].starts_with('"')) {
            let message = "this is JSON, and a scene is written in RON".to_string();
            let help = "round brackets, and names without quotes: (camera: (fov: 40.0), entities: [(sphere: ())])";
            self.report((tree.start, tree.start + 1), message, Some(help.into()));
            return;
        }
        if tree.children.is_empty() && !opening.starts_with('(') {
            let message = "this is no scene in RON".to_string();
            let help = "it begins with `(`, as in (camera: (fov: 40.0), entities: [(sphere: ())])";
            self.report((tree.start, tree.end), message, Some(help.into()));
            return;
        }
        for child in self.fields(tree, "the scene", &SECTIONS) {
            let node = &child.value;
            match child.key.as_deref() {
                Some("camera") => self.scene.camera = self.record::<Camera>(node, "camera").unwrap_or_default(),
                Some("render") => self.scene.render = self.record::<Render>(node, "render").unwrap_or_default(),
                Some("cameras") => self.cameras(node),
                Some("materials") => self.materials(node),
                Some("entities") => self.entities(node),
                _ => {}
            }
        }
    }

    /// The fields of a struct whose keys are known and there once; the others are reported.
    fn fields<'n>(&mut self, node: &'n SyntaxNode, owner: &str, known: &[&str]) -> Vec<&'n SyntaxField> {
        let mut good: Vec<&SyntaxField> = Vec::new();
        for (i, child) in node.children.iter().enumerate() {
            let Some(key) = child.key.as_deref() else {
                let span = (child.value.start, child.value.end);
                let before = i.checked_sub(1).map(|i| &node.children[i]);
                if let Some(before) = before.filter(|before| self.is_decimal_comma(before, child)) {
                    let span = (before.value.start, span.1);
                    let found = &self.text[span.0..span.1];
                    let help = format!("write {}", found.replacen(',', ".", 1));
                    self.report(span, format!("`{found}` has a comma where decimals begin with a point"), Some(help));
                    good.retain(|known| !std::ptr::eq(*known, before));
                    continue;
                }
                let help = Some(format!("fields are written `name: value`; {owner} has {}", list(known)));
                self.report(span, format!("{owner} has a value without a field name"), help);
                continue;
            };
            let span = (child.key_start, child.key_end);
            match mistake_in_name(key, known, &good, owner) {
                Some((message, help)) => self.report(span, message, help),
                None => good.push(child),
            }
        }
        good
    }

    /// Whether two values are what people who write decimals with a comma mean as one.
    fn is_decimal_comma(&self, whole: &SyntaxField, decimals: &SyntaxField) -> bool {
        let [whole, between, decimals] = [
            &self.text[whole.value.start..whole.value.end],
            &self.text[whole.value.end..decimals.value.start],
            &self.text[decimals.value.start..decimals.value.end],
        ];
        let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        is_digits(whole.trim_start_matches(['-', '+'])) && between == "," && is_digits(decimals)
    }

    /// The members of a map by their names, each of which is there once; the others are reported.
    fn named<'n>(&mut self, node: &'n SyntaxNode, (one, example): (&str, &str)) -> Vec<(&'n str, &'n SyntaxNode)> {
        let mut good: Vec<(&str, &SyntaxNode)> = Vec::new();
        for child in &node.children {
            let name = child.key.as_deref().unwrap_or("");
            if child.key.is_none() || !self.text[child.key_start..].starts_with('"') {
                let help = Some(format!("write {one}s as {{ \"name\": {example} }}"));
                self.report((child.value.start, child.value.end), format!("a {one} needs a name in quotes"), help);
                continue;
            }
            if good.iter().any(|(known, _)| *known == name) {
                self.report((child.key_start, child.key_end), format!("two {one}s are called `{name}`"), None);
            }
            good.push((name, &child.value));
        }
        good
    }

    fn materials(&mut self, node: &SyntaxNode) {
        for (name, node) in self.named(node, ("material", "(color: (0.8, 0.2, 0.1))")) {
            let material = self.record::<Material>(node, &format!("material `{name}`"));
            self.scene.materials.push((name.into(), material.unwrap_or_default()));
        }
    }

    fn cameras(&mut self, node: &SyntaxNode) {
        for (name, node) in self.named(node, ("camera", "(from: (0.0, 1.0, 2.0))")) {
            let camera = self.record::<Camera>(node, &format!("camera `{name}`"));
            self.scene.cameras.push((name.into(), camera.unwrap_or_default()));
        }
    }

    fn entities(&mut self, node: &SyntaxNode) {
        let keys: Vec<&str> = EntityDesc::keys().collect();
        for (index, entity) in node.children.iter().enumerate() {
            let owner = match entity.value.field("name") {
                Some(name) => format!("entity {}", &self.text[name.value.start..name.value.end].replace('"', "`")),
                None => format!("entity {}", index + 1),
            };
            let mut desc = EntityDesc::default();
            for child in self.fields(&entity.value, &owner, &keys) {
                match child.key.as_deref().unwrap_or("") {
                    "name" => desc.name = self.word(child, &owner, "a text in quotes"),
                    "tags" => desc.tags = self.word(child, &owner, "a list of texts").unwrap_or_default(),
                    name => {
                        let Some(kind) = Kind::parse(name) else { continue };
                        let component = self.component(kind, &child.value, &owner);
                        component.into_iter().for_each(|component| desc.put(component));
                    }
                }
            }
            self.scene.entities.push(desc);
        }
    }

    /// A value without fields of its own.
    fn word<T: DeserializeOwned>(&mut self, child: &SyntaxField, owner: &str, expected: &str) -> Option<T> {
        let (start, end) = (child.value.start, child.value.end);
        let read = options().from_str::<T>(&self.text[start..end]);
        if read.is_err() {
            let name = child.key.as_deref().unwrap_or("");
            let source = self.text[start..end].trim_matches(['\'', '"']);
            let is_word = !source.is_empty() && source.chars().all(|c| c.is_alphanumeric() || "_- ".contains(c));
            let help = is_word
                .then(|| if name == "tags" { format!("write [\"{source}\"]") } else { format!("write \"{source}\"") });
            self.report((start, end), format!("`{name}` of {owner}: expected {expected}"), help);
        }
        read.ok()
    }

    fn component(&mut self, kind: Kind, node: &SyntaxNode, owner: &str) -> Option<Component> {
        let read = |text: &str| read_component(kind, text);
        let owner = format!("`{}` of {owner}", kind.name());
        if kind == Kind::MaterialName {
            let component = read(&self.text[node.start..node.end]);
            if component.is_err() {
                let message = format!("{owner}: expected the name of a material in quotes");
                let source = &self.text[node.start..node.end];
                let help = if source.starts_with(['(', '{']) {
                    "put it into `materials: { \"name\": (...) }` and write material: \"name\"".to_string()
                } else {
                    format!("write \"{}\"", source.trim_matches('\''))
                };
                self.report((node.start, node.end), message, Some(help));
            }
            return component.ok();
        }
        self.fields_of(node, &owner, kind.default_component().record(), read)
    }

    fn record<T: DeserializeOwned + Default + Record>(&mut self, node: &SyntaxNode, owner: &str) -> Option<T> {
        self.fields_of(node, owner, &T::default(), |text| options().from_str::<T>(text))
    }

    /// Reads a record, or each field of it on its own; `default` tells what each one should look like.
    fn fields_of<T>(
        &mut self,
        node: &SyntaxNode,
        owner: &str,
        default: &dyn Record,
        read: impl Fn(&str) -> Result<T, SpannedError>,
    ) -> Option<T> {
        if let Ok(whole) = read(&self.text[node.start..node.end]) {
            return Some(whole);
        }
        let before = self.found.0.len();
        let mut good = Vec::new();
        for child in self.fields(node, owner, default.fields()) {
            let name = child.key.as_deref().unwrap_or("");
            let source = &self.text[child.value.start..child.value.end];
            let field = format!("{name}: {source}");
            let Err(error) = read(&format!("({field})")) else {
                good.push(field);
                continue;
            };
            if Material::MAPS.contains(&name) && !child.value.children.is_empty() {
                let before = self.found.0.len();
                self.record::<Texture>(&child.value, &format!("`{name}` of {owner}"));
                if self.found.0.len() > before {
                    continue;
                }
            }
            if ["daylight", "fog"].contains(&name) && !child.value.children.is_empty() {
                let before = self.found.0.len();
                let part = format!("`{name}` of {owner}");
                match name {
                    "fog" => drop(self.record::<Fog>(&child.value, &part)),
                    _ => drop(self.record::<Daylight>(&child.value, &part)),
                }
                if self.found.0.len() > before {
                    continue;
                }
            }
            let (message, mut help) = wrong_value(name, owner, source, default.get(name), &error.code);
            let parts = &child.value.children;
            let pairs = parts.len() == 6 && parts.chunks(2).all(|pair| self.is_decimal_comma(&pair[0], &pair[1]));
            if help.is_none() {
                help = notation(name, source, default.get(name));
            }
            if pairs && matches!(default.get(name), Some(Value::Vec3(_))) {
                help = Some("decimals begin with a point: write 0.5, not 0,5".into());
            }
            self.report((child.value.start, child.value.end), message, help);
        }
        if self.found.0.len() == before {
            let quoted = node.children.iter().any(|child| self.text[child.key_start..].starts_with('"'));
            let help = Some(match (quoted, self.text[node.start..].starts_with('{')) {
                (_, true) => "brackets are round here, and names have no quotes: (name: value)".to_string(),
                (true, false) => "names of fields have no quotes: write name: value".to_string(),
                (false, false) => format!("write it as ({}: ...)", default.fields().first().unwrap_or(&"")),
            });
            self.report((node.start, node.end), format!("{owner}: expected fields in round brackets"), help);
        }
        read(&format!("({})", good.join(", "))).ok()
    }
}

/// Reads one component of a kind.
pub(super) fn read_component(kind: Kind, text: &str) -> Result<Component, SpannedError> {
    let mut deserializer = ::ron::Deserializer::from_str_with_options(text, &options())?;
    let component = kind.deserialize(&mut deserializer).map_err(|e| deserializer.span_error(e))?;
    deserializer.end().map_err(|e| deserializer.span_error(e))?;
    Ok(component)
}

/// What is wrong with the value of a field, in plain words.
pub(super) fn wrong_value(
    name: &str,
    owner: &str,
    source: &str,
    like: Option<Value>,
    error: &Error,
) -> (String, Option<String>) {
    let found: String = source.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(40).collect();
    if let Error::NoSuchEnumVariant { expected, found, .. } = error {
        let message = format!("`{name}` of {owner}: unknown choice `{found}`");
        let help = suggestion(found, expected.iter().copied());
        // Where no word is near, the help lists them all by itself.
        let listed = |h: String| if h.starts_with("expected") { h } else { format!("{h} ({})", list(expected)) };
        return (message, help.map(listed));
    }
    if matches!(error, Error::FloatUnderscore | Error::InvalidEscape(_)) {
        return (format!("`{name}` of {owner}: {}", plain(error)), None);
    }
    if name == "focus" {
        let message = format!("`focus` of {owner}: expected an entity or a point, found `{found}`");
        return (message, None);
    }
    if let ("size" | "region", Some(Value::List(_))) = (name, &like) {
        let what = if name == "size" { "two whole numbers, as in (640, 360)" } else { "four whole numbers" };
        return (format!("`{name}` of {owner}: expected {what}, found `{found}`"), None);
    }
    let expected = match like {
        Some(Value::Number(_)) => "a number",
        Some(Value::Int(_)) => "a whole number from 0",
        Some(Value::Bool(_)) => "true or false",
        Some(Value::Vec3(_)) => "three numbers, as in (1.0, 2.0, 3.0)",
        Some(Value::Text(_)) => "a text in quotes or a choice",
        _ => return (format!("`{name}` of {owner}: {}, found `{found}`", plain(error)), None),
    };
    (format!("`{name}` of {owner}: expected {expected}, found `{found}`"), None)
}

/// How a value in the notation of another program is written here.
fn notation(name: &str, source: &str, like: Option<Value>) -> Option<String> {
    let inner = source.trim_matches(['"', '\'']);
    let is_quoted = source.starts_with(['"', '\'']);
    let capital = || {
        let mut letters = inner.chars();
        letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
    };
    let numbers = || {
        let all = source.split(|c: char| !(c.is_ascii_digit() || ".-+e".contains(c)));
        all.filter(|part| part.parse::<f64>().is_ok()).map(str::to_string).collect::<Vec<_>>()
    };
    Some(match like {
        _ if name == "focus" && source.starts_with(['(', '[']) => format!("write Point({})", numbers().join(", ")),
        _ if name == "focus" => {
            let inner = inner.trim_start_matches("Entity(").trim_end_matches(')');
            format!("write Entity(\"{inner}\"), or Point(0.0, 1.0, 0.0)")
        }
        _ if name == "lens" && source.parse::<f64>().is_ok() => {
            format!("`lens` is the outline of the opening; millimetres are focal_length: {source}")
        }
        _ if name == "aovs" => "write a list of words without quotes: [Depth, Normal]".into(),
        _ if Material::MAPS.contains(&name) && is_quoted => format!("write (image: \"{inner}\")"),
        _ if ["size", "region"].contains(&name) => "write whole numbers in round brackets: (640, 360)".into(),
        Some(Value::Text(_)) if is_quoted => format!("choices stand without quotes: {}", capital()),
        Some(Value::Bool(_)) if ["yes", "on", "True", "1", "TRUE"].contains(&inner) => "write true".into(),
        Some(Value::Bool(_)) if ["no", "off", "False", "0", "FALSE"].contains(&inner) => "write false".into(),
        Some(Value::Int(_)) if source.parse::<f64>().is_ok_and(|x| x >= 0.0) => {
            format!("write it without a point: {}", source.parse::<f64>().unwrap_or_default().round())
        }
        Some(Value::Vec3(_)) if inner.starts_with('#') || (is_quoted && name.contains("color")) => {
            "colours are three linear numbers from 0 to 1: (1.0, 0.5, 0.0)".into()
        }
        Some(Value::Vec3(_)) if source.starts_with("rgb") => {
            "colours are three linear numbers from 0 to 1: (1.0, 0.5, 0.0)".into()
        }
        Some(Value::Vec3(_)) => match &numbers()[..] {
            [x, y, z] => format!("write ({x}, {y}, {z})"),
            [x] => format!("write ({x}, {x}, {x}), a number for each"),
            _ => return None,
        },
        Some(Value::Number(_)) if source.chars().next().is_some_and(|c| c.is_ascii_digit()) => {
            let digits = numbers();
            let first = digits.first().filter(|_| source.ends_with(|c: char| c.is_alphabetic()))?;
            format!("numbers have no unit behind them: write {first}")
        }
        _ if source == "null" || source == "nil" => "leave the field out, or write None".into(),
        _ => return None,
    })
}

fn list(words: &[&str]) -> String {
    words.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ")
}

/// An error of the RON reader without its jargon.
fn plain(error: &Error) -> String {
    match error {
        Error::Eof => "the text ends too early".into(),
        Error::ExpectedFloat => "expected a number".into(),
        Error::ExpectedInteger | Error::InvalidIntegerDigit { .. } => "expected a whole number".into(),
        Error::ExpectedBoolean => "expected true or false".into(),
        Error::ExpectedString | Error::ExpectedIdentifier => "expected a text or a word".into(),
        Error::ExpectedStructLike | Error::ExpectedNamedStructLike(_) => "expected round brackets".into(),
        Error::ExpectedArray => "expected a list in square brackets".into(),
        Error::ExpectedMap => "expected a map in curly brackets".into(),
        Error::ExceededRecursionLimit => "brackets nest too deep".into(),
        Error::ExpectedDifferentLength { expected, found } => format!("expected {expected}, found {found} values"),
        Error::InvalidValueForType { expected, found } => format!("expected {expected}, found {found}"),
        other => {
            let text = other.to_string();
            let mut letters = text.chars();
            letters.next().map_or(text.clone(), |first| first.to_lowercase().collect::<String>() + letters.as_str())
        }
    }
}
