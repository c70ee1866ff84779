//! A part of a frame is the same part of the whole frame, whatever the frame is made with.

use anim::components::{Aov, Filter, Integrator, Render};
use anim::film::PixelBounds;
use anim::load;
use anim::output::{PixelWindow, read_layered};

use crate::tool::{Sandbox, film};

const SCENE: &str = r#"(
    camera: (from: (0.0, 2.0, 6.0), at: (0.0, 0.6, 0.0), aperture: 0.1),
    render: (size: (90, 80), samples: 4, background: (0.2, 0.3, 0.4), photons: 4000, photon_passes: 2, max_depth: 4),
    materials: { "gloss": (color: (0.8, 0.3, 0.2), specular: 0.5, gloss: 0.2) },
    entities: [
        (name: "hero", sphere: (), transform: (translation: (0.0, 1.0, 0.0)), material: "gloss"),
        (aabox: (), transform: (translation: (-1.5, 0.5, 0.5), rotation: (0.0, 30.0, 0.0))),
        (plane: ()),
        (name: "key", area_light: (size: (1.0, 1.0)), transform: (translation: (2.0, 4.0, 3.0))),
    ],
)"#;

#[test]
fn a_region_is_the_same_part_of_the_whole_with_every_setting_of_the_film() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", SCENE);
    let (scene, _) = load::load_scene(&sandbox.path("scene.ron"), false).unwrap();
    let base = scene.render.clone();
    let mut settings: Vec<Render> = [Integrator::Whitted, Integrator::Path, Integrator::Photon]
        .map(|integrator| Render { integrator, ..base.clone() })
        .to_vec();
    let all = vec![Aov::Depth, Aov::Normal, Aov::Albedo, Aov::Position, Aov::Entity, Aov::Material, Aov::Variance];
    settings.push(Render { denoise: true, aovs: all, ..base.clone() });
    settings.push(Render { filter: Filter::Mitchell, ..base.clone() });
    settings.push(Render { samples: 36, min_samples: 9, noise_threshold: Some(0.02), ..base });
    for settings in settings {
        let whole = film(&scene, settings.clone());
        for region in [[0, 0, 90, 80], [37, 21, 18, 14], [89, 79, 1, 1], [3, 70, 40, 2]] {
            let part = film(&scene, Render { region: Some(region), ..settings.clone() });
            let [x, y, width, height] = region;
            let bounds = PixelBounds { origin: [x, y], size: [width, height] };
            assert!(part == whole.cropped(PixelBounds::whole([90, 80]), bounds), "{region:?} {settings:?}");
        }
    }
}

#[test]
fn a_region_is_never_taken_for_a_whole_frame() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", SCENE);
    let script = "animation(#{ scene: \"scene.ron\", frames: 2 });
fn frame(s, f) { s.get(\"hero\").translation.y = 1.0 + f.t; s.camera.shutter = [0.0, 0.5]; s.render.denoise = true; }";
    sandbox.write("show.rhai", script);
    sandbox.anim("show.rhai").ok();
    let whole = sandbox.read("frames/show/show.0002.png");
    sandbox.anim("show.rhai --region 30,10,40,32").ok();
    assert!(sandbox.read("frames/show/show.0002.png") == whole, "the whole frame is left alone");
    let file = "frames/show.region-30-10-40-32/show.region-30-10-40-32.0002.png";
    let decode = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().to_rgb8();
    let cut = image::imageops::crop_imm(&decode(&whole), 30, 10, 40, 32).to_image();
    assert!(decode(&sandbox.read(file)) == cut);
    // Under the name of the whole frame, it is not that frame.
    sandbox.write("frames/show/show.0002.png", sandbox.read(file));
    let plan = sandbox.anim("plan show.rhai").ok().stdout;
    assert!(plan.contains("stale"), "{plan}");
    sandbox.anim("show.rhai --region 30,10,40").fails(2, &["X,Y,WIDTH,HEIGHT"]);
    sandbox.anim("show.rhai --region 30,10,0,2").fails(2, &["one pixel at least"]);
    sandbox.anim("show.rhai --region 80,10,11,2").fails(3, &["11x2 pixels at (80, 10)", "the frame of 90x80"]);
}

#[test]
fn an_exr_of_a_region_says_where_in_the_frame_it_lies() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", SCENE);
    sandbox.anim("scene.ron -o whole.exr --aovs depth,entity").ok();
    sandbox.anim("scene.ron -o part.exr --aovs depth,entity --region 50,33,17,20").ok();
    let [whole, part] = ["whole.exr", "part.exr"].map(|file| read_layered(&sandbox.read(file)).unwrap());
    assert_eq!(part.display_window, PixelWindow { origin: [0, 0], size: [90, 80] });
    assert_eq!(part.parts[0].data_window, PixelWindow { origin: [50, 33], size: [17, 20] });
    assert_eq!(part.parts[0].channels.len(), 5);
    for (a, b) in whole.parts[0].channels.iter().zip(&part.parts[0].channels) {
        assert_eq!(a.name, b.name);
        for i in 0..17 * 20 {
            let (x, y) = (50 + i % 17, 33 + i / 17);
            assert_eq!(a.samples.get(y * 90 + x), b.samples.get(i), "{} {x} {y}", a.name);
        }
    }
    // It is known again, and its frame number can be changed like that of any other.
    let again = sandbox.anim("scene.ron -o part.exr --aovs depth,entity --region 50,33,17,20 --stats json").ok();
    assert!(again.stdout.contains("\"reused\":\"cache\""), "{}", again.stdout);
    let words = sandbox.anim("info part.exr").ok().stdout;
    assert!(words.contains("region=[50,33,17,20]"), "{words}");
}
