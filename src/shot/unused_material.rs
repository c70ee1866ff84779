//! Fields of materials that are given and that their models do not look at, and colours in the numbers of other programs.

use glam::DVec3;

use super::idle::{IdleField, Unused, idle_of};
use crate::base::diagnostics::{ScenePart, Subject};
use crate::components::*;

/// What counts for nothing in the materials of a scene.
pub(super) fn in_scene(scene: &Scene) -> Vec<Unused> {
    let mut found = Vec::new();
    for (index, (name, material)) in scene.materials.iter().enumerate() {
        let owner = format!("material `{name}`");
        let part = ScenePart::Material(index);
        found.extend(of_other_models(part, &owner, material));
        if material.model == Model::BlinnPhong {
            found.extend(blinn_phong(part, &owner, material));
        }
        let subject = |field| Subject { part, component: None, field: Some(field) };
        for (field, color) in [("color", material.color), ("specular_color", material.specular_color)] {
            if let Some(help) = bytes_for_color(color, 2.0) {
                let message = format!("{owner}: `{field}` looks like a colour from 0 to 255");
                found.push(Unused { subject: subject(field), message, help: Some(help), is_hidden: false });
            }
        }
        if material.shadow_catcher && scene.render.integrator == Integrator::Photon {
            let message = format!(
                "{owner}: with `integrator: Photon` a `shadow_catcher` is an ordinary surface; `Path`, `Distribution` and \
                 `Whitted` show its shadows alone"
            );
            found.push(Unused { subject: subject("shadow_catcher"), message, help: None, is_hidden: false });
        }
    }
    found
}

/// Fields that only other models look at.
fn of_other_models(part: ScenePart, owner: &str, material: &Material) -> Vec<Unused> {
    let usual = Material::default();
    let used = material.model.fields();
    let model = material.model.name();
    let is_given = |field: &str| material.get(field) != usual.get(field);
    let idle = Material::FIELDS.iter().filter(|field| Model::is_for_some(field) && !used.contains(field));
    let told = |field: &&'static str| -> IdleField {
        let models = Model::ALL.iter().filter(|other| other.fields().contains(field));
        let models: Vec<String> = models.map(|other| format!("`{}`", other.name())).collect();
        let models = match &models[..] {
            [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
            all => all.concat(),
        };
        let why = format!("is not used by `{model}`, only by {models}");
        (*field, true, why, instead(material.model, field))
    };
    idle_of(part, None, owner, idle.filter(|field| is_given(field)).map(told))
}

/// The field of a model that does what another field does elsewhere.
fn instead(model: Model, field: &str) -> &'static str {
    let has = |ours: &str| model.fields().contains(&ours);
    match field {
        "roughness" | "roughness_map" if has("gloss") => "`gloss` blurs its mirror images, `shininess` its highlights",
        "gloss" | "shininess" | "specular" if has("roughness") => "`roughness` says how blurred its reflections are",
        "metallic" if model != Model::Conductor => "bare metal is `model: Conductor`",
        "color" if model == Model::Dielectric => "`absorption` colours the inside of glass",
        "transmission" => "clear glass is `model: Dielectric`",
        _ => "",
    }
}

/// Fields of a Blinn-Phong surface that refine what it does not have.
fn blinn_phong(part: ScenePart, owner: &str, material: &Material) -> Vec<Unused> {
    let usual = Material::default();
    let has_highlight = material.specular > 0.0;
    let mirrors = material.reflection_weight() > 0.0 || material.transmission > 0.0;
    let is_clear = material.transmission > 0.0;
    let highlight = || "shapes the highlight, and `specular` is 0".to_string();
    let inside = || "is of what light goes through, and `transmission` is 0".to_string();
    let ior = material.ior.is_some_and(|ior| ior > 0.0 && ior != 1.0);
    let fields = [
        ("shininess", material.shininess != usual.shininess && !has_highlight, highlight(), "give it `specular: 0.5`"),
        (
            "specular_color",
            material.specular_color != usual.specular_color && !has_highlight && !mirrors,
            "is of highlights and mirror images, and `specular` and `reflection` are 0".into(),
            "give it `specular: 0.5`",
        ),
        (
            "gloss",
            material.gloss > 0.0 && !mirrors,
            "spreads mirror images, and `reflection` is 0".into(),
            "give it `reflection: 0.3`",
        ),
        ("ior", ior && !is_clear, inside(), "clear glass is `model: Dielectric`"),
        ("absorption", material.absorption != usual.absorption && !is_clear, inside(), ""),
        ("priority", material.priority != usual.priority && !is_clear, inside(), ""),
    ];
    idle_of(part, None, owner, fields)
}

/// What to write for a colour that is most likely given in whole numbers from 0 to 255; `least` is the smallest of the
/// largest channel that nobody means otherwise.
pub(super) fn bytes_for_color(color: DVec3, least: f64) -> Option<String> {
    let channels = color.to_array();
    let is_whole = channels.iter().all(|x| *x == x.trunc() && (0.0..=255.0).contains(x));
    if !is_whole || color.max_element() < least {
        return None;
    }
    let [r, g, b] = channels.map(|x| (x / 255.0 * 100.0).round() / 100.0);
    Some(format!("colours are linear numbers where 1 is full: ({r:?}, {g:?}, {b:?}) if these are of 255"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(material: Material) -> Vec<&'static str> {
        let scene = Scene { materials: vec![("m".into(), material)], ..Scene::default() };
        in_scene(&scene).into_iter().filter_map(|unused| unused.subject.field).collect()
    }

    #[test]
    fn fields_of_other_models_and_colours_in_bytes_are_found() {
        let of = |model| Material { model, ..Material::default() };
        assert!(Model::ALL.iter().all(|model| said(of(*model)).is_empty()));
        assert_eq!(said(Material { gloss: 0.2, ..of(Model::Conductor) }), ["gloss"]);
        assert_eq!(said(Material { roughness: 0.2, ..of(Model::BlinnPhong) }), ["roughness"]);
        assert_eq!(said(Material { gloss: 0.2, ..of(Model::BlinnPhong) }), ["gloss"]);
        assert!(said(Material { gloss: 0.2, reflection: Some(0.5), ..of(Model::BlinnPhong) }).is_empty());
        assert_eq!(said(Material { ior: Some(1.5), ..of(Model::Lambert) }), ["ior"]);
        assert_eq!(said(Material { color: DVec3::new(255.0, 128.0, 0.0), ..of(Model::BlinnPhong) }), ["color"]);
        assert!(said(Material { color: DVec3::new(1.5, 0.25, 0.0), ..of(Model::BlinnPhong) }).is_empty());
    }
}
