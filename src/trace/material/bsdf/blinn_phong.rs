//! The P3F tracers' material as a BSDF: Lambert, Blinn's highlight, a mirror that may be spread, and glass.
//!
//! It keeps what the older pictures show and so need not conserve energy. The highlight is a lobe like the others: it
//! shows what surrounds the surface as well as the lamps.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;

use super::bsdf_sample::{BsdfSample, weighed};
use crate::components::Fresnel;
use crate::trace::material::{ShadingParams, TransportMode, behind, fresnel, scale};
use crate::trace::sampler::{around, cosine_hemisphere, cosine_pdf};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlinnPhong {
    diffuse: Vec3,
    specular: Vec3,
    shininess: f32,
    mirror_color: Vec3,
    reflection: f32,
    gloss: f32,
    transmission: f32,
    /// Index ahead over index behind, as `wo` sees it.
    eta: f32,
    scale: f32,
    fresnel: Fresnel,
}

/// Chances of the four ways, and the weights of mirror and glass.
struct LobeChances {
    chances: [f32; 4],
    mirror: Vec3,
    through: f32,
}

impl BlinnPhong {
    pub fn new(m: &ShadingParams, front: bool, fresnel: Fresnel, transport: TransportMode) -> Self {
        let eta = if m.transmission <= 0.0 {
            1.0
        } else if front {
            m.ior
        } else {
            1.0 / m.ior
        };
        BlinnPhong {
            diffuse: m.diffuse,
            specular: m.specular,
            shininess: m.shininess,
            mirror_color: m.mirror_color,
            reflection: m.reflection,
            gloss: m.gloss,
            transmission: m.transmission,
            eta,
            scale: scale(eta, transport),
            fresnel,
        }
    }

    /// Of its diffuse part.
    pub fn albedo(&self) -> Vec3 {
        self.diffuse
    }

    pub fn is_specular(&self) -> bool {
        let mirror = self.gloss == 0.0 || (self.reflection == 0.0 && self.transmission == 0.0);
        self.diffuse == Vec3::ZERO && self.specular == Vec3::ZERO && mirror
    }

    /// Whether it has no way but the mirror image.
    pub fn is_mirror(&self) -> bool {
        self.is_specular() && self.transmission <= 0.0
    }

    /// How much a transparent surface reflects and lets through; an opaque one reflects what its weight says.
    fn division(&self, wo: Vec3) -> (f32, f32) {
        if self.transmission <= 0.0 {
            return (self.reflection, 0.0);
        }
        let off = self.fresnel == Fresnel::Off;
        match behind(wo, Vec3::Z, self.eta) {
            None if off => ((self.reflection + self.transmission).min(1.0), 0.0),
            None => (1.0, 0.0),
            Some(_) if off => (self.reflection, self.transmission),
            Some(_) => {
                let share = fresnel(self.fresnel, wo.z, 1.0 / self.eta);
                (share, (1.0 - share) * self.transmission)
            }
        }
    }

    fn shares(&self, wo: Vec3) -> LobeChances {
        let (reflected, through) = self.division(wo);
        let mirror = self.mirror_color * reflected;
        // What the highlight gives back straight on, roughly.
        let highlight = self.specular.max_element() * (8.0 / (self.shininess + 8.0));
        let ways = [self.diffuse.max_element(), highlight, mirror.max_element(), through];
        let sum: f32 = ways.iter().sum();
        let chances = if sum > 0.0 { ways.map(|w| w / sum) } else { [0.0; 4] };
        LobeChances { chances, mirror, through }
    }

    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return Vec3::ZERO;
        }
        let mut value = self.diffuse * (wi.z * FRAC_1_PI);
        if self.specular != Vec3::ZERO {
            let base = (wo + wi).normalize_or_zero().z.max(0.0);
            value += self.specular * (libm::powf(base, self.shininess) * FRAC_1_PI);
        }
        if self.gloss > 0.0 {
            value += self.mirror_color * (self.division(wo).0 * self.spread(wo, wi));
        }
        value
    }

    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let [matt, shiny, mirror, _] = self.shares(wo).chances;
        let mut pdf = matt * cosine_pdf(wi);
        if shiny > 0.0 {
            pdf += shiny * self.highlight_pdf(wo, wi);
        }
        if self.gloss > 0.0 {
            pdf += mirror * self.spread(wo, wi);
        }
        pdf
    }

    /// Half vectors by cosine^(shininess + 1), as directions.
    fn highlight_pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let h = (wo + wi).normalize_or(Vec3::Z);
        let lobe = (self.shininess + 2.0) * libm::powf(h.z.max(0.0), self.shininess + 1.0) / (2.0 * PI);
        lobe / (4.0 * wo.dot(h).max(1e-6))
    }

    /// Density of a mirror image that is spread: directions to a ball around the tip of the mirrored one. What would go
    /// below the surface is thrown up again.
    fn spread(&self, wo: Vec3, wi: Vec3) -> f32 {
        let tip = Vec3::new(-wo.x, -wo.y, wo.z);
        ball(tip, wi, self.gloss) + ball(tip, Vec3::new(wi.x, wi.y, -wi.z), self.gloss)
    }

    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let LobeChances { chances: [matt, shiny, mirror, glass], mirror: mirror_weight, through } = self.shares(wo);
        let tip = Vec3::new(-wo.x, -wo.y, wo.z);
        let wi = if lobe < matt {
            cosine_hemisphere(u)
        } else if lobe < matt + shiny {
            let h = around(libm::powf(u[0], 1.0 / (self.shininess + 2.0)), u[1]);
            h * (2.0 * wo.dot(h)) - wo
        } else if mirror > 0.0 && (lobe < matt + shiny + mirror || glass <= 0.0) {
            if self.gloss <= 0.0 {
                return Some(BsdfSample::specular(tip, mirror_weight / mirror));
            }
            // What is left of the number once it has chosen is uniform again.
            let rest = ((lobe - matt - shiny) / mirror).clamp(0.0, 1.0);
            let offset = around(1.0 - 2.0 * u[0], u[1]) * (self.gloss * libm::cbrtf(rest));
            let wi = (tip + offset).normalize_or(tip);
            Vec3::new(wi.x, wi.y, wi.z.abs())
        } else if glass > 0.0 {
            let wi = behind(wo, Vec3::Z, self.eta)?;
            return Some(BsdfSample::specular(wi, Vec3::splat(through * self.scale / glass)));
        } else {
            return None;
        };
        weighed(wi, self.eval(wo, wi), self.pdf(wo, wi))
    }
}

/// Density, per steradian, of directions to points of a ball of radius `r` around a unit `tip`.
fn ball(tip: Vec3, direction: Vec3, r: f32) -> f32 {
    let c = tip.dot(direction);
    // The squared sine, without the loss of 1 - c^2 near 1.
    let sin2 = tip.cross(direction).length_squared();
    let half = r * r - sin2;
    if half <= 0.0 || c <= 0.0 {
        return 0.0;
    }
    let half = half.sqrt();
    let (near, far) = ((c - half).max(0.0), c + half);
    (far - near) * (far * far + far * near + near * near) / (4.0 * PI * r * r * r)
}
