//! World -> texture bindings of entities: the maps of their materials, their own textures, and their local spaces.

use glam::{DVec3, Vec3};
use rustc_hash::{FxHashMap, FxHashSet};

use super::deform::Deformed;
use super::hierarchy::Placement;
use super::origin::{relative, render_origin};
use super::shapes::from_origin_of;
use super::stage::{EnvironmentKey, MaterialIndex, Stage};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::components::*;
use crate::trace::material::texture::{TextureBindings, TextureLayer, TextureSet};
use crate::trace::primitive::{AffineMap, Bounds, ObjectSpace};

/// A file that the World names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileRequest {
    /// Its name, relative to the scene.
    pub file: Text,
    /// What is read of it.
    pub plane: ImagePlane,
    /// What a message calls its user.
    pub owner: String,
    /// Where the scene names it.
    pub subject: Subject,
}

/// Whether the numbers of colour images are decoded to linear light.
fn decodes_colors(stage: &Stage) -> bool {
    stage.settings().transfer == Transfer::Srgb
}

/// The images of textures that are not loaded, as the World stands.
pub fn missing_images(stage: &Stage) -> Vec<FileRequest> {
    let mut missing: Vec<FileRequest> = Vec::new();
    let decodes = decodes_colors(stage);
    let mut add = |texture: &Texture, coloured: bool, subject: Subject, owner: &dyn Fn() -> String| {
        let Some(file) = texture.file() else { return };
        let plane = texture.plane(coloured && decodes);
        let is_known = missing.iter().any(|one| one.file == file && one.plane == plane);
        if !is_known && !stage.files.images.0.contains_key(&(file.clone(), plane)) {
            missing.push(FileRequest { file, plane, owner: owner(), subject });
        }
    };
    for (i, entity) in stage.materials.iter().enumerate() {
        let Ok(material) = stage.world.get::<&Material>(*entity) else { continue };
        for (field, texture, coloured) in material.maps() {
            let name = || stage.material_names.iter().find(|(_, index)| **index == i).map_or("", |(name, _)| name);
            let subject = Subject { part: ScenePart::Material(i), component: None, field: Some(field) };
            add(texture, coloured, subject, &|| format!("`{field}` of material `{}`", name()));
        }
    }
    let _ = stage.for_each_in_order::<&Texture>(|index, texture| {
        let component = Some(Kind::Texture.name());
        let subject = Subject { part: ScenePart::Entity(index), component, field: Some("image") };
        add(texture, true, subject, &|| format!("texture of {}", stage.label(index)));
        Ok(())
    });
    missing
}

/// The images that the World names as it stands, textures and environment, each with what is read of it.
pub fn named_images(stage: &Stage) -> FxHashSet<(Text, ImagePlane)> {
    let decodes = decodes_colors(stage);
    let environment = environment_key(stage).map(|(file, decoded)| (file, ImagePlane::of_colors(decoded)));
    let mut named: FxHashSet<(Text, ImagePlane)> = environment.into_iter().collect();
    let mut add = |texture: &Texture, coloured: bool| {
        named.extend(texture.file().map(|file| (file, texture.plane(coloured && decodes))));
    };
    for entity in &stage.materials {
        let Ok(material) = stage.world.get::<&Material>(*entity) else { continue };
        material.maps().for_each(|(_, texture, coloured)| add(texture, coloured));
    }
    stage.world.query::<&Texture>().iter().for_each(|texture| add(texture, true));
    named
}

/// The environment that the settings name, if it is not loaded.
pub fn missing_environment(stage: &Stage) -> Option<FileRequest> {
    let (file, decoded) = environment_key(stage)?;
    let is_loaded = stage.files.environment.as_ref().is_some_and(|(key, _)| *key == (file.clone(), decoded));
    let subject = Subject { part: ScenePart::Render, component: None, field: Some("environment") };
    let plane = ImagePlane::of_colors(decoded);
    (!is_loaded).then(|| FileRequest { file, plane, owner: "`environment`".into(), subject })
}

/// The environment that the settings name, with how it is decoded.
pub(super) fn environment_key(stage: &Stage) -> Option<EnvironmentKey> {
    stage.settings().environment.map(|file| (file, decodes_colors(stage)))
}

