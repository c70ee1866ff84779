//! The JSON of a glTF 2.0 file as plain structs; what the program does not look at is passed over.
//!
//! Numbers are not judged here: every index is checked where it is followed.

use serde::de::{DeserializeOwned, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};

/// An index or a count: a whole number, also where it is written as `3.0`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Index(pub usize);

impl<'de> Deserialize<'de> for Index {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Whole;
        impl Visitor<'_> for Whole {
            type Value = Index;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a whole number from 0")
            }
            fn visit_u64<E: serde::de::Error>(self, x: u64) -> Result<Index, E> {
                usize::try_from(x).map(Index).map_err(|_| E::custom("the number is too large"))
            }
            fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<Index, E> {
                usize::try_from(x).map(Index).map_err(|_| E::custom("expected a whole number from 0"))
            }
            fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<Index, E> {
                let whole = x == x.trunc() && (0.0..9e15).contains(&x);
                if whole { Ok(Index(x as usize)) } else { Err(E::custom("expected a whole number from 0")) }
            }
        }
        deserializer.deserialize_any(Whole)
    }
}

/// Extension objects by name.
pub type Extensions = Map<String, Value>;

/// Reads an extension object of a known form; `None` if it is not there.
///
/// # Errors
/// What is wrong with its form.
pub fn extension<T: DeserializeOwned>(all: &Extensions, name: &str) -> Result<Option<T>, String> {
    let Some(value) = all.get(name) else { return Ok(None) };
    T::deserialize(value).map(Some).map_err(|e| format!("`{name}`: {e}"))
}

