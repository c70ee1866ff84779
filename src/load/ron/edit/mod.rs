//! Edits a RON scene in place: one value after the other at its exact place, every other byte as it was.
//!
//! A path leads from the scene to a value, in the words of the scene: `camera.focus_distance`, `materials.brass.color`,
//! `entities.key.area_light.size`, `entities[3].sphere.radius` (counted from 0), `entities.king.transform.translation.y`.
//! What is not there yet is added behind its neighbours, in their manner.

use super::explain::{read_component, wrong_value};
use super::{SECTIONS, options};
use crate::base::color::from_hex;
use crate::base::diagnostics::{Diagnostic, Place};
use crate::components::*;
use crate::load::spans::{self, Step, SyntaxNode};

/// A value for a place in a scene, as a person writes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    /// Where the value stands, as in `camera.focus_distance` or `entities[3].sphere.radius`.
    pub path: String,
    /// RON; the quotes of a text may be left out, and a colour may be `#ff8800`, as the screen shows it.
    pub value: String,
}

impl Assignment {
    /// Reads `path=value`.
    ///
    /// # Errors
    /// There is no `=` outside of quotes.
    pub fn parse(text: &str) -> Result<Assignment, String> {
        let mut quoted = false;
        let equals = text.char_indices().find(|(_, c)| {
            quoted ^= *c == '"';
            *c == '=' && !quoted
        });
        match equals.map(|(at, _)| (text[..at].trim(), text[at + 1..].trim())) {
            Some((path, value)) if !path.is_empty() && !value.is_empty() => {
                Ok(Assignment { path: path.into(), value: value.into() })
            }
            _ => Err("expected PATH=VALUE, as in camera.focus_distance=3.2".into()),
        }
    }
}

/// What an assignment did to a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ValueChange {
    /// Where the value stands, as in the assignment.
    pub path: String,
    /// Where the value stands in the text as it is now.
    pub place: Place,
    /// What stood there; `None` if nothing did.
    pub before: Option<String>,
    /// What stands there now.
    pub after: String,
}

/// The text with other values, each checked for its own shape; whether the whole makes sense is for
/// [`parse`](super::parse) to say. `file` is what diagnostics call it.
///
/// # Errors
/// A text that is no scene; a path that leads nowhere, with the nearest word; a value that does not fit.
pub fn assign(text: &str, file: &str, assignments: &[Assignment]) -> Result<(String, Vec<ValueChange>), Diagnostic> {
    let mut text = text.to_string();
    let mut changes = Vec::new();
    for assignment in assignments {
        let said = |problem: Diagnostic| {
            let message = format!("{}={}: {}", assignment.path, assignment.value, problem.message);
            Diagnostic { message, ..problem }
        };
        let tree = spans::parse(&text).map_err(|broken| {
            Diagnostic::error(broken.message).at(Place::of_span(file, &text, broken.at, broken.at + 1))
        })?;
        let target = target(&text, &tree, &assignment.path).map_err(said)?;
        let value = target.fitting(&assignment.value).map_err(said)?;
        let Splice { start, end, insert, value_at } = target.splice(&text, &tree, &value);
        let before = (end > start).then(|| text[start..end].to_string());
        text.replace_range(start..end, &insert);
        let at = start + value_at;
        let place = Place::of_span(file, &text, at, at + value.len());
        changes.push(ValueChange { path: assignment.path.clone(), place, before, after: value });
    }
    for change in &mut changes {
        // Lines that were added above have moved it; a new name has its place as it is.
        if let Ok((place, true)) = place_of_path(&text, file, &change.path) {
            change.place = place;
        }
    }
    Ok((text, changes))
}

/// Where a path of a scene leads in its text, and whether the text says it: the deepest part that it says.
///
/// # Errors
/// As [`assign`].
pub fn place_of_path(text: &str, file: &str, path: &str) -> Result<(Place, bool), Diagnostic> {
    let tree = spans::parse(text).map_err(|broken| Diagnostic::error(broken.message))?;
    let target = target(text, &tree, path)?;
    let (mut node, left) = descend(&tree, text, &target.steps);
    if let Some(child) = target.element.filter(|_| left.is_empty()).and_then(|element| node.children.get(element)) {
        node = &child.value;
    }
    Ok((Place::of_span(file, text, node.start, node.end), left.is_empty()))
}

