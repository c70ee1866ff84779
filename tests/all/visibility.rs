//! Which rays meet what, what lights light, and whose shadows they throw: held to scenes without the one or the other.

use crate::tool::{Sandbox, mean, picture};

/// A floor with a mirror behind it, two balls, and lamps of every kind; `more` stands among the entities.
fn room(integrator: &str, more: &str) -> String {
    format!(
        r#"(
        camera: (from: (0.0, 3.0, 8.0), at: (0.0, 0.7, 0.0), fov: 40.0),
        render: (size: (32, 24), samples: 4, integrator: {integrator}, max_depth: 4, transfer: Linear, photons: 2000, photon_passes: 1),
        materials: {{
            "matt": (model: Lambert, color: (0.5, 0.5, 0.5)), "mirror": (color: (0.1, 0.1, 0.1), specular: 0.8),
            "red": (model: Lambert, color: (0.8, 0.1, 0.1)), "glow": (emission: (3.0, 2.5, 2.0)),
            "gold": (model: Conductor, roughness: 0.3), "black": (model: Lambert, color: (0, 0, 0)),
        }},
        entities: [
            (aabox: (min: (-6, -0.2, -4), max: (6, 0, 4)), material: "matt"),
            (aabox: (min: (-6, 0, -4.2), max: (6, 4, -4)), material: "mirror"),
            (name: "gold", tags: ["gold"], sphere: (radius: 0.6), transform: (translation: (-1.6, 0.7, 0)), material: "gold"),
            (sphere: (radius: 0.3), transform: (translation: (2.6, 2.2, -1)), material: "glow"),
            (name: "key", point_light: (position: (-3, 5, 4), color: (0.6, 0.6, 0.6))),
            (name: "area", area_light: (size: (1.5, 1.5), color: (6, 6, 6), falloff: InverseSquare),
                transform: (translation: (1, 4, 1))),
            {more}
        ],
    )"#
    )
}

const BALL: &str = r#"(name: "ball", tags: ["ball"], sphere: (radius: 0.7), transform: (translation: (0.4, 0.9, 0.6)), material: "red""#;

const INTEGRATORS: [&str; 4] = ["Whitted", "Distribution", "Path", "Photon"];

#[test]
fn what_no_ray_meets_is_not_there() {
    let sandbox = Sandbox::new();
    for integrator in INTEGRATORS {
        let without = picture(&sandbox, &room(integrator, ""), "");
        let hidden = format!("{BALL}, visible: (camera: false, shadow: false, reflection: false)),");
        let hidden = room(integrator, &hidden);
        for accel in ["bvh", "grid", "brute"] {
            let found = picture(&sandbox, &hidden, &format!("--accel {accel}"));
            assert!(found == without, "{integrator} {accel}");
        }
        assert!(picture(&sandbox, &room(integrator, &format!("{BALL}),")), "") != without);
    }
}

#[test]
fn the_camera_the_mirrors_and_the_lamps_each_miss_what_they_do_not_see() {
    let sandbox = Sandbox::new();
    let seen = |visible: &str| picture(&sandbox, &room("Whitted", &format!("{BALL}, {visible}),")), "");
    let (with, without) = (seen("visible: ()"), picture(&sandbox, &room("Whitted", ""), ""));
    let [camera, shadow, reflection] =
        ["camera", "shadow", "reflection"].map(|one| seen(&format!("visible: ({one}: false)")));
    let (mut on_ball, mut in_shadow, mut mirrored) = (0, 0, 0);
    for (x, y, p) in with.enumerate_pixels() {
        let [c, s, r, none] = [&camera, &shadow, &reflection, &without].map(|one| one.get_pixel(x, y));
        let is_red = p.0[0] > 3.0 * p.0[1];
        match (c == p, s == p, r == p) {
            // A ball in the dark before its own shadow is as black as that.
            (true, true, true) => assert!(p == none || p.0.iter().all(|x| *x < 0.03), "({x}, {y}) {p:?} {none:?}"),
            // The ball itself; what it hides shows in its place.
            (false, true, true) => on_ball += u32::from(is_red && c.0[0] < 3.0 * c.0[1]),
            (true, false, true) => in_shadow += u32::from(s == none),
            (true, true, false) => mirrored += u32::from(r == none),
            _ => {}
        }
    }
    assert!(on_ball > 8 && in_shadow > 5 && mirrored > 3, "{on_ball} {in_shadow} {mirrored}");
}

