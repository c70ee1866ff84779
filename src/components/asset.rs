//! The component `asset`: a file whose nodes are entities below this one.

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::record::{Check, Invalid};
use super::value::{FieldValue, Mismatch, Text, Value};
use super::{Clip, EntityDesc, FieldClass, FieldError, Material, Record};
use crate::base::digest::Digest;

/// A node of an asset, before it stands below an entity.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetNode {
    /// What it is called below the entity.
    pub name: Text,
    /// Its parent's place among the nodes, before its own; the entity itself for `None`.
    pub parent: Option<usize>,
    /// All but its name; joints of skins are named as nodes are.
    pub desc: EntityDesc,
}

/// What an asset holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AssetData {
    /// Named motion of its nodes.
    pub clips: Vec<Clip>,
    /// Parents before their children.
    pub nodes: Vec<AssetNode>,
    /// Under the names that they have in a scene.
    pub materials: Vec<(Text, Material)>,
    /// Of all the above.
    pub digest: Digest,
}

/// A file that holds entities: glTF (`.gltf`, `.glb`), or OBJ with its groups.
///
/// Each of its nodes is an entity below this one, called `name/node`, with its transform, mesh, light or skin. An entity
/// of the scene with such a name takes the place of what it gives: its components stand instead of those of the node.
/// Likewise a material of the scene that is called as one of the file, `file/material`, the ending left out. A script
/// plays the clips of the file: `s.get("robot").play("Walk", f.seconds)`.
#[derive(Clone, Debug, Default)]
pub struct Asset {
    /// The file, relative to the scene.
    pub file: Text,
    /// Name or number (from 0) of the one scene of the file that is shown; the file's own choice without it.
    pub scene: Option<Text>,
    /// Nodes that are left out, with all below them.
    pub without: Vec<Text>,
    /// Filled by the loader.
    pub data: Arc<AssetData>,
}

impl Asset {
    /// The fields that a scene may give.
    pub const FIELDS: &'static [&'static str] = &["file", "scene", "without"];

    /// A clip by its name.
    pub fn clip(&self, name: &str) -> Option<&Clip> {
        self.data.clips.iter().find(|clip| &*clip.name == name)
    }
}

impl PartialEq for Asset {
    fn eq(&self, other: &Self) -> bool {
        let same_data = Arc::ptr_eq(&self.data, &other.data) || self.data.digest == other.data.digest;
        (&self.file, &self.scene, &self.without) == (&other.file, &other.scene, &other.without) && same_data
    }
}

impl Record for Asset {
    fn fields(&self) -> &'static [&'static str] {
        Self::FIELDS
    }
    fn classes(&self) -> &'static [FieldClass] {
        &[FieldClass::Data; Asset::FIELDS.len()]
    }
    fn get(&self, field: &str) -> Option<Value> {
        match field {
            "file" => Some(self.file.to_value()),
            "scene" => Some(self.scene.to_value()),
            "without" => Some(self.without.to_value()),
            _ => None,
        }
    }
    fn set(&mut self, field: &str, _: &Value) -> Result<(), FieldError> {
        if !Self::FIELDS.contains(&field) {
            return Err(FieldError::Unknown { known: Self::FIELDS });
        }
        let message = format!("`{field}` of an asset is read when the scene is loaded and cannot be set by a script");
        Err(FieldError::Mismatch(Mismatch { message, help: Some("write the asset in the scene".into()) }))
    }
    fn probe(&self, field: &str, value: &Value) -> Result<(), FieldError> {
        let shape = match field {
            "file" => Text::from_value(value).map(drop),
            "scene" => Option::<Text>::from_value(value).map(drop),
            "without" => Vec::<Text>::from_value(value).map(drop),
            _ => return Err(FieldError::Unknown { known: Self::FIELDS }),
        };
        shape.map_err(FieldError::Mismatch)
    }
    fn docs(&self) -> &'static str {
        "A file that holds entities: glTF (`.gltf`, `.glb`), OBJ with its groups, or AFF. Each of its nodes is an entity \
         below this one, called `name/node`, with its transform, mesh, light or skin. An entity of the scene with such a \
         name takes the place of what it gives: its components stand instead of those of the node. Likewise a material of \
         the scene that is called as one of the file, `file/material`, the ending left out. A script plays the clips of \
         the file: `s.get(\"robot\").play(\"Walk\", f.seconds)`."
    }
    fn field_docs(&self) -> &'static [&'static str] {
        &[
            "The file, relative to the scene.",
            "Name or number (from 0) of the one scene of a glTF file that is shown; the file's own choice without it.",
            "Nodes that are left out, with all below them.",
        ]
    }
}

impl Check for Asset {
    fn check(&self) -> Result<(), Invalid> {
        if self.file.is_empty() {
            return Err(Invalid { field: "file", message: "an asset needs a `file`".into() });
        }
        Ok(())
    }
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Asset")]
struct AssetForm {
    file: Text,
    scene: Option<Text>,
    without: Vec<Text>,
}

impl<'de> Deserialize<'de> for Asset {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let AssetForm { file, scene, without } = AssetForm::deserialize(deserializer)?;
        Ok(Asset { file, scene, without, data: Arc::default() })
    }
}

impl Serialize for Asset {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct;
        let Asset { file, scene, without, data: _ } = self;
        let count = 1 + usize::from(scene.is_some()) + usize::from(!without.is_empty());
        let mut out = serializer.serialize_struct("Asset", count)?;
        out.serialize_field("file", file)?;
        if let Some(scene) = scene {
            out.serialize_field("scene", scene)?;
        }
        if !without.is_empty() {
            out.serialize_field("without", without)?;
        }
        out.end()
    }
}
