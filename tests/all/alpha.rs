//! Pictures without what lies around the scene, or without its floor: laid over it again, they are the pictures with it.

use anim::components::{Filter, Integrator, Render, Scene};
use anim::film::Film;
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

/// Looks down on a floor on which things stand, of which one is mirror and one glass; out of sight hangs a leaf.
const FLOOR: &str = r#"(
    camera: (from: (0.5, 6.0, 4.0), at: (0.0, 0.0, 0.0), fov: 30.0, aperture: 0.05),
    render: (size: (32, 24), samples: 16, background: (0.4, 0.4, 0.4), max_depth: 5, seed: 3),
    materials: { "floor": (model: Lambert, color: (0.5, 0.5, 0.5)), "mirror": (color: (0.3, 0.3, 0.3), specular: 0.6),
        "glass": (model: Dielectric, ior: 1.5), "leaf": (model: Lambert, color: (0.4, 0.4, 0.4), opacity: 0.5) },
    entities: [
        (name: "floor", plane: (), material: "floor"),
        (name: "ball", sphere: (radius: 0.5), transform: (translation: (-0.8, 0.5, 0.0)), material: "mirror"),
        (sphere: (radius: 0.4), transform: (translation: (0.5, 0.4, 0.6)), material: "glass"),
        (aabox: (min: (-2.2, 2.4, 0.1), max: (-1.6, 2.6, 0.7)), material: "leaf"),
        (area_light: (size: (1.0, 1.0), color: (0.8, 0.8, 0.8)), transform: (translation: (1.0, 4.0, -2.0))),
        (point_light: (position: (-3.0, 4.0, 1.0), color: (0.3, 0.3, 0.3))),
    ],
)"#;

/// The scene, as it is with a floor that catches shadows, and without the things that stand there.
fn floors() -> [Scene; 3] {
    let sandbox = Sandbox::new();
    let load = |name: &str, text: &str| {
        sandbox.write(name, text);
        load::load_scene(&sandbox.path(name), false).unwrap().0
    };
    let catching = FLOOR.replace("\"floor\": (", "\"floor\": (shadow_catcher: true, ");
    let mut plate = load("scene.ron", FLOOR);
    let scene = plate.clone();
    plate.entities.retain(|entity| {
        entity.get(anim::components::Kind::Sphere).or(entity.get(anim::components::Kind::AABox)).is_none()
    });
    [scene, load("catching.ron", &catching), plate]
}

fn over(picture: &Film, plate: &Film, pixel: usize) -> [f32; 3] {
    [0, 1, 2].map(|k| picture.pixels[pixel][k] + (1.0 - picture.alpha(pixel)) * plate.pixels[pixel][k])
}

#[test]
fn caught_shadows_over_the_plate_are_those_on_the_floor() {
    let [scene, catching, plate] = floors();
    for integrator in [Integrator::Whitted, Integrator::Distribution, Integrator::Path] {
        for filter in [Filter::Box, Filter::Mitchell] {
            let opaque = Render { integrator, filter, ..scene.render.clone() };
            let transparent = Render { transparent: true, ..opaque.clone() };
            let things = film(&Scene { entities: scene.entities[1..].to_vec(), ..scene.clone() }, transparent.clone());
            let (expected, plate) = (film(&scene, opaque.clone()), film(&plate, opaque.clone()));
            let caught = film(&catching, transparent);
            let (mut shadows, mut sum) = (0, 0.0);
            for i in 0..expected.pixels.len() {
                let found = over(&caught, &plate, i);
                // A filter with negative lobes makes the floor beside a shadow brighter, which no alpha can.
                let expected =
                    [0, 1, 2].map(|k| expected.pixels[i][k].min(plate.pixels[i][k].max(caught.pixels[i][k])));
                let off = (0..3).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f32::max);
                sum += off;
                // At outlines, what is laid over each other is only near to what was seen together.
                if things.alpha(i) == 0.0 {
                    shadows += u32::from(caught.alpha(i) > 0.2);
                    // The floor gets light back from things, but is never brighter for it here than without them.
                    assert!(off < 2e-3 * expected[0].max(0.1), "{integrator:?} {filter:?} {i}: {found:?} {expected:?}");
                    assert!(caught.pixels[i] == [0.0; 3], "{integrator:?} {filter:?} {i}: {:?}", caught.pixels[i]);
                }
            }
            assert!(shadows > 30, "{integrator:?}: {shadows}");
            assert!(sum / (expected.pixels.len() as f32) < 0.02, "{integrator:?} {filter:?}: {sum}");
        }
    }
}

