//! Records that are shapes.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::lexer::Word;
use super::{NffReader, Stop};
use crate::base::limits;
use crate::components::*;
use crate::load::mesh::{self, polygon};

impl NffReader<'_> {
    /// Shapes of a fixed count of numbers.
    pub fn simple_shape(&mut self, word: Word) {
        match word.text {
            "s" => {
                if let Some([x, y, z, radius]) = self.exactly(word) {
                    self.add(word, Sphere { center: DVec3::new(x, y, z), radius }, None);
                }
            }
            "sm" | "ms" => self.moving_sphere(word),
            "c" => self.cone(word),
            "pl" => {
                if let Some(n) = self.exactly::<9>(word) {
                    let [p, q, r] = [0, 3, 6].map(|i| DVec3::new(n[i], n[i + 1], n[i + 2]));
                    let normal = (q - p).cross(r - p);
                    self.add(word, Plane { point: p, normal: normal.normalize_or_zero() }, None);
                }
            }
            "box" | "aabb" => {
                self.p3f |= word.text == "box";
                if let Some(n) = self.exactly::<6>(word) {
                    let (a, b) = (DVec3::new(n[0], n[1], n[2]), DVec3::new(n[3], n[4], n[5]));
                    self.add(word, AABox { min: a.min(b), max: a.max(b) }, None);
                }
            }
            _ => self.solid(word),
        }
    }

    /// Three layouts: two centres and a radius; with times after the radius; with times before it.
    fn moving_sphere(&mut self, word: Word) {
        self.read_numbers();
        let n = self.numbers.clone();
        let (radius, start, end) = match n.len() {
            7 => (n[6], 0.0, 1.0),
            9 if n[8] <= n[7] && n[6] < n[7] && n[8] > 0.0 => {
                self.warn(word, "times do not follow each other; read as start, end, radius");
                (n[8], n[6], n[7])
            }
            9 => (n[6], n[7], n[8]),
            count => return self.short(word, format!("`{}` takes 7 or 9 numbers, not {count}", word.text)),
        };
        let [from, to] = [0, 3].map(|i| DVec3::new(n[i], n[i + 1], n[i + 2]));
        let motion = Motion { displacement: to - from, start, end };
        self.add(word, Sphere { center: from, radius }, Some(motion));
    }

    fn cone(&mut self, word: Word) {
        let Some(n) = self.exactly::<8>(word) else { return };
        let (base, apex) = (DVec3::new(n[0], n[1], n[2]), DVec3::new(n[4], n[5], n[6]));
        let (base_radius, apex_radius) = (n[3], n[7]);
        if base_radius == apex_radius {
            self.add(word, Cylinder { base, apex, radius: base_radius, capped: false }, None);
        } else {
            self.add(word, Cone { base, base_radius, apex, apex_radius, capped: false }, None);
        }
    }

    /// A platonic solid in a sphere.
    fn solid(&mut self, word: Word) {
        let Some([x, y, z, radius]) = self.exactly(word) else { return };
        let g = (1.0 + 5.0f64.sqrt()) / 2.0;
        let corners: Vec<DVec3> = match word.text {
            "tet" => [[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]].map(|c| c.map(f64::from).into()).to_vec(),
            "oct" => [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|a| [a, -a]).collect(),
            "hex" => {
                (0..8).map(|i| DVec3::from_array([1, 2, 4].map(|b| if i & b == 0 { -1.0 } else { 1.0 }))).collect()
            }
            _ => {
                let cube = (0..8).map(|i| DVec3::from_array([1, 2, 4].map(|b| if i & b == 0 { -1.0 } else { 1.0 })));
                let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
                let golden = signs.into_iter().flat_map(|(a, b)| {
                    let (p, q) = (a / g, b * g);
                    [DVec3::new(0.0, p, q), DVec3::new(p, q, 0.0), DVec3::new(q, 0.0, p)]
                });
                cube.chain(golden).collect()
            }
        };
        let center = DVec3::new(x, y, z);
        let points: Vec<Vec3> = corners.iter().map(|c| (center + c.normalize() * radius).as_vec3()).collect();
        let triangles = hull(&points);
        let data = MeshData::new(points, triangles, Vec::new());
        self.add(word, Mesh { data: Arc::new(data), ..Mesh::default() }, None);
    }

    /// `p`, `pp` and `tpp`: a count, then that many vertices with what belongs to each.
    pub fn polygon(&mut self, word: Word) -> Result<(), Stop> {
        self.read_numbers();
        let per_vertex = match word.text {
            "p" => 3,
            "pp" => 6,
            _ => 8,
        };
        let n = std::mem::take(&mut self.numbers);
        let count = self.count(word, n.first(), "vertices", n.len().saturating_sub(1) / per_vertex)?;
        if n.len() > 1 + count * per_vertex {
            let extra = n.len() - 1 - count * per_vertex;
            self.warn(word, format!("`{}` has {extra} numbers more than its count asks for", word.text));
        }
        if count < 3 {
            self.warn(word, format!("a polygon of {count} vertices; skipped"));
            return Ok(());
        }
        if count > limits::POLYGON_VERTICES {
            self.error(word, format!("a polygon of more than {} vertices", limits::POLYGON_VERTICES));
            return Err(Stop);
        }
        let vertex = |i: usize, offset: usize| {
            let at = 1 + i * per_vertex + offset;
            DVec3::new(n[at], n[at + 1], n[at + 2])
        };
        let points: Vec<DVec3> = (0..count).map(|i| vertex(i, 0)).collect();
        let normals: Vec<DVec3> = if per_vertex > 3 { (0..count).map(|i| vertex(i, 3)).collect() } else { Vec::new() };
        if count == 3 {
            let shading = (!normals.is_empty()).then(|| Box::new([normals[0], normals[1], normals[2]]));
            self.add(word, Triangle { vertices: [points[0], points[1], points[2]], normals: shading, uvs: None }, None);
        } else {
            let data = MeshData::new(
                points.iter().map(|v| v.as_vec3()).collect(),
                polygon::clipped(&points),
                normals.iter().map(|v| v.as_vec3()).collect(),
            );
            self.add(word, Mesh { data: Arc::new(data), ..Mesh::default() }, None);
        }
        self.numbers = n;
        Ok(())
    }

    /// A count that the file declares, if its numbers bear it out: `there` is how many there are.
    fn count(&mut self, word: Word, declared: Option<&f64>, what: &str, there: usize) -> Result<usize, Stop> {
        let keyword = word.text;
        match declared {
            Some(d) if *d >= 0.0 && d.fract() == 0.0 && *d <= there as f64 => Ok(*d as usize),
            Some(d) if *d >= 0.0 && d.fract() == 0.0 => {
                self.error(word, format!("`{keyword}` declares {d} {what}, but there are numbers for {there}"));
                Err(Stop)
            }
            _ => {
                self.error(word, format!("`{keyword}` needs a count of {what}"));
                Err(Stop)
            }
        }
    }

    /// `mesh`: counts of vertices and triangles, vertices, indices from 1 or from the end.
    pub fn mesh(&mut self, word: Word) -> Result<(), Stop> {
        self.p3f = true;
        self.read_numbers();
        let n = std::mem::take(&mut self.numbers);
        let vertices = self.count(word, n.first(), "vertices", n.len().saturating_sub(2) / 3)?;
        let rest = n.len().saturating_sub(2 + 3 * vertices);
        let declared = self.count(word, n.get(1), "triangles", rest / 3)?;
        let point = |i: usize| Vec3::new(n[2 + 3 * i] as f32, n[3 + 3 * i] as f32, n[4 + 3 * i] as f32);
        let mut triangles = Vec::with_capacity(declared);
        for t in 0..declared {
            let at = 2 + 3 * vertices + 3 * t;
            let corner = |x: f64| {
                let index = if x < 0.0 { x + vertices as f64 } else { x - 1.0 };
                (index >= 0.0 && index < vertices as f64 && index.fract() == 0.0).then_some(index as u32)
            };
            let corners = [n[at], n[at + 1], n[at + 2]].map(corner);
            let [Some(a), Some(b), Some(c)] = corners else {
                let message = format!("triangle {} names a vertex that is not there; there are {vertices}", t + 1);
                self.error(word, message);
                return Err(Stop);
            };
            triangles.push([a, b, c]);
        }
        let data = MeshData::new((0..vertices).map(point).collect(), triangles, Vec::new());
        self.add(word, Mesh { data: Arc::new(data), ..Mesh::default() }, None);
        self.numbers = n;
        Ok(())
    }

    pub fn ply(&mut self, word: Word) {
        let Some(name) = self.lexer.next() else { return };
        match mesh::load(self.base, name.text, false) {
            Ok(loaded) => {
                let (data, warnings) = loaded.faces();
                warnings.into_iter().for_each(|warning| self.push(warning));
                self.add(word, Mesh { file: Some(name.text.into()), data: Arc::new(data), ..Mesh::default() }, None);
            }
            Err(problem) => {
                let place = problem.place.as_ref().filter(|place| place.line > 0);
                let place = place.map_or(String::new(), |place| format!(", line {}", place.line));
                self.warn(name, format!("{}{place}: {}; skipped", name.short(), problem.message));
            }
        }
    }
}

