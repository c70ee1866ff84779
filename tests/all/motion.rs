//! Motion blur: the shutter against pictures whose truth is known.

use anim::components::{Edit, Render};
use anim::shot::{self, Overrides, Shot};

use crate::tool::Sandbox;

fn open(sandbox: &Sandbox, input: &str) -> Shot {
    shot::open(&sandbox.path(input), &[], false, Overrides::default()).unwrap().0
}

fn picture(sandbox: &Sandbox, file: &str) -> image::RgbImage {
    image::load_from_memory(&sandbox.read(file)).unwrap().to_rgb8()
}

/// A black ball on white, seen from so far away that its outline is a disk of `radius` pixels, in a picture of 48 x 24,
/// which it crosses by `travel` pixels to the right while the shutter is open. A pixel is 0.1 units wide.
fn ball(radius: f64, travel: f64, camera: &str, render: &str) -> String {
    format!(
        r#"(
        camera: (from: (0.0, 0.0, 1000.0), at: (0.0, 0.0, 0.0), fov: 0.137509868, {camera}),
        render: (size: (48, 24), background: (1.0, 1.0, 1.0), transfer: Linear, {render}),
        materials: {{ "black": (diffuse: 0.0, specular: 0.0) }},
        entities: [(
            sphere: (radius: {}), material: "black", transform: (translation: ({}, 0.0, 0.0)),
            motion: (displacement: ({}, 0.0, 0.0), end: 0.5),
        )],
    )"#,
        radius / 10.0,
        -travel / 20.0,
        travel / 10.0,
    )
}

/// Share of the shutter's time and of the pixel's area at (x, y) that the ball covers, by brute force.
fn coverage(x: u32, y: u32, radius: f64, travel: f64) -> f64 {
    let n = 16;
    let at = |i: u32, p: u32, size: u32| f64::from(p) + (f64::from(i) + 0.5) / f64::from(n) - f64::from(size) / 2.0;
    let mut sum = 0.0;
    for i in 0..n * n {
        let (px, py) = (at(i % n, x, 48), at(i / n, y, 24));
        // The chord at this height, slid along: the share of slides that hold the point.
        let half = (radius * radius - py * py).max(0.0).sqrt();
        let first = ((px - half + travel / 2.0) / travel).clamp(0.0, 1.0);
        let last = ((px + half + travel / 2.0) / travel).clamp(0.0, 1.0);
        sum += last - first;
    }
    sum / f64::from(n * n)
}

#[test]
fn a_moving_ball_covers_what_it_should() {
    let sandbox = Sandbox::new();
    let (radius, travel) = (5.0, 24.0);
    sandbox.write("ball.ron", ball(radius, travel, "shutter: (0.0, 0.5)", "samples: 64, shutter_slices: 64"));
    sandbox.anim("ball.ron -o ball.png").ok();
    let (mut worst, mut area) = (0.0f64, 0.0);
    for (x, y, pixel) in picture(&sandbox, "ball.png").enumerate_pixels() {
        let covered = 1.0 - f64::from(pixel.0[0]) / 255.0;
        area += covered;
        worst = worst.max((covered - coverage(x, y, radius, travel)).abs());
    }
    assert!(worst < 0.16, "{worst}");
    let disk = std::f64::consts::PI * radius * radius;
    assert!((area / disk - 1.0).abs() < 0.005, "{area} instead of {disk}");
}

/// As many moments as do not divide the samples evenly: none of them may count for more in the mean.
#[test]
fn slices_share_the_samples_fairly() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.ron", ball(8.0, 30.0, "shutter: (0.0, 0.5)", "samples: 9, shutter_slices: 7"));
    sandbox.anim("ball.ron -o ball.png").ok();
    let (mut area, mut moment) = (0.0, 0.0);
    for (x, _, pixel) in picture(&sandbox, "ball.png").enumerate_pixels() {
        let covered = 1.0 - f64::from(pixel.0[0]) / 255.0;
        area += covered;
        moment += covered * (f64::from(x) + 0.5 - 24.0);
    }
    assert!((area / (std::f64::consts::PI * 64.0) - 1.0).abs() < 0.02, "{area}");
    assert!((moment / area).abs() < 0.5, "{}", moment / area);
}

