//! Walking a tree with eight rays that go nearly the same way.
//!
//! Nodes are tested once for all of them, by bounds of their origins and directions (Reshetov, Soupikov and Hurley
//! 2005; Boulos, Wald and Shirley 2006); at a leaf each ray is tested against its box, and those that meet it are
//! tested as they would be alone. What a ray hits cannot differ: the bounds only ever open more boxes.

use super::walk::{Cost, MARGIN, Scope, entry, lanes, leaf, others};
use super::{Bvh, Child, Held, LANES, Node, Tree};
use crate::trace::Geometry;
use crate::trace::accel::Worker;
use crate::trace::geometry::Best;
use crate::trace::shapes::Probe;
#[cfg(target_arch = "x86_64")]
use crate::trace::simd::{Avx2, Sse2};
use crate::trace::simd::{Plain, V3, Wide, Width, prefetch};

/// How many rays go together.
pub const RAYS: usize = LANES;

/// Rays and their hits so far.
pub struct Packet {
    pub probes: [Probe; RAYS],
    pub bests: [Best; RAYS],
}

impl Packet {
    /// Whether all rays go into the same octant, so that they meet boxes from the same sides.
    pub fn coherent(&self) -> bool {
        let octant = |p: &Probe| p.inverse.is_negative_bitmask();
        self.probes.iter().all(|p| octant(p) == octant(&self.probes[0]))
    }
}

