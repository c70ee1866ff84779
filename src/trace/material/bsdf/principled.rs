//! Metal, plastic and glass in one, by shares: what glTF and most programs call metallic-roughness.
//!
//! `metallic` mixes bare metal with a dielectric; `transmission` mixes what lies below the dielectric's surface, a diffuse
//! base and the way through it. The surface reflects by the exact law of Fresnel, tinted and weighted as
//! KHR_materials_specular has it; the base gets what the surface lets in, so that a white one loses nothing (Kelemen and
//! Szirmay-Kalos, Eurographics 2001). Without thickness the way through is straight on.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::bsdf_sample::{BsdfSample, weighed};
use super::conductor::Conductor;
use super::microfacet::{Microfacets, mirrored};
use super::tables;
use crate::trace::material::{ShadingParams, TransportMode, behind, scale, share};
use crate::trace::sampler::{cosine_hemisphere, cosine_pdf};

/// The metallic-roughness model of glTF 2.0 (appendix B): a mix of metal, glass, and a diffuse base under a dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    facets: Microfacets,
    metal: Conductor,
    metallic: f32,
    transmission: f32,
    /// Of the base, and of what goes through.
    color: Vec3,
    /// Share that a facet reflects straight on: without a tint, and with it.
    straight: f32,
    tinted: Vec3,
    /// Weight of all reflection at the surface, from outside.
    weight: f32,
    /// Index of the body over that around it, 0 where a facet reflects by its tint alone.
    ior: f32,
    /// Index ahead over index behind, as `wo` sees it; 1 without thickness.
    eta: f32,
    /// Factor of what goes through.
    scale: f32,
    thin: bool,
    front: bool,
    /// Mean share that the surface lets in, over the hemisphere.
    let_in: f32,
}

/// The ways of scattering and their chances.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PrincipledChances {
    metal: f32,
    /// The surface of the opaque part.
    surface: f32,
    diffuse: f32,
    /// Surface and inside of the transparent part.
    glass: f32,
}

impl Principled {
    /// The law of a material, seen from its front or its back.
    pub fn new(m: &ShadingParams, front: bool, transport: TransportMode) -> Self {
        let root = (m.ior - 1.0) / (m.ior + 1.0);
        let straight = root * root;
        let solid_eta = if front { m.ior } else { 1.0 / m.ior.max(1e-3) };
        let eta = if m.thin || m.ior == 0.0 { 1.0 } else { solid_eta };
        let mut made = Principled {
            facets: Microfacets { alpha: m.alpha },
            metal: Conductor::with_color(m.diffuse, m.alpha),
            metallic: m.metallic,
            transmission: m.transmission,
            color: m.diffuse,
            straight,
            tinted: (m.mirror_color * straight).min(Vec3::ONE),
            weight: m.principled_reflection,
            ior: m.ior,
            eta,
            scale: if m.thin { 1.0 } else { scale(eta, transport) },
            thin: m.thin || m.ior == 0.0,
            front,
            let_in: 1.0,
        };
        made.let_in = 1.0 - made.mean_reflected();
        made
    }

    /// Whether all of it is polished.
    pub fn is_smooth(&self) -> bool {
        self.facets.is_smooth()
    }

    /// Whether all light goes in single directions.
    pub fn is_specular(&self) -> bool {
        self.is_smooth() && !self.is_diffuse()
    }

