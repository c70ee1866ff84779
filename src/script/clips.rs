//! Clips of assets: played, laid over each other, and told of.

use ::rhai::{Array, Dynamic, Map};
use glam::DVec3;

use super::convert::number;
use super::errors::{Fallible, complain};
use super::handles::EntityHandle;
use super::table::{Chapter, Function};
use crate::base::diagnostics::suggestion;
use crate::components::animation::{euler_of, quaternion_of, slerp};
use crate::components::*;

/// How a clip is put on.
#[derive(Clone, Copy)]
pub struct Playing {
    pub seconds: f64,
    /// Whether it begins again behind its end.
    pub repeat: bool,
    /// How far towards the clip everything goes from where it stands, 0 to 1.
    pub weight: f64,
}

fn with_options(playing: Playing, options: &Map) -> Fallible<Playing> {
    let mut playing = playing;
    for (key, value) in options {
        match key.as_str() {
            "repeat" => match value.as_bool() {
                Ok(repeat) => playing.repeat = repeat,
                Err(_) => return complain("`repeat` of `play` must be true or false", None),
            },
            "weight" => playing.weight = checked_weight(number(value)?)?,
            other => {
                return complain(format!("`play` has no option `{other}`"), suggestion(other, ["repeat", "weight"]));
            }
        }
    }
    Ok(playing)
}

fn checked_weight(weight: f64) -> Fallible<f64> {
    if (0.0..=1.0).contains(&weight) {
        Ok(weight)
    } else {
        complain(format!("a weight must be from 0 to 1, not {weight}"), None)
    }
}

/// The asset that an entity is.
fn asset(entity: &EntityHandle) -> Fallible<Asset> {
    match entity.component(Kind::Asset) {
        Some(Component::Asset(asset)) => Ok(asset),
        _ => complain(
            format!("{} has no `asset`, and so no clips", entity.label()),
            Some("ask the entity whose `asset` names the file".into()),
        ),
    }
}

fn clip<'a>(asset: &'a Asset, name: &str) -> Fallible<&'a Clip> {
    match asset.clip(name) {
        Some(clip) => Ok(clip),
        None if asset.data.clips.is_empty() => complain(format!("`{}` has no clips", asset.file), None),
        None => {
            let known = asset.data.clips.iter().map(|clip| &*clip.name);
            complain(format!("`{}` has no clip `{name}`", asset.file), suggestion(name, known))
        }
    }
}

/// A clip as a script sees it.
fn describe(clip: &Clip) -> Map {
    let [start, end] = clip.span();
    let name = Dynamic::from(::rhai::ImmutableString::from(&*clip.name));
    [("name", name), ("start", start.into()), ("end", end.into()), ("length", (end - start).into())]
        .into_iter()
        .map(|(key, value)| (key.into(), value))
        .collect()
}

/// All clips of an entity's asset.
pub fn all(entity: &EntityHandle) -> Fallible<Array> {
    Ok(asset(entity)?.data.clips.iter().map(|clip| describe(clip).into()).collect())
}

/// Puts the nodes of an asset where a clip has them at a time.
pub fn play(entity: &mut EntityHandle, name: &str, playing: Playing) -> Fallible<EntityHandle> {
    let asset = asset(entity)?;
    let clip = clip(&asset, name)?;
    if !playing.seconds.is_finite() {
        return complain(format!("`{name}` cannot be played at {} seconds", playing.seconds), None);
    }
    let time = clip.wrapped(playing.seconds, playing.repeat);
    let prefix = entity.name().unwrap_or_default();
    let mut target: Option<(Text, Option<EntityHandle>)> = None;
    for track in &clip.tracks {
        // The tracks of a node mostly follow each other.
        if target.as_ref().is_none_or(|(node, _)| *node != track.node) {
            target = Some((track.node.clone(), entity.find(&format!("{prefix}/{}", track.node))));
        }
        // What a scene leaves out, or a script has removed, does not move.
        let Some((_, Some(node))) = &mut target else { continue };
        put(node, track, track.at(time), playing.weight)?;
    }
    Ok(entity.clone())
}

