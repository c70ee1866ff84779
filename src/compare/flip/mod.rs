//! FLIP: how different two pictures look to a person who flips between them, pixel by pixel, from 0 to 1.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator for Alternating Images"
//! (2020) for pictures as they are shown, and Andersson, Nilsson, Shirley, Akenine-Möller: "Visualizing Errors in
//! Rendered High Dynamic Range Images" (2021) for linear light of any brightness. Both pictures are blurred as the eye
//! blurs them at a viewing distance, colours are compared in CIELAB with the Hunt effect, and differences at edges and
//! points count for more.
//!
//! Everything is computed in `f64` with `libm`, in bands of rows: the map does not depend on the machine or on threads.
//! The reference implementation works in `f32`; the maps agree to about 1e-4, and so do their means if the mean of the
//! map is taken in `f64` (the reference sums its mean in `f32`, which drifts on large pictures).

mod color;
mod filters;
pub mod magma;

use rayon::prelude::*;

use color::{DISTANCE_POWER, aces, almost_white, decoded, hyab, largest_distance, perceived, positive};
use filters::{FeatureFilters, Pixels, Planes, Rows, SpatialFilters};

use crate::base::limits;

/// How the pictures are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewing {
    /// Pixels that one degree of the visual field covers; above 0.
    pub pixels_per_degree: f64,
}

impl Default for Viewing {
    /// A screen that is 3840 pixels and 0.7 m wide, seen from 0.7 m: the viewing conditions of the paper.
    fn default() -> Self {
        Viewing { pixels_per_degree: 3840.0 * std::f64::consts::PI / 180.0 }
    }
}

/// The exposures at which linear pictures are compared, in stops, equally spaced, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// The darkest one.
    pub start: f64,
    /// The brightest one, `start` at least.
    pub stop: f64,
    /// At least 1.
    pub count: u32,
}

/// The FLIP error of every pixel, top row first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorMap {
    /// Pixels of a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// From 0 (looks the same) to 1.
    pub errors: Vec<f32>,
}

impl ErrorMap {
    /// The mean error of all pixels, summed in `f64` row by row.
    pub fn mean(&self) -> f64 {
        let rows = self.errors.chunks(self.width.max(1) as usize);
        let sum: f64 = rows.map(|row| row.iter().map(|e| f64::from(*e)).sum::<f64>()).sum();
        sum / self.errors.len().max(1) as f64
    }

    /// The largest error of any pixel; 0 of no pixels.
    pub fn largest(&self) -> f32 {
        self.errors.iter().copied().fold(0.0, f32::max)
    }
}

/// Compares two pictures as they are shown: sRGB-encoded colours, which are clamped to 0..1.
///
/// Both slices hold rows of `width` colours, top row first, and have one length.
pub fn ldr(width: u32, reference: &[[f32; 3]], test: &[[f32; 3]], viewing: Viewing) -> ErrorMap {
    let decode = |color: [f32; 3]| color.map(decoded);
    let compare = |bands: &Bands, rows| bands.errors(rows, &decode);
    by_bands(width, reference, test, viewing, &compare)
}

/// Compares two pictures of linear light: the largest error over a range of exposures, each tone mapped (ACES).
///
/// Both slices hold rows of `width` colours, top row first, and have one length. A pixel of which one picture holds a
/// number and the other none has the error 1. It matters which picture is the reference only for [`exposures`].
pub fn hdr(width: u32, reference: &[[f32; 3]], test: &[[f32; 3]], viewing: Viewing, exposures: Exposures) -> ErrorMap {
    let Exposures { start, stop, count } = exposures;
    let count = count.clamp(1, limits::FLIP_EXPOSURES);
    let step = if count > 1 { (stop - start) / f64::from(count - 1) } else { 0.0 };
    let compare = |bands: &Bands, rows: Rows| {
        let mut worst: Vec<f64> = Vec::new();
        for i in 0..count {
            let gain = libm::exp2(start + f64::from(i) * step);
            let errors = bands.errors(rows, &|color: [f32; 3]| color.map(|x| aces(positive(x) * gain).min(1.0)));
            match worst.is_empty() {
                true => worst = errors,
                false => worst.iter_mut().zip(errors).for_each(|(worst, error)| *worst = worst.max(error)),
            }
        }
        worst
    };
    let mut map = by_bands(width, reference, test, viewing, &compare);
    for (error, (a, b)) in map.errors.iter_mut().zip(reference.iter().zip(test)) {
        if a.iter().zip(b).any(|(a, b)| a.is_nan() != b.is_nan()) {
            *error = 1.0;
        }
    }
    map
}