/// What kind of value stands at the end of a path.
enum Owner {
    Fields(OwnerRecord),
    Text,
    Texts,
}

/// The usual value of a field.
type UsualValue = Box<dyn Fn(&str) -> Option<Value>>;
/// Reads a record, to see whether a value fits it.
type RecordReader = Box<dyn Fn(&str) -> Result<(), ::ron::error::SpannedError>>;

/// Camera, settings, a material or a component.
struct OwnerRecord {
    fields: &'static [&'static str],
    usual: UsualValue,
    read: RecordReader,
}

impl OwnerRecord {
    fn of<T: Record + Default + serde::de::DeserializeOwned>() -> OwnerRecord {
        OwnerRecord {
            fields: T::default().fields(),
            usual: Box::new(|field| T::default().get(field)),
            read: Box::new(|text| options().from_str::<T>(text).map(drop)),
        }
    }

    fn of_kind(kind: Kind) -> OwnerRecord {
        OwnerRecord {
            fields: kind.fields(),
            usual: Box::new(move |field| kind.default_component().record().get(field)),
            read: Box::new(move |text| read_component(kind, text).map(drop)),
        }
    }
}

/// Where a path leads.
struct PathTarget {
    /// From the scene, entities by number.
    steps: Vec<Step>,
    owner: Owner,
    /// What messages call the owner.
    label: String,
    /// From the owner to the value.
    fields: Vec<String>,
    /// Which number of a vector is meant.
    element: Option<usize>,
}

/// A change of a text: what is put in the place of some bytes, and where in it the value begins.
struct Splice {
    start: usize,
    end: usize,
    insert: String,
    value_at: usize,
}

/// The words of a path: `a.b[2]."c.d"`.
fn words(path: &str) -> Result<Vec<Step>, Diagnostic> {
    let wrong = || Diagnostic::error("a path is words with points between them, as in entities.key.sphere.radius");
    let mut steps = Vec::new();
    let mut rest = path;
    while !rest.is_empty() {
        if let Some(inner) = rest.strip_prefix('[') {
            let (number, behind) = inner.split_once(']').ok_or_else(wrong)?;
            steps.push(Step::Index(number.trim().parse().map_err(|_| wrong())?));
            rest = behind;
        } else {
            rest = if steps.is_empty() { rest } else { rest.strip_prefix('.').ok_or_else(wrong)? };
            let end = match rest.strip_prefix('"') {
                Some(inner) => inner.find('"').ok_or_else(wrong)? + 2,
                None => rest.find(['.', '[']).unwrap_or(rest.len()),
            };
            let word = rest[..end].trim_matches('"').trim();
            if word.is_empty() {
                return Err(wrong());
            }
            steps.push(Step::Key(word.into()));
            rest = &rest[end..];
        }
    }
    Ok(steps)
}

fn unknown<'a>(what: String, word: &str, known: impl IntoIterator<Item = &'a str>) -> Diagnostic {
    Diagnostic::error(what).suggest(word, known)
}

/// Finds out where a path leads.
fn target(text: &str, tree: &SyntaxNode, path: &str) -> Result<PathTarget, Diagnostic> {
    let words = words(path)?;
    let (Some(Step::Key(section)), rest) = (words.first(), words.get(1..).unwrap_or_default()) else {
        return Err(Diagnostic::error(format!("a path starts with one of {}", SECTIONS.join(", "))));
    };
    match section.as_str() {
        "camera" => record_target(vec![words[0].clone()], OwnerRecord::of::<Camera>(), "camera", rest),
        "render" => record_target(vec![words[0].clone()], OwnerRecord::of::<Render>(), "render", rest),
        "cameras" => {
            let label = named(tree, section, rest, ("camera", "cameras.close.fov"))?;
            record_target(words[..2].to_vec(), OwnerRecord::of::<Camera>(), &label, &rest[1..])
        }
        "materials" => {
            let label = named(tree, section, rest, ("material", "materials.brass.color"))?;
            record_target(words[..2].to_vec(), OwnerRecord::of::<Material>(), &label, &rest[1..])
        }
        "entities" => entity_target(text, tree, rest),
        other => Err(unknown(format!("a scene has no section `{other}`"), other, SECTIONS)),
    }
}

