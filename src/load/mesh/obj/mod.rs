//! Wavefront OBJ: faces with all that stands at their corners, what they wear, and the sets that they belong to.
//!
//! One pass over the bytes; a second one only where faces name vertices that come later. Faces keep their order, and
//! vertices are numbered as faces first use them: one for each position, texture coordinates and normal that go together.

mod faces;
pub mod mtl;
mod sets;

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::cursor::{Cursor, Number};
use super::source::{Notes, SourceFile, decode};
use crate::base::diagnostics::Diagnostic;
use crate::base::math;
use crate::components::{MeshData, Text};
use faces::Corners;
use sets::{Active, Sets};

/// What an OBJ file says.
pub struct Obj {
    pub data: MeshData,
    /// Names of the material libraries as they are written, and where.
    pub libraries: Vec<Library>,
}

/// A `mtllib` statement.
pub struct Library {
    pub name: String,
    pub start: usize,
    pub end: usize,
}

/// Statements that say how to show curves and surfaces that are not read, or that nobody uses any more.
const UNUSED: [&str; 31] = [
    "vp",
    "deg",
    "bmat",
    "step",
    "cstype",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "maplib",
    "usemap",
    "bsp",
    "bzp",
    "cdc",
    "call",
    "csh",
];

/// Which statements a pass listens to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pass {
    All,
    /// Everything that faces refer to.
    Points,
    /// Everything else.
    Faces,
}

/// Why a pass ends before the file does.
enum Interruption {
    /// A face names something that comes later.
    Ahead,
    Wrong(Diagnostic),
}

struct ObjReader<'a> {
    source: SourceFile<'a>,
    cursor: Cursor<'a>,
    pass: Pass,
    /// Relative to `origin`, which is near the first of them.
    positions: Vec<Vec3>,
    origin: DVec3,
    /// As long as `positions` once one of them has a colour; as they are written.
    colors: Vec<Vec4>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Positions, texture coordinates and normals that stand before the statement at hand.
    seen: [usize; 3],
    corners: Corners,
    polygon: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    smoothing: Vec<u32>,
    smoothing_group: u32,
    materials: Sets,
    groups: Sets,
    libraries: Vec<Library>,
    statements: u64,
}

/// Reads an OBJ file; with `decoded` its colours stand for the sRGB curve.
///
/// # Errors
/// The first statement that cannot be read, at its place.
pub fn parse(source: SourceFile, decoded: bool, notes: &mut Notes) -> Result<Obj, Diagnostic> {
    let mut reader = ObjReader::new(source, Pass::All);
    let mut found = Notes::default();
    match reader.statements(&mut found) {
        Ok(()) => {}
        Err(Interruption::Wrong(problem)) => return Err(problem),
        Err(Interruption::Ahead) => {
            (reader, found) = (ObjReader::new(source, Pass::Points), Notes::default());
            for pass in [Pass::Points, Pass::Faces] {
                (reader.pass, reader.cursor, reader.seen) = (pass, Cursor::new(source.bytes), [0; 3]);
                if let Err(Interruption::Wrong(problem)) = reader.statements(&mut found) {
                    return Err(problem);
                }
            }
        }
    }
    notes.take(found);
    reader.finish(decoded, notes)
}

impl<'a> ObjReader<'a> {
    fn new(source: SourceFile<'a>, pass: Pass) -> Self {
        ObjReader {
            source,
            cursor: Cursor::new(source.bytes),
            pass,
            positions: Vec::new(),
            origin: DVec3::ZERO,
            colors: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            seen: [0; 3],
            corners: Corners::default(),
            polygon: Vec::new(),
            triangles: Vec::new(),
            smoothing: Vec::new(),
            smoothing_group: 0,
            materials: Sets::default(),
            groups: Sets::default(),
            libraries: Vec::new(),
            statements: 0,
        }
    }

    fn statements(&mut self, notes: &mut Notes) -> Result<(), Interruption> {
        loop {
            self.cursor.blanks();
            let Some(first) = self.cursor.peek() else { return Ok(()) };
            if matches!(first, b'\n' | b'\r' | b'#') {
                self.cursor.next_line();
                continue;
            }
            let start = self.cursor.at;
            let word = self.cursor.word();
            self.statement(word, start, notes)?;
            self.cursor.blanks();
            if !self.cursor.at_end() {
                self.left_over(word, notes);
            }
            self.cursor.next_line();
        }
    }

