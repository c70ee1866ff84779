//! A tree of boxes with eight children a node (Wald, Benthin and Boulos 2008; Ernst and Greiner 2008).
//!
//! Eight boxes are tested at once, and a leaf holds a block of up to eight primitives of one kind that are tested at
//! once (see [`super::leaves`]); kinds without blocks are listed and tested one by one. A [`Model`] has a tree of its
//! own, into which the ray is carried by its instances. Where primitives only moved, boxes are fitted to them instead
//! of building again ([`refit`]); where few rays are expected, a tree is built in three fifths of the time ([`fast`]).
//!
//! Boxes are tested with a margin by more than the tests of primitives err, so that no hit is ever lost and the tree
//! answers as brute force does; that alone lets their arithmetic differ from one processor to the next.

mod build;
mod collapse;
mod curve;
mod fast;
mod packet;
mod refit;
mod walk;

use std::sync::Arc;

use super::Worker;
use super::leaves::{Child, Held, Leaves, Source};
use super::packet::{GROUPS, Group, Packet, Structure};
use crate::components::MeshData;
use crate::trace::Geometry;
use crate::trace::geometry::{Best, Bounds, Kind, Layout, Model};
use crate::trace::shapes::Probe;
use crate::trace::simd::{LANES, Wide, Width};

/// Boxes of eight children; those of missing ones are inside out.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    /// By axis, side (least, greatest) and child.
    bounds: [[[f32; LANES]; 2]; 3],
    children: [Child; LANES],
}

/// One tree and its leaves.
#[derive(Clone, Debug)]
struct Tree {
    root: Child,
    nodes: Vec<Node>,
    leaves: Leaves,
    bounds: Bounds,
    /// Greatest coordinate of anything in it.
    extent: f32,
    /// Entries that the stack of a walk can come to hold.
    stack: usize,
    /// [`Self::estimate`] when it was built.
    fresh: f32,
    /// Built for few rays.
    is_fast: bool,
}

impl Tree {
    /// Whether it was built for fewer rays than these.
    fn is_outgrown(&self, rays: f64, primitives: u32) -> bool {
        self.is_fast && repays(rays, primitives)
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + self.leaves.bytes()
    }
}

/// The world's tree, and those of its models.
pub struct Bvh {
    world: Tree,
    /// Numbers at which each kind ended when the world's tree was built.
    layout: Layout,
    /// By model; a mesh that was there before keeps its tree.
    models: Vec<(Arc<MeshData>, Arc<Tree>)>,
    width: Width,
    /// Entries that the stack of a walk can come to hold.
    stack: usize,
    /// The world's tree is an older one, with its boxes fitted to what moved.
    pub is_fitted: bool,
}

/// How many rays a primitive repay a build at full quality.
///
/// Measured with the `rays` bench on one thread, with 874 k triangles: a full build takes 0.64 microseconds a primitive
/// and a fast one 0.37; a diffuse ray takes 0.32 in the full tree and about 0.04 more in the fast one, so that the two are
/// even at about 7 rays a primitive. It is full quality from somewhat fewer on: rays are expected with less certainty than
/// primitives, and other rays lose more.
const REPAY: f64 = 5.0;

/// Whether that many rays, all that are expected to go through a tree while it lasts, repay a build at full quality over
/// a fast one. A question of what is to be drawn, never of threads or of time that was measured.
fn repays(rays: f64, primitives: u32) -> bool {
    rays >= REPAY * f64::from(primitives)
}

impl Tree {
    fn build<S: Source>(source: &S, count: u32, rays: f64) -> Tree {
        if repays(rays, count) { build::full(source, count) } else { fast::fast(source, count) }
    }
}