impl Bvh {
    /// As [`Bvh::walk`], for a coherent packet.
    pub fn walk_packet<const ANY: bool>(&self, geometry: &Geometry, packet: &mut Packet, worker: &mut Worker) {
        if worker.stack.len() < self.stack {
            worker.stack.resize(self.stack, 0);
        }
        match self.width {
            Width::Plain => walk::<Plain, ANY>(self, geometry, packet, worker),
            #[cfg(target_arch = "x86_64")]
            Width::Sse2 => walk::<Sse2, ANY>(self, geometry, packet, worker),
            // SAFETY: this width is only ever detected, never assumed.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            Width::Avx2 => unsafe { walk_avx2::<ANY>(self, geometry, packet, worker) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn walk_avx2<const ANY: bool>(bvh: &Bvh, geometry: &Geometry, packet: &mut Packet, worker: &mut Worker) {
    walk::<Avx2, ANY>(bvh, geometry, packet, worker);
}

/// One coordinate of all rays.
#[inline(always)]
fn column(packet: &Packet, of: impl Fn(&Probe) -> f32) -> [f32; RAYS] {
    let mut column = [0.0; RAYS];
    for (x, probe) in column.iter_mut().zip(&packet.probes) {
        *x = of(probe);
    }
    column
}

#[inline(always)]
fn least(column: &[f32; RAYS]) -> f32 {
    column.iter().fold(f32::INFINITY, |least, x| if *x < least { *x } else { least })
}

#[inline(always)]
fn greatest(column: &[f32; RAYS]) -> f32 {
    column.iter().fold(f32::NEG_INFINITY, |most, x| if *x > most { *x } else { most })
}

/// The rays along one axis.
struct Axis<L> {
    /// Lanes are rays: 1 / direction, and the origin with its margins times it.
    inverse: L,
    near: L,
    far: L,
    /// Every lane the same: bounds over all rays, such that near planes come out nearer and far ones farther.
    inverses: [L; 2],
    near_origin: L,
    far_origin: L,
    /// Side of a box that is met first.
    first: usize,
}

impl<L: Wide> Axis<L> {
    #[inline(always)]
    fn new(packet: &Packet, axis: usize, margin: f32) -> Self {
        let inverse = column(packet, |p| p.inverse[axis]);
        let origin = column(packet, |p| p.origin[axis]);
        let backward = inverse[0] < 0.0;
        let (low, high) = (least(&origin) - margin, greatest(&origin) + margin);
        let (near_origin, far_origin) = if backward { (low, high) } else { (high, low) };
        let (o, i) = (L::load(&origin), L::load(&inverse));
        let ahead = L::splat(if backward { -margin } else { margin });
        Axis {
            inverse: i,
            near: (o + ahead) * i,
            far: (o - ahead) * i,
            inverses: [L::splat(least(&inverse)), L::splat(greatest(&inverse))],
            near_origin: L::splat(near_origin),
            far_origin: L::splat(far_origin),
            first: usize::from(backward),
        }
    }

    /// Lanes are children: a lower bound of where any ray enters between the planes of this axis, and an upper bound
    /// of where it leaves.
    #[inline(always)]
    fn bounds(&self, planes: &[[f32; LANES]; 2]) -> (L, L) {
        let near = L::load(&planes[self.first & 1]) - self.near_origin;
        let far = L::load(&planes[1 - self.first & 1]) - self.far_origin;
        let [low, high] = self.inverses;
        ((near * low).min(near * high), (far * low).max(far * high))
    }

    /// Lanes are rays: where each enters and leaves between the planes of one child.
    #[inline(always)]
    fn cross(&self, planes: &[[f32; LANES]; 2], child: usize) -> (L, L) {
        let near = L::splat(planes[self.first & 1][child]);
        let far = L::splat(planes[1 - self.first & 1][child]);
        (near.scale_sub(self.inverse, self.near), far.scale_sub(self.inverse, self.far))
    }
}

/// The rays as boxes want them.
struct Sight<L> {
    x: Axis<L>,
    y: Axis<L>,
    z: Axis<L>,
}

impl<L: Wide> Sight<L> {
    #[inline(always)]
    fn new(packet: &Packet, extent: f32) -> Self {
        let reach = packet.probes.iter().fold(0.0f32, |reach, p| reach.max(p.origin.abs().max_element()));
        let margin = (reach + extent) * MARGIN;
        let axis = |axis| Axis::new(packet, axis, margin);
        Sight { x: axis(0), y: axis(1), z: axis(2) }
    }

    /// Children that any ray may meet before `limit`.
    #[inline(always)]
    fn meet(&self, node: &Node, limit: L) -> (L, u32) {
        let [x, y, z] = &node.bounds;
        let (near_x, far_x) = self.x.bounds(x);
        let (near_y, far_y) = self.y.bounds(y);
        let (near_z, far_z) = self.z.bounds(z);
        let near = near_x.max(near_y).max(near_z.max(L::splat(0.0)));
        let far = far_x.min(far_y).min(far_z.min(limit));
        (near, L::bits(near.le(far)))
    }

    /// Rays that meet the box of one child before their own limits.
    #[inline(always)]
    fn rays(&self, node: &Node, child: usize, limits: &[f32; RAYS]) -> u32 {
        let child = child & (LANES - 1);
        let [x, y, z] = &node.bounds;
        let (near_x, far_x) = self.x.cross(x, child);
        let (near_y, far_y) = self.y.cross(y, child);
        let (near_z, far_z) = self.z.cross(z, child);
        let near = near_x.max(near_y).max(near_z.max(L::splat(0.0)));
        let far = far_x.min(far_y).min(far_z.min(L::load(limits)));
        L::bits(near.le(far))
    }
}

#[inline(always)]
fn walk<L: Wide, const ANY: bool>(bvh: &Bvh, geometry: &Geometry, packet: &mut Packet, worker: &mut Worker) {
    let tree = &bvh.world;
    if tree.root == Child::NONE {
        return;
    }
    let Worker { counters, stack, .. } = worker;
    let mut cost = Cost::default();
    let sight = Sight::<L>::new(packet, tree.extent);
    let mut limits = [0.0; RAYS];
    limits.iter_mut().zip(&packet.bests).for_each(|(limit, best)| *limit = best.t);
    let mut limit = greatest(&limits);
    let mut held = 0;
    let (mut child, mut rays) = (tree.root, (1 << RAYS) - 1);
    loop {
        if child.held() == Held::Node {
            let node = &tree.nodes[child.index()];
            cost.steps += 1;
            let (near, hits) = sight.meet(node, L::splat(limit));
            push(tree, child.index(), &near.store(), hits, stack, &mut held);
        } else {
            for i in lanes(rays) {
                let (probe, best) = (&packet.probes[i], &mut packet.bests[i]);
                if child.held() == Held::List {
                    let list = &tree.lists[child.index()][..child.count() as usize];
                    cost += others::<L, ANY>(bvh, geometry, list, probe, best, &mut stack[held..]);
                } else {
                    cost.tests += child.count();
                    leaf::<L>(tree, child, probe, Scope::WORLD, best);
                }
                // Nothing is before minus infinity: that ray is done.
                limits[i] = if ANY && best.found { f32::NEG_INFINITY } else { best.t };
            }
            if rays != 0 {
                limit = greatest(&limits);
            }
        }
        loop {
            if held == 0 {
                return cost.count(counters);
            }
            held -= 1;
            let next = stack[held];
            if f32::from_bits((next >> 32) as u32) <= limit {
                let at = next as u32 as usize;
                let node = &tree.nodes[at / LANES];
                child = node.children[at % LANES];
                if child.held() != Held::Node {
                    rays = sight.rays(node, at % LANES, &limits);
                }
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
        let child = tree.nodes[node].children[i];
        if child.held() == Held::Node
            && let Some(ahead) = tree.nodes.get(child.index())
        {
            prefetch(ahead);
        }
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