/// Faces of the convex hull of a few points, outwards; several triangles where a face has more corners.
fn hull(points: &[Vec3]) -> Vec<[u32; 3]> {
    let p: Vec<DVec3> = points.iter().map(|v| v.as_dvec3()).collect();
    let center = p.iter().sum::<DVec3>() / p.len() as f64;
    let size = p.iter().map(|q| q.distance(center)).fold(0.0, f64::max);
    let mut faces: Vec<(DVec3, Vec<u32>)> = Vec::new();
    for i in 0..p.len() {
        for j in i + 1..p.len() {
            for k in j + 1..p.len() {
                let normal = (p[j] - p[i]).cross(p[k] - p[i]).normalize_or_zero();
                let normal = if normal.dot(p[i] - center) < 0.0 { -normal } else { normal };
                let height = |q: &DVec3| (*q - p[i]).dot(normal);
                let outside = p.iter().any(|q| height(q) > 1e-5 * size);
                if outside || normal == DVec3::ZERO || faces.iter().any(|(known, _)| known.dot(normal) > 0.9999) {
                    continue;
                }
                let on = (0..p.len() as u32).filter(|q| height(&p[*q as usize]).abs() <= 1e-5 * size);
                faces.push((normal, on.collect()));
            }
        }
    }
    faces.into_iter().flat_map(|(normal, corners)| fan(&p, normal, corners)).collect()
}

/// Corners of one convex face, sorted around its normal, as triangles.
fn fan(points: &[DVec3], normal: DVec3, mut corners: Vec<u32>) -> Vec<[u32; 3]> {
    let at = |i: u32| points[i as usize];
    let middle = corners.iter().map(|i| at(*i)).sum::<DVec3>() / corners.len() as f64;
    let right = (at(corners[0]) - middle).normalize_or_zero();
    let up = normal.cross(right);
    let angle = |i: u32| libm::atan2((at(i) - middle).dot(up), (at(i) - middle).dot(right));
    corners.sort_by(|a, b| angle(*a).total_cmp(&angle(*b)));
    (2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]).collect()
}
