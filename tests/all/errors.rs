//! Every kind of mistake, as a user meets it: the place, the word, the exit code, and nothing written.

use std::time::{Duration, Instant};

use crate::tool::Sandbox;

/// Renders a file with a mistake in it; gives what was said.
#[track_caller]
fn mistake(name: &str, text: impl AsRef<[u8]>, said: &[&str]) {
    let sandbox = Sandbox::new();
    sandbox.write(name, text);
    let start = Instant::now();
    sandbox.anim(&format!("render {name} -o out")).fails(3, said);
    assert!(start.elapsed() < Duration::from_secs(20));
    assert_eq!(sandbox.files(), [name]);
}

#[test]
fn a_misspelt_field() {
    let scene = "(\n  materials: { \"m\": (colour: (1.0, 0.0, 0.0)) },\n)";
    mistake("a.ron", scene, &["a.ron:2:22: error", "colour", "did you mean `color`?", "^^^^^^"]);
}

#[test]
fn a_bad_number() {
    mistake("a.ron", "(\n  entities: [(sphere: (radius: big))],\n)", &["a.ron:2:"]);
    mistake("a.ron", "(\n  entities: [(sphere: (radius: NaN))],\n)", &["a.ron:2:32", "radius", "finite"]);
    mistake("a.ron", "(\n  entities: [(sphere: (radius: 0.0))],\n)", &["a.ron:2:32", "`radius` must not be 0"]);
}

#[test]
fn several_mistakes_at_once() {
    let scene =
        "(\n  camera: (fov: 200.0),\n  entities: [\n    (sphere: (raduis: 1.0)),\n    (material: \"gone\"),\n  ],\n)";
    mistake("a.ron", scene, &["a.ron:2:17", "a.ron:4:15", "did you mean `radius`?", "a.ron:5:16", "gone"]);
}

#[test]
fn a_truncated_scene() {
    mistake("a.ron", "(\n  entities: [\n    (sphere: (radius: 1.0", &["a.ron:3:"]);
    mistake("a.ron", "", &["a.ron"]);
    mistake("a.ron", "(".repeat(200_000), &["a.ron:1:"]);
}

#[test]
fn a_missing_file() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", "()");
    let said = sandbox.anim("render scen.ron").stderr;
    assert!(said.contains("scen.ron") && said.contains("scene.ron"), "{said}");
    mistake("a.ron", "(entities: [(mesh: (file: \"bunny.obj\"))])", &["a.ron:1:", "bunny.obj"]);
    mistake("a.rhai", "animation(#{ scene: \"none.ron\" });\nfn frame(s, f) {}", &["a.rhai:1:", "none.ron"]);
}

#[test]
fn a_hostile_mesh_is_refused_before_memory_is_filled() {
    let sandbox = Sandbox::new();
    let header = "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n\
                  property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n";
    sandbox.write("m.ply", header).write("a.ron", "(entities: [(mesh: (file: \"m.ply\"))])");
    sandbox.anim("render a.ron").fails(3, &["m.ply"]);
    mistake("a.nff", "f 1 1 1 1 0 1 0 1\np 4000000000\n0 0 0\n", &["a.nff:2:"]);
}

#[test]
fn a_circle_of_parents() {
    let scene = r#"(entities: [
        (name: "a", transform: (parent: "b")),
        (name: "b", transform: (parent: "a")),
    ])"#;
    mistake("a.ron", scene, &["a.ron:2:", "a", "b"]);
}

