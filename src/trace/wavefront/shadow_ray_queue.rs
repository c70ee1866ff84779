//! Shadow rays with what each adds, column by column, and where that is added.

use glam::Vec3;

use super::context::RenderContext;
use super::slots::accumulator_slot;
use crate::trace::simd::{LANES, Lanes, V3, lanes_from_bits};
use crate::trace::soa::{Ray, RayLanes, Rays, work_item};

work_item! {
    /// What a shadow ray adds if nothing stands in its way.
    #[derive(Clone, Copy, Debug, PartialEq)]
    ShadowRay, ShadowRayLanes, ShadowRays {
        /// Where it is added: see [`accumulator_slot`].
        slot: u32,
        /// The light, weighted.
        contribution: Vec3,
    }
}

work_item! {
    /// The end of a shadow ray, where transparent surfaces do not stop it.
    #[derive(Clone, Copy, Debug, PartialEq)]
    ShadowTarget, ShadowTargetLanes, ShadowTargets {
        /// On the light.
        point: Vec3,
    }
}

/// Shadow rays towards one light, with what each adds if nothing stands in its way.
#[derive(Debug, Default)]
pub struct ShadowRayQueue {
    /// The rays, each ending at its light.
    pub rays: Rays,
    /// None but where transparent surfaces do not stop rays.
    targets: ShadowTargets,
    shadow_rays: ShadowRays,
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
    /// Adds a ray whose light is added to `slot` if the way to `target` is free.
    #[inline]
    pub fn push(&mut self, context: RenderContext, ray: Ray, target: Vec3, slot: u32, contribution: Vec3) {
        self.rays.push(ray);
        if context.dims_shadow_rays() {
            self.targets.push(ShadowTarget { point: target });
        }
        self.shadow_rays.push(ShadowRay { slot, contribution });
    }

    /// Adds the rays of the lanes that have a bit, which belong to these samples and whose light goes to this group.
    #[inline(always)]
    pub fn compress_store<L: Lanes>(
        &mut self,
        context: RenderContext,
        which: u32,
        asked: &ShadowRayBatch<L>,
        samples: &[u32; LANES],
        group: u32,
    ) {
        let ShadowRayBatch { origin, direction, distance, target, contribution } = *asked;
        self.rays.compress_store(which, &RayLanes { origin, direction, t_max: distance });
        if context.dims_shadow_rays() {
            self.targets.compress_store(which, &ShadowTargetLanes { point: target });
        }
        let mut slots = *samples;
        for slot in &mut slots {
            *slot = accumulator_slot(*slot, group);
        }
        self.shadow_rays.compress_store(which, &ShadowRayLanes { slot: lanes_from_bits(&slots), contribution });
    }

    /// Where the light of one ray is added, and how much it is.
    #[inline(always)]
    pub fn get(&self, i: usize) -> ShadowRay {
        self.shadow_rays.get(i)
    }

    /// Where on its light a ray ends.
    pub fn target(&self, i: usize) -> Vec3 {
        self.targets.get(i).point
    }

    /// Forgets all; memory stays.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.targets.clear();
        self.shadow_rays.clear();
    }
}
