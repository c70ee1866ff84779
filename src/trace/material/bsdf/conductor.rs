//! Metal: facets that are mirrors, and what they lose to each other given back (Kulla and Conty, SIGGRAPH course 2017),
//! with the colour that a random walk over facets gives it.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::bsdf_sample::{BsdfSample, weighed};
use super::microfacet::{Microfacets, mirrored};
use super::tables;
use crate::trace::material::{ShadingParams, metal_reflectance};
use crate::trace::sampler::cosine_hemisphere;

/// What a polished metal reflects at a cosine, per channel.
pub fn polished_metal(m: &ShadingParams, cosine: f32) -> Vec3 {
    Conductor::new(m).reflectance(cosine)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    facets: Microfacets,
    /// What is reflected straight on; where `k` is not 0, it follows from the index of refraction.
    f0: Vec3,
    index: Option<[Vec3; 2]>,
    /// Mean of what a facet reflects, over the hemisphere, by the cosine.
    mean: Vec3,
}

impl Conductor {
    pub fn new(m: &ShadingParams) -> Self {
        let index = (m.eta != Vec3::ZERO).then_some([m.eta, m.k]);
        let straight = |[eta, k]: [Vec3; 2]| metal_reflectance(1.0, eta, k);
        let f0 = index.map_or(m.diffuse, straight);
        let mean = if index.is_some() { m.mean_fresnel } else { schlick_mean(f0) };
        Conductor { facets: Microfacets { alpha: m.alpha }, f0, index, mean }
    }

    /// A metal that reflects this colour straight on.
    pub fn with_color(f0: Vec3, alpha: f32) -> Self {
        Conductor { facets: Microfacets { alpha }, f0, index: None, mean: schlick_mean(f0) }
    }

    /// What the polished metal mirrors.
    pub fn mirrors(&self, cosine: f32) -> Vec3 {
        self.reflectance(cosine)
    }

    pub fn is_smooth(&self) -> bool {
        self.facets.is_smooth()
    }

    /// Share that a facet reflects.
    fn reflectance(&self, cosine: f32) -> Vec3 {
        match self.index {
            Some([eta, k]) => metal_reflectance(cosine.clamp(0.0, 1.0), eta, k),
            None => schlick(self.f0, cosine),
        }
    }

    /// Colour of the light that comes back after more than one facet: each of them reflects the mean, and after each but
    /// the first it gets away with the same chance. That chance was measured by random walks over GGX facets (Heitz et
    /// al., SIGGRAPH 2016), from polished to alpha 1 and for reflectances of 0.4 and 0.8: it is
    /// 1 - alpha * 1.5 z / (1 + 2.2 z) to within 0.03. Both directions share what is missing to 1, so that light goes both
    /// ways alike; `MEAN_TRAPPED` is what the share comes to on average over the other direction.
    fn bounced(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let trapped = |z: f32| 1.5 * z / (1.0 + 2.2 * z);
        let trapped = (trapped(wo.z) + trapped(wi.z) - MEAN_TRAPPED).clamp(0.0, 1.0) * self.facets.alpha;
        let f = self.mean;
        f * f * (1.0 - trapped) / (Vec3::ONE - f * trapped)
    }

    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if self.is_smooth() || wi.z <= 0.0 || wo.z <= 0.0 {
            return Vec3::ZERO;
        }
        let (facets, alpha) = (self.facets, self.facets.alpha);
        let h = (wo + wi).normalize_or(Vec3::Z);
        let once = facets.density(h) * facets.seen_by_both(wo, wi) / (4.0 * wo.z);
        let (lost_o, lost_i) = (1.0 - tables::metal(wo.z, alpha), 1.0 - tables::metal(wi.z, alpha));
        let mean = tables::metal_mean(alpha);
        let more = lost_o * lost_i / (1.0 - mean).max(1e-6) * (wi.z * FRAC_1_PI);
        self.reflectance(wo.dot(h)) * once + self.bounced(wo, wi) * more
    }

    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.is_smooth() || wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let h = (wo + wi).normalize_or(Vec3::Z);
        let once = self.facets.seen(wo) * self.facets.density(h) / (4.0 * wo.z);
        let share = tables::metal(wo.z, self.facets.alpha);
        share * once + (1.0 - share) * wi.z * FRAC_1_PI
    }

    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        if self.is_smooth() {
            return Some(BsdfSample::specular(Vec3::new(-wo.x, -wo.y, wo.z), self.reflectance(wo.z)));
        }
        let wi = if lobe < tables::metal(wo.z, self.facets.alpha) {
            mirrored(wo, self.facets.sample(wo, u))
        } else {
            cosine_hemisphere(u)
        };
        weighed(wi, self.eval(wo, wi), self.pdf(wo, wi))
    }
}

