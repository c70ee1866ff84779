//! Hits that are shaded side by side, eight at a time.

use super::context::RenderContext;
use super::interaction::LEAST_FACING;
use super::path_state::{EmissionScope, PathStateLanes};
use super::ray_queue::RayQueue;
use super::slots::slot_sample;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{SurfacePoint, SurfacePointLanes};
use crate::trace::sampler::{SampleLanes, SampleSet, tangents};
use crate::trace::simd::{LANES, V3, Wide, lane, lanes, lanes_to_bits, set_lane};
use crate::trace::soa::{HitLanes, Hits, RayLanes};

/// A hit that is shaded beside others: indices of its ray and of its material.
pub type ShadingEntry = [u32; 2];

/// What a wave met, and which of it is shaded side by side.
#[derive(Clone, Copy)]
pub struct ShadingInput<'a> {
    /// What is traced.
    pub context: RenderContext<'a>,
    /// The rays.
    pub wave: &'a RayQueue,
    /// What each of them met.
    pub hits: &'a Hits,
    /// Which of them are shaded, by material.
    pub places: &'a [ShadingEntry],
    /// What they draw their numbers from.
    pub samples: SampleSet<'a>,
}

/// Eight hits, the last ones repeated where there are fewer.
pub struct ShadingBatch<'a, L: Wide> {
    /// Where they come from.
    input: ShadingInput<'a>,
    /// Cones are those at the hits.
    pub states: PathStateLanes<L>,
    /// Of the rays.
    pub direction: V3<L>,
    /// Whether the rays come from the outside.
    pub front: L::Mask,
    /// Facing the rays.
    pub points: SurfacePointLanes<L>,
    /// The normal that light is counted about on paths.
    pub normal: V3<L>,
    materials: [u32; LANES],
    /// Numbers of the rays.
    rays: [usize; LANES],
    pub albedo: V3<L>,
    pub samples: SampleLanes<'a>,
    /// A bit for each lane that is in use.
    pub used: u32,
}

impl<'a> ShadingInput<'a> {
    /// Eight hits at most, their surfaces and states in lanes.
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
        if context.lights.has_receivers() {
            let mut entities = [0; LANES];
            for (entity, ray) in entities.iter_mut().zip(rays) {
                *entity = entity_of(self, ray);
            }
            states.scope = EmissionScope::with_receivers(states.scope, &entities);
        }
        let mut samples = lanes_to_bits(states.sample);
        for sample in &mut samples {
            *sample = slot_sample(*sample);
        }
        let direction = ray.direction;
        let points = context.geometry.surface_points(&ray, &hits);
        let front = direction.dot(points.geometric_normal).lt(L::splat(0.0));
        let points = points.facing(direction);
        states.cone.width = states.cone.width + states.cone.spread * hits.t;
        let trusted = points.shading_normal.dot(direction).lt(L::splat(-LEAST_FACING));
        ShadingBatch {
            input: *self,
            direction,
            front,
            normal: V3::select(trusted, points.shading_normal, points.geometric_normal),
            points,
            materials,
            rays,
            albedo: V3::load(&albedo),
            samples: self.samples.eight(samples, states.each_node()),
            states,
            used: (1 << places.len()) - 1,
        }
    }
}

impl<L: Wide> ShadingBatch<'_, L> {
    /// Axes of the surfaces, z along the normals, and the directions back along the rays in them; their z is positive.
    #[inline(always)]
    pub fn axes(&self) -> ([V3<L>; 3], V3<L>) {
        let (back, normal) = (-self.direction, self.normal);
        let [x, y] = tangents(normal);
        let wo = V3 { x: back.dot(x), y: back.dot(y), z: back.dot(normal).max(L::splat(1e-7)) };
        ([x, y, normal], wo)
    }

    /// What the surface of one lane is of.
    #[inline(always)]
    pub fn material(&self, lane: usize) -> &ShadingParams {
        &self.input.context.materials[self.materials[lane] as usize]
    }

    /// The entity whose surface is in one lane.
    #[inline(always)]
    pub fn entity(&self, lane: usize) -> u32 {
        entity_of(&self.input, self.rays[lane])
    }

    /// As [`SurfaceInteraction::smooth_start`](super::SurfaceInteraction::smooth_start), for the lanes that have a bit:
    /// which of them have such a start, and all `origins` with theirs in place of what is there.
    #[inline(always)]
    pub fn smooth_starts(&self, bits: u32, origins: V3<L>) -> (u32, V3<L>) {
        let SurfacePointLanes { point, error, geometric_normal, shading_normal } = &self.points;
        // No function of arrays: see `Kernel::run`.
        let points = [point.store(), error.store(), geometric_normal.store(), shading_normal.store()];
        let mut origins = origins.store();
        let mut opaque = 0;
        for i in lanes(bits) {
            opaque |= u32::from(self.material(i).transmission == 0.0) << i;
        }
        let found = each_smooth_start(&self.input, &self.rays, &points, opaque, &mut origins);
        (found, V3::load(&origins))
    }
}

/// The entity that a ray met.
fn entity_of(input: &ShadingInput, ray: usize) -> u32 {
    input.context.geometry.tag(input.hits.primitive(ray)).entity
}

/// Light behind a surface that its smooth normals face is rare: lane by lane is soon enough.
#[cold]
fn each_smooth_start(
    input: &ShadingInput,
    rays: &[usize; LANES],
    points: &[[[f32; LANES]; 3]; 4],
    bits: u32,
    origins: &mut [[f32; LANES]; 3],
) -> u32 {
    let mut found = 0;
    for i in lanes(bits) {
        let Some(hit) = input.hits.get(rays[i]) else { continue };
        let [point, error, geometric_normal, shading_normal] = [0, 1, 2, 3].map(|k: usize| lane(&points[k], i));
        let surface = SurfacePoint { point, error, geometric_normal, shading_normal, ..SurfacePoint::default() };
        if let Some(start) = input.context.geometry.smooth_start(&hit, &surface) {
            found |= 1 << i;
            set_lane(origins, i, start);
        }
    }
    found
}
