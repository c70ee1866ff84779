//! The transparent bodies on both sides of eight surfaces.

use super::batch::{ShadingBatch, ShadingEntry, ShadingInput};
use super::medium_stack::{Crossing, MediumStack};
use crate::trace::simd::{LANES, Lanes, V3, Wide, lanes_from_bits};

/// What lies on both sides of surfaces, lane by lane.
#[derive(Default)]
pub struct BodyLanes {
    /// Index of each body whose surface it is against that of what is around it there.
    pub ior: [f32; LANES],
    /// Share of light that goes through.
    pub transmission: [f32; LANES],
    /// What rays are in on either side, in halves.
    before: [[u32; LANES]; 2],
    behind: [[u32; LANES]; 2],
}

impl BodyLanes {
    /// Finds them, and takes the rays into the bodies that they turn out to have come through.
    #[inline(always)]
    pub fn new<L: Wide>(met: &ShadingInput, places: &[ShadingEntry], hits: &mut ShadingBatch<L>) -> BodyLanes {
        let mut bodies = BodyLanes::default();
        bodies.fill(met, places, L::bits(hits.front));
        let [low, high] = &bodies.before;
        hits.states.medium = [lanes_from_bits(low), lanes_from_bits(high)];
        bodies
    }

    /// No part of a kernel: what is asked of each material differs.
    #[inline(never)]
    fn fill(&mut self, met: &ShadingInput, places: &[ShadingEntry], fronts: u32) {
        let materials = met.context.materials;
        for i in 0..LANES {
            let [ray, material] = places[i.min(places.len() - 1)];
            let medium = MediumStack::of_halves(met.wave.states().medium::<f32>(ray as usize));
            let tag = met.context.geometry.tag(met.hits.primitive(ray as usize));
            let crossing = Crossing::new(materials, medium, tag, fronts >> i & 1 == 1);
            (self.ior[i], self.transmission[i]) = (crossing.ior, materials[material as usize].transmission);
            [self.before[0][i], self.before[1][i]] = crossing.before.words();
            [self.behind[0][i], self.behind[1][i]] = crossing.behind.words();
        }
    }

    /// What paths with this throughput are worth. What radiance loses on its way into glass it gets back on its way out: no
    /// reason to end a path.
    #[inline(always)]
    pub fn worth<L: Wide>(&self, throughput: V3<L>, transmitted: L::Mask, front: L::Mask) -> L {
        let (zero, one, ior) = (L::splat(0.0), L::splat(1.0), L::load(&self.ior));
        let inside = L::or(L::and(transmitted, front), L::not(L::or(transmitted, front)));
        let inside = L::and(inside, zero.lt(L::load(&self.transmission)));
        throughput.max_element() * L::select(inside, (ior * ior).max(one), one)
    }

    /// The bodies that rays are in which go on: those behind the surface where they go through it.
    #[inline(always)]
    pub fn onward<L: Lanes>(&self, medium: [L; 2], transmitted: L::Mask) -> [L; 2] {
        let [low, high] = &self.behind;
        let behind = [lanes_from_bits(low), lanes_from_bits(high)];
        [L::select(transmitted, behind[0], medium[0]), L::select(transmitted, behind[1], medium[1])]
    }
}
