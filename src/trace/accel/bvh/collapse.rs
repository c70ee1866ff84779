//! From two children a node to eight, so that the boxes of all nodes together have the least surface (Ylitie, Karras and
//! Laine, HPG 2017, section 3; Wald, Benthin and Boulos 2008): what a ray that meets the tree visits of it.
//!
//! Leaves are those of the tree of twos. Of every range it is found what it costs as one child, and as two to eight of
//! them, from the leaves up; nodes are then made of the cheapest ways.

use super::build::{Bins, Extent, Ground, Range, Ref, split};
use super::{Child, Held, LANES, Leaves, Node, Tree};

/// A range of the tree of twos.
struct Twig<'a> {
    around: Extent,
    /// Of a leaf.
    refs: &'a [Ref],
    /// Of what is split: the halves.
    halves: [usize; 2],
    /// What it costs in up to so many children, from one on.
    costs: [f32; LANES],
    /// For each number from two on: how many of so many children the first half gets, or 0 where fewer are as good.
    shares: [u8; LANES],
    /// Into how many children its own node divides it, and how many of them the first half gets.
    own: [u8; 2],
}

/// How many levels of the tree of twos count as one where it is asked whether a tree gets too deep.
const LEVELS: usize = 4;

/// Adds a range to the tree: the child that it becomes, and how many nodes deep it is.
pub fn grow<F>(ground: &Ground<F>, range: Range, tree: &mut Tree, bins: &mut Bins, depth: usize) -> (Child, usize)
where
    F: Fn(&[Ref], &mut Leaves) -> Child,
{
    let mut twigs = Vec::new();
    let root = divide(range, ground.block, &mut twigs, bins, LEVELS * depth);
    put(ground, &twigs, root, tree)
}

/// Divides a range down to its leaves; gives its place among the twigs.
fn divide<'a>(range: Range<'a>, block: usize, twigs: &mut Vec<Twig<'a>>, bins: &mut Bins, level: usize) -> usize {
    let around = range.bounds;
    let mut twig = Twig { around, refs: &[], halves: [0; 2], costs: [0.0; LANES], shares: [0; LANES], own: [0; 2] };
    if range.is_leaf(block) {
        // What leaves cost is the same in every tree.
        twig.refs = range.into_refs();
    } else {
        twig.halves = split(range, block, bins, level / LEVELS).map(|half| divide(half, block, twigs, bins, level + 1));
        let [first, second] = twig.halves;
        weigh(&mut twig, &twigs[first].costs, &twigs[second].costs);
    }
    twigs.push(twig);
    twigs.len() - 1
}

/// Finds what a range costs, given what its halves do.
fn weigh(twig: &mut Twig, first: &[f32; LANES], second: &[f32; LANES]) {
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
            twig.own = [count as u8, divided[count - 1].1];
        }
    }
    twig.costs[0] = twig.around.half_area() + best;
    for (count, (cost, share)) in divided.into_iter().enumerate().skip(1) {
        let cheaper = cost < twig.costs[count - 1];
        twig.costs[count] = if cheaper { cost } else { twig.costs[count - 1] };
        twig.shares[count] = if cheaper { share } else { 0 };
    }
}

/// The twigs that a range becomes as up to so many children.
fn gather(twigs: &[Twig], at: usize, mut count: usize, children: &mut Vec<usize>) {
    while count > 1 && twigs[at].shares[count - 1] == 0 {
        count -= 1;
    }
    if count == 1 {
        children.push(at);
        return;
    }
    let (share, [first, second]) = (usize::from(twigs[at].shares[count - 1]), twigs[at].halves);
    gather(twigs, first, share, children);
    gather(twigs, second, count - share, children);
}

fn put<F>(ground: &Ground<F>, twigs: &[Twig], at: usize, tree: &mut Tree) -> (Child, usize)
where
    F: Fn(&[Ref], &mut Leaves) -> Child,
{
    let twig = &twigs[at];
    if !twig.refs.is_empty() {
        return ((ground.leaf)(twig.refs, &mut tree.leaves), 0);
    }
    let ([count, share], [first, second]) = (twig.own.map(usize::from), twig.halves);
    let mut children = Vec::with_capacity(LANES);
    gather(twigs, first, share, &mut children);
    gather(twigs, second, count - share, &mut children);
    let index = tree.nodes.len();
    let mut node = Node::EMPTY;
    for (i, child) in children.iter().enumerate() {
        node.put(i, twigs[*child].around, Child::NONE);
    }
    tree.nodes.push(node);
    let mut deepest = 0;
    for (i, child) in children.into_iter().enumerate() {
        let (child, below) = put(ground, twigs, child, tree);
        tree.nodes[index].children[i] = child;
        deepest = deepest.max(below);
    }
    (Child::new(Held::Node, 1, index), deepest + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn twig(halves: [usize; 2], surface: f32, twigs: &[Twig<'_>]) -> Twig<'static> {
        // A box of this half surface: one by this by nothing.
        let high = glam::Vec4::new(1.0, surface, 0.0, 0.0);
        let around = Extent { low: glam::Vec4::ZERO, high };
        let mut twig = Twig { around, refs: &[], halves, costs: [0.0; LANES], shares: [0; LANES], own: [0; 2] };
        if halves != [0; 2] {
            weigh(&mut twig, &twigs[halves[0]].costs, &twigs[halves[1]].costs);
        }
        twig
    }

    /// Thirteen leaves in a row of twos fit into two nodes: the small one at the end is as small as can be.
    #[test]
    fn nodes_are_full_and_small() {
        let mut twigs = vec![twig([0; 2], 0.0, &[])];
        for size in 1..13 {
            twigs.push(twig([0; 2], 0.0, &[]));
            let (last, leaf) = (twigs.len() - 2, twigs.len() - 1);
            let next = twig([last, leaf], size as f32, &twigs);
            twigs.push(next);
        }
        let root = twigs.len() - 1;
        // The root, and the node of six leaves in it: a range of n leaves has a surface of n - 1.
        assert_eq!(twigs[root].costs[0], 12.0 + 5.0);
        let [count, share] = twigs[root].own.map(usize::from);
        let mut children = Vec::new();
        gather(&twigs, twigs[root].halves[0], share, &mut children);
        gather(&twigs, twigs[root].halves[1], count - share, &mut children);
        assert_eq!(children.len(), 8);
        let nodes: Vec<_> = children.iter().filter(|child| twigs[**child].halves != [0; 2]).collect();
        assert_eq!(nodes.len(), 1);
        assert_eq!(twigs[*nodes[0]].around.half_area(), 5.0);
    }
}
