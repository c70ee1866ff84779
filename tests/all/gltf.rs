//! glTF assets: what a scene gets from them, how it changes them, how scripts play them, and what is refused.

use anim::components::*;
use anim::load::load_scene;
use glam::{DVec3, Vec3};

use crate::gltf_file::{GltfFile, base64};
use crate::tool::Sandbox;

const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

/// A scene around `a.gltf` or `a.glb`, as the scene of a test.
fn scene_of(sandbox: &Sandbox, text: &str) -> Result<(Scene, String), String> {
    sandbox.write("scene.ron", text);
    load_scene(&sandbox.path("scene.ron"), false)
        .map(|(scene, warnings)| (scene, warnings.to_string()))
        .map_err(|errors| errors.to_string())
}

fn good(sandbox: &Sandbox, text: &str) -> Scene {
    scene_of(sandbox, text).unwrap_or_else(|said| panic!("{said}")).0
}

const ALONE: &str = "(entities: [(name: \"robot\", asset: (file: \"a.gltf\"))])";

fn entity<'a>(scene: &'a Scene, name: &str) -> &'a EntityDesc {
    let names = || scene.entities.iter().filter_map(|desc| desc.name.as_deref()).collect::<Vec<_>>();
    let found = scene.entities.iter().find(|desc| desc.name.as_deref() == Some(name));
    found.unwrap_or_else(|| panic!("no {name} among {:?}", names()))
}

fn transform(scene: &Scene, name: &str) -> Transform {
    match entity(scene, name).get(Kind::Transform) {
        Some(Component::Transform(transform)) => transform.clone(),
        other => panic!("{name}: {other:?}"),
    }
}

fn mesh<'a>(scene: &'a Scene, name: &str) -> &'a Mesh {
    match entity(scene, name).get(Kind::Mesh) {
        Some(Component::Mesh(mesh)) => mesh,
        other => panic!("{name}: {other:?}"),
    }
}

fn material<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    let known = scene.materials.iter().map(|(name, _)| name).collect::<Vec<_>>();
    &scene.materials.iter().find(|(known, _)| &**known == name).unwrap_or_else(|| panic!("{name}: {known:?}")).1
}

/// A square with a material, on an arm that is turned.
fn robot() -> (GltfFile, String) {
    let mut file = GltfFile::default();
    let points = file.floats("VEC3", &SQUARE);
    let uvs = file.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let corners = file.shorts("SCALAR", &[0, 1, 2, 0, 2, 3]);
    let rest = format!(
        r#""scenes": [{{"nodes": [0]}}],
        "nodes": [
            {{"name": "Body", "translation": [1, 2, 3], "children": [1, 2]}},
            {{"name": "Arm", "rotation": [0, 0.7071067811865476, 0, 0.7071067811865476], "scale": [2, 2, 2], "mesh": 0}},
            {{"name": "Arm", "matrix": [1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1], "mesh": 0}}
        ],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {points}, "TEXCOORD_0": {uvs}, "_MASS": {uvs}}},
            "indices": {corners}, "material": 0}}]}}],
        "materials": [{{"name": "Steel", "pbrMetallicRoughness": {{"baseColorFactor": [0.5, 0.6, 0.7, 1],
            "metallicFactor": 0.9, "roughnessFactor": 0.3}}}}]"#
    );
    (file, rest)
}

