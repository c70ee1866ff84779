//! Takes noise out of a film, guided by what its pixels show and by how two halves of its samples differ.
//!
//! Three passes of non-local means with patches of 3 x 3 pixels, over 7 x 7, 7 x 7 and 5 x 5 taps that lie 1, 2 and 4
//! pixels apart (Buades, Coll and Morel 2005; half buffers as in Rousselle, Knaus and Zwicker, SIGGRAPH Asia 2012, and
//! Bitterli et al., EGSR 2016). Each half is filtered by weights that follow from the other, so that weights know nothing
//! of the noise that they are applied to. Neighbours count less, the more normal, albedo and distance differ: those of
//! what mirrors and clear glass show, not of the mirror. Where these are themselves noisy, as in lens blur, they fade.
//! Colour is divided by the albedo of the first hit before and multiplied after, half by half; where that is noisy, it is
//! filtered first (`albedo`).
//!
//! In the end each pixel takes the level whose error is least by the halves' own account ([`select`]), the unfiltered
//! picture among them: what needs no filter keeps its every pixel. With fewer than [`FEWEST_TO_CHOOSE`] samples that
//! account is itself noise, and the widest level is taken.
//!
//! Fireflies are cut in what weights and choice go by, not in the picture: no light is lost.
//!
//! | file | |
//! |---|---|
//! | `albedo` | what colour is divided by, without its own noise |
//! | `halves` | what the film gathers: samples in two halves, with what they show |
//! | `plane` | planes of numbers with a margin, and blurs |
//! | `pass` | a pass of non-local means, row by row on all threads |
//! | `select` | the choice among levels |
//!
//! Every pixel of a pass is a function of the pass before, so that rows may be filtered on any thread. The result
//! depends on the film alone.

mod albedo;
mod halves;
mod pass;
mod plane;
mod select;

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;

use albedo::{AlbedoPlanes, steady_albedo};
#[cfg(test)]
pub use halves::HalfPixel;
pub use halves::{DenoisePixel, DenoiseSum, SeenFeature};
use pass::{FeaturePlanes, HalfLight, PassShape, filter, with_unseen};
use plane::{PaddedPlane, box_weights};
use select::{Candidate, choose};

use super::{CaughtShadow, Film};
use crate::base::color::luminance;

/// The passes, from fine to coarse.
const PASSES: [PassShape; 3] = [
    PassShape { radius: 3, step: 1, bandwidth: 0.6 },
    PassShape { radius: 3, step: 2, bandwidth: 0.8 },
    PassShape { radius: 2, step: 4, bandwidth: 0.8 },
];
/// Samples of a pixel from which on a level is chosen.
const FEWEST_TO_CHOOSE: f32 = 8.0;
/// Largest light and variance: what is computed with them stays inside `f32`.
const MOST_LIGHT: f32 = 1e9;
/// Variance after a pass, as a share of that before the first, at the least.
const LEFT_VARIANCE: f32 = 0.01;

/// How far in pixels a change of one pixel can reach, at most: 6 by the albedo's variance, taps and patches, 11 by the
/// variance that weights go by, 4, 7 and 9 by taps and patches of the passes, 3 after each but the last by the variance
/// that it leaves, 8 and 6 by the choice. Parts of a frame are filtered with so many pixels around them.
pub const DENOISE_REACH: u32 = 6 + 11 + 4 + 3 + 7 + 3 + 9 + 8 + 6;

/// Denoises a film that has its samples in two halves, and shadows that catchers have; others stay as they are.
pub fn denoise(film: &mut Film) {
    denoise_until(film, &AtomicBool::new(false));
}

/// As [`denoise`]; false if `cancel` was raised, and the film is none then.
pub fn denoise_until(film: &mut Film, cancel: &AtomicBool) -> bool {
    let pixels = std::mem::take(&mut film.layers.halves);
    let size = [film.width as usize, film.height as usize];
    if pixels.len() != film.pixels.len() || pixels.is_empty() || pixels.iter().any(|pixel| pixel.samples < 2.0) {
        return true;
    }
    let Some(colors) = filtered(&pixels, size, cancel) else { return false };
    film.pixels = colors;
    let caught = &mut film.layers.caught;
    if caught.len() == pixels.len() {
        let shadows: Vec<DenoisePixel> =
            pixels.iter().zip(&*caught).map(|(pixel, shadow)| of_shadow(pixel, shadow)).collect();
        let Some(all_left) = filtered(&shadows, size, cancel) else { return false };
        for (shadow, left) in caught.iter_mut().zip(all_left) {
            shadow.left = left.map(|x| x.clamp(0.0, 1.0));
        }
    }
    true
}

