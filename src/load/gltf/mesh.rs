//! Meshes: the primitives of one glTF mesh as one mesh, its materials by triangles, and what bends it.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use serde_json::Value;

use super::document::{Document, at, field, item};
use super::json::{MeshJson, PrimitiveJson, attribute};
use super::warnings::Warnings;
use crate::base::limits;
use crate::components::{FaceSet, Influences, MeshData, MorphData, MorphTarget, Text};
use crate::load::resolve::Problem;
use crate::load::spans::Step;

/// A mesh of the file with what belongs to its vertices.
#[derive(Clone, Debug, Default)]
pub struct GltfMesh {
    pub data: Arc<MeshData>,
    /// None if no primitive has any.
    pub influences: Option<Arc<Influences>>,
    /// None if it has no targets.
    pub morph: Option<Arc<MorphData>>,
    /// Weights that the file gives its targets.
    pub weights: Vec<f64>,
    /// The greatest number of a joint among its influences, and one more.
    pub joints: usize,
}

/// Vertices of one primitive and of those before it.
#[derive(Default)]
struct Vertices {
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: [Vec<Vec2>; 2],
    colors: Vec<Vec4>,
    /// Influences of each primitive by the number of its vertices.
    influences: Vec<(usize, Influences)>,
    targets: Vec<MorphTarget>,
}

/// Sets of texture coordinates that are read.
const UV_SETS: usize = 2;

