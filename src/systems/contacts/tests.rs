use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{
    ContactNudges, ContactsLeftOut, FACE_BYTES, contact_nudges, contacts_left_out, left_out_within, nudges_within,
};
use crate::base::limits;
use crate::components::*;
use crate::systems::{spawn, update_hierarchy};

/// A square floor of tiles at height 0, two triangles each, from -1 to 1 on x and z.
fn floor(side: u32) -> Mesh {
    let place = |i: u32| i as f32 * 2.0 / side as f32 - 1.0;
    let vertices = (0..=side).flat_map(|z| (0..=side).map(move |x| Vec3::new(place(x), 0.0, place(z)))).collect();
    let pair = |x: u32, z: u32| {
        let [a, b] = [z * (side + 1) + x, (z + 1) * (side + 1) + x];
        [[a, b, b + 1], [a, b + 1, a + 1]]
    };
    let triangles = (0..side).flat_map(|z| (0..side).flat_map(move |x| pair(x, z))).collect();
    let mut data = MeshData::default();
    (data.vertices, data.triangles) = (vertices, triangles);
    Mesh { data: Arc::new(data), ..Mesh::default() }
}

/// A glass block of a fifth of the floor's width whose bottom is at this height.
fn block(height: f64) -> EntityDesc {
    let [min, max] = [DVec3::new(-0.1, height, -0.1), DVec3::new(0.1, height + 0.2, 0.1)];
    EntityDesc::new([AABox { min, max }.into(), MaterialName("glass".into()).into()])
}

#[test]
fn a_block_is_lifted_off_a_floor_of_any_number_of_triangles() {
    let glass = Material { transmission: 1.0, ior: Some(1.5), ..Material::default() };
    assert!(glass.is_transparent());
    for side in [2, 250] {
        let floor = floor(side);
        assert_eq!(floor.data.triangles.len() > limits::CONTACT_FACES, side == 250);
        for (height, touches) in [(0.0, true), (0.01, false), (-0.1, false)] {
            let scene = Scene {
                materials: vec![("glass".into(), glass.clone())],
                entities: vec![EntityDesc::new([floor.clone().into()]), block(height)],
                ..Scene::default()
            };
            let mut stage = spawn(scene).unwrap();
            update_hierarchy(&mut stage).unwrap();
            let nudges = contact_nudges(&stage);
            let up = nudges.of(1).map_or(0.0, |map| map.translation.y);
            assert_eq!(up > 0.0, touches, "{side} tiles, {height}: {up}");
            assert!(nudges.of(0).is_none());
        }
    }
}

/// Bodies whose faces are too many to be looked at are found where that leaves a contact alone, and nowhere else.
#[test]
fn contacts_beyond_the_caps_are_known() {
    let differing = |height: f64, most_faces: usize| {
        let scene = Scene {
            materials: vec![("glass".into(), Material { model: Model::Dielectric, ..Material::default() })],
            entities: vec![block(height), EntityDesc::new([Plane::default().into()])],
            ..Scene::default()
        };
        let mut stage = spawn(scene).unwrap();
        update_hierarchy(&mut stage).unwrap();
        assert_eq!(contacts_left_out(&stage), ContactsLeftOut { bodies: vec![], cut: None });
        let capped = nudges_within(&stage, most_faces, limits::CONTACT_TESTS);
        capped.differing(&contact_nudges(&stage)).collect::<Vec<_>>()
    };
    // Six faces of the block, and the plane.
    assert_eq!((differing(0.0, 7), differing(0.0, 6)), (vec![], vec![0]));
    assert_eq!(differing(0.1, 6), [] as [usize; 0], "above the plane");
}

/// What is looked for follows from the memory that is left, and never goes below what rendering looks at.
#[test]
fn contacts_are_looked_for_in_the_memory_that_is_left() {
    // Two floors near each other, together of more faces than rendering looks at, and a block on the upper one.
    let height = 5e-5;
    let floors = [0.0, height].map(|y| {
        let transform = Transform { translation: DVec3::new(0.0, y, 0.0), ..Transform::default() };
        EntityDesc::new([floor(200).into(), transform.into()])
    });
    let scene = Scene {
        materials: vec![("glass".into(), Material { model: Model::Dielectric, ..Material::default() })],
        entities: floors.into_iter().chain([block(height)]).collect(),
        ..Scene::default()
    };
    let mut stage = spawn(scene).unwrap();
    update_hierarchy(&mut stage).unwrap();
    let faces = 2 * 2 * 200 * 200 + 6;
    let within = |faces: usize| left_out_within(&stage, Some(faces as u64 * FACE_BYTES));
    assert_eq!(within(faces), ContactsLeftOut { bodies: vec![2], cut: None });
    assert_eq!(within(faces - 1), ContactsLeftOut { bodies: vec![], cut: Some((faces - 1, true)) });
    assert_eq!(within(0), ContactsLeftOut { bodies: vec![], cut: Some((limits::CONTACT_FACES, true)) });
}

#[test]
fn of_more_meshes_than_can_be_compared_none_is_moved() {
    let tile = floor(6);
    let count = limits::CONTACT_PAIRS.isqrt() + 1;
    assert!(count * tile.data.triangles.len() > limits::CONTACT_FACES);
    let scene = Scene { entities: vec![EntityDesc::new([tile.into()]); count], ..Scene::default() };
    let mut stage = spawn(scene).unwrap();
    update_hierarchy(&mut stage).unwrap();
    assert_eq!(contact_nudges(&stage), ContactNudges::default());
}
