//! What is given and counts for nothing, because another setting takes its place or nothing asks for it.
//!
//! A field is taken for given where it has another value than its default.

use glam::DVec3;

use super::idle::{IdleField, LEAVE_OUT, Unused, idle_of};
use super::unused_material;
use crate::base::diagnostics::{ScenePart, Subject};
use crate::components::*;

/// All that counts for nothing in one scene.
pub(super) fn in_scene(scene: &Scene) -> Vec<Unused> {
    let mut found = camera_fields(scene);
    found.extend(render_fields(&scene.render, scene.camera.shutter.x < scene.camera.shutter.y));
    found.extend(unused_material::in_scene(scene));
    found.extend(parts_of_entities(scene));
    found
}

/// What counts for nothing in all of these scenes: what a script only does at times is meant. What another setting takes the
/// place of must be so before frames change anything, too.
pub(super) fn in_all<'a>(before: Option<&Scene>, scenes: impl IntoIterator<Item = &'a Scene>) -> Vec<Unused> {
    let mut scenes = scenes.into_iter();
    let mut found = scenes.next().map(in_scene).unwrap_or_default();
    let is_in = |one: &Unused, scene: &[Unused]| scene.iter().any(|other| other.subject == one.subject);
    for scene in scenes {
        let here = in_scene(scene);
        found.retain(|one| is_in(one, &here));
    }
    if let Some(before) = before.filter(|_| found.iter().any(|one| one.is_hidden)) {
        let before = in_scene(before);
        found.retain(|one| !one.is_hidden || is_in(one, &before));
    }
    found
}

const OPEN: &str = "give the lens an `aperture`, or `focal_length` and `f_stop`";

fn camera_fields(scene: &Scene) -> Vec<Unused> {
    let (camera, usual) = (&scene.camera, Camera::default());
    let is_parallel = camera.projection == Projection::Orthographic;
    let has_view = camera.entity.is_none();
    let is_whitted = scene.render.integrator == Integrator::Whitted;
    let is_photographic = camera.focal_length.is_some() && camera.f_stop.is_some();
    let is_pinhole = camera.lens_radius() == 0.0;
    let has_fov = camera.fov != usual.fov;
    let pinhole = || "is only used by an open lens".to_string();
    let whitted = || "is not used by `Whitted`".to_string();
    let all = "`Distribution` and `Path` are for lenses and for motion";
    let fields = [
        (
            "height",
            camera.height.is_some() && !is_parallel && has_view,
            "is only used by an `Orthographic` camera".into(),
            "",
        ),
        (
            "fov",
            has_fov && is_parallel && camera.height.is_some(),
            "is only used by a camera without `height`".into(),
            LEAVE_OUT,
        ),
        (
            "fov",
            has_fov && camera.focal_length.is_some() && has_view && !(is_parallel && camera.height.is_some()),
            "is not used: `focal_length` takes its place".into(),
            LEAVE_OUT,
        ),
        (
            "aperture",
            camera.aperture > 0.0 && is_photographic,
            "is not used: `focal_length` and `f_stop` say how wide the lens is".into(),
            "leave `f_stop` or `aperture` out",
        ),
        (
            "focus",
            camera.focus.is_some() && camera.focus_distance.is_some(),
            "is not used: `focus_distance` takes its place".into(),
            LEAVE_OUT,
        ),
        ("focus", camera.focus.is_some() && camera.focus_distance.is_none() && is_pinhole, pinhole(), OPEN),
        ("focus_distance", camera.focus_distance.is_some() && is_pinhole, pinhole(), OPEN),
        ("lens", camera.lens != usual.lens && is_pinhole, pinhole(), OPEN),
        ("blades", camera.blades > 0 && is_pinhole, format!("{}: give it an `aperture`", pinhole()), ""),
        (
            "blade_angle",
            camera.blade_angle != 0.0 && camera.blades == 0,
            "turns the `blades` of the iris, of which there are none".into(),
            "give it `blades: 6`",
        ),
        (
            "sensor_width",
            camera.sensor_width != usual.sensor_width && camera.focal_length.is_none(),
            "is only used beside `focal_length`".into(),
            "give the lens in millimetres: `focal_length: 35.0`",
        ),
        (
            if is_photographic { "f_stop" } else { "aperture" },
            !is_pinhole && is_whitted,
            format!("{}, whose camera is a pinhole", whitted()),
            all,
        ),
        (
            "shutter",
            camera.shutter.x < camera.shutter.y && is_whitted,
            format!("{}, whose pictures are of one moment", whitted()),
            all,
        ),
    ];
    idle_of(ScenePart::Camera, None, "camera", fields)
}

/// What is said of a field of view that stands beside a focal length.
pub(super) fn hidden_fov() -> Option<Unused> {
    let fov = Camera::default().fov + 1.0;
    let camera = Camera { fov, focal_length: Some(35.0), ..Camera::default() };
    camera_fields(&Scene { camera, ..Scene::default() }).into_iter().find(|unused| unused.subject.field == Some("fov"))
}

