//! World -> the kernel's lights, in authored order.

use glam::{DAffine3, DVec3, Vec3};

use super::hierarchy::Placement;
use super::stage::{Absent, Order, Stage};
use crate::components::{AreaLight, Falloff, Kind, PointLight, Render};
use crate::trace::light::Lamp;
use crate::trace::material::ShadingParams;

/// What shines and can have a pass of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shiner {
    /// A light, by the authored index of its entity.
    Lamp(usize, Kind),
    /// All surfaces of a material, by its number.
    Material(usize),
    /// The background's colour, or the factor of what stands in its place.
    Surround,
}

/// What has a pass of its own, in the order of the passes from the second on, and the grey that it shines with there,
/// whatever its own colour is: chances to ask for its light do not depend on that either.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Passes {
    pub shiners: Vec<(Shiner, f32)>,
}

impl Passes {
    /// How many there are, with the one of all the rest.
    pub fn count(&self) -> usize {
        self.shiners.len() + 1
    }

    /// The pass of its own and its grey, if it has one.
    fn own(&self, shiner: Shiner) -> Option<(u32, f32)> {
        let place = self.shiners.iter().position(|(one, _)| *one == shiner)?;
        Some((place as u32 + 1, self.shiners[place].1))
    }

    fn of(&self, order: Order, kind: Kind, light: Lamp) -> Lamp {
        let own = self.own(Shiner::Lamp(order.0 as usize, kind));
        own.map_or(light, |(pass, grey)| Lamp { color: Vec3::splat(grey), group: pass, ..light })
    }

    /// Gives materials their passes, and what they shine with there.
    pub fn divide(&self, materials: &mut [ShadingParams]) {
        for (number, material) in materials.iter_mut().enumerate() {
            if let Some((pass, grey)) = self.own(Shiner::Material(number)) {
                (material.emission, material.group) = (Vec3::splat(grey), pass);
            }
        }
    }

    /// Gives what lies around the scene its grey; the pass that it is in.
    pub fn surround(&self, settings: &mut Render) -> u32 {
        let Some((pass, grey)) = self.own(Shiner::Surround) else { return 0 };
        settings.background = DVec3::splat(grey.into());
        settings.environment_intensity = grey.into();
        pass
    }
}

/// Every light of the World; point lights are widened by the setting `light_size`.
pub fn lights(stage: &Stage, passes: &Passes) -> Vec<Lamp> {
    let world = &stage.world;
    let widened = stage.settings().light_size;
    let place = |p: Option<&Placement>| p.map_or(DAffine3::IDENTITY, |p| p.0);
    let mut found: Vec<(Order, Kind, Lamp)> = Vec::new();
    let mut points = world.query::<(&Order, &PointLight, Option<&Placement>)>().without::<&Absent>();
    for (order, light, placement) in points.iter() {
        let center = place(placement).transform_point3(light.position);
        let edges = [DVec3::X * widened, DVec3::Y * widened];
        found.push((*order, Kind::PointLight, resolved(center, edges, light.color, light.falloff, false)));
    }
    let mut areas = world.query::<(&Order, &AreaLight, Option<&Placement>)>().without::<&Absent>();
    for (order, light, placement) in areas.iter() {
        let map = place(placement);
        let edges = light.edge_vectors().map(|e| map.transform_vector3(e));
        let center = map.transform_point3(light.position);
        found.push((*order, Kind::AreaLight, resolved(center, edges, light.color, light.falloff, light.visible)));
    }
    found.sort_by_key(|(order, kind, _)| (*order, *kind));
    let lights = found.into_iter().map(|(order, kind, light)| passes.of(order, kind, light));
    lights.filter(|light| light.color != Vec3::ZERO).collect()
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
