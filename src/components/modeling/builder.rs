//! A mesh while it is made, and what its makers share.

use glam::{DVec2, DVec3};

use crate::components::mesh::MeshData;

/// A mesh while it is made.
#[derive(Default)]
pub struct MeshBuilder {
    vertices: Vec<DVec3>,
    uvs: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
}

impl MeshBuilder {
    /// Its number, for triangles.
    pub fn vertex(&mut self, at: DVec3, uv: DVec2) -> u32 {
        self.vertices.push(at);
        self.uvs.push(uv);
        self.vertices.len() as u32 - 1
    }

    /// A triangle, unless it has no area, as at the pole of a ball.
    pub fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|i| self.vertices[i as usize]);
        if (b - a).cross(c - a) != DVec3::ZERO {
            self.triangles.push(corners);
        }
    }

    /// A grid of points, row by row, as quads. The surface faces along (along a row) x (from row to row), or the other way.
    pub fn grid(&mut self, rows: &[Vec<(DVec3, DVec2)>], turned: bool) {
        let first: Vec<Vec<u32>> =
            rows.iter().map(|row| row.iter().map(|(at, uv)| self.vertex(*at, *uv)).collect()).collect();
        for pair in first.windows(2) {
            for i in 1..pair[0].len().min(pair[1].len()) {
                let [a, b, c, d] = [pair[0][i - 1], pair[0][i], pair[1][i], pair[1][i - 1]];
                for [p, q, r] in [[a, b, c], [a, c, d]] {
                    self.triangle(if turned { [p, r, q] } else { [p, q, r] });
                }
            }
        }
    }

    /// What was made.
    pub fn finish(self) -> MeshData {
        let vertices = self.vertices.iter().map(|v| v.as_vec3()).collect();
        let uvs = self.uvs.iter().map(|uv| uv.as_vec2()).collect();
        MeshData::new(vertices, self.triangles, Vec::new()).with_uvs(uvs)
    }
}

/// Twice the signed area of a closed polygon: positive where it runs against the clock.
pub fn double_area(points: &[DVec2]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum()
}
