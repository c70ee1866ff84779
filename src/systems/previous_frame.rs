//! The World as it was in the frame before, for the motion of what the camera sees.

use glam::DAffine3;

use super::deform::Deformed;
use super::hierarchy::Placement;
use super::lens;
use super::origin::{moved, render_origin};
use super::stage::{AuthoredIndex, Despawned, Name, Stage};
use crate::components::{Camera, Text};
use crate::trace::camera::CameraRays;
use crate::trace::reuse::MotionVectors;

/// Camera and placements of one moment. Shapes and materials of their own time do not count.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviousFrame {
    camera: Camera,
    /// By authored index; `None` was not there.
    poses: Vec<Option<EntityPose>>,
}

/// Where an entity stood, and its name: what frames spawn under other names is not the same entity.
#[derive(Clone, Debug, PartialEq)]
struct EntityPose {
    name: Option<Text>,
    placement: DAffine3,
}

impl PreviousFrame {
    /// The World as it stands, its placements up to date.
    pub fn of(stage: &Stage) -> PreviousFrame {
        // A camera that stands nowhere is answered where its own frame is rendered.
        let camera = lens::placed_camera(stage).unwrap_or_else(|_| stage.camera());
        PreviousFrame { camera, poses: poses(stage) }
    }

    /// How entities have moved from then to the World as it stands now, for a picture of a size.
    pub fn motion_to(&self, stage: &Stage, size: [u32; 2]) -> MotionVectors {
        // Focus does not move the image of a point seen through the centre of the lens.
        let origin = render_origin(stage);
        let camera = CameraRays::new(&lens::seen_from(origin, self.camera.clone()), size, 1.0);
        let now = poses(stage);
        let moved = now.iter().zip(&self.poses).enumerate().filter_map(|(index, (now, then))| {
            let (now, then) = now.as_ref().zip(then.as_ref())?;
            if now.placement == then.placement || now.name != then.name {
                return None;
            }
            // Both as seen from the origin that this frame is traced from.
            let map = moved(then.placement, -origin) * moved(now.placement, -origin).inverse();
            map.is_finite().then_some((index as u32, map))
        });
        MotionVectors::new(camera, moved)
    }
}

fn poses(stage: &Stage) -> Vec<Option<EntityPose>> {
    let mut poses = vec![None; stage.entities.len()];
    for (order, name, placement, bent) in stage.world.query::<Parts>().without::<&Despawned>().iter() {
        // What joints carry does not go with its own entity.
        let placement = placement.filter(|_| bent.is_none_or(|bent| !bent.in_world));
        let placement = placement.map_or(DAffine3::IDENTITY, |placement| placement.0);
        poses[order.0 as usize] = Some(EntityPose { name: name.map(|name| name.0.clone()), placement });
    }
    poses
}

type Parts<'q> = (&'q AuthoredIndex, Option<&'q Name>, Option<&'q Placement>, Option<&'q Deformed>);
