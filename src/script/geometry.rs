//! Meshes that a script models: values of their own, put on as many entities as one likes.

use std::sync::Arc;

use ::rhai::{Array, Dynamic, ImmutableString, Map, NativeCallContext};
use glam::{DVec2, DVec3};

use super::convert::{describe, is_vector, number, vector};
use super::curve::{Curve, CurveKind};
use super::errors::{Fallible, complain};
use super::options::CallOptions;
use super::paths::PathHandle;
use super::subjects::points;
use super::table::{Chapter, Function};
use crate::base::math::sin_cos_degrees;
use crate::components::modeling::{self, Outline, PathFrame, TextAlign, TextLayout};
use crate::components::{Mesh, MeshData};

/// A mesh that a script has made; entities that it is put on share it.
#[derive(Clone)]
pub struct MeshHandle(pub Mesh);

/// Edges at which a made mesh turns by more degrees than this are sharp, unless it is asked for otherwise.
const CREASE_ANGLE: f64 = 40.0;
/// Divisions of a turn, and of a path: beyond them none would show.
const SEGMENTS: u64 = 4_096;
/// Farthest coordinate of a point of an outline.
const FARTHEST: f64 = 1e6;

fn made(data: MeshData, options: &CallOptions) -> Fallible<MeshHandle> {
    let crease_angle = options.between("crease_angle", CREASE_ANGLE, 0.0, 180.0)?;
    if data.triangles.is_empty() {
        return complain(format!("{}: the shape has no faces", options.function()), None);
    }
    let crease_angle = Some(crease_angle);
    Ok(MeshHandle(Mesh { smooth: Some(true), crease_angle, data: Arc::new(data), ..Mesh::default() }))
}

/// A finite number above `low`, or from it.
fn length(function: &str, name: &str, value: &Dynamic, from_zero: bool) -> Fallible<f64> {
    let x = number(value)?;
    let is_good = x <= FARTHEST && (x > 0.0 || from_zero && x == 0.0);
    let from = if from_zero { "from 0" } else { "above 0" };
    if is_good { Ok(x) } else { complain(format!("{function}: `{name}` must be a length {from}, not {x}"), None) }
}

/// A point in a plane: two numbers, or a vector without its z.
fn flat_point(value: &Dynamic) -> Fallible<DVec2> {
    let pair = value.read_lock::<Array>().filter(|list| list.len() == 2).map(|list| list.to_vec());
    let point = match pair {
        Some(pair) => DVec2::new(number(&pair[0])?, number(&pair[1])?),
        None if is_vector(value) => vector(value)?.truncate(),
        None => return complain(format!("expected a point of two numbers, found {}", describe(value)), None),
    };
    match point.abs().max_element() <= FARTHEST {
        true => Ok(point),
        false => complain(format!("a point of an outline must lie within +-{FARTHEST:e}, not at {point}"), None),
    }
}

fn outline(list: &Array) -> Fallible<Outline> {
    let mut points: Outline = Vec::with_capacity(list.len());
    for value in list {
        let point = flat_point(value)?;
        if points.last() != Some(&point) {
            points.push(point);
        }
    }
    Ok(points)
}

/// One outline, or a list of them.
fn outlines(list: &Array) -> Fallible<Vec<Outline>> {
    let is_list_of_points =
        |value: &Dynamic| value.read_lock::<Array>().is_some_and(|inner| inner.first().is_some_and(is_vector));
    let all: Vec<Outline> = if !list.is_empty() && list.iter().all(is_list_of_points) {
        list.iter().map(|one| outline(&one.clone().cast::<Array>())).collect::<Fallible<_>>()?
    } else {
        vec![outline(list)?]
    };
    match all.iter().find(|one| one.len() < 3) {
        Some(one) => complain(format!("an outline has three points at least, not {}", one.len()), None),
        None => Ok(all),
    }
}

