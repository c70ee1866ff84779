//! The grid as packets and single rays walk through it.

use super::two_level::Grid;
use super::{packet, walk};
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::packet::{GROUPS, HitSink, RayBatch, RayGroup, RayPacket, Traversal};
use crate::trace::accel::stream::LooseRays;
use crate::trace::primitive::{ClosestHit, Geometry, PreparedRay};
use crate::trace::simd::{Wide, Width};

impl Traversal for Grid {
    fn width(&self) -> Width {
        self.width
    }

    fn make_room(&self, _: &mut TraversalScratch) {}

    #[inline(always)]
    fn one<L: Wide, const ANY: bool>(
        &self,
        geometry: &Geometry,
        probe: &PreparedRay,
        best: &mut ClosestHit,
        scratch: &mut TraversalScratch,
    ) {
        walk::world::<L, ANY>(self, geometry, probe, best, scratch);
    }

    #[inline(always)]
    fn many<L: Wide, const ANY: bool>(
        &self,
        packet: RayPacket,
        groups: &mut [RayGroup<L>; GROUPS],
        scratch: &mut TraversalScratch,
    ) -> bool {
        packet::descend::<L, ANY>(self, packet, groups, scratch)
    }

    #[inline(always)]
    fn loose<L: Wide, F: HitSink + ?Sized, const ANY: bool>(
        &self,
        batch: RayBatch,
        loose: &LooseRays,
        scratch: &mut TraversalScratch,
        found: &mut F,
    ) {
        for i in 0..loose.len() {
            let (number, begun) = loose.get(i);
            let (skip, ray) = batch.geometry.approach(&batch.rays.get(number as usize));
            let mut best = begun.unwrap_or(ClosestHit::within(ray.t_max));
            let kernel = walk::RestKernel::<ANY> {
                grid: self,
                geometry: batch.geometry,
                probe: &PreparedRay::from(&ray),
                best: &mut best,
                scratch,
            };
            self.width.run(kernel);
            found.one(number as usize, skip, &best);
        }
    }
}