#[test]
fn nodes_are_entities_below_the_asset() {
    let sandbox = Sandbox::new();
    let (file, rest) = robot();
    sandbox.write("a.gltf", file.text(&rest));
    let scene = good(&sandbox, ALONE);
    assert_eq!(transform(&scene, "robot/Body").translation, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(transform(&scene, "robot/Body").parent.as_deref(), Some("robot"));
    let arm = transform(&scene, "robot/Arm");
    assert!((arm.rotation - DVec3::new(0.0, 90.0, 0.0)).length() < 1e-5 && arm.scale.0 == DVec3::splat(2.0), "{arm:?}");
    assert_eq!(arm.parent.as_deref(), Some("robot/Body"));
    // Two of a name are told apart; a matrix that shears is kept.
    let sheared = transform(&scene, "robot/Arm.2");
    assert_eq!(sheared.matrix.unwrap()[1], DVec3::new(0.5, 1.0, 0.0));
    let square = &mesh(&scene, "robot/Arm").data;
    assert_eq!(square.triangles, [[0, 1, 2], [0, 2, 3]]);
    // Texture coordinates run upwards.
    assert_eq!(square.uvs[0].y, 0.0);
    assert!(std::sync::Arc::ptr_eq(square, &mesh(&scene, "robot/Arm.2").data), "one mesh for both");
    let steel = material(&scene, "a/Steel");
    assert_eq!((steel.model, steel.metallic, steel.roughness), (Model::Principled, 0.9, 0.3));
    assert_eq!((steel.color, steel.two_sided), (DVec3::new(0.5, 0.6, 0.7), false));
    // A binary file says the same.
    sandbox.write("a.glb", file.binary(&rest));
    let binary = good(&sandbox, &ALONE.replace("a.gltf", "a.glb"));
    assert_eq!(mesh(&binary, "robot/Arm").data, *square);
}

#[test]
fn a_scene_changes_what_it_likes_of_an_asset() {
    let sandbox = Sandbox::new();
    let (file, rest) = robot();
    sandbox.write("a.gltf", file.text(&rest));
    let scene = good(
        &sandbox,
        r#"(
            materials: { "brass": (color: (0.9, 0.7, 0.4)), "a/Steel": (color: (0.1, 0.1, 0.1)) },
            entities: [
                (name: "robot/Arm", transform: (translation: (0.0, 5.0, 0.0)), material: "brass"),
                (name: "robot", asset: (file: "a.gltf", without: ["Arm.2"])),
                (name: "hat", sphere: (), transform: (parent: "robot/Body")),
            ],
        )"#,
    );
    let arm = transform(&scene, "robot/Arm");
    assert_eq!((arm.translation.y, arm.scale, arm.parent.as_deref()), (5.0, Scale::default(), Some("robot/Body")));
    assert!(!mesh(&scene, "robot/Arm").file_materials, "the entity's material stands for the file's");
    assert!(!scene.entities.iter().any(|desc| desc.name.as_deref() == Some("robot/Arm.2")));
    assert_eq!(material(&scene, "a/Steel").color, DVec3::splat(0.1));
    assert_eq!(scene.materials.len(), 2);
}

#[test]
fn names_that_an_asset_does_not_have_are_mistakes() {
    let sandbox = Sandbox::new();
    let (file, rest) = robot();
    sandbox.write("a.gltf", file.text(&rest));
    let wrong = |text: &str, said: &[&str]| {
        let found = scene_of(&sandbox, text).unwrap_err();
        said.iter().for_each(|said| assert!(found.contains(said), "{said}:\n{found}"));
    };
    let amr = "(entities: [\n(name: \"robot\", asset: (file: \"a.gltf\")),\n(name: \"robot/Amr\", material: \"x\")])";
    wrong(amr, &["scene.ron:3:", "no node for `robot/Amr`", "did you mean `robot/Arm`?"]);
    wrong("(materials: {\"a/Steal\": ()}, entities: [(asset: (file: \"a.gltf\"))])", &["did you mean `a/Steel`?"]);
    wrong("(entities: [(asset: (file: \"a.gltf\", without: [\"Bodi\"]))])", &["did you mean `Body`?"]);
    wrong("(entities: [(asset: (file: \"b.gltf\"))])", &["scene.ron:1:", "b.gltf", "did you mean `a.gltf`?"]);
    wrong("(entities: [(asset: (file: \"a.gltf\", scene: \"Main\"))])", &["there is no scene `Main`"]);
    wrong("(entities: [(asset: (fil: \"a.gltf\"))])", &["did you mean `file`?"]);
    wrong("(entities: [(asset: ())])", &["an asset needs a `file`"]);
}

