//! What frames share is traced once, and no byte shows it.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::tool::{Run, Sandbox};

fn number(line: &str, key: &str) -> u64 {
    serde_json::from_str::<serde_json::Value>(line).unwrap()[key].as_u64().unwrap()
}

fn sum(run: &Run, key: &str) -> u64 {
    run.stdout.lines().map(|line| number(line, key)).sum()
}

fn pictures(sandbox: &Sandbox, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let files = sandbox.files().into_iter().filter(|file| file.ends_with(".png"));
    files.filter_map(|file| Some((file.strip_prefix(folder)?.to_string(), sandbox.read(&file)))).collect()
}

/// Renders a script as it is, frame by frame without reuse, and on two shards; gives the statistics of the first.
#[track_caller]
fn same_bytes(sandbox: &Sandbox, name: &str, more: &str) -> Run {
    let run = sandbox.anim(&format!("{name} -o kept/ --stats json {more}")).ok();
    let fresh = sandbox.anim(&format!("{name} -o fresh/ --no-reuse --threads 1 --stats json {more}")).ok();
    assert_eq!(sum(&fresh, "tiles_kept") + sum(&fresh, "passes_kept") + sum(&fresh, "photon_maps_kept"), 0);
    for shard in 1..=2 {
        sandbox.anim(&format!("{name} -o shards/ --shard {shard}/2 {more}")).ok();
    }
    let kept = pictures(sandbox, "kept/");
    for folder in ["fresh/", "shards/"] {
        for (name, bytes) in pictures(sandbox, folder) {
            assert!(kept[&name] == bytes, "{folder}{name} differs {more}");
        }
    }
    for folder in ["kept", "fresh", "shards"] {
        std::fs::remove_dir_all(sandbox.path(folder)).unwrap();
    }
    run
}

const ROOM: &str = r#"(
    camera: (from: (0.0, 3.0, 8.0), at: (0.0, 0.5, 0.0)),
    render: (size: (64, 48), samples: 4, background: (0.1, 0.1, 0.2), max_depth: 4),
    materials: {
        "mirror": (diffuse: 0.2, specular: 0.7, gloss: 0.05),
        "glass": (diffuse: 0.0, specular: 0.4, transmission: 1.0, ior: 1.5),
        "red": (color: (0.8, 0.1, 0.1)),
    },
    entities: [
        (name: "floor", aabox: (min: (-9.0, -0.2, -9.0), max: (9.0, 0.0, 9.0))),
        (name: "wall", aabox: (min: (-9.0, 0.0, -9.2), max: (9.0, 6.0, -9.0)), material: "mirror"),
        (name: "a", sphere: (radius: 0.7), transform: (translation: (-1.5, 0.7, 0.0)), material: "glass"),
        (name: "b", sphere: (radius: 0.5), transform: (translation: (1.5, 0.5, 1.0)), material: "red"),
        (name: "c", cone: (), transform: (translation: (0.3, 0.0, -2.0), parent: "b"), material: "mirror"),
        (name: "key", point_light: (position: (3.0, 6.0, 4.0), color: (0.7, 0.7, 0.6))),
        (name: "fill", area_light: (size: (2.0, 2.0), color: (9.0, 9.0, 12.0), falloff: InverseSquare),
            transform: (translation: (-4.0, 5.0, 2.0))),
    ],
)"#;

const INTEGRATORS: [&str; 3] = ["whitted", "distribution", "path"];