/// Light comes by samples and by rays that meet it; what throws no shadow stops neither, though rays meet it.
#[test]
fn a_body_without_a_shadow_takes_no_light() {
    let sandbox = Sandbox::new();
    let scene = |integrator: &str, light: &str, visible: &str| {
        format!(
            r#"(
            camera: (from: (0.0, 0.4, 3.0), at: (0.0, 0.0, 0.0), fov: 8.0),
            render: (size: (8, 8), samples: 256, integrator: {integrator}, max_depth: 3, transfer: Linear, seed: 3),
            materials: {{ "matt": (model: Lambert, color: (0.5, 0.5, 0.5)), "black": (model: Lambert, color: (0, 0, 0)),
                "glow": (model: Lambert, color: (0, 0, 0), emission: (4, 4, 4)) }},
            entities: [
                (plane: (), material: "matt"), {light},
                (aabox: (min: (-1.5, 1.0, -1.5), max: (1.5, 1.05, 1.5)), material: "black" {visible}),
            ],
        )"#
        )
    };
    let hidden = ", visible: (camera: false, shadow: false, reflection: false)";
    let area =
        "(area_light: (size: (2, 2), color: (3, 3, 3), falloff: InverseSquare), transform: (translation: (0, 2, 0)))";
    let glow = "(sphere: (radius: 0.7), transform: (translation: (0, 2.2, 0)), material: \"glow\")";
    for (integrator, light) in [("Path", area), ("Path", glow), ("Distribution", glow), ("Distribution", area)] {
        let expected = mean(&picture(&sandbox, &scene(integrator, light, hidden), ""));
        let found = mean(&picture(&sandbox, &scene(integrator, light, ", visible: (shadow: false)"), ""));
        let dark = mean(&picture(&sandbox, &scene(integrator, light, ""), ""));
        assert!(
            (found / expected - 1.0).abs() < 0.01 && dark < 0.5 * expected,
            "{integrator} {light}: {found} {expected}"
        );
        // A lamp without shadows lights through everything as well.
        if light == area {
            let lamp = light.replace("transform", "visible: (shadow: false), transform");
            let found = mean(&picture(&sandbox, &scene(integrator, &lamp, ""), ""));
            assert!((found / expected - 1.0).abs() < 0.01, "{integrator}: {found} {expected}");
        }
    }
}

/// With paths of one ray all light is sampled: each body shows what it would under the lamps that light it alone.
#[test]
fn lamps_light_what_they_are_linked_to() {
    let sandbox = Sandbox::new();
    for integrator in ["Whitted", "Distribution", "Path"] {
        let scene = |area: &str| {
            let scene = room(integrator, &format!("{BALL}),")).replace("max_depth: 4", "max_depth: 1");
            match area {
                "none" => scene.replace("(name: \"area\",", "(name: \"area\", light_link: (includes: [\"nobody\"]),"),
                link => scene.replace("(name: \"area\",", &format!("(name: \"area\", {link}")),
            }
        };
        let seen = |area: &str| picture(&sandbox, &scene(area), "");
        let (lit, unlit) = (seen(""), seen("none"));
        let (only, but) = (seen("light_link: (includes: [\"ball\"]),"), seen("light_link: (excludes: [\"ball\"]),"));
        let (mut of_ball, mut of_rest) = (0, 0);
        for (x, y, p) in lit.enumerate_pixels() {
            let [none, only, but] = [&unlit, &only, &but].map(|one| one.get_pixel(x, y).0);
            let p = p.0;
            // Pixels at the rim of the ball show both.
            if only != none && but == none && only == p {
                of_ball += 1;
            } else if only == none && but == p && p != none {
                of_rest += 1;
            }
            // Exact up to the rounding of sums whose parts differ.
            let sum = (0..3).map(|c| (only[c] + but[c] - none[c] - p[c]).abs()).fold(0.0, f32::max);
            assert!(sum < 1e-3, "{integrator} ({x}, {y}): {only:?} {but:?} {none:?} {p:?}");
        }
        assert!(of_ball > 4 && of_rest > 100, "{integrator}: {of_ball} {of_rest}");
    }
}