/// See [`Conductor::bounced`].
const MEAN_TRAPPED: f32 = 0.40;

/// Schlick's approximation (1994).
fn schlick(f0: Vec3, cosine: f32) -> Vec3 {
    let m = 1.0 - cosine.clamp(0.0, 1.0);
    f0 + (Vec3::ONE - f0) * (m * m * m * m * m)
}

/// Its mean over the hemisphere, by the cosine.
fn schlick_mean(f0: Vec3) -> Vec3 {
    f0 + (Vec3::ONE - f0) / 21.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::material::mean_metal_reflectance;

    /// Gold of roughness 1 in white light against random walks over GGX facets, 200 000 a direction.
    #[test]
    fn rough_gold_gives_back_what_random_walks_over_its_facets_do() {
        let (eta, k) = (Vec3::new(0.18, 0.42, 1.37), Vec3::new(3.42, 2.35, 1.77));
        let facets = Microfacets { alpha: 1.0 };
        let f0 = metal_reflectance(1.0, eta, k);
        let gold = Conductor { facets, f0, index: Some([eta, k]), mean: mean_metal_reflectance(eta, k) };
        for (cosine, walks) in [(1.0f32, [0.8762, 0.5980, 0.1885]), (0.5, [0.8986, 0.6542, 0.2420])] {
            let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let mut sum = Vec3::ZERO;
            const SAMPLES: u32 = 1 << 14;
            for i in 0..SAMPLES {
                let u = crate::trace::sampler::sobol::pair(i, 7, 1);
                let lobe = crate::trace::sampler::sobol::single(i, 7, 2);
                sum += gold.sample(wo, u, lobe).map_or(Vec3::ZERO, |s| s.weight);
            }
            let mean = sum / SAMPLES as f32;
            assert!((mean - Vec3::from(walks)).abs().max_element() < 0.006, "{cosine}: {mean}");
        }
    }

    #[test]
    fn gold_and_glass_have_their_known_reflectances() {
        // ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)
        let gold = metal_reflectance(1.0, Vec3::new(0.18, 0.42, 1.37), Vec3::new(3.42, 2.35, 1.77));
        for (got, (n, k)) in gold.to_array().into_iter().zip([(0.18f32, 3.42f32), (0.42, 2.35), (1.37, 1.77)]) {
            let expected = ((n - 1.0) * (n - 1.0) + k * k) / ((n + 1.0) * (n + 1.0) + k * k);
            assert!((got - expected).abs() < 1e-5, "{got} {expected}");
        }
        // Without extinction it is the dielectric's.
        for cosine in [0.05, 0.3, 0.8] {
            let there = crate::trace::material::fresnel(crate::components::Fresnel::Exact, cosine, 1.0 / 1.5);
            assert!((metal_reflectance(cosine, Vec3::splat(1.5), Vec3::ZERO).x - there).abs() < 1e-4);
        }
        assert!((metal_reflectance(0.0, Vec3::ONE, Vec3::splat(3.0)) - Vec3::ONE).length() < 1e-5);
    }
}
