//! From one machine to many: archives, tasks, claims, what a folder lacks, and the jobs that are written for schedulers.

use std::process::{Command, Stdio};
use std::time::Duration;

use crate::tool::Sandbox;

const SCENE: &str = r#"(
    render: (size: (24, 16), samples: 1),
    materials: { "red": (color: (0.8, 0.1, 0.1)), "wall": (color_map: (image: "maps/dots.png")) },
    entities: [
        (name: "ball", sphere: (), material: "red"),
        (name: "wall", plane: (normal: (0.0, 0.0, 1.0)), material: "wall", transform: (translation: (0.0, 0.0, -2.0))),
        (name: "lamp", point_light: (position: (2.0, 5.0, 3.0))),
    ],
)"#;

const SCRIPT: &str = r#"animation(#{ scene: "a.ron", frames: 12 });
fn frame(s, f) {
    import "lib/path" as path;
    s.camera.fov = param("wide", 30) + path::at(f.index);
}"#;

/// A project with a script, a module, a scene and a texture, and something that is not of it.
fn project() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("p/a.ron", SCENE).write("p/a.rhai", SCRIPT).write("p/lib/path.rhai", "fn at(i) { i / 2.0 }");
    sandbox.write("p/unused.txt", "not of the shot").write("p/golden.ron", "(entries: [])");
    let dots: Vec<u8> = (0..48).map(|i| if i % 5 == 0 { 250 } else { 40 }).collect();
    std::fs::create_dir_all(sandbox.path("p/maps")).unwrap();
    sandbox.write("p/maps/dots.png", anim::output::encode_rgb8(&dots, [4, 4], &Default::default()).unwrap());
    sandbox
}

fn frames(sandbox: &Sandbox, folder: &str) -> Vec<Vec<u8>> {
    (1..=12).map(|frame| sandbox.read(&format!("{folder}/a.{frame:04}.png"))).collect()
}

#[test]
fn an_archive_renders_to_the_same_bytes_and_is_equal_for_equal_input() {
    let sandbox = project();
    sandbox.anim("p/a.rhai -o plain -D wide=40").ok();
    sandbox.anim("pack p/a.rhai -D wide=40 -o a.anim.zip").ok();
    sandbox.anim("pack p/a.rhai -D wide=40 -o b.anim.zip").ok();
    assert_eq!(sandbox.read("a.anim.zip"), sandbox.read("b.anim.zip"));
    // The folder of the input is gone; so is what it was packed with.
    std::fs::rename(sandbox.path("p"), sandbox.path("elsewhere")).unwrap();
    sandbox.anim("a.anim.zip -o packed").ok();
    assert_eq!(frames(&sandbox, "packed"), frames(&sandbox, "plain"));
    // The archive is the input by another name: what it makes is kept.
    assert!(sandbox.anim("plan a.anim.zip -o plain --exit-code").ok().stdout.contains("12 done"));
    assert!(!String::from_utf8_lossy(&sandbox.read("a.anim.zip")).contains("unused"));
    sandbox.anim("a.anim.zip --root .").fails(2, &["reads nothing but what is in it"]);
}

#[test]
fn a_folder_of_an_archive_grows_by_what_is_new() {
    let sandbox = project();
    let new = |said: String| said.split(", ").find_map(|part| part.strip_suffix(" new").map(str::to_string));
    assert_eq!(new(sandbox.anim("pack p/a.rhai -o a.anim").ok().stdout).unwrap(), "4");
    assert_eq!(new(sandbox.anim("pack p/a.rhai -o a.anim").ok().stdout).unwrap(), "0");
    sandbox.write("p/lib/path.rhai", "fn at(i) { i / 3.0 }");
    assert_eq!(new(sandbox.anim("pack p/a.rhai -o a.anim").ok().stdout).unwrap(), "1");
    sandbox.anim("a.anim -o packed --frames 3").ok();
    sandbox.anim("p/a.rhai -o plain --frames 3").ok();
    assert_eq!(sandbox.read("packed/a.0003.png"), sandbox.read("plain/a.0003.png"));
    // A content that was changed is refused by its name.
    let content = sandbox.files().into_iter().find(|file| file.starts_with("a.anim/contents/")).unwrap();
    sandbox.write(&content, "other");
    sandbox.anim("a.anim").fails(3, &["is not the one that was packed"]);
}

