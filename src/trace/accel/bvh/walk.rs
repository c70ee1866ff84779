//! Walking a tree with one ray, nearest box first.

use glam::Vec3;

use super::{Boxes, Bvh, Child, Held, LANES, NO_BACK, NO_FRONT, Node, Spheres, Tree, Triangles};
use crate::trace::accel::Worker;
use crate::trace::geometry::{Best, Kind};
use crate::trace::shapes::{self, Beam, Probe};
use crate::trace::simd::{Kernel, V3, Wide, prefetch};
use crate::trace::{Counters, Geometry, Sides};

/// Margin of the boxes, relative to the greatest coordinate of ray and tree. What tests of primitives are held to errs
/// by a quarter of it.
pub(super) const MARGIN: f32 = 8.0 * f32::EPSILON;

impl Bvh {
    /// The nearest hit before `best.t`, or with `ANY` any one.
    #[inline]
    pub fn walk<const ANY: bool>(&self, geometry: &Geometry, probe: &Probe, best: &mut Best, worker: &mut Worker) {
        self.make_room(worker);
        self.width.run(Walk::<ANY> { bvh: self, geometry, probe, best, worker });
    }
}

impl Bvh {
    /// Sees to it that a walk's stack never overflows.
    pub(super) fn make_room(&self, worker: &mut Worker) {
        if worker.stack.len() < self.stack {
            worker.stack.resize(self.stack, 0);
        }
    }
}

struct Walk<'a, const ANY: bool> {
    bvh: &'a Bvh,
    geometry: &'a Geometry,
    probe: &'a Probe,
    best: &'a mut Best,
    worker: &'a mut Worker,
}

impl<const ANY: bool> Kernel for Walk<'_, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        scan_rest::<L, ANY>(self.bvh, self.geometry, self.probe, self.best, self.worker);
    }
}

/// A walk of the world's tree; the best so far may already be a hit.
#[inline(always)]
pub(super) fn scan_rest<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    probe: &Probe,
    best: &mut Best,
    worker: &mut Worker,
) {
    let Worker { counters, stack, .. } = worker;
    let cost = scan::<L, ANY>(&bvh.world, probe, Scope::WORLD, best, stack, |list, best, stack| {
        others::<L, ANY>(bvh, geometry, list, probe, best, stack)
    });
    cost.count(counters);
}

/// Primitives of the kinds that have no lanes.
#[inline(always)]
pub(super) fn others<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    list: &[u32],
    probe: &Probe,
    best: &mut Best,
    stack: &mut [u64],
) -> Cost {
    let mut cost = Cost::default();
    for &n in list {
        if geometry.kind_of(n) == Kind::Instance {
            cost += enter::<L, ANY>(bvh, geometry, n, probe, best, stack);
        } else {
            geometry.test(n, probe, best);
            cost.tests += 1;
        }
    }
    cost
}

/// Carries the ray into the tree of an instance.
#[inline(always)]
fn enter<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    number: u32,
    probe: &Probe,
    best: &mut Best,
    stack: &mut [u64],
) -> Cost {
    let instance = geometry.instance(number);
    let Some((local, scale, near)) = instance.enter(probe, best.t) else { return Cost::default() };
    let hidden = match geometry.tag(number).sides {
        Sides::Both => 0,
        Sides::Front => NO_BACK,
        Sides::Back => NO_FRONT,
    };
    let scope = Scope { scale, near, instance: Some(number), hidden };
    scan::<L, ANY>(&bvh.models[instance.model as usize].1, &local, scope, best, stack, |_, _, _| Cost::default())
}

/// Whose triangles are met, and how distances there relate to those in the world.
#[derive(Clone, Copy)]
pub(super) struct Scope {
    scale: f32,
    /// Distance in the world before which nothing is met.
    near: f32,
    instance: Option<u32>,
    /// Sides that are not there for rays.
    hidden: u32,
}

impl Scope {
    pub(super) const WORLD: Scope = Scope { scale: 1.0, near: 0.0, instance: None, hidden: 0 };
}

#[derive(Clone, Copy, Default)]
pub(super) struct Cost {
    pub(super) steps: u32,
    pub(super) tests: u32,
}

impl Cost {
    pub(super) fn count(self, counters: &mut Counters) {
        counters.steps += u64::from(self.steps);
        counters.intersection_tests += u64::from(self.tests);
    }
}

impl std::ops::AddAssign for Cost {
    fn add_assign(&mut self, o: Self) {
        self.steps += o.steps;
        self.tests += o.tests;
    }
}