#[test]
fn a_closed_shutter_is_an_instant() {
    let sandbox = Sandbox::new();
    let render = |name: &str, text: String| {
        sandbox.write(&format!("{name}.ron"), text).anim(&format!("{name}.ron -o {name}.png")).ok();
        picture(&sandbox, &format!("{name}.png"))
    };
    let never = render("never", ball(5.0, 20.0, "", "samples: 4"));
    assert_eq!(render("closed", ball(5.0, 20.0, "shutter: (0.0, 0.0)", "samples: 4, shutter_slices: 4")), never);
    // Later, the ball is elsewhere; one sample shows the middle of the shutter, and so does a Whitted picture.
    let later = render("later", ball(5.0, 20.0, "shutter: (0.25, 0.25)", "samples: 1"));
    assert_ne!(later, never);
    assert_eq!(render("middle", ball(5.0, 20.0, "shutter: (0.0, 0.5)", "samples: 1")), later);
    let whitted = |shutter: &str| ball(5.0, 20.0, shutter, "samples: 4, integrator: Whitted");
    assert_eq!(render("whitted", whitted("shutter: (0.0, 0.5)")), render("instant", whitted("shutter: (0.25, 0.25)")));
}

const WALL: &str = r#"(
    camera: (from: (0.0, 0.0, 9.0), at: (0.0, 0.0, 0.0)),
    render: (size: (32, 24), samples: 4),
    materials: { "white": (color: (0.9, 0.9, 0.9)) },
    entities: [
        (aabox: (min: (-9.0, -9.0, -1.0), max: (9.0, 9.0, 0.0)), material: "white"),
        (name: "lamp", point_light: (color: (0.7, 0.8, 0.9))),
    ],
)"#;

fn orbiting(frames: u32, shutter: &str) -> String {
    format!(
        r#"animation(#{{ scene: "wall.ron", frames: {frames}, mode: "loop" }});
        fn frame(s, f) {{ s.get("lamp").translation = orbit([0, 0, 2], 3.0, f.t); {shutter} }}"#
    )
}

/// One frame of a light that flies around is the mean of its instants.
#[test]
fn an_open_shutter_is_the_mean_of_its_moments() {
    let sandbox = Sandbox::new();
    sandbox
        .write("wall.ron", WALL)
        .write("blurred.rhai", orbiting(4, "s.camera.shutter = [0, 1];"))
        .write("instants.rhai", orbiting(32, ""));
    sandbox.anim("blurred.rhai -o a --frames 1").ok();
    sandbox.anim("instants.rhai -o b --frames 2,4,6,8").ok();
    let blurred = picture(&sandbox, "a/blurred.0001.png");
    let instants = [2, 4, 6, 8].map(|n| picture(&sandbox, &format!("b/instants.{n:04}.png")));
    let linear = |byte: u8| anim::base::color::srgb_decode(f32::from(byte) / 255.0);
    let (mut error, mut change) = (0.0f32, 0.0f32);
    for (x, y, pixel) in blurred.enumerate_pixels() {
        let mean = instants.iter().map(|i| linear(i.get_pixel(x, y).0[0])).sum::<f32>() / 4.0;
        error += linear(pixel.0[0]) - mean;
        change += (linear(instants[0].get_pixel(x, y).0[0]) - mean).abs();
    }
    assert!(error.abs() < change * 0.02, "{error} of {change}");
}

