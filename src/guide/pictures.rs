//! Small pictures of what can be chosen, made by this program from scenes that the choice is written into.

use std::sync::atomic::AtomicBool;

use super::{entity_records, other_records};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::project::Folder;
use crate::components::{Component, Kind, Render, Role};
use crate::film::DisplayTransform;
use crate::load;
use crate::output::{Metadata, encode_rgb8};
use crate::systems;

/// A picture of the guide.
pub struct GuidePicture {
    /// The record that it belongs to: `material`.
    pub record: &'static str,
    /// Its field: `model`. Empty for the record as a whole.
    pub field: &'static str,
    /// What it shows: `Conductor`, or the record.
    pub choice: String,
    /// The scene that it is of, as RON.
    pub scene: String,
}

/// Pictures of each of so many pixels.
const SIZE: [u32; 2] = [120, 80];
/// Choices that look alike.
const ALIKE: [&str; 5] = ["accel", "light_sampler", "encoding", "transfer", "uv_set"];

impl GuidePicture {
    /// Its file, beside the pages.
    pub fn file(&self) -> String {
        let parts = [self.record, self.field, &self.choice];
        let name: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        format!("{}.png", name.join("-"))
    }

    /// The picture as a PNG.
    ///
    /// # Errors
    /// A scene that is wrong, which is a mistake of the program.
    pub fn encode(&self) -> Result<Vec<u8>, Diagnostics> {
        let (scene, _) = load::ron::parse(&self.scene, &self.file(), &Folder::default())?;
        let display = DisplayTransform::new(&scene.render);
        let mut stage = systems::spawn(scene)?;
        let never = AtomicBool::new(false);
        let rendered = systems::render(&mut stage, &never, &|_, _| {})?;
        let (film, _) = rendered.ok_or_else(|| Diagnostic::bug("nobody interrupts a picture of the guide"))?;
        let encoded = encode_rgb8(&film.to_rgb8(display), SIZE, &Metadata::default());
        Ok(encoded.map_err(|error| Diagnostic::bug(format!("a picture of the guide: {error}")))?)
    }
}

/// Every picture: one of each shape and light, and one of each word that a field may be, where it shows.
pub fn pictures() -> Vec<GuidePicture> {
    let mut all = Vec::new();
    for kind in Kind::ALL {
        let entity = match kind.role() {
            Role::Shape if !matches!(kind.default_component(), Component::Mesh(_)) => body(kind.name()),
            Role::Light => light(kind.name(), ""),
            _ => continue,
        };
        let scene = studio("", "", "", &entity, kind.role() != Role::Light);
        all.push(GuidePicture { record: kind.name(), field: "", choice: String::new(), scene });
    }
    // A texture is a part of materials and a component: one and the same record.
    let mut records = other_records();
    records.extend(entity_records().into_iter().filter(|one| one.name != "texture" && one.name != "material"));
    for record in records {
        for field in record.fields.iter().filter(|field| !ALIKE.contains(&field.name)) {
            for (choice, _) in &field.choices {
                let said = format!("{}: {choice}", field.name);
                if let Some(scene) = scene_of(record.name, field.name, &said) {
                    all.push(GuidePicture { record: record.name, field: field.name, choice: choice.clone(), scene });
                }
            }
        }
    }
    all
}

/// A scene that shows what a field of a record says; `None` where it would not show.
fn scene_of(record: &str, field: &str, said: &str) -> Option<String> {
    let ball = "(sphere: (radius: 0.8), transform: (translation: (0, 0.8, 0)), material: \"m\")";
    Some(match (record, field) {
        ("material", "model") => {
            studio("", "", &format!("{said}, ior: 1.5, roughness: 0.25, specular: 0.4"), ball, true)
        }
        ("material", _) => return None,
        ("texture", "pattern") => {
            studio("", "", &format!("color_map: ({said}, scale: (0.25, 0.25, 0.25))"), ball, true)
        }
        ("render", "integrator") => {
            let glass = "(sphere: (radius: 0.8), transform: (translation: (0, 0.8, 0)), material: \"m\")";
            let more = "photons: 20000, photon_passes: 4, background: (0.1, 0.12, 0.15)";
            studio(&format!("{said}, {more}"), "", "model: Dielectric, ior: 1.5", glass, true)
        }
        ("render", "aovs" | "filter") => return None,
        ("render", "tone_map") => studio(&format!("{said}, exposure: 1.5"), "", "", ball, true),
        ("render", _) => studio(&format!("{said}, light_size: 1.5, shadow_samples: 4"), "", "", ball, true),
        ("camera", "lens") => {
            let lights = "(sphere: (radius: 0.05), transform: (translation: (0, 1, -3)), material: \"glow\"), \
                          (sphere: (radius: 0.05), transform: (translation: (1.2, 1.6, -3)), material: \"glow\")";
            studio("samples: 64", &format!("{said}, aperture: 0.5, focus_distance: 2.5"), "", lights, true)
        }
        ("camera", "projection") => studio("", said, "", ball, true),
        (light_kind, _) if light_kind.ends_with("_light") => studio("", "", "", &light(light_kind, said), false),
        _ => return None,
    })
}

