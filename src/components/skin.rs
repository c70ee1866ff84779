//! What bends a mesh: joints that carry its vertices, and shapes that it blends into.
//!
//! Both come with an asset and are pure functions of data: the same joints and weights give the same bits everywhere.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::record::ranges::between;
use super::record::{Check, Invalid};
use super::value::{FieldValue, Text, Value};
use super::{Component, FieldClass, FieldError, Mesh, MeshData, Record};
use crate::base::digest::{Digest, Hasher};

/// How much each joint of a skin moves each vertex of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Influences {
    /// Joints that may move one vertex.
    pub per_vertex: usize,
    /// Numbers of joints in the skin, `per_vertex` of them for each vertex.
    pub joints: Vec<u16>,
    /// The weight of each; those of a vertex add up to 1.
    pub weights: Vec<f32>,
}

/// Where the joints of a skin were when the mesh was fitted to them, and which vertices they move.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinData {
    /// From the space of the mesh to that of each joint.
    binds: Vec<DAffine3>,
    influences: Arc<Influences>,
    digest: Digest,
}

impl SkinData {
    /// `binds` lead from the space of the mesh to that of each joint; every influence is by one of these joints.
    pub fn new(binds: Vec<DAffine3>, influences: Arc<Influences>) -> Self {
        let mut hasher = Hasher::default();
        hasher.word(binds.len() as u64);
        binds.iter().flat_map(|m| m.to_cols_array()).for_each(|x| hasher.number(x));
        hasher.word(influences.per_vertex as u64);
        influences.joints.iter().for_each(|j| hasher.bytes(&j.to_le_bytes()));
        influences.weights.iter().for_each(|w| hasher.bytes(&w.to_bits().to_le_bytes()));
        SkinData { binds, influences, digest: hasher.finish() }
    }

    /// The digest of all that it is made of.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// The maps and the influences that it was made of.
    pub fn parts(&self) -> (&[DAffine3], &Arc<Influences>) {
        (&self.binds, &self.influences)
    }

    /// Points and normals where the joints carry them, in the space that `joints` leads to: one map for each joint.
    ///
    /// The maps of the joints of a vertex are blended by their weights (linear blend skinning); normals go by the
    /// cofactors of the blended map. A vertex that no joint moves follows the first.
    pub fn carried(&self, points: &[Vec3], normals: &[Vec3], joints: &[DAffine3]) -> (Vec<Vec3>, Vec<Vec3>) {
        let Influences { per_vertex, joints: numbers, weights } = &*self.influences;
        let maps: Vec<DAffine3> = joints.iter().zip(&self.binds).map(|(joint, bind)| *joint * *bind).collect();
        let mut moved = (Vec::with_capacity(points.len()), Vec::with_capacity(normals.len()));
        for (v, point) in points.iter().enumerate() {
            let row = v * per_vertex..(v + 1) * per_vertex;
            let map = blended(&maps, &numbers[row.clone()], &weights[row]);
            moved.0.push(map.transform_point3(point.as_dvec3()).as_vec3());
            if let Some(normal) = normals.get(v) {
                moved.1.push(turned(&map.matrix3, *normal));
            }
        }
        moved
    }
}

fn blended(maps: &[DAffine3], numbers: &[u16], weights: &[f32]) -> DAffine3 {
    let mut sum = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
    for (number, weight) in numbers.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let (map, weight) = (&maps[usize::from(*number)], f64::from(*weight));
        sum.matrix3 += map.matrix3 * weight;
        sum.translation += map.translation * weight;
    }
    sum
}

/// A normal under a map: by the cofactors, so that it stays square to the surface, outwards in a mirror too.
fn turned(m: &DMat3, normal: Vec3) -> Vec3 {
    let cofactors = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    (cofactors * normal.as_dvec3() * sign).normalize_or_zero().as_vec3()
}

/// The shapes that a mesh can blend into.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphData {
    targets: Vec<MorphTarget>,
    digest: Digest,
}

