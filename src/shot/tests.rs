//! Digests and plans against what must and what must not change them.

use std::path::PathBuf;

use glam::DVec3;

use super::fingerprint::FramePart;
use super::*;
use crate::base::digest::Digest;
use crate::components::*;
use crate::output::names::Target;

fn lamp(color: DVec3) -> EntityDesc {
    EntityDesc::new([PointLight { color, ..PointLight::default() }.into(), Transform::default().into()])
}

fn scene() -> Scene {
    let ball =
        EntityDesc::new([Sphere::default().into(), Transform::default().into(), MaterialName("m".into()).into()]);
    Scene {
        materials: vec![("m".into(), Material::default()), ("unworn".into(), Material::default())],
        entities: vec![ball.named("ball"), lamp(DVec3::ONE), EntityDesc::new([Plane::default().into()])],
        ..Scene::default()
    }
}

fn rest(scene: &Scene) -> BaseFingerprint {
    BaseFingerprint::new(Arc::new(scene.clone()), Assets::new(scene.base.clone()))
}

fn hash(scene: &Scene, edits: &[Edit]) -> Digest {
    rest(scene).fingerprint(edits).hash()
}

fn put(entity: usize, component: impl Into<Component>) -> Edit {
    Edit::Put { entity, component: component.into() }
}

/// Sets a field and gives what it then is.
type SetField<'a> = &'a mut dyn FnMut(&Value) -> Result<Value, FieldError>;

/// Tries values on a field until it holds another one than before.
fn flip(before: &Value, set: SetField) -> bool {
    let vector = Value::Vec3(DVec3::new(0.25, 0.5, 0.75));
    let list = |item: &Value, n: usize| Value::List(vec![item.clone(); n]);
    let mut values = vec![Value::Bool(true), Value::Bool(false), Value::Int(3), Value::Int(8), Value::Number(0.375)];
    values.extend([vector.clone(), list(&vector, 2), list(&vector, 3), list(&vector, 4), Value::Map(Vec::new())]);
    values.extend([2, 3, 4].map(|n| list(&Value::Int(5), n)));
    values.push(list(&list(&Value::Int(0), 3), 1));
    values.extend([1, 3].map(|n| list(&list(&Value::Number(0.375), 2), n)));
    let other = Value::Text("other".into());
    for (guess, many) in [(other.clone(), false), (list(&other, 1), true)] {
        match set(&guess) {
            // A choice names its words.
            Err(FieldError::Mismatch(m)) if m.message.starts_with("expected one of ") => {
                let words = m.message["expected one of ".len()..].split(", ").filter(|word| !word.contains(' '));
                let words = words.map(|word| Value::Text(word.into()));
                values.extend(words.map(|word| if many { list(&word, 1) } else { word }));
            }
            Ok(now) if now != *before => return true,
            _ => {}
        }
    }
    values.iter().any(|value| set(value).is_ok_and(|now| now != *before))
}

#[test]
fn every_field_of_every_component_decides_the_hash() {
    // An asset is what its file holds, and no edit of a frame changes it.
    for kind in Kind::ALL.iter().copied().filter(|kind| *kind != Asset::KIND) {
        let mut scene = scene();
        let mut component = kind.default_component();
        if let Component::MaterialName(name) = &mut component {
            name.0 = "m".into();
        }
        scene.entities.push(EntityDesc::new([component.clone()]));
        let before = hash(&scene, &[]);
        // Of a file it is the content that counts, and `frame` says which file it is; `names` are only read.
        for field in kind.fields().iter().filter(|field| !["file", "frame", "names"].contains(field)) {
            let mut changed = component.clone();
            let set = &mut |value: &Value| {
                changed = component.clone();
                changed.record_mut().set(field, value).map(|()| changed.record().get(field).unwrap())
            };
            let known = component.record().get(field).unwrap();
            assert!(flip(&known, set), "no other value for {}.{field}", kind.name());
            let mut edited = scene.clone();
            edited.entities[3].put(changed.clone());
            assert_ne!(hash(&edited, &[]), before, "{}.{field}", kind.name());
            // As an edit of a frame it makes the same frame.
            assert_eq!(hash(&scene, &[put(3, changed)]), hash(&edited, &[]), "{}.{field}", kind.name());
        }
        assert_eq!(hash(&scene, &[put(3, component), Edit::Tags { entity: 3, tags: vec!["t".into()] }]), before);
    }
}

