//! All models of scattering as one value.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::blinn_phong::BlinnPhong;
use super::bsdf_sample::BsdfSample;
use super::conductor::Conductor;
use super::dielectric::Dielectric;
use super::plastic::Plastic;
use super::principled::Principled;
use crate::components::{Fresnel, Model};
use crate::trace::material::{ShadingParams, TransportMode};
use crate::trace::sampler::{cosine_hemisphere, cosine_pdf};

/// The scattering at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambert's law and Blinn's highlight.
    BlinnPhong(BlinnPhong),
    /// Albedo.
    Lambert(Vec3),
    /// Metal, of facets or polished.
    Conductor(Conductor),
    /// Glass, of facets or polished.
    Dielectric(Dielectric),
    /// A diffuse base under a clear coat.
    Plastic(Plastic),
    /// Metal, glass and plastic by weights.
    Principled(Principled),
}

impl Bsdf {
    /// What a material does to light that meets it; `front`: from the outside.
    #[inline]
    pub fn new(material: &ShadingParams, front: bool, fresnel: Fresnel, transport: TransportMode) -> Self {
        match material.model {
            Model::BlinnPhong if material.is_diffuse() => Bsdf::Lambert(material.diffuse),
            Model::BlinnPhong => Bsdf::BlinnPhong(BlinnPhong::new(material, front, fresnel, transport)),
            Model::Lambert => Bsdf::Lambert(material.diffuse),
            Model::Conductor => Bsdf::Conductor(Conductor::new(material)),
            Model::Dielectric => Bsdf::Dielectric(Dielectric::new(material, front, transport)),
            Model::Plastic => Bsdf::Plastic(Plastic::new(material)),
            Model::Principled => Bsdf::Principled(Principled::new(material, front, transport)),
            // What it shows is added where it is met.
            Model::Unlit => Bsdf::Lambert(Vec3::ZERO),
        }
    }

    /// Whether all light is scattered in single directions, so that lights need not be sampled.
    #[inline]
    pub fn is_specular(&self) -> bool {
        match self {
            Bsdf::BlinnPhong(b) => b.is_specular(),
            Bsdf::Conductor(c) => c.is_smooth(),
            Bsdf::Dielectric(d) => d.is_smooth(),
            Bsdf::Principled(p) => p.is_specular(),
            Bsdf::Lambert(_) | Bsdf::Plastic(_) => false,
        }
    }

    /// What a tracer that follows mirror images alone looks for: the same without a diffuse base.
    pub fn glossy(&self) -> Option<Bsdf> {
        match self {
            Bsdf::BlinnPhong(_) | Bsdf::Lambert(_) => None,
            Bsdf::Conductor(_) | Bsdf::Dielectric(_) => Some(*self),
            Bsdf::Plastic(p) => Some(Bsdf::Plastic(p.coat_alone())),
            Bsdf::Principled(p) => p.glossy().map(Bsdf::Principled),
        }
    }

    /// Whether part of it is diffuse: light from all sides goes to all sides.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        match self {
            Bsdf::BlinnPhong(b) => b.albedo() != Vec3::ZERO,
            Bsdf::Lambert(albedo) => *albedo != Vec3::ZERO,
            Bsdf::Plastic(_) => true,
            Bsdf::Principled(p) => p.is_diffuse(),
            Bsdf::Conductor(_) | Bsdf::Dielectric(_) => false,
        }
    }

    /// The diffuse part of [`Self::eval`].
    #[inline]
    pub fn diffuse(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let lambert = |albedo: Vec3| albedo * (wi.z.max(0.0) * FRAC_1_PI);
        match self {
            Bsdf::BlinnPhong(b) => lambert(b.albedo()),
            Bsdf::Lambert(albedo) => lambert(*albedo),
            Bsdf::Plastic(p) if wi.z > 0.0 => p.diffuse(wo, wi),
            Bsdf::Principled(p) => p.diffuse(wo, wi),
            Bsdf::Plastic(_) | Bsdf::Conductor(_) | Bsdf::Dielectric(_) => Vec3::ZERO,
        }
    }

    /// Value times `|wi.z|`, without what goes in single directions.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        match self {
            Bsdf::BlinnPhong(b) => b.eval(wo, wi),
            Bsdf::Lambert(albedo) => *albedo * (wi.z.max(0.0) * FRAC_1_PI),
            Bsdf::Conductor(c) => c.eval(wo, wi),
            Bsdf::Dielectric(d) => d.eval(wo, wi),
            Bsdf::Plastic(p) => p.eval(wo, wi),
            Bsdf::Principled(p) => p.eval(wo, wi),
        }
    }

    /// Density of [`Self::sample`] per steradian, without single directions.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Bsdf::BlinnPhong(b) => b.pdf(wo, wi),
            Bsdf::Lambert(_) => cosine_pdf(wi),
            Bsdf::Conductor(c) => c.pdf(wo, wi),
            Bsdf::Dielectric(d) => d.pdf(wo, wi),
            Bsdf::Plastic(p) => p.pdf(wo, wi),
            Bsdf::Principled(p) => p.pdf(wo, wi),
        }
    }

    /// As [`Self::sample`], with numbers that are drawn where they decide something: mirrors have one way alone.
    #[inline]
    pub fn draw(&self, wo: Vec3, u: impl FnOnce() -> [f32; 2], lobe: impl FnOnce() -> f32) -> Option<BsdfSample> {
        let chooses = match self {
            Bsdf::Lambert(_) => false,
            Bsdf::Conductor(c) => !c.is_smooth(),
            Bsdf::BlinnPhong(b) => !b.is_mirror(),
            Bsdf::Dielectric(_) | Bsdf::Plastic(_) | Bsdf::Principled(_) => true,
        };
        let u = if self.is_specular() { [0.0; 2] } else { u() };
        self.sample(wo, u, if chooses { lobe() } else { 0.0 })
    }

    /// A direction for numbers in 0..1; `lobe` chooses among the ways of scattering. `None`: the light is absorbed.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        match self {
            Bsdf::BlinnPhong(b) => b.sample(wo, u, lobe),
            Bsdf::Lambert(albedo) => {
                let wi = cosine_hemisphere(u);
                (wi.z > 0.0).then(|| BsdfSample {
                    wi,
                    weight: *albedo,
                    pdf: cosine_pdf(wi),
                    specular: false,
                    transmitted: false,
                })
            }
            Bsdf::Conductor(c) => c.sample(wo, u, lobe),
            Bsdf::Dielectric(d) => d.sample(wo, u, lobe),
            Bsdf::Plastic(p) => p.sample(wo, u, lobe),
            Bsdf::Principled(p) => p.sample(wo, u, lobe),
        }
    }
}
