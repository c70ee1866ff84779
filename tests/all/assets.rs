//! Meshes that people bring, as they meet them: pictures whose truth is known, warnings, and mistakes inside of files.

use crate::tool::Sandbox;

/// A scene that looks straight at the square from -1 to 1, lit with strength 1 from far behind the eye.
fn stage(entity: &str, materials: &str) -> String {
    format!(
        "(\n  camera: (from: (0, 0, 8), at: (0, 0, 0), fov: 30),\n  render: (size: (48, 48), samples: 1, integrator: \
         Whitted, transfer: Linear),\n  materials: {{ {materials} }},\n  entities: [\n    ({entity}),\n    (point_light: \
         (position: (0, 0, 4000))),\n  ],\n)"
    )
}

fn picture(desk: &Sandbox, scene: &str) -> image::RgbImage {
    desk.write("scene.ron", scene);
    desk.anim("scene.ron -o out.png --force").ok();
    image::load_from_memory(&desk.read("out.png")).unwrap().to_rgb8()
}

fn lit(picture: &image::RgbImage) -> usize {
    picture.pixels().filter(|p| p.0 != [0; 3]).count()
}

const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";

#[test]
fn faces_wear_what_their_library_says_unless_the_scene_says_otherwise() {
    let desk = Sandbox::new();
    desk.write("two.obj", format!("mtllib two.mtl\n{SQUARE}usemtl red\nf 1 2 3\nusemtl green\nf 1 3 4\n"));
    desk.write("two.mtl", "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n");
    let at = |picture: &image::RgbImage, x, y| picture.get_pixel(x, y).0;
    let look = |entity: &str, materials: &str| {
        let picture = picture(&desk, &stage(entity, materials));
        [at(&picture, 30, 32), at(&picture, 18, 16)]
    };
    let clay = "\"clay\": (color: (0.2, 0.2, 0.2))";
    assert_eq!(look("mesh: (file: \"two.obj\"), material: \"clay\"", clay), [[255, 0, 0], [0, 255, 0]]);
    let own = format!("{clay}, \"green\": (color: (0, 0, 1))");
    assert_eq!(look("mesh: (file: \"two.obj\"), material: \"clay\"", &own), [[255, 0, 0], [0, 0, 255]]);
    let plain = "mesh: (file: \"two.obj\", file_materials: false), material: \"clay\"";
    assert_eq!(look(plain, clay), [[51; 3]; 2]);
    // A script reaches the materials of the file by their names.
    desk.write(
        "show.rhai",
        "animation(#{ scene: \"scene.ron\" });\nfn frame(s, f) { s.material(\"red\").color = [1, 1, 0]; }",
    );
    desk.write("scene.ron", stage("mesh: (file: \"two.obj\")", ""));
    desk.anim("show.rhai -o out").ok();
    let shown = image::load_from_memory(&desk.read("out/show.0001.png")).unwrap().to_rgb8();
    assert_eq!([at(&shown, 30, 32), at(&shown, 18, 16)], [[255, 255, 0], [0, 255, 0]]);
}

#[test]
fn wires_are_no_surfaces_and_notches_stay_open() {
    let desk = Sandbox::new();
    let look = |obj: &str| {
        desk.write("m.obj", obj);
        lit(&picture(&desk, &stage("mesh: (file: \"m.obj\")", "")))
    };
    let triangle = look(&format!("{SQUARE}f 1 2 3\n"));
    assert_eq!(look(&format!("{SQUARE}f 1 2 3\nl 1 2 3 4 1\n")), triangle);
    let square = look(&format!("{SQUARE}f 1 2 3 4\n"));
    // A notch down to the middle takes a quarter of the square with it, wherever the polygon begins.
    for order in ["1 2 3 5 4", "5 4 1 2 3", "3 5 4 1 2"] {
        let notched = look(&format!("{SQUARE}v 0 0 0\nf {order}\n"));
        assert!((notched as f64 - 0.75 * square as f64).abs() < 0.03 * square as f64, "{order}: {notched} of {square}");
    }
}

