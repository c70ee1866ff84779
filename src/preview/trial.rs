//! Values that are tried out: edits of a frame that nobody has written yet.

use serde_json::Value as Json;

use super::board::{PagePart, Trial};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::components::{Edit, FieldError, Kind, Record, Scene, Value};

/// The edits that give a scene these values, one for each record that they are in.
///
/// # Errors
/// A subject that is not there; a value that does not fit its field.
pub fn edits(scene: &Scene, trials: &[Trial]) -> Result<Vec<Edit>, Diagnostics> {
    let mut scene = scene.clone();
    let mut edits = Vec::new();
    for trial in trials {
        edits.push(edit(&mut scene, trial)?);
    }
    Ok(edits)
}

fn edit(scene: &mut Scene, trial: &Trial) -> Result<Edit, Diagnostic> {
    let gone = || Diagnostic::error("what was to be changed is not there any more");
    Ok(match trial.subject {
        PagePart::Camera => {
            set(&mut scene.camera, &trial.field, &trial.value)?;
            Edit::Camera(scene.camera.clone())
        }
        PagePart::Render => {
            set(&mut scene.render, &trial.field, &trial.value)?;
            Edit::Render(scene.render.clone())
        }
        PagePart::Material(index) => {
            let (_, material) = scene.materials.get_mut(index).ok_or_else(gone)?;
            set(material, &trial.field, &trial.value)?;
            Edit::Material { index, material: material.clone() }
        }
        PagePart::Entity(index) => {
            let desc = scene.entities.get_mut(index).ok_or_else(gone)?;
            let kind = trial.component.as_deref().and_then(Kind::parse).ok_or_else(gone)?;
            let mut component = desc.get(kind).cloned().unwrap_or_else(|| kind.default_component());
            set(component.record_mut(), &trial.field, &trial.value)?;
            desc.put(component.clone());
            Edit::Put { entity: index, component }
        }
    })
}

fn set(record: &mut dyn Record, field: &str, value: &Json) -> Result<(), Diagnostic> {
    record.set(field, &Value::from_json(value)).map_err(|error| match error {
        FieldError::Unknown { known } => {
            Diagnostic::error(format!("there is no field `{field}`")).suggest(field, known.iter().copied())
        }
        FieldError::Mismatch(mismatch) => Diagnostic::error(format!("`{field}`: {}", mismatch.message)),
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::components::{EntityDesc, Sphere};

    #[test]
    fn values_become_edits_of_their_records() {
        let sphere = EntityDesc::new([Sphere::default().into()]);
        let scene = Scene { entities: vec![sphere], ..Scene::default() };
        let trial = |subject, component: Option<&str>, field: &str, value| Trial {
            subject,
            component: component.map(str::to_string),
            field: field.into(),
            value,
        };
        let camera = |field: &str, value| trial(PagePart::Camera, None, field, value);
        let both = edits(&scene, &[camera("from", json!([1, 2, 3.5])), camera("fov", json!(30))]).unwrap();
        let Edit::Camera(last) = &both[1] else { panic!() };
        assert_eq!((last.from.to_array(), last.fov), ([1.0, 2.0, 3.5], 30.0));
        let moved = trial(PagePart::Entity(0), Some("transform"), "translation", json!([0, 1, 0]));
        assert!(
            matches!(&edits(&scene, &[moved]).unwrap()[0], Edit::Put { entity: 0, component } if component.kind() == Kind::Transform)
        );
        let wrong = trial(PagePart::Entity(0), Some("sphere"), "raduis", json!(2));
        assert!(edits(&scene, &[wrong]).unwrap_err().to_string().contains("did you mean `radius`?"));
        for subject in [PagePart::Entity(1), PagePart::Material(0)] {
            assert!(edits(&scene, &[trial(subject, Some("sphere"), "radius", json!(2))]).is_err());
        }
    }
}
