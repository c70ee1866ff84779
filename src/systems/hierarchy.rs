//! Transforms, parents and motion -> placements in the world.

use glam::DAffine3;

use super::references;
use super::stage::{Hierarchy, Stage};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::base::limits;
use crate::components::transform::placement_below;
use crate::components::{Kind, Motion, Transform};

/// Map from an entity's local space to the world; entities without one stand in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement(pub DAffine3);

/// How far the walk over one entity has come.
#[derive(Clone, Copy)]
enum VisitState {
    Waiting,
    /// On the way from a child to its root.
    Open,
    /// Placed; with how many entities there are from its root to it, both included.
    Done(DAffine3, usize),
}

/// Brings placements and references up to date with the edits that were made since.
///
/// # Errors
/// An unknown or removed parent, a cycle of parents, a chain of parents over the limit, an unknown material.
pub fn update(stage: &mut Stage) -> Result<(), Diagnostics> {
    references::update(stage)?;
    let key = stage.placement_key();
    if stage.derived.placements == Some(key) {
        let moved = std::mem::take(&mut stage.derived.moved);
        moved.into_iter().for_each(|index| move_with_children(stage, index));
        return Ok(());
    }
    let mut progress = vec![VisitState::Waiting; stage.entities.len()];
    let mut chain = Vec::new();
    let mut hierarchy = Hierarchy::default();
    for index in 0..stage.entities.len() {
        place(stage, index, &mut progress, &mut chain, &mut hierarchy)?;
    }
    for (index, state) in progress.into_iter().enumerate() {
        let placement = match state {
            VisitState::Done(matrix, _) => Some(matrix),
            VisitState::Waiting | VisitState::Open => None,
        };
        put_placement(stage, index, placement);
    }
    stage.derived.hierarchy = hierarchy;
    stage.derived.moved.clear();
    stage.derived.placements = Some(key);
    Ok(())
}

/// Only what has a transform or is in motion has a placement.
fn put_placement(stage: &mut Stage, index: usize, placement: Option<DAffine3>) {
    let entity = stage.entities[index];
    let is_placed = stage.world.satisfies::<hecs::Or<&Transform, &Motion>>(entity);
    match placement.filter(|_| is_placed) {
        Some(matrix) => {
            if let Ok(mut slot) = stage.world.get::<&mut Placement>(entity) {
                slot.0 = matrix;
                return;
            }
            let _ = stage.world.insert_one(entity, Placement(matrix));
        }
        None => drop(stage.world.remove_one::<Placement>(entity)),
    }
}

/// Places an entity whose numbers changed and not its parent, and all that stand in its space.
///
/// Should one above it have moved as well, that one brings it along when it is its turn.
fn move_with_children(stage: &mut Stage, index: usize) {
    let mut open = vec![index];
    while let Some(index) = open.pop() {
        let parent = stage.derived.hierarchy.parents.get(&index).map(|parent| stage.entities[*parent]);
        let above = parent.and_then(|parent| stage.world.get::<&Placement>(parent).ok().map(|p| p.0));
        let placement = below(stage, index, above.unwrap_or(DAffine3::IDENTITY));
        put_placement(stage, index, Some(placement));
        open.extend(stage.derived.hierarchy.children.get(&index).into_iter().flatten());
    }
}

/// The space of an entity that stands in the space `above`.
fn below(stage: &Stage, index: usize, above: DAffine3) -> DAffine3 {
    let entity = stage.entities[index];
    let (transform, motion) = (stage.world.get::<&Transform>(entity).ok(), stage.world.get::<&Motion>(entity).ok());
    placement_below(above, transform.as_deref(), motion.as_deref(), stage.time)
}

/// Walks from `index` up to the first entity that is placed, then back down.
fn place(
    stage: &Stage,
    index: usize,
    progress: &mut [VisitState],
    chain: &mut Vec<usize>,
    hierarchy: &mut Hierarchy,
) -> Result<(), Diagnostic> {
    chain.clear();
    let mut at = Some(index);
    let (mut matrix, mut above) = (DAffine3::IDENTITY, 0);
    while let Some(here) = at {
        match progress[here] {
            VisitState::Done(known, depth) => {
                (matrix, above) = (known, depth);
                break;
            }
            VisitState::Open => return Err(cycle(stage, chain, here)),
            VisitState::Waiting => {}
        }
        progress[here] = VisitState::Open;
        chain.push(here);
        if chain.len() > limits::HIERARCHY_DEPTH + 1 {
            return Err(too_deep(stage, index));
        }
        at = parent_of(stage, here)?;
        if let Some(parent) = at {
            hierarchy.parents.insert(here, parent);
            hierarchy.children.entry(parent).or_default().push(here);
        }
    }
    // The part of the way that others have gone before counts as well.
    if above + chain.len() > limits::HIERARCHY_DEPTH + 1 {
        return Err(too_deep(stage, index));
    }
    for here in chain.drain(..).rev() {
        matrix = below(stage, here, matrix);
        above += 1;
        progress[here] = VisitState::Done(matrix, above);
    }
    Ok(())
}

fn too_deep(stage: &Stage, index: usize) -> Diagnostic {
    let message = format!("{} has more than {} parents", stage.label(index), limits::HIERARCHY_DEPTH);
    Diagnostic::error(message).about(parent_field(index))
}

fn parent_of(stage: &Stage, index: usize) -> Result<Option<usize>, Diagnostic> {
    let Some(entity) = stage.live(index) else { return Ok(None) };
    let Ok(transform) = stage.world.get::<&Transform>(entity) else { return Ok(None) };
    let Some(parent) = &transform.parent else { return Ok(None) };
    match stage.names.get(parent) {
        Some(found) if stage.live(*found).is_some() => Ok(Some(*found)),
        Some(removed) => {
            let message = format!("the parent `{parent}` of {} was removed", stage.label(index));
            Err(Diagnostic::error(message).about(ScenePart::Entity(*removed)).about(parent_field(index)))
        }
        None => Err(stage.unknown(index, "parent", parent, stage.names.keys())),
    }
}

fn cycle(stage: &Stage, chain: &[usize], back_at: usize) -> Diagnostic {
    let start = chain.iter().position(|i| *i == back_at).unwrap_or(0);
    let names: Vec<String> = chain[start..].iter().chain([&back_at]).map(|i| stage.label(*i)).collect();
    let problem = Diagnostic::error(format!("parents go round in a circle: {}", names.join(" -> ")));
    chain[start..].iter().fold(problem, |problem, index| problem.about(parent_field(*index)))
}

/// Where an entity names its parent.
fn parent_field(index: usize) -> Subject {
    Subject { part: ScenePart::Entity(index), component: Some(Kind::Transform.name()), field: Some("parent") }
}