/// What takes the place of other surroundings, and its name.
fn surroundings(render: &Render) -> Option<&'static str> {
    let all = [
        ("environment", render.environment.is_some()),
        ("daylight", render.daylight.is_some()),
        ("sky", render.sky.is_some()),
    ];
    all.into_iter().find(|(_, is_given)| *is_given).map(|(name, _)| name)
}

/// How many samples of a number that is given are taken: the rest of a square is left out.
fn rounded(field: &str, given: u32, taken: u32) -> (bool, String) {
    let side = taken.isqrt();
    let next = (side + 1) * (side + 1);
    let square = if side * side == taken { format!(", a square of {side} x {side}") } else { String::new() };
    (
        given != taken,
        format!("is rounded down from {given} to {taken}{square}: write `{field}: {taken}` or `{field}: {next}`"),
    )
}

fn render_fields(render: &Render, is_shutter_open: bool) -> Vec<Unused> {
    let usual = Render::default();
    let around = surroundings(render);
    let is_photon = render.integrator == Integrator::Photon;
    let is_whitted = render.integrator == Integrator::Whitted;
    let follows_paths = matches!(render.integrator, Integrator::Path | Integrator::Photon);
    let hidden = |what: &str| format!("is not seen: `{what}` takes its place");
    let only = |what: &str| format!("is only used by {what}");
    let one_sample = render.strata() == 1;
    let taken = render.rounds() * render.strata().pow(2);
    let (is_cut, cut) = rounded("samples", render.samples, taken);
    let is_fixed = !is_whitted
        && match render.shadows {
            Shadows::Fixed => true,
            Shadows::Auto => one_sample && !follows_paths,
            Shadows::Hard | Shadows::Random | Shadows::Jittered => false,
        };
    let (is_shadow_cut, shadow_cut) =
        rounded("shadow_samples", render.shadow_samples, render.shadow_samples.isqrt().pow(2));
    let more = "give more: `samples: 16`";
    let fields = [
        ("background", render.background != DVec3::ZERO && around.is_some(), hidden(around.unwrap_or("")), LEAVE_OUT),
        ("daylight", render.daylight.is_some() && around != Some("daylight"), hidden(around.unwrap_or("")), LEAVE_OUT),
        ("sky", render.sky.is_some() && around != Some("sky"), hidden(around.unwrap_or("")), LEAVE_OUT),
        (
            "environment_intensity",
            render.environment_intensity != 1.0 && around.is_none(),
            only("`environment`, `daylight` or `sky`, of which there is none"),
            "",
        ),
        (
            "environment_rotation",
            render.environment_rotation != 0.0 && matches!(around, None | Some("sky")),
            only("`environment` or `daylight`, of which there is none"),
            "",
        ),
        ("samples", is_cut, cut, ""),
        ("denoise", render.denoise && one_sample, "does nothing with one sample a pixel".into(), more),
        (
            "noise_threshold",
            render.noise_threshold.is_some() && one_sample,
            "does nothing with one sample a pixel".into(),
            more,
        ),
        (
            "min_samples",
            render.min_samples != usual.min_samples && render.noise_threshold.is_none(),
            "is only used beside a `noise_threshold`".into(),
            "",
        ),
        (
            "shadow_samples",
            render.shadow_samples != usual.shadow_samples && !is_fixed,
            only("`shadows: Fixed`, and by `Auto` where a pixel has one sample"),
            "",
        ),
        ("shadow_samples", is_shadow_cut && is_fixed, shadow_cut, ""),
        (
            "shadows",
            render.shadows != usual.shadows && is_whitted,
            "is not used by `Whitted`, whose shadows are hard".into(),
            "",
        ),
        (
            "light_size",
            render.light_size > 0.0 && (is_whitted || render.shadows == Shadows::Hard),
            "is for soft shadows, and these are hard".into(),
            "`Distribution` and `Path` have soft ones, unless `shadows` is `Hard`",
        ),
        ("min_weight", render.min_weight > 0.0 && follows_paths, only("`Whitted` and `Distribution`"), ""),
        ("photons", render.photons != usual.photons && !is_photon, only("`Photon`"), ""),
        ("photon_passes", render.photon_passes != usual.photon_passes && !is_photon, only("`Photon`"), ""),
        ("photon_radius", render.photon_radius.is_some() && !is_photon, only("`Photon`"), ""),
        (
            "transparent_shadows",
            render.transparent_shadows && is_photon,
            "is not used by `Photon`, whose photons go through glass by themselves".into(),
            "",
        ),
        (
            "grid_density",
            render.grid_density != usual.grid_density && render.accel != Accel::Grid,
            "is only used by `accel: Grid`".into(),
            "",
        ),
        (
            "dither",
            render.dither && render.bit_depth != 8,
            format!("is for pictures of 8 bits, and this one has {}", render.bit_depth),
            "",
        ),
        (
            "shutter_slices",
            render.shutter_slices != usual.shutter_slices && !is_shutter_open,
            "is only used while the camera's `shutter` is open".into(),
            "open it: `camera: (shutter: (0.0, 0.5))`",
        ),
    ];
    let mut found = idle_of(ScenePart::Render, None, "render", fields);
    if let Some(help) = unused_material::bytes_for_color(render.background, 16.0) {
        let subject = Subject { part: ScenePart::Render, component: None, field: Some("background") };
        let message = "render: `background` looks like a colour from 0 to 255".to_string();
        found.push(Unused { subject, message, help: Some(help), is_hidden: false });
    }
    found
}

