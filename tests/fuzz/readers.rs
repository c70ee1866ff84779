//! Every reader of the program, with inputs to begin from. A new reader is one entry more.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anim::base::codec::{Decoder, SharedTable};
use anim::base::digest::Digest;
use anim::base::project::{Access, Folder, Project};
use anim::base::rate::Rate;
use anim::components::{Component, Edit, ImageCache, ImagePlane, Render, Scene};
use anim::film::Film;
use anim::load;
use anim::output::formats::FORMATS;
use anim::output::manifest::Manifest;
use anim::output::{Provenance, film, inspect, provenance_metadata, read_layered};
use anim::script::host::{HOST_WORD, HostCommand};
use anim::script::{Evaluation, Program};
use anim::systems;

pub struct Reader {
    pub name: &'static str,
    /// Inputs that are changed.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Words that mean something to it.
    pub words: &'static [&'static str],
    /// Reads an input, in a folder that is its own.
    pub read: fn(&Path, &[u8]),
}

pub const READERS: [Reader; 20] = [
    Reader { name: "ron", seeds: || corpus("ron", &["scenes"]), words: &RON, read: |folder, bytes| ron(folder, bytes) },
    Reader {
        name: "nff",
        seeds: || corpus("nff", &[]),
        words: &NFF,
        read: |folder, bytes| nff(folder, bytes, "a.nff"),
    },
    Reader {
        name: "p3f",
        seeds: || corpus("nff", &[]),
        words: &NFF,
        read: |folder, bytes| nff(folder, bytes, "a.p3f"),
    },
    Reader {
        name: "gltf",
        seeds: || corpus("gltf", &[]),
        words: &[
            "\"extensions\": {",
            "\"sparse\": {",
            "\"count\": 4000000000",
            "\"byteStride\": 4",
            "\"children\": [0]",
        ],
        read: |folder, bytes| asset(folder, bytes, "a.gltf"),
    },
    Reader {
        name: "glb",
        seeds: glb_seeds,
        words: &["glTF", "JSON", "BIN\0", "\"buffer\": 0", "\"bufferView\": 1"],
        read: |folder, bytes| asset(folder, bytes, "a.glb"),
    },
    Reader {
        name: "aff",
        seeds: || corpus("aff", &[]),
        words: &["k arm {", "transl 4\n", "tpa 2\n", "x arm {", "}", "i 1 a.aff\n", "vertices 9999999\n"],
        read: |folder, bytes| asset(folder, bytes, "a.aff"),
    },
    Reader {
        name: "rhai",
        seeds: || corpus("rhai", &["scripts"]),
        words: &RHAI,
        read: |folder, bytes| rhai(folder, bytes),
    },
    Reader {
        name: "obj",
        seeds: || corpus("obj", &[]),
        words: &["vn ", "f 1//1 2//2 -1//-1\n", "\\\n", "usemtl x\n"],
        read: |folder, bytes| mesh(folder, bytes, "a.obj"),
    },
    Reader {
        name: "ply",
        seeds: ply_seeds,
        words: &["element face 9\n", "property list uchar int vertex_indices\n", "end_header\n"],
        read: |folder, bytes| mesh(folder, bytes, "a.ply"),
    },
    Reader {
        name: "stl",
        seeds: stl_seeds,
        words: &["facet normal ", "solid x\n", "endsolid\n", "vertex 1 2 3\n"],
        read: |folder, bytes| mesh(folder, bytes, "a.stl"),
    },
    Reader {
        name: "mtl",
        seeds: || corpus("mtl", &[]),
        words: &["newmtl a\n", "Kd ", "map_Kd -s 1 1 1 ", "Pr ", "illum ", "\\\n"],
        read: mtl,
    },
    Reader {
        name: "golden",
        seeds: || corpus("golden", &[]),
        words: &["entries: [", "size: (", "frames: \"", "parameters: {"],
        read: |folder, bytes| drop(load::golden::load_golden_list(&put(folder, "golden.ron", bytes))),
    },
    Reader {
        name: "csv",
        seeds: || corpus("csv", &[]),
        words: &["\"", "\"\"", ",", ";", "\r\n", "nan"],
        read: |folder, bytes| data(folder, bytes, "a.csv", CSV_SCRIPT),
    },
    Reader {
        name: "json",
        seeds: || corpus("json", &[]),
        words: &["[[[[", "{\"a\":", "1e999", "\\ud800", "null"],
        read: |folder, bytes| data(folder, bytes, "a.json", "let all = load_json(\"a.json\"); print(`${all}`);"),
    },
    Reader { name: "film", seeds: film_seeds, words: &["moov", "iTXt", "acTL", "VP8X", "XMP ", "FRAME\n"], read: film },
    Reader {
        name: "image",
        seeds: image_seeds,
        words: &["IHDR", "IDAT", "-Y 9 +X 9\n", "FORMAT=32-bit_rle_rgbe\n"],
        read: image,
    },
    Reader { name: "cube", seeds: image_seeds, words: &[], read: cube },
    Reader { name: "frame", seeds: frame_seeds, words: &["iTXt", "Hash", "Pixels", "comments"], read: frame },
    Reader { name: "manifest", seeds: manifest_seeds, words: &["\"frame\":", "\"input\":", "\n"], read: manifest },
    Reader { name: "edits", seeds: edits_seeds, words: &[], read: edits },
];

