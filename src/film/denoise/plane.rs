//! Planes of numbers with a margin around them, so that taps beyond the picture's edge read what lies at the edge.

#![allow(clippy::needless_range_loop, reason = "loops over several slices at once are those that compile to lanes")]

use rayon::prelude::*;

/// Pixels of margin on every side: as far as the widest taps and their patches reach, and the widest blur.
pub const MARGIN: usize = 10;

/// One number for each pixel, in rows with a margin.
#[derive(Clone, Debug)]
pub struct PaddedPlane {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl PaddedPlane {
    /// `value` is asked for every pixel by its number, from the top left.
    pub fn from_fn([width, height]: [usize; 2], value: impl Fn(usize) -> f32 + Sync) -> Self {
        let mut plane = PaddedPlane::empty([width, height]);
        plane.fill_rows(|y, row| {
            for (x, to) in row.iter_mut().enumerate() {
                *to = value(y * width + x);
            }
        });
        plane
    }

    fn empty([width, height]: [usize; 2]) -> Self {
        let values = vec![0.0; (width + 2 * MARGIN) * (height + 2 * MARGIN)];
        PaddedPlane { width, height, values }
    }

    fn stride(&self) -> usize {
        self.width + 2 * MARGIN
    }

    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Fills all rows without their margins, on any thread, and then the margin.
    pub fn fill_rows(&mut self, fill: impl Fn(usize, &mut [f32]) + Sync) {
        let (stride, width, height) = (self.stride(), self.width, self.height);
        let inner = &mut self.values[MARGIN * stride..(MARGIN + height) * stride];
        inner.par_chunks_mut(stride).enumerate().for_each(|(y, row)| {
            fill(y, &mut row[MARGIN..MARGIN + width]);
            let (first, last) = (row[MARGIN], row[MARGIN + width - 1]);
            row[..MARGIN].fill(first);
            row[MARGIN + width..].fill(last);
        });
        for y in 0..MARGIN {
            self.values.copy_within(MARGIN * stride..(MARGIN + 1) * stride, y * stride);
            let last = (MARGIN + height - 1) * stride;
            self.values.copy_within(last..last + stride, (MARGIN + height + y) * stride);
        }
    }

    /// So many numbers of a row from column `x` on; rows and columns from `-MARGIN` on.
    #[inline]
    pub fn part(&self, x: isize, y: isize, len: usize) -> &[f32] {
        let margin = MARGIN as isize;
        let first = (y + margin) as usize * self.stride() + (x + margin) as usize;
        &self.values[first..first + len]
    }

    /// A row without its margin.
    pub fn row(&self, y: usize) -> &[f32] {
        self.part(0, y as isize, self.width)
    }

    #[inline]
    pub fn at(&self, pixel: usize) -> f32 {
        let (x, y) = (pixel % self.width, pixel / self.width);
        self.values[(y + MARGIN) * self.stride() + x + MARGIN]
    }

    /// Blurred along both axes by weights of an odd number of taps, [`MARGIN`] on a side at most.
    pub fn blurred(&self, weights: &[f32]) -> PaddedPlane {
        let (width, reach) = (self.width, weights.len() / 2);
        let stride = self.stride();
        // Rows of the margin too: those above and below need them.
        let mut across = vec![0.0; self.values.len()];
        across.par_chunks_mut(stride).zip(self.values.par_chunks(stride)).for_each(|(to, from)| {
            let to = &mut to[MARGIN..MARGIN + width];
            for (tap, weight) in weights.iter().enumerate() {
                let from = &from[MARGIN + tap - reach..][..width];
                for x in 0..width {
                    to[x] += from[x] * weight;
                }
            }
        });
        let mut blurred = PaddedPlane::empty(self.size());
        blurred.fill_rows(|y, to| {
            for (tap, weight) in weights.iter().enumerate() {
                let from = &across[(y + MARGIN + tap - reach) * stride + MARGIN..][..width];
                for x in 0..width {
                    to[x] += from[x] * weight;
                }
            }
        });
        blurred
    }
}

/// Weights of a box so many pixels wide.
pub fn box_weights(width: usize) -> Vec<f32> {
    vec![1.0 / width as f32; width]
}

/// Weights of a Gaussian, cut off at the margin.
pub fn gaussian_weights(deviation: f32) -> Vec<f32> {
    let reach = ((2.5 * deviation) as i32 + 1).min(MARGIN as i32);
    let weight = |i: i32| libm::expf(-((i * i) as f32) / (2.0 * deviation * deviation));
    let sum: f32 = (-reach..=reach).map(weight).sum();
    (-reach..=reach).map(|i| weight(i) / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blur_keeps_sums_and_edges_read_what_lies_at_them() {
        let plane = PaddedPlane::from_fn([32, 24], |i| if i == 12 * 32 + 16 { 1.0 } else { 0.0 });
        for weights in [box_weights(7), gaussian_weights(2.2)] {
            let blurred = plane.blurred(&weights);
            let sum: f32 = (0..32 * 24).map(|i| blurred.at(i)).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        }
        let flat = PaddedPlane::from_fn([5, 3], |_| 2.0).blurred(&box_weights(21));
        assert!((0..15).all(|i| (flat.at(i) - 2.0).abs() < 1e-5));
        let ramp = PaddedPlane::from_fn([4, 2], |i| i as f32);
        assert_eq!((ramp.part(-2, -1, 4), ramp.part(2, 3, 4)), (&[0.0, 0.0, 0.0, 1.0][..], &[6.0, 7.0, 7.0, 7.0][..]));
    }
}
