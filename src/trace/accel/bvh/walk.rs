//! Walking a tree with one ray, nearest box first.

use glam::Vec3;

use super::tree::{Tree, WideNode};
use super::two_level::Bvh;
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::leaves::{HitSpace, NodeKind, NodeRef, TraversalCost, block};
use crate::trace::primitive::{ClosestHit, Geometry, MARGIN, PreparedRay, PrimitiveKind};
use crate::trace::simd::{Kernel, LANES, V3, Wide, prefetch};

/// A walk of the world's tree; the best so far may already be a hit.
#[inline(always)]
pub fn scan_rest<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    probe: &PreparedRay,
    best: &mut ClosestHit,
    scratch: &mut TraversalScratch,
) {
    let TraversalScratch { counters, stack, .. } = scratch;
    let lists = WorldLists { bvh, geometry };
    scan::<L, ANY, _>(&bvh.world, bvh.world.root, probe, HitSpace::WORLD, best, stack, &lists).count(counters);
}

/// The rest of a walk of the world's tree, from one of its children on.
///
/// A kernel of its own: those who call it are entered by the same processor instructions already, and share one copy.
pub struct SubtreeKernel<'a, const ANY: bool> {
    pub bvh: &'a Bvh,
    pub geometry: &'a Geometry,
    pub from: NodeRef,
    pub probe: &'a PreparedRay,
    pub best: &'a mut ClosestHit,
    pub stack: &'a mut [u64],
}

impl<const ANY: bool> Kernel for SubtreeKernel<'_, ANY> {
    type Output = TraversalCost;

    #[inline(always)]
    fn run<L: Wide>(self) -> TraversalCost {
        let SubtreeKernel { bvh, geometry, from, probe, best, stack } = self;
        let lists = WorldLists { bvh, geometry };
        scan::<L, ANY, _>(&bvh.world, from, probe, HitSpace::WORLD, best, stack, &lists)
    }
}

/// Tests lists of primitives of the kinds that have no lanes. A trait and no closure: what closures compute is left
/// outside of the function that enables AVX2.
trait ListTester {
    /// What it is given of the stack is free.
    fn test<const ANY: bool>(
        &self,
        list: &[u32],
        probe: &PreparedRay,
        best: &mut ClosestHit,
        stack: &mut [u64],
    ) -> TraversalCost;
}

/// Those of the world.
struct WorldLists<'a> {
    bvh: &'a Bvh,
    geometry: &'a Geometry,
}

impl ListTester for WorldLists<'_> {
    #[inline(always)]
    fn test<const ANY: bool>(
        &self,
        list: &[u32],
        probe: &PreparedRay,
        best: &mut ClosestHit,
        stack: &mut [u64],
    ) -> TraversalCost {
        others::<ANY>(self.bvh, self.geometry, list, probe, best, stack)
    }
}

/// Trees of meshes have none.
struct NoLists;

impl ListTester for NoLists {
    #[inline(always)]
    fn test<const ANY: bool>(&self, _: &[u32], _: &PreparedRay, _: &mut ClosestHit, _: &mut [u64]) -> TraversalCost {
        TraversalCost::default()
    }
}

/// Primitives of the kinds that have no lanes.
#[inline(always)]
pub fn others<const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    list: &[u32],
    probe: &PreparedRay,
    best: &mut ClosestHit,
    stack: &mut [u64],
) -> TraversalCost {
    let mut cost = TraversalCost::default();
    for &number in list {
        if geometry.kind_of(number) == PrimitiveKind::Instance {
            cost += bvh.width.run(InstanceKernel::<ANY> { bvh, geometry, number, probe, best, stack });
        } else {
            geometry.intersect(number, probe, best);
            cost.tests += 1;
        }
    }
    cost
}

/// Carries the ray into the tree of an instance. A kernel of its own, as [`SubtreeKernel`].
struct InstanceKernel<'a, const ANY: bool> {
    bvh: &'a Bvh,
    geometry: &'a Geometry,
    number: u32,
    probe: &'a PreparedRay,
    best: &'a mut ClosestHit,
    stack: &'a mut [u64],
}

impl<const ANY: bool> Kernel for InstanceKernel<'_, ANY> {
    type Output = TraversalCost;

    #[inline(always)]
    fn run<L: Wide>(self) -> TraversalCost {
        let InstanceKernel { bvh, geometry, number, probe, best, stack } = self;
        let instance = geometry.instance(number);
        let Some((local, scale, near)) = instance.enter(probe, best.t) else { return TraversalCost::default() };
        let scope = HitSpace::of_instance(number, geometry.tag(number).sides, scale, near);
        let tree = &bvh.models[instance.prototype as usize].1;
        scan::<L, ANY, _>(tree, tree.root, &local, scope, best, stack, &NoLists)
    }
}

/// A ray as boxes want it.
struct SlabRay<L> {
    inverse: V3<L>,
    /// Origin times inverse, with the margin that makes near planes nearer.
    near: V3<L>,
    far: V3<L>,
    /// Which side of a box is met first along each axis.
    first: [usize; 3],
}