impl Bvh {
    /// `rays` are expected to go through it. `before` may be any tree: what it holds of the same meshes is not built
    /// again, and where the world has as many primitives of each kind its boxes are fitted to them while that is good
    /// enough. What rays cost then depends on the trees before, what they find does not.
    pub fn build(geometry: &Geometry, width: Width, rays: f64, before: Option<&Bvh>) -> Self {
        let known = before.map_or(&[][..], |bvh| &bvh.models);
        let tree = |model: &Model| {
            let count = model.mesh.triangles.len() as u32;
            let same = known.iter().find(|(mesh, _)| Arc::ptr_eq(mesh, &model.mesh));
            let good = same.filter(|(_, tree)| !tree.is_outgrown(rays, count));
            good.map_or_else(|| Arc::new(Tree::build(model, count, rays)), |(_, tree)| tree.clone())
        };
        let models: Vec<_> = geometry.models().iter().map(|model| (model.mesh.clone(), tree(model))).collect();
        let (layout, count) = (geometry.layout(), geometry.finite());
        let same = before.filter(|bvh| bvh.layout == layout && !bvh.world.is_outgrown(rays, count));
        let fitted = same.and_then(|bvh| bvh.world.refit(geometry));
        let is_fitted = fitted.is_some();
        let world = fitted.unwrap_or_else(|| Tree::build(geometry, count, rays));
        let stack = world.stack + models.iter().map(|(_, tree)| tree.stack).max().unwrap_or(0);
        Bvh { world, layout, models, width, stack, is_fitted }
    }

    /// Whether a part of it was built fast, and would not be for so many rays.
    pub fn is_outgrown(&self, rays: f64) -> bool {
        let of_model = |(mesh, tree): &(Arc<MeshData>, Arc<Tree>)| tree.is_outgrown(rays, mesh.triangles.len() as u32);
        self.world.is_outgrown(rays, self.layout[Kind::Instance as usize]) || self.models.iter().any(of_model)
    }

    /// Memory of trees and leaves.
    pub fn bytes(&self) -> usize {
        self.world.bytes() + self.models.iter().map(|(_, tree)| tree.bytes()).sum::<usize>()
    }
}

impl Structure for Bvh {
    fn width(&self) -> Width {
        self.width
    }

    fn make_room(&self, worker: &mut Worker) {
        if worker.stack.len() < self.stack {
            worker.stack.resize(self.stack, 0);
        }
    }

    #[inline(always)]
    fn one<L: Wide, const ANY: bool>(&self, geometry: &Geometry, probe: &Probe, best: &mut Best, worker: &mut Worker) {
        walk::scan_rest::<L, ANY>(self, geometry, probe, best, worker);
    }

    #[inline(always)]
    fn many<L: Wide, const ANY: bool>(
        &self,
        packet: Packet,
        groups: &mut [Group<L>; GROUPS],
        worker: &mut Worker,
    ) -> bool {
        packet::descend::<L, ANY>(self, packet, groups, worker)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3, Vec3, Vec3Swizzles};

    use super::*;
    use crate::trace::accel::packet::alone;
    use crate::trace::{Ray, Tag};

    #[test]
    fn a_moved_instance_does_not_build_its_mesh_again() {
        let mesh = Arc::new(MeshData::new(vec![Vec3::X, Vec3::Y, Vec3::Z], vec![[0, 1, 2]], Vec::new()));
        let build = |mesh: &Arc<MeshData>, x: f64, before: Option<&Bvh>| {
            let mut geometry = Geometry::default();
            geometry.push_instance(Tag::default(), mesh, false, &DAffine3::from_translation(DVec3::X * x));
            geometry.finish();
            Bvh::build(&geometry, Width::detect(), f64::INFINITY, before)
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
        let tree = Bvh::build(&geometry, Width::detect(), f64::INFINITY, None);
        let mut worker = Worker::default();
        let ray = Ray::new(Vec3::new(6.3, 0.3, 5.0), Vec3::NEG_Z);
        let mut best = Best::within(f32::INFINITY);
        alone::<_, false>(&tree, &geometry, &Probe::from(&ray), &mut best, &mut worker);
        assert!(best.found);
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
        let first = Bvh::build(&balls(|i| i, 0.0), Width::detect(), f64::INFINITY, None);
        let moved = balls(|i| i, 1.0);
        let fitted = first.world.refit(&moved).expect("nearly the same");
        assert_eq!(fitted.nodes.len(), first.world.nodes.len());
        assert!(fitted.estimate() < 1.1 * build::full(&moved, moved.finite()).estimate());
        // Every ball far from those that were its neighbours.
        assert!(first.world.refit(&balls(|i| i * 301 % 512, 0.0)).is_none());
    }
}
