//! Materials as the kernel wants them.

use glam::Vec3;

use super::fresnel::mean_metal_reflectance;
use crate::components::{Material, Model};

/// Facets narrower than this are taken for a polished surface: their highlight is beyond what `f32` resolves well.
pub const SMOOTH: f32 = 1e-3;

/// Where a surface is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HoleCoverage {
    /// Everywhere.
    Full,
    /// Where its opacity is this much at least.
    Cutoff(f32),
    /// As much as its opacity says.
    Partial,
}

/// A material with every weight multiplied out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingParams {
    /// The law that it scatters by.
    pub model: Model,
    /// Kd Cd; of a conductor what it reflects straight on.
    pub diffuse: Vec3,
    /// Ks Cs, for highlights.
    pub specular: Vec3,
    /// Exponent of Blinn's highlight.
    pub shininess: f32,
    /// Weight of the mirror image, with its colour.
    pub reflection: f32,
    /// Linear factors of what a mirror shows.
    pub mirror_color: Vec3,
    /// Half the side of the square that mirrored rays are spread over, at distance 1.
    pub gloss: f32,
    /// Share of light that goes through, by the P3F tracers' reckoning: 1 for a `Dielectric`.
    pub transmission: f32,
    /// Refractive index against air.
    pub ior: f32,
    /// Which of transparent bodies that overlap is there: the highest.
    pub priority: u32,
    /// Share of bare metal of a `Principled` surface.
    pub metallic: f32,
    /// Weight of what a `Principled` surface reflects that is no metal.
    pub principled_reflection: f32,
    /// Whether light goes straight through a `Principled` surface.
    pub thin: bool,
    /// How much of it is there.
    pub opacity: f32,
    /// What opacity below 1 means.
    pub coverage: HoleCoverage,
    /// Whether the alpha of vertex colours counts for `opacity`.
    pub alpha_counts: bool,
    /// Width of GGX: the square of `roughness`.
    pub alpha: f32,
    /// Complex index of refraction of a conductor: eta, and k with it; 0 where `diffuse` stands for both.
    pub eta: Vec3,
    /// Absorption of a conductor, channel by channel.
    pub k: Vec3,
    /// Mean reflectance over the hemisphere of a conductor that has `eta`; 0 else.
    pub mean_fresnel: Vec3,
    /// Per world unit.
    pub absorption: Vec3,
    /// Radiance.
    pub emission: Vec3,
    /// Whether the camera sees no more of it than shadows.
    pub shadow_catcher: bool,
    /// Whether what it sends out differs from point to point, so that lights cannot be chosen by it.
    pub uneven_emission: bool,
    /// The light group that its emission is added up in, as that of a lamp.
    pub group: u32,
}

impl From<&Material> for ShadingParams {
    fn from(m: &Material) -> Self {
        let albedo = match m.model {
            Model::Conductor | Model::Principled | Model::Unlit => m.color,
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
                Model::Principled => m.transmission as f32,
                Model::Dielectric => 1.0,
                Model::Lambert | Model::Conductor | Model::Plastic | Model::Unlit => 0.0,
            },
            ior: m.refractive_index() as f32,
            priority: m.priority,
            metallic: m.metallic as f32,
            principled_reflection: m.principled_reflection() as f32,
            thin: m.thin,
            opacity: m.opacity as f32,
            coverage: match m.opacity_cutoff {
                Some(cutoff) => HoleCoverage::Cutoff(cutoff as f32),
                None if m.has_holes() => HoleCoverage::Partial,
                None => HoleCoverage::Full,
            },
            alpha_counts: m.vertex_opacity,
            alpha: (m.roughness * m.roughness) as f32,
            eta: m.eta.unwrap_or_default().as_vec3(),
            k: m.k.unwrap_or_default().as_vec3(),
            mean_fresnel: match (m.eta, m.k) {
                (Some(eta), Some(k)) => mean_metal_reflectance(eta.as_vec3(), k.as_vec3()),
                (Some(_), None) | (None, _) => Vec3::ZERO,
            },
            absorption: m.absorption.as_vec3(),
            emission: m.emission.as_vec3(),
            shadow_catcher: m.shadow_catcher,
            uneven_emission: m.emission_map.is_some() || m.has_holes(),
            group: 0,
        }
    }
}

