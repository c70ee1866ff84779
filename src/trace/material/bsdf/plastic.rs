//! A clear coat over a diffuse base.
//!
//! What the coat does not reflect goes down to the base, comes back dimmed, and part of it is thrown back again from
//! below; the base's share is shaped so that a white one loses nothing (Kelemen and Szirmay-Kalos, Eurographics 2001).

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::bsdf_sample::{BsdfSample, weighed};
use super::microfacet::{Microfacets, mirrored};
use super::tables;
use crate::trace::material::{ShadingParams, share};
use crate::trace::sampler::cosine_hemisphere;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    facets: Microfacets,
    eta: f32,
    /// What leaves the coat again of the light that has entered it.
    base: Vec3,
    /// Mean of what the coat lets in, over the hemisphere.
    mean: f32,
}

impl Plastic {
    pub fn new(m: &ShadingParams) -> Self {
        let mean = 1.0 - tables::reflected_mean(m.alpha, m.ior);
        // Seen from below the coat reflects more: what enters must be able to leave.
        let inside = (1.0 - mean / (m.ior * m.ior)).max(0.0);
        let base = m.diffuse * (1.0 - inside) / (Vec3::ONE - m.diffuse * inside).max(Vec3::splat(1e-6));
        Plastic { facets: Microfacets { alpha: m.alpha }, eta: m.ior, base, mean }
    }

    /// The same over a black base.
    pub fn coat_alone(&self) -> Self {
        Plastic { base: Vec3::ZERO, ..*self }
    }

    /// Share that the coat reflects.
    fn coat(&self, z: f32) -> f32 {
        if self.facets.is_smooth() { share(z, self.eta) } else { tables::reflected(z, self.facets.alpha, self.eta) }
    }

    /// Chance that a sample is of the coat.
    fn chance(&self, wo: Vec3) -> f32 {
        let coat = self.coat(wo.z);
        coat / (coat + (1.0 - coat) * self.base.max_element()).max(1e-9)
    }

    /// What the base adds to [`Self::eval`].
    pub fn diffuse(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let shape = (1.0 - self.coat(wo.z)) * (1.0 - self.coat(wi.z)) / self.mean.max(1e-6);
        self.base * (shape * wi.z * FRAC_1_PI)
    }

    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return Vec3::ZERO;
        }
        let matt = self.diffuse(wo, wi);
        if self.facets.is_smooth() {
            return matt;
        }
        let h = (wo + wi).normalize_or(Vec3::Z);
        let seen = self.facets.density(h) * self.facets.seen_by_both(wo, wi) / (4.0 * wo.z);
        matt + Vec3::splat(share(wo.dot(h), self.eta) * seen)
    }

    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let chance = self.chance(wo);
        let matt = (1.0 - chance) * wi.z * FRAC_1_PI;
        if self.facets.is_smooth() {
            return matt;
        }
        let h = (wo + wi).normalize_or(Vec3::Z);
        matt + chance * self.facets.seen(wo) * self.facets.density(h) / (4.0 * wo.z)
    }

    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let chance = self.chance(wo);
        let wi = if lobe >= chance {
            cosine_hemisphere(u)
        } else if self.facets.is_smooth() {
            let weight = Vec3::splat(self.coat(wo.z) / chance);
            return Some(BsdfSample::specular(Vec3::new(-wo.x, -wo.y, wo.z), weight));
        } else {
            mirrored(wo, self.facets.sample(wo, u))
        };
        weighed(wi, self.eval(wo, wi), self.pdf(wo, wi))
    }
}