/// Rays that a surface scatters into a lamp that does not light it bring nothing home, nor do those that meet what glows.
#[test]
fn no_ray_brings_light_to_what_is_not_linked() {
    let sandbox = Sandbox::new();
    for light in [
        "(LINK area_light: (size: (2, 2), color: (3, 3, 3), falloff: InverseSquare), transform: (translation: (0, 2, 0)))",
        "(LINK sphere: (radius: 0.7), transform: (translation: (0, 2.2, 0)), material: \"glow\")",
        "(LINK cone: (), transform: (translation: (0, 1, 0)), material: \"glow\")",
    ] {
        for (material, integrator) in [("matt", "Path"), ("gold", "Path"), ("gold", "Distribution")] {
            let scene = |link: &str| {
                format!(
                    r#"(
                    camera: (from: (0.0, 0.4, 3.0), at: (0.0, 0.0, 0.0), fov: 8.0),
                    render: (size: (8, 8), samples: 64, integrator: {integrator}, max_depth: 3, transfer: Linear),
                    materials: {{ "matt": (model: Lambert), "gold": (model: Conductor, roughness: 0.5),
                        "glow": (model: Lambert, color: (0, 0, 0), emission: (4, 4, 4)) }},
                    entities: [(plane: (), tags: ["floor"], material: "{material}"), {}],
                )"#,
                    light.replace("LINK", link)
                )
            };
            let all = mean(&picture(&sandbox, &scene(""), ""));
            let none = mean(&picture(&sandbox, &scene("light_link: (excludes: [\"floor\"]),"), ""));
            let linked = mean(&picture(&sandbox, &scene("light_link: (includes: [\"floor\"]),"), ""));
            assert!(
                none == 0.0 && all > 0.0 && linked == all,
                "{light} {material} {integrator}: {none} {all} {linked}"
            );
        }
    }
}

#[test]
fn shadows_are_thrown_by_what_is_linked() {
    let sandbox = Sandbox::new();
    for integrator in ["Whitted", "Distribution", "Path"] {
        let scene = |ball: &str, key: &str| {
            let scene = room(integrator, &format!("{BALL}{ball}),")).replace("max_depth: 4", "max_depth: 1");
            let scene = scene
                .replace("color: (6, 6, 6)", "color: (0, 0, 0)")
                .replace("\"glow\": (emission: (3.0, 2.5, 2.0))", "\"glow\": ()");
            scene.replace("(name: \"key\",", &format!("(name: \"key\", {key}"))
        };
        let seen = |ball: &str, key: &str| picture(&sandbox, &scene(ball, key), "");
        let without = seen(", visible: (shadow: false)", "");
        assert!(seen("", "shadow_link: (excludes: [\"ball\"]),") == without, "{integrator}");
        let (all, gold) = (seen("", ""), seen("", "shadow_link: (includes: [\"gold\"]),"));
        assert!(all != without && gold != all && gold != without, "{integrator}");
        assert!(
            seen("", "shadow_link: (includes: [\"nobody\"]),") == seen("", "visible: (shadow: false),"),
            "{integrator}"
        );
    }
}
