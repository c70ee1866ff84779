//! Cameras whose pictures are known from elsewhere, and scripts that choose among several.

use crate::tool::{Run, Sandbox};

/// The linear luminance of each pixel of a picture in the sandbox, row by row, and its width.
fn rows(sandbox: &Sandbox, file: &str) -> Vec<Vec<f32>> {
    let picture = image::open(sandbox.path(file)).unwrap().to_rgb32f();
    let row = |y: u32| (0..picture.width()).map(|x| picture.get_pixel(x, y).0.iter().sum::<f32>() / 3.0).collect();
    (0..picture.height()).map(row).collect()
}

/// A ball that shines, alone in the dark.
fn ball(camera: &str, place: &str) -> String {
    format!(
        "(camera: ({camera}), render: (size: (80, 60), samples: 1, transfer: Linear, background: (0.0, 0.0, 0.0)),
          materials: {{ \"lamp\": (model: Unlit, color: (1.0, 1.0, 1.0)) }},
          entities: [(sphere: (radius: 1.0), transform: (translation: {place}), material: \"lamp\")])"
    )
}

#[test]
fn parallel_rays_show_a_ball_as_large_from_anywhere() {
    let sandbox = Sandbox::new();
    // Four units are 60 pixels: the radius is 15, and the shift to the right moves the ball by a tenth of 80 to the left.
    let view = "projection: Orthographic, height: 4.0, at: (0.0, 0.0, 0.0), shift: (0.1, 0.0)";
    for (name, distance) in [("near", 3.0), ("far", 300.0)] {
        sandbox
            .write(&format!("{name}.ron"), ball(&format!("from: (0.0, 0.0, {distance:?}), {view}"), "(0.0, 0.0, 0.0)"));
        for integrator in ["whitted", "distribution", "path", "photon"] {
            sandbox.anim(&format!("{name}.ron -o {name}.png --force --integrator {integrator}")).ok();
            let lit = rows(&sandbox, &format!("{name}.png"));
            for (y, row) in lit.iter().enumerate() {
                for (x, value) in row.iter().enumerate() {
                    let off = (x as f32 + 0.5 - 32.0).hypot(y as f32 + 0.5 - 30.0);
                    if (off - 15.0).abs() > 0.1 {
                        assert_eq!(*value > 0.5, off < 15.0, "{name} {integrator}: {x} {y}");
                    }
                }
            }
        }
    }
}

#[test]
fn all_directions_give_an_environment_back() {
    let sandbox = Sandbox::new();
    let texel = |x: u32, y: u32| [(x * 16 + 7) as u8, (y * 30 + 9) as u8, ((x * 5 + y * 11) % 200) as u8 + 20];
    let sky = image::RgbImage::from_fn(16, 8, |x, y| image::Rgb(texel(x, y)));
    sky.save(sandbox.path("sky.png")).unwrap();
    sandbox.write(
        "a.ron",
        "(camera: (projection: Equirectangular, from: (3.0, 1.0, 2.0), at: (3.0, 1.0, 1.0)),
          render: (size: (144, 72), samples: 1, environment: \"sky.png\"))",
    );
    for integrator in ["whitted", "path"] {
        sandbox.anim(&format!("a.ron -o {integrator}.png --integrator {integrator}")).ok();
        let got = image::open(sandbox.path(&format!("{integrator}.png"))).unwrap().to_rgb8();
        for (x, y) in (0..16).flat_map(|x| (0..8).map(move |y| (x, y))) {
            let pixel = got.get_pixel(9 * x + 4, 9 * y + 4).0;
            let away = pixel.iter().zip(texel(x, y)).map(|(a, b)| a.abs_diff(b)).max();
            assert!(away <= Some(1), "{integrator} {x} {y}: {pixel:?} for {:?}", texel(x, y));
        }
    }
    // A ball straight above fills the rows above its latitude: half its angle is asin(1/2), 30 of 180 degrees.
    let around = "projection: Equirectangular, from: (0.0, 0.0, 0.0), at: (0.0, 0.0, -1.0)";
    sandbox.write("b.ron", ball(around, "(0.0, 2.0, 0.0)"));
    sandbox.anim("b.ron -o b.png").ok();
    for (y, row) in rows(&sandbox, "b.png").iter().enumerate() {
        assert!(row.iter().all(|value| (*value > 0.5) == (y < 10)), "row {y}");
    }
}

#[test]
fn textures_are_filtered_by_what_a_pixel_of_parallel_rays_covers() {
    let sandbox = Sandbox::new();
    // Squares of a tenth of a unit, under pixels of half a unit that see an even number of both.
    let floor = |camera: &str| {
        format!(
            "(camera: ({camera}, up: (0.0, 0.0, -1.0)), render: (size: (16, 16), samples: 1, transfer: Linear),
              materials: {{ \"tiles\": (model: Unlit, color: (1.0, 1.0, 1.0), color_map: (image: \"tiles.png\", scale: (5.0, 5.0))) }},
              entities: [(plane: (), material: \"tiles\")])"
        )
    };
    let tiles = image::GrayImage::from_fn(64, 64, |x, y| image::Luma([if (x < 32) == (y < 32) { 255 } else { 0 }]));
    tiles.save(sandbox.path("tiles.png")).unwrap();
    let high = "from: (0.03, 900.0, 0.04), at: (0.03, 0.0, 0.04)";
    sandbox.write("wide.ron", floor(&format!("{high}, projection: Orthographic, height: 48.0")));
    sandbox.write("fine.ron", floor(&format!("{high}, projection: Orthographic, height: 0.05")));
    for name in ["wide", "fine"] {
        sandbox.anim(&format!("{name}.ron -o {name}.png")).ok();
    }
    let wide: Vec<f32> = rows(&sandbox, "wide.png").concat();
    let fine: Vec<f32> = rows(&sandbox, "fine.png").concat();
    assert!(wide.iter().all(|value| (value - 0.5).abs() < 0.05), "{wide:?}");
    assert!(fine.iter().all(|value| *value < 0.01 || *value > 0.99), "{fine:?}");
}

/// A scene with three cameras of different projections, and a script that cuts between them while a ball moves.
fn cuts(sandbox: &Sandbox) {
    sandbox.write(
        "set.ron",
        r#"(
            camera: (from: (0.0, 2.0, 6.0), at: (0.0, 0.6, 0.0), aperture: 0.1, blades: 5, shift: (0.1, -0.1)),
            cameras: {
                "plan": (from: (0.0, 6.0, 0.0), at: (0.0, 0.0, 0.0), up: (0.0, 0.0, -1.0), projection: Orthographic, height: 5.0, aperture: 0.05),
                "all": (from: (0.5, 1.2, 2.5), at: (0.0, 1.0, 0.0), projection: Equirectangular),
            },
            render: (size: (48, 32), samples: 4, background: (0.2, 0.3, 0.4), aovs: []),
            materials: { "gloss": (color: (0.8, 0.3, 0.2), specular: 0.5, gloss: 0.2), "check": (color_map: (pattern: Checker)) },
            entities: [
                (name: "hero", sphere: (radius: 0.5), transform: (translation: (0.0, 0.5, 0.0)), material: "gloss"),
                (aabox: (), transform: (translation: (-1.5, 0.5, 0.5), rotation: (0.0, 30.0, 0.0)), material: "gloss"),
                (triangle: (vertices: ((-3.0, 0.0, -2.0), (3.0, 0.0, -2.0), (0.0, 3.0, -2.5)))),
                (plane: (), material: "check"),
                (name: "key", point_light: (position: (2.0, 4.0, 3.0))),
            ],
        )"#,
    );
    sandbox.write(
        "cuts.rhai",
        r#"animation(#{ scene: "set.ron", frames: 9 });
           fn frame(s, f) {
               if f.number > 6 { s.camera = "all"; } else if f.number > 3 { s.camera = "plan"; }
               s.get("hero").translation.x = 0.2 * f.index;
           }"#,
    );
}

#[test]
fn every_projection_gives_the_same_bytes_however_it_is_traced() {
    let sandbox = Sandbox::new();
    cuts(&sandbox);
    let frames = |folder: &str| -> Vec<Vec<u8>> {
        (1..=9).map(|n| image::open(sandbox.path(&format!("{folder}/cuts.{n:04}.png"))).unwrap().into_bytes()).collect()
    };
    for integrator in ["whitted", "path"] {
        let render = |folder: &str, more: &str, variables: &[(&str, &str)]| -> (Run, Vec<Vec<u8>>) {
            let run = sandbox.anim_with(
                variables,
                &format!("cuts.rhai -o {folder}/ --force --stats json --integrator {integrator} {more}"),
            );
            (run.ok(), frames(folder))
        };
        let (run, kept) = render("kept", "--threads 2", &[]);
        // Frames before one camera share what did not change.
        assert!(run.stdout.lines().any(|line| !line.contains("\"tiles_kept\":0")), "{}", run.stdout);
        assert!(kept.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(kept == render("fresh", "--no-reuse --threads 1 --accel brute", &[]).1, "{integrator}: brute");
        assert!(kept == render("grid", "--no-reuse --accel grid", &[]).1, "{integrator}: grid");
        assert!(kept == render("plain", "--accel bvh", &[("ANIM_SIMD", "sse2")]).1, "{integrator}: sse2");
    }
}

#[test]
fn a_script_cuts_to_cameras_and_blends_them() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "set.ron",
        "(camera: (from: (0.0, 1.0, 8.0), at: (0.0, 1.0, 0.0), fov: 40.0),
          cameras: { \"close\": (from: (2.0, 1.0, 4.0), at: (0.0, 1.0, 0.0), fov: 20.0, aperture: 0.2) },
          entities: [(name: \"ball\", sphere: ())])",
    );
    sandbox.write(
        "show.rhai",
        "animation(#{ scene: \"set.ron\", frames: 4 });
         fn setup(s) { s.add_camera(\"top\", #{ from: [0, 9, 0], up: [0, 0, -1] }); }
         fn frame(s, f) {
             if f.number == 2 { s.camera = \"close\"; s.camera.fov = 25; s.cameras.close.blades = 6; }
             if f.number == 3 { s.camera = blend(\"camera\", \"close\", 0.5); s.camera.up = [0.1, 1, 0]; }
             if f.number == 4 { s.camera = \"top\"; s.camera = \"camera\"; s.camera.fov += 1; s.cameras.top.fov = 9; }
         }",
    );
    let camera = |frame: u32, more: &str| {
        let dumped = sandbox.anim(&format!("dump show.rhai --frame {frame} {more}")).ok().stdout;
        dumped.lines().find(|line| line.trim().starts_with("camera:")).unwrap_or_default().trim().to_string()
    };
    assert_eq!(camera(1, ""), "camera: (from: (0.0, 1.0, 8.0), at: (0.0, 1.0, 0.0)),");
    let close = "camera: (from: (2.0, 1.0, 4.0), at: (0.0, 1.0, 0.0), fov: 25.0, aperture: 0.2, blades: 6),";
    assert_eq!(camera(2, ""), close);
    // The focus goes evenly in 1 / distance from 8 to sqrt(20).
    let between = camera(3, "");
    assert!(between.starts_with("camera: (from: (1.0, 1.0, 6.0), at: (0.0, 1.0, 0.0), up: (0.1, 1.0, 0.0), fov: 30.0"));
    let distance = 2.0 / (1.0 / 8.0 + 1.0 / 20f64.sqrt());
    assert!(between.contains(&format!("focus_distance: {:.5}", distance)[..20]), "{between}");
    assert!(between.contains("aperture: 0.1"), "{between}");
    assert_eq!(camera(4, ""), "camera: (from: (0.0, 1.0, 8.0), at: (0.0, 1.0, 0.0), fov: 41.0),");
    // What is dumped loads again, with its cameras.
    let dumped = sandbox.anim("dump show.rhai --frame 4").ok().stdout;
    assert!(dumped.contains("\"top\": (from: (0.0, 9.0, 0.0), up: (0.0, 0.0, -1.0), fov: 9.0)"), "{dumped}");
    sandbox.write("again.ron", &dumped);
    assert_eq!(sandbox.anim("dump again.ron").ok().stdout, dumped);
    // A camera that no frame is seen from makes none of them stale.
    sandbox.anim("show.rhai --frames 1 --size 8x6 --spp 1").ok();
    sandbox.anim("set set.ron cameras.close.fov=21").ok();
    let plan = sandbox.anim("plan show.rhai --size 8x6 --spp 1").ok().stdout;
    assert!(plan.contains("1 done"), "{plan}");
}

#[test]
fn the_command_line_chooses_a_camera() {
    let sandbox = Sandbox::new();
    cuts(&sandbox);
    sandbox.anim("set.ron -o still.png --camera plan --integrator whitted").ok();
    sandbox.anim("cuts.rhai -o cuts/ --camera plan --frames 1 --integrator whitted").ok();
    let still = image::open(sandbox.path("still.png")).unwrap().into_bytes();
    assert!(still == image::open(sandbox.path("cuts/cuts.0001.png")).unwrap().into_bytes());
    sandbox.anim("set.ron --camera pln").fails(2, &["--camera pln: there is no such camera", "did you mean `plan`?"]);
}

#[test]
fn mistakes_with_cameras_are_answered_at_their_places() {
    let sandbox = Sandbox::new();
    // `^` stands before what a message points at.
    let in_scene = |marked: &str, expected: &str| {
        let at = format!("a.ron:1:{}: error", marked.find('^').unwrap() + 1);
        sandbox.write("a.ron", marked.replace('^', ""));
        sandbox.anim("check a.ron").fails(3, &[&at, expected]);
    };
    in_scene("(cameras: { \"a\": (^fvo: 3) })", "did you mean `fov`?");
    in_scene("(cameras: { \"a\": (blades: ^2) })", "camera `a`: `blades` must be 0");
    in_scene("(cameras: { \"a\": (focus: ^Entity(\"x\")) })", "camera `a` is focused on `x`, which does not exist");
    in_scene("(cameras: { \"camera\": ^() })", "no camera of `cameras` may be called `camera`");
    in_scene("(cameras: { \"a\": (), ^\"a\": () })", "two cameras are called `a`");
    in_scene("(cameras: [^(fov: 3)])", "a camera needs a name in quotes");
    in_scene("(camera: (projection: ^Ortographic))", "did you mean `Orthographic`?");
    in_scene("(camera: (projection: Equirectangular, aperture: ^0.2))", "an `Equirectangular` camera has no lens");
    let two = "(cameras: { \"close\": (), \"plan\": (projection: Orthographic) })";
    sandbox.write("a.ron", two);
    let in_script = |script: &str, expected: &[&str]| {
        sandbox.write("a.rhai", format!("animation(#{{ scene: \"a.ron\" }});\nfn frame(s, f) {{ {script} }}"));
        sandbox.anim("check a.rhai").fails(3, &[&["a.rhai:2:"], expected].concat());
    };
    in_script("s.camera = \"clsoe\";", &["there is no camera `clsoe`", "did you mean `close`?"]);
    in_script("s.camera = 3;", &["found the number 3", "write the name of one of the scene's `cameras`"]);
    in_script("s.cameras.clsoe.fov = 3;", &["did you mean `close`?"]);
    in_script("s.camera = blend(\"close\", \"plan\", 0.5);", &["Perspective and Orthographic, are not blended"]);
    in_script("s.cameras.top = #{ fov: 3 };", &["write s.add_camera(\"top\""]);
    in_script("s.camera = \"close\"; s.camera.fov = 300;", &["`fov` must be from"]);
    sandbox.write("b.ron", "(camera: (height: 3.0, blades: 6))");
    sandbox.anim("check b.ron --strict").fails(3, &["`height` is only used by", "`blades` is only used by"]);
}
