//! The World's camera -> camera rays: where the lens is focused, and the seed that goes with the pose.

use glam::{DAffine3, DVec2, DVec3};

use super::extract::find;
use super::hierarchy::Placement;
use super::origin::origin_for;
use super::stage::Stage;
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::base::random::hash_words;
use crate::components::{Camera, Check, Focus, Projection, Viewpoint};
use crate::trace::camera::CameraRays;

/// Camera rays for the World as it stands.
///
/// # Errors
/// A focus on an entity that does not exist or does not lie before the camera.
pub fn camera_rays(stage: &Stage, size: [u32; 2]) -> Result<CameraRays, Diagnostics> {
    let camera = placed_camera(stage)?;
    let distance = focus_distance(stage, &camera)?;
    let origin = origin_for(camera.from);
    Ok(CameraRays::new(&seen_from(origin, camera), size, distance))
}

/// The camera where it stands in a space with another origin.
pub(super) fn seen_from(origin: DVec3, camera: Camera) -> Camera {
    Camera { from: camera.from - origin, at: camera.at - origin, ..camera }
}

/// The camera where it stands: where the entity is that carries it, if one does.
///
/// # Errors
/// An entity that does not exist, or whose transform leaves the camera no direction.
pub fn placed_camera(stage: &Stage) -> Result<Camera, Diagnostic> {
    let camera = stage.camera();
    let Some(name) = camera.entity.clone() else { return Ok(camera) };
    let index = find(stage, &name).ok_or_else(|| {
        let unknown = format!("the camera is carried by `{name}`, which does not exist");
        Diagnostic::error(unknown).suggest(&name, stage.names.keys().map(|text| &**text))
    })?;
    let entity = stage.entities[index];
    let map = stage.world.get::<&Placement>(entity).map_or(DAffine3::IDENTITY, |placement| placement.0);
    let viewpoint = stage.world.get::<&Viewpoint>(entity).ok();
    let placed = camera.carried(&map, viewpoint.as_deref());
    placed.check().map_err(|invalid| match invalid.field {
        "at" | "up" | "from" => {
            Diagnostic::error(format!("the camera is carried by `{name}`, which is scaled to nothing"))
        }
        _ => Diagnostic::error(format!("the camera is carried by `{name}`: {}", invalid.message)),
    })?;
    Ok(placed)
}

fn focus_distance(stage: &Stage, camera: &Camera) -> Result<f64, Diagnostic> {
    if let Some(distance) = camera.focus_distance {
        return Ok(distance);
    }
    let mut entity = None;
    let (point, what) = match &camera.focus {
        None => return Ok(camera.from.distance(camera.at)),
        Some(Focus::Point(point)) => (*point, "the point".to_string()),
        Some(Focus::Entity(name)) => {
            let index = find(stage, name).ok_or_else(|| {
                let unknown = format!("the camera is focused on `{name}`, which does not exist");
                Diagnostic::error(unknown).about(FOCUS).suggest(name, stage.names.keys().map(|text| &**text))
            })?;
            entity = Some(index);
            let placed = stage.world.get::<&Placement>(stage.entities[index]);
            (placed.map_or(DVec3::ZERO, |p| p.0.translation), format!("`{name}`"))
        }
    };
    let distance = (point - camera.from).dot(camera.axis());
    if distance > 0.0 || camera.lens_radius() == 0.0 {
        return Ok(distance);
    }
    let problem = Diagnostic::error(format!("the camera is focused on {what}, which is behind it"));
    let problem = problem.help("turn the camera, or set `focus_distance`").about(FOCUS);
    Err(entity.map_or(problem.clone(), |index| problem.about(ScenePart::Entity(index))))
}

/// Where the camera says what it is focused on.
const FOCUS: Subject = Subject { part: ScenePart::Camera, component: None, field: Some("focus") };

/// Seed of a frame: noise stands still while the camera does, and is fresh for every new pose.
pub fn pose_seed(camera: &Camera) -> u64 {
    let numbers = [camera.from, camera.at, camera.up].into_iter().flat_map(|v| v.to_array());
    let optics = [camera.fov, camera.focal_length.unwrap_or(0.0), camera.sensor_width];
    // What few cameras have counts where it is there.
    let lies_otherwise = camera.projection != Projection::Perspective || camera.shift != DVec2::ZERO;
    let layout = [camera.projection as u8 as f64, camera.height.unwrap_or(0.0), camera.shift.x, camera.shift.y];
    let optics = optics.into_iter().chain(layout.into_iter().filter(|_| lies_otherwise));
    // Adding zero makes -0 and 0 the same pose.
    hash_words(numbers.chain(optics).map(|x| (x + 0.0).to_bits()))
}