/// A pixel whose colour is the light that shadows leave.
fn of_shadow(pixel: &DenoisePixel, shadow: &CaughtShadow) -> DenoisePixel {
    let mut pixel = *pixel;
    let [a, b] = shadow.halves.map(Vec3::from);
    for (half, left) in pixel.halves.iter_mut().zip([a, b]) {
        (half.color, half.albedo) = (left, Vec3::ONE);
    }
    DenoisePixel { variance: (a - b) * (a - b) * 0.5, ..pixel }
}

/// Colours without noise; `None` if `cancel` was raised.
fn filtered(pixels: &[DenoisePixel], size: [usize; 2], cancel: &AtomicBool) -> Option<Vec<[f32; 3]>> {
    let features = feature_planes(pixels, size);
    let albedo = steady_albedo(pixels, &features, size, cancel);
    let raw = light_planes(pixels, &albedo, size);
    let believed = variance_plane(pixels, &raw, &albedo, size);
    let variances = [0, 1].map(|half| in_light(&believed, &albedo[half]));
    let cut = [0, 1].map(|half| without_fireflies(&raw[half], &variances[half]));
    let mut level = [0, 1].map(|half: usize| HalfLight {
        light: raw[half].clone(),
        guide: cut[half].clone(),
        variance: with_unseen(&variances[half], &cut[half]),
    });
    let (mut outputs, mut guides) = (Vec::new(), Vec::new());
    let mut show = |level: &[HalfLight; 2]| {
        outputs.push([0, 1].map(|half: usize| modulated(&level[half].light, &albedo[half])));
        guides.push(Candidate { halves: [0, 1].map(|half: usize| modulated(&level[half].guide, &albedo[half])) });
    };
    show(&level);
    for shape in PASSES {
        level = filter(&level, &features, shape, cancel);
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        let spread = spread_of(&level, &variances);
        for half in &mut level {
            half.variance = with_unseen(&spread, &half.guide);
        }
        show(&level);
    }
    let weights = choose(&believed, &guides, &|i| pixels[i].samples < FEWEST_TO_CHOOSE);
    let color = |i: usize| {
        let mut color = Vec3::ZERO;
        for (output, weight) in outputs.iter().zip(&weights) {
            let at = |k: usize| 0.5 * (output[0][k].at(i) + output[1][k].at(i));
            color += Vec3::new(at(0), at(1), at(2)) * weight.at(i);
        }
        color.to_array()
    };
    Some((0..pixels.len()).map(color).collect())
}

/// Colour over albedo.
fn light_planes(pixels: &[DenoisePixel], albedo: &AlbedoPlanes, size: [usize; 2]) -> [[PaddedPlane; 3]; 2] {
    [0, 1].map(|half: usize| {
        [0, 1, 2].map(|k: usize| {
            PaddedPlane::from_fn(size, |i| (pixels[i].halves[half].color[k] / albedo[half][k].at(i)).min(MOST_LIGHT))
        })
    })
}

fn modulated(light: &[PaddedPlane; 3], albedo: &[PaddedPlane; 3]) -> [PaddedPlane; 3] {
    [0, 1, 2].map(|k: usize| PaddedPlane::from_fn(light[k].size(), |i| light[k].at(i) * albedo[k].at(i)))
}

/// Variance of the colour of a half, summed over the channels: that of its samples, brought to what the halves' own
/// difference says over 21 x 21 pixels. Samples that are well spread vary more than their mean shows.
fn variance_plane(
    pixels: &[DenoisePixel],
    raw: &[[PaddedPlane; 3]; 2],
    albedo: &AlbedoPlanes,
    size: [usize; 2],
) -> PaddedPlane {
    let most = MOST_LIGHT * MOST_LIGHT;
    let of_samples = PaddedPlane::from_fn(size, |i| pixels[i].variance.element_sum().min(most));
    let of_halves = PaddedPlane::from_fn(size, |i| {
        let apart = |k: usize| raw[0][k].at(i) * albedo[0][k].at(i) - raw[1][k].at(i) * albedo[1][k].at(i);
        let squares: f32 = (0..3).map(|k| apart(k) * apart(k)).sum();
        (0.5 * squares).min(most)
    });
    let wide = box_weights(21);
    let (expected, found) = (of_samples.blurred(&wide), of_halves.blurred(&wide));
    let smooth = of_samples.blurred(&box_weights(3));
    PaddedPlane::from_fn(size, |i| {
        let ratio = (found.at(i) / (expected.at(i) + 1e-30)).clamp(0.05, 1.5);
        smooth.at(i) * ratio
    })
}

/// A variance of colour as one of light.
fn in_light(variance: &PaddedPlane, albedo: &[PaddedPlane; 3]) -> PaddedPlane {
    PaddedPlane::from_fn(variance.size(), |i| {
        let whole = luminance([albedo[0].at(i), albedo[1].at(i), albedo[2].at(i)]);
        variance.at(i) / (whole * whole)
    })
}

