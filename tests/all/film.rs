//! The film: filters against exact integrals, linear values and layers in EXR files, rounds of samples, denoising.

use anim::compare::{Picture, difference};
use exr::prelude::read_all_data_from_file;

use crate::tool::Sandbox;

/// A white wall left of x = 0, seen straight on, before nothing at all.
fn edge(film: &str) -> String {
    format!(
        "(camera: (from: (0.0, 0.0, 8.0), at: (0.0, 0.0, 0.0), fov: 90.0),
          render: (size: (16, 16), samples: 256, background: (0.5, 0.5, 0.5), {film}),
          entities: [(aabox: (min: (0.0, -90.0, -1.0), max: (90.0, 90.0, 0.0)))])"
    )
}

fn colors(sandbox: &Sandbox, scene: &str, arguments: &str) -> Picture {
    sandbox.write("scene.ron", scene);
    sandbox.anim(&format!("scene.ron -o out.exr --depth 32 {arguments}")).ok();
    Picture::read(&sandbox.path("out.exr")).unwrap()
}

/// Filters as they are published, across half of their width from 0 to 1, times any constant.
fn published(filter: &str, x: f64) -> f64 {
    match filter {
        "Box" => 1.0,
        "Tent" => 1.0 - x,
        "Gaussian" => (-4.5 * x * x).exp() - (-4.5f64).exp(),
        "Mitchell" => {
            let (b, c, x) = (1.0 / 3.0, 1.0 / 3.0, 2.0 * x);
            if x < 1.0 {
                (12.0 - 9.0 * b - 6.0 * c) * x.powi(3) + (12.0 * b + 6.0 * c - 18.0) * x * x + 6.0 - 2.0 * b
            } else {
                (-b - 6.0 * c) * x.powi(3) + (6.0 * b + 30.0 * c) * x * x - (12.0 * b + 48.0 * c) * x
                    + 8.0 * b
                    + 24.0 * c
            }
        }
        _ => {
            let t = std::f64::consts::PI * (x + 1.0);
            0.35875 - 0.48829 * t.cos() + 0.14128 * (2.0 * t).cos() - 0.01168 * (3.0 * t).cos()
        }
    }
}

/// Share of a filter's mass left of a place, in pixels from its centre.
fn share(filter: &str, width: f64, place: f64) -> f64 {
    let n = 20_000;
    let (mut left, mut all) = (0.0, 0.0);
    for i in 0..n {
        let x = (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
        let value = published(filter, x.abs());
        all += value;
        left += if x * width / 2.0 < place { value } else { 0.0 };
    }
    left / all
}

#[test]
fn an_edge_is_filtered_as_its_integral_says() {
    let sandbox = Sandbox::new();
    for (filter, width) in
        [("Box", 1.0), ("Box", 2.5), ("Tent", 2.0), ("Gaussian", 3.0), ("Mitchell", 4.0), ("BlackmanHarris", 3.0)]
    {
        let picture = colors(&sandbox, &edge(&format!("filter: {filter}, filter_width: {width:?}")), "");
        for x in 4..12 {
            let column = (0..16).map(|y| f64::from(picture.pixels[y * 16 + x][0])).sum::<f64>() / 16.0;
            let expected = 0.5 * share(filter, width, 8.0 - (x as f64 + 0.5));
            assert!((column - expected).abs() < 0.004, "{filter} {width} {x}: {column} {expected}");
        }
    }
}

const STILL: &str = r#"(
    camera: (from: (0.0, 2.0, 0.0), at: (0.0, 0.0, 0.0), up: (0.0, 0.0, -1.0), fov: 90.0),
    render: (size: (32, 24), samples: 16, background: (0.0, 0.0, 4.0)),
    materials: { "red": (color: (0.5, 0.1, 0.1), specular: 0.25), "lit": (color: (0.5, 0.5, 0.5)) },
    entities: [
        (aabox: (min: (-9.0, -2.0, -9.0), max: (0.0, -1.0, 9.0)), material: "lit"),
        (sphere: (radius: 0.5), transform: (translation: (0.5, 0.0, 0.0)), material: "red"),
        (point_light: (position: (-1.0, 3.0, 0.0), color: (30.0, 30.0, 30.0))),
    ],
)"#;

