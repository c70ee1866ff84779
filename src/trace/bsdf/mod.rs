//! How a surface scatters light: one small value per hit, with evaluation, sampling and density.
//!
//! Directions are unit vectors that point away from the surface, in its own [`Frame`]: z is the shading normal on the
//! side of the viewer, so that `wo.z` is positive. `wi` lies below (z < 0) where light goes through. A value is a BSDF in
//! the usual measure, with 1 / pi in Lambert's law: a lamp of `color` c, whose light a matt surface turns into
//! `albedo * c * cosine`, has an irradiance of pi c straight before it.
//!
//! Light that goes through is scaled by the square of the indices' ratio where it is radiance that is followed, from
//! the eye, and not where it is power, from a light ([`Transport`]; Veach 1997, section 5.2).

mod blinn;
mod conductor;
mod dielectric;
mod microfacet;
mod plastic;
mod tables;

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;

use super::sampler::concentric_disk;
use super::simd::{Lanes, V3};
use super::surfacing::Surfacing;
use crate::components::{Fresnel, Model};
use blinn::BlinnPhong;
use conductor::Conductor;
use dielectric::Dielectric;
use plastic::Plastic;

/// What a path carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// From the eye: radiance.
    Radiance,
    /// From a light: power.
    Power,
}

/// The scattering at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    BlinnPhong(BlinnPhong),
    /// Albedo.
    Lambert(Vec3),
    Conductor(Conductor),
    Dielectric(Dielectric),
    Plastic(Plastic),
}

/// A direction that light is scattered to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampled {
    pub wi: Vec3,
    /// Value times cosine over density, as a path's factor.
    pub weight: Vec3,
    /// Per steradian; 0 if `specular`, where no other way of sampling finds the direction.
    pub pdf: f32,
    /// A mirror or a polished surface: exactly one direction.
    pub specular: bool,
    pub transmitted: bool,
}

impl Sampled {
    fn specular(wi: Vec3, weight: Vec3) -> Self {
        Sampled { wi, weight, pdf: 0.0, specular: true, transmitted: wi.z < 0.0 }
    }
}

impl Bsdf {
    /// What a material does to light that meets it; `front`: from the outside.
    #[inline]
    pub fn new(material: &Surfacing, front: bool, fresnel: Fresnel, transport: Transport) -> Self {
        match material.model {
            Model::BlinnPhong if material.is_matt() => Bsdf::Lambert(material.diffuse),
            Model::BlinnPhong => Bsdf::BlinnPhong(BlinnPhong::new(material, front, fresnel, transport)),
            Model::Lambert => Bsdf::Lambert(material.diffuse),
            Model::Conductor => Bsdf::Conductor(Conductor::new(material)),
            Model::Dielectric => Bsdf::Dielectric(Dielectric::new(material, front, transport)),
            Model::Plastic => Bsdf::Plastic(Plastic::new(material)),
        }
    }

    /// Whether all light is scattered in single directions, so that lights need not be asked.
    #[inline]
    pub fn is_specular(&self) -> bool {
        match self {
            Bsdf::BlinnPhong(b) => b.is_specular(),
            Bsdf::Conductor(c) => c.is_smooth(),
            Bsdf::Dielectric(d) => d.is_smooth(),
            Bsdf::Lambert(_) | Bsdf::Plastic(_) => false,
        }
    }

    /// What a tracer that follows mirror images alone looks for: the same without a matt base.
    pub fn glossy(&self) -> Option<Bsdf> {
        match self {
            Bsdf::BlinnPhong(_) | Bsdf::Lambert(_) => None,
            Bsdf::Conductor(_) | Bsdf::Dielectric(_) => Some(*self),
            Bsdf::Plastic(p) => Some(Bsdf::Plastic(p.coat_alone())),
        }
    }

    /// Whether part of it is matt: light from all sides goes to all sides.
    #[inline]
    pub fn is_matt(&self) -> bool {
        match self {
            Bsdf::BlinnPhong(b) => b.albedo() != Vec3::ZERO,
            Bsdf::Lambert(albedo) => *albedo != Vec3::ZERO,
            Bsdf::Plastic(_) => true,
            Bsdf::Conductor(_) | Bsdf::Dielectric(_) => false,
        }
    }

    /// The matt part of [`Self::eval`].
    #[inline]
    pub fn matt(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let lambert = |albedo: Vec3| albedo * (wi.z.max(0.0) * FRAC_1_PI);
        match self {
            Bsdf::BlinnPhong(b) => lambert(b.albedo()),
            Bsdf::Lambert(albedo) => lambert(*albedo),
            Bsdf::Plastic(p) if wi.z > 0.0 => p.matt(wo, wi),
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
        }
    }

    /// A direction for numbers in 0..1; `lobe` chooses among the ways of scattering. `None`: the light is swallowed.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<Sampled> {
        match self {
            Bsdf::BlinnPhong(b) => b.sample(wo, u, lobe),
            Bsdf::Lambert(albedo) => {
                let wi = cosine_hemisphere(u);
                (wi.z > 0.0).then(|| Sampled {
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
        }
    }
}

/// A sample of what is evaluated, with the weight that follows.
fn weighed(wi: Vec3, value: Vec3, pdf: f32) -> Option<Sampled> {
    let good = pdf > 0.0 && pdf < f32::INFINITY;
    good.then(|| Sampled { wi, weight: value / pdf, pdf, specular: false, transmitted: wi.z < 0.0 })
}

/// A direction by the cosine over the upper hemisphere.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    cosine_directions(u).into()
}

/// As [`cosine_hemisphere`].
#[inline(always)]
pub fn cosine_directions<L: Lanes>(u: [L; 2]) -> V3<L> {
    let [x, y] = concentric_disk(u);
    V3 { x, y, z: (L::splat(1.0) - x * x - y * y).max(L::splat(0.0)).sqrt() }
}

#[inline]
pub fn cosine_pdf(wi: Vec3) -> f32 {
    wi.z.max(0.0) * FRAC_1_PI
}

/// Axes of a surface: z along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    pub x: Vec3,
    pub y: Vec3,
    pub z: Vec3,
}

impl Frame {
    /// `normal` is unit.
    #[inline]
    pub fn new(normal: Vec3) -> Self {
        let [x, y] = tangents(V3::<f32>::from(normal));
        Frame { x: x.into(), y: y.into(), z: normal }
    }

    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

/// Two axes across a unit normal (Duff et al., Building an Orthonormal Basis, Revisited, JCGT 2017).
#[inline(always)]
pub fn tangents<L: Lanes>(normal: V3<L>) -> [V3<L>; 2] {
    let V3 { x, y, z } = normal;
    let one = L::splat(1.0);
    let sign = L::select(z.lt(L::splat(0.0)), -one, one);
    let a = -one / (sign + z);
    let b = x * y * a;
    [V3 { x: one + sign * x * x * a, y: sign * b, z: -sign * x }, V3 { x: b, y: sign + y * y * a, z: -y }]
}

/// A uniform direction around z for two numbers: radius in the plane and height are given by `z`.
pub fn around(z: f32, turn: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(2.0 * PI * turn);
    Vec3::new(r * cos, r * sin, z)
}

#[cfg(test)]
mod tests;