fn lathe(profile: &Array, options: &Map) -> Fallible<MeshHandle> {
    let options = CallOptions::new("lathe", options, &["segments", "angle", "closed", "crease_angle"])?;
    let profile = outline(profile)?;
    if profile.len() < 2 {
        return complain("lathe: a profile has two points at least", None);
    }
    if let Some(point) = profile.iter().find(|point| point.x < 0.0) {
        return complain(
            format!("lathe: the first number of a point is its distance from the axis, not {}", point.x),
            None,
        );
    }
    let segments = options.whole("segments", 64, 3, SEGMENTS)? as u32;
    let angle = options.between("angle", 360.0, 0.001, 360.0)?;
    made(modeling::lathe(&profile, options.switch("closed", false)?, segments, angle), &options)
}

fn circle(radius: f64, count: u32) -> Outline {
    let at = |i: u32| {
        let (sin, cos) = sin_cos_degrees(360.0 * f64::from(i) / f64::from(count));
        DVec2::new(cos, sin) * radius
    };
    (0..count).map(at).collect()
}

fn torus(radius: &Dynamic, tube: &Dynamic, options: &Map) -> Fallible<MeshHandle> {
    let options = CallOptions::new("torus", options, &["segments", "sides", "crease_angle"])?;
    let (radius, tube) = (length("torus", "radius", radius, false)?, length("torus", "tube_radius", tube, false)?);
    if tube > radius {
        return complain(format!("torus: `tube_radius` {tube} is larger than `radius` {radius}"), None);
    }
    let segments = options.whole("segments", 96, 3, SEGMENTS)? as u32;
    let sides = options.whole("sides", 48, 3, SEGMENTS)? as u32;
    let profile: Outline = circle(tube, sides).into_iter().map(|p| p + DVec2::X * radius).collect();
    made(modeling::lathe(&profile, true, segments, 360.0), &options)
}

fn disk(radius: &Dynamic, options: &Map) -> Fallible<MeshHandle> {
    let options = CallOptions::new("disk", options, &["inner", "segments", "angle", "crease_angle"])?;
    let radius = length("disk", "radius", radius, false)?;
    let inner = options.between("inner", 0.0, 0.0, radius)?;
    let segments = options.whole("segments", 96, 3, SEGMENTS)? as u32;
    let angle = options.between("angle", 360.0, 0.001, 360.0)?;
    let profile = [DVec2::new(radius, 0.0), DVec2::new(inner, 0.0)];
    made(modeling::lathe(&profile, false, segments, angle), &options)
}

fn rounded_box(size: &Dynamic, radius: &Dynamic, options: &Map) -> Fallible<MeshHandle> {
    let options = CallOptions::new("rounded_box", options, &["segments", "crease_angle"])?;
    let size = if is_vector(size) { vector(size)? } else { DVec3::splat(number(size)?) };
    if !(size.min_element() > 0.0 && size.max_element() <= FARTHEST) {
        return complain(format!("rounded_box: each side of `size` must be a length above 0, not {size}"), None);
    }
    let radius = length("rounded_box", "radius", radius, true)?;
    if radius > size.min_element() / 2.0 {
        let most = size.min_element() / 2.0;
        return complain(
            format!("rounded_box: `radius` must be at most half of the smallest side, {most}, not {radius}"),
            None,
        );
    }
    let segments = options.whole("segments", 8, 1, 256)? as u32;
    made(modeling::rounded_box(size, radius, segments), &options)
}

fn extrude(list: &Array, depth: &Dynamic, options: &Map) -> Fallible<MeshHandle> {
    let options = CallOptions::new("extrude", options, &["crease_angle"])?;
    let depth = length("extrude", "depth", depth, true)?;
    made(modeling::extrude(&outlines(list)?, depth), &options)
}

/// A path, or points that a smooth one is laid through.
fn path_of(context: &NativeCallContext, path: &Dynamic) -> Fallible<Arc<Curve>> {
    if let Some(path) = path.read_lock::<PathHandle>() {
        return Ok(path.0.clone());
    }
    let Some(list) = path.read_lock::<Array>().map(|list| list.to_vec()) else {
        return complain(format!("expected a path or a list of points, found {}", describe(path)), None);
    };
    let curve = Curve::new(CurveKind::CatmullRom, &points(context, &list)?, false, DVec3::Y);
    curve.map(Arc::new).or_else(|message| complain(message, None))
}