impl Document {
    /// Reads a mesh; `material` names the material of a number, or that of primitives without one.
    ///
    /// # Errors
    /// Accessors that do not fit each other or are out of range.
    pub fn mesh(
        &self,
        index: usize,
        material: &dyn Fn(Option<usize>) -> Text,
        warnings: &mut Warnings,
    ) -> Result<GltfMesh, Problem> {
        let path = at("meshes", index);
        let Some(mesh) = self.root.meshes.get(index) else {
            let count = self.root.meshes.len();
            return Err(Problem::new(path, format!("there is no mesh {index}; there are {count}")));
        };
        let names = target_names(mesh);
        let mut all = Vertices::default();
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        let mut materials: Vec<FaceSet> = Vec::new();
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let path = item(field(path.clone(), "primitives"), i);
            if let Some(points) = shown_as_points(primitive) {
                warnings.add(points, || Problem::new(path.clone(), format!("{points} are not drawn")));
                continue;
            }
            let first = all.points.len() as u32;
            self.vertices(primitive, &path, &names, &mut all, warnings)?;
            let count = all.points.len() as u32 - first;
            let start = triangles.len() as u32;
            self.triangles(primitive, &path, [first, count], &mut triangles, warnings)?;
            if let Some(number) = primitive.material.map(|m| m.0)
                && number >= self.root.materials.len()
            {
                let message = format!("there is no material {number}; there are {}", self.root.materials.len());
                return Err(Problem::new(field(path, "material"), message));
            }
            let name = material(primitive.material.map(|m| m.0));
            let end = triangles.len() as u32;
            match materials.iter_mut().find(|set| set.name == name) {
                Some(set) => set.push(start, end),
                None if start < end => materials.push(FaceSet { name, runs: vec![[start, end]] }),
                None => {}
            }
        }
        if triangles.len() > limits::TRIANGLES {
            return Err(Problem::new(path, format!("the mesh has more than {} triangles", limits::TRIANGLES)));
        }
        let (influences, joints) = all.joined_influences();
        let Vertices { points, normals, uvs, colors, targets, .. } = all;
        let [uvs, second_uvs] = uvs;
        let mut data = MeshData::new(points, triangles, normals).with_uvs(uvs);
        (data.second_uvs, data.colors, data.materials) = (second_uvs, colors, materials);
        let morph = (!targets.is_empty()).then(|| Arc::new(MorphData::new(targets)));
        let count = morph.as_ref().map_or(0, |morph| morph.len());
        let weights = (0..count).map(|i| mesh.weights.get(i).copied().unwrap_or(0.0)).collect();
        Ok(GltfMesh { data: Arc::new(data), influences: influences.map(Arc::new), morph, weights, joints })
    }

    /// Adds the vertices of a primitive to those before it.
    fn vertices(
        &self,
        primitive: &PrimitiveJson,
        path: &[Step],
        names: &[Text],
        all: &mut Vertices,
        warnings: &mut Warnings,
    ) -> Result<(), Problem> {
        let attributes = field(path.to_vec(), "attributes");
        let find = |name: &str| attribute(&primitive.attributes, name).map_err(|m| Problem::new(attributes.clone(), m));
        let Some(positions) = find("POSITION")? else {
            // Its extension has them, or it has none: nothing to draw either way.
            return Ok(());
        };
        let first = all.points.len();
        let points = vec3s(self.floats(positions, &["VEC3"])?.0);
        let count = points.len();
        let fits = |name: &str, there: usize| match there == count {
            true => Ok(()),
            false => Err(Problem::new(
                field(attributes.clone(), name),
                format!("{there} values of `{name}` for {count} vertices: one each"),
            )),
        };
        let bad = points.iter().position(|p| !p.abs().cmple(Vec3::splat(1e9)).all());
        if let Some(i) = bad {
            let message = format!("vertex {i} is at {}, which is beyond reach", points[i]);
            return Err(Problem::new(field(attributes, "POSITION"), message));
        }
        all.points.extend(points);
        let normals = match find("NORMAL")? {
            Some(index) => vec3s(self.floats(index, &["VEC3"])?.0),
            None => Vec::new(),
        };
        if !normals.is_empty() {
            fits("NORMAL", normals.len())?;
        }
        // A normal that is none leaves its vertex flat.
        let usable = |n: Vec3| if n.is_finite() { n } else { Vec3::ZERO };
        extend(&mut all.normals, first, count, normals.into_iter().map(usable), Vec3::ZERO);
        for set in 0..UV_SETS {
            let name = format!("TEXCOORD_{set}");
            let found = find(&name)?.map(|index| self.floats(index, &["VEC2"])).transpose()?;
            let flat = found.map_or(Vec::new(), |(floats, _)| floats);
            if !flat.is_empty() {
                fits(&name, flat.len() / 2)?;
            }
            // Ours grow upwards from the bottom row of a picture.
            let uvs = flat.chunks_exact(2).map(|uv| Vec2::new(uv[0], 1.0 - uv[1]));
            let usable = uvs.map(|uv| if uv.abs().cmple(Vec2::splat(1e9)).all() { uv } else { Vec2::ZERO });
            extend(&mut all.uvs[set], first, count, usable, MeshData::NO_UV);
        }
        let colors = find("COLOR_0")?.map(|index| self.floats(index, &["VEC3", "VEC4"])).transpose()?;
        if let Some((flat, width)) = &colors {
            fits("COLOR_0", flat.len() / width)?;
        }
        let color = |c: &[f32]| Vec4::new(c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0));
        let kept = |c: Vec4| if c.is_finite() { c.clamp(Vec4::ZERO, Vec4::splat(1e9)) } else { Vec4::ONE };
        let (flat, width) = colors.unwrap_or((Vec::new(), 4));
        extend(&mut all.colors, first, count, flat.chunks_exact(width).map(color).map(kept), Vec4::ONE);
        if let Some(influences) = self.influences(primitive, &attributes, count)? {
            all.influences.push((first, influences));
        }
        self.targets(primitive, path, [first, count], names, all, warnings)
    }

    /// The joints that move the vertices of a primitive.
    fn influences(
        &self,
        primitive: &PrimitiveJson,
        path: &[Step],
        count: usize,
    ) -> Result<Option<Influences>, Problem> {
        let find = |name: &str| attribute(&primitive.attributes, name).map_err(|m| Problem::new(path.to_vec(), m));
        let mut sets = Vec::new();
        while let (Some(joints), Some(weights)) =
            (find(&format!("JOINTS_{}", sets.len()))?, find(&format!("WEIGHTS_{}", sets.len()))?)
        {
            let joints = self.whole_numbers(joints, &["VEC4"])?.0;
            let weights = self.floats(weights, &["VEC4"])?.0;
            if joints.len() != 4 * count || weights.len() != 4 * count {
                let message = format!("joints and weights for {count} vertices: four of each in a set");
                return Err(Problem::new(field(path.to_vec(), &format!("JOINTS_{}", sets.len())), message));
            }
            sets.push((joints, weights));
            if sets.len() > limits::JOINT_SETS {
                return Err(Problem::new(path.to_vec(), format!("more than {} sets of joints", limits::JOINT_SETS)));
            }
        }
        if sets.is_empty() {
            return Ok(None);
        }
        let per_vertex = 4 * sets.len();
        let mut found = Influences { per_vertex, joints: Vec::new(), weights: Vec::new() };
        for v in 0..count {
            let row = found.weights.len();
            for (joints, weights) in &sets {
                for k in 4 * v..4 * v + 4 {
                    let joint = u16::try_from(joints[k]).map_err(|_| {
                        Problem::new(field(path.to_vec(), "JOINTS_0"), format!("there is no joint {}", joints[k]))
                    })?;
                    let weight = if weights[k].is_finite() { weights[k].max(0.0) } else { 0.0 };
                    // What moves nothing must not stand for a joint that is not there.
                    found.joints.push(if weight > 0.0 { joint } else { 0 });
                    found.weights.push(weight);
                }
            }
            normalise(&mut found.weights[row..]);
        }
        Ok(Some(found))
    }

    /// Adds the differences of a primitive to those of the ones before it.
    fn targets(
        &self,
        primitive: &PrimitiveJson,
        path: &[Step],
        [first, count]: [usize; 2],
        names: &[Text],
        all: &mut Vertices,
        warnings: &mut Warnings,
    ) -> Result<(), Problem> {
        for (i, target) in primitive.targets.iter().enumerate() {
            let path = item(field(path.to_vec(), "targets"), i);
            if all.targets.len() <= i {
                let name = names.get(i).cloned().unwrap_or_default();
                all.targets.push(MorphTarget { name, ..MorphTarget::default() });
            }
            for (name, which) in [("POSITION", 0), ("NORMAL", 1)] {
                let index = attribute(target, name).map_err(|m| Problem::new(path.clone(), m))?;
                let differences = match index {
                    Some(index) => vec3s(self.floats(index, &["VEC3"])?.0),
                    None => Vec::new(),
                };
                if index.is_some() && differences.len() != count {
                    let message = format!("{} values of `{name}` for {count} vertices", differences.len());
                    return Err(Problem::new(path, message));
                }
                let usable = |d: Vec3| if d.is_finite() { d } else { Vec3::ZERO };
                let target = &mut all.targets[i];
                let sums = if which == 0 { &mut target.points } else { &mut target.normals };
                extend(sums, first, count, differences.into_iter().map(usable), Vec3::ZERO);
            }
            let others = target.keys().filter(|key| !["POSITION", "NORMAL", "TANGENT"].contains(&key.as_str()));
            for key in others.filter(|key| !key.starts_with('_')) {
                warnings.add(&format!("target {key}"), || {
                    Problem::new(path.clone(), format!("`{key}` of a morph target is not used"))
                });
            }
        }
        Ok(())
    }

    /// Adds the triangles of a primitive whose vertices are `count` from number `first` on.
    fn triangles(
        &self,
        primitive: &PrimitiveJson,
        path: &[Step],
        [first, count]: [u32; 2],
        triangles: &mut Vec<[u32; 3]>,
        warnings: &mut Warnings,
    ) -> Result<(), Problem> {
        let corners = match primitive.indices {
            Some(index) => self.whole_numbers(index.0, &["SCALAR"])?.0,
            None => (0..count).collect(),
        };
        if let Some(corner) = corners.iter().find(|corner| **corner >= count) {
            let message = format!("vertex {corner} does not exist; there are {count}, numbered from 0");
            return Err(Problem::new(field(path.to_vec(), "indices"), message));
        }
        let mode = primitive.mode.map_or(4, |mode| mode.0);
        let n = corners.len();
        let place = |t: [usize; 3]| t.map(|i| first + corners[i]);
        match mode {
            4 => {
                if !n.is_multiple_of(3) {
                    warnings.add("corners left over", || {
                        let message = format!("{n} corners make {} triangles, and {} are left over", n / 3, n % 3);
                        Problem::new(field(path.to_vec(), "indices"), message)
                    });
                }
                triangles.extend((0..n / 3).map(|t| place([3 * t, 3 * t + 1, 3 * t + 2])));
            }
            5 => {
                // Every other triangle of a strip is turned; some are there to reach the next strip.
                let strip = (2..n).map(|i| if i % 2 == 0 { [i - 2, i - 1, i] } else { [i - 1, i - 2, i] }).map(place);
                triangles.extend(strip.filter(|[a, b, c]| a != b && b != c && c != a));
            }
            6 => triangles.extend((2..n).map(|i| place([i - 1, i, 0]))),
            other => {
                let message = format!("unknown mode {other}");
                return Err(Problem::new(field(path.to_vec(), "mode"), message));
            }
        }
        Ok(())
    }
}

