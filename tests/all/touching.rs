//! Surfaces that touch, bodies in bodies, and what a clamp may cut: against the same scene without the difficulty.

use crate::tool::{self, Sandbox, mean};

fn picture(scene: &str) -> image::Rgb32FImage {
    let sandbox = Sandbox::new();
    tool::picture(&sandbox, scene, "")
}

fn deviation(picture: &image::Rgb32FImage) -> f32 {
    let mean = mean(picture);
    let squares = picture.pixels().map(|p| (p.0[0] - mean) * (p.0[0] - mean)).sum::<f32>();
    (squares / (picture.width() * picture.height()) as f32).sqrt()
}

fn close(name: &str, found: &image::Rgb32FImage, expected: &image::Rgb32FImage, most: f32) {
    let apart =
        found.pixels().zip(expected.pixels()).map(|(a, b)| (0..3).map(|k| (a.0[k] - b.0[k]).abs()).sum::<f32>());
    let apart = apart.sum::<f32>() / (3 * found.width() * found.height()) as f32;
    assert!(apart <= most, "{name}: {apart} apart, {} {}", mean(found), mean(expected));
}

const CUBE: &str = "vertices: [(-1,0,-1),(1,0,-1),(1,0,1),(-1,0,1),(-1,1,-1),(1,1,-1),(1,1,1),(-1,1,1)], \
    triangles: [(0,1,2),(0,2,3),(4,6,5),(4,7,6),(0,4,5),(0,5,1),(1,5,6),(1,6,2),(2,6,7),(2,7,3),(3,7,4),(3,4,0)]";

/// A floor of many triangles that all lie in one plane.
fn tiles() -> String {
    let side = 40;
    let number = |x: i32, z: i32| z * (side + 1) + x;
    let place = |i: i32| (i as f32 - 20.0) * 0.2;
    let points = (0..=side).flat_map(|z| (0..=side).map(move |x| format!("({},0,{})", place(x), place(z))));
    let pair = |x: i32, z: i32| {
        let [a, b, c, d] = [number(x, z), number(x, z + 1), number(x + 1, z + 1), number(x + 1, z)];
        format!("({a},{b},{c}),({a},{c},{d})")
    };
    let triangles = (0..side).flat_map(|z| (0..side).map(move |x| pair(x, z)));
    let list = |all: Vec<String>| all.join(",");
    format!("mesh: (vertices: [{}], triangles: [{}])", list(points.collect()), list(triangles.collect()))
}

/// A floor seen through a block of glass that stands on it, or floats so far above.
fn block(floor: &str, glass: &str, material: &str, render: &str) -> String {
    format!(
        r#"(
        camera: (from: (0.3, 5.0, 2.0), at: (0.0, 0.0, 0.0), fov: 15.0),
        render: (size: (12, 12), max_depth: 10, transfer: Linear, background: (0.3, 0.3, 0.3), {render}),
        materials: {{ "g": ({material}), "f": (model: Lambert, color: (0.7, 0.7, 0.7)) }},
        entities: [({floor}, material: "f"), ({glass}, material: "g"), (point_light: (position: (2, 6, 3), color: (0.5, 0.5, 0.5)))],
    )"#
    )
}

#[test]
fn glass_on_a_floor_is_seen_as_if_it_hovered() {
    let plane = "plane: ()";
    let quad = "mesh: (vertices: [(-4,0,4),(4,0,4),(4,0,-4),(-4,0,-4)], triangles: [(0,1,2),(0,2,3)])";
    let slab = "aabox: (min: (-4, -1, -4), max: (4, 0, 4))";
    let tiles = &tiles();
    let turned = "rotation: (0, 27, 0)";
    let thin = "diffuse: 0.0, transmission: 1.0, ior: 1.0001";
    let glass = "model: Dielectric, ior: 1.5";
    let direct = "samples: 16, transparent_shadows: true";
    let path = "samples: 64, integrator: Path, seed: Some(3)";
    for (floor, material, render) in [
        (plane, thin, direct),
        (quad, thin, direct),
        (tiles, thin, direct),
        (slab, thin, direct),
        (plane, glass, path),
        (slab, glass, path),
    ] {
        for solid in ["aabox: (min: (-1, 0, -1), max: (1, 1, 1))", &format!("mesh: ({CUBE})")] {
            let at = |y: f64| format!("{solid}, transform: (translation: (0, {y}, 0), {turned})");
            let standing = picture(&block(floor, &at(0.0), material, render));
            let hovering = picture(&block(floor, &at(0.001), material, render));
            let name = format!("{floor} {solid} {material}");
            let (a, b) = (mean(&standing), mean(&hovering));
            assert!(a > 0.1 && (a / b - 1.0).abs() < 0.02, "{name}: {a} {b}");
            assert!(deviation(&standing) < deviation(&hovering) + 0.02, "{name}: {}", deviation(&standing));
        }
    }
}

