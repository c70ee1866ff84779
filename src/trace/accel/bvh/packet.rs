//! Walking a tree with rays that go nearly the same way, sixteen together.
//!
//! Nodes are tested once for all of them, by the frustum around them (Reshetov, Soupikov and Hurley 2005; see
//! [`super::frustum`]). At a leaf, eight rays at a time are tested against its box, and if any meets it, against its
//! primitives one after the other. What a ray hits cannot differ from its own walk: the frustum only ever opens more
//! boxes, and the tests are the same in every lane. Where the rays turn out to part ways, the packet is given up and
//! each goes on alone with what it has found.

use glam::Vec3;

use super::frustum::Sight;
use super::walk::{Cost, entry, lanes, others, prefetch_child, scan_rest};
use super::{Bvh, Child, Held, LANES, NO_BACK, NO_FRONT, Tree};
use crate::trace::accel::Worker;
use crate::trace::geometry::Best;
use crate::trace::shapes::{self, Beam, Probe};
use crate::trace::simd::{Kernel, V3, Wide};
use crate::trace::{Geometry, Ray};

/// Eights of rays that go together.
pub const GROUPS: usize = 2;

/// How many rays go together.
pub const RAYS: usize = GROUPS * LANES;

/// Nodes that a packet visits before it is given up; a ray alone visits some three to five.
const PATIENCE: u32 = 28;

/// Eight rays, column by column, and their hits so far.
pub struct Group<L: Wide> {
    pub beam: Beam<L>,
    /// Coordinates in the order of the beam's axes.
    pub origin: [L; 3],
    pub direction: [L; 3],
    pub t: L,
    u: L,
    v: L,
    /// Bits of the numbers of primitives.
    primitive: L,
    element: L,
    /// A bit for each ray that has a hit.
    found: u32,
}

/// Ways in which rays can mostly run: along an axis, up or down.
const WAYS: usize = 6;

/// Rays that are sorted together: neighbours in the wave stay near each other.
const SORTED: usize = 512;

#[inline(always)]
fn way(ray: &Ray) -> usize {
    let axis = shapes::dominant(ray.direction);
    2 * axis + usize::from(ray.direction[axis] < 0.0)
}

/// Sorts rays by the way that they run; gives where each way ends.
fn sort(rays: &[Ray], order: &mut Vec<u32>) -> [usize; WAYS] {
    let mut next = [0; WAYS];
    rays.iter().for_each(|ray| next[way(ray)] += 1);
    let mut sum = 0;
    for count in &mut next {
        sum += std::mem::replace(count, sum);
    }
    order.resize(rays.len(), 0);
    for (i, ray) in rays.iter().enumerate() {
        let at = &mut next[way(ray)];
        order[*at] = i as u32;
        *at += 1;
    }
    next
}

impl Bvh {
    /// Walks of many rays, those that run the same way together: calls `done` for each with its number, how far it was
    /// moved up to the primitives, and what it found.
    pub fn each_packet<const ANY: bool>(
        &self,
        geometry: &Geometry,
        rays: &[Ray],
        worker: &mut Worker,
        mut done: impl FnMut(usize, f32, &Best, &mut Worker),
    ) {
        self.make_room(worker);
        let mut order = std::mem::take(&mut worker.order);
        for (chunk, rays) in rays.chunks(SORTED).enumerate() {
            let ends = sort(rays, &mut order);
            self.each_sorted::<ANY>(geometry, rays, &order, ends, worker, |i, skip, best, worker| {
                done(chunk * SORTED + i, skip, best, worker);
            });
        }
        worker.order = order;
    }