impl Vertices {
    /// The influences of all primitives in one table, and how many joints they speak of.
    fn joined_influences(&mut self) -> (Option<Influences>, usize) {
        let parts = std::mem::take(&mut self.influences);
        let Some(per_vertex) = parts.iter().map(|(_, part)| part.per_vertex).max() else { return (None, 0) };
        let size = self.points.len() * per_vertex;
        let mut all = Influences { per_vertex, joints: vec![0; size], weights: vec![0.0; size] };
        // Vertices that no primitive says anything of follow the first joint.
        all.weights.iter_mut().step_by(per_vertex).for_each(|weight| *weight = 1.0);
        for (first, part) in &parts {
            let rows = part.joints.chunks_exact(part.per_vertex).zip(part.weights.chunks_exact(part.per_vertex));
            for (v, (joints, weights)) in rows.enumerate() {
                let at = (first + v) * per_vertex;
                all.joints[at..at + joints.len()].copy_from_slice(joints);
                all.weights[at..at + weights.len()].copy_from_slice(weights);
            }
        }
        let joints = all.joints.iter().map(|joint| usize::from(*joint) + 1).max().unwrap_or(0);
        (Some(all), joints)
    }
}

/// Makes weights add up to 1; those of nothing are all of the first.
fn normalise(weights: &mut [f32]) {
    let sum: f32 = weights.iter().sum();
    if sum > 0.0 && sum.is_finite() {
        weights.iter_mut().for_each(|weight| *weight /= sum);
    } else {
        weights.fill(0.0);
        weights[0] = 1.0;
    }
}

fn vec3s(flat: Vec<f32>) -> Vec<Vec3> {
    flat.chunks_exact(3).map(Vec3::from_slice).collect()
}

/// Adds the values of `count` vertices from number `first` on, if there are any; those without have `missing`.
fn extend<T: Copy>(all: &mut Vec<T>, first: usize, count: usize, values: impl ExactSizeIterator<Item = T>, missing: T) {
    if values.len() > 0 {
        all.resize(first, missing);
        all.extend(values);
    } else if !all.is_empty() {
        all.resize(first + count, missing);
    }
}

/// What a primitive shows that is no surface.
fn shown_as_points(primitive: &PrimitiveJson) -> Option<&'static str> {
    match primitive.mode.map_or(4, |mode| mode.0) {
        0 => Some("points"),
        1..=3 => Some("lines"),
        _ => None,
    }
}

/// Names of morph targets, where it is usual to write them.
fn target_names(mesh: &MeshJson) -> Vec<Text> {
    let names = mesh.extras.get("targetNames").and_then(Value::as_array);
    let text = |name: &Value| Text::from(name.as_str().unwrap_or(""));
    names.map_or_else(Vec::new, |names| names.iter().map(text).collect())
}
