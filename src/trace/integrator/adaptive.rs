//! When pixels have had samples enough.
//!
//! The noise of a pixel is the standard error of its mean luminance, estimated from its samples and measured as it is
//! seen: after exposure, on the square root of light, which is near to what a screen's curve and the eye make of it. A
//! threshold then means the same in light and in shade; relative to the light itself, black corners would take most of
//! the samples. Strata make the true error smaller than the estimate.
//!
//! A pixel goes on while any pixel of its block of 4 x 4 is too noisy: where the first samples of one pixel happen to
//! agree, its neighbours know better. Stopping by what was seen still favours samples that agree, so that adaptive
//! pictures are biased by a little less than the threshold.

use crate::film::PixelAccumulator;
use crate::trace::wavefront::Noise;

/// The least light on which noise is measured relative to its root: there the slope of the root is that of sRGB's
/// straight part, 12.92.
const DARKEST: f64 = 0.0015;

/// Side of a block, and blocks along the side of a tile.
const BLOCK: u32 = 4;

/// The bit of the block that a pixel lies in, in its tile.
fn block([x, y]: [u32; 2]) -> u16 {
    1 << (x / BLOCK % BLOCK + y / BLOCK % BLOCK * BLOCK)
}

/// Pixels of a tile that share a block with one of these, in order.
pub fn whole_blocks(places: &[[u32; 2]], pixels: &[u32]) -> Vec<u32> {
    let blocks = pixels.iter().fold(0, |blocks, pixel| blocks | block(places[*pixel as usize]));
    (0..places.len() as u32).filter(|pixel| blocks & block(places[*pixel as usize]) != 0).collect()
}

impl Noise {
    /// Keeps those of the active pixels of a tile that need more samples.
    pub fn retain_noisy(&self, places: &[[u32; 2]], tally: &PixelAccumulator, active: &mut Vec<u32>) {
        let block = |pixel: u32| block(places[pixel as usize]);
        let contribution = libm::exp2(self.exposure);
        let noisy = |pixel: u32| tally.spread(pixel as usize).is_some_and(|spread| self.shows(spread, contribution));
        let blocks = active.iter().filter(|p| noisy(**p)).fold(0, |blocks, p| blocks | block(*p));
        active.retain(|p| blocks & block(*p) != 0);
    }

    fn shows(&self, [mean, variance]: [f64; 2], contribution: f64) -> bool {
        let light = (mean * contribution).max(DARKEST);
        variance.sqrt() * contribution > self.threshold * 2.0 * light.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::film::AccumulatorOptions;

    #[test]
    fn a_noisy_pixel_keeps_its_block_and_no_other() {
        let places: Vec<[u32; 2]> = (0..256).map(|i| [16 + i % 16, 32 + i / 16]).collect();
        let mut tally = PixelAccumulator::new(
            256,
            AccumulatorOptions { signed: false, moments: true, features: false, halves: false },
        );
        for pixel in 0..256 {
            tally.add(pixel, Vec3::splat(0.5), 1.0);
            tally.add(pixel, Vec3::splat(if pixel == 5 * 16 + 9 { 0.9 } else { 0.5 }), 1.0);
        }
        let mut active: Vec<u32> = (0..256).collect();
        Noise { threshold: 0.01, exposure: 0.0 }.retain_noisy(&places, &tally, &mut active);
        let expected: Vec<u32> = (0..256).filter(|i| i % 16 / 4 == 2 && i / 16 / 4 == 1).collect();
        assert_eq!(active, expected);
        // Brought down by eight stops it does not show.
        Noise { threshold: 0.05, exposure: -8.0 }.retain_noisy(&places, &tally, &mut active);
        assert!(active.is_empty());
    }
}