/// What messages call the member of a section that is meant by its name, which must be there.
fn named(tree: &SyntaxNode, section: &str, rest: &[Step], (one, example): (&str, &str)) -> Result<String, Diagnostic> {
    let Some(Step::Key(name)) = rest.first() else {
        return Err(Diagnostic::error(format!("a {one} is meant by its name, as in {example}")));
    };
    let known = || tree.field(section).into_iter().flat_map(|field| &field.value.children);
    if !known().any(|child| child.key.as_deref() == Some(name)) {
        let names = known().filter_map(|child| child.key.as_deref());
        return Err(unknown(format!("the scene writes no {one} `{name}`"), name, names));
    }
    Ok(format!("{one} `{name}`"))
}

fn entity_target(text: &str, tree: &SyntaxNode, rest: &[Step]) -> Result<PathTarget, Diagnostic> {
    let entities = tree.field("entities").map_or(&[][..], |field| &field.value.children);
    let name_of = |node: &SyntaxNode| -> Option<String> {
        let name = &node.field("name")?.value;
        options().from_str::<String>(&text[name.start..name.end]).ok()
    };
    let (index, label) = match rest.first() {
        Some(Step::Index(i)) if *i < entities.len() => (*i, format!("entity {}", i + 1)),
        Some(Step::Index(i)) => {
            let message = format!("entities[{i}]: the scene has {}, counted from 0", entities.len());
            return Err(Diagnostic::error(message));
        }
        Some(Step::Key(name)) => {
            let found = entities.iter().position(|entity| name_of(&entity.value).as_deref() == Some(name));
            let Some(index) = found else {
                let names: Vec<String> = entities.iter().filter_map(|entity| name_of(&entity.value)).collect();
                let what = format!("the scene writes no entity `{name}`");
                return Err(unknown(what, name, names.iter().map(String::as_str)));
            };
            (index, format!("entity `{name}`"))
        }
        None => return Err(Diagnostic::error("an entity is meant by name or number: entities.key, entities[3]")),
    };
    let steps = vec![Step::Key("entities".into()), Step::Index(index)];
    let Some(Step::Key(key)) = rest.get(1) else {
        return Err(Diagnostic::error(format!("which component of {label}? As in entities[{index}].sphere.radius")));
    };
    let leaf = |owner: Owner| {
        if rest.len() > 2 {
            return Err(Diagnostic::error(format!("`{key}` of {label} is one value, without fields")));
        }
        let steps = steps.iter().cloned().chain([rest[1].clone()]).collect();
        Ok(PathTarget { steps, owner, label: label.clone(), fields: Vec::new(), element: None })
    };
    match (key.as_str(), Kind::parse(key)) {
        ("name", _) | (_, Some(Kind::MaterialName)) => leaf(Owner::Text),
        ("tags", _) => leaf(Owner::Texts),
        (_, Some(kind)) => {
            let label = format!("`{key}` of {label}");
            let steps = steps.into_iter().chain([rest[1].clone()]).collect();
            record_target(steps, OwnerRecord::of_kind(kind), &label, &rest[2..])
        }
        (_, None) => {
            let problem = Diagnostic::error(format!("unknown component `{key}` of {label}"));
            let has = |kind: &&Kind| {
                kind.fields().contains(&key.as_str()) && entities[index].value.field(kind.name()).is_some()
            };
            let owner =
                Kind::ALL.iter().find(has).or(Kind::ALL.iter().find(|kind| kind.fields().contains(&key.as_str())));
            Err(match owner {
                Some(kind) => problem.help(format!("it is a field of `{0}`: write {0}.{key}", kind.name())),
                None => problem.suggest(key, EntityDesc::keys()),
            })
        }
    }
}

