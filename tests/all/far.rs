//! Scenes far from the origin, and coarse meshes where their light ends.

use std::fmt::Write;
use std::sync::atomic::AtomicBool;

use anim::load::load_scene;
use anim::systems;

use crate::tool::Sandbox;

const SIDE: u32 = 48;

/// The linear pixels of a scene beside the files of a sandbox, at one moment.
fn rendered(sandbox: &Sandbox, scene: &str) -> Vec<[f32; 3]> {
    sandbox.write("scene.ron", scene);
    let (scene, _) = load_scene(&sandbox.path("scene.ron"), false).unwrap_or_else(|e| panic!("{e}"));
    let mut stage = systems::spawn(scene).unwrap_or_else(|e| panic!("{e}"));
    let never = AtomicBool::new(false);
    let film = systems::render(&mut stage, &never, &|_, _| {}).unwrap_or_else(|e| panic!("{e}"));
    film.expect("nobody interrupts").0.pixels
}

/// Share of pixels that differ by more than 8 of 255.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let differs =
        |(a, b): &(&[f32; 3], &[f32; 3])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 8.0 / 255.0 || a.is_nan());
    a.iter().zip(b).filter(differs).count() as f64 / a.len() as f64
}

/// A point as a scene writes it, moved.
fn at(by: [f64; 3], point: [f64; 3]) -> String {
    let [x, y, z] = [0, 1, 2].map(|i| point[i] + by[i]);
    format!("({x:?}, {y:?}, {z:?})")
}

