//! Which level of filtering a pixel gets: the one whose error, as the halves tell of each other, is least.
//!
//! Half a is filtered by weights of half b alone, so that its difference to the unfiltered b is its own error and the
//! noise of b, which is known. That one candidate is the picture as it was makes that no part of it gets worse.

#![allow(clippy::needless_range_loop, reason = "loops over several slices at once are those that compile to lanes")]

use super::plane::{PaddedPlane, gaussian_weights};

/// Deviations in pixels of the blur of errors, and of that of the choice.
const OF_ERRORS: f32 = 3.0;
const OF_CHOICE: f32 = 2.2;
/// Errors count relative to brightness to this power: nearly as they are seen.
const BRIGHTNESS_POWER: f32 = 1.2;
/// The mean of all samples of a well spread set is better than the halves say: its error is taken to be this share.
const UNFILTERED: f32 = 0.5;

/// A picture from two halves.
pub struct Candidate {
    pub halves: [[PaddedPlane; 3]; 2],
}

/// How much of each candidate a pixel shows. The first is the unfiltered picture, `variance` that of each of its halves,
/// summed over the channels; of pixels with `too_few` samples to choose by, the last is taken.
pub fn choose(
    variance: &PaddedPlane,
    candidates: &[Candidate],
    too_few: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<PaddedPlane> {
    let raw = &candidates[0].halves;
    let size = variance.size();
    let last = &candidates[candidates.len() - 1].halves;
    let brightness = PaddedPlane::from_fn(size, |i| {
        let mean = |k: usize| 0.5 * (last[0][k].at(i) + last[1][k].at(i));
        libm::powf((mean(0) + mean(1) + mean(2)).max(0.0) / 3.0 + 1e-4, BRIGHTNESS_POWER)
    });
    let smooth = gaussian_weights(OF_ERRORS);
    let errors: Vec<PaddedPlane> = candidates
        .iter()
        .enumerate()
        .map(|(number, candidate)| {
            let [a, b] = &candidate.halves;
            let error = PaddedPlane::from_fn(size, |i| {
                let mut sum = -variance.at(i);
                for k in 0..3 {
                    let (a, b) = (a[k].at(i), b[k].at(i));
                    let (p, q, between) = (a - raw[1][k].at(i), b - raw[0][k].at(i), a - b);
                    sum += 0.5 * (p * p + q * q) - 0.25 * between * between;
                }
                let share = if number == 0 { UNFILTERED } else { 1.0 };
                share * sum / brightness.at(i)
            });
            error.blurred(&smooth)
        })
        .collect();
    let soft = gaussian_weights(OF_CHOICE);
    let best = |i: usize| {
        if too_few(i) {
            return candidates.len() - 1;
        }
        let mut best = 0;
        for (number, error) in errors.iter().enumerate() {
            if error.at(i) < errors[best].at(i) {
                best = number;
            }
        }
        best
    };
    let choice = PaddedPlane::from_fn(size, |i| best(i) as f32);
    let chosen = |number: usize| PaddedPlane::from_fn(size, |i| f32::from(u8::from(choice.at(i) == number as f32)));
    (0..candidates.len()).map(|number| chosen(number).blurred(&soft)).collect()
}
