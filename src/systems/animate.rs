//! Edits -> World, and back.
//!
//! The edits of a frame are data. Applying them records how each is taken back, so that every frame starts from the
//! same rest values without the World being spawned anew.

use hecs::EntityBuilder;

use super::stage::{Despawned, Name, NamedCameras, Stage, Tags, put, take};
use super::{extract, hierarchy, spawn};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart};
use crate::components::*;

/// How to take back what [`animate`] did.
pub struct Undo(Vec<Inverse>);

enum Inverse {
    Camera(Camera),
    Cameras(Vec<(Text, Camera)>),
    Render(Render),
    Material(usize, Material),
    RemoveMaterial,
    Put(usize, Component),
    Take(usize, Kind),
    Tags(usize, Vec<Text>),
    Unspawn,
    Revive(usize),
}

/// Applies edits in their order; on error nothing is changed.
///
/// # Errors
/// Diagnostics that name the entity or material: a value out of range, an unknown reference, a cycle of parents.
pub fn animate(stage: &mut Stage, edits: Vec<Edit>) -> Result<Undo, Diagnostics> {
    let mut done = Undo(Vec::with_capacity(edits.len()));
    let applied = edits
        .into_iter()
        .try_for_each(|edit| apply(stage, edit).map(|inverse| done.0.push(inverse)))
        .map_err(Diagnostics::from)
        .and_then(|()| hierarchy::update(stage));
    match applied {
        Ok(()) => Ok(done),
        Err(problems) => {
            undo(stage, done);
            Err(problems)
        }
    }
}

/// Takes back the edits of one [`animate`], the last one first.
pub fn undo(stage: &mut Stage, undo: Undo) {
    for inverse in undo.0.into_iter().rev() {
        revert(stage, inverse);
    }
}

fn apply(stage: &mut Stage, edit: Edit) -> Result<Inverse, Diagnostic> {
    Ok(match edit {
        Edit::Camera(camera) => {
            camera.check().map_err(|e| spawn::invalid("the scene", "camera", e, ScenePart::Camera))?;
            Inverse::Camera(set_camera(stage, camera))
        }
        Edit::Cameras(cameras) => {
            for (name, camera) in &cameras {
                let owner = format!("camera `{name}`");
                camera.check().map_err(|e| spawn::invalid("the scene", &owner, e, ScenePart::Camera))?;
            }
            Inverse::Cameras(set_cameras(stage, cameras))
        }
        Edit::Render(render) => {
            render.check().map_err(|e| spawn::invalid("the scene", "render", e, ScenePart::Render))?;
            Inverse::Render(set_render(stage, render))
        }
        Edit::Material { index, material } => {
            let part = ScenePart::Material(index);
            material.check().map_err(|e| spawn::invalid(&format!("material {}", index + 1), "material", e, part))?;
            if index >= stage.materials.len() {
                return Err(Diagnostic::error(format!("there is no material number {}", index + 1)));
            }
            Inverse::Material(index, set_material(stage, index, material))
        }
        Edit::AddMaterial { name, material } => {
            let part = ScenePart::Material(stage.materials.len());
            material.check().map_err(|e| spawn::invalid(&format!("material `{name}`"), "material", e, part))?;
            spawn::add_material(stage, name, material)?;
            Inverse::RemoveMaterial
        }
        Edit::Put { entity, component } => {
            let kind = component.kind();
            let part = ScenePart::Entity(entity);
            component.record().check().map_err(|e| spawn::invalid(&stage.label(entity), kind.name(), e, part))?;
            let id = stage.live(entity).ok_or_else(|| gone(entity))?;
            touch(stage, entity, Some(&component), kind);
            match put(&mut stage.world, id, component) {
                Some(old) => Inverse::Put(entity, old),
                None => Inverse::Take(entity, kind),
            }
        }
        Edit::Take { entity, kind } => {
            let id = stage.live(entity).ok_or_else(|| gone(entity))?;
            touch(stage, entity, None, kind);
            match take(&mut stage.world, id, kind) {
                Some(old) => Inverse::Put(entity, old),
                None => Inverse::Take(entity, kind),
            }
        }
        Edit::Tags { entity, tags } => {
            stage.live(entity).ok_or_else(|| gone(entity))?;
            Inverse::Tags(entity, set_tags(stage, entity, tags))
        }
        Edit::Spawn(desc) => {
            for component in desc.components() {
                let owner = || desc.label(stage.entities.len());
                let part = ScenePart::Entity(stage.entities.len());
                let kind = component.kind().name();
                component.record().check().map_err(|e| spawn::invalid(&owner(), kind, e, part))?;
            }
            spawn::spawn_entity(stage, &mut EntityBuilder::new(), desc)?;
            stage.revisions.hierarchy += 1;
            Inverse::Unspawn
        }
        Edit::Despawn { entity } => {
            let id = stage.live(entity).ok_or_else(|| gone(entity))?;
            // A live entity takes any component.
            let _ = stage.world.insert_one(id, Despawned);
            stage.revisions.hierarchy += 1;
            Inverse::Revive(entity)
        }
    })
}

