//! What a surface looks like.

use glam::DVec3;

use super::record::ranges::{at_least, between, color};
use super::record::{Check, Invalid, record};
use super::value::{FieldValue, Mismatch, Text, Value};
use super::{FieldError, Record, Texture};

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
        /// Multiplied with `color`.
        pub color_map: Option<Box<Texture>> = None,
        /// Multiplied with `specular_color`: of highlights and mirror images.
        pub specular_map: Option<Box<Texture>> = None,
        /// Its luminance is multiplied with `gloss`.
        pub roughness_map: Option<Box<Texture>> = None,
        /// Its luminance is a height that bends the shading normal (Blinn, SIGGRAPH 1978).
        pub bump: Option<Box<Texture>> = None,
        /// An image of normals in tangent space: red along u, green along v (up), blue out; 0..1 stands for -1..1.
        pub normal_map: Option<Box<Texture>> = None,
    }
}

impl Material {
    /// Weight of the mirror image.
    pub fn reflection_weight(&self) -> f64 {
        self.reflection.unwrap_or(self.specular)
    }

    /// Fields that hold textures.
    pub const MAPS: [&str; 5] = ["color_map", "specular_map", "roughness_map", "bump", "normal_map"];

    /// The textures of [`Self::MAPS`] that are given, each with its field and whether it is of colours.
    pub fn maps(&self) -> impl Iterator<Item = (&'static str, &Texture, bool)> {
        let all = [&self.color_map, &self.specular_map, &self.roughness_map, &self.bump, &self.normal_map];
        let given = Self::MAPS.into_iter().zip(all).enumerate();
        given.filter_map(|(i, (field, map))| map.as_deref().map(|texture| (field, texture, i < 2)))
    }

    /// Files that its textures name.
    pub fn images(&mut self) -> impl Iterator<Item = &mut Text> {
        let Material { color_map, specular_map, roughness_map, bump, normal_map, .. } = self;
        let all = [color_map, specular_map, roughness_map, bump, normal_map];
        all.into_iter().flatten().filter_map(|texture| texture.image.as_mut())
    }

    /// Sees to it that each texture makes sense where it stands.
    fn check_maps(&self) -> Result<(), Invalid> {
        for (field, texture, _) in self.maps() {
            let message = match texture.check() {
                Err(invalid) => invalid.message,
                Ok(()) if field == "normal_map" && texture.image.is_none() => "a `normal_map` is an `image`".into(),
                Ok(()) if texture.depth.is_some() && !matches!(field, "bump" | "normal_map") => {
                    "`depth` is for `bump` and `normal_map`".into()
                }
                Ok(()) => continue,
            };
            return Err(Invalid { field, message });
        }
        Ok(())
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
        self.check_maps()
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
