//! World -> the kernel's lights, in authored order; and the light groups that emitters are divided into.

use glam::{DAffine3, DVec3, Vec3};

use super::hierarchy::Placement;
use super::stage::Stage;
use crate::base::diagnostics::Diagnostic;
use crate::components::{AreaLight, ComponentType, Falloff, Kind, PointLight, Render};
use crate::trace::light::Lamp;
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
        own.map_or(light, |(group, grey)| Lamp { color: Vec3::splat(grey), group, ..light })
    }

    /// Gives materials their groups, and greys in place of their emission.
    pub fn assign_materials(&self, materials: &mut [ShadingParams]) {
        for (number, material) in materials.iter_mut().enumerate() {
            if let Some((group, grey)) = self.group_of(EmitterId::Material(number)) {
                (material.emission, material.group) = (Vec3::splat(grey), group);
            }
        }
    }

    /// Gives the environment its grey, if it has a group of its own; returns the group that it is in.
    pub fn assign_environment(&self, settings: &mut Render) -> u32 {
        let Some((group, grey)) = self.group_of(EmitterId::Environment) else { return 0 };
        settings.background = DVec3::splat(grey.into());
        settings.environment_intensity = grey.into();
        group
    }
}

/// Every light of the World, in authored order; point lights are widened by the setting `light_size`.
pub fn lights(stage: &Stage, groups: &LightGroups) -> Result<Vec<Lamp>, Diagnostic> {
    let widened = stage.settings().light_size;
    let mut lights = Vec::new();
    type Parts<'q> = (hecs::Or<&'q PointLight, &'q AreaLight>, Option<&'q Placement>);
    stage.for_each_in_order::<Parts>(|index, (found, placement)| {
        let map = placement.map_or(DAffine3::IDENTITY, |p| p.0);
        let (point, area) = found.split();
        let point = point.map(|light: &PointLight| {
            let center = map.transform_point3(light.position);
            let edges = [DVec3::X * widened, DVec3::Y * widened];
            (PointLight::KIND, resolved(center, edges, light.color, light.falloff, false))
        });
        let area = area.map(|light: &AreaLight| {
            let edges = light.edge_vectors().map(|e| map.transform_vector3(e));
            let center = map.transform_point3(light.position);
            (AreaLight::KIND, resolved(center, edges, light.color, light.falloff, light.visible))
        });
        lights.extend(point.into_iter().chain(area).map(|(kind, light)| groups.assign_light(index, kind, light)));
        Ok(())
    })?;
    lights.retain(|light| light.color != Vec3::ZERO);
    Ok(lights)
}

fn resolved(center: DVec3, edges: [DVec3; 2], color: DVec3, falloff: Falloff, visible: bool) -> Lamp {
    Lamp {
        center: center.as_vec3(),
        edges: edges.map(|e| e.as_vec3()),
        normal: edges[0].cross(edges[1]).normalize_or_zero().as_vec3(),
        color: color.as_vec3(),
        inverse_square: falloff == Falloff::InverseSquare,
        visible,
        group: 0,
    }
}
