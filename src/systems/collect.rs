//! World -> scene data: the inverse of `spawn`, for writing scenes and for showing them to scripts.

use super::stage::{Name, Stage, Tags, get};
use crate::components::*;

/// The World as a scene; entities that were removed are left out.
pub fn collect(stage: &Stage) -> Scene {
    let world = &stage.world;
    let material = |entity: &hecs::Entity| {
        let mut query = world.query_one::<(&Name, &Material)>(*entity);
        query.get().ok().map(|(name, material)| (name.0.clone(), material.clone()))
    };
    let desc = |index: usize| {
        let entity = stage.live(index)?;
        let mut desc = EntityDesc::new(Kind::ALL.iter().filter_map(|kind| get(world, entity, *kind)));
        desc.name = world.get::<&Name>(entity).ok().map(|name| name.0.clone());
        desc.tags = world.get::<&Tags>(entity).map(|tags| tags.0.clone()).unwrap_or_default();
        Some(desc)
    };
    Scene {
        camera: stage.camera(),
        cameras: stage.named_cameras(),
        render: stage.settings(),
        materials: stage.materials.iter().filter_map(material).collect(),
        entities: (0..stage.entities.len()).filter_map(desc).collect(),
        base: stage.base.clone(),
        images: stage.files.images.clone(),
    }
}
