//! Mistakes that people make in scripts and scenes, words of other tools among them: each with its place and the right
//! word.

use std::sync::Arc;

use anim::base::project::Project;
use anim::components::{AABox, AreaLight, Component, EntityDesc, Material, MaterialName, Scene, Sphere, Transform};
use anim::script::{Evaluation, Program};

fn scene() -> Arc<Scene> {
    let body = |name: &str, shape: Component| {
        EntityDesc::new([Transform::default().into(), shape, MaterialName("m".into()).into()]).named(name)
    };
    let lamp = EntityDesc::new([AreaLight::default().into()]).named("lamp");
    Arc::new(Scene {
        materials: vec![("m".into(), Material::default())],
        entities: vec![body("ball", Sphere::default().into()), body("box", AABox::default().into()), lamp],
        ..Scene::default()
    })
}

/// What is said of a script; empty if nothing is wrong with it.
fn said(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("show.rhai");
    std::fs::write(&path, text).unwrap();
    let project = Project::of(&path, &Default::default()).unwrap();
    let run = || {
        let program = Program::open(&path, &[], &project, &Evaluation::InProcess)?;
        let edits = program.setup(&scene())?;
        drop(edits);
        program.frame(&scene(), 2, 0.0)
    };
    run().err().map(|problems| problems.to_string()).unwrap_or_default()
}

/// A script whose `frame` has this body, on line 3.
fn body(body: &str) -> String {
    format!("animation(#{{ frames: 5 }});\nfn frame(s, f) {{\n{body}\n}}\n")
}

/// Mistakes that are answered otherwise than they should be; all of them are told when the test ends.
#[derive(Default)]
struct Trials(Vec<String>);

impl Drop for Trials {
    fn drop(&mut self) {
        assert!(self.0.is_empty() || std::thread::panicking(), "{}", self.0.join("\n"));
    }
}

impl Trials {
    /// A mistake in the body of `frame`: its column in line 3, and what must be said.
    fn wrong(&mut self, text: &str, column: usize, words: &[&str]) {
        self.check(&body(text), &format!("show.rhai:3:{column}: "), words);
    }

    fn check(&mut self, text: &str, place: &str, words: &[&str]) {
        let said = said(text);
        let raw = [
            "Expecting",
            "DVec3",
            "Dynamic",
            "ImmutableString",
            "i64",
            "f64",
            "getter",
            "setter",
            "INT",
            "anim_",
            "\u{1b}",
        ];
        let missing = [place]
            .into_iter()
            .chain(words.iter().copied())
            .filter(|word| !said.contains(*word))
            .map(|word| format!("no `{word}`"));
        let leaks = raw.iter().filter(|word| said.contains(**word)).map(|word| format!("`{word}` leaks"));
        self.0.extend(missing.chain(leaks).map(|what| format!("{what} for\n{text}\n{said}")));
    }
}

#[test]
fn typical_mistakes_of_grammar() {
    let mut trials = Trials::default();
    trials.wrong("let a = 1\nlet b = 2;", 9, &["expected `;`"]);
    trials.wrong("let a = [1, 2;", 14, &["expected `]`"]);
    trials.wrong("let a = (1 + 2;", 15, &["expected `)`"]);
    trials.wrong("let t = 'hello';", 9, &["texts stand in \"...\""]);
    trials.wrong("let t = \"hello;", 9, &["never closed"]);
    trials.wrong("let i = 0; i++;", 13, &["write `x += 1`"]);
    trials.wrong("if f.t === 0 { }", 8, &["write `==`"]);
    trials.wrong("if f.t = 0 { }", 8, &[]);
    trials.wrong("if f.t > 0 and f.t < 1 { }", 12, &["write `&&`"]);
    trials.wrong("let a = f.t > 0 ? 1 : 2;", 17, &["if a { b } else { c }"]);
    trials.wrong("let a = 2 ** 3;", 11, &["pow(x, y)"]);
    trials.wrong("var a = 1;", 1, &["let name"]);
    trials.wrong("# a comment", 1, &["//"]);
    trials.wrong("for i in 0..3 s.get(\"ball\").yaw = i;", 15, &["braces"]);
    trials.wrong("if f.t > 0.5 { 1 } elif f.t > 0.2 { 2 }", 20, &["else if"]);
    trials.wrong("let m = #{ a: 1 b: 2 };", 17, &["expected `,` between two entries"]);
    trials.wrong("let m = #{ a = 1 };", 14, &["expected `:`"]);
    trials.wrong("s.spawn(#{}).yaw = 5;", 3, &["in a variable first"]);
    trials.wrong("fn helper() { }", 1, &["inside another"]);
    trials.check(&body("let x = 1;;}"), "show.rhai:4:1: ", &["one too many"]);
}

