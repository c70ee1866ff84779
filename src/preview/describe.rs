//! What the page says of a part of the scene: its fields, where each stands, and whether it can be written there.

use std::path::Path;

use serde_json::{Value as Json, json};

use super::board::PagePart;
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::base::{files, limits};
use crate::components::{Component, ComponentType, Kind, MaterialName, Record, Scene, Transform, Value};
use crate::load::ron::edit::place_of_path;
use crate::shot::Shot;

/// A part of the scene in a frame, for the panel of the page.
///
/// # Errors
/// A part that is not there; mistakes of the frame.
pub fn describe(shot: &mut Shot, frame: u32, subject: PagePart) -> Result<Json, Diagnostics> {
    let scene = shot.scene_of(frame)?;
    let gone = || Diagnostic::error("there is no such part of the scene");
    let file = shot.scene_file().map(Path::to_path_buf);
    let text = file.as_ref().filter(|file| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron")));
    let text = text.and_then(|file| files::read_text(file, limits::SCENE_FILE_BYTES).ok());
    let source = SceneSource { shot, frame, file: file.map(|f| f.to_string_lossy().into_owned()), text };
    Ok(match subject {
        PagePart::Camera => {
            let group = source.group(
                "camera",
                "camera",
                &scene.camera,
                authored(shot).map(|s| &s.camera as _),
                ScenePart::Camera,
                None,
            );
            json!({ "kind": "camera", "label": "camera", "groups": [group] })
        }
        PagePart::Render => {
            let group = source.group(
                "render",
                "render",
                &scene.render,
                authored(shot).map(|s| &s.render as _),
                ScenePart::Render,
                None,
            );
            json!({ "kind": "render", "label": "settings", "groups": [group] })
        }
        PagePart::Material(index) => {
            let group = material(&source, &scene, index).ok_or_else(gone)?;
            json!({ "kind": "material", "index": index, "label": format!("material {}", scene.materials[index].0), "groups": [group] })
        }
        PagePart::Entity(index) => entity(&source, &scene, index).ok_or_else(gone)?,
    })
}

fn authored(shot: &Shot) -> Option<&Scene> {
    shot.authored().map(|scene| &**scene)
}

/// Where the values of a scene are from.
struct SceneSource<'a> {
    shot: &'a Shot,
    frame: u32,
    file: Option<String>,
    /// Of a RON scene.
    text: Option<String>,
}

fn entity(source: &SceneSource, scene: &Scene, index: usize) -> Option<Json> {
    let desc = scene.entities.get(index)?;
    let written = source.shot.is_as_written(index).then(|| authored(source.shot)?.entities.get(index)).flatten();
    let path = match &desc.name {
        Some(name) => format!("entities.\"{name}\""),
        None => format!("entities[{index}]"),
    };
    let group = |component: &Component| {
        let kind = component.kind();
        if kind == Kind::MaterialName {
            return source.material_name(&path, component, written.and_then(|written| written.get(kind)));
        }
        let before = written.and_then(|written| written.get(kind)).map(|component| component.record());
        source.group(
            kind.name(),
            &format!("{path}.{}", kind.name()),
            component.record(),
            before,
            ScenePart::Entity(index),
            Some(kind.name()),
        )
    };
    let mut groups: Vec<Json> = desc.components().iter().map(group).collect();
    let name = desc.component::<MaterialName>().map(|name| name.0.clone());
    let number = name.as_deref().and_then(|name| scene.material_index(name));
    groups.extend(number.and_then(|number| material(source, scene, number)));
    // A place that nobody has written can be: the entity moves then.
    let movable = written.is_some_and(|written| {
        let place = |desc: &crate::components::EntityDesc| desc.component::<Transform>().cloned().unwrap_or_default();
        source.text.is_some() && place(written) == place(desc) && place(desc).parent.is_none()
    });
    let translation = desc.component::<Transform>().map(|t| t.translation).unwrap_or_default();
    Some(json!({
        "kind": "entity",
        "index": index,
        "label": desc.label(index),
        "path": path,
        "material": name.as_deref(),
        "movable": movable,
        "translation": translation.to_array(),
        "groups": groups,
    }))
}

