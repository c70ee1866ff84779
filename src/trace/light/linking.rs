//! Which lights light which bodies, whose shadows they throw, and which of them no scattered ray may count.

use rustc_hash::FxHashMap;

/// What a light lights, and how it is found. The default is a light like any other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightLinking {
    /// A bit that bodies have among their [`LightLinks`] which the light does not light; 0 for one that lights all.
    pub unlit: u64,
    /// Number of the set of bodies that throw shadows in its light.
    pub shadow_set: u32,
    /// Whether its light is only ever sampled. Rays that were scattered then do not count it, though they may meet it: what
    /// stands in their way is not what throws shadows, so that the two ways of finding it would not agree.
    pub sampled_only: bool,
}

/// What is special about the lights of a scene, by authored index of their entities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightLinks {
    /// By entity: the bits of those lights that do not light it. Empty where all lights light all.
    pub receivers: Vec<u64>,
    /// Of surfaces that emit light: of entities other than the usual ones.
    pub emissive: FxHashMap<u32, LightLinking>,
    /// Of all other surfaces that emit light, and of what lies around the scene.
    pub usual: LightLinking,
}

impl LightLinks {
    /// Of surfaces of an entity that emit light.
    pub fn of_emissive(&self, entity: u32) -> LightLinking {
        self.emissive.get(&entity).copied().unwrap_or(self.usual)
    }

    /// Whether a light lights an entity.
    #[inline]
    pub fn lights(&self, light: LightLinking, entity: u32) -> bool {
        light.unlit == 0 || self.receivers.get(entity as usize).is_none_or(|unlit| unlit & light.unlit == 0)
    }
}