#[test]
fn limits_of_texts_and_of_chains_of_parents_hold() {
    let link = |i: usize| match i {
        0 => "(name: \"e0\"),\n".to_string(),
        _ => format!("(name: \"e{i}\", transform: (parent: \"e{}\")),\n", i - 1),
    };
    let chain = |links: usize| format!("(entities: [\n{}])", (0..links).map(link).collect::<String>());
    mistake("deep.ron", chain(1500), &["deep.ron:1027:", "more than 1024 parents above entity `e1025`"]);
    let sandbox = Sandbox::new();
    sandbox.write("fits.ron", chain(1000));
    sandbox.anim("check fits.ron").ok();
    let long = "x".repeat(5000);
    let said = "a text of 5000 bytes is over the limit of 4096";
    mistake("a.ron", format!("(entities: [(name: \"{long}\", sphere: ())])"), &["a.ron:1:", said]);
    mistake("a.ron", format!("(entities: [(sphere: (), tags: [\"a\", \"{long}\"])])"), &["a.ron:1:", said]);
    mistake("a.ron", format!("(materials: {{ \"{long}\": () }})"), &["a.ron:1:", said]);
}

#[test]
fn a_script_that_runs_for_ever() {
    let script = "animation(#{ frames: 2 });\nfn frame(s, f) {\n  loop { }\n}";
    mistake("a.rhai", script, &["a.rhai:3:", "frame 1"]);
    mistake(
        "a.rhai",
        "animation(#{ frames: 2 });\nfn f(n) { f(n + 1) }\nfn frame(s, f) { f(0); }",
        &["a.rhai:3:18:", "too deep"],
    );
}

#[test]
fn a_mistake_in_every_frame() {
    let script = "animation(#{ frames: 40 });\nfn frame(s, f) {\n  s.camera.fvo = 3;\n}";
    mistake("a.rhai", script, &["a.rhai:3:", "frame 1", "fvo", "did you mean `fov`?"]);
}

#[test]
fn what_a_script_does_to_the_scene_has_a_place() {
    let in_frame = |body: &str, said: &[&str]| {
        let sandbox = Sandbox::new();
        sandbox.write("a.ron", "(render: (size: (4, 4)), camera: (aperture: 0.1, focus: Entity(\"a\")),\n entities: [\n  (name: \"a\", sphere: ()),\n  (name: \"b\", sphere: (), transform: (parent: \"a\")),\n ])");
        sandbox.write(
            "a.rhai",
            // Other functions, with variables of their own, stand beside it.
            format!(
                "animation(#{{ scene: \"a.ron\" }});\nfn frame(s, f) {{\n    let x = 1;\n{body}\n}}\n\
                 fn setup(s) {{ let a = 1; let b = a; s.camera.fov = 30; }}\nfn helper(a) {{ let b = a; b }}"
            ),
        );
        sandbox.anim("check a.rhai").fails(3, said);
    };
    in_frame("    s.camera.fov = 200;\n    let y = 2;", &["a.rhai:4:", "in frame 1", "fov"]);
    in_frame("    s.get(\"a\").parent = \"b\";", &["a.rhai:4:", "in a circle"]);
    in_frame("    let y = 2;\n    s.despawn(s.get(\"a\"));", &["a.rhai:5:", "removed"]);
    in_frame("    s.camera.from = [0, 0, -9];\n    s.camera.at = [0, 0, -19];", &["a.rhai:5:", "behind it"]);
    in_frame("    s.get(\"a\").translation = [0, 0, 99];", &["a.rhai:4:", "behind it"]);
    in_frame("    s.get(\"a\").texture = #{ image: \"none.png\" };", &["a.rhai:4:", "none.png"]);
    in_frame("    s.render.environment = \"none.hdr\";", &["a.rhai:4:", "none.hdr"]);
    in_frame("    s.despawn(s.get(\"b\"));\n    s.get(\"b\").yaw = 1;", &["a.rhai:5:", "entity `b` was removed"]);
}

