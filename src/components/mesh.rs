//! Triangle meshes: a component, and the data that entities share.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;
use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize};

use super::record::ranges::{at_least, position};
use super::record::{Check, Invalid};
use super::shapes::{Reach, Shape, support_of_box};
use super::value::{FieldValue, Mismatch, Text, Value};
use super::{FieldClass, FieldError, Record};
use crate::base::digest::{Digest, Hasher};

/// Vertices and triangles of a mesh, shared by all who use it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshData {
    /// Positions, local space.
    pub vertices: Vec<Vec3>,
    /// Corners as indices from 0, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// One shading normal per vertex, or none at all.
    pub normals: Vec<Vec3>,
    /// Texture coordinates (u, v), one per vertex, or none at all.
    pub uvs: Vec<Vec2>,
    #[serde(skip)]
    computed: Computed,
}

/// Boxes around the vertices of a mesh along each axis.
const BOXES: u8 = 12;

/// What is computed on first use; it follows from the rest and takes no part in comparisons.
#[derive(Clone, Debug, Default)]
struct Computed {
    normals: OnceLock<Vec<Vec3>>,
    digest: OnceLock<Digest>,
    boxes: OnceLock<Vec<[Vec3; 2]>>,
}

impl PartialEq for Computed {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl MeshData {
    /// A mesh without texture coordinates; `normals` are one per vertex, or none.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>, normals: Vec<Vec3>) -> Self {
        MeshData { vertices, triangles, normals, uvs: Vec::new(), computed: Computed::default() }
    }

    /// The mesh with texture coordinates.
    pub fn with_uvs(self, uvs: Vec<Vec2>) -> Self {
        MeshData { uvs, ..self }
    }

    /// The normals given, or else computed ones: one per vertex.
    pub fn shading_normals(&self) -> &[Vec3] {
        if self.normals.is_empty() {
            self.computed.normals.get_or_init(|| self.smooth_normals())
        } else {
            &self.normals
        }
    }

    /// The digest of all that the mesh is made of.
    pub fn digest(&self) -> Digest {
        *self.computed.digest.get_or_init(|| {
            let MeshData { vertices, triangles, normals, uvs, computed: _ } = self;
            let mut hasher = Hasher::default();
            for points in [vertices, normals] {
                hasher.word(points.len() as u64);
                points.iter().flat_map(|p| p.to_array()).for_each(|x| hasher.bytes(&x.to_bits().to_le_bytes()));
            }
            hasher.word(uvs.len() as u64);
            uvs.iter().flat_map(|uv| uv.to_array()).for_each(|x| hasher.bytes(&x.to_bits().to_le_bytes()));
            triangles.iter().flatten().for_each(|i| hasher.bytes(&i.to_le_bytes()));
            hasher.finish()
        })
    }

    /// Boxes around all vertices, some hundreds at most: lower and upper corners.
    pub fn boxes(&self) -> &[[Vec3; 2]] {
        self.computed.boxes.get_or_init(|| {
            let around = |vertices: &[Vec3]| {
                let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
                vertices.iter().fold(start, |[min, max], v| [min.min(*v), max.max(*v)])
            };
            let [min, max] = around(&self.vertices);
            let scale = (max - min).map(|side| if side > 0.0 { BOXES as f32 / side } else { 0.0 });
            let mut cells: BTreeMap<[u8; 3], [Vec3; 2]> = BTreeMap::new();
            for vertex in &self.vertices {
                let cell = ((*vertex - min) * scale).to_array().map(|x| (x as u8).min(BOXES - 1));
                let [low, high] = cells.entry(cell).or_insert([*vertex; 2]);
                (*low, *high) = (low.min(*vertex), high.max(*vertex));
            }
            cells.into_values().collect()
        })
    }

    /// Area-weighted vertex normals from the triangles around each vertex.
    fn smooth_normals(&self) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.vertices.len()];
        for &[a, b, c] in &self.triangles {
            let (pa, pb, pc) = (self.vertices[a as usize], self.vertices[b as usize], self.vertices[c as usize]);
            let weighted = (pb - pa).cross(pc - pa);
            for corner in [a, b, c] {
                sums[corner as usize] += weighted;
            }
        }
        if !self.uvs.is_empty() {
            self.join_seams(&mut sums);
        }
        sums.into_iter().map(|n| n.try_normalize().unwrap_or(Vec3::Y)).collect()
    }

    /// Vertices that only differ in their texture coordinates get one normal: the seam of a texture is no crease.
    fn join_seams(&self, sums: &mut [Vec3]) {
        let place = |v: &Vec3| v.to_array().map(|x| (x + 0.0).to_bits());
        let mut joined: FxHashMap<[u32; 3], Vec3> = FxHashMap::default();
        for (v, sum) in self.vertices.iter().zip(sums.iter()) {
            *joined.entry(place(v)).or_default() += *sum;
        }
        for (v, sum) in self.vertices.iter().zip(sums) {
            *sum = joined[&place(v)];
        }
    }
}

/// An indexed triangle mesh, from a file or written out.
///
/// Texture coordinates are those of its vertices; a mesh without them is wrapped like a sphere around the middle of its
/// bounds, in local space.
///
/// In a scene: `mesh: (file: "bunny.obj", smooth: true)` or
/// `mesh: (vertices: [(0, 0, 0), ...], triangles: [(0, 1, 2), ...])`. The loader fills `data` from `file`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// OBJ or PLY file, relative to the scene; `None` when the mesh is written out.
    pub file: Option<Text>,
    /// Whether missing vertex normals are computed from the triangles around each vertex.
    pub smooth: bool,
    /// What it is made of, wherever that is from.
    pub data: Arc<MeshData>,
}

