//! Hits that are shaded side by side, eight at a time.

use super::context::RenderContext;
use super::interaction::LEAST_FACING;
use super::path_state::PathStateLanes;
use super::ray_queue::RayQueue;
use crate::trace::primitive::SurfacePointLanes;
use crate::trace::sampler::{SampleLanes, SampleSet};
use crate::trace::simd::{LANES, V3, Wide, lanes_to_bits, set_lane};
use crate::trace::soa::{HitLanes, Hits, RayLanes};

/// A hit that is shaded beside others: indices of its ray and of its material.
pub type ShadingEntry = [u32; 2];

/// What a wave met, and which of it is shaded side by side.
#[derive(Clone, Copy)]
pub struct ShadingInput<'a> {
    pub context: RenderContext<'a>,
    pub wave: &'a RayQueue,
    pub hits: &'a Hits,
    pub places: &'a [ShadingEntry],
    pub samples: SampleSet<'a>,
}

/// Eight hits, the last ones repeated where there are fewer.
pub struct ShadingBatch<'a, L: Wide> {
    /// Cones are those at the hits.
    pub states: PathStateLanes<L>,
    /// Of the rays.
    pub direction: V3<L>,
    /// Facing the rays.
    pub points: SurfacePointLanes<L>,
    /// The normal that light is counted about on paths.
    pub normal: V3<L>,
    pub materials: [u32; LANES],
    pub albedo: V3<L>,
    pub samples: SampleLanes<'a>,
    /// A bit for each lane that is in use.
    pub used: u32,
}

impl<'a> ShadingInput<'a> {
    #[inline(always)]
    pub fn group<L: Wide>(&self, places: &[ShadingEntry]) -> ShadingBatch<'a, L> {
        let (context, wave) = (self.context, self.wave);
        let (mut rays, mut materials) = ([0; LANES], [0; LANES]);
        let mut albedo = [[0.0; LANES]; 3];
        // A loop, not functions of arrays: see `Kernel::run`.
        for i in 0..LANES {
            let [ray, material] = places[i.min(places.len() - 1)];
            (rays[i], materials[i]) = (ray as usize, material);
            set_lane(&mut albedo, i, context.materials[material as usize].diffuse);
        }
        let (mut states, ray, hits): (PathStateLanes<L>, RayLanes<L>, HitLanes<L>);
        if places.len() == LANES && rays[LANES - 1] - rays[0] == LANES - 1 {
            let first = rays[0];
            (states, ray, hits) = (wave.states().lanes(first), wave.rays().lanes(first), self.hits.lanes(first));
        } else {
            (states, ray, hits) = (wave.states().gather(&rays), wave.rays().gather(&rays), self.hits.gather(&rays));
        }
        let direction = ray.direction;
        let points = context.geometry.surface_points(&ray, &hits).facing(direction);
        states.cone.width = states.cone.width + states.cone.spread * hits.t;
        let trusted = points.shading_normal.dot(direction).lt(L::splat(-LEAST_FACING));
        ShadingBatch {
            direction,
            normal: V3::select(trusted, points.shading_normal, points.geometric_normal),
            points,
            materials,
            albedo: V3::load(&albedo),
            samples: self.samples.eight(lanes_to_bits(states.sample), states.each_node()),
            states,
            used: (1 << places.len()) - 1,
        }
    }
}
