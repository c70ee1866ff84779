//! What is laid over a surface: pictures and patterns.

use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::ImagePlane;
use super::record::ranges::{above, at_least, between, color, coordinate, position, whole};
use super::record::{Check, Invalid, choice, map_of, record, set_from_map};
use super::value::{FieldValue, Mismatch, Text, Value};
use crate::base::files::numbered;
use crate::base::limits;

choice! {
    /// A procedural texture; one unit of its coordinates is one period, before `scale`.
    pub enum Pattern {
        /// Cells of side 1/2 that alternate between two colours.
        Checker,
        /// Bands of equal width across the first coordinate, one of each colour per unit.
        Stripes,
        /// A wave across the first coordinate that runs through the colours and back; `turbulence` makes the veins.
        Marble,
        /// The same wave in rings around the second axis.
        Wood,
        /// Gradient noise (Perlin, SIGGRAPH 2002) in octaves, through the colours from first to last.
        Noise,
    }
}

choice! {
    /// What lies beyond the edges of a picture.
    pub enum Wrap {
        /// The picture again.
        Repeat,
        /// Every other copy is mirrored.
        Mirror,
        /// The texels of the edge go on for ever.
        Clamp,
    }
}

choice! {
    /// How a texture is reduced to the area that a ray stands for.
    pub enum TexelFilter {
        /// The one texel, or the pattern at the one point.
        Nearest,
        /// The mean of the four nearest texels by distance; patterns as `Nearest`.
        Bilinear,
        /// The mean over the footprint of the ray: from smaller copies of a picture (Williams, SIGGRAPH 1983) along the
        /// longer axis of the footprint; patterns by their integral, noise without the octaves that are too fine.
        Mip,
    }
}

choice! {
    /// The coordinates that a texture is laid out in.
    pub enum Space {
        /// Those on the surface: see each shape.
        Uv,
        /// The entity's own space: the pattern is carved from a solid that moves with it.
        Object,
        /// The world: the entity moves through the solid.
        World,
    }
}

choice! {
    /// What the numbers of a picture file mean. HDR files are always linear.
    pub enum Encoding {
        /// `Srgb` for colours, `Linear` for everything else and where the picture is written with `transfer: Linear`.
        Auto,
        /// The sRGB curve.
        Srgb,
        /// Linear values.
        Linear,
    }
}

choice! {
    /// Which part of a texture counts; where a colour is wanted, it is a grey.
    pub enum Channel {
        /// All of it: its luminance where one number is wanted, as for `roughness_map`.
        Color,
        /// The first channel.
        Red,
        /// The second channel.
        Green,
        /// The third channel.
        Blue,
        /// That of a picture, 1 if it has none.
        Alpha,
    }
}

record! {
    /// A picture or a pattern. On an entity it is multiplied with the `color` of its material.
    ///
    /// A point with coordinates p (u, v; or x, y, z in a solid) shows what the texture has at
    /// `rotate(p * scale, rotation) + offset`. Pictures cover 0..1 by 0..1, v from the bottom row up.
    pub struct Texture {
        /// Image file (PNG, JPEG, WebP, TGA, BMP, PNM, HDR, EXR), relative to the scene; of its alpha only `channel`
        /// speaks; `####` in its name stands for `frame`. Either this or `pattern`.
        pub image: Option<Text> = None,
        /// Number of the image, where its name has `##` or more of these; the nearest whole number, 1 if not given.
        pub frame: Option<f64> = None,
        /// A procedural texture; either this or `image`.
        pub pattern: Option<Pattern> = None,
        /// Colours of the pattern, linear, two or more (`Checker`: two).
        pub colors: Vec<DVec3> = vec![DVec3::ZERO, DVec3::ONE],
        /// Octaves of noise, each half as wide and half as strong as the one before.
        pub octaves: u32 = 6,
        /// How far noise displaces the pattern, in units of its coordinates; `Marble` 0.5, `Wood` 0.1, else 0.
        pub turbulence: Option<f64> = None,
        /// Repeats per unit: one number, two for u and v, or three in a solid; not 0.
        pub scale: Axes<1> = Axes(DVec3::ONE),
        /// Shift in repeats: two numbers for u and v, or three in a solid.
        pub offset: Axes<0> = Axes(DVec3::ZERO),
        /// Degrees, counter-clockwise in the plane of the first two coordinates.
        pub rotation: f64 = 0.0,
        /// For pictures: beyond their sides, and above and below unless `wrap_v` is given.
        pub wrap: Wrap = Wrap::Repeat,
        /// For pictures: above and below them.
        pub wrap_v: Option<Wrap> = None,
        /// Which of a mesh's texture coordinates are meant, 0 or 1; meshes with one set have no other.
        pub uv_set: u32 = 0,
        /// What of it counts.
        pub channel: Channel = Channel::Color,
        /// Factor of the colour, linear.
        pub tint: DVec3 = DVec3::ONE,
        /// How it is reduced to the area that a ray stands for.
        pub filter: TexelFilter = TexelFilter::Mip,
        /// `Uv` for pictures (which have no other), `Checker` and `Stripes`, else `Object`.
        pub space: Option<Space> = None,
        /// For pictures.
        pub encoding: Encoding = Encoding::Auto,
        /// In `bump`, how high white stands above black, in units of the entity, 0.02 if not given; in `normal_map` a
        /// factor of the slope, 1 if not given. Negative values turn hills into hollows.
        pub depth: Option<f64> = None,
    }
}

