//! The cameras of a scene: cuts from one to another, and what lies between two.

use ::rhai::{Dynamic, Engine, ImmutableString, Map};

use super::context::ScriptContext;
use super::convert::{describe, number, to_dynamic};
use super::errors::{Fallible, complain};
use super::fields::{checked, set_field};
use super::handles::{RecordHandle, SceneHandle};
use super::overlay::ActiveCamera;
use super::table::{Chapter, Function};
use crate::base::diagnostics::suggestion;
use crate::base::limits;
use crate::base::rotation::slerp_direction;
use crate::components::*;

/// The named cameras of a scene: `s.cameras.close`.
#[derive(Clone)]
struct CameraLookup(SceneHandle);

/// A camera between two others.
#[derive(Clone)]
struct BlendedCamera(Camera);

fn find(scene: &SceneHandle, name: &str) -> Fallible<ActiveCamera> {
    let overlay = scene.lock();
    if let Some(which) = overlay.find_camera(name) {
        return Ok(which);
    }
    let named = overlay.cameras().iter().map(|(known, _)| &**known);
    complain(format!("there is no camera `{name}`"), suggestion(name, named.chain([Scene::DEFAULT_CAMERA])))
}

/// Sees the frame from the camera of a name, one of `s.cameras`, or a blend.
pub fn choose(scene: &mut SceneHandle, value: Dynamic) -> Fallible<()> {
    let which = if let Some(name) = value.read_lock::<ImmutableString>() {
        find(scene, &name)?
    } else if let Some(BlendedCamera(camera)) = value.read_lock::<BlendedCamera>().as_deref() {
        ActiveCamera::Blended(Box::new(camera.clone()))
    } else if let Some(handle) = value.clone().try_cast::<RecordHandle>() {
        match handle.as_camera() {
            // What a write to a field of it puts back.
            Some(None) => return Ok(()),
            Some(Some(which)) => which.clone(),
            None => return complain("`s.camera` takes a camera, not another component", None),
        }
    } else {
        let help = "write the name of one of the scene's `cameras`, or set a field: s.camera.fov = 35";
        return complain(format!("`s.camera` takes a camera, found {}", describe(&value)), Some(help.into()));
    };
    scene.lock().choose_camera(which);
    Ok(())
}

fn add(scene: &mut SceneHandle, name: &str, fields: &Map) -> Fallible<RecordHandle> {
    let owner = format!("camera `{name}`");
    let mut camera = Camera::default();
    for (field, value) in fields {
        set_field(&mut camera, field, value, &owner)?;
    }
    checked(&camera, &owner)?;
    let mut overlay = scene.lock();
    if overlay.find_camera(name).is_some() {
        return complain(format!("there is already a camera `{name}`"), None);
    }
    if overlay.cameras().len() >= limits::CAMERAS || name.len() > limits::TEXT_BYTES {
        return complain(format!("a scene has {} cameras at most", limits::CAMERAS), None);
    }
    let which = overlay.add_camera(name.into(), camera);
    drop(overlay);
    Ok(scene.camera_of(which))
}

/// A camera where it stands: where the entity is that carries it, if one does.
pub fn standing(scene: &SceneHandle, camera: Camera) -> Fallible<Camera> {
    let Some(name) = camera.entity.clone() else { return Ok(camera) };
    let entity = scene.clone().get(&name)?;
    let component = entity.component(Kind::Viewpoint);
    let placed = camera.carried(&entity.placement(), component.as_ref().and_then(Viewpoint::of));
    Ok(Camera { entity: None, ..placed })
}

/// A camera by its name, as a component, or as a blend of others.
fn camera_of(scene: &SceneHandle, subject: &Dynamic) -> Fallible<Camera> {
    if let Some(name) = subject.read_lock::<ImmutableString>() {
        let which = find(scene, &name)?;
        return Ok(scene.lock().camera_of(&which).clone());
    }
    if let Some(BlendedCamera(camera)) = subject.read_lock::<BlendedCamera>().as_deref() {
        return Ok(camera.clone());
    }
    let handle = subject.clone().try_cast::<RecordHandle>();
    match handle.as_ref().and_then(RecordHandle::as_camera) {
        Some(None) => Ok(scene.camera()),
        Some(Some(which)) => Ok(scene.lock().camera_of(which).clone()),
        None => complain(format!("expected a camera or the name of one, found {}", describe(subject)), None),
    }
}

/// How far before a camera it is focused.
fn focus_distance(scene: &SceneHandle, camera: &Camera) -> Fallible<f64> {
    let point = match (&camera.focus_distance, &camera.focus) {
        (Some(distance), _) => return Ok(*distance),
        (None, None) => return Ok(camera.from.distance(camera.at)),
        (None, Some(Focus::Point(point))) => *point,
        (None, Some(Focus::Entity(name))) => scene.position(name)?,
    };
    match (point - camera.from).dot(camera.axis()) {
        distance if distance > 0.0 => Ok(distance),
        _ => complain("blend: what a camera is focused on is not in front of it", None),
    }
}