#[test]
fn typical_mistakes_of_names_and_kinds() {
    let mut trials = Trials::default();
    trials.wrong("let a = [1, 2]; let b = a[2];", 27, &["the list has 2 items", "from 0 to 1"]);
    trials.wrong("let a = []; let b = a[0];", 23, &["the list is empty"]);
    trials.wrong("let a = \"x\" * 2;", 13, &["`*` does not work between a text and a whole number"]);
    trials.wrong("for i in 5 { }", 10, &["0..10"]);
    trials.wrong("if f.index { s.camera.fov = 3; }", 6, &["true or false"]);
    trials.wrong("s.get(\"ball\").translation = 3;", 15, &["three numbers"]);
    trials.wrong("s.get(\"ball\").translation = [1, 2];", 15, &["three numbers"]);
    trials.wrong("s.camera.fov = \"wide\";", 10, &["a number"]);
    trials.wrong("lerp(1, 2);", 1, &["lerp(a, b, t)"]);
    trials.wrong("s.get(ball).yaw = 1;", 7, &["there is no variable `ball`"]);
    trials.wrong("s.get(\"bal\").yaw = 1;", 7, &["did you mean `ball`?"]);
    trials.wrong("let v = s.camera.from.w;", 23, &["a vector has no `w`"]);
    trials.wrong("let n = s.camera.from.length;", 23, &["length(v)"]);
    trials.wrong("let n = f.t();", 11, &["`t` is a property"]);
    trials.wrong("let a = f.time;", 11, &["did you mean `seconds`?"]);
    trials.wrong("let a = t * 2;", 9, &["f.t"]);
    trials.wrong("let a = 2 * PI;", 13, &["PI()"]);
    trials.wrong("let a = None;", 9, &["()"]);
    trials.wrong("let a = True;", 9, &["true"]);
    trials.wrong("camera.fov = 3;", 1, &["s.camera"]);
    trials.wrong("let x = 9223372036854775807 + 1;", 29, &["64 bits"]);
    trials.wrong("let x = 5 % 0;", 11, &["division by 0"]);
    trials.wrong("const A = 1; A = 2;", 14, &["constant `A`"]);
    trials.wrong("s.despawn(\"ball\");", 3, &["`despawn` does not take (scene, text)", "s.despawn(entity)"]);
    trials.wrong("s.camera = 5;", 3, &[]);
    trials.wrong("throw \"stop\";", 1, &["stop"]);
}

#[test]
fn mistakes_in_functions_of_the_script() {
    let mut trials = Trials::default();
    let text =
        "animation(#{ frames: 5 });\nfn tower(s, i) { s.get(\"ball\").yaw = i; }\nfn frame(s, f) {\n  tower(s);\n}";
    trials.check(text, "show.rhai:4:3: ", &["`tower` takes 2 arguments, not 1", "tower(s, i)"]);
    let text = "animation(#{ frames: 5 });\nfn helper(s) { s.camera.fvo = 3; }\nfn frame(s, f) { helper(s); }";
    trials.check(text, "show.rhai:2:25: ", &["in frame 2", "did you mean `fov`?"]);
}

