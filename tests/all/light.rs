//! Light whose truth is known: furnaces, lamps over a floor, glass, and ways of sampling that must agree.

use crate::tool::{Sandbox, mean, picture};

/// A floor seen from above by a narrow camera, and what lights it.
fn floor(render: &str, light: &str) -> String {
    format!(
        r#"(
        camera: (from: (3.0, 3.0, 0.0), at: (0.0, 0.0, 0.0), fov: 0.5),
        render: (size: (8, 8), transfer: Linear, {render}),
        materials: {{
            "matt": (model: Lambert, color: (0.5, 0.5, 0.5)),
            "lamp": (model: Lambert, color: (0.0, 0.0, 0.0), emission: (1.5, 1.5, 1.5)),
        }},
        entities: [(plane: (), material: "matt"), {light}],
    )"#
    )
}

#[test]
fn a_white_thing_in_uniform_light_cannot_be_seen() {
    for material in [
        "model: Lambert, color: (1, 1, 1)",
        "model: Conductor, color: (1, 1, 1), roughness: 0.1",
        "model: Conductor, color: (1, 1, 1), roughness: 0.7",
        "model: Dielectric, ior: 1.5",
        "model: Dielectric, ior: 1.5, roughness: 0.5",
        "model: Plastic, color: (1, 1, 1), ior: 1.5, roughness: 0.4",
        "color: (1, 1, 1), diffuse: 0, transmission: 1, ior: 1.5",
    ] {
        let scene = format!(
            r#"(
            camera: (from: (0.0, 0.0, 3.0), at: (0.0, 0.0, 0.0), fov: 38.0),
            render: (size: (12, 12), samples: 64, integrator: Path, max_depth: 32, transfer: Linear, background: (0.5, 0.5, 0.5)),
            materials: {{ "m": ({material}) }},
            entities: [(sphere: (), material: "m")],
        )"#
        );
        let found = mean(&picture(&Sandbox::new(), &scene, ""));
        // Ground surfaces are as exact as the tables of what their facets lose.
        assert!((found - 0.5).abs() < 0.01, "{material}: {found}");
    }
}

/// A transparent sphere of negative radius is a bubble in its material: no light is lost at it, wherever it is seen from.
#[test]
fn bubbles_of_glass_lose_no_light() {
    let bubble = "(sphere: (radius: -0.8), material: \"m\")";
    let egg = "(sphere: (radius: -1), transform: (scale: (0.8, 0.6, 0.7)), material: \"m\")";
    let hollow = format!("(sphere: (), material: \"m\"), {bubble}");
    for (entities, material) in [
        (bubble, "model: Dielectric, ior: 1.5"),
        (egg, "model: Dielectric, ior: 1.5"),
        (&hollow, "model: Dielectric, ior: 1.5"),
        (&hollow, "color: (1, 1, 1), diffuse: 0, transmission: 1, ior: 1.5"),
    ] {
        let scene = format!(
            r#"(
            camera: (from: (0.2, 0.4, 4.0), at: (0.0, 0.0, 0.0), fov: 38.0),
            render: (size: (12, 12), samples: 16, integrator: Path, max_depth: 64, transfer: Linear, background: (0.5, 0.5, 0.5)),
            materials: {{ "m": ({material}) }},
            entities: [{entities}],
        )"#
        );
        let picture = picture(&Sandbox::new(), &scene, "");
        for (x, y, pixel) in picture.enumerate_pixels() {
            assert!((pixel.0[0] - 0.5).abs() < 0.02, "{entities}, {material}: ({x}, {y}) {:?}", pixel.0);
        }
    }
}

/// In a closed box whose walls shine by E and give back the share a, radiance is E / (1 - a) everywhere.
#[test]
fn a_closed_furnace_reaches_its_balance() {
    let scene = r#"(
        camera: (from: (0.1, 0.2, 0.3), at: (1.0, 0.3, 0.0), fov: 60.0),
        render: (size: (12, 12), samples: 64, integrator: Path, max_depth: 40, transfer: Linear),
        materials: {
            "wall": (model: Lambert, color: (0.5, 0.5, 0.5), emission: (0.2, 0.2, 0.2)),
            "ball": (model: Plastic, color: (1, 1, 1), ior: 1.5),
        },
        entities: [
            (sphere: (radius: 4.0), material: "wall"),
            (sphere: (center: (2.0, 0.3, 0.0), radius: 0.5), material: "ball"),
        ],
    )"#;
    let found = mean(&picture(&Sandbox::new(), scene, ""));
    assert!((found - 0.4).abs() < 0.008, "{found}");
}