/// One shape: how far it is from the mesh, vertex by vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphTarget {
    /// What the asset calls it; empty if it has no name for it.
    pub name: Text,
    /// Differences of positions; none at all if they stay.
    pub points: Vec<Vec3>,
    /// Differences of normals; none at all if they stay.
    pub normals: Vec<Vec3>,
}

impl MorphData {
    /// Targets, and the digest that tells them from others.
    pub fn new(targets: Vec<MorphTarget>) -> Self {
        let mut hasher = Hasher::default();
        hasher.word(targets.len() as u64);
        for target in &targets {
            for differences in [&target.points, &target.normals] {
                hasher.word(differences.len() as u64);
                differences.iter().flat_map(|d| d.to_array()).for_each(|x| hasher.bytes(&x.to_bits().to_le_bytes()));
            }
        }
        MorphData { targets, digest: hasher.finish() }
    }

    /// The shapes.
    pub fn targets(&self) -> &[MorphTarget] {
        &self.targets
    }

    /// Number of shapes.
    pub fn len(&self) -> usize {
        self.targets.len()
    }

    /// Whether there is no shape at all.
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }

    /// The digest of all that the shapes are made of.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// Points and normals of the mesh with a share of each target added.
    pub fn blended(&self, points: &[Vec3], normals: &[Vec3], weights: &[f64]) -> (Vec<Vec3>, Vec<Vec3>) {
        let mut moved = (points.to_vec(), normals.to_vec());
        let shown = self.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
        for (target, weight) in shown {
            let weight = *weight as f32;
            let add = |sum: &mut [Vec3], differences: &[Vec3]| {
                sum.iter_mut().zip(differences).for_each(|(sum, difference)| *sum += *difference * weight);
            };
            add(&mut moved.0, &target.points);
            add(&mut moved.1, &target.normals);
        }
        moved
    }
}

/// Joints that carry the vertices of the entity's mesh. It comes with an asset.
///
/// The mesh then stands where its joints are, wherever its own entity is.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Names of the entities that are its joints, in the order of the asset's skin.
    pub joints: Vec<Text>,
    /// Joints and weights, shared by all entities of one file.
    pub data: Arc<SkinData>,
}

impl Skin {
    /// The fields that a scene may give.
    pub const FIELDS: &'static [&'static str] = &["joints"];
}

/// Shapes that the entity's mesh blends into. They come with an asset.
#[derive(Clone, Debug, Default)]
pub struct Morph {
    /// How much of each shape is added, in the order of the asset: 0 nothing, 1 all of it.
    pub weights: Vec<f64>,
    /// Shapes, shared by all entities of one file.
    pub data: Arc<MorphData>,
}

impl Morph {
    /// The fields that a scene may give.
    pub const FIELDS: &'static [&'static str] = &["weights", "names"];

    /// What the asset calls the shapes.
    pub fn names(&self) -> Vec<Text> {
        self.data.targets.iter().map(|target| target.name.clone()).collect()
    }
}

impl PartialEq for Skin {
    fn eq(&self, other: &Self) -> bool {
        self.joints == other.joints && (Arc::ptr_eq(&self.data, &other.data) || self.data == other.data)
    }
}

impl PartialEq for Morph {
    fn eq(&self, other: &Self) -> bool {
        self.weights == other.weights && (Arc::ptr_eq(&self.data, &other.data) || self.data == other.data)
    }
}

impl Record for Skin {
    fn fields(&self) -> &'static [&'static str] {
        Self::FIELDS
    }
    fn classes(&self) -> &'static [FieldClass] {
        &[FieldClass::General]
    }
    fn get(&self, field: &str) -> Option<Value> {
        (field == "joints").then(|| self.joints.to_value())
    }
    fn set(&mut self, field: &str, value: &Value) -> Result<(), FieldError> {
        if field != "joints" {
            return Err(FieldError::Unknown { known: Self::FIELDS });
        }
        self.joints = Vec::from_value(value).map_err(FieldError::Mismatch)?;
        Ok(())
    }
    fn probe(&self, field: &str, value: &Value) -> Result<(), FieldError> {
        super::record::probe(self.clone(), field, value)
    }
    fn docs(&self) -> &'static str {
        "Joints that carry the vertices of the entity's mesh. It comes with an `asset`. The mesh then stands where its \
         joints are, wherever its own entity is."
    }
    fn field_docs(&self) -> &'static [&'static str] {
        &["Names of the entities that are its joints, in the order of the asset's skin."]
    }
}

