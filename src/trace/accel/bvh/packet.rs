//! Walking a tree with the rays of a packet.
//!
//! Nodes are tested once for all of them. At a leaf, eight rays at a time are tested against its box, and if any meets
//! it, against its primitives one after the other; of cones, whose tests are long, only those that the frustum meets.
//! (For spheres that costs more than it saves, for triangles about as much.)

use super::tree::{Tree, WideNode};
use super::two_level::Bvh;
use super::walk::{entry, others, prefetch_child};
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::leaves::{NodeKind, NodeRef, TraversalCost};
use crate::trace::accel::packet::{GROUPS, PacketFrustum, RayGroup, RayPacket};
use crate::trace::simd::{LANES, Wide, lanes};

/// Nodes that a packet visits before it is given up; a ray alone visits some three to five.
const PATIENCE: u32 = 28;

/// A packet goes on if as many rays meet cones, over all leaves that it looked into: in a cloud of small ones, a ray
/// alone visits twenty nodes, and what sixteen share of the tests is worth more than the nodes.
const PAYS: u32 = 2;

/// Nodes after which even such a packet is given up.
const LONGEST: u32 = 16 * PATIENCE;

/// False if the packet was given up.
#[inline(always)]
pub fn descend<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    packet: RayPacket,
    groups: &mut [RayGroup<L>; GROUPS],
    scratch: &mut TraversalScratch,
) -> bool {
    let tree = &bvh.world;
    if tree.root == NodeRef::NONE {
        return true;
    }
    let Some(sight) = PacketFrustum::new(groups, tree.bounds, tree.extent) else { return true };
    let TraversalScratch { counters, stack, .. } = scratch;
    let mut cost = TraversalCost::default();
    let mut limit = sight.limit(groups);
    let mut held = 0;
    // Leaves that were looked into, and rays that met those of cones.
    let (mut leaves, mut at_cones) = (0, 0);
    let (mut child, mut parent) = (tree.root, None::<(&WideNode, usize)>);
    loop {
        if child.held() == NodeKind::Node {
            if cost.steps >= PATIENCE && (at_cones < PAYS * leaves || cost.steps == LONGEST) {
                cost.count(counters);
                return false;
            }
            let node = &tree.nodes[child.index()];
            cost.steps += 1;
            let (front, hits) = sight.intersect(&node.bounds, limit);
            push(tree, child.index(), &front.store(), hits, stack, &mut held);
        } else {
            let mut met = 0;
            leaves += 1;
            let cones = child.held() == NodeKind::Cones;
            let mut which = (1 << child.count()) - 1;
            if cones {
                which &= sight.clip(tree.leaves.boxes_of::<L>(child).1, limit).1;
            }
            for (g, group) in groups.iter_mut().enumerate() {
                let some = parent.map_or(!0, |(node, slot)| sight.rays(g, &node.bounds, slot, group.t));
                let some = some & ((1 << LANES) - 1);
                met |= some;
                if some == 0 {
                    continue;
                }
                at_cones += if cones { some.count_ones() } else { 0 };
                cost.tests += which.count_ones() * some.count_ones();
                if child.held() != NodeKind::List {
                    group.block::<ANY>(&tree.leaves, child, which);
                    continue;
                }
                let list = &tree.leaves.lists[child.index()][..child.count() as usize];
                let mut bests = group.bests();
                for lane in lanes(some) {
                    let (Some(probe), best) = (packet.probe(g * LANES + lane), &mut bests[lane]) else { continue };
                    cost += others::<ANY>(bvh, packet.geometry, list, &probe, best, &mut stack[held..]);
                    if ANY && best.found {
                        best.t = f32::NEG_INFINITY;
                    }
                }
                group.set(&bests);
            }
            if met != 0 {
                limit = sight.limit(groups);
            }
        }
        loop {
            if held == 0 {
                cost.count(counters);
                return true;
            }
            held -= 1;
            let next = stack[held];
            if sight.depth((next >> 32) as u32) <= limit {
                let at = next as u32 as usize;
                let node = &tree.nodes[at / LANES];
                child = node.children[at % LANES];
                parent = Some((node, at % LANES));
                break;
            }
        }
    }
}

/// Puts the children that were met onto the stack, farthest first.
#[inline(always)]
fn push(tree: &Tree, node: usize, near: &[f32; LANES], hits: u32, stack: &mut [u64], held: &mut usize) {
    let base = *held;
    for i in lanes(hits) {
        let i = i & (LANES - 1);
        prefetch_child(tree, tree.nodes[node].children[i]);
        let pushed = entry(near[i], (node * LANES + i) as u32);
        let mut to = *held;
        while to > base && stack[to - 1] < pushed {
            stack[to] = stack[to - 1];
            to -= 1;
        }
        stack[to] = pushed;
        *held += 1;
    }
}
