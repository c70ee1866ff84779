//! A scene around an asset alone: what `anim model.glb` shows and `anim convert model.glb` writes.
//!
//! Its camera is the file's, or one that sees all of it; where the file has no lights, a sun and a sky light it.

use std::path::Path;

use glam::DVec3;

use super::aff::{self, AffShow};
use super::assemble::{self, Wrong};
use super::measures::SceneMeasures;
use super::resolve::Problem;
use crate::base::diagnostics::Diagnostics;
use crate::base::project::Folder;
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

/// Reads an asset as a scene of what it holds and nothing else, with what of it is not used.
///
/// # Errors
/// All that is wrong in it.
pub fn contents(path: &Path, base: &Folder) -> Result<(Scene, Diagnostics), Diagnostics> {
    let mut scene = scene_of(path, base);
    let warnings = assembled(&mut scene)?;
    Ok((scene, warnings))
}

/// Reads an asset as a scene, with what of it is not used.
///
/// # Errors
/// All that is wrong in it.
pub fn load(path: &Path, base: &Folder) -> Result<(Scene, Diagnostics), Diagnostics> {
    let (mut scene, warnings) = contents(path, base)?;
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
    let Some([min, max]) = SceneMeasures::of(scene).bounds else { return };
    let (center, radius) = ((min + max) / 2.0, ((max - min).length() / 2.0).max(1e-6));
    let (sin, _) = crate::base::math::sin_cos_degrees(scene.camera.fov / 2.0);
    scene.camera.from = center + FROM.normalize() * (radius / sin * 1.02);
    scene.camera.at = center;
}
