//! The component `mesh`: where its data come from, and which of them show how.

mod creases;
mod data;
mod pieces;

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4};
use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize};

use super::record::ranges::{between, position};
use super::record::{Check, Invalid};
use super::shapes::{Reach, Shape, support_of_box};
use super::value::{FieldValue, Text, Value};
use super::{FieldClass, FieldError, Record};
use crate::base::diagnostics::suggestion;
pub use data::{FaceSet, MeshData, Piece};
pub use pieces::Pieces;

/// An indexed triangle mesh, from a file or written out.
///
/// Texture coordinates are those of its vertices; where there are none it is wrapped like a sphere around the middle of
/// its bounds, in local space.
///
/// In a scene: `mesh: (file: "bunny.obj", smooth: true)` or
/// `mesh: (vertices: [(0, 0, 0), ...], triangles: [(0, 1, 2), ...])`. The loader fills `data` from `file`.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// OBJ, PLY or STL file, relative to the scene; `None` when the mesh is written out.
    pub file: Option<Text>,
    /// Which file of a sequence, where the name of `file` has `####` for its number; 1 if not given. Between two whole
    /// numbers the vertices are on their way from one to the other, if the triangles of both are the same.
    pub frame: Option<f64>,
    /// Name of the one group or object of the file that shows; all of it without a name.
    pub group: Option<Text>,
    /// Whether missing vertex normals are computed from the triangles around each vertex: everywhere, nowhere, or, if
    /// not given, as the smoothing groups of the file say.
    pub smooth: Option<bool>,
    /// Degrees, 0 to 180: computed normals are not joined over edges at which the surface turns by more.
    pub crease_angle: Option<f64>,
    /// Whether faces wear the materials that the file names for them. Others, and all without it, wear the `material` of
    /// the entity.
    pub file_materials: bool,
    /// What was read, shared by all entities of one file.
    pub data: Arc<MeshData>,
}

impl Default for Mesh {
    fn default() -> Self {
        Mesh {
            file: None,
            frame: None,
            group: None,
            smooth: None,
            crease_angle: None,
            file_materials: true,
            data: Arc::default(),
        }
    }
}

impl Mesh {
    /// The triangles that the mesh shows of these data: those of its group, or all.
    pub fn shown_triangles<'a>(&self, data: &'a MeshData) -> Box<dyn Iterator<Item = [u32; 3]> + 'a> {
        match self.group.as_deref().and_then(|name| data.group(name)) {
            Some(set) => Box::new(set.triangles().map(|t| data.triangles[t as usize])),
            None => Box::new(data.triangles.iter().copied()),
        }
    }

    /// The fields that a scene may give.
    pub const FIELDS: &'static [&'static str] = &[
        "file",
        "frame",
        "group",
        "smooth",
        "crease_angle",
        "file_materials",
        "vertices",
        "triangles",
        "normals",
        "uvs",
        "colors",
    ];

    /// The class of each field.
    pub const CLASSES: &'static [FieldClass] = &{
        let mut classes = [FieldClass::Data; Self::FIELDS.len()];
        // What is shown of the data, and how.
        let mut i = 2;
        while i < 6 {
            classes[i] = FieldClass::General;
            i += 1;
        }
        classes
    };

    /// Names of the materials that its faces wear by themselves.
    pub fn worn(&self) -> impl Iterator<Item = &Text> {
        self.data.materials.iter().filter(|_| self.file_materials).map(|set| &set.name)
    }

    fn edit(&mut self) -> &mut MeshData {
        self.file = None;
        let data = Arc::make_mut(&mut self.data);
        data.forget_computed();
        data
    }
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        let Mesh { file, frame, group, smooth, crease_angle, file_materials, data } = self;
        let same_data = Arc::ptr_eq(data, &other.data) || *data == other.data;
        (file, group, smooth) == (&other.file, &other.group, &other.smooth)
            && (crease_angle, file_materials) == (&other.crease_angle, &other.file_materials)
            && frame == &other.frame
            && same_data
    }
}