macro_rules! json {
    ($(#[$meta:meta])* $name:ident { $( $(#[$field_meta:meta])* $field:ident : $type:ty ),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, Default, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        pub struct $name { $( $(#[$field_meta])* pub $field: $type, )* }
    };
}

json! {
    /// The whole of it.
    RootJson {
        asset: AssetJson,
        scene: Option<Index>,
        scenes: Vec<SceneJson>,
        nodes: Vec<NodeJson>,
        meshes: Vec<MeshJson>,
        materials: Vec<MaterialJson>,
        textures: Vec<TextureJson>,
        images: Vec<ImageJson>,
        samplers: Vec<SamplerJson>,
        accessors: Vec<AccessorJson>,
        buffer_views: Vec<ViewJson>,
        buffers: Vec<BufferJson>,
        skins: Vec<SkinJson>,
        cameras: Vec<CameraJson>,
        animations: Vec<AnimationJson>,
        extensions_used: Vec<String>,
        extensions_required: Vec<String>,
        extensions: Extensions,
    }
}

json! {
    AssetJson { version: String, min_version: Option<String>, generator: Option<String> }
}

json! {
    /// What files of every version have.
    VersionJson { asset: Extensions, meshes: Value }
}

json! {
    SceneJson { name: Option<String>, nodes: Vec<Index> }
}

json! {
    NodeJson {
        name: Option<String>,
        children: Vec<Index>,
        matrix: Option<[f64; 16]>,
        translation: Option<[f64; 3]>,
        rotation: Option<[f64; 4]>,
        scale: Option<[f64; 3]>,
        mesh: Option<Index>,
        skin: Option<Index>,
        camera: Option<Index>,
        weights: Vec<f64>,
        extensions: Extensions,
    }
}

json! {
    MeshJson { name: Option<String>, primitives: Vec<PrimitiveJson>, weights: Vec<f64>, extras: Value }
}

json! {
    PrimitiveJson {
        attributes: Map<String, Value>,
        indices: Option<Index>,
        material: Option<Index>,
        mode: Option<Index>,
        targets: Vec<Map<String, Value>>,
        extensions: Extensions,
    }
}

json! {
    MaterialJson {
        name: Option<String>,
        pbr_metallic_roughness: MetallicRoughnessJson,
        normal_texture: Option<TextureInfoJson>,
        occlusion_texture: Option<TextureInfoJson>,
        emissive_texture: Option<TextureInfoJson>,
        emissive_factor: Option<[f64; 3]>,
        alpha_mode: Option<String>,
        alpha_cutoff: Option<f64>,
        double_sided: bool,
        extensions: Extensions,
    }
}

json! {
    MetallicRoughnessJson {
        base_color_factor: Option<[f64; 4]>,
        base_color_texture: Option<TextureInfoJson>,
        metallic_factor: Option<f64>,
        roughness_factor: Option<f64>,
        metallic_roughness_texture: Option<TextureInfoJson>,
    }
}

json! {
    /// A use of a texture; `scale` is that of normal textures, `strength` that of occlusion.
    TextureInfoJson {
        index: Option<Index>,
        tex_coord: Index,
        scale: Option<f64>,
        strength: Option<f64>,
        extensions: Extensions,
    }
}

json! {
    TextureJson { sampler: Option<Index>, source: Option<Index>, extensions: Extensions }
}

json! {
    ImageJson { name: Option<String>, uri: Option<String>, mime_type: Option<String>, buffer_view: Option<Index> }
}

json! {
    SamplerJson {
        mag_filter: Option<Index>,
        min_filter: Option<Index>,
        wrap_s: Option<Index>,
        wrap_t: Option<Index>,
    }
}

json! {
    AccessorJson {
        buffer_view: Option<Index>,
        byte_offset: Index,
        component_type: Index,
        normalized: bool,
        count: Index,
        #[serde(rename = "type")]
        shape: String,
        sparse: Option<SparseJson>,
    }
}

json! {
    SparseJson { count: Index, indices: SparseIndicesJson, values: SparseValuesJson }
}

json! {
    SparseIndicesJson { buffer_view: Index, byte_offset: Index, component_type: Index }
}

json! {
    SparseValuesJson { buffer_view: Index, byte_offset: Index }
}

json! {
    ViewJson {
        buffer: Index,
        byte_offset: Index,
        byte_length: Index,
        byte_stride: Option<Index>,
        extensions: Extensions,
    }
}

json! {
    BufferJson { uri: Option<String>, byte_length: Index }
}

json! {
    SkinJson { name: Option<String>, joints: Vec<Index>, inverse_bind_matrices: Option<Index> }
}

json! {
    CameraJson {
        name: Option<String>,
        #[serde(rename = "type")]
        projection: String,
        perspective: PerspectiveJson,
        orthographic: OrthographicJson,
    }
}

json! {
    PerspectiveJson { yfov: Option<f64> }
}

json! {
    OrthographicJson { ymag: Option<f64> }
}

json! {
    AnimationJson { name: Option<String>, channels: Vec<ChannelJson>, samplers: Vec<KeysJson> }
}

json! {
    ChannelJson { sampler: Index, target: TargetJson }
}

json! {
    TargetJson { node: Option<Index>, path: String, extensions: Extensions }
}

json! {
    KeysJson { input: Index, output: Index, interpolation: Option<String> }
}

/// The accessor that an attribute of a primitive names, if it is there.
///
/// # Errors
/// A value that is no index.
pub fn attribute(all: &Map<String, Value>, name: &str) -> Result<Option<usize>, String> {
    let Some(value) = all.get(name) else { return Ok(None) };
    let index = Index::deserialize(value).map(|i| Some(i.0));
    index.map_err(|_| format!("attribute `{name}` must be the number of an accessor"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_may_be_written_with_a_point() {
        let read = |text: &str| serde_json::from_str::<Index>(text).ok().map(|i| i.0);
        assert_eq!([read("3"), read("3.0"), read("0")], [Some(3), Some(3), Some(0)]);
        assert_eq!([read("-1"), read("2.5"), read("1e300"), read("\"3\"")], [None; 4]);
    }

    #[test]
    fn what_is_left_out_has_the_defaults_of_the_format() {
        let root: RootJson = serde_json::from_str(r#"{"asset": {"version": "2.0"}, "extra": [1]}"#).unwrap();
        assert!(root.nodes.is_empty() && root.scene.is_none());
        let material: MaterialJson = serde_json::from_str("{}").unwrap();
        assert!(!material.double_sided && material.pbr_metallic_roughness.metallic_factor.is_none());
    }
}
