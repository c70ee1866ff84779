//! Shadow rays with what each adds, column by column, and where that is added.

use glam::Vec3;

use super::context::RenderContext;
use crate::trace::simd::{LANES, V3, Wide, lanes_from_bits};
use crate::trace::soa::{Columns, Ray, Rays};

/// Where the light of a light group is added up for a sample.
#[inline]
pub fn accumulator_slot(sample: u32, pass: u32) -> u32 {
    sample + pass * BATCH as u32
}

/// The sample of such a place.
#[inline]
pub fn slot_sample(place: u32) -> u32 {
    place % BATCH as u32
}

/// Shadow rays towards one light, with what each adds if nothing stands in its way.
#[derive(Debug, Default)]
pub struct ShadowRayQueue {
    pub rays: Rays,
    /// Ends of the rays, where transparent surfaces do not stop them.
    targets: Columns<3>,
    /// Bits of the place that the light is added to, and the light.
    contributions: Columns<4>,
}

/// Shadow rays side by side.
pub struct ShadowRayBatch<L> {
    pub origin: V3<L>,
    pub direction: V3<L>,
    pub distance: L,
    pub target: V3<L>,
    pub contribution: V3<L>,
}

impl ShadowRayQueue {
    /// Asks whether the way to `target` is free.
    #[inline]
    pub fn push(&mut self, context: RenderContext, ray: Ray, target: Vec3, place: u32, contribution: Vec3) {
        self.rays.push(ray);
        if context.settings.transparent_shadows {
            self.targets.push(target.to_array());
        }
        self.contributions.push([f32::from_bits(place), contribution.x, contribution.y, contribution.z]);
    }

    /// Adds the rays of the lanes that have a bit, which belong to these samples and whose light goes to this group.
    #[inline(always)]
    pub fn compress_store<L: Wide>(
        &mut self,
        context: RenderContext,
        which: u32,
        asked: &ShadowRayBatch<L>,
        samples: &[u32; LANES],
        pass: u32,
    ) {
        let ShadowRayBatch { origin, direction, distance, target, contribution } = *asked;
        self.rays.compress_store(which, origin, direction, distance);
        if context.settings.transparent_shadows {
            self.targets.compress_store(which, &[target.x, target.y, target.z]);
        }
        let mut places = *samples;
        for at in &mut places {
            *at = accumulator_slot(*at, pass);
        }
        self.contributions
            .compress_store(which, &[lanes_from_bits(&places), contribution.x, contribution.y, contribution.z]);
    }

    /// Where the light of one ray is added, and how much it is.
    #[inline(always)]
    pub fn contribution(&self, i: usize) -> (u32, Vec3) {
        let [place, x, y, z] = self.contributions.row(i);
        (place.to_bits(), Vec3::new(x, y, z))
    }

    pub fn target(&self, i: usize) -> Vec3 {
        Vec3::from_array(self.targets.row(i))
    }

    pub fn clear(&mut self) {
        self.rays.clear();
        self.targets.clear();
        self.contributions.clear();
    }
}

/// Samples that go through the scene together: enough to keep packets full, few enough for the cache.
pub const BATCH: usize = 2048;