#[test]
fn a_file_that_is_wrong_says_where() {
    let sandbox = Sandbox::new();
    let (file, rest) = robot();
    let wrong = |from: &str, to: &str, said: &[&str]| {
        assert!(rest.contains(from), "{from}");
        sandbox.write("a.gltf", file.text(&rest.replace(from, to)));
        let found = scene_of(&sandbox, ALONE).unwrap_err();
        assert!(found.contains("a.gltf:"), "{found}");
        said.iter().for_each(|said| assert!(found.contains(said), "{said}:\n{found}"));
    };
    wrong("\"material\": 0", "\"material\": 3", &["there is no material 3; there are 1", "^"]);
    wrong("\"children\": [1, 2]", "\"children\": [1, 9]", &["there is no node 9"]);
    wrong("\"children\": [1, 2]", "\"children\": [1, 0]", &["circle"]);
    wrong("\"indices\": 2", "\"indices\": 0", &["expected an accessor of SCALAR, found `VEC3`"]);
    wrong("\"metallicFactor\": 0.9", "\"metallicFactor\": \"much\"", &["invalid type"]);
    wrong("\"name\": \"Body\"", "\"name\": \"Body\", \"rotation\": [0, 0, 0, \"x\"]", &["invalid type"]);
    let required = |name: &str| format!("{rest}, \"extensionsRequired\": [\"{name}\"]");
    for (name, said) in [("KHR_draco_mesh_compression", "without compression"), ("XYZ_unknown", "is not known")] {
        sandbox.write("a.gltf", file.text(&required(name)));
        let found = scene_of(&sandbox, ALONE).unwrap_err();
        assert!(found.contains(name) && found.contains(said), "{found}");
    }
    sandbox.write("a.gltf", file.text(&required("KHR_lights_punctual")));
    assert!(scene_of(&sandbox, ALONE).is_ok());
    sandbox.write("a.gltf", r#"{"asset": {"version": "1.0"}, "buffers": {"a": {"uri": "a.bin"}}, "nodes": {}}"#);
    let old = scene_of(&sandbox, ALONE).unwrap_err();
    assert!(old.contains("a.gltf:1:") && old.contains("glTF 1.0 is not read; version 2.0 is"), "{old}");
}

#[test]
fn materials_bring_their_maps_and_extensions() {
    let sandbox = Sandbox::new();
    let mut file = GltfFile::default();
    let points = file.floats("VEC3", &SQUARE);
    let png = png();
    let view = file.view(&png);
    let rest = format!(
        r#""nodes": [{{"name": "N", "mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {points}}}, "mode": 5, "material": 0}},
                                   {{"attributes": {{"POSITION": {points}}}, "mode": 6, "material": 1}}]}}],
        "images": [{{"uri": "data:image/png;base64,{}"}}, {{"bufferView": {view}, "mimeType": "image/png"}},
                   {{"uri": "my%20wood.png"}}],
        "samplers": [{{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}}],
        "textures": [{{"source": 0, "sampler": 0}}, {{"source": 1}}, {{"source": 2}}],
        "materials": [
            {{"name": "all", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
              "pbrMetallicRoughness": {{"baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": {{"index": 0}},
                "metallicRoughnessTexture": {{"index": 1, "texCoord": 1}}}},
              "normalTexture": {{"index": 2, "scale": 0.5}}, "occlusionTexture": {{"index": 1}},
              "emissiveTexture": {{"index": 0, "extensions": {{"KHR_texture_transform": {{"offset": [0, 1],
                "scale": [1, -1]}}}}}}, "emissiveFactor": [1, 0.5, 0],
              "extensions": {{"KHR_materials_emissive_strength": {{"emissiveStrength": 4}},
                "KHR_materials_clearcoat": {{"clearcoatFactor": 1}}}}}},
            {{"name": "glass", "extensions": {{"KHR_materials_transmission": {{"transmissionFactor": 0.8}},
              "KHR_materials_ior": {{"ior": 1.33}},
              "KHR_materials_volume": {{"thicknessFactor": 1, "attenuationDistance": 2,
                "attenuationColor": [0.5, 1, 0.1]}},
              "KHR_materials_specular": {{"specularFactor": 0.5, "specularColorFactor": [1, 0.9, 0.8]}}}}}}
        ]"#,
        base64(&png)
    );
    sandbox.write("a.gltf", file.text(&rest)).write("my wood.png", &png);
    let (scene, said) = scene_of(&sandbox, ALONE).unwrap();
    assert!(said.contains("a.gltf:") && said.contains("`KHR_materials_clearcoat` is not used"), "{said}");
    assert!(said.contains("occlusion"), "{said}");
    let all = material(&scene, "a/all");
    assert_eq!((all.opacity, all.opacity_cutoff, all.two_sided), (0.5, Some(0.25), true));
    assert_eq!(all.emission, DVec3::new(4.0, 2.0, 0.0));
    let map = |map: &Option<Box<Texture>>| map.as_deref().cloned().unwrap();
    let color = map(&all.color_map);
    assert_eq!(
        (color.image.as_deref(), color.wrap, color.wrap_v),
        (Some("a.gltf#images/0"), Wrap::Clamp, Some(Wrap::Mirror))
    );
    assert_eq!(color.filter, TexelFilter::Nearest);
    assert_eq!(map(&all.opacity_map).channel, Channel::Alpha);
    let (metal, rough) = (map(&all.metallic_map), map(&all.roughness_map));
    assert_eq!((metal.channel, metal.uv_set, rough.channel), (Channel::Blue, 1, Channel::Green));
    let normal = map(&all.normal_map);
    assert_eq!((normal.image.as_deref(), normal.depth), (Some("my wood.png"), Some(0.5)));
    assert_eq!(map(&all.emission_map).scale.0.y, -1.0);
    let glass = material(&scene, "a/glass");
    assert_eq!((glass.transmission, glass.ior, glass.thin, glass.reflection), (0.8, Some(1.33), false, Some(0.5)));
    assert!((glass.absorption - DVec3::new(0.5f64.ln() / -2.0, 0.0, 0.1f64.ln() / -2.0)).length() < 1e-12);
    // Strips and fans are triangles, and each primitive wears its own material.
    let square = &mesh(&scene, "robot/N").data;
    assert_eq!(square.triangles, [[0, 1, 2], [2, 1, 3], [5, 6, 4], [6, 7, 4]]);
    assert_eq!(square.materials.len(), 2);
    assert_eq!(&*square.materials[1].name, "a/glass");
}