/// Values of the maps of a material at one point: factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapValues {
    /// Factors of the diffuse colour.
    pub color: Vec3,
    /// Factors of the highlight's colour.
    pub specular: Vec3,
    /// Factors of the emitted light.
    pub emission: Vec3,
    /// Factor of the mirror's share.
    pub reflection: f32,
    /// Factor of the roughness.
    pub roughness: f32,
    /// Factor of the share of metal.
    pub metallic: f32,
    /// Factor of the share that goes through.
    pub transmission: f32,
    /// Factor of the opacity.
    pub opacity: f32,
}

impl ShadingParams {
    /// The material with the values of its maps at one point.
    pub fn mapped(&self, maps: &MapValues) -> Self {
        ShadingParams {
            diffuse: self.diffuse * maps.color,
            specular: self.specular * maps.specular,
            mirror_color: self.mirror_color * maps.specular,
            emission: self.emission * maps.emission,
            principled_reflection: self.principled_reflection * maps.reflection,
            gloss: self.gloss * maps.roughness,
            alpha: self.alpha * (maps.roughness * maps.roughness),
            metallic: self.metallic * maps.metallic,
            transmission: self.transmission * maps.transmission,
            opacity: self.opacity * maps.opacity,
            ..*self
        }
    }

    /// The factor of `opacity` that the alpha of a vertex colour is.
    #[inline]
    pub fn vertex_opacity(&self, alpha: f32) -> f32 {
        if self.alpha_counts { alpha.clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Radiance of the surface as a light that is sampled.
    pub fn sampled_emission(&self) -> Vec3 {
        if self.uneven_emission { Vec3::ZERO } else { self.emission }
    }

    /// How much of it is there: 1 or 0 where a cutoff decides.
    #[inline]
    pub fn cover(&self) -> f32 {
        match self.coverage {
            HoleCoverage::Full => 1.0,
            HoleCoverage::Cutoff(least) => f32::from(u8::from(self.opacity >= least)),
            HoleCoverage::Partial => self.opacity,
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

    /// Whether all light goes on in single directions, by a mirror's law and that of glass alone.
    #[inline]
    pub fn is_polished(&self) -> bool {
        let polished = match self.model {
            Model::BlinnPhong => !self.is_diffuse() && self.gloss == 0.0,
            Model::Dielectric | Model::Conductor => self.alpha < SMOOTH,
            Model::Lambert | Model::Plastic | Model::Principled | Model::Unlit => false,
        };
        let scatters = self.model == Model::BlinnPhong && (self.diffuse != Vec3::ZERO || self.specular != Vec3::ZERO);
        polished && !scatters && self.emission == Vec3::ZERO
    }

    /// Whether it is the skin of a body that light runs in, where it encloses one: a wall of no thickness has no inside.
    #[inline]
    pub fn bounds_body(&self) -> bool {
        self.transmission > 0.0 && self.metallic < 1.0 && !self.thin && self.ior > 0.0
    }

    /// Whether it is glass and nothing else: no light is scattered by anything but a change of index.
    #[inline]
    pub fn is_clear(&self) -> bool {
        self.model == Model::Dielectric && self.emission == Vec3::ZERO
    }

    /// Whether light gets less on its way through its body.
    pub fn absorbs(&self) -> bool {
        self.bounds_body() && self.absorption != Vec3::ZERO
    }

    /// Whether it belongs to the scene that shadows are counted against: what catches them, and what sends out light.
    pub fn stays_without_objects(&self) -> bool {
        self.shadow_catcher || self.emission != Vec3::ZERO
    }

    /// What is left of light after a way inside the body, by Beer's law.
    pub fn transmittance(&self, distance: f32) -> Vec3 {
        // Where nothing is absorbed, nothing is on an endless way either.
        self.absorption.map(|a| if a > 0.0 { libm::expf(-a * distance) } else { 1.0 })
    }
}
