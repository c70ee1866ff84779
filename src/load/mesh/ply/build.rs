//! Faces of a PLY file as triangles.

use glam::{Vec2, Vec3, Vec4};
use rustc_hash::FxHashMap;

use super::Row;
use super::header::PlyHeader;
use crate::base::color::srgb_decode;
use crate::base::diagnostics::Diagnostic;
use crate::base::limits;
use crate::components::record::ranges::FARTHEST;
use crate::components::{FaceSet, MeshData};
use crate::load::mesh::polygon;
use crate::load::mesh::source::{Notes, SourceFile};

/// A linear colour from shares of a full one.
pub fn linear(color: Vec4, decoded: bool) -> Vec4 {
    let share = |x: f32| if x >= 0.0 { x.min(1e6) } else { 0.0 };
    let value = |x: f32| if decoded && x <= 1.0 { srgb_decode(share(x)) } else { share(x) };
    Vec4::new(value(color.x), value(color.y), value(color.z), share(color.w).min(1.0))
}

/// Faces in the order of the file, until the vertices are known.
pub struct Faces {
    vertices: usize,
    decoded: bool,
    /// Whether faces have texture coordinates, or colours, of their own.
    pub has_uvs: bool,
    pub has_colors: bool,
    corners: Vec<u32>,
    /// One pair for each corner, where faces have them.
    uvs: Vec<Vec2>,
    faces: Vec<PlyFace>,
    triangles: usize,
}

struct PlyFace {
    /// Number of its first corner, and of the one behind its last.
    corners: [usize; 2],
    color: Vec4,
    texture: i64,
}

impl Faces {
    pub fn new(vertices: usize, decoded: bool) -> Self {
        Faces {
            vertices,
            decoded,
            has_uvs: false,
            has_colors: false,
            corners: Vec::new(),
            uvs: Vec::new(),
            faces: Vec::new(),
            triangles: 0,
        }
    }

    /// Triangles so far.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    fn corner(&self, corner: i64) -> Result<u32, String> {
        let known = usize::try_from(corner).ok().filter(|i| *i < self.vertices);
        known
            .map(|i| i as u32)
            .ok_or_else(|| format!("vertex {corner} does not exist; there are {}, numbered from 0", self.vertices))
    }

    /// Adds a face.
    ///
    /// # Errors
    /// Why it is none.
    pub fn add(&mut self, row: &Row) -> Result<(), String> {
        let count = row.corners.len();
        if count > limits::POLYGON_VERTICES {
            return Err(format!("a face has {count} corners"));
        }
        let start = self.corners.len();
        for corner in &row.corners {
            let corner = self.corner(*corner)?;
            self.corners.push(corner);
        }
        if self.has_uvs {
            let pairs = row.corner_uvs.chunks_exact(2).map(Vec2::from_slice);
            let good = |uv: Vec2| if uv.abs().max_element() < 1e9 { uv } else { MeshData::NO_UV };
            self.uvs.extend(pairs.map(good).chain(std::iter::repeat(MeshData::NO_UV)).take(count));
        }
        let color = if self.has_colors { linear(row.color, self.decoded) } else { Vec4::ONE };
        self.faces.push(PlyFace { corners: [start, start + count], color, texture: row.texture });
        self.triangles += count.saturating_sub(2);
        Ok(())
    }

    /// Adds strips: each corner makes a triangle with the two before it, every other one turned over; -1 ends a strip.
    ///
    /// # Errors
    /// Why it is none.
    pub fn add_strips(&mut self, corners: &[i64]) -> Result<(), String> {
        for strip in corners.split(|corner| *corner < 0) {
            for (i, triple) in strip.windows(3).enumerate() {
                let [a, b, c] = [self.corner(triple[0])?, self.corner(triple[1])?, self.corner(triple[2])?];
                // Strips turn corners by naming one twice.
                if a == b || b == c || a == c {
                    continue;
                }
                let start = self.corners.len();
                self.corners.extend(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
                if self.has_uvs {
                    self.uvs.extend([MeshData::NO_UV; 3]);
                }
                self.faces.push(PlyFace { corners: [start, start + 3], color: Vec4::ONE, texture: 0 });
                self.triangles += 1;
            }
        }
        Ok(())
    }

    /// The mesh of these faces over the vertices of `data`.
    pub fn build(
        self,
        source: SourceFile,
        header: &PlyHeader,
        mut data: MeshData,
        notes: &mut Notes,
    ) -> Result<MeshData, Diagnostic> {
        let has_uvs = self.has_uvs && data.uvs.is_empty();
        let has_colors = self.has_colors && data.colors.is_empty();
        for (kind, both) in [("texcoord", self.has_uvs && !has_uvs), ("colours", self.has_colors && !has_colors)] {
            if both {
                let message = format!("{kind} of faces are not used, for vertices have them too");
                notes.add(kind, || source.whole(message).into_warning());
            }
        }
        let is_near = |v: &Vec3| v.to_array().iter().all(|x| x.abs() <= FARTHEST as f32);
        if !data.vertices.iter().all(is_near) {
            let strange = |corner: &&u32| !is_near(&data.vertices[**corner as usize]);
            if let Some(corner) = self.corners.iter().find(strange) {
                let v = data.vertices[*corner as usize];
                let message = format!("vertex {corner} is used by a face and stands at ({}, {}, {})", v.x, v.y, v.z);
                return Err(source.whole(message));
            }
            // What no face uses cannot be seen, and needs no place.
            data.vertices.iter_mut().filter(|v| !is_near(v)).for_each(|v| *v = Vec3::ZERO);
        }
        let mut splitter = (has_uvs || has_colors).then(|| Splitter::new(&data, has_uvs, has_colors));
        let mut sets: FxHashMap<i64, Vec<[u32; 2]>> = FxHashMap::default();
        let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(self.triangles);
        for face in &self.faces {
            let [start, end] = face.corners;
            let corners = &self.corners[start..end];
            let points: Vec<_> = corners.iter().map(|i| data.vertices[*i as usize].as_dvec3()).collect();
            let first = triangles.len() as u32;
            polygon::triangles(&points, |t| {
                triangles.push(t.map(|i| match &mut splitter {
                    None => corners[i],
                    Some(splitter) => {
                        let uv = if has_uvs { self.uvs[start + i] } else { MeshData::NO_UV };
                        splitter.vertex(corners[i], uv, face.color)
                    }
                }));
            });
            if header.texture(face.texture).is_some() {
                let runs = sets.entry(face.texture).or_default();
                match runs.last_mut() {
                    Some(last) if last[1] == first => last[1] = triangles.len() as u32,
                    _ => runs.push([first, triangles.len() as u32]),
                }
            }
        }
        let mut data = match splitter {
            Some(splitter) => splitter.finish(),
            None => data,
        };
        data.triangles = triangles;
        let mut numbers: Vec<i64> = sets.keys().copied().collect();
        numbers.sort_unstable();
        let set = |number: i64| {
            let name = header.texture(number).unwrap_or_default().into();
            let runs = sets.get(&number).cloned().unwrap_or_default();
            FaceSet { name, runs: runs.into_iter().filter(|[start, end]| start < end).collect() }
        };
        data.materials = numbers.into_iter().map(set).filter(|set| !set.runs.is_empty()).collect();
        Ok(data)
    }
}

