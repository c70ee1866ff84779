//! Scene data -> World.

use hecs::{EntityBuilder, World};

use super::hierarchy;
use super::stage::{
    AuthoredIndex, DerivedCache, LoadedFiles, MaterialIndex, Name, NamedCameras, Revisions, Stage, Tags, add,
};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::base::limits;
use crate::components::*;

/// Fills a World from a scene whose values are in range, as `load` and [`super::animate`] see to.
///
/// # Errors
/// Diagnostics that name the entity: a name given twice, an unknown material or parent, a cycle of parents.
pub fn spawn(scene: Scene) -> Result<Stage, Diagnostics> {
    let mut world = World::new();
    let camera = world.spawn((scene.camera, NamedCameras(scene.cameras)));
    let settings = world.spawn((scene.render,));
    let mut stage = Stage {
        world,
        entities: Vec::with_capacity(scene.entities.len()),
        materials: Vec::with_capacity(scene.materials.len()),
        camera,
        settings,
        names: Default::default(),
        material_names: Default::default(),
        base: scene.base,
        time: 0.0,
        previous: None,
        frames_left: 1,
        files: LoadedFiles { images: scene.images, environment: None },
        revisions: Revisions::default(),
        derived: DerivedCache::default(),
    };
    for (name, material) in scene.materials {
        add_material(&mut stage, name, material)?;
    }
    let mut builder = EntityBuilder::new();
    for desc in scene.entities {
        spawn_entity(&mut stage, &mut builder, desc)?;
    }
    hierarchy::update(&mut stage)?;
    Ok(stage)
}

pub(super) fn add_material(stage: &mut Stage, name: Text, material: Material) -> Result<(), Diagnostic> {
    let index = stage.materials.len();
    if index >= limits::MATERIALS {
        return Err(Diagnostic::error(format!("more than {} materials", limits::MATERIALS)));
    }
    if stage.material_names.insert(name.clone(), index).is_some() {
        return Err(Diagnostic::error(format!("two materials are called `{name}`")));
    }
    let entity = stage.world.spawn((Name(name), material));
    stage.materials.push(entity);
    Ok(())
}

pub(super) fn spawn_entity(
    stage: &mut Stage,
    builder: &mut EntityBuilder,
    mut desc: EntityDesc,
) -> Result<(), Diagnostic> {
    let index = stage.entities.len();
    if index >= limits::ENTITIES {
        return Err(Diagnostic::error(format!("more than {} entities", limits::ENTITIES)));
    }
    builder.add(AuthoredIndex(index as u32));
    if let Some(name) = desc.name.take() {
        if stage.names.insert(name.clone(), index).is_some() {
            return Err(Diagnostic::error(format!("two entities are called `{name}`")));
        }
        builder.add(Name(name));
    }
    if !desc.tags.is_empty() {
        builder.add(Tags(std::mem::take(&mut desc.tags)));
    }
    if let Some(name) = desc.component::<MaterialName>() {
        match stage.material_names.get(&name.0) {
            Some(number) => drop(builder.add(MaterialIndex(*number as u32))),
            // It may be added later.
            None => stage.derived.unresolved.push(index),
        }
    }
    for component in desc.into_components() {
        add(builder, component);
    }
    let entity = stage.world.spawn(builder.build());
    stage.entities.push(entity);
    Ok(())
}

/// A failed range check, with the entity that it belongs to.
pub(super) fn invalid(owner: &str, kind: &str, problem: Invalid, part: ScenePart) -> Diagnostic {
    let component = Kind::parse(kind).map(Kind::name).filter(|_| matches!(part, ScenePart::Entity(_)));
    let subject = Subject { part, component, field: Some(problem.field) };
    Diagnostic::error(format!("{owner}: {kind}: {}", problem.message)).about(subject)
}
