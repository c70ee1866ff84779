//! Wavefront OBJ: all groups of a file as one mesh; materials are the scene's matter.

use glam::{Vec2, Vec3};

use crate::components::MeshData;

pub fn parse(bytes: &[u8]) -> Result<MeshData, String> {
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut &bytes[..], &options, no_materials).map_err(|e| e.to_string())?;
    let mut data = MeshData::default();
    let all_have_normals = models.iter().all(|model| !model.mesh.normals.is_empty());
    let all_have_uvs = models.iter().all(|model| !model.mesh.texcoords.is_empty());
    for mesh in models.into_iter().map(|model| model.mesh) {
        let first = data.vertices.len() as u32;
        let vectors = |flat: &[f32]| flat.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
        data.vertices.extend(vectors(&mesh.positions));
        if all_have_normals {
            data.normals.extend(vectors(&mesh.normals));
        }
        if all_have_uvs {
            data.uvs.extend(mesh.texcoords.chunks_exact(2).map(Vec2::from_slice));
        }
        let corners = mesh.indices.chunks_exact(3);
        data.triangles.extend(corners.map(|c| [first + c[0], first + c[1], first + c[2]]));
    }
    Ok(data)
}
