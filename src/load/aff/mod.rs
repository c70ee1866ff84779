//! AFF: NFF with transforms, keys and meshes, as the Benchmark for Animated Ray Tracing has it.
//!
//! A file is an asset: each transform is a node, and so is what lies between two of them and wears one material. The keys
//! of all transforms are one clip, [`CLIP`]. Files that it includes are read from beside the first one.
//!
//! Source: J. Lext, U. Assarsson and T. Moeller, A Benchmark for Animated Ray Tracing, IEEE CG&A 2001, and the comments
//! of the parser that came with it.

mod curves;
mod keys;
mod pieces;
mod scan;

use std::path::{Path, PathBuf};

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::asset::AssetFile;
use crate::base::diagnostics::{Diagnostic, Diagnostics, nearest};
use crate::base::math;
use crate::base::project::{FileRole, Folder};
use crate::base::{files, limits};
use crate::components::*;
use crate::load::names::Names;
use keys::Keys;
use pieces::OpenPieces;
use scan::{AffWord as Word, Scan};

/// What the one clip of a file is called.
pub const CLIP: &str = "animation";

/// The node that looks at the scene, and the one that carries it.
pub const VIEW: &str = "view";
const CAMERA: &str = "camera";

/// How a file wants to be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct AffShow {
    /// Seconds of the first and the last frame.
    pub time: [f64; 2],
    /// Frames of the whole animation, 1 at least.
    pub frames: u32,
    /// Colour of rays that meet nothing, linear.
    pub background: DVec3,
    /// Width and height in pixels, if the file says so.
    pub size: Option<[u32; 2]>,
    /// Whether the file has a camera.
    pub has_view: bool,
}

/// Words that start a record.
const KEYWORDS: [&str; 21] =
    ["v", "b", "l", "la", "f", "fm", "c", "s", "p", "pp", "i", "d", "tt", "ttp", "tpa", "m", "xs", "x", "k", "a", "am"];

/// Stops the reading; what is wrong has been reported.
struct AffStop;

/// What is read once for the whole of a scene.
struct Reader {
    base: Folder,
    /// Folder that its files are relative to, as seen from `base`.
    inner: PathBuf,
    prefix: String,
    nodes: Vec<AssetNode>,
    names: Names,
    /// Nodes by the name in the file, which several may have.
    named: FxHashMap<String, Vec<Text>>,
    materials: Vec<(Text, Material)>,
    /// Numbers of known materials and names of their textures, to give equal ones one name.
    known: FxHashMap<(Vec<u64>, Option<Text>), Text>,
    fill: Vec<f64>,
    ambient: DVec3,
    pieces: OpenPieces,
    keys: Vec<(String, Keys)>,
    /// Clips of shapes that are keyed point by point.
    tracks: Vec<Track>,
    show: AffShow,
    detail: f64,
    /// Files that are being read, the innermost last.
    open: Vec<PathBuf>,
    includes: usize,
    found: Diagnostics,
}

/// Reads an AFF file. `file` is what the scene calls it, `prefix` what the names of its materials start with.
///
/// # Errors
/// What is wrong in it or in a file that it includes, with its place.
pub fn read(base: &Folder, file: &str, prefix: &str) -> Result<(AssetFile, AffShow), Diagnostics> {
    let path = base.find(file, FileRole::Mesh)?;
    let text = files::read_text(&path, limits::SCENE_FILE_BYTES)?;
    let mut reader = Reader::new(base, file, prefix);
    reader.open.push(path.clone());
    let _stopped = reader.records(&mut Scan::new(&text, &path.to_string_lossy()), None);
    reader.finish()
}

