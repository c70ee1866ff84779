//! The tree as packets and single rays walk through it.

use super::two_level::Bvh;
use super::{packet, stream, walk};
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::packet::{GROUPS, HitSink, RayBatch, RayGroup, RayPacket, Traversal};
use crate::trace::accel::stream::LooseRays;
use crate::trace::primitive::{ClosestHit, Geometry, PreparedRay};
use crate::trace::simd::{Wide, Width};

impl Traversal for Bvh {
    fn width(&self) -> Width {
        self.width
    }

    fn make_room(&self, scratch: &mut TraversalScratch) {
        if scratch.stack.len() < self.stack {
            scratch.stack.resize(self.stack, 0);
        }
        scratch.streams.make_room(self.stack);
    }

    #[inline(always)]
    fn one<L: Wide, const ANY: bool>(
        &self,
        geometry: &Geometry,
        probe: &PreparedRay,
        best: &mut ClosestHit,
        scratch: &mut TraversalScratch,
    ) {
        walk::scan_rest::<L, ANY>(self, geometry, probe, best, scratch);
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
        stream::each_stream::<L, F, ANY>(self, batch, loose, scratch, found);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3, Vec3, Vec3Swizzles};

    use super::*;
    use crate::components::MeshData;
    use crate::trace::accel::HiddenPrimitives;
    use crate::trace::accel::bvh::build;
    use crate::trace::accel::packet::alone;
    use crate::trace::primitive::Tag;
    use crate::trace::soa::Ray;

    #[test]
    fn a_moved_instance_does_not_build_its_mesh_again() {
        let mesh = Arc::new(MeshData::new(vec![Vec3::X, Vec3::Y, Vec3::Z], vec![[0, 1, 2]], Vec::new()));
        let build = |mesh: &Arc<MeshData>, x: f64, before: Option<&Bvh>| {
            let mut geometry = Geometry::default();
            geometry.push_instance(Tag::default(), mesh, false, &DAffine3::from_translation(DVec3::X * x));
            geometry.finish();
            Bvh::build(&geometry, Width::detect(), f64::INFINITY, (before, true), &HiddenPrimitives::NONE)
        };
        let first = build(&mesh, 0.0, None);
        assert!(Arc::ptr_eq(&build(&mesh, 5.0, Some(&first)).models[0].1, &first.models[0].1));
        let other = Arc::new(MeshData::clone(&mesh));
        assert!(!Arc::ptr_eq(&build(&other, 5.0, Some(&first)).models[0].1, &first.models[0].1));
    }

    #[test]
    fn a_ray_enters_only_instances_whose_boxes_it_meets() {
        let mesh = Arc::new(MeshData::new(vec![Vec3::X, Vec3::Y, Vec3::Z], vec![[0, 1, 2]], Vec::new()));
        let mut geometry = Geometry::default();
        for i in 0..8 {
            let map = DAffine3::from_translation(DVec3::new(2.0 * f64::from(i), 0.0, 0.0));
            geometry.push_instance(Tag::default(), &mesh, false, &map);
        }
        geometry.finish();
        let tree = Bvh::build(&geometry, Width::detect(), f64::INFINITY, (None, false), &HiddenPrimitives::NONE);
        let mut worker = TraversalScratch::default();
        let ray = Ray::new(Vec3::new(6.3, 0.3, 5.0), Vec3::NEG_Z);
        assert!(alone::<_, false>(&tree, &geometry, &ray, &mut worker).1.found);
        // The node above the eight, and the one triangle of the fourth.
        assert_eq!((worker.counters.steps, worker.counters.intersection_tests), (1, 1));
    }

    #[test]
    fn boxes_are_fitted_until_a_new_tree_is_worth_building() {
        let balls = |order: fn(usize) -> usize, shift: f32| {
            let mut geometry = Geometry::default();
            for i in 0..512 {
                let n = order(i);
                let at = Vec3::new((n % 8) as f32, (n / 8 % 8) as f32, (n / 64) as f32);
                geometry.push_sphere(Tag::default(), at + shift * at.yzx() * 0.01, 0.2);
            }
            geometry.finish();
            geometry
        };
        let first =
            Bvh::build(&balls(|i| i, 0.0), Width::detect(), f64::INFINITY, (None, false), &HiddenPrimitives::NONE);
        let moved = balls(|i| i, 1.0);
        let fitted = first.world.refit(&moved).expect("nearly the same");
        assert_eq!(fitted.nodes.len(), first.world.nodes.len());
        assert!(fitted.estimate() < 1.1 * build::full(&moved, moved.finite(), &HiddenPrimitives::NONE).estimate());
        // Every ball far from those that were its neighbours.
        assert!(first.world.refit(&balls(|i| i * 301 % 512, 0.0)).is_none());
    }
}
