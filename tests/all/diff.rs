//! `anim diff`: every value of two files, metrics, folders, and what is printed and written.

use serde_json::Value;

use crate::tool::Sandbox;

const SCENE: &str = "(
    camera: (from: (0.0, 1.0, 5.0), at: (0.0, 0.5, 0.0)),
    render: (size: (12, 8), samples: 1, integrator: Whitted),
    entities: [
        (name: \"ball\", sphere: (radius: 1.0)),
        (name: \"key\", point_light: (), transform: (translation: (3.0, 4.0, 2.0))),
    ],
)";

/// A sandbox with `a.ron`, and `b.ron` whose ball is larger.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", SCENE).write("b.ron", SCENE.replace("radius: 1.0", "radius: 1.1"));
    sandbox
}

fn json(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

#[test]
fn exr_files_are_compared_with_every_channel() {
    let sandbox = sandbox();
    sandbox.anim("a.ron -o colors.exr").ok();
    sandbox.anim("a.ron -o whole.exr --aovs depth,normal").ok();
    sandbox.anim("b.ron -o other.exr --aovs depth,normal").ok();
    sandbox.anim("diff whole.exr whole.exr").ok();
    let lacks = sandbox.anim("diff whole.exr colors.exr");
    assert_eq!(lacks.code, 1);
    assert!(lacks.stdout.contains("channels `N.X`, `N.Y`, `N.Z`, `Z` only in the first"), "{}", lacks.stdout);
    assert_eq!(sandbox.anim("diff whole.exr colors.exr --metric max --tolerance 1000").code, 1);
    let flip = sandbox.anim("diff whole.exr other.exr --metric flip --tolerance 1").ok();
    assert!(flip.stderr.contains("`N.X`") && flip.stderr.contains("are not judged"), "{}", flip.stderr);
    let run = sandbox.anim("diff whole.exr other.exr --json");
    let line = &json(&run.stdout)[0];
    let names: Vec<&str> = line["channels"].as_array().unwrap().iter().map(|c| c["name"].as_str().unwrap()).collect();
    assert!(run.code == 1 && names.contains(&"Z") && names.contains(&"N.X"), "{line}");
    assert!(line["layout"].as_array().unwrap().is_empty() && line["result"] == "different");
}

#[test]
fn each_metric_has_its_tolerance_and_its_number() {
    let sandbox = sandbox();
    sandbox.anim("a.ron -o a.png").ok();
    sandbox.anim("b.ron -o b.png").ok();
    let run = sandbox.anim("diff a.png b.png --metric flip --json");
    let numbers = &json(&run.stdout)[0];
    let flip = numbers["flip"][0]["mean"].as_f64().unwrap();
    let shown = |metric: &str| numbers[metric].as_f64().unwrap();
    assert!(run.code == 1 && flip > 0.0 && flip < 0.5, "{numbers}");
    assert!((numbers["flip"][0]["pixels_per_degree"].as_f64().unwrap() - 67.0206).abs() < 1e-3);
    for (metric, number, above) in [
        ("max", shown("largest"), true),
        ("rmse", shown("rmse"), true),
        ("psnr", shown("psnr"), false),
        ("flip", flip, true),
    ] {
        let run =
            |by: f64| sandbox.anim(&format!("diff a.png b.png --metric {metric} --tolerance {}", number * by)).code;
        let (wider, tighter) = if above { (1.01, 0.99) } else { (0.99, 1.01) };
        assert_eq!((run(wider), run(tighter)), (0, 1), "{metric} {number}");
    }
    sandbox.anim("diff a.png b.png --metric exact --tolerance 1").fails(2, &["has no tolerance"]);
    sandbox.anim("diff a.png b.png --metric mse").fails(2, &["rmse"]);
}

#[test]
fn folders_give_numbers_pictures_and_a_page() {
    let sandbox = sandbox();
    for (folder, scene) in [("one", "a"), ("two", "a")] {
        sandbox.anim(&format!("{scene}.ron -o {folder}/same.png")).ok();
    }
    sandbox.anim("a.ron -o one/moved.png").ok();
    sandbox.anim("b.ron -o two/moved.png").ok();
    sandbox.anim("a.ron -o one/gone.png").ok();
    sandbox.anim("a.ron -o two/new.exr").ok();
    let run = sandbox.anim("diff one two -o apart --html page.html --json");
    let lines = json(&run.stdout);
    let of = |name: &str| lines.iter().find(|line| line["file"].as_str().unwrap().contains(name)).unwrap();
    assert_eq!((run.code, lines.len()), (1, 4));
    assert!(of("same")["result"] == "equal" && of("moved")["result"] == "different");
    assert!(of("gone")["only_in"] == "one" && of("new")["only_in"] == "two");
    assert_eq!(
        sandbox.files().iter().filter(|file| file.starts_with("apart/")).collect::<Vec<_>>(),
        ["apart/moved.png"]
    );
    let page = String::from_utf8(sandbox.read("page.html")).unwrap();
    assert!(page.contains("3 pictures differ") && page.contains("moved.png") && !page.contains("same.png"));
    let text = sandbox.anim("diff one two");
    assert!(text.code == 1 && text.stdout.contains("1 equal, 1 different, 2 only in one folder"), "{}", text.stdout);
    sandbox.anim("diff one one").ok();
    std::fs::create_dir(sandbox.path("empty")).unwrap();
    sandbox.anim("diff empty empty").fails(3, &["no pictures"]);
}

#[test]
fn damaged_files_are_answered_and_never_equal() {
    let sandbox = sandbox();
    sandbox.anim("a.ron -o a.exr").ok();
    sandbox.anim("a.ron -o a.png").ok();
    for name in ["a.exr", "a.png"] {
        let whole = sandbox.read(name);
        sandbox.write("cut.x", &whole[..whole.len() / 2]);
        let run = sandbox.anim(&format!("diff {name} cut.x"));
        assert!(run.code != 0 && run.code != 1 && run.stderr.contains("cut.x"), "{}\n{}", run.code, run.stderr);
        assert!(!run.stderr.contains("panicked"));
    }
    sandbox.anim("diff a.png nowhere.png").fails(5, &["nowhere.png"]);
}