#[test]
fn a_black_ball_takes_the_light_of_the_part_of_the_sky_that_it_hides() {
    // Seen from a point of the floor below its middle, a ball hides (radius / distance)^2 of what arrives.
    let text = r#"(
        camera: (from: (3.0, 1.0, 0.0), at: (0.0, 0.0, 0.0), fov: 1.0),
        render: (size: (6, 6), samples: 256, background: (0.3, 0.6, 0.9), integrator: Path, transparent: true),
        materials: { "floor": (model: Lambert, shadow_catcher: true), "black": (model: Lambert, color: (0.0, 0.0, 0.0)) },
        entities: [(plane: (), material: "floor"),
            (sphere: (radius: 1.0), transform: (translation: (0.0, 2.0, 0.0)), material: "black")],
    )"#;
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", text);
    let (scene, _) = load::load_scene(&sandbox.path("scene.ron"), false).unwrap();
    let picture = film(&scene, scene.render.clone());
    let mean = (0..36).map(|i| picture.alpha(i)).sum::<f32>() / 36.0;
    assert!((mean - 0.25).abs() < 3e-3, "{mean}");
    // Before its surroundings the same floor shows what lies behind it, darkened.
    let opaque = film(&scene, Render { transparent: false, ..scene.render.clone() });
    for (i, color) in opaque.pixels.iter().enumerate() {
        let left = 1.0 - picture.alpha(i);
        assert!(color.iter().zip([0.3, 0.6, 0.9]).all(|(x, sky)| (x - sky * left).abs() < 1e-4), "{i}: {color:?}");
    }
    // Without noise it is the same on average, and smoother.
    let clean = film(&scene, Render { denoise: true, samples: 16, ..scene.render.clone() });
    let noisy = film(&scene, Render { samples: 16, ..scene.render.clone() });
    let error = |film: &Film| (0..36).map(|i| (film.alpha(i) - 0.25).powi(2)).sum::<f32>();
    assert!(error(&clean) < 0.7 * error(&noisy), "{} {}", error(&clean), error(&noisy));
}

#[test]
fn caught_shadows_are_the_same_however_they_are_found() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "s.ron",
        FLOOR.replace("\"floor\": (", "\"floor\": (shadow_catcher: true, ").replace("seed: 3", "transparent: true"),
    );
    let script = "animation(#{ scene: \"s.ron\", frames: 3 });\nfn frame(s, f) { s.get(\"ball\").translation = [-0.8, 0.5 + f.t, 0.0]; }\n";
    sandbox.write("s.rhai", script);
    sandbox.anim("s.rhai -o a.##.exr --integrator path").ok();
    for (i, how) in ["--accel grid", "--accel brute --threads 1", "--frames 3 --force"].into_iter().enumerate() {
        sandbox.anim(&format!("s.rhai -o b{i}.##.exr --integrator path {how}")).ok();
        sandbox.anim(&format!("diff a.03.exr b{i}.03.exr")).ok();
    }
    sandbox.anim_with(&[("ANIM_SIMD", "sse2")], "s.rhai -o c.##.exr --integrator path").ok();
    sandbox.anim("diff a.03.exr c.03.exr").ok();
    let said = sandbox.anim("check s.rhai").ok();
    assert!(!said.stderr.contains("shadow_catcher"), "{}", said.stderr);
    sandbox.write(
        "p.ron",
        FLOOR.replace("\"floor\": (", "\"floor\": (shadow_catcher: true, ").replace("seed: 3", "integrator: Photon"),
    );
    let said = sandbox.anim("check p.ron").ok();
    assert!(said.stderr.contains("`shadow_catcher` is an ordinary surface"), "{}{}", said.stdout, said.stderr);
}
