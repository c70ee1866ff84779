//! World -> texture bindings of entities: the maps of their materials, their own textures, and their local spaces.

use glam::{DAffine3, Vec3};
use rustc_hash::{FxHashMap, FxHashSet};

use super::hierarchy::Placement;
use super::stage::{AuthoredIndex, Despawned, Stage};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::components::*;
use crate::load::image;
use crate::trace::material::texture::{TextureBindings, TextureLayer, TextureSet};
use crate::trace::primitive::{AffineMap, Bounds, ObjectSpace};

/// Calls for every texture of the World, with whether it is of colours and with what a message calls its owner.
fn for_each_texture(
    stage: &Stage,
    mut call: impl FnMut(&Texture, bool, &dyn Fn() -> String) -> Result<(), Diagnostic>,
) -> Result<(), Diagnostic> {
    for (i, entity) in stage.materials.iter().enumerate() {
        let Ok(material) = stage.world.get::<&Material>(*entity) else { continue };
        for (field, texture, coloured) in material.maps() {
            let name = || stage.material_names.iter().find(|(_, index)| **index == i).map_or("", |(name, _)| name);
            call(texture, coloured, &|| format!("`{field}` of material `{}`", name()))?;
        }
    }
    let mut query = stage.world.query::<(&AuthoredIndex, &Texture)>().without::<&Despawned>();
    let mut found: Vec<_> = query.iter().collect();
    found.sort_by_key(|(order, _)| **order);
    for (order, texture) in found {
        call(texture, true, &|| format!("texture of {}", stage.label(order.0 as usize)))?;
    }
    Ok(())
}

/// Reads the pictures that textures name, those that are not yet there.
///
/// # Errors
/// A picture that cannot be read, and who names it.
pub fn load_images(stage: &mut Stage) -> Result<(), Diagnostics> {
    let mut images = std::mem::take(&mut stage.derived.images);
    let settings = stage.settings();
    let curved = settings.transfer == Transfer::Srgb;
    if images.texels() > limits::TEXTURE_TEXELS / 2 {
        // A sequence of images would fill all of the room: those that this frame does not name make place.
        let mut named: FxHashSet<(Text, bool)> = FxHashSet::default();
        named.extend(settings.environment.iter().map(|file| (file.clone(), curved)));
        let listed = for_each_texture(stage, |texture, coloured, _| {
            named.extend(texture.image.iter().map(|file| (file.clone(), texture.decodes(coloured && curved))));
            Ok(())
        });
        listed?;
        images.0.retain(|key, _| named.contains(key));
    }
    let read = for_each_texture(stage, |texture, coloured, owner| {
        let Some(file) = &texture.image else { return Ok(()) };
        let fetched = image::fetch(&mut images, &stage.base, file, texture.decodes(coloured && curved));
        fetched.map(|_| ()).map_err(|e| Diagnostic { message: format!("{}: {}", owner(), e.message), ..e })
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
    let mut query = stage.world.query::<Parts>().without::<&Despawned>();
    let colored = |mesh: &Option<&Mesh>| mesh.is_some_and(|mesh| !mesh.data.colors.is_empty());
    let matters =
        |(_, texture, _, _, mesh): &<Parts as hecs::Query>::Item<'_>| textured || texture.is_some() || colored(mesh);
    let mut found: Vec<_> = query.iter().filter(matters).collect();
    found.sort_by_key(|(order, ..)| **order);
    let default = stage.materials.len();
    // Entities that are textured alike share a set of textures.
    let mut own: FxHashMap<(Option<usize>, String), u32> = FxHashMap::default();
    let mut bare: Option<u32> = None;
    for (order, texture, material_name, placement, mesh) in found {
        let of_entity = material_name.and_then(|name| stage.material_names.get(&name.0).copied());
        let mut set_of = |bindings: &mut TextureBindings, material: Option<usize>| match texture {
            None => material.and_then(|i| of_material[i]),
            Some(texture) => Some(*own.entry((material, format!("{texture:?}"))).or_insert_with(|| {
                let mut set = material.map_or_else(TextureSet::default, |i| sets[i].clone());
                set.color.push(layer(texture, true));
                bindings.add(set)
            })),
        };
        let pieces = mesh.map(Mesh::pieces);
        let of_piece = |piece: &Piece| {
            let own = piece.material.as_ref().and_then(|name| stage.material_names.get(name).copied());
            own.or(of_entity)
        };
        let whole = pieces.is_none().then_some(of_entity);
        let materials = pieces.iter().flat_map(|pieces| pieces.iter().map(of_piece)).chain(whole);
        let colored = colored(&mesh);
        let mut frame_of_entity = None;
        for material in materials {
            let set = match set_of(&mut bindings, material) {
                Some(set) => set,
                None if colored => *bare.get_or_insert_with(|| bindings.add(TextureSet::default())),
                None => continue,
            };
            let frame = frame_of_entity.get_or_insert_with(|| frame(placement, mesh));
            bindings.put(order.0, material.unwrap_or(default) as u32, frame, colored, set);
        }
    }
    Ok(bindings)
}

/// The local space of an entity, as `extract` has it.
fn frame(placement: Option<&Placement>, mesh: Option<&Mesh>) -> ObjectSpace {
    let map = placement.map_or(DAffine3::IDENTITY, |p| p.0);
    let bare = mesh.filter(|mesh| mesh.data.lacks_uvs());
    let center = bare.map(|mesh: &Mesh| -> Vec3 {
        let pieces = mesh.pieces();
        pieces.iter().map(|piece| Bounds::around(&piece.data.vertices)).fold(Bounds::default(), Bounds::union).center()
    });
    ObjectSpace { map: AffineMap::new(&map), center }
}
