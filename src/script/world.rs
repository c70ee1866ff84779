//! Where things are in the world: after their parents and their motion, as the frame stands at the moment of asking.
//!
//! The rule for it is that of the systems ([`world_placement`], [`Shape::support`]): a script measures what is rendered.

use ::rhai::{Dynamic, Map};
use glam::{DAffine3, DVec3};

use super::convert::vector;
use super::errors::{Fallible, complain};
use super::handles::EntityHandle;
use super::overlay::Overlay;
use super::table::{Chapter, Function};
use crate::base::limits;
use crate::components::skin::bent;
use crate::components::transform::world_placement;
use crate::components::*;

/// Properties of an entity that say where it is.
pub const PROPERTIES: [&str; 3] = ["world_position", "world_transform", "bounds"];

/// The entity whose space another one stands in.
pub fn parent_of(overlay: &Overlay, entity: usize) -> Option<usize> {
    let transform = overlay.component(entity, Kind::Transform).and_then(Transform::of)?;
    transform.parent.as_deref().and_then(|parent| overlay.find(parent))
}

/// An entity and all that it stands in, inside out. A circle of parents, which is refused with the frame, ends somewhere.
pub fn ancestry(overlay: &Overlay, entity: usize) -> Vec<usize> {
    let above = |index: &usize| parent_of(overlay, *index);
    std::iter::successors(Some(entity), above).take(limits::HIERARCHY_DEPTH).collect()
}

/// The map from an entity's local space to the world, at a time of the shutter.
pub fn placement(overlay: &Overlay, entity: usize, time: f64) -> DAffine3 {
    world_placement(
        entity,
        |index| overlay.component(index, Kind::Transform).and_then(Transform::of),
        |index| overlay.component(index, Kind::Motion).and_then(Motion::of),
        |name| overlay.find(name),
        time,
    )
}

/// A box in the world around the shapes of one entity; `None` without a shape that ends somewhere.
fn own_bounds(overlay: &Overlay, entity: usize, time: f64) -> Option<[DVec3; 2]> {
    let map = placement(overlay, entity, time);
    if let Some(bounds) = bent_bounds(overlay, entity, map, time) {
        return Some(bounds);
    }
    let shapes = Kind::ALL.iter().filter_map(|kind| overlay.component(entity, *kind)?.shape());
    shapes.filter_map(|shape| shapes::world_bounds(shape, &map)).reduce(union)
}

/// A box in the world around a mesh that a skin or a morph bends; `None` if nothing does.
fn bent_bounds(overlay: &Overlay, entity: usize, map: DAffine3, time: f64) -> Option<[DVec3; 2]> {
    let [morph, skin] = [Kind::Morph, Kind::Skin].map(|kind| overlay.component(entity, kind));
    let Some(Component::Mesh(mesh)) = overlay.component(entity, Kind::Mesh) else { return None };
    if morph.is_none() && skin.is_none() {
        return None;
    }
    let joint = |name: &Text| overlay.find(name).map_or(DAffine3::IDENTITY, |joint| placement(overlay, joint, time));
    let (bent, map) = bent(mesh, morph, skin, map, joint);
    let corners = mesh.shown_triangles(&bent).flatten();
    let corners = corners.map(|v| map.transform_point3(bent.vertices[v as usize].as_dvec3() + bent.origin));
    corners.map(|p| [p; 2]).reduce(union)
}

fn union(a: [DVec3; 2], b: [DVec3; 2]) -> [DVec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

impl EntityHandle {
    /// The map from local space to the world at the moment that the script is called for.
    pub fn placement(&self) -> DAffine3 {
        placement(&self.scene.lock(), self.index, self.scene.time)
    }

    /// World position, parents included.
    ///
    /// # Errors
    /// An entity that was removed.
    pub fn position(&self) -> Fallible<DVec3> {
        self.alive()?;
        Ok(self.placement().translation)
    }

    /// A box around its shapes and those of all that stands in its space.
    fn bounds(&self) -> Option<[DVec3; 2]> {
        let overlay = self.scene.lock();
        let below = overlay.entities().filter(|other| {
            // Most entities stand in nobody's space, and what has no shape has no bounds.
            *other == self.index
                || parent_of(&overlay, *other).is_some() && ancestry(&overlay, *other).contains(&self.index)
        });
        below.filter_map(|other| own_bounds(&overlay, other, self.scene.time)).reduce(union)
    }
}

/// What a property of [`PROPERTIES`] is now.
pub fn property(entity: &EntityHandle, name: &str) -> Option<Fallible<Dynamic>> {
    Some(match name {
        "world_position" => Ok(Dynamic::from(entity.placement().translation)),
        "world_transform" => {
            let map = entity.placement();
            let axes = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation];
            Ok(Dynamic::from_map(vectors(["x", "y", "z", "origin"], axes)))
        }
        "bounds" => match entity.bounds() {
            Some([min, max]) => {
                let values = [min, max, (min + max) / 2.0, max - min];
                Ok(Dynamic::from_map(vectors(["min", "max", "center", "size"], values)))
            }
            None => {
                let help = "only shapes have bounds; a plane has none, and a file that a script names is read later";
                complain(format!("{} has no bounds", entity.label()), Some(help.into()))
            }
        },
        _ => return None,
    })
}

