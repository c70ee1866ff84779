//! The systems against small Worlds whose answer is known.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::hierarchy::Placement;
use super::stage::{BuiltAccelerator, MaterialIndex};
use super::*;
use crate::base::diagnostics::{ScenePart, Subject};
use crate::components::*;

fn ball(name: &str, at: [f64; 3]) -> EntityDesc {
    let transform = Transform { translation: at.into(), ..Transform::default() };
    EntityDesc::new([transform.into(), Sphere::default().into(), MaterialName("red".into()).into()]).named(name)
}

fn child(name: &str, parent: &str, at: [f64; 3], yaw: f64) -> EntityDesc {
    let transform = Transform {
        translation: at.into(),
        rotation: DVec3::Y * yaw,
        parent: Some(parent.into()),
        ..Transform::default()
    };
    EntityDesc::new([transform.into(), AABox::default().into()]).named(name)
}

fn scene() -> Scene {
    let lamp = PointLight { position: DVec3::new(0.0, 9.0, 3.0), ..PointLight::default() };
    Scene {
        materials: vec![("red".into(), Material::default())],
        entities: vec![
            ball("a", [0.0, 0.0, 0.0]),
            child("b", "a", [2.0, 0.0, 0.0], 90.0),
            child("c", "b", [1.0, 0.0, 0.0], 0.0),
            EntityDesc::new([lamp.into()]).named("lamp"),
        ],
        render: Render { size: [24, 16], samples: 4, ..Render::default() },
        ..Scene::default()
    }
}

