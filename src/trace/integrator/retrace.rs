//! Tiles of a still camera: what may look otherwise than in the picture before is sampled again, the rest is kept.
//!
//! Samples are strangers to each other, so that each can be kept by itself; sums are then made of old and new samples
//! in the order in which all of them would be taken. Where samples decide about others (noise and its rounds), where
//! more than colours is wanted of them, or where memory is short, the samples of a pixel are kept or taken together.

use super::adaptive::whole_blocks;
use super::bounces::Estimator;
use super::tile::{SampleSubset, place_in_pixel, render_active, trace_batch};
use crate::film::PixelAccumulator;
use crate::trace::reuse::{Changes, SampleHistory};
use crate::trace::sampler::Sampler;
use crate::trace::wavefront::{BATCH, Worker};

/// Brings the tally of a tile's pixels up to date; gives how many samples or pixels of the history were taken again.
pub fn retrace(
    estimator: Estimator,
    places: &[[u32; 2]],
    changes: &Changes,
    history: &mut SampleHistory,
    tally: &mut PixelAccumulator,
    worker: &mut Worker,
) -> usize {
    let Estimator { context, .. } = estimator;
    let stale = history.stale(changes);
    if stale.is_empty() {
        return 0;
    }
    if history.each() > 0 {
        samples(estimator, places, (&stale, changes), history, tally, worker);
        return stale.len();
    }
    let pixels = if context.settings.noise.is_some() { whole_blocks(places, &stale) } else { stale };
    let count = pixels.len();
    pixels.iter().for_each(|pixel| tally.clear(*pixel as usize));
    history.begin_pixels(&pixels, changes, &mut worker.footprint);
    render_active(estimator, places, pixels.clone(), SampleSubset::WHOLE, std::slice::from_mut(tally), worker);
    history.keep_pixels(&pixels, &worker.footprint, changes.picture);
    count
}

/// Takes single samples, and adds up their pixels.
fn samples(
    estimator: Estimator,
    places: &[[u32; 2]],
    (stale, changes): (&[u32], &Changes),
    history: &mut SampleHistory,
    tally: &mut PixelAccumulator,
    worker: &mut Worker,
) {
    let Estimator { context, .. } = estimator;
    let each = history.each();
    let sampler = |unit: u32| {
        let place = places[(unit / each) as usize];
        let mut sampler: Sampler = context.settings.sampler(context.settings.seed, place, context.width);
        sampler.sample = unit % each;
        (place, sampler)
    };
    let mut buffers = std::mem::take(&mut worker.waves);
    for units in stale.chunks(BATCH) {
        worker.footprint.begin(units.iter().map(|unit| history.outlook(*unit, changes)));
        let batch: Vec<_> = units.iter().map(|unit| sampler(*unit)).collect();
        trace_batch(estimator, &batch, &mut buffers, worker);
        history.keep_samples(units, &buffers.colors, &worker.footprint, changes.picture);
    }
    worker.waves = buffers;
    for units in stale.chunk_by(|a, b| a / each == b / each) {
        let pixel = units[0] / each;
        tally.clear(pixel as usize);
        for (sample, color) in history.colors_of(pixel as usize).iter().enumerate() {
            let weighs = context.filter.is_signed();
            let weight = if weighs { place_in_pixel(context, &sampler(pixel * each + sample as u32).1).1 } else { 1.0 };
            tally.add(pixel as usize, *color, weight);
        }
    }
}
