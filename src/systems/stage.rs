//! The World, the authored order of what is in it, and what is kept between frames.

use std::sync::Arc;

use hecs::{Entity, EntityBuilder, World};
use rustc_hash::FxHashMap;

use super::previous_frame::PreviousFrame;
use crate::base::diagnostics::{Diagnostic, ScenePart, Subject};
use crate::base::project::Folder;
use crate::components::entity::every_kind;
use crate::components::*;
use crate::trace::accel::Accelerator;
use crate::trace::light::environment::Environment;
use crate::trace::primitive::Geometry;

/// Position of an entity in the authored order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct AuthoredIndex(pub u32);

/// The name of an entity or of a material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(pub Text);

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tags(pub Vec<Text>);

/// Marks an entity that a frame has removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Despawned;

/// The World and what goes with it.
///
/// Camera, settings and materials are entities too; here is where they are.
pub struct Stage {
    pub(super) world: World,
    /// Entities in authored order.
    pub(super) entities: Vec<Entity>,
    /// Material entities in authored order: their index is the material's number.
    pub(super) materials: Vec<Entity>,
    pub(super) camera: Entity,
    pub(super) settings: Entity,
    /// Authored index by name.
    pub(super) names: FxHashMap<Text, usize>,
    pub(super) material_names: FxHashMap<Text, usize>,
    pub(super) base: Folder,
    /// The time that entities with `motion` go by, in the units of the camera's shutter.
    pub(super) time: f64,
    /// This World in the frame before, if motion is one of the layers.
    pub(super) previous: Option<PreviousFrame>,
    /// Frames that are still to be rendered of this World at most, the next one included.
    pub(super) frames_left: u32,
    pub(super) derived: DerivedCache,
}

/// What is derived from the World and outlives a frame, with marks of what an edit may have made stale.
#[derive(Default)]
pub(super) struct DerivedCache {
    pub geometry: Arc<Geometry>,
    pub accelerator: Option<(AccelKey, Accelerator)>,
    /// Rays that were expected to be traced with it so far, since it was built anew and not only refitted.
    pub served: f64,
    /// The environment that was used last, by its file and whether its values were decoded to linear light.
    pub environment: Option<((Text, bool), Environment)>,
    /// Images that were read for textures.
    pub images: ImageCache,
    /// Placements may be out of date.
    pub stale_hierarchy: bool,
    /// Authored indices of the entities that stand in the space of another, by that one.
    pub children: FxHashMap<usize, Vec<usize>>,
    /// Entities whose transforms changed and whose parents did not: they and their children may be out of place.
    pub moved: Vec<usize>,
    /// Materials that entities name may not exist.
    pub stale_materials: bool,
    /// Columns of primitives may be out of date.
    pub stale_geometry: bool,
}

/// The settings that an accelerator was built with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AccelKey {
    pub choice: Accel,
    pub density: f64,
}

impl Stage {
    pub fn camera(&self) -> Camera {
        copy(&self.world, self.camera)
    }

    pub fn settings(&self) -> Render {
        copy(&self.world, self.settings)
    }

    /// Sets the time that entities with `motion` go by, in the units of the camera's shutter.
    pub fn set_time(&mut self, time: f64) {
        if self.time != time && self.world.query::<&Motion>().iter().next().is_some() {
            self.derived.stale_hierarchy = true;
            self.derived.stale_geometry = true;
        }
        self.time = time;
    }

    /// Sets how many frames are still to be rendered of this World at most, the next one included; it is 1 otherwise. Only
    /// what they cost depends on it.
    pub fn set_frames_left(&mut self, frames_left: u32) {
        self.frames_left = frames_left;
    }

    /// Sets what this World was in the frame before.
    pub fn set_previous_frame(&mut self, previous: Option<PreviousFrame>) {
        self.previous = previous;
    }

    /// Number of entities, those included that a frame has removed.
    pub fn entity_count(&self) -> usize {
        self.entities.len()
    }

    /// The entity of an authored index, unless it was removed.
    pub(super) fn live(&self, index: usize) -> Option<Entity> {
        let entity = *self.entities.get(index)?;
        self.world.get::<&Despawned>(entity).is_err().then_some(entity)
    }

    /// What a message calls the entity.
    pub(super) fn label(&self, index: usize) -> String {
        let named = self.entities.get(index).and_then(|e| self.world.get::<&Name>(*e).ok());
        match named {
            Some(name) => format!("entity `{}`", name.0),
            None => format!("entity {}", index + 1),
        }
    }

    /// An error about an entity, with the nearest of the known names.
    pub(super) fn unknown<'a>(
        &self,
        index: usize,
        what: &str,
        name: &str,
        known: impl Iterator<Item = &'a Text>,
    ) -> Diagnostic {
        let component = if what == "parent" { Kind::Transform } else { Kind::MaterialName };
        let field = (what == "parent").then_some("parent");
        let subject = Subject { part: ScenePart::Entity(index), component: Some(component.name()), field };
        Diagnostic::error(format!("unknown {what} `{name}` of {}", self.label(index)))
            .about(subject)
            .suggest(name, known.map(|text| &**text))
    }
}

fn copy<T: hecs::Component + Clone + Default>(world: &World, entity: Entity) -> T {
    world.get::<&T>(entity).map(|c| (*c).clone()).unwrap_or_default()
}

/// Writes the four ways of reaching a component by its kind, once for all kinds.
macro_rules! storage {
    ($($name:ident : $variant:ident),* $(,)?) => {
        pub(super) fn add(builder: &mut EntityBuilder, component: Component) {
            match component { $( Component::$variant(c) => { builder.add(c); } )* }
        }

        /// Adds or replaces a component; gives back the old one. The entity must be alive.
        pub(super) fn put(world: &mut World, entity: Entity, component: Component) -> Option<Component> {
            match component { $( Component::$variant(c) => {
                if let Ok(mut slot) = world.get::<&mut $variant>(entity) {
                    return Some(std::mem::replace(&mut *slot, c).into());
                }
                // Only a dead entity refuses, and a dead one was answered before.
                let _ = world.insert_one(entity, c);
                None
            } )* }
        }

        pub(super) fn take(world: &mut World, entity: Entity, kind: Kind) -> Option<Component> {
            match kind { $( Kind::$variant => world.remove_one::<$variant>(entity).ok().map(Component::from), )* }
        }

        pub(super) fn get(world: &World, entity: Entity, kind: Kind) -> Option<Component> {
            match kind { $( Kind::$variant => world.get::<&$variant>(entity).ok().map(|c| (*c).clone().into()), )* }
        }
    };
}
every_kind!(storage);