/// Four pixels with alpha: red, green, blue, and a hole.
fn png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = [255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 0];
    image::RgbaImage::from_raw(2, 2, pixels.to_vec()).unwrap().write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn lights_cameras_and_instances_are_entities() {
    let sandbox = Sandbox::new();
    let mut file = GltfFile::default();
    let points = file.floats("VEC3", &SQUARE);
    let moved = file.floats("VEC3", &[1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
    let rest = format!(
        r#""nodes": [{{"name": "Sun", "extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}},
                     {{"name": "Spot", "extensions": {{"KHR_lights_punctual": {{"light": 1}}}}}},
                     {{"name": "Eye", "camera": 0}},
                     {{"name": "Grass", "mesh": 0, "extensions": {{"EXT_mesh_gpu_instancing":
                       {{"attributes": {{"TRANSLATION": {moved}}}}}}}}}],
        "cameras": [{{"type": "perspective", "perspective": {{"yfov": 0.8, "znear": 0.1}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {points}}}, "mode": 5}}]}}],
        "extensionsUsed": ["KHR_lights_punctual", "EXT_mesh_gpu_instancing"],
        "extensionsRequired": ["KHR_lights_punctual", "EXT_mesh_gpu_instancing"],
        "extensions": {{"KHR_lights_punctual": {{"lights": [
            {{"type": "directional", "intensity": 3.0, "color": [1, 0.5, 0.25]}},
            {{"type": "spot", "intensity": 100, "spot": {{"innerConeAngle": 0.1, "outerConeAngle": 0.5}}}}]}}}}"#
    );
    sandbox.write("a.gltf", file.text(&rest));
    let scene = good(&sandbox, ALONE);
    let Some(Component::DirectionalLight(sun)) = entity(&scene, "robot/Sun").get(Kind::DirectionalLight) else {
        panic!()
    };
    assert!((sun.intensity - 3.0 / std::f64::consts::PI).abs() < 1e-12 && sun.color.y == 0.5);
    let Some(Component::SpotLight(spot)) = entity(&scene, "robot/Spot").get(Kind::SpotLight) else { panic!() };
    assert!((spot.outer_angle - 0.5f64.to_degrees()).abs() < 1e-9 && spot.falloff == Falloff::InverseSquare);
    let Some(Component::Viewpoint(eye)) = entity(&scene, "robot/Eye").get(Kind::Viewpoint) else { panic!() };
    assert!((eye.fov - 0.8f64.to_degrees()).abs() < 1e-9);
    for i in 0..3 {
        let name = format!("robot/Grass/{i}");
        assert_eq!(transform(&scene, &name).translation.x, f64::from(i + 1));
        assert_eq!(transform(&scene, &name).parent.as_deref(), Some("robot/Grass"));
    }
    // Without a material it wears that of the format: white metal.
    assert_eq!(material(&scene, "a/default").metallic, 1.0);
}

