//! Building a tree: surface area heuristic over bins, top down (Wald 2007), the same tree on any number of threads.
//!
//! Ranges of references are split in two down to leaves, of which nodes of eight children are made ([`collapse`]).
//! Above what one thread builds, ranges are split until a node has eight children, the one with the largest surface
//! first, so that what a wide node skips is the least likely to be met. Costs count leaves in blocks of eight, which
//! fills them.

use rayon::prelude::*;

use super::collapse;
use super::collapse::LeafBuilder;
use super::prim_ref::{FORK, PrimRange, PrimRef, refs};
use super::split::{SahBins, split};
use super::tree::{Tree, WideNode};
use crate::trace::accel::HiddenPrimitives;
use crate::trace::accel::leaves::{BuildInput, Leaves, NodeKind, NodeRef};
use crate::trace::primitive::Bounds;
use crate::trace::simd::LANES;

/// Full quality: a block of a leaf is chosen as every split is.
pub fn full<S: BuildInput>(source: &S, count: u32, hidden: &HiddenPrimitives) -> Tree {
    let mut refs = refs(source, count, hidden);
    let leaf = |refs: &[PrimRef], leaves: &mut Leaves| {
        let mut numbers = [0; LANES];
        refs.iter().zip(&mut numbers).for_each(|(r, n)| *n = r.number());
        leaves.put(source, &numbers[..refs.len()])
    };
    let mut tree = build_tree(&mut refs, &LeafBuilder { block: LANES, leaf });
    tree.fresh = tree.estimate();
    tree
}

/// The tree over references.
pub fn build_tree<F: Fn(&[PrimRef], &mut Leaves) -> NodeRef + Sync>(
    refs: &mut [PrimRef],
    builder: &LeafBuilder<F>,
) -> Tree {
    let empty = refs.is_empty();
    let range = PrimRange::of_many(refs);
    let mut tree = Tree::empty(Bounds { min: range.bounds.low.truncate(), max: range.bounds.high.truncate() });
    if !empty {
        let depth;
        (tree.root, depth) = build_range(builder, range, &mut tree, &mut SahBins::new(), 0);
        tree.stack = (LANES - 1) * depth + 1;
    }
    tree
}

/// Adds a range to the tree: the child that it becomes, and how many nodes deep it is.
fn build_range<F>(
    builder: &LeafBuilder<F>,
    range: PrimRange,
    tree: &mut Tree,
    bins: &mut SahBins,
    depth: usize,
) -> (NodeRef, usize)
where
    F: Fn(&[PrimRef], &mut Leaves) -> NodeRef + Sync,
{
    let block = builder.block;
    if range.is_leaf(block) {
        return ((builder.leaf)(range.refs, &mut tree.leaves), 0);
    }
    if range.refs.len() <= FORK {
        return collapse::build_collapsed(builder, range, tree, bins, depth);
    }
    let mut ranges = Vec::with_capacity(LANES);
    ranges.push(range);
    while ranges.len() < LANES {
        let open = ranges.iter().enumerate().filter(|(_, r)| !r.is_leaf(block));
        let Some((widest, _)) = open.max_by(|a, b| a.1.bounds.half_area().total_cmp(&b.1.bounds.half_area())) else {
            break;
        };
        let [a, b] = split(ranges.swap_remove(widest), block, bins, depth);
        ranges.extend([a, b]);
    }
    let at = tree.nodes.len();
    let mut node = WideNode::EMPTY;
    ranges.iter().enumerate().for_each(|(i, range)| node.put(i, range.bounds, NodeRef::NONE));
    tree.nodes.push(node);
    let grown: Vec<_> = ranges
        .into_par_iter()
        .map(|range| {
            let mut branch = Tree::empty(tree.bounds);
            let child = build_range(builder, range, &mut branch, &mut SahBins::new(), depth + 1);
            (branch, child)
        })
        .collect();
    tree.reserve(&grown.iter().map(|(branch, _)| branch).collect::<Vec<_>>());
    let mut deepest = 0;
    for (i, (branch, (child, below))) in grown.into_iter().enumerate() {
        tree.nodes[at].children[i] = tree.append(branch, child);
        deepest = deepest.max(below);
    }
    (NodeRef::new(NodeKind::Node, 1, at), deepest + 1)
}