/// Makes a vertex of its own for each corner at which faces differ.
struct Splitter<'a> {
    data: &'a MeshData,
    has_uvs: bool,
    has_colors: bool,
    known: FxHashMap<(u32, [u32; 6]), u32>,
    /// Vertex, texture coordinates and colour of each.
    corners: Vec<(u32, Vec2, Vec4)>,
}

impl<'a> Splitter<'a> {
    fn new(data: &'a MeshData, has_uvs: bool, has_colors: bool) -> Self {
        Splitter { data, has_uvs, has_colors, known: FxHashMap::default(), corners: Vec::new() }
    }

    fn vertex(&mut self, vertex: u32, uv: Vec2, color: Vec4) -> u32 {
        let [u, v] = uv.to_array().map(f32::to_bits);
        let [r, g, b, a] = color.to_array().map(f32::to_bits);
        let next = self.corners.len() as u32;
        let number = *self.known.entry((vertex, [u, v, r, g, b, a])).or_insert(next);
        if number == next {
            self.corners.push((vertex, uv, color));
        }
        number
    }

    fn finish(self) -> MeshData {
        let Splitter { data, has_uvs, has_colors, corners, .. } = self;
        let vertex = || corners.iter().map(|(vertex, ..)| *vertex as usize);
        let normals = vertex().filter_map(|v| data.normals.get(v).copied()).collect();
        let mut split = MeshData::new(vertex().map(|v| data.vertices[v]).collect(), Vec::new(), normals);
        split.origin = data.origin;
        split.uvs = match has_uvs {
            true => corners.iter().map(|(_, uv, _)| *uv).collect(),
            false => vertex().filter_map(|v| data.uvs.get(v).copied()).collect(),
        };
        split.colors = match has_colors {
            true => corners.iter().map(|(_, _, color)| *color).collect(),
            false => vertex().filter_map(|v| data.colors.get(v).copied()).collect(),
        };
        split
    }
}
