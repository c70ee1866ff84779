//! Which part of a scene a field belongs to: for words that are right and stand in the wrong place.

use super::daylight::Daylight;
use super::fog::Fog;
use super::{Camera, Kind, Material, Render};
use crate::base::synonyms::{by_meaning, by_parts};

/// The part of a scene that has a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldHome {
    /// The camera.
    Camera,
    /// The settings.
    Render,
    /// A material.
    Material,
    /// A component of an entity.
    Component(Kind),
    /// An entity: it is a component itself.
    Entity,
    /// A part of the settings, by its field.
    PartOfRender(&'static str),
}

/// The first part of a scene that has a field of this very name; `None` if none has.
pub fn home_of(field: &str) -> Option<FieldHome> {
    if Camera::FIELDS.contains(&field) {
        return Some(FieldHome::Camera);
    }
    if Render::FIELDS.contains(&field) {
        return Some(FieldHome::Render);
    }
    if Kind::parse(field).is_some() {
        return Some(FieldHome::Entity);
    }
    let has = |kind: &Kind| kind.fields().contains(&field);
    if has(&Kind::Transform) {
        return Some(FieldHome::Component(Kind::Transform));
    }
    if Material::FIELDS.contains(&field) {
        return Some(FieldHome::Material);
    }
    if let Some(kind) = Kind::ALL.iter().find(|kind| has(kind)) {
        return Some(FieldHome::Component(*kind));
    }
    if Daylight::FIELDS.contains(&field) {
        return Some(FieldHome::PartOfRender("daylight"));
    }
    Fog::FIELDS.contains(&field).then_some(FieldHome::PartOfRender("fog"))
}

/// As [`home_of`], for a word that means a field of ours elsewhere: the part of a scene, and the field.
pub fn home_by_meaning(word: &str) -> Option<(FieldHome, &'static str)> {
    let meant =
        |known: &[&'static str]| by_meaning(word, known).or_else(|| by_parts(word, known)).map(|(field, _)| field);
    let of_scene = [
        (FieldHome::Camera, Camera::FIELDS),
        (FieldHome::Render, Render::FIELDS),
        (FieldHome::Material, Material::FIELDS),
    ];
    let in_scene = of_scene.into_iter().find_map(|(home, known)| Some((home, meant(known)?)));
    let in_entity = || Kind::ALL.iter().find_map(|kind| Some((FieldHome::Component(*kind), meant(kind.fields())?)));
    in_scene.or_else(in_entity)
}

impl FieldHome {
    /// Where a scene has the field, as help for whoever has written it elsewhere.
    pub fn in_scene(self, field: &str) -> String {
        match self {
            FieldHome::Camera => format!("`{field}` belongs to the camera: `camera: ({field}: ...)`"),
            FieldHome::Render => format!("`{field}` is a setting: `render: ({field}: ...)`"),
            FieldHome::Material => {
                format!("`{field}` belongs to a material: `materials: {{ \"name\": ({field}: ...) }}`")
            }
            FieldHome::Component(kind) => {
                let kind = kind.name();
                format!("`{field}` belongs to the `{kind}` of an entity: `{kind}: ({field}: ...)`")
            }
            FieldHome::Entity => format!("`{field}` belongs to an entity: `entities: [({field}: ...)]`"),
            FieldHome::PartOfRender(part) => format!("`{field}` is of `{part}`: `render: ({part}: ({field}: ...))`"),
        }
    }

    /// The same in a script.
    pub fn in_script(self, field: &str) -> String {
        match self {
            FieldHome::Camera => format!("`{field}` belongs to the camera: s.camera.{field}"),
            FieldHome::Render => format!("`{field}` is a setting: s.render.{field}"),
            FieldHome::Material => format!("`{field}` belongs to a material: s.material(\"name\").{field}"),
            FieldHome::Component(Kind::Transform) | FieldHome::Entity => {
                format!("`{field}` belongs to an entity: s.get(\"name\").{field}")
            }
            FieldHome::Component(kind) => {
                let kind = kind.name();
                format!("`{field}` belongs to the `{kind}` of an entity: s.get(\"name\").{kind}.{field}")
            }
            FieldHome::PartOfRender(part) => {
                format!("`{field}` is of `{part}`: s.render.{part} = #{{ {field}: ... }}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_where_they_belong() {
        assert_eq!(home_of("fov"), Some(FieldHome::Camera));
        assert_eq!(home_of("samples"), Some(FieldHome::Render));
        assert_eq!(home_of("roughness"), Some(FieldHome::Material));
        assert_eq!(home_of("radius"), Some(FieldHome::Component(Kind::Sphere)));
        assert_eq!(home_of("rotation"), Some(FieldHome::Component(Kind::Transform)));
        assert_eq!(home_of("sphere"), Some(FieldHome::Entity));
        assert_eq!(home_of("turbidity"), Some(FieldHome::PartOfRender("daylight")));
        assert_eq!(home_of("wombat"), None);
        assert_eq!(home_by_meaning("spp"), Some((FieldHome::Render, "samples")));
        assert_eq!(home_by_meaning("wombat"), None);
        assert!(home_of("fov").unwrap().in_script("fov").contains("s.camera.fov"));
        assert!(home_of("radius").unwrap().in_scene("radius").contains("sphere: (radius: ...)"));
    }
}
