//! Walking a tree with one ray, nearest box first.

use glam::Vec3;

use super::tree::{Tree, WideNode};
use super::two_level::Bvh;
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::leaves::{HitSpace, NodeKind, NodeRef, TraversalCost, block};
use crate::trace::primitive::{ClosestHit, Geometry, MARGIN, PreparedRay, PrimitiveKind};
use crate::trace::simd::{LANES, V3, Wide, prefetch};

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
    let cost = scan::<L, ANY>(&bvh.world, probe, HitSpace::WORLD, best, stack, |list, best, stack| {
        others::<L, ANY>(bvh, geometry, list, probe, best, stack)
    });
    cost.count(counters);
}

/// Primitives of the kinds that have no lanes.
#[inline(always)]
pub fn others<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    list: &[u32],
    probe: &PreparedRay,
    best: &mut ClosestHit,
    stack: &mut [u64],
) -> TraversalCost {
    let mut cost = TraversalCost::default();
    for &n in list {
        if geometry.kind_of(n) == PrimitiveKind::Instance {
            cost += enter::<L, ANY>(bvh, geometry, n, probe, best, stack);
        } else {
            geometry.intersect(n, probe, best);
            cost.tests += 1;
        }
    }
    cost
}

/// Carries the ray into the tree of an instance.
#[inline(always)]
fn enter<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    number: u32,
    probe: &PreparedRay,
    best: &mut ClosestHit,
    stack: &mut [u64],
) -> TraversalCost {
    let instance = geometry.instance(number);
    let Some((local, scale, near)) = instance.enter(probe, best.t) else { return TraversalCost::default() };
    let scope = HitSpace::of_instance(number, geometry.tag(number).sides, scale, near);
    scan::<L, ANY>(&bvh.models[instance.prototype as usize].1, &local, scope, best, stack, |_, _, _| {
        TraversalCost::default()
    })
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
    fn new(probe: &PreparedRay, extent: f32) -> Self {
        let margin = (probe.origin.abs().max_element() + extent) * MARGIN;
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
        let b = &node.bounds;
        let plane =
            |axis: usize, side: usize, inverse: L, origin: L| L::load(&b[axis][side & 1]).scale_sub(inverse, origin);
        let near = plane(0, x, self.inverse.x, self.near.x)
            .max(plane(1, y, self.inverse.y, self.near.y))
            .max(plane(2, z, self.inverse.z, self.near.z).max(L::splat(0.0)));
        let far = plane(0, 1 - x, self.inverse.x, self.far.x)
            .min(plane(1, 1 - y, self.inverse.y, self.far.y))
            .min(plane(2, 1 - z, self.inverse.z, self.far.z).min(limit));
        (near, L::bits(near.le(far)))
    }
}

/// Something and the distance at which its box is entered: as integers, in the order of the distances.
#[inline(always)]
pub fn entry(t: f32, what: u32) -> u64 {
    u64::from(t.to_bits()) << 32 | u64::from(what)
}

/// `others` tests a list of primitives of other kinds; what it is given of the stack is free.
#[inline(always)]
fn scan<L: Wide, const ANY: bool>(
    tree: &Tree,
    probe: &PreparedRay,
    scope: HitSpace,
    best: &mut ClosestHit,
    stack: &mut [u64],
    mut others: impl FnMut(&[u32], &mut ClosestHit, &mut [u64]) -> TraversalCost,
) -> TraversalCost {
    let mut cost = TraversalCost::default();
    if tree.root == NodeRef::NONE {
        return cost;
    }
    let sight = SlabRay::<L>::new(probe, tree.extent);
    let per_scale = scope.per_scale();
    let mut limit = best.t * per_scale;
    let mut held = 0;
    let mut child = tree.root;
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
                cost += others(list, best, &mut stack[held..]);
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
    let mut left = hits;
    let mut take = || {
        let i = left.trailing_zeros() as usize & (LANES - 1);
        left &= left - 1;
        let child = node.children[i];
        prefetch_child(tree, child);
        (left != 0, entry(near[i], child.bits()))
    };
    let (more, first) = take();
    if !more {
        return NodeRef::of_bits(first as u32);
    }
    let (more, second) = take();
    let (mut nearest, farther) = if first <= second { (first, second) } else { (second, first) };
    let base = *held;
    stack[base] = farther;
    let mut end = base + 1;
    if more {
        loop {
            let (more, next) = take();
            let mut at = end;
            let pushed = if next < nearest { std::mem::replace(&mut nearest, next) } else { next };
            if !ANY {
                while at > base && stack[at - 1] < pushed {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
            }
            stack[at] = pushed;
            end += 1;
            if !more {
                break;
            }
        }
    }
    *held = end;
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
