//! Settings that count for nothing, each told at its place by whatever reads the scene.

use crate::tool::Sandbox;

/// The place of a text in a scene, as messages have it.
#[track_caller]
fn place_of(scene: &str, written: &str) -> String {
    let at = scene.find(written).unwrap_or_else(|| panic!("{written}"));
    let value = at + written.find(": ").map_or(0, |colon| colon + 2);
    let line = scene[..value].matches('\n').count() + 1;
    let column = scene[..value].chars().rev().take_while(|c| *c != '\n').count() + 1;
    format!("a.ron:{line}:{column}: ")
}

/// Checks a scene in which all of these are idle: what is written, and a part of what is said of it there.
#[track_caller]
fn idle(scene: &str, expected: &[(&str, &str)]) {
    let sandbox = Sandbox::new();
    let said = sandbox.write("a.ron", scene).anim("check a.ron").ok().stderr;
    for (written, part) in expected {
        let place = place_of(scene, written);
        let told = said.lines().any(|line| line.starts_with(&place) && line.contains("warning") && line.contains(part));
        assert!(told, "{place}{part}\n{said}");
    }
    assert_eq!(said.matches(" warning: ").count(), expected.len(), "{said}");
}

#[test]
fn settings_whose_place_another_one_takes_are_told() {
    idle(
        "(
    camera: (fov: 40.0, focal_length: 35.0, f_stop: 2.0, aperture: 0.5, focus: Point(0.0, 0.0, 0.0), focus_distance: 3.0),
    render: (samples: 4, background: (0.5, 0.5, 0.5), sky: ((0.1, 0.2, 0.3), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1)), daylight: ()),
    entities: [
        (name: \"a\", sphere: (), transform: (
            translation: (0.0, 0.5, 0.0), matrix: ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)))),
        (area_light: (size: (2.0, 1.0), edges: ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))),
    ],
)",
        &[
            ("fov: 40.0", "`focal_length` takes its place"),
            ("aperture: 0.5", "`focal_length` and `f_stop`"),
            ("focus: Point", "`focus_distance` takes its place"),
            ("background: ", "`daylight` takes its place"),
            ("sky: ", "`daylight` takes its place"),
            ("translation: ", "`matrix` takes its place"),
            ("size: (2.0", "`edges` take its place"),
        ],
    );
}

#[test]
fn settings_that_nothing_asks_for_are_told() {
    idle(
        "(
    camera: (focus: Point(0.0, 0.0, 0.0), lens: Square, blade_angle: 3.0, sensor_width: 24.0),
    render: (samples: 3, denoise: true, photons: 9, environment_intensity: 2.0, shutter_slices: 4, dither: true, bit_depth: 16),
    materials: {
        \"a\": (gloss: 0.2, color: (255.0, 128.0, 0.0)),
        \"b\": (model: Plastic, specular: 0.5, reflection_map: (pattern: Checker)),
        \"c\": (model: Principled, metallic: 0.5, roughness: 0.5),
    },
    entities: [
        (name: \"a\", sphere: (), material: \"a\"),
        (mesh: ()),
        (point_light: (intensity: 0.0)),
        (point_light: (color: (255.0, 255.0, 200.0))),
    ],
)",
        &[
            ("focus: ", "open lens"),
            ("lens: ", "open lens"),
            ("blade_angle: ", "`blades`"),
            ("sensor_width: ", "`focal_length`"),
            ("samples: 3", "rounded down from 3 to 1"),
            ("denoise: ", "one sample"),
            ("photons: ", "`Photon`"),
            ("environment_intensity: ", "`environment`"),
            ("shutter_slices: ", "`shutter`"),
            ("dither: ", "8 bits"),
            ("gloss: ", "`reflection` is 0"),
            ("color: (255.0, 128", "0 to 255"),
            ("specular: 0.5", "`BlinnPhong`"),
            ("reflection_map: ", "`Principled`"),
            ("mesh: ", "no triangles"),
            ("intensity: 0.0", "sends out none"),
            ("color: (255.0, 255", "0 to 255"),
        ],
    );
}

