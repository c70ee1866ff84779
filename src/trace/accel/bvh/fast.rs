//! A tree that is built fast: leaves and the lowest nodes are cut from a curve that fills space, and only what is above
//! them is chosen by surface area among boxes in space, of which there are far fewer than primitives.
//!
//! Clusters by a curve under a hierarchy by surface area are those of HLBVH (Pantaleoni and Luebke 2010; Garanzha,
//! Pantaleoni and McAllister 2011). Where the curve is cut is not left to the bits of its codes: each cut is the
//! cheapest by the same costs as a split in space, and what it leaves becomes a node only where that wastes no surface.

use rayon::prelude::*;

use super::build::build_tree;
use super::collapse::LeafBuilder;
use super::morton;
use super::prim_ref::{Extent, PrimRange, PrimRef, refs};
use super::split::cost;
use super::tree::{Tree, WideNode, renumbered};
use crate::trace::accel::HiddenPrimitives;
use crate::trace::accel::leaves::{BuildInput, Leaves, NodeKind, NodeRef};
use crate::trace::simd::LANES;

/// References between two cuts that are made wherever they fall.
const STRETCH: usize = 256;

/// A node of its own may have this much more surface than its parts together: with more, it is better left to the
/// hierarchy above what goes with what.
const WASTE: f32 = 1.1;

/// The tree over the first `count` primitives of a source that are not hidden, the same on any number of threads.
pub fn fast<S: BuildInput>(source: &S, count: u32, hidden: &HiddenPrimitives) -> Tree {
    let mut refs = refs(source, count, hidden);
    let centroids = PrimRange::of_many(&mut refs).centroids;
    let order = morton::order(&refs, centroids);
    let cuts: Vec<CurveCuts> = order.par_chunks(STRETCH).map(|stretch| CurveCuts::of(&refs, stretch)).collect();
    // What is hidden has no reference, so that those of the others are not numbered as they are.
    let order = match hidden.is_empty() {
        true => order,
        false => order.iter().map(|at| refs[*at as usize].number()).collect(),
    };
    drop(refs);
    let (mut boxes, mut runs) = (Vec::new(), Vec::new());
    let mut end = 0;
    for CurveCuts { tops, counts, .. } in &cuts {
        // To the tree above, each is one of those that have a leaf of their own.
        boxes.extend(
            tops.iter().zip(boxes.len() as u32..).map(|((around, _), i)| PrimRef::new(*around, i, NodeKind::List)),
        );
        for count in counts {
            runs.push(end..end + count);
            end += count;
        }
    }
    let leaf = |refs: &[PrimRef], _: &mut Leaves| NodeRef::new(NodeKind::List, 1, refs[0].number() as usize);
    let mut tree = build_tree(&mut boxes, &LeafBuilder { block: 1, leaf });
    // Of each kind, how many there are before those of a stretch.
    let above = tree.nodes.len();
    let mut before = [0; 6];
    before[NodeKind::Node as usize] = above;
    let mut children = Vec::with_capacity(boxes.len());
    tree.nodes.reserve_exact(cuts.iter().map(|cuts| cuts.nodes.len()).sum());
    for CurveCuts { tops, nodes, blocks, .. } in cuts {
        children.extend(tops.into_iter().map(|(_, child)| renumbered(child, &before)));
        tree.nodes.extend(nodes.into_iter().map(|mut node| {
            node.children = node.children.map(|child| renumbered(child, &before));
            node
        }));
        before.iter_mut().zip(blocks).for_each(|(sum, count)| *sum += count);
    }
    tree.root = real(tree.root, &children);
    tree.nodes[..above].iter_mut().for_each(|node| node.children = node.children.map(|child| real(child, &children)));
    tree.leaves = Leaves::of(source, &order, &runs);
    tree.stack += LANES - 1;
    tree.fresh = tree.estimate();
    tree.is_fast = true;
    tree
}

/// What stands where a tree holds the number of it.
fn real(child: NodeRef, children: &[NodeRef]) -> NodeRef {
    if child == NodeRef::NONE || child.held() == NodeKind::Node { child } else { children[child.index()] }
}

/// What a stretch of the curve was cut into; indices count from its beginning.
#[derive(Default)]
struct CurveCuts {
    /// How many references each block takes, in the order of the curve.
    counts: Vec<usize>,
    nodes: Vec<WideNode>,
    /// What has no node yet.
    tops: Vec<(Extent, NodeRef)>,
    /// How many nodes and blocks there are of each kind.
    blocks: [usize; 6],
}

impl CurveCuts {
    fn of(refs: &[PrimRef], stretch: &[u32]) -> Self {
        let stretch: Vec<PrimRef> = stretch.iter().map(|n| refs[*n as usize]).collect();
        let mut above = vec![0.0; stretch.len()];
        let mut cuts = CurveCuts::default();
        for run in stretch.chunk_by(|a, b| a.held() == b.held()) {
            let (open, _) = cuts.cut(run, &mut above);
            cuts.close(open, cuts.tops.len());
        }
        cuts
    }