fn material(source: &SceneSource, scene: &Scene, index: usize) -> Option<Json> {
    let (name, material) = scene.materials.get(index)?;
    let written = authored(source.shot).and_then(|scene| scene.materials.get(index)).filter(|(known, _)| known == name);
    let before = written.map(|(_, material)| material as &dyn Record);
    let path = format!("materials.\"{name}\"");
    let mut group = source.group("material", &path, material, before, ScenePart::Material(index), None);
    group["title"] = json!(format!("material {name}"));
    group["subject"] = json!({ "kind": "material", "index": index });
    Some(group)
}

impl SceneSource<'_> {
    /// The name of an entity's material, which is a value without fields.
    fn material_name(&self, path: &str, now: &Component, before: Option<&Component>) -> Json {
        let own = format!("{path}.material");
        let name = MaterialName::of(now).map(|name| name.0.to_string());
        let place = self.text.as_deref().zip(self.file.as_deref());
        let place = place.and_then(|(text, file)| place_of_path(text, file, &own).ok()).map(|(place, _)| place);
        let is_as_written = before == Some(now);
        let field = json!({
            "name": "material",
            "value": name,
            "text": name,
            "kind": "text",
            "doc": "The name of a material of the scene.",
            "path": own,
            "said": true,
            "writable": is_as_written && place.is_some(),
            "by_script": !is_as_written,
            "file": place.as_ref().map(|place| &*place.file),
            "line": place.as_ref().map(|place| place.line),
        });
        json!({ "title": "surface", "component": null, "doc": "What it looks like.", "fields": [field] })
    }

    /// One record with its fields; `before` is how the scene's file has it.
    fn group(
        &self,
        title: &str,
        path: &str,
        record: &dyn Record,
        before: Option<&dyn Record>,
        part: ScenePart,
        component: Option<&'static str>,
    ) -> Json {
        let mut script = None;
        let fields = record.fields().iter().zip(record.field_docs()).filter_map(|(field, docs)| {
            let value = record.get(field)?;
            let (kind, is_simple) = kind_of(&value, docs);
            let own = format!("{path}.{field}");
            let place = self.text.as_deref().zip(self.file.as_deref());
            let place = place.and_then(|(text, file)| place_of_path(text, file, &own).ok());
            let is_as_written = before.and_then(|before| before.get(field)) == Some(value.clone());
            let by_script = (!is_as_written).then(|| {
                let subject = Subject { part, component, field: None };
                script.get_or_insert_with(|| self.shot.script_place(self.frame, subject)).clone()
            });
            let by_script = by_script.flatten();
            let shown = by_script.as_ref().or(place.as_ref().map(|(place, _)| place));
            Some(json!({
                "name": field,
                "value": value.to_json(),
                "text": value.to_string(),
                "kind": kind,
                "doc": docs.trim(),
                "path": own,
                "said": place.as_ref().is_some_and(|(_, said)| *said),
                "writable": is_simple && is_as_written && place.is_some(),
                "by_script": !is_as_written,
                "file": shown.map(|place| &*place.file),
                "line": shown.map(|place| place.line),
            }))
        });
        let fields: Vec<Json> = fields.collect();
        json!({ "title": title, "component": component, "doc": record.docs().trim(), "fields": fields })
    }
}

/// How a value is edited, and whether it can be.
fn kind_of(value: &Value, docs: &str) -> (&'static str, bool) {
    let is_color = docs.to_lowercase().contains("colour");
    match value {
        Value::Bool(_) => ("bool", true),
        Value::Int(_) => ("whole", true),
        Value::Number(_) => ("number", true),
        Value::Text(_) => ("text", true),
        Value::Vec3(_) if is_color => ("color", true),
        Value::Vec3(_) => ("vector", true),
        Value::Unit => ("none", true),
        Value::List(items) if items.len() <= 4 && items.iter().all(|item| item.as_number().is_some()) => {
            ("numbers", true)
        }
        Value::List(_) | Value::Map(_) => ("other", false),
    }
}
