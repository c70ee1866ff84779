//! What a surface looks like.

use glam::{DVec2, DVec3};

use super::record::ranges::{at_least, between, color, position};
use super::record::{Check, Invalid, record};
use super::value::{FieldValue, Mismatch, Text, Value};
use super::{FieldError, Record};

record! {
    /// The Blinn-Phong material of both ancestors, with mirror reflection and refraction.
    ///
    /// Light that reaches a point from direction L gives
    /// `diffuse * color * (N.L) + specular * specular_color * (N.H)^shininess` (Blinn, SIGGRAPH 1977).
    pub struct Material {
        /// Diffuse colour (albedo), linear, 0 and up.
        pub color: DVec3 = DVec3::splat(0.8),
        /// Kd: weight of the diffuse part, 0 and up.
        pub diffuse: f64 = 1.0,
        /// Colour of highlights and mirror images, linear.
        pub specular_color: DVec3 = DVec3::ONE,
        /// Ks: weight of the highlight, 0 and up.
        pub specular: f64 = 0.0,
        /// Exponent of the highlight, 0 and up; larger is smaller and sharper.
        pub shininess: f64 = 20.0,
        /// Weight of the mirror image; `specular` unless given, as in the ancestors. Transparent surfaces reflect what
        /// the setting `fresnel` says instead.
        pub reflection: Option<f64> = None,
        /// Gloss: how far mirror rays are spread, as the radius of the sphere around the tip of the unit mirror ray.
        pub gloss: f64 = 0.0,
        /// Transmittance, 0 (opaque) to 1.
        pub transmission: f64 = 0.0,
        /// Index of refraction against the surrounding air; matters when `transmission` is above 0.
        pub ior: f64 = 1.0,
        /// Whether opaque surfaces show and stop rays on both sides. Transparent ones always do.
        pub two_sided: bool = true,
    }
}

impl Material {
    /// Weight of the mirror image.
    pub fn reflection_weight(&self) -> f64 {
        self.reflection.unwrap_or(self.specular)
    }
}

impl Check for Material {
    fn check(&self) -> Result<(), Invalid> {
        color("color", self.color)?;
        at_least("diffuse", self.diffuse, 0.0)?;
        color("specular_color", self.specular_color)?;
        at_least("specular", self.specular, 0.0)?;
        at_least("shininess", self.shininess, 0.0)?;
        if let Some(reflection) = self.reflection {
            at_least("reflection", reflection, 0.0)?;
        }
        between("gloss", self.gloss, 0.0, 1.0)?;
        between("transmission", self.transmission, 0.0, 1.0)?;
        between("ior", self.ior, 0.0, 100.0)?;
        if self.transmission > 0.0 && self.ior <= 0.0 {
            let message = "`ior` must be greater than 0 where `transmission` is".into();
            return Err(Invalid { field: "ior", message });
        }
        Ok(())
    }
}

/// The name of the material that an entity wears.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct MaterialName(pub Text);

impl MaterialName {
    /// The one field, under which the name is reached.
    pub const FIELDS: &'static [&'static str] = &["name"];
}

impl Default for MaterialName {
    fn default() -> Self {
        MaterialName("".into())
    }
}

impl Record for MaterialName {
    fn fields(&self) -> &'static [&'static str] {
        Self::FIELDS
    }
    fn get(&self, field: &str) -> Option<Value> {
        (field == "name").then(|| self.to_value())
    }
    fn set(&mut self, field: &str, value: &Value) -> Result<(), FieldError> {
        if field != "name" {
            return Err(FieldError::Unknown { known: Self::FIELDS });
        }
        *self = Self::from_value(value).map_err(FieldError::Mismatch)?;
        Ok(())
    }
}

/// Whether the name is that of a material is for the scene to say.
impl Check for MaterialName {
    fn check(&self) -> Result<(), Invalid> {
        Ok(())
    }
}

impl FieldValue for MaterialName {
    fn to_value(&self) -> Value {
        Value::Text(self.0.clone())
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        Text::from_value(value).map(MaterialName).map_err(|_| Mismatch::new("the name of a material", value))
    }
}

record! {
    /// An image laid over a surface. Loaded and kept; not yet drawn.
    pub struct Texture {
        /// Image file, relative to the scene.
        pub image: Text = "".into(),
        /// Repeats along u and v.
        pub scale: DVec2 = DVec2::ONE,
        /// Shift along u and v, in repeats.
        pub offset: DVec2 = DVec2::ZERO,
    }
}

impl Check for Texture {
    fn check(&self) -> Result<(), Invalid> {
        position("scale", self.scale.extend(0.0))?;
        position("offset", self.offset.extend(0.0))
    }
}
