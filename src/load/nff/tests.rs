//! What was met in real files, each on a few lines of its own.

use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::base::project::{Access, Project};

fn read(text: &str) -> (Scene, Vec<String>) {
    let (scene, warnings) =
        parse(text, "a.nff", &Folder::from(Path::new("nowhere")), false).map_err(|d| d.to_string()).unwrap();
    (scene, warnings.0.iter().map(ToString::to_string).filter(|w| !w.contains("no camera")).collect())
}

fn quiet(text: &str) -> Scene {
    let (scene, warnings) = read(text);
    assert!(warnings.is_empty(), "{warnings:?}");
    scene
}

fn shape(text: &str) -> Component {
    let scene = quiet(text);
    scene.entities[0].components().iter().find(|c| c.kind() != Kind::MaterialName).unwrap().clone()
}

fn fails(text: &str) -> String {
    parse(text, "a.nff", &Folder::from(Path::new("nowhere")), false).map(|_| ()).unwrap_err().to_string()
}

const VIEW: &str = "v\nfrom 0 0 8\nat 0 0 0\nup 0 1 0\nangle 90\nhither 1\nresolution 200 100\n";

#[test]
fn the_core_records() {
    let scene =
        quiet(&format!("b 0.1 0.2 0.3\n{VIEW}l 1 2 3\nl 1 2 3 0.5 0.5 0.5\nf 1 0 0 0.5 0.25 9 0.5 1.5\ns 1 2 3 4\n"));
    assert_eq!(scene.render.background, DVec3::new(0.1, 0.2, 0.3));
    assert_eq!((scene.render.size, scene.camera.fov), ([200, 100], 90.0));
    assert_eq!((scene.render.max_depth, scene.render.samples), (5, 1));
    let material = &scene.materials[0].1;
    assert_eq!((material.diffuse, material.specular, material.shininess), (0.5, 0.25, 9.0));
    assert_eq!((material.transmission, material.ior), (0.5, Some(1.5)));
    let Some(Component::PointLight(light)) = scene.entities[1].get(Kind::PointLight) else { panic!() };
    assert!((light.color.x - 0.5f64.sqrt()).abs() < 1e-12);
}

#[test]
fn the_shapes() {
    let v = DVec3::new;
    assert_eq!(shape("s 1 2 3 -4"), Sphere { center: v(1.0, 2.0, 3.0), radius: -4.0 }.into());
    let cylinder = Cylinder { base: DVec3::ZERO, apex: DVec3::Z, radius: 2.0, capped: false };
    assert_eq!(shape("c\n0 0 0 2\n0 0 1 2"), cylinder.into());
    let cone = Cone { base: DVec3::ZERO, base_radius: -2.0, apex: DVec3::Z, apex_radius: -1.0, capped: false };
    assert_eq!(shape("c 0 0 0 -2 0 0 1 -1"), cone.into());
    assert_eq!(shape("pl 0 0 1 1 0 1 0 1 1"), Plane { point: DVec3::Z, normal: DVec3::Z }.into());
    assert_eq!(shape("box 0 0 0 1 2 3"), AABox { min: DVec3::ZERO, max: v(1.0, 2.0, 3.0) }.into());
    assert_eq!(shape("aabb 1 2 3 0 0 0"), shape("box 0 0 0 1 2 3"));
    let Component::Triangle(t) = shape("pp 3\n0 0 0 0 0 1\n1 0 0 0 0 2\n0 1 0 0 1 1") else { panic!() };
    assert_eq!(t.normals.unwrap()[1], v(0.0, 0.0, 2.0));
    let Component::Mesh(mesh) = shape("mesh 3 1 0 0 0 1 0 0 0 1 0 1 2 -1") else { panic!() };
    assert_eq!(mesh.data.triangles, [[0, 1, 2]]);
    for (word, faces) in [("tet", 4), ("oct", 8), ("hex", 12), ("dod", 36)] {
        let Component::Mesh(mesh) = shape(&format!("{word} 1 2 3 2")) else { panic!() };
        assert_eq!(mesh.data.triangles.len(), faces, "{word}");
    }
}

#[test]
fn p3f_lens_and_materials() {
    let text = format!(
        "bclr 0 0 0\n{VIEW}aperture 10\nfocal 1.5\nspp 17\naccel 1\nf 1 0 0 1 0 1 0 0.5 9 0.5 1.5 0.25\ns 0 0 0 1"
    );
    let scene = quiet(&text);
    // At distance 8 and 90 degrees the view plane is 16 high: a pixel is 0.16.
    assert!((scene.camera.aperture - 1.6).abs() < 1e-9);
    assert_eq!(scene.camera.focus_distance, Some(12.0));
    assert_eq!((scene.render.max_depth, scene.render.accel), (6, Accel::Grid));
    assert_eq!((scene.render.samples, scene.render.strata()), (17, 4));
    let material = &scene.materials[0].1;
    assert_eq!((material.specular_color, material.gloss), (DVec3::Y, 0.25));
}

