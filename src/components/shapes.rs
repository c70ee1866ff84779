//! Shapes: plain numbers in the local space of their entity.
//!
//! A shape stands where its fields put it; the entity's transform, if any, then carries it into the world. Lengths are
//! world units before that transform.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;
use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize};

use super::record::ranges::{at_least, coordinate, direction, position};
use super::record::{Check, Invalid, record};
use super::value::{FieldValue, Mismatch, Text, Value};
use super::{FieldError, Record};
use crate::base::digest::{Digest, Hasher};

record! {
    /// A sphere.
    ///
    /// Texture coordinates, in local space: u is the angle around y as a share of a turn, to the east (from +z towards
    /// +x), with 0.5 at +z, so that the seam is at -z; v is the angle from -y (0) to +y (1).
    pub struct Sphere {
        /// Centre, local space.
        pub center: DVec3 = DVec3::ZERO,
        /// Radius, not 0; a negative one shows the inside only (as NFF has it).
        pub radius: f64 = 1.0,
    }
}

impl Check for Sphere {
    fn check(&self) -> Result<(), Invalid> {
        position("center", self.center)?;
        nonzero("radius", self.radius)
    }
}

fn nonzero(field: &'static str, x: f64) -> Result<(), Invalid> {
    coordinate(field, x)?;
    if x == 0.0 { Err(Invalid { field, message: format!("`{field}` must not be 0") }) } else { Ok(()) }
}

record! {
    /// One triangle, counter-clockwise seen from its front.
    pub struct Triangle {
        /// Corners, local space.
        pub vertices: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y],
        /// Shading normals at the corners, of any length; flat without them.
        pub normals: Option<Box<[DVec3; 3]>> = None,
        /// Texture coordinates (u, v) at the corners; (0, 0), (1, 0), (0, 1) without them.
        pub uvs: Option<Box<[DVec2; 3]>> = None,
    }
}

impl Check for Triangle {
    fn check(&self) -> Result<(), Invalid> {
        self.vertices.iter().try_for_each(|v| position("vertices", *v))?;
        self.normals.iter().flat_map(|n| n.iter()).try_for_each(|n| position("normals", *n))?;
        self.uvs.iter().flat_map(|t| t.iter()).try_for_each(|t| position("uvs", t.extend(0.0)))
    }
}

record! {
    /// An infinite plane.
    ///
    /// Texture coordinates: local units from `point`, v upwards (towards local +y) and u to the right of it seen from
    /// the front; on a floor u runs along +x and v along -z.
    pub struct Plane {
        /// Any point of it, local space.
        pub point: DVec3 = DVec3::ZERO,
        /// Its front side, of any length but 0.
        pub normal: DVec3 = DVec3::Y,
    }
}

impl Check for Plane {
    fn check(&self) -> Result<(), Invalid> {
        position("point", self.point)?;
        direction("normal", self.normal)
    }
}

record! {
    /// A solid box along the local axes.
    ///
    /// Texture coordinates run from 0 to 1 over each face: on the sides u to the right seen from outside and v along +y,
    /// on top u along +x and v along -z, at the bottom u along +x and v along +z.
    pub struct AABox {
        /// Lower corner, local space.
        pub min: DVec3 = DVec3::splat(-0.5),
        /// Upper corner, local space; not below `min` on any axis.
        pub max: DVec3 = DVec3::splat(0.5),
    }
}

impl Check for AABox {
    fn check(&self) -> Result<(), Invalid> {
        position("min", self.min)?;
        position("max", self.max)?;
        if self.min.cmple(self.max).all() {
            return Ok(());
        }
        let message = format!("`max` {} must not be below `min` {} on any axis", self.max, self.min);
        Err(Invalid { field: "max", message })
    }
}

record! {
    /// A cylinder between two points.
    ///
    /// Texture coordinates as those of a [`Cone`].
    pub struct Cylinder {
        /// Centre of one end, local space.
        pub base: DVec3 = DVec3::ZERO,
        /// Centre of the other end; not the same point.
        pub apex: DVec3 = DVec3::Y,
        /// Radius, not 0; negative shows the inside only.
        pub radius: f64 = 0.5,
        /// Whether disks close the ends.
        pub capped: bool = true,
    }
}

impl Check for Cylinder {
    fn check(&self) -> Result<(), Invalid> {
        nonzero("radius", self.radius)?;
        axis(self.base, self.apex)
    }
}

fn axis(base: DVec3, apex: DVec3) -> Result<(), Invalid> {
    position("base", base)?;
    position("apex", apex)?;
    if base == apex {
        return Err(Invalid { field: "apex", message: "`apex` must not be the same point as `base`".into() });
    }
    Ok(())
}

record! {
    /// A cone, or the frustum of one, between two points.
    ///
    /// Texture coordinates, in local space: u is the angle around the axis as a share of a turn, as on a sphere with its
    /// north at the apex, v runs from 0 at the base to 1 at the apex. On the caps the unit square stands around the disk,
    /// u to the right and v up as the cap is seen from outside.
    pub struct Cone {
        /// Centre of the wide end, local space.
        pub base: DVec3 = DVec3::ZERO,
        /// Radius at the base; both radii negative show the inside only.
        pub base_radius: f64 = 0.5,
        /// Centre of the other end; not the same point.
        pub apex: DVec3 = DVec3::Y,
        /// Radius at the apex; 0 is a point.
        pub apex_radius: f64 = 0.0,
        /// Whether disks close the ends.
        pub capped: bool = true,
    }
}

impl Check for Cone {
    fn check(&self) -> Result<(), Invalid> {
        coordinate("base_radius", self.base_radius)?;
        coordinate("apex_radius", self.apex_radius)?;
        axis(self.base, self.apex)?;
        if self.base_radius == 0.0 && self.apex_radius == 0.0 {
            return Err(Invalid { field: "base_radius", message: "one of the radii must not be 0".into() });
        }
        if self.base_radius * self.apex_radius < 0.0 {
            let message = "`base_radius` and `apex_radius` must have the same sign".into();
            return Err(Invalid { field: "apex_radius", message });
        }
        Ok(())
    }
}

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
    pub data: Arc<MeshData>,
}

impl Mesh {
    pub const FIELDS: &'static [&'static str] = &["file", "smooth", "vertices", "triangles", "normals", "uvs"];

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