/// Two flat surfaces in one plane, turned in space: one of them wins wherever they overlap, the same one everywhere.
#[test]
fn of_two_surfaces_in_one_plane_one_wins_everywhere() {
    let quad = "mesh: (vertices: [(-1.3,-1,0),(1.3,-1,0),(1.3,1,0),(-1.3,1,0)], triangles: [(0,1,2),(0,2,3)])";
    let triangle = "triangle: (vertices: ((-1.9,-1.1,0),(2.1,-1.2,0),(0.3,2.4,0)))";
    let small =
        "mesh: (vertices: [(-0.95,-0.8,0),(0.95,-0.8,0),(0.95,0.8,0),(-0.95,0.8,0)], triangles: [(0,1,2),(0,2,3)])";
    let plane = "plane: (normal: (0, 0, 1))";
    let slab = "aabox: (min: (-1.2, -0.9, -0.5), max: (1.2, 0.9, 0))";
    let render = |entities: &str| {
        picture(&format!(
            r#"(
            camera: (from: (0.4, 1.0, 9.0), at: (0.0, 0.0, 0.0), fov: 6.0),
            render: (size: (24, 24), samples: 1, integrator: Whitted, transfer: Linear),
            materials: {{ "a": (color: (1, 0, 0)), "b": (color: (0, 1, 0)) }},
            entities: [{entities} (point_light: (position: (2, 6, 9)))],
        )"#
        ))
    };
    let of = |shape: &str, material: &str| {
        format!("({shape}, transform: (rotation: (17, 31, 11)), material: \"{material}\"),")
    };
    let count = |picture: &image::Rgb32FImage, k: usize| picture.pixels().filter(|p| p.0[k] > p.0[1 - k]).count();
    for (a, b) in [(quad, triangle), (quad, small), (small, plane), (slab, triangle), (slab, plane)] {
        // Each of them alone fills the picture.
        assert_eq!([count(&render(&of(a, "a")), 0), count(&render(&of(b, "b")), 1)], [24 * 24; 2], "{a} {b}");
        let red = count(&render(&(of(a, "a") + &of(b, "b"))), 0);
        assert!(red == 0 || red == 24 * 24, "{a} {b}: {red} of {}", 24 * 24);
    }
}

/// A ball of glass seen before a sky, with something in it.
fn marble(inside: &str, glass: &str) -> image::Rgb32FImage {
    picture(&format!(
        r#"(
        camera: (from: (0.0, 0.6, 6.0), at: (0.0, 0.0, 0.0), fov: 22.0),
        render: (size: (16, 16), samples: 16, sky: ((0.9, 0.9, 1.0), (0.5, 0.6, 0.8), (0.3, 0.2, 0.1)),
            integrator: Path, max_depth: 24, transfer: Linear, seed: Some(5)),
        materials: {{ "g": ({glass}), "same": ({glass}), "water": (model: Dielectric, ior: 1.33) }},
        entities: [(sphere: (), material: "g"), {inside}],
    )"#
    ))
}

#[test]
fn glass_in_glass_is_invisible_and_refracts_by_the_ratio_of_both() {
    let glass = "model: Dielectric, ior: 1.5";
    let alone = marble("", glass);
    for material in ["g", "same"] {
        let cube = format!("(mesh: ({CUBE}), transform: (scale: (0.3, 0.3, 0.3)), material: \"{material}\")");
        let ball = format!("(sphere: (radius: 0.5), material: \"{material}\")");
        let cylinder =
            format!("(cylinder: (base: (0,-0.4,0), apex: (0,0.4,0), radius: 0.3), material: \"{material}\")");
        for inside in [cube, ball, cylinder] {
            close(&inside, &marble(&inside, glass), &alone, 0.002);
        }
    }
    // Water that fills the marble up to its skin, and covers it by priority: only the water is there.
    let water = marble("", "model: Dielectric, ior: 1.33");
    let full = marble("(sphere: (radius: 0.9999), material: \"water\")", glass);
    assert!((mean(&full) - mean(&water)).abs() < 0.02 * mean(&water), "{} {}", mean(&full), mean(&water));
}

/// Rays that graze the walls of a closed room near its corners stay inside.
#[test]
fn no_light_leaks_into_a_closed_room() {
    let scene = r#"(
        camera: (from: (0, 0.5, 0.5), at: (0, 0.5, 0), fov: 90.0),
        render: (size: (24, 24), samples: 256, integrator: Path, max_depth: 6, background: (1e6, 1e6, 1e6), seed: Some(2)),
        materials: { "w": (model: Lambert, color: (0.8, 0.8, 0.8)) },
        entities: [(mesh: (vertices: [(-1,-0.5,-1),(1,-0.5,-1),(1,-0.5,1),(-1,-0.5,1),(-1,1.5,-1),(1,1.5,-1),(1,1.5,1),(-1,1.5,1)],
            triangles: [(0,1,2),(0,2,3),(4,5,6),(4,6,7),(0,4,7),(0,7,3),(1,5,6),(1,6,2),(0,1,5),(0,5,4),(3,2,6),(3,6,7)]), material: "w")],
    )"#;
    let picture = picture(scene);
    let lit = picture.pixels().filter(|p| p.0[0] > 0.0).count();
    assert_eq!(lit, 0);
}

