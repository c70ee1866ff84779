//! Mesh files: OBJ through `tobj`, PLY through `ply-rs-bw`.

mod obj;
mod ply;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::resolve::{Problem, component_path, key};
use crate::base::project::FileRole;
use crate::base::{files, limits};
use crate::components::*;

/// Why a mesh could not be read, and what may help.
type Failure = (String, Option<String>);

/// Reads the files of all meshes of a scene; a file that several entities use is read once and shared.
pub fn load_all(scene: &mut Scene) -> Vec<Problem> {
    let mut known: FxHashMap<PathBuf, Result<Arc<MeshData>, Failure>> = FxHashMap::default();
    let mut problems = Vec::new();
    for (index, desc) in scene.entities.iter_mut().enumerate() {
        let Some(mesh) = desc.component::<Mesh>() else { continue };
        let Some(file) = &mesh.file else { continue };
        let mut path = component_path(index, Kind::Mesh);
        path.push(key("file"));
        if !mesh.data.vertices.is_empty() || !mesh.data.triangles.is_empty() {
            problems.push(Problem::new(path, "a mesh comes from a `file` or has `vertices` and `triangles`, not both"));
            continue;
        }
        let full = match scene.base.find(file, FileRole::Mesh) {
            Ok(full) => full,
            Err(refused) => {
                problems.push(Problem::new(path, refused.message).help(refused.help));
                continue;
            }
        };
        match known.entry(full.clone()).or_insert_with(|| load(&full).map(Arc::new)) {
            Ok(data) => {
                let loaded = Mesh { data: data.clone(), ..mesh.clone() };
                desc.put(loaded.into());
            }
            Err((message, help)) => problems.push(Problem::new(path, message.clone()).help(help.clone())),
        }
    }
    problems
}

/// Reads one mesh file by its ending.
pub fn load(path: &Path) -> Result<MeshData, Failure> {
    let bytes = files::read_bytes(path, limits::MESH_FILE_BYTES).map_err(|d| (d.message, d.help))?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let read = match extension.as_str() {
        "obj" => obj::parse(&bytes),
        "ply" => ply::parse(&bytes),
        _ => {
            return Err((format!("{}: not a mesh that can be read", path.display()), Some("known: .obj, .ply".into())));
        }
    };
    let data = read.and_then(checked).map_err(|message| (format!("{}: {message}", path.display()), None))?;
    Ok(data)
}

fn checked(data: MeshData) -> Result<MeshData, String> {
    if data.triangles.is_empty() {
        return Err("the mesh has no faces".into());
    }
    if data.triangles.len() > limits::TRIANGLES {
        return Err(format!("the mesh has more than {} triangles", limits::TRIANGLES));
    }
    let mesh = Mesh { data: Arc::new(data), ..Mesh::default() };
    mesh.check().map_err(|invalid| invalid.message)?;
    Ok(Arc::unwrap_or_clone(mesh.data))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, bytes: &[u8]) -> Result<MeshData, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        load(&path).map_err(|(message, _)| message)
    }

    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                       element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                       0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

    #[test]
    fn an_obj_square_is_two_triangles() {
        let data = read("a.obj", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
        assert_eq!((data.vertices.len(), data.triangles.len()), (4, 2));
        let normals = read("n.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n").unwrap().normals;
        assert_eq!(normals, [glam::Vec3::Z; 3]);
    }

    #[test]
    fn a_ply_square_is_two_triangles() {
        let data = read("a.ply", PLY.as_bytes()).unwrap();
        assert_eq!(data.triangles, [[0, 1, 2], [0, 2, 3]]);
        let binary = PLY.split("end_header\n").next().unwrap().replace("ascii", "binary_little_endian");
        let mut bytes = (binary + "end_header\n").into_bytes();
        for x in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0] {
            bytes.extend(x.to_le_bytes());
        }
        bytes.push(4);
        (0..4i32).for_each(|i| bytes.extend(i.to_le_bytes()));
        assert_eq!(read("b.ply", &bytes).unwrap(), data);
        for cut in 0..bytes.len() {
            assert!(read("c.ply", &bytes[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn broken_meshes_are_refused() {
        assert!(read("a.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").is_err());
        assert!(read("a.obj", b"v 0 0 0\nf 1 2 3\n").is_err());
        assert!(read("a.obj", b"").unwrap_err().contains("no faces"));
        let vast = PLY.replace("vertex 4", "vertex 4000000000");
        assert!(read("a.ply", vast.as_bytes()).unwrap_err().contains("declares"));
        assert!(
            read("a.ply", PLY.replace("4 0 1 2 3", "4 0 1 2 9").as_bytes()).unwrap_err().contains("does not exist")
        );
        assert!(read("a.ply", b"\xff\x00junk").is_err());
        assert!(read("a.stl", b"").unwrap_err().contains("not a mesh"));
    }
}