#[test]
fn colours_of_lights_cost_one_frame() {
    let sandbox = Sandbox::new();
    let script = r#"animation(#{ scene: "a.ron", frames: 6 });
        fn frame(s, f) {
            if f.number < 6 { s.get("key").color = [f.t, 0.5, 1.0 - f.t]; }
            s.get("fill").area_light.color = if f.number == 3 { [0, 0, 0] } else { [9.0 * f.t, 3, 1] };
        }"#;
    sandbox.write("a.ron", ROOM).write("a.rhai", script);
    for integrator in INTEGRATORS {
        let run = same_bytes(&sandbox, "a.rhai", &format!("--integrator {integrator} --size 32x24"));
        // Three passes, traced in the first of six frames.
        assert_eq!((sum(&run, "passes"), sum(&run, "passes_kept")), (18, 15));
        // A plan counts the passes that are not there any more.
        let more = format!("--integrator {integrator} --size 32x24");
        sandbox.anim(&format!("a.rhai -o out/ {more}")).ok();
        std::fs::remove_file(sandbox.path("out/a.0004.png")).unwrap();
        std::fs::remove_file(sandbox.path("out/a.0005.png")).unwrap();
        let plan = sandbox.anim(&format!("plan a.rhai -o out/ {more}")).ok().stdout;
        assert!(plan.contains("4 done, 2 missing; 1 to trace"), "{plan}");
        std::fs::remove_dir_all(sandbox.path("out")).unwrap();
        // A few of the frames are what they are among all.
        sandbox.anim(&format!("a.rhai -o some/ --size 32x24 --integrator {integrator} --frames 4,2")).ok();
        sandbox.anim(&format!("a.rhai -o all/ --size 32x24 --integrator {integrator} --reuse-memory 0")).ok();
        let all = pictures(&sandbox, "all/");
        assert!(pictures(&sandbox, "some/").iter().all(|(name, bytes)| all[name] == *bytes));
    }
}

/// The room with a lamp of glowing glass, one of brass that glows in some frames, and something bright around it.
fn glowing(around: &str) -> String {
    let materials = r#""glow": (emission: (2.0, 1.0, 0.5)), "ember": (model: Conductor, roughness: 0.3),
        "idle": (emission: (9.0, 9.0, 9.0)),"#;
    let entities = r#"(sphere: (radius: 0.4), transform: (translation: (-3.0, 2.0, 1.0)), material: "glow"),
        (aabox: (min: (2.0, 0.0, -1.0), max: (3.0, 1.0, 0.0)), material: "ember"),
        (cone: (), transform: (translation: (-2.0, 0.0, 3.0)), material: "glow"),"#;
    ROOM.replace("background: (0.1, 0.1, 0.2)", around)
        .replace("materials: {", &format!("materials: {{ {materials}"))
        .replace("entities: [", &format!("entities: [ {entities}"))
}