/// A target inside of a record, one level of records in records included.
fn record_target(
    mut steps: Vec<Step>,
    record: OwnerRecord,
    label: &str,
    rest: &[Step],
) -> Result<PathTarget, Diagnostic> {
    let (mut fields, mut element) = (Vec::new(), None);
    let mut known: &[&str] = record.fields;
    for (i, step) in rest.iter().enumerate() {
        let is_last = i + 1 == rest.len();
        let letter =
            |word: &str| ["x", "y", "z"].iter().chain(&["r", "g", "b"]).position(|w| *w == word).map(|n| n % 3);
        match step {
            Step::Index(n) if is_last && i > 0 => element = Some(*n),
            Step::Key(word) if known.contains(&word.as_str()) => {
                fields.push(word.clone());
                steps.push(step.clone());
                known = if Material::MAPS.contains(&word.as_str()) { Texture::FIELDS } else { &[] };
            }
            Step::Key(word) if is_last && i > 0 && known.is_empty() && letter(word).is_some() => element = letter(word),
            Step::Key(word) if known.is_empty() => {
                let owner = fields.last().map_or(label, String::as_str);
                return Err(Diagnostic::error(format!("`{owner}` is one value, without a field `{word}`")));
            }
            Step::Key(word) => return Err(unknown(format!("unknown field `{word}` in {label}"), word, known.to_vec())),
            Step::Index(n) => return Err(Diagnostic::error(format!("[{n}] leads nowhere in {label}"))),
        }
    }
    Ok(PathTarget { steps, owner: Owner::Fields(record), label: label.into(), fields, element })
}

impl PathTarget {
    /// The value as it is written, once it fits.
    fn fitting(&self, given: &str) -> Result<String, Diagnostic> {
        if self.element.is_some() {
            let number = given.parse::<f64>().ok().filter(|x| x.is_finite());
            return number.map(|_| given.into()).ok_or_else(|| Diagnostic::error("expected a number"));
        }
        if let Some(color) = from_hex(given) {
            let [r, g, b] = color.map(|x| format!("{:?}", (f64::from(x) * 1e6 + 0.5).floor() / 1e6));
            return self.checked(&format!("({r}, {g}, {b})"));
        }
        let plain = self.checked(given);
        // A text is meant by its words alone where nothing else fits.
        let quoted = || self.checked(&format!("{given:?}"));
        plain.or_else(|problem| if given.starts_with('"') { Err(problem) } else { quoted().map_err(|_| problem) })
    }

    fn checked(&self, given: &str) -> Result<String, Diagnostic> {
        let tree = spans::parse(given).map_err(|broken| Diagnostic::error(broken.message))?;
        // What stands around the value, as a comment, is left out.
        let value = &given[tree.start..tree.end];
        let wrapped = self.fields.iter().rev().fold(value.to_string(), |inner, field| format!("({field}: {inner})"));
        let (read, record) = match &self.owner {
            Owner::Fields(record) => ((record.read)(&wrapped), Some(record)),
            Owner::Text => (options().from_str::<String>(value).map(drop), None),
            Owner::Texts => (options().from_str::<Vec<String>>(value).map(drop), None),
        };
        let Err(error) = read else { return Ok(value.into()) };
        let name = self.fields.last().map_or("value", String::as_str);
        let like = record.filter(|_| self.fields.len() == 1).and_then(|record| (record.usual)(name));
        let (message, help) = wrong_value(name, &self.label, value, like, &error.code);
        let problem = Diagnostic::error(message);
        Err(match help {
            Some(help) => problem.help(help),
            None => problem,
        })
    }

    /// How the text changes so that it says the value.
    fn splice(&self, text: &str, tree: &SyntaxNode, value: &str) -> Splice {
        let (mut node, mut left) = descend(tree, text, &self.steps);
        let mut value = value.to_string();
        let mut value_at = 0;
        if let Some(element) = self.element {
            match node.children.get(element).filter(|_| left.is_empty()) {
                Some(child) => (node, left) = (&child.value, &[]),
                None => (value, value_at) = self.with_element(element, &value),
            }
        }
        let replaced = |insert: String, value_at| Splice { start: node.start, end: node.end, insert, value_at };
        let Some((Step::Key(first), inner)) = left.split_first() else { return replaced(value, value_at) };
        let mut insert = value;
        for step in inner.iter().rev() {
            let Step::Key(field) = step else { continue };
            value_at += field.len() + 3;
            insert = format!("({field}: {insert})");
        }
        value_at += first.len() + 2;
        insert = format!("{first}: {insert}");
        if !text[..node.end].ends_with(')') {
            return replaced(format!("({insert})"), value_at + 1);
        }
        added(text, node, &insert, value_at)
    }

