//! A sequence costs what changes in it: edits, kills, shards and faults, and always the bytes of a fresh run.

use std::collections::BTreeMap;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::tool::{Run, Sandbox};

const SCENE: &str = r#"(
    render: (size: (24, 16), samples: 1),
    materials: { "red": (color: (0.8, 0.1, 0.1)), "spare": () },
    entities: [
        (name: "ball", sphere: (), material: "red"),
        (name: "lamp", point_light: (position: (2.0, 5.0, 3.0))),
        (name: "late", sphere: (radius: 0.3), transform: (translation: (1.5, 0.0, 0.0))),
    ],
)"#;

/// Twelve frames; from the seventh on `late` is gone, and the camera stands still in the last four.
const SCRIPT: &str = r#"animation(#{ scene: "a.ron", frames: 12 });
fn frame(s, f) {
    s.camera.fov = 30 + min(f.index, 8);
    if f.number > 6 { s.despawn(s.get("late")); }
}"#;

const FRAMES: u32 = 12;
/// The ninth, tenth, eleventh and twelfth are equal.
const DIFFERENT: usize = 9;

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", SCENE).write("a.rhai", SCRIPT);
    sandbox
}

/// How often each kind of reuse is in the statistics of a run.
fn reuse(run: &Run) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for line in run.stdout.lines() {
        let value: serde_json::Value = serde_json::from_str(line).unwrap();
        *counts.entry(value["reused"].as_str().unwrap().to_string()).or_default() += 1;
    }
    counts
}

#[track_caller]
fn expect(run: Run, none: usize, copy: usize, cache: usize) {
    let counts = reuse(&run.ok());
    let of = |word: &str| counts.get(word).copied().unwrap_or(0);
    assert_eq!((of("none"), of("copy"), of("cache")), (none, copy, cache));
}

/// Names and bytes of the pictures in a folder, what is beside them left out.
fn pictures(sandbox: &Sandbox, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let below = |file: &String| file.strip_prefix(folder).map(str::to_string);
    let files = sandbox.files().into_iter().filter(|file| file.ends_with(".png") || file.ends_with(".exr"));
    files.filter_map(|file| Some((below(&file)?, sandbox.read(&file)))).collect()
}

fn strays(sandbox: &Sandbox) -> Vec<String> {
    sandbox.files().into_iter().filter(|file| file.contains(".anim-tmp")).collect()
}

#[test]
fn a_second_run_renders_nothing_and_equal_frames_are_rendered_once() {
    let sandbox = sandbox();
    let all = FRAMES as usize;
    expect(sandbox.anim("a.rhai -o out --stats json"), DIFFERENT, all - DIFFERENT, 0);
    let first = pictures(&sandbox, "out/");
    assert_eq!(first.len(), all);
    expect(sandbox.anim("a.rhai -o out --stats json"), 0, 0, all);
    // Without the manifest the frames speak for themselves.
    std::fs::remove_file(sandbox.path("out/.anim-manifest.jsonl")).unwrap();
    expect(sandbox.anim("a.rhai -o out --stats json"), 0, 0, all);
    // A copy is what a fresh run writes, from the file of another frame too.
    std::fs::remove_file(sandbox.path("out/a.0011.png")).unwrap();
    expect(sandbox.anim("a.rhai -o out --stats json"), 0, 1, all - 1);
    for frame in 1..=FRAMES {
        sandbox.anim(&format!("a.rhai -o alone --frames {frame} --threads 1")).ok();
    }
    assert_eq!(pictures(&sandbox, "alone/"), first);
    assert_eq!(pictures(&sandbox, "out/"), first);
    expect(sandbox.anim("a.rhai -o out --stats json --force"), DIFFERENT, all - DIFFERENT, 0);
    assert_eq!(pictures(&sandbox, "out/"), first);
}

#[test]
fn only_what_an_edit_changes_is_rendered_again() {
    let sandbox = sandbox();
    let all = FRAMES as usize;
    sandbox.anim("a.rhai -o out").ok();
    let after = |scene: &str, script: &str, rendered: usize, copied: usize| {
        sandbox.write("a.ron", scene).write("a.rhai", script);
        expect(sandbox.anim("a.rhai -o out --stats json"), rendered, copied, all - rendered - copied);
        sandbox.anim("a.rhai -o fresh --force").ok();
        assert_eq!(pictures(&sandbox, "out/"), pictures(&sandbox, "fresh/"));
        sandbox.write("a.ron", SCENE).write("a.rhai", SCRIPT);
        sandbox.anim("a.rhai -o out").ok();
    };
    // Another form of the same scene, and of the same script.
    let reformatted = SCENE.replace("    ", " ").replace("samples: 1", "samples: 1 /* few */").replace("0.8,", "0.80,");
    after(&reformatted, &SCRIPT.replace("    if", "\n    // Gone.\n if"), 0, 0);
    after(&SCENE.replace("\"spare\": ()", "\"spare\": (diffuse: 0.1)"), SCRIPT, 0, 0);
    after(&SCENE.replace("samples: 1", "samples: 1, accel: Grid"), SCRIPT, 0, 0);
    after(&SCENE.replace("name: \"late\", sphere", "name: \"late\", tags: [\"x\"], sphere"), SCRIPT, 0, 0);
    // An entity that six frames show, and one that all do.
    after(&SCENE.replace("radius: 0.3", "radius: 0.4"), SCRIPT, 6, 0);
    after(&SCENE.replace("(2.0, 5.0, 3.0)", "(2.0, 5.0, 4.0)"), SCRIPT, DIFFERENT, all - DIFFERENT);
    after(SCENE, &SCRIPT.replace("f.number > 6", "f.number > 5"), 1, 0);
}