#[test]
fn all_mistakes_are_told_at_once() {
    let text = "animation(#{ frames: 5 });\nfn one() {\n  let a = ;\n}\nfn two() {\n  let b = (1;\n}\nfn frame(s, f) {\n  let c = 1 2;\n}";
    let said = said(text);
    for place in ["show.rhai:3:11:", "show.rhai:6:", "show.rhai:9:"] {
        assert!(said.contains(place), "{place}\n{said}");
    }
    let text = body("if f.t < 0 { eaze(1); let y = lmap; }\nlet x = slepr(1, 2, 3);");
    let said = self::said(&text);
    for part in [
        "3:14: error: there is no function `eaze`",
        "`ease`",
        "3:31: error: there is no variable `lmap`",
        "4:9:",
        "`slerp`",
    ] {
        assert!(said.contains(part), "{part}\n{said}");
    }
}

#[test]
fn foreign_words_in_scripts() {
    let mut trials = Trials::default();
    for (line, column, word) in [
        ("s.get(\"ball\").position = [0, 0, 0];", 15, "`translation`"),
        ("s.get(\"ball\").location = [0, 0, 0];", 15, "`translation`"),
        ("s.get(\"ball\").rot = [0, 0, 0];", 15, "`rotation`"),
        ("s.get(\"ball\").heading = 3;", 15, "`yaw`"),
        ("s.get(\"ball\").shader = \"m\";", 15, "`material`"),
        ("s.get(\"ball\").colour = [1, 0, 0];", 15, "s.material(\"m\").color"),
        ("s.get(\"lamp\").colour = [1, 0, 0];", 15, "`color`"),
        ("s.get(\"box\").cube.min = [0, 0, 0];", 14, "`aabox`"),
        ("s.get(\"ball\").sphere.r = 2;", 22, "`radius`"),
        ("s.material(\"m\").albedo = [1, 0, 0];", 17, "`color`"),
        ("s.material(\"m\").metalness = 1;", 17, "`metallic`"),
        ("s.material(\"m\").transparency = 1;", 17, "`transmission`"),
        ("s.material(\"m\").alpha = 1;", 17, "`opacity`"),
        ("s.material(\"m\").Kd = 1;", 17, "`diffuse`"),
        ("s.material(\"m\").shine = 1;", 17, "`shininess`"),
        ("s.render.spp = 4;", 10, "`samples`"),
        ("s.render.hdri = \"x.hdr\";", 10, "`environment`"),
        ("s.render.bounces = 4;", 10, "`max_depth`"),
        ("s.render.resolution = [1, 1];", 10, "`size`"),
        ("s.camera.target = [1, 1, 1];", 10, "`at`"),
        ("s.camera.position = [1, 1, 1];", 10, "`from`"),
        ("s.camera.lens_radius = 1;", 10, "`aperture`"),
        ("mix(1, 2, 3);", 1, "`lerp`"),
        ("perlin(1);", 1, "`noise`"),
        ("s.add(#{});", 3, "`spawn`"),
        ("s.remove(1);", 3, "`despawn`"),
        ("s.find(\"ball\");", 3, "`get`"),
        ("map_range(1, 2, 3, 4, 5);", 1, "`remap`"),
        ("random();", 1, "`rng`"),
        ("s.spawn(#{ cube: #{} });", 12, "`aabox`"),
        ("let a = s.get(\"ball\").x;", 23, ".translation.x"),
        ("s.find(\"ball\").yaw = 1;", 3, "`get`"),
        ("s.object(\"ball\").yaw = 1;", 3, "`get`"),
        ("s.add_sphere([0, 0, 0], 1);", 3, "s.spawn(#{"),
        ("s.move(\"ball\", [1, 0, 0]);", 3, "`translation`"),
        ("s.camera.yaw = 3;", 10, "s.get(\"name\").yaw"),
        ("s.material(\"m\").yaw = 3;", 17, "s.get(\"name\").yaw"),
        ("s.get(\"ball\").rotate(0, 90, 0);", 15, "e.yaw = 90"),
        ("s.get(\"ball\").translate(0, 90, 0);", 15, "e.translation"),
        ("s.get(\"ball\").hide();", 15, "e.visible = false"),
        ("s.get(\"ball\").set_color([1, 0, 0]);", 15, "s.material(\"name\").color"),
        ("let a = rand(0, 1);", 9, "f.rng.range"),
        ("let a = Color(1, 0, 0);", 9, "[1, 0.5, 0]"),
        ("let a = rgb(255, 0, 0);", 9, "[1, 0.5, 0]"),
        ("console.log(\"hi\");", 1, "print(x)"),
        ("let a = str(3);", 9, "${"),
        ("let a = mod(5, 3);", 9, "x % y"),
        ("let a = math.sin(3);", 9, "sin(x)"),
        ("s.get(\"ball\").intensity = 3;", 15, "s.material(\"m\").emission"),
        ("s.get(\"lamp\").intensity = 3;", 15, ".area_light.intensity"),
        ("s.get(\"lamp\").power = 3;", 15, "`intensity`"),
        ("s.camera.intensity = 3;", 10, "intensity"),
        ("s.render.fov = 3;", 10, "s.camera.fov"),
        ("s.camera.samples = 3;", 10, "s.render.samples"),
        ("s.fov = 3;", 3, "s.camera.fov"),
        ("let a = [1].length();", 13, ".len()"),
        ("let a = [1].length;", 13, ".len()"),
        ("let a = len();", 9, "list.len()"),
        ("for i in range(3) { }", 10, "0..n"),
        ("let a = min(1, 2, 3);", 9, "min(a, min(b, c))"),
        ("s.ball.yaw = 3;", 3, "s.get(\"ball\")"),
        ("s[\"ball\"].yaw = 3;", 2, "s.get(\"name\")"),
        ("s.get(\"ball\").material.color = [1, 0, 0];", 24, "s.material(\"name\").color"),
        ("s.material(\"m\").color_map = \"wood.png\";", 17, "image: \"wood.png\""),
        ("let a = ORIGIN;", 9, "vector"),
        ("let a = bpy.data;", 9, "s.get(\"name\")"),
        ("pass", 1, "{ }"),
    ] {
        trials.wrong(line, column, &[word]);
    }
}