/// An arm of two joints that bends over, and a square that swells.
fn arm() -> (GltfFile, String) {
    let mut file = GltfFile::default();
    let points = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 1.0, 2.0, 0.0]);
    let joints = file.shorts("VEC4", &[0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    let weights =
        file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let corners = file.shorts("SCALAR", &[0, 1, 2, 1, 3, 2]);
    let mut binds = [[0.0f32; 16]; 2];
    for m in &mut binds {
        (0..4).for_each(|i| m[5 * i] = 1.0);
    }
    // The second joint is one above the first.
    binds[1][13] = -1.0;
    let binds = file.floats("MAT4", &binds.concat());
    let square = file.floats("VEC3", &SQUARE);
    let swollen = file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let times = file.floats("SCALAR", &[0.0, 1.0, 2.0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turns = file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half, 0.0, 0.0, half, half]);
    let shares = file.floats("SCALAR", &[0.0, 1.0, 0.5]);
    let steps = file.floats("VEC3", &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 8.0, 0.0, 0.0]);
    let rest = format!(
        r#""nodes": [{{"name": "Root", "children": [1, 2, 3], "translation": [10, 0, 0]}},
                     {{"name": "Skin", "mesh": 0, "skin": 0, "translation": [100, 100, 100]}},
                     {{"name": "Lower", "children": [4]}},
                     {{"name": "Face", "mesh": 1, "translation": [0, 0, -5]}},
                     {{"name": "Upper", "translation": [0, 1, 0]}}],
        "scenes": [{{"nodes": [0]}}], "scene": 0,
        "skins": [{{"joints": [2, 4], "inverseBindMatrices": {binds}}}],
        "meshes": [
            {{"primitives": [{{"attributes": {{"POSITION": {points}, "JOINTS_0": {joints}, "WEIGHTS_0": {weights}}},
              "indices": {corners}}}]}},
            {{"primitives": [{{"attributes": {{"POSITION": {square}}}, "mode": 5, "targets": [{{"POSITION": {swollen}}}]}}],
              "weights": [0.25], "extras": {{"targetNames": ["Swell"]}}}}],
        "animations": [
            {{"name": "Bend", "samplers": [{{"input": {times}, "output": {turns}}}, {{"input": {times}, "output": {shares}}}],
              "channels": [{{"sampler": 0, "target": {{"node": 4, "path": "rotation"}}}},
                           {{"sampler": 1, "target": {{"node": 3, "path": "weights"}}}}]}},
            {{"name": "Slide", "samplers": [{{"input": {times}, "output": {steps}, "interpolation": "STEP"}}],
              "channels": [{{"sampler": 0, "target": {{"node": 0, "path": "translation"}}}}]}}]"#
    );
    (file, rest)
}

/// The scene of a frame of a script over the arm.
fn played(frame: &str) -> Scene {
    let sandbox = Sandbox::new();
    let (file, rest) = arm();
    sandbox.write("a.gltf", file.text(&rest)).write("scene.ron", ALONE);
    sandbox
        .write("a.rhai", format!("animation(#{{ scene: \"scene.ron\", frames: 1 }});\nfn frame(s, f) {{ {frame} }}"));
    let run = sandbox.anim("dump a.rhai -o out.ron").ok();
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    load_scene(&sandbox.path("out.ron"), false).unwrap_or_else(|said| panic!("{said}")).0
}