    fn each_sorted<const ANY: bool>(
        &self,
        geometry: &Geometry,
        rays: &[Ray],
        order: &[u32],
        ends: [usize; WAYS],
        worker: &mut Worker,
        mut done: impl FnMut(usize, f32, &Best, &mut Worker),
    ) {
        let mut start = 0;
        let (mut skips, mut near) = ([0.0; RAYS], [Ray::new(Vec3::ZERO, Vec3::ZERO); RAYS]);
        let mut bests = [Best::within(0.0); RAYS];
        for (way, end) in ends.into_iter().enumerate() {
            for numbers in order[start..end].chunks(RAYS) {
                for (lane, n) in numbers.iter().enumerate() {
                    (skips[lane], near[lane]) = geometry.approach(&rays[*n as usize]);
                }
                let near = &near[..numbers.len()];
                if worker.wait > 0 {
                    worker.wait -= 1;
                    for (ray, best) in near.iter().zip(&mut bests) {
                        *best = Best::within(ray.t_max);
                        self.walk::<ANY>(geometry, &Probe::from(ray), best, worker);
                    }
                } else {
                    self.walk_packet::<ANY>(geometry, near, way / 2, &mut bests, worker);
                }
                for (lane, n) in numbers.iter().enumerate() {
                    done(*n as usize, skips[lane], &bests[lane], worker);
                }
            }
            start = end;
        }
    }

    /// As [`Bvh::walk`] for up to [`RAYS`] rays that all run mostly along this axis, the same way.
    fn walk_packet<const ANY: bool>(
        &self,
        geometry: &Geometry,
        rays: &[Ray],
        axis: usize,
        bests: &mut [Best; RAYS],
        worker: &mut Worker,
    ) {
        let axes = [(axis + 1) % 3, (axis + 2) % 3, axis];
        self.width.run(Walk::<ANY> { bvh: self, geometry, rays, axes, bests, worker });
    }
}

struct Walk<'a, const ANY: bool> {
    bvh: &'a Bvh,
    geometry: &'a Geometry,
    rays: &'a [Ray],
    axes: [usize; 3],
    bests: &'a mut [Best; RAYS],
    worker: &'a mut Worker,
}

impl<const ANY: bool> Kernel for Walk<'_, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        walk::<L, ANY>(self.bvh, self.geometry, self.rays, self.axes, self.bests, self.worker);
    }
}

impl<L: Wide> Group<L> {
    /// The last ray fills the lanes that are left.
    #[inline(always)]
    fn new(rays: &[Ray], axes: [usize; 3]) -> Self {
        let mut columns = [[0.0; LANES]; 7];
        for lane in 0..LANES {
            let ray = &rays[lane.min(rays.len() - 1)];
            let (o, d) = (ray.origin, ray.direction);
            let [x, y, z] = axes;
            for (column, x) in columns.iter_mut().zip([o[x], o[y], o[z], d[x], d[y], d[z], ray.t_max]) {
                column[lane] = x;
            }
        }
        let [ox, oy, oz, dx, dy, dz, t] = &columns;
        let origin = [L::load(ox), L::load(oy), L::load(oz)];
        let direction = [L::load(dx), L::load(dy), L::load(dz)];
        let zero = L::splat(0.0);
        Group {
            beam: Beam::of_rays(axes, origin, direction),
            origin,
            direction,
            t: L::load(t),
            u: zero,
            v: zero,
            primitive: zero,
            element: zero,
            found: 0,
        }
    }

    /// Hits so far, ray by ray.
    #[inline(always)]
    fn bests(&self) -> [Best; LANES] {
        let [t, u, v] = [self.t.store(), self.u.store(), self.v.store()];
        let [primitive, element] = [self.primitive.store(), self.element.store()];
        let mut bests = [Best::within(0.0); LANES];
        for (i, best) in bests.iter_mut().enumerate() {
            let (primitive, element) = (primitive[i].to_bits(), element[i].to_bits());
            *best = Best { t: t[i], primitive, element, u: u[i], v: v[i], found: self.found >> i & 1 == 1 };
        }
        bests
    }