#[test]
fn forms_of_other_languages() {
    let mut trials = Trials::default();
    for (line, column, word) in [
        ("if not f.t { }", 4, "`!`"),
        ("if !f.t { }", 4, "x == 0"),
        ("let a = 1; if a = 2 { }", 17, "`==`"),
        ("for (i = 0; i < 3; i++) { }", 8, "0..10"),
        ("for (let i = 0; i < 3; i++) { }", 6, "0..10"),
        ("for i = 0, 10 { }", 7, "0..10"),
        ("let a = f\"x {f.t}\";", 9, "backticks"),
        ("let a = 1 if f.t > 0 else 2;", 11, "if a { b } else { c }"),
        ("vec3 a = [1, 2, 3];", 1, "let name = ...;"),
        ("int a = 1;", 1, "let name = ...;"),
        ("let mut a = 1;", 5, "every variable can change"),
        ("let a: number = 1.0;", 6, "no type"),
        ("let (a, b) = [1, 2];", 5, "one variable at a time"),
        ("let a, b = 1, 2;", 6, "one variable at a time"),
        ("let a = 1.0f;", 12, "no unit"),
        ("s.get(\"ball\").yaw = 30deg;", 23, "degrees"),
        ("let a = 1,5;", 10, "decimals begin with a point"),
        ("let a = {\"a\": 1};", 9, "#{"),
        ("let a = { a: 1 };", 9, "#{"),
        ("let a = (1, 2, 3);", 9, "[1, 2, 3]"),
        ("s.get(\"ball\").translation = <1, 2, 3>;", 29, "[1, 2, 3]"),
        ("let a = lerp(a: 1, b: 2, t: 0.5);", 15, "arguments have no names"),
        ("let a = (x) => x + 1;", 13, "|x| x + 1"),
        ("let a = function(x) { x };", 9, "|x| x + 1"),
        ("let a = [1, 2, 3]; let b = a[0:2];", 31, "list[1..3]"),
        ("print \"hello\";", 1, "brackets"),
        ("s.camera.fov = ;", 16, "a value is missing"),
        ("#declare X = 1;", 1, "let name = 1"),
        ("try { } except { }", 9, "catch"),
        ("let a = `x` \"y\";", 13, "expected `;`"),
    ] {
        trials.wrong(line, column, &[word]);
    }
    let head = |header: &str| format!("animation(#{{ {header} }});\nfn frame(s, f) {{ }}");
    trials.check(&head("frames: 5, loop: true"), "show.rhai:1:25: ", &["mode: \"loop\""]);
    trials.check(&head("frames: 5, mode: \"lop\""), "show.rhai:1:25: ", &["did you mean `loop`?"]);
    trials.check("animation({ frames: 5 });\nfn frame(s, f) { }", "show.rhai:1:11: ", &["#{"]);
    trials.check("animation(#{ frames: 5 });\nfn update(s, f) { }", "show.rhai:2:4: ", &["did you mean `frame`?"]);
    trials.check("animation(#{ frames: 5 });\nfn frame(s: Scene, f) { }", "show.rhai:2:11: ", &["no types"]);
    let step =
        "animation(#{ frames: 5 });\nfn start(s) { 1 }\nfn step(state, f) { state += 1; }\nfn frame(s, f) { f.state; }";
    trials.check(step, "show.rhai:3:", &["`step` gives nothing"]);
}

