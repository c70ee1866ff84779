//! Fog: one medium of the same kind everywhere, or in a box.

use glam::DVec3;

use super::record::ranges::{at_least, between, position};
use super::record::{Check, Invalid, map_of, record, set_from_map};
use super::value::{FieldValue, Mismatch, Value};

record! {
    /// Fog around the scene, or in a box: air that takes light and scatters some of it. Glass and other bodies have none
    /// inside. With `Path` its light is that of the lamps and of all else that shines; with `Whitted` and `Distribution`
    /// what lies in it fades towards its `color` with distance, and with `Photon` too.
    pub struct Fog {
        /// What is lost of a beam of light per world unit, 0 and up: after a way of 1 / `density` 37 % are left.
        pub density: f64 = 0.1,
        /// Share of what is lost that is scattered, the rest is absorbed, linear, 0 to 1; with `Whitted`, `Distribution` and
        /// `Photon` the colour that things fade into.
        pub color: DVec3 = DVec3::splat(0.8),
        /// Where light is scattered to, with `Path`: 0 evenly, towards 1 onwards as by mist, towards -1 back; from -0.95 to
        /// 0.95 (Henyey and Greenstein 1941).
        pub anisotropy: f64 = 0.0,
        /// Two opposite corners of a box that it fills, world space. It reaches everywhere when not given, and no light from
        /// infinitely far then gets through it.
        pub bounds: Option<[DVec3; 2]> = None,
    }
}

impl Check for Fog {
    fn check(&self) -> Result<(), Invalid> {
        at_least("density", self.density, 0.0)?;
        self.color.to_array().into_iter().try_for_each(|share| between("color", share, 0.0, 1.0))?;
        between("anisotropy", self.anisotropy, -0.95, 0.95)?;
        self.bounds.iter().flatten().try_for_each(|corner| position("bounds", *corner))
    }
}

/// A script reads and writes it as a map.
impl FieldValue for Fog {
    fn to_value(&self) -> Value {
        map_of(self)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let mut fog = Fog::default();
        set_from_map(&mut fog, "`fog`", value)?;
        Ok(fog)
    }
}
