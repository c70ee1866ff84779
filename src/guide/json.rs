//! The reference for programs: all pages as JSON, and a schema of scenes.

use serde_json::{Map, Value, json};

use super::{Block, CodeKind, FieldReference, PAGES, RecordReference, entity_records, other_records};
use crate::components;

fn code_word(kind: CodeKind) -> &'static str {
    match kind {
        CodeKind::Scene => "scene",
        CodeKind::Script => "script",
        CodeKind::Command => "command",
        CodeKind::Answer => "answer",
    }
}

fn block(block: &Block) -> Value {
    match block {
        Block::Heading(text) => json!({ "heading": text }),
        Block::Paragraph(text) => json!({ "text": text }),
        Block::Code(kind, text) => json!({ "code": text, "language": code_word(*kind) }),
        Block::Pair(theirs, ours) => json!({ "theirs": theirs, "ours": ours }),
        Block::GuideEntry(entry) => {
            let arguments: Vec<Value> =
                entry.arguments.iter().map(|(name, text)| json!({ "name": name, "text": text })).collect();
            json!({
                "forms": entry.forms,
                "kind": entry.kind,
                "default": entry.default,
                "text": entry.text,
                "arguments": arguments,
                "example": entry.example.as_ref().map(|(_, code)| code),
            })
        }
    }
}

/// All pages.
pub fn pages() -> Value {
    let page = |page: &super::Page| {
        let blocks: Vec<Value> = (page.blocks)().iter().map(block).collect();
        json!({ "name": page.name, "title": page.title, "summary": page.summary, "blocks": blocks })
    };
    Value::Array(PAGES.iter().map(page).collect())
}

/// The shape of a field that is not given unless a scene gives it.
fn shape_of_kind(kind: &str) -> Value {
    let numbers = |least: u32, most: u32| json!({ "type": "array", "items": { "type": "number" }, "minItems": least, "maxItems": most });
    match kind {
        "a number" => json!({ "type": "number" }),
        "a whole number from 0" => json!({ "type": "integer", "minimum": 0 }),
        "true or false" => json!({ "type": "boolean" }),
        "a text" | "a file" => json!({ "type": "string" }),
        "two numbers" => numbers(2, 2),
        "three numbers" => numbers(3, 3),
        "three or four numbers" => numbers(3, 4),
        kind if kind.starts_with("a list") => json!({ "type": "array" }),
        // What may be one of several shapes, as a focus or a texture, is told by its description.
        _ => json!({}),
    }
}

fn field(field: &FieldReference) -> Value {
    let shape = match &field.default {
        _ if !field.choices.is_empty() => {
            json!({ "enum": field.choices.iter().map(|(word, _)| word).collect::<Vec<_>>() })
        }
        components::Value::Bool(_) => json!({ "type": "boolean" }),
        components::Value::Int(_) => json!({ "type": "integer" }),
        components::Value::Number(_) => json!({ "type": "number" }),
        components::Value::Text(_) => json!({ "type": "string" }),
        components::Value::Vec3(_) => {
            json!({ "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 })
        }
        components::Value::List(_) => json!({ "type": "array" }),
        components::Value::Unit | components::Value::Map(_) => shape_of_kind(&field.kind),
    };
    let mut shape = shape;
    if let Value::Object(map) = &mut shape {
        map.insert("description".into(), format!("{} ({})", field.text, field.kind).into());
        map.insert("examples".into(), json!([field.example]));
    }
    shape
}

fn record(record: &RecordReference) -> Value {
    let properties: Map<String, Value> = record.fields.iter().map(|one| (one.name.to_string(), field(one))).collect();
    json!({
        "type": "object",
        "description": record.about,
        "additionalProperties": false,
        "properties": properties,
    })
}

/// A JSON Schema of scenes, for editors: the fields of RON are those of JSON.
pub fn schema() -> Value {
    let mut entity: Map<String, Value> = Map::new();
    entity.insert("name".into(), json!({ "type": "string", "description": "what scripts and other entities call it" }));
    entity.insert("tags".into(), json!({ "type": "array", "items": { "type": "string" } }));
    for one in entity_records() {
        let shape = if one.name == "material" { json!({ "type": "string" }) } else { record(&one) };
        entity.insert(one.name.to_string(), shape);
    }
    let others: Map<String, Value> = other_records().iter().map(|one| (one.name.to_string(), record(one))).collect();
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "anim scene",
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "camera": others["camera"],
            "cameras": { "type": "object", "additionalProperties": others["camera"] },
            "render": others["render"],
            "materials": { "type": "object", "additionalProperties": others["material"] },
            "entities": {
                "type": "array",
                "items": { "type": "object", "additionalProperties": false, "properties": entity },
            },
        },
    })
}