/// Irradiance of a sphere is pi L (r / d)^2 and that of a wide square lamp Siegel and Howell's; both integrators.
#[test]
fn lamps_over_a_floor_have_their_analytic_irradiance() {
    // Radiance 1.5, radius 0.5 at height 2; albedo 0.5 over pi.
    let sphere = 0.5 * 1.5 * (0.5f32 / 2.0) * (0.5 / 2.0);
    let (a, r) = (0.5f32, (1.0f32 + 0.25).sqrt());
    let rectangle = 4.0 * 0.5 * 2.0 * (a / r * (a / r).atan());
    // Of colour 0.3: radiance 0.3 pi / area.
    let square = 0.5 * 0.3 / 4.0 * rectangle;
    let ball = r#"(sphere: (center: (0.0, 2.0, 0.0), radius: 0.5), material: "lamp")"#;
    let egg =
        r#"(sphere: (radius: 0.5), transform: (translation: (0, 2, 0), scale: (1, 1, 1.0001)), material: "lamp")"#;
    let lamp =
        "(area_light: (position: (0.0, 2.0, 0.0), size: (2.0, 2.0), color: (0.3, 0.3, 0.3), falloff: InverseSquare))";
    let path = "integrator: Path, max_depth: 2, samples: 256";
    let distribution = "integrator: Distribution, max_depth: 2, samples: 256";
    for (name, render, light, expected, tolerance) in [
        ("sphere", path, ball, sphere, 0.01),
        ("sphere, distribution", distribution, ball, sphere, 0.01),
        ("square", path, lamp, square, 0.01),
        // Not sampled: only rays that happen to meet it bring its light.
        ("ellipsoid", path, egg, sphere, 0.08),
    ] {
        let found = mean(&picture(&Sandbox::new(), &floor(render, light), ""));
        assert!((found / expected - 1.0).abs() < tolerance, "{name}: {found} {expected}");
    }
}

/// A slab of coloured glass before a uniform sky: what is reflected and let through, all bounces within summed up.
#[test]
fn glass_swallows_light_by_beers_law() {
    let scene = |integrator: &str, model: &str| {
        format!(
            r#"(
            camera: (from: (0.0, 0.0, 5.0), at: (0.0, 0.0, 0.0), fov: 0.1),
            render: (size: (8, 8), samples: 256, integrator: {integrator}, max_depth: 12, transfer: Linear, background: (0.5, 0.5, 0.5)),
            materials: {{ "g": ({model}, ior: 1.5, absorption: (0.0, 0.5, 2.0)) }},
            entities: [(aabox: (min: (-9.0, -9.0, 0.0), max: (9.0, 9.0, 1.0)), material: "g")],
        )"#
        )
    };
    for integrator in ["Path", "Whitted"] {
        for model in ["model: Dielectric", "diffuse: 0, transmission: 1"] {
            let picture = picture(&Sandbox::new(), &scene(integrator, model), "");
            for (channel, absorption) in [0.0f32, 0.5, 2.0].into_iter().enumerate() {
                let (r, a) = (0.04f32, (-absorption).exp());
                let round = 1.0 - r * r * a * a;
                let expected = 0.5 * (r + (1.0 - r) * (1.0 - r) * (r * a * a + a) / round);
                let found = picture.pixels().map(|p| p.0[channel]).sum::<f32>() / 64.0;
                assert!((found - expected).abs() < 0.008, "{integrator} {model} {channel}: {found} {expected}");
            }
        }
    }
}

/// A lamp above a mirror, found by rays, and above ground metal, found both ways: errors shrink as samples grow.
#[test]
fn errors_fall_as_samples_grow() {
    let scene = |samples: u32| {
        format!(
            r#"(
            camera: (from: (0.0, 2.0, 4.0), at: (0.0, 0.5, 0.0), fov: 40.0),
            render: (size: (16, 16), samples: {samples}, integrator: Path, max_depth: 4, transfer: Linear, seed: 1),
            materials: {{
                "matt": (model: Lambert, color: (0.5, 0.5, 0.5)),
                "metal": (model: Conductor, color: (0.9, 0.8, 0.7), roughness: 0.4),
                "lamp": (model: Lambert, color: (0.0, 0.0, 0.0), emission: (0.9, 0.9, 0.9)),
            }},
            entities: [
                (plane: (), material: "matt"),
                (sphere: (center: (0.0, 0.7, 0.0), radius: 0.7), material: "metal"),
                (aabox: (min: (-1.0, 2.5, -1.0), max: (1.0, 2.6, 1.0)), material: "lamp"),
            ],
        )"#
        )
    };
    let sandbox = Sandbox::new();
    let truth = picture(&sandbox, &scene(576), "--seed 2");
    let error = |samples: u32| {
        let found = picture(&sandbox, &scene(samples), "");
        let squares = found.pixels().zip(truth.pixels()).map(|(a, b)| (a.0[0] - b.0[0]).powi(2));
        (squares.sum::<f32>() / 256.0).sqrt()
    };
    let (few, many) = (error(4), error(64));
    // A quarter for sixteen times as many; the reference errs too.
    assert!(many < 0.35 * few && few < 0.2, "{few} {many}");
}