#[test]
fn what_a_scene_says_has_a_place_when_it_is_seen_late() {
    let scene = "(\n  camera: (aperture: 0.1, at: (0.0, 1.0, 9.0),\n    focus: Point(0.0, 0.0, 0.0)),\n)";
    mistake("a.ron", scene, &["a.ron:3:12", "behind it"]);
    let twice = "(entities: [\n  (name: \"a\", sphere: (),\n   name: \"b\"),\n])";
    mistake("a.ron", twice, &["a.ron:3:", "name"]);
    mistake(
        "a.nff",
        "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 8 8\nb 2e9 0 0\n",
        &["a.nff:8:1", "background"],
    );
    mistake("a.rhai", "fn frame(s, f) {}", &["a.rhai:1:1", "does not call `animation`"]);
    mistake("a.rhai", "animation(#{});", &["a.rhai:1:1", "no function `frame(s, f)`"]);
}

#[test]
fn usage() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", "()");
    sandbox.anim("render a.ron --frames 3-1").fails(2, &["3-1"]);
    sandbox.anim("render a.ron --size 0x10").fails(2, &["size"]);
    sandbox.anim("render a.ron --szie 10x10").fails(2, &["--size"]);
    sandbox.anim("render").fails(2, &[]);
    sandbox.anim("render a.txt").fails(3, &["a.txt"]);
}

#[test]
fn the_worst_of_several_inputs_decides_the_exit_code() {
    let sandbox = Sandbox::new();
    sandbox.write("good.ron", "()").write("bad.ron", "(entities: [(sphere: (raduis: 1.0))])");
    sandbox.write("show.rhai", "animation(#{});\nfn frame(s, f) { let x = param(\"x\", 1); nonsense(); }");
    for inputs in ["bad.ron good.ron", "good.ron bad.ron"] {
        sandbox.anim(&format!("check {inputs}")).fails(3, &["raduis"]);
    }
    // A define that a scene cannot take is a mistake of usage.
    for inputs in ["show.rhai good.ron", "good.ron show.rhai"] {
        sandbox.anim(&format!("check {inputs} -D x=2")).fails(2, &["nonsense", "only a script has parameters"]);
    }
}

#[test]
fn output_that_cannot_be_written() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", "(render: (size: (4, 4), samples: 1))").write("taken", "a file, not a folder");
    sandbox.anim("render a.ron -o taken/x.png").fails(5, &["taken"]);
    assert_eq!(sandbox.files(), ["a.ron", "taken"]);
}

/// A disk on which nothing more can be written, as the system stands in for one.
#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_written_are_a_failure_and_a_reader_that_goes_away_is_none() {
    use std::process::{Command, Stdio};
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", "(render: (size: (4, 4), samples: 1), entities: [(sphere: ())])");
    sandbox.write("a.rhai", "animation(#{ scene: \"a.ron\", frames: 2 }); fn frame(s, f) {}");
    let run = |arguments: &str, stdout: Stdio| {
        let command = &mut Command::new(env!("CARGO_BIN_EXE_anim"));
        command.args(arguments.split(' ')).current_dir(sandbox.path("")).stdout(stdout).output().unwrap()
    };
    for arguments in ["help", "--version", "check --help"] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = run(arguments, full.into());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(5) && said.contains("No space left"), "{arguments}: {said}");
    }
    for arguments in ["dump a.rhai --frame 1", "guide", "help"] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = run(arguments, writer.into());
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn a_folder_that_is_deleted_while_frames_are_written_into_it_is_a_failure() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", "(render: (size: (64, 64), samples: 16), entities: [(name: \"a\", sphere: ())])");
    let moving = "fn frame(s, f) { s.camera.fov = 30 + f.number; }";
    sandbox.write("a.rhai", format!("animation(#{{ scene: \"a.ron\", frames: 12 }}); {moving}"));
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_anim"))
        .args(["a.rhai", "-o", "out", "--threads", "1"])
        .current_dir(sandbox.path(""))
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    while !sandbox.exists("out/a.0001.png") {
        assert!(child.try_wait().unwrap().is_none(), "it ends before it has written a frame");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    // A frame that is written meanwhile makes the folder again.
    let _ = std::fs::remove_dir_all(sandbox.path("out"));
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(5) && said.contains("a.0001.png was written and is gone"), "{said}");
}