impl<L: Wide> SlabRay<L> {
    #[inline(always)]
    fn new(probe: &PreparedRay) -> Self {
        // Boxes have margins of their own.
        let margin = probe.origin.abs().max_element() * MARGIN;
        let margin = Vec3::splat(margin).copysign(probe.inverse);
        SlabRay {
            inverse: V3::splat(probe.inverse),
            near: V3::splat((probe.origin + margin) * probe.inverse),
            far: V3::splat((probe.origin - margin) * probe.inverse),
            first: [
                usize::from(probe.inverse.x < 0.0),
                usize::from(probe.inverse.y < 0.0),
                usize::from(probe.inverse.z < 0.0),
            ],
        }
    }

    /// Distances at which the boxes of a node are entered, and which are before `limit`.
    #[inline(always)]
    fn intersect(&self, node: &WideNode, limit: L) -> (L, u32) {
        let [x, y, z] = self.first;
        let [bx, by, bz] = &node.bounds;
        let near_x = L::load(&bx[x & 1]).scale_sub(self.inverse.x, self.near.x);
        let near_y = L::load(&by[y & 1]).scale_sub(self.inverse.y, self.near.y);
        let near_z = L::load(&bz[z & 1]).scale_sub(self.inverse.z, self.near.z);
        let far_x = L::load(&bx[1 - (x & 1)]).scale_sub(self.inverse.x, self.far.x);
        let far_y = L::load(&by[1 - (y & 1)]).scale_sub(self.inverse.y, self.far.y);
        let far_z = L::load(&bz[1 - (z & 1)]).scale_sub(self.inverse.z, self.far.z);
        let near = near_x.max(near_y).max(near_z.max(L::splat(0.0)));
        let far = far_x.min(far_y).min(far_z.min(limit));
        (near, L::bits(near.le(far)))
    }
}

/// Something and the distance at which its box is entered: as integers, in the order of the distances.
#[inline(always)]
pub fn entry(t: f32, what: u32) -> u64 {
    u64::from(t.to_bits()) << 32 | u64::from(what)
}

/// What hangs below a child.
#[inline(always)]
fn scan<L: Wide, const ANY: bool, T: ListTester>(
    tree: &Tree,
    from: NodeRef,
    probe: &PreparedRay,
    scope: HitSpace,
    best: &mut ClosestHit,
    stack: &mut [u64],
    lists: &T,
) -> TraversalCost {
    let mut cost = TraversalCost::default();
    if from == NodeRef::NONE {
        return cost;
    }
    let sight = SlabRay::<L>::new(probe);
    let per_scale = scope.per_scale();
    let mut limit = best.t * per_scale;
    let mut held = 0;
    let mut child = from;
    loop {
        while child.held() == NodeKind::Node {
            let node = &tree.nodes[child.index()];
            cost.steps += 1;
            let (near, hits) = sight.intersect(node, L::splat(limit));
            if hits == 0 {
                child = NodeRef::NONE;
                break;
            }
            child = descend::<ANY>(tree, node, &near.store(), hits, stack, &mut held);
        }
        if child != NodeRef::NONE {
            if child.held() == NodeKind::List {
                let list = &tree.leaves.lists[child.index()][..child.count() as usize];
                cost += lists.test::<ANY>(list, probe, best, &mut stack[held..]);
            } else {
                cost.tests += child.count();
                block::<L>(&tree.leaves, child, probe, scope, best);
            }
            if ANY && best.found {
                return cost;
            }
            limit = best.t * per_scale;
        }
        loop {
            if held == 0 {
                return cost;
            }
            held -= 1;
            let next = stack[held];
            if f32::from_bits((next >> 32) as u32) <= limit {
                child = NodeRef::of_bits(next as u32);
                break;
            }
        }
    }
}

/// The nearest of the children that were met; the others go onto the stack, farthest first.
#[inline(always)]
fn descend<const ANY: bool>(
    tree: &Tree,
    node: &WideNode,
    near: &[f32; LANES],
    hits: u32,
    stack: &mut [u64],
    held: &mut usize,
) -> NodeRef {
    let first = hits.trailing_zeros() as usize & (LANES - 1);
    let mut left = hits & (hits - 1);
    prefetch_child(tree, node.children[first]);
    if left == 0 {
        return node.children[first];
    }
    let mut nearest = entry(near[first], node.children[first].bits());
    // Room for all eight, so that the bounds of the stack are looked at once.
    let Some(room) = stack[*held..].first_chunk_mut::<LANES>() else { unreachable!("stacks have room for a node") };
    let mut end = 0;
    while left != 0 {
        let i = left.trailing_zeros() as usize & (LANES - 1);
        left &= left - 1;
        prefetch_child(tree, node.children[i]);
        let next = entry(near[i], node.children[i].bits());
        let pushed = if next < nearest { std::mem::replace(&mut nearest, next) } else { next };
        let mut at = end;
        if !ANY {
            while at > 0 && room[(at - 1) & (LANES - 1)] < pushed {
                room[at & (LANES - 1)] = room[(at - 1) & (LANES - 1)];
                at -= 1;
            }
        }
        room[at & (LANES - 1)] = pushed;
        end += 1;
    }
    *held += end;
    NodeRef::of_bits(nearest as u32)
}

#[inline(always)]
pub fn prefetch_child(tree: &Tree, child: NodeRef) {
    if child.held() == NodeKind::Node
        && let Some(ahead) = tree.nodes.get(child.index())
    {
        prefetch(ahead);
    }
}
