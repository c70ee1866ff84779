//! Light towards points of a way through a medium: one light of all by power, wherever on the way the point comes to lie.

use glam::Vec3;

use super::lights::Lights;
use super::sample::LightSample;

/// A light that was chosen for a whole way.
#[derive(Clone, Copy, Debug)]
pub struct WayLight {
    /// Its number; `None` for what lies around the scene.
    light: Option<usize>,
    chance: f32,
}

impl Lights {
    /// A light for a number in 0..1.
    pub fn pick_for_way(&self, pick: f32) -> Option<WayLight> {
        let earthly = self.earthly();
        if pick >= earthly {
            return Some(WayLight { light: None, chance: 1.0 - earthly });
        }
        let (light, _) = self.direct.pick(pick / earthly)?;
        Some(WayLight { light: Some(light), chance: self.direct.chance(light) * earthly })
    }

    /// The point of a lamp that [`Self::sample_for_way`] takes with these numbers, whatever it lights; `None` for lights
    /// whose points depend on that.
    pub fn point_for_way(&self, way: WayLight, u: [f32; 2]) -> Option<Vec3> {
        let lamp = self.lamps.get(way.light?)?;
        (!lamp.distant).then(|| lamp.point(u))
    }

    /// Light of the one that was chosen towards a point of the way.
    pub fn sample_for_way(&self, way: WayLight, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        match way.light {
            None => self.sky_light(from, u),
            Some(light) => self.sample_one(light, way.chance, from, u),
        }
    }
}
