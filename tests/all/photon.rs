//! Photon mapping: against path tracing, which knows nothing of photons, and against closed forms.

use crate::tool::{Sandbox, picture};

type Picture = image::Rgb32FImage;

/// Means of the channels over a block of the picture's n x n.
fn blocks(picture: &Picture, n: u32) -> Vec<[f32; 3]> {
    let (w, h) = (picture.width() / n, picture.height() / n);
    let block = |i: u32| {
        let (left, top) = (i % n * w, i / n * h);
        let pixels = (0..w * h).map(|k| picture.get_pixel(left + k % w, top + k / w).0);
        let sum = pixels.fold([0.0f32; 3], |sum, p| std::array::from_fn(|c| sum[c] + p[c]));
        sum.map(|s| s / (w * h) as f32)
    };
    (0..n * n).map(block).collect()
}

/// Photon map and path tracer of a scene: the largest difference of blocks, over the mean, and that of the whole.
fn compare(scene: &str, photon: &str, path: &str, n: u32) -> (f32, f32) {
    let sandbox = Sandbox::new();
    let [a, b] = [format!("--integrator photon {photon}"), format!("--integrator path {path}")]
        .map(|arguments| picture(&sandbox, scene, &arguments));
    let whole = |p: &Picture| blocks(p, 1)[0].iter().sum::<f32>() / 3.0;
    let mean = whole(&b);
    assert!(mean > 0.02 && mean < 0.9, "{mean}");
    let off = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    let worst = blocks(&a, n).iter().zip(&blocks(&b, n)).map(off).fold(0.0, f32::max);
    (worst / mean, whole(&a) / mean - 1.0)
}

/// A room with walls of two colours, and things in it.
fn room(render: &str, materials: &str, entities: &str) -> String {
    format!(
        r#"(
        camera: (from: (0.0, 1.0, 3.4), at: (0.0, 1.0, 0.0), fov: 38.0),
        render: (size: (24, 24), transfer: Linear, {render}),
        materials: {{
            "white": (model: Lambert, color: (0.7, 0.7, 0.7)),
            "red": (model: Lambert, color: (0.6, 0.1, 0.1)),
            "lamp": (model: Lambert, color: (0.0, 0.0, 0.0), emission: (2.0, 1.8, 1.5)),
            {materials}
        }},
        entities: [
            (aabox: (min: (-1.1, -0.1, -1.0), max: (1.1, 0.0, 1.0)), material: "white"),
            (aabox: (min: (-1.1, 2.0, -1.0), max: (1.1, 2.1, 1.0)), material: "white"),
            (aabox: (min: (-1.1, 0.0, -1.1), max: (1.1, 2.0, -1.0)), material: "white"),
            (aabox: (min: (-1.1, 0.0, -1.0), max: (-1.0, 2.0, 1.0)), material: "red"),
            (aabox: (min: (1.0, 0.0, -1.0), max: (1.1, 2.0, 1.0)), material: "white"),
            {entities}
        ],
    )"#
    )
}

#[test]
fn a_room_looks_as_path_tracing_has_it() {
    let scene = room(
        "photons: 12000, photon_passes: 9, max_depth: 7",
        r#""gold": (model: Conductor, color: (0.9, 0.7, 0.3), roughness: 0.3),
           "gloss": (color: (0.2, 0.3, 0.6), specular: 0.0, reflection: 0.3, gloss: 0.15),"#,
        r#"(aabox: (min: (-0.4, 1.9, -0.4), max: (0.4, 1.95, 0.4)), material: "lamp"),
           (sphere: (center: (-0.45, 0.4, -0.3), radius: 0.4), material: "gold"),
           (aabox: (min: (0.1, 0.0, -0.2), max: (0.7, 0.7, 0.4)), material: "gloss"),"#,
    );
    let (worst, whole) = compare(&scene, "--spp 36", "--spp 196", 3);
    assert!(worst < 0.09 && whole.abs() < 0.025, "{worst} {whole}");
}

/// Light that photons do not carry: of a sky, of a lamp that does not fall off, of a shape that is no light to ask.
#[test]
fn what_sends_no_photons_is_not_lost() {
    let scene = r#"(
        camera: (from: (0.0, 2.5, 5.0), at: (0.0, 0.4, 0.0), fov: 34.0),
        render: (size: (24, 24), transfer: Linear, photons: 12000, photon_passes: 9, max_depth: 6,
            sky: ((0.2, 0.3, 0.5), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1))),
        materials: {
            "white": (model: Lambert, color: (0.7, 0.7, 0.7)),
            "coat": (model: Plastic, color: (0.6, 0.3, 0.2), ior: 1.5, roughness: 0.3),
            "tube": (model: Lambert, color: (0.0, 0.0, 0.0), emission: (1.5, 1.0, 0.5)),
        },
        entities: [
            (plane: (), material: "white"),
            (aabox: (min: (-1.6, 0.0, -1.2), max: (1.6, 1.6, -1.0)), material: "white"),
            (sphere: (center: (0.3, 0.5, 0.0), radius: 0.5), material: "coat"),
            (cylinder: (base: (-1.0, 0.3, 0.4), apex: (-0.4, 0.3, 0.6), radius: 0.15), material: "tube"),
            (point_light: (position: (2.0, 3.0, 2.0), color: (0.2, 0.2, 0.2))),
            (point_light: (position: (-1.0, 2.0, 1.0), color: (0.5, 0.5, 0.7), falloff: InverseSquare)),
        ],
    )"#;
    let (worst, whole) = compare(scene, "--spp 36", "--spp 196", 3);
    assert!(worst < 0.09 && whole.abs() < 0.025, "{worst} {whole}");
}