/// A column that is misspelt is nothing otherwise; maps of one's own are asked for what may be missing.
#[test]
fn a_misspelt_column_of_a_row_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("show.rhai");
    std::fs::write(folder.path().join("d.csv"), "time,temp\n0,1.5\n1,2.5\n").unwrap();
    let run = |asked: &str| {
        let text = format!(
            "const D = load_csv(\"d.csv\");\n{}",
            body(&format!("let r = D[1]; let m = #{{ cell_a: 1 }};\n{asked}"))
        );
        std::fs::write(&path, text).unwrap();
        let project = Project::of(&path, &Default::default()).unwrap();
        let program = Program::open(&path, &[], &project, &Evaluation::InProcess).map_err(|e| e.to_string())?;
        program.frame(&scene(), 2, 0.0).map(drop).map_err(|e| e.to_string())
    };
    for asked in ["let a = 2 * r.tmep;", "let a = r[\"tmep\"] + 1;", "s.get(\"ball\").yaw = r.tmep;"] {
        let said = run(asked).unwrap_err();
        assert!(
            said.contains("show.rhai:5:") && said.contains("no column `tmep`") && said.contains("`temp`"),
            "{said}"
        );
    }
    run("let a = r.temp; let b = r.other ?? 3; let c = m.cell_b; m.cell_c = 5; r.temq = 3;").unwrap();
}

/// Constants of a module's top are seen by its functions, and by whoever imports it.
#[test]
fn modules_give_their_constants() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("show.rhai");
    std::fs::write(folder.path().join("pal.rhai"), "const K = 3;\nfn twice() { K * 2 }\n").unwrap();
    let run = |value: &str| {
        let text = format!(
            "import \"pal\" as pal;\nanimation(#{{ frames: 5 }});\nfn frame(s, f) {{\n  s.camera.fov = {value};\n}}"
        );
        std::fs::write(&path, text).unwrap();
        let project = Project::of(&path, &Default::default()).unwrap();
        let program = Program::open(&path, &[], &project, &Evaluation::InProcess).map_err(|e| e.to_string())?;
        program.frame(&scene(), 2, 0.0).map_err(|e| e.to_string())
    };
    let fov = |edits: Vec<anim::components::Edit>| match &edits[0] {
        anim::components::Edit::Camera(camera) => camera.fov,
        other => panic!("{other:?}"),
    };
    assert_eq!(fov(run("30 + pal::K + pal::twice()").unwrap()), 39.0);
    let said = run("pal::KK").unwrap_err();
    assert!(said.contains("show.rhai:4:") && said.contains("module `pal` gives no `KK`"), "{said}");
    let said = run("pal::twise()").unwrap_err();
    assert!(said.contains("show.rhai:4:") && said.contains("`twice`"), "{said}");
    let said = run("pal.K").unwrap_err();
    assert!(said.contains("show.rhai:4:") && said.contains("pal::NAME"), "{said}");
}