/// Colour, brightness and falloff of the lights of an entity.
fn lights_of(desc: &EntityDesc) -> Vec<(Kind, DVec3, f64, Falloff)> {
    let point = desc.component::<PointLight>().map(|l| (PointLight::KIND, l.color, l.intensity, l.falloff));
    let spot = desc.component::<SpotLight>().map(|l| (SpotLight::KIND, l.color, l.intensity, l.falloff));
    let area = desc.component::<AreaLight>().map(|l| (AreaLight::KIND, l.color, l.intensity, l.falloff));
    let sun = desc.component::<DirectionalLight>();
    let sun = sun.map(|l| (DirectionalLight::KIND, l.color, l.intensity, Falloff::Constant));
    [point, spot, area, sun].into_iter().flatten().collect()
}

fn parts_of_entities(scene: &Scene) -> Vec<Unused> {
    let mut found = Vec::new();
    for (index, desc) in scene.entities.iter().enumerate() {
        let part = ScenePart::Entity(index);
        let mut tell = |kind: Kind, fields: Vec<IdleField>| {
            let owner = format!("`{}` of {}", kind.name(), desc.label(index));
            found.extend(idle_of(part, Some(kind.name()), &owner, fields));
        };
        for (kind, color, intensity, falloff) in lights_of(desc) {
            tell(kind, fields_of_light(color, intensity, falloff));
        }
        if let Some(transform) = desc.component::<Transform>().filter(|transform| transform.matrix.is_some()) {
            let (hidden, usual) = (|| "is not used: `matrix` takes its place".to_string(), Transform::default());
            tell(
                Transform::KIND,
                vec![
                    ("translation", transform.translation != usual.translation, hidden(), LEAVE_OUT),
                    ("rotation", transform.rotation != usual.rotation, hidden(), LEAVE_OUT),
                    ("scale", transform.scale != usual.scale, hidden(), LEAVE_OUT),
                ],
            );
        }
        if let Some(light) = desc.component::<AreaLight>() {
            let is_seen = scene.render.integrator == Integrator::Path && light.falloff == Falloff::InverseSquare;
            let why = "is only used by `integrator: Path` and `falloff: InverseSquare`".to_string();
            let is_hidden = light.edges.is_some() && light.size != AreaLight::default().size;
            let edges = "is not used: `edges` take its place".to_string();
            tell(
                AreaLight::KIND,
                vec![("visible", light.visible && !is_seen, why, ""), ("size", is_hidden, edges, LEAVE_OUT)],
            );
        }
        if let Some(motion) = desc.component::<Motion>() {
            let [open, close] = scene.camera.shutter.to_array();
            let stands = open == close && motion.at(open) == DVec3::ZERO && motion.displacement != DVec3::ZERO;
            let why = "moves nothing while the camera's `shutter` is closed".to_string();
            let help = "open it: `camera: (shutter: (0.0, 0.5))`; a script moves entities from frame to frame";
            tell(Motion::KIND, vec![("displacement", stands, why, help)]);
        }
        // What a file lacks is told where it is read.
        let is_empty = |mesh: &&Mesh| mesh.data.triangles.is_empty() && mesh.file.is_none();
        if desc.component::<Mesh>().filter(is_empty).is_some() {
            let help = Some("give it `vertices` and `triangles`, or a `file`".to_string());
            let message = format!("`mesh` of {} has no triangles: nothing of it shows", desc.label(index));
            let subject = Subject { part, component: Some(Mesh::KIND.name()), field: None };
            found.push(Unused { subject, message, help, is_hidden: false });
        }
    }
    found
}

fn fields_of_light(color: DVec3, intensity: f64, falloff: Falloff) -> Vec<IdleField> {
    // What weakens with distance may well start with hundreds.
    let least = if falloff == Falloff::Constant { 16.0 } else { 255.0 };
    let is_bytes = unused_material::bytes_for_color(color, least).is_some();
    let bytes = "colours are linear and 1 is full: divide by 255, and set `intensity` for how bright it is";
    let is_black = color == DVec3::ZERO && intensity > 0.0;
    vec![
        ("intensity", intensity == 0.0, "is 0: the light sends out none".into(), "1 is the usual one"),
        ("color", is_black, "is black: the light sends out none".into(), ""),
        ("color", is_bytes, "looks like a colour from 0 to 255".into(), bytes),
    ]
}
