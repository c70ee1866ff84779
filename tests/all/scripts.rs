//! What scripts do, as a user meets it: data, parameters, printing, simulation, and the reference.

use crate::tool::Sandbox;

#[test]
fn a_table_of_numbers_moves_a_chart() {
    let sandbox = Sandbox::new();
    sandbox
        .write("level.csv", "time,level,note\n0,1.5,a\n1,,b\n2,3.5,c\n")
        .write("places.json", "{ \"bars\": [[0, 0, 0], [1, 0, 0]] }")
        .write(
            "chart.rhai",
            "const DATA = load_csv(\"level.csv\");
             animation(#{ frames: DATA.len() });
             fn setup(s) {
                 let i = 0;
                 for at in load_json(\"places.json\").bars { s.spawn(#{ name: `bar ${i}`, aabox: #{}, translation: at }); i += 1; }
             }
             fn frame(s, f) {
                 let level = DATA[f.index].level ?? DATA.highest(\"level\");
                 s.get(\"bar 1\").scale = [1, level, 1];
                 if f.number == 3 { print(`${DATA[2].note} of ${DATA.column(\"time\")}`); }
             }",
        );
    let dumped = sandbox.anim("dump chart.rhai --frame 2").ok().stdout;
    assert!(dumped.contains("scale: (1.0, 3.5, 1.0)"), "{dumped}");
    let said = sandbox.anim("check chart.rhai").ok().stderr;
    assert!(said.contains("chart.rhai:10: in frame 3: c of [0, 1, 2]"), "{said}");
    sandbox.write("level.csv", "time,level,note\n0,1.5,a\n1,2.5,b\n2,high,c\n3,1,d\n");
    sandbox
        .anim("check chart.rhai")
        .fails(3, &["level.csv:4:3: error", "a number in the column `level`", "chart.rhai:1"]);
    sandbox.write("a.rhai", "animation(#{}); fn frame(s, f) { load_text(\"/etc/hosts\"); }");
    sandbox.anim("check a.rhai").fails(3, &["a.rhai:1"]);
}

#[test]
fn parameters_are_listed_and_their_ranges_hold() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "show.rhai",
        "animation(#{ frames: 2 });
         fn frame(s, f) {
             s.camera.aperture = param(\"aperture\", 0.2, #{ min: 0, max: 1, step: 0.01, label: \"Lens opening\" });
             s.camera.lens = param(\"lens\", \"Disk\", #{ choices: [\"Disk\", \"Square\"] });
         }",
    );
    let listed = sandbox.anim("check show.rhai --params --json").ok().stdout;
    let listed: serde_json::Value = serde_json::from_str(&listed).unwrap();
    assert_eq!(listed["parameters"][0]["name"], "aperture");
    assert_eq!(listed["parameters"][0]["max"], 1.0);
    assert_eq!(listed["parameters"][0]["label"], "Lens opening");
    assert_eq!(listed["parameters"][1]["choices"][1], "Square");
    let text = sandbox.anim("check show.rhai --params").ok().stdout;
    assert!(text.contains("aperture = 0.2   a number from 0 to 1"), "{text}");
    sandbox.anim("check show.rhai -D aperture=2").fails(3, &["-D aperture=2: expected a number from 0 to 1"]);
    sandbox.anim("check show.rhai -D apperture=1").fails(2, &["did you mean `aperture`?"]);
}

#[test]
fn what_is_printed_may_go_to_a_file() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "a.rhai",
        "animation(#{ frames: 3 });\nfn frame(s, f) { print(\"hello\"); s.camera.fov = 20 + f.index; }",
    );
    let said = sandbox.anim("check a.rhai").ok().stderr;
    assert_eq!(said.trim(), "a.rhai:2: in frames 1-3: hello");
    let said = sandbox.anim("check a.rhai --log said.txt").ok().stderr;
    assert_eq!(said, "");
    assert_eq!(sandbox.read("said.txt"), b"a.rhai:2: in frames 1-3: hello\n");
}

/// Shards, in any order, and the whole make the same bytes.
#[test]
fn a_simulation_is_the_same_in_shards() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "ball.rhai",
        "animation(#{ frames: 6, steps_per_frame: 3, fps: 12 });
         fn setup(s) { s.spawn(#{ name: \"ball\", sphere: #{ radius: 0.5 } }); s.spawn(#{ point_light: #{ position: [3, 5, 5] } }); }
         fn start(s) { #{ y: 1.5, speed: 0.0 } }
         fn step(state, f) {
             state.speed -= 9.8 * f.dt;
             state.y += state.speed * f.dt;
             if state.y < -0.5 { state.y = -0.5; state.speed = -0.8 * state.speed; }
             state
         }
         fn frame(s, f) { s.get(\"ball\").translation.y = f.state.y; }",
    );
    let look = "--size 32x18 --spp 1";
    sandbox.anim(&format!("ball.rhai {look} -o whole")).ok();
    for shard in [3, 1, 2] {
        sandbox.anim(&format!("ball.rhai {look} -o parts --shard {shard}/3")).ok();
    }
    for frame in 1..=6 {
        let of = |folder: &str| sandbox.read(&format!("{folder}/ball.{frame:04}.png"));
        assert_eq!(of("whole"), of("parts"), "{frame}");
    }
    assert_ne!(sandbox.read("whole/ball.0001.png"), sandbox.read("whole/ball.0004.png"));
}

#[test]
fn the_guide_is_printed_and_written() {
    let sandbox = Sandbox::new();
    let contents = sandbox.anim("guide").ok().stdout;
    for page in ["script", "scene", "materials", "camera", "errors", "coming-from"] {
        assert!(contents.contains(page), "{contents}");
        assert!(!sandbox.anim(&format!("guide {page}")).ok().stdout.is_empty());
    }
    assert!(sandbox.anim("guide script").ok().stdout.contains("along(path, t) -> vector"));
    sandbox.anim("guide scirpt").fails(2, &["did you mean `script`?"]);
    sandbox.anim("guide --html site --no-pictures").ok();
    assert!(
        sandbox.exists("site/index.html") && sandbox.exists("site/script.html") && sandbox.exists("site/search.js")
    );
    let schema: serde_json::Value = serde_json::from_str(&sandbox.anim("guide --schema").ok().stdout).unwrap();
    assert!(schema["properties"]["entities"]["items"]["properties"]["sphere"].is_object());
    sandbox.anim("guide --definitions .").ok();
    assert!(sandbox.exists("anim.d.rhai"));
    assert!(sandbox.anim("completions bash").ok().stdout.contains("anim"));
    sandbox.anim("man pages").ok();
    assert!(sandbox.exists("pages/anim.1") && sandbox.exists("pages/anim-render.1"));
}

#[test]
fn what_can_hardly_be_meant_is_warned_of() {
    let sandbox = Sandbox::new();
    let scene = |light: &str| {
        format!(
            "(camera: (from: (0, 0, 5), at: (0, 0, 0)), entities: [(name: \"ball\", sphere: ()), {light}
              (name: \"lost\", sphere: (), transform: (translation: (0, 0, 20)))])"
        )
    };
    sandbox.write("dark.ron", scene("")).write("lit.ron", scene("(point_light: (position: (0, 5, 5))),"));
    let said = sandbox.anim("check dark.ron").ok();
    assert!(said.stderr.contains("dark.ron: warning: there is no light in the scene"), "{}", said.stderr);
    assert!(said.stderr.contains("dark.ron:2:15: warning: entity `lost` is outside the picture"), "{}", said.stderr);
    assert!(said.stdout.contains("2 warnings"), "{}", said.stdout);
    sandbox.anim("check lit.ron --strict").fails(3, &["error: entity `lost` is outside the picture"]);
    let metal = "(materials: {\n \"m\": (metallic: 1.0),\n}, entities: [(sphere: (), material: \"m\"), (point_light: (position: (0, 5, 5)))])";
    sandbox.write("metal.ron", metal);
    let said = ["metal.ron:2:", "`metallic` is not used by `BlinnPhong`, only by `Principled`"];
    sandbox.anim("check metal.ron --strict").fails(3, &said);
    sandbox.write(
        "still.rhai",
        "animation(#{ scene: \"lit.ron\", frames: 3 });\nfn frame(s, f) { s.get(\"ball\").yaw = 90; s.despawn(s.get(\"lost\")); }",
    );
    sandbox.anim("check still.rhai --strict").fails(3, &["still.rhai: error: nothing moves: all 3 frames"]);
    sandbox.write(
        "moves.rhai",
        "animation(#{ scene: \"lit.ron\", frames: 3 });\nfn setup(s) { s.despawn(s.get(\"lost\")); }\nfn frame(s, f) { s.get(\"ball\").translation.x = f.t; }",
    );
    assert!(sandbox.anim("check moves.rhai --strict").ok().stdout.contains("good"));
}

#[test]
fn editors_get_mistakes_and_warnings_with_their_places() {
    let sandbox = Sandbox::new();
    sandbox
        .write("a.ron", "(camera: (fov: 40),\n entities: [(sphere: (radios: 1))])")
        .write("b.ron", "(entities: [(sphere: ())])");
    let outcome = sandbox.anim("check a.ron b.ron --json");
    let lines: Vec<serde_json::Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((lines[0]["good"].clone(), lines[1]["good"].clone()), (false.into(), true.into()));
    let mistake = &lines[0]["diagnostics"][0];
    assert_eq!((&mistake["severity"], &mistake["file"]), (&"error".into(), &"a.ron".into()));
    assert_eq!((&mistake["line"], &mistake["column"], &mistake["width"]), (&2.into(), &23.into(), &6.into()));
    assert_eq!(mistake["help"], "did you mean `radius`?");
    assert_eq!(lines[1]["diagnostics"][0]["severity"], "warning");
    assert!(outcome.stderr.is_empty(), "{}", outcome.stderr);
}

#[test]
fn limits_are_raised_by_the_header_and_the_command_line() {
    let sandbox = Sandbox::new();
    let show = |header: &str, body: &str| {
        let text = format!("animation(#{{ {header} }});\nfn frame(s, f) {{ {body} }}");
        sandbox.write("a.rhai", text);
    };
    let busy = "let n = 0; for i in 0..2000 { n += i; }";
    show("limits: #{ operations: 2000 }", busy);
    let help = "allow more with animation(#{ limits: #{ operations: 20000 } }) or -D limits.operations=20000";
    let said = ["a.rhai:2:", "the script runs for too long: more than 2000 operations in one call", help];
    sandbox.anim("check a.rhai").fails(3, &said);
    sandbox.anim("check a.rhai -D limits.operations=1e5").ok();
    show("limits: #{ operations: param(\"most\", 1e5) }", busy);
    sandbox.anim("check a.rhai").ok();
    sandbox.anim("check a.rhai -D most=2000").fails(3, &["more than 2000 operations"]);
    // They hold for the rest of the top level, too.
    sandbox.write("top.rhai", "animation(#{ limits: #{ operations: 2000 } });\nloop { }\nfn frame(s, f) { }");
    sandbox.anim("check top.rhai").fails(3, &["top.rhai:2:", "more than 2000 operations"]);
    show("limits: #{ memory: 24 }", "let all = []; loop { all.push([f.index, 0.5, \"abc\"]); }");
    sandbox.anim("check a.rhai").fails(3, &["a.rhai:2:", "the script holds more than 24 MiB", "-D limits.memory=240"]);
    show("limits: #{ spawns: 3 }", "for i in 0..9 { s.spawn(#{ sphere: #{} }); }");
    sandbox.anim("check a.rhai").fails(3, &["a.rhai:2:", "more than 3 entities", "-D limits.spawns=30"]);
    sandbox.anim("check a.rhai -D limits.spawns=9").ok();
    show("limits: #{ operatoins: 5 }", "");
    sandbox
        .anim("check a.rhai")
        .fails(3, &["a.rhai:1:", "there is no limit `operatoins`", "did you mean `operations`?"]);
    show("limits: #{ operations: 1e30 }", "");
    sandbox.anim("check a.rhai").fails(3, &["the limit `operations` goes from 1 to 50000000000"]);
    show("", "");
    sandbox.anim("check a.rhai -D limits.time=5").fails(2, &["-D limits.time=5: there is no limit `time`"]);
}

/// Long lists cost what is done with them, and not what is in them.
#[test]
fn lists_grow_as_long_as_data_is() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "long.rhai",
        "animation(#{ frames: 1 });
         fn setup(s) {
             let all = [];
             for i in 0..100_000 { all.push(i * 0.5); }
             let map = #{};
             for i in 0..40_000 { map[`k${i}`] = i; }
             all[99_999] += map.k7;
             s.camera.fov = all[99_999] / 50_000 * 10 + all.len() / 100_000;
         }
         fn frame(s, f) { }",
    );
    let dumped = sandbox.anim("dump long.rhai --frame 1").ok().stdout;
    assert!(dumped.contains("fov: 11.0013"), "{dumped}");
}

/// Whatever a script calls the scene and the frame, and wherever it keeps them.
#[test]
fn the_scene_may_have_any_name() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "a.rhai",
        "animation(#{ frames: 2 });
         fn build(world) { world.spawn(#{ name: \"a\", sphere: #{} }); world.get(\"a\").yaw = 3; }
         fn setup(stage) {
             build(stage);
             let all = #{ stage: stage };
             all.stage.get(\"a\").pitch = 4;
             stage.add_material(\"m\", #{});
         }
         fn frame(stage, time) {
             stage.get(\"a\").translation.y = time.t;
             stage.material(\"m\").color = [1, 0, 0];
             stage.camera.fov = 30;
         }",
    );
    let dumped = sandbox.anim("dump a.rhai --frame 2").ok().stdout;
    assert!(
        dumped.contains("rotation: (4.0, 3.0, 0.0)") && dumped.contains("translation: (0.0, 1.0, 0.0)"),
        "{dumped}"
    );
    assert!(dumped.contains("color: (1.0, 0.0, 0.0)") && dumped.contains("fov: 30.0"), "{dumped}");
}

/// A run in the middle of a sequence goes on from a state beside the frames, if all that it follows from is as it was.
#[test]
fn a_simulation_goes_on_from_what_is_kept_beside_its_frames() {
    let sandbox = Sandbox::new();
    let script = "animation(#{ frames: 150 });
        fn start(s) { #{ x: 0.1, size: 0.125 } }
        fn step(state, f) {
            import \"rules\" as rules;
            state.x = rules::next(state.x);
            state
        }
        fn frame(s, f) {
            s.spawn(#{ sphere: #{ radius: 0.5 * f.state.x + f.state.size } });
            s.spawn(#{ point_light: #{ position: [0, 3, 3] } });
            s.render.size = [16, 12];
            s.render.samples = 4;
        }";
    sandbox.write("rules.rhai", "fn next(x) { 3.7 * x * (1.0 - x) }").write("a.rhai", script);
    let frames = |folder: &str| {
        sandbox.anim(&format!("a.rhai --frames 20,149,150 -o {folder}/ --force")).ok();
        [20, 149, 150].map(|frame| sandbox.read(&format!("{folder}/a.{frame:04}.png")))
    };
    let first = frames("out");
    let kept = || sandbox.files().into_iter().filter(|file| file.starts_with("out/.anim-checkpoints/"));
    assert_eq!(kept().count(), 3, "{:?}", kept().collect::<Vec<_>>());
    assert!(frames("out") == first);
    // That a state is gone on from shows where it is another one under a seal that is right.
    let change = |file: &str, is_sealed: bool| {
        let mut bytes = sandbox.read(file);
        let at = bytes.windows(8).position(|bytes| bytes == 0.125f64.to_le_bytes()).unwrap();
        bytes[at..at + 8].copy_from_slice(&0.5f64.to_le_bytes());
        let end = bytes.len() - 16;
        if is_sealed {
            let seal = anim::base::digest::Digest::of(&bytes[..end]).0.to_le_bytes();
            bytes[end..].copy_from_slice(&seal);
        }
        sandbox.write(file, bytes);
    };
    let latest = kept().find(|file| file.ends_with("-148.state")).unwrap();
    let whole = sandbox.read(&latest);
    change(&latest, true);
    let others = frames("out");
    assert!(others[0] == first[0] && others[1] != first[1] && others[2] != first[2]);
    // Without its seal it counts as none.
    sandbox.write(&latest, whole);
    change(&latest, false);
    assert!(frames("out") == first);
    // Another module: nothing of what is there is used.
    kept().filter(|file| *file != latest).for_each(|file| change(&file, true));
    sandbox.write("rules.rhai", "fn next(x) { 3.6 * x * (1.0 - x) }");
    assert!(frames("out") == frames("fresh"));
}

/// Morphs between meshes of one topology, and many places for one mesh.
#[test]
fn meshes_are_blended_and_put_in_many_places() {
    let sandbox = Sandbox::new();
    let script = |share: &str| {
        format!(
            "animation(#{{ frames: 2 }});
            fn setup(s) {{
                s.spawn(#{{ name: \"a\", mesh: torus(1, 0.1) }});
                s.spawn(#{{ name: \"b\", mesh: torus(1, 0.5), translation: [9, 0, 0] }});
                let places = [];
                for i in 0..20000 {{ places.push([i, 0, 0]); }}
                s.instances(#{{ mesh: rounded_box(0.4, 0.1) }}, places);
            }}
            fn frame(s, f) {{
                let a = s.get(\"a\");
                a.mesh = a.mesh.blend(s.get(\"b\").mesh, {share});
                print(a.bounds.size.y);
            }}"
        )
    };
    let said = |share: &str| sandbox.write("a.rhai", script(share)).anim("plan a.rhai").ok().stderr;
    assert!(said("0.5").contains("0.6") && said("0").contains("0.2") && said("2.0").contains("1.8"));
    sandbox.write("a.rhai", script("0.5").replace("torus(1, 0.5)", "torus(1, 0.5, #{ sides: 9 })"));
    sandbox.anim("plan a.rhai").fails(3, &["9216 triangles do not become", "one topology"]);
    sandbox.write("a.rhai", script("0.5").replace("s.get(\"b\").mesh", "7"));
    sandbox.anim("plan a.rhai").fails(3, &["expected a mesh, found the number 7"]);
}