/// A ray as boxes want it.
struct Sight<L> {
    inverse: V3<L>,
    /// Origin times inverse, with the margin that makes near planes nearer.
    near: V3<L>,
    far: V3<L>,
    /// Which side of a box is met first along each axis.
    first: [usize; 3],
}

impl<L: Wide> Sight<L> {
    #[inline(always)]
    fn new(probe: &Probe, extent: f32) -> Self {
        let margin = (probe.origin.abs().max_element() + extent) * MARGIN;
        let margin = Vec3::splat(margin).copysign(probe.inverse);
        Sight {
            inverse: V3::splat(probe.inverse),
            near: V3::splat((probe.origin + margin) * probe.inverse),
            far: V3::splat((probe.origin - margin) * probe.inverse),
            first: [0, 1, 2].map(|axis| usize::from(probe.inverse[axis] < 0.0)),
        }
    }

    /// Distances at which the boxes of a node are entered, and which are before `limit`.
    #[inline(always)]
    fn meet(&self, node: &Node, limit: L) -> (L, u32) {
        let [x, y, z] = self.first;
        let b = &node.bounds;
        let plane =
            |axis: usize, side: usize, inverse: L, origin: L| L::load(&b[axis][side & 1]).scale_sub(inverse, origin);
        let near = plane(0, x, self.inverse.x, self.near.x)
            .max(plane(1, y, self.inverse.y, self.near.y))
            .max(plane(2, z, self.inverse.z, self.near.z).max(L::splat(0.0)));
        let far = plane(0, 1 - x, self.inverse.x, self.far.x)
            .min(plane(1, 1 - y, self.inverse.y, self.far.y))
            .min(plane(2, 1 - z, self.inverse.z, self.far.z).min(limit));
        (near, L::bits(near.le(far)))
    }
}

/// Something and the distance at which its box is entered: as integers, in the order of the distances.
#[inline(always)]
pub(super) fn entry(t: f32, what: u32) -> u64 {
    u64::from(t.to_bits()) << 32 | u64::from(what)
}

/// `others` tests a list of primitives of other kinds; what it is given of the stack is free.
#[inline(always)]
fn scan<L: Wide, const ANY: bool>(
    tree: &Tree,
    probe: &Probe,
    scope: Scope,
    best: &mut Best,
    stack: &mut [u64],
    mut others: impl FnMut(&[u32], &mut Best, &mut [u64]) -> Cost,
) -> Cost {
    let mut cost = Cost::default();
    if tree.root == Child::NONE {
        return cost;
    }
    let sight = Sight::<L>::new(probe, tree.extent);
    // Rounded up: a box is not passed over for the rounding of a scale.
    let per_scale = if scope.scale == 1.0 { 1.0 } else { (1.0 / scope.scale) * (1.0 + 4.0 * f32::EPSILON) };
    let mut limit = best.t * per_scale;
    let mut held = 0;
    let mut child = tree.root;
    loop {
        while child.held() == Held::Node {
            let node = &tree.nodes[child.index()];
            cost.steps += 1;
            let (near, hits) = sight.meet(node, L::splat(limit));
            if hits == 0 {
                child = Child::NONE;
                break;
            }
            child = descend::<ANY>(tree, node, &near.store(), hits, stack, &mut held);
        }
        if child != Child::NONE {
            if child.held() == Held::List {
                let list = &tree.lists[child.index()][..child.count() as usize];
                cost += others(list, best, &mut stack[held..]);
            } else {
                cost.tests += child.count();
                leaf::<L>(tree, child, probe, scope, best);
            }
            if ANY && best.found {
                return cost;
            }
            limit = best.t * per_scale;
        }
        loop {
            if held == 0 {
                return cost;
            }
            held -= 1;
            let next = stack[held];
            if f32::from_bits((next >> 32) as u32) <= limit {
                child = Child(next as u32);
                break;
            }
        }
    }
}

/// Tests the eight primitives of a leaf.
#[inline(always)]
fn leaf<L: Wide>(tree: &Tree, child: Child, probe: &Probe, scope: Scope, best: &mut Best) {
    // Spread over the lanes again for every leaf: kept across the loop, it would only be spilled.
    let probe = std::hint::black_box(probe);
    match child.held() {
        Held::Triangles => triangles::<L>(&tree.triangles[child.index()], &probe.beam(), scope, best),
        Held::Spheres => spheres::<L>(&tree.spheres[child.index()], &probe.beam(), best),
        Held::Boxes => boxes::<L>(&tree.boxes[child.index()], &probe.beam(), best),
        Held::List | Held::Node => {}
    }
}

