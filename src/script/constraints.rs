//! Constraints: what an entity does by another one, evaluated when the function of the script has ended.
//!
//! They hold for the call that they are made in: in `frame` for that frame, in `setup` for what all frames start from. An
//! entity is placed after all that it depends on, so that the order in which a script says things does not matter.

use std::sync::{Arc, Mutex, PoisonError};

use ::rhai::{Dynamic, Map, NativeCallContext, Position};
use glam::{DAffine3, DMat3, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};

use super::convert::{describe, is_vector, number, vector};
use super::errors::{Fallible, complain};
use super::handles::{EntityHandle, SceneHandle};
use super::paths::PathHandle;
use super::table::{Chapter, Function};
use super::world::{ancestry, parent_of, placement};
use crate::base::limits;
use crate::base::math::{decompose, euler_degrees, look_at_degrees, rotation_matrix};
use crate::components::transform::Scale;
use crate::components::{AreaLight, ComponentType, Transform};

/// What a constraint follows.
#[derive(Clone, Copy, Debug)]
enum ConstraintTarget {
    Point(DVec3),
    Entity(usize),
}

/// What a constraint does to an entity.
#[derive(Clone, Copy, Debug)]
enum ConstraintKind {
    /// Its face is turned towards the target.
    LookAt { up: DVec3 },
    /// It is turned about its own y axis alone.
    Track,
    /// It stands where the target stands, turned and scaled alike.
    Copy,
}

#[derive(Clone, Copy, Debug)]
struct Constraint {
    entity: usize,
    target: ConstraintTarget,
    kind: ConstraintKind,
    /// Where the script says so.
    at: Position,
}

/// The constraints of one call, in the order in which the script makes them.
#[derive(Clone, Default)]
pub struct Constraints(Arc<Mutex<Vec<Constraint>>>);

/// How far the evaluation of an entity is.
#[derive(Clone, Copy, PartialEq)]
enum Visit {
    Begun,
    Done,
}

fn target_of(scene: &SceneHandle, target: &Dynamic) -> Fallible<ConstraintTarget> {
    if is_vector(target) {
        return Ok(ConstraintTarget::Point(vector(target)?));
    }
    if let Some(entity) = target.clone().try_cast::<EntityHandle>() {
        entity.alive()?;
        return Ok(ConstraintTarget::Entity(entity.index));
    }
    if target.is_string() {
        return Ok(ConstraintTarget::Entity(scene.clone().get(&target.to_string())?.index));
    }
    complain(format!("expected an entity, its name or a point, found {}", describe(target)), None)
}

fn add(context: &NativeCallContext, entity: &EntityHandle, target: &Dynamic, kind: ConstraintKind) -> Fallible<()> {
    entity.alive()?;
    let target = target_of(&entity.scene, target)?;
    let mut all = entity.scene.constraints.0.lock().unwrap_or_else(PoisonError::into_inner);
    if all.len() >= limits::ENTITIES {
        return complain(format!("more than {} constraints", limits::ENTITIES), None);
    }
    all.push(Constraint { entity: entity.index, target, kind, at: context.call_position() });
    Ok(())
}

/// Places every constrained entity after what it depends on.
///
/// # Errors
/// A circle of constraints, and places that no transform gives, at the constraint.
pub fn resolve(scene: &SceneHandle) -> Fallible<()> {
    let all = std::mem::take(&mut *scene.constraints.0.lock().unwrap_or_else(PoisonError::into_inner));
    if all.is_empty() {
        return Ok(());
    }
    let mut of_entity: FxHashMap<usize, Vec<Constraint>> = FxHashMap::default();
    all.iter().for_each(|constraint| of_entity.entry(constraint.entity).or_default().push(*constraint));
    let mut progress = FxHashMap::default();
    all.iter().try_for_each(|constraint| visit(scene, constraint.entity, &of_entity, &mut progress))
}

/// Evaluates the constraints of an entity, and before them those of all that it depends on. The chain of constraints is
/// walked with a stack of its own, for it may be as long as there are entities.
fn visit(
    scene: &SceneHandle,
    entity: usize,
    of_entity: &FxHashMap<usize, Vec<Constraint>>,
    progress: &mut FxHashMap<usize, Visit>,
) -> Fallible<()> {
    let mut stack = vec![entity];
    while let Some(&entity) = stack.last() {
        let constraints = of_entity.get(&entity).map_or(&[][..], Vec::as_slice);
        match progress.get(&entity) {
            Some(Visit::Done) => {
                stack.pop();
                continue;
            }
            Some(Visit::Begun) => {
                stack.pop();
                progress.insert(entity, Visit::Done);
                for constraint in constraints {
                    apply(scene, constraint).map_err(|error| placed(error, constraint.at))?;
                }
                continue;
            }
            None => {}
        }
        progress.insert(entity, Visit::Begun);
        for constraint in constraints {
            for needed in dependences(scene, constraint) {
                match progress.get(&needed) {
                    Some(Visit::Begun) => return circle(scene, constraint, needed),
                    Some(Visit::Done) => {}
                    None if of_entity.contains_key(&needed) => stack.push(needed),
                    None => {}
                }
            }
        }
    }
    Ok(())
}