    /// Takes hits back into the lanes.
    #[inline(always)]
    fn set(&mut self, bests: &[Best; LANES]) {
        let mut columns = [[0.0; LANES]; 5];
        self.found = 0;
        for (i, best) in bests.iter().enumerate() {
            columns[0][i] = best.t;
            columns[1][i] = best.u;
            columns[2][i] = best.v;
            columns[3][i] = f32::from_bits(best.primitive);
            columns[4][i] = f32::from_bits(best.element);
            self.found |= u32::from(best.found) << i;
        }
        let [t, u, v, primitive, element] = &columns;
        (self.t, self.u, self.v) = (L::load(t), L::load(u), L::load(v));
        (self.primitive, self.element) = (L::load(primitive), L::load(element));
    }

    /// Keeps the hits of one primitive that are nearer than the best so far, or as near and lower in number.
    #[inline(always)]
    fn offer<const ANY: bool>(&mut self, hit: L::Mask, t: L, u: L, v: L, number: u32, element: u32) {
        let nearer = L::both(hit, t.lt(self.t));
        let level = L::bits(L::both(hit, t.le(self.t))) & !L::bits(nearer) & self.found;
        if level != 0 && !ANY {
            let mut bests = self.bests();
            let (t, u, v) = (t.store(), u.store(), v.store());
            for lane in lanes(level) {
                bests[lane].offer(t[lane], number, element, u[lane], v[lane]);
            }
            self.set(&bests);
        }
        self.found |= L::bits(nearer);
        // Nothing is before minus infinity: a ray that asks for any hit is done.
        let t = if ANY { L::splat(f32::NEG_INFINITY) } else { t };
        self.t = L::select(nearer, t, self.t);
        self.u = L::select(nearer, u, self.u);
        self.v = L::select(nearer, v, self.v);
        self.primitive = L::select(nearer, L::splat(f32::from_bits(number)), self.primitive);
        self.element = L::select(nearer, L::splat(f32::from_bits(element)), self.element);
    }

    /// Tests the primitives of a leaf one after the other.
    #[inline(always)]
    fn leaf<const ANY: bool>(&mut self, tree: &Tree, child: Child) {
        match child.held() {
            Held::Triangles => {
                let block = &tree.triangles[child.index()];
                for lane in 0..child.count() as usize {
                    self.triangle::<ANY>(&block.corners, lane & (LANES - 1), block.numbers[lane & (LANES - 1)]);
                }
            }
            Held::Spheres => {
                let block = &tree.spheres[child.index()];
                for lane in 0..child.count() as usize {
                    let lane = lane & (LANES - 1);
                    let (met, span) =
                        shapes::sphere(&self.beam, pick(&block.center, lane), L::splat(block.radius[lane]));
                    self.span::<ANY>(met, span, block.numbers[lane]);
                }
            }
            Held::Boxes => {
                let block = &tree.boxes[child.index()];
                for lane in 0..child.count() as usize {
                    let lane = lane & (LANES - 1);
                    let span = shapes::slab(&self.beam, pick(&block.min, lane), pick(&block.max, lane));
                    self.span::<ANY>(span[0].le(span[1]), span, block.numbers[lane]);
                }
            }
            Held::List | Held::Node => {}
        }
    }

    #[inline(always)]
    fn triangle<const ANY: bool>(&mut self, corners: &[[[f32; LANES]; 3]; 3], lane: usize, number: u32) {
        let [x, y, z] = self.beam.axes;
        let [a, b, c] = corners;
        let a = V3 { x: L::splat(a[x][lane]), y: L::splat(a[y][lane]), z: L::splat(a[z][lane]) };
        let b = V3 { x: L::splat(b[x][lane]), y: L::splat(b[y][lane]), z: L::splat(b[z][lane]) };
        let c = V3 { x: L::splat(c[x][lane]), y: L::splat(c[y][lane]), z: L::splat(c[z][lane]) };
        let Some(hits) = shapes::triangle(&self.beam, [a, b, c]) else { return };
        let mut hit = hits.hit;
        if number & NO_FRONT != 0 {
            hit = L::both(hit, L::not(hits.front));
        }
        if number & NO_BACK != 0 {
            hit = L::both(hit, hits.front);
        }
        let number = number & !(NO_FRONT | NO_BACK);
        self.offer::<ANY>(hit, hits.t, hits.u, hits.v, number, number);
    }

