//! A direction that light is scattered to.

use glam::Vec3;

/// A direction that light is scattered to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The direction, unit, in the axes of the surface.
    pub wi: Vec3,
    /// Value times cosine over density, as a path's factor.
    pub weight: Vec3,
    /// Per steradian; 0 if `specular`, where no other way of sampling finds the direction.
    pub pdf: f32,
    /// A mirror or a polished surface: exactly one direction.
    pub specular: bool,
    /// Whether it goes through the surface.
    pub transmitted: bool,
}

impl BsdfSample {
    pub(super) fn specular(wi: Vec3, weight: Vec3) -> Self {
        BsdfSample { wi, weight, pdf: 0.0, specular: true, transmitted: wi.z < 0.0 }
    }
}

/// A sample of what is evaluated, with the weight that follows.
pub fn weighed(wi: Vec3, value: Vec3, pdf: f32) -> Option<BsdfSample> {
    let good = pdf > 0.0 && pdf < f32::INFINITY;
    good.then(|| BsdfSample { wi, weight: value / pdf, pdf, specular: false, transmitted: wi.z < 0.0 })
}