/// The exposures that the paper derives from a reference picture of linear light: from the one at which its brightest
/// pixel is just not white to the one at which half of its pixels are.
///
/// Where more than half of the picture is black the median of the others is taken, which the paper leaves open; a black
/// picture is compared as it is.
pub fn exposures(reference: &[[f32; 3]]) -> Exposures {
    let luminance = |c: &[f32; 3]| 0.2126 * positive(c[0]) + 0.7152 * positive(c[1]) + 0.0722 * positive(c[2]);
    let mut all: Vec<f64> = reference.iter().map(luminance).collect();
    all.sort_unstable_by(f64::total_cmp);
    let largest = all.last().copied().unwrap_or(0.0);
    if largest <= 0.0 {
        return Exposures { start: 0.0, stop: 0.0, count: 1 };
    }
    let black = all.partition_point(|x| *x <= 0.0);
    let median = if all[all.len() / 2] > 0.0 { all[all.len() / 2] } else { all[black + (all.len() - black) / 2] };
    let white = almost_white();
    let (start, stop) = (libm::log2(white / largest), libm::log2(white / median));
    let count = libm::ceil(stop - start).clamp(2.0, f64::from(limits::FLIP_EXPOSURES));
    Exposures { start, stop, count: count as u32 }
}

/// Rows of one band: few enough for a core's own memory, many beside the rows that neighbouring bands share.
const BAND: usize = 48;

fn by_bands(
    width: u32,
    reference: &[[f32; 3]],
    test: &[[f32; 3]],
    viewing: Viewing,
    compare: &(dyn Fn(&Bands, Rows) -> Vec<f64> + Sync),
) -> ErrorMap {
    let count = reference.len().min(test.len());
    let pixels = |colors| Pixels { width: width as usize, colors };
    let bands = Bands {
        reference: pixels(&reference[..count]),
        test: pixels(&test[..count]),
        spatial: SpatialFilters::new(viewing.pixels_per_degree),
        feature: FeatureFilters::new(viewing.pixels_per_degree),
        largest_distance: largest_distance(),
    };
    let height = bands.reference.height();
    let starts: Vec<usize> = (0..height).step_by(BAND).collect();
    let parts: Vec<Vec<f64>> =
        starts.into_par_iter().map(|start| compare(&bands, (start, (start + BAND).min(height)))).collect();
    let errors = parts.into_iter().flatten().map(|e| e as f32).collect();
    ErrorMap { width, height: height as u32, errors }
}

/// Two pictures and the filters that they are compared with.
struct Bands<'a> {
    reference: Pixels<'a>,
    test: Pixels<'a>,
    spatial: SpatialFilters,
    feature: FeatureFilters,
    largest_distance: f64,
}

/// What the eye makes of the rows of one band: colours in CIELAB after the Hunt effect, edges and points.
struct PerceivedBand {
    colors: Vec<[f64; 3]>,
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Bands<'_> {
    fn errors(&self, rows: Rows, linear: &dyn Fn([f32; 3]) -> [f64; 3]) -> Vec<f64> {
        let (reference, test) = (self.see(self.reference, rows, linear), self.see(self.test, rows, linear));
        let error = |i: usize| {
            let color = self.color_error(reference.colors[i], test.colors[i]);
            let edge = (reference.edges[i] - test.edges[i]).abs();
            let point = (reference.points[i] - test.points[i]).abs();
            let feature = (edge.max(point) / std::f64::consts::SQRT_2).sqrt();
            libm::pow(color, 1.0 - feature)
        };
        (0..reference.colors.len()).map(error).collect()
    }

    /// The distance of two colours from 0 to 1, small ones spread out.
    fn color_error(&self, a: [f64; 3], b: [f64; 3]) -> f64 {
        /// Shares of the largest distance and of the range of errors where the two pieces of the map meet.
        const KNEE: f64 = 0.4;
        const AT_KNEE: f64 = 0.95;
        let distance = libm::pow(hyab(a, b), DISTANCE_POWER);
        let knee = KNEE * self.largest_distance;
        if distance < knee {
            return distance * AT_KNEE / knee;
        }
        AT_KNEE + (distance - knee) / (self.largest_distance - knee) * (1.0 - AT_KNEE)
    }

    fn see(&self, pixels: Pixels, rows: Rows, linear: &dyn Fn([f32; 3]) -> [f64; 3]) -> PerceivedBand {
        let reach = self.spatial.achromatic.len().max(self.feature.smooth.len()) / 2;
        let planes = Planes::new(pixels, rows, reach, linear);
        let blurred = |plane: &[f64], taps: &[f64]| planes.columns(&planes.along_rows(plane, taps), taps);
        let SpatialFilters { achromatic, red_green, blue_yellow: [wide, narrow] } = &self.spatial;
        let [y, cx, cz] = &planes.channels;
        let (light, red) = (blurred(y, achromatic), blurred(cx, red_green));
        let (blue, more_blue) = (blurred(cz, wide), blurred(cz, narrow));
        let colors = (0..light.len()).map(|i| perceived([light[i], red[i], blue[i] + more_blue[i]])).collect();
        let gray: Vec<f64> = y.iter().map(|y| (y + 16.0) / 116.0).collect();
        let FeatureFilters { smooth, edge, point } = &self.feature;
        let smooth_rows = planes.along_rows(&gray, smooth);
        let strength = |taps: &[f64]| -> Vec<f64> {
            let across = planes.columns(&planes.along_rows(&gray, taps), smooth);
            let down = planes.columns(&smooth_rows, taps);
            across.iter().zip(down).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        PerceivedBand { colors, edges: strength(edge), points: strength(point) }
    }
}

#[cfg(test)]
mod tests;
