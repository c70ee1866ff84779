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

/// A mistake in the body of `frame`: its column in line 3, and what must be said.
#[track_caller]
fn wrong(text: &str, column: usize, words: &[&str]) {
    check(&body(text), &format!("show.rhai:3:{column}: "), words);
}

#[track_caller]
fn check(text: &str, place: &str, words: &[&str]) {
    let said = said(text);
    assert!(said.contains(place), "no `{place}` for\n{text}\n{said}");
    for word in words {
        assert!(said.contains(word), "no `{word}` for\n{text}\n{said}");
    }
    for raw in
        ["Expecting", "DVec3", "Dynamic", "ImmutableString", "i64", "f64", "getter", "setter", "INT", "anim_", "\u{1b}"]
    {
        assert!(!said.contains(raw), "`{raw}` leaks for\n{text}\n{said}");
    }
}

#[test]
fn typical_mistakes_of_grammar() {
    wrong("let a = 1", 9, &["expected `;`"]);
    wrong("let a = 1\nlet b = 2;", 9, &["expected `;`"]);
    wrong("let a = [1, 2;", 14, &["expected `]`"]);
    wrong("let a = (1 + 2;", 15, &["expected `)`"]);
    wrong("let t = 'hello';", 9, &["texts stand in \"...\""]);
    wrong("let t = \"hello;", 9, &["never closed"]);
    wrong("let i = 0; i++;", 13, &["write `x += 1`"]);
    wrong("if f.t === 0 { }", 8, &["write `==`"]);
    wrong("if f.t = 0 { }", 8, &[]);
    wrong("if f.t > 0 and f.t < 1 { }", 12, &["write `&&`"]);
    wrong("let a = f.t > 0 ? 1 : 2;", 17, &["if a { b } else { c }"]);
    wrong("let a = 2 ** 3;", 11, &["pow(x, y)"]);
    wrong("var a = 1;", 1, &["let name"]);
    wrong("# a comment", 1, &["//"]);
    wrong("for i in 0..3 s.get(\"ball\").yaw = i;", 15, &["braces"]);
    wrong("if f.t > 0.5 { 1 } elif f.t > 0.2 { 2 }", 20, &["else if"]);
    wrong("let m = #{ a: 1 b: 2 };", 17, &["expected `,` between two entries"]);
    wrong("let m = #{ a = 1 };", 14, &["expected `:`"]);
    wrong("s.spawn(#{}).yaw = 5;", 9, &["in a variable first"]);
    wrong("fn helper() { }", 1, &["inside another"]);
    wrong("let x = 1;;}", 12, &[]);
}

#[test]
fn typical_mistakes_of_names_and_kinds() {
    wrong("let a = [1, 2]; let b = a[2];", 27, &["the list has 2 items", "from 0 to 1"]);
    wrong("let a = []; let b = a[0];", 23, &["the list is empty"]);
    wrong("let a = \"x\" * 2;", 13, &["`*` does not work between a text and a whole number"]);
    wrong("for i in 5 { }", 10, &["0..10"]);
    wrong("if f.index { }", 4, &["true or false"]);
    wrong("s.get(\"ball\").translation = 3;", 15, &["three numbers"]);
    wrong("s.get(\"ball\").translation = [1, 2];", 15, &["three numbers"]);
    wrong("s.camera.fov = \"wide\";", 10, &["a number"]);
    wrong("lerp(1, 2);", 1, &["lerp(a, b, t)"]);
    wrong("s.get(ball).yaw = 1;", 7, &["there is no variable `ball`"]);
    wrong("s.get(\"bal\").yaw = 1;", 7, &["did you mean `ball`?"]);
    wrong("let v = s.camera.from.w;", 23, &["a vector has no `w`"]);
    wrong("let n = s.camera.from.length;", 23, &["v.length()"]);
    wrong("let n = f.t();", 11, &["`t` is a property"]);
    wrong("let a = f.time;", 11, &["did you mean `seconds`?"]);
    wrong("let a = t * 2;", 9, &["f.t"]);
    wrong("let a = 2 * PI;", 13, &["PI()"]);
    wrong("let a = None;", 9, &["()"]);
    wrong("let a = True;", 9, &["true"]);
    wrong("camera.fov = 3;", 1, &["s.camera"]);
    wrong("let x = 9223372036854775807 + 1;", 29, &["64 bits"]);
    wrong("let x = 5 % 0;", 11, &["division by 0"]);
    wrong("const A = 1; A = 2;", 14, &["constant `A`"]);
    wrong("s.despawn(\"ball\");", 3, &["`despawn` does not take (scene, text)", "s.despawn(entity)"]);
    wrong("s.camera = 5;", 3, &[]);
    wrong("throw \"stop\";", 1, &["stop"]);
}

#[test]
fn mistakes_in_functions_of_the_script() {
    let text =
        "animation(#{ frames: 5 });\nfn tower(s, i) { s.get(\"ball\").yaw = i; }\nfn frame(s, f) {\n  tower(s);\n}";
    check(text, "show.rhai:4:3: ", &["`tower` takes 2 arguments, not 1", "tower(s, i)"]);
    let text = "animation(#{ frames: 5 });\nfn helper(s) { s.camera.fvo = 3; }\nfn frame(s, f) { helper(s); }";
    check(text, "show.rhai:2:25: ", &["in frame 2", "did you mean `fov`?"]);
}

#[test]
fn all_mistakes_are_told_at_once() {
    let text = "animation(#{ frames: 5 });\nfn one() {\n  let a = ;\n}\nfn two() {\n  let b = (1;\n}\nfn frame(s, f) {\n  let c = 1 2;\n}";
    let said = said(text);
    for place in ["show.rhai:3:11:", "show.rhai:6:", "show.rhai:9:"] {
        assert!(said.contains(place), "{place}\n{said}");
    }
    let text = body("if false { eaze(1); lmap; }\nlet x = slepr(1, 2, 3);");
    let said = self::said(&text);
    for part in [
        "3:12: error: there is no function `eaze`",
        "`ease`",
        "3:21: error: there is no variable `lmap`",
        "4:9:",
        "`slerp`",
    ] {
        assert!(said.contains(part), "{part}\n{said}");
    }
}

#[test]
fn foreign_words_in_scripts() {
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
        ("s.material(\"m\").metallic = 1;", 17, "Conductor"),
        ("s.material(\"m\").opacity = 1;", 17, "`transmission`"),
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
        ("s.spawn(#{ cube: #{} });", 3, "`aabox`"),
    ] {
        wrong(line, column, &[word]);
    }
}
