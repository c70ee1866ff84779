//! Reconstruction filters, by drawing samples from them.
//!
//! A sample belongs to one pixel alone and lies where the pixel's filter puts it: its offset is drawn in proportion to
//! the filter's absolute value, and it counts with the filter's sign (Ernst, Stamminger and Greiner, "Filter importance
//! sampling", 2006; pbrt-v4, section 8.8). A pixel is then a function of its own samples, and strata stay strata.
//!
//! The function of one axis is tabulated as steps, fine enough not to show.

use crate::components::Filter;

/// Steps across the filter's width.
const STEPS: usize = 1024;

/// A filter ready to be sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct FilterTable {
    width: f32,
    /// Cumulative distribution of the filter's absolute value: its integral left of each step, and 1 at the end; empty for
    /// a box.
    cdf: Vec<f32>,
    /// Sign of each step.
    signs: Vec<f32>,
    /// Integral of the absolute value over the integral, along one axis: the absolute weight of a sample.
    weight_scale: f32,
}

impl FilterTable {
    /// `width` is the full width in pixels.
    pub fn new(filter: Filter, width: f64) -> Self {
        let plain = FilterTable { width: width as f32, cdf: Vec::new(), signs: Vec::new(), weight_scale: 1.0 };
        if filter == Filter::Box {
            return plain;
        }
        let value = |i: usize| value(filter, (i as f64 + 0.5) / STEPS as f64 * 2.0 - 1.0);
        let values: Vec<f64> = (0..STEPS).map(value).collect();
        let (mut absolute, mut mass, mut below) = (0.0, 0.0, Vec::with_capacity(STEPS + 1));
        for v in &values {
            below.push(absolute);
            absolute += v.abs();
            mass += v;
        }
        below.push(absolute);
        FilterTable {
            cdf: below.into_iter().map(|b| (b / absolute) as f32).collect(),
            signs: values.into_iter().map(|v| if v < 0.0 { -1.0 } else { 1.0 }).collect(),
            weight_scale: (absolute / mass) as f32,
            ..plain
        }
    }

    /// Whether samples may count negatively.
    pub fn is_signed(&self) -> bool {
        self.weight_scale > 1.0
    }

    /// Where a point of the unit square falls, as an offset from the pixel's top left corner, and its weight.
    ///
    /// The middle of the square is the middle of the pixel. A box of width 1 leaves points as they are.
    #[inline]
    pub fn sample(&self, square: [f32; 2]) -> ([f32; 2], f32) {
        if self.cdf.is_empty() {
            let apart = |u: f32| 0.5 + (u - 0.5) * self.width;
            return (if self.width == 1.0 { square } else { square.map(apart) }, 1.0);
        }
        let ([x, sign_x], [y, sign_y]) = (self.along(square[0]), self.along(square[1]));
        ([x, y], if self.is_signed() { sign_x * sign_y * self.weight_scale * self.weight_scale } else { 1.0 })
    }

    /// Offset along one axis and its sign.
    fn along(&self, u: f32) -> [f32; 2] {
        // The last step whose share lies at or below u: never one that holds nothing.
        let step = self.cdf.partition_point(|cdf| *cdf <= u).clamp(1, STEPS) - 1;
        let (left, right) = (self.cdf[step], self.cdf[step + 1]);
        let within = if right > left { ((u - left) / (right - left)).clamp(0.0, 1.0) } else { 0.5 };
        let place = (step as f32 + within) * (1.0 / STEPS as f32) - 0.5;
        [0.5 + place * self.width, self.signs[step]]
    }
}

/// The filter at x, from -1 to 1 across its width, times any constant.
fn value(filter: Filter, x: f64) -> f64 {
    let x = x.abs();
    match filter {
        Filter::Box => 1.0,
        Filter::Tent => 1.0 - x,
        // The edge lies at three standard deviations.
        Filter::Gaussian => libm::exp(-4.5 * x * x) - libm::exp(-4.5),
        Filter::Mitchell => mitchell(2.0 * x),
        Filter::BlackmanHarris => {
            let turn = |k: f64| libm::cos(std::f64::consts::PI * k * (x + 1.0));
            0.35875 - 0.48829 * turn(1.0) + 0.14128 * turn(2.0) - 0.01168 * turn(3.0)
        }
    }
}

