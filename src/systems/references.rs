//! Names of materials -> numbers, when they change and not in every frame.

use super::stage::{MaterialIndex, Stage};
use crate::base::diagnostics::Diagnostic;
use crate::components::MaterialName;

/// Looks up the materials of all entities whose material names changed.
///
/// # Errors
/// The first entity whose material has no definition, with the nearest name.
pub fn update(stage: &mut Stage) -> Result<(), Diagnostic> {
    let unresolved = std::mem::take(&mut stage.derived.unresolved);
    let outcome = unresolved.iter().try_for_each(|index| resolve(stage, *index));
    if outcome.is_err() {
        // Edits that are taken back change names again; what they leave is looked up then.
        stage.derived.unresolved = unresolved;
    }
    outcome
}

fn resolve(stage: &mut Stage, index: usize) -> Result<(), Diagnostic> {
    // An entity that was spawned and taken back is gone.
    let Some(entity) = stage.entities.get(index).copied() else { return Ok(()) };
    let name = stage.world.get::<&MaterialName>(entity).ok().map(|name| name.0.clone());
    let Some(name) = name else {
        let _ = stage.world.remove_one::<MaterialIndex>(entity);
        return Ok(());
    };
    let Some(number) = stage.material_names.get(&name) else {
        return Err(stage.unknown(index, "material", &name, stage.material_names.keys()));
    };
    let number = MaterialIndex(*number as u32);
    if let Ok(mut known) = stage.world.get::<&mut MaterialIndex>(entity) {
        *known = number;
        return Ok(());
    }
    // A living entity takes any component.
    let _ = stage.world.insert_one(entity, number);
    Ok(())
}