fn vectors(names: [&str; 4], values: [DVec3; 4]) -> Map {
    names.into_iter().zip(values).map(|(name, value)| (name.into(), Dynamic::from(value))).collect()
}

pub const CHAPTER: Chapter = Chapter {
    title: "Where things are",
    functions: &[
        Function {
            name: "world_position",
            forms: &["e.world_position -> vector"],
            text: "Where the origin of an entity is in the world, its parents and `motion` included.",
            arguments: &[("e", "an entity")],
            example: "let moon = s.spawn(#{ sphere: #{ radius: 0.2 }, translation: [1, 0, 0], parent: \"ball\" });\n\
                      s.get(\"ball\").translation = [0, 2, 0];\n\
                      moon.world_position       // vec3(1, 2, 0)",
            register: |_| {},
        },
        Function {
            name: "world_transform",
            forms: &["e.world_transform -> map"],
            text: "Where an entity's local space is in the world: `origin`, and `x`, `y`, `z` as its axes go, each as long as \
                   one of its units. A local point p is at `origin + x * p.x + y * p.y + z * p.z`.",
            arguments: &[("e", "an entity")],
            example: "let stick = s.spawn(#{ aabox: #{}, scale: 2, yaw: 90 });\n\
                      stick.world_transform.x       // vec3(0, 0, -2)",
            register: |_| {},
        },
        Function {
            name: "bounds",
            forms: &["e.bounds -> map"],
            text: "A box along the world's axes around the shapes of an entity and of all that stands in its space: `min`, \
                   `max`, `center`, `size`. Around a mesh it may be larger by a hundredth of the mesh; around one that a \
                   clip or weights bend it fits.",
            arguments: &[("e", "an entity with a shape, or the parent of some")],
            example: "let moon = s.spawn(#{ sphere: #{ radius: 0.5 }, translation: [1, 2, 0] });\n\
                      moon.bounds.min       // vec3(0.5, 1.5, -0.5)\n\
                      moon.bounds.size      // vec3(1, 1, 1)",
            register: |_| {},
        },
        Function {
            name: "to_world",
            forms: &["e.to_world(point) -> vector"],
            text: "A point of an entity's local space, in the world.",
            arguments: &[("e", "an entity"), ("point", "a point in local space")],
            example: "let stick = s.spawn(#{ aabox: #{}, translation: [0, 1, 0], yaw: 90 });\n\
                      stick.to_world([2, 0, 0])       // vec3(0, 1, -2)",
            register: |engine| {
                engine.register_fn("to_world", |entity: &mut EntityHandle, point: Dynamic| -> Fallible<DVec3> {
                    entity.alive()?;
                    Ok(entity.placement().transform_point3(vector(&point)?))
                });
            },
        },
        Function {
            name: "to_local",
            forms: &["e.to_local(point) -> vector"],
            text: "A point of the world, in an entity's local space.",
            arguments: &[("e", "an entity"), ("point", "a point in the world")],
            example: "let stick = s.spawn(#{ aabox: #{}, translation: [0, 1, 0], scale: 2 });\n\
                      stick.to_local([2, 1, 0])       // vec3(1, 0, 0)",
            register: |engine| {
                engine.register_fn("to_local", |entity: &mut EntityHandle, point: Dynamic| -> Fallible<DVec3> {
                    entity.alive()?;
                    Ok(entity.placement().inverse().transform_point3(vector(&point)?))
                });
            },
        },
    ],
};