    /// Share of the diffuse base.
    fn opaque(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.transmission)
    }

    fn clear(&self) -> f32 {
        (1.0 - self.metallic) * self.transmission
    }

    /// Whether any of it follows Lambert's law.
    pub fn is_diffuse(&self) -> bool {
        self.opaque() > 0.0 && self.color != Vec3::ZERO
    }

    /// The same over a black base.
    pub fn glossy(&self) -> Option<Principled> {
        let reflects = self.metallic > 0.0 || self.weight > 0.0 || self.transmission > 0.0;
        // The part that is diffuse keeps its surface.
        reflects.then_some(Principled { let_in: 0.0, ..*self })
    }

    /// Tint and weight of a share that a facet reflects.
    fn colored(&self, share: f32) -> Vec3 {
        let risen = if self.straight < 1.0 { ((share - self.straight) / (1.0 - self.straight)).max(0.0) } else { 0.0 };
        (self.tinted + (Vec3::ONE - self.tinted) * risen) * self.weight
    }

    /// Share that a facet of the opaque part reflects, which is seen from outside whichever side shows.
    fn surface(&self, cosine: f32) -> Vec3 {
        if self.ior == 0.0 {
            let m = 1.0 - cosine.clamp(0.0, 1.0);
            return (self.tinted + (Vec3::ONE - self.tinted) * (m * m * m * m * m)) * self.weight;
        }
        self.colored(share(cosine, self.ior))
    }

    /// Share that a facet of the transparent part reflects.
    fn glass_surface(&self, cosine: f32) -> Vec3 {
        if self.thin || self.front { self.surface(cosine) } else { Vec3::splat(share(cosine, self.eta)) }
    }

    /// What the surface of the opaque part reflects of light from `z`, in the channel that reflects most.
    fn reflected(&self, z: f32) -> f32 {
        if self.is_smooth() {
            return self.surface(z).max_element();
        }
        let all = tables::metal(z, self.facets.alpha);
        self.spread_over(tables::reflected(z, self.facets.alpha, self.ior.max(1e-3)), all)
    }

    fn mean_reflected(&self) -> f32 {
        let alpha = self.facets.alpha;
        self.spread_over(tables::reflected_mean(alpha, self.ior.max(1e-3)), tables::metal_mean(alpha))
    }

    /// The tables know facets without tint, and perfect mirrors; between the two lies what a tint makes of them.
    fn spread_over(&self, plain: f32, all: f32) -> f32 {
        let risen = if self.straight < 1.0 { (plain - self.straight * all) / (1.0 - self.straight) } else { 0.0 };
        ((self.tinted * (all - risen) + Vec3::splat(risen)) * self.weight).max_element().clamp(0.0, 1.0)
    }

    /// The diffuse part of [`Self::eval`].
    pub fn diffuse(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wi.z <= 0.0 || self.let_in <= 0.0 {
            return Vec3::ZERO;
        }
        let shape = (1.0 - self.reflected(wo.z)) * (1.0 - self.reflected(wi.z)) / self.let_in;
        self.color * (self.opaque() * shape * wi.z * FRAC_1_PI)
    }

    fn chances(&self, wo: Vec3) -> PrincipledChances {
        let surface = self.reflected(wo.z);
        let base = if self.let_in > 0.0 { (1.0 - surface) * self.color.max_element() } else { 0.0 };
        let metal = self.metallic * self.color.max_element();
        let (surface, diffuse) = (self.opaque() * surface, self.opaque() * base);
        let glass = self.clear() * self.color.max_element().max(surface).max(0.1);
        let sum = (metal + surface + diffuse + glass).max(1e-9);
        PrincipledChances { metal: metal / sum, surface: surface / sum, diffuse: diffuse / sum, glass: glass / sum }
    }

    /// The facet of the transparent part that sends light from `wi` to `wo`, on the side of `wo`, if one can.
    fn glass_facet(&self, wo: Vec3, wi: Vec3) -> Option<Vec3> {
        if self.thin {
            // The lobe behind a thin wall is that of the mirror image, on the other side.
            return (wo + Vec3::new(wi.x, wi.y, wi.z.abs())).try_normalize();
        }
        let ahead = if wi.z > 0.0 { 1.0 } else { self.eta };
        let h = (wo + wi * ahead).try_normalize()?;
        let h = if h.z < 0.0 { -h } else { h };
        (wo.dot(h) > 0.0 && wi.dot(h) * wi.z > 0.0).then_some(h)
    }

    /// Solid angle of facets per solid angle of directions behind them.
    fn spread(&self, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
        let d = wi.dot(h) + wo.dot(h) / self.eta;
        wi.dot(h).abs() / (d * d).max(1e-12)
    }

    /// Factor of the transparent part that gives back what its facets lose to each other.
    fn kept(&self, wo: Vec3) -> f32 {
        let all = if self.thin {
            tables::metal(wo.z, self.facets.alpha)
        } else {
            tables::glass(wo.z, self.facets.alpha, self.eta)
        };
        1.0 / all.max(1e-3)
    }

    fn glass_eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let Some(h) = self.glass_facet(wo, wi) else { return Vec3::ZERO };
        let reflected = self.glass_surface(wo.dot(h));
        let above = Vec3::new(wi.x, wi.y, wi.z.abs());
        let (facets, seen) = (self.facets, if self.thin { above } else { wi });
        let common = facets.density(h) * facets.seen_by_both(wo, seen) * self.kept(wo) / wo.z;
        if wi.z > 0.0 {
            return reflected * (common / 4.0);
        }
        let through = self.color * (1.0 - reflected.max_element());
        through * (common * if self.thin { 0.25 } else { wo.dot(h) * self.spread(wo, wi, h) * self.scale })
    }

    /// Chance that a facet's ray is mirrored and not let through.
    fn mirror_chance(&self, cosine: f32) -> f32 {
        let reflected = self.glass_surface(cosine).max_element();
        let through = (1.0 - reflected) * self.color.max_element();
        reflected / (reflected + through).max(1e-9)
    }

    fn glass_pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some(h) = self.glass_facet(wo, wi) else { return 0.0 };
        let (mirror, visible) = (self.mirror_chance(wo.dot(h)), self.facets.visible_density(wo, h));
        if wi.z > 0.0 {
            mirror * visible / (4.0 * wo.dot(h)).max(1e-9)
        } else if self.thin {
            (1.0 - mirror) * visible / (4.0 * wo.dot(h)).max(1e-9)
        } else {
            (1.0 - mirror) * visible * self.spread(wo, wi, h)
        }
    }

    /// Value times the cosine of `wi`; both are unit, in the axes of the surface.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z == 0.0 {
            return Vec3::ZERO;
        }
        let mut sum = self.diffuse(wo, wi);
        if self.is_smooth() {
            return sum;
        }
        if self.metallic > 0.0 {
            sum += self.metal.eval(wo, wi) * self.metallic;
        }
        if self.opaque() > 0.0 && wi.z > 0.0 {
            let h = (wo + wi).normalize_or(Vec3::Z);
            let once = self.facets.density(h) * self.facets.seen_by_both(wo, wi) / (4.0 * wo.z);
            sum += self.surface(wo.dot(h)) * (once * self.opaque());
        }
        if self.clear() > 0.0 {
            sum += self.glass_eval(wo, wi) * self.clear();
        }
        sum
    }

    /// Density of [`Self::sample`] per steradian.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z == 0.0 {
            return 0.0;
        }
        let chances = self.chances(wo);
        let mut sum = chances.diffuse * cosine_pdf(wi);
        if self.is_smooth() {
            return sum;
        }
        sum += chances.metal * self.metal.pdf(wo, wi);
        if wi.z > 0.0 {
            let h = (wo + wi).normalize_or(Vec3::Z);
            sum += chances.surface * self.facets.seen(wo) * self.facets.density(h) / (4.0 * wo.z);
        }
        if chances.glass > 0.0 {
            sum += chances.glass * self.glass_pdf(wo, wi);
        }
        sum
    }

    /// A direction for numbers in 0..1; `lobe` chooses among the ways of scattering.
    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let PrincipledChances { metal, surface, diffuse, glass } = self.chances(wo);
        if lobe < diffuse {
            let wi = cosine_hemisphere(u);
            return weighed(wi, self.eval(wo, wi), self.pdf(wo, wi));
        }
        // What is left of the number chooses again.
        let rest = (lobe - diffuse) / (1.0 - diffuse).max(1e-9);
        if self.is_smooth() {
            return self.polished_sample(wo, rest, 1.0 - diffuse);
        }
        let of_rest = |chance: f32| chance / (1.0 - diffuse).max(1e-9);
        // A facet may send light to the wrong side, which is lost; the factor that `kept` gives has it back. Taken as light
        // of the other way, it would be counted twice.
        let above = |wi: Vec3| (wi.z > 0.0).then_some(wi);
        let wi = if rest < of_rest(metal) {
            let own = (rest / of_rest(metal)).min(1.0 - f32::EPSILON / 2.0);
            self.metal.sample(wo, u, own)?.wi
        } else if rest < of_rest(metal + surface) {
            above(mirrored(wo, self.facets.sample(wo, u)))?
        } else {
            let own = ((rest - of_rest(metal + surface)) / of_rest(glass).max(1e-9)).clamp(0.0, 1.0);
            let h = self.facets.sample(wo, u);
            if own < self.mirror_chance(wo.dot(h)) {
                above(mirrored(wo, h))?
            } else if self.thin {
                let wi = above(mirrored(wo, h))?;
                Vec3::new(wi.x, wi.y, -wi.z)
            } else {
                behind(wo, h, self.eta).filter(|wi| wi.z < 0.0)?
            }
        };
        weighed(wi, self.eval(wo, wi), self.pdf(wo, wi))
    }

    /// The two single directions of a polished surface: the mirror image, and the way through; each with its weight.
    pub fn polished(&self, wo: Vec3) -> [Option<BsdfSample>; 2] {
        let glass = self.glass_surface(wo.z);
        let mirror =
            self.metal.mirrors(wo.z) * self.metallic + self.surface(wo.z) * self.opaque() + glass * self.clear();
        let up = Vec3::new(-wo.x, -wo.y, wo.z);
        let through = self.color * ((1.0 - glass.max_element()) * self.clear() * self.scale);
        let down = if self.thin { Some(-wo) } else { behind(wo, Vec3::Z, self.eta) };
        let sample = |wi: Vec3, weight: Vec3| (weight != Vec3::ZERO).then(|| BsdfSample::specular(wi, weight));
        [sample(up, mirror), down.filter(|wi| wi.z < 0.0).and_then(|wi| sample(wi, through))]
    }

    /// One of the single directions, given that the diffuse base was not chosen, which happens with this chance.
    fn polished_sample(&self, wo: Vec3, u: f32, chance: f32) -> Option<BsdfSample> {
        let [up, down] = self.polished(wo);
        let worth = |s: &Option<BsdfSample>| s.map_or(0.0, |s| s.weight.max_element());
        // What radiance loses on its way into a body it gets back on its way out: no reason to choose it less.
        let (a, b) = (worth(&up), worth(&down) / self.scale.max(1e-9));
        let mirror = a / (a + b).max(1e-12);
        let (chosen, own) = if u < mirror { (up, mirror) } else { (down, 1.0 - mirror) };
        chosen.map(|s| BsdfSample { weight: s.weight / (own * chance).max(1e-9), ..s })
    }
}