const SHOW: &str = r#"
    animation(#{ scene: "scene.ron", frames: 3, mode: "loop" });
    fn frame(s, f) {
        s.camera.shutter = [-0.3, 0.4];
        s.camera.from = orbit([0, 2, 0], 6.0, f.t / 8.0);
        s.get("ball").translation.y = 1.0 + sind(360 * f.t);
        s.get("lamp").color = [1.0, f.t, 1.0];
        if f.t > 0.5 { s.spawn(#{ sphere: #{ radius: 0.3 }, translation: [f.rng.float(), 0.3, 1.5] }); }
        s.render.background = [f.t, 0, 0];
    }
"#;

fn show() -> Sandbox {
    let sandbox = Sandbox::new();
    let scene = r#"(
        render: (size: (40, 30), samples: 9, shutter_slices: 5),
        entities: [
            (name: "ball", sphere: (), transform: (translation: (0.0, 1.0, 0.0))),
            (name: "drifting", aabox: (), transform: (translation: (-2.0, 0.5, 0.0)), motion: (displacement: (0.0, 0.0, 2.0))),
            (sphere: (radius: 0.4), transform: (translation: (0.0, 1.0, 0.0), parent: "drifting")),
            (plane: ()),
            (name: "lamp", area_light: (), transform: (translation: (2.0, 5.0, 3.0))),
        ],
    )"#;
    sandbox.write("scene.ron", scene).write("show.rhai", SHOW);
    sandbox
}

#[test]
fn blurred_frames_do_not_depend_on_threads_order_or_accelerator() {
    let sandbox = show();
    let render = |folder: &str, flags: &str| {
        sandbox.anim(&format!("show.rhai -o {folder} {flags}")).ok();
        [1, 2, 3].map(|n| picture(&sandbox, &format!("{folder}/show.{n:04}.png")))
    };
    let one = render("one", "--threads 1");
    assert!(one[0] != one[1] && one[1] != one[2]);
    assert_eq!(render("three", "--threads 3 --frames 3,1,2"), one);
    assert_eq!(render("grid", "--accel grid"), one);
    assert_eq!(render("brute", "--accel brute"), one);
}

#[test]
fn a_frame_is_its_slices_as_data() {
    let sandbox = show();
    let shot = open(&sandbox, "show.rhai");
    let slices = shot.slices(2).unwrap();
    let times: Vec<f64> = slices.iter().map(|s| s.time).collect();
    let expected = [-0.23, -0.09, 0.05, 0.19, 0.33];
    assert!(times.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12) && times.len() == 5, "{times:?}");
    // The picture's settings are those of the frame's own time, a third of the way.
    for slice in &slices {
        let [render]: [&Render; 1] = renders(&slice.edits).try_into().unwrap();
        assert!((render.background.x - 1.0 / 3.0).abs() < 1e-12);
    }
    assert_ne!(slices[0].edits, slices[1].edits);
    assert_eq!(slices, shot.slices(2).unwrap());
}

fn renders(edits: &[Edit]) -> Vec<&Render> {
    edits.iter().filter_map(|edit| if let Edit::Render(render) = edit { Some(render) } else { None }).collect()
}

/// The entity stands in the space of one in motion, and is in motion itself.
#[test]
fn a_rack_and_a_focus_find_an_entity_in_motion_at_one_place() {
    let sandbox = Sandbox::new();
    let scene = r#"(
        camera: (from: (0.0, 1.0, 6.0), at: (0.0, 0.0, 0.0), aperture: 0.3, shutter: (0.2, 0.8)),
        render: (size: (32, 24), samples: 9, shutter_slices: 3, background: (0.2, 0.3, 0.5)),
        entities: [
            (name: "cart", transform: (translation: (0.0, 0.0, -1.0), rotation: (0.0, 30.0, 0.0)),
                motion: (displacement: (0.0, 0.0, 2.0))),
            (name: "ball", sphere: (radius: 0.6), transform: (translation: (0.4, 0.0, 0.2), parent: "cart"),
                motion: (displacement: (1.0, 0.0, 0.5), start: -1.0, end: 3.0)),
            (plane: (point: (0.0, -0.6, 0.0))),
            (name: "lamp", point_light: (position: (2.0, 5.0, 3.0))),
        ],
    )"#;
    let script = |focus: &str| format!("animation(#{{ scene: \"scene.ron\" }});\nfn frame(s, f) {{ {focus} }}");
    sandbox.write("scene.ron", scene);
    sandbox.write("rack.rhai", script("s.camera.focus_distance = rack(\"ball\", \"ball\", 0.5);"));
    sandbox.write("focus.rhai", script("s.camera.focus = \"ball\";"));
    sandbox.write("still.rhai", script("s.camera.focus_distance = 6.2;"));
    for name in ["rack", "focus", "still"] {
        sandbox.anim(&format!("{name}.rhai -o {name}.png")).ok();
    }
    let racked = picture(&sandbox, "rack.png");
    assert_eq!(racked, picture(&sandbox, "focus.png"));
    assert_ne!(racked, picture(&sandbox, "still.png"));
}

#[test]
fn a_mistake_between_frames_is_found_and_keeps_to_its_frame() {
    let sandbox = show();
    let mistake = SHOW.replace("if f.t", "if f.number == 3 && f.t > 0.67 && f.t < 0.7 { s.get(\"bal\"); }\nif f.t");
    sandbox.write("wrong.rhai", mistake);
    let said = ["wrong.rhai:8:", "in frame 3: there is no entity `bal`", "did you mean `ball`?"];
    sandbox.anim("check wrong.rhai").fails(3, &said);
    // The other frames are made.
    sandbox.anim("wrong.rhai -o out").fails(4, &said);
    assert!(sandbox.exists("out/wrong.0002.png") && !sandbox.exists("out/wrong.0003.png"));
    let behind = SHOW.replace(
        "if f.t",
        "s.camera.aperture = 0.1; if f.t > 0.4 && f.t < 0.5 { s.camera.focus = [0, 2, -99]; }\nif f.t",
    );
    sandbox.write("behind.rhai", behind);
    sandbox.anim("check behind.rhai").fails(3, &["in frame 2: the camera is focused on the point, which is behind it"]);
}

