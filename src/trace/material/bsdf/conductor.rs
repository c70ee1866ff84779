//! Metal: facets that are mirrors, and what they lose to each other given back (Kulla and Conty, SIGGRAPH course 2017).

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::bsdf_sample::{BsdfSample, weighed};
use super::microfacet::{Microfacets, mirrored};
use super::tables;
use crate::trace::material::ShadingParams;
use crate::trace::sampler::cosine_hemisphere;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    facets: Microfacets,
    /// What is reflected straight on; where `k` is not 0, it follows from the index of refraction.
    f0: Vec3,
    index: Option<[Vec3; 2]>,
}

impl Conductor {
    pub fn new(m: &ShadingParams) -> Self {
        let index = (m.eta != Vec3::ZERO).then_some([m.eta, m.k]);
        let straight = |[eta, k]: [Vec3; 2]| exact(1.0, eta, k);
        Conductor { facets: Microfacets { alpha: m.alpha }, f0: index.map_or(m.diffuse, straight), index }
    }

    /// A metal that reflects this colour straight on.
    pub fn with_color(f0: Vec3, alpha: f32) -> Self {
        Conductor { facets: Microfacets { alpha }, f0, index: None }
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
            Some([eta, k]) => exact(cosine.clamp(0.0, 1.0), eta, k),
            None => schlick(self.f0, cosine),
        }
    }

    /// Share of the lost light that comes back in the end.
    fn bounced(&self, mean: f32) -> Vec3 {
        let f = self.f0 + (Vec3::ONE - self.f0) / 21.0;
        f * f * mean / (Vec3::ONE - f * (1.0 - mean))
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
        self.reflectance(wo.dot(h)) * once + self.bounced(mean) * more
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

/// Schlick's approximation (1994).
fn schlick(f0: Vec3, cosine: f32) -> Vec3 {
    let m = 1.0 - cosine.clamp(0.0, 1.0);
    f0 + (Vec3::ONE - f0) * (m * m * m * m * m)
}

/// Fresnel reflectance of a metal for unpolarised light, per channel (Born and Wolf; in this form by Lagarde 2013).
fn exact(cosine: f32, eta: Vec3, k: Vec3) -> Vec3 {
    let c2 = cosine * cosine;
    let s2 = 1.0 - c2;
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - Vec3::splat(s2);
    let both = (t0 * t0 + 4.0 * eta2 * k2).map(|x| x.max(0.0).sqrt());
    let a = ((both + t0) * 0.5).map(|x| x.max(0.0).sqrt());
    let (t1, t2) = (both + Vec3::splat(c2), a * (2.0 * cosine));
    let across = (t1 - t2) / (t1 + t2).max(Vec3::splat(1e-12));
    let (t3, t4) = (both * c2 + Vec3::splat(s2 * s2), t2 * s2);
    let along = across * (t3 - t4) / (t3 + t4).max(Vec3::splat(1e-12));
    (across + along) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gold_and_glass_have_their_known_reflectances() {
        // ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)
        let gold = exact(1.0, Vec3::new(0.18, 0.42, 1.37), Vec3::new(3.42, 2.35, 1.77));
        for (got, (n, k)) in gold.to_array().into_iter().zip([(0.18f32, 3.42f32), (0.42, 2.35), (1.37, 1.77)]) {
            let expected = ((n - 1.0) * (n - 1.0) + k * k) / ((n + 1.0) * (n + 1.0) + k * k);
            assert!((got - expected).abs() < 1e-5, "{got} {expected}");
        }
        // Without extinction it is the dielectric's.
        for cosine in [0.05, 0.3, 0.8] {
            let there = crate::trace::material::fresnel(crate::components::Fresnel::Exact, cosine, 1.0 / 1.5);
            assert!((exact(cosine, Vec3::splat(1.5), Vec3::ZERO).x - there).abs() < 1e-4);
        }
        assert!((exact(0.0, Vec3::ONE, Vec3::splat(3.0)) - Vec3::ONE).length() < 1e-5);
    }
}
