//! What somebody else's scene or script may do: nothing but pictures.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anim::base::project::{Access, Project};
use anim::components::Scene;
use anim::load;
use anim::script::host::{HOST_WORD, HostCommand};
use anim::script::{Evaluation, Program};

use crate::tool::Sandbox;

const SCENE: &str = "(render: (size: (8, 8), samples: 1), entities: [(name: \"ball\", sphere: ())])";

fn this_host() -> HostCommand {
    HostCommand::new(env!("CARGO_BIN_EXE_anim"), [HOST_WORD.into()])
}

fn program(path: &Path, host: Option<HostCommand>) -> Result<Program, String> {
    let project = Project::of(path, &Access::default()).map_err(|d| d.to_string())?;
    let evaluation = host.map_or(Evaluation::InProcess, Evaluation::Hosted);
    Program::open(path, &[], &project, &evaluation).map_err(|d| d.to_string())
}

fn scene_of(program: &Program) -> Arc<Scene> {
    match program.scene_path().unwrap() {
        Some((path, project)) => Arc::new(load::load_scene_in(&path, false, &project).unwrap().0),
        None => Arc::default(),
    }
}

#[test]
fn a_process_of_its_own_gives_the_edits_of_this_process() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let mut compared = 0;
    for entry in std::fs::read_dir(root.join("scripts")).unwrap() {
        let path = entry.unwrap().path();
        let (Ok(here), Ok(hosted)) = (program(&path, None), program(&path, Some(this_host()))) else { continue };
        assert_eq!(here.header(), hosted.header());
        let scene = scene_of(&here);
        assert_eq!(here.setup(&scene), hosted.setup(&scene), "{}", path.display());
        let frames = here.header().frames;
        for (number, offset) in [(1, 0.0), (frames.div_ceil(2), 0.25), (frames, 0.0)] {
            let edits = here.frame(&scene, number, offset);
            assert_eq!(edits, hosted.frame(&scene, number, offset), "{} {number}", path.display());
            compared += edits.map_or(0, |edits| edits.len());
        }
    }
    assert!(compared > 50, "{compared}");
}

#[test]
fn many_threads_ask_at_once() {
    let desk = Sandbox::new();
    desk.write("a.rhai", "animation(#{ frames: 64 }); fn frame(s, f) { s.camera.fov = 20 + f.number / 2.0; }");
    let hosted = program(&desk.path("a.rhai"), Some(this_host())).unwrap();
    let here = program(&desk.path("a.rhai"), None).unwrap();
    let scene: Arc<Scene> = Arc::default();
    std::thread::scope(|scope| {
        for first in 1..=4 {
            let (hosted, here, scene) = (&hosted, &here, &scene);
            scope.spawn(move || {
                for number in (first..=64).step_by(4) {
                    assert_eq!(hosted.frame(scene, number, 0.0), here.frame(scene, number, 0.0));
                }
            });
        }
    });
}

/// A shell that stands for a script's process.
#[cfg(unix)]
fn shell(command: &str) -> HostCommand {
    HostCommand::new("/bin/sh", ["-c".into(), command.into(), env!("CARGO_BIN_EXE_anim").into()])
}

#[cfg(unix)]
#[test]
fn the_end_of_a_process_is_an_error_of_its_script() {
    let desk = Sandbox::new();
    desk.write("a.rhai", "animation(#{}); fn frame(s, f) {}");
    let said = |command: &str| program(&desk.path("a.rhai"), Some(shell(command))).err().unwrap();
    for (command, words) in [
        ("exit 7", "ended its process: exit status: 7"),
        ("kill -9 $$", "ended its process: signal: 9"),
        ("kill -SEGV $$", "its stack overflows"),
        ("echo 'memory allocation of 9 bytes failed' >&2; kill -ABRT $$", "needs more than"),
        ("echo nonsense", "ended its process"),
    ] {
        let said = said(command);
        assert!(said.contains("a.rhai: error: ") && said.contains(words), "{command}: {said}");
    }
    let missing = HostCommand::new(desk.path("nothing"), []);
    assert!(program(&desk.path("a.rhai"), Some(missing)).err().unwrap().contains("cannot start the script's process"));
}

