//! Transforms, parents and motion -> placements in the world.

use glam::DAffine3;

use super::stage::Stage;
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::components::{Motion, Transform};

/// Map from an entity's local space to the world; entities without one stand in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement(pub DAffine3);

/// How far the walk over one entity has come.
#[derive(Clone, Copy)]
enum Progress {
    Waiting,
    /// On the way from a child to its root.
    Open,
    Done(DAffine3),
}

/// Brings the placement of every entity with a transform or in motion up to date, if an edit may have changed one.
///
/// # Errors
/// An unknown or removed parent, a cycle of parents, a chain of parents over the limit.
pub fn update(stage: &mut Stage) -> Result<(), Diagnostics> {
    if !stage.kept.stale_hierarchy {
        return Ok(());
    }
    let mut progress = vec![Progress::Waiting; stage.entities.len()];
    let mut chain = Vec::new();
    for index in 0..stage.entities.len() {
        place(stage, index, &mut progress, &mut chain)?;
    }
    for (index, state) in progress.into_iter().enumerate() {
        let entity = stage.entities[index];
        let is_placed = stage.world.satisfies::<hecs::Or<&Transform, &Motion>>(entity);
        match state {
            Progress::Done(matrix) if is_placed => {
                if let Ok(mut slot) = stage.world.get::<&mut Placement>(entity) {
                    slot.0 = matrix;
                    continue;
                }
                let _ = stage.world.insert_one(entity, Placement(matrix));
            }
            _ => drop(stage.world.remove_one::<Placement>(entity)),
        }
    }
    stage.kept.stale_hierarchy = false;
    Ok(())
}

/// Walks from `index` up to the first entity that is placed, then back down.
fn place(stage: &Stage, index: usize, progress: &mut [Progress], chain: &mut Vec<usize>) -> Result<(), Diagnostic> {
    chain.clear();
    let mut at = Some(index);
    let mut matrix = DAffine3::IDENTITY;
    while let Some(here) = at {
        match progress[here] {
            Progress::Done(known) => {
                matrix = known;
                break;
            }
            Progress::Open => return Err(cycle(stage, chain, here)),
            Progress::Waiting => {}
        }
        progress[here] = Progress::Open;
        chain.push(here);
        if chain.len() > limits::HIERARCHY_DEPTH {
            let message = format!("{} has more than {} parents", stage.label(index), limits::HIERARCHY_DEPTH);
            return Err(Diagnostic::error(message));
        }
        at = parent_of(stage, here)?;
    }
    for here in chain.drain(..).rev() {
        if let Ok(transform) = stage.world.get::<&Transform>(stage.entities[here]) {
            matrix *= transform.matrix();
        }
        if let Ok(motion) = stage.world.get::<&Motion>(stage.entities[here]) {
            matrix.translation += motion.at(stage.time);
        }
        progress[here] = Progress::Done(matrix);
    }
    Ok(())
}

fn parent_of(stage: &Stage, index: usize) -> Result<Option<usize>, Diagnostic> {
    let Some(entity) = stage.live(index) else { return Ok(None) };
    let Ok(transform) = stage.world.get::<&Transform>(entity) else { return Ok(None) };
    let Some(parent) = &transform.parent else { return Ok(None) };
    match stage.names.get(parent) {
        Some(found) if stage.live(*found).is_some() => Ok(Some(*found)),
        Some(_) => Err(Diagnostic::error(format!("the parent `{parent}` of {} was removed", stage.label(index)))),
        None => Err(stage.unknown(index, "parent", parent, stage.names.keys())),
    }
}

fn cycle(stage: &Stage, chain: &[usize], back_at: usize) -> Diagnostic {
    let start = chain.iter().position(|i| *i == back_at).unwrap_or(0);
    let names: Vec<String> = chain[start..].iter().chain([&back_at]).map(|i| stage.label(*i)).collect();
    Diagnostic::error(format!("parents go round in a circle: {}", names.join(" -> ")))
}