/// Checks every field of a record that is not one of `hidden`.
fn every_field<R: Record + Clone>(record: &R, hidden: &[&str], hash_with: impl Fn(R) -> Digest) {
    let before = hash_with(record.clone());
    for field in record.fields() {
        let mut changed = record.clone();
        let set = &mut |value: &Value| {
            changed = record.clone();
            changed.set(field, value).map(|()| changed.get(field).unwrap())
        };
        assert!(flip(&record.get(field).unwrap(), set), "no other value for {field}");
        assert_eq!(hash_with(changed) == before, hidden.contains(field), "{field}");
    }
}

#[test]
fn every_field_of_camera_settings_and_materials_decides_the_hash() {
    let edited = |edit: Edit| hash(&scene(), &[edit]);
    every_field(&Camera::default(), &[], |camera| edited(Edit::Camera(camera)));
    every_field(&Render::default(), &["accel", "grid_density"], |render| edited(Edit::Render(render)));
    every_field(&Material::default(), &[], |material| edited(Edit::Material { index: 0, material }));
    every_field(&Camera::default(), &[], |camera| hash(&Scene { camera, ..scene() }, &[]));
    let none = Material::FIELDS;
    every_field(&Material::default(), none, |material| edited(Edit::Material { index: 1, material }));
}

#[test]
fn what_changed_is_said_in_parts() {
    let rest = rest(&scene());
    let before = rest.fingerprint(&[]);
    let changes = |edits: &[Edit]| rest.fingerprint(edits).changes(&before);
    let turned = || Transform { rotation: DVec3::Y, ..Transform::default() };
    assert_eq!(changes(&[]), []);
    assert_eq!(changes(&[Edit::Camera(Camera { fov: 9.0, ..Camera::default() })]), [FramePart::Camera]);
    assert_eq!(changes(&[Edit::Camera(Camera { aperture: 9.0, ..Camera::default() })]), [FramePart::Lens]);
    assert_eq!(changes(&[Edit::Render(Render { samples: 9, ..Render::default() })]), [FramePart::Settings]);
    assert_eq!(changes(&[Edit::Render(Render { accel: Accel::Grid, ..Render::default() })]), []);
    assert_eq!(changes(&[put(0, Sphere { radius: 2.0, ..Sphere::default() })]), [FramePart::Geometry]);
    assert_eq!(changes(&[put(0, turned())]), [FramePart::Transforms]);
    assert_eq!(changes(&[put(1, turned())]), [FramePart::Lights]);
    assert_eq!(changes(&[put(1, PointLight { color: DVec3::X, ..PointLight::default() })]), [FramePart::LightColors]);
    let red = || Material { color: DVec3::X, ..Material::default() };
    assert_eq!(changes(&[Edit::Material { index: 0, material: red() }]), [FramePart::Materials]);
    assert_eq!(changes(&[Edit::Material { index: 1, material: red() }]), []);
    assert_eq!(changes(&[put(0, MaterialName("unworn".into()))]), [FramePart::Materials]);
    let spawned = Edit::Spawn(EntityDesc::new([Sphere::default().into()]));
    assert_eq!(changes(std::slice::from_ref(&spawned)), [FramePart::Geometry]);
    assert_eq!(changes(&[spawned, Edit::Despawn { entity: 3 }]), []);
}

#[test]
fn edits_and_the_scene_that_they_make_have_the_same_hash() {
    let start = scene();
    let red = Material { color: DVec3::X, ..Material::default() };
    let added = EntityDesc::new([Sphere::default().into(), MaterialName("new".into()).into()]);
    let edits = [
        Edit::AddMaterial { name: "new".into(), material: red.clone() },
        Edit::Spawn(added.clone()),
        put(0, MaterialName("unworn".into())),
        Edit::Material { index: 1, material: red.clone() },
        Edit::Take { entity: 0, kind: Kind::Transform },
        Edit::Camera(Camera { fov: 20.0, ..Camera::default() }),
    ];
    let mut end = start.clone();
    end.materials[1].1 = red.clone();
    end.materials.push(("new".into(), red));
    end.entities[0].put(MaterialName("unworn".into()).into());
    end.entities[0].take(Kind::Transform);
    end.entities.push(added);
    end.camera.fov = 20.0;
    assert_eq!(hash(&start, &edits), hash(&end, &[]));
    // Two entities that change places are another scene: the order of lights is that of their sum.
    let mut swapped = start.clone();
    swapped.entities.swap(0, 1);
    assert_ne!(hash(&swapped, &[]), hash(&start, &[]));
}

