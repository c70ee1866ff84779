//! Mesh files that a script chooses frame by frame, and sequences of files with a number in their names.

use std::sync::{Arc, Mutex, PoisonError};

use super::adopt;
use super::{Loaded, load};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::base::files::numbered;
use crate::base::limits;
use crate::components::*;

/// Mesh files that edits name; those that were read last are kept.
#[derive(Default)]
pub struct MeshFiles(Mutex<Vec<Known>>);

#[derive(Clone)]
struct Known {
    file: Text,
    decoded: bool,
    data: Arc<MeshData>,
    materials: Arc<[(Text, Material)]>,
}

/// The file of a sequence that a mesh stands at, the one after it, and how far it is on its way there.
pub struct SequencePosition {
    pub file: Text,
    pub next: Option<(Text, f32)>,
}

impl SequencePosition {
    /// `None` for a mesh without a file.
    pub fn of(mesh: &Mesh) -> Option<SequencePosition> {
        let file = mesh.file.clone()?;
        if !file.contains('#') {
            return Some(SequencePosition { file, next: None });
        }
        let frame = mesh.frame.unwrap_or(1.0).max(0.0);
        let (whole, rest) = (frame.floor(), (frame - frame.floor()) as f32);
        let numbered = |number: f64| Text::from(numbered(&file, number as u64));
        let next = (rest > 0.0).then(|| (numbered(whole + 1.0), rest));
        Some(SequencePosition { file: numbered(whole), next })
    }
}

/// A mesh on its way from one to the next, as far as it is one mesh that moves.
pub fn between(from: &Arc<MeshData>, next: Option<(&MeshData, f32)>) -> Arc<MeshData> {
    let moved = next.and_then(|(to, share)| from.toward(to, share));
    moved.map_or_else(|| from.clone(), Arc::new)
}

impl MeshFiles {
    /// The edits with the meshes read that they name, and the materials added that these bring.
    ///
    /// # Errors
    /// Files that cannot be read, with who names them.
    pub fn complete(&self, rest: &Scene, mut edits: Vec<Edit>) -> Result<Vec<Edit>, Diagnostics> {
        if !edits.iter().any(|edit| mesh_of(edit).is_some_and(wants_file)) {
            return Ok(edits);
        }
        let render = edits.iter().rev().find_map(|edit| match edit {
            Edit::Render(render) => Some(render),
            _ => None,
        });
        let decoded = render.unwrap_or(&rest.render).transfer == Transfer::Srgb;
        let mut added: Vec<(Text, Material)> = edits
            .iter()
            .filter_map(|edit| match edit {
                Edit::AddMaterial { name, material } => Some((name.clone(), material.clone())),
                _ => None,
            })
            .collect();
        let first_new = added.len();
        let mut problems = Vec::new();
        let mut spawned = rest.entities.len();
        for edit in &mut edits {
            let index = match edit {
                Edit::Put { entity, .. } => *entity,
                _ => spawned,
            };
            spawned += usize::from(matches!(edit, Edit::Spawn(_)));
            let owner = match edit {
                Edit::Put { entity, .. } => rest.entities.get(*entity).map(|desc| desc.label(*entity)),
                Edit::Spawn(desc) => desc.name.as_ref().map(|name| format!("entity `{name}`")),
                _ => None,
            };
            let Some(mesh) = mesh_of(edit).filter(|mesh| wants_file(mesh)) else { continue };
            match self.read(rest, mesh, decoded, &mut added) {
                Ok(data) => put_data(edit, data),
                Err(problem) => {
                    let owner = owner.unwrap_or_else(|| "a new entity".into());
                    let message = format!("mesh of {owner}: {}", problem.message);
                    let (part, component) = (ScenePart::Entity(index), Some(Kind::Mesh.name()));
                    let subject = Subject { part, component, field: Some("file") };
                    problems.push(Diagnostic { message, ..problem }.about(subject).about(part));
                }
            }
        }
        if !problems.is_empty() {
            return Err(Diagnostics(problems));
        }
        // Materials are there before what is made of them.
        let early = |edit: &Edit| match edit {
            Edit::Camera(_) | Edit::Cameras(_) | Edit::Render(_) | Edit::Material { .. } | Edit::AddMaterial { .. } => {
                true
            }
            Edit::Put { .. } | Edit::Take { .. } | Edit::Tags { .. } | Edit::Spawn(_) | Edit::Despawn { .. } => false,
        };
        let at = edits.iter().position(|edit| !early(edit)).unwrap_or(edits.len());
        let new = added.drain(first_new..).map(|(name, material)| Edit::AddMaterial { name, material });
        edits.splice(at..at, new);
        Ok(edits)
    }

