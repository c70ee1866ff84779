//! What a script holds: handles into the overlay. Every mistake is answered where it is made.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ::rhai::{Dynamic, Map};
use glam::DVec3;

use super::allowance::Limit;
use super::clips;
use super::constraints::Constraints;
use super::context::ScriptContext;
use super::convert::{describe, to_dynamic, to_value};
use super::elsewhere;
use super::errors::{Fallible, complain};
use super::fields::{
    checked, known_entity, known_material, known_parent, number_of, parts_in_order, set_field, text, unknown_entity,
};
use super::geometry::MeshHandle;
use super::overlay::{ActiveCamera, Marks, Overlay};
use super::random::Generator;
use super::sandbox::allowance;
use super::world;
use crate::base::limits;
use crate::components::*;

/// The scene as a script sees it.
#[derive(Clone)]
pub struct SceneHandle {
    overlay: Arc<Mutex<Overlay>>,
    rng: Generator,
    shared: ScriptContext,
    /// The time that entities with `motion` go by, in the units of the camera's shutter.
    pub(super) time: f64,
    pub(super) constraints: Constraints,
}

/// One entity.
#[derive(Clone)]
pub struct EntityHandle {
    pub(super) scene: SceneHandle,
    pub(super) index: usize,
}

/// Something with fields.
#[derive(Clone)]
pub struct RecordHandle {
    pub(super) scene: SceneHandle,
    pub(super) place: RecordPath,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum RecordPath {
    /// The one that the frame is seen from, whichever it is by then.
    Camera,
    NamedCamera(ActiveCamera),
    Render,
    Material(usize),
    Component(usize, Kind),
}

const TRANSFORM_FIELDS: [&str; 4] = ["translation", "rotation", "scale", "parent"];
/// The first of these that an entity has is what its `color` is of.
const LIGHTS: [Kind; 4] = [Kind::AreaLight, Kind::PointLight, Kind::SpotLight, Kind::DirectionalLight];
const ANGLES: [(&str, usize); 3] = [("pitch", 0), ("yaw", 1), ("roll", 2)];

impl SceneHandle {
    pub fn new(overlay: Overlay, seed: u64, time: f64, shared: ScriptContext) -> Self {
        SceneHandle {
            overlay: Arc::new(Mutex::new(overlay)),
            rng: Generator::new(seed),
            shared,
            time,
            constraints: Constraints::default(),
        }
    }

    /// What belongs to the script as a whole.
    pub fn shared(&self) -> &ScriptContext {
        &self.shared
    }

    /// The generator of random numbers of `setup`, or of the frame.
    pub fn rng(&self) -> Generator {
        self.rng.clone()
    }

    pub fn has(&self, name: &str) -> bool {
        self.lock().find(name).is_some()
    }

    /// The camera's fields.
    pub fn camera_record(&self) -> RecordHandle {
        self.record(RecordPath::Camera)
    }

    /// The fields of one of the cameras.
    pub fn camera_of(&self, which: ActiveCamera) -> RecordHandle {
        self.record(RecordPath::NamedCamera(which))
    }

    /// The render settings.
    pub fn render_record(&self) -> RecordHandle {
        self.record(RecordPath::Render)
    }

    /// Entities in authored order: all, or those with a tag.
    pub fn entities(&self, tag: Option<&str>) -> Vec<EntityHandle> {
        let overlay = self.lock();
        let wanted = |i: &usize| tag.is_none_or(|tag| overlay.tags(*i).iter().any(|t| &**t == tag));
        overlay.entities().filter(wanted).map(|i| self.entity(i)).collect()
    }