#[test]
fn files_count_by_what_is_in_them() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &str| std::fs::write(folder.path().join(name), bytes).unwrap();
    let mut scene = Scene { base: folder.path().into(), ..scene() };
    scene.render.environment = Some("sky".into());
    std::fs::create_dir(folder.path().join("sky")).unwrap();
    write("sky/top.png", "blue");
    scene.entities[0].put(Texture { image: Some("wood.png".into()), ..Texture::default() }.into());
    let missing = hash(&scene, &[]);
    write("wood.png", "oak");
    let oak = hash(&scene, &[]);
    write("wood.png", "ash");
    assert!(missing != oak && oak != hash(&scene, &[]));
    write("wood.png", "oak");
    assert_eq!(hash(&scene, &[]), oak);
    write("sky/top.png", "grey");
    assert_ne!(hash(&scene, &[]), oak);
    write("sky/note.txt", "not a picture");
    write("sky/top.png", "blue");
    assert_eq!(hash(&scene, &[]), oak);
    let rest = rest(&scene);
    assert_eq!(rest.changed_asset(), None);
    write("wood.png", "walnut");
    assert_eq!(rest.changed_asset().as_deref(), Some("wood.png"));
    std::fs::remove_file(folder.path().join("wood.png")).unwrap();
    assert_eq!(rest.changed_asset(), None);
}

/// A script of its own over a small scene.
fn shot(script: &str) -> (tempfile::TempDir, Shot) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.rhai");
    std::fs::write(&path, script).unwrap();
    let (shot, _) = open(&path, &[], false, Overrides::default()).unwrap();
    (folder, shot)
}

fn planned(shot: &mut Shot) -> plan::Plan {
    let wanted: Vec<u32> = (1..=shot.frames()).collect();
    let target = Target::Pattern { before: "nowhere/s.".into(), digits: 4, after: ".png".into() };
    plan::make(shot, &wanted, target).unwrap()
}

#[test]
fn equal_frames_know_each_other() {
    let script = "animation(#{ frames: 200 });\nfn frame(s, f) { s.camera.fov = 20 + abs(f.index % 100 - 50); }";
    let (_folder, mut shot) = shot(script);
    let plan = planned(&mut shot);
    let twins = plan.frames.iter().filter(|p| p.twin.is_some()).count();
    assert_eq!(twins, 200 - 51);
    assert_eq!((plan.frames[0].twin, plan.frames[51].twin, plan.frames[100].twin), (None, Some(50), Some(1)));
    assert_eq!(plan.frames[1].changes.as_deref(), Some(&[FramePart::Camera][..]));
    assert_eq!(plan.frames[0].file, PathBuf::from("nowhere/s.0001.png"));
}

#[test]
fn shards_are_the_whole_in_order_and_cost_about_the_same() {
    let script = "animation(#{ frames: 90 });\nfn frame(s, f) {\n  s.render.samples = if f.number < 30 { 64 } else { 4 };\n\
                  s.camera.fov = 10 + f.number;\n  if f.number == 50 { throw \"tired\"; }\n}";
    let (_folder, mut shot) = shot(script);
    for n in [1, 2, 3, 7, 90, 200] {
        let mut all = Vec::new();
        for i in 1..=n {
            let mut plan = planned(&mut shot);
            let whole: f64 = plan.frames.iter().map(plan::PlannedFrame::cost).sum();
            plan.keep_shard(i, n);
            let cost: f64 = plan.frames.iter().map(plan::PlannedFrame::cost).sum();
            assert!(n > 7 || cost < 1.5 * whole / f64::from(n), "{i}/{n}: {cost} of {whole}");
            all.extend(plan.frames.iter().map(|planned| planned.frame));
        }
        assert_eq!(all, (1..=90).collect::<Vec<u32>>());
    }
}

