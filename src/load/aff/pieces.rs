//! Triangles: gathered into meshes as long as the material stays.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;

use super::scan::{AffWord, Scan};
use super::{AffStop, Reader};
use crate::base::digest::Digest;
use crate::base::limits;
use crate::components::{KeyInterpolation, MeshData, MorphData, MorphTarget, Text, Track, TrackProperty};
use crate::load::mesh::polygon;

/// A mesh that is ready.
pub struct OpenPiece {
    pub data: Arc<MeshData>,
    pub material: Text,
    /// Shapes at the times of keys, if it moves.
    pub morph: Option<(Arc<MorphData>, Vec<f64>)>,
}

/// What has been gathered since the last transform.
#[derive(Default)]
pub struct OpenPieces {
    /// In the order in which materials were met.
    loose: Vec<(Text, Gathered)>,
    done: Vec<OpenPiece>,
    moving: Vec<Moving>,
    /// Meshes that were made before: a file that is included twice has them twice.
    known: FxHashMap<Digest, Arc<MeshData>>,
}

#[derive(Default)]
struct Gathered {
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

/// Triangles that move by the same times.
struct Moving {
    material: Text,
    times: Vec<f64>,
    /// Points and normals at each time.
    at: Vec<[Vec<Vec3>; 2]>,
}

/// A corner: point, normal, texture coordinates.
#[derive(Clone, Copy, Default)]
pub struct Corner {
    pub point: DVec3,
    pub normal: Option<DVec3>,
    pub uv: Option<[f64; 2]>,
}

impl OpenPieces {
    fn gather(&mut self, material: Text) -> &mut Gathered {
        let place = self.loose.iter().rposition(|(name, _)| *name == material).unwrap_or_else(|| {
            self.loose.push((material, Gathered::default()));
            self.loose.len() - 1
        });
        &mut self.loose[place].1
    }

    /// All that was gathered, as meshes.
    pub fn take(&mut self) -> Vec<OpenPiece> {
        let mut all = std::mem::take(&mut self.done);
        for (material, gathered) in std::mem::take(&mut self.loose) {
            let data = self.shared(gathered.into_mesh());
            all.push(OpenPiece { data, material, morph: None });
        }
        for moving in std::mem::take(&mut self.moving) {
            all.push(moving.into_piece());
        }
        all
    }

    fn shared(&mut self, data: MeshData) -> Arc<MeshData> {
        self.known.entry(data.digest()).or_insert_with(|| Arc::new(data)).clone()
    }
}

impl Gathered {
    fn push(&mut self, corners: &[Corner], triangles: &[[u32; 3]]) {
        let first = self.points.len() as u32;
        for corner in corners {
            self.points.push(corner.point.as_vec3());
            self.normals.push(corner.normal.map_or(Vec3::ZERO, |n| n.as_vec3()));
            // Here v runs upwards, as there.
            self.uvs.push(corner.uv.map_or(MeshData::NO_UV, |[u, v]| Vec2::new(u as f32, v as f32)));
        }
        self.triangles.extend(triangles.iter().map(|t| t.map(|i| first + i)));
    }

    fn into_mesh(self) -> MeshData {
        let Gathered { points, normals, uvs, triangles } = self;
        let normals = if normals.iter().all(|n| *n == Vec3::ZERO) { Vec::new() } else { normals };
        let uvs = if uvs.iter().all(|uv| *uv == MeshData::NO_UV) { Vec::new() } else { uvs };
        MeshData::new(points, triangles, normals).with_uvs(uvs)
    }
}

impl Moving {
    fn into_piece(self) -> OpenPiece {
        let count = self.at[0][0].len() as u32;
        let triangles = (0..count / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        // The mesh stays at the origin, and each key adds itself by its weight: those of two neighbours add up to 1.
        let nothing = vec![Vec3::ZERO; count as usize];
        let data = Arc::new(MeshData::new(nothing.clone(), triangles, nothing));
        let target = |[points, normals]: [Vec<Vec3>; 2]| MorphTarget { name: Text::default(), points, normals };
        let morph = Arc::new(MorphData::new(self.at.into_iter().map(target).collect()));
        OpenPiece { data, material: self.material, morph: Some((morph, self.times)) }
    }
}

/// The track of the weights of shapes that stand for keys at these times.
pub fn track(node: Text, times: &[f64]) -> Track {
    let one = |i: usize| (0..times.len()).map(move |k| f32::from(u8::from(k == i)));
    Track {
        node,
        property: TrackProperty::Weights,
        interpolation: KeyInterpolation::Linear,
        times: times.iter().map(|t| *t as f32).collect(),
        values: (0..times.len()).flat_map(one).collect(),
        width: times.len(),
    }
}

impl Reader {
    /// `p`, or `pp` with a normal at each corner.
    pub fn polygon(&mut self, scan: &mut Scan, word: AffWord) -> Result<(), AffStop> {
        let patch = word.text == "pp";
        let count = self.count(scan, if patch { 6 } else { 3 })?;
        if count > limits::POLYGON_VERTICES {
            return self.fail(scan, word, format!("a polygon of {count} corners"));
        }
        let mut corners = Vec::with_capacity(count);
        for _ in 0..count {
            let point = self.vector(scan)?;
            let normal = if patch { Some(self.vector(scan)?) } else { None };
            corners.push(Corner { point, normal, uv: None });
        }
        let points: Vec<DVec3> = corners.iter().map(|corner| corner.point).collect();
        let triangles = polygon::clipped(&points);
        let material = self.worn(None);
        self.pieces.gather(material).push(&corners, &triangles);
        Ok(())
    }