fn swept(profile: &Outline, path: &Curve, options: &CallOptions) -> Fallible<MeshHandle> {
    let steps = options.whole("steps", (16 * path.pieces() as u64).min(SEGMENTS), 1, SEGMENTS)?;
    let twist = options.between("twist", 0.0, -1e6, 1e6)?;
    let taper = options.between("taper", 1.0, 0.0, 1e3)?;
    let caps = options.switch("caps", true)?;
    let closed = path.is_closed();
    let frame = |i: u64| {
        let share = i as f64 / steps as f64;
        let at = path.frame(share);
        let (sin, cos) = sin_cos_degrees(twist * share);
        let (across, up) = (at.binormal(), at.normal);
        PathFrame {
            position: at.position,
            across: across * cos + up * sin,
            up: up * cos - across * sin,
            share,
            scale: 1.0 + (taper - 1.0) * share,
        }
    };
    let count = if closed { steps } else { steps + 1 };
    let frames: Vec<PathFrame> = (0..count).map(frame).collect();
    made(modeling::sweep(profile, &frames, closed, caps), options)
}

fn tube(context: &NativeCallContext, path: &Dynamic, radius: &Dynamic, options: &Map) -> Fallible<MeshHandle> {
    let options = CallOptions::new("tube", options, &["sides", "steps", "taper", "caps", "crease_angle"])?;
    let sides = options.whole("sides", 32, 3, SEGMENTS)? as u32;
    let radius = length("tube", "radius", radius, false)?;
    swept(&circle(radius, sides), &*path_of(context, path)?, &options)
}

fn sweep(context: &NativeCallContext, profile: &Array, path: &Dynamic, options: &Map) -> Fallible<MeshHandle> {
    let options = CallOptions::new("sweep", options, &["steps", "twist", "taper", "caps", "crease_angle"])?;
    let profile = outline(profile)?;
    if profile.len() < 3 {
        return complain("sweep: a profile has three points at least", None);
    }
    swept(&profile, &*path_of(context, path)?, &options)
}

fn text(words: &str, options: &Map) -> Fallible<MeshHandle> {
    let options =
        CallOptions::new("text", options, &["size", "depth", "align", "line_spacing", "steps", "crease_angle"])?;
    let usual = TextLayout::default();
    let layout = TextLayout {
        size: options.between("size", usual.size, 1e-6, FARTHEST)?,
        depth: options.between("depth", usual.depth, 0.0, FARTHEST)?,
        align: match options.choice("align", &["left", "center", "right"])? {
            Some(1) => TextAlign::Center,
            Some(2) => TextAlign::Right,
            _ => TextAlign::Left,
        },
        line_spacing: options.between("line_spacing", usual.line_spacing, -1e3, 1e3)?,
        steps: options.whole("steps", u64::from(usual.steps), 1, 64)? as u32,
    };
    if words.trim().is_empty() {
        return complain("text: there is nothing to write", None);
    }
    made(modeling::text(words, &layout), &options)
}

const CREASE: (&str, &str) = (
    "options",
    "a map; of all of these `crease_angle`: edges that turn by more degrees are sharp, 0 to 180, default 40",
);

/// Registers a function with and without its last argument, a map of options.
macro_rules! with_options {
    ($engine:ident, $name:literal, |$($argument:ident: $type:ty),*| $call:expr) => {
        $engine
            .register_fn($name, |$($argument: $type),*, options: Map| ($call)($($argument),*, &options))
            .register_fn($name, |$($argument: $type),*| ($call)($($argument),*, &Map::new()))
    };
}