const RON: [&str; 12] = [
    "entities: [",
    "sphere: (radius: ",
    "transform: (parent: \"a\")",
    "mesh: (vertices: [",
    "Some(",
    "materials: {",
    "image: \"a.png\"",
    "#![enable(implicit_some)]",
    "/*",
    "\"\\u{0}\"",
    "camera: (focus: Entity(\"a\"))",
    "r#\"",
];
const NFF: [&str; 12] = [
    "v\nfrom ",
    "f ",
    "p 3\n",
    "pp 3\n",
    "mesh 1 1\n",
    "hither ",
    "env x\n",
    "ply x\n",
    "al ",
    "bclr ",
    "spp ",
    "accel ",
];
const RHAI: [&str; 14] = [
    "animation(#{ frames: 2 });",
    "fn frame(s, f) {",
    "s.spawn(#{ sphere: #{} });",
    "for i in 0..9 {",
    "s.camera.fov = ",
    "let x = [1, ",
    "|x| x + 1",
    "import \"a\" as a;",
    "keys([[0, 1]], f.t)",
    "`${x}`",
    "loop {",
    "s.get(\"a\")",
    "#{ a: ",
    "switch x {",
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The files of a folder of the corpus, and those of other folders of the project.
fn corpus(name: &str, more: &[&str]) -> Vec<Vec<u8>> {
    let own = root().join("tests/fuzz/corpus").join(name);
    let folders = std::iter::once(own).chain(more.iter().map(|folder| root().join(folder)));
    let mut files: Vec<PathBuf> = Vec::new();
    for folder in folders {
        files.extend(std::fs::read_dir(&folder).expect("a corpus").map(|entry| entry.expect("a file").path()));
    }
    files.sort();
    let seeds: Vec<Vec<u8>> = files.iter().filter_map(|file| std::fs::read(file).ok()).collect();
    assert!(!seeds.is_empty(), "no seeds for {name}");
    seeds
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("room for an input");
    path
}

fn ron(folder: &Path, bytes: &[u8]) {
    let path = put(folder, "a.ron", bytes);
    let read = load::load_scene(&path, true).ok();
    // What was read can be written, and what was written can be read.
    if let Some(text) = read.and_then(|(scene, _)| load::write::to_ron(&scene, None).ok()) {
        let again = put(folder, "again.ron", text.as_bytes());
        if let Err(problems) = load::load_scene(&again, true) {
            panic!("what was written cannot be read: {problems}\n{text}");
        }
    }
}

fn nff(folder: &Path, bytes: &[u8], name: &str) {
    let path = put(folder, name, bytes);
    for strict in [false, true] {
        let _ = load::load_scene(&path, strict);
    }
}

/// What was read is brought into a World, and every clip that it has is played.
fn asset(folder: &Path, bytes: &[u8], name: &str) {
    let path = put(folder, name, bytes);
    let Ok((scene, _)) = load::load_scene(&path, false) else { return };
    for desc in &scene.entities {
        let clips = desc.components().iter().filter_map(|component| match component {
            Component::Asset(asset) => Some(&asset.data.clips),
            _ => None,
        });
        for track in clips.flatten().flat_map(|clip| &clip.tracks) {
            for seconds in [-1.0, 0.0, 0.3, 1.0, 1e9] {
                let value = track.at(seconds);
                assert!(value.iter().all(|x| x.is_finite()), "{track:?} at {seconds}: {value:?}");
            }
        }
    }
    if let Ok(mut stage) = systems::spawn(scene) {
        let _ = systems::update_hierarchy(&mut stage);
    }
}

/// Text assets as binary ones, their buffers behind the text.
fn glb_seeds() -> Vec<Vec<u8>> {
    let packed = |text: &Vec<u8>| {
        let padding = text.len().next_multiple_of(4) - text.len();
        let length = (text.len() + padding) as u32;
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((20 + length).to_le_bytes());
        out.extend(length.to_le_bytes());
        out.extend(b"JSON");
        out.extend(text);
        out.resize(out.len() + padding, b' ');
        out
    };
    corpus("gltf", &[]).iter().map(packed).collect()
}

/// Evaluated as the program does it: what ends the script's process ends nothing else.
fn rhai(folder: &Path, bytes: &[u8]) {
    let path = put(folder, "a.rhai", bytes);
    let project = Project::of(&path, &Access::default()).expect("a project");
    let host = HostCommand::new(env!("CARGO_BIN_EXE_anim"), [HOST_WORD.into()]);
    let scene: Arc<Scene> = Arc::default();
    let outcome = Program::open(&path, &[], &project, &Evaluation::Hosted(host))
        .and_then(|program| program.setup(&scene).and_then(|_| program.frame(&scene, 1, 0.0)));
    for problem in outcome.err().map_or(Vec::new(), |problems| problems.0) {
        assert!(problem.place.is_some(), "a mistake without a place: {problem}");
    }
}

fn folder_of(folder: &Path) -> Folder {
    Folder::new(folder, Arc::new(Project::new(folder.to_path_buf(), Vec::new())))
}

fn mesh(folder: &Path, bytes: &[u8], name: &str) {
    put(folder, name, bytes);
    let _ = load::mesh::load(&folder_of(folder), name, true);
}

/// A library of materials, beside a mesh that names all that it could hold.
fn mtl(folder: &Path, bytes: &[u8]) {
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib a.mtl\nusemtl a\nf 1 2 3\nusemtl glass\nf 1 3 2\n";
    put(folder, "a.obj", faces.as_bytes());
    put(folder, "a.mtl", bytes);
    let _ = load::mesh::load(&folder_of(folder), "a.obj", true);
}

fn stl_seeds() -> Vec<Vec<u8>> {
    let mut seeds = corpus("stl", &[]);
    let mut binary = vec![b' '; 80];
    binary.extend(2u32.to_le_bytes());
    for facet in 0..2 {
        (0..12).for_each(|i| binary.extend((((i * 7 + facet) % 5) as f32).to_le_bytes()));
        binary.extend(0x801fu16.to_le_bytes());
    }
    seeds.push(binary);
    seeds
}

const CSV_SCRIPT: &str = "for options in [#{}, #{ header: false }, #{ separator: \";\" }] {
    try { let all = load_csv(\"a.csv\", options); print(`${all.columns} ${all.len()}`); for row in all { print(`${row}`); } }
    catch {}
}";

/// A file of data, read by a script in this process.
fn data(folder: &Path, bytes: &[u8], name: &str, body: &str) {
    put(folder, name, bytes);
    let script = format!("animation(#{{ frames: 1 }});\nfn setup(s) {{ {body} }}\nfn frame(s, f) {{}}");
    let path = put(folder, "a.rhai", script.as_bytes());
    let project = Project::of(&path, &Access::default()).expect("a project");
    let scene: Arc<Scene> = Arc::default();
    if let Ok(program) = Program::open(&path, &[], &project, &Evaluation::InProcess) {
        let _ = program.setup(&scene);
    }
}

/// Films of the formats that are written here, and the first boxes of two that are not.
fn film_seeds() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder");
    let spec = film::FilmSpec {
        size: [4, 2],
        rate: Rate::new(24, 1).expect("a rate"),
        frames: 2,
        alpha: false,
        deep: false,
        plays: 0,
        metadata: provenance_metadata(&frame_of()),
    };
    let frames = [10, 200].map(|shade| film::FilmFrame {
        width: 4,
        height: 2,
        pixels: film::FramePixels::Bytes(vec![[shade, 0, 90, 255]; 8]),
    });
    let mut seeds = vec![
        b"\0\0\0\x14ftypisom\0\0\0\0isom\0\0\0\x74moov\0\0\0\x6cmvhd".to_vec(),
        vec![0x1a, 0x45, 0xdf, 0xa3, 0x84, 1, 2, 3, 4, 0x18, 0x53, 0x80, 0x67, 0x84, 0x15, 0x49, 0xa9, 0x66],
    ];
    for ending in ["apng", "gif", "webp", "y4m"] {
        let path = folder.path().join("a").with_extension(ending);
        let mut finder = film::PaletteFinder::new(film::PaletteChoice::Shared, 2);
        frames.iter().for_each(|frame| finder.add(frame));
        let options = film::FilmOptions::default();
        let mut writer = film::FilmWriter::create(&path, &spec, &options, finder.choose()).expect("a film");
        frames.iter().for_each(|frame| writer.add(frame).expect("a frame"));
        writer.finish().expect("a film");
        seeds.push(std::fs::read(&path).expect("a film"));
    }
    seeds
}

fn film(folder: &Path, bytes: &[u8]) {
    let _ = film::read_film_info(&put(folder, "a.film", bytes));
}

fn ply_seeds() -> Vec<Vec<u8>> {
    let mut seeds = corpus("ply", &[]);
    for (format, endian) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = format!(
            "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
        .into_bytes();
        let order = |word: [u8; 4]| if endian { [word[3], word[2], word[1], word[0]] } else { word };
        [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().for_each(|x| bytes.extend(order(x.to_le_bytes())));
        bytes.push(3);
        (0..3i32).for_each(|i| bytes.extend(order(i.to_le_bytes())));
        seeds.push(bytes);
    }
    seeds
}

fn image_seeds() -> Vec<Vec<u8>> {
    let picture = image::RgbImage::from_fn(7, 5, |x, y| image::Rgb([x as u8 * 30, y as u8 * 40, 99]));
    let encoded = |format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("an image");
        bytes.into_inner()
    };
    let mut radiance = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 16\n".to_vec();
    for _ in 0..2 {
        radiance.extend([2, 2, 0, 16]);
        [100, 200, 50, 129].iter().for_each(|value| radiance.extend([128 + 16, *value]));
    }
    vec![encoded(image::ImageFormat::Png), encoded(image::ImageFormat::Jpeg), radiance]
}

fn image(folder: &Path, bytes: &[u8]) {
    let path = put(folder, "a.png", bytes);
    for plane in [ImagePlane::Srgb, ImagePlane::Alpha] {
        let _ = load::image::fetch(&mut ImageCache::default(), &folder_of(folder), &"a.png".into(), plane);
    }
    let _ = anim::compare::Picture::read(&path);
}

fn cube(folder: &Path, bytes: &[u8]) {
    for face in ["right", "left", "top", "bottom", "front", "back"] {
        put(folder, &format!("{face}.png"), bytes);
    }
    let _ = load::image::read_cube_map(&folder_of(folder), ".", true);
}

fn frame_of() -> Provenance {
    Provenance { source: "a.rhai".into(), frame: 1, hash: Digest(77) }
}

/// Frames in every format, and bytes that begin as they do.
fn frame_seeds() -> Vec<Vec<u8>> {
    let film = Film { pixels: (0..63).map(|i| [i as f32 / 60.0, 0.3, 4.0]).collect(), ..Film::new(9, 7) };
    let encode = |format: &anim::output::Format| {
        let render = Render { bit_depth: format.bit_depths[0].0, ..Render::default() };
        (format.encode)(&film, &render, &provenance_metadata(&frame_of())).expect("a frame")
    };
    let mut seeds: Vec<Vec<u8>> = FORMATS.iter().map(|format| encode(format)).collect();
    // What other tools write: grey, with alpha.
    let grey = image::GrayAlphaImage::from_fn(5, 3, |x, y| image::LumaA([x as u8 * 40, 255 - y as u8]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    grey.write_to(&mut bytes, image::ImageFormat::Png).expect("an image");
    seeds.push(bytes.into_inner());
    seeds
}

fn frame(folder: &Path, bytes: &[u8]) {
    for ending in FORMATS.iter().map(|format| format.extensions[0]) {
        let path = put(folder, &format!("a.0001.{ending}"), bytes);
        let _ = inspect(&path, None, &frame_of(), "a.rhai");
    }
    let _ = anim::output::relabelled(bytes, &Provenance { frame: 123, ..frame_of() });
    for format in FORMATS {
        let _ = ((format.decode)(bytes), (format.pixels)(bytes), (format.read_header)(bytes));
    }
    let _ = (read_layered(bytes), film::FilmFrame::read(bytes), film::FilmFrame::head(bytes));
}

fn manifest_seeds() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = Manifest::read(folder.path(), "x/a.rhai");
    for frame in 1..4 {
        let provenance = Provenance { frame, ..frame_of() };
        let bytes = &frame_seeds()[0];
        manifest.add(&folder.path().join(format!("a.000{frame}.png")), &provenance, bytes).expect("a line");
    }
    vec![std::fs::read(folder.path().join(anim::output::manifest::NAME)).expect("a manifest")]
}

fn manifest(folder: &Path, bytes: &[u8]) {
    put(folder, anim::output::manifest::NAME, bytes);
    let manifest = Manifest::read(folder, "x/a.rhai");
    let frame = put(folder, "a.0001.png", b"");
    let _ = inspect(&frame, manifest.get(&frame), &frame_of(), manifest.input());
    manifest.add(&frame, &frame_of(), b"bytes").expect("a line more");
}

/// What a script's process answers, and a scene as it is told to one.
fn edits_seeds() -> Vec<Vec<u8>> {
    let (scene, _) = load::load_scene(&root().join("scenes/chess.ron"), true).expect("a scene of the project");
    let edits = vec![
        Edit::Camera(scene.camera.clone()),
        Edit::Render(scene.render.clone()),
        Edit::Spawn(scene.entities[0].clone()),
        Edit::Material { index: 0, material: scene.materials[0].1.clone() },
        Edit::Tags { entity: 3, tags: vec!["a".into()] },
        Edit::Despawn { entity: 2 },
    ];
    let mut all = Vec::new();
    for encode in [true, false] {
        let mut encoder = anim::base::codec::Encoder::default();
        if encode {
            encoder.put(&edits)
        } else {
            encoder.put(&scene)
        }
        all.push(encoder.bytes);
    }
    all
}

fn edits(_: &Path, bytes: &[u8]) {
    let decoder = || Decoder::new(bytes, SharedTable::default(), true);
    let _ = decoder().get::<Vec<Edit>>();
    let _ = decoder().get::<Scene>();
}
