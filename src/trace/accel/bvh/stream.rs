//! Walking a tree with streams of rays (after Barringer and Akenine-Moeller 2014, and Fuetterling, Lojewski, Pfreundt
//! and Ebert 2015): rays of one octant that share nothing else.
//!
//! What is still to be visited says by one bit a ray who is to visit it. At a node every ray that is there tests the
//! eight boxes; their answers are turned into one number a child. Children are visited in the order of the octant, so
//! that it is found when the tree is built, and rays have nothing to sort. Where two or fewer are left each goes on
//! alone.

use super::tree::WideNode;
use super::two_level::Bvh;
use super::walk::{SubtreeKernel, others};
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::leaves::{HitSpace, NodeKind, NodeRef, TraversalCost, block};
use crate::trace::accel::packet::{HitSink, RayBatch};
use crate::trace::accel::stream::{LooseRays, STREAM, StreamEntry, StreamRay};
use crate::trace::simd::{LANES, Wide, prefetch};

/// So many rays at a node, and fewer, go on alone.
const ALONE: u32 = 2;

/// Walks of all loose rays of a batch.
#[inline(always)]
pub fn each_stream<L: Wide, F: HitSink + ?Sized, const ANY: bool>(
    bvh: &Bvh,
    batch: RayBatch,
    loose: &LooseRays,
    scratch: &mut TraversalScratch,
    found: &mut F,
) {
    let ends = scratch.streams.deal::<L>(batch.rays, (batch.first, batch.count), loose);
    let mut start = 0;
    for (octant, end) in ends.into_iter().enumerate() {
        // Streams of about the same length.
        let streams = (end - start).div_ceil(STREAM);
        for left in (1..=streams).rev() {
            let to = start + (end - start).div_ceil(left);
            scratch.streams.load::<L>(batch.geometry, batch.rays, loose, start, to);
            walk::<L, ANY>(bvh, batch, octant, to - start, scratch);
            for ray in &scratch.streams.rays[..to - start] {
                found.one(ray.number as usize, ray.skip, &ray.best);
            }
            start = to;
        }
    }
}

/// Walks with the first `count` rays of the stream that is ready.
#[inline(always)]
fn walk<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    batch: RayBatch,
    octant: usize,
    count: usize,
    scratch: &mut TraversalScratch,
) {
    let tree = &bvh.world;
    if tree.root == NodeRef::NONE {
        return;
    }
    let TraversalScratch { counters, stack, streams, .. } = scratch;
    let Some(rays) = streams.rays.first_chunk_mut::<STREAM>() else { unreachable!("streams have room") };
    let waiting = &mut streams.stack[..];
    let mut cost = TraversalCost::default();
    // Rays that have not met anything, where that is all that is asked.
    let mut open = !0 >> (STREAM - count);
    waiting[0] = StreamEntry { rays: open, child: tree.root.bits() };
    let mut held = 1;
    while held > 0 {
        held -= 1;
        let StreamEntry { rays: here, child } = waiting[held];
        let (here, child) = (here & open, NodeRef::of_bits(child));
        let number = here.count_ones();
        if number == 0 {
            continue;
        }
        if child.held() == NodeKind::Node && number > ALONE {
            cost.steps += number;
            let node = &tree.nodes[child.index()];
            let met = intersect::<L>(node, octant, rays, here);
            let Some(room) = waiting[held..].first_chunk_mut() else { unreachable!("stacks have room for a node") };
            let pushed = push(node, octant, met, room);
            if bvh.is_large {
                for entry in &room[..pushed] {
                    prefetch_far(bvh, NodeRef::of_bits(entry.child));
                }
            }
            held += pushed;
            continue;
        }
        let mut left = here;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let StreamRay { prepared, best, .. } = &mut rays[i % STREAM];
            match child.held() {
                NodeKind::Node => {
                    let (geometry, from) = (batch.geometry, child);
                    let kernel = SubtreeKernel::<ANY> { bvh, geometry, from, probe: prepared, best, stack };
                    cost += bvh.width.run(kernel);
                }
                NodeKind::List => {
                    let list = &tree.leaves.lists[child.index()][..child.count() as usize];
                    cost += others::<ANY>(bvh, batch.geometry, list, prepared, best, stack);
                }
                _ => {
                    cost.tests += child.count();
                    block::<L>(&tree.leaves, child, prepared, HitSpace::WORLD, best);
                }
            }
            if ANY && best.found {
                open &= !(1 << i);
            }
        }
    }
    cost.count(counters);
}

/// By child, the rays that meet its box before their own limits.
#[inline(always)]
fn intersect<L: Wide>(node: &WideNode, octant: usize, rays: &[StreamRay; STREAM], here: u64) -> [u64; LANES] {
    let [bx, by, bz] = &node.bounds;
    let [x, y, z] = [octant & 1, octant >> 1 & 1, octant >> 2 & 1];
    let [near_x, near_y, near_z]: [L; 3] = [L::load(&bx[x]), L::load(&by[y]), L::load(&bz[z])];
    let [far_x, far_y, far_z]: [L; 3] = [L::load(&bx[1 - x]), L::load(&by[1 - y]), L::load(&bz[1 - z])];
    let mut met = [0u8; STREAM];
    let mut left = here;
    while left != 0 {
        let i = left.trailing_zeros() as usize % STREAM;
        left &= left - 1;
        let StreamRay { inverse, near, far, best, .. } = &rays[i];
        let [x, y, z] = [L::splat(inverse[0]), L::splat(inverse[1]), L::splat(inverse[2])];
        let near = near_x
            .scale_sub(x, L::splat(near[0]))
            .max(near_y.scale_sub(y, L::splat(near[1])))
            .max(near_z.scale_sub(z, L::splat(near[2])).max(L::splat(0.0)));
        let far = far_x
            .scale_sub(x, L::splat(far[0]))
            .min(far_y.scale_sub(y, L::splat(far[1])))
            .min(far_z.scale_sub(z, L::splat(far[2])).min(L::splat(best.t)));
        met[i] = L::bits(near.le(far)) as u8;
    }
    L::bit_planes(&met)
}

/// Puts down the children that any ray met, the nearest last; gives how many.
#[inline(always)]
fn push(node: &WideNode, octant: usize, met: [u64; LANES], room: &mut [StreamEntry; LANES]) -> usize {
    let mut order = node.far_to_near[octant % LANES];
    let mut pushed = 0;
    for _ in 0..LANES {
        let slot = order as usize % LANES;
        order >>= 3;
        // Written in any case, and kept if it counts: nothing to mispredict.
        room[pushed % LANES] = StreamEntry { rays: met[slot], child: node.children[slot].bits() };
        pushed += usize::from(met[slot] != 0);
    }
    pushed
}

/// Asks for a child of a large tree.
#[inline(always)]
fn prefetch_far(bvh: &Bvh, child: NodeRef) {
    let tree = &bvh.world;
    match child.held() {
        NodeKind::Node => {
            if let Some(node) = tree.nodes.get(child.index()) {
                prefetch(&node.bounds[0]);
                prefetch(&node.bounds[1]);
                prefetch(&node.bounds[2]);
                prefetch(&node.children);
            }
        }
        NodeKind::Triangles => {
            if let Some(block) = tree.leaves.triangles.get(child.index()) {
                prefetch(&block.corners[0]);
                prefetch(&block.corners[1]);
                prefetch(&block.corners[2]);
                prefetch(&block.numbers);
            }
        }
        NodeKind::Spheres | NodeKind::Boxes | NodeKind::Cones | NodeKind::List => {}
    }
}
