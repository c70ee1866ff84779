//! Where the entities of a scene stand, without a World.

use glam::DAffine3;
use rustc_hash::FxHashMap;

use crate::components::transform::world_placement;
use crate::components::*;

/// The shapes that an entity carries.
pub(super) fn shapes_of(desc: &EntityDesc) -> impl Iterator<Item = &dyn Shape> {
    Kind::ALL.iter().filter_map(|kind| desc.get(*kind)?.shape())
}

/// Where the entities of a scene stand at the time 0 of the shutter.
pub(super) struct Placements<'a> {
    scene: &'a Scene,
    by_name: FxHashMap<&'a str, usize>,
}

impl<'a> Placements<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let named = |(index, desc): (usize, &'a EntityDesc)| desc.name.as_deref().map(|name| (name, index));
        Placements { scene, by_name: scene.entities.iter().enumerate().filter_map(named).collect() }
    }

    /// The camera, where the entity is that carries it, if one does.
    pub(super) fn camera(&self) -> Camera {
        let camera = self.scene.camera.clone();
        let carrier = camera.entity.as_deref().and_then(|name| self.by_name.get(name));
        let Some(index) = carrier else { return camera };
        let viewpoint = self.scene.entities[*index].get(Kind::Viewpoint).and_then(Viewpoint::of);
        camera.carried(&self.of(*index), viewpoint)
    }

    pub(super) fn of(&self, index: usize) -> DAffine3 {
        let entities = &self.scene.entities;
        world_placement(
            index,
            |index| entities[index].get(Kind::Transform).and_then(Transform::of),
            |index| entities[index].get(Kind::Motion).and_then(Motion::of),
            |name| self.by_name.get(name).copied(),
            0.0,
        )
    }
}