/// Channel values of an EXR file by name.
fn channel(sandbox: &Sandbox, file: &str, name: &str) -> Vec<f32> {
    let image = read_all_data_from_file(sandbox.path(file)).unwrap();
    let list = &image.layer_data[0].channel_data.list;
    let found = list.iter().find(|c| c.name.eq(name)).unwrap_or_else(|| panic!("{name}"));
    found.sample_data.levels_as_slice()[0].values_as_f32().collect()
}

#[test]
fn layers_say_what_the_camera_sees() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STILL);
    sandbox.anim("a.ron -o a.exr --aovs depth,normal,albedo,position,entity,material,variance").ok();
    let at = |name: &str, x: usize, y: usize| channel(&sandbox, "a.exr", name)[y * 32 + x];
    // The box, two below the camera's 2; its top is met straight on, at depth 3.
    assert!((at("Z", 4, 12) - 3.0).abs() < 1e-5);
    assert!((at("P.Y", 4, 12) + 1.0).abs() < 1e-5 && at("P.X", 4, 12) < -1.0);
    assert!((at("N.Y", 4, 12) - 1.0).abs() < 1e-6);
    assert_eq!((at("entityId", 4, 12), at("materialId", 4, 12)), (1.0, 2.0));
    assert!((at("albedo.R", 4, 12) - 0.5).abs() < 1e-6);
    // The sphere: nearer, and with its mirror colour in the albedo.
    assert!(at("Z", 19, 12) < 2.0 && at("Z", 19, 12) > 1.5);
    assert_eq!((at("entityId", 19, 12), at("materialId", 19, 12)), (2.0, 1.0));
    assert!((at("albedo.R", 19, 12) - 0.75).abs() < 1e-6);
    // Nothing.
    assert_eq!(
        (at("Z", 30, 12), at("entityId", 30, 12), at("N.Y", 30, 12), at("variance", 30, 12)),
        (1e10, 0.0, 0.0, 0.0)
    );
    assert_eq!(at("B", 30, 12), 4.0);
    // Light is linear and of any size: 30 on half a grey, right below the lamp.
    let picture = Picture::read(&sandbox.path("a.exr")).unwrap();
    assert!(picture.pixels.iter().any(|p| p[0] > 14.0), "nothing is brighter than the screen");
}

#[test]
fn exr_files_are_the_same_everywhere_and_can_be_looked_at() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STILL);
    let flags = "--aovs depth,entity,variance --integrator path --denoise";
    sandbox.anim(&format!("a.ron -o one.exr --threads 1 {flags}")).ok();
    sandbox.anim(&format!("a.ron -o two.exr --threads 3 --accel brute {flags}")).ok();
    assert_eq!(sandbox.read("one.exr"), sandbox.read("two.exr"));
    let said = sandbox.anim("info one.exr").ok().stdout;
    for word in ["32x24", "Software: anim", "Source: a.ron", "denoise=true", "B G R Z entityId variance"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    sandbox.anim("diff one.exr two.exr").ok();
    sandbox.anim("a.ron -o three.exr --depth 32").ok();
    assert_eq!(sandbox.anim("diff one.exr three.exr").code, 1);
    sandbox.write("cut.exr", &sandbox.read("one.exr")[..200]);
    sandbox.anim("info cut.exr").fails(3, &["cut.exr"]);
    sandbox.anim("diff cut.exr one.exr").fails(3, &["cut.exr"]);
    sandbox.anim("diff . none").fails(5, &["cannot read none"]);
}