/// Variance of what a pass has left: as the halves differ in 7 x 7 pixels.
fn spread_of(level: &[HalfLight; 2], before: &[PaddedPlane; 2]) -> PaddedPlane {
    let size = before[0].size();
    let apart = PaddedPlane::from_fn(size, |i| {
        let square = |k: usize| {
            let d = level[0].guide[k].at(i) - level[1].guide[k].at(i);
            d * d
        };
        0.5 * (square(0) + square(1) + square(2))
    });
    let apart = apart.blurred(&box_weights(7));
    PaddedPlane::from_fn(size, |i| apart.at(i).max(LEFT_VARIANCE * 0.5 * (before[0].at(i) + before[1].at(i))))
}

/// Light with those pixels brought down that stand out of their 5 x 5 neighbours by more than thrice what four fifths of
/// these differ by, and whose own noise explains it.
fn without_fireflies(light: &[PaddedPlane; 3], variance: &PaddedPlane) -> [PaddedPlane; 3] {
    let size = variance.size();
    let bright = PaddedPlane::from_fn(size, |i| luminance([light[0].at(i), light[1].at(i), light[2].at(i)]));
    let factor = PaddedPlane::from_fn(size, |i| {
        let (x, y) = ((i % size[0]) as isize, (i / size[0]) as isize);
        let here = bright.at(i);
        let mut around = [0.0f32; 25];
        for (row, to) in around.chunks_mut(5).enumerate() {
            to.copy_from_slice(bright.part(x - 2, y + row as isize - 2, 5));
        }
        // Most pixels are nobody's firefly: not above twice the mean of their neighbours.
        let mean: f32 = (around.iter().sum::<f32>() - here) / 24.0;
        if here <= 2.0 * mean {
            return 1.0;
        }
        around.sort_unstable_by(f32::total_cmp);
        let (median, high) = (around[12], around[20]);
        let limit = high + 3.0 * (high - median);
        let explained = (here - high) * (here - high) <= 9.0 * variance.at(i);
        if here > limit && explained { limit / here } else { 1.0 }
    });
    [0, 1, 2].map(|k: usize| PaddedPlane::from_fn(size, |i| light[k].at(i) * factor.at(i)))
}

/// Features by the mean of the halves, and their variance by the difference.
fn feature_planes(pixels: &[DenoisePixel], size: [usize; 2]) -> FeaturePlanes {
    let group = |of: &(dyn Fn(usize, usize) -> Vec3 + Sync)| {
        let mean = [0, 1, 2].map(|k: usize| PaddedPlane::from_fn(size, |i| 0.5 * (of(i, 0)[k] + of(i, 1)[k])));
        let variance = PaddedPlane::from_fn(size, |i| 0.25 * (of(i, 0) - of(i, 1)).length_squared());
        (mean, doubted(&variance))
    };
    let (normal, normal_variance) = group(&|i, half| pixels[i].halves[half].seen.normal);
    let (albedo, albedo_variance) = group(&|i, half| pixels[i].halves[half].seen.albedo);
    let of = |i: usize, half: usize| pixels[i].halves[half].disparity;
    let disparity = PaddedPlane::from_fn(size, |i| 0.5 * (of(i, 0) + of(i, 1)));
    let variance = PaddedPlane::from_fn(size, |i| 0.25 * (of(i, 0) - of(i, 1)) * (of(i, 0) - of(i, 1)));
    let variance = doubted(&variance);
    let disparity_slack = PaddedPlane::from_fn(size, |i| {
        let tolerated = DISPARITY * disparity.at(i);
        tolerated * tolerated + variance.at(i)
    });
    let disparity_slope = PaddedPlane::from_fn(size, |i| {
        let (x, y) = ((i % size[0]) as isize, (i / size[0]) as isize);
        let [left, here, right] = [x - 1, x, x + 1].map(|x| disparity.part(x, y, 1)[0]);
        let [above, below] = [y - 1, y + 1].map(|y| disparity.part(x, y, 1)[0]);
        // The smaller of the changes to both sides: across an edge the other side does not count.
        let least = |a: f32, b: f32| (a - here).abs().min((b - here).abs());
        let (across, down) = (least(left, right), least(above, below));
        4.0 * (across * across + down * down)
    });
    FeaturePlanes { normal, normal_variance, albedo, albedo_variance, disparity, disparity_slack, disparity_slope }
}

/// Variance of a feature from that of single pixels. The difference of two halves is a poor witness, as often too small
/// as too big, and a pixel that trusts its feature by mistake keeps its noise to itself: so more is taken.
fn doubted(variance: &PaddedPlane) -> PaddedPlane {
    let smooth = variance.blurred(&box_weights(3));
    PaddedPlane::from_fn(variance.size(), |i| DOUBT * smooth.at(i))
}

/// How much more noise of features is expected than is seen of it.
const DOUBT: f32 = 2.0;
/// Share of the distance that pixels of one surface may differ by beyond its slope.
const DISPARITY: f32 = 0.01;

#[cfg(test)]
mod tests;
