//! Lights and cameras of nodes.

use glam::DVec3;
use serde::Deserialize;

use super::document::{Document, at, field};
use super::json::{Index, NodeJson, extension};
use super::warnings::Warnings;
use crate::components::*;
use crate::load::resolve::{Problem, key};
use crate::load::spans::Step;

const LIGHTS: &str = "KHR_lights_punctual";

#[derive(Deserialize)]
struct LightUseJson {
    light: Index,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct LightsJson {
    lights: Vec<LightJson>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct LightJson {
    #[serde(rename = "type")]
    kind: String,
    color: Option<[f64; 3]>,
    intensity: Option<f64>,
    range: Option<f64>,
    spot: SpotJson,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpotJson {
    inner_cone_angle: Option<f64>,
    outer_cone_angle: Option<f64>,
}

impl Document {
    /// Adds the light and the camera of a node to its entity.
    ///
    /// # Errors
    /// One that does not exist or has impossible values.
    pub fn light_and_camera(
        &self,
        node: &NodeJson,
        path: &[Step],
        bag: &mut EntityDesc,
        warnings: &mut Warnings,
    ) -> Result<(), Problem> {
        let used: Option<LightUseJson> =
            extension(&node.extensions, LIGHTS).map_err(|m| Problem::new(path.to_vec(), m))?;
        if let Some(LightUseJson { light }) = used {
            bag.put(self.light(light.0, path, warnings)?);
        }
        if let Some(camera) = node.camera {
            bag.put(self.viewpoint(camera.0)?.into());
        }
        Ok(())
    }

    fn light(&self, index: usize, path: &[Step], warnings: &mut Warnings) -> Result<Component, Problem> {
        let place = || field(field(vec![key("extensions")], LIGHTS), "lights");
        let all: LightsJson = extension(&self.root.extensions, LIGHTS)
            .map_err(|m| Problem::new(vec![key("extensions")], m))?
            .unwrap_or_default();
        let Some(light) = all.lights.get(index) else {
            let count = all.lights.len();
            return Err(Problem::new(path.to_vec(), format!("there is no light {index}; there are {count}")));
        };
        let place = super::document::item(place(), index);
        if light.range.is_some() {
            warnings.add("range of a light", || {
                Problem::new(place.clone(), "the `range` of a light is not used: it falls off as light does")
            });
        }
        // Candela and lux; a matt surface sends back the pi-th part of what arrives.
        let intensity = light.intensity.unwrap_or(1.0) / std::f64::consts::PI;
        let color = light.color.map_or(DVec3::ONE, DVec3::from_array);
        let falloff = Falloff::InverseSquare;
        let component: Component = match light.kind.as_str() {
            "point" => PointLight { color, intensity, falloff, ..PointLight::default() }.into(),
            "directional" => DirectionalLight { color, intensity, ..DirectionalLight::default() }.into(),
            "spot" => {
                let inner = light.spot.inner_cone_angle.unwrap_or(0.0).to_degrees();
                let outer = light.spot.outer_cone_angle.unwrap_or(std::f64::consts::FRAC_PI_4).to_degrees();
                // Written in radians, a right angle may be a little more than one.
                let [inner_angle, outer_angle] = [inner.min(outer), outer.min(90.0)];
                SpotLight { color, intensity, inner_angle, outer_angle, falloff, ..SpotLight::default() }.into()
            }
            other => {
                let message = format!("unknown type `{other}` of a light; known: point, spot, directional");
                return Err(Problem::new(field(place, "type"), message));
            }
        };
        match component.record().check() {
            Ok(()) => Ok(component),
            Err(invalid) => Err(Problem::new(place, invalid.message)),
        }
    }

    fn viewpoint(&self, index: usize) -> Result<Viewpoint, Problem> {
        let path = at("cameras", index);
        let Some(camera) = self.root.cameras.get(index) else {
            let count = self.root.cameras.len();
            return Err(Problem::new(path, format!("there is no camera {index}; there are {count}")));
        };
        let viewpoint = match camera.projection.as_str() {
            "perspective" => {
                let fov = camera.perspective.yfov.unwrap_or(0.0).to_degrees();
                Viewpoint { fov, ..Viewpoint::default() }
            }
            "orthographic" => {
                // Half of what the picture spans.
                let height = camera.orthographic.ymag.map(|half| 2.0 * half.abs());
                Viewpoint { projection: Projection::Orthographic, height, ..Viewpoint::default() }
            }
            other => return Err(Problem::new(field(path, "type"), format!("unknown type `{other}` of a camera"))),
        };
        viewpoint.check().map(|()| viewpoint).map_err(|invalid| Problem::new(path, invalid.message))
    }
}
