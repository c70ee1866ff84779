//! Which rays of a wave are looked at one by one before what they met is shaded.

use super::context::RenderContext;
use super::ray_queue::RayQueue;
use crate::trace::simd::{Kernel, LANES, Wide};
use crate::trace::soa::Hits;

/// Finds rays that left the scene, ran through a body that absorbs light, or crossed a lamp: bits for each in the
/// bytes of its eight.
pub struct ClassifyKernel<'a> {
    /// What is traced.
    pub context: RenderContext<'a>,
    /// The rays.
    pub wave: &'a RayQueue,
    /// What each of them met.
    pub hits: &'a Hits,
    /// Whether lamps are met on the way, and whether by rays of the camera.
    pub lamps: bool,
    /// Whether the rays come from the camera.
    pub camera: bool,
    /// A flag for each ray: it needs more than shading.
    pub special: &'a mut Vec<u8>,
    /// A flag for each ray: it crossed a lamp.
    pub crossed: &'a mut Vec<u8>,
}

impl Kernel for ClassifyKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let ClassifyKernel { context, wave, hits, lamps, camera, special, crossed } = self;
        special.clear();
        crossed.clear();
        for first in (0..wave.rays().len()).step_by(LANES) {
            let (medium, found) = (wave.states().medium::<L>(first), hits.found::<L>(first));
            let mut odd = L::bits(L::not(found));
            if context.absorbs {
                // Bits of whole numbers: air is 0, and whatever is not counts as a number, or as none.
                odd |= L::bits(medium[0].ne(L::splat(0.0)));
            }
            let mut met = 0;
            if lamps {
                let end = L::select(found, hits.distances(first), L::splat(f32::INFINITY));
                let (origin, direction) = (wave.rays().origin(first), wave.rays().direction(first));
                for (_, lamp) in context.lights.met(camera) {
                    met |= L::bits(lamp.crossed(origin, direction, end).1);
                }
            }
            // Fog is in the way of all of them.
            special.push(if context.fog.is_some() { u8::MAX } else { (odd | met) as u8 });
            crossed.push(met as u8);
        }
    }
}
