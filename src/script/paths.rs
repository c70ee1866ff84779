//! Paths in scripts: a value of their own, made once and walked at constant speed.

use std::sync::Arc;

use ::rhai::{Array, Dynamic, Map, NativeCallContext};
use glam::DVec3;

use super::convert::number;
use super::curve::{Curve, CurveKind};
use super::errors::{Fallible, complain};
use super::options::CallOptions;
use super::subjects::points;
use super::table::{Chapter, Function};
use crate::base::math::euler_degrees;

/// A path as a script holds it.
#[derive(Clone)]
pub struct PathHandle(pub Arc<Curve>);

const KINDS: [&str; 4] = ["catmull_rom", "bezier", "b_spline", "linear"];

fn make(context: &NativeCallContext, list: &Array, options: &Map) -> Fallible<PathHandle> {
    let options = CallOptions::new("path", options, &["kind", "closed", "up"])?;
    let kind = match options.choice("kind", &KINDS)? {
        Some(1) => CurveKind::Bezier,
        Some(2) => CurveKind::BSpline,
        Some(3) => CurveKind::Linear,
        _ => CurveKind::CatmullRom,
    };
    let up = options.vector("up", DVec3::Y)?;
    let closed = options.switch("closed", false)?;
    match Curve::new(kind, &points(context, list)?, closed, up) {
        Ok(curve) => Ok(PathHandle(Arc::new(curve))),
        Err(message) => complain(message, None),
    }
}

/// A share of the length; what is no number would give a point that is nowhere.
fn share(value: &Dynamic) -> Fallible<f64> {
    match number(value)? {
        t if t.is_finite() => Ok(t),
        t => complain(format!("a share of a path must be a finite number, not {t}"), None),
    }
}

fn frame_along(path: &PathHandle, t: f64) -> Map {
    let frame = path.0.frame(t);
    let entries = [
        ("position", frame.position),
        ("tangent", frame.tangent),
        ("normal", frame.normal),
        ("binormal", frame.binormal()),
        ("rotation", euler_degrees(frame.matrix())),
    ];
    entries.into_iter().map(|(name, v)| (name.into(), Dynamic::from(v))).collect()
}

const SHARE: (&str, &str) = (
    "t",
    "share of the length: 0 is the start, 1 the end. Beyond them an open path goes straight on, a closed one round again",
);
const PATH: (&str, &str) = ("path", "a path");

pub const CHAPTER: Chapter = Chapter {
    title: "Paths",
    functions: &[
        Function {
            name: "path",
            forms: &["path(points) -> path", "path(points, options) -> path"],
            text: "A curve through points, to be walked at constant speed. Make it once for a frame and ask it as often as \
                   you like. A point that repeats the one before counts once.",
            arguments: &[
                ("points", "a list of vectors or of names of entities (where those are), world units"),
                (
                    "options",
                    "a map: `kind` \"catmull_rom\" (centripetal, through all points; the default), \"bezier\" (a point, two \
                     handles, a point, ...), \"b_spline\" (near the points, smoother) or \"linear\"; `closed`, whether it \
                     comes back to its start, default false; `up`, where the first normal points, default [0, 1, 0]",
                ),
            ],
            example: "let way = path([[0, 0, 0], [2, 0, 0], [2, 0, 2]], #{ kind: \"linear\" });\n\
                      way.length            // 4.0\n\
                      along(way, 0.25)      // vec3(1, 0, 0)",
            register: |engine| {
                engine
                    .register_type_with_name::<PathHandle>("Path")
                    .register_fn("path", |context: NativeCallContext, points: Array| {
                        make(&context, &points, &Map::new())
                    })
                    .register_fn("path", |context: NativeCallContext, points: Array, options: Map| {
                        make(&context, &points, &options)
                    })
                    .register_get("length", |path: &mut PathHandle| path.0.length())
                    .register_fn("to_string", |path: &mut PathHandle| format!("path of length {}", path.0.length()))
                    .register_fn("to_debug", |path: &mut PathHandle| format!("path of length {}", path.0.length()));
            },
        },
        Function {
            name: "along",
            forms: &["along(path, t) -> vector"],
            text: "The point at a share of a path's length: equal steps of `t` are equal ways.",
            arguments: &[PATH, SHARE],
            example: "let way = path([[0, 0, 0], [1, 0, 0], [9, 0, 0]]);\n\
                      along(way, 0.5)       // vec3(4.5, 0, 0)\n\
                      way.along(1.0)        // vec3(9, 0, 0)",
            register: |engine| {
                engine.register_fn("along", |path: PathHandle, t: Dynamic| -> Fallible<DVec3> {
                    Ok(path.0.position(share(&t)?))
                });
            },
        },
        Function {
            name: "tangent_along",
            forms: &["tangent_along(path, t) -> vector"],
            text: "The direction in which a path goes on, a vector of length 1.",
            arguments: &[PATH, SHARE],
            example: "tangent_along(path([[0, 0, 0], [0, 3, 0]]), 0.5)   // vec3(0, 1, 0)",
            register: |engine| {
                engine.register_fn("tangent_along", |path: PathHandle, t: Dynamic| -> Fallible<DVec3> {
                    Ok(path.0.tangent(share(&t)?))
                });
            },
        },
        Function {
            name: "frame_along",
            forms: &["frame_along(path, t) -> map"],
            text: "Where a path is and how it lies there: `position`, and the unit vectors `tangent` (onwards), `normal` and \
                   `binormal` (right of both), carried along without rolling, so that they never flip; `rotation`, degrees, \
                   is what an entity needs to look along the path with its -z axis.",
            arguments: &[PATH, SHARE],
            example: "let way = path([[0, 0, 0], [0, 0, -5]]);\n\
                      let here = frame_along(way, 0.5);\n\
                      here.position         // vec3(0, 0, -2.5)\n\
                      here.normal           // vec3(0, 1, 0)\n\
                      s.camera.from = here.position;\n\
                      s.camera.at = here.position + here.tangent;\n\
                      s.camera.up = here.normal;",
            register: |engine| {
                engine.register_fn("frame_along", |path: PathHandle, t: Dynamic| -> Fallible<Map> {
                    Ok(frame_along(&path, share(&t)?))
                });
            },
        },
    ],
};