/// The nearest of the children that were met; the others go onto the stack, farthest first.
#[inline(always)]
fn descend<const ANY: bool>(
    tree: &Tree,
    node: &Node,
    near: &[f32; LANES],
    hits: u32,
    stack: &mut [u64],
    held: &mut usize,
) -> Child {
    let mut left = hits;
    let mut take = || {
        let i = left.trailing_zeros() as usize & (LANES - 1);
        left &= left - 1;
        let child = node.children[i];
        prefetch_child(tree, child);
        (left != 0, entry(near[i], child.0))
    };
    let (more, first) = take();
    if !more {
        return Child(first as u32);
    }
    let (more, second) = take();
    let (mut nearest, farther) = if first <= second { (first, second) } else { (second, first) };
    let base = *held;
    stack[base] = farther;
    let mut end = base + 1;
    if more {
        loop {
            let (more, next) = take();
            let mut at = end;
            let pushed = if next < nearest { std::mem::replace(&mut nearest, next) } else { next };
            if !ANY {
                while at > base && stack[at - 1] < pushed {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
            }
            stack[at] = pushed;
            end += 1;
            if !more {
                break;
            }
        }
    }
    *held = end;
    Child(nearest as u32)
}

#[inline(always)]
pub(super) fn prefetch_child(tree: &Tree, child: Child) {
    if child.held() == Held::Node
        && let Some(ahead) = tree.nodes.get(child.index())
    {
        prefetch(ahead);
    }
}

#[inline(always)]
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

/// Three columns, in the order of the axes.
#[inline(always)]
fn load<L: Wide>(columns: &[[f32; LANES]; 3], [x, y, z]: [usize; 3]) -> V3<L> {
    V3 { x: L::load(&columns[x]), y: L::load(&columns[y]), z: L::load(&columns[z]) }
}

#[inline(always)]
fn triangles<L: Wide>(block: &Triangles, beam: &Beam<L>, scope: Scope, best: &mut Best) {
    let [x, y, z] = beam.axes;
    let [a, b, c] = &block.corners;
    let corners = [load(a, [x, y, z]), load(b, [x, y, z]), load(c, [x, y, z])];
    let Some(hits) = shapes::triangle(beam, corners) else { return };
    let t = (hits.t * L::splat(scope.scale)).max(L::splat(scope.near));
    let met = L::bits(L::both(hits.hit, t.le(L::splat(best.t))));
    if met == 0 {
        return;
    }
    let front = L::bits(hits.front);
    let (t, u, v) = (t.store(), hits.u.store(), hits.v.store());
    for lane in lanes(met) {
        let number = block.numbers[lane];
        let side = if front >> lane & 1 == 1 { NO_FRONT } else { NO_BACK };
        if (number | scope.hidden) & side == 0 {
            let element = number & !(NO_FRONT | NO_BACK);
            best.offer(t[lane], scope.instance.unwrap_or(element), element, u[lane], v[lane]);
        }
    }
}

#[inline(always)]
fn spheres<L: Wide>(block: &Spheres, beam: &Beam<L>, best: &mut Best) {
    let (met, spans) = shapes::sphere(beam, load(&block.center, [0, 1, 2]), L::load(&block.radius));
    offer_spans(met, spans, &block.numbers, best);
}

#[inline(always)]
fn boxes<L: Wide>(block: &Boxes, beam: &Beam<L>, best: &mut Best) {
    let spans = shapes::slab(beam, load(&block.min, [0, 1, 2]), load(&block.max, [0, 1, 2]));
    offer_spans(spans[0].le(spans[1]), spans, &block.numbers, best);
}

#[inline(always)]
fn offer_spans<L: Wide>(met: L::Mask, [near, far]: [L; 2], numbers: &[u32; LANES], best: &mut Best) {
    let (zero, limit) = (L::splat(0.0), L::splat(best.t));
    // Whatever side shows, the hit is at `near` or behind it.
    let met = L::bits(L::both(met, L::both(near.le(limit), zero.lt(far))));
    if met == 0 {
        return;
    }
    let (near, far) = (near.store(), far.store());
    for lane in lanes(met) {
        let number = numbers[lane];
        let sides = match (number & NO_FRONT != 0, number & NO_BACK != 0) {
            (false, false) => Sides::Both,
            (false, true) => Sides::Front,
            _ => Sides::Back,
        };
        best.offer_span([near[lane], far[lane]], sides, number & !(NO_FRONT | NO_BACK));
    }
}
