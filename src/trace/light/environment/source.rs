//! Radiance from outside the scene, and sampling of its directions.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::cube::CubeMap;
use super::distribution::SphericalDistribution;
use crate::base::color::luminance;
use crate::base::math::sin_cos_degrees;
use crate::components::{MipMap, TexelFilter, Wrap};
use crate::trace::material::texture::{ImageSampler, RayCone};

/// Where an environment gets its colours from.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentMap {
    /// Six square pictures around the scene.
    Cube(Arc<CubeMap>),
    /// Equirectangular: u is the angle around y, 0.5 at -z and growing to the right (towards +x), v from -y up to +y.
    Sphere(Arc<MipMap>),
    /// Colours straight up, at the horizon and straight down.
    Sky([Vec3; 3]),
}

/// What lies around the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Where the light comes from.
    pub source: EnvironmentMap,
    /// Factor of the radiance.
    intensity: f32,
    /// Sine and cosine of the angle about y that the environment is turned by.
    turn: [f32; 2],
    distribution: Option<Arc<SphericalDistribution>>,
}

/// A direction chosen in proportion to what comes from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Unit, away from the scene.
    pub direction: Vec3,
    pub radiance: Vec3,
    /// Density per steradian, above 0.
    pub pdf: f32,
}

const TURN: f32 = std::f32::consts::TAU;

/// Directions, squared, that the luminance of the whole is estimated from.
const LOOKS: u32 = 16;

impl Environment {
    /// `rotation` is in degrees about y, counter-clockwise seen from above, as the yaw of an entity.
    pub fn new(source: EnvironmentMap, intensity: f64, rotation: f64) -> Self {
        let (sin, cos) = sin_cos_degrees(rotation);
        Environment { source, intensity: intensity as f32, turn: [sin as f32, cos as f32], distribution: None }
    }

    /// Builds what sampling needs, unless it is there.
    pub fn prepare(&mut self) {
        if self.distribution.is_some() {
            return;
        }
        let (width, height) = match &self.source {
            EnvironmentMap::Cube(cube) => (4 * cube.faces[0].width, 2 * cube.faces[0].height),
            EnvironmentMap::Sphere(picture) => (picture.levels[0].width, picture.levels[0].height),
            EnvironmentMap::Sky(_) => (1, 64),
        };
        let distribution = SphericalDistribution::new(width, height, |direction| self.source.lookup(direction));
        self.distribution = Some(Arc::new(distribution));
    }

    /// Whether directions can be sampled by how bright they are.
    pub fn is_prepared(&self) -> bool {
        self.distribution.is_some()
    }

    /// Luminance summed over the sphere of directions, as far as some sampled ones tell; 0 if nothing is prepared.
    pub fn luminous(&self) -> f64 {
        let at = |i: u32| [(i % LOOKS) as f32, (i / LOOKS) as f32].map(|x| (x + 0.5) / LOOKS as f32);
        let samples = (0..LOOKS * LOOKS).filter_map(|i| self.sample(at(i)));
        let sum: f64 = samples.map(|s| f64::from(luminance(s.radiance.to_array()) / s.pdf)).sum();
        sum / f64::from(LOOKS * LOOKS)
    }

    /// The same source, brighter or darker and turned; what sampling needs stays.
    pub fn placed(self, intensity: f64, rotation: f64) -> Self {
        Environment { distribution: self.distribution, ..Self::new(self.source, intensity, rotation) }
    }

    /// Radiance from a direction.
    #[inline]
    pub fn lookup(&self, direction: Vec3) -> Vec3 {
        self.source.lookup(self.inward(direction)) * self.intensity
    }

    /// Mean radiance around a direction, over the cone of a ray. Only a picture of the sphere is averaged.
    pub fn lookup_wide(&self, direction: Vec3, cone: RayCone) -> Vec3 {
        let inward = self.inward(direction);
        match &self.source {
            EnvironmentMap::Sphere(picture) => lookup_sphere(picture, inward, cone.spread) * self.intensity,
            source => source.lookup(inward) * self.intensity,
        }
    }

    /// A direction for a point of the unit square; `None` if nothing is prepared.
    pub fn sample(&self, square: [f32; 2]) -> Option<EnvironmentSample> {
        let (inward, pdf) = self.distribution.as_ref()?.sample(square);
        let radiance = self.source.lookup(inward) * self.intensity;
        Some(EnvironmentSample { direction: self.outward(inward), radiance, pdf })
    }

    /// Density per steradian with which [`Self::sample`] gives a direction; 0 if nothing is prepared.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        self.distribution.as_ref().map_or(0.0, |d| d.pdf(self.inward(direction)))
    }

    /// From the world to the space of the source.
    #[inline]
    fn inward(&self, d: Vec3) -> Vec3 {
        let [sin, cos] = self.turn;
        if sin == 0.0 && cos == 1.0 { d } else { Vec3::new(cos * d.x - sin * d.z, d.y, sin * d.x + cos * d.z) }
    }

    fn outward(&self, d: Vec3) -> Vec3 {
        let [sin, cos] = self.turn;
        Vec3::new(cos * d.x + sin * d.z, d.y, cos * d.z - sin * d.x)
    }
}

impl EnvironmentMap {
    fn lookup(&self, d: Vec3) -> Vec3 {
        match self {
            EnvironmentMap::Cube(cube) => cube.lookup(d),
            EnvironmentMap::Sphere(picture) => lookup_sphere(picture, d, 0.0),
            EnvironmentMap::Sky([zenith, horizon, ground]) => {
                // Straight in the height: the mean over the upper half is that of its two colours.
                if d.y >= 0.0 { *horizon + (*zenith - *horizon) * d.y } else { *horizon - (*ground - *horizon) * d.y }
            }
        }
    }
}

/// An equirectangular picture in a direction, over a cone of this angle.
fn lookup_sphere(picture: &MipMap, d: Vec3, spread: f32) -> Vec3 {
    let across = (d.x * d.x + d.z * d.z).sqrt();
    let u = 0.5 + libm::atan2f(d.x, -d.z) / TURN;
    let v = libm::atan2f(across, -d.y) * (2.0 / TURN);
    let filter = if spread > 0.0 { TexelFilter::Mip } else { TexelFilter::Bilinear };
    let sheet = ImageSampler { wrap: [Wrap::Repeat; 2], filter };
    let axes = [Vec2::X * (spread / (TURN * across.max(1e-6))).min(1.0), Vec2::Y * (spread * 2.0 / TURN)];
    sheet.color(picture, Vec2::new(u, v), axes, [None, Some([0.0, 1.0])])
}
