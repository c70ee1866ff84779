//! The cone that a spot light shines into.

use glam::Vec3;

use crate::trace::simd::{Lanes, V3};

/// Which directions a lamp shines to, and how much of its light each gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampCone {
    /// Unit, along the middle; zero for a lamp that shines everywhere.
    pub axis: Vec3,
    /// Cosine of the angle at which it is dark.
    pub dark: f32,
    /// One over how far the cosine rises from there to where all of the light arrives.
    pub scale: f32,
}

impl LampCone {
    /// Everything gets all of the light: exactly so, since the share is then (0 + 1) * 1.
    pub const EVERYWHERE: LampCone = LampCone { axis: Vec3::ZERO, dark: -1.0, scale: 1.0 };

    /// A cone along a unit axis between the cosines of two angles, the smaller angle first.
    pub fn new(axis: Vec3, full: f32, dark: f32) -> Self {
        LampCone { axis, dark, scale: 1.0 / (full - dark).max(1e-4) }
    }

    /// Whether it shines everywhere.
    pub fn is_everywhere(&self) -> bool {
        self.axis == Vec3::ZERO
    }

    /// Share of the light that goes in a direction away from the lamp.
    #[inline]
    pub fn share(&self, away: Vec3) -> f32 {
        self.shares::<f32>((-away).into())
    }

    /// The same for directions towards the lamp.
    #[inline(always)]
    pub fn shares<L: Lanes>(&self, toward: V3<L>) -> L {
        share(-V3::splat(self.axis).dot(toward), L::splat(self.dark), L::splat(self.scale))
    }

    /// Share of all directions that get any.
    pub fn solid_share(&self) -> f32 {
        if self.is_everywhere() { 1.0 } else { 0.5 * (1.0 - self.dark) }
    }
}

/// The share at a cosine from the middle.
#[inline(always)]
pub fn share<L: Lanes>(cosine: L, dark: L, scale: L) -> L {
    let t = ((cosine - dark) * scale).max(L::splat(0.0)).min(L::splat(1.0));
    t * t
}