#[test]
fn archives_that_lead_out_lack_something_or_are_damaged_are_refused() {
    let sandbox = project();
    sandbox.anim("pack p/a.rhai -o a.anim").ok();
    let manifest = String::from_utf8(sandbox.read("a.anim/manifest.json")).unwrap();
    let with = |from: &str, to: &str, said: &str| {
        let changed = manifest.replacen(from, to, 1);
        assert_ne!(changed, manifest, "{from}");
        sandbox.write("a.anim/manifest.json", changed);
        sandbox.anim("a.anim").fails(3, &[said]);
        assert!(!sandbox.exists("frames") && !sandbox.exists("evil.rhai"));
    };
    with("\"path\": \"lib/path.rhai\"", "\"path\": \"../evil.rhai\"", "leads out of the archive");
    with("\"path\": \"lib/path.rhai\"", "\"path\": \"/evil.rhai\"", "leads out of the archive");
    with("\"path\": \"lib/path.rhai\"", "\"path\": \"c:\\\\evil.rhai\"", "leads out of the archive");
    with("\"path\": \"lib/path.rhai\"", "\"path\": \"a.ron\"", "is in it twice");
    with("\"input\": \"a.rhai\"", "\"input\": \"b.rhai\"", "there is `a.rhai`");
    with("\"layout\": 1", "\"layout\": 2", "layout is 2");
    let bytes = manifest.find("\"bytes\": ").unwrap();
    let number: String = manifest[bytes + 9..].chars().take_while(char::is_ascii_digit).collect();
    with(&format!("\"bytes\": {number}"), "\"bytes\": 99999999999", "larger than the limit");
    with(&format!("\"bytes\": {number}"), "\"bytes\": 3", "is not the one that was packed");
    sandbox.write("a.anim/manifest.json", "{}");
    sandbox.anim("a.anim").fails(3, &["manifest.json cannot be understood"]);
    // Of a file: every byte of it may be missing or wrong.
    sandbox.anim("pack p/a.rhai -o a.anim.zip").ok();
    let whole = sandbox.read("a.anim.zip");
    for at in (0..whole.len()).step_by(whole.len() / 12) {
        sandbox.write("cut.anim.zip", &whole[..at]);
        let run = sandbox.anim("plan cut.anim.zip");
        assert!(run.code == 3 && run.stderr.contains("error: "), "cut at {at}: {}", run.stderr);
    }
    sandbox.write("no.anim.zip", "PK");
    sandbox.anim("no.anim.zip").fails(3, &["no whole zip archive"]);
    sandbox.anim("none.anim.zip").fails(3, &["no such file"]);
    sandbox.anim("pack a.anim.zip").fails(2, &["an archive already"]);
    sandbox.anim("pack p/a.rhai -o a.tar").fails(2, &["a.anim.zip"]);
}

#[cfg(unix)]
#[test]
fn what_lies_outside_of_the_project_is_not_packed() {
    let sandbox = project();
    sandbox.write("out/dots.png", sandbox.read("p/maps/dots.png"));
    std::fs::remove_file(sandbox.path("p/maps/dots.png")).unwrap();
    std::os::unix::fs::symlink(sandbox.path("out/dots.png"), sandbox.path("p/maps/dots.png")).unwrap();
    sandbox.anim("pack p/a.rhai --allow-read out").fails(3, &["a link that leaves the project", "--root"]);
    // A name that only this machine knows is found to be missing before anybody else finds it.
    std::fs::remove_file(sandbox.path("p/maps/dots.png")).unwrap();
    std::fs::copy(sandbox.path("out/dots.png"), sandbox.path("p/maps/dots.png")).unwrap();
    let absolute = sandbox.path("p/maps/dots.png").to_string_lossy().into_owned();
    sandbox.write("p/a.ron", SCENE.replace("maps/dots.png", &absolute));
    sandbox.anim("p/a.rhai -o plain --frames 1").ok();
    sandbox.anim("pack p/a.rhai").fails(3, &["does not hold all that its frames need", "absolute path"]);
    assert!(!sandbox.exists("a.anim.zip"));
}

