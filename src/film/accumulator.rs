//! Accumulates the samples of pixels; what is made of the sums comes later.
//!
//! Sums can be added to in several goes (rounds of samples, slices of time) before they are resolved into means.

use glam::Vec3;

use super::catcher::{CaughtLight, CaughtShadow, CaughtSum};
use super::denoise::{DenoisePixel, DenoiseSum, SeenFeature};
use super::layers::{Feature, FeatureSum};
use crate::base::color::luminance;

/// Largest value of a channel of a sample: sums of as many as there can be stay inside `f32`.
const LARGEST: f32 = 1e30;

/// Sums over the samples of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct PixelSum {
    color: Vec3,
    /// As `color`, by weight; only where weights differ.
    weighted: Vec3,
    weight: f32,
    count: u32,
}

/// What is accumulated, beside what every picture needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccumulatorOptions {
    /// Whether weights have signs, and so differ.
    pub signed: bool,
    /// Whether the variance of the samples is wanted.
    pub moments: bool,
    /// Whether what the camera's rays met first is wanted.
    pub features: bool,
    /// Whether samples are wanted in two halves, for denoising.
    pub halves: bool,
}

/// Sums over the samples of the pixels of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelAccumulator {
    sums: Vec<PixelSum>,
    /// Sums of luminance and of its square; empty unless wanted.
    moments: Vec<[f64; 2]>,
    /// Empty unless wanted.
    features: Vec<FeatureSum>,
    /// Empty unless wanted.
    halves: Vec<DenoiseSum>,
    /// Empty until a sample meets a shadow catcher.
    caught: Vec<CaughtSum>,
    signed: bool,
}