impl Record for Morph {
    fn fields(&self) -> &'static [&'static str] {
        Self::FIELDS
    }
    fn classes(&self) -> &'static [FieldClass] {
        &[FieldClass::General, FieldClass::Data]
    }
    fn get(&self, field: &str) -> Option<Value> {
        match field {
            "weights" => Some(self.weights.to_value()),
            "names" => Some(self.names().to_value()),
            _ => None,
        }
    }
    fn set(&mut self, field: &str, value: &Value) -> Result<(), FieldError> {
        match field {
            "weights" => self.weights = Vec::from_value(value).map_err(FieldError::Mismatch)?,
            "names" => {
                let message = "`names` are those of the asset and cannot be set".into();
                return Err(FieldError::Mismatch(super::Mismatch { message, help: None }));
            }
            _ => return Err(FieldError::Unknown { known: Self::FIELDS }),
        }
        Ok(())
    }
    fn probe(&self, field: &str, value: &Value) -> Result<(), FieldError> {
        super::record::probe(self.clone(), field, value)
    }
    fn docs(&self) -> &'static str {
        "Shapes that the entity's mesh blends into. They come with an `asset`."
    }
    fn field_docs(&self) -> &'static [&'static str] {
        &[
            "How much of each shape is added, in the order of the asset: 0 nothing, 1 all of it.",
            "What the asset calls the shapes; it cannot be set.",
        ]
    }
}

impl Check for Skin {
    fn check(&self) -> Result<(), Invalid> {
        let wanted = self.data.binds.len();
        if self.joints.len() == wanted {
            return Ok(());
        }
        let message = match wanted {
            0 => "a skin comes with an `asset`; only its `joints` can be other entities".into(),
            _ => format!("`joints` must be {wanted} entities, as the asset has them, not {}", self.joints.len()),
        };
        Err(Invalid { field: "joints", message })
    }
}

impl Check for Morph {
    fn check(&self) -> Result<(), Invalid> {
        let wanted = self.data.targets.len();
        self.weights.iter().try_for_each(|w| between("weights", *w, -1e6, 1e6))?;
        if self.weights.len() == wanted {
            return Ok(());
        }
        let message = match wanted {
            0 => "a morph comes with an `asset`; only its `weights` can be set".into(),
            _ => format!("`weights` must be {wanted} numbers, one for each shape, not {}", self.weights.len()),
        };
        Err(Invalid { field: "weights", message })
    }
}