/// Mitchell and Netravali with B = C = 1/3, for x from 0 to 2, times 18.
fn mitchell(x: f64) -> f64 {
    if x < 1.0 { (21.0 * x - 36.0) * x * x + 16.0 } else { ((-7.0 * x + 36.0) * x - 60.0) * x + 32.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Filter; 5] = [Filter::Box, Filter::Tent, Filter::Gaussian, Filter::Mitchell, Filter::BlackmanHarris];

    /// Mean weight, and weighted means of the offset from the centre and of its square, over a fine grid.
    fn moments(table: &FilterTable) -> [f64; 3] {
        let n = 4096;
        let mut sums = [0.0; 3];
        for i in 0..n {
            // Along one axis; in the middle of the other the sign is plus.
            let ([x, _], weight) = table.sample([(i as f32 + 0.5) / n as f32, 0.5]);
            let (x, weight) = (f64::from(x) - 0.5, f64::from(weight / table.weight_scale));
            for (sum, term) in sums.iter_mut().zip([1.0, x, x * x]) {
                *sum += weight * term / f64::from(n);
            }
        }
        sums
    }

    #[test]
    fn weights_are_one_on_average_and_offsets_are_centred() {
        for filter in ALL {
            let [mass, mean, _] = moments(&FilterTable::new(filter, filter.usual_width()));
            assert!((mass - 1.0).abs() < 2e-3 && mean.abs() < 1e-4, "{filter:?}: {mass} {mean}");
        }
    }

    #[test]
    fn variances_are_those_of_the_filters() {
        // By integration: w^2/12, w^2/24; that of Mitchell's cubic is 2 C - ... = by its second moment below.
        for (filter, width) in [(Filter::Box, 1.0), (Filter::Box, 2.5), (Filter::Tent, 2.0), (Filter::Mitchell, 4.0)] {
            let steps = 100_000;
            let (mut mass, mut square) = (0.0, 0.0);
            for i in 0..steps {
                let x = (f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0;
                mass += value(filter, x);
                square += value(filter, x) * x * x * width * width / 4.0;
            }
            let known = match filter {
                Filter::Box => width * width / 12.0,
                Filter::Tent => width * width / 24.0,
                Filter::Gaussian | Filter::Mitchell | Filter::BlackmanHarris => square / mass,
            };
            assert!((square / mass - known).abs() < 1e-6);
            let [_, _, variance] = moments(&FilterTable::new(filter, width));
            assert!((variance - known).abs() < 3e-3, "{filter:?}: {variance} {known}");
        }
        let gaussian = FilterTable::new(Filter::Gaussian, 6.0);
        assert!((moments(&gaussian)[2] - 1.0).abs() < 0.1, "{:?}", moments(&gaussian));
    }

    #[test]
    fn mitchells_cubics_have_their_published_values() {
        // (6 - 2B) / 6 = 8/9 at 0, B/6 = 1/18 at 1, and zero at 2, with no step between.
        for (x, expected) in [(0.0, 16.0), (1.0, 1.0), (2.0, 0.0), (8.0 / 7.0, 0.0)] {
            assert!((mitchell(x) - expected).abs() < 1e-12, "{x}");
        }
        assert!((mitchell(1.0 - 1e-9) - 1.0).abs() < 1e-6 && mitchell(1.5) < 0.0);
        assert!(FilterTable::new(Filter::Mitchell, 4.0).is_signed());
        assert!(!FilterTable::new(Filter::BlackmanHarris, 3.0).is_signed());
    }

    #[test]
    fn a_box_of_one_pixel_leaves_points_alone_and_centres_stay_centres() {
        let plain = FilterTable::new(Filter::Box, 1.0);
        for point in [[0.0, 0.123], [0.7, 0.999_999_9]] {
            assert_eq!(plain.sample(point), (point, 1.0));
        }
        for filter in ALL {
            let ([x, y], weight) = FilterTable::new(filter, 3.0).sample([0.5; 2]);
            assert!((x - 0.5).abs() < 1e-6 && x == y && weight > 0.0, "{filter:?} {x}");
            for edge in [0.0, 1.0 - f32::EPSILON / 2.0] {
                let ([x, _], _) = FilterTable::new(filter, 3.0).sample([edge, 0.5]);
                assert!((x - 0.5).abs() <= 1.500_001, "{filter:?} {x}");
            }
        }
    }
}