/// A script that needs little, in a process that has less.
#[cfg(target_os = "linux")]
#[test]
fn the_line_at_which_a_process_ended_is_found() {
    let desk = Sandbox::new();
    let script = "animation(#{ frames: 3 });
fn more(s, text) {
    s.spawn(#{ tags: [text] });
}
fn frame(s, f) {
    let text = \"x\";
    text.pad(1000000, 'x');
    if f.number == 2 {
        for i in 0..400 {
            more(s, text);
        }
    }
}";
    desk.write("a.rhai", script);
    let small = shell("ulimit -v 300000; exec \"$0\" script-host");
    let program = program(&desk.path("a.rhai"), Some(small)).unwrap();
    let scene: Arc<Scene> = Arc::default();
    for _ in 0..2 {
        assert_eq!(program.frame(&scene, 1, 0.0), Ok(vec![]));
        let said = program.frame(&scene, 2, 0.0).unwrap_err().to_string();
        assert!(said.contains("in frame 2: one operation of the script needs more than"), "{said}");
        assert!(said.contains("a.rhai:10:") && said.contains("more(s, text)"), "{said}");
        assert_eq!(program.frame(&scene, 3, 0.0), Ok(vec![]));
    }
}

#[test]
fn what_a_script_holds_is_counted_together() {
    let desk = Sandbox::new();
    let body =
        "let text = \"x\"; text.pad(1000000, 'x');\n    for i in 0..2000 {\n        s.spawn(#{ tags: [text] });\n    }";
    desk.write("a.rhai", format!("animation(#{{}});\nfn frame(s, f) {{\n    {body}\n}}"));
    desk.anim("a.rhai -o out").fails(3, &["a.rhai:5:", "in frame 1: the script holds more than 512 MiB"]);
    assert_eq!(desk.files(), ["a.rhai"]);
}

#[test]
fn modules_are_known_before_anything_runs() {
    let desk = Sandbox::new();
    let main = |import: &str| {
        format!("animation(#{{}});\nfn frame(s, f) {{\n    import \"{import}\" as m;\n    s.camera.fov = m::fov();\n}}")
    };
    desk.write("lib/one.rhai", "import \"two\" as two;\nfn fov() {\n    import \"two\" as t;\n    t::wide()\n}");
    desk.write("lib/two.rhai", "fn wide() { 70 }");
    desk.write("a.rhai", main("lib/one"));
    assert!(desk.anim("dump a.rhai").ok().stdout.contains("fov: 70"));
    // What is imported at the top is there in every function.
    desk.write(
        "top.rhai",
        "import \"lib/one\" as m;\nanimation(#{});\nfn frame(s, f) {\n    s.camera.fov = m::fov();\n}",
    );
    assert!(desk.anim("dump top.rhai").ok().stdout.contains("fov: 70"));
    // A mistake in a module is placed in the module.
    desk.write("lib/two.rhai", "fn wide() {\n    70 + nothing\n}");
    desk.anim("check a.rhai").fails(3, &["two.rhai:2:", "nothing"]);
    desk.write("lib/two.rhai", "fn wide() { 70 ");
    desk.anim("check a.rhai").fails(3, &["two.rhai:1:"]);
    desk.write("lib/two.rhai", "import \"one\" as one; fn wide() { 70 }");
    desk.anim("check a.rhai").fails(3, &["two.rhai:1:8", "in a circle", "one.rhai -> ", "two.rhai -> "]);
    desk.write("a.rhai", main("lib/tow"));
    desk.anim("check a.rhai").fails(3, &["a.rhai:3:12", "there is no module `lib/tow`", "did you mean"]);
    desk.write("a.rhai", main("../a"));
    desk.anim("check a.rhai").fails(3, &["a.rhai:3:12", "outside of the project"]);
    desk.write("a.rhai", "animation(#{}); let n = \"lib/two\";\nimport n as m;\nfn frame(s, f) {}");
    desk.anim("check a.rhai").fails(3, &["a.rhai:2:1", "written out"]);
    for i in 0..30 {
        desk.write(&format!("deep{i}.rhai"), format!("import \"deep{}\" as next;", i + 1));
    }
    desk.write("deep30.rhai", "").write("a.rhai", main("deep0"));
    desk.anim("check a.rhai").fails(3, &["deep15.rhai:1:8", "more than 16 modules"]);
}

#[test]
fn nothing_outside_of_the_project_is_read() {
    let desk = Sandbox::new();
    let png = anim_png();
    desk.write("p/golden.ron", "").write("p/shots/t.png", &png).write("p/in.png", &png).write("out.png", &png);
    desk.write("out/m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").write("out/b.ron", SCENE);
    let textured = |file: &str| {
        format!(
            "(render: (size: (4, 4), samples: 1),\n materials: {{\"m\": (color_map: (image: \"{file}\"))}},\n entities: [(sphere: (), material: \"m\")])"
        )
    };
    let outside = desk.path("out.png").to_string_lossy().into_owned();
    for (file, is_inside) in [("t.png", true), ("../in.png", true), ("../../out.png", false), (outside.as_str(), false)]
    {
        desk.write("p/shots/a.ron", textured(file));
        let run = desk.anim("check p/shots/a.ron");
        match is_inside {
            true => drop(run.ok()),
            false => drop(run.fails(3, &["a.ron:2:", "outside of the project", "--allow-read"])),
        }
    }
    desk.anim("check p/shots/a.ron --allow-read .").ok();
    desk.anim("check p/shots/a.ron --root .").ok();
    desk.anim("check p/shots/a.ron --root out").fails(2, &["--root"]);
    desk.anim("check p/shots/a.ron --allow-read none").fails(2, &["no such folder"]);
    desk.write("p/shots/a.ron", "(entities: [(mesh: (file: \"../../out/m.obj\"))])");
    desk.anim("check p/shots/a.ron").fails(3, &["outside of the project"]);
    desk.write("p/shots/a.ron", "(render: (environment: \"../../out\"))");
    desk.anim("check p/shots/a.ron").fails(3, &["a.ron:1:", "outside of the project"]);
    desk.write("p/shots/a.nff", "ply ../../out/m.ply\ns 0 0 0 1\n");
    desk.anim("check p/shots/a.nff --strict").fails(3, &["a.nff:1:5", "outside of the project"]);
    let script = "animation(#{ scene: param(\"scene\", \"../../out/b.ron\") });\nfn frame(s, f) {}";
    desk.write("p/shots/a.rhai", script);
    desk.anim("check p/shots/a.rhai").fails(3, &["a.rhai:1:", "outside of the project"]);
    desk.anim("check p/shots/a.rhai -D scene=out/b.ron").ok();
    let texture = "s.get(\"ball\").texture = #{ image: \"../../out.png\" };";
    desk.write("p/b.ron", SCENE);
    desk.write(
        "p/shots/a.rhai",
        format!("animation(#{{ scene: \"../b.ron\" }});\nfn frame(s, f) {{\n    {texture}\n}}"),
    );
    desk.anim("check p/shots/a.rhai").fails(3, &["outside of the project"]);
}

fn anim_png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 2, image::Rgb([9, 99, 199])).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_not_waited_for() {
    let desk = Sandbox::new();
    let made = std::process::Command::new("mkfifo").arg(desk.path("pipe.ron")).status();
    if made.is_ok_and(|status| status.success()) {
        desk.anim("check pipe.ron").fails(3, &["pipe.ron", "not a file"]);
    }
    std::os::unix::fs::symlink("/dev/zero", desk.path("zero.ron")).unwrap();
    desk.anim("check zero.ron").fails(3, &["zero.ron", "not a file"]);
}