/// A glass ball before a lamp so wide that path tracing finds it by chance.
#[test]
fn a_caustic_has_the_energy_that_brute_force_finds() {
    let scene = r#"(
        camera: (from: (0.0, 3.0, 0.01), at: (0.0, 0.0, 0.0), fov: 30.0),
        render: (size: (24, 24), transfer: Linear, photons: 20000, photon_passes: 9, max_depth: 6),
        materials: {
            "matt": (model: Lambert, color: (0.6, 0.6, 0.6)),
            "glass": (model: Dielectric, ior: 1.5, absorption: (0.1, 0.4, 0.9)),
        },
        entities: [
            (aabox: (min: (-2.0, -0.2, -2.0), max: (2.0, 0.0, 2.0)), material: "matt"),
            (sphere: (center: (0.9, 0.6, 0.0), radius: 0.45), material: "glass"),
            (transform: (translation: (2.4, 1.6, 0.0), rotation: (0.0, 0.0, 60.0)),
                area_light: (size: (1.2, 1.2), color: (4.0, 4.0, 4.0), falloff: InverseSquare)),
        ],
    )"#;
    let (worst, whole) = compare(scene, "--spp 16", "--spp 400", 2);
    assert!(worst < 0.13 && whole.abs() < 0.025, "{worst} {whole}");
}

/// In a hollow ball whose inside shines by E and gives back the share a, radiance is E / (1 - a) everywhere.
#[test]
fn a_furnace_reaches_its_balance() {
    let scene = r#"(
        camera: (from: (0.0, 0.0, 0.0), at: (1.0, 0.0, 0.0), fov: 30.0),
        render: (size: (12, 12), samples: 16, integrator: Photon, max_depth: 24, transfer: Linear,
            photons: 10000, photon_passes: 9),
        materials: { "wall": (model: Lambert, color: (0.5, 0.5, 0.5), emission: (0.2, 0.2, 0.2)) },
        entities: [(sphere: (radius: -1.0), material: "wall")],
    )"#;
    let [found, ..] = blocks(&picture(&Sandbox::new(), scene, ""), 1)[0];
    assert!((found - 0.4).abs() < 0.012, "{found}");
}

#[test]
fn photons_are_the_same_whatever_finds_their_ways() {
    let sandbox = Sandbox::new();
    let scene = room(
        "photons: 9000, photon_passes: 3, max_depth: 6, samples: 4, integrator: Photon, shutter_slices: 2",
        r#""glass": (model: Dielectric, ior: 1.5),"#,
        r#"(area_light: (position: (0.0, 1.9, 0.0), color: (0.8, 0.8, 0.8), falloff: InverseSquare)),
           (sphere: (center: (0.3, 0.4, 0.2), radius: 0.3), material: "glass",
            motion: (displacement: (0.3, 0.0, 0.0))),"#,
    )
    .replace("fov: 38.0", "fov: 38.0, shutter: (0.0, 0.5)");
    let one = picture(&sandbox, &scene, "--threads 1 --accel brute");
    assert_eq!(picture(&sandbox, &scene, "--threads 3 --accel bvh"), one);
    assert_eq!(picture(&sandbox, &scene, "--threads 2 --accel grid"), one);
    assert_ne!(picture(&sandbox, &scene, "--seed 7"), one);
}

#[test]
fn impossible_settings_are_explained() {
    let sandbox = Sandbox::new();
    for (setting, said) in [
        ("photons: 0", "`photons`"),
        ("photon_passes: 0", "`photon_passes`"),
        ("photon_radius: 0.0", "`photon_radius`"),
    ] {
        sandbox.write("scene.ron", format!("(render: ({setting}))"));
        sandbox.anim("check scene.ron").fails(3, &["scene.ron:1:", said]);
    }
}

/// The same in a room of six walls, whose corners the disks that photons are looked for in reach beyond.
#[test]
fn the_corner_of_a_furnace_is_as_bright_as_its_walls() {
    let wall = |axis: usize, end: f32| {
        let (mut low, mut high) = ([-1.1; 3], [1.1; 3]);
        (low[axis], high[axis]) = (end.min(1.1 * end), end.max(1.1 * end));
        format!("(aabox: (min: {low:?}, max: {high:?}), material: \"wall\"),").replace('[', "(").replace(']', ")")
    };
    let walls: String = (0..6).map(|i| wall(i / 2, if i % 2 == 0 { -1.0 } else { 1.0 })).collect();
    let scene = format!(
        r#"(
        camera: (from: (0.0, 0.1, 0.0), at: (1.0, 1.0, 1.0), fov: 20.0),
        render: (size: (12, 12), samples: 16, integrator: Photon, max_depth: 40, transfer: Linear,
            photons: 40000, photon_passes: 4, photon_radius: 0.4),
        materials: {{ "wall": (model: Lambert, color: (0.8, 0.8, 0.8), emission: (0.08, 0.08, 0.08)) }},
        entities: [{walls}],
    )"#
    );
    // A quarter of a disk at the corner holds photons: without a look at where walls end it is 0.34.
    let found = blocks(&picture(&Sandbox::new(), &scene, ""), 2);
    assert!(found.iter().all(|block| (block[0] - 0.4).abs() < 0.025), "{found:?}");
    let mean = found.iter().map(|block| block[0]).sum::<f32>() / 4.0;
    assert!((mean - 0.4).abs() < 0.01, "{mean}");
}
