//! Scenes that are right, scenes that are wrong, and scenes that are neither.

use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::load::write::to_ron;

const GOOD: &str = r#"// A scene.
(
    camera: (from: (0, 1.4, 6), focus: Entity("hero"), focal_length: 35, lens: Square),
    render: (size: (64, 48), samples: 16, seed: 7, background: (0.1, 0.1, 0.12)),
    materials: { "brass": (color: (0.9, 0.7, 0.4), reflection: 0.2), "a b": () },
    entities: [
        (name: "hero", tags: ["x", "y"], sphere: (radius: 1), transform: (scale: 2, rotation: (0, 45, 0)), material: "brass"),
        (name: "child", transform: (parent: "hero", scale: (1, 2, 3)), cone: (), aabox: (min: (-1, 0, 0))),
        (mesh: (vertices: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], triangles: [(0, 1, 2)])),
        (area_light: (size: (1, 2), edges: ((1, 0, 0), (0, 1, 0)), falloff: InverseSquare)),
        (triangle: (vertices: ((0, 0, 0), (1, 0, 0), (0, 1, 0)), normals: ((0, 0, 1), (0, 0, 1), (0, 1, 1)))),
        (texture: (pattern: Wood, scale: (2, 3), colors: [(0, 0, 1), (1, 0, 0)]), motion: (displacement: (1, 0, 0)), plane: ()),
    ],
)
"#;

fn read(text: &str) -> Result<Scene, String> {
    parse(text, "a.ron", &Folder::from(Path::new(""))).map(|(scene, _)| scene).map_err(|d| d.to_string())
}

#[track_caller]
fn said(text: &str, expected: &[&str]) {
    let message = read(text).unwrap_err();
    for part in expected {
        assert!(message.contains(part), "`{part}` is not in:\n{message}");
    }
}

#[test]
fn a_scene_is_what_it_says() {
    let scene = read(GOOD).unwrap();
    assert_eq!(scene.camera.focus, Some(Focus::Entity("hero".into())));
    assert_eq!((scene.camera.lens, scene.camera.focal_length), (Lens::Square, Some(35.0)));
    assert_eq!((scene.render.size, scene.render.seed), ([64, 48], Some(7)));
    assert_eq!(&*scene.materials[0].0, "brass");
    assert_eq!(scene.materials[0].1.reflection, Some(0.2));
    let Some(Component::Transform(t)) = scene.entities[0].get(Kind::Transform) else { panic!() };
    assert_eq!(t.scale.0, glam::DVec3::splat(2.0));
    assert_eq!(read("()").unwrap(), Scene::default());
}

#[test]
fn what_is_written_is_read_back() {
    let scene = read(GOOD).unwrap();
    let text = to_ron(&scene, None).unwrap();
    assert_eq!(read(&text).unwrap(), scene, "{text}");
    assert_eq!(to_ron(&read(&text).unwrap(), None).unwrap(), text);
    assert!(text.contains("focus: Entity(\"hero\")"), "{text}");
}

#[test]
fn an_unknown_field_is_underlined() {
    let message = read("(\n  materials: { \"m\": (colour: (1.0, 0.0, 0.0)) },\n)").unwrap_err();
    let expected = "a.ron:2:22: error: unknown field `colour` in material `m`\n  \
                    2 |   materials: { \"m\": (colour: (1.0, 0.0, 0.0)) },\n    \
                      |                      ^^^^^^\n  help: did you mean `color`?";
    assert_eq!(message, expected);
}

