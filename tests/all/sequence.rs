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
    let run =
        |folder: &str| sandbox.anim(&format!("a.rhai -o {folder}/f.####.exr --stats json --aovs depth --overwrite"));
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
    sandbox.anim("a.ron -o x.png").fails(2, &["x.png", "no picture that anim has made", "--overwrite"]);
    sandbox.anim("a.ron -o x.png --force").fails(2, &["--overwrite"]);
    assert_eq!(sandbox.read("x.png"), b"another picture");
    expect(sandbox.anim("a.ron -o x.png --stats json --overwrite"), 1, 0, 0);
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
fn a_frame_that_cannot_be_written_does_not_stop_the_others() {
    let sandbox = sandbox();
    sandbox.anim("a.rhai -o fresh").ok();
    std::fs::create_dir_all(sandbox.path("out/a.0005.png/in the way")).unwrap();
    sandbox.anim("a.rhai -o out --threads 1").fails(4, &["cannot write out/a.0005.png"]);
    assert_eq!(pictures(&sandbox, "out/").len(), FRAMES as usize - 1);
    for (name, bytes) in pictures(&sandbox, "out/") {
        assert_eq!(bytes, pictures(&sandbox, "fresh/")[&name]);
    }
    std::fs::remove_dir_all(sandbox.path("out/a.0005.png")).unwrap();
    sandbox.anim("a.rhai -o out").ok();
    assert_eq!(pictures(&sandbox, "out/"), pictures(&sandbox, "fresh/"));
}

#[test]
fn a_picture_that_another_tool_has_changed_is_made_again() {
    let sandbox = sandbox();
    let all = FRAMES as usize;
    expect(sandbox.anim("a.rhai -o out --stats json"), DIFFERENT, all - DIFFERENT, 0);
    let first = pictures(&sandbox, "out/");
    let (frame, twin) = ("out/a.0009.png", "out/a.0010.png");
    for manifest in [true, false] {
        if !manifest {
            std::fs::remove_file(sandbox.path("out/.anim-manifest.jsonl")).unwrap();
        }
        // Packed more tightly, with the notes as they were: nothing has changed.
        sandbox.write(frame, repainted(&first["a.0009.png"], |_| {}));
        assert_ne!(sandbox.read(frame), first["a.0009.png"]);
        expect(sandbox.anim("a.rhai -o out --stats json"), 0, 0, all);
        // Painted over: made again, and its twins are not made from it.
        sandbox.write(frame, repainted(&first["a.0009.png"], |pixels| pixels[5] ^= 1));
        std::fs::remove_file(sandbox.path(twin)).unwrap();
        expect(sandbox.anim("a.rhai -o out --stats json"), 0, 2, all - 2);
        assert_eq!(pictures(&sandbox, "out/"), first);
    }
}

/// The same picture with the same notes, its pixels changed and packed otherwise.
fn repainted(bytes: &[u8], change: impl Fn(&mut [u8])) -> Vec<u8> {
    let mut pixels = image::load_from_memory(bytes).unwrap().to_rgb8();
    change(&mut pixels);
    let (mut data, size) = (std::io::Cursor::new(Vec::new()), pixels.dimensions());
    let encoder = image::codecs::png::PngEncoder::new_with_quality(
        &mut data,
        image::codecs::png::CompressionType::Best,
        image::codecs::png::FilterType::Paeth,
    );
    image::ImageEncoder::write_image(encoder, &pixels, size.0, size.1, image::ExtendedColorType::Rgb8).unwrap();
    let chunks = |bytes: &[u8], wanted: fn(&[u8]) -> bool| -> Vec<u8> {
        let (mut rest, mut found) = (&bytes[8..], Vec::new());
        while rest.len() >= 12 {
            let length = u32::from_be_bytes(rest[..4].try_into().unwrap()) as usize + 12;
            if wanted(&rest[4..8]) {
                found.extend(&rest[..length]);
            }
            rest = &rest[length..];
        }
        found
    };
    let data = data.into_inner();
    let before = chunks(bytes, |kind| kind == b"IHDR" || kind == b"iTXt");
    let after = chunks(&data, |kind| kind == b"IDAT" || kind == b"IEND");
    [&bytes[..8], &before, &after].concat()
}

