//! Many entities that differ in their places: made at once, so that a hundred thousand of them cost no more than their data.

use ::rhai::{Array, Dynamic, Map};
use glam::DVec3;

use super::allowance::Limit;
use super::convert::{is_vector, number, vector};
use super::errors::{Fallible, complain};
use super::fields::{checked, known_material, text};
use super::handles::SceneHandle;
use super::options::CallOptions;
use super::sandbox::allowance;
use super::table::{Chapter, Function};
use crate::base::limits;
use crate::components::*;

/// A value for each of the places, or one for all of them.
fn spread(options: &CallOptions, name: &str, count: usize) -> Fallible<Option<Vec<Dynamic>>> {
    let Some(value) = options.get(name) else { return Ok(None) };
    let list = value.read_lock::<Array>().map(|list| list.to_vec());
    // Three numbers are a vector for all.
    let is_one = |list: &Vec<Dynamic>| list.len() == 3 && count != 3 && list.iter().all(|x| number(x).is_ok());
    match list.filter(|list| !is_one(list)) {
        None => Ok(Some(vec![value.clone(); count])),
        Some(list) if list.len() == count => Ok(Some(list)),
        Some(list) => {
            let message = format!("instances: `{name}` has {} values for {count} places", list.len());
            complain(message, Some("give one for all, or one for each place".into()))
        }
    }
}

fn scale_of(value: &Dynamic) -> Fallible<DVec3> {
    if is_vector(value) { vector(value) } else { number(value).map(DVec3::splat) }
}

fn instances(scene: &mut SceneHandle, parts: Map, places: &Array, options: &Map) -> Fallible<Array> {
    let options = CallOptions::new("instances", options, &["rotations", "scales", "materials"])?;
    let count = places.len();
    let rotations = spread(&options, "rotations", count)?;
    let scales = spread(&options, "scales", count)?;
    let materials = spread(&options, "materials", count)?;
    {
        let overlay = scene.lock();
        let most = allowance().get(Limit::Spawns);
        if overlay.count() + count > limits::ENTITIES || (overlay.spawned() + count) as u64 > most {
            let message = format!("instances: more than {most} entities spawned in one call");
            return complain(message, Some(Limit::Spawns.how_to_raise(most)));
        }
    }
    scene.spawn(parts)?;
    let Some(prototype) = scene.lock().unspawn() else { return Ok(Array::new()) };
    let base = prototype.component::<Transform>().cloned().unwrap_or_default();
    let first = scene.lock().count();
    for (index, place) in places.iter().enumerate() {
        let mut transform = Transform { translation: base.translation + vector(place)?, ..base.clone() };
        if let Some(rotations) = &rotations {
            transform.rotation = base.rotation + vector(&rotations[index])?;
        }
        if let Some(scales) = &scales {
            transform.scale.0 = base.scale.0 * scale_of(&scales[index])?;
        }
        checked(&transform, "transform of an instance")?;
        let mut desc = prototype.clone();
        desc.put(transform.into());
        let mut overlay = scene.lock();
        if let Some(materials) = &materials {
            let name = text(&materials[index], "`materials` of instances")?;
            known_material(&overlay, &name)?;
            desc.put(MaterialName(name).into());
        }
        if let Some(name) = &prototype.name {
            let name: Text = format!("{name} {index}").into();
            if overlay.find(&name).is_some() {
                return complain(format!("there is already an entity `{name}`"), None);
            }
            desc.name = Some(name);
        }
        overlay.spawn(desc);
    }
    Ok((first..first + count).map(|index| Dynamic::from(scene.entity(index))).collect())
}

pub const CHAPTER: Chapter = Chapter {
    title: "Many at once",
    functions: &[Function {
        name: "instances",
        forms: &[
            "s.instances(parts, places) -> list of entities",
            "s.instances(parts, places, options) -> list of entities",
        ],
        text: "Spawns one entity for each place, all with the same parts. A mesh that they share is stored once, so that a \
               hundred thousand of them take little.",
        arguments: &[
            ("parts", "a map, as for `spawn`; with a `name`, the entities are called `name 0`, `name 1`, ..."),
            ("places", "a list of points, added to the `translation` of the parts"),
            (
                "options",
                "a map, empty if left out, each with one value for all or a list of one for each place: `rotations` (degrees, added), `scales` \
                 (numbers or vectors, multiplied), `materials` (names)",
            ),
        ],
        example: "let places = [];\n\
                  for i in 0..100 { places.push(polar(3, i * 3.6)); }\n\
                  let posts = s.instances(#{ mesh: rounded_box(0.1, 0.02), material: \"brass\" }, places, #{ scales: [1, 4, 1] });\n\
                  posts.len()                      // 100\n\
                  posts[25].world_position         // vec3(0, 0, -3)",
        register: |engine| {
            engine
                .register_fn("instances", |s: &mut SceneHandle, parts: Map, places: Array| {
                    instances(s, parts, &places, &Map::new())
                })
                .register_fn("instances", |s: &mut SceneHandle, parts: Map, places: Array, options: Map| {
                    instances(s, parts, &places, &options)
                });
        },
    }],
};