#[test]
fn no_accelerator_is_no_order_to_do_without() {
    let accel = |n: u32| quiet(&format!("accel {n}\ns 0 0 0 1")).render.accel;
    assert_eq!([0, 1, 2, 3].map(accel), [Accel::Auto, Accel::Grid, Accel::Bvh, Accel::Auto]);
}

#[test]
fn skies_are_found_beside_the_folders_above() {
    let folder = tempfile::tempdir().unwrap();
    let sky = folder.path().join("SkyBox");
    std::fs::create_dir_all(&sky).unwrap();
    std::fs::create_dir_all(folder.path().join("scenes/p3f")).unwrap();
    for face in crate::trace::light::environment::FACES {
        ::image::RgbImage::from_pixel(1, 1, ::image::Rgb([255, 0, 255])).save(sky.join(format!("{face}.PNG"))).unwrap();
    }
    let input = folder.path().join("scenes/p3f/a.p3f");
    let access = Access { root: Some(folder.path().into()), ..Access::default() };
    let base = Folder::around(&input, Project::of(&input, &access).unwrap());
    let (scene, warnings) = parse("env skybox\ns 0 0 0 1", "a.p3f", &base, false).unwrap();
    assert!(!warnings.0.iter().any(|w| w.message.contains("environment")), "{warnings}");
    assert_eq!(scene.render.environment.as_deref(), Some("../../SkyBox"));
}

#[test]
fn other_lenses() {
    let lens = |keys: &str| quiet(&format!("{VIEW}{keys}\ns 0 0 0 1")).camera;
    let world = lens("lensRadius 0.5\napperture 2\nfocalp 3\nviewp 1");
    assert_eq!((world.aperture, world.focus_distance), (1.0, Some(3.0)));
    let blunt = lens("focal 4\nview 1\napperture 0.25");
    assert_eq!((blunt.aperture, blunt.focus_distance), (0.25, Some(4.0)));
    assert_eq!(lens("time0 1\ntime1 2").shutter, glam::DVec2::new(1.0, 2.0));
}

#[test]
fn lights_of_every_layout() {
    let light = |text: &str| match shape(text) {
        Component::AreaLight(light) => light,
        other => panic!("{other:?}"),
    };
    let edges = Some([DVec3::X * 2.0, DVec3::Z * 4.0]);
    let plain = light("al 0 5 0 2 0 0 0 0 4 1 0.5 0.25");
    assert_eq!((plain.position, plain.edges, plain.color.y), (DVec3::new(1.0, 5.0, 2.0), edges, 0.5));
    assert_eq!(light("al 0 5 0 2 0 0 0 0 4 1 0.5 0.25 9"), plain);
    assert_eq!(light("al 0 5 0 1 0.5 0.25 2 0 0 0 0 4 9"), plain);
    let aimed = light("al 0 5 0 0 0 0 2 3 1 1 1").edges.unwrap();
    assert!(
        aimed[0].y.abs() < 1e-9 && (aimed[0].length() - 2.0).abs() < 1e-9 && (aimed[1].length() - 3.0).abs() < 1e-9
    );
}

#[test]
fn moving_spheres_of_every_layout() {
    let motion = |text: &str| {
        let (scene, warnings) = read(text);
        let Some(Component::Motion(m)) = scene.entities[0].get(Kind::Motion) else { panic!() };
        (m.clone(), warnings.len())
    };
    let moved = Motion { displacement: DVec3::X, start: 0.0, end: 1.0 };
    assert_eq!(motion("ms 0 0 0 1 0 0 2"), (moved.clone(), 0));
    assert_eq!(motion("sm 0 0 0 1 0 0 2 0 1"), (moved.clone(), 0));
    assert_eq!(motion("ms 0 0 0 1 0 0 0 1 0.5"), (moved, 1));
}

#[test]
fn what_was_met_in_real_files() {
    // Carriage returns, no final newline, comments glued to data, a polygon on one line, trailing spaces.
    assert_eq!(quiet("s 0 1 0 1#main\r\np 3 0 0 0  1 0 0  0 1 0  \r\n# end\r\ns 0 0 0 2").entities.len(), 3);
    // Lights after and between shapes; the last of duplicated settings wins.
    assert_eq!(quiet("s 0 0 0 1\nl 1 1 1\ns 0 0 0 2\nl 1 1 1\nb 0 0 0\nb 1 1 1").render.background, DVec3::ONE);
    // Huge exponents, no index of refraction, no object.
    quiet("f 1 1 1 1 0 100000 0 0\ns 0 0 0 1");
    assert_eq!(quiet(VIEW).entities.len(), 0);
    quiet(&VIEW.replace("200 100", "33 77"));
}

