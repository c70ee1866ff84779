//! Normals of corners: joined inside of smoothing groups, or over edges that are shallow enough.

use glam::Vec3;
use rustc_hash::FxHashMap;

use super::MeshData;
use super::data::place;
use crate::base::math::sin_cos_degrees;

/// A normal for each corner of each triangle; corners share them.
pub struct CornerNormals {
    pub normals: Vec<Vec3>,
    pub of_triangle: Vec<[u32; 3]>,
}

impl CornerNormals {
    /// Joined over all triangles of a smoothing group that meet at a point; zero in group 0, which is flat.
    pub fn of_groups(data: &MeshData) -> Self {
        let mut sums = vec![Vec3::ZERO];
        let mut known: FxHashMap<([u32; 3], u32), u32> = FxHashMap::default();
        let mut of_triangle = Vec::with_capacity(data.triangles.len());
        for (t, corners) in data.triangles.iter().enumerate() {
            let group = data.smoothing.get(t).copied().unwrap_or(0);
            let weighted = data.area_normal(*corners);
            of_triangle.push(corners.map(|v| {
                if group == 0 {
                    return 0;
                }
                let at = *known.entry((place(data.vertices[v as usize]), group)).or_insert_with(|| {
                    sums.push(Vec3::ZERO);
                    sums.len() as u32 - 1
                });
                sums[at as usize] += weighted;
                at
            }));
        }
        CornerNormals { normals: unit(sums), of_triangle }
    }

    /// Joined from triangle to triangle over every edge at which the surface turns by no more than `degrees`.
    pub fn up_to(data: &MeshData, degrees: f64) -> Self {
        // Flat quads must hold together at 0 degrees, whatever their corners were rounded to.
        let least = (sin_cos_degrees(degrees).1 - 1e-6) as f32;
        let mut places: FxHashMap<[u32; 3], u32> = FxHashMap::default();
        let points: Vec<u32> = data
            .vertices
            .iter()
            .map(|v| {
                let next = places.len() as u32;
                *places.entry(place(*v)).or_insert(next)
            })
            .collect();
        let normals: Vec<Vec3> = data.triangles.iter().map(|t| data.area_normal(*t)).collect();
        let mut islands = Islands::new(3 * data.triangles.len());
        // The last corner that an edge was seen to start from, by the points of its ends.
        let mut edges: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        for (t, corners) in data.triangles.iter().enumerate() {
            for i in 0..3 {
                let ends = [corners[i], corners[(i + 1) % 3]].map(|v| points[v as usize]);
                let (key, turned) = if ends[0] <= ends[1] { (ends, false) } else { ([ends[1], ends[0]], true) };
                let here = [3 * t + i, 3 * t + (i + 1) % 3];
                let low_first = if turned { [here[1], here[0]] } else { here };
                let packed = (3 * t + i) as u32;
                let Some(other) = edges.insert(key, packed) else { continue };
                let (u, j) = (other as usize / 3, other as usize % 3);
                let (a, b) = (normals[t], normals[u]);
                if a.dot(b) < least * (a.length() * b.length()) {
                    continue;
                }
                let there = [3 * u + j, 3 * u + (j + 1) % 3];
                let starts_low = points[data.triangles[u][j] as usize] == key[0];
                let there = if starts_low { there } else { [there[1], there[0]] };
                islands.join(low_first[0], there[0]);
                islands.join(low_first[1], there[1]);
            }
        }
        let mut number = vec![u32::MAX; 3 * data.triangles.len()];
        let mut sums = Vec::new();
        let mut of_triangle = Vec::with_capacity(data.triangles.len());
        for (t, weighted) in normals.iter().enumerate() {
            of_triangle.push(std::array::from_fn(|i| {
                let root = islands.root(3 * t + i);
                if number[root] == u32::MAX {
                    number[root] = sums.len() as u32;
                    sums.push(Vec3::ZERO);
                }
                sums[number[root] as usize] += *weighted;
                number[root]
            }));
        }
        CornerNormals { normals: unit(sums), of_triangle }
    }
}

/// Sums as unit vectors; those of nothing stay zero, and are shaded flat.
fn unit(sums: Vec<Vec3>) -> Vec<Vec3> {
    sums.into_iter().map(Vec3::normalize_or_zero).collect()
}

/// Sets that are joined one by one.
struct Islands(Vec<u32>);

impl Islands {
    fn new(count: usize) -> Self {
        Islands((0..count as u32).collect())
    }

    fn root(&mut self, mut at: usize) -> usize {
        while self.0[at] as usize != at {
            self.0[at] = self.0[self.0[at] as usize];
            at = self.0[at] as usize;
        }
        at
    }

    /// The smaller number stays the root, so that the result does not depend on the order of joins.
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b) as u32;
    }
}