/// A lamp that grows brighter all the time: what it is a sum of depends on the window of 64 frames alone.
#[test]
fn one_frame_of_a_long_script_costs_the_evaluation_of_its_window() {
    let script = "animation(#{ frames: 150 });\n\
                  fn setup(s) { s.spawn(#{ name: \"key\", point_light: #{} }); s.spawn(#{ sphere: #{} }); }\n\
                  fn frame(s, f) { print(\"seen\"); s.get(\"key\").color = [0.01 * f.number, 0.1, 0.1]; }";
    let (_folder, mut all) = shot(script);
    let whole = planned(&mut all);
    let unit = |planned: &plan::PlannedFrame| planned.light_mix.as_ref().unwrap().light_groups.emitters[0].1;
    assert_eq!([1, 64, 65, 128, 129].map(|frame: usize| unit(&whole.frames[frame - 1])), [1.0, 1.0, 2.0, 2.0, 2.0]);
    for (frame, window) in [(3, "1-64"), (100, "65-128"), (150, "129-150")] {
        let (_folder, mut shot) = shot(script);
        let target = Target::Pattern { before: "nowhere/s.".into(), digits: 4, after: ".png".into() };
        let plan = plan::make(&mut shot, &[frame], target).unwrap();
        assert_eq!(plan.frames[0].hash, whole.frames[frame as usize - 1].hash);
        let said = shot.take_printed().join("\n");
        assert!(said.contains(&format!("frames {window}")) || said.contains(window), "{said}");
        assert!(!said.contains("1-150"), "{said}");
    }
}

#[test]
fn a_panic_loses_its_own_frame_only() {
    let (_folder, mut shot) = shot("animation(#{ frames: 3 });\nfn frame(s, f) { s.camera.fov = 9 + f.number; }");
    let Shot { stage, input, .. } = &mut shot;
    let before = systems::collect(stage);
    let edits = input.edits(2).unwrap();
    let failed = input.with_frame(stage, 2, edits, |_| -> Result<(), _> { panic!("the roof") }).unwrap_err();
    assert!(failed.to_string().contains("in frame 2: the renderer failed: the roof"), "{failed}");
    assert_eq!(systems::collect(stage), before);
    assert!(input.evaluate(stage, 2, None).is_ok());
}

#[test]
fn hopeless_input_is_given_up_early() {
    let (_folder, mut shot) = shot("animation(#{ frames: 100000 });\nfn frame(s, f) { loop { } }");
    let wanted: Vec<u32> = (1..=100_000).collect();
    let problems = plan::check(&mut shot, &wanted).unwrap_err();
    assert!(problems.to_string().contains("frame 1"), "{problems}");
    assert_eq!(crate::base::diagnostics::ranges(&[1, 2, 3, 7, 9, 10]), "1-3, 7, 9-10");
}

#[test]
fn a_frame_that_tells_what_has_moved_depends_on_the_frame_before() {
    let hashes = |aovs: &str, first: u32| {
        let script = format!(
            "animation(#{{ frames: 4 }});\nfn setup(s) {{ s.render.aovs = [{aovs}]; }}\n\
             fn frame(s, f) {{ s.camera.fov = if f.number == 1 {{ {first} }} else {{ 40 }}; }}"
        );
        let (_folder, mut shot) = shot(&script);
        let target = Target::Pattern { before: "nowhere/s.".into(), digits: 4, after: ".exr".into() };
        let plan = plan::make(&mut shot, &[1, 2, 3, 4], target).unwrap();
        assert_eq!(plan.frames[3].twin, Some(if aovs == "\"Motion\"" { 3 } else { 2 }));
        plan.frames.iter().for_each(|planned| {
            let fingerprint = planned.fingerprint.as_ref().unwrap();
            let shares = aovs != "\"Motion\"";
            assert_eq!((fingerprint.is_sum, fingerprint.has_static_camera), (shares, shares));
        });
        [1, 2, 3].map(|i: usize| plan.frames[i].hash)
    };
    let (one, other) = (hashes("\"Motion\"", 20), hashes("\"Motion\"", 30));
    assert!(one[0] != other[0] && one[1..] == other[1..] && one[0] != one[1] && one[1] == one[2]);
    assert_eq!(hashes("\"Depth\"", 20), hashes("\"Depth\"", 30));
}
