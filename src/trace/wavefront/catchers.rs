//! Shadow catchers: surfaces of which the camera sees no more than the shadows on them.
//!
//! Light that arrives at a catcher is followed in two scenes: the one that there is, and the one without objects, where
//! catchers, what emits light and the surroundings are left. How much less there is in the first of what there is in the second is
//! shadow. The film takes the ratio of the sums over a pixel, not of samples.
//!
//! Both scenes are traced by the same rays and the same random numbers: a path from a catcher is one until it meets an
//! object. There it divides, one ray ends up in the scene with objects, the other goes on behind as if nothing were
//! there. So the ratio is exactly 1 where no object is near, and has little noise elsewhere.
//!
//! Which scene a ray belongs to is told by the slot that its light goes to: catchers have rows of their own behind that
//! of the other light, in place of light groups.

use glam::Vec3;

use super::context::RenderContext;
use super::holes::beyond;
use super::path_state::PathState;
use super::ray_queue::RayQueue;
use super::slots::{CatcherRow, slot_sample};
use super::worker::Worker;
use crate::film::CaughtLight;
use crate::trace::accel::Accelerator;
use crate::trace::sampler::{Domain, RayNode, Sampler};
use crate::trace::soa::Hits;

/// What a sample has caught.
pub fn caught_light(colors: &[Vec3], sample: usize) -> CaughtLight {
    let of = |row: CatcherRow| colors[row.slot(sample as u32) as usize];
    let both = of(CatcherRow::Both);
    CaughtLight {
        with_objects: both + of(CatcherRow::WithObjects),
        without_objects: both + of(CatcherRow::WithoutObjects),
        behind: of(CatcherRow::Behind),
    }
}

/// Takes note of camera rays that have met a catcher, and divides the paths from catchers that have met an object.
pub fn split_at_catchers(
    (context, accelerator): (RenderContext, &Accelerator),
    (wave, hits): (&mut RayQueue, &mut Hits),
    sampler: impl Fn(u32) -> Sampler,
    (colors, caught): (&mut [Vec3], &mut [bool]),
    worker: &mut Worker,
) {
    for i in 0..wave.rays().len() {
        let Some(hit) = hits.get(i) else { continue };
        let material = &context.materials[context.geometry.tag(hit.primitive).material as usize];
        let (ray, mut state) = wave.get(i);
        let sample = slot_sample(state.sample);
        match CatcherRow::of(context.catchers, state.sample) {
            CatcherRow::Seen if state.node == RayNode::CAMERA && material.shadow_catcher => {
                caught[sample as usize] = true;
                if !context.settings.transparent {
                    colors[CatcherRow::Behind.slot(sample) as usize] =
                        state.throughput * context.surroundings(ray.direction, state.cone);
                }
                state.sample = CatcherRow::Both.slot(sample);
                wave.set_state(i, &state);
            }
            CatcherRow::Both if !material.stays_without_objects() => {
                let mut without = PathState { sample: CatcherRow::WithoutObjects.slot(sample), ..state };
                state.sample = CatcherRow::WithObjects.slot(sample);
                wave.set_state(i, &state);
                let chance = |step: u32| sampler(state.sample).random(state.node, Domain::Hole(step))[0];
                let found = beyond((context, accelerator), &ray, hit, &mut without, chance, worker);
                wave.push(ray, without);
                hits.push(found);
            }
            CatcherRow::Seen
            | CatcherRow::Both
            | CatcherRow::WithObjects
            | CatcherRow::WithoutObjects
            | CatcherRow::Behind => {}
        }
    }
}
