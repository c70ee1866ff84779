//! What makes an animation hard to trace, in numbers: most of what Lext, Assarsson and Möller name in "BART: a benchmark for
//! animated ray tracing" (IEEE Computer Graphics and Applications, 2001), as far as it is known before a ray is traced.

use glam::{DAffine3, DVec3};
use rustc_hash::FxHashMap;

use super::Shot;
use super::placements::{Placements, shapes_of};
use super::plan::{Plan, PlannedFrame};
use crate::base::diagnostics::Diagnostics;
use crate::base::limits;
use crate::components::shapes::world_bounds;
use crate::components::*;

/// Pairs of neighbouring frames that are compared, spread over the plan.
const PAIRS: usize = 8;
/// Bodies whose boxes are held against those of all others.
const BOXES: usize = 256;

/// The measures of a plan. Shares are from 0 to 1 and means over the pairs of frames that were looked at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnimationMeasures {
    /// Pairs of neighbouring frames that were looked at.
    pub pairs: usize,
    /// Entities with a shape that has an end.
    pub bodies: usize,
    /// What rays are tested against.
    pub primitives: usize,
    /// Entities that carry a light.
    pub lights: usize,
    /// Entities above the deepest one, and itself.
    pub levels: usize,
    /// Share of the bodies that stand elsewhere in the next frame.
    pub moving: f64,
    /// Share of the bodies that have another form in the next frame.
    pub bending: f64,
    /// Share of the lights that stand elsewhere in the next frame.
    pub lights_moving: f64,
    /// Share of the pairs in which the camera moves.
    pub camera_moving: f64,
    /// How much larger the box of all is than that of the median body: a teapot in a stadium.
    pub size_ratio: f64,
    /// Boxes of other bodies that the box of one meets.
    pub overlap: f64,
    /// Deviation of the cost of frames, as a share of its mean.
    pub cost_deviation: f64,
    /// The largest cost of a frame over the mean.
    pub cost_peak: f64,
}

/// A frame, as far as it is compared.
struct Snapshot {
    scene: Scene,
    camera: Camera,
    places: Vec<DAffine3>,
    boxes: Vec<[DVec3; 2]>,
}

impl Snapshot {
    fn of(shot: &mut Shot, frame: u32) -> Result<Self, Diagnostics> {
        let scene = shot.scene_of(frame)?;
        let placements = Placements::new(&scene);
        let places: Vec<DAffine3> = (0..scene.entities.len()).map(|index| placements.of(index)).collect();
        let camera = placements.camera();
        let of_entity = |(desc, map): (&EntityDesc, &DAffine3)| {
            let boxes = shapes_of(desc).filter_map(|shape| world_bounds(shape, map));
            boxes.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
        };
        let boxes = scene.entities.iter().zip(&places).filter_map(of_entity).collect();
        Ok(Snapshot { scene, camera, places, boxes })
    }
}

impl AnimationMeasures {
    /// Measures the frames of a plan.
    ///
    /// # Errors
    /// The mistakes of a frame that is looked at.
    pub fn of(shot: &mut Shot, plan: &Plan) -> Result<Self, Diagnostics> {
        let (first, last) = (1, shot.frames());
        let pairs = PAIRS.min(last.saturating_sub(first) as usize);
        let mut measures = AnimationMeasures { pairs, ..AnimationMeasures::default() };
        measures.costs(plan);
        let rest = Snapshot::of(shot, first)?;
        measures.sizes(&rest);
        for pair in 0..pairs as u32 {
            let frame = first + pair * (last - first) / pairs as u32;
            let [before, after] = [Snapshot::of(shot, frame)?, Snapshot::of(shot, frame + 1)?];
            measures.add_pair(&before, &after);
        }
        Ok(measures)
    }

    fn costs(&mut self, plan: &Plan) {
        let costs: Vec<f64> = plan.frames.iter().map(PlannedFrame::cost).collect();
        let count = costs.len().max(1) as f64;
        let mean = costs.iter().sum::<f64>() / count;
        if mean > 0.0 {
            let variance = costs.iter().map(|cost| (cost - mean) * (cost - mean)).sum::<f64>() / count;
            self.cost_deviation = variance.sqrt() / mean;
            self.cost_peak = costs.iter().copied().fold(0.0, f64::max) / mean;
        }
    }

