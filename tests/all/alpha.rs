//! Pictures without what lies around the scene: laid over it again, they are the pictures with it.

use anim::components::{Filter, Integrator, Render};
use anim::load;
use anim::output::read_layered;

use crate::tool::{Sandbox, film};

const SCENE: &str = r#"(
    camera: (from: (0.0, 1.5, 6.0), at: (0.0, 0.8, 0.0), fov: 30.0, aperture: 0.05),
    render: (size: (24, 18), samples: 16, background: (0.2, 0.3, 0.9), photons: 2000, max_depth: 5),
    materials: { "gloss": (color: (0.8, 0.3, 0.2), specular: 0.5), "glass": (model: Dielectric, ior: 1.5),
        "leaf": (model: Lambert, color: (0.2, 0.7, 0.1), opacity: 0.5) },
    entities: [
        (sphere: (), transform: (translation: (-0.8, 1.0, 0.0)), material: "gloss"),
        (sphere: (radius: 0.6), transform: (translation: (0.8, 1.2, 0.5)), material: "glass"),
        (aabox: (), transform: (translation: (0.9, 0.4, -1.0), rotation: (0.0, 30.0, 0.0)), material: "leaf"),
        (point_light: (position: (2.0, 4.0, 3.0))),
    ],
)"#;

#[test]
fn over_its_background_a_transparent_picture_is_the_opaque_one() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", SCENE);
    let (scene, _) = load::load_scene(&sandbox.path("scene.ron"), false).unwrap();
    let base = Render { seed: Some(3), ..scene.render.clone() };
    let sky = scene.render.background.as_vec3();
    for integrator in [Integrator::Distribution, Integrator::Path, Integrator::Photon] {
        for filter in [Filter::Box, Filter::Mitchell] {
            let opaque = Render { integrator, filter, ..base.clone() };
            let transparent = film(&scene, Render { transparent: true, ..opaque.clone() });
            let expected = film(&scene, opaque);
            let alphas: Vec<f32> = (0..expected.pixels.len()).map(|i| transparent.alpha(i)).collect();
            assert!(alphas.contains(&0.0) && alphas.contains(&1.0) && alphas.iter().any(|a| *a > 0.2 && *a < 0.8));
            for (i, expected) in expected.pixels.iter().enumerate() {
                for k in 0..3 {
                    let over = transparent.pixels[i][k] + (1.0 - alphas[i]) * sky[k];
                    let off = (over - expected[k]).abs();
                    assert!(off < 1e-5, "{integrator:?} {filter:?} {i}: {over} {}", expected[k]);
                }
            }
        }
    }
}

#[test]
fn files_hold_alpha_as_their_format_has_it() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", SCENE);
    let script = "animation(#{ scene: \"scene.ron\", frames: 1 });\nfn setup(s) { s.render.transparent = true; s.render.transfer = \"Linear\"; }\nfn frame(s, f) {}\n";
    sandbox.write("s.rhai", script);
    sandbox.anim("s.rhai -o deep.####.png --depth 16").ok();
    sandbox.anim("s.rhai -o f.####.png").ok();
    sandbox.anim("s.rhai -o f.####.exr").ok();
    let channel = |file: &str, name: &str| -> Vec<f64> {
        let picture = read_layered(&sandbox.read(file)).unwrap();
        let found = picture.parts[0].channels.iter().find(|channel| channel.name == name);
        let samples = &found.unwrap_or_else(|| panic!("{file} has no {name}")).samples;
        (0..samples.len()).map(|i| samples.get(i)).collect()
    };
    let (alpha, red) = (channel("f.0001.exr", "A"), channel("f.0001.exr", "R"));
    for (file, step) in [("f.0001.png", 1.0 / 255.0), ("deep.0001.png", 1e-3)] {
        let (straight_alpha, straight) = (channel(file, "A"), channel(file, "R"));
        for i in 0..alpha.len() {
            assert!((alpha[i] - straight_alpha[i]).abs() < step, "{file} {i}");
            // Multiplied again, colours are those of the linear file.
            assert!((red[i].min(alpha[i]) - straight[i] * alpha[i]).abs() < 1.5 * step, "{file} {i}");
        }
    }
    // The digest among the metadata is that of the pixels with their alpha: the frame counts as done.
    let plan = sandbox.anim("plan s.rhai -o f.####.png --json --exit-code").ok().stdout;
    assert!(plan.contains("\"done\""), "{plan}");
    sandbox.anim("diff f.0001.png f.0001.png").ok();
    // Where nothing stands, the picture lets all through.
    assert_eq!(alpha[0], 0.0);
}
