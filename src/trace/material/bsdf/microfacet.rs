//! Facets by Trowbridge and Reitz (GGX), of one width in all directions.
//!
//! Shadowing is Smith's, correlated in height (Heitz, JCGT 2014); facets are sampled as they are seen (Heitz, JCGT
//! 2018) by spherical caps (Dupuy and Benyoub, HPG 2023).

use std::f32::consts::PI;

use glam::Vec3;

use crate::trace::material::SMOOTH;

/// A surface of facets, whose slopes have the width `alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    pub alpha: f32,
}

impl Microfacets {
    pub fn is_smooth(self) -> bool {
        self.alpha < SMOOTH
    }

    /// Share of facets around the unit normal `h`, per steradian and unit of surface.
    pub fn density(self, h: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let e = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
        1.0 / (PI * a2 * e * e)
    }

    /// Smith's Lambda.
    fn hidden(self, w: Vec3) -> f32 {
        let z2 = w.z * w.z;
        if z2 == 0.0 {
            return f32::INFINITY;
        }
        let slope2 = (w.x * w.x + w.y * w.y) / z2;
        // The difference of nearly equal numbers, written without it.
        let s = self.alpha * self.alpha * slope2;
        0.5 * s / (1.0 + (1.0 + s).sqrt())
    }

    /// Share of facets that `w` sees.
    pub fn seen(self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.hidden(w))
    }

    /// Share of facets that both directions see, on the same side of the surface or on either.
    pub fn seen_by_both(self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.hidden(wo) + self.hidden(wi))
    }

    /// Density of [`Self::sample`] around `h`.
    pub fn visible_density(self, wo: Vec3, h: Vec3) -> f32 {
        self.seen(wo) * self.density(h) * wo.dot(h).max(0.0) / wo.z.abs().max(1e-9)
    }

    /// The normal of a facet that `wo` (z > 0) sees.
    pub fn sample(self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let a = self.alpha;
        let w = Vec3::new(wo.x * a, wo.y * a, wo.z).normalize();
        let z = (1.0 - u[1]) * (1.0 + w.z) - w.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = libm::sincosf(2.0 * PI * u[0]);
        let cap = Vec3::new(r * cos, r * sin, z) + w;
        Vec3::new(cap.x * a, cap.y * a, cap.z.max(1e-9)).normalize()
    }
}

/// The direction mirrored at a facet.
pub fn mirrored(wo: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * wo.dot(h)) - wo
}