    fn statement(&mut self, word: &[u8], start: usize, notes: &mut Notes) -> Result<(), Interruption> {
        let (points, faces) = (self.pass != Pass::Faces, self.pass != Pass::Points);
        match word {
            b"v" => {
                self.seen[0] += 1;
                if points { self.position(start, notes) } else { self.pass_over() }
            }
            b"vt" => {
                self.seen[1] += 1;
                if points { self.texture(start) } else { self.pass_over() }
            }
            b"vn" => {
                self.seen[2] += 1;
                if points { self.normal(start) } else { self.pass_over() }
            }
            _ if !faces => self.pass_over(),
            b"f" | b"fo" => self.face(start, notes),
            _ => {
                // Only what is known counts as a sign that this is an OBJ file at all.
                self.statements += u64::from(self.other(word, start, notes));
                return Ok(());
            }
        }?;
        self.statements += 1;
        Ok(())
    }

    /// Statements that are neither points nor faces; whether it is one that is known.
    fn other(&mut self, word: &[u8], start: usize, notes: &mut Notes) -> bool {
        let now = self.triangles.len() as u32;
        match word {
            b"usemtl" => {
                let name = self.rest().0;
                self.materials.switch(Active::named(&name), now);
            }
            b"mtllib" => {
                let (name, [start, end]) = self.rest();
                self.libraries.push(Library { name, start, end });
            }
            b"o" => {
                let name = self.rest().0;
                self.groups.switch(Active::object(&name), now);
            }
            b"g" => {
                let names = self.rest().0;
                self.groups.switch(Active::groups(&names), now);
            }
            b"s" => self.smoothing(start, notes),
            b"l" | b"p" => {
                let kind = if word == b"l" { "lines have" } else { "points have" };
                let message = format!("`{}` is not drawn: {kind} no surface", decode(word));
                notes.add(&decode(word), || self.source.error(start, start + 1, message).into_warning());
                self.cursor.skip_line();
                self.step_back();
            }
            _ => return self.unused(word, start, notes),
        }
        true
    }

    /// The rest of the line as text, and where it stands.
    fn rest(&mut self) -> (String, [usize; 2]) {
        let [start, end] = self.cursor.rest();
        (decode(&self.source.bytes[start..end]), [start, end])
    }

    fn unused(&mut self, word: &[u8], start: usize, notes: &mut Notes) -> bool {
        let name = decode(word);
        let known = UNUSED.contains(&name.as_str());
        notes.add(&name, || {
            let short: String = name.chars().take(30).collect();
            let message = match name.as_str() {
                "surf" | "curv" | "curv2" | "cstype" => {
                    format!("`{short}` is not used: curves and surfaces are not read")
                }
                _ if known => format!("`{short}` is not used"),
                _ => format!("`{short}` is no statement of OBJ; the line is skipped"),
            };
            self.source.error(start, start + word.len(), message).into_warning()
        });
        self.cursor.skip_line();
        self.step_back();
        known
    }

    /// Back before the line end that was just passed, where statements end.
    fn step_back(&mut self) {
        let before = &self.source.bytes[..self.cursor.at];
        let end = before.strip_suffix(b"\r\n").or(before.strip_suffix(b"\n")).or(before.strip_suffix(b"\r"));
        self.cursor.at = end.map_or(self.cursor.at, <[u8]>::len);
    }

    #[allow(clippy::unnecessary_wraps, reason = "an arm among arms that can fail")]
    fn pass_over(&mut self) -> Result<(), Interruption> {
        self.cursor.skip_line();
        self.step_back();
        Ok(())
    }

    fn left_over(&mut self, word: &[u8], notes: &mut Notes) {
        let (start, end) = (self.cursor.at, self.cursor.word_end());
        let name = decode(word);
        notes.add(&format!("after {name}"), || {
            let message = format!("`{}` after the end of `{name}` is not used", self.source.short(start, end));
            self.source.error(start, end, message).into_warning()
        });
        self.cursor.skip_line();
        self.step_back();
    }

    /// Up to N numbers of a statement that needs at least `least`; gives how many there are.
    #[inline(always)]
    fn numbers<const N: usize>(&mut self, start: usize, least: usize) -> Result<([f64; N], usize), Interruption> {
        let mut numbers = [0.0; N];
        for (i, slot) in numbers.iter_mut().enumerate() {
            match self.cursor.number() {
                Number::Value(x) => *slot = x,
                Number::Missing if i >= least => return Ok((numbers, i)),
                Number::Missing => return Err(self.too_few(start, least, i)),
                Number::Word(from, to) => return Err(self.no_number(from, to)),
            }
        }
        Ok((numbers, N))
    }