fn blend(scene: &SceneHandle, from: &Dynamic, to: &Dynamic, t: f64) -> Fallible<BlendedCamera> {
    let (from, to) = (camera_of(scene, from)?, camera_of(scene, to)?);
    if t == 0.0 || t == 1.0 {
        return Ok(BlendedCamera(if t == 0.0 { from } else { to }));
    }
    let [a, b] = [standing(scene, from)?, standing(scene, to)?];
    if a.projection != b.projection {
        let names = [a.projection.name(), b.projection.name()].join(" and ");
        return complain(
            format!("cameras with different projections, {names}, are not blended: cut between them"),
            None,
        );
    }
    let mix = |a: f64, b: f64| a + (b - a) * t;
    let nearer = if t < 0.5 { &a } else { &b };
    let focal_length = a.focal_length.zip(b.focal_length).map(|(a, b)| mix(a, b));
    let f_stop = a.f_stop.zip(b.f_stop).filter(|_| focal_length.is_some()).map(|(a, b)| mix(a, b));
    let size = scene.lock().render().size;
    let aspect = f64::from(size[0]) / f64::from(size[1].max(1));
    let is_parallel = a.projection == Projection::Orthographic;
    let focus_distance = if a.lens_radius() > 0.0 || b.lens_radius() > 0.0 {
        let [near, far] = [focus_distance(scene, &a)?, focus_distance(scene, &b)?];
        // As a focus ring turns.
        Some(1.0 / mix(1.0 / near, 1.0 / far))
    } else {
        nearer.focus_distance
    };
    Ok(BlendedCamera(Camera {
        from: a.from.lerp(b.from, t),
        at: a.at.lerp(b.at, t),
        up: slerp_direction(a.up, b.up, t),
        fov: mix(field_of_view(&a, aspect), field_of_view(&b, aspect)),
        height: if is_parallel { Some(2.0 * mix(a.half_extent(aspect), b.half_extent(aspect))) } else { nearer.height },
        shift: a.shift.lerp(b.shift, t),
        focus_distance,
        focus: None,
        aperture: mix(a.lens_radius(), b.lens_radius()),
        blade_angle: mix(a.blade_angle, b.blade_angle),
        focal_length,
        f_stop,
        sensor_width: mix(a.sensor_width, b.sensor_width),
        meters_per_unit: mix(a.meters_per_unit, b.meters_per_unit),
        shutter: a.shutter.lerp(b.shutter, t),
        ..nearer.clone()
    }))
}

/// The vertical field of view in degrees, whichever way it is given.
fn field_of_view(camera: &Camera, aspect: f64) -> f64 {
    match camera.focal_length {
        Some(_) => 2.0 * libm::atan(camera.half_height(aspect)).to_degrees(),
        None => camera.fov,
    }
}

fn types(engine: &mut Engine) {
    engine
        .register_type_with_name::<CameraLookup>("Cameras")
        .register_get("cameras", |s: &mut SceneHandle| CameraLookup(s.clone()))
        .register_set("cameras", |_: &mut SceneHandle, _: CameraLookup| {})
        .register_indexer_get(|all: &mut CameraLookup, name: ImmutableString| -> Fallible<RecordHandle> {
            Ok(all.0.camera_of(find(&all.0, &name)?))
        })
        .register_indexer_set(|all: &mut CameraLookup, name: ImmutableString, value: Dynamic| -> Fallible<()> {
            match value.is::<RecordHandle>() && find(&all.0, &name).is_ok() {
                // What a write to a field of it puts back.
                true => Ok(()),
                false => {
                    complain(format!("cameras are not assigned: write s.add_camera(\"{name}\", #{{ ... }})"), None)
                }
            }
        })
        .register_type_with_name::<BlendedCamera>("Camera")
        .register_indexer_get(|camera: &mut BlendedCamera, field: ImmutableString| -> Fallible<Dynamic> {
            match camera.0.get(&field) {
                Some(value) => Ok(to_dynamic(value)),
                None => complain(
                    format!("unknown field `{field}` of a camera"),
                    suggestion(&field, Camera::FIELDS.iter().copied()),
                ),
            }
        });
}

pub const CHAPTER: Chapter = Chapter {
    title: "Cameras",
    functions: &[
        Function {
            name: "cameras",
            forms: &["s.cameras -> cameras"],
            text: "The scene's named cameras, each by its name: `s.cameras.close`, or `s.cameras[\"close\"]`. Their fields are \
                   those of `camera`; what is written to one shows where it is chosen: `s.camera = \"close\"`.",
            arguments: &[],
            example: "s.cameras.close.fov = 20;\ns.camera = \"close\";\ns.camera.fov       // 20.0",
            register: types,
        },
        Function {
            name: "add_camera",
            forms: &["s.add_camera(name, fields) -> component"],
            text: "Adds a named camera.",
            arguments: &[
                ("name", "a text that no other camera has, and not `camera`"),
                ("fields", "a map of the fields of a camera that differ from their defaults"),
            ],
            example: "s.add_camera(\"top\", #{ from: [0, 9, 0], up: [0, 0, -1] });\n\
                      if f.t > 0.5 { s.camera = \"top\"; }",
            register: |engine| {
                engine.register_fn("add_camera", |s: &mut SceneHandle, name: &str, fields: Map| add(s, name, &fields));
            },
        },
        Function {
            name: "blend",
            forms: &["blend(from, to, t) -> camera"],
            text: "A camera between two others, to be assigned to `s.camera`: place, direction, field of view, lens and shutter \
                   go over from one to the other, the focus evenly in 1 / distance. What both look at stays in the middle. \
                   Both have the same projection.",
            arguments: &[
                ("from", "the name of a camera, `\"camera\"` for the scene's own, or one of `s.cameras`"),
                ("to", "a name of a camera, or a camera: the same as for `from`"),
                ("t", "0 for the first, 1 for the second"),
            ],
            example: "s.camera = blend(\"camera\", \"close\", ease(\"in_out_cubic\", f.span(0.4, 0.6)));\n\
                      blend(\"camera\", \"close\", 0.5).fov       // 32.5",
            register: |engine| {
                engine.register_fn("blend", |from: Dynamic, to: Dynamic, t: Dynamic| -> Fallible<BlendedCamera> {
                    blend(&ScriptContext::current_scene("blend")?, &from, &to, number(&t)?)
                });
            },
        },
    ],
};
