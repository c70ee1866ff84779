//! The same input gives the same bytes: on any number of threads, in any order, with any accelerator.

use crate::tool::Sandbox;

const SCENE: &str = r#"(
    camera: (from: (0.0, 2.0, 6.0), at: (0.0, 0.6, 0.0), aperture: 0.1, focus: Entity("hero")),
    render: (size: (64, 48), samples: 4, background: (0.2, 0.3, 0.4)),
    materials: {
        "gloss": (color: (0.8, 0.3, 0.2), specular: 0.5, gloss: 0.2),
        "glass": (diffuse: 0.0, specular: 0.5, transmission: 1.0, ior: 1.5),
    },
    entities: [
        (name: "hero", sphere: (), transform: (translation: (0.0, 1.0, 0.0)), material: "gloss"),
        (sphere: (radius: 0.5), transform: (translation: (1.2, 0.5, 1.2)), material: "glass"),
        (aabox: (), transform: (translation: (-1.5, 0.5, 0.5), rotation: (0.0, 30.0, 0.0))),
        (cone: (), transform: (translation: (0.3, 0.0, 1.9), scale: (1.0, 0.7, 0.6)), material: "gloss"),
        (triangle: (vertices: ((-3.0, 0.0, -2.0), (3.0, 0.0, -2.0), (0.0, 3.0, -2.5)))),
        (plane: ()),
        (name: "key", area_light: (size: (1.0, 1.0)), transform: (translation: (2.0, 4.0, 3.0))),
    ],
)"#;

const SCRIPT: &str = r#"
    animation(#{ scene: "scene.ron", frames: 4, mode: "loop" });
    fn setup(s) {
        for i in 0..60 { s.spawn(#{ sphere: #{ radius: 0.12 }, translation: polar(2.4, i * 6, 0.12), material: "gloss" }); }
    }
    fn frame(s, f) {
        s.get("hero").translation.y = 1.0 + 0.3 * f.t;
        s.camera.from = orbit([0, 2, 0], 6.0, f.t / 8.0);
        s.get("key").color = [f.rng.float(), 1.0, 1.0];
    }
"#;

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("scene.ron", SCENE).write("show.rhai", SCRIPT);
    sandbox
}

fn frames(sandbox: &Sandbox, folder: &str, numbers: &[u32]) -> Vec<Vec<u8>> {
    numbers.iter().map(|n| sandbox.read(&format!("{folder}/show.{n:04}.png"))).collect()
}

#[test]
fn frames_do_not_depend_on_threads_order_or_company() {
    let sandbox = sandbox();
    sandbox.anim("show.rhai -o one --threads 1").ok();
    sandbox.anim("show.rhai -o two --threads 2").ok();
    sandbox.anim("show.rhai -o shuffled --frames 4,2,1,3 --threads 3").ok();
    sandbox.anim("show.rhai -o alone --frames 3").ok();
    let all = frames(&sandbox, "one", &[1, 2, 3, 4]);
    assert!(all.windows(2).all(|pair| pair[0] != pair[1]));
    assert_eq!(all, frames(&sandbox, "two", &[1, 2, 3, 4]));
    assert_eq!(all, frames(&sandbox, "shuffled", &[1, 2, 3, 4]));
    assert_eq!(all[2..3], frames(&sandbox, "alone", &[3]));
}

#[test]
fn the_accelerator_does_not_show() {
    let sandbox = sandbox();
    for accel in ["grid", "brute", "bvh", "auto"] {
        sandbox.anim(&format!("show.rhai -o {accel} --accel {accel} --frames 1,3")).ok();
    }
    let brute = pixels(&sandbox, "brute");
    assert_eq!(pixels(&sandbox, "grid"), brute);
    assert_eq!(pixels(&sandbox, "bvh"), brute);
    assert_eq!(pixels(&sandbox, "auto"), brute);
}

#[test]
fn every_integrator_gives_the_same_bytes_with_any_accelerator_and_thread_count() {
    let sandbox = sandbox();
    for integrator in ["whitted", "distribution", "path"] {
        let render = |accel: &str, threads: usize| {
            let folder = format!("{integrator}-{accel}-{threads}");
            let flags = format!("--integrator {integrator} --accel {accel} --threads {threads} --frames 1,3");
            sandbox.anim(&format!("show.rhai -o {folder} {flags}")).ok();
            pixels(&sandbox, &folder)
        };
        let brute = render("brute", 1);
        assert_eq!(render("bvh", 2), brute, "{integrator}");
        assert_eq!(render("grid", 3), brute, "{integrator}");
    }
}

/// Pixels alone: the settings in the metadata name the accelerator.
fn pixels(sandbox: &Sandbox, folder: &str) -> Vec<Vec<u8>> {
    let decode = |bytes: Vec<u8>| image::load_from_memory(&bytes).unwrap().to_rgb8().into_raw();
    frames(sandbox, folder, &[1, 3]).into_iter().map(decode).collect()
}

#[test]
fn a_dumped_frame_renders_to_the_same_picture() {
    let sandbox = sandbox();
    sandbox.anim("show.rhai -o frames --frames 3").ok();
    sandbox.anim("dump show.rhai --frame 3 -o frame3.ron").ok();
    sandbox.anim("frame3.ron -o still.png").ok();
    let decode = |bytes: Vec<u8>| image::load_from_memory(&bytes).unwrap().to_rgb8().into_raw();
    assert_eq!(decode(sandbox.read("frames/show.0003.png")), decode(sandbox.read("still.png")));
}

#[test]
fn converting_twice_gives_the_same_text() {
    let sandbox = sandbox();
    let once = sandbox.anim("convert scene.ron").ok().stdout;
    sandbox.write("once.ron", &once);
    assert_eq!(sandbox.anim("convert once.ron").ok().stdout, once);
    sandbox.anim("scene.ron -o a.png").ok();
    sandbox.anim("once.ron -o b.png").ok();
    let decode = |bytes: Vec<u8>| image::load_from_memory(&bytes).unwrap().to_rgb8().into_raw();
    assert_eq!(decode(sandbox.read("a.png")), decode(sandbox.read("b.png")));
}

/// Builds for development have one width only; what they have gives the same bytes, and what they do not is said.
#[test]
fn a_width_that_is_forced_is_reported_and_does_not_show() {
    let sandbox = sandbox();
    let width = |run: &crate::tool::Run| {
        let line = run.stdout.lines().next().unwrap_or_default();
        serde_json::from_str::<serde_json::Value>(line).unwrap()["simd"].as_str().unwrap().to_string()
    };
    let usual = width(&sandbox.anim("show.rhai --frames 2 -o usual/ --stats json").ok());
    let narrow = if cfg!(target_arch = "x86_64") { "sse2" } else { "scalar" };
    for name in [narrow, usual.as_str()] {
        let run =
            sandbox.anim_with(&[("ANIM_SIMD", name)], "show.rhai --frames 2 -o forced/ --force --stats json").ok();
        assert_eq!(width(&run), name);
        assert!(sandbox.read("forced/show.0002.png") == sandbox.read("usual/show.0002.png"), "{name}");
    }
    sandbox.anim_with(&[("ANIM_SIMD", "mmx")], "show.rhai --frames 1").fails(2, &["ANIM_SIMD=mmx", narrow]);
}