impl Reader {
    fn new(base: &Folder, file: &str, prefix: &str) -> Self {
        Reader {
            base: base.clone(),
            inner: Path::new(file).parent().unwrap_or(Path::new("")).to_path_buf(),
            prefix: prefix.to_string(),
            nodes: Vec::new(),
            names: Names::default(),
            named: FxHashMap::default(),
            materials: Vec::new(),
            known: FxHashMap::default(),
            // Objects before any material: grey.
            fill: vec![0.0, 0.0, 0.0, 0.8, 0.8, 0.8, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            ambient: DVec3::ONE,
            pieces: OpenPieces::default(),
            keys: Vec::new(),
            tracks: Vec::new(),
            show: AffShow { time: [0.0, 0.0], frames: 1, background: DVec3::ZERO, size: None, has_view: false },
            detail: 0.0,
            open: Vec::new(),
            includes: 0,
            found: Diagnostics::default(),
        }
    }

    /// Reads records up to the end of the file, or to the bracket that closes those of a transform.
    fn records(&mut self, scan: &mut Scan, parent: Option<usize>) -> Result<(), AffStop> {
        while let Some(word) = scan.next() {
            if word.text == "}" {
                self.close(parent);
                if parent.is_some() && scan.depth > 0 {
                    scan.depth -= 1;
                    return Ok(());
                }
                self.fail(scan, word, "this bracket closes nothing")?;
            }
            self.record(scan, word, parent)?;
        }
        self.close(parent);
        if scan.depth > 0 {
            return self.fail(scan, scan.end(), "the file ends inside of a transform: a `}` is missing");
        }
        Ok(())
    }

    fn record(&mut self, scan: &mut Scan, word: Word, parent: Option<usize>) -> Result<(), AffStop> {
        match word.text {
            "v" => self.view(scan, word)?,
            "b" => self.show.background = self.vector(scan)?.max(DVec3::ZERO),
            "a" => {
                let [start, end, frames] = self.numbers(scan)?;
                self.show.time = [start, end.max(start)];
                self.show.frames = (frames.max(1.0) as u32).min(limits::FRAMES);
            }
            "am" => self.ambient = self.vector(scan)?.max(DVec3::ZERO),
            "l" | "la" => self.light(scan, word, parent)?,
            "f" => {
                let [r, g, b, kd, ks, shine, t, ior] = self.numbers(scan)?;
                self.fill = vec![0.0, 0.0, 0.0, r * kd, g * kd, b * kd, ks, ks, ks, shine, t, ior];
            }
            "fm" => self.fill = self.numbers::<12>(scan)?.to_vec(),
            "s" => {
                let [x, y, z, radius] = self.numbers(scan)?;
                self.shape(scan, word, parent, Sphere { center: DVec3::new(x, y, z), radius }.into())?;
            }
            "c" => {
                let n: [f64; 8] = self.numbers(scan)?;
                let (base, apex) = (DVec3::new(n[0], n[1], n[2]), DVec3::new(n[4], n[5], n[6]));
                let cone = Cone { base, base_radius: n[3], apex, apex_radius: n[7], capped: false };
                self.shape(scan, word, parent, cone.into())?;
            }
            "p" | "pp" => self.polygon(scan, word)?,
            "tt" | "ttp" => self.textured(scan, word)?,
            "tpa" => self.moving_triangle(scan, word)?,
            "m" => self.mesh(scan)?,
            "i" => self.include(scan, parent)?,
            "d" => self.detail = self.number(scan)?,
            "xs" | "x" => self.transform(scan, word, parent)?,
            "k" => self.keyed(scan)?,
            other => {
                let near = nearest(other, KEYWORDS).filter(|_| other.len() > 1);
                let help = near.map(|near| format!("did you mean `{near}`?"));
                let what =
                    if word.number().is_some() { "a number where a keyword was expected" } else { "unknown keyword" };
                let error = Diagnostic::error(format!("{what}: `{}`", word.short())).at(scan.place(word));
                self.found.push(Diagnostic { help, ..error });
                return Err(AffStop);
            }
        }
        Ok(())
    }

    fn fail<T>(&mut self, scan: &Scan, word: Word, message: impl Into<String>) -> Result<T, AffStop> {
        self.found.push(Diagnostic::error(message).at(scan.place(word)));
        Err(AffStop)
    }

    fn warn(&mut self, scan: &Scan, word: Word, message: impl Into<String>) {
        if self.found.0.len() < 10 * limits::DIAGNOSTICS {
            self.found.push(Diagnostic::warning(message).at(scan.place(word)));
        }
    }

    fn word<'a>(&mut self, scan: &mut Scan<'a>, what: &str) -> Result<Word<'a>, AffStop> {
        match scan.next() {
            Some(word) => Ok(word),
            None => self.fail(scan, scan.end(), format!("the file ends where {what} was expected")),
        }
    }

    fn number(&mut self, scan: &mut Scan) -> Result<f64, AffStop> {
        let word = self.word(scan, "a number")?;
        match word.number() {
            Some(x) => Ok(x),
            None => self.fail(scan, word, format!("expected a number, found `{}`", word.short())),
        }
    }

    fn numbers<const N: usize>(&mut self, scan: &mut Scan) -> Result<[f64; N], AffStop> {
        let mut all = [0.0; N];
        for x in &mut all {
            *x = self.number(scan)?;
        }
        Ok(all)
    }

    fn vector(&mut self, scan: &mut Scan) -> Result<DVec3, AffStop> {
        self.numbers(scan).map(DVec3::from_array)
    }

    /// A count of what follows, each thing of so many numbers: believed only if the text has room for it.
    fn count(&mut self, scan: &mut Scan, each: usize) -> Result<usize, AffStop> {
        let word = self.word(scan, "a count")?;
        let count = word.number().filter(|x| *x == x.trunc() && *x >= 0.0).map(|x| x as usize);
        match count {
            Some(count) if count.saturating_mul(2 * each.max(1)) <= scan.rest() + 2 => Ok(count),
            Some(count) => {
                self.fail(scan, word, format!("there is no room for {count} of them in the rest of the file"))
            }
            None => self.fail(scan, word, format!("expected a count, found `{}`", word.short())),
        }
    }

    fn expect(&mut self, scan: &mut Scan, wanted: &str) -> Result<(), AffStop> {
        let word = self.word(scan, &format!("`{wanted}`"))?;
        if word.text == wanted {
            return Ok(());
        }
        self.fail(scan, word, format!("expected `{wanted}`, found `{}`", word.short()))
    }

    /// Adds a node; its place among them.
    fn node(&mut self, word: &str, parent: Option<usize>, desc: EntityDesc) -> usize {
        let name = self.names.give(word);
        self.nodes.push(AssetNode { name, parent, desc });
        self.nodes.len() - 1
    }

    fn view(&mut self, scan: &mut Scan, word: Word) -> Result<(), AffStop> {
        let mut three = [DVec3::ZERO; 3];
        for (name, v) in ["from", "at", "up"].into_iter().zip(&mut three) {
            self.expect(scan, name)?;
            *v = self.vector(scan)?;
        }
        self.expect(scan, "angle")?;
        let fov = self.number(scan)?;
        self.expect(scan, "hither")?;
        self.number(scan)?;
        self.expect(scan, "resolution")?;
        let [width, height] = self.numbers(scan)?;
        let [from, at, up] = three;
        let viewpoint = Viewpoint { fov, ..Viewpoint::default() };
        if from == at || viewpoint.check().is_err() {
            return self.fail(scan, word, "this view shows nothing: `from` is `at`, or `angle` is out of range");
        }
        let side = |x: f64| (1.0..=f64::from(limits::FRAME_SIDE)).contains(&x).then_some(x as u32);
        self.show.size = side(width).zip(side(height)).map(|(width, height)| [width, height]);
        if self.show.has_view {
            self.warn(scan, word, "a second view is not used");
            return Ok(());
        }
        self.show.has_view = true;
        let rotation = math::look_at_degrees(from, at, up);
        let transform = Transform { translation: from, rotation, ..Transform::default() };
        let camera = self.node(CAMERA, None, EntityDesc::new([Transform::default().into()]));
        self.named.entry(CAMERA.into()).or_default().push(self.nodes[camera].name.clone());
        self.node(VIEW, Some(camera), EntityDesc::new([transform.into(), viewpoint.into()]));
        Ok(())
    }

    fn light(&mut self, scan: &mut Scan, word: Word, parent: Option<usize>) -> Result<(), AffStop> {
        let name = if word.text == "la" { Some(self.word(scan, "the name of a light")?) } else { None };
        let position = self.vector(scan)?;
        let is_number = |scan: &mut Scan| scan.peek().is_some_and(|next| next.number().is_some());
        let color = if is_number(scan) { self.vector(scan)? } else { DVec3::ONE };
        let light = PointLight { position, color, ..PointLight::default() };
        if let Err(invalid) = light.check() {
            return self.fail(scan, word, invalid.message);
        }
        let called = name.map_or("light", |name| name.text);
        let place = self.node(called, parent, EntityDesc::new([Transform::default().into(), light.into()]));
        if let Some(name) = name {
            self.named.entry(name.text.to_string()).or_default().push(self.nodes[place].name.clone());
        }
        Ok(())
    }

    /// The material of what follows, with a texture or without.
    fn worn(&mut self, texture: Option<Text>) -> Text {
        let key = (self.fill.iter().map(|x| x.to_bits()).collect(), texture.clone());
        if let Some(name) = self.known.get(&key) {
            return name.clone();
        }
        let n = &self.fill;
        let color = |i: usize| DVec3::new(n[i], n[i + 1], n[i + 2]).max(DVec3::ZERO);
        let specular = color(6);
        let map = |image: Text| Box::new(Texture { image: Some(image), ..Texture::default() });
        let material = Material {
            color: color(3),
            specular_color: specular,
            specular: if specular == DVec3::ZERO { 0.0 } else { 1.0 },
            // The benchmark's reflection vectors against our half ones.
            shininess: 4.0 * n[9].max(0.0),
            transmission: n[10].clamp(0.0, 1.0),
            ior: Some(if n[11] > 0.0 { n[11].min(100.0) } else { 1.0 }),
            emission: color(0) * self.ambient,
            color_map: texture.map(map),
            ..Material::default()
        };
        let name: Text = format!("{}/m{}", self.prefix, self.materials.len() + 1).into();
        self.materials.push((name.clone(), material));
        self.known.insert(key, name.clone());
        name
    }

    /// A texture as the scene names it, if its file is there.
    fn texture(&mut self, scan: &Scan, word: Word) -> Option<Text> {
        let named = self.beside(word);
        if self.base.find(&named, FileRole::Image).is_ok_and(|path| path.is_file()) {
            return Some(named.into());
        }
        self.warn(scan, word, format!("no texture: there is no file `{}`", word.short()));
        None
    }

    /// A file beside this one, as the scene names it.
    fn beside(&self, word: Word) -> String {
        self.inner.join(word.text).to_string_lossy().replace('\\', "/")
    }

    fn shape(&mut self, scan: &Scan, word: Word, parent: Option<usize>, shape: Component) -> Result<(), AffStop> {
        if let Err(invalid) = shape.record().check() {
            self.warn(scan, word, format!("{}; skipped", invalid.message));
            return Ok(());
        }
        let worn = MaterialName(self.worn(None));
        let called = shape.kind().name();
        self.node(called, parent, EntityDesc::new([Transform::default().into(), shape, worn.into()]));
        Ok(())
    }

    /// Puts what was gathered since the last transform below its node.
    fn close(&mut self, parent: Option<usize>) {
        for piece in self.pieces.take() {
            let mut desc = EntityDesc::new([
                Transform::default().into(),
                Mesh { data: piece.data, ..Mesh::default() }.into(),
                MaterialName(piece.material).into(),
            ]);
            let weights = piece.morph.as_ref().map(|(morph, times)| (morph.clone(), times.clone()));
            if let Some((morph, _)) = &weights {
                let mut at_rest = vec![0.0; morph.len()];
                at_rest.iter_mut().take(1).for_each(|w| *w = 1.0);
                desc.put(Morph { weights: at_rest, data: morph.clone() }.into());
            }
            let place = self.node("mesh", parent, desc);
            if let Some((_, times)) = weights {
                self.tracks.push(pieces::track(self.nodes[place].name.clone(), &times));
            }
        }
    }

    fn transform(&mut self, scan: &mut Scan, word: Word, parent: Option<usize>) -> Result<(), AffStop> {
        let (called, transform) = if word.text == "xs" {
            let n: [f64; 10] = self.numbers(scan)?;
            let v = |i: usize| DVec3::new(n[i], n[i + 1], n[i + 2]);
            let turn = keys::axis_angle(v(3), n[6].to_radians());
            let rotation = animation::euler_of(turn);
            (
                "static".to_string(),
                Transform { translation: v(7), rotation, scale: Scale(v(0)), ..Transform::default() },
            )
        } else {
            (self.word(scan, "the name of a transform")?.text.to_string(), Transform::default())
        };
        if let Err(invalid) = transform.check() {
            return self.fail(scan, word, invalid.message);
        }
        self.expect(scan, "{")?;
        scan.depth += 1;
        if scan.depth + self.open.len() > limits::NESTING {
            return self.fail(scan, word, format!("transforms nest deeper than {}", limits::NESTING));
        }
        self.close(parent);
        let place = self.node(&called, parent, EntityDesc::new([transform.into()]));
        if word.text == "x" {
            self.named.entry(called).or_default().push(self.nodes[place].name.clone());
        }
        self.records(scan, Some(place))
    }

    fn include(&mut self, scan: &mut Scan, parent: Option<usize>) -> Result<(), AffStop> {
        let level = self.number(scan)?;
        let word = self.word(scan, "the name of a file")?;
        if level > self.detail {
            return Ok(());
        }
        self.includes += 1;
        let path = self.base.find(&self.beside(word), FileRole::Mesh);
        let is_open = path.as_ref().is_ok_and(|path| self.open.contains(path));
        if is_open || self.open.len() >= limits::NESTING || self.includes > limits::INCLUDES {
            return self.fail(scan, word, format!("`{}` is included too often, or in itself", word.short()));
        }
        let read = path.and_then(|path| Ok((files::read_text(&path, limits::SCENE_FILE_BYTES)?, path)));
        let (text, path) = match read {
            Ok(read) => read,
            Err(problem) => {
                let error = Diagnostic::error(problem.message).at(scan.place(word));
                self.found.push(Diagnostic { help: problem.help, ..error });
                return Err(AffStop);
            }
        };
        self.open.push(path.clone());
        let done = self.records(&mut Scan::new(&text, &path.to_string_lossy()), parent);
        self.open.pop();
        done
    }

    fn finish(mut self) -> Result<(AssetFile, AffShow), Diagnostics> {
        for (name, keys) in std::mem::take(&mut self.keys) {
            let nodes = self.named.get(&name).cloned().unwrap_or_default();
            if nodes.is_empty() {
                let message = format!("there is nothing called `{name}` that its keys could move");
                let near =
                    nearest(&name, self.named.keys().map(String::as_str)).map(|n| format!("did you mean `{n}`?"));
                let warning = Diagnostic::warning(message).at(keys.place.clone());
                self.found.push(Diagnostic { help: near, ..warning });
            }
            nodes.into_iter().for_each(|node| self.tracks.extend(keys.tracks(&node)));
        }
        let clips = vec![Clip { name: CLIP.into(), tracks: self.tracks }];
        let (warnings, errors): (Vec<Diagnostic>, Vec<Diagnostic>) =
            self.found.0.into_iter().partition(|d| !d.is_error());
        if !errors.is_empty() {
            return Err(Diagnostics(errors));
        }
        Ok((AssetFile { nodes: self.nodes, materials: self.materials, clips, warnings }, self.show))
    }
}