/// A room with a lamp and a ball that mirrors, or one that is seen in a mirror alone, by paths of so many rays.
fn room(is_mirrored: bool, clamp: &str, depth: u32) -> image::Rgb32FImage {
    let (lamp, mirror) = if is_mirrored {
        ("(0.6, 1.6, 3.0)", "aabox: (min: (-1, 0, 1.9), max: (1, 2, 2))")
    } else {
        ("(0.2, 1.3, 0)", "sphere: (center: (-0.5, 0.4, 0), radius: 0.4)")
    };
    picture(&format!(
        r#"(
        camera: (from: (0.0, 1.0, 3.9), at: (0.0, 1.0, 0.0), fov: 40.0),
        render: (size: (12, 12), samples: 64, integrator: Path, transfer: Linear, exposure: -5.0, max_depth: {depth}, {clamp}),
        materials: {{ "w": (model: Lambert, color: (0.7, 0.7, 0.7)),
            "l": (model: Lambert, color: (0, 0, 0), emission: (20, 20, 20)), "m": (model: Conductor, color: (0.9, 0.9, 0.9)) }},
        entities: [(aabox: (min: (-1, 0, -1), max: (1, 2, 4)), material: "w"),
            (sphere: (center: {lamp}, radius: 0.3), material: "l"), ({mirror}, material: "m")],
    )"#
    ))
}

#[test]
fn a_clamp_cuts_indirect_light_alone() {
    // One ray more than these, and light of two walls is among it.
    let direct = room(false, "", 1);
    close("direct", &room(false, "clamp: Some(0.01)", 1), &direct, 1e-5);
    let mirrored = room(true, "", 2);
    assert!(mean(&mirrored) > 0.001, "{}", mean(&mirrored));
    close("mirrored", &room(true, "clamp: Some(0.01)", 2), &mirrored, 1e-5);
    let (free, cut) = (mean(&room(false, "", 6)), mean(&room(false, "clamp: Some(0.01)", 6)));
    assert!(mean(&direct) <= cut * 1.01 && cut < 0.98 * free, "{} {cut} {free}", mean(&direct));
    assert!(mean(&room(false, "clamp_direct: Some(0.01)", 1)) < 0.98 * mean(&direct));
    assert!(mean(&room(true, "clamp_direct: Some(0.01)", 2)) < 0.98 * mean(&mirrored));
}

/// A block of coloured glass before a wall, with something in or around it.
fn stained(others: &str, render: &str) -> image::Rgb32FImage {
    picture(&format!(
        r#"(
        camera: (from: (0.3, 1.5, 6.0), at: (0.0, 0.5, 0.0), fov: 26.0),
        render: (size: (14, 14), background: (0.4, 0.5, 0.6), max_depth: 8, transfer: Linear, {render}),
        materials: {{ "g": (model: Dielectric, ior: 1.4, absorption: (0.1, 0.5, 0.9)), "w": (model: Lambert),
            "gone": (model: Dielectric, ior: 1.7, absorption: (2, 0.3, 0.1), opacity: 0.0),
            "mist": (model: Lambert, opacity: 0.0), "cut": (color: (1, 0, 0), opacity: 0.4, opacity_cutoff: 0.5) }},
        entities: [(aabox: (min: (-1, 0, -0.6), max: (1, 1.2, 0.6)), material: "g"), (plane: (), material: "w"), {others}
            (point_light: (position: (2, 5, 3), color: (0.6, 0.6, 0.6)))],
    )"#
    ))
}

/// What is not there changes nothing: before glass, in it, around it, seen and in the way of light.
#[test]
fn holes_in_and_around_glass_are_as_if_nothing_were_there() {
    let ball = |radius: f64, material: &str| {
        format!("(sphere: (center: (0, 0.6, 0), radius: {radius}), material: \"{material}\"),")
    };
    let path = "integrator: Path, samples: 16, seed: Some(4)";
    let photon = "integrator: Photon, samples: 4, photons: 20000, seed: Some(4)";
    for render in
        ["integrator: Whitted, samples: 1", "samples: 4, seed: Some(4), transparent_shadows: true", path, photon]
    {
        let alone = stained("", render);
        for others in [
            ball(0.4, "gone"),
            ball(2.5, "gone"),
            ball(0.4, "mist"),
            ball(2.5, "cut"),
            ball(0.4, "gone") + &ball(0.2, "gone"),
        ] {
            close(&format!("{render} {others}"), &stained(&others, render), &alone, 1e-3);
        }
    }
}
