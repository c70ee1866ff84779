//! Motion as a layer, against projections that are known.

use exr::prelude::read_all_data_from_file;
use glam::{DMat3, DVec2, DVec3};

use crate::tool::Sandbox;

const SIZE: [usize; 2] = [40, 30];

/// Values of a channel of frame `frame`, rendered into a folder.
fn channel(sandbox: &Sandbox, folder: &str, frame: u32, name: &str) -> Vec<f32> {
    let image = read_all_data_from_file(sandbox.path(&format!("{folder}/f.{frame:04}.exr"))).unwrap();
    let list = &image.layer_data[0].channel_data.list;
    let found = list.iter().find(|c| c.name.eq(name)).unwrap_or_else(|| panic!("{name}"));
    found.sample_data.levels_as_slice()[0].values_as_f32().collect()
}

/// The pixels of a frame: number of the entity, place in the world, motion.
fn pixels(sandbox: &Sandbox, folder: &str, frame: u32) -> Vec<(f32, DVec3, DVec2)> {
    let of = |name: &str| channel(sandbox, folder, frame, name);
    let (id, place) = (of("entityId"), ["P.X", "P.Y", "P.Z"].map(of));
    let motion = ["motion.X", "motion.Y"].map(of);
    let axis = |columns: &[Vec<f32>], axis: usize, i: usize| f64::from(columns[axis][i]);
    let vector = |i: usize| DVec3::from_array([0, 1, 2].map(|a| axis(&place, a, i)));
    (0..id.len()).map(|i| (id[i], vector(i), DVec2::new(axis(&motion, 0, i), axis(&motion, 1, i)))).collect()
}

/// A scene whose frames are made by a script.
fn sandbox(header: &str, camera: &str, entities: &str, frame: &str) -> Sandbox {
    let sandbox = Sandbox::new();
    let scene = format!(
        "(camera: ({camera}),
          render: (size: ({}, {}), samples: 1, aovs: [Motion, Position, Entity]), entities: [{entities}])",
        SIZE[0], SIZE[1]
    );
    sandbox.write("f.ron", scene).write(
        "f.rhai",
        format!("animation(#{{ scene: \"f.ron\", {header} }});\nfn frame(s, f) {{ let n = f.number; {frame} }}"),
    );
    sandbox.anim("f.rhai -o out/f.####.exr").ok();
    sandbox
}

/// Where a point is in a picture, in pixels from the bottom left, as a textbook has it.
fn project(from: DVec3, at: DVec3, fov: f64, point: DVec3) -> DVec2 {
    let back = (from - at).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let local = DMat3::from_cols(right, back.cross(right), back).transpose() * (point - from);
    let scale = 0.5 * SIZE[1] as f64 / (fov.to_radians() / 2.0).tan();
    DVec2::new(local.x, local.y) / -local.z * scale + DVec2::new(SIZE[0] as f64, SIZE[1] as f64) / 2.0
}

/// Camera, its field of view and a pivot all move; a ball stands in the space of the pivot, a box does not move.
#[test]
fn every_pixel_points_from_where_its_surface_was() {
    let sandbox = sandbox(
        "frames: 3",
        "",
        r#"(name: "pivot", transform: ()),
           (sphere: (radius: 0.8), transform: (translation: (0.5, 0.3, 0.0), parent: "pivot")),
           (aabox: (min: (-3.0, -2.0, -2.0), max: (3.0, -1.0, 2.0)))"#,
        "let p = s.get(\"pivot\"); p.yaw = 20.0 * n; p.scale = 1.0 + 0.1 * n; p.translation = [0.2 * n, 0.1 * n, 0];
         s.camera.from = [0.5 * n, 0.5, 6.0 - 0.5 * n]; s.camera.at = [0.1 * n, 0, 0]; s.camera.fov = 40.0 + 3.0 * n;",
    );
    let seen = |n: f64, point: DVec3| {
        project(DVec3::new(0.5 * n, 0.5, 6.0 - 0.5 * n), DVec3::new(0.1 * n, 0.0, 0.0), 40.0 + 3.0 * n, point)
    };
    let placed = |n: f64, local: DVec3| {
        let turn = DMat3::from_rotation_y((20.0 * n).to_radians());
        turn * (local * (1.0 + 0.1 * n)) + DVec3::new(0.2 * n, 0.1 * n, 0.0)
    };
    let local = |n: f64, world: DVec3| {
        let turn = DMat3::from_rotation_y((20.0 * n).to_radians()).transpose();
        turn * (world - DVec3::new(0.2 * n, 0.1 * n, 0.0)) / (1.0 + 0.1 * n)
    };
    let (mut on_ball, mut on_box) = (0, 0);
    for (frame, n) in [(2, 2.0), (3, 3.0)] {
        for (id, point, motion) in pixels(&sandbox, "out", frame) {
            let was = if id == 2.0 { placed(n - 1.0, local(n, point)) } else { point };
            let expected = if id == 0.0 { DVec2::ZERO } else { seen(n, point) - seen(n - 1.0, was) };
            assert!((motion - expected).length() < 2e-3, "{id} {point}: {motion} instead of {expected}");
            on_ball += i32::from(id == 2.0);
            on_box += i32::from(id == 3.0 && motion.length() > 0.5);
        }
    }
    assert!(on_ball > 60 && on_box > 200, "{on_ball} {on_box}");
    assert!(pixels(&sandbox, "out", 1).iter().all(|(_, _, motion)| *motion == DVec2::ZERO));
}

const AFAR: &str = "from: (0.0, 0.0, 1000.0), at: (0.0, 0.0, 0.0), fov: 0.17188727";