#[test]
fn what_cannot_be_read_is_skipped_with_its_place() {
    for (text, place, words) in [
        ("<<<<<<< HEAD\ns 0 0 0 1", "a.nff:1:1: warning", "unknown keyword `<<<<<<<`"),
        ("s 0 0 0 1\nRed Carpet\n", "a.nff:2:1: warning", "unknown keyword `Red`"),
        ("//l 0 0 5 1 1 1\ns 0 0 0 1", "a.nff:1:1: warning", "unknown keyword `//l`"),
        ("s 0 0 0 1\n  spheer 1 2 3 4", "a.nff:2:3: warning", "unknown keyword `spheer`"),
        ("s 0 0 0.90.166667", "a.nff:1:7: warning", "read as 0.9 and 0.166667"),
        ("s 0 0 0\ns 0 0 0 1", "a.nff:1:1: warning", "`s` needs 4 numbers and has 3"),
        ("s 0 0 0 0\ns 0 0 0 1", "a.nff:1:1: warning", "`radius` must not be 0"),
        ("c 0 0 0 1 0 0 0 1\ns 0 0 0 1", "a.nff:1:1: warning", "must not be the same point"),
        ("l 1 2 3 4\ns 0 0 0 1", "a.nff:1:1: warning", "`l` takes 3 or 6 numbers, not 4"),
        ("f 1 2 3\ns 0 0 0 1", "a.nff:1:1: warning", "`f` takes 8, 9, 11 or 12 numbers"),
        ("env skybox\ns 0 0 0 1", "a.nff:1:5: warning", "the background colour is used"),
        ("shader x.png\ns 0 0 0 1", "a.nff:1:1: warning", "not supported"),
    ] {
        let (scene, warnings) = read(text);
        assert_eq!(scene.entities.len(), 1, "{text}");
        assert!(warnings[0].starts_with(place) && warnings[0].contains(words), "{}", warnings[0]);
        if !text.starts_with("env") {
            assert!(parse(text, "a.nff", &Folder::from(Path::new("")), true).is_err(), "{text}");
        }
    }
    let (scene, warnings) = read(&VIEW.replace("up", "upp"));
    assert!(warnings[0].contains("`upp` is read as `up`") && scene.camera.up == DVec3::Y);
}

#[test]
fn counts_without_data_stop_the_reading() {
    assert!(fails("s 0 0 0 1\np 4000000000\n0 0 0").contains("a.nff:2:1: error: `p` declares 4000000000 vertices"));
    assert!(fails("mesh 3 9 0 0 0 1 0 0 0 1 0 1 2 3").contains("declares 9 triangles"));
    assert!(fails("mesh 99999999999 1 0 0 0").contains("declares 99999999999 vertices"));
    assert!(fails("mesh 3 1 0 0 0 1 0 0 0 1 0 1 2 4").contains("names a vertex that is not there"));
    assert!(fails("p\ns 0 0 0 1").contains("needs a count"));
    assert!(fails("nff\nversion 2.1").contains("Sense8"));
}

#[test]
fn numbers_without_a_sensible_reading_are_errors() {
    for (text, said) in [
        ("s 0 0 0 nan\ns 0 0 0 1", "a.nff:1:9: error: `nan` is not a finite number"),
        ("s 0 0 0 1\nl 1e999 2 3", "a.nff:2:3: error: `1e999` is not a finite number"),
        ("s 0 0 1.5.2.7 1", "a.nff:1:7: error: `1.5.2.7` is not a number: `s` needs 4 numbers and has 2"),
        ("s 0 0 0 1\ns 0 0", "a.nff:2:1: error: the file ends in the middle of `s`"),
        ("v\nfrom 0 0 inf\nat 0 0 0", "a.nff:2:10: error: `inf` is not a finite number"),
        ("", "a.nff: error: there is no camera, no light and no object"),
        ("<html>\n<body>\n</html>", "there is no camera, no light and no object"),
    ] {
        assert!(fails(text).contains(said), "{}", fails(text));
    }
}

#[test]
fn equal_materials_are_one() {
    let scene = quiet("f 1 0 0 1 0 1 0 1\ns 0 0 0 1\nf 0 1 0 1 0 1 0 1\ns 0 0 0 1\nf 1 0 0 1 0 1 0 1\ns 0 0 0 1");
    assert_eq!(scene.materials.len(), 2);
    assert_eq!(scene.entities[0].get(Kind::MaterialName), scene.entities[2].get(Kind::MaterialName));
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let text = String::from_utf8_lossy(&bytes);
        let _ = parse(&text, "a.nff", &Folder::from(Path::new("nowhere")), false);
    }

    #[test]
    fn any_records_are_read_or_refused(words in prop::collection::vec(
        prop_oneof![
            prop::sample::select(KEYWORDS.to_vec()).prop_map(str::to_string),
            (-5i32..9).prop_map(|i| i.to_string()),
            Just("0.5.5".to_string()), Just("1e308".to_string()), Just("from".to_string()), Just("\n".to_string()),
        ], 0..60)) {
        let _ = parse(&words.join(" "), "a.nff", &Folder::from(Path::new("nowhere")), false);
    }
}