#[test]
fn smooth_surfaces_have_no_crease_between_groups() {
    let desk = Sandbox::new();
    let roof = "v -1 -1 0\nv -1 1 0\nv 0 -1 1\nv 0 1 1\nv 1 -1 0\nv 1 1 0\n";
    let look = |faces: &str, how: &str| {
        desk.write("m.obj", format!("{roof}{faces}"));
        picture(&desk, &stage(&format!("mesh: (file: \"m.obj\", {how})"), ""))
    };
    let whole = look("f 1 3 4 2\nf 3 5 6 4\n", "smooth: true");
    assert!(whole == look("g a\nf 1 3 4 2\ng b\nf 3 5 6 4\n", "smooth: true"));
    assert!(whole == look("s 1\nf 1 3 4 2\nf 3 5 6 4\n", ""));
    assert!(whole == look("f 1 3 4 2\nf 3 5 6 4\n", "crease_angle: 100"));
    let flat = look("f 1 3 4 2\nf 3 5 6 4\n", "");
    assert!(whole != flat && flat == look("f 1 3 4 2\nf 3 5 6 4\n", "crease_angle: 80"));
    assert!(flat == look("s 1\nf 1 3 4 2\ns 2\nf 3 5 6 4\n", ""));
    // A group that is picked alone is shaded as it is in the whole.
    let half = look("g a\nf 1 3 4 2\ng b\nf 3 5 6 4\n", "smooth: true, group: \"b\"");
    assert_eq!(half.get_pixel(30, 24), whole.get_pixel(30, 24));
    assert_eq!(half.get_pixel(18, 24).0, [0; 3]);
}

#[test]
fn colours_of_vertices_are_seen() {
    let desk = Sandbox::new();
    let color = |c: &str| SQUARE.lines().map(|v| format!("{v} {c}\n")).collect::<String>();
    desk.write("m.obj", color("0.2 0.4 1") + "f 1 2 3 4\n");
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty \
                  uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int \
                  vertex_indices\nend_header\n";
    desk.write("m.ply", format!("{header}{}4 0 1 2 3\n", color("51 102 255").replace("v ", "")));
    for file in ["m.obj", "m.ply"] {
        let scene = stage(&format!("mesh: (file: \"{file}\"), material: \"white\""), "\"white\": (color: (1, 1, 1))");
        let pixel = |picture: image::RgbImage| picture.get_pixel(24, 24).0;
        assert_eq!(pixel(picture(&desk, &scene)), [51, 102, 255], "{file}");
        // Where pictures are encoded by the sRGB curve, the colour of a file is one of that curve.
        assert_eq!(pixel(picture(&desk, &scene.replace("Linear", "Srgb"))), [51, 102, 255], "{file}");
        // Instances of one mesh, which are traced in its own space, show it too.
        let twice = scene.replace(
            "  ],",
            &format!("    (mesh: (file: \"{file}\"), material: \"white\", transform: (translation: (0, 0, 1))),\n  ],"),
        );
        assert_eq!(pixel(picture(&desk, &twice)), [51, 102, 255], "{file}");
    }
}

#[test]
fn what_is_not_used_is_a_warning_and_an_error_when_strict() {
    let desk = Sandbox::new();
    desk.write("m.obj", format!("mtllib m.mtl\n{SQUARE}usemtl red\nf 1 2 3\nl 1 2\n"));
    desk.write("m.mtl", "newmtl red\nKd 1 0 0\nmap_disp bumps.png\n");
    desk.write("a.ron", stage("mesh: (file: \"m.obj\")", ""));
    let run = desk.anim("check a.ron").ok();
    for said in ["m.obj:8:1: warning: `l` is not drawn", "m.mtl:3:1: warning: `map_disp` is not used"] {
        assert!(run.stderr.contains(said), "{}", run.stderr);
    }
    desk.anim("check --strict a.ron").fails(3, &["m.mtl:3:1: error: `map_disp` is not used"]);
}

