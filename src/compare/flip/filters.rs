//! The filters of FLIP, and a band of a picture that they are applied to.

use super::color::opponent;
use crate::base::limits;

/// Colours of a picture, row by row from the top, `width` to a row.
#[derive(Clone, Copy)]
pub struct Pixels<'a> {
    pub width: usize,
    pub colors: &'a [[f32; 3]],
}

impl Pixels<'_> {
    pub fn height(&self) -> usize {
        self.colors.len() / self.width.max(1)
    }
}

/// Rows of a band: the first one, and the one behind the last.
pub type Rows = (usize, usize);

/// Weights of the filters that blur as the eye does: of the achromatic and the red-green channel, and the two Gaussians
/// whose sum is that of the blue-yellow channel.
pub struct SpatialFilters {
    pub achromatic: Vec<f64>,
    pub red_green: Vec<f64>,
    pub blue_yellow: [Vec<f64>; 2],
}

impl SpatialFilters {
    pub fn new(pixels_per_degree: f64) -> Self {
        use std::f64::consts::PI;
        // Amplitude and width of the contrast sensitivity functions (table 1 of the paper), in degrees.
        const ACHROMATIC: f64 = 0.0047;
        const RED_GREEN: f64 = 0.0053;
        const BLUE_YELLOW: [[f64; 2]; 2] = [[34.1, 0.04], [13.5, 0.025]];
        let widest = BLUE_YELLOW[0][1];
        let radius = radius(3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree);
        // A Gaussian of two dimensions is a product: each axis carries the root of its amplitude.
        let taps = |[amplitude, width]: [f64; 2]| -> Vec<f64> {
            let height = (amplitude * (PI / width).sqrt()).sqrt();
            let at = |i: i64| {
                let x = i as f64 / pixels_per_degree;
                height * libm::exp(-PI * PI * x * x / width)
            };
            (-radius..=radius).map(at).collect()
        };
        let single = |width: f64| scaled(taps([1.0, width]), |sum| sum);
        let [wide, narrow] = BLUE_YELLOW.map(taps);
        let sums = [&wide, &narrow].map(|taps| taps.iter().sum::<f64>());
        let whole = (sums[0] * sums[0] + sums[1] * sums[1]).sqrt();
        SpatialFilters {
            achromatic: single(ACHROMATIC),
            red_green: single(RED_GREEN),
            blue_yellow: [scaled(wide, |_| whole), scaled(narrow, |_| whole)],
        }
    }
}

/// Weights that find edges and points in the achromatic channel: a Gaussian, its first and its second derivative.
pub struct FeatureFilters {
    pub smooth: Vec<f64>,
    pub edge: Vec<f64>,
    pub point: Vec<f64>,
}

impl FeatureFilters {
    pub fn new(pixels_per_degree: f64) -> Self {
        /// Width of a feature in degrees.
        const WIDTH: f64 = 0.082;
        let deviation = 0.5 * WIDTH * pixels_per_degree;
        let radius = radius(3.0 * deviation);
        let gauss = |x: f64| libm::exp(-x * x / (2.0 * deviation * deviation));
        let taps = |of: &dyn Fn(f64) -> f64| (-radius..=radius).map(|i| of(i as f64)).collect::<Vec<f64>>();
        FeatureFilters {
            smooth: scaled(taps(&gauss), |sum| sum),
            edge: balanced(taps(&|x| -x * gauss(x))),
            point: balanced(taps(&|x| (x * x / (deviation * deviation) - 1.0) * gauss(x))),
        }
    }
}

/// Whole pixels that a filter reaches. However near a viewer is said to be, it reaches no farther than a picture.
fn radius(pixels: f64) -> i64 {
    libm::ceil(pixels).clamp(0.0, f64::from(limits::FRAME_SIDE)) as i64
}

fn scaled(mut taps: Vec<f64>, by: impl Fn(f64) -> f64) -> Vec<f64> {
    let by = by(taps.iter().sum());
    taps.iter_mut().for_each(|tap| *tap /= by);
    taps
}

/// Positive weights add up to 1, negative ones to -1.
fn balanced(mut taps: Vec<f64>) -> Vec<f64> {
    let sum = |sign: f64| taps.iter().filter(|tap| **tap * sign > 0.0).map(|tap| tap * sign).sum::<f64>();
    let (above, below) = (sum(1.0), sum(-1.0));
    for tap in &mut taps {
        let by = if *tap > 0.0 { above } else { below };
        // A filter of a single pixel finds nothing.
        *tap = if by > 0.0 { *tap / by } else { 0.0 };
    }
    taps
}

/// A band of a picture in YCxCz, with the rows above and below that filters reach.
pub struct Planes {
    width: usize,
    /// The first row that is held.
    top: usize,
    /// Rows of the whole picture.
    height: usize,
    rows: Rows,
    pub channels: [Vec<f64>; 3],
}

impl Planes {
    pub fn new(pixels: Pixels, rows: Rows, reach: usize, linear: &dyn Fn([f32; 3]) -> [f64; 3]) -> Self {
        let (width, height) = (pixels.width, pixels.height());
        let (top, end) = (rows.0.saturating_sub(reach), (rows.1 + reach).min(height));
        let held = &pixels.colors[top * width..end * width];
        let mut channels: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(held.len()));
        for color in held {
            let opponent = opponent(linear(*color));
            channels.iter_mut().zip(opponent).for_each(|(channel, value)| channel.push(value));
        }
        Planes { width, top, height, rows, channels }
    }

    /// Filters every row that is held; beyond its ends a row goes on as it ends.
    pub fn along_rows(&self, plane: &[f64], taps: &[f64]) -> Vec<f64> {
        let (width, radius) = (self.width, taps.len() / 2);
        let mut padded = vec![0.0; width + 2 * radius];
        let mut out = Vec::with_capacity(plane.len());
        for row in plane.chunks_exact(width) {
            padded[..radius].fill(row[0]);
            padded[radius..radius + width].copy_from_slice(row);
            padded[radius + width..].fill(row[width - 1]);
            out.extend((0..width).map(|x| taps.iter().zip(&padded[x..]).map(|(tap, value)| tap * value).sum::<f64>()));
        }
        out
    }

    /// Filters the columns of the band's own rows; above and below the picture it goes on as it ends.
    pub fn columns(&self, plane: &[f64], taps: &[f64]) -> Vec<f64> {
        let (width, radius) = (self.width, taps.len() / 2);
        let mut out = vec![0.0; (self.rows.1 - self.rows.0) * width];
        for (y, sums) in (self.rows.0..self.rows.1).zip(out.chunks_exact_mut(width)) {
            for (i, tap) in taps.iter().enumerate() {
                let from = (y + i).saturating_sub(radius).min(self.height - 1) - self.top;
                let row = &plane[from * width..][..width];
                sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += tap * value);
            }
        }
        out
    }
}
