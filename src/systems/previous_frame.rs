//! The World as it was in the frame before, for the motion of what the camera sees.

use glam::DAffine3;

use super::hierarchy::Placement;
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
        PreviousFrame { camera: stage.camera(), poses: poses(stage) }
    }

    /// How entities have moved from then to the World as it stands now, for a picture of a size.
    pub fn motion_to(&self, stage: &Stage, size: [u32; 2]) -> MotionVectors {
        // Focus does not move the image of a point seen through the centre of the lens.
        let camera = CameraRays::new(&self.camera, size, 1.0);
        let now = poses(stage);
        let moved = now.iter().zip(&self.poses).enumerate().filter_map(|(index, (now, then))| {
            let (now, then) = now.as_ref().zip(then.as_ref())?;
            if now.placement == then.placement || now.name != then.name {
                return None;
            }
            let map = then.placement * now.placement.inverse();
            map.is_finite().then_some((index as u32, map))
        });
        MotionVectors::new(camera, moved)
    }
}

fn poses(stage: &Stage) -> Vec<Option<EntityPose>> {
    let mut poses = vec![None; stage.entities.len()];
    for (order, name, placement) in stage.world.query::<Parts>().without::<&Despawned>().iter() {
        let placement = placement.map_or(DAffine3::IDENTITY, |placement| placement.0);
        poses[order.0 as usize] = Some(EntityPose { name: name.map(|name| name.0.clone()), placement });
    }
    poses
}

type Parts<'q> = (&'q AuthoredIndex, Option<&'q Name>, Option<&'q Placement>);