    /// Removes an entity.
    pub fn despawn(&self, entity: &EntityHandle) -> Fallible<()> {
        entity.alive()?;
        self.lock().despawn(entity.index);
        Ok(())
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Overlay> {
        self.overlay.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes from now on when parts of the scene are written to.
    pub fn keep_marks(&self) {
        self.lock().keep_marks();
    }

    pub fn take_marks(&self) -> Marks {
        self.lock().take_marks()
    }

    /// What the script has changed.
    pub fn into_edits(self) -> Vec<Edit> {
        self.lock().take_edits()
    }

    pub fn camera(&self) -> Camera {
        self.lock().camera().clone()
    }

    pub(super) fn entity(&self, index: usize) -> EntityHandle {
        EntityHandle { scene: self.clone(), index }
    }

    fn record(&self, place: RecordPath) -> RecordHandle {
        RecordHandle { scene: self.clone(), place }
    }

    pub fn get(&mut self, name: &str) -> Fallible<EntityHandle> {
        let overlay = self.lock();
        match overlay.find(name) {
            Some(index) => {
                drop(overlay);
                Ok(self.entity(index))
            }
            None => unknown_entity(&overlay, name),
        }
    }

    pub fn material(&mut self, name: &str) -> Fallible<RecordHandle> {
        match known_material(&self.lock(), name) {
            Ok(index) => Ok(self.record(RecordPath::Material(index))),
            Err(error) => Err(error),
        }
    }

    pub fn add_material(&mut self, name: &str, fields: Map) -> Fallible<RecordHandle> {
        let mut material = Material::default();
        let owner = format!("material `{name}`");
        for (field, value) in &fields {
            set_field(&mut material, field, value, &owner)?;
        }
        checked(&material, &owner)?;
        let mut overlay = self.lock();
        if overlay.find_material(name).is_some() {
            return complain(format!("there is already a material `{name}`"), None);
        }
        let index = overlay.add_material(name.into(), material);
        drop(overlay);
        Ok(self.record(RecordPath::Material(index)))
    }

    pub fn spawn(&mut self, parts: Map) -> Fallible<EntityHandle> {
        let mut desc = EntityDesc::default();
        if let Some(name) = parts.get("name") {
            desc.name = Some(text(name, "`name` of a new entity")?);
        }
        let index = {
            let mut overlay = self.lock();
            if overlay.count() >= limits::ENTITIES || overlay.spawned() as u64 >= allowance().get(Limit::Spawns) {
                let most = allowance().get(Limit::Spawns);
                let help = Limit::Spawns.how_to_raise(most);
                return complain(format!("more than {} entities spawned in one call", overlay.spawned()), Some(help));
            }
            if let Some(name) = desc.name.as_deref()
                && overlay.find(name).is_some()
            {
                return complain(format!("there is already an entity `{name}`"), None);
            }
            overlay.spawn(desc)
        };
        let mut entity = self.entity(index);
        for (key, value) in parts_in_order(&parts)? {
            entity.set(key, value.clone())?;
        }
        Ok(entity)
    }

    /// World position of an entity at the moment that the script is called for, its parents and `motion` included: the
    /// place that a `focus` on it has.
    pub fn position(&self, name: &str) -> Fallible<DVec3> {
        self.clone().get(name)?.position()
    }
}

impl RecordHandle {
    /// Which camera it is, if it is one; `None` inside is the one that the frame is seen from.
    pub(super) fn as_camera(&self) -> Option<Option<&ActiveCamera>> {
        match &self.place {
            RecordPath::Camera => Some(None),
            RecordPath::NamedCamera(which) => Some(Some(which)),
            RecordPath::Render | RecordPath::Material(_) | RecordPath::Component(..) => None,
        }
    }

    fn owner(&self) -> String {
        let overlay = self.scene.lock();
        match &self.place {
            RecordPath::Camera | RecordPath::NamedCamera(ActiveCamera::Default | ActiveCamera::Blended(_)) => {
                "the camera".into()
            }
            RecordPath::NamedCamera(ActiveCamera::Named(index)) => format!("camera `{}`", overlay.cameras()[*index].0),
            RecordPath::Render => "the render settings".into(),
            RecordPath::Material(index) => {
                overlay.material(*index).map_or_else(String::new, |(name, _)| format!("material `{name}`"))
            }
            RecordPath::Component(entity, kind) => format!("{} of {}", kind.name(), overlay.label(*entity)),
        }
    }

    pub fn get(&mut self, field: &str) -> Fallible<Dynamic> {
        let overlay = self.scene.lock();
        let look = |record: &dyn Record| (record.get(field), record.fields());
        let (value, known) = match &self.place {
            RecordPath::Camera => look(overlay.camera()),
            RecordPath::NamedCamera(which) => look(overlay.camera_of(which)),
            RecordPath::Render => look(overlay.render()),
            RecordPath::Material(index) => overlay.material(*index).map_or((None, &[][..]), |(_, m)| look(m)),
            RecordPath::Component(entity, kind) => {
                overlay.component(*entity, *kind).map_or((None, &[][..]), |c| look(c.record()))
            }
        };
        drop(overlay);
        match value {
            Some(value) => Ok(to_dynamic(value)),
            None => complain(
                format!("unknown field `{field}` of {}", self.owner()),
                elsewhere::of_field(field, known.iter().copied()),
            ),
        }
    }

    pub fn set(&mut self, field: &str, value: Dynamic) -> Fallible<()> {
        let owner = self.owner();
        let mut overlay = self.scene.lock();
        match self.place.clone() {
            RecordPath::Camera | RecordPath::NamedCamera(_) => {
                let which = match &self.place {
                    RecordPath::NamedCamera(which) => which.clone(),
                    _ => overlay.active_camera().clone(),
                };
                let mut camera = overlay.camera_of(&which).clone();
                set_field(&mut camera, field, &value, &owner)?;
                if let (Some(Focus::Entity(name)), "focus") = (&camera.focus, field) {
                    known_entity(&overlay, name)?;
                }
                // Position and target may pass through each other on the way: the whole is checked with the frame.
                overlay.set_camera(&which, camera);
            }
            RecordPath::Render => {
                let mut render = overlay.render().clone();
                set_field(&mut render, field, &value, &owner)?;
                checked(&render, &owner)?;
                overlay.set_render(render);
            }
            RecordPath::Material(index) => {
                let Some((_, material)) = overlay.material(index) else { return Ok(()) };
                let mut material = material.clone();
                set_field(&mut material, field, &value, &owner)?;
                checked(&material, &owner)?;
                overlay.set_material(index, material);
            }
            RecordPath::Component(entity, kind) => {
                let Some(component) = overlay.component(entity, kind) else {
                    return complain(format!("{owner} was taken off"), None);
                };
                let mut component = component.clone();
                set_field(component.record_mut(), field, &value, &owner)?;
                checked(component.record(), &owner)?;
                known_parent(&overlay, &component)?;
                overlay.put(entity, component);
            }
        }
        Ok(())
    }
}

impl EntityHandle {
    pub(super) fn label(&self) -> String {
        self.scene.lock().label(self.index)
    }

    pub(super) fn name(&self) -> Option<Text> {
        self.scene.lock().name(self.index)
    }

    pub(super) fn component(&self, kind: Kind) -> Option<Component> {
        self.scene.lock().component(self.index, kind).cloned()
    }

    /// Another entity of the scene, if it is there.
    pub(super) fn find(&self, name: &str) -> Option<EntityHandle> {
        let index = self.scene.lock().find(name);
        index.map(|index| self.scene.entity(index))
    }

    pub(super) fn alive(&self) -> Fallible<()> {
        let is_gone = self.scene.lock().is_gone(self.index);
        match is_gone {
            true => complain(format!("{} was removed", self.label()), None),
            false => Ok(()),
        }
    }

    pub(super) fn transform(&self) -> Transform {
        self.scene.lock().component(self.index, Kind::Transform).and_then(Transform::of).cloned().unwrap_or_default()
    }

    /// The kind of the one light that the entity carries.
    fn light(&self) -> Option<Kind> {
        let overlay = self.scene.lock();
        LIGHTS.into_iter().find(|kind| overlay.component(self.index, *kind).is_some())
    }

    /// Properties that it has, for an answer to one that it has not.
    fn unknown_property<T>(&self, property: &str) -> Fallible<T> {
        let own = TRANSFORM_FIELDS.into_iter().chain(ANGLES.map(|a| a.0)).chain(world::PROPERTIES);
        let color = self.light().map(|_| "color");
        self.unknown(property, &own.chain(color).chain(EntityDesc::keys()).collect::<Vec<_>>())
    }

    pub fn get(&mut self, property: &str) -> Fallible<Dynamic> {
        self.alive()?;
        if TRANSFORM_FIELDS.contains(&property) {
            return Ok(self.transform().get(property).map_or(Dynamic::UNIT, to_dynamic));
        }
        if let Some((_, axis)) = ANGLES.iter().find(|(name, _)| *name == property) {
            return Ok(self.transform().rotation[*axis].into());
        }
        if let ("color", Some(kind)) = (property, self.light()) {
            return self.scene.record(RecordPath::Component(self.index, kind)).get("color");
        }
        if property == "clips" {
            return clips::all(self).map(Dynamic::from);
        }
        if let Some(value) = world::property(self, property) {
            return value;
        }
        let overlay = self.scene.lock();
        match property {
            "name" => return Ok(overlay.name(self.index).map_or(Dynamic::UNIT, |n| to_dynamic(Value::Text(n)))),
            "tags" => return Ok(to_dynamic(overlay.tags(self.index).to_vec().to_value())),
            "material" => {
                let material = overlay.component(self.index, Kind::MaterialName);
                return Ok(material.and_then(|c| c.record().get("name")).map_or(Dynamic::UNIT, to_dynamic));
            }
            _ => {}
        }
        let Some(kind) = Kind::parse(property) else {
            drop(overlay);
            return self.unknown_property(property);
        };
        let is_there = overlay.component(self.index, kind).is_some();
        let has = is_there || matches!(kind, Kind::Transform | Kind::Visible);
        drop(overlay);
        // Every entity stands somewhere and is seen by some: fields of these can be written at once.
        if has && !is_there {
            self.scene.lock().put(self.index, kind.default_component());
        }
        Ok(if has { Dynamic::from(self.scene.record(RecordPath::Component(self.index, kind))) } else { Dynamic::UNIT })
    }

    pub fn set(&mut self, property: &str, value: Dynamic) -> Fallible<()> {
        self.alive()?;
        if TRANSFORM_FIELDS.contains(&property) {
            let mut transform = self.transform();
            return set_field(&mut transform, property, &value, &self.label())
                .and_then(|()| self.put(transform.into()));
        }
        if let Some((_, axis)) = ANGLES.iter().find(|(name, _)| *name == property) {
            let mut transform = self.transform();
            transform.rotation[*axis] = number_of(property, &self.label(), &value)?;
            return self.put(transform.into());
        }
        if let ("color", Some(kind)) = (property, self.light()) {
            return self.scene.record(RecordPath::Component(self.index, kind)).set("color", value);
        }
        match property {
            "name" => return complain("an entity's name cannot be changed", None),
            _ if property == "clips" || world::PROPERTIES.contains(&property) => {
                // What was read comes back unchanged from a method that was called on it.
                if to_value(&self.get(property)?) == to_value(&value) {
                    return Ok(());
                }
                let help = "set `translation`, `rotation` and `scale`, which are relative to the parent";
                let help = (property != "clips").then(|| help.to_string());
                return complain(format!("`{property}` of {} is only read", self.label()), help);
            }
            "tags" => {
                let value = to_value(&value).unwrap_or(Value::Unit);
                return match Vec::<Text>::from_value(&value) {
                    Ok(tags) => {
                        self.scene.lock().set_tags(self.index, tags);
                        Ok(())
                    }
                    Err(m) => complain(format!("`tags` of {}: {}", self.label(), m.message), None),
                };
            }
            "material" if !value.is_unit() => {
                let name = text(&value, &format!("`material` of {}", self.label()))?;
                known_material(&self.scene.lock(), &name)?;
                return self.put(MaterialName(name).into());
            }
            _ => {}
        }
        match Kind::parse(property) {
            None => self.unknown_property(property),
            Some(kind) => self.set_component(kind, value),
        }
    }

    /// A component from a map of its fields; `()` takes it off; the handle itself is what nested writes put back.
    fn set_component(&mut self, kind: Kind, value: Dynamic) -> Fallible<()> {
        if value.is_unit() {
            self.scene.lock().take(self.index, kind);
            return Ok(());
        }
        if let Some(mesh) = value.read_lock::<MeshHandle>().filter(|_| kind == Kind::Mesh) {
            return self.put(mesh.0.clone().into());
        }
        if let Some(handle) = value.clone().try_cast::<RecordHandle>() {
            if handle.place == RecordPath::Component(self.index, kind) {
                return Ok(());
            }
            let RecordPath::Component(other, other_kind) = handle.place else {
                return complain(format!("expected a {}", kind.name()), None);
            };
            if kind == Kind::Asset {
                let help = Some("write the asset in the scene once more".into());
                return complain("the nodes of an asset are read with the scene, and are not copied with it", help);
            }
            let copied = self.scene.lock().component(other, other_kind).cloned();
            return match copied.filter(|_| other_kind == kind) {
                Some(component) => self.put(component),
                None => complain(format!("expected a {}, found a {}", kind.name(), other_kind.name()), None),
            };
        }
        if let Some(shown) = value.as_bool().ok().filter(|_| kind == Kind::Visible) {
            return self.put(Visible::all(shown).into());
        }
        let owner = format!("{} of {}", kind.name(), self.label());
        let Some(fields) = value.read_lock::<Map>() else {
            let help = Some(format!("write {}: #{{ ... }}", kind.name()));
            return complain(format!("{owner}: expected a map of fields, found {}", describe(&value)), help);
        };
        let mut component = kind.default_component();
        for (field, value) in fields.iter() {
            set_field(component.record_mut(), field, value, &owner)?;
        }
        self.put(component)
    }

    pub(super) fn put(&mut self, component: Component) -> Fallible<()> {
        checked(component.record(), &format!("{} of {}", component.kind().name(), self.label()))?;
        let mut overlay = self.scene.lock();
        known_parent(&overlay, &component)?;
        overlay.put(self.index, component);
        Ok(())
    }
}