#[derive(Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Skin")]
struct SkinForm {
    joints: Vec<Text>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Morph")]
struct MorphForm {
    weights: Vec<f64>,
}

impl Serialize for Skin {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        SkinForm { joints: self.joints.clone() }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Skin {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        SkinForm::deserialize(deserializer).map(|form| Skin { joints: form.joints, data: Arc::default() })
    }
}

impl Serialize for Morph {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        MorphForm { weights: self.weights.clone() }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Morph {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        MorphForm::deserialize(deserializer).map(|form| Morph { weights: form.weights, data: Arc::default() })
    }
}

/// The mesh as shapes and joints bend it, and the digest of all that it follows from.
///
/// `joints` lead from the joints to the space that the mesh is wanted in; they do not matter without a skin.
pub fn deformed(mesh: &MeshData, morph: Option<&Morph>, skin: Option<(&Skin, &[DAffine3])>) -> MeshData {
    let (mut points, mut normals) = match morph {
        Some(morph) => morph.data.blended(&mesh.vertices, &mesh.normals, &morph.weights),
        None => (mesh.vertices.clone(), mesh.normals.clone()),
    };
    if let Some((skin, joints)) = skin {
        (points, normals) = skin.data.carried(&points, &normals, joints);
    }
    mesh.moved(points, normals)
}

/// A mesh as the morph and the skin of its entity bend it, if it has any, and what leads from it to the world.
///
/// `map` is that of the entity, and `joint` gives that of a joint by its name. Where there is a skin, the joints alone say
/// where the mesh is.
pub fn bent(
    mesh: &Mesh,
    morph: Option<&Component>,
    skin: Option<&Component>,
    map: DAffine3,
    joint: impl Fn(&Text) -> DAffine3,
) -> (MeshData, DAffine3) {
    let morph = match morph {
        Some(Component::Morph(morph)) => Some(morph),
        _ => None,
    };
    match skin {
        Some(Component::Skin(skin)) => {
            let joints: Vec<DAffine3> = skin.joints.iter().map(joint).collect();
            (deformed(&mesh.data, morph, Some((skin, &joints))), DAffine3::IDENTITY)
        }
        _ => (deformed(&mesh.data, morph, None), map),
    }
}

/// The digest of all that [`deformed`] follows from.
pub fn deformed_digest(mesh: &MeshData, morph: Option<&Morph>, skin: Option<(&Skin, &[DAffine3])>) -> Digest {
    let mut hasher = Hasher::default();
    hasher.digest(mesh.digest());
    if let Some(morph) = morph {
        hasher.digest(morph.data.digest());
        morph.weights.iter().for_each(|w| hasher.number(*w));
    }
    if let Some((skin, joints)) = skin {
        hasher.digest(skin.data.digest());
        joints.iter().flat_map(|m| m.to_cols_array()).for_each(|x| hasher.number(x));
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math::placement;

    fn skin(weights: &[f32]) -> SkinData {
        let influences = Influences { per_vertex: 2, joints: vec![0, 1], weights: weights.to_vec() };
        SkinData::new(vec![DAffine3::IDENTITY; 2], Arc::new(influences))
    }

    #[test]
    fn a_vertex_between_two_joints_goes_half_way_with_each() {
        let up = DAffine3::from_translation(DVec3::Y * 2.0);
        let turned = placement(DVec3::ZERO, DVec3::new(0.0, 90.0, 0.0), DVec3::ONE);
        let (points, normals) = skin(&[0.5, 0.5]).carried(&[Vec3::X], &[Vec3::X], &[up, turned]);
        assert!((points[0] - Vec3::new(0.5, 1.0, -0.5)).length() < 1e-6, "{}", points[0]);
        assert!((normals[0] - Vec3::new(1.0, 0.0, -1.0).normalize()).length() < 1e-6, "{}", normals[0]);
        let (points, _) = skin(&[1.0, 0.0]).carried(&[Vec3::X], &[], &[up, DAffine3::from_translation(DVec3::NAN)]);
        assert_eq!(points, [Vec3::new(1.0, 2.0, 0.0)]);
    }

    #[test]
    fn normals_stay_square_to_a_surface_that_is_squashed_or_mirrored() {
        let slanted = Vec3::new(1.0, 1.0, 0.0).normalize();
        for scale in [DVec3::new(1.0, 0.25, 1.0), DVec3::new(1.0, -0.25, 1.0)] {
            let map = placement(DVec3::ZERO, DVec3::ZERO, scale);
            let (points, normals) =
                skin(&[1.0, 0.0]).carried(&[Vec3::new(1.0, -1.0, 0.0)], &[slanted], &[map, DAffine3::IDENTITY]);
            assert!(points[0].dot(normals[0]).abs() < 1e-6 && normals[0].x > 0.0, "{} {}", points[0], normals[0]);
        }
    }

    #[test]
    fn shapes_are_added_by_their_weights() {
        let target = |d: Vec3| MorphTarget { name: "".into(), points: vec![d], normals: Vec::new() };
        let data = MorphData::new(vec![target(Vec3::X), target(Vec3::Y * 4.0)]);
        let (points, normals) = data.blended(&[Vec3::Z], &[Vec3::Z], &[2.0, 0.25]);
        assert_eq!((points[0], normals[0]), (Vec3::new(2.0, 1.0, 1.0), Vec3::Z));
        let morph = Morph { weights: vec![0.5], data: Arc::new(data) };
        assert!(morph.check().unwrap_err().message.contains("must be 2 numbers"));
    }
}