fn gone(index: usize) -> Diagnostic {
    Diagnostic::error(format!("entity {} does not exist or was removed", index + 1))
}

fn revert(stage: &mut Stage, inverse: Inverse) {
    match inverse {
        Inverse::Camera(camera) => drop(set_camera(stage, camera)),
        Inverse::Cameras(cameras) => drop(set_cameras(stage, cameras)),
        Inverse::Render(render) => drop(set_render(stage, render)),
        Inverse::Material(index, material) => drop(set_material(stage, index, material)),
        Inverse::RemoveMaterial => {
            if let Some(entity) = stage.materials.pop() {
                if let Ok(name) = stage.world.remove_one::<Name>(entity) {
                    stage.material_names.remove(&name.0);
                }
                let _ = stage.world.despawn(entity);
            }
        }
        Inverse::Put(index, component) => {
            touch(stage, index, Some(&component), component.kind());
            put(&mut stage.world, stage.entities[index], component);
        }
        Inverse::Take(index, kind) => {
            touch(stage, index, None, kind);
            take(&mut stage.world, stage.entities[index], kind);
        }
        Inverse::Tags(index, tags) => drop(set_tags(stage, index, tags)),
        Inverse::Unspawn => {
            if let Some(entity) = stage.entities.pop() {
                if let Ok(name) = stage.world.remove_one::<Name>(entity) {
                    stage.names.remove(&name.0);
                }
                let _ = stage.world.despawn(entity);
            }
            stage.revisions.hierarchy += 1;
        }
        Inverse::Revive(index) => {
            let _ = stage.world.remove_one::<Despawned>(stage.entities[index]);
            stage.revisions.hierarchy += 1;
        }
    }
}

fn set_camera(stage: &mut Stage, camera: Camera) -> Camera {
    let old = stage.camera();
    let _ = stage.world.insert_one(stage.camera, camera);
    old
}

fn set_cameras(stage: &mut Stage, cameras: Vec<(Text, Camera)>) -> Vec<(Text, Camera)> {
    let old = stage.named_cameras();
    let _ = stage.world.insert_one(stage.camera, NamedCameras(cameras));
    old
}

fn set_render(stage: &mut Stage, render: Render) -> Render {
    let old = stage.settings();
    let _ = stage.world.insert_one(stage.settings, render);
    old
}

fn set_material(stage: &mut Stage, index: usize, material: Material) -> Material {
    let entity = stage.materials[index];
    let old = stage.world.get::<&Material>(entity).map(|m| (*m).clone()).unwrap_or_default();
    let is_traced_alike = extract::shows_both_sides(&old) == extract::shows_both_sides(&material)
        && (old.is_transparent(), old.priority) == (material.is_transparent(), material.priority);
    stage.revisions.shapes += u64::from(!is_traced_alike);
    let _ = stage.world.insert_one(entity, material);
    old
}

fn set_tags(stage: &mut Stage, index: usize, tags: Vec<Text>) -> Vec<Text> {
    let entity = stage.entities[index];
    let old = stage.world.get::<&Tags>(entity).map(|t| t.0.clone()).unwrap_or_default();
    if tags.is_empty() {
        let _ = stage.world.remove_one::<Tags>(entity);
    } else {
        let _ = stage.world.insert_one(entity, Tags(tags));
    }
    old
}

/// Marks that a component of this kind changes, by what is derived from it; `now` is what it becomes, if it stays.
fn touch(stage: &mut Stage, index: usize, now: Option<&Component>, kind: Kind) {
    match kind.role() {
        Role::Placement => {
            let before = stage.world.get::<&Transform>(stage.entities[index]).ok().and_then(|t| t.parent.clone());
            let parent = now.and_then(Transform::of).and_then(|transform| transform.parent.as_ref());
            if kind == Transform::KIND && before.as_ref() == parent {
                stage.revisions.transforms += 1;
                stage.derived.moved.push(index);
            } else {
                stage.revisions.hierarchy += 1;
            }
        }
        Role::Shape | Role::Deformation => stage.revisions.shapes += 1,
        // Textures, lights and who sees what are taken from the World for every frame.
        Role::Surface if kind != MaterialName::KIND => {}
        Role::Light | Role::Visibility | Role::Linking | Role::View | Role::Source => {}
        Role::Surface => {
            stage.revisions.shapes += 1;
            stage.derived.unresolved.push(index);
        }
    }
}