impl Mesh {
    /// Field names in declared order.
    pub const FIELDS: &'static [&'static str] = &["file", "smooth", "vertices", "triangles", "normals", "uvs"];
    /// The class of each field: `smooth` is about the shading of the data, all else is the data.
    pub const CLASSES: &'static [FieldClass] = &{
        let mut classes = [FieldClass::Data; Self::FIELDS.len()];
        classes[1] = FieldClass::General;
        classes
    };

    fn edit(&mut self) -> &mut MeshData {
        let data = Arc::make_mut(&mut self.data);
        data.computed = Computed::default();
        data
    }
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        let same_data = Arc::ptr_eq(&self.data, &other.data) || self.data == other.data;
        self.file == other.file && self.smooth == other.smooth && same_data
    }
}

impl Record for Mesh {
    fn fields(&self) -> &'static [&'static str] {
        Self::FIELDS
    }
    fn classes(&self) -> &'static [FieldClass] {
        Self::CLASSES
    }
    fn get(&self, field: &str) -> Option<Value> {
        match field {
            "file" => Some(self.file.to_value()),
            "smooth" => Some(self.smooth.to_value()),
            "vertices" => Some(self.data.vertices.to_value()),
            "normals" => Some(self.data.normals.to_value()),
            "triangles" => Some(self.data.triangles.to_value()),
            "uvs" => Some(self.data.uvs.to_value()),
            _ => None,
        }
    }
    fn set(&mut self, field: &str, value: &Value) -> Result<(), FieldError> {
        let wrong = FieldError::Mismatch;
        match field {
            "file" => {
                let message = "`file` of a mesh is read when the scene is loaded and cannot be set by a script".into();
                return Err(wrong(Mismatch { message, help: Some("name it in the scene".into()) }));
            }
            "smooth" => self.smooth = bool::from_value(value).map_err(wrong)?,
            "vertices" => self.edit().vertices = Vec::from_value(value).map_err(wrong)?,
            "normals" => self.edit().normals = Vec::from_value(value).map_err(wrong)?,
            "triangles" => self.edit().triangles = Vec::from_value(value).map_err(wrong)?,
            "uvs" => self.edit().uvs = Vec::from_value(value).map_err(wrong)?,
            _ => return Err(FieldError::Unknown { known: Self::FIELDS }),
        }
        if field != "smooth" {
            self.file = None;
        }
        Ok(())
    }
}

impl Check for Mesh {
    fn check(&self) -> Result<(), Invalid> {
        let data = &self.data;
        data.vertices.iter().try_for_each(|v| position("vertices", v.as_dvec3()))?;
        data.normals.iter().try_for_each(|n| position("normals", n.as_dvec3()))?;
        let count = data.vertices.len();
        if let Some(index) = data.triangles.iter().flatten().find(|i| **i as usize >= count) {
            let message = format!("vertex {index} of `triangles` does not exist; there are {count}, numbered from 0");
            return Err(Invalid { field: "triangles", message });
        }
        if !data.normals.is_empty() && data.normals.len() != count {
            let message = format!("{} normals for {count} vertices: one each, or none", data.normals.len());
            return Err(Invalid { field: "normals", message });
        }
        data.uvs.iter().try_for_each(|t| position("uvs", t.as_dvec2().extend(0.0)))?;
        if !data.uvs.is_empty() && data.uvs.len() != count {
            let message = format!("{} texture coordinates for {count} vertices: one each, or none", data.uvs.len());
            return Err(Invalid { field: "uvs", message });
        }
        at_least("vertices", count as f64, 0.0)
    }
}

impl Shape for Mesh {
    fn reach(&self) -> Reach {
        if self.data.vertices.is_empty() { Reach::Empty } else { Reach::Finite }
    }
    fn support(&self, direction: DVec3) -> f64 {
        let of_box = |corners: &[Vec3; 2]| support_of_box(corners.map(|corner| corner.as_dvec3()), direction);
        self.data.boxes().iter().map(of_box).fold(f64::NEG_INFINITY, f64::max)
    }
    fn primitive_count(&self) -> usize {
        self.data.triangles.len()
    }
}

/// The written form of a mesh.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Mesh")]
#[derive(Default)]
struct MeshForm {
    file: Option<Text>,
    smooth: bool,
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
}

impl<'de> Deserialize<'de> for Mesh {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let form = MeshForm::deserialize(deserializer)?;
        let MeshForm { file, smooth, vertices, triangles, normals, uvs } = form;
        Ok(Mesh { file, smooth, data: Arc::new(MeshData::new(vertices, triangles, normals).with_uvs(uvs)) })
    }
}

impl Serialize for Mesh {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let inline = self.file.is_none();
        let normals = inline && !self.data.normals.is_empty();
        let uvs = inline && !self.data.uvs.is_empty();
        let count = 1 + [self.smooth, inline, normals, uvs].map(usize::from).iter().sum::<usize>();
        let mut out = serializer.serialize_struct("Mesh", count)?;
        if let Some(file) = &self.file {
            out.serialize_field("file", file)?;
        }
        if self.smooth {
            out.serialize_field("smooth", &true)?;
        }
        if inline {
            out.serialize_field("vertices", &self.data.vertices)?;
            out.serialize_field("triangles", &self.data.triangles)?;
        }
        if normals {
            out.serialize_field("normals", &self.data.normals)?;
        }
        if uvs {
            out.serialize_field("uvs", &self.data.uvs)?;
        }
        out.end()
    }
}
