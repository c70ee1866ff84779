//! Tiles of a still camera: what may look otherwise than in the picture before is sampled again, the rest is kept.
//!
//! Samples are strangers to each other, so that each can be kept by itself; sums are then made of old and new samples
//! in the order in which all of them would be taken. Where samples decide about others (noise and its rounds), where
//! more than colours is wanted of them, or where memory is short, the samples of a pixel are kept or taken together.

use super::adaptive::whole_blocks;
use super::{BATCH, Share, View, expose_pixels, place_in_pixel, trace_batch};
use crate::film::PixelAccumulator;
use crate::trace::Worker;
use crate::trace::footprint::{Changes, Trail};
use crate::trace::sampler::Sampler;

/// Brings the tally of a tile's pixels up to date; gives how many samples or pixels of the trail were taken again.
pub fn expose_again(
    view: View,
    places: &[[u32; 2]],
    changes: &Changes,
    trail: &mut Trail,
    tally: &mut PixelAccumulator,
    worker: &mut Worker,
) -> usize {
    let stale = trail.stale(changes);
    if stale.is_empty() {
        return 0;
    }
    if trail.each() > 0 {
        samples(view, places, (&stale, changes), trail, tally, worker);
        return stale.len();
    }
    let pixels = if view.settings.noise.is_some() { whole_blocks(places, &stale) } else { stale };
    let count = pixels.len();
    pixels.iter().for_each(|pixel| tally.clear(*pixel as usize));
    trail.begin_pixels(&pixels, changes, &mut worker.footprint);
    expose_pixels(view, places, pixels.clone(), Share::WHOLE, std::slice::from_mut(tally), worker);
    trail.keep_pixels(&pixels, &worker.footprint, changes.picture);
    count
}

/// Takes single samples, and adds up their pixels.
fn samples(
    view: View,
    places: &[[u32; 2]],
    (stale, changes): (&[u32], &Changes),
    trail: &mut Trail,
    tally: &mut PixelAccumulator,
    worker: &mut Worker,
) {
    let each = trail.each();
    let sampler = |unit: u32| {
        let place = places[(unit / each) as usize];
        let mut sampler: Sampler = view.settings.sampler(view.settings.seed, place, view.width);
        sampler.sample = unit % each;
        (place, sampler)
    };
    let mut buffers = std::mem::take(&mut worker.waves);
    for units in stale.chunks(BATCH) {
        worker.footprint.begin(units.iter().map(|unit| trail.outlook(*unit, changes)));
        let batch: Vec<_> = units.iter().map(|unit| sampler(*unit)).collect();
        trace_batch(view, &batch, &mut buffers, worker);
        trail.keep_samples(units, &buffers.colors, &worker.footprint, changes.picture);
    }
    worker.waves = buffers;
    for units in stale.chunk_by(|a, b| a / each == b / each) {
        let pixel = units[0] / each;
        tally.clear(pixel as usize);
        for (sample, color) in trail.colors_of(pixel as usize).iter().enumerate() {
            let weighs = view.filter.is_signed();
            let weight = if weighs { place_in_pixel(view, &sampler(pixel * each + sample as u32).1).1 } else { 1.0 };
            tally.add(pixel as usize, *color, weight);
        }
    }
}
