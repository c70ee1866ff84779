//! Nodes of eight children, and a tree of them with its leaves.

use rayon::prelude::*;

use super::prim_ref::Extent;
use crate::trace::accel::leaves::{Leaves, NodeRef};
use crate::trace::primitive::Bounds;
use crate::trace::simd::LANES;

/// Boxes of eight children; those of missing ones are inside out.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct WideNode {
    /// By axis, side (least, greatest) and child; each box with a margin by its own greatest coordinate (see
    /// [`Bounds::padded`]), so that what small things need does not depend on how far the whole tree reaches.
    pub(super) bounds: [[[f32; LANES]; 2]; 3],
    pub(super) children: [NodeRef; LANES],
    /// Children from the farthest to the nearest, three bits each, for rays of every octant: see
    /// [`Tree::order_children`].
    pub(super) far_to_near: [u32; LANES],
}

/// One tree and its leaves.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(super) root: NodeRef,
    pub(super) nodes: Vec<WideNode>,
    pub(super) leaves: Leaves,
    pub(super) bounds: Bounds,
    /// Greatest coordinate of anything in it.
    pub(super) extent: f32,
    /// Entries that the stack of a walk can come to hold.
    pub(super) stack: usize,
    /// [`Self::estimate`] when it was built.
    pub(super) fresh: f32,
    /// Built for few rays.
    pub(super) is_fast: bool,
}

impl Tree {
    /// Whether it was built for fewer rays than these.
    pub(super) fn is_outgrown(&self, rays: f64, primitives: u32) -> bool {
        self.is_fast && repays(rays, primitives)
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + self.leaves.bytes()
    }
}

/// How many rays a primitive repay a build at full quality.
///
/// Measured with the `rays` bench on one thread, with 874 k triangles: a full build takes 0.64 microseconds a primitive
/// and a fast one 0.37; a diffuse ray takes 0.32 in the full tree and about 0.04 more in the fast one, so that the two
/// are even at about 7 rays a primitive. It is full quality from somewhat fewer on: rays are expected with less
/// certainty than primitives, and other rays lose more.
const REPAY: f64 = 5.0;

/// Whether that many rays, all that are expected to go through a tree while it lasts, repay a build at full quality
/// over a fast one. A question of what is to be drawn, never of threads or of time that was measured.
pub fn repays(rays: f64, primitives: u32) -> bool {
    rays >= REPAY * f64::from(primitives)
}

impl WideNode {
    pub const EMPTY: WideNode = WideNode {
        bounds: [[[f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]]; 3],
        children: [NodeRef::NONE; LANES],
        far_to_near: [0; LANES],
    };

    #[inline]
    pub fn put(&mut self, slot: usize, around: Extent, child: NodeRef) {
        self.set(slot, Bounds { min: around.low.truncate(), max: around.high.truncate() });
        self.children[slot] = child;
    }

    /// Places the box of a child, with its margin.
    #[inline]
    pub fn set(&mut self, slot: usize, bounds: Bounds) {
        let Bounds { min, max } = bounds.padded();
        for axis in 0..3 {
            self.bounds[axis][0][slot] = min[axis];
            self.bounds[axis][1][slot] = max[axis];
        }
    }

    /// By where the middles of the boxes lie along the middle of each octant.
    fn order_children(&mut self) {
        // Octants that face each other see the same order from either end.
        for octant in 0..LANES / 2 {
            let mut keys = [0.0; LANES];
            for (axis, [low, high]) in self.bounds.iter().enumerate() {
                let sign = if octant >> axis & 1 == 1 { -1.0 } else { 1.0 };
                for (key, (low, high)) in keys.iter_mut().zip(low.iter().zip(high)) {
                    *key += sign * (low + high);
                }
            }
            let mut order: [usize; LANES] = std::array::from_fn(|i| i);
            for end in 1..LANES {
                let mut at = end;
                // Middles of missing children are no numbers, and wherever they stand is well.
                while at > 0 && keys[order[at - 1]] < keys[order[at]] {
                    order.swap(at - 1, at);
                    at -= 1;
                }
            }
            for (k, slot) in order.into_iter().enumerate() {
                self.far_to_near[octant] |= (slot as u32) << (3 * k);
                self.far_to_near[LANES - 1 - octant] |= (slot as u32) << (3 * (LANES - 1 - k));
            }
        }
    }
}