    fn sizes(&mut self, rest: &Snapshot) {
        let Snapshot { scene, boxes, .. } = rest;
        self.bodies = boxes.len();
        self.primitives = scene.entities.iter().flat_map(shapes_of).map(|shape| shape.primitive_count()).sum();
        self.lights = scene.entities.iter().filter(|desc| is_lamp(desc)).count();
        self.levels = levels(scene);
        let mut sizes: Vec<f64> = boxes.iter().map(|[min, max]| min.distance(*max)).collect();
        sizes.sort_by(f64::total_cmp);
        let all = boxes.iter().copied().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        if let (Some([min, max]), Some(median)) = (all, sizes.get(sizes.len() / 2).filter(|size| **size > 0.0)) {
            self.size_ratio = min.distance(max) / median;
        }
        let step = boxes.len().div_ceil(BOXES).max(1);
        let meets = |a: &[DVec3; 2], b: &[DVec3; 2]| a[0].cmple(b[1]).all() && b[0].cmple(a[1]).all();
        let looked_at: Vec<&[DVec3; 2]> = boxes.iter().step_by(step).collect();
        let met: usize = looked_at.iter().map(|one| boxes.iter().filter(|other| meets(one, other)).count() - 1).sum();
        self.overlap = met as f64 / looked_at.len().max(1) as f64;
    }

    fn add_pair(&mut self, before: &Snapshot, after: &Snapshot) {
        let weight = 1.0 / self.pairs as f64;
        let share = |count: usize, of: usize| weight * count as f64 / of.max(1) as f64;
        let all = before.scene.entities.iter().zip(&after.scene.entities).enumerate();
        let (mut moving, mut bending, mut lights) = (0, 0, 0);
        for (index, (was, is)) in all {
            let moves = before.places[index] != after.places[index];
            let has_body = shapes_of(was).any(|shape| shape.reach() == shapes::Reach::Finite);
            moving += usize::from(has_body && moves);
            bending += usize::from(has_body && has_another_form(was, is));
            let shines_elsewhere =
                Kind::ALL.iter().any(|kind| kind.role() == Role::Light && was.get(*kind) != is.get(*kind));
            lights += usize::from(is_lamp(was) && (moves || shines_elsewhere));
        }
        self.moving += share(moving, self.bodies);
        self.bending += share(bending, self.bodies);
        self.lights_moving += share(lights, self.lights);
        let view = |camera: &Camera| [camera.from, camera.at, camera.up];
        self.camera_moving += share(usize::from(view(&before.camera) != view(&after.camera)), 1);
    }
}

fn is_lamp(desc: &EntityDesc) -> bool {
    Kind::ALL.iter().any(|kind| kind.role() == Role::Light && desc.get(*kind).is_some())
}

/// Whether an entity has another form, wherever it stands.
fn has_another_form(was: &EntityDesc, is: &EntityDesc) -> bool {
    let decides = |kind: &Kind| matches!(kind.role(), Role::Shape | Role::Deformation);
    Kind::ALL.iter().filter(|kind| decides(kind)).any(|kind| was.get(*kind) != is.get(*kind))
}

/// Entities from the top of the hierarchy down to the deepest one.
fn levels(scene: &Scene) -> usize {
    let named = |(index, desc): (usize, &EntityDesc)| desc.name.clone().map(|name| (name, index));
    let by_name: FxHashMap<Text, usize> = scene.entities.iter().enumerate().filter_map(named).collect();
    let parent = |index: usize| {
        let transform = scene.entities[index].get(Kind::Transform).and_then(Transform::of)?;
        by_name.get(transform.parent.as_ref()?).copied()
    };
    let level = |mut index: usize| {
        let mut levels = 1;
        while let Some(above) = parent(index).filter(|_| levels < limits::HIERARCHY_DEPTH) {
            (index, levels) = (above, levels + 1);
        }
        levels
    };
    (0..scene.entities.len()).map(level).max().unwrap_or(0)
}
