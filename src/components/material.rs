//! What a surface looks like.

use glam::DVec3;

use super::record::ranges::{at_least, between, color};
use super::record::{Check, Invalid, choice, record};
use super::value::{FieldValue, Mismatch, Text, Value};
use super::{Channel, FieldClass, FieldError, Record, Texture};

choice! {
    /// How a surface scatters light. All but the first give back no more than arrives.
    pub enum Model {
        /// The material of the NFF and P3F tracers: Lambert, a highlight (Blinn 1977), mirror and glass, each with its weight.
        BlinnPhong,
        /// Matt: `diffuse * color` is the share that comes back.
        Lambert,
        /// Bare metal: microfacets by GGX, what they lose to each other given back (Kulla and Conty 2017).
        Conductor,
        /// Glass, smooth or ground (Walter et al. 2007): `ior`, `roughness`, `absorption`.
        Dielectric,
        /// A clear coat (`ior`, `roughness`) over a matt base of `diffuse * color`.
        Plastic,
        /// Metal, plastic and glass by shares, as glTF and most programs have it: `color`, `metallic`, `roughness`,
        /// `ior`, `reflection`, `specular_color`, `transmission` and `thin`.
        Principled,
        /// Shows its `color` as it is, lit by nothing, and lights nothing.
        Unlit,
    }
}

impl Model {
    /// All of them, in the order of their declaration.
    pub const ALL: [Model; 7] = [
        Model::BlinnPhong,
        Model::Lambert,
        Model::Conductor,
        Model::Dielectric,
        Model::Plastic,
        Model::Principled,
        Model::Unlit,
    ];

    /// Fields of a material that this model looks at, of those that not all models do.
    pub const fn fields(self) -> &'static [&'static str] {
        match self {
            Model::BlinnPhong => &[
                "color",
                "diffuse",
                "specular_color",
                "specular",
                "shininess",
                "reflection",
                "gloss",
                "transmission",
                "ior",
                "priority",
                "absorption",
                "color_map",
                "specular_map",
                "roughness_map",
                "transmission_map",
            ],
            Model::Lambert => &["color", "diffuse", "color_map"],
            Model::Conductor => &["color", "roughness", "eta", "k", "color_map", "roughness_map"],
            // Whitted pictures tint what polished glass mirrors.
            Model::Dielectric => &[
                "specular_color",
                "ior",
                "priority",
                "roughness",
                "absorption",
                "specular_map",
                "roughness_map",
                "transmission_map",
            ],
            Model::Plastic => &["color", "diffuse", "ior", "roughness", "color_map", "roughness_map"],
            Model::Principled => &[
                "color",
                "specular_color",
                "reflection",
                "transmission",
                "ior",
                "priority",
                "metallic",
                "thin",
                "roughness",
                "absorption",
                "color_map",
                "specular_map",
                "reflection_map",
                "roughness_map",
                "metallic_map",
                "transmission_map",
            ],
            Model::Unlit => &["color", "color_map"],
        }
    }

    /// Whether a field of a material is looked at by some models and not by others.
    pub fn is_for_some(field: &str) -> bool {
        let uses = |model: &Model| model.fields().contains(&field);
        Model::ALL.iter().any(uses) && !Model::ALL.iter().all(uses)
    }
}

