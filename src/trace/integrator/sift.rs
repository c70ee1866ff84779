//! Which rays of a wave are looked at one by one before what they met is shaded.

use super::View;
use super::errand::Wave;
use crate::trace::Hits;
use crate::trace::simd::{Kernel, LANES, Wide};

/// Finds rays that left the scene, ran through a body that swallows light, or crossed a lamp: a bit for each in the byte
/// of its eight.
pub struct Sift<'a> {
    pub view: View<'a>,
    pub wave: &'a Wave,
    pub hits: &'a Hits,
    /// Whether lamps are met on the way, and whether by rays of the camera.
    pub lamps: bool,
    pub camera: bool,
    pub special: &'a mut Vec<u8>,
}

impl Kernel for Sift<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let Sift { view, wave, hits, lamps, camera, special } = self;
        special.clear();
        for first in (0..wave.rays().len()).step_by(LANES) {
            let (medium, found) = (wave.media::<L>(first), hits.found::<L>(first));
            // What is clear is NaN.
            let mut odd = L::either(L::not(found), L::not(medium.ne(medium)));
            if lamps {
                let end = L::select(found, hits.distances(first), L::splat(f32::INFINITY));
                let (origin, direction) = (wave.rays().origins(first), wave.rays().directions(first));
                for (_, lamp) in view.lights.met(camera) {
                    odd = L::either(odd, lamp.crossed(origin, direction, end).1);
                }
            }
            special.push(L::bits(odd) as u8);
        }
    }
}