#[test]
fn a_png_that_should_hold_layers_is_refused_before_anything_is_rendered() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", "(render: (size: (4, 4), samples: 1, aovs: [Depth]))");
    sandbox.anim("a.ron -o a.png").fails(2, &["Depth", "a.exr", "--aovs none"]);
    assert_eq!(sandbox.files(), ["a.ron"]);
    sandbox.anim("a.ron -o a.png --aovs none").ok();
    sandbox.anim("a.ron -o b.png --aovs none --depth 32").fails(2, &["32", "b.exr"]);
    sandbox.anim("a.ron -o b.exr --aovs depht").fails(2, &["depth"]);
    sandbox.write("b.ron", "(render: (aovs: [Dept]))");
    sandbox.anim("b.ron -o b.exr").fails(3, &["b.ron:1:", "Dept"]);
}

#[test]
fn samples_go_where_noise_is_and_nowhere_else() {
    let sandbox = Sandbox::new();
    let scene = STILL.replace("samples: 16", "samples: 256, noise_threshold: 0.02");
    sandbox.write("a.ron", scene);
    let render = |out: &str, flags: &str| -> u64 {
        let run = sandbox.anim(&format!("a.ron -o {out} --stats json --integrator path {flags}")).ok();
        let stats: serde_json::Value = serde_json::from_str(run.stdout.lines().next().unwrap()).unwrap();
        stats["primary_rays"].as_u64().unwrap()
    };
    let rays = render("one.png", "--threads 1");
    assert_eq!(render("two.png", "--threads 3 --accel grid"), rays);
    assert_eq!(sandbox.read("one.png"), sandbox.read("two.png"));
    // Nothing lies in the right third: sixteen samples there, and nowhere more than 256.
    let pixels = 32 * 24;
    assert!(rays > 20 * pixels && rays < 128 * pixels, "{rays}");
}

/// A room lit by a lamp at its ceiling, open to the camera.
const ROOM: &str = r#"(
    camera: (from: (0.0, 1.0, 3.4), at: (0.0, 1.0, 0.0), fov: 40.0),
    render: (size: (48, 48), integrator: Path, max_depth: 3, seed: 1),
    materials: {
        "white": (color: (0.7, 0.7, 0.7)), "red": (color: (0.6, 0.1, 0.1)), "green": (color: (0.1, 0.5, 0.1)),
    },
    entities: [
        (aabox: (min: (-1.0, -0.1, -1.0), max: (1.0, 0.0, 1.0)), material: "white"),
        (aabox: (min: (-1.0, 2.0, -1.0), max: (1.0, 2.1, 1.0)), material: "white"),
        (aabox: (min: (-1.0, 0.0, -1.1), max: (1.0, 2.0, -1.0)), material: "white"),
        (aabox: (min: (-1.1, 0.0, -1.0), max: (-1.0, 2.0, 1.0)), material: "red"),
        (aabox: (min: (1.0, 0.0, -1.0), max: (1.1, 2.0, 1.0)), material: "green"),
        (aabox: (min: (-0.6, 0.0, -0.6), max: (-0.1, 1.1, -0.1)), material: "white"),
        (sphere: (radius: 0.35), transform: (translation: (0.4, 0.35, 0.2)), material: "white"),
        (area_light: (size: (0.5, 0.5), color: (1.5, 1.4, 1.2)), transform: (translation: (0.0, 1.95, 0.0))),
    ],
)"#;

#[test]
fn denoising_comes_nearer_to_the_truth() {
    let sandbox = Sandbox::new();
    let truth = colors(&sandbox, ROOM, "--spp 144 --seed 2");
    let error = |flags: &str| difference(&colors(&sandbox, ROOM, flags), &truth).unwrap().rmse;
    for samples in [4, 9] {
        let (raw, denoised) = (error(&format!("--spp {samples}")), error(&format!("--spp {samples} --denoise")));
        assert!(denoised < 0.6 * raw, "{samples}: {raw} {denoised}");
    }
}