#[test]
fn scripts_play_clips_and_blend_them() {
    let scene = played("s.get(\"robot\").play(\"Bend\", 0.5);");
    let upper = transform(&scene, "robot/Upper");
    assert!((upper.rotation - DVec3::new(0.0, 0.0, 45.0)).length() < 1e-5, "{upper:?}");
    assert_eq!(upper.translation.y, 1.0, "what a clip does not move stays");
    let weights = |scene: &Scene| match entity(scene, "robot/Face").get(Kind::Morph) {
        Some(Component::Morph(morph)) => morph.weights.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(weights(&scene), [0.5]);
    // Behind its end a clip begins again, or stays where it is told to.
    let again = played("s.get(\"robot\").play(\"Bend\", 4.5);");
    assert!((transform(&again, "robot/Upper").rotation.z - 45.0).abs() < 1e-5);
    let held = played("s.get(\"robot\").play(\"Bend\", 9, #{ repeat: false });");
    assert!((transform(&held, "robot/Upper").rotation.z - 90.0).abs() < 1e-5);
    // Blends lead from where things stand towards the clip.
    let both = played("let r = s.get(\"robot\"); r.play(\"Bend\", 1.0).blend(\"Slide\", 1.5, 0.25);");
    assert_eq!(transform(&both, "robot/Root").translation.x, 10.0 + (4.0 - 10.0) * 0.25);
    assert!((transform(&both, "robot/Upper").rotation.z - 90.0).abs() < 1e-5);
    let half = played("s.get(\"robot\").play(\"Bend\", 1, #{ weight: 0.5 });");
    assert!((transform(&half, "robot/Upper").rotation.z - 45.0).abs() < 1e-5);
    assert_eq!(weights(&half), [0.25 + 0.75 * 0.5]);
}

#[test]
fn scripts_read_names_and_lengths_of_clips() {
    let scene = played(
        "let r = s.get(\"robot\"); let c = r.clip(\"Bend\");
         s.get(\"robot/Face\").translation = [c.length, c.start + r.clips.len(), r.clips[1].name.len()];",
    );
    assert_eq!(transform(&scene, "robot/Face").translation, DVec3::new(2.0, 2.0, 5.0));
}

#[test]
fn clips_that_are_not_there_are_explained() {
    let sandbox = Sandbox::new();
    let (file, rest) = arm();
    sandbox.write("a.gltf", file.text(&rest)).write("scene.ron", ALONE);
    let fails = |frame: &str, said: &[&str]| {
        let text = format!("animation(#{{ scene: \"scene.ron\", frames: 1 }});\nfn frame(s, f) {{\n{frame}\n}}");
        sandbox.write("a.rhai", text);
        sandbox.anim("check a.rhai").fails(3, said);
    };
    fails("s.get(\"robot\").play(\"Bent\", 1);", &["a.rhai:3:", "no clip `Bent`", "did you mean `Bend`?"]);
    fails("s.get(\"robot/Face\").play(\"Bend\", 1);", &["has no `asset`"]);
    fails("s.get(\"robot\").play(\"Bend\", \"soon\");", &["expected a number"]);
    fails("s.get(\"robot\").play(\"Bend\", 1, #{ repeats: true });", &["no option `repeats`"]);
    fails("s.get(\"robot\").blend(\"Bend\", 1, 2);", &["a weight must be from 0 to 1"]);
}

#[test]
fn unbent_and_bent_meshes_are_where_they_should_be() {
    let sandbox = Sandbox::new();
    let (file, rest) = arm();
    sandbox.write("a.gltf", file.text(&rest));
    let scene = good(&sandbox, ALONE);
    let Some(Component::Skin(skin)) = entity(&scene, "robot/Skin").get(Kind::Skin) else { panic!() };
    assert_eq!(skin.joints.iter().map(|name| &**name).collect::<Vec<_>>(), ["robot/Lower", "robot/Upper"]);
    let bent = |angle: f64| {
        let (sin, cos) = anim::base::math::sin_cos_degrees(angle);
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let lower = glam::DAffine3::from_translation(at(10.0, 0.0, 0.0));
        let turn = glam::DMat3::from_cols(at(cos, sin, 0.0), at(-sin, cos, 0.0), DVec3::Z);
        let upper = glam::DAffine3 { matrix3: turn, translation: at(10.0, 1.0, 0.0) };
        anim::components::skin::deformed(&mesh(&scene, "robot/Skin").data, None, Some((skin, &[lower, upper]))).vertices
    };
    let near = |found: &[Vec3], wanted: [[f32; 3]; 4]| {
        found.iter().zip(wanted).for_each(|(f, w)| assert!((*f - Vec3::from_array(w)).length() < 1e-6, "{f} {w:?}"));
    };
    near(&bent(0.0), [[10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [10.0, 2.0, 0.0], [11.0, 2.0, 0.0]]);
    near(&bent(90.0), [[10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 2.0, 0.0]]);
}

#[test]
fn scripts_measure_bent_meshes_where_a_clip_has_them() {
    // The joints stand at 10, not where the node of the mesh is. The shape moves the square by its weight, here 1.
    let wanted =
        [("Skin", "min", [9.0, 0.0, 0.0]), ("Skin", "max", [10.0, 2.0, 0.0]), ("Face", "min", [10.0, 0.0, -4.0])];
    for (node, end, wanted) in wanted {
        let measured = format!("s.get(\"robot/Face\").translation = s.get(\"robot/{node}\").bounds.{end};");
        let scene = played(&format!("s.get(\"robot\").play(\"Bend\", 1); {measured}"));
        let found = transform(&scene, "robot/Face").translation;
        assert!((found - DVec3::from_array(wanted)).length() < 1e-5, "{node} {end}: {found}");
    }
}

#[test]
fn groups_of_an_obj_are_entities() {
    let sandbox = Sandbox::new();
    let vase =
        "mtllib vase.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no vase\ng body\nusemtl clay\nf 1 2 3\ng lid\nf 1 3 4\n";
    sandbox.write("vase.obj", vase).write("vase.mtl", "newmtl clay\nKd 0.6 0.3 0.2\n");
    let scene = good(
        &sandbox,
        "(entities: [(name: \"v\", asset: (file: \"vase.obj\")), (name: \"v/lid\", transform: (translation: (0.0, 2.0, 0.0)))])",
    );
    assert_eq!(mesh(&scene, "v/body").group.as_deref(), Some("body"));
    assert_eq!(transform(&scene, "v/lid").translation.y, 2.0);
    assert_eq!(transform(&scene, "v/lid").parent.as_deref(), Some("v"));
    assert!(std::sync::Arc::ptr_eq(&mesh(&scene, "v/body").data, &mesh(&scene, "v/lid").data), "read once for both");
    assert_eq!(material(&scene, "clay").color, DVec3::new(0.6, 0.3, 0.2));
    // By itself it is a scene, and what is written of that is the asset and not its nodes.
    let run = sandbox.anim("convert vase.obj").ok();
    assert!(run.stdout.contains("asset: (file: \"vase.obj\")"), "{}", run.stdout);
    let written = |line: &str| !line.trim_start().starts_with("//") && line.contains("vase/body");
    assert!(!run.stdout.lines().any(written), "{}", run.stdout);
}

/// What is valid and unusual: corners that are left over, a node that says of its visibility nothing, pictures of kinds
/// that are known and not read.
#[test]
fn unusual_files_are_read_and_what_is_not_used_is_named() {
    let sandbox = Sandbox::new();
    let mut file = GltfFile::default();
    let points = file.floats("VEC3", &SQUARE);
    let rest = format!(
        r#""nodes": [{{"mesh": 0, "extensions": {{"KHR_node_visibility": {{}}}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": {points}}}}}]}}]"#
    );
    sandbox.write("a.gltf", file.text(&rest));
    let (scene, said) = scene_of(&sandbox, ALONE).unwrap();
    assert_eq!(mesh(&scene, "robot/node0").data.triangles.len(), 1);
    assert!(said.contains("4 corners make 1 triangles, and 1 are left over"), "{said}");
    sandbox.write("b.ktx2", b"\xabKTX 20\xbb\r\n\x1a\n");
    let said = scene_of(&sandbox, "(entities: [(sphere: (), texture: (image: \"b.ktx2\"))])").unwrap_err();
    assert!(said.contains("(KTX2) are not read") && said.contains("PPM"), "{said}");
    sandbox.write("c.ppm", b"P6 1 1 255\n\x10\x20\x30");
    scene_of(&sandbox, "(entities: [(sphere: (), texture: (image: \"c.ppm\"))])").unwrap();
}

/// A mesh file is shown by itself, as what it is, in every format.
#[test]
fn mesh_files_are_shown_by_themselves() {
    let sandbox = Sandbox::new();
    sandbox
        .write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .write(
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
            element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        )
        .write(
            "a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
            endfacet\nendsolid a\n",
        );
    for ending in ["obj", "ply", "stl"] {
        sandbox.anim(&format!("a.{ending} -o {ending}.png --size 16x9 --spp 1")).ok();
        sandbox.anim(&format!("convert a.{ending} -o {ending}.ron")).ok();
        sandbox.anim(&format!("check {ending}.ron --strict")).ok();
        let said = sandbox.anim(&format!("info a.{ending}")).ok().stdout;
        for line in ["of them 1 meshes, 0 lights", "Triangles: 1\nArea: 0.5\n", "Bounds: (0, 0, 0) to (1, 1, 0), size"]
        {
            assert!(said.contains(line), "{said}");
        }
    }
    assert_eq!(sandbox.read("obj.png").len(), sandbox.read("stl.png").len());
    let scene = good(&sandbox, "(entities: [(name: \"part\", asset: (file: \"a.stl\"))])");
    assert_eq!(mesh(&scene, "part/a").data.triangles.len(), 1);
}