    fn read(
        &self,
        rest: &Scene,
        mesh: &Mesh,
        decoded: bool,
        added: &mut Vec<(Text, Material)>,
    ) -> Result<Arc<MeshData>, Diagnostic> {
        let Some(position) = SequencePosition::of(mesh) else { return Ok(mesh.data.clone()) };
        let here = self.file(rest, &position.file, decoded)?;
        // A sequence ends with its last file.
        let next = position.next.and_then(|(file, share)| Some((self.file(rest, &file, decoded).ok()?, share)));
        let mut data = between(&here.data, next.as_ref().map(|(known, share)| (&*known.data, *share)));
        if !data.materials.is_empty() {
            let names = adopt::names_for(&here.materials, &position.file, rest, added);
            let is_named = data.materials.iter().all(|set| names.get(&set.name) == Some(&set.name));
            if !is_named {
                let named = Arc::make_mut(&mut data);
                named.materials.retain_mut(|set| {
                    let name = names.get(&set.name);
                    name.inspect(|name| set.name = (*name).clone()).is_some()
                });
            }
        }
        Ok(data)
    }

    fn file(&self, rest: &Scene, file: &Text, decoded: bool) -> Result<Known, Diagnostic> {
        // A thread that fell over left a whole list behind.
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = lock().iter().find(|known| known.file == *file && known.decoded == decoded) {
            return Ok(known.clone());
        }
        let Loaded { data, materials, .. } = load(&rest.base, file, decoded)?;
        let mut images = ImageCache::default();
        let complete = |brought| adopt::complete(&mut images, rest, decoded, brought, &mut Vec::new());
        let materials = materials.iter().map(|brought| brought.name.clone()).zip(materials.iter().map(complete));
        let known = Known { file: file.clone(), decoded, data: Arc::new(data), materials: materials.collect() };
        let mut kept = lock();
        if kept.len() >= limits::MESH_FILES_KEPT {
            kept.remove(0);
        }
        kept.push(known.clone());
        Ok(known)
    }
}

fn wants_file(mesh: &Mesh) -> bool {
    mesh.file.is_some() && mesh.data.vertices.is_empty() && mesh.data.triangles.is_empty()
}

fn mesh_of(edit: &Edit) -> Option<&Mesh> {
    let component = match edit {
        Edit::Put { component, .. } => Some(component),
        Edit::Spawn(desc) => desc.get(Kind::Mesh),
        Edit::Camera(_)
        | Edit::Cameras(_)
        | Edit::Render(_)
        | Edit::Material { .. }
        | Edit::AddMaterial { .. }
        | Edit::Take { .. }
        | Edit::Tags { .. }
        | Edit::Despawn { .. } => None,
    };
    match component {
        Some(Component::Mesh(mesh)) => Some(mesh),
        _ => None,
    }
}

fn put_data(edit: &mut Edit, data: Arc<MeshData>) {
    match edit {
        Edit::Put { component: Component::Mesh(mesh), .. } => mesh.data = data,
        Edit::Spawn(desc) => {
            if let Some(Component::Mesh(mesh)) = desc.get(Kind::Mesh) {
                desc.put(Mesh { data, ..mesh.clone() }.into());
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_goes_from_file_to_file() {
        let at = |frame: f64| {
            let mesh = Mesh { file: Some("a.##.obj".into()), frame: Some(frame), ..Mesh::default() };
            let SequencePosition { file, next } = SequencePosition::of(&mesh).unwrap();
            (file.to_string(), next.map(|(file, share)| (file.to_string(), share)))
        };
        assert_eq!(at(3.0), ("a.03.obj".into(), None));
        assert_eq!(at(3.25), ("a.03.obj".into(), Some(("a.04.obj".into(), 0.25))));
    }

    #[test]
    fn edits_bring_meshes_with_their_materials() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        for (name, x) in [("m.01.obj", 0), ("m.02.obj", 4)] {
            write(
                name,
                &format!("mtllib m.mtl\nv {x} 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl own\nf 1 2 3\n"),
            );
        }
        write("m.mtl", "newmtl red\nKd 1 0 0\nnewmtl own\nKd 0 1 0\n");
        let rest = Scene {
            base: folder.path().into(),
            materials: vec![("own".into(), Material::default())],
            entities: vec![EntityDesc::default()],
            ..Scene::default()
        };
        let put = |frame| {
            let mesh = Mesh { file: Some("m.##.obj".into()), frame: Some(frame), ..Mesh::default() };
            vec![Edit::Tags { entity: 0, tags: Vec::new() }, Edit::Put { entity: 0, component: mesh.into() }]
        };
        let files = MeshFiles::default();
        let edits = files.complete(&rest, put(1.5)).unwrap();
        assert!(matches!(&edits[0], Edit::AddMaterial { name, .. } if &**name == "red"), "{:?}", edits[0]);
        let Edit::Put { component: Component::Mesh(mesh), .. } = &edits[2] else { panic!() };
        assert_eq!(mesh.data.vertices[0].x, 2.0);
        assert_eq!(mesh.worn().map(|name| &**name).collect::<Vec<_>>(), ["red", "own"]);
        // Behind the last file of a sequence there is none to go to.
        let last = files.complete(&rest, put(2.5)).unwrap();
        assert_eq!(mesh_of(&last[2]).unwrap().data.vertices[0].x, 4.0);
        let said = files.complete(&rest, put(7.0)).unwrap_err().to_string();
        assert!(said.contains("mesh of entity 1: cannot read") && said.contains("m.07.obj"), "{said}");
    }
}
