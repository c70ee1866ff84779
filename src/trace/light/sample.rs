//! Light towards a point, and photons that leave a light.

use glam::Vec3;

use crate::trace::soa::Ray;

/// Light that reaches a point, if nothing stands in its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit, towards the light.
    pub direction: Vec3,
    /// Where on the light it comes from.
    pub target: Vec3,
    /// Where a shadow ray ends.
    pub distance: f32,
    /// Radiance over density: the factor of the BSDF's value.
    pub contribution: Vec3,
    /// Per steradian, with the chance of the light in it; 0 where no ray can meet the light by itself.
    pub pdf: f32,
    /// Number of the light, for those who put shadow rays in order.
    pub light: u32,
}

/// A photon that leaves a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmittedPhoton {
    pub ray: Ray,
    /// Power of all lights together, as this photon would carry it alone: to be divided by how many are sent.
    pub power: Vec3,
}
