//! The film: what samples add up to, linear pixels of one frame, and their way to numbers of a picture file.
//!
//! Pixels are linear and of any size (scene referred). [`accumulator`] adds samples up, tile by tile; [`filter`] draws where
//! in and around a pixel they lie; `catcher` makes alpha of shadows; [`layers`] say what the pixels show; [`denoise`]
//! takes out noise; [`tone`] makes what a screen can show of the result; [`bounds`] are rectangles of a frame that is not
//! rendered as a whole, [`rows`] filter one that comes in bands, `redenoise` one that was edited.

pub mod accumulator;
pub mod bounds;
mod catcher;
mod denoise;
mod dither;
pub mod filter;
pub mod layers;
mod redenoise;
pub mod rows;
pub mod tone;

pub use accumulator::{AccumulatorOptions, PixelAccumulator};
pub use bounds::PixelBounds;
pub use catcher::{CaughtLight, CaughtShadow, CaughtSum};
pub use denoise::{DENOISE_REACH, DenoisePixel, SeenFeature, denoise, denoise_until};
pub use filter::FilterTable;
pub use layers::{Feature, Layers};
pub use redenoise::DenoiseHistory;
pub use rows::RowDenoiser;
pub use tone::DisplayTransform;

use rayon::prelude::*;

/// Linear RGB pixels of any size, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// Top row first.
    pub pixels: Vec<[f32; 3]>,
    /// What the pixels show, as far as it was asked for.
    pub layers: Layers,
    /// Where the first pixel lies in its frame, of which the film may be a part.
    pub origin: [u32; 2],
}