    /// The whole vector, where the scene writes none, with one number in it.
    fn with_element(&self, element: usize, value: &str) -> (String, usize) {
        let usual = match &self.owner {
            Owner::Fields(record) if self.fields.len() == 1 => (record.usual)(&self.fields[0]),
            Owner::Fields(_) | Owner::Text | Owner::Texts => None,
        };
        let usual = match usual {
            Some(Value::Vec3(v)) => v.to_array().map(|x| format!("{x:?}")).to_vec(),
            Some(Value::List(items)) => items.iter().map(Value::to_string).collect(),
            _ => vec!["0.0".into(); 3],
        };
        let parts: Vec<&str> =
            usual.iter().enumerate().map(|(i, text)| if i == element { value } else { text.as_str() }).collect();
        let at = 1 + parts.iter().take(element).map(|part| part.len() + 2).sum::<usize>();
        (format!("({})", parts.join(", ")), at)
    }
}

/// The deepest part of a path that the text says, and the steps that are left.
fn descend<'t, 's>(tree: &'t SyntaxNode, text: &str, steps: &'s [Step]) -> (&'t SyntaxNode, &'s [Step]) {
    let mut node = tree;
    for (i, step) in steps.iter().enumerate() {
        // `Some(...)` around a value may be left out, so it is passed through.
        if let [child] = node.children.as_slice()
            && child.key.is_none()
            && text[node.start..].starts_with("Some")
        {
            node = &child.value;
        }
        let next = match step {
            Step::Key(key) => node.field(key).map(|field| &field.value),
            Step::Index(n) => node.children.get(*n).map(|field| &field.value),
        };
        match next {
            Some(next) => node = next,
            None => return (node, &steps[i..]),
        }
    }
    (node, &[])
}

/// Adds a field behind the others of a record, on a line of its own if they stand so.
fn added(text: &str, node: &SyntaxNode, field: &str, value_at: usize) -> Splice {
    let at =
        |start: usize, insert: String, before: usize| Splice { start, end: start, insert, value_at: before + value_at };
    let Some(last) = node.children.last() else {
        return at(node.end - 1, field.into(), 0);
    };
    let line_start = text[..last.key_start].rfind('\n').map_or(0, |i| i + 1);
    let indent = &text[line_start..last.key_start];
    let behind = &text[last.value.end..node.end - 1];
    let stands_alone = indent.trim().is_empty() && behind.contains('\n');
    let comma = comma_in(behind);
    if !stands_alone {
        return at(last.value.end, format!(", {field}"), 2);
    }
    let ending = if text[..line_start].ends_with("\r\n") { "\r\n" } else { "\n" };
    // Behind the comma and a comment on the same line; without a comma nothing can stand between.
    match comma {
        Some(comma) => {
            let line_end = behind[comma..].find(['\r', '\n']).map_or(behind.len(), |i| comma + i);
            at(last.value.end + line_end, format!("{ending}{indent}{field},"), ending.len() + indent.len())
        }
        None => at(last.value.end, format!(",{ending}{indent}{field}"), 1 + ending.len() + indent.len()),
    }
}

/// Where the comma behind a value is, comments passed over.
fn comma_in(behind: &str) -> Option<usize> {
    let (mut i, mut depth) = (0, 0);
    while i < behind.len() {
        let rest = &behind[i..];
        if rest.starts_with("/*") {
            (depth, i) = (depth + 1, i + 2);
        } else if rest.starts_with("*/") {
            (depth, i) = (depth - 1, i + 2);
        } else if depth == 0 && rest.starts_with("//") {
            i += rest.find('\n').unwrap_or(rest.len());
        } else if depth == 0 && rest.starts_with(',') {
            return Some(i);
        } else {
            i += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    None
}

#[cfg(test)]
mod tests;
