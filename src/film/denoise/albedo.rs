//! The albedo that colour is divided by before it is filtered, and multiplied by after.
//!
//! Of surfaces in focus every sample meets the same, and the albedo is exact. Out of focus, or in motion, a half knows no
//! more than a handful of samples tell of what covers the pixel: multiplied by that, filtered light would be as grainy as
//! the albedo. So where the halves disagree about it, the albedo is filtered first, each half by weights of the other.

use std::sync::atomic::AtomicBool;

use super::halves::DenoisePixel;
use super::pass::{FeaturePlanes, HalfLight, PassShape, filter, with_unseen};
use super::plane::{PaddedPlane, box_weights};

/// Albedo of each half, in three channels.
pub type AlbedoPlanes = [[PaddedPlane; 3]; 2];

/// Least albedo that colour is divided by.
const MIN_ALBEDO: f32 = 0.02;
/// The pass that albedo goes through.
const PASS: PassShape = PassShape { radius: 2, step: 1, bandwidth: 1.2 };
/// Pixels along the side of the squares in which the halves are compared.
const AROUND: usize = 7;
/// Variance of a half over the square of the albedo, from which on the filtered albedo has a share, and from which on it
/// takes all.
const EXACT: f32 = 0.001;
const NOISY: f32 = 0.004;

/// Albedo of the first hit, filtered as far as it is noisy; any if `cancel` was raised.
pub fn steady_albedo(
    pixels: &[DenoisePixel],
    features: &FeaturePlanes,
    size: [usize; 2],
    cancel: &AtomicBool,
) -> AlbedoPlanes {
    let own = [0, 1].map(|half: usize| {
        [0, 1, 2].map(|k: usize| PaddedPlane::from_fn(size, |i| pixels[i].halves[half].albedo[k].max(MIN_ALBEDO)))
    });
    let variance = PaddedPlane::from_fn(size, |i| {
        let square = |k: usize| {
            let apart = own[0][k].at(i) - own[1][k].at(i);
            apart * apart
        };
        0.5 * (square(0) + square(1) + square(2))
    });
    let variance = variance.blurred(&box_weights(AROUND));
    let share = noisy_share(&own, &variance);
    if (0..pixels.len()).all(|i| share.at(i) == 0.0) {
        return own;
    }
    let halves = own.each_ref().map(|albedo| HalfLight {
        light: albedo.clone(),
        guide: albedo.clone(),
        variance: with_unseen(&variance, albedo),
    });
    let filtered = filter(&halves, features, PASS, cancel);
    [0, 1].map(|half: usize| {
        [0, 1, 2].map(|k: usize| {
            let (from, to) = (&own[half][k], &filtered[half].light[k]);
            PaddedPlane::from_fn(size, |i| from.at(i) + (to.at(i) - from.at(i)) * share.at(i))
        })
    })
}

/// Where albedo of this variance is noisy: from 0 to 1, without a step.
fn noisy_share(own: &AlbedoPlanes, variance: &PaddedPlane) -> PaddedPlane {
    let size = variance.size();
    let mean = PaddedPlane::from_fn(size, |i| {
        let sum: f32 = own.iter().flatten().map(|plane| plane.at(i)).sum();
        sum / 6.0
    });
    let mean = mean.blurred(&box_weights(AROUND));
    PaddedPlane::from_fn(size, |i| {
        let relative = variance.at(i) / (3.0 * mean.at(i) * mean.at(i));
        let t = ((relative - EXACT) / (NOISY - EXACT)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    })
}
