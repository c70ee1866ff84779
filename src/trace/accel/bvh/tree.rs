//! Nodes of eight children, and a tree of them with its leaves.

use super::prim_ref::Extent;
use crate::trace::accel::leaves::{Leaves, NodeRef};
use crate::trace::primitive::Bounds;
use crate::trace::simd::LANES;

/// Boxes of eight children; those of missing ones are inside out.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct WideNode {
    /// By axis, side (least, greatest) and child.
    pub(super) bounds: [[[f32; LANES]; 2]; 3],
    pub(super) children: [NodeRef; LANES],
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
    };

    #[inline]
    pub fn put(&mut self, slot: usize, around: Extent, child: NodeRef) {
        for axis in 0..3 {
            self.bounds[axis][0][slot] = around.low[axis];
            self.bounds[axis][1][slot] = around.high[axis];
        }
        self.children[slot] = child;
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