#[test]
fn each_kind_of_mistake_has_its_words() {
    said("(cmaera: ())", &["a.ron:1:2", "unknown field `cmaera` in the scene", "did you mean `camera`?"]);
    said("(entities: [(spere: ())])", &["a.ron:1:14", "did you mean `sphere`?"]);
    said("(entities: [(sphere: (Radius: 1))])", &["a.ron:1:23", "did you mean `radius`?"]);
    said("(camera: (fov: wide))", &["a.ron:1:16", "expected a number, found `wide`"]);
    said("(camera: (from: (1, 2)))", &["a.ron:1:17", "expected three numbers"]);
    said("(camera: (lens: Dsik))", &["a.ron:1:17", "unknown choice `Dsik`", "did you mean `Disk`?"]);
    said("(render: (samples: -3))", &["a.ron:1:20", "expected a whole number"]);
    said("(camera: (fov: 10, fov: 20))", &["a.ron:1:20", "`fov` is given twice"]);
    said("(entities: [(material: 3)])", &["a.ron:1:24", "expected the name of a material in quotes"]);
    said("(entities: [(material: Some (\"red\"))])", &["a.ron:1:24", "help: write the value itself, without `Some`"]);
    said("(entities: [(name: 3)])", &["a.ron:1:20", "expected a text in quotes"]);
    said("(materials: {\"a\": (), \"a\": ()})", &["a.ron:1:23", "two materials are called `a`"]);
    said("(entities: [(sphere: (1.0))])", &["a.ron:1:23", "without a field name"]);
    said("(camera: [1, 2])", &["a.ron:1:11"]);
    said("(entities: [(sphere: (radius: NaN))])", &["a.ron:1:31", "`radius` must be a finite number"]);
    said("(entities: [(sphere: (), material: \"x\")])", &["a.ron:1:36", "unknown material `x`"]);
    said("(entities: [(name: \"a\"), (name: \"a\")])", &["a.ron:1:33", "two entities are called `a`"]);
    said("(camera: (focus: Entity(\"b\")), entities: [(name: \"bb\")])", &["a.ron:1:18", "did you mean `bb`?"]);
    said("(entities: [(mesh: (file: \"none.obj\"))])", &["a.ron:1:27", "none.obj"]);
    said("(camera: (fov: 10)", &["a.ron:1:1", "never closed"]);
}

#[test]
fn what_keyboards_and_word_processors_do_is_named() {
    said("(entities: [(sphere: (radius: 0,5))])", &["a.ron:1:31", "`0,5` has a comma", "help: write 0.5"]);
    let message = read("(entities: [(sphere: (radius: 0,5))])").unwrap_err();
    assert!(!message.contains("must not be 0"), "{message}");
    said("(camera: (from: (0,0, 1,4, 6,0)))", &["a.ron:1:17", "write 0.5, not 0,5"]);
    said("(camera:\u{a0}(fov: 40))", &["a.ron:1:9", "a no-break space (U+00A0) stands here", "a plain space"]);
    said("(entities: [(name: “a”)])", &["a.ron:1:20", "a curly quote", "a.ron:1:22"]);
    said("(entities: [(name: \"a\", name: \"b\", sphere: ())])", &["a.ron:1:25", "`name` is given twice"]);
    said("(entities: [(tags: [], tags: [], sphere: ())])", &["a.ron:1:24", "`tags` is given twice"]);
}

