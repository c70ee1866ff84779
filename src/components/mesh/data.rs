//! What a mesh is made of.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

use glam::{DVec3, Vec2, Vec3, Vec4};
use rustc_hash::FxHashMap;

use super::check_data;
use crate::base::digest::{Digest, Hasher};
use crate::components::{Invalid, Text};

/// Vertices and triangles of a mesh, shared by all who use it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Positions, local space, relative to `origin`.
    pub vertices: Vec<Vec3>,
    /// Where the positions count from, local space: far from 0 they would be rounded too much.
    pub origin: DVec3,
    /// Corners as indices from 0, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// One shading normal per vertex, or none at all; zero at vertices that have none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates (u, v), one pair per vertex, or none at all; [`Self::NO_UV`] at vertices that have none.
    pub uvs: Vec<Vec2>,
    /// As `uvs`, for textures that say `uv_set: 1`.
    pub second_uvs: Vec<Vec2>,
    /// Red, green, blue and alpha, linear, multiplied with the colour of the material; one per vertex, or none at all.
    pub colors: Vec<Vec4>,
    /// The smoothing group of each triangle, or none at all: normals are joined inside of a group; in 0 they are flat.
    pub smoothing: Vec<u32>,
    /// Triangles that name what they wear, by the name of the material; none is in two of them.
    pub materials: Vec<FaceSet>,
    /// Groups and objects by their name.
    pub groups: Vec<FaceSet>,
    pub(super) computed: Computed,
}

/// Some triangles of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceSet {
    /// As the file names it.
    pub name: Text,
    /// Number of the first triangle of each run and of the one behind it, rising.
    pub runs: Vec<[u32; 2]>,
}

impl FaceSet {
    /// Adds the triangles from one number to before another, at the end.
    pub fn push(&mut self, start: u32, end: u32) {
        match self.runs.last_mut() {
            Some(last) if last[1] == start => last[1] = end,
            _ if start < end => self.runs.push([start, end]),
            _ => {}
        }
    }

    /// Numbers of its triangles.
    pub fn triangles(&self) -> impl Iterator<Item = u32> {
        self.runs.iter().flat_map(|[start, end]| *start..*end)
    }
}

/// Triangles of a mesh that wear one material.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The material that the file names for them; `None` for that of the entity.
    pub material: Option<Text>,
    /// The geometry of the file.
    pub data: Arc<MeshData>,
    /// Whether they are shaded by [`MeshData::shading_normals`].
    pub smooth: bool,
}

/// Which normals are computed where the data have none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Smoothing {
    Nowhere,
    Everywhere,
    /// Inside of the smoothing groups of the data.
    Groups,
    /// Over edges at which the surface turns by no more than this, in degrees.
    UpTo(f64),
}

/// What the pieces of a mesh follow from, beside its data.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    pub(super) group: Option<Text>,
    pub(super) smoothing: Smoothing,
    pub(super) materials: bool,
}

/// Boxes around the vertices of a mesh along each axis.
const BOXES: u8 = 12;

/// What is computed on first use; it follows from the rest and takes no part in comparisons.
#[derive(Debug, Default)]
pub(super) struct Computed {
    normals: OnceLock<Vec<Vec3>>,
    digest: OnceLock<Digest>,
    boxes: OnceLock<Vec<[Vec3; 2]>>,
    lacks_normals: OnceLock<bool>,
    lacks_uvs: OnceLock<bool>,
    checked: OnceLock<Result<(), Invalid>>,
    pub pieces: Mutex<Vec<(Recipe, Arc<[Piece]>)>>,
}

impl PartialEq for Computed {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Clone for Computed {
    fn clone(&self) -> Self {
        Computed::default()
    }
}

impl MeshData {
    /// Stands for missing texture coordinates; a number, so that equal meshes are equal.
    pub const NO_UV: Vec2 = Vec2::INFINITY;

