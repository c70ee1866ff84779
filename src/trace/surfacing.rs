//! Materials as the kernel wants them, and the arithmetic of mirrors and glass.

use glam::Vec3;

use crate::components::{Fresnel, Material, Model};

/// A material with every weight multiplied out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfacing {
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
    /// Share of light that goes through, by the ancestors' reckoning: 1 for a `Dielectric`.
    pub transmission: f32,
    pub ior: f32,
    /// Width of GGX: the square of `roughness`.
    pub alpha: f32,
    /// Complex index of refraction of a conductor: eta, and k with it; 0 where `diffuse` stands for both.
    pub eta: Vec3,
    pub k: Vec3,
    /// Per world unit.
    pub absorption: Vec3,
    /// Radiance.
    pub emission: Vec3,
    /// The pass that its light is added up in, as that of a lamp.
    pub pass: u32,
}

impl From<&Material> for Surfacing {
    fn from(m: &Material) -> Self {
        let albedo = match m.model {
            Model::Conductor => m.color,
            Model::Dielectric => glam::DVec3::ZERO,
            Model::BlinnPhong | Model::Lambert | Model::Plastic => m.color * m.diffuse,
        };
        Surfacing {
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
            alpha: (m.roughness * m.roughness) as f32,
            eta: m.eta.unwrap_or_default().as_vec3(),
            k: m.k.unwrap_or_default().as_vec3(),
            absorption: m.absorption.as_vec3(),
            emission: m.emission.as_vec3(),
            pass: 0,
        }
    }
}

impl Surfacing {
    /// The material with the values of its maps at one point.
    pub fn mapped(&self, color: Vec3, specular: Vec3, roughness: f32) -> Self {
        Surfacing {
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
    pub fn is_matt(&self) -> bool {
        self.specular == Vec3::ZERO && self.reflection == 0.0 && self.transmission == 0.0
    }

    /// Whether light is scattered by Lambert's law, and nothing else happens.
    #[inline]
    pub fn is_plain(&self) -> bool {
        let matt = self.model == Model::Lambert || (self.model == Model::BlinnPhong && self.is_matt());
        matt && self.emission == Vec3::ZERO
    }

    /// What is left of light after a way inside the body, by Beer's law.
    pub fn left_after(&self, distance: f32) -> Vec3 {
        // Where nothing is swallowed, nothing is on an endless way either.
        self.absorption.map(|a| if a > 0.0 { libm::expf(-a * distance) } else { 1.0 })
    }
}

/// Direction of the mirror ray; `normal` is on either side, both unit.
pub fn reflect(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - normal * (2.0 * direction.dot(normal))
}

/// Snell's law: the refracted direction, or `None` on total internal reflection.
///
/// `normal` faces against `direction`; `eta` is the index behind the ray over the index ahead of it. Unit vectors.
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cos_in = -direction.dot(normal);
    let sin2_out = eta * eta * (1.0 - cos_in * cos_in).max(0.0);
    if sin2_out >= 1.0 {
        return None;
    }
    let cos_out = (1.0 - sin2_out).sqrt();
    Some((direction * eta + normal * (eta * cos_in - cos_out)).normalize())
}

/// Share of unpolarised light that is reflected; 1 on total internal reflection.
///
/// `cos_in` is the cosine on the side that the ray comes from, `eta` as in [`refract`].
pub fn fresnel(model: Fresnel, cos_in: f32, eta: f32) -> f32 {
    let cos_in = cos_in.clamp(0.0, 1.0);
    let sin2_out = eta * eta * (1.0 - cos_in * cos_in);
    if sin2_out >= 1.0 {
        return 1.0;
    }
    let cos_out = (1.0 - sin2_out).sqrt();
    if model == Fresnel::Schlick {
        let r0 = (eta - 1.0) / (eta + 1.0);
        let r0 = r0 * r0;
        // From the denser side the angle that counts is the one outside.
        let m = 1.0 - if eta > 1.0 { cos_out } else { cos_in };
        return r0 + (1.0 - r0) * (m * m * m * m * m);
    }
    let across = (eta * cos_in - cos_out) / (eta * cos_in + cos_out);
    let along = (cos_in - eta * cos_out) / (cos_in + eta * cos_out);
    (across * across + along * along) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnel_has_its_known_values() {
        let glass = 1.0 / 1.5;
        for model in [Fresnel::Exact, Fresnel::Schlick] {
            assert!((fresnel(model, 1.0, glass) - 0.04).abs() < 1e-6);
            assert!((fresnel(model, 0.0, glass) - 1.0).abs() < 1e-5);
            assert_eq!(fresnel(model, 0.5, 1.5), 1.0);
        }
        assert_eq!(fresnel(Fresnel::Exact, 0.7, 1.0), 0.0);
        // Brewster's angle: only the polarisation across the plane is reflected; half of ((n^2-1)/(n^2+1))^2.
        let cos = 1.0 / (1.0 + 1.5f32 * 1.5).sqrt();
        let half = 0.5 * (1.25f32 / 3.25) * (1.25 / 3.25);
        assert!((fresnel(Fresnel::Exact, cos, glass) - half).abs() < 1e-6);
    }

    #[test]
    fn fresnel_is_the_same_from_both_sides() {
        for i in 1..100 {
            let cos_in = i as f32 / 100.0;
            let cos_out = (1.0 - (1.0 - cos_in * cos_in) / 2.25f32).sqrt();
            for model in [Fresnel::Exact, Fresnel::Schlick] {
                let (there, back) = (fresnel(model, cos_in, 1.0 / 1.5), fresnel(model, cos_out, 1.5));
                assert!((there - back).abs() < 1e-4, "{model:?} {cos_in} {there} {back}");
            }
        }
    }

    #[test]
    fn refraction_obeys_snell_and_total_reflection() {
        let normal = Vec3::Y;
        for degrees in [0.0f32, 20.0, 45.0, 80.0] {
            let a = degrees.to_radians();
            let direction = Vec3::new(a.sin(), -a.cos(), 0.0);
            let out = refract(direction, normal, 1.0 / 1.5).unwrap();
            assert!((out.x * 1.5 - a.sin()).abs() < 1e-5 && out.y < 0.0);
            assert_eq!(refract(direction, normal, 1.5).is_some(), 1.5 * a.sin() < 1.0);
        }
        assert_eq!(reflect(Vec3::new(0.6, -0.8, 0.0), normal), Vec3::new(0.6, 0.8, 0.0));
    }
}
