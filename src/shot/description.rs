//! A frame as facts for people: what it is made from, by the names that the scene and the script use.

use super::Shot;
use super::fingerprint::{BaseFingerprint, Fingerprint, PICTURES};
use crate::base::diagnostics::Diagnostics;
use crate::compare::description::{Detail, Fact, FrameDescription, PARTS, Topic, short};
use crate::components::{
    Camera, Component, ComponentType, EntityDesc, FieldClass, Kind, Material, MaterialName, Mesh, Record, Render, Role,
    Scene, Value,
};

impl Shot {
    /// What a frame is made from at its own time; `fingerprint` is that of the frame.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn describe(&mut self, frame: u32, fingerprint: &Fingerprint) -> Result<FrameDescription, Diagnostics> {
        let scene = self.scene_of(frame)?;
        let mut facts = Facts { list: Vec::new(), base: &self.input.base };
        facts.add(Topic::Frame, "anim", "version", env!("CARGO_PKG_VERSION").into());
        facts.add(Topic::Frame, "anim", "picture version", PICTURES.to_string());
        for (part, digest) in fingerprint.digests() {
            facts.add(Topic::Frame, PARTS, part.word(), short(digest));
        }
        facts.scene(&scene);
        Ok(FrameDescription { detail: Detail::Values, facts: facts.list })
    }
}

struct Facts<'a> {
    list: Vec<Fact>,
    /// Knows the content of the files that a scene names.
    base: &'a BaseFingerprint,
}

impl Facts<'_> {
    fn add(&mut self, topic: Topic, subject: &str, field: &str, value: String) {
        self.list.push(Fact { topic, subject: subject.into(), field: field.into(), value });
    }

    fn scene(&mut self, scene: &Scene) {
        self.record(Topic::Scene, "camera", "", &scene.camera, &Camera::default());
        self.record(Topic::Scene, "render", "", &scene.render, &Render::default());
        let worn: rustc_hash::FxHashSet<&str> = scene.entities.iter().filter_map(material_of).collect();
        for (name, material) in scene.materials.iter().filter(|(name, _)| worn.contains(&**name)) {
            let subject = format!("material `{name}`");
            // A material without a value of its own is there all the same.
            self.add(Topic::Material, &subject, "name", name.to_string());
            self.record(Topic::Material, &subject, "", material, &Material::default());
        }
        for (index, entity) in scene.entities.iter().enumerate() {
            let subject = entity.label(index);
            for component in entity.components() {
                self.component(&subject, component);
            }
        }
    }

    fn component(&mut self, subject: &str, component: &Component) {
        let kind = component.kind();
        // The entities that come from an asset are told themselves.
        if kind.role() == Role::Source {
            return;
        }
        if let Component::MaterialName(name) = component {
            return self.add(Topic::Entity, subject, kind.name(), name.0.to_string());
        }
        let mut prefix = String::new();
        // What a transform says is said of the entity, as scripts do.
        if kind != Kind::Transform {
            prefix = format!("{}.", kind.name());
            // Data behind its fields are told by their digest.
            let mut content = component.data_digest().map_or_else(|| "there".into(), short);
            if let Some(mesh) = Mesh::of(component) {
                content = format!("{} triangles {content}", mesh.data.triangles.len());
            }
            self.add(Topic::Entity, subject, kind.name(), content);
        }
        self.record(Topic::Entity, subject, &prefix, component.record(), kind.default_component().record());
    }

    /// The fields that are not at their defaults and show in a picture; data behind them are told by their digest.
    fn record(&mut self, topic: Topic, subject: &str, prefix: &str, record: &dyn Record, default: &dyn Record) {
        let is_told = |class: FieldClass| !matches!(class, FieldClass::Invisible | FieldClass::Data);
        let fields = record.fields().iter().zip(record.classes());
        for (field, _) in fields.filter(|(_, class)| is_told(**class)) {
            let value = record.get(field).filter(|value| default.get(field).as_ref() != Some(value));
            if let Some(value) = value {
                self.value(topic, subject, &format!("{prefix}{field}"), &value);
            }
        }
    }

    fn value(&mut self, topic: Topic, subject: &str, field: &str, value: &Value) {
        match value {
            Value::Map(entries) => {
                for (key, value) in entries.iter().filter(|(_, value)| *value != Value::Unit) {
                    self.value(topic, subject, &format!("{field}.{key}"), value);
                }
            }
            Value::Text(text) => {
                // A file is what is in it.
                let content = self.base.content_of(text).map(|digest| format!(" [{}]", &short(digest)[..8]));
                self.add(topic, subject, field, format!("{text}{}", content.unwrap_or_default()));
            }
            Value::Unit | Value::Bool(_) | Value::Int(_) | Value::Number(_) | Value::Vec3(_) | Value::List(_) => {
                self.add(topic, subject, field, plain(value));
            }
        }
    }
}

fn material_of(entity: &EntityDesc) -> Option<&str> {
    entity.get(Kind::MaterialName).and_then(MaterialName::of).map(|name| &*name.0)
}

/// A value as people write it.
fn plain(value: &Value) -> String {
    match value {
        Value::Unit => "none".into(),
        Value::Bool(yes) => yes.to_string(),
        Value::Int(number) => number.to_string(),
        Value::Number(number) => number.to_string(),
        Value::Text(text) => text.to_string(),
        Value::Vec3(v) => format!("({}, {}, {})", v.x, v.y, v.z),
        Value::List(items) => format!("[{}]", items.iter().map(plain).collect::<Vec<_>>().join(", ")),
        Value::Map(entries) => {
            let entries: Vec<String> = entries.iter().map(|(key, value)| format!("{key}: {}", plain(value))).collect();
            format!("({})", entries.join(", "))
        }
    }
}
