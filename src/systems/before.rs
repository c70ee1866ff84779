//! The World as it was in the frame before, for the motion of what the camera sees.

use glam::DAffine3;
use hecs::World;

use super::hierarchy::Placement;
use super::stage::{Absent, Name, Order, Stage};
use crate::components::{Camera, Text};
use crate::trace::camera::CameraRays;
use crate::trace::reuse::MotionVectors;

/// Camera and placements of one moment. Shapes and materials of their own time do not count.
#[derive(Clone, Debug, PartialEq)]
pub struct Past {
    camera: Camera,
    /// By authored index; `None` was not there.
    stances: Vec<Option<Stance>>,
}

/// Where an entity stood, and its name: what frames spawn under other names is not the same entity.
#[derive(Clone, Debug, PartialEq)]
struct Stance {
    name: Option<Text>,
    placement: DAffine3,
}

impl Past {
    /// The World as it stands, its placements up to date.
    pub fn of(stage: &Stage) -> Past {
        Past { camera: stage.camera(), stances: stances(&stage.world, stage.entities.len()) }
    }

    /// How what is in the World as it stands now has moved since, in a picture of a size.
    pub fn seen_from(&self, stage: &Stage, size: [u32; 2]) -> MotionVectors {
        // Where the lens is focused does not move what its middle sees.
        let camera = CameraRays::new(&self.camera, size, 1.0);
        let now = stances(&stage.world, stage.entities.len());
        let moved = now.iter().zip(&self.stances).enumerate().filter_map(|(index, (now, then))| {
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

fn stances(world: &World, count: usize) -> Vec<Option<Stance>> {
    let mut stances = vec![None; count];
    type Parts<'q> = (&'q Order, Option<&'q Name>, Option<&'q Placement>);
    for (order, name, placement) in world.query::<Parts>().without::<&Absent>().iter() {
        let placement = placement.map_or(DAffine3::IDENTITY, |placement| placement.0);
        stances[order.0 as usize] = Some(Stance { name: name.map(|name| name.0.clone()), placement });
    }
    stances
}
