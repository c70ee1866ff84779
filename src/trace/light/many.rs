//! Choosing one of many lights by what it is expected to bring to a point.

use std::f32::consts::PI;

use glam::Vec3;

use super::distribution::DiscreteDistribution;
use super::emitter::Emitter;
use super::lamp::Lamp;
use super::tree::{LightBounds, LightTree};
use crate::base::limits;
use crate::trace::primitive::Bounds;

/// Of so many lights one is chosen by power: a walk through a tree would cost more than it is worth.
const FEW: usize = 8;

/// Lamps and emitters, numbered through: those that fall off with distance in a tree, the others by power.
#[derive(Clone, Debug, PartialEq)]
pub struct ManyLights {
    tree: LightTree,
    no_falloff: DiscreteDistribution,
}

fn strength(v: Vec3) -> f32 {
    v.x + v.y + v.z
}

impl ManyLights {
    /// `None` where they are few, or too many for a tree.
    pub fn new(lamps: &[Lamp], emitters: &[Emitter]) -> Option<ManyLights> {
        let count = lamps.len() + emitters.len();
        if count <= FEW || count > limits::TREE_LIGHTS {
            return None;
        }
        let of_lamps = lamps.iter().map(bounds_of_lamp);
        let bounds: Vec<Option<LightBounds>> =
            of_lamps.chain(emitters.iter().map(|e| Some(bounds_of_emitter(e)))).collect();
        // What a lamp brings that does not fall off is the same everywhere. Emitters all have bounds.
        let everywhere = |(light, bounds): (usize, &Option<LightBounds>)| {
            if bounds.is_some() { 0.0 } else { f64::from(PI * strength(lamps[light].color)) }
        };
        let no_falloff = DiscreteDistribution::new(bounds.iter().enumerate().map(everywhere));
        Some(ManyLights { tree: LightTree::new(&bounds), no_falloff })
    }

    /// The chance that a light which does not fall off is chosen.
    fn no_falloff_share(&self, from: Vec3) -> f32 {
        let (constant, falling) = (self.no_falloff.total as f32, self.tree.importance(from));
        if constant > 0.0 { constant / (constant + falling) } else { 0.0 }
    }

    /// A light for a number in 0..1, with the chance of it; `None` where none shines to the point.
    pub fn pick(&self, from: Vec3, u: f32) -> Option<(usize, f32)> {
        let share = self.no_falloff_share(from);
        if u < share {
            let (light, _) = self.no_falloff.pick(u / share)?;
            return Some((light, self.no_falloff.chance(light) * share));
        }
        let (light, chance) =
            self.tree.pick(from, ((u - share) / (1.0 - share)).clamp(0.0, 1.0 - f32::EPSILON / 2.0))?;
        Some((light as usize, chance * (1.0 - share)))
    }

    /// The chance that [`Self::pick`] gives a light.
    pub fn chance(&self, from: Vec3, light: usize) -> f32 {
        let share = self.no_falloff_share(from);
        self.no_falloff.chance(light) * share + self.tree.chance(from, light as u32) * (1.0 - share)
    }
}

/// `None` for a lamp that does not fall off with distance.
fn bounds_of_lamp(lamp: &Lamp) -> Option<LightBounds> {
    if lamp.distant || !lamp.inverse_square {
        return None;
    }
    let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]].map(|u| lamp.point(u));
    let (bounds, power) = (Bounds::around(&corners), PI * strength(lamp.color));
    let is_surface = lamp.is_surface();
    let (axis, normals, emission) = match () {
        () if is_surface => (lamp.normal, 1.0, 0.0),
        () if lamp.cone.is_everywhere() => (Vec3::Y, -1.0, 0.0),
        () => (lamp.cone.axis, 1.0, lamp.cone.dark),
    };
    Some(LightBounds { bounds, power, axis, normals, emission, two_sided: is_surface })
}

fn bounds_of_emitter(emitter: &Emitter) -> LightBounds {
    let (bounds, power) = (emitter.bounds(), strength(emitter.radiance) * emitter.area());
    let (axis, normals, two_sided) = match emitter.flat_normal() {
        Some(normal) => (normal * emitter.side(0.0), 1.0, emitter.sides() > 1.0),
        None => (Vec3::Y, -1.0, false),
    };
    LightBounds { bounds, power, axis, normals, emission: 0.0, two_sided }
}
