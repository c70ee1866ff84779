//! Glass, polished or ground: Walter, Marschner, Li and Torrance, "Microfacet Models for Refraction" (EGSR 2007).
//!
//! What the facets of ground glass lose to each other is given back by a factor that depends on `wo` alone (Turquin
//! 2019): energy is kept exactly, reciprocity to within that factor.

use glam::Vec3;

use super::bsdf_sample::{BsdfSample, weighed};
use super::microfacet::{Microfacets, mirrored};
use super::tables;
use crate::trace::material::{ShadingParams, TransportMode, behind, scale, share};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    facets: Microfacets,
    /// Index ahead over index behind, as `wo` sees it.
    eta: f32,
    /// Factor of what goes through.
    scale: f32,
}

impl Dielectric {
    pub fn new(m: &ShadingParams, front: bool, transport: TransportMode) -> Self {
        let eta = if front { m.ior } else { 1.0 / m.ior };
        Dielectric { facets: Microfacets { alpha: m.alpha }, eta, scale: scale(eta, transport) }
    }

    pub fn is_smooth(&self) -> bool {
        self.facets.is_smooth()
    }

    /// The facet that sends light from `wi` to `wo`, on the side of `wo`, if one can.
    fn facet(&self, wo: Vec3, wi: Vec3) -> Option<Vec3> {
        let ahead = if wi.z > 0.0 { 1.0 } else { self.eta };
        let h = (wo + wi * ahead).normalize_or_zero();
        let h = if h.z < 0.0 { -h } else { h };
        let fits = wo.dot(h) > 0.0 && wi.dot(h) * wi.z > 0.0;
        fits.then_some(h)
    }

    /// Solid angle of facets per solid angle of directions behind them.
    fn spread(&self, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
        let d = wi.dot(h) + wo.dot(h) / self.eta;
        wi.dot(h).abs() / (d * d).max(1e-12)
    }

    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let Some(h) = self.lit_facet(wo, wi) else { return Vec3::ZERO };
        let facets = self.facets;
        let reflected = share(wo.dot(h), self.eta);
        let kept = 1.0 / tables::glass(wo.z, facets.alpha, self.eta).max(1e-3);
        let common = facets.density(h) * facets.seen_by_both(wo, wi) * kept / wo.z;
        Vec3::splat(if wi.z > 0.0 {
            reflected * common / 4.0
        } else {
            (1.0 - reflected) * common * wo.dot(h) * self.spread(wo, wi, h) * self.scale
        })
    }

    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some(h) = self.lit_facet(wo, wi) else { return 0.0 };
        let reflected = share(wo.dot(h), self.eta);
        let visible = self.facets.visible_density(wo, h);
        if wi.z > 0.0 {
            reflected * visible / (4.0 * wo.dot(h))
        } else {
            (1.0 - reflected) * visible * self.spread(wo, wi, h)
        }
    }

    fn lit_facet(&self, wo: Vec3, wi: Vec3) -> Option<Vec3> {
        if self.is_smooth() || wo.z <= 0.0 || wi.z == 0.0 { None } else { self.facet(wo, wi) }
    }

    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let smooth = self.is_smooth();
        let h = if smooth { Vec3::Z } else { self.facets.sample(wo, u) };
        let reflected = share(wo.dot(h), self.eta);
        let mirror = lobe < reflected;
        let wi = if mirror { mirrored(wo, h) } else { behind(wo, h, self.eta)? };
        if (wi.z > 0.0) != mirror {
            return None;
        }
        if smooth {
            // The chance of the way cancels its weight.
            return Some(BsdfSample::specular(wi, Vec3::splat(if mirror { 1.0 } else { self.scale })));
        }
        let kept = self.facets.seen_by_both(wo, wi) / self.facets.seen(wo);
        let kept = kept / tables::glass(wo.z, self.facets.alpha, self.eta).max(1e-3);
        let weight = Vec3::splat(kept * if mirror { 1.0 } else { self.scale });
        let sampled = weighed(wi, Vec3::ZERO, self.pdf(wo, wi))?;
        Some(BsdfSample { weight, ..sampled })
    }
}
