//! Records as the reference shows them: every field with its kind, its default and an example.

use super::{Block, CodeKind, GuideEntry, field_examples};
use crate::components::*;

/// A record with its fields.
pub struct RecordReference {
    /// As it is written in a scene: `camera`, `sphere`.
    pub name: &'static str,
    /// What it stands for, from its declaration.
    pub about: String,
    /// In the order of the declaration.
    pub fields: Vec<FieldReference>,
}

/// A field of a record.
pub struct FieldReference {
    /// As it is written in a scene.
    pub name: &'static str,
    /// What it means, with unit and range, from its declaration.
    pub text: String,
    /// What its value is, in words.
    pub kind: String,
    /// Words that it may be, where it is one of a few, each with what it means.
    pub choices: Vec<(String, String)>,
    /// The unit of its numbers; empty where it holds none.
    pub unit: &'static str,
    /// What its numbers may be, in words; empty where it holds none.
    pub range: String,
    /// What it is where a scene does not give it.
    pub default: Value,
    /// The value in a scene.
    pub example: String,
}

/// Doc comments as plain sentences: lines joined, links and code marks of rustdoc kept as they read best.
fn plain(docs: &str) -> String {
    let lines: Vec<&str> = docs.lines().map(str::trim).collect();
    let mut text = String::new();
    for line in lines {
        match line {
            "" => text.push('\n'),
            _ if text.is_empty() || text.ends_with('\n') => text.push_str(line),
            _ => {
                text.push(' ');
                text.push_str(line);
            }
        }
    }
    text.replace("[`Self::", "`").replace("[`", "`").replace("`]", "`").trim().to_string()
}

/// What a field takes, from what it says when it is given something else.
fn kind_of(record: &dyn Record, field: &str) -> (String, Vec<String>) {
    // No field takes a switch and a map of strangers, so that one of the two is refused with what is expected.
    let strangers = [Value::Map(vec![("?".into(), Value::Unit)]), Value::Bool(true)];
    for stranger in strangers {
        if let Err(FieldError::Mismatch(mismatch)) = record.probe(field, &stranger) {
            // A record in the record knows no such stranger.
            if let Some((_, inner)) = mismatch.message.strip_prefix("unknown field").and_then(|m| m.split_once(" in "))
            {
                return (format!("fields of {}", inner.trim_matches('`')), Vec::new());
            }
            if !mismatch.message.starts_with("expected ") {
                return ("a file".into(), Vec::new());
            }
            let expected = mismatch.message.trim_start_matches("expected ").split(", found").next().unwrap_or_default();
            let expected = expected.to_string();
            let choices = expected.strip_prefix("one of ").map(|list| list.split(", ").map(str::to_string).collect());
            return (expected.clone(), choices.unwrap_or_default());
        }
    }
    ("a texture".into(), Vec::new())
}

/// A value as it stands in a scene.
pub fn in_ron(value: &Value, kind: &str) -> String {
    let is_choice = kind.starts_with("one of ");
    match value {
        Value::Unit => "()".into(),
        Value::Bool(b) => b.to_string(),
        Value::Int(i) => i.to_string(),
        Value::Number(x) => format!("{x:?}"),
        Value::Text(text) if is_choice => text.to_string(),
        Value::Text(text) => format!("{text:?}"),
        Value::Vec3(v) => format!("({:?}, {:?}, {:?})", v.x, v.y, v.z),
        Value::List(items) => {
            let inner: Vec<String> = items.iter().map(|item| in_ron(item, "")).collect();
            let (open, close) = if kind == "a list" { ('[', ']') } else { ('(', ')') };
            format!("{open}{}{close}", inner.join(", "))
        }
        Value::Map(entries) => {
            let inner: Vec<String> =
                entries.iter().map(|(key, value)| format!("{key}: {}", in_ron(value, ""))).collect();
            format!("({})", inner.join(", "))
        }
    }
}

/// A value for a field that has none by itself.
fn example_of(record: &dyn Record, field: &str, default: &Value, kind: &str, choices: &[String]) -> String {
    if *default != Value::Unit && *default != Value::List(Vec::new()) {
        return in_ron(default, kind);
    }
    if kind.contains("entity or a point") {
        return "Point(0.2, 1.0, 0.5)".into();
    }
    if kind == "fields of daylight" {
        return "(sun: (1.0, 2.0, 1.0), turbidity: 2.5)".into();
    }
    if kind == "fields of fog" {
        return "(density: 0.1, color: (0.8, 0.8, 0.8))".into();
    }
    let first = choices.first().map(|word| Value::Text(word.as_str().into()));
    let number = |x: f64| Value::Number(x);
    let three = Value::Vec3(glam::DVec3::new(0.2, 1.0, 0.5));
    let candidates = first.into_iter().chain([
        number(0.5),
        Value::Int(1),
        number(1.5),
        three.clone(),
        Value::List(vec![number(1.0), number(2.0)]),
        Value::List(vec![three.clone(), Value::Vec3(glam::DVec3::X)]),
        Value::List(vec![three.clone(), three.clone(), three.clone()]),
        Value::List(
            [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z].map(Value::Vec3).into_iter().chain([three]).collect(),
        ),
        Value::List(vec![Value::List(vec![number(0.0), number(1.0)]); 3]),
        Value::List([0, 0, 8, 8].map(Value::Int).to_vec()),
        Value::List(vec![Value::Text("name".into())]),
        Value::List(Vec::new()),
        Value::Text("name".into()),
        Value::Bool(false),
        // A temperature.
        number(2800.0),
    ]);
    // A field that goes with another (`f_stop` with `focal_length`) fits by its shape alone.
    let (mut fitting, mut shaped) = (None, None);
    for value in candidates {
        match record.probe(field, &value) {
            Ok(()) => fitting = fitting.or(Some(value)),
            Err(FieldError::Mismatch(mismatch)) if !mismatch.message.starts_with("expected ") => shaped = Some(value),
            Err(_) => {}
        }
    }
    fitting.or(shaped).map_or_else(|| "(pattern: Checker)".into(), |value| in_ron(&value, kind))
}

