//! What the film gathers for denoising: the samples of each pixel in two halves, and what they show.
//!
//! The two halves are estimates of one picture that are strangers to each other: what they agree on is no noise.

use glam::Vec3;

/// What a sample shows once mirrors and clear glass are seen through.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeenFeature {
    /// Share of white light that comes back from what is seen, each channel 1 at most; the colour of what shines by
    /// itself, cut at 1.
    pub albedo: Vec3,
    /// Unit normal of what is seen, by how much of it is; zero of what lies behind everything.
    pub normal: Vec3,
}

impl SeenFeature {
    /// Adds something that `share` of the sample shows.
    pub fn add(&mut self, share: Vec3, albedo: Vec3, normal: Vec3) {
        let share = share.min(Vec3::ONE);
        let light = share * albedo.min(Vec3::ONE);
        if light.is_finite() && normal.is_finite() {
            self.albedo = (self.albedo + light).min(Vec3::ONE);
            self.normal += normal * share.max_element();
        }
    }
}

/// Sums over half of the samples of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct HalfSums {
    count: f32,
    color: Vec3,
    /// As `color`, by weights that may have signs, and the sum of these.
    weighted: Vec3,
    weight: f32,
    albedo: Vec3,
    seen: SeenFeature,
    disparity: f32,
}

/// Sums over the samples of a pixel, half by half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DenoiseSum {
    halves: [HalfSums; 2],
    squares: Vec3,
}

impl DenoiseSum {
    /// Adds a sample to one of the halves; `first` is the albedo and the distance of what its
    /// camera ray met.
    pub fn add(&mut self, second: bool, color: Vec3, weight: f32, first: Option<(Vec3, f32)>, seen: &SeenFeature) {
        let half = &mut self.halves[usize::from(second)];
        half.count += 1.0;
        half.color += color;
        half.weighted += color * weight;
        half.weight += weight;
        // What lies behind everything is not lit: its colour counts as it is.
        half.albedo += first.map_or(Vec3::ONE, |(albedo, _)| albedo);
        half.disparity += first.map_or(0.0, |(_, depth)| 1.0 / depth.max(1e-9));
        half.seen.albedo += seen.albedo;
        half.seen.normal += seen.normal;
        self.squares += color * color;
    }

    /// Means, and how far they may be off; `None` if a half has no samples.
    pub fn resolve(&self) -> Option<DenoisePixel> {
        let [a, b] = &self.halves;
        let count = a.count + b.count;
        if a.count == 0.0 || b.count == 0.0 {
            return None;
        }
        let mean = (a.color + b.color) / count;
        let variance = ((self.squares - mean * mean * count) / (count - 1.0)).max(Vec3::ZERO);
        let half = |half: &HalfSums| {
            let mean = half.color / half.count;
            HalfPixel {
                color: (mean + (half.weighted - mean * half.weight) / half.count).max(Vec3::ZERO),
                albedo: half.albedo / half.count,
                seen: SeenFeature { albedo: half.seen.albedo / half.count, normal: half.seen.normal / half.count },
                disparity: half.disparity / half.count,
            }
        };
        Some(DenoisePixel { halves: [half(a), half(b)], variance: variance / (0.5 * count), samples: count })
    }
}

/// Means over half of the samples of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HalfPixel {
    pub color: Vec3,
    /// Of the first hit; white where there is none.
    pub albedo: Vec3,
    pub seen: SeenFeature,
    /// One over the distance of the first hit, 0 where there is none.
    pub disparity: f32,
}

/// A pixel in two halves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DenoisePixel {
    pub halves: [HalfPixel; 2],
    /// Variance of the colour of one half by that of single samples: up to five times too much, as these are well spread.
    pub variance: Vec3,
    /// Of both halves.
    pub samples: f32,
}
