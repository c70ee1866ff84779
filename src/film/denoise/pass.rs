//! One pass of non-local means over two half buffers: each is filtered by weights that the other one gives.

#![allow(clippy::needless_range_loop, reason = "loops over several slices at once are those that compile to lanes")]

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::plane::PaddedPlane;

/// Rows that are filtered together: few enough that what is noted of them stays in the cache.
const BAND: usize = 16;

/// Squared differences of normals and of albedos that a factor of 1/e stands for, where they are known exactly.
const NORMAL: f32 = 0.03;
const ALBEDO: f32 = 0.01;
/// Weights fall as (1 - d / 8)^8, which is near to e^-d, and is 0 beyond 8.
const REACH: f32 = 8.0;

/// Share of light by which pixels may differ though they have no noise: it does not show.
const UNSEEN: f32 = 1e-3;

/// A half buffer on its way through the passes.
#[derive(Clone)]
pub struct HalfLight {
    /// Light: colour over the albedo of the first hit.
    pub light: [PaddedPlane; 3],
    /// The same without fireflies: what weights and the choice among levels go by.
    pub guide: [PaddedPlane; 3],
    /// Variance of the guide, summed over the channels.
    pub variance: PaddedPlane,
}

/// What the pixels show, whichever half is looked at; with the variance of each group, by which it fades.
pub struct FeaturePlanes {
    pub normal: [PaddedPlane; 3],
    pub normal_variance: PaddedPlane,
    pub albedo: [PaddedPlane; 3],
    pub albedo_variance: PaddedPlane,
    /// One over the distance: 0 where nothing stands.
    pub disparity: PaddedPlane,
    /// Squared difference of it that does not count, to any neighbour.
    pub disparity_slack: PaddedPlane,
    /// Square of its change from pixel to pixel.
    pub disparity_slope: PaddedPlane,
}

/// Taps of a pass.
#[derive(Clone, Copy)]
pub struct PassShape {
    /// Taps to each side, and pixels from one to the next.
    pub radius: isize,
    pub step: isize,
    /// Difference in standard deviations that a factor of 1/e stands for.
    pub bandwidth: f32,
}

/// A variance, at least what does not show.
pub fn with_unseen(variance: &PaddedPlane, light: &[PaddedPlane; 3]) -> PaddedPlane {
    PaddedPlane::from_fn(variance.size(), |i| {
        let square: f32 = light.iter().map(|plane| plane.at(i) * plane.at(i)).sum();
        variance.at(i) + UNSEEN * UNSEEN * square
    })
}

/// Sums of a band of rows, for one half: three channels of light, three of the guide, and the weights.
struct BandSums([Vec<f32>; 7]);

/// Filters both halves; variances stay those of the input. Once `cancel` is raised the result is of no use.
pub fn filter(
    halves: &[HalfLight; 2],
    features: &FeaturePlanes,
    shape: PassShape,
    cancel: &AtomicBool,
) -> [HalfLight; 2] {
    let [width, height] = features.disparity.size();
    let bands: Vec<[BandSums; 2]> = (0..height.div_ceil(BAND))
        .into_par_iter()
        .map(|band| filter_band((halves, features), shape, band * BAND..((band + 1) * BAND).min(height), cancel))
        .collect();
    [0, 1].map(|half| {
        let plane = |channel: usize| {
            let mut plane = halves[half].variance.clone();
            plane.fill_rows(|y, row| {
                let BandSums(sums) = &bands[y / BAND][half];
                let at = y % BAND * width;
                for x in 0..width {
                    row[x] = sums[channel][at + x] / sums[6][at + x];
                }
            });
            plane
        };
        let (light, guide) = ([plane(0), plane(1), plane(2)], [plane(3), plane(4), plane(5)]);
        HalfLight { light, guide, variance: halves[half].variance.clone() }
    })
}

fn filter_band(
    (halves, features): (&[HalfLight; 2], &FeaturePlanes),
    shape: PassShape,
    rows: std::ops::Range<usize>,
    cancel: &AtomicBool,
) -> [BandSums; 2] {
    let [width, _] = features.disparity.size();
    // The pixel itself counts in full.
    let mut sums = [0, 1].map(|half: usize| {
        let HalfLight { light, guide, .. } = &halves[half];
        let own = |plane: &PaddedPlane| rows.clone().flat_map(|y| plane.row(y).to_vec()).collect::<Vec<f32>>();
        let [r, g, b] = light.each_ref().map(own);
        let [x, y, z] = guide.each_ref().map(own);
        BandSums([r, g, b, x, y, z, vec![1.0; rows.len() * width]])
    });
    let mut distances = [0, 1].map(|_| vec![0.0; (rows.len() + 2) * (width + 2)]);
    let mut apart = vec![0.0; width];
    let mut patch = vec![0.0; width + 2];
    let mut weights = vec![0.0; width];
    let taps = if cancel.load(Ordering::Relaxed) { 0..=0 } else { -shape.radius..=shape.radius };
    for (dx, dy) in taps.clone().flat_map(|dy| taps.clone().map(move |dx| (dx, dy))).filter(|tap| *tap != (0, 0)) {
        let offset = [dx * shape.step, dy * shape.step];
        for (half, distances) in halves.iter().zip(&mut distances) {
            for (i, row) in distances.chunks_mut(width + 2).enumerate() {
                color_distances(half, rows.start as isize + i as isize - 1, offset, shape.bandwidth, row);
            }
        }
        for (i, y) in rows.clone().enumerate() {
            feature_distances(features, y, offset, &mut apart);
            for half in [0, 1] {
                let of_patch = &distances[1 - half][i * (width + 2)..(i + 3) * (width + 2)];
                patch_weights(of_patch, &apart, &mut patch, &mut weights);
                add(&mut sums[half], &halves[half], i, y, offset, &weights);
            }
        }
    }
    sums
}