impl Texture {
    /// Height of `bump` where `depth` is not given.
    pub const DEPTH: f64 = 0.02;

    /// The space that the texture is laid out in.
    pub fn layout(&self) -> Space {
        self.space.unwrap_or(match self.pattern {
            None | Some(Pattern::Checker | Pattern::Stripes) => Space::Uv,
            Some(Pattern::Marble | Pattern::Wood | Pattern::Noise) => Space::Object,
        })
    }

    /// The displacement of the pattern by noise.
    pub fn displacement(&self) -> f64 {
        self.turbulence.unwrap_or(match self.pattern {
            Some(Pattern::Marble) => 0.5,
            Some(Pattern::Wood) => 0.1,
            None | Some(Pattern::Checker | Pattern::Stripes | Pattern::Noise) => 0.0,
        })
    }

    /// The file of its image, with the number of the frame where a sequence of files is named. (A single `#` is a part of
    /// a name, as of an image inside of a glTF file.)
    pub fn file(&self) -> Option<Text> {
        let image = self.image.as_ref()?;
        if !image.contains("##") {
            return Some(image.clone());
        }
        let number = self.frame.unwrap_or(1.0).max(0.0).round();
        Some(numbered(image, number as u64).into())
    }

    /// What is read of its image; `coloured` says whether `Auto` stands for the sRGB curve here.
    pub fn plane(&self, coloured: bool) -> ImagePlane {
        match (self.channel, self.encoding) {
            (Channel::Alpha, _) => ImagePlane::Alpha,
            (_, Encoding::Srgb) => ImagePlane::Srgb,
            (_, Encoding::Linear) => ImagePlane::Linear,
            (_, Encoding::Auto) if coloured => ImagePlane::Srgb,
            (_, Encoding::Auto) => ImagePlane::Linear,
        }
    }
}

impl Check for Texture {
    fn check(&self) -> Result<(), Invalid> {
        let fail = |field, message: &str| Err(Invalid { field, message: message.into() });
        match (&self.image, self.pattern) {
            (Some(_), Some(_)) => return fail("pattern", "a texture has an `image` or a `pattern`, not both"),
            (None, None) => return fail("image", "a texture needs an `image` or a `pattern`"),
            (Some(_), None) if self.layout() != Space::Uv => {
                return fail("space", "an `image` is laid out by `Uv`; `Object` and `World` are for patterns");
            }
            (Some(_), None) | (None, Some(_)) => {}
        }
        let most = if self.pattern == Some(Pattern::Checker) { 2 } else { limits::PATTERN_COLORS };
        if !(2..=most).contains(&self.colors.len()) {
            let message = format!("`colors` must be from 2 to {most} colours, not {}", self.colors.len());
            return Err(Invalid { field: "colors", message });
        }
        self.colors.iter().try_for_each(|c| color("colors", *c))?;
        whole("octaves", self.octaves.into(), 1, limits::OCTAVES.into())?;
        self.turbulence.map_or(Ok(()), |x| at_least("turbulence", x, 0.0))?;
        position("scale", self.scale.0)?;
        if self.scale.0.to_array().contains(&0.0) {
            return fail("scale", "`scale` must not be 0 on any axis");
        }
        whole("uv_set", self.uv_set.into(), 0, 1)?;
        if let Some(frame) = self.frame {
            between("frame", frame, 0.0, 1e9)?;
            if !self.image.as_ref().is_some_and(|image| image.contains("##")) {
                return fail("frame", "`frame` is for an `image` whose name has `####` for its number");
            }
        }
        if self.channel == Channel::Alpha && self.image.is_none() {
            return fail("channel", "only an `image` has an alpha channel");
        }
        position("offset", self.offset.0)?;
        coordinate("rotation", self.rotation)?;
        color("tint", self.tint)?;
        self.depth.map_or(Ok(()), |x| above("depth", x.abs(), 0.0).and(coordinate("depth", x)))
    }
}

/// Textures are fields of other records too: a script reads and writes them as maps.
impl FieldValue for Texture {
    fn to_value(&self) -> Value {
        map_of(self)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let mut texture = Texture::default();
        set_from_map(&mut texture, "a texture", value)?;
        Ok(texture)
    }
}

/// A number per axis: written as one number if all are alike, as two if the third is `REST`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes<const REST: i8>(pub DVec3);

