//! Materials of a glTF file -> `Principled` ones.

use std::path::Path;

use glam::DVec3;
use serde::Deserialize;

use super::document::{Document, at, field, relative};
use super::json::{Extensions, Index, MaterialJson, TextureInfoJson, extension};
use super::warnings::Warnings;
use crate::base::math::sin_cos_degrees;
use crate::components::*;
use crate::load::resolve::Problem;
use crate::load::spans::Step;

/// Extensions of materials that are read.
pub const READ: [&str; 6] = [
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_specular",
    "KHR_materials_unlit",
];

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct StrengthJson {
    emissive_strength: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct IorJson {
    ior: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct TransmissionJson {
    transmission_factor: f64,
    transmission_texture: Option<TextureInfoJson>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct VolumeJson {
    thickness_factor: f64,
    thickness_texture: Option<TextureInfoJson>,
    attenuation_distance: Option<f64>,
    attenuation_color: Option<[f64; 3]>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpecularJson {
    specular_factor: Option<f64>,
    specular_texture: Option<TextureInfoJson>,
    specular_color_factor: Option<[f64; 3]>,
    specular_color_texture: Option<TextureInfoJson>,
}

#[derive(Deserialize)]
struct UnlitJson {}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct TextureTransformJson {
    offset: Option<[f64; 2]>,
    rotation: Option<f64>,
    scale: Option<[f64; 2]>,
    tex_coord: Option<Index>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct SourceJson {
    source: Option<Index>,
}

/// Other places that a texture may have its picture from, in the order in which they are tried.
const SOURCES: [&str; 1] = ["EXT_texture_webp"];

/// What a material is read with.
pub struct MaterialReader<'a> {
    pub document: &'a Document,
    /// The file as the scene names it.
    pub file: &'a str,
    pub warnings: &'a mut Warnings,
}

impl MaterialReader<'_> {
    /// What meshes without a material are made of: white metal, as rough as can be.
    pub fn plain() -> Material {
        Material {
            model: Model::Principled,
            color: DVec3::ONE,
            metallic: 1.0,
            roughness: 1.0,
            two_sided: false,
            ..Material::default()
        }
    }

    /// The material of a number.
    ///
    /// # Errors
    /// Values out of range, textures that do not exist.
    pub fn material(&mut self, index: usize) -> Result<Material, Problem> {
        let path = at("materials", index);
        let json = &self.document.root.materials[index];
        let pbr = &json.pbr_metallic_roughness;
        let [r, g, b, alpha] = pbr.base_color_factor.unwrap_or([1.0; 4]);
        let mut material = Material {
            model: Model::Principled,
            color: DVec3::new(r, g, b).clamp(DVec3::ZERO, DVec3::ONE),
            metallic: pbr.metallic_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            roughness: pbr.roughness_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            emission: json.emissive_factor.map_or(DVec3::ZERO, DVec3::from_array).max(DVec3::ZERO),
            two_sided: json.double_sided,
            ..Material::default()
        };
        let slot = |name: &str| field(path.clone(), name);
        material.color_map =
            self.texture(pbr.base_color_texture.as_ref(), Channel::Color, &slot("pbrMetallicRoughness"))?;
        self.opacity(json, pbr.base_color_texture.as_ref(), alpha, &mut material, &path)?;
        let metal = pbr.metallic_roughness_texture.as_ref();
        if material.metallic > 0.0 {
            material.metallic_map = self.texture(metal, Channel::Blue, &slot("pbrMetallicRoughness"))?;
        }
        if material.roughness > 0.0 {
            material.roughness_map = self.texture(metal, Channel::Green, &slot("pbrMetallicRoughness"))?;
        }
        if let Some(info) = &json.normal_texture {
            let scale = info.scale.unwrap_or(1.0);
            let map = self.texture(Some(info), Channel::Color, &slot("normalTexture"))?;
            let depth = (scale != 1.0).then_some(scale);
            material.normal_map = map.filter(|_| scale != 0.0).map(|map| Box::new(Texture { depth, ..*map }));
        }
        if json.occlusion_texture.is_some() {
            self.warnings.add("occlusion", || {
                let message = "the occlusion texture is not used: corners are darkened by the light that is traced";
                Problem::new(slot("occlusionTexture"), message)
            });
        }
        if material.emission != DVec3::ZERO {
            material.emission_map =
                self.texture(json.emissive_texture.as_ref(), Channel::Color, &slot("emissiveTexture"))?;
        }
        self.extensions(&json.extensions, &mut material, &path)?;
        match material.check() {
            Ok(()) => Ok(material),
            Err(invalid) => Err(Problem::new(path, invalid.message)),
        }
    }

    fn opacity(
        &mut self,
        json: &MaterialJson,
        info: Option<&TextureInfoJson>,
        alpha: f64,
        material: &mut Material,
        path: &[Step],
    ) -> Result<(), Problem> {
        match json.alpha_mode.as_deref().unwrap_or("OPAQUE") {
            "OPAQUE" => return Ok(()),
            "MASK" => material.opacity_cutoff = Some(json.alpha_cutoff.unwrap_or(0.5).clamp(0.0, 1.0)),
            "BLEND" => {}
            other => {
                let message = format!("unknown alpha mode `{other}`; known: OPAQUE, MASK, BLEND");
                return Err(Problem::new(field(path.to_vec(), "alphaMode"), message));
            }
        }
        material.opacity = alpha.clamp(0.0, 1.0);
        material.vertex_opacity = true;
        material.opacity_map = self.texture(info, Channel::Alpha, &field(path.to_vec(), "pbrMetallicRoughness"))?;
        Ok(())
    }

    fn extensions(&mut self, all: &Extensions, material: &mut Material, path: &[Step]) -> Result<(), Problem> {
        let path = field(path.to_vec(), "extensions");
        let wrong = |m: String| Problem::new(path.clone(), m);
        let slot = |name: &str| field(path.clone(), name);
        if let Some(StrengthJson { emissive_strength: Some(strength) }) = extension(all, READ[0]).map_err(wrong)? {
            material.emission *= strength.max(0.0);
        }
        if let Some(IorJson { ior: Some(ior) }) = extension(all, READ[1]).map_err(wrong)? {
            material.ior = Some(ior);
        }
        let volume: Option<VolumeJson> = extension(all, READ[3]).map_err(wrong)?;
        if let Some(TransmissionJson { transmission_factor, transmission_texture }) =
            extension(all, READ[2]).map_err(wrong)?
        {
            material.transmission = transmission_factor.clamp(0.0, 1.0);
            if material.transmission > 0.0 {
                material.transmission_map =
                    self.texture(transmission_texture.as_ref(), Channel::Red, &slot(READ[2]))?;
            }
            material.thin = volume.as_ref().is_none_or(|volume| volume.thickness_factor <= 0.0);
        }
        if let Some(volume) = volume.filter(|volume| volume.thickness_factor > 0.0) {
            self.volume(&volume, material, &slot(READ[3]));
        }
        if let Some(specular) = extension::<SpecularJson>(all, READ[4]).map_err(wrong)? {
            material.reflection = specular.specular_factor.map(|s| s.clamp(0.0, 1.0));
            let color = specular.specular_color_factor.map_or(DVec3::ONE, DVec3::from_array);
            material.specular_color = color.max(DVec3::ZERO);
            material.specular_map =
                self.texture(specular.specular_color_texture.as_ref(), Channel::Color, &slot(READ[4]))?;
            material.reflection_map =
                self.texture(specular.specular_texture.as_ref(), Channel::Alpha, &slot(READ[4]))?;
        }
        if extension::<UnlitJson>(all, READ[5]).map_err(wrong)?.is_some() {
            material.model = Model::Unlit;
        }
        for name in all.keys().filter(|name| !READ.contains(&name.as_str())) {
            self.warnings.add(name, || Problem::new(slot(name), format!("`{name}` is not used")));
        }
        Ok(())
    }

    /// What the inside of a body swallows: after the distance the colour is left.
    fn volume(&mut self, volume: &VolumeJson, material: &mut Material, path: &[Step]) {
        let distance = volume.attenuation_distance.filter(|d| *d > 0.0 && d.is_finite());
        if let (Some(distance), Some(color)) = (distance, volume.attenuation_color) {
            // What lets nothing through lets the 1e-6th part through: its logarithm is a number.
            let left = DVec3::from_array(color).clamp(DVec3::splat(1e-6), DVec3::ONE);
            material.absorption = left.map(|c| -libm::log(c) / distance) + DVec3::ZERO;
        }
        if volume.thickness_texture.is_some() {
            self.warnings.add("thickness", || {
                let message = "the thickness texture is not used: how thick a body is follows from its shape";
                Problem::new(path.to_vec(), message)
            });
        }
    }

    /// The texture that a material uses, one channel of it, if its picture can be had.
    fn texture(
        &mut self,
        info: Option<&TextureInfoJson>,
        channel: Channel,
        path: &[Step],
    ) -> Result<Option<Box<Texture>>, Problem> {
        let Some((info, Index(index))) = info.and_then(|info| Some((info, info.index?))) else { return Ok(None) };
        let document = self.document;
        let Some(texture) = document.root.textures.get(index) else {
            let count = document.root.textures.len();
            return Err(Problem::new(path.to_vec(), format!("there is no texture {index}; there are {count}")));
        };
        let mut source = None;
        for name in SOURCES {
            let found: Option<SourceJson> =
                extension(&texture.extensions, name).map_err(|m| Problem::new(at("textures", index), m))?;
            source = source.or(found.and_then(|found| found.source));
        }
        let Some(Index(image)) = source.or(texture.source) else {
            let kinds: Vec<&str> = texture.extensions.keys().map(String::as_str).collect();
            let what =
                if kinds.is_empty() { "it has no picture".into() } else { format!("{} is not read", kinds.join(", ")) };
            self.warnings.add(&format!("texture {what}"), || {
                Problem::new(at("textures", index), format!("a texture is not used: {what}"))
            });
            return Ok(None);
        };
        let image = self.image(image)?;
        let sampler = texture.sampler.and_then(|s| document.root.samplers.get(s.0)).cloned().unwrap_or_default();
        let wrap = |code: Option<Index>| match code.map_or(10497, |c| c.0) {
            33071 => Wrap::Clamp,
            33648 => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let (wrap, wrap_v) = (wrap(sampler.wrap_s), wrap(sampler.wrap_t));
        let nearest = sampler.mag_filter.is_some_and(|f| f.0 == 9728);
        let filter = if nearest { TexelFilter::Nearest } else { TexelFilter::Mip };
        let mut read = Texture {
            image: Some(image),
            wrap,
            wrap_v: (wrap_v != wrap).then_some(wrap_v),
            filter,
            channel,
            uv_set: info.tex_coord.0 as u32,
            ..Texture::default()
        };
        let moved: Option<TextureTransformJson> =
            extension(&info.extensions, "KHR_texture_transform").map_err(|m| Problem::new(path.to_vec(), m))?;
        if let Some(moved) = moved {
            place(&mut read, &moved);
        }
        if read.uv_set > 1 {
            let set = read.uv_set;
            self.warnings.add("texture coordinates", || {
                Problem::new(
                    path.to_vec(),
                    format!("texture coordinates {set} are not read, only 0 and 1; those of 0 are used"),
                )
            });
            read.uv_set = 0;
        }
        match read.check() {
            Ok(()) => Ok(Some(Box::new(read))),
            Err(invalid) => Err(Problem::new(path.to_vec(), invalid.message)),
        }
    }

    /// What a scene calls an image of the file: its own name beside it, or its number inside of it.
    fn image(&self, index: usize) -> Result<Text, Problem> {
        let path = at("images", index);
        let Some(image) = self.document.root.images.get(index) else {
            let count = self.document.root.images.len();
            return Err(Problem::new(path, format!("there is no image {index}; there are {count}")));
        };
        match image.uri.as_deref().filter(|uri| !uri.starts_with("data:")) {
            Some(uri) => {
                let relative = relative(uri);
                let relative = relative.map_err(|(message, help)| Problem::new(path, message).help(help))?;
                let folder = Path::new(self.file).parent().unwrap_or(Path::new(""));
                Ok(folder.join(relative).to_string_lossy().replace('\\', "/").into())
            }
            None => Ok(format!("{}#images/{index}", self.file).into()),
        }
    }
}

/// Lays a texture out as KHR_texture_transform says it.
///
/// There a point (u, v), v from the top row down, shows what the picture has at (c s u + n t v + x, c t v - n s u + y)
/// for a scale (s, t), an offset (x, y), and the cosine c and sine n of the rotation; so read it all known programs, though
/// the matrix in the text of the extension turns the other way. Here v runs upwards.
fn place(texture: &mut Texture, moved: &TextureTransformJson) {
    let [x, y] = moved.offset.unwrap_or_default();
    let [s, t] = moved.scale.unwrap_or([1.0; 2]);
    let degrees = moved.rotation.unwrap_or(0.0).to_degrees();
    let (sin, cos) = sin_cos_degrees(degrees);
    texture.scale = Axes(DVec3::new(s, t, 1.0));
    texture.rotation = degrees;
    texture.offset = Axes(DVec3::new(x + sin * t, 1.0 - y - cos * t, 0.0));
    if let Some(Index(set)) = moved.tex_coord {
        texture.uv_set = set as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of the square that a texture shows, by the arithmetic of the scene.
    fn shown(texture: &Texture, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = sin_cos_degrees(texture.rotation);
        let (x, y) = (u * texture.scale.0.x, v * texture.scale.0.y);
        [cos * x - sin * y + texture.offset.0.x, sin * x + cos * y + texture.offset.0.y]
    }

    #[test]
    fn texture_transforms_are_laid_out_as_they_are_meant() {
        let moved = TextureTransformJson {
            offset: Some([0.1, 0.7]),
            rotation: Some(0.4),
            scale: Some([2.0, -0.5]),
            tex_coord: Some(Index(1)),
        };
        let mut texture = Texture::default();
        place(&mut texture, &moved);
        let (n, c) = (libm::sin(0.4), libm::cos(0.4));
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.3, 0.8]] {
            let theirs = [c * 2.0 * u + n * -0.5 * v + 0.1, c * -0.5 * v - n * 2.0 * u + 0.7];
            let ours = shown(&texture, [u, 1.0 - v]);
            assert!((ours[0] - theirs[0]).abs() < 1e-12 && (ours[1] - (1.0 - theirs[1])).abs() < 1e-12, "{u} {v}");
        }
        assert_eq!(texture.uv_set, 1);
        // The example of the extension that turns the picture upside down.
        let flipped = TextureTransformJson { offset: Some([0.0, 1.0]), scale: Some([1.0, -1.0]), ..Default::default() };
        place(&mut texture, &flipped);
        assert_eq!(shown(&texture, [0.25, 0.25]), [0.25, 0.75]);
    }
}
