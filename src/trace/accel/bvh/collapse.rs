//! From two children a node to eight, so that the boxes of all nodes together have the least surface (Ylitie, Karras
//! and Laine, HPG 2017, section 3; Wald, Benthin and Boulos 2008): what a ray that meets the tree visits of it.
//!
//! Leaves are those of the binary tree. Of every range it is found what it costs as one child, and as two to eight of
//! them, from the leaves up; nodes are then made of the cheapest ways.

use super::prim_ref::{Extent, PrimRange, PrimRef};
use super::split::{SahBins, split};
use super::tree::{Tree, WideNode};
use crate::trace::accel::leaves::{Leaves, NodeKind, NodeRef};
use crate::trace::simd::LANES;

/// What a tree grows down to.
pub struct LeafBuilder<F> {
    /// How many references of one kind a leaf takes.
    pub block: usize,
    /// Makes a leaf of them.
    pub leaf: F,
}

/// A range of the binary tree.
struct BinaryNode<'a> {
    around: Extent,
    /// Of a leaf.
    refs: &'a [PrimRef],
    /// Of what is split: the halves.
    halves: [usize; 2],
    /// What it costs in up to so many children, from one on.
    costs: [f32; LANES],
    /// For each number from two on: how many of so many children the first half gets, or 0 where fewer are as good.
    shares: [u8; LANES],
    /// Into how many children its own node divides it, and how many of them the first half gets.
    own: [u8; 2],
}

/// How many levels of the binary tree count as one where it is asked whether a tree gets too deep.
const LEVELS: usize = 4;

/// Adds a range to the tree: the child that it becomes, and how many nodes deep it is.
pub fn build_collapsed<F>(
    builder: &LeafBuilder<F>,
    range: PrimRange,
    tree: &mut Tree,
    bins: &mut SahBins,
    depth: usize,
) -> (NodeRef, usize)
where
    F: Fn(&[PrimRef], &mut Leaves) -> NodeRef,
{
    let mut nodes = Vec::new();
    let root = divide(range, builder.block, &mut nodes, bins, LEVELS * depth);
    put(builder, &nodes, root, tree)
}

/// Divides a range down to its leaves; gives its place among the nodes.
fn divide<'a>(
    range: PrimRange<'a>,
    block: usize,
    nodes: &mut Vec<BinaryNode<'a>>,
    bins: &mut SahBins,
    level: usize,
) -> usize {
    let around = range.bounds;
    let mut node =
        BinaryNode { around, refs: &[], halves: [0; 2], costs: [0.0; LANES], shares: [0; LANES], own: [0; 2] };
    if range.is_leaf(block) {
        // What leaves cost is the same in every tree.
        node.refs = range.into_refs();
    } else {
        node.halves = split(range, block, bins, level / LEVELS).map(|half| divide(half, block, nodes, bins, level + 1));
        let [first, second] = node.halves;
        weigh(&mut node, &nodes[first].costs, &nodes[second].costs);
    }
    nodes.push(node);
    nodes.len() - 1
}

/// Finds what a range costs, given what its halves do.
fn weigh(node: &mut BinaryNode, first: &[f32; LANES], second: &[f32; LANES]) {
    let (mut best, mut divided) = (f32::INFINITY, [(f32::INFINITY, 0); LANES]);
    for count in 2..=LANES {
        for share in 1..count {
            let cost = first[share - 1] + second[count - share - 1];
            if cost < divided[count - 1].0 {
                divided[count - 1] = (cost, share as u8);
            }
        }
        if divided[count - 1].0 < best {
            best = divided[count - 1].0;
            node.own = [count as u8, divided[count - 1].1];
        }
    }
    node.costs[0] = node.around.half_area() + best;
    for (count, (cost, share)) in divided.into_iter().enumerate().skip(1) {
        let cheaper = cost < node.costs[count - 1];
        node.costs[count] = if cheaper { cost } else { node.costs[count - 1] };
        node.shares[count] = if cheaper { share } else { 0 };
    }
}

/// The nodes that a range becomes as up to so many children.
fn gather(nodes: &[BinaryNode], at: usize, mut count: usize, children: &mut Vec<usize>) {
    while count > 1 && nodes[at].shares[count - 1] == 0 {
        count -= 1;
    }
    if count == 1 {
        children.push(at);
        return;
    }
    let (share, [first, second]) = (usize::from(nodes[at].shares[count - 1]), nodes[at].halves);
    gather(nodes, first, share, children);
    gather(nodes, second, count - share, children);
}

fn put<F>(builder: &LeafBuilder<F>, nodes: &[BinaryNode], at: usize, tree: &mut Tree) -> (NodeRef, usize)
where
    F: Fn(&[PrimRef], &mut Leaves) -> NodeRef,
{
    let node = &nodes[at];
    if !node.refs.is_empty() {
        return ((builder.leaf)(node.refs, &mut tree.leaves), 0);
    }
    let ([count, share], [first, second]) = (node.own.map(usize::from), node.halves);
    let mut children = Vec::with_capacity(LANES);
    gather(nodes, first, share, &mut children);
    gather(nodes, second, count - share, &mut children);
    let index = tree.nodes.len();
    let mut node = WideNode::EMPTY;
    for (i, child) in children.iter().enumerate() {
        node.put(i, nodes[*child].around, NodeRef::NONE);
    }
    tree.nodes.push(node);
    let mut deepest = 0;
    for (i, child) in children.into_iter().enumerate() {
        let (child, below) = put(builder, nodes, child, tree);
        tree.nodes[index].children[i] = child;
        deepest = deepest.max(below);
    }
    (NodeRef::new(NodeKind::Node, 1, index), deepest + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(halves: [usize; 2], surface: f32, nodes: &[BinaryNode<'_>]) -> BinaryNode<'static> {
        // A box of this half surface: one by this by nothing.
        let high = glam::Vec4::new(1.0, surface, 0.0, 0.0);
        let around = Extent { low: glam::Vec4::ZERO, high };
        let mut node = BinaryNode { around, refs: &[], halves, costs: [0.0; LANES], shares: [0; LANES], own: [0; 2] };
        if halves != [0; 2] {
            weigh(&mut node, &nodes[halves[0]].costs, &nodes[halves[1]].costs);
        }
        node
    }

    /// Thirteen leaves in a row of twos fit into two nodes: the small one at the end is as small as can be.
    #[test]
    fn nodes_are_full_and_small() {
        let mut nodes = vec![node([0; 2], 0.0, &[])];
        for size in 1..13 {
            nodes.push(node([0; 2], 0.0, &[]));
            let (last, leaf) = (nodes.len() - 2, nodes.len() - 1);
            let next = node([last, leaf], size as f32, &nodes);
            nodes.push(next);
        }
        let root = nodes.len() - 1;
        // The root, and the node of six leaves in it: a range of n leaves has a surface of n - 1.
        assert_eq!(nodes[root].costs[0], 12.0 + 5.0);
        let [count, share] = nodes[root].own.map(usize::from);
        let mut children = Vec::new();
        gather(&nodes, nodes[root].halves[0], share, &mut children);
        gather(&nodes, nodes[root].halves[1], count - share, &mut children);
        assert_eq!(children.len(), 8);
        let inner: Vec<_> = children.iter().filter(|child| nodes[**child].halves != [0; 2]).collect();
        assert_eq!(inner.len(), 1);
        assert_eq!(nodes[*inner[0]].around.half_area(), 5.0);
    }
}