#[test]
fn a_plan_tells_tasks_what_is_left_and_what_splitting_costs() {
    let sandbox = project();
    let lines = |arguments: &str| -> Vec<serde_json::Value> {
        sandbox.anim(arguments).ok().stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let tasks = lines("plan p/a.rhai -o out --json --tasks 5");
    assert_eq!(
        (tasks.len(), &tasks[0]["tasks"], &tasks[0]["frames"], &tasks[0]["left"]),
        (6, &5.into(), &12.into(), &12.into())
    );
    let numbers: u64 = tasks[1..].iter().map(|task| task["count"].as_u64().unwrap()).sum();
    assert_eq!((numbers, &tasks[1]["first"], &tasks[5]["last"]), (12, &1.into(), &12.into()));
    assert!(tasks[0]["memory_bytes"].as_u64().unwrap() >= 256 << 20 && tasks[0]["cores"].as_u64().unwrap() >= 1);
    // The arguments of a task are a command.
    let words = |task: &serde_json::Value| -> String {
        let words = task["arguments"].as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_string());
        words.collect::<Vec<_>>().join(" ")
    };
    sandbox.anim(&words(&tasks[2])).ok();
    let left = sandbox.anim("plan p/a.rhai -o out --left");
    assert_eq!((left.code, left.stdout.trim().contains(&tasks[2]["frames"].as_str().unwrap().to_string())), (1, false));
    sandbox.anim("plan p/a.rhai -o out --exit-code").fails(1, &[]);
    assert!(sandbox.anim("plan p/a.rhai -o out --tasks 5").ok().stdout.contains("5 tasks side by side"));
    for task in &tasks[1..] {
        sandbox.anim(&words(task)).ok();
    }
    assert_eq!(sandbox.anim("plan p/a.rhai -o out --left --exit-code").ok().stdout, "");
    // After an edit the tasks of before are refused.
    sandbox.write("p/lib/path.rhai", "fn at(i) { i / 3.0 }");
    sandbox.anim(&words(&tasks[1])).fails(3, &["write the job anew"]);
    sandbox.anim(&format!("plan p/a.rhai --expect {}", tasks[0]["plan"].as_str().unwrap())).fails(3, &["the plan is"]);
}