/// A ball that mirrors, a box that is turned, a mesh from a file, a floor that leans and a lamp.
fn scene(by: [f64; 3], integrator: &str) -> String {
    let at = |point| at(by, point);
    format!(
        "(
            camera: (from: {}, at: {}, fov: 36.0),
            render: (size: ({SIDE}, {SIDE}), samples: 1, integrator: {integrator}, background: (0.1, 0.2, 0.4), seed: Some(7)),
            materials: {{ \"m\": (color: (0.8, 0.5, 0.3), specular: 0.0, reflection: 0.2), \"f\": (color: (0.6, 0.6, 0.6)) }},
            entities: [
                (sphere: (radius: 0.8), transform: (translation: {}), material: \"m\"),
                (aabox: (min: (-0.6, -0.6, -0.6), max: (0.6, 0.6, 0.6)),
                    transform: (translation: {}, rotation: (0.0, 30.0, 0.0)), material: \"m\"),
                (mesh: (file: \"grid.obj\"), material: \"m\"),
                (plane: (point: {}, normal: (0.05, 1.0, 0.02)), material: \"f\"),
                (point_light: (position: {})),
            ],
        )",
        at([2.0, 1.6, 6.0]),
        at([0.0, 0.5, 0.0]),
        at([-0.9, 0.8, 0.0]),
        at([0.9, 0.6, 0.2]),
        at([0.0, 0.0, 0.0]),
        at([4.0, 7.0, 5.0]),
    )
}

/// A tent in the coordinates of a national grid.
fn grid(by: [f64; 3]) -> String {
    let mut text = String::new();
    for [x, y, z] in [[-0.3, 1.2, 0.5], [0.4, 1.2, 0.5], [0.4, 1.2, 1.1], [-0.3, 1.2, 1.1], [0.05, 1.73, 0.8]] {
        writeln!(text, "v {:?} {:?} {:?}", x + by[0], y + by[1], z + by[2]).unwrap();
    }
    text + "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"
}

#[test]
fn scenes_far_from_the_origin_look_as_those_at_it() {
    for integrator in ["Whitted", "Path"] {
        let near = Sandbox::new();
        near.write("grid.obj", grid([0.0; 3]));
        let wanted = rendered(&near, &scene([0.0; 3], integrator));
        for by in [[1e6, 1e6, -1e6], [1e7, -1e7, 1e7], [4_096.0, 0.0, 0.0], [0.0, 0.0, 3e8]] {
            let far = Sandbox::new();
            far.write("grid.obj", grid(by));
            let off = difference(&rendered(&far, &scene(by, integrator)), &wanted);
            assert!(off <= 0.001, "{integrator} at {by:?}: {off}");
        }
    }
}

#[test]
fn what_lies_beyond_reach_is_an_error() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", "(entities: [(sphere: (), transform: (translation: (2e9, 0.0, 0.0)))])");
    sandbox.anim("check a.ron").fails(3, &["a.ron:1:", "1e9"]);
}

/// A ball of few facets with the normals of a round one.
fn ball(around: u32) -> String {
    let (mut text, rings) = (String::new(), around / 2);
    for ring in 0..=rings {
        for step in 0..around {
            let [polar, turn] =
                [f64::from(ring) / f64::from(rings) * 180.0, f64::from(step) / f64::from(around) * 360.0];
            let [(sp, cp), (st, ct)] = [polar, turn].map(anim::base::math::sin_cos_degrees);
            let [x, y, z] = [sp * st, cp, sp * ct];
            writeln!(text, "v {x} {y} {z}\nvn {x} {y} {z}").unwrap();
        }
    }
    for ring in 0..rings {
        for step in 0..around {
            let vertex = |ring: u32, step: u32| ring * around + step % around + 1;
            let [a, b] = [vertex(ring, step), vertex(ring, step + 1)];
            let [c, d] = [vertex(ring + 1, step), vertex(ring + 1, step + 1)];
            writeln!(text, "f {a}//{a} {c}//{c} {d}//{d}\nf {a}//{a} {d}//{d} {b}//{b}").unwrap();
        }
    }
    text
}

fn lit_ball(shape: &str, integrator: &str) -> String {
    format!(
        "(
            camera: (from: (0.0, 0.0, 5.0), at: (0.0, 0.0, 0.0), fov: 26.0),
            render: (size: ({SIDE}, {SIDE}), samples: 4, max_depth: 1, integrator: {integrator}, seed: Some(3)),
            materials: {{ \"m\": (model: {}, color: (0.9, 0.9, 0.9)) }},
            entities: [(name: \"b\", {shape}, material: \"m\"), (point_light: (position: (90.0, 20.0, 17.5)))],
        )",
        if integrator == "Path" { "Lambert" } else { "BlinnPhong" }
    )
}

/// The greatest difference of neighbours in a row, as a share of the light: an edge that should not be there. The rim of the
/// ball is left out.
fn hardest_edge(pixels: &[[f32; 3]]) -> f32 {
    let brightest = pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
    let middle = |i: u32| i as f32 + 0.5 - SIDE as f32 / 2.0;
    let inside = |x: u32, y: u32| middle(x).hypot(middle(y)) < 0.36 * SIDE as f32;
    let mut hardest = 0.0f32;
    for y in 0..SIDE {
        for x in (1..SIDE).filter(|x| inside(*x, y) && inside(*x - 1, y)) {
            let [a, b] = [x - 1, x].map(|x| pixels[(y * SIDE + x) as usize][0]);
            hardest = hardest.max((a - b).abs() / brightest);
        }
    }
    hardest
}

/// Where a facet turned away from the light begins, a fifth of the light would end at once.
#[test]
fn the_light_of_a_coarse_smooth_mesh_ends_softly() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.obj", ball(16));
    for integrator in ["Whitted", "Distribution", "Path"] {
        let coarse = rendered(&sandbox, &lit_ball("mesh: (file: \"ball.obj\")", integrator));
        let round = rendered(&sandbox, &lit_ball("sphere: (radius: 1.0)", integrator));
        let [coarse, round] = [coarse, round].map(|pixels| hardest_edge(&pixels));
        assert!(coarse < round + 0.06, "{integrator}: {coarse}, of a round one {round}");
    }
}

/// Smooth normals in a closed room: no light comes in at its corners.
#[test]
fn smooth_normals_let_no_light_into_a_closed_room() {
    let sandbox = Sandbox::new();
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let mut text = String::new();
    for [x, y, z] in (0..8).map(corner) {
        writeln!(text, "v {x} {y} {z}\nvn {} {} {}", -x, -y, -z).unwrap();
    }
    for face in [[1, 2, 4, 3], [5, 7, 8, 6], [1, 5, 6, 2], [3, 4, 8, 7], [1, 3, 7, 5], [2, 6, 8, 4]] {
        let corners = face.map(|i| format!("{i}//{i}")).join(" ");
        writeln!(text, "f {corners}").unwrap();
    }
    sandbox.write("room.obj", text);
    for integrator in ["Whitted", "Path"] {
        let scene = format!(
            "(
                camera: (from: (0.5, 0.3, 0.9), at: (-0.6, -0.4, -1.0), fov: 80.0),
                render: (size: ({SIDE}, {SIDE}), samples: 4, integrator: {integrator}, seed: Some(3)),
                materials: {{ \"m\": (model: Lambert, color: (0.9, 0.9, 0.9), two_sided: true) }},
                entities: [(mesh: (file: \"room.obj\", smooth: true), material: \"m\"),
                    (point_light: (position: (3.0, 4.0, 5.0))), (point_light: (position: (-5.0, -1.5, -2.0)))],
            )"
        );
        let lit = rendered(&sandbox, &scene).iter().filter(|pixel| pixel.iter().any(|x| *x > 0.0)).count();
        assert_eq!(lit, 0, "{integrator}");
    }
}
