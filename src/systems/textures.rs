//! World -> texture bindings of entities: the maps of their materials, their own textures, and their local spaces.

use std::sync::Arc;

use glam::{DAffine3, Vec3};
use rustc_hash::FxHashMap;

use super::hierarchy::Placement;
use super::stage::{AuthoredIndex, Despawned, Stage};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::components::*;
use crate::load::image;
use crate::trace::material::texture::{TextureBindings, TextureLayer, TextureSet};
use crate::trace::primitive::{AffineMap, Bounds, ObjectSpace};

/// Calls for every texture of the World, with whether it is of colours, what it belongs to, and what a message calls that.
fn for_each_texture(
    stage: &Stage,
    mut call: impl FnMut(&Texture, bool, Subject, &dyn Fn() -> String) -> Result<(), Diagnostic>,
) -> Result<(), Diagnostic> {
    for (i, entity) in stage.materials.iter().enumerate() {
        let Ok(material) = stage.world.get::<&Material>(*entity) else { continue };
        for (field, texture, coloured) in material.maps() {
            let name = || stage.material_names.iter().find(|(_, index)| **index == i).map_or("", |(name, _)| name);
            let subject = Subject { part: ScenePart::Material(i), component: None, field: Some(field) };
            call(texture, coloured, subject, &|| format!("`{field}` of material `{}`", name()))?;
        }
    }
    let mut query = stage.world.query::<(&AuthoredIndex, &Texture)>().without::<&Despawned>();
    let mut found: Vec<_> = query.iter().collect();
    found.sort_by_key(|(order, _)| **order);
    for (order, texture) in found {
        let part = ScenePart::Entity(order.0 as usize);
        let subject = Subject { part, component: Some(Kind::Texture.name()), field: Some("image") };
        call(texture, true, subject, &|| format!("texture of {}", stage.label(order.0 as usize)))?;
    }
    Ok(())
}

/// Reads the pictures that textures name, those that are not yet there.
///
/// # Errors
/// A picture that cannot be read, and who names it.
pub fn load_images(stage: &mut Stage) -> Result<(), Diagnostics> {
    let mut images = std::mem::take(&mut stage.derived.images);
    let curved = stage.settings().transfer == Transfer::Srgb;
    let read = for_each_texture(stage, |texture, coloured, subject, owner| {
        let Some(file) = &texture.image else { return Ok(()) };
        let fetched = image::fetch(&mut images, &stage.base, file, texture.decodes(coloured && curved));
        fetched
            .map(|_| ())
            .map_err(|e| Diagnostic { message: format!("{}: {}", owner(), e.message), ..e }.about(subject))
    });
    stage.derived.images = images;
    read.map_err(Diagnostics::from)
}

/// The textures of every entity: the maps of its material, and its own texture over them.
///
/// # Errors
/// As [`load_images`].
pub fn texture_bindings(stage: &mut Stage) -> Result<TextureBindings, Diagnostics> {
    load_images(stage)?;
    let stage = &*stage;
    let curved = stage.settings().transfer == Transfer::Srgb;
    let layer = |texture: &Texture, coloured: bool| {
        let picture =
            |file: &Text| stage.derived.images.0.get(&(file.clone(), texture.decodes(coloured && curved))).cloned();
        TextureLayer::new(texture, texture.image.as_ref().and_then(picture))
    };
    let of_material = |entity: &hecs::Entity| {
        let material = stage.world.get::<&Material>(*entity).ok();
        material.map_or_else(TextureSet::default, |material| {
            let one = |map: &Option<Box<Texture>>, coloured| map.as_deref().map(|texture| layer(texture, coloured));
            TextureSet {
                color: one(&material.color_map, true).into_iter().collect(),
                specular: one(&material.specular_map, true),
                roughness: one(&material.roughness_map, false),
                bump: one(&material.bump, false),
                normal: one(&material.normal_map, false),
            }
        })
    };
    let sets: Vec<TextureSet> = stage.materials.iter().map(of_material).collect();
    let mut bindings = TextureBindings::default();
    let of_material: Vec<Option<u32>> =
        sets.iter().map(|set| (!set.is_empty()).then(|| bindings.add(set.clone()))).collect();
    type Parts<'q> =
        (&'q AuthoredIndex, Option<&'q Texture>, Option<&'q MaterialName>, Option<&'q Placement>, Option<&'q Mesh>);
    let textured = of_material.iter().any(Option::is_some);
    if !textured && stage.world.query::<&Texture>().iter().next().is_none() {
        return Ok(bindings);
    }
    let mut query = stage.world.query::<Parts>().without::<&Despawned>();
    let mut found: Vec<_> = query.iter().filter(|(_, texture, ..)| textured || texture.is_some()).collect();
    found.sort_by_key(|(order, ..)| **order);
    // Entities that are textured alike share a set of textures.
    let mut own: FxHashMap<(Option<usize>, String), u32> = FxHashMap::default();
    for (order, texture, material_name, placement, mesh) in found {
        let material = material_name.and_then(|name| stage.material_names.get(&name.0).copied());
        let set = match texture {
            None => material.and_then(|i| of_material[i]),
            Some(texture) => Some(*own.entry((material, format!("{texture:?}"))).or_insert_with(|| {
                let mut set = material.map_or_else(TextureSet::default, |i| sets[i].clone());
                set.color.push(layer(texture, true));
                bindings.add(set)
            })),
        };
        if let Some(set) = set {
            bindings.put(order.0, frame(placement, mesh), set);
        }
    }
    Ok(bindings)
}

/// The local space of an entity, as `extract` has it.
fn frame(placement: Option<&Placement>, mesh: Option<&Mesh>) -> ObjectSpace {
    let map = placement.map_or(DAffine3::IDENTITY, |p| p.0);
    let bare = mesh.filter(|mesh| mesh.data.uvs.is_empty());
    let center = bare.map(|mesh: &Mesh| -> Vec3 { Bounds::around(&Arc::clone(&mesh.data).vertices).center() });
    ObjectSpace { map: AffineMap::new(&map), center }
}