#[test]
fn mistakes_inside_a_mesh_have_their_line_there() {
    let desk = Sandbox::new();
    desk.write("m.obj", format!("{SQUARE}f 1 2 9\n"));
    desk.write("a.ron", stage("mesh: (file: \"m.obj\")", ""));
    let said = ["m.obj:5:7: error: vertex 9 does not exist", "5 | f 1 2 9", "the file is named in a.ron:6:19"];
    desk.anim("check a.ron").fails(3, &said);
    desk.write("m.obj", "g nothing\n");
    let run = desk.anim("check a.ron").ok();
    assert!(run.stderr.contains("m.obj: warning: the mesh has no faces"), "{}", run.stderr);
    desk.write("a.ron", stage("mesh: (file: \"m.fbx\")", ""));
    desk.anim("check a.ron").fails(3, &["a.ron:6:19: error", "FBX is not read"]);
    desk.write("m.usda", "#usda 1.0\n");
    desk.anim("check m.usda").fails(3, &["not a scene", "OpenUSD is not read"]);
}

#[test]
fn texts_of_other_programs_are_read_or_named() {
    let desk = Sandbox::new();
    let scene = stage("sphere: (radius: 0.5)", "");
    let plain = picture(&desk, &scene);
    assert!(plain == picture(&desk, &format!("\u{feff}{scene}")));
    let wide: Vec<u8> = format!("\u{feff}{scene}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    desk.write("wide.ron", wide);
    desk.anim("check wide.ron").fails(3, &["wide.ron:1:1: error: the file is in UTF-16", "UTF-8"]);
    desk.write("comma.ron", scene.replace("0.5", "0,5"));
    desk.anim("check comma.ron").fails(3, &["comma.ron:6:23: error: `0,5` has a comma"]);
    desk.write(
        "a.nff",
        "\u{feff}v\nfrom 0 -5 0\nat 0 0 0\nup 0 0 1\nangle 30\nhither 1\nresolution 16 16\nl 2 -5 4\ns 0 0 0 1\n",
    );
    let run = desk.anim("check --strict a.nff").ok();
    assert!(run.stderr.is_empty(), "{}", run.stderr);
}

/// A script chooses mesh files frame by frame, those of new entities too, and of a sequence the shutter sees what lies
/// between two files.
#[test]
fn scripts_choose_mesh_files() {
    let desk = Sandbox::new();
    let at = |x: f64| format!("v {} -0.2 0\nv {} -0.2 0\nv {} 0.2 0\nf 1 2 3\n", x, x + 0.3, x);
    for (frame, x) in [(1, -1.0), (2, 0.0), (3, 1.0)] {
        desk.write(&format!("cache/c.{frame:04}.obj"), at(x));
    }
    desk.write("scene.ron", stage("name: \"m\", mesh: (file: \"cache/c.####.obj\")", ""));
    let script = |body: &str| {
        desk.write(
            "show.rhai",
            format!("animation(#{{ scene: \"scene.ron\", fps: 1, frames: 3 }});\nfn frame(s, f) {{ {body} }}"),
        );
    };
    let frames = || {
        desk.anim("show.rhai -o out --force").ok();
        let read = |i: u32| image::load_from_memory(&desk.read(&format!("out/show.{i:04}.png"))).unwrap().to_rgb8();
        [1, 2, 3].map(read)
    };
    let still = picture(&desk, &stage("mesh: (file: \"cache/c.0002.obj\")", ""));
    desk.write("scene.ron", stage("name: \"m\", mesh: (file: \"cache/c.####.obj\")", ""));
    script("s.get(\"m\").mesh.frame = f.number;");
    let sequence = frames();
    assert!(sequence[1] == still && sequence[0] != still);
    script("s.get(\"m\").mesh.file = `cache/c.000${f.number}.obj`;");
    assert!(frames() == sequence);
    script("s.despawn(s.get(\"m\")); s.spawn(#{ name: \"n\", mesh: #{ file: `cache/c.000${f.number}.obj` } });");
    assert!(frames() == sequence);
    // While the shutter is open the triangle goes half of the way to the next file.
    let blurred = "s.camera.shutter = [0, 0.5]; s.render.samples = 16; s.render.integrator = \"Distribution\"; \
                   s.get(\"m\").mesh.frame = 1 + f.seconds;";
    script(blurred);
    let smear = frames();
    assert!(lit(&smear[0]) > 2 * lit(&sequence[0]), "{} {}", lit(&smear[0]), lit(&sequence[0]));
    script("s.get(\"m\").mesh.file = \"cache/c.0009.obj\";");
    desk.anim("show.rhai -o two").fails(3, &["in frame 1: mesh of entity `m`: cannot read", "c.0009.obj"]);
}

/// Pictures of a sequence stand for moments of a texture, as if each were named.
#[test]
fn scripts_choose_images_of_a_sequence() {
    let desk = Sandbox::new();
    for (frame, level) in [(1, 40), (2, 120), (3, 250)] {
        image::RgbImage::from_pixel(2, 2, image::Rgb([level, 20, 90]))
            .save(desk.path(&format!("t.{frame:04}.png")))
            .unwrap();
    }
    desk.write("m.obj", format!("{SQUARE}f 1 2 3 4\n"));
    let frames = |body: &str| {
        let material = "\"m\": (color_map: (image: \"t.####.png\"))";
        desk.write("scene.ron", stage("mesh: (file: \"m.obj\"), material: \"m\"", material));
        desk.write(
            "show.rhai",
            format!("animation(#{{ scene: \"scene.ron\", frames: 3 }});\nfn frame(s, f) {{ {body} }}"),
        );
        desk.anim("show.rhai -o out --force").ok();
        let read = |i: u32| image::load_from_memory(&desk.read(&format!("out/show.{i:04}.png"))).unwrap().to_rgb8();
        [1, 2, 3].map(read)
    };
    let named = frames("s.material(\"m\").color_map = #{ image: `t.000${f.number}.png` };");
    let numbered = frames("s.material(\"m\").color_map.frame = f.number + 0.2;");
    assert!(named == numbered && named[0] != named[1] && named[1] != named[2]);
    assert!(frames("").iter().all(|frame| *frame == named[0]), "the first one if no number is given");
    desk.write(
        "show.rhai",
        "animation(#{ scene: \"scene.ron\" });\nfn frame(s, f) { s.material(\"m\").color_map.frame = 9; }",
    );
    desk.anim("show.rhai -o two").fails(3, &["`color_map` of material `m`: cannot read", "t.0009.png"]);
}

/// What makes a benchmark of animated ray tracing hard stands below its plan.
#[test]
fn plans_of_benchmarks_measure_their_animation() {
    let desk = Sandbox::new();
    let keys = "k rise {\ntransl 4\n-1 0 -1 0 0 0 0\n0 0 0 0 0 0 0\n1 0 1 0 0 0 0\n2 0 2 0 0 0 0\n}\n";
    desk.write(
        "a.aff",
        format!(
            "v\nfrom 0 0 8\nat 0 0 0\nup 0 1 0\nangle 30\nhither 1\nresolution 8 8\nl 0 9 9\na 0 1 5\n{keys}\
             f 1 0 0 1 0 0 0 1\ns 9 0 0 1\nx rise {{\ns 0 0 0 1\n}}\n"
        ),
    );
    let plan = desk.anim("plan a.aff").ok().stdout;
    assert!(
        plan.contains("over 4 pairs of neighbouring frames") && plan.contains("50.0 % of the bodies move"),
        "{plan}"
    );
    let lines = desk.anim("plan a.aff --json").ok().stdout;
    let last: serde_json::Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
    assert_eq!(
        (last["measures"]["bodies"].as_u64(), last["measures"]["bending"].as_f64()),
        (Some(2), Some(0.0)),
        "{last}"
    );
}

/// The robots of a benchmark have keys that programs which draw them never come to.
#[test]
fn keys_that_go_back_in_time_are_left_out_with_a_warning() {
    let desk = Sandbox::new();
    let shown = |count: u32, more: &str| {
        desk.write(
            "a.aff",
            format!(
                "v\nfrom 0 0 8\nat 0 0 0\nup 0 1 0\nangle 30\nhither 1\nresolution 16 16\nl 0 9 9\na 0 1 5\nk rise {{\n\
                 transl {count}\n-1 0 -1 0 0 0 0\n0 0 0 0 0 0 0\n1 0 1 0 0 0 0\n{more}2 0 2 0 0 0 0\n}}\n\
                 f 1 0 0 1 0 0 0 1\nx rise {{\ns 0 0 0 1\n}}\n"
            ),
        );
        let run = desk.anim("a.aff --frames 3 -o out --force").ok();
        (image::load_from_memory(&desk.read("out/a.0003.png")).unwrap().to_rgb8(), run.stderr)
    };
    let (plain, nothing) = shown(4, "");
    assert!(!nothing.contains("warning"), "{nothing}");
    let (same, said) = shown(6, "0.5 0 -9 0 0 0 0\n0.75 0 9 0 0 0 0\n");
    assert!(same == plain && lit(&plain) > 0);
    assert!(said.contains("a.aff:11:1: warning: 2 of 6 keys are not used"), "{said}");
    shown(4, "");
    let text = String::from_utf8(desk.read("a.aff")).unwrap();
    desk.write("a.aff", text.replace("\n1 0 1 0 0 0 0", "\n-3 0 1 0 0 0 0"));
    desk.anim("check a.aff").fails(3, &["a.aff:11:1:", "four keys at least, at rising times, and has 3"]);
}

/// A scene of meshes of every kind is the same to the byte however it is traced, and comes back as RON.
#[test]
fn meshes_of_several_materials_are_exact() {
    let desk = Sandbox::new();
    desk.write("m/bent.obj", bent());
    desk.write(
        "m/bent.mtl",
        "newmtl red\nKd 1 0.2 0.1\nKs 1 1 1\nillum 3\nnewmtl glow\nKd 0.5 0.5 0.5\nKe 0.3 0.3 0.1\n",
    );
    let mesh = |more: &str| format!("(mesh: (file: \"m/bent.obj\", smooth: true{more}), material: \"pattern\"");
    let scene = format!(
        "(camera: (from: (0, 3, 7), at: (0, 0, 0)), render: (size: (32, 24), samples: 4, integrator: Path),\n\
         materials: {{ \"pattern\": (color_map: (pattern: Checker, scale: 4)) }},\n\
         entities: [(plane: (point: (0, -1, 0))), {}), {}, transform: (translation: (2, 0, 0))), {}, transform: \
         (translation: (-2, 0, 0), scale: (-1, 1, 1))), (point_light: (position: (4, 8, 8)))])",
        mesh(""),
        mesh(""),
        mesh(", group: \"far\"")
    );
    desk.write("scene.ron", scene);
    desk.anim("scene.ron -o one.png --threads 1").ok();
    for other in ["--threads 3", "--accel brute", "--accel grid", "--accel bvh"] {
        desk.anim(&format!("scene.ron -o two.png {other} --force")).ok();
        assert!(desk.read("one.png") == desk.read("two.png"), "{other}");
    }
    desk.anim("convert scene.ron -o sub/again.ron").ok();
    desk.anim("sub/again.ron -o two.png --threads 1 --force --root .").ok();
    let pixels = |name| image::load_from_memory(&desk.read(name)).unwrap().to_rgb8();
    assert!(pixels("one.png") == pixels("two.png"));
}

/// A wavy sheet of 200 triangles: some of them plain, some red, some that glow.
fn bent() -> String {
    let mut obj = String::from("mtllib bent.mtl\n");
    for i in 0..11 {
        for j in 0..11 {
            let (x, z) = (f64::from(i) * 0.15 - 0.75, f64::from(j) * 0.15 - 0.75);
            obj += &format!("v {x} {} {z} 1 {} 1\nvt {x} {z}\n", (i * j % 5) as f64 * 0.06, f64::from(i) / 10.0);
        }
    }
    for i in 0..10 {
        obj +=
            ["g near\n", "g far\nusemtl red\n", "usemtl glow\n", "usemtl\n"].get(i as usize / 2).copied().unwrap_or("");
        for j in 0..10 {
            let at = |i: i32, j: i32| i * 11 + j + 1;
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            obj += &format!("f {a}/{a} {b}/{b} {c}/{c} {d}/{d}\n");
        }
    }
    obj
}
