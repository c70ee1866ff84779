//! Samples of the pixels of a tile, in rounds and in batches.

use super::bounces::{Estimator, trace};
use crate::base::random::combine;
use crate::film::PixelAccumulator;
use crate::trace::sampler::{Domain, PixelSample, RayNode, SampleSet, Sampler};
use crate::trace::wavefront::{BATCH, CameraRayKernel, RenderContext, WavefrontBuffers, Worker, caught_light};

/// One of the equal parts that the samples of every pixel are divided into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleSubset {
    /// Which one, from 0.
    pub index: u32,
    /// How many there are, 1 at least.
    pub of: u32,
}

impl SampleSubset {
    /// All samples.
    pub const WHOLE: SampleSubset = SampleSubset { index: 0, of: 1 };

    /// Samples of a pixel that belong to this part.
    ///
    /// Which ones is drawn anew for each pixel, so that parts are strangers to strata of pixel, lens and lights. Where
    /// the number of samples is no multiple of the parts, chance decides per pixel which parts have one more: no part
    /// counts for more than another in the mean.
    pub(super) fn samples(self, pixel: &Sampler) -> impl Iterator<Item = u32> + use<> {
        const STEPS: u64 = 1 << 24;
        let pixel = *pixel;
        let count = pixel.strata * pixel.strata;
        let whole = self.of == 1;
        let shift = if whole { 0 } else { pixel.offset(Domain::Time, STEPS) };
        let bound = |part: u32| {
            let at = (u64::from(part) * u64::from(count) * STEPS).div_ceil(u64::from(self.of));
            (at.saturating_sub(shift).div_ceil(STEPS) as u32).min(count)
        };
        let slots = if whole { 0..count } else { bound(self.index)..bound(self.index + 1) };
        slots.map(move |slot| if whole { slot } else { pixel.shuffled(Domain::Time, slot) })
    }
}

/// Adds the samples of pixels (x, y), counted from the top left, to a tally with a place for each.
///
/// Pixels that follow each other in the list should be neighbours, and all of one tile. Samples come in rounds, each of
/// them well spread by itself: n x n strata under a key of its own. After each round the pixels that are still noisy go
/// on; which these are depends on their tile alone.
///
/// Of the samples of a round only a share is taken; where that is not the whole, all pixels get all rounds, so that
/// shares stay equal.
///
/// There is a tally for each light group; all but the light of what has a group of its own goes into the first.
pub fn render_pixels(
    estimator: Estimator,
    places: &[[u32; 2]],
    share: SampleSubset,
    tallies: &mut [PixelAccumulator],
    worker: &mut Worker,
) {
    render_active(estimator, places, (0..places.len() as u32).collect(), share, tallies, worker);
}

/// As [`render_pixels`], of some of the pixels: all of a block, where noise decides about rounds.
pub fn render_active(
    estimator: Estimator,
    places: &[[u32; 2]],
    mut active: Vec<u32>,
    share: SampleSubset,
    tallies: &mut [PixelAccumulator],
    worker: &mut Worker,
) {
    let Estimator { context, .. } = estimator;
    for round in 0..context.settings.rounds {
        if let Some(noise) = context.settings.noise.filter(|_| round > 0 && share == SampleSubset::WHOLE) {
            noise.retain_noisy(places, &tallies[0], &mut active);
        }
        if active.is_empty() {
            return;
        }
        let picked = SampleRound { round, share, places, active: &active };
        sample(estimator, picked, tallies, worker);
    }
}

/// Samples that are to be taken.
struct SampleRound<'a> {
    round: u32,
    share: SampleSubset,
    places: &'a [[u32; 2]],
    active: &'a [u32],
}

/// Adds a share of one round of samples to the active pixels.
fn sample(estimator: Estimator, picked: SampleRound, tallies: &mut [PixelAccumulator], worker: &mut Worker) {
    let Estimator { context, .. } = estimator;
    let SampleRound { round, share, places, active } = picked;
    let seed = if round == 0 { context.settings.seed } else { combine(context.settings.seed, round.into()) };
    let mut batch = SampleBatch::default();
    for pixel in active {
        let place = places[*pixel as usize];
        let mut sampler = context.settings.sampler(seed, place, context.width);
        for sample in share.samples(&sampler) {
            sampler.sample = sample;
            batch.pixels.push(*pixel as usize);
            batch.samples.push((place, sampler));
            if batch.samples.len() == BATCH {
                add_batch(estimator, &mut batch, tallies, worker);
            }
        }
    }
    add_batch(estimator, &mut batch, tallies, worker);
}

/// Samples that are traced together, [`BATCH`] at most.
#[derive(Default)]
struct SampleBatch {
    /// Numbers of their pixels in the list.
    pixels: Vec<usize>,
    /// Pixels, and samples of theirs.
    samples: Vec<PixelSample>,
}

/// Adds the samples to their pixels, and empties the batch.
fn add_batch(estimator: Estimator, batch: &mut SampleBatch, tallies: &mut [PixelAccumulator], worker: &mut Worker) {
    let Estimator { context, .. } = estimator;
    let mut buffers = std::mem::take(&mut worker.waves);
    if context.regions.is_some() {
        worker.footprint.begin_of_pixels(batch.pixels.iter().copied());
    }
    trace_batch(estimator, &batch.samples, &mut buffers, worker);
    for (i, (pixel, filter_sample)) in batch.pixels.drain(..).zip(&buffers.filter_samples).enumerate() {
        for (pass, tally) in tallies.iter_mut().enumerate() {
            tally.add(pixel, buffers.colors[pass * BATCH + i], filter_sample.weight);
        }
        if let Some(true) = buffers.caught.get(i) {
            let second = context.settings.is_second_half(&batch.samples[i].1);
            tallies[0].add_caught(pixel, second, caught_light(&buffers.colors, i), filter_sample.weight);
        }
        if context.settings.features {
            let (feature, weighted) = (buffers.features[i].as_ref(), (buffers.colors[i], filter_sample.weight));
            tallies[0].add_feature(pixel, feature, filter_sample.off_center, filter_sample.weight);
            if buffers.veils[i] > 0.0 {
                tallies[0].add_veil(pixel, buffers.veils[i], filter_sample.weight);
            }
            let second = context.settings.is_second_half(&batch.samples[i].1);
            tallies[0].add_half(pixel, second, weighted, feature, &buffers.seen[i]);
        }
        if context.regions.is_some() {
            worker.footprint.put_down(i, pixel);
        }
    }
    batch.samples.clear();
    worker.waves = buffers;
}

/// Traces samples of pixels, [`BATCH`] at most.
pub fn trace_batch(estimator: Estimator, samples: &[PixelSample], buffers: &mut WavefrontBuffers, worker: &mut Worker) {
    let Estimator { context, .. } = estimator;
    buffers.begin(context, samples.len());
    let mut numbers = std::mem::take(&mut buffers.numbers);
    let set = SampleSet::new(samples, &mut numbers);
    context.lanes.run(CameraRayKernel { context, samples: set, buffers });
    worker.traversal.counters.primary_rays += samples.len() as u64;
    trace(estimator, set, buffers, worker);
    buffers.numbers = numbers;
}

/// Where in and around its pixel a sample lies, from the top left corner, and its weight.
pub fn place_in_pixel(context: RenderContext, sampler: &Sampler) -> ([f32; 2], f32) {
    let square =
        if context.settings.strata == 1 { [0.5; 2] } else { sampler.in_own_cell(RayNode::CAMERA, Domain::Pixel) };
    context.filter.sample(square)
}