/// A shape as it is without being told more, lifted where it would lie in the floor.
fn body(kind: &str) -> String {
    let (fields, lift) = match kind {
        "plane" => ("normal: (0, 1, 0.4), point: (0, 0.4, 0)", 0.0),
        "triangle" => ("vertices: ((-1, 0, 0), (1, 0, 0), (0, 1.6, 0))", 0.0),
        "sphere" => ("radius: 0.8", 0.8),
        _ => ("", 0.6),
    };
    format!(
        "({kind}: ({fields}), transform: (translation: (0, {lift}, 0), rotation: (0, 30, 0), scale: 0.9), material: \"m\")"
    )
}

/// A light over a ball.
fn light(kind: &str, said: &str) -> String {
    let fields = match kind {
        "area_light" => "position: (1.5, 2.5, 1.5), size: (1.5, 1.5), color: (1, 1, 1)",
        "directional_light" => "direction: (-1, -2, -1), angle: 2, color: (0.8, 0.8, 0.8)",
        "spot_light" => "position: (1.5, 2.5, 1.5), direction: (-1.5, -2.2, -1.5), color: (1, 1, 1), outer_angle: 30",
        _ => "position: (1.5, 2.5, 1.5), color: (0.8, 0.8, 0.8)",
    };
    // As bright at the ball, whether it falls off or not.
    let bright = if said.contains("InverseSquare") { ", intensity: 9" } else { "" };
    let comma = if said.is_empty() { "" } else { ", " };
    format!(
        "({kind}: ({fields}{bright}{comma}{said})), \
         (sphere: (radius: 0.6), transform: (translation: (0, 0.6, 0)), material: \"m\")"
    )
}

/// A floor with whatever is said of settings, camera, material and entities.
fn studio(render: &str, camera: &str, material: &str, entities: &str, is_lit: bool) -> String {
    let [width, height] = SIZE;
    let usual = Render::default();
    let given = |list: &str, name: &str, value: String| {
        if list.contains(&format!("{name}:")) { String::new() } else { format!("{name}: {value}, ") }
    };
    let samples = given(render, "samples", usual.samples.to_string());
    let background = given(render, "background", "(0.25, 0.28, 0.33)".into());
    let color = if material.contains("color") { String::new() } else { "color: (0.85, 0.5, 0.25), ".into() };
    let lamp = "(area_light: (size: (1.5, 1.5), color: (0.8, 0.8, 0.8)), transform: (translation: (2, 3, 2.5))),";
    format!(
        "(
    camera: (from: (0, 1.5, 4), at: (0, 0.7, 0), fov: 38.0, {camera}),
    render: (size: ({width}, {height}), {samples}{background}{render}),
    materials: {{
        \"m\": ({color}{material}),
        \"floor\": (model: Lambert, color_map: (pattern: Checker, colors: [(0.5, 0.5, 0.5), (0.3, 0.3, 0.3)])),
        \"glow\": (emission: (6, 5, 4)),
    }},
    entities: [{} (plane: (), material: \"floor\"), {entities}],
)",
        if is_lit { lamp } else { "" }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_picture_is_of_a_scene_that_loads_and_shows_its_choice() {
        let all = pictures();
        for picture in &all {
            let read = load::ron::parse(&picture.scene, &picture.file(), &Folder::default());
            read.unwrap_or_else(|problems| panic!("{}: {problems}\n{}", picture.file(), picture.scene));
        }
        let of = |record: &str, field: &str| all.iter().filter(|p| p.record == record && p.field == field).count();
        assert_eq!((of("material", "model"), of("render", "integrator"), of("camera", "projection")), (7, 4, 3));
        assert!(of("texture", "pattern") > 3 && of("sphere", "") == 1 && of("spot_light", "") == 1);
        let mut names: Vec<String> = all.iter().map(GuidePicture::file).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), all.len());
    }

    #[test]
    fn pictures_are_the_same_bytes_each_time_and_differ_by_their_choice() {
        let all = pictures();
        let of = |name: &str| all.iter().find(|picture| picture.file() == name).unwrap().encode().unwrap();
        let [metal, glass] = ["material-model-Conductor.png", "material-model-Dielectric.png"].map(of);
        assert!(metal == of("material-model-Conductor.png") && metal != glass && metal.starts_with(b"\x89PNG"));
    }
}
