//! Every idiom of the script contract, and every way to get it wrong.

use std::sync::Arc;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::components::*;

pub fn scene() -> Arc<Scene> {
    let ball = |name: &str, z: f64| {
        let transform = Transform { translation: DVec3::new(0.0, 0.0, z), ..Transform::default() };
        EntityDesc::new([transform.into(), Sphere::default().into(), MaterialName("brass".into()).into()]).named(name)
    };
    let lamp = EntityDesc::new([AreaLight::default().into()]).named("key");
    Arc::new(Scene {
        camera: Camera { from: DVec3::new(0.0, 0.0, 10.0), ..Camera::default() },
        materials: vec![("brass".into(), Material::default())],
        entities: vec![ball("near", 8.0), ball("far", 2.0), lamp],
        ..Scene::default()
    })
}

pub fn open(text: &str, defines: &[(&str, &str)]) -> Result<Program, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("show.rhai");
    std::fs::write(&path, text).unwrap();
    let defines: Vec<_> = defines.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
    let project = Project::of(&path, &Default::default()).map_err(|d| d.to_string())?;
    Program::open(&path, &defines, &project, &Evaluation::InProcess).map_err(|d| d.to_string())
}

/// The edits of frame 3 out of 5 of a script with this body of `frame`.
fn frame(body: &str) -> Result<Vec<Edit>, String> {
    let text = format!("animation(#{{ frames: 5 }});\nconst SIZE = 2;\nfn frame(s, f) {{\n{body}\n}}");
    open(&text, &[])?.frame(&scene(), 3, 0.0).map_err(|d| d.to_string())
}