#[test]
fn colours_of_what_glows_and_of_what_lies_around_cost_one_frame() {
    let sandbox = Sandbox::new();
    let script = |around: &str| {
        format!(
            "animation(#{{ scene: \"a.ron\", frames: 5 }});\nfn frame(s, f) {{
                s.material(\"glow\").emission = [3.0 * f.t, 1, 2.0 - f.t];
                if f.number > 2 {{ s.material(\"ember\").emission = [f.t, 0.2, 0]; }}
                s.material(\"idle\").emission = [f.t, 0, 0];
                if f.number == 4 {{ s.get(\"key\").color = [0.1, 0.7, 0.9]; }}
                {around}
            }}"
        )
    };
    let sky = "sky: ((0.2, 0.3, 0.6), (0.5, 0.5, 0.5), (0.1, 0.1, 0.1))";
    for (around, edit) in [
        ("background: (0.1, 0.1, 0.2)", "s.render.background = [0.2 * f.t, 0.1, 0.3];"),
        (sky, "s.render.environment_intensity = 2.0 * f.t;"),
    ] {
        sandbox.write("a.ron", glowing(around)).write("a.rhai", script(edit));
        for integrator in INTEGRATORS {
            let run = same_bytes(&sandbox, "a.rhai", &format!("--integrator {integrator} --size 32x24 --spp 4"));
            // One for each of what glows, the lamp and the surroundings, and the rest; traced in the first of five.
            assert_eq!((sum(&run, "passes"), sum(&run, "passes_kept")), (25, 20), "{integrator} {around}");
        }
    }
}

#[test]
fn a_sum_over_what_glows_is_the_light_of_all_of_it() {
    let sandbox = Sandbox::new();
    let lit = "s.material(\"glow\").emission = [3, 1, 1]; s.material(\"ember\").emission = [0.5, 0.2, 0];";
    let sky = "sky: ((0.2, 0.3, 0.6), (0.5, 0.5, 0.5), (0.1, 0.1, 0.1))";
    for (around, edit) in [
        ("background: (0.1, 0.1, 0.2)", "s.render.background = [0.3, 0.1, 0.2];"),
        (sky, "s.render.environment_intensity = 0.5;"),
    ] {
        let show = |frames: u32| {
            format!(
                "animation(#{{ scene: \"a.ron\", frames: {frames} }});
                fn frame(s, f) {{ if f.number == 1 {{ {lit} {edit} }} }}"
            )
        };
        // Without what only lucky paths find: caustics, and a cone that shines and cannot be asked.
        let swap = |scene: String, [from, to]: [&str; 2]| {
            assert!(scene.contains(from));
            scene.replace(from, to)
        };
        let matt = [
            ["material: \"glass\"", "material: \"red\""],
            ["diffuse: 0.2, specular: 0.7, gloss: 0.05", "diffuse: 0.4"],
            ["(-2.0, 0.0, 3.0)), material: \"glow\"", "(-2.0, 0.0, 3.0)), material: \"red\""],
        ];
        let scene = matt.into_iter().fold(glowing(around), swap);
        sandbox.write("a.ron", scene).write("sum.rhai", show(2)).write("one.rhai", show(1));
        for integrator in INTEGRATORS {
            let more = format!("--integrator {integrator} --size 8x6 --spp 256 --frames 1");
            sandbox.anim(&format!("sum.rhai -o sum.png {more}")).ok();
            sandbox.anim(&format!("one.rhai -o one.png {more}")).ok();
            // Lights are chosen by other chances then, and paths are noisy.
            let tolerance = if integrator == "path" { 0.1 } else { 0.01 };
            sandbox.anim(&format!("diff sum.png one.png --tolerance {tolerance}")).ok();
        }
    }
}

#[test]
fn a_sum_of_passes_is_the_light_of_all_lights() {
    let sandbox = Sandbox::new();
    let script = "animation(#{ scene: \"a.ron\", frames: 2 });\n\
                  fn frame(s, f) { s.get(\"key\").color = [0.3, 0.4 * f.index, 0.5]; }";
    sandbox.write("a.ron", ROOM).write("a.rhai", script);
    for integrator in INTEGRATORS {
        sandbox.anim(&format!("a.rhai -o out --integrator {integrator} --size 16x12 --spp 256")).ok();
        sandbox.write("b.ron", ROOM.replace("color: (0.7, 0.7, 0.6)", "color: (0.3, 0.4, 0.5)"));
        sandbox.anim(&format!("b.ron -o b.png --integrator {integrator} --size 16x12 --spp 256")).ok();
        // Paths choose lights by another chance then, and are noisy.
        let tolerance = if integrator == "path" { 0.2 } else { 0.005 };
        sandbox.anim(&format!("diff out/a.0002.png b.png --tolerance {tolerance}")).ok();
    }
}

#[test]
fn a_body_that_moves_costs_the_tiles_that_see_it() {
    let sandbox = Sandbox::new();
    let script = r#"animation(#{ scene: "a.ron", frames: 5 });
        fn frame(s, f) {
            s.get("b").translation = [1.5 + 0.1 * f.index, 0.5, 1.0];
            if f.number == 3 { s.get("b").material = "glass"; }
            if f.number == 4 { s.spawn(#{ sphere: #{ radius: 0.2 }, translation: [-3, 0.2, 3] }); }
        }"#;
    sandbox.write("a.ron", ROOM).write("a.rhai", script);
    for integrator in INTEGRATORS {
        let run = same_bytes(&sandbox, "a.rhai", &format!("--integrator {integrator} --size 96x64 --spp 1"));
        let (tiles, kept) = (sum(&run, "tiles"), sum(&run, "tiles_kept"));
        assert!(integrator == "path" || kept * 3 > tiles, "{integrator}: {kept} of {tiles}");
    }
}

#[test]
fn photons_are_sent_once_while_only_the_camera_or_the_film_changes() {
    let sandbox = Sandbox::new();
    let script = r#"animation(#{ scene: "a.ron", frames: 7 });
        fn frame(s, f) {
            s.camera.from = [0.3 * f.index, 3, 8];
            if f.number == 2 { s.camera.aperture = 0.2; s.camera.focus_distance = 7.0; }
            if f.number == 3 { s.render.exposure = 1.0; s.render.filter = "Gaussian"; }
            if f.number > 4 { s.material("red").color = [0.1, 0.8, 0.1]; }
            if f.number > 6 { s.get("key").color = [0.1, 0.8, 0.1]; }
        }"#;
    sandbox.write("a.ron", ROOM.replace("max_depth", "photons: 1000, photon_passes: 3, max_depth"));
    let more = "--integrator photon --size 16x12 --spp 4";
    // Frames 1 to 4 and 5 to 6 see the same light; with a shutter each moment has maps of its own.
    for (shutter, maps) in [("", 3), ("s.camera.shutter = [0.0, 0.5]; s.render.shutter_slices = 2;", 2)] {
        sandbox.write("a.rhai", script.replace("s.camera.from", &format!("{shutter} s.camera.from")));
        let run = same_bytes(&sandbox, "a.rhai", more);
        assert_eq!((sum(&run, "photon_maps"), sum(&run, "photon_maps_kept")), (7 * maps, 4 * maps));
        assert!(sum(&run, "reuse_bytes") > 0);
        let none = sandbox.anim(&format!("a.rhai -o none/ --stats json --reuse-memory 0 {more}")).ok();
        assert_eq!((sum(&none, "photon_maps_kept"), sum(&none, "reuse_bytes")), (0, 0));
        std::fs::remove_dir_all(sandbox.path("none")).unwrap();
    }
    let plan = sandbox.anim(&format!("plan a.rhai --json {more}")).ok();
    let words: Vec<serde_json::Value> = plan.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let words: Vec<&str> = words.iter().map(|line| line["reuse"].as_str().unwrap()).collect();
    assert_eq!(words, ["none", "photons", "photons", "photons", "none", "photons", "none"]);
}

/// A small generator of its own: scripts of this test are the same everywhere.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % sides
    }
}

/// A room with something of everything, and settings of chance.
fn random_room(dice: &mut Dice) -> String {
    let mut pick = |of: &[&str]| of[dice.roll(of.len() as u64) as usize].to_string();
    let more = [
        pick(&["", "aperture: 0.2, focus_distance: 7.0,"]),
        pick(&["", "transparent_shadows: true,", "noise_threshold: 0.05, min_samples: 4,"]),
        pick(&["", "filter: Mitchell,", "denoise: true,", "sky: ((0.3, 0.4, 0.8), (0.8, 0.8, 0.8), (0.2, 0.2, 0.1)),"]),
        pick(&["", "shadows: Fixed, shadow_samples: 4,", "shadows: Hard,"]),
        pick(&["mirror", "tiled", "rough"]),
        pick(&["plane: ()", "aabox: (min: (-6.0, -0.2, -6.0), max: (6.0, 0.0, 6.0))"]),
    ];
    let [camera, tracing, film, shadows, worn, floor] = more;
    format!(
        r#"(
    camera: (from: (0.5, 2.5, 7.0), at: (0.0, 0.6, 0.0), {camera}),
    render: (background: (0.1, 0.1, 0.2), max_depth: 4, {tracing} {film} {shadows}),
    materials: {{
        "mirror": (diffuse: 0.4, reflection: 0.3),
        "glossy": (diffuse: 0.2, reflection: 0.7, gloss: 0.1),
        "glass": (diffuse: 0.0, specular: 0.4, transmission: 1.0, ior: 1.5),
        "rough": (model: Plastic, color: (0.2, 0.4, 0.7), ior: 1.5, roughness: 0.3),
        "tiled": (color_map: (pattern: Checker, scale: 4.0), bump: (pattern: Noise, depth: 0.05), reflection: 0.1),
    }},
    entities: [
        (name: "floor", {floor}, material: "{worn}"),
        (name: "hub", transform: (translation: (0.2, 0.6, 0.0))),
        (name: "a", mesh: ({OCTAHEDRON}), transform: (translation: (1.0, 0.0, 0.0), parent: "hub"), material: "glossy"),
        (name: "b", mesh: ({OCTAHEDRON}), transform: (translation: (-1.0, 0.2, 0.3), scale: (0.4, 0.8, 0.5), parent: "hub")),
        (name: "c", sphere: (radius: 0.4), transform: (translation: (-0.4, 0.4, 1.5)), material: "glass"),
        (name: "d", cylinder: (radius: 0.3), transform: (translation: (2.0, 0.3, -1.0)), material: "tiled"),
        (name: "e", aabox: (), transform: (translation: (-2.2, 0.5, -1.0)), material: "rough"),
        (sphere: (center: (0.0, 0.3, -2.0), radius: 0.3), material: "mirror"),
        (name: "key", point_light: (position: (3.0, 6.0, 4.0), color: (0.7, 0.7, 0.6))),
        (name: "fill", area_light: (size: (2.0, 2.0), color: (9.0, 9.0, 12.0), falloff: InverseSquare),
            transform: (translation: (-4.0, 5.0, 2.0))),
    ],
)"#
    )
}

const OCTAHEDRON: &str = "vertices: [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], \
     triangles: [(2, 4, 0), (2, 0, 5), (2, 5, 1), (2, 1, 4), (3, 0, 4), (3, 5, 0), (3, 1, 5), (3, 4, 1)]";

/// A script whose frames change one thing or another.
fn random_script(dice: &mut Dice) -> String {
    let mut script = String::from("animation(#{ scene: \"a.ron\", frames: 5 });\nfn frame(s, f) {\n");
    for _ in 0..1 + dice.roll(3) {
        let name = ["a", "b", "c", "d", "e"][dice.roll(5) as usize];
        let x = dice.roll(40) as f64 / 10.0 - 2.0;
        let edit = match dice.roll(20) {
            0..4 => "s.get(\"hub\").yaw = 200 * f.t;".into(),
            4..7 => format!("s.get(\"{name}\").translation = [{x} + f.t, 0.6, 0.5];"),
            7..9 => format!("s.get(\"{name}\").yaw = 90 * f.t;"),
            9 => format!("s.get(\"{name}\").scale = 0.5 + 0.5 * f.t;"),
            10 | 11 => format!("s.get(\"{name}\").material = \"mirror\";"),
            12 => "s.material(\"mirror\").color = [0.5, f.t, 0.1];".into(),
            13 | 14 => {
                format!(
                    "s.spawn(#{{ sphere: #{{ radius: 0.3 }}, translation: [{x}, f.t, 2.0], material: \"glass\" }});"
                )
            }
            15 => format!("s.despawn(s.get(\"{name}\"));"),
            16 => format!("s.camera.fov = {};", 40.0 + x),
            17 => "s.get(\"key\").color = [f.t, 0.5, 0.5]; s.render.background = [0.1, f.t, 0.2];".into(),
            18 => format!("s.get(\"fill\").translation = [{x}, 5, 2];"),
            _ => "s.material(\"tiled\").emission = [1, 1, 0];".into(),
        };
        let when = match dice.roll(4) {
            0 => format!("if f.number == {} ", 1 + dice.roll(5)),
            1 => format!("if f.number > {} ", 1 + dice.roll(4)),
            _ => String::new(),
        };
        let _ = writeln!(script, "    {when}{{ {edit} }}");
    }
    script + "}"
}

/// Sequences of chance under an integrator, rendered both ways.
fn random_edits(integrator: &str, seeds: std::ops::Range<u64>) {
    let sandbox = Sandbox::new();
    let mut kept = 0.0;
    for seed in seeds {
        let mut dice = Dice(seed);
        sandbox.write("a.ron", random_room(&mut dice)).write("a.rhai", random_script(&mut dice));
        let size = ["--size 32x24 --spp 4", "--size 40x30 --spp 1"][seed as usize % 2];
        let run = same_bytes(&sandbox, "a.rhai", &format!("--integrator {integrator} {size}"));
        let share = |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["share_kept"].as_f64();
        kept += run.stdout.lines().filter_map(share).sum::<f64>();
    }
    assert!(kept > 0.0);
}

#[test]
fn random_edits_give_the_bytes_of_a_fresh_whitted_run() {
    random_edits("whitted", 0..3);
}

#[test]
fn random_edits_give_the_bytes_of_a_fresh_distribution_run() {
    random_edits("distribution", 10..14);
}

#[test]
fn random_edits_give_the_bytes_of_a_fresh_path_run() {
    random_edits("path", 20..23);
}

#[test]
fn short_of_memory_pixels_are_kept_as_wholes() {
    let sandbox = Sandbox::new();
    let script = "animation(#{ scene: \"a.ron\", frames: 4 });\n\
                  fn frame(s, f) { s.get(\"b\").translation = [1.5, 0.5 + f.t, 1.0]; }";
    sandbox.write("a.ron", ROOM).write("a.rhai", script);
    let run = |memory: u32| same_bytes(&sandbox, "a.rhai", &format!("--size 64x48 --spp 16 --reuse-memory {memory}"));
    let (little, ample) = (run(1), run(64));
    let most = |run: &Run| run.stdout.lines().map(|line| number(line, "reuse_bytes")).max().unwrap();
    assert!(most(&little) <= 1 << 20 && most(&ample) > 1 << 20, "{} {}", most(&little), most(&ample));
    assert!(sum(&little, "tiles_kept") > 0 && sum(&ample, "tiles_kept") > 0);
    // Samples are finer than pixels.
    assert!(sum(&ample, "primary_rays") < sum(&little, "primary_rays"));
}

#[test]
fn a_turning_piece_before_a_mirror_costs_what_sees_it() {
    let sandbox = Sandbox::new();
    let script = "animation(#{ scene: \"a.ron\", frames: 4, mode: \"loop\" });\n\
                  fn frame(s, f) { s.get(\"c\").yaw = 360 * f.t; s.get(\"b\").translation = [1.5, 0.5 + f.t, 1.0]; }";
    sandbox.write("a.ron", ROOM).write("a.rhai", script);
    for integrator in INTEGRATORS {
        let run = same_bytes(&sandbox, "a.rhai", &format!("--integrator {integrator} --size 64x48"));
        let (first, all) = (number(run.stdout.lines().next().unwrap(), "primary_rays"), sum(&run, "primary_rays"));
        assert!(all < first * 3, "{integrator}: {all} of {first} a frame");
    }
}

/// Who sees a body, its tags and the links of lamps change from frame to frame.
#[test]
fn what_rays_meet_and_lamps_light_changes_in_the_same_bytes() {
    let sandbox = Sandbox::new();
    let script = r#"animation(#{ scene: "a.ron", frames: 6 });
        fn setup(s) { s.get("key").light_link = #{ excludes: ["shy"] }; }
        fn frame(s, f) {
            let b = s.get("b");
            b.visible = f.number != 2;
            if f.number == 3 { b.visible.shadow = false; }
            if f.number == 4 { b.visible.camera = false; b.tags = ["shy"]; }
            if f.number >= 5 { s.get("floor").tags = ["shy"]; s.get("fill").visible = #{ shadow: false }; }
            if f.number == 6 { s.get("fill").shadow_link = #{ includes: ["shy"] }; }
        }"#;
    sandbox.write("a.ron", ROOM).write("a.rhai", script);
    for integrator in INTEGRATORS {
        let run = same_bytes(&sandbox, "a.rhai", &format!("--integrator {integrator} --size 32x24"));
        // Every path of so small a room may see a body whose shadow comes and goes.
        assert!(integrator == "path" || sum(&run, "tiles_kept") > 0, "{integrator}");
        let plan = sandbox.anim(&format!("plan a.rhai --json --integrator {integrator} --size 32x24")).ok().stdout;
        let hashes: std::collections::BTreeSet<&str> = plan.split('"').filter(|word| word.len() == 32).collect();
        assert!(hashes.len() >= 6, "{plan}");
    }
}