/// What must stand before a constraint is evaluated: the target, and what it and the entity stand in.
fn dependences(scene: &SceneHandle, constraint: &Constraint) -> Vec<usize> {
    let overlay = scene.lock();
    let mut all = ancestry(&overlay, constraint.entity);
    all.remove(0);
    if let ConstraintTarget::Entity(target) = constraint.target {
        all.extend(ancestry(&overlay, target));
    }
    let mut seen = FxHashSet::default();
    all.retain(|entity| seen.insert(*entity));
    all
}

fn circle(scene: &SceneHandle, constraint: &Constraint, needed: usize) -> Fallible<()> {
    let overlay = scene.lock();
    let message = if needed == constraint.entity {
        format!(
            "{} would have to stand before itself: it is, or stands in, what its constraint follows",
            overlay.label(needed)
        )
    } else {
        let (one, other) = (overlay.label(constraint.entity), overlay.label(needed));
        format!("constraints go round in a circle: {one} is placed by {other}, and {other} by {one}")
    };
    complain(message, None).map_err(|error| placed(error, constraint.at))
}

fn placed(mut error: Box<::rhai::EvalAltResult>, at: Position) -> Box<::rhai::EvalAltResult> {
    if error.position().is_none() {
        error.set_position(at);
    }
    error
}

fn apply(scene: &SceneHandle, constraint: &Constraint) -> Fallible<()> {
    let mut entity = scene.entity(constraint.entity);
    let (above, target) = {
        let overlay = scene.lock();
        if overlay.is_gone(constraint.entity) {
            return Ok(());
        }
        let above = parent_of(&overlay, constraint.entity)
            .map_or(DAffine3::IDENTITY, |parent| placement(&overlay, parent, scene.time));
        let target = match constraint.target {
            ConstraintTarget::Point(point) => DAffine3::from_translation(point),
            ConstraintTarget::Entity(target) if overlay.is_gone(target) => {
                return complain(format!("{} was removed", overlay.label(target)), None);
            }
            ConstraintTarget::Entity(target) => placement(&overlay, target, scene.time),
        };
        (above, target)
    };
    let mut transform = entity.transform();
    if transform.matrix.is_some() {
        // A map that is given whole is taken apart, so that it can be turned.
        let map = transform.matrix();
        set_map(&mut transform, map);
        if transform.matrix.is_some() && !matches!(constraint.kind, ConstraintKind::Copy) {
            return complain(format!("{} has a `matrix` that shears: it cannot be turned alone", entity.label()), None);
        }
    }
    match constraint.kind {
        ConstraintKind::Copy => {
            set_map(&mut transform, above.inverse() * target);
        }
        ConstraintKind::LookAt { up } => {
            let at = above.inverse().transform_point3(target.translation);
            let up = above.inverse().transform_vector3(up);
            let turned = look_at_degrees(transform.translation, at, up);
            transform.rotation = if has_a_face(&entity) { face_down(turned) } else { turned };
        }
        ConstraintKind::Track => {
            let at = above.inverse().transform_point3(target.translation) - transform.translation;
            if at.x != 0.0 || at.z != 0.0 {
                transform.rotation.y = libm::atan2(-at.x, -at.z).to_degrees();
            }
        }
    }
    entity.put(transform.into())
}

/// Whether the entity is an area light, which shines along -y where other things look along -z.
fn has_a_face(entity: &EntityHandle) -> bool {
    entity.scene.lock().component(entity.index, AreaLight::KIND).is_some()
}

/// Turns -y to where -z is.
fn face_down(rotation: DVec3) -> DVec3 {
    let m = rotation_matrix(rotation);
    euler_degrees(DMat3::from_cols(m.x_axis, m.z_axis, -m.y_axis))
}

/// Makes an entity stand in another one's space without moving it.
fn attach(entity: &mut EntityHandle, target: &Dynamic) -> Fallible<()> {
    entity.alive()?;
    let ConstraintTarget::Entity(index) = target_of(&entity.scene, target)? else {
        return complain("an entity is attached to an entity, not to a point", None);
    };
    let (name, above, is_below) = {
        let overlay = entity.scene.lock();
        let is_below = ancestry(&overlay, index).contains(&entity.index);
        (overlay.name(index), placement(&overlay, index, entity.scene.time), is_below)
    };
    let label = entity.scene.entity(index).label();
    if is_below {
        return complain(format!("{} cannot be attached to {label}, which stands in its space", entity.label()), None);
    }
    let Some(name) = name else {
        return complain(format!("{label} needs a name for others to be attached to it"), None);
    };
    let mut transform = Transform { parent: Some(name), ..Transform::default() };
    set_map(&mut transform, above.inverse() * entity.placement());
    entity.put(transform.into())
}