fn camera(body: &str) -> Camera {
    match frame(body).unwrap().remove(0) {
        Edit::Camera(camera) => camera,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn said(body: &str, expected: &[&str]) {
    let message = frame(body).map(|_| String::new()).unwrap_or_else(|message| message);
    for part in expected {
        assert!(message.contains(part), "`{part}` is not in:\n{message}");
    }
}

#[test]
fn fields_are_read_and_written_wherever_they_are() {
    let edits = frame(
        "s.camera.fov = 50; s.camera.from.x = 2; s.render.samples = 4;
         s.material(\"brass\").color = [1, 0, 0];
         let near = s.get(\"near\"); near.translation.y += 0.5; near.yaw = 360 * f.t; near.sphere.radius = SIZE;
         s.get(\"key\").color = s.get(\"key\").color * 3; s.get(\"key\").area_light.size = [2, f.t];
         s.get(\"far\").material = (); s.get(\"far\").cone = #{ base_radius: 2 }; s.get(\"far\").tags = [\"x\"];",
    )
    .unwrap();
    let transform = Transform {
        translation: DVec3::new(0.0, 0.5, 8.0),
        rotation: DVec3::new(0.0, 180.0, 0.0),
        ..Transform::default()
    };
    let light = AreaLight { color: DVec3::splat(3.0), size: glam::DVec2::new(2.0, 0.5), ..AreaLight::default() };
    let put = |entity, component: Component| Edit::Put { entity, component };
    let expected = [
        Edit::Camera(Camera { fov: 50.0, from: DVec3::new(2.0, 0.0, 10.0), ..scene().camera.clone() }),
        Edit::Render(Render { samples: 4, ..Render::default() }),
        Edit::Material { index: 0, material: Material { color: DVec3::X, ..Material::default() } },
        put(0, transform.into()),
        put(0, Sphere { radius: 2.0, ..Sphere::default() }.into()),
        put(1, Cone { base_radius: 2.0, ..Cone::default() }.into()),
        Edit::Take { entity: 1, kind: Kind::MaterialName },
        put(2, light.into()),
        Edit::Tags { entity: 1, tags: vec!["x".into()] },
    ];
    assert_eq!(edits, expected);
}

#[test]
fn writing_back_what_was_there_is_no_edit() {
    assert_eq!(frame("s.camera.fov = s.camera.fov; s.get(\"near\").translation = [0, 0, 8];").unwrap(), []);
}

#[test]
fn entities_come_and_go() {
    let edits = frame(
        "let e = s.spawn(#{ name: \"new\", sphere: #{ radius: 0.2 }, translation: polar(3, 90), material: \"brass\" });
         e.yaw = 5; s.despawn(s.get(\"far\"));
         if s.has(\"far\") || !s.has(\"new\") || s.entities().len() != 3 { throw \"lost\"; }",
    )
    .unwrap();
    let [Edit::Spawn(desc), Edit::Despawn { entity: 1 }] = &edits[..] else { panic!("{edits:?}") };
    let Some(Component::Transform(t)) = desc.get(Kind::Transform) else { panic!() };
    assert_eq!((t.translation, t.rotation.y), (DVec3::new(0.0, 0.0, -3.0), 5.0));
}

#[test]
fn focus_is_racked_in_inverse_distance() {
    // Subjects at 2 and 8: half way in 1/d is 1 / (0.3125) = 3.2.
    let distance = camera("s.camera.focus_distance = rack(\"near\", \"far\", f.t);").focus_distance.unwrap();
    assert!((distance - 3.2).abs() < 1e-12);
    assert_eq!(camera("s.camera.focus_distance = s.rack(4, [0, 0, 5], 1);").focus_distance, Some(5.0));
}

#[test]
fn keys_and_vectors() {
    let at = |body: &str| camera(&format!("s.camera.at = {body};")).at;
    assert_eq!(at("keys([[0, [0, 0, 0]], [1, [2, 4, 6]]], f.t)"), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(at("keys([[0, [0, 0, 0]], [0.25, [1, 1, 1], \"in_quad\"]], f.t)"), DVec3::ONE);
    assert_eq!(at("vec3(1, 2, 3) * 2 + [1, 0, 0] - vec3(0, 1, 0) / 2"), DVec3::new(3.0, 3.5, 6.0));
    assert_eq!(at("orbit([0, 1, 0], 2, 0.25)"), DVec3::new(0.0, 1.0, -2.0));
    assert_eq!(at("[lerp(0, 2, f.t), sind(90), f.span(0, 1)]"), DVec3::new(1.0, 1.0, 0.5));
}

#[test]
fn time_is_clip_or_loop() {
    for (mode, expected) in [("clip", [0.0, 0.5, 1.0]), ("loop", [0.0, 1.0 / 3.0, 2.0 / 3.0])] {
        let text = format!(
            "animation(#{{ frames: 3, mode: \"{mode}\", fps: 2 }}); fn frame(s, f) {{ s.camera.fov = 1.0 + f.t; }}"
        );
        let program = open(&text, &[]).unwrap();
        for (number, t) in (1..).zip(expected) {
            let Edit::Camera(camera) = program.frame(&scene(), number, 0.0).unwrap().remove(0) else { panic!() };
            assert_eq!(camera.fov, 1.0 + t);
        }
    }
}

#[test]
fn rates_are_fractions() {
    let of = |fps: &str| open(&format!("animation(#{{ fps: {fps} }}); fn frame(s, f) {{}}"), &[]);
    let rate = |fps: &str| of(fps).unwrap().header().rate.to_string();
    assert_eq!(rate("30"), "30");
    assert_eq!(rate("12.5"), "25/2");
    for ntsc in ["23.976", "24000.0 / 1001.0", "\"24000/1001\""] {
        assert_eq!(rate(ntsc), "24000/1001");
    }
    for wrong in ["0", "-24", "\"24/0\"", "\"fast\"", "2e6", "[24]"] {
        let said = of(wrong).err().unwrap();
        assert!(said.contains("fps") || said.contains("number"), "{wrong}: {said}");
    }
}

#[test]
fn time_runs_on_between_frames() {
    let at = |mode: &str, number: u32, offset: f64| {
        let header = format!("animation(#{{ frames: 5, fps: 2, mode: \"{mode}\" }});");
        let body = "fn frame(s, f) { s.camera.from = [f.t, f.seconds, f.number * 10 + f.index]; }";
        let program = open(&format!("{header} {body}"), &[]).unwrap();
        let Edit::Camera(camera) = program.frame(&scene(), number, offset).unwrap().remove(0) else { panic!() };
        camera.from
    };
    assert_eq!(at("clip", 2, 0.5), DVec3::new(0.375, 0.75, 21.0));
    assert_eq!(at("loop", 2, 0.25), DVec3::new(0.25, 0.625, 21.0));
    // A clip goes on beyond its ends, and a loop goes round.
    assert_eq!(at("clip", 5, 0.5), DVec3::new(1.125, 2.25, 54.0));
    assert_eq!(at("clip", 1, -0.5), DVec3::new(-0.125, -0.25, 10.0));
    assert_eq!(at("loop", 5, 1.5), DVec3::new(0.1, 2.75, 54.0));
    assert_eq!(at("loop", 1, -0.5).x, 0.9);
}

#[test]
fn frames_are_pure_and_random_numbers_are_theirs() {
    let text = "animation(#{ frames: 9, seed: 4 }); fn frame(s, f) { s.camera.fov = f.rng.range(20, 60); }";
    let program = open(text, &[]).unwrap();
    let of = |n| program.frame(&scene(), n, 0.0).unwrap();
    let forwards: Vec<_> = (1..=9).map(of).collect();
    let backwards: Vec<_> = (1..=9).rev().map(of).collect();
    assert!(forwards.iter().eq(backwards.iter().rev()));
    assert_ne!(forwards[0], forwards[1]);
}

#[test]
fn parameters_are_read_like_their_defaults() {
    let text = "animation(#{ frames: param(\"n\", 3) }); fn frame(s, f) { s.camera.fov = param(\"fov\", 40.0); }";
    let program = open(text, &[("n", "7"), ("fov", "50")]).unwrap();
    assert_eq!(program.header().frames, 7);
    let Edit::Camera(camera) = program.frame(&scene(), 7, 0.0).unwrap().remove(0) else { panic!() };
    assert_eq!(camera.fov, 50.0);
    assert!(open(text, &[("n", "many")]).err().unwrap().contains("-D n=many: expected a whole number"));
    assert!(open(text, &[("fow", "1")]).err().unwrap().contains("did you mean `fov`?"));
}

#[test]
fn mistakes_have_a_place_a_frame_and_a_better_word() {
    let message = frame("s.camera.fvo = 3;").unwrap_err();
    assert!(message.contains("show.rhai:4:"), "{message}");
    said("s.camera.fvo = 3;", &["in frame 3: unknown field `fvo` of the camera", "did you mean `fov`?"]);
    said("s.get(\"naer\");", &["there is no entity `naer`", "did you mean `near`?"]);
    said("s.material(\"bras\").colour = 1;", &["did you mean `brass`?"]);
    said("s.get(\"near\").colr = 1;", &["unknown property `colr` of entity `near`"]);
    said("s.get(\"near\").sphere.radius = 0;", &["sphere of entity `near`: `radius` must not be 0"]);
    said("s.get(\"near\").sphere.radius = \"x\";", &["expected a number, found the text \"x\""]);
    said("s.get(\"near\").material = \"gold\";", &["there is no material `gold`"]);
    said("s.get(\"near\").parent = \"nobody\";", &["there is no entity `nobody`"]);
    said("s.camera.lens = \"Dsik\";", &["`lens` of the camera: expected one of Disk, Square", "did you mean `Disk`?"]);
    said("let x = eaze(\"in_quad\", 1);", &["there is no function `eaze`", "`ease`"]);
    said("let x = ease(\"in_qaud\", 1);", &["there is no easing `in_qaud`", "`in_quad`"]);
    said("let lamp = 1; x = lmap;", &["there is no variable"]);
    said("s.spawn(#{ spere: #{} });", &["unknown property `spere`", "did you mean `sphere`?"]);
    said("s.camera.fov = 10", &[]);
    said("let x = [1, 2", &["show.rhai:4:"]);
}

#[test]
fn headers_are_checked() {
    let fails = |text: &str, word: &str| {
        let message = open(text, &[]).err().unwrap();
        assert!(message.contains(word), "{message}");
    };
    fails("fn frame(s, f) {}", "does not call `animation`");
    fails("animation(#{});", "no function `frame(s, f)`");
    fails("animation(#{ frame: 3 }); fn frame(s, f) {}", "did you mean `frames`?");
    fails("animation(#{ frames: 0 }); fn frame(s, f) {}", "from 1 to");
    fails("animation(#{ mode: \"lop\" }); fn frame(s, f) {}", "did you mean `loop`?");
}

#[test]
fn a_script_stays_in_its_sandbox() {
    said("loop { }", &["in frame 3: the script runs for too long"]);
    said("fn g(n) { g(n + 1) } g(0);", &[]);
    for body in ["eval(\"1\")", "sleep(1)", "timestamp()", "2.0 ** 0.5"] {
        assert!(frame(&format!("let x = {body};")).is_err(), "{body}");
    }
    for path in ["../secret", "/etc/hosts", "none"] {
        assert!(frame(&format!("import \"{path}\" as m;")).is_err(), "{path}");
    }
    let deep = "animation(#{}); fn g(n) { g(n + 1) } fn frame(s, f) { g(0); }";
    let message = open(deep, &[]).unwrap().frame(&scene(), 1, 0.0).unwrap_err().to_string();
    assert!(message.contains("too deep"), "{message}");
    said("let a = []; loop { a.push(a); }", &["show.rhai:4:", "a list grows beyond"]);
    said("let t = \"x\"; loop { t += t; }", &["a text grows beyond"]);
}

/// What a script prints while its frames 1 to 3 are evaluated.
fn printed(text: &str) -> Vec<String> {
    let program = open(text, &[]).unwrap();
    (1..=3).for_each(|n| drop(program.frame(&scene(), n, 0.0).unwrap()));
    let short = |line: String| line[line.find("show.rhai").unwrap()..].to_string();
    program.take_printed().into_iter().map(short).collect()
}

#[test]
fn division_of_whole_numbers_gives_a_fraction() {
    let fov = |body: &str| camera(&format!("s.camera.fov = {body};")).fov;
    assert_eq!(fov("40 + f.index / f.count * 10"), 44.0);
    assert_eq!(fov("360 * f.index / 7"), 720.0 / 7.0);
    assert_eq!(fov("7 / 2 + div(7, 2) + 7 % 2 + -7 / 2.0 + 10"), 14.0);
    assert_eq!(camera("let n = 9; n /= 2; s.camera.fov = n; s.camera.fov /= 3;").fov, 1.5);
    assert_eq!(camera("let a = [1, 2]; a[f.index - 1] /= 4; s.camera.fov = a[1];").fov, 0.5);
    said("let x = 1 / 0;", &["1 / 0: a division by 0", "show.rhai:4:"]);
}

#[test]
fn ranges_and_indices_take_whole_fractions() {
    assert_eq!(
        camera("let n = 0; for i in 0..6 / 2 { n += i; } for i in 1.0..=3.0 { n += i; } s.camera.fov = n;").fov,
        9.0
    );
    assert_eq!(camera("let a = [10, 20, 30]; s.camera.fov = a[4 / 2] + a[floor(1.7)];").fov, 50.0);
    said("let a = [1]; let b = a[1 / 2];", &["an index must be a whole number, not 0.5", "show.rhai:4:24"]);
    said("for i in 0..5 / 2 { }", &["the end of a range must be a whole number, not 2.5"]);
}

#[test]
fn the_scene_may_have_any_name() {
    let text = "animation(#{ frames: 5 });
        fn tint(stage) { stage.get(\"near\").yaw = 5; stage.get(`${\"far\"}`).sphere.radius += 1; }
        fn setup(world) { world.material(\"brass\").color = [1, 0, 0]; }
        fn frame(anything, f) { tint(anything); let m = #{ get: 3 }; m.get += 1; }";
    let program = open(text, &[]).unwrap();
    assert_eq!(program.frame(&scene(), 1, 0.0).unwrap().len(), 2);
    assert_eq!(program.setup(&scene()).unwrap().len(), 1);
}

#[test]
fn rows_of_subjects_are_racked_with_marks() {
    let at = |body: &str| camera(&format!("s.camera.focus_distance = {body};")).focus_distance.unwrap();
    assert!((at("rack([\"near\", \"far\"], f.t)") - 3.2).abs() < 1e-12);
    assert!((at("rack([\"near\", s.get(\"far\"), 2], 0.5)") - 8.0).abs() < 1e-12);
    assert!((at("s.rack([[0, \"near\"], [0.5, \"near\"], [1.0, \"far\", \"linear\"]], 0.75)") - 3.2).abs() < 1e-12);
    assert!((at("rack([[0, 0, 8], [0, 0, 2]], 0.5, \"in_out_sine\")") - 3.2).abs() < 1e-12);
    said("rack([[0.5, \"near\"], [0.2, \"far\"]], 1);", &["the mark at 0.2 comes after 0.5"]);
    said("rack(\"key\", [0, 0, 20], 1);", &["is not in front of the camera"]);
}

#[test]
fn keys_know_subjects_holds_and_angles() {
    let at = |body: &str| camera(&format!("s.camera.at = {body};")).at;
    assert_eq!(at("keys([[0, \"near\"], [1, \"far\"]], 0.5)"), DVec3::new(0.0, 0.0, 5.0));
    assert_eq!(at("keys([#{ at: 0, value: [0, 0, 0], hold: 0.5 }, [1, [0, 4, 0]]], 0.75)"), DVec3::new(0.0, 2.0, 0.0));
    assert_eq!(at("[keys([[0, 350], [1, 10]], 0.5, #{ angles: true }), 0, 0]"), DVec3::new(360.0, 0.0, 0.0));
    said("keys([[0, \"naer\"], [1, \"far\"]], 0.5);", &["no entity `naer`", "`near`"]);
    said("keys([[1, 2], [0, 3]], 0.5);", &["time 0 comes after 1"]);
}

#[test]
fn paths_run_through_entities_too() {
    let at = |body: &str| camera(&format!("s.camera.at = {body};")).at;
    assert_eq!(at("along(path([\"near\", \"far\"]), 0.5)"), DVec3::new(0.0, 0.0, 5.0));
    said("path([[0, 0, 0]]);", &["a path needs at least 2 points"]);
    said("path([[0, 0, 0], [1, 1, 1]], #{ knid: 3 });", &["path has no option `knid`", "`kind`"]);
}

#[test]
fn lists_of_numbers_scale_like_vectors_and_vectors_index_like_lists() {
    let at = |body: &str| camera(&format!("s.camera.at = {body};")).at;
    assert_eq!(at("[1, 2, 3] * f.t"), DVec3::new(0.5, 1.0, 1.5));
    assert_eq!(at("[2, 4, 6] / 2 - [1, 1, 1]"), DVec3::new(0.0, 1.0, 2.0));
    let indexed = camera("let v = s.camera.from; v[0] = 7; s.camera.at = [v[0], v[-1], v.z];").at;
    assert_eq!(indexed, DVec3::new(7.0, 10.0, 10.0));
    said("let v = s.camera.from; v[3];", &["a vector has the coordinates 0, 1 and 2, not the number 3"]);
}

#[test]
fn what_a_script_prints_is_kept_with_its_place_and_frames() {
    let text = "print(\"top\");\nanimation(#{ frames: 3 });\nfn frame(s, f) {\n  print(\"same\");\n  print(`n ${f.number}`); \
                debug([\"a\", 1]);\n  \"method\".print();\n}";
    assert_eq!(
        printed(text),
        [
            "show.rhai:1: top",
            "show.rhai:4: in frames 1-3: same",
            "show.rhai:5: in frames 1-3: [\"a\", 1]",
            "show.rhai:5: in frame 1: n 1",
            "show.rhai:5: in frame 2: n 2",
            "show.rhai:5: in frame 3: n 3",
            "show.rhai:6: in frames 1-3: method",
        ]
    );
}

#[test]
fn parameters_are_declared_with_ranges() {
    let text = "const A = param(\"aperture\", 0.2, #{ min: 0, max: 1, step: 0.01, label: \"Lens opening\" });
        animation(#{});
        fn frame(s, f) { s.camera.aperture = A; s.camera.lens = param(\"lens\", \"Disk\", #{ choices: [\"Disk\", \"Square\"] }); }";
    let program = open(text, &[("aperture", "0.75")]).unwrap();
    let Edit::Camera(camera) = program.frame(&scene(), 1, 0.0).unwrap().remove(0) else { panic!() };
    assert_eq!(camera.aperture, 0.75);
    let lines: Vec<String> = program.parameters().iter().map(Parameter::line).collect();
    assert_eq!(
        lines,
        ["aperture = 0.2   a number from 0 to 1 in steps of 0.01   Lens opening", "lens = Disk   one of Disk, Square"]
    );
    let refused = |name: &str, value: &str| match open(text, &[(name, value)]) {
        Ok(program) => program.frame(&scene(), 1, 0.0).unwrap_err().to_string(),
        Err(message) => message,
    };
    assert!(refused("aperture", "1.5").contains("-D aperture=1.5: expected a number from 0 to 1"));
    assert!(refused("lens", "Sqare").contains("did you mean `Square`?"));
    let twice = "animation(#{ frames: param(\"n\", 2) }); fn frame(s, f) { param(\"n\", 3); }";
    let message = open(twice, &[]).unwrap().frame(&scene(), 1, 0.0).unwrap_err().to_string();
    assert!(message.contains("`n` is declared twice"), "{message}");
}

#[test]
fn limits_point_at_the_statement() {
    let script = |helper: &str, body: &str| {
        let text = format!("animation(#{{}});\nfn helper(n) {{\n{helper}\n}}\nfn frame(s, f) {{\n{body}\n}}");
        open(&text, &[]).unwrap().frame(&scene(), 1, 0.0).unwrap_err().to_string()
    };
    let said = script("n", "let x = 0;\nwhile x >= 0 {\nx += 1;\n}");
    assert!(["show.rhai:7:", "show.rhai:8:"].iter().any(|place| said.contains(place)), "{said}");
    // In a function it is the call of it.
    let said = script("loop { n += 1; }", "let x = 0;\nfor i in 0..3 {\nx += i;\nhelper(x);\n}");
    assert!(said.contains("show.rhai:9:"), "{said}");
    let said = script("n", "let t = \"x\";\nloop {\nt += t;\n}");
    assert!(said.contains("show.rhai:8:") && said.contains("a text grows beyond"), "{said}");
}

#[test]
fn closures_tell_no_name() {
    let text = "let g = |x| x + 1; let h = Fn(\"frame\");
        let all = [g.name, g.to_string(), \"\" + g, `${g}`, [g].to_string(), #{ a: g }.to_string(), [[g]].to_string()];
        if all != [\"closure\", \"Fn(closure)\", \"Fn(closure)\", \"Fn(closure)\", \"[Fn(closure)]\", `#{\"a\": Fn(closure)}`,
            \"[[Fn(closure)]]\"] { throw all.to_string(); }
        if h.name != \"frame\" || !g.is_anonymous || g.call(1) != 2 { throw \"a closure is one no longer\"; }";
    assert_eq!(frame(text), Ok(vec![]));
    said("get_fn_metadata_list();", &["cannot list its functions"]);
}

/// A script whose state counts steps and adds up their seconds.
const COUNTING: &str = "fn start(s) { #{ n: 0, x: 1.0, list: [vec3(0, 0, 0)] } }
    fn step(state, f) { state.n += 1; state.x += f.dt; state.list[0].y = state.x; state }
    fn frame(s, f) { s.camera.from = [f.state.x, f.state.list[0].y, f.state.n]; }";

#[test]
fn a_simulation_goes_on_from_step_to_step() {
    let program = open(&format!("animation(#{{ frames: 9, fps: 2, steps_per_frame: 4 }}); {COUNTING}"), &[]).unwrap();
    let rest = scene();
    let at = |number: u32, offset: f64| {
        let Edit::Camera(camera) = program.frame(&rest, number, offset).unwrap().remove(0) else { panic!() };
        camera.from
    };
    // Backwards first: the order in which frames are asked for does not matter.
    assert_eq!(at(5, 0.0), DVec3::new(3.0, 3.0, 16.0));
    assert_eq!(at(1, 0.0), DVec3::new(1.0, 0.0, 0.0));
    assert_eq!(at(3, 0.0), DVec3::new(2.0, 2.0, 8.0));
    // Between two steps numbers are interpolated, and go on straight before the first.
    assert_eq!(at(2, 0.125), DVec3::new(1.5625, 1.5625, 4.0));
    assert_eq!(at(1, -0.25).x, 0.875);
}

#[test]
fn mistakes_in_a_simulation_are_explained() {
    let fails = |text: &str, words: &[&str]| {
        let message = match open(&format!("animation(#{{ frames: 5 }});\n{text}"), &[]) {
            Ok(program) => program.frame(&scene(), 3, 0.0).unwrap_err().to_string(),
            Err(message) => message,
        };
        words.iter().for_each(|word| assert!(message.contains(word), "{word}\n{message}"));
    };
    fails("fn start(s) { 1 } fn frame(s, f) { }", &["no `step(state, f)`"]);
    fails("fn frame(s, f) { let x = f.state; }", &["there is no state", "fn start(s)"]);
    fails("fn start(s) { 1 }\nfn step(state, f) { state.x }\nfn frame(s, f) { }", &["show.rhai:3:", "in frame 2"]);
    fails("fn start(s) { s.get(\"near\") } fn step(a, f) { a } fn frame(s, f) { }", &["a state holds numbers"]);
    fails("fn start(s) { s.camera.fov = 3; 1 } fn step(a, f) { a } fn frame(s, f) { }", &["cannot change the scene"]);
}

proptest! {
    #[test]
    fn any_text_is_a_script_or_a_mistake(text in "[a-z0-9 (){}\\[\\];=+*#:.,\"\\n]{0,60}") {
        let whole = format!("animation(#{{}}); fn frame(s, f) {{ {text} }}");
        if let Ok(program) = open(&whole, &[]) {
            let _ = program.frame(&scene(), 1, 0.0);
        }
    }
}

/// The transform that a frame leaves entity number `index` with.
fn transform_of(body: &str, index: usize) -> Transform {
    let edits = frame(body).unwrap();
    let found = edits.into_iter().find_map(|edit| match edit {
        Edit::Put { entity, component: Component::Transform(transform) } if entity == index => Some(transform),
        _ => None,
    });
    found.expect("the frame moves the entity")
}

#[test]
fn constraints_follow_what_stands_at_the_end_in_any_order() {
    // The lamp looks at a ball that is moved afterwards, and itself by a constraint.
    let body = "s.get(\"key\").look_at(\"near\"); s.get(\"key\").translation = [0, 5, 0];
                s.get(\"near\").copy(\"far\"); s.get(\"far\").translation = [0, 0, 0];";
    let near = transform_of(body, 0);
    assert_eq!(near.translation, DVec3::ZERO);
    let face = crate::base::math::rotation_matrix(transform_of(body, 2).rotation) * DVec3::NEG_Y;
    assert!((face - DVec3::NEG_Y).length() < 1e-9, "{face}");
    let turned = transform_of("s.get(\"far\").translation = [5, 0, 8]; s.get(\"near\").track(\"far\");", 0);
    let look = crate::base::math::rotation_matrix(turned.rotation) * DVec3::NEG_Z;
    assert!((look - DVec3::X).length() < 1e-9, "{look}");
}

#[test]
fn constraints_that_go_round_are_refused_where_they_are_made() {
    let body = "s.get(\"near\").copy(\"far\");\ns.get(\"far\").look_at(\"near\");";
    said(body, &["show.rhai:", "constraints go round in a circle", "`near`", "`far`"]);
    said("s.get(\"near\").look_at(\"near\");", &["show.rhai:4", "would have to stand before itself"]);
    said("s.get(\"near\").parent = \"far\"; s.get(\"far\").copy(\"near\");", &["show.rhai:4", "far"]);
    said("s.get(\"near\").look_at(3);", &["expected an entity, its name or a point"]);
    said("s.get(\"near\").world_position = [1, 2, 3];", &["show.rhai:4", "is only read", "set `translation`"]);
    said("s.get(\"key\").bounds", &["has no bounds"]);
}

#[test]
fn what_is_attached_stays_where_it_is_and_is_carried() {
    let body = "s.get(\"far\").yaw = 90; s.get(\"far\").scale = 2; s.get(\"near\").attach(\"far\");
                let before = s.get(\"near\").world_position;
                s.get(\"far\").translation.x += 3;
                s.camera.from = s.get(\"near\").world_position - before + [0, 0, 9];";
    let Some(Edit::Camera(camera)) = frame(body).unwrap().into_iter().next() else { panic!("no camera") };
    assert!((camera.from - DVec3::new(3.0, 0.0, 9.0)).length() < 1e-12, "{}", camera.from);
    assert_eq!(transform_of(body, 0).parent.as_deref(), Some("far"));
}
