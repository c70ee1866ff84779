//! Fitting the boxes of a tree to primitives that have moved (van den Bergen 1997), as long as that leaves a tree that
//! is nearly as good as a new one.

use glam::Vec3;

use super::tree::{Tree, WideNode};
use crate::trace::accel::leaves::{BuildInput, NodeKind, NodeRef};
use crate::trace::primitive::Bounds;
use crate::trace::simd::LANES;

/// How much more than the tree cost when it was built it may cost.
const WORST: f32 = 1.25;

/// Of a leaf that is met, in nodes.
const LEAF: f32 = 1.5;

impl Tree {
    /// The tree with its boxes around what the same numbers stand for now; `None` if a new one is worth building.
    ///
    /// Numbers must stand for the same kinds as when the tree was built.
    pub fn refit<S: BuildInput>(&self, source: &S) -> Option<Tree> {
        let mut tree = self.clone();
        tree.leaves.renew(source);
        let root = tree.fit(source);
        tree.set_bounds(root);
        let good = tree.estimate() <= WORST * self.fresh;
        good.then_some(tree)
    }

    /// Fits all boxes; gives the one around everything.
    fn fit<S: BuildInput>(&mut self, source: &S) -> Bounds {
        // Children stand behind their parents.
        for at in (0..self.nodes.len()).rev() {
            for slot in 0..LANES {
                let child = self.nodes[at].children[slot];
                if child != NodeRef::NONE {
                    let bounds = self.bounds_of(source, child);
                    self.nodes[at].set(slot, bounds);
                }
            }
        }
        if self.root == NodeRef::NONE { Bounds::default() } else { self.bounds_of(source, self.root) }
    }

    fn bounds_of<S: BuildInput>(&self, source: &S, child: NodeRef) -> Bounds {
        match child.held() {
            NodeKind::Node => self.nodes[child.index()].bounds(),
            _ => self.leaves.bounds(source, child),
        }
    }

    /// What a ray that meets the tree is expected to cost, in nodes: the surface area heuristic.
    pub fn estimate(&self) -> f32 {
        let cost = |node: &WideNode| -> f64 {
            let children = node.children.iter().enumerate().filter(|(_, child)| **child != NodeRef::NONE);
            let each = |(slot, child): (usize, &NodeRef)| {
                let weight = if child.held() == NodeKind::Node { 1.0 } else { LEAF };
                f64::from(half_area(node.bounds_at(slot)) * weight)
            };
            children.map(each).sum()
        };
        (self.nodes.iter().map(cost).sum::<f64>() / f64::from(half_area(self.bounds))) as f32
    }
}

fn half_area(bounds: Bounds) -> f32 {
    let s = bounds.size();
    s.x * s.y + s.y * s.z + s.z * s.x
}

impl WideNode {
    pub fn bounds_at(&self, slot: usize) -> Bounds {
        let side = |side: usize| std::array::from_fn(|axis| self.bounds[axis][side][slot]);
        Bounds { min: Vec3::from_array(side(0)), max: Vec3::from_array(side(1)) }
    }

    fn bounds(&self) -> Bounds {
        // Those of missing children are inside out.
        (0..LANES).fold(Bounds::default(), |all, slot| all.union(self.bounds_at(slot)))
    }
}
