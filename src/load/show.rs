//! A scene around an asset alone: what `anim model.glb` shows and `anim convert model.glb` writes.
//!
//! Its camera is the file's, or one that sees all of it; where the file has no lights, a sun and a sky light it.

use std::path::Path;

use glam::{DAffine3, DVec3};
use rustc_hash::FxHashMap;

use super::aff::{self, AffShow};
use super::assemble::{self, Wrong};
use super::resolve::Problem;
use crate::base::diagnostics::Diagnostics;
use crate::base::project::Folder;
use crate::components::skin::deformed;
use crate::components::*;

/// Where the camera stands, from the middle of what it is to show.
const FROM: DVec3 = DVec3::new(0.5, 0.35, 1.0);

/// A scene that holds an asset, called as its file without the ending.
fn scene_of(path: &Path, base: &Folder) -> Scene {
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let asset = Asset { file: file.into(), ..Asset::default() };
    Scene { entities: vec![EntityDesc::new([asset.into()]).named(name)], base: base.clone(), ..Scene::default() }
}

/// Reads an asset as a scene, with what of it is not used.
///
/// # Errors
/// All that is wrong in it.
pub fn load(path: &Path, base: &Folder) -> Result<(Scene, Diagnostics), Diagnostics> {
    let mut scene = scene_of(path, base);
    let warnings = assembled(&mut scene)?;
    complete(&mut scene);
    Ok((scene, warnings))
}

/// As [`load`], for an AFF file, which says itself how it wants to be shown.
///
/// # Errors
/// As [`load`].
pub fn load_aff(path: &Path, base: &Folder) -> Result<(Scene, Diagnostics, AffShow), Diagnostics> {
    let mut scene = scene_of(path, base);
    let show = aff::read(base, &path.file_name().unwrap_or_default().to_string_lossy(), "")?.1;
    scene.render = Render {
        integrator: Integrator::Whitted,
        samples: 1,
        transfer: Transfer::Linear,
        background: show.background,
        size: show.size.unwrap_or(scene.render.size),
        ..scene.render
    };
    let warnings = assembled(&mut scene)?;
    if show.has_view {
        let name = scene.entities[0].name.as_deref().unwrap_or_default();
        scene.camera.entity = Some(format!("{name}/{}", aff::VIEW).into());
    } else {
        frame(&mut scene);
    }
    Ok((scene, warnings, show))
}

fn assembled(scene: &mut Scene) -> Result<Diagnostics, Diagnostics> {
    match assemble::assemble(scene) {
        Ok(warnings) => Ok(Diagnostics(warnings)),
        Err(Wrong { problems, found }) => {
            let problems = problems.into_iter().map(Problem::diagnostic);
            Err(Diagnostics(problems.chain(found.0).collect()))
        }
    }
}

/// Gives a scene whose assets are in it a camera and light, as far as the assets have none.
fn complete(scene: &mut Scene) {
    let has = |kind: Kind| scene.entities.iter().find(|desc| desc.get(kind).is_some());
    let lights = [Kind::PointLight, Kind::AreaLight, Kind::SpotLight, Kind::DirectionalLight];
    let is_lit = lights.into_iter().any(|kind| has(kind).is_some());
    let viewpoint = has(Kind::Viewpoint).and_then(|desc| desc.name.clone());
    match viewpoint {
        Some(name) => scene.camera.entity = Some(name),
        None => frame(scene),
    }
    scene.render.integrator = Integrator::Path;
    scene.render.samples = 64;
    if !is_lit {
        scene.render.sky = Some([DVec3::new(0.75, 0.85, 1.0), DVec3::splat(0.9), DVec3::splat(0.25)]);
        let direction = DVec3::new(-0.6, -1.0, -0.5);
        let sun = DirectionalLight {
            direction,
            color: DVec3::new(1.0, 0.95, 0.88),
            angle: 4.0,
            ..DirectionalLight::default()
        };
        scene.entities.push(EntityDesc::new([sun.into()]).named("sun"));
    }
}

/// Puts the camera where it sees all meshes.
fn frame(scene: &mut Scene) {
    let Some([min, max]) = bounds(scene) else { return };
    let (center, radius) = ((min + max) / 2.0, ((max - min).length() / 2.0).max(1e-6));
    let (sin, _) = crate::base::math::sin_cos_degrees(scene.camera.fov / 2.0);
    scene.camera.from = center + FROM.normalize() * (radius / sin * 1.02);
    scene.camera.at = center;
}

/// The box around all meshes and spheres at rest, world space.
fn bounds(scene: &Scene) -> Option<[DVec3; 2]> {
    let names: FxHashMap<&str, usize> =
        scene.entities.iter().enumerate().filter_map(|(i, desc)| Some((desc.name.as_deref()?, i))).collect();
    let mut known: Vec<Option<DAffine3>> = vec![None; scene.entities.len()];
    for i in 0..scene.entities.len() {
        place(scene, &names, i, &mut known, 0);
    }
    let mut found: Option<[DVec3; 2]> = None;
    let mut add = |p: DVec3| {
        let [min, max] = found.get_or_insert([p; 2]);
        (*min, *max) = (min.min(p), max.max(p));
    };
    for (desc, map) in scene.entities.iter().zip(&known) {
        let map = map.unwrap_or(DAffine3::IDENTITY);
        if let Some(Component::Mesh(mesh)) = desc.get(Kind::Mesh) {
            let morph = match desc.get(Kind::Morph) {
                Some(Component::Morph(morph)) => Some(morph),
                _ => None,
            };
            let joint = |name: &Text| names.get(&**name).and_then(|i| known[*i]).unwrap_or(DAffine3::IDENTITY);
            match desc.get(Kind::Skin) {
                Some(Component::Skin(skin)) => {
                    let joints: Vec<DAffine3> = skin.joints.iter().map(joint).collect();
                    let bent = deformed(&mesh.data, morph, Some((skin, &joints)));
                    bent.points().for_each(&mut add);
                }
                _ => {
                    let bent = deformed(&mesh.data, morph, None);
                    bent.points().for_each(|point| add(map.transform_point3(point)));
                }
            }
        }
        if let Some(Component::Sphere(sphere)) = desc.get(Kind::Sphere) {
            let corners = [DVec3::ONE, DVec3::NEG_ONE].map(|side| sphere.center + side * sphere.radius.abs());
            corners.into_iter().for_each(|corner| add(map.transform_point3(corner)));
        }
    }
    found
}

/// Where an entity stands, its parents first; references were checked.
fn place(
    scene: &Scene,
    names: &FxHashMap<&str, usize>,
    index: usize,
    known: &mut [Option<DAffine3>],
    depth: usize,
) -> DAffine3 {
    if let Some(known) = known[index] {
        return known;
    }
    let mut map = DAffine3::IDENTITY;
    if let Some(Component::Transform(transform)) = scene.entities[index].get(Kind::Transform) {
        let parent = transform.parent.as_deref().and_then(|name| names.get(name));
        if let Some(parent) = parent.filter(|_| depth < crate::base::limits::HIERARCHY_DEPTH) {
            map = place(scene, names, *parent, known, depth + 1);
        }
        map *= transform.matrix();
    }
    known[index] = Some(map);
    map
}