record! {
    /// What a surface is made of.
    ///
    /// `model` says which of the fields count. Of a Blinn-Phong surface, light that reaches a point from direction L
    /// gives `diffuse * color * (N.L) + specular * specular_color * (N.H)^shininess` (Blinn, SIGGRAPH 1977).
    pub struct Material {
        /// Which law it scatters light by.
        pub model: Model = Model::BlinnPhong,
        /// Diffuse colour (albedo), linear, 0 and up; of a `Conductor` the colour that it reflects straight on; of a
        /// `Principled` surface both, and that of what goes through. At most 1 where the model conserves energy.
        pub color: DVec3 = DVec3::splat(0.8),
        /// Kd: weight of the diffuse part, 0 and up.
        pub diffuse: f64 = 1.0,
        /// Colour of highlights and mirror images, linear.
        pub specular_color: DVec3 = DVec3::ONE,
        /// Ks: weight of the highlight, 0 and up.
        pub specular: f64 = 0.0,
        /// Exponent of the highlight, 0 and up; larger is smaller and sharper.
        pub shininess: f64 = 20.0,
        /// Weight of the mirror image; `specular` unless given, as in the P3F tracers. Transparent surfaces reflect what
        /// the setting `fresnel` says instead. Of a `Principled` surface that is no metal, the weight of what it
        /// reflects, 0 to 1; 1 unless given.
        pub reflection: Option<f64> = None,
        /// Gloss: how far mirror rays are spread, as the radius of the sphere around the tip of the unit mirror ray.
        pub gloss: f64 = 0.0,
        /// Transmittance, 0 (opaque) to 1. Of a `Principled` surface that is no metal, the share of the light let in
        /// that goes through, and is not scattered back.
        pub transmission: f64 = 0.0,
        /// Index of refraction against air, whatever surrounds the body; matters when `transmission` is above 0, and to
        /// `Dielectric`, `Plastic` and `Principled`. Unless given it is 1.5, and 1 for `BlinnPhong`. A body inside another
        /// refracts by the ratio of both.
        pub ior: Option<f64> = None,
        /// Where transparent bodies overlap, the one of highest priority is there and the others are not (Schmidt and
        /// Budge 2002): give a glass 1 and let the liquid in it, of 0, reach a little into its wall. Of bodies of equal
        /// priority the one that was entered last is there: a bubble or a drop inside another needs none.
        pub priority: u32 = 0,
        /// How much of a `Principled` surface is bare metal, 0 to 1.
        pub metallic: f64 = 0.0,
        /// Whether a `Principled` surface is a wall of no thickness: light goes straight through it.
        pub thin: bool = false,
        /// How much of the surface is there at all, 0 (a hole) to 1. Where it is not, rays go on as if there were
        /// nothing: shadows too.
        pub opacity: f64 = 1.0,
        /// If given, the surface is there where `opacity` is this much at least, and a hole elsewhere.
        pub opacity_cutoff: Option<f64> = None,
        /// Whether `opacity` is multiplied with the alpha of the colours that the vertices of a mesh have.
        pub vertex_opacity: bool = false,
        /// Roughness of `Conductor`, `Dielectric` and `Plastic`, 0 (polished) to 1; the width alpha of GGX is its square.
        /// Below 0.03 a surface counts as polished.
        pub roughness: f64 = 0.0,
        /// Complex index of refraction of a `Conductor`, per channel: `eta` and `k` take the place of `color`.
        pub eta: Option<DVec3> = None,
        /// Extinction coefficient that goes with `eta`.
        pub k: Option<DVec3> = None,
        /// What the inside of a transparent body swallows per world unit: light is dimmed by e^(-`absorption` * way).
        pub absorption: DVec3 = DVec3::ZERO,
        /// Radiance that the surface sends out by itself, to the sides that it shows. A lamp of `color` c with inverse
        /// square falloff and area A has radiance c * pi / A. Spheres, triangles, meshes and boxes
        /// that shine light what is around them.
        pub emission: DVec3 = DVec3::ZERO => EmittedColor,
        /// Whether opaque surfaces show and stop rays on both sides. Transparent ones always do.
        pub two_sided: bool = true,
        /// Whether the camera sees no more of the surface than the shadows on it: with `transparent` they are in alpha alone,
        /// else they darken what surrounds the scene. Laid over a photograph of the place, the picture puts the objects on
        /// its floor. What counts as shadow is by how much other bodies, but those that emit light, take from the light
        /// that arrives; in mirrors, through glass and to what it lights the surface is an ordinary one. Not with `Photon`.
        pub shadow_catcher: bool = false,
        /// Multiplied with `color`.
        pub color_map: Option<Box<Texture>> = None,
        /// Multiplied with `specular_color`: of highlights and mirror images.
        pub specular_map: Option<Box<Texture>> = None,
        /// Multiplied with `reflection`: its luminance, or the `channel` that it names.
        pub reflection_map: Option<Box<Texture>> = None,
        /// Multiplied with `roughness` and `gloss`: its luminance, or the `channel` that it names.
        pub roughness_map: Option<Box<Texture>> = None,
        /// As `roughness_map`, for `metallic`.
        pub metallic_map: Option<Box<Texture>> = None,
        /// As `roughness_map`, for `transmission`.
        pub transmission_map: Option<Box<Texture>> = None,
        /// As `roughness_map`, for `opacity`.
        pub opacity_map: Option<Box<Texture>> = None,
        /// Multiplied with `emission`. Surfaces with one are lights only to rays that happen to meet them.
        pub emission_map: Option<Box<Texture>> = None,
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

    /// Weight of what a `Principled` surface reflects that is no metal.
    pub fn principled_reflection(&self) -> f64 {
        self.reflection.unwrap_or(1.0)
    }

    /// Index of refraction, given or not.
    pub fn refractive_index(&self) -> f64 {
        self.ior.unwrap_or(if self.model == Model::BlinnPhong { 1.0 } else { 1.5 })
    }

    /// Whether there may be holes in the surface, or places that are only partly there.
    pub fn has_holes(&self) -> bool {
        self.opacity < 1.0 || self.opacity_map.is_some() || self.opacity_cutoff.is_some() || self.vertex_opacity
    }

    /// Fields that hold textures: those of colours, then those of numbers and normals.
    pub const MAPS: [&str; 10] = [
        "color_map",
        "specular_map",
        "emission_map",
        "reflection_map",
        "roughness_map",
        "metallic_map",
        "transmission_map",
        "opacity_map",
        "bump",
        "normal_map",
    ];