impl Film {
    /// A black film without layers.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = vec![[0.0; 3]; width as usize * height as usize];
        Film { width, height, pixels, layers: Layers::default(), origin: [0; 2] }
    }

    /// The part of a film that covers `bounds` of a frame.
    pub fn cropped(&self, bounds: PixelBounds, part: PixelBounds) -> Film {
        let [width, height] = part.size;
        let (pixels, layers) = (bounds.crop(&self.pixels, part), self.layers.cropped(bounds, part));
        Film { width, height, pixels, layers, origin: part.origin }
    }

    /// Adds rows of the same width and with the same layers below.
    pub fn append(&mut self, mut rows: Film) {
        if self.layers.caught.len() + rows.layers.caught.len() > 0 {
            self.layers.caught.resize(self.pixels.len(), CaughtShadow::default());
            rows.layers.caught.resize(rows.pixels.len(), CaughtShadow::default());
        }
        self.height += rows.height;
        self.pixels.extend(rows.pixels);
        self.layers.append(rows.layers);
    }

    /// RGB bytes, three per pixel, rounded to nearest or dithered.
    pub fn to_rgb8(&self, display: DisplayTransform) -> Vec<u8> {
        let (width, [left, top]) = (self.width.max(1) as usize, self.origin.map(|at| at as usize));
        let dithers = display.dithers();
        let mut bytes = vec![0; 3 * self.pixels.len()];
        let rows = bytes.par_chunks_mut(3 * width).zip(self.pixels.par_chunks(width)).enumerate();
        rows.for_each(|(y, (bytes, colors))| {
            for (x, (to, color)) in bytes.chunks_exact_mut(3).zip(colors).enumerate() {
                let exposed = display.expose(*color);
                for (k, to) in to.iter_mut().enumerate() {
                    *to = if dithers {
                        display.dithered_byte(exposed[k], dither::threshold(left + x, top + y, k))
                    } else {
                        display.byte(exposed[k])
                    };
                }
            }
        });
        bytes
    }

    /// As [`Self::to_rgb8`], with alpha in a fourth byte: colours are straight, as files for the screen have them.
    pub fn to_rgba8(&self, display: DisplayTransform) -> Vec<u8> {
        let straight = Film { pixels: self.straight(), layers: Layers::default(), ..*self };
        let colors = straight.to_rgb8(display);
        let alpha = (0..self.pixels.len()).map(|i| (self.alpha(i).clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
        colors.chunks_exact(3).zip(alpha).flat_map(|(c, alpha)| [c[0], c[1], c[2], alpha]).collect()
    }

    /// As [`Self::to_rgba8`], in 16 bits.
    pub fn to_rgba16(&self, display: DisplayTransform) -> Vec<u16> {
        let shown = |(i, color): (usize, [f32; 3])| {
            let [r, g, b] = display.expose(color).map(|x| display.word(x));
            [r, g, b, (self.alpha(i).clamp(0.0, 1.0) * 65535.0 + 0.5) as u16]
        };
        self.straight().into_iter().enumerate().flat_map(shown).collect()
    }

    /// Share of a pixel that something covers; all of it where nobody asked.
    pub fn alpha(&self, pixel: usize) -> f32 {
        self.layers.coverage.get(pixel).copied().unwrap_or(1.0)
    }

    /// Colours of what covers the pixels; black where nothing does.
    fn straight(&self) -> Vec<[f32; 3]> {
        let of = |(i, color): (usize, &[f32; 3])| match self.alpha(i) {
            alpha if alpha > 0.0 => color.map(|x| x / alpha),
            _ => [0.0; 3],
        };
        self.pixels.iter().enumerate().map(of).collect()
    }

    /// RGB in 16 bits, three per pixel, rounded to nearest.
    pub fn to_rgb16(&self, display: DisplayTransform) -> Vec<u16> {
        self.pixels.iter().flat_map(|color| display.expose(*color).map(|x| display.word(x))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::{Render, Transfer};

    #[test]
    fn pixels_are_clamped_rounded_and_never_nan() {
        let pixels = vec![[-1.0, 0.5, 2.0], [f32::NAN, 1.0 / 255.0, 1.0]];
        let film = Film { pixels, ..Film::new(2, 1) };
        let display = |transfer| DisplayTransform::new(&Render { transfer, ..Render::default() });
        assert_eq!(film.to_rgb8(display(Transfer::Linear)), [0, 128, 255, 0, 1, 255]);
        assert_eq!(film.to_rgb8(display(Transfer::Srgb)), [0, 188, 255, 0, 13, 255]);
        assert_eq!(film.to_rgb16(display(Transfer::Linear))[1], 32768);
    }

    #[test]
    fn alpha_is_straight_beside_bytes() {
        let mut film = Film { pixels: vec![[0.25, 0.125, 0.0], [0.5, 0.5, 0.5], [0.0; 3]], ..Film::new(3, 1) };
        let display = DisplayTransform::new(&Render { transfer: Transfer::Linear, ..Render::default() });
        assert_eq!(film.to_rgba8(display)[3], 255);
        film.layers.coverage = vec![0.5, 1.0, 0.0];
        assert_eq!(film.to_rgba8(display), [128, 64, 0, 128, 128, 128, 128, 255, 0, 0, 0, 0]);
        assert_eq!(film.to_rgba16(display)[..4], [32768, 16384, 0, 32768]);
    }

    #[test]
    fn a_dithered_gradient_keeps_its_mean_and_what_is_a_code_stays() {
        let render = Render { dither: true, transfer: Transfer::Linear, ..Render::default() };
        let grey = |x: f32| Film { pixels: vec![[x / 255.0; 3]; 4096], ..Film::new(64, 64) };
        for x in [0.0, 17.0, 255.0] {
            assert!(grey(x).to_rgb8(DisplayTransform::new(&render)).iter().all(|byte| *byte == x as u8));
        }
        for x in [0.25, 100.5, 254.9] {
            let bytes = grey(x).to_rgb8(DisplayTransform::new(&render));
            let mean = bytes.iter().map(|byte| f32::from(*byte)).sum::<f32>() / bytes.len() as f32;
            assert!((mean - x).abs() < 1e-3, "{x} {mean}");
        }
    }
}