pub const CHAPTER: Chapter = Chapter {
    title: "Geometry",
    functions: &[
        Function {
            name: "lathe",
            forms: &["lathe(profile) -> mesh", "lathe(profile, options) -> mesh"],
            text: "A profile that is turned about the y axis, as a `mesh` for entities: `s.spawn(#{ mesh: lathe(...) })`. What is \
                   made once and put on many entities is stored once.",
            arguments: &[
                ("profile", "points [distance from the axis, height], world units; distances from 0"),
                (
                    "options",
                    "a map: `segments` of a turn, 3 to 4096, default 64; `angle` in degrees, above 0 to 360, default 360; \
                     `closed`, whether the last point joins the first, default false; `crease_angle`: edges that turn by \
                     more degrees are sharp, 0 to 180, default 40",
                ),
            ],
            example: "let vase = lathe([[0, 0], [0.5, 0], [0.3, 0.6], [0.4, 1]], #{ segments: 48 });\n\
                      s.spawn(#{ name: \"vase\", mesh: vase, material: \"brass\" }).bounds.size.y       // 1.0",
            register: |engine| {
                engine.register_type_with_name::<MeshHandle>("Mesh");
                with_options!(engine, "lathe", |profile: Array| |profile: Array, options: &Map| lathe(
                    &profile, options
                ));
            },
        },
        Function {
            name: "extrude",
            forms: &["extrude(outline, depth) -> mesh", "extrude(outline, depth, options) -> mesh"],
            text: "A flat outline with thickness, from -depth / 2 to depth / 2 along z. A list of outlines has holes: what lies in an \
                   odd number of them is filled.",
            arguments: &[
                ("outline", "points [x, y] of a closed polygon, three at least, or a list of such lists"),
                ("depth", "world units, from 0: the face alone"),
                CREASE,
            ],
            example: "let plate = extrude([[[0, 0], [2, 0], [2, 1], [0, 1]], [[0.5, 0.3], [1.5, 0.3], [1, 0.8]]], 0.25);\n\
                      s.spawn(#{ mesh: plate }).bounds.size       // vec3(2, 1, 0.25)",
            register: |engine| {
                with_options!(engine, "extrude", |list: Array, depth: Dynamic| {
                    |list: Array, depth: Dynamic, o: &Map| extrude(&list, &depth, o)
                });
            },
        },
        Function {
            name: "sweep",
            forms: &["sweep(profile, path) -> mesh", "sweep(profile, path, options) -> mesh"],
            text: "A closed profile that is moved along a path without rolling.",
            arguments: &[
                ("profile", "points [x, y], three at least: x to the right of who goes along the path, y up"),
                ("path", "a path, or points that a smooth one is laid through"),
                (
                    "options",
                    "a map: `steps` along the path, 1 to 4096, default 16 for each of its pieces; `twist`, degrees from end to \
                     end, default 0; `taper`, the size at the end, from 0, where 1 is that of the start, default 1; `caps`, \
                     whether open ends are closed, default true; `crease_angle` as for `lathe`",
                ),
            ],
            example: "let rail = sweep([[-0.1, 0], [0.1, 0], [0, 0.2]], [[0, 0, 0], [1, 0.5, 0], [2, 0, 0]], #{ twist: 90 });\n\
                      s.spawn(#{ mesh: rail, material: \"brass\" });",
            register: |engine| {
                type Context<'a> = NativeCallContext<'a>;
                engine
                    .register_fn("sweep", |c: Context, profile: Array, path: Dynamic| {
                        sweep(&c, &profile, &path, &Map::new())
                    })
                    .register_fn("sweep", |c: Context, profile: Array, path: Dynamic, options: Map| {
                        sweep(&c, &profile, &path, &options)
                    });
            },
        },
        Function {
            name: "tube",
            forms: &["tube(path, radius) -> mesh", "tube(path, radius, options) -> mesh"],
            text: "A round tube along a path.",
            arguments: &[
                ("path", "a path, or points that a smooth one is laid through"),
                ("radius", "world units, above 0"),
                (
                    "options",
                    "a map: `sides`, 3 to 4096, default 32; `steps`, `taper`, `caps` and `crease_angle` as for `sweep`",
                ),
            ],
            example: "let hose = tube([[0, 0, 0], [1, 1, 0], [2, 0, 1]], 0.1, #{ taper: 0.5 });\n\
                      s.spawn(#{ mesh: hose, material: \"brass\" });",
            register: |engine| {
                type Context<'a> = NativeCallContext<'a>;
                engine
                    .register_fn("tube", |c: Context, path: Dynamic, radius: Dynamic| {
                        tube(&c, &path, &radius, &Map::new())
                    })
                    .register_fn("tube", |c: Context, path: Dynamic, radius: Dynamic, options: Map| {
                        tube(&c, &path, &radius, &options)
                    });
            },
        },
        Function {
            name: "torus",
            forms: &["torus(radius, tube_radius) -> mesh", "torus(radius, tube_radius, options) -> mesh"],
            text: "A ring about the y axis.",
            arguments: &[
                ("radius", "from the axis to the middle of the ring, world units, above 0"),
                ("tube_radius", "of the ring itself, above 0, at most `radius`"),
                (
                    "options",
                    "a map: `segments` around the axis, 3 to 4096, default 96; `sides` around the ring, default 48; \
                     `crease_angle` as for `lathe`",
                ),
            ],
            example: "s.spawn(#{ mesh: torus(1, 0.25), material: \"brass\" }).bounds.size.y       // 0.5",
            register: |engine| {
                with_options!(engine, "torus", |radius: Dynamic, tube: Dynamic| |r: Dynamic, t: Dynamic, o: &Map| {
                    torus(&r, &t, o)
                });
            },
        },
        Function {
            name: "rounded_box",
            forms: &["rounded_box(size, radius) -> mesh", "rounded_box(size, radius, options) -> mesh"],
            text: "A box around the origin with round edges and corners.",
            arguments: &[
                ("size", "a vector, or one number for all sides, world units, above 0"),
                ("radius", "of the edges, from 0 to half of the smallest side"),
                (
                    "options",
                    "a map: `segments` of a quarter of a turn, 1 to 256, default 8; `crease_angle` as for `lathe`",
                ),
            ],
            example: "s.spawn(#{ mesh: rounded_box([2, 1, 1], 0.2), material: \"brass\" }).bounds.size       // vec3(2, 1, 1)",
            register: |engine| {
                with_options!(engine, "rounded_box", |size: Dynamic, radius: Dynamic| {
                    |s: Dynamic, r: Dynamic, o: &Map| rounded_box(&s, &r, o)
                });
            },
        },
        Function {
            name: "disk",
            forms: &["disk(radius) -> mesh", "disk(radius, options) -> mesh"],
            text: "A flat disk about the y axis that faces up.",
            arguments: &[
                ("radius", "world units, above 0"),
                (
                    "options",
                    "a map: `inner`, the radius of a hole, from 0, default 0; `segments`, 3 to 4096, default 96; `angle` in \
                     degrees, above 0 to 360, default 360; `crease_angle` as for `lathe`",
                ),
            ],
            example: "s.spawn(#{ mesh: disk(1, #{ inner: 0.5, angle: 90 }), material: \"brass\" });",
            register: |engine| {
                with_options!(engine, "disk", |radius: Dynamic| |radius: Dynamic, o: &Map| disk(&radius, o));
            },
        },
        Function {
            name: "text",
            forms: &["text(words) -> mesh", "text(words, options) -> mesh"],
            text: "Words as a body that is read from +z, in the font that is built in: Latin with its accents, Greek and Cyrillic, \
                   kerned. The first base line is y = 0; lines end at `\\n`.",
            arguments: &[
                ("words", "a text"),
                (
                    "options",
                    "a map: `size` of an em in world units, default 1, of which capitals are 0.714; `depth`, from 0, default \
                     0.2; `align`, \"left\" (it starts at x = 0, the default), \"center\" or \"right\"; `line_spacing` in ems, \
                     default 1.3; `steps` of a curve, 1 to 64, default 8; `crease_angle` as for `lathe`",
                ),
            ],
            example: "let title = s.spawn(#{ mesh: text(\"Hello\", #{ size: 0.5, depth: 0.25, align: \"center\" }), material: \"brass\" });\n\
                      title.bounds.size.z       // 0.25",
            register: |engine| {
                with_options!(engine, "text", |words: ImmutableString| |words: ImmutableString, o: &Map| text(
                    &words, o
                ));
            },
        },
    ],
};
