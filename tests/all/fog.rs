//! Fog, held to what can be computed: transmittance, furnaces, and single scattering as an integral.

use std::f64::consts::PI;

use anim::components::{Aov, Fog, Render};

use crate::tool::{Sandbox, film, picture};

fn mean(picture: &image::Rgb32FImage, channel: usize) -> f64 {
    let sum: f64 = picture.pixels().map(|p| f64::from(p.0[channel])).sum();
    sum / f64::from(picture.width() * picture.height())
}

/// A wall that shines, 4 units before the camera, as exactly as pixels see it.
fn wall(integrator: &str, samples: u32, fog: &str) -> String {
    format!(
        r#"(
        camera: (from: (0, 0, 4), at: (0, 0, 0), fov: 1.0),
        render: (size: (8, 8), samples: {samples}, integrator: {integrator}, transfer: Linear, photons: 1000, photon_passes: 1, fog: ({fog})),
        materials: {{ "glow": (model: Lambert, color: (0, 0, 0), emission: (0.8, 0.8, 0.8)) }},
        entities: [(plane: (normal: (0, 0, 1)), material: "glow")],
    )"#
    )
}

#[test]
fn light_is_lost_by_the_law_of_beer() {
    let sandbox = Sandbox::new();
    let left = f64::exp(-0.25 * 4.0);
    for integrator in ["Whitted", "Distribution", "Photon"] {
        let found = picture(&sandbox, &wall(integrator, 1, "density: 0.25, color: (0.5, 0.2, 0.0)"), "");
        for (channel, color) in [(0, 0.5), (1, 0.2), (2, 0.0)] {
            let expected = 0.8 * left + color * (1.0 - left);
            assert!((mean(&found, channel) - expected).abs() < 2e-4, "{integrator} {channel}");
        }
    }
    // Paths meet the wall or the fog by chance; fog that is black gives nothing back.
    let found = mean(&picture(&sandbox, &wall("Path", 1024, "density: 0.25, color: (0, 0, 0)"), ""), 0);
    assert!((found - 0.8 * left).abs() < 0.004, "{found} {}", 0.8 * left);
    // Half of the way is outside of the box.
    let half = "density: 0.25, color: (0, 0, 0), bounds: ((-1, -1, 1), (1, 1, 3))";
    let found = mean(&picture(&sandbox, &wall("Whitted", 1, half), ""), 0);
    assert!((found - 0.8 * f64::exp(-0.5)).abs() < 2e-4, "{found}");
}

/// What neither absorbs nor shines cannot be seen in even light, however it scatters.
#[test]
fn fog_in_even_light_cannot_be_seen() {
    let sandbox = Sandbox::new();
    for around in ["background: (0.5, 0.5, 0.5)", "sky: ((0.5, 0.5, 0.5), (0.5, 0.5, 0.5), (0.5, 0.5, 0.5))"] {
        for scattering in ["anisotropy: 0", "anisotropy: 0.4"] {
            let scene = format!(
                r#"(
                camera: (from: (0, 0, 3), at: (0, 0, 0), fov: 38.0),
                render: (size: (10, 10), samples: 100, integrator: Path, max_depth: 64, transfer: Linear, {around},
                    fog: (density: 0.8, color: (1, 1, 1), {scattering}, bounds: ((-2, -2, -2), (2, 2, 2)))),
                materials: {{ "m": (model: Lambert, color: (1, 1, 1)) }},
                entities: [(sphere: (radius: 0.5), material: "m")],
            )"#
            );
            let found = mean(&picture(&sandbox, &scene, ""), 0);
            assert!((found - 0.5).abs() < 0.01, "{around} {scattering}: {found}");
        }
    }
}

/// Radiance of fog beside a point of intensity 1 that is seen past it, scattered once: the integral along the ray.
fn scattered_once(density: f64, g: f64, apart: f64, nearest: f64, end: f64) -> f64 {
    let n = 200_000;
    let step = end / f64::from(n);
    let at = |i: u32| {
        let t = (f64::from(i) + 0.5) * step;
        let along = nearest - t;
        let square = apart * apart + along * along;
        let cosine = along / square.sqrt();
        let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
        density * f64::exp(-density * (t + square.sqrt())) * phase / square
    };
    (0..n).map(at).sum::<f64>() * step
}