/// The textures of every entity: the maps of its material, and its own texture over them.
///
/// # Errors
/// An image that is not loaded.
pub fn texture_bindings(stage: &Stage) -> Result<TextureBindings, Diagnostics> {
    if let Some(missing) = missing_images(stage).first() {
        return Err(Diagnostic::bug(format!("{}: `{}` was not loaded", missing.owner, missing.file)).into());
    }
    let decodes = decodes_colors(stage);
    let layer = |texture: &Texture, coloured: bool| {
        let image = |file: Text| stage.files.images.0.get(&(file, texture.plane(coloured && decodes))).cloned();
        TextureLayer::new(texture, texture.file().and_then(image))
    };
    let of_material = |entity: &hecs::Entity| {
        let material = stage.world.get::<&Material>(*entity).ok();
        material.map_or_else(TextureSet::default, |material| {
            let one = |map: &Option<Box<Texture>>, coloured| map.as_deref().map(|texture| layer(texture, coloured));
            TextureSet {
                color: one(&material.color_map, true).into_iter().collect(),
                specular: one(&material.specular_map, true),
                emission: one(&material.emission_map, true),
                reflection: one(&material.reflection_map, false),
                roughness: one(&material.roughness_map, false),
                metallic: one(&material.metallic_map, false),
                transmission: one(&material.transmission_map, false),
                opacity: one(&material.opacity_map, false),
                bump: one(&material.bump, false),
                normal: one(&material.normal_map, false),
            }
        })
    };
    let sets: Vec<TextureSet> = stage.materials.iter().map(of_material).collect();
    let mut bindings = TextureBindings::default();
    let of_material: Vec<Option<u32>> =
        sets.iter().map(|set| (!set.is_empty()).then(|| bindings.add(set.clone()))).collect();
    let textured = of_material.iter().any(Option::is_some);
    let is_colored = |mesh: &Mesh| !mesh.data.colors.is_empty();
    let has_colors = stage.world.query::<&Mesh>().iter().any(is_colored);
    if !textured && !has_colors && stage.world.query::<&Texture>().iter().next().is_none() {
        return Ok(bindings);
    }
    let default = stage.materials.len();
    // Entities that are textured alike share a set of textures.
    let mut own: FxHashMap<(Option<usize>, String), u32> = FxHashMap::default();
    let mut plain: Option<u32> = None;
    let origin = render_origin(stage);
    type Bendable<'q> = (&'q Mesh, Option<&'q Deformed>);
    type Parts<'q> = (Option<&'q Texture>, Option<&'q MaterialIndex>, Option<&'q Placement>, Option<Bendable<'q>>);
    stage.for_each_in_order::<Parts>(|index, (texture, material, placement, mesh)| {
        let bent = mesh.and_then(|(_, bent)| bent);
        let in_world = bent.is_some_and(|bent| bent.in_world);
        let placement = placement.filter(|_| !in_world);
        let mesh = mesh.map(|(mesh, _)| bent.map_or(mesh, |bent| &bent.mesh));
        let colored = mesh.is_some_and(is_colored);
        if !textured && !colored && texture.is_none() {
            return Ok(());
        }
        let of_entity = material.map(|material| material.0 as usize);
        let pieces = mesh.map(Mesh::pieces);
        let of_piece = |piece: &Piece| {
            let own = piece.material.as_ref().and_then(|name| stage.material_names.get(name).copied());
            own.or(of_entity)
        };
        let whole = pieces.is_none().then_some(of_entity);
        let mut space = None;
        for material in pieces.iter().flat_map(|pieces| pieces.iter().map(of_piece)).chain(whole) {
            let set = match texture {
                None => material.and_then(|i| of_material[i]),
                Some(texture) => Some(*own.entry((material, format!("{texture:?}"))).or_insert_with(|| {
                    let mut set = material.map_or_else(TextureSet::default, |i| sets[i].clone());
                    set.color.push(layer(texture, true));
                    bindings.add(set)
                })),
            };
            let set = match set {
                Some(set) => set,
                None if colored => *plain.get_or_insert_with(|| bindings.add(TextureSet::default())),
                None => continue,
            };
            let space =
                space.get_or_insert_with(|| frame(placement, mesh, if in_world { DVec3::ZERO } else { origin }));
            bindings.put(index as u32, material.unwrap_or(default) as u32, space, colored, set);
        }
        Ok(())
    })?;
    Ok(bindings)
}

/// The local space of an entity, as `extract` has it.
fn frame(placement: Option<&Placement>, mesh: Option<&Mesh>, origin: DVec3) -> ObjectSpace {
    // What is squashed flat has no local space to go back to.
    let whole = placement.filter(|p| p.0.matrix3.determinant() != 0.0);
    let map = relative(whole, origin);
    let map = mesh.map_or(map, |mesh| from_origin_of(mesh, map));
    let bare = mesh.filter(|mesh| mesh.data.lacks_uvs());
    let center = bare.map(|mesh: &Mesh| -> Vec3 {
        let pieces = mesh.pieces();
        pieces.iter().map(|piece| Bounds::around(&piece.data.vertices)).fold(Bounds::default(), Bounds::union).center()
    });
    ObjectSpace { map: AffineMap::new(&map), center }
}
