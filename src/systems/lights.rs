//! World -> the kernel's lights, in authored order.

use glam::{DAffine3, DVec3, Vec3};

use super::hierarchy::Placement;
use super::stage::{Absent, Order, Stage};
use crate::components::{AreaLight, Falloff, PointLight};
use crate::trace::lights::Light;

/// Every light of the World; point lights are widened by the setting `light_size`.
pub fn lights(stage: &Stage) -> Vec<Light> {
    let world = &stage.world;
    let widened = stage.settings().light_size;
    let place = |p: Option<&Placement>| p.map_or(DAffine3::IDENTITY, |p| p.0);
    let mut found: Vec<(Order, u8, Light)> = Vec::new();
    let mut points = world.query::<(&Order, &PointLight, Option<&Placement>)>().without::<&Absent>();
    for (order, light, placement) in points.iter() {
        let center = place(placement).transform_point3(light.position);
        let edges = [DVec3::X * widened, DVec3::Y * widened];
        found.push((*order, 0, resolved(center, edges, light.color, light.falloff, false)));
    }
    let mut areas = world.query::<(&Order, &AreaLight, Option<&Placement>)>().without::<&Absent>();
    for (order, light, placement) in areas.iter() {
        let map = place(placement);
        let edges = light.edge_vectors().map(|e| map.transform_vector3(e));
        let center = map.transform_point3(light.position);
        found.push((*order, 1, resolved(center, edges, light.color, light.falloff, light.visible)));
    }
    found.sort_by_key(|(order, kind, _)| (*order, *kind));
    found.into_iter().map(|(_, _, light)| light).filter(|light| light.color != Vec3::ZERO).collect()
}

fn resolved(center: DVec3, edges: [DVec3; 2], color: DVec3, falloff: Falloff, visible: bool) -> Light {
    Light {
        center: center.as_vec3(),
        edges: edges.map(|e| e.as_vec3()),
        normal: edges[0].cross(edges[1]).normalize_or_zero().as_vec3(),
        color: color.as_vec3(),
        inverse_square: falloff == Falloff::InverseSquare,
        visible,
    }
}
