//! Faces: corners that share a vertex where all that stands there is the same, and polygons as triangles.

use glam::{Vec2, Vec3, Vec4};

use super::{Interruption, ObjReader, Pass};
use crate::base::color::srgb_decode;
use crate::base::diagnostics::Diagnostic;
use crate::base::limits;
use crate::components::MeshData;
use crate::components::record::ranges::FARTHEST;
use crate::load::mesh::cursor::Cursor;
use crate::load::mesh::polygon;
use crate::load::mesh::source::Notes;

const NONE: u32 = u32::MAX;

/// The vertices that corners have made so far.
#[derive(Default)]
pub struct Corners {
    /// The newest vertex at each position, and for each vertex the one before it at the same.
    newest: Vec<u32>,
    older: Vec<u32>,
    /// Numbers of the position, the texture coordinates and the normal of each vertex.
    vertices: Vec<[u32; 3]>,
    pub has_smoothing: bool,
}

impl Corners {
    #[inline]
    fn vertex(&mut self, corner: [u32; 3]) -> u32 {
        let position = corner[0] as usize;
        if self.newest.len() <= position {
            self.newest.resize(position + 1, NONE);
        }
        let mut at = self.newest[position];
        while at != NONE {
            if self.vertices[at as usize] == corner {
                return at;
            }
            at = self.older[at as usize];
        }
        let number = self.vertices.len() as u32;
        self.vertices.push(corner);
        self.older.push(std::mem::replace(&mut self.newest[position], number));
        number
    }
}

/// What stands at the vertices of a mesh.
type VertexColumns = (Vec<Vec3>, Vec<Vec3>, Vec<Vec2>, Vec<Vec4>);