#[test]
fn light_that_is_scattered_once_is_the_integral_along_the_ray() {
    let sandbox = Sandbox::new();
    for (density, g, apart) in [(0.2, 0.0, 0.5), (0.2, 0.6, 0.5), (1.0, -0.4, 0.2), (0.05, 0.0, 0.02)] {
        let scene = |light: &str| {
            format!(
                r#"(
                camera: (from: (0, 0, 5), at: (0, 0, 0), fov: 0.01),
                render: (size: (8, 8), samples: 256, integrator: Path, max_depth: 1, transfer: Linear,
                    fog: (density: {density}, color: (1, 0.5, 0), anisotropy: {g})),
                entities: [{light}],
            )"#
            )
        };
        // A point of color c has the intensity pi c.
        let expected = scattered_once(density, g, apart, 5.0, 200.0);
        let color = 0.3 / expected / PI;
        let lamp = format!(
            "(point_light: (position: (0, {apart}, 0), color: ({color}, {color}, {color}), falloff: InverseSquare))"
        );
        let found = picture(&sandbox, &scene(&lamp), "");
        assert!((mean(&found, 0) - 0.3).abs() < 0.005, "{density} {g} {apart}: {}", mean(&found, 0));
        assert!((mean(&found, 1) - 0.15).abs() < 0.003 && mean(&found, 2) == 0.0);
        // A small ball that shines is a point from afar: the same light by another way of sampling.
        if apart > 0.1 {
            let radius = 0.02;
            let radiance = 0.3 / expected / (PI * radius * radius);
            let ball =
                format!("(sphere: (radius: {radius}), transform: (translation: (0, {apart}, 0)), material: \"glow\")");
            let glow = format!(
                "materials: {{ \"glow\": (color: (0, 0, 0), emission: ({radiance}, {radiance}, {radiance})) }}, entities"
            );
            let found = picture(&sandbox, &scene(&ball).replace("entities", &glow), "");
            assert!((mean(&found, 0) - 0.3).abs() < 0.03, "{density} {g} {apart}: {}", mean(&found, 0));
        }
    }
}

const ROOM: &str = r#"(
    camera: (from: (0.0, 1.0, 4.0), at: (0.0, 0.6, 0.0), fov: 40.0),
    render: (size: (32, 24), samples: 16, max_depth: 4, background: (0.1, 0.1, 0.2),
        fog: (density: 0.3, color: (0.8, 0.9, 1.0), bounds: ((-3, 0, -3), (3, 3, 5)))),
    materials: { "glass": (model: Dielectric, ior: 1.5), "matt": (model: Lambert, color: (0.5, 0.5, 0.5)) },
    entities: [
        (aabox: (min: (-3, -0.2, -3), max: (3, 0, 3)), material: "matt"),
        (name: "ball", sphere: (radius: 0.5), transform: (translation: (-0.6, 0.6, 0)), material: "glass"),
        (name: "spot", spot_light: (position: (1, 2.8, 0), direction: (-0.2, -1, 0), color: (4, 4, 4), falloff: InverseSquare)),
        (area_light: (size: (1, 1), color: (1, 1, 1), falloff: InverseSquare), transform: (translation: (-1, 2.5, 0))),
    ],
)"#;

#[test]
fn fog_keeps_its_bytes_whatever_is_reused() {
    let sandbox = Sandbox::new();
    let script = r#"animation(#{ scene: "a.ron", frames: 4 });
        fn frame(s, f) {
            s.get("ball").translation = [f.t - 0.6, 0.6, 0];
            if f.number == 4 { s.render.fog.density = 0.5; }
        }"#;
    sandbox.write("a.ron", ROOM).write("a.rhai", script);
    for integrator in ["distribution", "path"] {
        let more = format!("--integrator {integrator} --progress none");
        sandbox.anim(&format!("a.rhai -o kept/ {more}")).ok();
        sandbox.anim(&format!("a.rhai -o fresh/ --no-reuse --threads 1 {more} --accel grid")).ok();
        let frame = |folder: &str, n: u32| sandbox.read(&format!("{folder}/a.{n:04}.png"));
        let pixels = |folder: &str, n: u32| image::load_from_memory(&frame(folder, n)).unwrap().to_rgb8();
        for n in 1..=4 {
            assert!(pixels("kept", n) == pixels("fresh", n), "{integrator} {n}");
        }
        assert!(pixels("kept", 3) != pixels("kept", 4));
    }
}

#[test]
fn layers_look_through_fog_and_alpha_does_not() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", ROOM);
    let project = anim::base::project::Project::of(&sandbox.path("scene.ron"), &Default::default()).unwrap();
    let folder = anim::base::project::Folder::new(sandbox.path("."), project);
    let (scene, _) = anim::load::ron::parse(ROOM, "scene.ron", &folder).unwrap();
    for integrator in [anim::components::Integrator::Path, anim::components::Integrator::Distribution] {
        let render = |fog: Option<Fog>| Render {
            integrator,
            transparent: true,
            aovs: vec![Aov::Depth, Aov::Normal],
            fog: fog.map(Box::new),
            ..scene.render.clone()
        };
        let all = Fog { density: 0.3, ..Fog::default() };
        let (clear, foggy) = (film(&scene, render(None)), film(&scene, render(Some(all))));
        assert!(clear.layers.depth == foggy.layers.depth && clear.layers.normal == foggy.layers.normal);
        assert!(clear.layers.entity == foggy.layers.entity && clear.pixels != foggy.pixels);
        // Endless fog hides all that lies behind everything.
        assert!(foggy.layers.coverage.iter().all(|alpha| *alpha == 1.0) && clear.layers.coverage.contains(&0.0));
    }
}