#[test]
fn workers_on_one_folder_render_every_frame_once_though_they_are_killed() {
    let sandbox = project();
    sandbox.write("p/a.rhai", SCRIPT.replace("frames: 12", "frames: 36"));
    sandbox.anim("p/a.rhai -o plain").ok();
    let start = |more: &str| {
        let words = format!("p/a.rhai -o out --claims --threads 1 --progress json {more}");
        Command::new(env!("CARGO_BIN_EXE_anim"))
            .args(words.split_whitespace())
            .current_dir(sandbox.path(""))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    for round in 0..3 {
        let mut workers = [start("--shard 1/2"), start("--shard 2/2"), start("--frames 5-36")];
        std::thread::sleep(Duration::from_millis(150 + 60 * round));
        workers[round as usize].kill().unwrap();
        for worker in &mut workers {
            worker.wait().unwrap();
        }
    }
    sandbox.anim("p/a.rhai -o out --claims").ok();
    for frame in 1..=36 {
        assert_eq!(sandbox.read(&format!("out/a.{frame:04}.png")), sandbox.read(&format!("plain/a.{frame:04}.png")));
    }
    let status: serde_json::Value =
        serde_json::from_str(&sandbox.anim("status out --json --verify --exit-code").ok().stdout).unwrap();
    assert_eq!(
        (&status["done"], &status["twice"], &status["missing"]),
        (&36.into(), &"".into(), &"".into()),
        "{status}"
    );
    let claims = sandbox.files().into_iter().filter(|file| file.contains(".anim-claims/0"));
    assert_eq!(claims.collect::<Vec<_>>(), Vec::<String>::new());
    sandbox.anim("p/a.rhai -o out --claims --force").fails(2, &["--force"]);
    sandbox.anim("p/a.ron -o out.png --claims").fails(2, &["one picture"]);
}

#[test]
fn one_of_several_workers_helps_the_others() {
    let sandbox = project();
    sandbox.anim("p/a.rhai -o out --claims --shard 2/3").ok();
    assert_eq!(sandbox.files().iter().filter(|file| file.starts_with("out/a.")).count(), 12);
    let shown = sandbox.anim("status out").ok().stdout;
    assert!(shown.contains("12 of 12 frames done") && shown.contains("done: 12 frames"), "{shown}");
    sandbox.anim("status nowhere").fails(2, &["no such folder"]);
}

#[cfg(unix)]
#[test]
fn a_job_script_is_a_shell_script_whatever_is_in_its_paths() {
    let sandbox = project();
    std::fs::rename(sandbox.path("p"), sandbox.path("it's")).unwrap();
    sandbox.anim("farm slurm it's/a.rhai --tasks 3 -D wide=35 --film f.mp4 --partition fast --throttle 2").ok();
    let script = String::from_utf8(sandbox.read("a.slurm.sh")).unwrap();
    assert!(script.starts_with("#!/bin/bash\n"));
    for line in ["#SBATCH --array=1-3%2\n", "#SBATCH --partition=fast\n", "#SBATCH --requeue\n", "#     1   "] {
        assert!(script.contains(line), "{line} in\n{script}");
    }
    let checked = Command::new("bash").args(["-n"]).arg(sandbox.path("a.slurm.sh")).output().unwrap();
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    // Its words reach the program as they were: the check of an empty folder names every frame.
    let script = sandbox.path("a.slurm.sh");
    let run = |arguments: &[&str]| {
        Command::new("bash").arg(&script).args(arguments).env("SLURM_ARRAY_TASK_ID", "2").output().unwrap()
    };
    let said = String::from_utf8_lossy(&run(&["check"]).stdout).into_owned();
    assert!(said.contains("missing: 1-12"), "{said}");
    // A task outside of a cluster is one all the same.
    assert!(run(&[]).status.success());
    sandbox.anim("plan it's/a.rhai -D wide=35 --exit-code").ok();
    sandbox.anim("farm slurm it's/a.rhai --shard 1/2").fails(2, &["--tasks"]);
    sandbox.anim("farm slurm it's/a.ron").fails(2, &["one picture"]);
}

#[test]
fn templates_and_rules_name_every_frame_once() {
    let sandbox = project();
    let template = sandbox.anim("farm openjd p/a.rhai --tasks 4 --to -").ok().stdout;
    assert!(template.contains("range: \"1-{{Param.Tasks}}\"") && !template.contains("extensions"), "{template}");
    assert!(template.contains("exec \"$anim\" render"));
    // Each of two scripts is handed every parameter that the template declares.
    let declared: Vec<&str> = template.lines().filter_map(|line| line.strip_prefix("- name: ")).collect();
    let parameters = declared.iter().filter(|name| template.contains(&format!("\"{{{{Param.{name}}}}}\"")));
    for name in ["Input", "Output", "Frames", "Width", "Height", "Samples", "Anim", "Tasks"] {
        assert!(declared.contains(&name), "{name}: {template}");
        assert_eq!(template.matches(&format!("\"{{{{Param.{name}}}}}\"")).count(), 2, "{name}: {template}");
    }
    assert_eq!(parameters.count(), 8, "{template}");
    let chunked = sandbox.anim("farm openjd p/a.rhai --chunk-seconds 60 --for windows --to -").ok().stdout;
    assert!(chunked.contains("extensions: [TASK_CHUNKING]") && chunked.contains("powershell"), "{chunked}");
    // Scripts of both steps are for one shell, and a path of this machine is none of another system's.
    assert_eq!(chunked.matches("anyOf: [windows]").count(), 2, "{chunked}");
    assert_eq!(template.matches("anyOf: [linux]").count(), 2, "{template}");
    assert_eq!(chunked.contains("default: \"anim\""), cfg!(not(windows)), "{chunked}");
    sandbox.anim("farm openjd p/a.rhai --frames 5,3").fails(2, &["in their order"]);
    sandbox.write("p/b.rhai", SCRIPT.replace("30)", "30) + param(\"label\", \"\").len()"));
    sandbox.anim("farm openjd p/b.rhai -D label=\"x\" --for windows").fails(2, &["double quote"]);
    let ninja = sandbox.anim("farm make p/a.rhai --tasks 4 -o out/ --to build.ninja").ok();
    assert!(ninja.stdout.contains("ninja -f build.ninja"));
    let rules = String::from_utf8(sandbox.read("build.ninja")).unwrap();
    let outputs: usize =
        rules.lines().filter(|line| line.contains(": render |")).map(|line| line.matches(".png").count()).sum();
    // A texture is an input of all of them.
    assert_eq!(outputs, 12 + 4, "{rules}");
    let make = sandbox.anim("farm make p/a.rhai --minutes-per-task 900 --to -").ok().stdout;
    assert!(make.contains("all: task-1\n") && make.contains("\ttask-1".trim()), "{make}");
}

#[test]
fn open_job_description_hears_how_far_it_is_and_what_failed() {
    let sandbox = project();
    let run = sandbox.anim("p/a.rhai -o out --frames 1-4 --progress openjd").ok();
    assert!(
        run.stdout.contains("openjd_progress: 25.00\n") && run.stdout.contains("openjd_progress: 100.00\n"),
        "{}",
        run.stdout
    );
    assert!(run.stdout.contains("openjd_status: frame "));
    sandbox.write("p/a.rhai", "animation(#{ frames: 2 });\nfn frame(s, f) { s.camera.fow = 3; }");
    let run = sandbox.anim("p/a.rhai -o out --progress openjd");
    assert!(run.code == 3 && run.stdout.starts_with("openjd_fail: "), "{}", run.stdout);
}

#[test]
fn tiles_are_merged_to_the_bytes_of_the_whole() {
    let sandbox = project();
    sandbox.write("p/still.ron", SCENE.replace("(24, 16)", "(70, 40)"));
    for (name, more) in [("plain", ""), ("layers", "--denoise --aovs depth,entity --depth 32")] {
        sandbox.anim(&format!("p/still.ron -o {name}.exr {more}")).ok();
        for i in 1..=4 {
            sandbox.anim(&format!("p/still.ron --tiles {i}/4 -o {name}.{i}.exr {more}")).ok();
        }
        let parts = |numbers: &[u32]| numbers.iter().map(|i| format!("{name}.{i}.exr ")).collect::<String>();
        sandbox.anim(&format!("merge {} -o merged.exr", parts(&[3, 1, 4, 2]))).ok();
        assert!(sandbox.read("merged.exr") == sandbox.read(&format!("{name}.exr")), "{name}");
        sandbox.anim(&format!("merge {} -o no.exr", parts(&[1, 2, 4]))).fails(3, &["a part is missing"]);
        sandbox.anim(&format!("merge {} -o no.exr", parts(&[1, 2, 2, 3, 4]))).fails(3, &["lie over each other"]);
    }
    sandbox.anim("merge plain.1.exr layers.2.exr -o no.exr").fails(3, &["parts of different frames"]);
    sandbox.anim("p/still.ron --tiles 1/4 -o a.png").fails(2, &["EXR"]);
    sandbox.anim("p/still.ron --tiles 5/4 -o a.exr").fails(2, &["numbered from 1 to 4"]);
    sandbox.anim("p/still.ron --tiles 1/400 -o a.exr").fails(2, &["squares"]);
    sandbox.anim("p/still.ron --region 0,0,70,40 -o region.exr").ok();
    assert!(sandbox.anim("merge region.exr -o whole.exr").ok().stderr.contains("does not say which frame"));
    assert!(!sandbox.exists("no.exr"));
}