/// Every model under every integrator, with lamps that do not fall off and lamps that are out.
#[test]
fn every_integrator_draws_every_model() {
    for integrator in ["Whitted", "Distribution", "Path"] {
        for model in ["BlinnPhong", "Lambert", "Conductor", "Dielectric", "Plastic"] {
            let scene = format!(
                r#"(
                camera: (from: (0.0, 0.0, 3.0), at: (0.0, 0.0, 0.0), fov: 30.0),
                render: (size: (8, 8), samples: 16, integrator: {integrator}, transfer: Linear, background: (0.1, 0.1, 0.1)),
                materials: {{ "m": (model: {model}, color: (0.8, 0.5, 0.3), roughness: 0.3, ior: 1.5, emission: (0.05, 0.05, 0.05)) }},
                entities: [
                    (sphere: (), material: "m"),
                    (point_light: (position: (2.0, 3.0, 3.0), color: (0.4, 0.4, 0.4))),
                    (area_light: (position: (-2.0, 3.0, 3.0), size: (0.01, 1.0), falloff: InverseSquare)),
                    (area_light: (position: (-2.0, 3.0, 3.0), size: (0.2, 0.2), color: (0.0, 0.0, 0.0))),
                ],
            )"#
            );
            let found = mean(&picture(&Sandbox::new(), &scene, ""));
            assert!(found > 0.06 && found < 0.9, "{integrator} {model}: {found}");
        }
    }
}

#[test]
fn lamps_without_area_are_refused_with_their_place() {
    let sandbox = Sandbox::new();
    for (light, place) in [("size: (0, 1)", "a.ron:1:33: "), ("edges: ((1, 0, 0), (2, 0, 0))", "a.ron:1:34: ")] {
        sandbox.write("a.ron", format!("(entities: [(area_light: ({light}))])"));
        sandbox.anim("check a.ron").fails(3, &[place, "must span an area", "`point_light`"]);
    }
}

#[test]
fn impossible_materials_are_refused_with_their_place() {
    for (material, words) in [
        ("model: Conductor, roughness: 1.5", "`roughness` must be from 0 to 1"),
        ("model: Lambert, color: (1.2, 1, 1)", "`color` must be at most 1"),
        ("model: Plastic, ior: 1.0", "`ior` of a `Plastic` must be above 0 and not 1"),
        ("model: Conductor, eta: (1, 1, 1)", "`eta` of a `Conductor` needs `k` beside it"),
        ("emission: (-1, 0, 0)", "`emission` must be at least 0"),
        ("model: Lambart", "Lambert"),
    ] {
        let sandbox = Sandbox::new();
        sandbox.write("scene.ron", format!("(\n  materials: {{ \"m\": ({material}) }},\n)"));
        let run = sandbox.anim("check scene.ron");
        assert_eq!(run.code, 3, "{material}");
        assert!(run.stderr.contains(words) && run.stderr.contains("scene.ron:2:"), "{material}: {}", run.stderr);
    }
}

/// A lens of glass in front of others splits every ray at every surface: depth alone never ends that.
#[test]
fn rays_too_faint_to_show_are_not_followed() {
    let glass = |x: f32, z: f32| {
        format!("(sphere: (radius: 0.9), transform: (translation: ({x:.1}, 0.0, {z:.1})), material: \"glass\"),")
    };
    let balls: String = [(-1.0, 0.0), (1.0, 0.0), (0.0, 1.6), (0.0, -1.6)].map(|(x, z)| glass(x, z)).concat();
    let scene = |least: &str| {
        format!(
            r#"(
            camera: (from: (0.0, 0.5, 6.0), at: (0.0, 0.0, 0.0)),
            render: (size: (24, 16), samples: 1, background: (1.0, 1.0, 1.0), transfer: Linear, bit_depth: 16, {least}),
            materials: {{ "glass": (diffuse: 0.0, transmission: 0.98, ior: 1.5) }},
            entities: [{balls}],
        )"#
        )
    };
    let rays = |sandbox: &Sandbox, least: &str, depth: u32| {
        let text = scene(least).replace("samples: 1,", &format!("samples: 1, max_depth: {depth},"));
        sandbox.write("scene.ron", text);
        let run = sandbox.anim(&format!("scene.ron -o {depth}.png --force --stats json")).ok();
        let stats: serde_json::Value = serde_json::from_str(run.stdout.lines().next().unwrap()).unwrap();
        let count = ["refraction_rays", "reflection_rays"].map(|key| stats[key].as_u64().unwrap()).iter().sum::<u64>();
        (count, image::load_from_memory(&sandbox.read(&format!("{depth}.png"))).unwrap().to_rgb32f())
    };
    const FAINT: &str = "min_weight: 0.00002";
    let sandbox = Sandbox::new();
    let ((shallow, faint), (deep, _)) = (rays(&sandbox, FAINT, 12), rays(&sandbox, FAINT, 64));
    assert!(deep <= 2 * shallow, "{deep} rays at depth 64, {shallow} at depth 12");
    let ((all, whole), (more, _)) = (rays(&sandbox, "", 12), rays(&sandbox, "", 16));
    assert!(more > 2 * all && all > 2 * shallow, "{more} of all rays, {all} of those at depth 12, {shallow} followed");
    // What is left out does not show: less than half a step of a screen.
    let far = faint.pixels().zip(whole.pixels()).flat_map(|(a, b)| (0..3).map(move |c| (a[c] - b[c]).abs()));
    assert!(far.fold(0.0, f32::max) < 0.5 / 255.0);
}