impl Tree {
    pub(super) fn empty(bounds: Bounds) -> Tree {
        let mut tree = Tree {
            root: NodeRef::NONE,
            nodes: Vec::new(),
            leaves: Leaves::default(),
            bounds,
            extent: 0.0,
            stack: 0,
            fresh: 0.0,
            is_fast: false,
        };
        tree.set_bounds(bounds);
        tree
    }

    /// Notes for every node in which order rays of each octant are to visit its children: octant i is that of
    /// directions which run down the axes that have a bit in i.
    pub(super) fn order_children(&mut self) {
        self.nodes.par_iter_mut().with_min_len(1024).for_each(|node| {
            node.far_to_near = [0; LANES];
            node.order_children();
        });
    }

    pub fn set_bounds(&mut self, bounds: Bounds) {
        self.bounds = bounds;
        self.extent = if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() };
    }

    /// Makes room for branches.
    pub(super) fn reserve(&mut self, branches: &[&Tree]) {
        self.nodes.reserve(branches.iter().map(|branch| branch.nodes.len()).sum());
        let add = |total: [usize; 5], branch: &&Tree| std::array::from_fn(|i| total[i] + branch.leaves.lens()[i]);
        self.leaves.reserve(branches.iter().fold([0; 5], add));
    }

    /// Takes over a branch; gives the child of it as it is numbered here.
    pub(super) fn append(&mut self, mut branch: Tree, child: NodeRef) -> NodeRef {
        let [triangles, spheres, boxes, cones, lists] = self.leaves.lens();
        let before = [self.nodes.len(), triangles, spheres, boxes, cones, lists];
        let moved = |child| renumbered(child, &before);
        for node in &mut branch.nodes {
            node.children = node.children.map(moved);
        }
        self.nodes.append(&mut branch.nodes);
        self.leaves.append(&mut branch.leaves);
        moved(child)
    }
}

/// A child whose index counted from what is behind so many nodes and blocks of each kind.
pub fn renumbered(child: NodeRef, before: &[usize; 6]) -> NodeRef {
    if child == NodeRef::NONE { child } else { child.moved(before[child.held() as usize]) }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn every_octant_visits_all_children_and_its_own_corner_first() {
        let mut node = WideNode::EMPTY;
        for slot in 0..LANES {
            // One child in each octant, and the last one missing.
            let corner = |axis: usize| if slot >> axis & 1 == 1 { -2.0 - axis as f32 } else { 2.0 + axis as f32 };
            let at = Vec3::new(corner(0), corner(1), corner(2));
            if slot < LANES - 1 {
                node.set(slot, Bounds { min: at - 0.5, max: at + 0.5 });
            }
        }
        let mut tree = Tree::empty(Bounds::default());
        tree.nodes.push(node);
        tree.order_children();
        for octant in 0..LANES {
            let order: Vec<u32> = (0..LANES).map(|k| tree.nodes[0].far_to_near[octant] >> (3 * k) & 7).collect();
            let mut all = order.clone();
            all.sort();
            assert_eq!(all, (0..8).collect::<Vec<u32>>());
            // Rays that run down the axes of an octant come from the opposite one.
            let (near, far) = (LANES - 1 - octant, octant);
            let place = |slot: usize| order.iter().position(|one| *one as usize == slot);
            if near != LANES - 1 && far != LANES - 1 {
                assert!(place(near) > place(far), "{octant}: {order:?}");
            }
        }
    }
}
