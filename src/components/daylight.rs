//! Daylight: a clear sky with the sun in it.

use glam::DVec3;

use super::record::ranges::{between, position};
use super::record::{Check, Invalid, map_of, record, set_from_map};
use super::value::{FieldValue, Mismatch, Value};

record! {
    /// The sky of a clear day and the sun in it, by scattering in air and haze (Nishita et al., SIGGRAPH 1993): around the
    /// scene where there is no `environment`. A white floor under a high sun has a radiance of about 1; `exposure` and
    /// `environment_intensity` change that, `environment_rotation` turns the whole.
    pub struct Daylight {
        /// Direction to the sun, of any length. Low suns are red; below the horizon it is dusk.
        pub sun: DVec3 = DVec3::new(-0.5, 0.6, 0.6),
        /// What air and haze take from a beam of light over what air alone takes: 1 pure air, 2 a clear day, 6 haze.
        pub turbidity: f64 = 2.0,
        /// Diameter of the sun in degrees, 0.6 at least: larger ones make softer shadows of the same light.
        pub sun_size: f64 = 0.6,
    }
}

impl Check for Daylight {
    fn check(&self) -> Result<(), Invalid> {
        position("sun", self.sun)?;
        if self.sun == DVec3::ZERO {
            let message = "`sun` must not be (0, 0, 0): it is the direction to the sun".into();
            return Err(Invalid { field: "sun", message });
        }
        between("turbidity", self.turbidity, 1.0, 20.0)?;
        between("sun_size", self.sun_size, 0.6, 60.0)
    }
}

/// A script reads and writes it as a map.
impl FieldValue for Daylight {
    fn to_value(&self) -> Value {
        map_of(self)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let mut daylight = Daylight::default();
        set_from_map(&mut daylight, "`daylight`", value)?;
        Ok(daylight)
    }
}
