//! Scenes while they are written: values set in place, files that are watched, the page.

use crate::tool::Sandbox;

const STAGE: &str = "// A stage.
(
    camera: (from: (0.0, 1.0, 5.0), at: (0.0, 0.5, 0.0)), // three steps back
    render: (size: (32, 18), samples: 1, integrator: Whitted),
    materials: { \"brass\": (color: (0.9, 0.7, 0.4)) },
    entities: [
        (name: \"ball\", sphere: (radius: 1.0), material: \"brass\"),
        (name: \"key\", point_light: (), transform: (translation: (3.0, 4.0, 2.0))),
    ],
)
";

fn lines_that_differ(a: &str, b: &str) -> usize {
    assert_eq!(a.lines().count(), b.lines().count());
    a.lines().zip(b.lines()).filter(|(a, b)| a != b).count()
}

#[test]
fn set_changes_one_value_of_a_file_and_says_where() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STAGE);
    let said = sandbox.anim("set a.ron entities.ball.sphere.radius=1.5 --dry-run").ok().stdout;
    assert_eq!(said, "a.ron:7:41: entities.ball.sphere.radius = 1.5 (was 1.0)\n");
    assert_eq!(sandbox.read("a.ron"), STAGE.as_bytes());
    sandbox.anim("set a.ron entities.ball.sphere.radius=1.5").ok();
    let after = String::from_utf8(sandbox.read("a.ron")).unwrap();
    assert_eq!(after, STAGE.replace("radius: 1.0", "radius: 1.5"));
    sandbox.anim("set a.ron camera.focus=ball").fails(3, &["camera.focus=ball"]);
    sandbox.anim("set a.ron camera.focus=Entity(\"ball\") materials.brass.color=#ffffff").ok();
    let last = String::from_utf8(sandbox.read("a.ron")).unwrap();
    assert_eq!(lines_that_differ(&after, &last), 2);
    assert!(last.contains("at: (0.0, 0.5, 0.0), focus: Entity(\"ball\")), // three steps back"));
    sandbox.anim("check a.ron").ok();
}

#[test]
fn a_scene_that_would_be_wrong_is_not_written() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STAGE).write("b.nff", "").write("c.ron", [STAGE.as_bytes(), b"// \xe9"].concat());
    sandbox.anim("set a.ron camera.fov=500").fails(3, &["a.ron:3:", "`fov` must be from"]);
    sandbox.anim("set a.ron entities.ball.material=gold").fails(3, &["unknown material `gold`"]);
    sandbox.anim("set a.ron camera.fov=50 camera.fob=1").fails(3, &["did you mean `fov`?"]);
    sandbox.anim("set a.ron camera.fov").fails(2, &["expected PATH=VALUE"]);
    sandbox.anim("set b.nff camera.fov=1").fails(2, &["anim convert"]);
    sandbox.anim("set c.ron camera.fov=1").fails(3, &["must be UTF-8"]);
    assert_eq!(sandbox.read("a.ron"), STAGE.as_bytes());
    assert_eq!(sandbox.files(), ["a.ron", "b.nff", "c.ron"]);
}

#[cfg(unix)]
#[test]
fn permissions_links_and_byte_order_marks_outlive_an_edit() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", format!("\u{feff}{STAGE}"));
    std::fs::set_permissions(sandbox.path("a.ron"), PermissionsExt::from_mode(0o640)).unwrap();
    symlink("a.ron", sandbox.path("b.ron")).unwrap();
    sandbox.anim("set b.ron camera.fov=50").ok();
    assert!(sandbox.path("b.ron").symlink_metadata().unwrap().is_symlink());
    let mode = std::fs::metadata(sandbox.path("a.ron")).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    assert!(String::from_utf8(sandbox.read("a.ron")).unwrap().starts_with("\u{feff}// A stage."));
}

#[cfg(all(unix, feature = "preview"))]
#[test]
fn watch_renders_again_after_an_edit_and_outlives_mistakes() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STAGE);
    let mut child = Command::new(env!("CARGO_BIN_EXE_anim"))
        .args(["watch", "a.ron"])
        .current_dir(sandbox.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
    let mut problems = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(said.next().unwrap().starts_with("frames/a.png ("));
    let first = sandbox.read("frames/a.png");
    sandbox.write("a.ron", STAGE.replace("radius: 1.0", "radius: 1.0.0"));
    assert_eq!(problems.next().unwrap(), "changed: a.ron");
    assert!(problems.next().unwrap().starts_with("a.ron:7:"));
    sandbox.write("a.ron", STAGE.replace("radius: 1.0", "radius: 0.5"));
    assert!(said.next().unwrap().starts_with("frames/a.png ("));
    assert_ne!(first, sandbox.read("frames/a.png"));
    let fresh = Sandbox::new();
    fresh.write("a.ron", sandbox.read("a.ron"));
    fresh.anim("a.ron").ok();
    assert_eq!(fresh.read("frames/a.png"), sandbox.read("frames/a.png"));
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
}
