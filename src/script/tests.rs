//! Every idiom of the script contract, and every way to get it wrong.

use std::sync::Arc;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::components::*;

fn scene() -> Arc<Scene> {
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

fn open(text: &str, defines: &[(&str, &str)]) -> Result<Program, String> {
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
    assert_eq!((t.translation, t.rotation.y), (DVec3::new(0.0, 0.0, 3.0), 5.0));
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
    assert_eq!(at("orbit([0, 1, 0], 2, 0.25)"), DVec3::new(0.0, 1.0, 2.0));
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
    // A clip stands still beyond its ends, and a loop goes round.
    assert_eq!(at("clip", 5, 0.5), DVec3::new(1.0, 2.25, 54.0));
    assert_eq!(at("clip", 1, -0.5), DVec3::new(0.0, -0.25, 10.0));
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
    assert!(open(text, &[("n", "many")]).err().unwrap().contains("-D n=many: expected a number"));
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
    said("let x = eaze(\"in_quad\", 1);", &["there is no function `eaze` for (text, whole number)", "`ease`"]);
    said("let x = ease(\"in_qaud\", 1);", &["there is no easing `in_qaud`", "`in_quad`"]);
    said("let lamp = 1; x = lmap;", &["there is no variable"]);
    said("s.spawn(#{ spere: #{} });", &["unknown property `spere`", "did you mean `sphere`?"]);
    said("s.camera.fov = 10", &[]);
    said("let x = [1, 2", &["show.rhai:5:"]);
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

proptest! {
    #[test]
    fn any_text_is_a_script_or_a_mistake(text in "[a-z0-9 (){}\\[\\];=+*#:.,\"\\n]{0,60}") {
        let whole = format!("animation(#{{}}); fn frame(s, f) {{ {text} }}");
        if let Ok(program) = open(&whole, &[]) {
            let _ = program.frame(&scene(), 1, 0.0);
        }
    }
}
