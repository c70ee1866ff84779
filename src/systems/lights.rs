//! World -> the kernel's lights, in authored order; and the light groups that emitters are divided into.

use glam::{DAffine3, DVec3, Vec3};

use super::hierarchy::Placement;
use super::origin::{relative, render_origin};
use super::stage::Stage;
use super::visibility::RayVisibility;
use crate::base::diagnostics::Diagnostic;
use crate::base::math::sin_cos_degrees;
use crate::components::{
    AreaLight, ComponentType, DirectionalLight, Falloff, Kind, PointLight, Render, SpotLight, Visible,
};
use crate::trace::light::{Lamp, LampCone, LightLinking};
use crate::trace::material::ShadingParams;

/// What emits light and can have a light group of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EmitterId {
    /// A light, by the authored index of its entity.
    Lamp(usize, Kind),
    /// All surfaces of a material, by its number.
    Material(usize),
    /// The background's colour, or the factor of the environment or sky in its place.
    Environment,
}

/// Emitters with a light group of their own, in the order of the groups from the second on; the first group is all the
/// rest.
///
/// Each has the grey that it emits in its group whatever its own colour is, so that the probability of sampling it does
/// not depend on that colour either.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightGroups {
    /// Emitters and their greys, above 0.
    pub emitters: Vec<(EmitterId, f32)>,
    /// Each has its own colour instead, and the picture is divided among them as it is.
    pub keep_colors: bool,
}

impl LightGroups {
    /// How many groups there are, with that of all the rest.
    pub fn count(&self) -> usize {
        self.emitters.len() + 1
    }

    /// The group of an emitter and its grey, if it has a group of its own.
    fn group_of(&self, emitter: EmitterId) -> Option<(u32, f32)> {
        let index = self.emitters.iter().position(|(one, _)| *one == emitter)?;
        Some((index as u32 + 1, self.emitters[index].1))
    }

    /// A light with its group, and its grey in place of its colour.
    fn assign_light(&self, index: usize, kind: Kind, light: Lamp) -> Lamp {
        let own = self.group_of(EmitterId::Lamp(index, kind));
        let color = |grey| if self.keep_colors { light.color } else { Vec3::splat(grey) };
        own.map_or(light, |(group, grey)| Lamp { color: color(grey), group, ..light })
    }

    /// Gives materials their groups, and greys in place of their emission.
    pub fn assign_materials(&self, materials: &mut [ShadingParams]) {
        for (number, material) in materials.iter_mut().enumerate() {
            if let Some((group, grey)) = self.group_of(EmitterId::Material(number)) {
                material.group = group;
                if !self.keep_colors {
                    material.emission = Vec3::splat(grey);
                }
            }
        }
    }

    /// Gives the environment its grey, if it has a group of its own; returns the group that it is in.
    pub fn assign_environment(&self, settings: &mut Render) -> u32 {
        let Some((group, grey)) = self.group_of(EmitterId::Environment) else { return 0 };
        if !self.keep_colors {
            settings.background = DVec3::splat(grey.into());
            settings.environment_intensity = grey.into();
        }
        group
    }
}

/// Every light of the World, in authored order; point and spot lights are widened by the setting `light_size`.
pub fn lights(stage: &Stage, groups: &LightGroups, visibility: &RayVisibility) -> Result<Vec<Lamp>, Diagnostic> {
    let widened = stage.settings().light_size;
    let origin = render_origin(stage);
    let mut lights = Vec::new();
    type Near<'q> = hecs::Or<&'q PointLight, &'q AreaLight>;
    type Aimed<'q> = hecs::Or<&'q SpotLight, &'q DirectionalLight>;
    type Parts<'q> = (hecs::Or<Near<'q>, Aimed<'q>>, Option<&'q Placement>, Option<&'q Visible>);
    stage.for_each_in_order::<Parts>(|index, (found, placement, visible)| {
        let map = relative(placement, origin);
        let (near, aimed) = found.split();
        let (point, area) = near.map_or((None, None), hecs::Or::split);
        let (spot, distant) = aimed.map_or((None, None), hecs::Or::split);
        let all = [
            point.map(|light| (PointLight::KIND, of_point(light, &map, widened))),
            area.map(|light| (AreaLight::KIND, of_area(light, &map))),
            spot.map(|light| (SpotLight::KIND, of_spot(light, &map, widened))),
            distant.map(|light| (DirectionalLight::KIND, of_directional(light, &map))),
        ];
        let linking = visibility.of_lamp(index);
        lights.extend(all.into_iter().flatten().map(|(kind, light)| {
            let lamp = Lamp { linking, ..groups.assign_light(index, kind, light) };
            visible.map_or(lamp, |visible| Lamp {
                visible: visible.camera.unwrap_or(lamp.visible),
                reflected: visible.reflection,
                ..lamp
            })
        }));
        Ok(())
    })?;
    // A light that a transform has left without a direction lights nothing.
    lights.retain(|light| light.color != Vec3::ZERO && !(light.distant && light.center == Vec3::ZERO));
    Ok(lights)
}

fn of_point(light: &PointLight, map: &DAffine3, widened: f64) -> Lamp {
    let edges = [DVec3::X * widened, DVec3::Y * widened];
    lamp(map.transform_point3(light.position), edges, light.emitted(), light.falloff)
}

fn of_area(light: &AreaLight, map: &DAffine3) -> Lamp {
    let edges = light.edge_vectors().map(|e| map.transform_vector3(e));
    let lamp = lamp(map.transform_point3(light.position), edges, light.emitted(), light.falloff);
    Lamp { visible: light.visible, ..lamp }
}

fn of_spot(light: &SpotLight, map: &DAffine3, widened: f64) -> Lamp {
    let axis = map.transform_vector3(light.direction).normalize_or_zero().as_vec3();
    let [inner, outer] = [light.inner_angle, light.outer_angle].map(|angle| sin_cos_degrees(angle).1 as f32);
    let edges = [DVec3::X * widened, DVec3::Y * widened];
    let lamp = lamp(map.transform_point3(light.position), edges, light.emitted(), light.falloff);
    Lamp { cone: LampCone::new(axis, inner, outer), ..lamp }
}

fn of_directional(light: &DirectionalLight, map: &DAffine3) -> Lamp {
    let toward = -map.transform_vector3(light.direction).normalize_or_zero();
    let (sin, cos) = sin_cos_degrees(light.angle / 2.0);
    let (a, b) = toward.any_orthonormal_pair();
    let disk = lamp(toward, [a, b].map(|axis| axis * (sin / cos)), light.emitted(), Falloff::Constant);
    Lamp { normal: Vec3::ZERO, distant: true, ..disk }
}

/// A lamp that shines everywhere.
fn lamp(center: DVec3, edges: [DVec3; 2], color: DVec3, falloff: Falloff) -> Lamp {
    Lamp {
        center: center.as_vec3(),
        edges: edges.map(|e| e.as_vec3()),
        normal: edges[0].cross(edges[1]).normalize_or_zero().as_vec3(),
        color: color.as_vec3(),
        cone: LampCone::EVERYWHERE,
        distant: false,
        inverse_square: falloff == Falloff::InverseSquare,
        visible: false,
        reflected: true,
        linking: LightLinking::default(),
        group: 0,
    }
}