/// Every setting that is one word out of a few: the words, and what they mean.
const CHOICES: [(&[&str], &[&str]); 19] = [
    (Accel::NAMES, Accel::DOCS),
    (Aov::NAMES, Aov::DOCS),
    (Channel::NAMES, Channel::DOCS),
    (Encoding::NAMES, Encoding::DOCS),
    (Falloff::NAMES, Falloff::DOCS),
    (Filter::NAMES, Filter::DOCS),
    (Fresnel::NAMES, Fresnel::DOCS),
    (Integrator::NAMES, Integrator::DOCS),
    (Lens::NAMES, Lens::DOCS),
    (LightSampler::NAMES, LightSampler::DOCS),
    (Model::NAMES, Model::DOCS),
    (Pattern::NAMES, Pattern::DOCS),
    (Projection::NAMES, Projection::DOCS),
    (Shadows::NAMES, Shadows::DOCS),
    (Space::NAMES, Space::DOCS),
    (TexelFilter::NAMES, TexelFilter::DOCS),
    (ToneMap::NAMES, ToneMap::DOCS),
    (Transfer::NAMES, Transfer::DOCS),
    (Wrap::NAMES, Wrap::DOCS),
];

/// Words that a field may be, with what each means.
fn with_meanings(words: Vec<String>) -> Vec<(String, String)> {
    let known = CHOICES.iter().find(|(names, _)| names.iter().eq(words.iter()));
    let meaning = |i: usize| known.map_or(String::new(), |(_, docs)| plain(docs[i]));
    words.into_iter().enumerate().map(|(i, word)| (word, meaning(i))).collect()
}

/// What is said of a model of materials beside its meaning: the fields that it looks at.
fn fields_of_model(word: &str) -> String {
    let Some(model) = Model::parse(word) else { return String::new() };
    let fields: Vec<String> = model.fields().iter().map(|field| format!("`{field}`")).collect();
    format!(" Of the fields that not all models have it looks at {}.", fields.join(", "))
}

/// A record by its name in a scene.
pub fn reference(name: &'static str, record: &dyn Record) -> RecordReference {
    // A texture is one only with something to show.
    let pattern = Texture { pattern: Some(Pattern::Checker), ..Texture::default() };
    let probed: &dyn Record = if name == "texture" { &pattern } else { record };
    let fields = record.fields().iter().zip(record.field_docs()).map(|(field, docs)| {
        let (kind, choices) = kind_of(record, field);
        let default = record.get(field).unwrap_or(Value::Unit);
        let example = match field_examples::value_of(name, field) {
            Some(value) => value.to_string(),
            None => example_of(record, field, &default, &kind, &choices),
        };
        let unit = field_examples::unit_of(name, field);
        let range = field_examples::range_of(probed, field, &kind);
        let choices = with_meanings(choices);
        FieldReference { name: field, text: plain(docs), kind, choices, unit, range, default, example }
    });
    RecordReference { name, about: plain(record.docs()), fields: fields.collect() }
}

/// Everything that an entity can carry.
pub fn entity_records() -> Vec<RecordReference> {
    Kind::ALL.iter().map(|kind| reference(kind.name(), kind.default_component().record())).collect()
}

/// What a scene has beside its entities.
pub fn other_records() -> Vec<RecordReference> {
    vec![
        reference("camera", &Camera::default()),
        reference("render", &Render::default()),
        reference("material", &Material::default()),
        reference("texture", &Texture::default()),
        reference("daylight", &Daylight::default()),
        reference("fog", &Fog::default()),
    ]
}

/// A record as blocks of a page.
pub fn blocks(record: &RecordReference) -> Vec<Block> {
    let mut blocks = vec![Block::Heading(format!("`{}`", record.name)), Block::Paragraph(record.about.clone())];
    blocks.extend(record.fields.iter().map(|field| {
        let default = match &field.default {
            Value::Unit => "not given".to_string(),
            value => in_ron(value, &field.kind),
        };
        Block::GuideEntry(GuideEntry {
            forms: vec![field.name.to_string()],
            kind: [field.kind.as_str(), field.unit, field.range.as_str()]
                .into_iter()
                .filter(|part| !part.is_empty())
                .collect::<Vec<_>>()
                .join(", "),
            default,
            text: field.text.clone(),
            arguments: field
                .choices
                .iter()
                .map(|(word, meaning)| {
                    let more = if field.name == "model" { fields_of_model(word) } else { String::new() };
                    (word.clone(), format!("{meaning}{more}"))
                })
                .collect(),
            example: Some((CodeKind::Scene, format!("{}: {}", field.name, field.example))),
        })
    }));
    blocks
}