impl PixelAccumulator {
    /// An accumulator for so many pixels, without samples.
    pub fn new(pixels: usize, options: AccumulatorOptions) -> Self {
        let AccumulatorOptions { signed, moments, features, halves } = options;
        PixelAccumulator {
            sums: vec![PixelSum::default(); pixels],
            moments: vec![[0.0; 2]; if moments { pixels } else { 0 }],
            features: vec![FeatureSum::default(); if features { pixels } else { 0 }],
            halves: vec![DenoiseSum::default(); if halves { pixels } else { 0 }],
            caught: Vec::new(),
            signed,
        }
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> usize {
        let sums = size_of_val(&*self.sums) + size_of_val(&*self.moments);
        sums + size_of_val(&*self.features) + size_of_val(&*self.halves) + size_of_val(&*self.caught)
    }

    /// Takes all samples of a pixel back.
    pub fn clear(&mut self, pixel: usize) {
        self.sums[pixel] = PixelSum::default();
        if let Some(moments) = self.moments.get_mut(pixel) {
            *moments = [0.0; 2];
        }
        if let Some(sum) = self.features.get_mut(pixel) {
            *sum = FeatureSum::default();
        }
        if let Some(sum) = self.halves.get_mut(pixel) {
            *sum = DenoiseSum::default();
        }
        if let Some(sum) = self.caught.get_mut(pixel) {
            *sum = CaughtSum::default();
        }
    }

    /// Adds a sample to a pixel. A colour that is no number, or infinite, counts as black.
    #[inline]
    pub fn add(&mut self, pixel: usize, color: Vec3, weight: f32) {
        let color = bounded(color);
        let sum = &mut self.sums[pixel];
        sum.count += 1;
        sum.color += color;
        if self.signed {
            sum.weighted += color * weight;
            sum.weight += weight;
        }
        if let Some([first, second]) = self.moments.get_mut(pixel) {
            let light = f64::from(luminance(color.to_array()));
            *first += light;
            *second += light * light;
        }
    }

    /// Adds what a sample that was added to a pixel has seen of a shadow catcher: its noise is that of the lit surface.
    pub fn add_caught(&mut self, pixel: usize, second: bool, caught: CaughtLight, weight: f32) {
        if self.caught.is_empty() {
            self.caught = vec![CaughtSum::default(); self.sums.len()];
        }
        let CaughtLight { with_objects, without_objects, behind } = caught;
        let [with_objects, without_objects, behind] = [with_objects, without_objects, behind].map(bounded);
        self.caught[pixel].add(second, CaughtLight { with_objects, without_objects, behind }, weight);
        if let Some([first, second]) = self.moments.get_mut(pixel) {
            let light = f64::from(luminance(with_objects.to_array()));
            *first += light;
            *second += light * light;
        }
    }

    /// What a pixel shows of shadow catchers, if it shows some.
    pub fn caught(&self, pixel: usize) -> Option<CaughtShadow> {
        let all = &self.sums[pixel];
        let weight = if self.signed { all.weight } else { all.count as f32 };
        self.caught.get(pixel)?.resolve(all.count, weight)
    }

    /// As [`Self::color`], with what shadow catchers show.
    pub fn shown(&self, pixel: usize) -> [f32; 3] {
        let darkened = self.caught(pixel).unwrap_or_default().darkened();
        let color = self.color(pixel);
        [0, 1, 2].map(|k| color[k] + darkened[k])
    }

    /// Adds what a sample met first, if that is wanted; see [`FeatureSum::add`].
    pub fn add_feature(&mut self, pixel: usize, feature: Option<&Feature>, off_center: f32, weight: f32) {
        if let Some(sum) = self.features.get_mut(pixel) {
            sum.add(feature, off_center, weight);
        }
    }

    /// Adds what hides a share of what lies behind everything from a sample that met nothing, if features are wanted.
    pub fn add_veil(&mut self, pixel: usize, share: f32, weight: f32) {
        if let Some(sum) = self.features.get_mut(pixel) {
            sum.add_veil(share, weight);
        }
    }

    /// Adds a sample to its half, if halves are wanted: its colour and weight, what it met first, and what it shows.
    pub fn add_half(
        &mut self,
        pixel: usize,
        second: bool,
        (color, weight): (Vec3, f32),
        first: Option<&Feature>,
        seen: &SeenFeature,
    ) {
        if let Some(sum) = self.halves.get_mut(pixel) {
            let first = first.map(|first| (first.albedo, first.depth));
            sum.add(second, bounded(color), weight, first, seen);
        }
    }

    /// The samples of a pixel in two halves, if they are wanted; of no samples where a half has none.
    pub fn halves(&self, pixel: usize) -> Option<DenoisePixel> {
        self.halves.get(pixel).map(|sum| sum.resolve().unwrap_or_default())
    }

    /// What the samples of a pixel met first, if that is wanted.
    pub fn feature(&self, pixel: usize) -> Option<&FeatureSum> {
        self.features.get(pixel)
    }

    /// How many samples were added to a pixel.
    pub fn samples(&self, pixel: usize) -> u32 {
        self.sums[pixel].count
    }

    /// Mean luminance of a pixel's samples and the variance of that mean, if it is wanted: the variance of the samples
    /// over their number. Two samples at least are needed to tell.
    pub fn spread(&self, pixel: usize) -> Option<[f64; 2]> {
        let [first, second] = *self.moments.get(pixel)?;
        let count = f64::from(self.sums[pixel].count.max(1));
        let mean = first / count;
        let variance = (second - first * mean).max(0.0) / (count - 1.0).max(1.0);
        Some([mean, variance / count])
    }

    /// The linear colour of a pixel; black without samples.
    ///
    /// Where weights differ, the weighted mean of what the samples are apart from their plain mean is added to that:
    /// a surface of one colour keeps it, whatever the weights of a few samples happen to add up to, and nothing is
    /// divided by a sum that could vanish. It may be negative beside what is much brighter, as the filter is.
    pub fn color(&self, pixel: usize) -> [f32; 3] {
        let sum = &self.sums[pixel];
        let count = sum.count.max(1) as f32;
        let mean = sum.color / count;
        if !self.signed {
            return mean.to_array();
        }
        (mean + (sum.weighted - mean * sum.weight) / count).to_array()
    }
}

/// The colour with its largest channel brought down to what sums can hold, so that its hue stays.
#[inline]
fn bounded(color: Vec3) -> Vec3 {
    if !color.is_finite() {
        return Vec3::ZERO;
    }
    let largest = color.max_element();
    if largest > LARGEST { color * (LARGEST / largest) } else { color }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: AccumulatorOptions =
        AccumulatorOptions { signed: false, moments: false, features: false, halves: false };

    #[test]
    fn the_spread_is_that_of_the_samples() {
        let mut accumulator = PixelAccumulator::new(1, AccumulatorOptions { moments: true, ..PLAIN });
        [1.0, 2.0, 3.0, 6.0].into_iter().for_each(|x| accumulator.add(0, Vec3::splat(x), 1.0));
        let [mean, variance] = accumulator.spread(0).unwrap();
        // The sum of squares about the mean 3 is 14; over 3, and over 4 samples.
        assert!((mean - 3.0).abs() < 1e-6 && (variance - 14.0 / 12.0).abs() < 1e-6, "{mean} {variance}");
        assert_eq!(PixelAccumulator::new(1, PLAIN).spread(0), None);
    }

    #[test]
    fn what_is_no_number_does_not_poison_a_pixel() {
        let mut accumulator = PixelAccumulator::new(2, PLAIN);
        for color in [Vec3::splat(f32::NAN), Vec3::new(1.0, f32::INFINITY, 0.0), Vec3::splat(3.0), Vec3::ZERO] {
            accumulator.add(0, color, 1.0);
        }
        assert_eq!(accumulator.color(0), [0.75; 3]);
        assert_eq!(accumulator.color(1), [0.0; 3]);
        (0..65_536).for_each(|_| accumulator.add(1, Vec3::splat(f32::MAX), 1.0));
        assert!(accumulator.color(1)[0].is_finite());
    }

    #[test]
    fn one_colour_stays_whatever_the_weights() {
        let mut accumulator = PixelAccumulator::new(1, AccumulatorOptions { signed: true, ..PLAIN });
        for weight in [1.2, -1.2, 1.2, -1.2] {
            accumulator.add(0, Vec3::splat(0.5), weight);
        }
        assert_eq!(accumulator.color(0), [0.5; 3]);
    }
}
