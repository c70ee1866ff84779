//! The grid as packets and single rays walk through it.

use super::two_level::Grid;
use super::{packet, walk};
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::packet::{GROUPS, RayGroup, RayPacket, Traversal};
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
}