/// Leads a property of a node towards a value.
fn put(node: &mut EntityHandle, track: &Track, value: Vec<f64>, weight: f64) -> Fallible<()> {
    let mixed = |from: f64, to: f64| if weight == 1.0 { to } else { from + (to - from) * weight };
    let vector = |from: DVec3| DVec3::new(mixed(from.x, value[0]), mixed(from.y, value[1]), mixed(from.z, value[2]));
    if track.property == TrackProperty::Weights {
        let Some(Component::Morph(morph)) = node.component(Kind::Morph) else { return Ok(()) };
        let weights = morph.weights.iter().zip(&value).map(|(from, to)| mixed(*from, *to)).collect();
        return node.put(Morph { weights, ..morph }.into());
    }
    let mut transform = node.transform();
    if let Some(matrix) = transform.matrix.take() {
        return complain(format!("{} stands by its `matrix` {:?}, which no clip can move", node.label(), matrix), None);
    }
    match track.property {
        TrackProperty::Translation => transform.translation = vector(transform.translation),
        TrackProperty::Scale => transform.scale = Scale(vector(transform.scale.0)),
        TrackProperty::Rotation => {
            let to = [value[0], value[1], value[2], value[3]];
            let to = if weight == 1.0 { to } else { slerp(quaternion_of(transform.rotation), to, weight) };
            transform.rotation = euler_of(to);
        }
        TrackProperty::Visibility if value[0] == 0.0 => transform.scale = Scale(DVec3::ZERO),
        TrackProperty::Visibility | TrackProperty::Weights => return Ok(()),
    }
    node.put(transform.into())
}

pub const CHAPTER: Chapter = Chapter {
    title: "Clips of assets",
    functions: &[
        Function {
            name: "play",
            forms: &["e.play(clip, seconds) -> entity", "e.play(clip, seconds, options) -> entity"],
            text: "Puts the nodes of an asset where a clip of its file has them at a time: their transforms, the weights of \
                   their shapes. Behind its end the clip begins again. A clip that is played later has the last word on \
                   what both move.",
            arguments: &[
                ("e", "the entity whose `asset` names the file"),
                ("clip", "its name in the file"),
                ("seconds", "a number: time of the clip, any; before its first key that of the key"),
                (
                    "options",
                    "a map: `repeat`, whether it begins again behind its end, default true; `weight`, how far everything goes \
                     from where it stands to where the clip has it, 0 to 1, default 1",
                ),
            ],
            example: "s.get(\"robot\").play(\"Nod\", f.seconds);\n\
                      s.get(\"robot\").play(\"Nod\", f.seconds, #{ repeat: false });",
            register: |engine| {
                engine
                    .register_fn("play", |e: &mut EntityHandle, clip: &str, seconds: Dynamic| {
                        play(e, clip, Playing { seconds: number(&seconds)?, repeat: true, weight: 1.0 })
                    })
                    .register_fn("play", |e: &mut EntityHandle, clip: &str, seconds: Dynamic, options: Map| {
                        let playing = Playing { seconds: number(&seconds)?, repeat: true, weight: 1.0 };
                        play(e, clip, with_options(playing, &options)?)
                    });
            },
        },
        Function {
            name: "blend",
            forms: &["e.blend(clip, seconds, weight) -> entity"],
            text: "Lays a clip over what is there, mostly another clip: everything that it moves goes this far from where it \
                   stands to where the clip has it, rotations on the shorter arc.",
            arguments: &[
                ("e", "the entity whose `asset` names the file"),
                ("clip", "its name in the file"),
                ("seconds", "a number: time of the clip, as for `play`"),
                ("weight", "0 (nothing of it) to 1 (nothing but it)"),
            ],
            example: "s.get(\"robot\").play(\"Nod\", f.seconds);\ns.get(\"robot\").blend(\"Turn\", f.seconds, 0.3);",
            register: |engine| {
                engine.register_fn(
                    "blend",
                    |e: &mut EntityHandle, clip: &str, seconds: Dynamic, weight: Dynamic| -> Fallible<EntityHandle> {
                        let weight = checked_weight(number(&weight)?)?;
                        play(e, clip, Playing { seconds: number(&seconds)?, repeat: true, weight })
                    },
                );
            },
        },
        Function {
            name: "clip",
            forms: &["e.clip(clip) -> map"],
            text: "What is known of a clip: its `name`, and the seconds of its `start`, its `end` and its `length`.",
            arguments: &[("e", "the entity whose `asset` names the file"), ("clip", "its name in the file")],
            example: "s.get(\"robot\").clip(\"Nod\").length       // 2.0",
            register: |engine| {
                engine.register_fn("clip", |e: &mut EntityHandle, name: &str| {
                    let asset = asset(e)?;
                    clip(&asset, name).map(describe)
                });
            },
        },
        Function {
            name: "clips",
            forms: &["e.clips -> list"],
            text: "All clips of an asset, each as `clip` gives it.",
            arguments: &[("e", "the entity whose `asset` names the file")],
            example: "s.get(\"robot\").clips.len()              // 2\ns.get(\"robot\").clips[1].name            // \"Turn\"",
            register: |engine| {
                engine.register_get("clips", |e: &mut EntityHandle| all(e));
            },
        },
    ],
};
