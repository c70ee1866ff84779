//! The World, the authored order of what is in it, and what is kept between frames.

use std::sync::{Arc, Weak};

use hecs::{Entity, EntityBuilder, World};
use rustc_hash::FxHashMap;

use super::origin::render_origin;
use super::previous_frame::PreviousFrame;
use crate::base::diagnostics::{Diagnostic, ScenePart, Subject};
use crate::base::project::Folder;
use crate::components::entity::every_kind;
use crate::components::*;
use crate::trace::accel::Accelerator;
use crate::trace::light::environment::{Environment, EnvironmentMap};
use crate::trace::primitive::Geometry;

/// Position of an entity in the authored order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct AuthoredIndex(pub u32);

/// The name of an entity or of a material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(pub Text);

/// Beside the camera of the World: those that may take its place.
pub(super) struct NamedCameras(pub Vec<(Text, Camera)>);

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tags(pub Vec<Text>);

/// Marks an entity that a frame has removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Despawned;

/// The number of an entity's material; entities without one have the default material.
///
/// It follows from the entity's [`MaterialName`] and is kept up to date by [`super::references`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialIndex(pub u32);

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
    pub(super) files: LoadedFiles,
    pub(super) revisions: Revisions,
    pub(super) derived: DerivedCache,
}

/// What was read of the files that the World names; nothing is read while it is rendered.
#[derive(Clone, Default)]
pub struct LoadedFiles {
    /// Images of textures, and of environments that are one image.
    pub images: ImageCache,
    /// The environment that was read last.
    pub environment: Option<(EnvironmentKey, EnvironmentMap)>,
}

/// An environment's file, and whether its values were decoded to linear light.
pub type EnvironmentKey = (Text, bool);

/// Numbers that change with what they are named after: what is derived from the World is kept with the number that it
/// was derived at, and is up to date while that is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Revisions {
    /// Which entities there are, their parents and motions.
    pub hierarchy: u64,
    /// Transforms of entities.
    pub transforms: u64,
    /// Shapes, which materials they have, and which sides those show.
    pub shapes: u64,
}

/// What placements are derived from: the number of the hierarchy, and the time if anything is in motion.
pub(super) type PlacementKey = (u64, Option<u64>);

/// What columns of primitives are derived from, and the origin of the space that they are in.
pub(super) type GeometryKey = (PlacementKey, Revisions, [u64; 3]);

/// What is derived from the World and outlives a frame, each with what it was derived from.
#[derive(Default)]
pub(super) struct DerivedCache {
    /// What the placements in the World were derived from, but for transforms that `moved`.
    pub placements: Option<PlacementKey>,
    pub hierarchy: Hierarchy,
    /// Entities whose transforms changed since and whose parents did not.
    pub moved: Vec<usize>,
    /// Entities whose material names changed since their material numbers were looked up.
    pub unresolved: Vec<usize>,
    pub geometry: Option<(GeometryKey, Arc<Geometry>)>,
    /// One for each set of primitives that some rays do not meet.
    pub accelerators: Vec<BuiltAccelerator>,
    /// The environment that was prepared last.
    pub environment: Option<(EnvironmentKey, Environment)>,
    /// The clear sky that was worked out last.
    pub daylight: Option<(Daylight, Environment)>,
}

/// Who stands in the space of whom, by authored index.
#[derive(Default)]
pub(super) struct Hierarchy {
    pub parents: FxHashMap<usize, usize>,
    pub children: FxHashMap<usize, Vec<usize>>,
}

/// An accelerator with what it was built from.
pub(super) struct BuiltAccelerator {
    /// The columns; they are not kept for it.
    pub geometry: Weak<Geometry>,
    pub key: AccelKey,
    pub accelerator: Arc<Accelerator>,
    /// Rays that were expected to be traced with it so far, since it was built anew and not only refitted.
    pub served: f64,
}

/// The settings that an accelerator was built with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AccelKey {
    pub choice: Accel,
    pub density: f64,
}

impl Stage {
    /// The camera, as edits left it.
    pub fn camera(&self) -> Camera {
        copy(&self.world, self.camera)
    }

    /// The cameras that may be chosen, by name.
    pub fn named_cameras(&self) -> Vec<(Text, Camera)> {
        self.world.get::<&NamedCameras>(self.camera).map(|all| all.0.clone()).unwrap_or_default()
    }

    /// Settings of the picture, as edits left them.
    pub fn settings(&self) -> Render {
        copy(&self.world, self.settings)
    }

    /// The folder that file names in the scene are relative to.
    pub fn base(&self) -> &Folder {
        &self.base
    }

    /// What was read of the files that the World names.
    pub fn files_mut(&mut self) -> &mut LoadedFiles {
        &mut self.files
    }

    /// Sets the time that entities with `motion` go by, in the units of the camera's shutter.
    pub fn set_time(&mut self, time: f64) {
        self.time = time;
    }

    /// What placements follow from, as the World stands.
    pub(super) fn placement_key(&self) -> PlacementKey {
        let moves = self.world.query::<&Motion>().iter().next().is_some();
        (self.revisions.hierarchy, moves.then_some(self.time.to_bits()))
    }

    /// What columns of primitives follow from, as the World stands.
    pub(super) fn geometry_key(&self) -> GeometryKey {
        (self.placement_key(), self.revisions, render_origin(self).to_array().map(f64::to_bits))
    }

    /// Sets how many frames are still to be rendered of this World at most, the next one included; it is 1 otherwise. Only
    /// what they cost depends on it.
    pub fn set_frames_left(&mut self, frames_left: u32) {
        self.frames_left = frames_left;
    }

    /// Takes over what was derived from the World of the same shot before it was edited and opened anew, and what was
    /// read of files if `keeps_files`. Columns are compared with those that the new World gives, and accelerators go by
    /// the columns that they were built over.
    pub fn adopt(&mut self, before: Stage, keeps_files: bool) {
        let DerivedCache { geometry, accelerators, environment, daylight, .. } = before.derived;
        // The numbers of another World say nothing of this one: no World counts as far as this.
        let unknown = Revisions { hierarchy: u64::MAX, transforms: u64::MAX, shapes: u64::MAX };
        self.derived.geometry =
            geometry.map(|((placements, _, origin), columns)| ((placements, unknown, origin), columns));
        self.derived.accelerators = accelerators;
        self.derived.daylight = daylight;
        if keeps_files {
            self.derived.environment = environment;
            self.files = before.files;
        }
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

    /// Calls for every entity that has what `Q` asks for, in authored order.
    pub(super) fn for_each_in_order<Q: hecs::Query>(
        &self,
        mut call: impl FnMut(usize, Q::Item<'_>) -> Result<(), Diagnostic>,
    ) -> Result<(), Diagnostic> {
        let mut query = self.world.query::<(&AuthoredIndex, Q)>().without::<&Despawned>();
        let mut found: Vec<_> = query.iter().collect();
        found.sort_by_key(|(order, _)| **order);
        found.into_iter().try_for_each(|(order, item)| call(order.0 as usize, item))
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
    ($($name:ident : $variant:ident is $role:ident),* $(,)?) => {
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