/// From so far away a pixel is 0.1 units wide everywhere: the picture of a ball moves as the layer says. An entity's
/// `motion` is the same in every frame, and a lens moves nothing.
#[test]
fn the_picture_moves_by_the_vectors() {
    let ball = r#"(name: "ball", sphere: (radius: 0.5), transform: (), motion: (displacement: (0.7, 0.0, 0.0)))"#;
    let open = "s.camera.shutter = [0.0, 0.5]; s.camera.aperture = 0.3; s.render.samples = 16;";
    for shutter in ["", open] {
        let script = format!("s.get(\"ball\").translation = [1.0 - 0.5 * (n + f.t), 0.3 * (n + f.t), 0.0]; {shutter}");
        let sandbox = sandbox("frames: 2", AFAR, ball, &script);
        let mean = |of: &[DVec2]| of.iter().sum::<DVec2>() / of.len() as f64;
        let centre = |frame: u32| {
            let pixels = pixels(&sandbox, "out", frame);
            let place = |i: usize| DVec2::new((i % SIZE[0]) as f64, -((i / SIZE[0]) as f64));
            mean(&(0..pixels.len()).filter(|i| pixels[*i].0 == 1.0).map(place).collect::<Vec<_>>())
        };
        let moved: Vec<DVec2> = pixels(&sandbox, "out", 2).iter().filter(|p| p.0 == 1.0).map(|p| p.2).collect();
        let by = centre(2) - centre(1);
        assert!(moved.len() > 50 && (mean(&moved) - by).length() < 0.4, "{} {by}", mean(&moved));
        // Two frames of a clip are 1 apart, and every moment within the shutter as far from its like in the frame before.
        let is_near = |m: &DVec2| (*m - DVec2::new(-10.0, 6.0)).length() < 0.02;
        assert!(moved.iter().all(is_near), "{moved:?}");
    }
}

#[test]
fn the_first_frame_of_a_loop_follows_the_last() {
    let ball = r#"(name: "ball", sphere: (radius: 0.5), transform: ())"#;
    let script = "s.get(\"ball\").translation = [0.2 * n, 0.0, 0.0];";
    for (header, expected) in [("frames: 3, mode: \"loop\"", -4.0), ("frames: 3", 0.0)] {
        let sandbox = sandbox(header, AFAR, ball, script);
        let moved: Vec<DVec2> = pixels(&sandbox, "out", 1).iter().filter(|p| p.0 == 1.0).map(|p| p.2).collect();
        assert!(moved.len() > 50 && moved.iter().all(|m| (m.x - expected).abs() < 0.02 && m.y.abs() < 0.02));
    }
}

#[test]
fn what_was_not_there_before_has_not_moved() {
    let script = |name: &str| {
        format!(
            "s.spawn(#{{ name: {name}, sphere: #{{ radius: 0.5 }}, translation: [0.2 * n, 0, 0] }});
             if n == 1 {{ s.despawn(s.get(\"late\")); }}"
        )
    };
    let late = r#"(name: "late", sphere: (radius: 0.3), transform: (translation: (0.0, 1.0, 0.0)))"#;
    for (name, expected) in [("\"same\"", 2.0), ("\"other\" + n", 0.0)] {
        let sandbox = sandbox("frames: 2", AFAR, late, &script(name));
        let of =
            |id: f32| -> Vec<DVec2> { pixels(&sandbox, "out", 2).iter().filter(|p| p.0 == id).map(|p| p.2).collect() };
        assert!(of(1.0).len() > 20 && of(1.0).iter().all(|m| *m == DVec2::ZERO));
        assert!(of(2.0).len() > 50 && of(2.0).iter().all(|m| (m.x - expected).abs() < 0.02), "{:?}", of(2.0));
    }
}

#[test]
fn bytes_do_not_depend_on_threads_order_or_what_was_there() {
    let entities = r#"(name: "a", sphere: (radius: 0.9), transform: ()), (name: "b", aabox: (), transform: (parent: "a")),
        (name: "lamp", point_light: (position: (1.0, 5.0, 3.0)))"#;
    let script = "s.render.samples = 9; let a = s.get(\"a\"); a.yaw = 15.0 * (if n == 3 { 2 } else { n });
        a.translation.x = 0.3 * f.t; s.get(\"lamp\").color = [1, f.t, 0]; if n == 4 { s.camera.shutter = [0, 0.5]; }";
    let sandbox = sandbox("frames: 4, mode: \"loop\"", "from: (0.0, 2.0, 5.0)", entities, script);
    let files = |folder: &str| [1, 2, 3, 4].map(|n| sandbox.read(&format!("{folder}/f.{n:04}.exr")));
    let all = files("out");
    sandbox.anim("f.rhai -o one/f.####.exr --threads 1 --accel brute --no-reuse").ok();
    sandbox.anim("f.rhai -o two/f.####.exr --threads 3 --frames 4,2").ok();
    sandbox.anim("f.rhai -o two/f.####.exr --frames 3,1").ok();
    assert!(files("one") == all && files("two") == all);
    // Only the first frame's own numbers change: the second is another one too.
    let changed =
        String::from_utf8(sandbox.read("f.rhai")).unwrap().replace("15.0 *", "(if n == 1 { 9.0 } else { 15.0 }) *");
    sandbox.write("f.rhai", changed);
    sandbox.anim("f.rhai -o out/f.####.exr").ok();
    sandbox.anim("f.rhai -o fresh/f.####.exr --no-reuse").ok();
    let now = files("out");
    assert!(now == files("fresh"));
    assert_eq!([0, 1, 2, 3].map(|i| now[i] == all[i]), [false, false, true, true]);
}