    /// `tt`, or `ttp` with a normal at each corner: a triangle with a texture.
    pub fn textured(&mut self, scan: &mut Scan, word: AffWord) -> Result<(), AffStop> {
        let name = self.word(scan, "the name of a texture")?;
        let texture = self.texture(scan, name);
        let mut corners = [Corner::default(); 3];
        for corner in &mut corners {
            corner.point = self.vector(scan)?;
            if word.text == "ttp" {
                corner.normal = Some(self.vector(scan)?);
            }
            corner.uv = Some(self.numbers(scan)?);
        }
        let material = self.worn(texture);
        self.pieces.gather(material).push(&corners, &[[0, 1, 2]]);
        Ok(())
    }

    /// `tpa`: a triangle that is another one at each of its times.
    pub fn moving_triangle(&mut self, scan: &mut Scan, word: AffWord) -> Result<(), AffStop> {
        let count = self.count(scan, 19)?;
        if count == 0 {
            return self.fail(scan, word, "`tpa` needs a time at least");
        }
        let mut keys = Vec::with_capacity(count);
        for _ in 0..count {
            let time = self.number(scan)?;
            let mut row = [[Vec3::ZERO; 3]; 2];
            let [points, normals] = &mut row;
            for (point, normal) in points.iter_mut().zip(normals) {
                *point = self.vector(scan)?.as_vec3();
                *normal = self.vector(scan)?.as_vec3();
            }
            keys.push((time, row));
        }
        let (times, rows): (Vec<f64>, Vec<_>) = self.rising(scan, word, keys, |(time, _)| *time).into_iter().unzip();
        let count = times.len();
        let material = self.worn(None);
        let moving = &mut self.pieces.moving;
        let place = moving.iter().rposition(|m| m.material == material && m.times == times).unwrap_or_else(|| {
            moving.push(Moving { material, times, at: vec![Default::default(); count] });
            moving.len() - 1
        });
        for (at, row) in moving[place].at.iter_mut().zip(rows) {
            at[0].extend(row[0]);
            at[1].extend(row[1]);
        }
        Ok(())
    }

    /// `m`: vertices, normals and texture coordinates, each if there are any, and triangles over them.
    pub fn mesh(&mut self, scan: &mut Scan) -> Result<(), AffStop> {
        self.expect(scan, "vertices")?;
        let points = self.vectors(scan)?;
        let (mut normals, mut uvs, mut texture) = (Vec::new(), Vec::new(), None);
        loop {
            let word = self.word(scan, "`triangles`")?;
            match word.text {
                "normals" => normals = self.vectors(scan)?,
                "texturecoords" => {
                    let count = self.count(scan, 2)?;
                    let name = self.word(scan, "the name of a texture")?;
                    texture = self.texture(scan, name);
                    for _ in 0..count {
                        uvs.push(self.numbers::<2>(scan)?);
                    }
                }
                "triangles" => break,
                other => {
                    let message = format!("expected `normals`, `texturecoords` or `triangles`, found `{other}`");
                    return self.fail(scan, word, message);
                }
            }
        }
        let each = 3 * (1 + usize::from(!normals.is_empty()) + usize::from(!uvs.is_empty()));
        let count = self.count(scan, each)?;
        let mut gathered = Gathered::default();
        let mut known: FxHashMap<[u32; 3], u32> = FxHashMap::default();
        for _ in 0..count {
            let mut corners = [[0u32; 3]; 3];
            for (which, there) in [points.len(), normals.len(), uvs.len()].into_iter().enumerate() {
                if which > 0 && there == 0 {
                    continue;
                }
                for corner in &mut corners {
                    corner[which] = self.index(scan, there)?;
                }
            }
            let triangle = corners.map(|[p, n, t]| {
                *known.entry([p, n, t]).or_insert_with(|| {
                    let corner = Corner {
                        point: points[p as usize],
                        normal: normals.get(n as usize).copied(),
                        uv: uvs.get(t as usize).copied(),
                    };
                    gathered.push(&[corner], &[]);
                    gathered.points.len() as u32 - 1
                })
            });
            gathered.triangles.push(triangle);
        }
        let material = self.worn(texture);
        if !gathered.triangles.is_empty() {
            let data = self.pieces.shared(gathered.into_mesh());
            self.pieces.done.push(OpenPiece { data, material, morph: None });
        }
        Ok(())
    }

    fn vectors(&mut self, scan: &mut Scan) -> Result<Vec<DVec3>, AffStop> {
        let count = self.count(scan, 3)?;
        (0..count).map(|_| self.vector(scan)).collect()
    }

    fn index(&mut self, scan: &mut Scan, there: usize) -> Result<u32, AffStop> {
        let word = self.word(scan, "an index")?;
        match word.number().filter(|x| *x == x.trunc() && *x >= 0.0 && *x < there as f64) {
            Some(x) => Ok(x as u32),
            None => self.fail(scan, word, format!("`{}` is none of {there}, numbered from 0", word.short())),
        }
    }
}