/// What the fields of a mesh are, in the order of [`Mesh::FIELDS`].
const MESH_DOCS: [&str; 11] = [
    "A file of triangles, relative to the scene; `####` in its name stands for `frame`.",
    "Number of the file, where its name has `####`; between whole numbers the mesh is between the two files.",
    "A group or object of the file: nothing else of it shows.",
    "Whether normals are made where there are none, so that faces blend into each other.",
    "Greatest angle in degrees between faces that blend into each other.",
    "Whether faces wear the materials that the file names for them.",
    "Corners, local space, world units.",
    "Three numbers of `vertices` for each triangle, counted from 0.",
    "A normal for each of `vertices`, or none.",
    "Texture coordinates for each of `vertices`, or none.",
    "Linear colour and alpha for each of `vertices`, multiplied with the colour of the material, or none.",
];

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
            "frame" => Some(self.frame.to_value()),
            "group" => Some(self.group.to_value()),
            "smooth" => Some(self.smooth.to_value()),
            "crease_angle" => Some(self.crease_angle.to_value()),
            "file_materials" => Some(self.file_materials.to_value()),
            "vertices" => Some(self.data.points().map(|point| point.as_vec3()).collect::<Vec<Vec3>>().to_value()),
            "normals" => Some(self.data.normals.to_value()),
            "triangles" => Some(self.data.triangles.to_value()),
            "uvs" => Some(self.data.uvs.to_value()),
            "colors" => Some(self.data.colors.to_value()),
            _ => None,
        }
    }
    fn set(&mut self, field: &str, value: &Value) -> Result<(), FieldError> {
        let wrong = FieldError::Mismatch;
        match field {
            "file" => {
                let file = Option::<Text>::from_value(value).map_err(wrong)?;
                if file != self.file {
                    // What it holds is read where the edits of a frame are resolved.
                    self.data = Arc::default();
                    self.file = file;
                }
            }
            "frame" => {
                let frame = Option::from_value(value).map_err(wrong)?;
                if frame != self.frame && self.file.is_some() {
                    self.data = Arc::default();
                }
                self.frame = frame;
            }
            "group" => self.group = Option::from_value(value).map_err(wrong)?,
            "smooth" => self.smooth = Option::from_value(value).map_err(wrong)?,
            "crease_angle" => self.crease_angle = Option::from_value(value).map_err(wrong)?,
            "file_materials" => self.file_materials = bool::from_value(value).map_err(wrong)?,
            "vertices" => {
                let data = self.edit();
                (data.vertices, data.origin) = (Vec::from_value(value).map_err(wrong)?, DVec3::ZERO);
            }
            "normals" => self.edit().normals = Vec::from_value(value).map_err(wrong)?,
            "triangles" => {
                let triangles = Vec::from_value(value).map_err(wrong)?;
                self.edit().put_triangles(triangles);
            }
            "uvs" => self.edit().uvs = Vec::from_value(value).map_err(wrong)?,
            "colors" => self.edit().colors = Vec::from_value(value).map_err(wrong)?,
            _ => return Err(FieldError::Unknown { known: Self::FIELDS }),
        }
        Ok(())
    }
    fn probe(&self, field: &str, value: &Value) -> Result<(), FieldError> {
        super::record::probe(self.clone(), field, value)
    }
    fn docs(&self) -> &'static str {
        "Triangles from a file, or written out. A mesh that many entities use is stored once."
    }
    fn field_docs(&self) -> &'static [&'static str] {
        &MESH_DOCS
    }
}

impl Check for Mesh {
    fn check(&self) -> Result<(), Invalid> {
        let fail = |field, message| Err(Invalid { field, message });
        let data = &self.data;
        self.crease_angle.map_or(Ok(()), |angle| between("crease_angle", angle, 0.0, 180.0))?;
        self.frame.map_or(Ok(()), |frame| between("frame", frame, 0.0, 1e9))?;
        data.checked()?;
        match &self.group {
            Some(group) if !data.triangles.is_empty() && data.group(group).is_none() => {
                let help = suggestion(group, data.groups.iter().map(|set| &*set.name));
                let help = help.map_or_else(String::new, |help| format!("; {help}"));
                fail("group", format!("the mesh has no group or object `{group}`{help}"))
            }
            _ => Ok(()),
        }
    }
}

/// What of the data can be out of range.
fn check_data(data: &MeshData) -> Result<(), Invalid> {
    let fail = |field, message| Err(Invalid { field, message });
    data.vertices.iter().try_for_each(|v| position("vertices", v.as_dvec3()))?;
    data.normals.iter().try_for_each(|n| position("normals", n.as_dvec3()))?;
    let count = data.vertices.len();
    if let Some(index) = data.triangles.iter().flatten().find(|i| **i as usize >= count) {
        let message = format!("vertex {index} of `triangles` does not exist; there are {count}, numbered from 0");
        return fail("triangles", message);
    }
    let given = data.uvs.iter().filter(|uv| **uv != MeshData::NO_UV);
    given.into_iter().try_for_each(|t| position("uvs", t.as_dvec2().extend(0.0)))?;
    data.colors.iter().flat_map(|c| c.to_array()).try_for_each(|x| between("colors", x.into(), 0.0, 1e9))?;
    let per_vertex = [
        ("normals", "normals", data.normals.len()),
        ("uvs", "texture coordinates", data.uvs.len()),
        ("colors", "colours", data.colors.len()),
    ];
    for (field, what, there) in per_vertex {
        if there != 0 && there != count {
            return fail(field, format!("{there} {what} for {count} vertices: one each, or none"));
        }
    }
    Ok(())
}

