//! Subjects: what a name, an entity or a point stands for, and the focus ring that turns from one to the next.

use ::rhai::{Array, Dynamic, NativeCallContext};
use glam::DVec3;

use super::cameras;
use super::context::ScriptContext;
use super::convert::{describe, is_vector, number, vector};
use super::easing::ease;
use super::errors::{Fallible, complain};
use super::handles::{EntityHandle, SceneHandle};
use super::table::{Chapter, Function};

/// Where a subject is in the world: a point, an entity, or the name of one.
pub fn point_of(context: &NativeCallContext, subject: &Dynamic) -> Fallible<DVec3> {
    if is_vector(subject) {
        return vector(subject);
    }
    if subject.is_string() || subject.is::<EntityHandle>() {
        return position(&ScriptContext::current_scene(context.fn_name())?, subject);
    }
    complain(format!("expected a point, an entity or the name of one, found {}", describe(subject)), None)
}

/// A list of subjects as points.
pub fn points(context: &NativeCallContext, list: &Array) -> Fallible<Vec<DVec3>> {
    list.iter().map(|subject| point_of(context, subject)).collect()
}

fn position(scene: &SceneHandle, subject: &Dynamic) -> Fallible<DVec3> {
    match subject.clone().try_cast::<EntityHandle>() {
        Some(entity) => entity.position(),
        None => scene.position(&subject.to_string()),
    }
}

/// Distance of a subject along the view: an entity, its name, a point, or a distance itself.
fn distance(scene: &SceneHandle, subject: &Dynamic) -> Fallible<f64> {
    let camera = cameras::standing(scene, scene.camera())?;
    let distance = if is_vector(subject) {
        (vector(subject)? - camera.from).dot(camera.axis())
    } else if subject.is_string() || subject.is::<EntityHandle>() {
        (position(scene, subject)? - camera.from).dot(camera.axis())
    } else {
        number(subject)?
    };
    match distance > 0.0 && distance.is_finite() {
        true => Ok(distance),
        false => complain(format!("rack: {} is not in front of the camera", describe(subject)), None),
    }
}

/// From one distance to another as a focus ring turns: evenly in 1 / distance.
fn turn_ring(near: f64, far: f64, t: f64) -> f64 {
    1.0 / (1.0 / near + (1.0 / far - 1.0 / near) * t.clamp(0.0, 1.0))
}

fn rack(scene: &SceneHandle, near: &Dynamic, far: &Dynamic, t: f64) -> Fallible<f64> {
    Ok(turn_ring(distance(scene, near)?, distance(scene, far)?, t))
}

/// A mark on the focus ring: when which subject is sharp, and how the ring gets there.
struct FocusMark {
    time: f64,
    subject: Dynamic,
    easing: Option<Dynamic>,
}

/// Subjects alone are spread evenly over 0..1; `[time, subject]` and `[time, subject, easing]` stand where they say.
fn marks(list: &Array, easing: Option<&Dynamic>) -> Fallible<Vec<FocusMark>> {
    let is_mark = |item: &Dynamic| {
        // Three numbers are a point.
        let is_number = |part: &Dynamic| part.is_int() || part.is_float();
        item.read_lock::<Array>()
            .is_some_and(|parts| parts.len() == 2 || parts.len() == 3 && !parts.iter().all(is_number))
    };
    let last = list.len().saturating_sub(1).max(1) as f64;
    let mut marks = Vec::with_capacity(list.len());
    for (index, item) in list.iter().enumerate() {
        if !is_mark(item) {
            marks.push(FocusMark { time: index as f64 / last, subject: item.clone(), easing: easing.cloned() });
            continue;
        }
        let parts = item.clone().cast::<Array>();
        let own = parts.get(2).filter(|own| !own.is_unit()).cloned();
        marks.push(FocusMark { time: number(&parts[0])?, subject: parts[1].clone(), easing: own.or(easing.cloned()) });
    }
    match marks.windows(2).find(|pair| pair[1].time < pair[0].time) {
        Some(pair) => complain(format!("rack: the mark at {} comes after {}", pair[1].time, pair[0].time), None),
        None => Ok(marks),
    }
}

fn rack_over(scene: &SceneHandle, list: &Array, t: f64, easing: Option<&Dynamic>) -> Fallible<f64> {
    let marks = marks(list, easing)?;
    let (Some(first), Some(last)) = (marks.first(), marks.last()) else {
        return complain("rack: the list is empty", None);
    };
    if t <= first.time {
        return distance(scene, &first.subject);
    }
    let Some(next) = marks.iter().position(|mark| t < mark.time) else { return distance(scene, &last.subject) };
    let (from, to) = (&marks[next - 1], &marks[next]);
    let share = (t - from.time) / (to.time - from.time);
    let eased = to.easing.as_ref().map_or(Ok(share), |easing| ease(easing, share))?;
    Ok(turn_ring(distance(scene, &from.subject)?, distance(scene, &to.subject)?, eased))
}

pub const CHAPTER: Chapter = Chapter {
    title: "Focus",
    functions: &[Function {
        name: "rack",
        forms: &["rack(from, to, t) -> number", "rack(subjects, t) -> number", "rack(subjects, t, easing) -> number"],
        text: "The focus distance between subjects, as a focus ring turns: evenly in 1 / distance. Over a list, subjects are \
               spread evenly from 0 to 1, or stand at the marks that they are given with: `[time, subject]`, or `[time, \
               subject, easing]` with how the ring gets there. Two marks with the same subject rest on it.",
        arguments: &[
            ("from", "an entity, its name, a point, or a distance in world units; in front of the camera"),
            ("to", "the same: an entity, its name, a point or a distance"),
            ("t", "0 to 1 between two, held to it; over marks the time that they are given in"),
            ("subjects", "a list of at least one of these, or of marks"),
            ("easing", "an easing, as for `ease`, for marks that have none; straight if left out"),
        ],
        example: "rack(2.0, 8.0, 0.5)                                         // 3.2\n\
                  rack([2.0, 8.0, 2.0], 0.25)                                 // 3.2\n\
                  rack([[0.0, 2.0], [0.4, 2.0], [1.0, 8.0, \"hold\"]], 0.7)     // 2.0\n\
                  s.camera.focus_distance = rack([\"ball\", \"box\"], f.t, \"in_out_cubic\");",
        register: |engine| {
            type Any = Dynamic;
            engine
                .register_fn("rack", |a: Any, b: Any, t: Any| -> Fallible<f64> {
                    // With a list first it is the form with an easing, and the last argument is that.
                    match a.read_lock::<Array>().filter(|list| !t.is_int() && !t.is_float() && !list.is_empty()) {
                        Some(list) => rack_over(&ScriptContext::current_scene("rack")?, &list, number(&b)?, Some(&t)),
                        None => rack(&ScriptContext::current_scene("rack")?, &a, &b, number(&t)?),
                    }
                })
                .register_fn("rack", |subjects: Array, t: Any| {
                    rack_over(&ScriptContext::current_scene("rack")?, &subjects, number(&t)?, None)
                })
                .register_fn("rack", |scene: &mut SceneHandle, a: Any, b: Any, t: Any| rack(scene, &a, &b, number(&t)?))
                .register_fn("rack", |scene: &mut SceneHandle, subjects: Array, t: Any| {
                    rack_over(scene, &subjects, number(&t)?, None)
                });
        },
    }],
};