    /// Cuts a run of one kind in two, again and again, until all parts are blocks. They are the last of `tops`: gives
    /// how many there are if they may go into a node together, or 0, and the box around the run. `above` is room to
    /// work in.
    fn cut(&mut self, run: &[PrimRef], above: &mut [f32]) -> (usize, Extent) {
        let held = NodeKind::of_bits(run[0].held());
        let most = if held == NodeKind::List { 1 } else { LANES };
        if run.len() <= most {
            let around = run.iter().fold(Extent::EMPTY, |all, r| all.union(r.extent()));
            let index = &mut self.blocks[held as usize];
            self.tops.push((around, NodeRef::new(held, run.len(), *index)));
            self.counts.push(run.len());
            *index += 1;
            return (1, around);
        }
        let (a, b) = run.split_at(cheapest(run, most, above));
        let (first, left) = self.cut(a, above);
        let between = self.tops.len();
        let (second, right) = self.cut(b, above);
        let all = left.union(right);
        let wasteful = all.half_area() > WASTE * (left.half_area() + right.half_area());
        if first > 0 && second > 0 && first + second <= LANES && !wasteful {
            return (first + second, all);
        }
        // The second first: they are the last.
        self.close(second, self.tops.len());
        self.close(first, between);
        (0, all)
    }

    /// Puts so many before a place among the tops into a node.
    fn close(&mut self, count: usize, end: usize) {
        if count < 2 {
            return;
        }
        let mut node = WideNode::EMPTY;
        let mut all = Extent::EMPTY;
        for (slot, (around, child)) in self.tops[end - count..end].iter().enumerate() {
            node.put(slot, *around, *child);
            all = all.union(*around);
        }
        self.tops.splice(end - count..end, [(all, NodeRef::new(NodeKind::Node, 1, self.nodes.len()))]);
        self.nodes.push(node);
        self.blocks[NodeKind::Node as usize] += 1;
    }
}

/// Where to cut a run that goes into leaves of `most`.
fn cheapest(run: &[PrimRef], most: usize, above: &mut [f32]) -> usize {
    let mut around = Extent::EMPTY;
    for i in (1..run.len()).rev() {
        around.add(run[i].low, run[i].high);
        above[i] = cost(&around, run.len() - i, most);
    }
    let mut around = Extent::EMPTY;
    let (mut best, mut at) = (f32::INFINITY, run.len() / 2);
    for i in 1..run.len() {
        around.add(run[i - 1].low, run[i - 1].high);
        let total = cost(&around, i, most) + above[i];
        if total < best {
            (best, at) = (total, i);
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::trace::accel::bvh::build;
    use crate::trace::primitive::{Geometry, Tag};

    fn balls(count: u32, place: impl Fn(u32) -> (Vec3, f32)) -> Geometry {
        let mut geometry = Geometry::default();
        (0..count).map(place).for_each(|(at, radius)| geometry.push_sphere(Tag::default(), at, radius));
        geometry.finish();
        geometry
    }

    fn scattered(n: u32) -> Vec3 {
        let part = |prime: u32| (n.wrapping_mul(prime) >> 8) as f32 / 16_777_216.0;
        Vec3::new(part(2_654_435_761), part(2_246_822_519), part(3_266_489_917))
    }

    /// Every number once in the leaves, and everything below a node within its box.
    fn assert_sound(tree: &Tree, geometry: &Geometry) {
        let mut seen = vec![0; geometry.len()];
        let mut open = vec![(tree.root, tree.bounds)];
        while let Some((child, around)) = open.pop() {
            if child.held() == NodeKind::Node {
                let node = &tree.nodes[child.index()];
                let children = (0..LANES).filter(|slot| node.children[*slot] != NodeRef::NONE);
                open.extend(children.map(|slot| (node.children[slot], node.bounds_at(slot))));
            } else {
                let numbers = &tree.leaves.spheres[child.index()].numbers[..child.count() as usize];
                numbers.iter().for_each(|n| seen[*n as usize] += 1);
                let inside = tree.leaves.bounds(geometry, child);
                assert!(inside.min.cmpge(around.min).all() && inside.max.cmple(around.max).all());
            }
        }
        assert!(seen.iter().all(|times| *times == 1));
    }

    #[test]
    fn the_tree_is_whole_and_the_same_on_any_number_of_threads() {
        // Enough that all threads sort.
        let geometry = balls(20_000, |n| (scattered(n), 0.001 + 0.01 * scattered(n + 1).x));
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| fast(&geometry, geometry.finite(), &HiddenPrimitives::NONE))
        };
        let (one, three) = (on(1), on(3));
        assert_sound(&one, &geometry);
        assert_eq!(format!("{one:?}"), format!("{three:?}"));
    }

    #[test]
    fn what_has_one_middle_is_shared_out_evenly() {
        for radius in [|_| 1.0, |n| 1.0 + n as f32] {
            let geometry = balls(5000, |n| (Vec3::ONE, radius(n)));
            let tree = fast(&geometry, geometry.finite(), &HiddenPrimitives::NONE);
            assert_sound(&tree, &geometry);
            assert!(tree.leaves.spheres.len() < 1400, "{} leaves", tree.leaves.spheres.len());
            assert!(tree.stack < 200, "{} entries", tree.stack);
        }
    }

    #[test]
    fn a_crowd_in_one_cell_of_the_curve_gets_a_good_tree_too() {
        let geometry = balls(4000, |n| match n {
            0 => (Vec3::splat(1e6), 1.0),
            _ => (scattered(n), 0.01),
        });
        let [fast, full] =
            [fast, build::full].map(|build| build(&geometry, geometry.finite(), &HiddenPrimitives::NONE));
        assert_sound(&fast, &geometry);
        let [fast, full] = [fast, full].map(|tree| {
            let crowded = tree.nodes.iter().flat_map(|node| (0..LANES).map(|slot| node.bounds_at(slot)));
            let crowded = crowded.filter(|bounds| !bounds.is_empty() && bounds.max.x < 2.0);
            crowded.map(|bounds| bounds.size().length_squared()).sum::<f32>()
        });
        assert!(fast < 1.4 * full, "{fast} against {full}");
    }
}