fn film(stage: &mut Stage) -> crate::film::Film {
    let (film, _) = render(stage, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
    film
}

fn put(entity: usize, component: impl Into<Component>) -> Edit {
    Edit::Put { entity, component: component.into() }
}

#[test]
fn a_world_collects_to_the_scene_it_came_from() {
    let stage = spawn(scene()).unwrap();
    assert_eq!(collect(&stage), scene());
}

#[test]
fn children_stand_in_their_parents_space() {
    let stage = spawn(scene()).unwrap();
    let at = |i: usize| stage.world.get::<&Placement>(stage.entities[i]).unwrap().0.translation;
    assert_eq!(at(1), DVec3::new(2.0, 0.0, 0.0));
    // A quarter turn about y carries the child's x to -z.
    assert_eq!(at(2), DVec3::new(2.0, 0.0, -1.0));
}

#[test]
fn every_edit_can_be_taken_back() {
    let mut stage = spawn(scene()).unwrap();
    let before = film(&mut stage);
    let edits = vec![
        Edit::Camera(Camera { from: DVec3::new(0.0, 3.0, 9.0), ..Camera::default() }),
        Edit::Render(Render { background: DVec3::X, ..scene().render }),
        Edit::AddMaterial { name: "blue".into(), material: Material::default() },
        Edit::Material { index: 0, material: Material { color: DVec3::Z, ..Material::default() } },
        put(0, MaterialName("blue".into())),
        put(0, Cone::default()),
        Edit::Take { entity: 1, kind: Kind::AABox },
        Edit::Tags { entity: 2, tags: vec!["x".into()] },
        Edit::Spawn(child("d", "a", [0.0, 1.0, 0.0], 0.0)),
        put(4, Sphere::default()),
        Edit::Despawn { entity: 2 },
    ];
    let taken_back = animate(&mut stage, edits).unwrap();
    assert_ne!(collect(&stage), scene());
    assert_ne!(film(&mut stage), before);
    undo(&mut stage, taken_back);
    assert_eq!(collect(&stage), scene());
    assert_eq!(film(&mut stage), before);
}

#[test]
fn a_failed_edit_leaves_nothing_behind() {
    let mut stage = spawn(scene()).unwrap();
    let turned = Transform { parent: Some("c".into()), ..Transform::default() };
    for (edit, expected) in [
        (put(0, turned), "parents go round in a circle: entity `a` -> entity `c` -> entity `b` -> entity `a`"),
        (put(0, Sphere { radius: f64::NAN, ..Sphere::default() }), "entity `a`: sphere: `radius` must be a finite"),
        (put(1, MaterialName("rde".into())), "unknown material `rde` of entity `b`\n  help: did you mean `red`?"),
        (put(9, Sphere::default()), "entity 10 does not exist"),
        (Edit::Despawn { entity: 0 }, "the parent `a` of entity `b` was removed"),
        (Edit::Spawn(ball("b", [0.0; 3])), "two entities are called `b`"),
    ] {
        let problems = animate(&mut stage, vec![put(1, Cylinder::default()), edit]).err().unwrap();
        assert!(problems.to_string().contains(expected), "{problems}");
        assert_eq!(collect(&stage), scene());
    }
}

#[test]
fn what_an_edit_leaves_alone_is_not_rebuilt() {
    let mut stage = spawn(scene()).unwrap();
    film(&mut stage);
    let columns = |stage: &Stage| stage.derived.geometry.as_ref().unwrap().1.clone();
    let before = columns(&stage);
    let same_after = |stage: &mut Stage, edit: Edit| {
        let taken_back = animate(stage, vec![edit]).unwrap();
        film(stage);
        let same = Arc::ptr_eq(&columns(stage), &before);
        undo(stage, taken_back);
        same
    };
    assert!(same_after(&mut stage, Edit::Camera(Camera { fov: 20.0, ..Camera::default() })));
    assert!(same_after(&mut stage, put(3, PointLight { color: DVec3::X, ..PointLight::default() })));
    assert!(same_after(&mut stage, put(3, Transform { translation: DVec3::Y, ..Transform::default() })));
    let red = Material { color: DVec3::X, ..Material::default() };
    assert!(same_after(&mut stage, Edit::Material { index: 0, material: red }));
    assert!(!same_after(&mut stage, put(0, Sphere { radius: 0.5, ..Sphere::default() })));
}

#[test]
fn entities_that_move_stand_where_a_new_world_has_them() {
    let turned = |parent: Option<&str>| Transform {
        rotation: DVec3::new(9.0, 40.0, -0.0),
        translation: DVec3::X,
        parent: parent.map(Text::from),
        ..Transform::default()
    };
    let placements = |stage: &Stage| {
        let all = stage.entities.iter();
        all.map(|e| stage.world.get::<&Placement>(*e).ok().map(|p| *p)).collect::<Vec<_>>()
    };
    let mut stage = spawn(scene()).unwrap();
    // `c` stands in the space of `b`, and `b` in that of `a`.
    for edits in [
        vec![put(0, turned(None))],
        vec![put(1, turned(Some("a"))), put(0, turned(None))],
        vec![put(2, turned(Some("a"))), put(0, turned(None))],
        vec![put(1, turned(None)), put(3, turned(Some("c")))],
        vec![Edit::Take { entity: 0, kind: Kind::Transform }, put(3, turned(None))],
        vec![Edit::Take { entity: 1, kind: Kind::Transform }],
        vec![Edit::Spawn(child("d", "c", [1.0; 3], 5.0)), put(2, turned(Some("b")))],
    ] {
        let taken_back = animate(&mut stage, edits).unwrap();
        assert_eq!(placements(&stage), placements(&spawn(collect(&stage)).unwrap()));
        undo(&mut stage, taken_back);
        hierarchy::update(&mut stage).unwrap();
        assert_eq!(placements(&stage), placements(&spawn(scene()).unwrap()));
    }
}

#[test]
fn materials_of_entities_are_those_that_a_new_world_has() {
    let numbers = |stage: &Stage| {
        let all = stage.entities.iter();
        all.map(|e| stage.world.get::<&MaterialIndex>(*e).ok().map(|number| number.0)).collect::<Vec<_>>()
    };
    let mut stage = spawn(scene()).unwrap();
    let late = || {
        let mut desc = ball("d", [1.0; 3]);
        desc.put(MaterialName("late".into()).into());
        desc
    };
    let add = |name: &str| Edit::AddMaterial { name: name.into(), material: Material::default() };
    for edits in [
        vec![add("new"), put(0, MaterialName("new".into())), put(1, MaterialName("red".into()))],
        vec![Edit::Take { entity: 0, kind: Kind::MaterialName }],
        vec![Edit::Spawn(late()), add("late")],
    ] {
        let taken_back = animate(&mut stage, edits).unwrap();
        assert_eq!(numbers(&stage), numbers(&spawn(collect(&stage)).unwrap()));
        undo(&mut stage, taken_back);
        hierarchy::update(&mut stage).unwrap();
        assert_eq!(numbers(&stage), numbers(&spawn(scene()).unwrap()));
    }
}

#[test]
fn a_missing_file_is_told_and_not_read() {
    let texture = Texture { image: Some("wood.png".into()), ..Texture::default() };
    let mut scene = scene();
    scene.entities[1].put(texture.clone().into());
    scene.entities[2].put(texture.into());
    scene.render.environment = Some("sky".into());
    let mut stage = spawn(scene).unwrap();
    let file = |file: &str, owner: &str, part, component, field| {
        let subject = Subject { part, component, field: Some(field) };
        FileRequest { file: file.into(), plane: ImagePlane::Srgb, owner: owner.into(), subject }
    };
    let image = file("wood.png", "texture of entity `b`", ScenePart::Entity(1), Some("texture"), "image");
    assert_eq!(missing_images(&stage), [image]);
    let environment = file("sky", "`environment`", ScenePart::Render, None, "environment");
    assert_eq!(missing_environment(&stage), Some(environment));
    let said = render(&mut stage, &AtomicBool::new(false), &|_, _| {}).unwrap_err().to_string();
    assert!(said.contains("`sky` was not loaded") && said.contains("a mistake in anim"), "{said}");
}

#[test]
fn a_mirrored_mesh_keeps_its_outside() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let one_sided = Material { two_sided: false, ..Material::default() };
    let mut scene = Scene { materials: vec![("m".into(), one_sided)], ..scene() };
    let transform = Transform { scale: Scale(DVec3::new(-1.0, 1.0, 1.0)), ..Transform::default() };
    let triangle = Triangle { vertices: corners, normals: None, uvs: None };
    scene.entities = vec![EntityDesc::new([transform.into(), triangle.into(), MaterialName("m".into()).into()])];
    scene.camera = Camera { from: DVec3::new(-0.2, 0.2, 5.0), at: DVec3::new(-0.2, 0.2, 0.0), ..Camera::default() };
    let mut stage = spawn(scene).unwrap();
    let (_, stats) = render(&mut stage, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
    assert!(stats.counters.primary_hits > 0);
}

/// 1559 triangles.
fn sheet() -> Arc<MeshData> {
    let side = 40;
    let vertices = (0..side * side).map(|i| glam::Vec3::new((i % side) as f32, (i / side) as f32, 0.0)).collect();
    let corner = |i: u32| [i, i + 1, i + side + 1];
    let triangles = (0..side * (side - 1) - 1).map(corner).collect();
    Arc::new(MeshData::new(vertices, triangles, Vec::new()))
}

#[test]
fn a_tree_is_as_good_as_the_rays_that_are_expected_are_worth() {
    let mut entities = scene().entities;
    let transform = Transform { translation: DVec3::new(-20.0, -20.0, -50.0), ..Transform::default() };
    entities.push(EntityDesc::new([transform.into(), Mesh { data: sheet(), ..Mesh::default() }.into()]));
    let few = Scene { entities, render: Render { samples: 1, ..scene().render }, ..scene() };
    let many = Scene { render: Render { samples: 64, ..scene().render }, ..few.clone() };
    let is_fast = |stage: &Stage| stage.derived.accelerators.first().unwrap().accelerator.is_outgrown(f64::INFINITY);
    let after = |scene: &Scene, pictures: u32| {
        let mut stage = spawn(scene.clone()).unwrap();
        stage.set_frames_left(pictures);
        film(&mut stage);
        stage
    };
    assert!(is_fast(&after(&few, 1)));
    assert!(!is_fast(&after(&many, 1)));
    let mut stage = after(&few, 100);
    assert!(!is_fast(&stage));
    // Another number of primitives: what was built did not last long.
    animate(&mut stage, vec![Edit::Spawn(ball("new", [0.5; 3]))]).unwrap();
    let at_first = film(&mut stage);
    assert!(is_fast(&stage));
    // Then all stands still, and a better tree begins to pay.
    (0..5).for_each(|_| assert_eq!(film(&mut stage), at_first));
    assert!(!is_fast(&stage));
}

#[test]
fn a_mesh_that_many_entities_use_is_stored_once() {
    let data = sheet();
    let copy = |i: u32| {
        let translation = DVec3::new(f64::from(i % 100), f64::from(i / 100), -50.0);
        let transform = Transform { translation, ..Transform::default() };
        EntityDesc::new([transform.into(), Mesh { data: data.clone(), ..Mesh::default() }.into()])
    };
    let entities = (0..10_000).map(copy).collect();
    let mut stage = spawn(Scene { entities, ..scene() }).unwrap();
    film(&mut stage);
    let (_, geometry) = stage.derived.geometry.as_ref().unwrap();
    let BuiltAccelerator { accelerator, .. } = stage.derived.accelerators.first().unwrap();
    assert_eq!((geometry.len(), geometry.prototypes().len(), geometry.instances().len()), (10_000, 1, 10_000));
    let bytes = accelerator.bytes() + size_of_val(&data.triangles[..]);
    assert!(bytes < 10_000 * 1_000, "{bytes}");
}