/// Distances of the pixels of a row, one beyond each end included, to those at an offset: what the difference of the
/// guides is beyond the noise to be expected of it (Rousselle, Knaus and Zwicker, SIGGRAPH Asia 2012).
fn color_distances(half: &HalfLight, y: isize, [dx, dy]: [isize; 2], bandwidth: f32, out: &mut [f32]) {
    let len = out.len();
    let [r, g, b] = half.guide.each_ref().map(|plane| plane.part(-1, y, len));
    let [rr, gg, bb] = half.guide.each_ref().map(|plane| plane.part(dx - 1, y + dy, len));
    let (v, vv) = (half.variance.part(-1, y, len), half.variance.part(dx - 1, y + dy, len));
    let k2 = bandwidth * bandwidth;
    for x in 0..len {
        let (p, q, s) = (r[x] - rr[x], g[x] - gg[x], b[x] - bb[x]);
        let least = if v[x] < vv[x] { v[x] } else { vv[x] };
        out[x] = (p * p + q * q + s * s - (v[x] + least)) / (k2 * (v[x] + vv[x]) + 1e-20);
    }
}

/// Distances of the features of a row to those at an offset.
fn feature_distances(f: &FeaturePlanes, y: usize, [dx, dy]: [isize; 2], out: &mut [f32]) {
    let len = out.len();
    let (y, steps) = (y as isize, (dx * dx + dy * dy) as f32);
    fn both(plane: &PaddedPlane, y: isize, [dx, dy]: [isize; 2], len: usize) -> [&[f32]; 2] {
        [plane.part(0, y, len), plane.part(dx, y + dy, len)]
    }
    let pair = |plane| both(plane, y, [dx, dy], len);
    fn group(
        [[a, aa], [b, bb], [c, cc]]: [[&[f32]; 2]; 3],
        [v, vv]: [&[f32]; 2],
        tolerance: f32,
        out: &mut [f32],
        first: bool,
    ) {
        for x in 0..out.len() {
            let (p, q, s) = (a[x] - aa[x], b[x] - bb[x], c[x] - cc[x]);
            let least = if v[x] < vv[x] { v[x] } else { vv[x] };
            let d = (p * p + q * q + s * s - (v[x] + least)) / (tolerance + v[x] + vv[x]);
            let d = if d > 0.0 { d } else { 0.0 };
            out[x] = if first { d } else { out[x] + d };
        }
    }
    let [n0, n1, n2] = f.normal.each_ref();
    group([pair(n0), pair(n1), pair(n2)], pair(&f.normal_variance), NORMAL, out, true);
    let [a0, a1, a2] = f.albedo.each_ref();
    group([pair(a0), pair(a1), pair(a2)], pair(&f.albedo_variance), ALBEDO, out, false);
    let ([z, zz], [s, ss]) = (pair(&f.disparity), pair(&f.disparity_slack));
    let slope = f.disparity_slope.part(0, y, len);
    for x in 0..len {
        let d = z[x] - zz[x];
        let slack = s[x] + ss[x];
        let d = (d * d - slack) / (slack + slope[x] * steps + 1e-30);
        out[x] += if d > 0.0 { d } else { 0.0 };
    }
}

/// Weights of a row: of patches of 3 x 3 distances, and of features.
fn patch_weights(distances: &[f32], apart: &[f32], patch: &mut [f32], weights: &mut [f32]) {
    let (wide, len) = (patch.len(), weights.len());
    let (above, rest) = distances.split_at(wide);
    let (here, below) = rest.split_at(wide);
    for x in 0..wide {
        patch[x] = above[x] + here[x] + below[x];
    }
    let (left, middle, right) = (&patch[..len], &patch[1..len + 1], &patch[2..len + 2]);
    for x in 0..len {
        let d = (left[x] + middle[x] + right[x]) * (1.0 / 9.0);
        let d = if d > 0.0 { d } else { 0.0 } + apart[x];
        let t = 1.0 - d * (1.0 / REACH);
        let t = if t > 0.0 { t } else { 0.0 };
        let (t2, t4) = (t * t, t * t * t * t);
        weights[x] = t2 * t2 * t4;
    }
}

fn add(BandSums(sums): &mut BandSums, half: &HalfLight, i: usize, y: usize, [dx, dy]: [isize; 2], weights: &[f32]) {
    let len = weights.len();
    let range = i * len..(i + 1) * len;
    for (plane, sum) in half.light.iter().chain(&half.guide).zip(sums.iter_mut()) {
        let (from, to) = (plane.part(dx, y as isize + dy, len), &mut sum[range.clone()]);
        for x in 0..len {
            to[x] += from[x] * weights[x];
        }
    }
    let to = &mut sums[6][range];
    for x in 0..len {
        to[x] += weights[x];
    }
}