/// A script may rack the focus of a scene that says what it is on, and open its lens.
#[test]
fn what_a_script_overrides_is_meant() {
    let sandbox = Sandbox::new();
    let scene = "(camera: (focus: Entity(\"a\"), aperture: 0.0), render: (size: (8, 8), samples: 4),
        entities: [(name: \"a\", sphere: ()), (point_light: (position: (3.0, 4.0, 5.0)))])";
    sandbox.write("a.ron", scene);
    let script = "s.camera.focus_distance = 3 + f.t; s.camera.aperture = 0.1 * f.t;";
    sandbox.write("a.rhai", format!("animation(#{{ scene: \"a.ron\", frames: 3 }});\nfn frame(s, f) {{ {script} }}"));
    let said = sandbox.anim("check a.rhai --strict").ok();
    assert!(said.stdout.contains("good"), "{}", said.stdout);
    let spawned = "s.spawn(#{ scale: 2, sphere: #{}, transform: #{ translation: [0, f.t, 0] } });";
    sandbox.write("b.rhai", format!("animation(#{{ scene: \"a.ron\", frames: 2 }});\nfn frame(s, f) {{ {spawned} }}"));
    let dumped = sandbox.anim("dump b.rhai --frame 2").ok().stdout;
    assert!(dumped.contains("scale: 2") && dumped.contains("translation: (0.0, 1.0, 0.0)"), "{dumped}");
    let twice = "s.spawn(#{ translation: [0, 1, 0], transform: #{ translation: [0, f.t, 0] } });";
    sandbox.write("c.rhai", format!("animation(#{{ scene: \"a.ron\", frames: 2 }});\nfn frame(s, f) {{ {twice} }}"));
    sandbox.anim("check c.rhai").fails(3, &["c.rhai:2:", "`translation`", "beside `transform`"]);
}

#[test]
fn rendering_says_what_check_says_before_the_first_frame() {
    let sandbox = Sandbox::new();
    let lamp = |i: usize| format!("(point_light: (intensity: 0.0, position: (0.0, {i}.0, 0.0))),");
    let lamps: String = (0..9).map(lamp).collect();
    let scene = format!("(render: (size: (8, 8), samples: 3), entities: [(name: \"a\", sphere: ()), {lamps}])");
    sandbox.write("a.ron", &scene);
    sandbox.anim("render a.ron -o strict.png --strict").fails(3, &["a.ron:1:", "error: render: `samples`"]);
    assert!(!sandbox.exists("strict.png"));
    let said = sandbox.anim("render a.ron -o out.png").ok().stderr;
    assert_eq!(said.matches(" warning: ").count(), 8, "{said}");
    assert!(said.contains("2 more warnings: anim check a.ron"), "{said}");
    // What is done is not looked at again.
    assert_eq!(sandbox.anim("render a.ron -o out.png").ok().stderr, "");
    assert_eq!(sandbox.anim("render a.ron -o quiet.png --quiet").ok().stderr, "");
    sandbox
        .write("still.rhai", "animation(#{ scene: \"a.ron\", frames: 3 });\nfn frame(s, f) { s.render.samples = 1; }");
    let said = sandbox.anim("render still.rhai -o f").ok().stderr;
    assert!(said.contains("nothing moves: all 3 frames"), "{said}");
}

#[test]
fn what_is_scaled_flat_is_found_by_check() {
    let sandbox = Sandbox::new();
    for shape in ["cylinder: ()", "aabox: ()", "plane: (normal: (0.0, 1.0, 0.0))", "cone: ()", "sphere: ()"] {
        sandbox.write("a.ron", format!("(entities: [\n  ({shape},\n   transform: (scale: (1.0, 0.0, 1.0)))])"));
        sandbox.anim("check a.ron").fails(3, &["a.ron:3:", "scaled flat"]);
    }
    sandbox.write("a.ron", "(entities: [(name: \"a\", sphere: ()), (point_light: ())])");
    let script =
        "animation(#{ scene: \"a.ron\", frames: 3 });\nfn frame(s, f) {\n  s.get(\"a\").scale = [1, 1 - f.t, 1];\n}";
    sandbox.write("a.rhai", script);
    sandbox.anim("check a.rhai").fails(3, &["a.rhai:3:", "in frame 3", "scaled flat"]);
}

#[test]
fn a_misspelt_command_or_ending_has_its_word() {
    let sandbox = Sandbox::new();
    sandbox.write("a.rhi", "").write("a.rhai", "");
    sandbox.anim("chek a.rhai").fails(2, &["there is no command `chek`", "did you mean `check`?"]);
    sandbox.anim("check a.rhi").fails(3, &["a.rhi", "did you mean `.rhai`?", ".ron"]);
}
