//! NFF and P3F: Haines' Neutral File Format and the dialect of a ray tracing course, with what was met in real files.
//!
//! Lines do not matter: a record is a keyword and the numbers that follow it. Dialects are told apart record by record,
//! by how many numbers there are. The reader is tolerant: what it does not know is skipped with a warning at its place,
//! or refused when strict. Only data that leaves no sensible reading (a count that the numbers do not bear out) stops it.
//!
//! Sources: E. Haines, "NFF: Neutral File Format" 3.9; the P3D course's format sheet.

mod camera;
mod lexer;
mod shapes;

use std::path::Path;

use glam::DVec3;
use lexer::{Lexer, Word};
use rustc_hash::FxHashMap;

use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, Severity, nearest};
use crate::base::project::Folder;
use crate::base::{files, limits};
use crate::components::record::ranges::color;
use crate::components::*;
use crate::load::image;

/// Every record that is read or known to be passed over.
const KEYWORDS: [&str; 29] = [
    "v", "b", "bclr", "l", "al", "f", "c", "s", "p", "pp", "pl", "box", "aabb", "mesh", "accel", "spp", "env", "fire",
    "sm", "ms", "ply", "tpp", "shader", "dod", "oct", "tet", "hex", "tess", "pb",
];

/// Records that have no picture here: skipped with a warning of their own.
const UNSUPPORTED: [&str; 7] = ["shader", "tess", "pb", "pn", "pnn", "tt", "ttp"];

/// A light as it stands in the file; its default brightness depends on how many there are.
struct LightRecord {
    light: Component,
    has_color: bool,
}

struct NffReader<'a> {
    lexer: Lexer<'a>,
    file: &'a str,
    base: &'a Folder,
    strict: bool,
    scene: Scene,
    lights: Vec<LightRecord>,
    material: Option<Text>,
    /// Numbers of known materials, to give equal ones one name.
    materials: FxHashMap<Vec<u64>, Text>,
    /// Records of the course's dialect were met.
    p3f: bool,
    has_camera: bool,
    found: Diagnostics,
    /// Warnings beyond those that are kept.
    more: usize,
    numbers: Vec<f64>,
}

/// Stops the reading; what is wrong has been reported.
struct Stop;

/// Reads a scene; `file` is what diagnostics call it, `base` the folder of the files that it names.
///
/// # Errors
/// Data without a sensible reading; with `strict`, all that a tolerant reading would skip.
pub fn parse(text: &str, file: &str, base: &Folder, strict: bool) -> Result<(Scene, Diagnostics), Diagnostics> {
    let render = Render { samples: 1, transfer: Transfer::Linear, ..Render::default() };
    let mut reader = NffReader {
        lexer: Lexer::new(text),
        file,
        base,
        strict,
        scene: Scene { render, base: base.clone(), ..Scene::default() },
        lights: Vec::new(),
        material: None,
        materials: FxHashMap::default(),
        p3f: false,
        has_camera: false,
        found: Diagnostics::default(),
        more: 0,
        numbers: Vec::new(),
    };
    let _stopped = reader.records();
    reader.finish()
}

