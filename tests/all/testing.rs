//! `anim test`: from nothing to green, a change, its report, what becomes of it, and green again.

use std::io::Write;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::tool::{Run, Sandbox};

const SCENE: &str = "(
    camera: (from: (0.0, 1.0, 5.0), at: (0.0, 0.5, 0.0)),
    render: (size: (32, 18), samples: 1, integrator: Whitted),
    materials: { \"red\": (color: (0.8, 0.1, 0.1)) },
    entities: [
        (name: \"ball\", sphere: (radius: 1.0), material: \"red\"),
        (name: \"key\", point_light: (), transform: (translation: (3.0, 4.0, 2.0))),
    ],
)";

const SCRIPT: &str = "animation(#{ scene: \"stage.ron\", fps: 24, frames: 8, mode: \"clip\" });
fn frame(s, f) { s.get(\"ball\").translation = [0.0, f.t * 0.5, 0.0]; }";

/// A sandbox with a script of eight frames.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("stage.ron", SCENE).write("show.rhai", SCRIPT);
    sandbox
}

/// The same with golden frames.
fn with_goldens() -> Sandbox {
    let sandbox = sandbox();
    sandbox.anim("test --init show.rhai").ok();
    sandbox.anim("test --accept").ok();
    sandbox
}

/// Moves the lamp.
fn edit(sandbox: &Sandbox) {
    sandbox.write("stage.ron", SCENE.replace("(3.0, 4.0, 2.0)", "(3.0, 4.0, 2.5)"));
}

fn json(run: &Run) -> Vec<Value> {
    run.stdout.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

fn goldens(sandbox: &Sandbox) -> Vec<String> {
    let files = sandbox.files().into_iter();
    files.filter(|file| file.starts_with("golden/") && !file.starts_with("golden/.new")).collect()
}

/// Runs `anim` with something typed, and with variables of the environment.
fn typed(sandbox: &Sandbox, arguments: &str, text: &str, variables: &[(&str, &str)]) -> Run {
    let mut child = Command::new(env!("CARGO_BIN_EXE_anim"))
        .args(arguments.split_whitespace())
        .current_dir(sandbox.path(""))
        .envs(variables.iter().copied())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It may end before it has read all of it.
    let _ = child.stdin.take().unwrap().write_all(text.as_bytes());
    let output = child.wait_with_output().unwrap();
    Run {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

#[test]
fn from_nothing_to_green() {
    let sandbox = sandbox();
    sandbox.anim("test").fails(2, &["there is no golden.ron", "--init"]);
    let init = sandbox.anim("test --init show.rhai").ok();
    assert!(init.stdout.contains("4 golden frames") && init.stdout.contains("--accept"), "{}", init.stdout);
    sandbox.anim("test --init show.rhai").fails(2, &["is there already"]);
    let missing = sandbox.anim("test");
    assert_eq!(missing.code, 1);
    assert!(
        missing.stdout.contains("show.0001  missing") && missing.stdout.contains("4 missing"),
        "{}",
        missing.stdout
    );
    assert!(goldens(&sandbox).is_empty(), "a golden was written silently");
    let accepted = sandbox.anim("test --accept").ok();
    assert!(accepted.stdout.contains("4 accepted"), "{}", accepted.stdout);
    assert_eq!(goldens(&sandbox), [1, 3, 5, 8].map(|n| format!("golden/show.{n:04}.png")));
    let green = sandbox.anim("test").ok();
    assert_eq!(green.stdout, "4 unchanged\n");
    assert!(!sandbox.exists("golden/.new"), "{:?}", sandbox.files());
    let rendered = sandbox.anim("test --render").ok();
    assert!(rendered.stdout.starts_with("4 equal\n"), "{}", rendered.stdout);
}

#[test]
fn a_change_is_told_with_its_cause_everywhere() {
    let sandbox = with_goldens();
    edit(&sandbox);
    let run = typed(&sandbox, "test --junit out/junit.xml", "", &[("GITHUB_ACTIONS", "true")]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let why = "entity `key`: translation (3, 4, 2) -> (3, 4, 2.5)";
    assert!(
        run.stdout.contains("show.0001  different  ") && run.stdout.contains(&format!("why: {why}")),
        "{}",
        run.stdout
    );
    let place = "::error file=golden.ron,line=";
    assert!(run.stdout.contains(place) && run.stdout.contains("title=show.0001 is different::"), "{}", run.stdout);
    let page = String::from_utf8(sandbox.read("golden/.new/report.html")).unwrap();
    assert!(page.contains("entity `key`: translation") && page.contains("data:image/png;base64,"));
    let xml = String::from_utf8(sandbox.read("out/junit.xml")).unwrap();
    assert!(
        xml.contains("tests=\"4\" failures=\"4\"") && xml.contains("entity `key`: translation (3, 4, 2) -&gt;"),
        "{xml}"
    );
    let lines = json(&sandbox.anim("test --json"));
    assert_eq!((lines.len(), &lines[0]["result"]), (5, &Value::from("different")));
    assert_eq!(lines[0]["why"][0]["after"], "(3, 4, 2.5)");
    assert!(lines[0]["numbers"]["flip"][0]["mean"].as_f64().unwrap() > 0.0);
    assert_eq!(lines[4]["summary"]["different"], 4);
    assert_eq!(lines[4]["report"], "golden/.new/report.html");
    assert!(!run.stdout.contains("warning") && sandbox.exists("golden/.new/.gitignore"));
}

#[test]
fn what_is_accepted_becomes_golden_and_nothing_else() {
    let sandbox = with_goldens();
    edit(&sandbox);
    let before = sandbox.read("golden/show.0008.png");
    assert_eq!(sandbox.anim("test").code, 1);
    sandbox.anim("test --accept shou").fails(2, &["no golden is called so", "did you mean `show`?"]);
    let some = sandbox.anim("test --accept show.1-3");
    assert!(some.code == 1 && some.stdout.contains("2 different, 2 accepted"), "{}", some.stdout);
    assert_eq!(sandbox.read("golden/show.0008.png"), before);
    let rest = sandbox.anim("test --accept").ok();
    assert!(rest.stdout.contains("2 unchanged, 2 accepted"), "{}", rest.stdout);
    assert_eq!(sandbox.anim("test").ok().stdout, "4 unchanged\n");
    assert!(!sandbox.exists("golden/.new"));
}

#[test]
fn a_review_takes_one_answer_for_each() {
    let sandbox = with_goldens();
    edit(&sandbox);
    let run = typed(&sandbox, "test --review", "what\na\nr\nq\n", &[]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(run.stdout.contains("[1/4] show.0001: different") && run.stdout.contains("`what` is none of these"));
    assert!(
        run.stdout.contains("golden  golden/show.0001.png") && run.stdout.contains("now     golden/.new/show.0001.png")
    );
    assert!(run.stdout.contains("3 different, 1 accepted"), "{}", run.stdout);
    let end = typed(&sandbox, "test --review", "", &[]);
    assert!(end.code == 1 && end.stdout.contains("3 different"), "{}", end.stdout);
    typed(&sandbox, "test --review", "r\nA\n", &[]);
    let last = typed(&sandbox, "test --review", "accept\n", &[]);
    assert_eq!(last.code, 0, "{}", last.stdout);
    assert_eq!(typed(&sandbox, "test --review", "", &[]).stdout, "nothing to review\n4 unchanged\n");
}

#[test]
fn an_edit_that_does_not_show_keeps_all_equal_and_accepting_renews_the_hash_alone() {
    let sandbox = with_goldens();
    // A material that nothing wears is no part of a frame; one that hides in another name is.
    sandbox.write("stage.ron", SCENE.replace("\"red\"", "\"crimson\""));
    let equal = sandbox.anim("test").ok();
    assert!(equal.stdout.starts_with("4 equal\n") && equal.stdout.contains("--accept` renews"), "{}", equal.stdout);
    sandbox.anim("test --accept").ok();
    assert_eq!(sandbox.anim("test").ok().stdout, "4 unchanged\n");
}

#[test]
fn slack_forgives_and_goldens_do_not_creep() {
    let sandbox = with_goldens();
    edit(&sandbox);
    let list = String::from_utf8(sandbox.read("golden.ron")).unwrap();
    sandbox.write("golden.ron", list.replace("samples: 4,", "samples: 4, flip: 0.5, max: 255,"));
    let within = sandbox.anim("test").ok();
    assert!(within.stdout.contains("show.0001  within") && within.stdout.contains("4 within"), "{}", within.stdout);
    assert!(sandbox.anim("test --accept").ok().stdout.contains("4 within"));
    sandbox.write("golden.ron", list.replace("samples: 4,", "samples: 4, flip: 0.5, max: 0,"));
    assert_eq!(sandbox.anim("test").code, 1);
    sandbox.write("golden.ron", list.replace("samples: 4,", "samples: 4, flip: 0.5,"));
    assert!(sandbox.anim("test --accept show").ok().stdout.contains("4 accepted"));
}

#[test]
fn a_script_that_is_wrong_fails_by_itself() {
    let sandbox = with_goldens();
    sandbox.write(
        "broken.rhai",
        "animation(#{ scene: \"stage.ron\", frames: 2 });\nfn frame(s, f) { s.get(\"bal\").yaw = 1; }",
    );
    let list = String::from_utf8(sandbox.read("golden.ron")).unwrap();
    sandbox.write(
        "golden.ron",
        list.replace("entries: [", "entries: [(script: \"broken.rhai\"), (script: \"none.rhai\"),"),
    );
    let run = sandbox.anim("test");
    assert_eq!(run.code, 3, "{}\n{}", run.stdout, run.stderr);
    assert!(run.stderr.contains("broken.rhai:2:") && run.stderr.contains("none.rhai"), "{}", run.stderr);
    assert!(run.stdout.contains("4 unchanged, 3 failed"), "{}", run.stdout);
    sandbox.anim("test --only show").ok();
    sandbox.anim("test --only nothing").fails(2, &["no golden is called so"]);
    sandbox.write("golden.ron", "(entires: [])");
    sandbox.anim("test").fails(3, &["golden.ron:1:2", "did you mean `entries`?"]);
}

#[test]
fn goldens_that_nothing_names_are_listed_and_removed_on_request() {
    let sandbox = with_goldens();
    let old = sandbox.read("golden/show.0001.png");
    sandbox.write("golden/old.0001.png", &old).write("golden/mine.png", b"no golden");
    let run = sandbox.anim("test").ok();
    assert!(run.stderr.contains("golden/old.0001.png") && run.stderr.contains("--prune"), "{}", run.stderr);
    assert_eq!(json(&sandbox.anim("test --json")).pop().unwrap()["unnamed"][1], "golden/old.0001.png");
    let pruned = sandbox.anim("test --prune").ok();
    assert!(pruned.stdout.contains("removed golden/old.0001.png") && pruned.stderr.contains("mine.png"));
    assert!(
        !sandbox.exists("golden/old.0001.png")
            && sandbox.exists("golden/mine.png")
            && sandbox.exists("golden/show.0001.png")
    );
}

#[test]
fn a_golden_that_is_damaged_or_of_another_size_vouches_for_nothing() {
    let sandbox = with_goldens();
    let whole = sandbox.read("golden/show.0001.png");
    sandbox.write("golden/show.0001.png", &whole[..whole.len() / 2]);
    let run = sandbox.anim("test");
    assert!(run.code == 1 && run.stdout.contains("show.0001  different  cannot read"), "{}", run.stdout);
    let list = String::from_utf8(sandbox.read("golden.ron")).unwrap();
    sandbox.write("golden.ron", list.replace("(160, 90)", "(80, 45)"));
    let run = sandbox.anim("test");
    assert!(run.stdout.contains("the picture is 80x45, not 160x90"), "{}", run.stdout);
    assert!(run.stdout.contains("why: render: size"), "{}", run.stdout);
}

#[test]
fn a_mesh_or_a_picture_of_another_content_is_named() {
    let sandbox = Sandbox::new();
    let object = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let scene = SCENE.replace("sphere: (radius: 1.0)", "mesh: (file: \"part.obj\")");
    sandbox.write("part.obj", object).write("stage.ron", scene);
    sandbox.anim("test --init stage.ron").ok();
    sandbox.anim("test --accept").ok();
    assert_eq!(sandbox.anim("test").ok().stdout, "1 unchanged\n");
    sandbox.write("part.obj", object.replace("v 1 0 0", "v 2 0 0"));
    let run = sandbox.anim("test");
    assert!(run.code == 1 && run.stdout.contains("why: entity `ball`: mesh 1 triangles "), "{}", run.stdout);
}

/// The commands of the guide's page, as continuous integration and a commit hook would run them.
#[test]
fn the_recipes_of_the_guide_run() {
    let page = include_str!("../../src/guide/pages/golden.md");
    let fences: Vec<&str> = page.split("```").skip(1).step_by(2).collect();
    let fence = |what: &str| fences.iter().copied().find(|fence| fence.contains(what)).unwrap();
    let command = |fence: &str| -> String {
        let line = fence.lines().find_map(|line| line.split_once("anim test ")).unwrap();
        format!("test {}", line.1)
    };
    let sandbox = sandbox();
    for line in fence("--init").lines().filter_map(|line| line.strip_prefix("anim ")) {
        sandbox.anim(line).ok();
    }
    for service in ["actions/checkout", "image: rust"] {
        sandbox.anim(&command(fence(service))).ok();
        assert!(sandbox.exists("golden.xml"), "{service}");
        std::fs::remove_file(sandbox.path("golden.xml")).unwrap();
    }
    sandbox.anim(&command(fence("language: system"))).ok();
    let hook = fence("#!/bin/sh").strip_prefix("sh\n").unwrap();
    edit(&sandbox);
    sandbox.write("hook", hook);
    let folder = std::path::Path::new(env!("CARGO_BIN_EXE_anim")).parent().unwrap();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    let hooked = || Command::new("sh").arg("hook").current_dir(sandbox.path("")).env("PATH", &path).output().unwrap();
    assert_eq!(hooked().status.code(), Some(1), "the hook lets a change pass");
    sandbox.anim("test --accept").ok();
    assert!(hooked().status.success());
}