/// The mean brightness of each column of a frame.
fn columns(sandbox: &Sandbox, frame: u32) -> Vec<f64> {
    let picture = picture(sandbox, &format!("out/show.{frame:04}.png"));
    let column = |x: u32| (0..picture.height()).map(|y| f64::from(picture.get_pixel(x, y).0[0])).sum::<f64>();
    (0..picture.width()).map(|x| column(x) / f64::from(picture.height())).collect()
}

#[test]
fn the_ends_of_a_clip_are_blurred_as_its_middle_is() {
    let sandbox = Sandbox::new();
    // A ball that goes 12 pixels from frame to frame: six of them while the shutter is open.
    sandbox.write("ball.ron", ball(3.0, 0.0, "shutter: (-0.25, 0.25)", "samples: 64, shutter_slices: 64")).write(
        "show.rhai",
        "animation(#{ scene: \"ball.ron\", frames: 3 });
         fn frame(s, f) { let ball = s.entities()[0]; ball.translation = [2.4 * f.t - 1.2, 0, 0]; }",
    );
    sandbox.anim("show.rhai -o out/").ok();
    let middle = columns(&sandbox, 2);
    for (frame, shift) in [(1, -12i32), (3, 12)] {
        let moved = columns(&sandbox, frame);
        for (x, value) in middle.iter().enumerate() {
            let there = usize::try_from(x as i32 + shift).ok().and_then(|x| moved.get(x));
            assert!(there.is_none_or(|there| (there - value).abs() < 4.0), "frame {frame}, column {x}");
        }
    }
}

#[test]
fn what_moves_by_the_frames_number_is_said_to_be_sharp() {
    let sandbox = Sandbox::new();
    let show = |shutter: &str, by: &str| {
        let text = format!(
            "animation(#{{ scene: \"ball.ron\", frames: 8 }});
             fn frame(s, f) {{ s.camera.shutter = {shutter}; s.get(\"ball\").translation.x = 0.1 * {by}; }}"
        );
        sandbox.write("ball.ron", "(entities: [(name: \"ball\", sphere: ()), (point_light: (position: (0, 5, 5)))])");
        sandbox.write("show.rhai", text).anim("check show.rhai").ok().stderr
    };
    let said = show("[0, 0.5]", "f.index");
    assert!(
        said.contains("show.rhai:2:") && said.contains("`ball` moves from frame to frame and stands still"),
        "{said}"
    );
    for (shutter, by) in
        [("[0, 0.5]", "f.seconds"), ("[0, 0.5]", "(f.index + f.t)"), ("[0, 0]", "f.index"), ("[0, 1]", "3")]
    {
        let said = show(shutter, by);
        assert!(!said.contains("stands still"), "{shutter} {by}: {said}");
    }
}

/// A small ball that flies past in few moments leaves a smear, and not a row of beads.
#[test]
fn what_flies_fast_leaves_no_beads() {
    let sandbox = Sandbox::new();
    // Fifteen pixels while the shutter is open, in four moments: a step is longer than the ball is wide.
    sandbox.write("ball.ron", ball(1.5, 0.0, "shutter: (0.0, 0.5)", "samples: 64, shutter_slices: 4")).write(
        "show.rhai",
        "animation(#{ scene: \"ball.ron\", frames: 3 });
         fn frame(s, f) { let ball = s.entities()[0]; ball.translation = [3.0 * (f.seconds * f.fps - 0.25), 0, 0]; }",
    );
    sandbox.anim("show.rhai --frames 1 -o out/").ok();
    let dark = |x: usize| 255.0 - columns(&sandbox, 1)[x];
    let (first, last) = (dark(12), dark(34));
    // Its middle goes from column 16.5 to 31.5.
    let columns: Vec<f64> = (18..30).map(dark).collect();
    let mean = columns.iter().sum::<f64>() / columns.len() as f64;
    assert!(columns.iter().all(|one| (one / mean - 1.0).abs() < 0.3), "{columns:?}");
    assert!(first < 0.2 * mean && last < 0.2 * mean, "{first} {last} {mean}");
}