impl NffReader<'_> {
    fn records(&mut self) -> Result<(), Stop> {
        let mut first = true;
        while let Some(word) = self.lexer.next() {
            if first && word.text.eq_ignore_ascii_case("nff") {
                self.error(word, "this is a WorldToolKit (Sense8) file, which shares only its ending with NFF");
                return Err(Stop);
            }
            first = false;
            self.record(word)?;
        }
        Ok(())
    }

    fn record(&mut self, word: Word) -> Result<(), Stop> {
        match word.text {
            "v" => self.camera(word),
            "b" | "bclr" => {
                self.p3f |= word.text == "bclr";
                if let Some([r, g, b]) = self.exactly(word) {
                    let background = DVec3::new(r, g, b).max(DVec3::ZERO);
                    match color("background", background) {
                        Ok(()) => self.scene.render.background = background,
                        Err(invalid) => self.error(word, invalid.message),
                    }
                }
            }
            "env" | "fire" => self.environment(),
            "spp" => {
                self.p3f = true;
                if let Some([n]) = self.exactly(word) {
                    self.scene.render.samples = (n as u32).clamp(1, limits::SAMPLES);
                }
            }
            "accel" => {
                self.p3f = true;
                if let Some([n]) = self.exactly(word) {
                    self.scene.render.accel = match n as i64 {
                        1 => Accel::Grid,
                        2 => Accel::Bvh,
                        // 0 says that its tracer had none, and would take hours by brute force. Pictures do not depend on it.
                        _ => Accel::Auto,
                    };
                }
            }
            "l" => self.point_light(word),
            "al" => self.area_light(word),
            "f" => self.fill(word),
            "s" | "sm" | "ms" | "c" | "pl" | "box" | "aabb" | "dod" | "oct" | "tet" | "hex" => self.simple_shape(word),
            "p" | "pp" | "tpp" => self.polygon(word)?,
            "mesh" => self.mesh(word)?,
            "ply" => self.ply(word),
            other if UNSUPPORTED.contains(&other) => {
                self.warn(word, format!("`{other}` is not supported; skipped"));
                self.skip(word);
            }
            _ => self.unknown(word),
        }
        Ok(())
    }

    /// Passes over the rest of the line and the numbers that go with it.
    fn skip(&mut self, word: Word) {
        self.lexer.end_of_line(word);
        self.read_numbers();
    }

    fn unknown(&mut self, word: Word) {
        let help = nearest(word.text, KEYWORDS).filter(|_| word.text.len() > 1);
        let message = if word.is_number() { "a number where a keyword was expected" } else { "unknown keyword" };
        let help = help.map(|near| format!("did you mean `{near}`?"));
        self.warn_with(word, format!("{message} `{}`; skipped", word.short()), help);
        self.lexer.end_of_line(word);
    }

    fn place(&self, word: Word) -> Place {
        Place::of_span(self.file, self.lexer.text, word.start, word.start + word.text.len())
    }

    fn warn(&mut self, word: Word, message: impl Into<String>) {
        self.warn_with(word, message, None);
    }

    fn warn_with(&mut self, word: Word, message: impl Into<String>, help: Option<String>) {
        // A place costs a walk through the text, so none is looked up for what is only counted.
        if self.found.0.len() >= 10 * limits::DIAGNOSTICS {
            self.more += 1;
            return;
        }
        let warning = Diagnostic { help, ..Diagnostic::warning(message) }.at(self.place(word));
        self.push(warning);
    }

    fn push(&mut self, mut diagnostic: Diagnostic) {
        if self.strict {
            diagnostic.severity = Severity::Error;
        }
        self.found.push(diagnostic);
    }

    /// A record without enough numbers is skipped; where a bad number or the end of the file cuts it off, it is wrong.
    fn short(&mut self, word: Word, message: String) {
        match self.lexer.peek() {
            None => self.error(word, format!("the file ends in the middle of `{}`: {message}", word.text)),
            Some(next) if next.is_like_a_number() => {
                self.error(next, format!("`{}` is not a number: {message}", next.short()));
            }
            Some(_) => self.warn(word, format!("{message}; skipped")),
        }
    }

    fn error(&mut self, word: Word, message: impl Into<String>) {
        if self.found.0.len() >= 10 * limits::DIAGNOSTICS && self.found.has_errors() {
            self.more += 1;
            return;
        }
        let error = Diagnostic::error(message).at(self.place(word));
        self.found.push(error);
    }

    /// Reads all numbers up to the next word into `self.numbers`.
    fn read_numbers(&mut self) {
        self.numbers.clear();
        while let Some(word) = self.lexer.peek() {
            if let Some(x) = word.number() {
                self.numbers.push(x);
                self.lexer.next();
            } else if let Some(parts) = word.glued() {
                self.warn(word, format!("numbers run together; read as {} and {}", parts[0], parts[1]));
                self.numbers.extend(parts);
                self.lexer.next();
            } else if word.is_not_finite() {
                self.error(word, format!("`{}` is not a finite number", word.short()));
                self.numbers.push(0.0);
                self.lexer.next();
            } else {
                return;
            }
        }
    }

    /// The numbers of a record that has a fixed count of them; more are passed over with a warning.
    fn exactly<const N: usize>(&mut self, word: Word) -> Option<[f64; N]> {
        self.read_numbers();
        let count = self.numbers.len();
        if count < N {
            self.short(word, format!("`{}` needs {N} numbers and has {count}", word.text));
            return None;
        }
        if count > N {
            self.warn(word, format!("`{}` has {count} numbers; the first {N} count", word.text));
        }
        self.numbers[..N].try_into().ok()
    }

    fn environment(&mut self) {
        self.p3f = true;
        let Some(name) = self.lexer.next() else { return };
        let folder = self.sky_folder(name.text);
        match image::read_cube_map(self.base, &folder, false) {
            Ok(_) => self.scene.render.environment = Some(folder.into()),
            Err(problem) => {
                let message = format!("no environment: {}; the background colour is used", problem.message);
                // A missing sky is common, and no mistake of the geometry: not even strict reading refuses it.
                let warning = Diagnostic::warning(message).at(self.place(name));
                self.found.push(warning);
            }
        }
    }

    /// Where the folder of a sky lies: beside the scene, or beside one of the folders that it is in, as courses lay them
    /// out; in letters of any case.
    fn sky_folder(&self, name: &str) -> String {
        let places = (0..=limits::SKY_FOLDERS_ABOVE).map(|up| "../".repeat(up) + name);
        let find = |place: String| {
            let found = files::find_any_case(self.base, Path::new(&place))?.to_string_lossy().replace('\\', "/");
            self.base.admit(&found).ok().filter(|path| path.is_dir()).map(|_| found)
        };
        let mut found = places.filter_map(find);
        found.next().unwrap_or_else(|| name.to_string())
    }

    fn point_light(&mut self, word: Word) {
        self.read_numbers();
        let n = &self.numbers;
        let (position, color) = match n.len() {
            3 => (DVec3::new(n[0], n[1], n[2]), None),
            6 => (DVec3::new(n[0], n[1], n[2]), Some(DVec3::new(n[3], n[4], n[5]))),
            count => return self.short(word, format!("`l` takes 3 or 6 numbers, not {count}")),
        };
        let light = PointLight { position, color: color.unwrap_or(DVec3::ONE), ..PointLight::default() };
        self.add_light(word, light.into(), color.is_some());
    }

    fn area_light(&mut self, word: Word) {
        self.read_numbers();
        let n = self.numbers.clone();
        let v = |i: usize| DVec3::new(n[i], n[i + 1], n[i + 2]);
        let unit = |i: usize| n[i..i + 3].iter().all(|x| (0.0..=1.0).contains(x));
        let light = match n.len() {
            // Position, target, width and height, colour.
            11 => {
                let back = (v(0) - v(3)).normalize_or(DVec3::Y);
                let right = back.any_orthonormal_vector();
                let edges = [right * n[6], back.cross(right) * n[7]];
                AreaLight { position: v(0), edges: Some(edges), color: v(8), ..AreaLight::default() }
            }
            // Corner, two edges, colour; a count of points after it. Or corner, colour, two edges, and the count.
            12 | 13 => {
                let colour_first = n.len() == 13 && unit(3) && !unit(9);
                if n.len() == 13 && unit(3) && unit(9) {
                    self.warn(word, "`al` can be read in two ways; the last three numbers but one are its colour");
                }
                let (a, b, color) = if colour_first { (v(6), v(9), v(3)) } else { (v(3), v(6), v(9)) };
                AreaLight { position: v(0) + (a + b) / 2.0, edges: Some([a, b]), color, ..AreaLight::default() }
            }
            count => return self.short(word, format!("`al` takes 11, 12 or 13 numbers, not {count}")),
        };
        self.add_light(word, light.into(), true);
    }

    fn add_light(&mut self, word: Word, light: Component, has_color: bool) {
        match light.record().check() {
            Ok(()) => self.lights.push(LightRecord { light, has_color }),
            Err(invalid) => self.warn(word, format!("{}; light skipped", invalid.message)),
        }
    }

    /// `f`: 8 numbers in NFF, 9 with glossiness, 11 in P3F, 12 with roughness.
    fn fill(&mut self, word: Word) {
        self.read_numbers();
        let n = std::mem::take(&mut self.numbers);
        let color = |i: usize| DVec3::new(n[i], n[i + 1], n[i + 2]);
        let material = match n.len() {
            8 | 9 => Material {
                color: color(0),
                diffuse: n[3],
                specular: n[4],
                shininess: n[5],
                transmission: n[6],
                ior: Some(n[7]),
                gloss: n.get(8).map_or(0.0, |g| g.clamp(0.0, 1.0)),
                two_sided: shown_on_both_sides(),
                ..Material::default()
            },
            11 | 12 => Material {
                color: color(0),
                diffuse: n[3],
                specular_color: color(4),
                specular: n[7],
                shininess: n[8],
                transmission: n[9],
                ior: Some(n[10]),
                gloss: n.get(11).map_or(0.0, |g| g.clamp(0.0, 1.0)),
                ..Material::default()
            },
            count => return self.short(word, format!("`f` takes 8, 9, 11 or 12 numbers, not {count}")),
        };
        self.p3f |= n.len() >= 11;
        // Files name a transparency without an index of refraction, or one above 1.
        let ior = material.ior.filter(|ior| *ior > 0.0).or(Some(1.0));
        let material = Material { ior, transmission: material.transmission.min(1.0), ..material };
        if let Err(invalid) = material.check() {
            return self.warn(word, format!("{}; material skipped", invalid.message));
        }
        let key = n.iter().map(|x| x.to_bits()).collect();
        self.use_material(key, material);
        self.numbers = n;
    }

    fn use_material(&mut self, key: Vec<u64>, material: Material) {
        let scene = &mut self.scene;
        let name = self.materials.entry(key).or_insert_with(|| {
            let name: Text = format!("m{}", scene.materials.len() + 1).into();
            scene.materials.push((name.clone(), material));
            name
        });
        self.material = Some(name.clone());
    }

    /// The current material; shapes before any `f` have the course's default.
    fn current_material(&mut self) -> MaterialName {
        if self.material.is_none() {
            let default = Material {
                color: DVec3::splat(0.2),
                diffuse: 0.2,
                specular: 0.8,
                shininess: 20.0,
                ..Material::default()
            };
            self.use_material(Vec::new(), default);
        }
        MaterialName(self.material.clone().unwrap_or_else(|| "".into()))
    }

    /// Adds a shape with the current material, if it is in range.
    fn add(&mut self, word: Word, shape: impl Into<Component>, motion: Option<Motion>) {
        let shape = shape.into();
        let checked = shape.record().check().and_then(|()| motion.as_ref().map_or(Ok(()), Check::check));
        if let Err(invalid) = checked {
            return self.warn(word, format!("{}; skipped", invalid.message));
        }
        let mut desc = EntityDesc::new([shape, self.current_material().into()]);
        if let Some(motion) = motion {
            desc.put(motion.into());
        }
        self.scene.entities.push(desc);
    }

    fn finish(mut self) -> Result<(Scene, Diagnostics), Diagnostics> {
        let count = self.lights.len() as f64;
        for LightRecord { mut light, has_color } in std::mem::take(&mut self.lights) {
            if let (Component::PointLight(point), false) = (&mut light, has_color) {
                // Twice what the databases suggest beside an ambient term, for there is none here.
                point.color = DVec3::splat(1.0 / count.sqrt());
            }
            self.scene.entities.push(EntityDesc::new([light]));
        }
        let render = &mut self.scene.render;
        render.max_depth = if self.p3f { 6 } else { 5 };
        if !self.has_camera && self.scene.entities.is_empty() && !self.found.has_errors() {
            let strange =
                Diagnostic::error("there is no camera, no light and no object in it: is it an NFF or P3F scene?");
            self.found.push(strange.at(Place::file(self.file)));
        } else if !self.has_camera {
            let missing = Diagnostic::warning("the file has no camera (`v`); a default one is used");
            self.push(missing.at(Place::file(self.file)));
        }
        if self.more > 0 {
            let more = Diagnostic::warning(format!("... and {} more", self.more));
            self.found.push(more.at(Place::file(self.file)));
        }
        let problems = super::resolve::check(&self.scene);
        for problem in problems {
            self.found.push(problem.diagnostic().at(Place::file(self.file)));
        }
        self.found.into_result(self.scene)
    }
}

/// NFF calls opaque surfaces one-sided; the databases' own ray counts, and every tracer met, fit both sides better.
fn shown_on_both_sides() -> bool {
    true
}

#[cfg(test)]
mod tests;