impl ObjReader<'_> {
    pub(super) fn face(&mut self, start: usize, notes: &mut Notes) -> Result<(), Interruption> {
        self.polygon.clear();
        loop {
            self.cursor.blanks();
            if self.cursor.at_end() {
                break;
            }
            let corner = self.corner(notes)?;
            let vertex = self.corners.vertex(corner);
            self.polygon.push(vertex);
        }
        let first = self.triangles.len();
        match self.polygon[..] {
            [] | [_] | [_, _] => notes.add("f of two", || {
                let message = "`f` with fewer than three corners has no surface";
                self.source.error(start, start + 1, message).into_warning()
            }),
            [a, b, c] => self.triangles.push([a, b, c]),
            _ => self.polygon(start)?,
        }
        if self.triangles.len() > limits::TRIANGLES {
            let message = format!("the mesh has more than {} triangles", limits::TRIANGLES);
            return Err(Interruption::Wrong(self.source.error(start, start + 1, message)));
        }
        if self.corners.has_smoothing {
            let added = self.triangles.len() - first;
            self.smoothing.extend(std::iter::repeat_n(self.smoothing_group, added));
        }
        Ok(())
    }

    /// A face of four or more corners.
    fn polygon(&mut self, start: usize) -> Result<(), Interruption> {
        if self.polygon.len() > limits::POLYGON_VERTICES {
            let message = format!("a face has {} corners, more than {}", self.polygon.len(), limits::POLYGON_VERTICES);
            return Err(Interruption::Wrong(self.source.error(start, start + 1, message)));
        }
        let place = |vertex: &u32| {
            let position = self.corners.vertices[*vertex as usize][0];
            self.positions[position as usize].as_dvec3()
        };
        let (polygon, triangles) = (&self.polygon, &mut self.triangles);
        let (few, many);
        let points = match polygon[..] {
            [a, b, c, d] => {
                few = [a, b, c, d].map(|vertex| place(&vertex));
                &few[..]
            }
            _ => {
                many = polygon.iter().map(place).collect::<Vec<_>>();
                &many[..]
            }
        };
        polygon::triangles(points, |corners| triangles.push(corners.map(|i| polygon[i])));
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`: numbers from 0, or [`NONE`].
    #[inline]
    fn corner(&mut self, notes: &mut Notes) -> Result<[u32; 3], Interruption> {
        let start = self.cursor.at;
        let mut corner = [NONE; 3];
        for (kind, slot) in corner.iter_mut().enumerate() {
            let here = self.cursor.at;
            match index(&mut self.cursor) {
                Some(0) | None if kind > 0 => {}
                Some(number) => *slot = self.resolve(kind, number, [here, self.cursor.at], notes)?,
                None => return Err(self.no_corner(start)),
            }
            if self.cursor.peek() != Some(b'/') {
                break;
            }
            if kind < 2 {
                self.cursor.at += 1;
            }
        }
        match self.cursor.peek() {
            None | Some(b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c | b'\\' | b'#') => Ok(corner),
            _ => Err(self.no_corner(start)),
        }
    }

    #[cold]
    fn no_corner(&self, start: usize) -> Interruption {
        let end = Cursor { bytes: self.source.bytes, at: start }.word_end();
        let message = format!("`{}` is not a corner of a face", self.source.short(start, end));
        Interruption::Wrong(self.source.error(start, end, message).help("corners are written 1, 1/2, 1//3 or 1/2/3"))
    }

    /// The number from 0 of what a corner names: counted from 1, or backwards from the statement.
    #[inline(always)]
    fn resolve(&self, kind: usize, number: i64, span: [usize; 2], notes: &mut Notes) -> Result<u32, Interruption> {
        let there = match kind {
            0 => self.positions.len(),
            1 => self.uvs.len(),
            _ => self.normals.len(),
        };
        let index = if number > 0 { number - 1 } else { self.seen[kind] as i64 + number };
        if number != 0 && (0..there as i64).contains(&index) {
            return Ok(index as u32);
        }
        self.out_of_reach(kind, number, index, there, span, notes)
    }

    #[cold]
    fn out_of_reach(
        &self,
        kind: usize,
        number: i64,
        index: i64,
        there: usize,
        [start, end]: [usize; 2],
        notes: &mut Notes,
    ) -> Result<u32, Interruption> {
        if self.pass == Pass::All && number != 0 && index >= 0 {
            return Err(Interruption::Ahead);
        }
        let what = ["vertex", "texture coordinates", "normal"][kind];
        let counted = if number < 0 { format!("; {} stand before it", self.seen[kind]) } else { String::new() };
        let message = format!("{what} {number} does not exist; there are {there}, numbered from 1{counted}");
        let error = self.source.error(start, end, message);
        if kind == 0 {
            return Err(Interruption::Wrong(error));
        }
        notes.add(what, || error.into_warning());
        Ok(NONE)
    }

    /// The columns of the mesh: what stands at its vertices, in the order in which faces first use them.
    pub(super) fn vertices(&self, decoded: bool, notes: &mut Notes) -> Result<VertexColumns, Diagnostic> {
        let all = &self.corners.vertices;
        let farthest = FARTHEST as f32;
        let is_near = |x: f32| x.abs() <= farthest;
        let strange = |[v, ..]: &&[u32; 3]| !self.positions[*v as usize].to_array().into_iter().all(is_near);
        if let Some([v, ..]) = all.iter().find(strange) {
            return Err(self.strange_position(*v));
        }
        let vertices = all.iter().map(|[v, ..]| self.positions[*v as usize]).collect();
        let mut no_normals = None;
        let mut normal = |n: u32| match self.normals.get(n as usize) {
            Some(normal) if normal.to_array().into_iter().all(is_near) => *normal,
            Some(_) => {
                no_normals.get_or_insert(n);
                Vec3::ZERO
            }
            None => Vec3::ZERO,
        };
        let has = |kind: usize| all.iter().any(|corner| corner[kind] != NONE);
        let normals = if has(2) { all.iter().map(|[.., n]| normal(*n)).collect() } else { Vec::new() };
        let mut no_uvs = None;
        let mut uv = |t: u32| match self.uvs.get(t as usize) {
            Some(uv) if uv.to_array().into_iter().all(is_near) => *uv,
            Some(_) => {
                no_uvs.get_or_insert(t);
                MeshData::NO_UV
            }
            None => MeshData::NO_UV,
        };
        let uvs = if has(1) { all.iter().map(|[_, t, _]| uv(*t)).collect() } else { Vec::new() };
        if let Some(n) = no_normals {
            let message = "a normal that is no direction is computed as if it were not given";
            notes.add("vn", || self.nth(b"vn", n, message).into_warning());
        }
        if let Some(t) = no_uvs {
            notes.add("vt", || {
                self.nth(b"vt", t, "texture coordinates that are no numbers are not used").into_warning()
            });
        }
        let colors = if self.colors.is_empty() { Vec::new() } else { self.vertex_colors(decoded, notes) };
        Ok((vertices, normals, uvs, colors))
    }

    /// Linear colours. Written from 0 to 1; some programs write 0 to 255.
    fn vertex_colors(&self, decoded: bool, notes: &mut Notes) -> Vec<Vec4> {
        let used = || self.corners.vertices.iter().map(|[v, ..]| (*v, self.colors[*v as usize]));
        let bright = used().find(|(_, color)| color.max_element() > 1.0);
        if let Some((v, _)) = bright {
            let message = "colours above 1 are taken as 0 to 255";
            notes.add("colors", || self.nth(b"v", v, message).into_warning());
        }
        let white = if bright.is_some() { 255.0 } else { 1.0 };
        let value = |x: f32| {
            let x = if x >= 0.0 { (x / white).min(1.0) } else { 0.0 };
            if decoded { srgb_decode(x) } else { x }
        };
        let linear = |color: Vec4| {
            let [red, green, blue, alpha] = color.to_array();
            let alpha = if bright.is_some() && alpha > 1.0 { alpha / white } else { alpha };
            Vec4::new(value(red), value(green), value(blue), if alpha >= 0.0 { alpha.min(1.0) } else { 0.0 })
        };
        used().map(|(_, color)| linear(color)).collect()
    }

    fn strange_position(&self, number: u32) -> Diagnostic {
        let position = self.positions[number as usize];
        let message = match position.to_array().into_iter().find(|x| !x.is_finite()) {
            Some(x) => format!("vertex {} is used by a face and has the coordinate {x}", u64::from(number) + 1),
            None => format!("vertex {} lies beyond +-{FARTHEST:e}", u64::from(number) + 1),
        };
        self.nth(b"v", number, &message)
    }

    /// An error at the statement of a kind that has a number, counted from 0.
    fn nth(&self, keyword: &[u8], number: u32, message: &str) -> Diagnostic {
        let mut cursor = Cursor::new(self.source.bytes);
        let mut left = number;
        while cursor.peek().is_some() {
            cursor.blanks();
            let (start, word) = (cursor.at, cursor.word());
            if word == keyword {
                if left == 0 {
                    return self.source.error(start, cursor.at, message);
                }
                left -= 1;
            }
            cursor.skip_line();
        }
        self.source.whole(message)
    }
}

/// A whole number, if one starts here.
#[inline(always)]
fn index(cursor: &mut Cursor) -> Option<i64> {
    let start = cursor.at;
    let negative = cursor.peek() == Some(b'-');
    let mut at = start + usize::from(negative || cursor.peek() == Some(b'+'));
    let first = at;
    let mut number = 0i64;
    while let Some(digit) = cursor.bytes.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        number = number.saturating_mul(10).saturating_add(i64::from(digit));
        at += 1;
    }
    if at == first {
        return None;
    }
    cursor.at = at;
    Some(if negative { -number } else { number })
}