    #[inline(always)]
    fn span<const ANY: bool>(&mut self, met: L::Mask, [near, far]: [L; 2], number: u32) {
        let zero = L::splat(0.0);
        let enters = if number & NO_FRONT == 0 { zero.lt(near) } else { zero.lt(zero) };
        let leaves = if number & NO_BACK == 0 { zero.lt(far) } else { zero.lt(zero) };
        let t = L::select(enters, near, far);
        let hit = L::both(met, L::either(enters, leaves));
        if L::any(L::both(hit, t.le(self.t))) {
            self.offer::<ANY>(hit, t, t, zero, number & !(NO_FRONT | NO_BACK), 0);
        }
    }
}

/// One vector of three columns, in every lane.
#[inline(always)]
fn pick<L: Wide>(columns: &[[f32; LANES]; 3], lane: usize) -> V3<L> {
    V3 { x: L::splat(columns[0][lane]), y: L::splat(columns[1][lane]), z: L::splat(columns[2][lane]) }
}

#[inline(always)]
fn walk<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    rays: &[Ray],
    axes: [usize; 3],
    bests: &mut [Best; RAYS],
    worker: &mut Worker,
) {
    let second = LANES.min(rays.len() - 1);
    let mut groups: [Group<L>; GROUPS] = [Group::new(rays, axes), Group::new(&rays[second..], axes)];
    let done = descend::<L, ANY>(bvh, geometry, rays, &mut groups, worker);
    for (group, bests) in groups.iter().zip(bests.chunks_exact_mut(LANES)) {
        bests.copy_from_slice(&group.bests());
    }
    for (i, best) in bests.iter_mut().enumerate().take(rays.len()) {
        let settled = done || (ANY && best.found);
        if !settled {
            scan_rest::<L, ANY>(bvh, geometry, &Probe::from(&rays[i]), best, worker);
        }
    }
    // The next packets are likely to fare as this one did.
    worker.failures = if done { worker.failures.saturating_sub(1) } else { (worker.failures + 2).min(8) };
    worker.wait = if done { 0 } else { (1 << worker.failures) - 1 };
}

/// False if the packet was given up.
#[inline(always)]
fn descend<L: Wide, const ANY: bool>(
    bvh: &Bvh,
    geometry: &Geometry,
    rays: &[Ray],
    groups: &mut [Group<L>; GROUPS],
    worker: &mut Worker,
) -> bool {
    let tree = &bvh.world;
    if tree.root == Child::NONE {
        return true;
    }
    let Some(sight) = Sight::new(groups, tree) else { return true };
    let Worker { counters, stack, .. } = worker;
    let mut cost = Cost::default();
    let mut limit = sight.limit(groups);
    let mut held = 0;
    let (mut child, mut parent) = (tree.root, None);
    loop {
        if child.held() == Held::Node {
            if cost.steps == PATIENCE {
                cost.count(counters);
                return false;
            }
            let node = &tree.nodes[child.index()];
            cost.steps += 1;
            let (front, hits) = sight.meet(node, limit);
            push(tree, child.index(), &front.store(), hits, stack, &mut held);
        } else {
            let mut met = 0;
            for (g, group) in groups.iter_mut().enumerate() {
                let some = parent.map_or(!0, |(node, slot)| sight.rays(g, node, slot, group.t));
                let some = some & ((1 << LANES) - 1);
                met |= some;
                if some == 0 {
                    continue;
                }
                cost.tests += child.count() * some.count_ones();
                if child.held() != Held::List {
                    group.leaf::<ANY>(tree, child);
                    continue;
                }
                let list = &tree.lists[child.index()][..child.count() as usize];
                let mut bests = group.bests();
                for lane in lanes(some) {
                    let (Some(ray), best) = (rays.get(g * LANES + lane), &mut bests[lane]) else { continue };
                    cost += others::<L, ANY>(bvh, geometry, list, &Probe::from(ray), best, &mut stack[held..]);
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