/// Makes a transform stand for a map: by translation, rotation and scale, or by its matrix where these cannot give it.
fn set_map(transform: &mut Transform, map: DAffine3) {
    match decompose(&map) {
        Some((translation, rotation, scale)) => {
            (transform.translation, transform.rotation, transform.scale) = (translation, rotation, Scale(scale));
            transform.matrix = None;
        }
        None => {
            let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
            transform.matrix = Some([x, y, z, map.translation]);
        }
    }
}

/// Puts an entity on a path, looking along it.
fn follow(entity: &mut EntityHandle, path: &PathHandle, t: &Dynamic, keeps_rotation: bool) -> Fallible<()> {
    entity.alive()?;
    let frame = path.0.frame(number(t)?);
    let mut transform = entity.transform();
    if transform.matrix.is_some() {
        return complain(format!("{} has a `matrix`: it cannot be moved alone", entity.label()), None);
    }
    transform.translation = frame.position;
    if !keeps_rotation {
        transform.rotation = euler_degrees(frame.matrix());
    }
    entity.put(transform.into())
}

const ENTITY: (&str, &str) = ("e", "an entity");
const TARGET: (&str, &str) = ("target", "an entity, its name, or a point in the world");

pub const CHAPTER: Chapter = Chapter {
    title: "Constraints",
    functions: &[
        Function {
            name: "look_at",
            forms: &["e.look_at(target)", "e.look_at(target, up)"],
            text: "Turns the -z axis of an entity towards another, of an area light its face (-y), wherever that one is when \
                   the function ends.",
            arguments: &[
                ENTITY,
                TARGET,
                ("up", "the direction that +y stays near to, in the world; [0, 1, 0] if left out"),
            ],
            example: "s.get(\"key\").look_at(\"ball\");\n\
                      s.get(\"box\").look_at([0, 1, 0], [0, 0, 1]);",
            register: |engine| {
                engine
                    .register_fn("look_at", |context: NativeCallContext, e: &mut EntityHandle, target: Dynamic| {
                        add(&context, e, &target, ConstraintKind::LookAt { up: DVec3::Y })
                    })
                    .register_fn(
                        "look_at",
                        |context: NativeCallContext, e: &mut EntityHandle, target: Dynamic, up: Dynamic| {
                            add(&context, e, &target, ConstraintKind::LookAt { up: vector(&up)? })
                        },
                    );
            },
        },
        Function {
            name: "track",
            forms: &["e.track(target)"],
            text: "Turns an entity about its y axis alone, so that -z looks towards another as far as that goes.",
            arguments: &[ENTITY, TARGET],
            example: "s.get(\"box\").track(\"ball\");",
            register: |engine| {
                engine.register_fn("track", |context: NativeCallContext, e: &mut EntityHandle, target: Dynamic| {
                    add(&context, e, &target, ConstraintKind::Track)
                });
            },
        },
        Function {
            name: "copy",
            forms: &["e.copy(target)"],
            text: "Puts an entity where another one is, turned and scaled alike, wherever that is when the function ends.",
            arguments: &[ENTITY, ("target", "an entity or its name")],
            example: "s.get(\"box\").copy(\"ball\");",
            register: |engine| {
                engine.register_fn("copy", |context: NativeCallContext, e: &mut EntityHandle, target: Dynamic| {
                    if is_vector(&target) {
                        return complain("`copy` takes an entity: set `translation` to a point", None);
                    }
                    add(&context, e, &target, ConstraintKind::Copy)
                });
            },
        },
        Function {
            name: "attach",
            forms: &["e.attach(target)"],
            text: "Makes an entity stand in the space of another, where it is: from here on it is carried along.",
            arguments: &[ENTITY, ("target", "an entity with a name, or that name")],
            example: "let flag = s.spawn(#{ aabox: #{}, translation: [0, 3, 0] });\n\
                      flag.attach(\"ball\");\n\
                      s.get(\"ball\").translation.x += 1;\n\
                      flag.world_position.y       // 3.0",
            register: |engine| {
                engine.register_fn("attach", |e: &mut EntityHandle, target: Dynamic| attach(e, &target));
            },
        },
        Function {
            name: "follow",
            forms: &["e.follow(path, t)", "e.follow(path, t, options)"],
            text: "Puts an entity on a path, in its parent's space, with -z along it.",
            arguments: &[
                ENTITY,
                ("path", "as `path` gives it"),
                ("t", "share of the length, 0 to 1"),
                ("options", "a map: `#{ turn: false }` keeps the rotation; it turns along the path if left out"),
            ],
            example: "let way = path([[0, 1, 0], [2, 1, 0], [2, 1, 2]]);\n\
                      s.get(\"ball\").follow(way, 0.0);\n\
                      s.get(\"ball\").translation       // vec3(0, 1, 0)",
            register: |engine| {
                engine
                    .register_fn("follow", |e: &mut EntityHandle, path: PathHandle, t: Dynamic| {
                        follow(e, &path, &t, false)
                    })
                    .register_fn("follow", |e: &mut EntityHandle, path: PathHandle, t: Dynamic, options: Map| {
                        let options = super::options::CallOptions::new("follow", &options, &["turn"])?;
                        follow(e, &path, &t, !options.switch("turn", true)?)
                    });
            },
        },
    ],
};