#[test]
fn a_plan_says_what_is_there_and_what_changes() {
    let sandbox = sandbox();
    let plan = || -> Vec<serde_json::Value> {
        let run = sandbox.anim("plan a.rhai -o out --json").ok();
        run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let states = || -> Vec<String> { plan().iter().map(|v| v["state"].as_str().unwrap().to_string()).collect() };
    assert!(states().iter().all(|state| state == "missing"));
    assert!(!sandbox.exists("out"));
    sandbox.anim("a.rhai -o out").ok();
    assert!(states().iter().all(|state| state == "done"));
    let frames = plan();
    assert_eq!(frames[0]["changed"], serde_json::Value::Null);
    assert_eq!(frames[1]["changed"], serde_json::json!(["camera"]));
    let seventh = frames[6]["changed"].as_array().unwrap();
    assert!(seventh.contains(&"geometry".into()) && seventh.contains(&"transforms".into()), "{seventh:?}");
    assert_eq!(frames[11]["same_as"], 9);
    assert_eq!(frames[11]["hash"], frames[8]["hash"]);
    sandbox.write("out/a.0002.png", "junk");
    let half = sandbox.read("out/a.0003.png")[..300].to_vec();
    sandbox.write("out/a.0003.png", half);
    let mut flipped = sandbox.read("out/a.0004.png");
    *flipped.last_mut().unwrap() ^= 1;
    sandbox.write("out/a.0004.png", flipped);
    let other = sandbox.read("out/a.0001.png");
    sandbox.write("out/a.0005.png", other);
    let found = states();
    assert_eq!(found[..6], ["done", "corrupt", "corrupt", "corrupt", "stale", "done"].map(String::from));
    let table = sandbox.anim("plan a.rhai -o out").ok().stdout;
    assert!(table.contains("8 done, 1 stale, 3 corrupt; 4 to trace"), "{table}");
    expect(sandbox.anim("a.rhai -o out --stats json"), 4, 0, 8);
    sandbox.anim("a.rhai -o fresh").ok();
    assert_eq!(pictures(&sandbox, "out/"), pictures(&sandbox, "fresh/"));
}

#[test]
fn exr_frames_are_kept_copied_and_redone_as_png_frames_are() {
    let sandbox = sandbox();
    let all = FRAMES as usize;
    let run = |folder: &str| sandbox.anim(&format!("a.rhai -o {folder}/f.####.exr --stats json --aovs depth"));
    expect(run("out"), DIFFERENT, all - DIFFERENT, 0);
    let first = pictures(&sandbox, "out/");
    for manifest in [true, false] {
        if !manifest {
            std::fs::remove_file(sandbox.path("out/.anim-manifest.jsonl")).unwrap();
        }
        std::fs::remove_file(sandbox.path("out/f.0011.exr")).unwrap();
        let half = first["f.0002.exr"][..first["f.0002.exr"].len() / 2].to_vec();
        sandbox.write("out/f.0002.exr", half);
        sandbox.write("out/f.0003.exr", "");
        sandbox.write("out/f.0004.exr", first["f.0005.exr"].clone());
        sandbox.write("out/f.0012.exr", "not a picture");
        expect(run("out"), 3, 2, all - 5);
        assert_eq!(pictures(&sandbox, "out/"), first);
    }
    for frame in 9..=FRAMES {
        sandbox.anim(&format!("a.rhai -o alone/f.####.exr --frames {frame} --threads 1 --aovs depth")).ok();
    }
    assert!(pictures(&sandbox, "alone/").iter().all(|(name, bytes)| first[name] == *bytes));
}

#[test]
fn a_still_is_kept_too() {
    let sandbox = sandbox();
    expect(sandbox.anim("a.ron -o x.png --stats json"), 1, 0, 0);
    expect(sandbox.anim("a.ron -o x.png --stats json"), 0, 0, 1);
    expect(sandbox.anim("a.ron -o x.png --stats json --size 20x10"), 1, 0, 0);
    sandbox.write("x.png", "another picture");
    expect(sandbox.anim("a.ron -o x.png --stats json"), 1, 0, 0);
    assert_eq!(sandbox.files(), ["a.rhai", "a.ron", "x.png"]);
}

#[test]
fn a_mistake_in_one_frame_does_not_lose_the_others() {
    let sandbox = sandbox();
    sandbox.write("a.rhai", SCRIPT.replace("    if", "    if f.number == 7 { s.camera.fvo = 3; }\n    if"));
    let said = ["a.rhai:4:", "frame 7", "fvo", "did you mean `fov`?"];
    sandbox.anim("check a.rhai").fails(3, &said);
    sandbox.anim("plan a.rhai -o out").fails(3, &said);
    assert!(!sandbox.exists("out"));
    sandbox.anim("a.rhai -o out").fails(4, &said);
    assert_eq!(pictures(&sandbox, "out/").len(), 11);
    assert!(!sandbox.exists("out/a.0007.png"));
    sandbox.anim("a.rhai -o out --frames 7").fails(3, &said);
    sandbox.write("a.rhai", SCRIPT);
    expect(sandbox.anim("a.rhai -o out --stats json"), 1, 0, 11);
}

#[test]
fn an_asset_that_goes_away_costs_the_frames_that_need_it() {
    let sandbox = sandbox();
    let sky = "if f.number > 9 { s.render.environment = \"sky\"; }\n    if";
    sandbox.write("a.rhai", SCRIPT.replacen("if", sky, 1));
    sandbox.anim("a.rhai -o out").fails(4, &["sky", "in frame 10"]);
    assert_eq!(pictures(&sandbox, "out/").len(), 9);
}

/// The program, started and left to itself.
fn start(sandbox: &Sandbox, arguments: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_anim"))
        .args(arguments.split_whitespace())
        .current_dir(sandbox.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn after_a_kill_exactly_the_missing_frames_are_rendered() {
    let sandbox = sandbox();
    sandbox.anim("a.rhai -o fresh").ok();
    let fresh = pictures(&sandbox, "fresh/");
    for wait in [5, 15, 30, 50, 80] {
        let mut child = start(&sandbox, "a.rhai -o out");
        std::thread::sleep(Duration::from_millis(wait));
        child.kill().unwrap();
        child.wait().unwrap();
        let there = pictures(&sandbox, "out/");
        for (name, bytes) in &there {
            assert!(fresh[name] == *bytes, "{name} is not whole");
        }
        let run = sandbox.anim("a.rhai -o out --stats json").ok();
        assert_eq!(reuse(&run).get("cache").copied().unwrap_or(0), there.len());
        assert_eq!(pictures(&sandbox, "out/"), fresh);
        assert!(strays(&sandbox).is_empty());
        std::fs::remove_dir_all(sandbox.path("out")).unwrap();
    }
}

#[test]
fn shards_at_once_in_one_folder_make_the_whole() {
    let sandbox = sandbox();
    sandbox.anim("a.rhai -o fresh").ok();
    let children: Vec<Child> = (1..=3).map(|i| start(&sandbox, &format!("a.rhai -o out --shard {i}/3"))).collect();
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    assert_eq!(pictures(&sandbox, "out/"), pictures(&sandbox, "fresh/"));
    expect(sandbox.anim("a.rhai -o out --stats json"), 0, 0, FRAMES as usize);
    sandbox.anim("a.rhai --shard 0/3").fails(2, &["numbered from 1 to 3"]);
    sandbox.anim("a.rhai --shard 3").fails(2, &["2/3"]);
}

#[test]
fn two_runs_of_the_same_frames_do_each_other_no_harm() {
    let sandbox = sandbox();
    sandbox.anim("a.rhai -o fresh").ok();
    let mut other = start(&sandbox, "a.rhai -o out --force");
    sandbox.anim("a.rhai -o out").ok();
    assert!(other.wait().unwrap().success());
    assert_eq!(pictures(&sandbox, "out/"), pictures(&sandbox, "fresh/"));
    assert!(strays(&sandbox).is_empty());
    expect(sandbox.anim("a.rhai -o out --stats json"), 0, 0, FRAMES as usize);
}

#[test]
fn a_folder_that_cannot_be_written_to_is_found_out_before_the_first_frame_is_rendered() {
    let sandbox = sandbox();
    let run = sandbox.anim("a.rhai -o a.ron/frames/ --progress json --spp 4096 --size 4000x4000");
    let said = ["cannot write a.ron/frames/a.0001.png: "];
    let run = run.fails(5, &said);
    assert!(!run.stderr.contains(".anim-tmp") && !run.stderr.contains("done"), "{}", run.stderr);
    assert_eq!(sandbox.files(), ["a.rhai", "a.ron"]);
}

#[test]
fn a_frame_that_cannot_be_written_is_an_io_error_and_the_rest_is_whole() {
    let sandbox = sandbox();
    sandbox.anim("a.rhai -o fresh").ok();
    std::fs::create_dir_all(sandbox.path("out/a.0005.png/in the way")).unwrap();
    sandbox.anim("a.rhai -o out --threads 1").fails(5, &["a.0005.png"]);
    for (name, bytes) in pictures(&sandbox, "out/") {
        assert_eq!(bytes, pictures(&sandbox, "fresh/")[&name]);
    }
    std::fs::remove_dir_all(sandbox.path("out/a.0005.png")).unwrap();
    sandbox.anim("a.rhai -o out").ok();
    assert_eq!(pictures(&sandbox, "out/"), pictures(&sandbox, "fresh/"));
}