    #[cold]
    fn too_few(&self, start: usize, least: usize, count: usize) -> Interruption {
        let end = Cursor { bytes: self.source.bytes, at: start }.word_end();
        let name = self.source.short(start, end);
        let (s, has) = (if least == 1 { "" } else { "s" }, if count == 0 { "none".into() } else { count.to_string() });
        Interruption::Wrong(self.source.error(start, end, format!("`{name}` needs {least} number{s} and has {has}")))
    }

    #[cold]
    fn no_number(&self, start: usize, end: usize) -> Interruption {
        Interruption::Wrong(super::no_number(&self.source, start, end))
    }

    /// `v x y z`, with a weight, or with a colour and perhaps an alpha.
    fn position(&mut self, start: usize, notes: &mut Notes) -> Result<(), Interruption> {
        let (n, count) = self.numbers::<7>(start, 3)?;
        let position = DVec3::new(n[0], n[1], n[2]);
        if self.positions.is_empty() {
            self.origin = math::lattice_origin(position);
        }
        self.positions.push((position - self.origin).as_vec3());
        if count < 5 {
            if !self.colors.is_empty() {
                self.colors.push(Vec4::ONE);
            }
            return Ok(());
        }
        if count == 5 {
            notes.add("v of five", || {
                let message = "`v` has 5 numbers; the first 3 count, for a colour takes 3 more";
                self.source.error(start, start + 1, message).into_warning()
            });
            return Ok(());
        }
        let alpha = if count == 7 { n[6] } else { 1.0 };
        self.colors.resize(self.positions.len() - 1, Vec4::ONE);
        self.colors.push(Vec4::from_array([n[3], n[4], n[5], alpha].map(|x| x as f32)));
        Ok(())
    }

    /// `vt u`, `vt u v` or `vt u v w`; the third is for solid textures, which are patterns here.
    fn texture(&mut self, start: usize) -> Result<(), Interruption> {
        let (n, _) = self.numbers::<3>(start, 1)?;
        self.uvs.push(Vec2::new(n[0] as f32, n[1] as f32));
        Ok(())
    }

    fn normal(&mut self, start: usize) -> Result<(), Interruption> {
        let (n, _) = self.numbers::<3>(start, 3)?;
        self.normals.push(Vec3::new(n[0] as f32, n[1] as f32, n[2] as f32));
        Ok(())
    }

    fn smoothing(&mut self, start: usize, notes: &mut Notes) {
        self.cursor.blanks();
        let word = decode(self.cursor.word());
        let group = match word.as_str() {
            "off" | "" => Some(0),
            "on" => Some(1),
            number => number.parse().ok(),
        };
        match group {
            Some(group) => {
                self.smoothing_group = group;
                if group != 0 && self.smoothing.is_empty() {
                    self.smoothing.resize(self.triangles.len(), 0);
                    self.corners.has_smoothing = true;
                }
            }
            None => notes.add("s of a word", || {
                let message =
                    format!("`s` takes the number of a smoothing group or `off`, not `{word}`; it is skipped");
                self.source.error(start, start + 1, message).into_warning()
            }),
        }
    }

    fn finish(mut self, decoded: bool, notes: &mut Notes) -> Result<Obj, Diagnostic> {
        if self.statements == 0 {
            let help = "it has no `v` and no `f` that could be read";
            return Err(self.source.whole("this is no OBJ file").help(help));
        }
        let now = self.triangles.len() as u32;
        let (materials, groups) = (std::mem::take(&mut self.materials), std::mem::take(&mut self.groups));
        if !self.colors.is_empty() {
            self.colors.resize(self.positions.len(), Vec4::ONE);
        }
        let (vertices, normals, uvs, colors) = self.vertices(decoded, notes)?;
        let mut data = MeshData::new(vertices, self.triangles, normals).with_uvs(uvs);
        (data.colors, data.smoothing, data.origin) = (colors, self.smoothing, self.origin);
        (data.materials, data.groups) = (materials.finish(now), groups.finish(now));
        Ok(Obj { data, libraries: self.libraries })
    }
}

impl Active {
    /// The material of a name; none without one.
    fn named(name: &str) -> Active {
        Active { object: None, groups: if name.is_empty() { Vec::new() } else { vec![Text::from(name)] }, keeps: false }
    }
}

#[cfg(test)]
mod tests;