#[test]
fn two_scripts_of_one_name_do_not_overwrite_each_other() {
    let sandbox = Sandbox::new();
    sandbox.write("p/golden.ron", "").write("p/a.ron", SCENE);
    for folder in ["one", "two"] {
        let script = SCRIPT.replace("a.ron", "../a.ron").replace("12 }", "2 }");
        sandbox.write(
            &format!("p/{folder}/a.rhai"),
            script.replace("30 +", if folder == "one" { "31 +" } else { "32 +" }),
        );
        sandbox.write(&format!("p/{folder}/s.ron"), SCENE);
    }
    sandbox.anim("p/one/a.rhai").ok();
    let first = pictures(&sandbox, "frames/a/");
    sandbox.anim("p/two/a.rhai").fails(2, &["frames/a/a.0001.png", "is a picture of one/a.rhai", "and 1 more"]);
    sandbox.anim("p/two/a.rhai --force").fails(2, &["--overwrite"]);
    assert!(sandbox.anim("plan p/two/a.rhai").ok().stdout.contains("2 foreign"));
    assert_eq!(pictures(&sandbox, "frames/a/"), first);
    sandbox.anim("p/two/a.rhai --overwrite").ok();
    sandbox.anim("p/one/a.rhai").fails(2, &["two/a.rhai"]);
    sandbox.anim("p/one/s.ron").ok();
    sandbox.anim("p/two/s.ron").fails(2, &["frames/s.png", "one/s.ron"]);
    sandbox.write("p/x/...rhai", SCRIPT.replace("a.ron", "../a.ron"));
    sandbox.anim("p/x/...rhai").fails(2, &["-o frame.####.png"]);
}

/// The same for every write of a run: the system refuses files beyond a size, as a full disk does.
#[cfg(target_os = "linux")]
#[test]
fn wherever_a_disk_is_full_frames_are_whole_or_missing() {
    let sandbox = sandbox();
    sandbox.anim("a.rhai -o fresh").ok();
    let fresh = pictures(&sandbox, "fresh/");
    for blocks in [0, 1, 2, 4] {
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" a.rhai -o out --threads 1");
        let run = Command::new("/bin/sh")
            .arg("-c")
            .arg(limited)
            .arg(env!("CARGO_BIN_EXE_anim"))
            .current_dir(sandbox.path(""))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stderr);
        let there = pictures(&sandbox, "out/");
        assert!(there.iter().all(|(name, bytes)| fresh[name] == *bytes), "{blocks}");
        let is_whole = there.len() == FRAMES as usize;
        assert_eq!(run.status.success(), is_whole, "{said}");
        assert!(is_whole || (said.contains("cannot write out/a.") && !said.contains(".anim-tmp")), "{said}");
        assert!(strays(&sandbox).is_empty());
    }
    sandbox.anim("a.rhai -o out").ok();
    assert_eq!(pictures(&sandbox, "out/"), fresh);
    for command in [
        "dump a.ron",
        "convert a.ron",
        "plan a.ron",
        "check a.ron",
        "a.ron -o x.png --stats json",
        "info fresh/a.0001.png",
    ] {
        let full = format!("exec \"$0\" {command} > /dev/full");
        let run = Command::new("/bin/sh")
            .arg("-c")
            .arg(full)
            .arg(env!("CARGO_BIN_EXE_anim"))
            .current_dir(sandbox.path(""))
            .output()
            .unwrap();
        assert_eq!(run.status.code(), Some(5), "{command}: {}", String::from_utf8_lossy(&run.stderr));
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_while_frames_are_planned_is_one() {
    let sandbox = sandbox();
    let slow =
        "animation(#{ frames: 5000 });\nfn frame(s, f) { let x = 0; for i in 0..20000 { x += i; } s.camera.fov = 40; }";
    sandbox.write("slow.rhai", slow);
    let child = start(&sandbox, "slow.rhai -o slow");
    std::thread::sleep(Duration::from_millis(700));
    assert!(Command::new("kill").arg("-INT").arg(child.id().to_string()).status().unwrap().success());
    let mut child = child;
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!sandbox.exists("slow"));
}