    /// Whether the triangles enclose an inside: every edge is run along once each way. Vertices in one place count as one.
    pub fn encloses(&self) -> bool {
        let place = |i: u32| self.vertices[i as usize].to_array().map(|x| (x + 0.0).to_bits());
        let mut open: FxHashMap<([u32; 3], [u32; 3]), i32> = FxHashMap::default();
        for [a, b, c] in self.triangles.iter().map(|triangle| triangle.map(place)) {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if from < to {
                    *open.entry((from, to)).or_default() += 1;
                } else {
                    *open.entry((to, from)).or_default() -= 1;
                }
            }
        }
        open.values().all(|runs| *runs == 0)
    }

    /// Whether a point of local space is in what the triangles enclose: a line out of it goes through an odd number of
    /// them.
    pub fn holds(&self, point: DVec3) -> bool {
        // No edge of what people build runs along it.
        let way = DVec3::new(0.294_117, 0.871_331, 0.392_711);
        let from = point - self.origin;
        let is_met = |triangle: &&[u32; 3]| {
            let [a, b, c] = triangle.map(|i| self.vertices[i as usize].as_dvec3() - from);
            let sides = [a.cross(b).dot(way), b.cross(c).dot(way), c.cross(a).dot(way)];
            let is_through = sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0);
            let normal = (b - a).cross(c - a);
            is_through && normal.dot(a) * normal.dot(way) > 0.0
        };
        self.triangles.iter().filter(is_met).count() % 2 == 1 && self.encloses()
    }

    /// A mesh without texture coordinates and colours. `vertices` and `normals` (as many, unit, or none) are in the
    /// space of the mesh; triangles name three vertices each, counter-clockwise as seen from the front.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>, normals: Vec<Vec3>) -> Self {
        MeshData { vertices, triangles, normals, ..MeshData::default() }
    }

    /// The mesh with texture coordinates.
    pub fn with_uvs(self, uvs: Vec<Vec2>) -> Self {
        MeshData { uvs, ..self }
    }

    /// Positions, local space.
    pub fn points(&self) -> impl Iterator<Item = DVec3> {
        self.vertices.iter().map(|vertex| vertex.as_dvec3() + self.origin)
    }

    /// The first or the second texture coordinates.
    pub fn uv_set(&self, second: bool) -> &[Vec2] {
        if second { &self.second_uvs } else { &self.uvs }
    }

    /// The mesh with its vertices elsewhere: one position each, and one normal each where it has any.
    pub fn moved(&self, vertices: Vec<Vec3>, normals: Vec<Vec3>) -> Self {
        MeshData { vertices, normals, ..self.clone() }
    }

    /// The triangles of a group or an object.
    pub fn group(&self, name: &str) -> Option<&FaceSet> {
        self.groups.iter().find(|set| &*set.name == name)
    }

    /// The mesh on its way to another of the same triangles, `share` of 0 to 1 and beyond; `None` if they are not the same.
    pub fn toward(&self, other: &MeshData, share: f32) -> Option<MeshData> {
        let is_same = self.triangles == other.triangles
            && self.vertices.len() == other.vertices.len()
            && self.normals.len() == other.normals.len();
        is_same.then(|| {
            let step = |(a, b): (&Vec3, &Vec3)| *a + (*b - *a) * share;
            let apart = (other.origin - self.origin).as_vec3();
            let there = other.vertices.iter().map(|v| *v + apart);
            let mut moved = self.clone();
            moved.vertices = self.vertices.iter().zip(there).map(|(a, b)| step((a, &b))).collect();
            moved.normals = self.normals.iter().zip(&other.normals).map(step).collect();
            moved
        })
    }

    /// Other triangles, which are in no group and wear nothing of their own.
    pub(super) fn put_triangles(&mut self, triangles: Vec<[u32; 3]>) {
        self.triangles = triangles;
        self.smoothing.clear();
        self.materials.clear();
        self.groups.clear();
    }

    pub(super) fn forget_computed(&mut self) {
        self.computed = Computed::default();
    }

    /// The normals given, or else computed ones: one per vertex.
    pub fn shading_normals(&self) -> &[Vec3] {
        if self.normals.is_empty() {
            self.computed.normals.get_or_init(|| self.smooth_normals())
        } else {
            &self.normals
        }
    }

    /// Whether all of it is in range: looked at once, however many entities share it.
    pub(super) fn checked(&self) -> Result<(), Invalid> {
        self.computed.checked.get_or_init(|| check_data(self)).clone()
    }

    /// Whether some vertices have no shading normal, though others do.
    pub(super) fn lacks_normals(&self) -> bool {
        *self.computed.lacks_normals.get_or_init(|| self.normals.contains(&Vec3::ZERO))
    }

    /// Whether some vertices have no texture coordinates.
    pub fn lacks_uvs(&self) -> bool {
        *self.computed.lacks_uvs.get_or_init(|| self.uvs.is_empty() || self.uvs.contains(&Self::NO_UV))
    }

    /// The digest of all that the mesh is made of.
    pub fn digest(&self) -> Digest {
        *self.computed.digest.get_or_init(|| {
            let MeshData { vertices, triangles, normals, uvs, second_uvs, colors, .. } = self;
            let MeshData { smoothing, materials, groups, origin, computed: _, .. } = self;
            let mut hasher = Hasher::default();
            if *origin != DVec3::ZERO {
                origin.to_array().into_iter().for_each(|x| hasher.number(x));
            }
            for points in [vertices, normals] {
                hasher.word(points.len() as u64);
                points.iter().flat_map(|p| p.to_array()).for_each(|x| hasher.bytes(&x.to_bits().to_le_bytes()));
            }
            for uvs in [uvs, second_uvs] {
                hasher.word(uvs.len() as u64);
                uvs.iter().flat_map(|uv| uv.to_array()).for_each(|x| hasher.bytes(&x.to_bits().to_le_bytes()));
            }
            hasher.word(colors.len() as u64);
            colors.iter().flat_map(|c| c.to_array()).for_each(|x| hasher.bytes(&x.to_bits().to_le_bytes()));
            hasher.word(triangles.len() as u64);
            triangles.iter().flatten().for_each(|i| hasher.bytes(&i.to_le_bytes()));
            hasher.word(smoothing.len() as u64);
            smoothing.iter().for_each(|i| hasher.bytes(&i.to_le_bytes()));
            for sets in [materials, groups] {
                hasher.word(sets.len() as u64);
                for set in sets {
                    hasher.text(&set.name);
                    hasher.word(set.runs.len() as u64);
                    set.runs.iter().flatten().for_each(|i| hasher.bytes(&i.to_le_bytes()));
                }
            }
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
    pub(super) fn smooth_normals(&self) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.vertices.len()];
        for &[a, b, c] in &self.triangles {
            let weighted = self.area_normal([a, b, c]);
            for corner in [a, b, c] {
                sums[corner as usize] += weighted;
            }
        }
        self.join_seams(&mut sums);
        sums.into_iter().map(|n| n.try_normalize().unwrap_or(Vec3::Y)).collect()
    }

    /// The normal of a triangle, as long as twice its area.
    pub(super) fn area_normal(&self, corners: [u32; 3]) -> Vec3 {
        let [a, b, c] = corners.map(|i| self.vertices[i as usize]);
        (b - a).cross(c - a)
    }

    /// Vertices at one place get one normal: neither the seam of a texture nor that of a ball that was rolled from a sheet
    /// is a crease.
    fn join_seams(&self, sums: &mut [Vec3]) {
        let mut joined: FxHashMap<[u32; 3], Vec3> = FxHashMap::default();
        for (v, sum) in self.vertices.iter().zip(sums.iter()) {
            *joined.entry(place(*v)).or_default() += *sum;
        }
        for (v, sum) in self.vertices.iter().zip(sums) {
            *sum = joined[&place(*v)];
        }
    }
}

/// What two vertices at one place have in common.
pub(super) fn place(v: Vec3) -> [u32; 3] {
    v.to_array().map(|x| (x + 0.0).to_bits())
}
