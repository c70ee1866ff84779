//! Materials as the kernel wants them.

use glam::Vec3;

use super::fresnel::mean_metal_reflectance;
use crate::components::{Material, Model};

/// A material with every weight multiplied out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingParams {
    pub model: Model,
    /// Kd Cd; of a conductor what it reflects straight on.
    pub diffuse: Vec3,
    /// Ks Cs, for highlights.
    pub specular: Vec3,
    pub shininess: f32,
    /// Weight of the mirror image, with its colour.
    pub reflection: f32,
    pub mirror_color: Vec3,
    pub gloss: f32,
    /// Share of light that goes through, by the P3F tracers' reckoning: 1 for a `Dielectric`.
    pub transmission: f32,
    pub ior: f32,
    /// Which of transparent bodies that overlap is there: the highest.
    pub priority: u32,
    /// Width of GGX: the square of `roughness`.
    pub alpha: f32,
    /// Complex index of refraction of a conductor: eta, and k with it; 0 where `diffuse` stands for both.
    pub eta: Vec3,
    pub k: Vec3,
    /// Mean reflectance over the hemisphere of a conductor that has `eta`; 0 else.
    pub mean_fresnel: Vec3,
    /// Per world unit.
    pub absorption: Vec3,
    /// Radiance.
    pub emission: Vec3,
    /// The light group that its emission is added up in, as that of a lamp.
    pub group: u32,
}

impl From<&Material> for ShadingParams {
    fn from(m: &Material) -> Self {
        let albedo = match m.model {
            Model::Conductor => m.color,
            Model::Dielectric => glam::DVec3::ZERO,
            Model::BlinnPhong | Model::Lambert | Model::Plastic => m.color * m.diffuse,
        };
        ShadingParams {
            model: m.model,
            diffuse: albedo.as_vec3(),
            specular: (m.specular_color * m.specular).as_vec3(),
            shininess: m.shininess as f32,
            reflection: m.reflection_weight() as f32,
            mirror_color: m.specular_color.as_vec3(),
            gloss: m.gloss as f32,
            transmission: match m.model {
                Model::BlinnPhong => m.transmission as f32,
                Model::Dielectric => 1.0,
                Model::Lambert | Model::Conductor | Model::Plastic => 0.0,
            },
            ior: m.ior as f32,
            priority: m.priority,
            alpha: (m.roughness * m.roughness) as f32,
            eta: m.eta.unwrap_or_default().as_vec3(),
            k: m.k.unwrap_or_default().as_vec3(),
            mean_fresnel: match (m.eta, m.k) {
                (Some(eta), Some(k)) => mean_metal_reflectance(eta.as_vec3(), k.as_vec3()),
                (Some(_), None) | (None, _) => Vec3::ZERO,
            },
            absorption: m.absorption.as_vec3(),
            emission: m.emission.as_vec3(),
            group: 0,
        }
    }
}

impl ShadingParams {
    /// The material with the values of its maps at one point.
    pub fn mapped(&self, color: Vec3, specular: Vec3, roughness: f32) -> Self {
        ShadingParams {
            diffuse: self.diffuse * color,
            specular: self.specular * specular,
            mirror_color: self.mirror_color * specular,
            gloss: self.gloss * roughness,
            alpha: self.alpha * (roughness * roughness),
            ..*self
        }
    }

    /// Whether a Blinn-Phong surface follows Lambert's law alone.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        self.specular == Vec3::ZERO && self.reflection == 0.0 && self.transmission == 0.0
    }

    /// Whether light is scattered by Lambert's law, and nothing else happens.
    #[inline]
    pub fn is_lambertian(&self) -> bool {
        let matt = self.model == Model::Lambert || (self.model == Model::BlinnPhong && self.is_diffuse());
        matt && self.emission == Vec3::ZERO
    }

    /// Whether it is glass and nothing else: no light is scattered by anything but a change of index.
    #[inline]
    pub fn is_clear(&self) -> bool {
        self.model == Model::Dielectric && self.emission == Vec3::ZERO
    }

    /// What is left of light after a way inside the body, by Beer's law.
    pub fn transmittance(&self, distance: f32) -> Vec3 {
        // Where nothing is absorbed, nothing is on an endless way either.
        self.absorption.map(|a| if a > 0.0 { libm::expf(-a * distance) } else { 1.0 })
    }
}