impl<const REST: i8> FieldValue for Axes<REST> {
    fn to_value(&self) -> Value {
        Value::Vec3(self.0)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        if let Some(x) = value.as_number() {
            return Ok(Axes(DVec3::splat(x)));
        }
        let two = glam::DVec2::from_value(value).map(|v| v.extend(f64::from(REST)));
        let read = two.or_else(|_| DVec3::from_value(value));
        read.map(Axes).map_err(|_| Mismatch::new("a number, or two or three of them", value))
    }
}

impl<const REST: i8> Serialize for Axes<REST> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let v = self.0;
        match v {
            _ if v == DVec3::splat(v.x) => v.x.serialize(serializer),
            _ if v.z == f64::from(REST) => v.truncate().serialize(serializer),
            _ => v.serialize(serializer),
        }
    }
}

impl<'de, const REST: i8> Deserialize<'de> for Axes<REST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AxesVisitor<const REST: i8>;
        impl<'de, const REST: i8> serde::de::Visitor<'de> for AxesVisitor<REST> {
            type Value = Axes<REST>;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number, or two or three of them")
            }
            fn visit_f64<E>(self, x: f64) -> Result<Self::Value, E> {
                Ok(Axes(DVec3::splat(x)))
            }
            fn visit_i64<E>(self, x: i64) -> Result<Self::Value, E> {
                Ok(Axes(DVec3::splat(x as f64)))
            }
            fn visit_u64<E>(self, x: u64) -> Result<Self::Value, E> {
                Ok(Axes(DVec3::splat(x as f64)))
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut axes = [f64::from(REST); 3];
                for (i, axis) in axes.iter_mut().enumerate() {
                    match seq.next_element()? {
                        Some(x) => *axis = x,
                        None if i == 2 => break,
                        None => return Err(serde::de::Error::invalid_length(i, &self)),
                    }
                }
                Ok(Axes(DVec3::from_array(axes)))
            }
        }
        deserializer.deserialize_any(AxesVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texture_needs_one_source() {
        let field = |t: &Texture| t.check().unwrap_err().field;
        let pattern = Texture { pattern: Some(Pattern::Noise), ..Texture::default() };
        assert!(pattern.check().is_ok());
        assert_eq!(field(&Texture::default()), "image");
        let image = Texture { image: Some("a.png".into()), ..Texture::default() };
        assert!(image.check().is_ok());
        assert_eq!(field(&Texture { pattern: Some(Pattern::Wood), ..image.clone() }), "pattern");
        assert_eq!(field(&Texture { space: Some(Space::World), ..image }), "space");
        assert_eq!(field(&Texture { scale: Axes(DVec3::new(1.0, 0.0, 1.0)), ..pattern.clone() }), "scale");
        assert_eq!(field(&Texture { octaves: 0, ..pattern.clone() }), "octaves");
        assert_eq!(field(&Texture { colors: vec![DVec3::ONE], ..pattern.clone() }), "colors");
        assert_eq!(field(&Texture { depth: Some(f64::NAN), ..pattern }), "depth");
    }

    #[test]
    fn a_frame_is_a_number_in_a_files_name() {
        let image = |name: &str, frame| Texture { image: Some(name.into()), frame, ..Texture::default() };
        let file = |name: &str, frame| image(name, frame).file().unwrap().to_string();
        assert_eq!(file("a.####.png", Some(12.4)), "a.0012.png");
        assert_eq!(
            (file("a.##.png", None), file("a.glb#images/3", None)),
            ("a.01.png".into(), "a.glb#images/3".into())
        );
        assert_eq!(image("a.png", Some(2.0)).check().unwrap_err().field, "frame");
        assert_eq!(image("a.##.png", Some(-1.0)).check().unwrap_err().field, "frame");
        assert!(image("a.##.png", Some(2.0)).check().is_ok());
    }

    #[test]
    fn textures_travel_as_maps() {
        let texture = Texture {
            pattern: Some(Pattern::Marble),
            scale: Axes(DVec3::new(2.0, 3.0, 1.0)),
            depth: Some(-1.0),
            ..Texture::default()
        };
        assert_eq!(Texture::from_value(&texture.to_value()), Ok(texture));
        let wrong = Value::Map(vec![("patern".into(), Value::Text("Wood".into()))]);
        let said = Texture::from_value(&wrong).unwrap_err();
        assert!(said.message.contains("`patern`") && said.help.unwrap().contains("`pattern`"));
    }

    #[test]
    fn axes_are_one_two_or_three_numbers() {
        let axes = |v: &[f64]| Axes::<1>::from_value(&Value::List(v.iter().map(|x| Value::Number(*x)).collect()));
        assert_eq!(axes(&[2.0, 3.0]), Ok(Axes(DVec3::new(2.0, 3.0, 1.0))));
        assert_eq!(axes(&[2.0, 3.0, 4.0]), Ok(Axes(DVec3::new(2.0, 3.0, 4.0))));
        assert_eq!(Axes::<0>::from_value(&Value::Int(2)), Ok(Axes(DVec3::splat(2.0))));
        assert!(axes(&[1.0]).is_err());
    }
}