impl Shape for Mesh {
    fn reach(&self) -> Reach {
        if self.data.vertices.is_empty() { Reach::Empty } else { Reach::Finite }
    }
    fn support(&self, direction: DVec3) -> f64 {
        let of_box = |corners: &[Vec3; 2]| support_of_box(corners.map(|corner| corner.as_dvec3()), direction);
        let farthest = self.data.boxes().iter().map(of_box).fold(f64::NEG_INFINITY, f64::max);
        farthest + self.data.origin.dot(direction)
    }
    fn holds(&self, point: DVec3) -> bool {
        self.pieces().iter().any(|piece| piece.data.holds(point))
    }
    fn primitive_count(&self) -> usize {
        self.data.triangles.len()
    }
}

/// The written form of a mesh.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Mesh")]
struct MeshForm {
    file: Option<Text>,
    frame: Option<f64>,
    group: Option<Text>,
    smooth: Option<bool>,
    crease_angle: Option<f64>,
    file_materials: bool,
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<Rgba>,
}

impl Default for MeshForm {
    fn default() -> Self {
        MeshForm {
            file: None,
            frame: None,
            group: None,
            smooth: None,
            crease_angle: None,
            file_materials: true,
            vertices: Vec::new(),
            triangles: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
        }
    }
}

impl<'de> Deserialize<'de> for Mesh {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let form = MeshForm::deserialize(deserializer)?;
        let MeshForm { vertices, triangles, normals, uvs, colors, .. } = form;
        let colors = colors.into_iter().map(|color| color.0).collect();
        let data = MeshData { colors, ..MeshData::new(vertices, triangles, normals).with_uvs(uvs) };
        let MeshForm { file, frame, group, smooth, crease_angle, file_materials, .. } = form;
        Ok(Mesh { file, frame, group, smooth, crease_angle, file_materials, data: Arc::new(data) })
    }
}

/// A colour of three numbers, or of four with its alpha.
struct Rgba(Vec4);

impl<'de> Deserialize<'de> for Rgba {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Rgba;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("three or four numbers")
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<Rgba, A::Error> {
                let mut rgba = Vec4::ONE;
                for i in 0..4 {
                    match seq.next_element()? {
                        Some(x) => rgba[i] = x,
                        None if i == 3 => break,
                        None => return Err(serde::de::Error::invalid_length(i, &self)),
                    }
                }
                Ok(Rgba(rgba))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// What differs from the defaults; the data only if no file has them.
impl Serialize for Mesh {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Mesh { file, frame, group, smooth, crease_angle, file_materials, data } = self;
        let inline = file.is_none();
        let beside = [!data.normals.is_empty(), !data.uvs.is_empty(), !data.colors.is_empty()].map(|has| inline && has);
        let [normals, uvs, colors] = beside;
        let options = [
            file.is_some(),
            frame.is_some(),
            group.is_some(),
            smooth.is_some(),
            crease_angle.is_some(),
            !file_materials,
        ];
        let count = options.into_iter().chain([inline, inline]).chain(beside).map(usize::from).sum();
        let mut out = serializer.serialize_struct("Mesh", count)?;
        if let Some(file) = file {
            out.serialize_field("file", file)?;
        }
        if let Some(frame) = frame {
            out.serialize_field("frame", frame)?;
        }
        if let Some(group) = group {
            out.serialize_field("group", group)?;
        }
        if let Some(smooth) = smooth {
            out.serialize_field("smooth", smooth)?;
        }
        if let Some(angle) = crease_angle {
            out.serialize_field("crease_angle", angle)?;
        }
        if !file_materials {
            out.serialize_field("file_materials", &false)?;
        }
        if inline {
            out.serialize_field("vertices", &data.vertices)?;
            out.serialize_field("triangles", &data.triangles)?;
        }
        if normals {
            out.serialize_field("normals", &data.normals)?;
        }
        if uvs {
            out.serialize_field("uvs", &data.uvs)?;
        }
        if colors {
            out.serialize_field("colors", &data.colors)?;
        }
        out.end()
    }
}
