//! Meshes on their way to others of the same triangles.

use std::sync::Arc;

use ::rhai::Dynamic;

use super::convert::{describe, number};
use super::errors::{Fallible, complain};
use super::geometry::MeshHandle;
use super::handles::{RecordHandle, RecordPath};
use super::table::{Chapter, Function};
use crate::components::{ComponentType, Kind, Mesh};

/// A mesh that was made, or that of an entity.
fn mesh_of(value: &Dynamic) -> Fallible<Mesh> {
    if let Some(made) = value.read_lock::<MeshHandle>() {
        return Ok(made.0.clone());
    }
    if let Some(RecordHandle { scene, place: RecordPath::Component(entity, Kind::Mesh) }) =
        value.clone().try_cast::<RecordHandle>()
        && let Some(mesh) = scene.lock().component(entity, Kind::Mesh).and_then(Mesh::of)
    {
        return Ok(mesh.clone());
    }
    complain(format!("blend: expected a mesh, found {}", describe(value)), None)
}

/// Shares of a blend beyond which nothing sensible is left.
const MOST_BLENDED: f64 = 100.0;

fn blend(from: &Dynamic, to: &Dynamic, share: &Dynamic) -> Fallible<MeshHandle> {
    let (from, to, share) = (mesh_of(from)?, mesh_of(to)?, number(share)?);
    if !(-MOST_BLENDED..=MOST_BLENDED).contains(&share) {
        return complain(format!("blend: the share must be from -{MOST_BLENDED} to {MOST_BLENDED}, not {share}"), None);
    }
    let Some(data) = from.data.toward(&to.data, share as f32) else {
        let count = |mesh: &Mesh| (mesh.data.vertices.len(), mesh.data.triangles.len());
        let (a, b) = (count(&from), count(&to));
        let message = match a == b {
            true => "blend: the two meshes have other triangles".to_string(),
            false => format!("blend: {} vertices and {} triangles do not become {} and {}", a.0, a.1, b.0, b.1),
        };
        return complain(message, Some("meshes of one topology differ in where their vertices are alone".into()));
    };
    // What is on its way is in no file.
    Ok(MeshHandle(Mesh { file: None, frame: None, data: Arc::new(data), ..from }))
}

pub const CHAPTER: Chapter = Chapter {
    title: "Morphs",
    functions: &[Function {
        name: "blend",
        forms: &["mesh.blend(other, share) -> mesh"],
        text: "A mesh on its way to another one of the same triangles: made with the same segments, or read from files that \
                   differ in where their vertices are.",
        arguments: &[
            ("mesh", "what is at a share of 0: a mesh that was made, or that of an entity"),
            ("other", "the mesh at a share of 1, made or of an entity"),
            ("share", "0 gives the mesh, 1 the other; beyond both it goes on, from -100 to 100"),
        ],
        example: "let ring = torus(1, 0.25);\n\
                      let half = s.spawn(#{ mesh: ring.blend(torus(1, 0.75), 0.5), material: \"brass\" });\n\
                      half.bounds.size.y       // 1.0",
        register: |engine| {
            engine
                .register_fn("blend", |from: &mut MeshHandle, to: Dynamic, share: Dynamic| {
                    blend(&Dynamic::from(from.clone()), &to, &share)
                })
                .register_fn("blend", |from: &mut RecordHandle, to: Dynamic, share: Dynamic| {
                    blend(&Dynamic::from(from.clone()), &to, &share)
                });
        },
    }],
};