#[test]
fn notations_of_other_programs_are_answered_with_ours() {
    said("(camera: (focus: \"ball\"))", &["a.ron:1:18", "write Entity(\"ball\")"]);
    said("(camera: (focus: (0, 1, 2)))", &["a.ron:1:18", "write Point(0, 1, 2)"]);
    said("(camera: (at = (0, 0, 0)))", &["a.ron:1:14", "between a field and its value"]);
    said("(camera: (from: [0, 1, 2]))", &["a.ron:1:17", "write (0, 1, 2)"]);
    said("(camera: (from: (x: 0, y: 1, z: 2)))", &["a.ron:1:17", "write (0, 1, 2)"]);
    said("(camera: (from: <0, 1, 2>))", &["a.ron:1:17", "round brackets"]);
    said("(camera: (fov: 40deg))", &["a.ron:1:16", "write 40"]);
    said("(render: (aovs: [\"depth\"]))", &["a.ron:1:17", "[Depth, Normal]"]);
    said("(render: (size: (64.0, 36.0)))", &["a.ron:1:17", "two whole numbers", "(640, 360)"]);
    said("(render: (size: [64, 36]))", &["a.ron:1:17", "(640, 360)"]);
    said("(render: (samples: 4.0))", &["a.ron:1:20", "write it without a point: 4"]);
    said("(render: (denoise: yes))", &["a.ron:1:20", "write true"]);
    said("(render: (integrator: \"path\"))", &["a.ron:1:23", "without quotes: Path"]);
    said("(render: (seed: null))", &["a.ron:1:17", "None"]);
    said("(render: (fov: 40))", &["a.ron:1:11", "`camera: (fov: ...)`"]);
    said("(background: (0, 0, 0))", &["a.ron:1:2", "`render: (background: ...)`"]);
    said("(\n# a comment\ncamera: ())", &["a.ron:2:1", "a comment begins with //"]);
    said("(camera: (fov: 40); render: ())", &["a.ron:1:19", "where a comma belongs"]);
    said("(camera: (fov: 40),, render: ())", &["a.ron:1:20", "one comma too many"]);
    said("(camera: (fov: 1/2))", &["a.ron:1:17", "plain numbers"]);
    said("{\"camera\": {\"fov\": 40}}", &["a.ron:1:1", "this is JSON"]);
    said("(entities: [{\"name\": \"a\"}])", &["a.ron:1:13"]);
    said("hello", &["a.ron:1:1", "no scene in RON"]);
    said("<scene></scene>", &["a.ron:1:1", "no scene in RON"]);
    said("camera:\n  fov: 40\n", &["a.ron:1:7", "no scene in RON"]);
    said("(materials: {\"m\": (color: \"#ff8800\")})", &["a.ron:1:27", "(1.0, 0.5, 0.0)"]);
    said("(materials: {\"m\": (color: 0.8)})", &["a.ron:1:27", "write (0.8, 0.8, 0.8)"]);
    said("(materials: {\"m\": (color_map: \"wood.png\")})", &["a.ron:1:31", "(image: \"wood.png\")"]);
    said("(entities: [(name: ball)])", &["a.ron:1:20", "write \"ball\""]);
    said("(entities: [(tags: \"a\")])", &["a.ron:1:20", "write [\"a\"]"]);
    said("(entities: [(name: \"a, sphere: ())])", &["a.ron:1:"]);
    said("(entities: [(material: m\")])", &["a.ron:1:25", "quote"]);
    said("(entities: [(material: (color: (1, 0, 0)))])", &["a.ron:1:24", "`materials: "]);
}

#[test]
fn several_mistakes_are_reported_at_once() {
    let text = "(\n camera: (fovv: 1),\n entities: [\n (sphere: (radius: x)),\n (cone: (apex: 1)),\n ])";
    said(text, &["a.ron:2:11", "a.ron:4:20", "a.ron:5:16"]);

    // A field that cannot be read does not hide a value out of range, nor a reference to nothing.
    let text = "(\n camera: (fov: 200),\n entities: [\n (sphere: (raduis: 1)),\n (material: \"gone\"),\n ])";
    said(text, &["a.ron:2:16", "a.ron:4:12", "a.ron:5:13"]);
}

proptest! {
    #[test]
    fn damaged_scenes_are_read_or_refused_with_a_place(at in 0usize..900, with in "[\\PC]{0,3}", cut in 0usize..8) {
        let start = (0..=at.min(GOOD.len())).rev().find(|i| GOOD.is_char_boundary(*i)).unwrap_or(0);
        let end = (start + cut).min(GOOD.len());
        prop_assume!(GOOD.is_char_boundary(end));
        let text = format!("{}{with}{}", &GOOD[..start], &GOOD[end..]);
        if let Err(diagnostics) = parse(&text, "a.ron", &Folder::from(Path::new(""))) {
            for diagnostic in diagnostics.0 {
                prop_assert!(diagnostic.place.is_some_and(|p| p.line > 0), "{}", diagnostic.message);
            }
        }
    }

    #[test]
    fn any_numbers_survive_writing(x in any::<f64>(), y in -1e9f64..1e9, n in any::<u64>()) {
        let mut scene = read(GOOD).unwrap();
        scene.camera.from.x = if x.is_finite() { x } else { 0.5 };
        scene.camera.from.y = y;
        scene.render.seed = Some(n);
        let text = to_ron(&scene, None).unwrap();
        let back = options().from_str::<SceneFile>(&text).unwrap();
        prop_assert_eq!(back.camera, scene.camera);
        prop_assert_eq!(back.render, scene.render);
    }
}