    /// The textures of [`Self::MAPS`] that are given, each with its field and whether it is of colours.
    pub fn maps(&self) -> impl Iterator<Item = (&'static str, &Texture, bool)> {
        let colors = [&self.color_map, &self.specular_map, &self.emission_map];
        let numbers = [&self.reflection_map, &self.roughness_map, &self.metallic_map, &self.transmission_map];
        let all = colors.into_iter().chain(numbers).chain([&self.opacity_map, &self.bump, &self.normal_map]);
        let given = Self::MAPS.into_iter().zip(all).enumerate();
        given.filter_map(|(i, (field, map))| map.as_deref().map(|texture| (field, texture, i < 3)))
    }

    /// Files that its textures name.
    pub fn images(&mut self) -> impl Iterator<Item = &mut Text> {
        let Material { color_map, specular_map, emission_map, reflection_map, roughness_map, .. } = self;
        let Material { metallic_map, transmission_map, opacity_map, bump, normal_map, .. } = self;
        let first = [color_map, specular_map, emission_map, reflection_map, roughness_map];
        let others = [metallic_map, transmission_map, opacity_map, bump, normal_map];
        first.into_iter().chain(others).flatten().filter_map(|texture| texture.image.as_mut())
    }

    /// Sees to it that each texture makes sense where it stands.
    fn check_maps(&self) -> Result<(), Invalid> {
        for (field, texture, _) in self.maps() {
            let message = match texture.check() {
                Err(invalid) => invalid.message,
                Ok(()) if field == "normal_map" && texture.image.is_none() => "a `normal_map` is an `image`".into(),
                Ok(()) if field == "normal_map" && texture.channel != Channel::Color => {
                    "a `normal_map` has three channels: `channel` cannot choose one".into()
                }
                Ok(()) if texture.depth.is_some() && !matches!(field, "bump" | "normal_map") => {
                    "`depth` is for `bump` and `normal_map`".into()
                }
                Ok(()) => continue,
            };
            return Err(Invalid { field, message });
        }
        Ok(())
    }

    /// Whether light goes through it.
    pub fn is_transparent(&self) -> bool {
        match self.model {
            Model::BlinnPhong => self.transmission > 0.0,
            Model::Dielectric => true,
            Model::Principled => self.transmission > 0.0 && self.metallic < 1.0,
            Model::Lambert | Model::Conductor | Model::Plastic | Model::Unlit => false,
        }
    }

    /// What only energy-conserving models ask for.
    fn check_model(&self) -> Result<(), Invalid> {
        let model = self.model;
        let fail = |field, message| Err(Invalid { field, message });
        let ior = self.refractive_index();
        if matches!(model, Model::Dielectric | Model::Plastic) && (ior <= 0.0 || ior == 1.0) {
            let message = format!("`ior` of a `{}` must be above 0 and not 1 (glass has 1.5)", model.name());
            return fail("ior", message);
        }
        if model == Model::Principled && self.reflection.is_some_and(|reflection| reflection > 1.0) {
            return fail("reflection", "`reflection` of a `Principled` surface must be from 0 to 1".into());
        }
        let albedo = match model {
            Model::Lambert | Model::Plastic => self.color * self.diffuse,
            Model::Conductor | Model::Principled => self.color,
            Model::BlinnPhong | Model::Dielectric | Model::Unlit => DVec3::ZERO,
        };
        if albedo.max_element() > 1.0 {
            let message = format!("a `{}` gives back no more than arrives: `color` must be at most 1", model.name());
            return fail("color", message);
        }
        if self.eta.is_some() != self.k.is_some() {
            let (given, missing) = if self.eta.is_some() { ("eta", "k") } else { ("k", "eta") };
            return fail(given, format!("`{given}` of a `Conductor` needs `{missing}` beside it"));
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
        between("metallic", self.metallic, 0.0, 1.0)?;
        between("opacity", self.opacity, 0.0, 1.0)?;
        self.opacity_cutoff.map_or(Ok(()), |cutoff| between("opacity_cutoff", cutoff, 0.0, 1.0))?;
        let ior = self.refractive_index();
        between("ior", ior, 0.0, 100.0)?;
        if self.transmission > 0.0 && ior <= 0.0 && self.model != Model::Principled {
            let message = "`ior` must be greater than 0 where `transmission` is".into();
            return Err(Invalid { field: "ior", message });
        }
        between("roughness", self.roughness, 0.0, 1.0)?;
        for eta in self.eta.iter().flat_map(|v| v.to_array()) {
            between("eta", eta, 1e-3, 100.0)?;
        }
        for k in self.k.iter().flat_map(|v| v.to_array()) {
            between("k", k, 0.0, 100.0)?;
        }
        color("absorption", self.absorption)?;
        color("emission", self.emission)?;
        self.check_model()?;
        self.check_maps()
    }
}

/// The name of an entity's material.
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
    fn classes(&self) -> &'static [FieldClass] {
        &[FieldClass::General]
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
    fn probe(&self, field: &str, value: &Value) -> Result<(), FieldError> {
        super::record::probe(self.clone(), field, value)
    }
    fn docs(&self) -> &'static str {
        "The material that an entity wears, by its name; a plain grey one where there is none."
    }
    fn field_docs(&self) -> &'static [&'static str] {
        &["The name of a material of the scene."]
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
