//! Scene data -> World.

use hecs::{EntityBuilder, World};

use super::stage::{Kept, Name, Order, Stage, Tags, add};
use super::{extract, hierarchy};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::components::*;

/// Fills a World from a scene and checks what the systems rely on.
///
/// # Errors
/// Diagnostics that name the entity: a component out of range, an unknown material or parent, a cycle of parents.
pub fn spawn(scene: Scene) -> Result<Stage, Diagnostics> {
    let mut world = World::new();
    let camera = world.spawn((scene.camera,));
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
        kept: Kept { stale_hierarchy: true, stale_geometry: true, ..Kept::default() },
    };
    for (name, material) in scene.materials {
        add_material(&mut stage, name, material)?;
    }
    let mut builder = EntityBuilder::new();
    for bag in scene.entities {
        spawn_bag(&mut stage, &mut builder, bag)?;
    }
    check_all(&stage)?;
    hierarchy::update(&mut stage)?;
    extract::check_materials(&stage)?;
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

pub(super) fn spawn_bag(stage: &mut Stage, builder: &mut EntityBuilder, mut bag: Bag) -> Result<(), Diagnostic> {
    let index = stage.entities.len();
    if index >= limits::ENTITIES {
        return Err(Diagnostic::error(format!("more than {} entities", limits::ENTITIES)));
    }
    builder.add(Order(index as u32));
    if let Some(name) = bag.name.take() {
        if stage.names.insert(name.clone(), index).is_some() {
            return Err(Diagnostic::error(format!("two entities are called `{name}`")));
        }
        builder.add(Name(name));
    }
    if !bag.tags.is_empty() {
        builder.add(Tags(std::mem::take(&mut bag.tags)));
    }
    for component in bag.into_components() {
        add(builder, component);
    }
    let entity = stage.world.spawn(builder.build());
    stage.entities.push(entity);
    Ok(())
}

/// A failed range check, with the entity that it belongs to.
pub(super) fn invalid(owner: &str, kind: &str, problem: Invalid) -> Diagnostic {
    Diagnostic::error(format!("{owner}: {kind}: {}", problem.message))
}

fn check_all(stage: &Stage) -> Result<(), Diagnostics> {
    stage.camera().check().map_err(|e| invalid("the scene", "camera", e))?;
    stage.settings().check().map_err(|e| invalid("the scene", "render", e))?;
    for entity in &stage.materials {
        let mut query = stage.world.query_one::<(&Name, &Material)>(*entity);
        if let Ok((name, material)) = query.get() {
            Check::check(material).map_err(|e| invalid(&format!("material `{}`", name.0), "material", e))?;
        }
    }
    macro_rules! check_kinds {
        ($($name:ident : $variant:ident),* $(,)?) => { $(
            for (order, component) in stage.world.query::<(&Order, &$variant)>().iter() {
                Check::check(component)
                    .map_err(|e| invalid(&stage.label(order.0 as usize), stringify!($name), e))?;
            }
        )* };
    }
    crate::components::entity::every_kind!(check_kinds);
    Ok(())
}
