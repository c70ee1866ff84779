//! Eight rays side by side against one primitive after the other.

use crate::trace::accel::leaves::{ConeBlock, Leaves, NO_BACK, NO_FRONT, NodeKind, NodeRef};
use crate::trace::primitive::{ClosestHit, ConeLanes, Geometry, PARTS, PreparedRayLanes, shapes};
use crate::trace::simd::{LANES, V3, Wide, lanes};
use crate::trace::soa::{HitLanes, RayLanes, Rays, contiguous};

/// Eight rays, column by column, and their hits so far.
pub struct RayGroup<L: Wide> {
    pub beam: PreparedRayLanes<L>,
    /// Coordinates in the order of the beam's axes.
    pub origin: [L; 3],
    pub direction: [L; 3],
    pub t: L,
    /// How far each was moved up to the primitives.
    skip: L,
    u: L,
    v: L,
    /// Bits of the numbers of primitives.
    primitive: L,
    element: L,
    /// A bit for each ray that has a hit.
    found: u32,
}

impl<L: Wide> RayGroup<L> {
    /// The last ray fills the lanes that are left.
    #[inline(always)]
    pub fn new(geometry: &Geometry, rays: &Rays, numbers: &[u32], axes: [usize; 3]) -> Self {
        let (mut origin, direction, t_max): (V3<L>, V3<L>, L);
        if numbers.len() >= LANES && contiguous(&numbers[..LANES]) {
            RayLanes { origin, direction, t_max } = rays.lanes(numbers[0] as usize);
        } else {
            let mut which = [0; LANES];
            for (lane, which) in which.iter_mut().enumerate() {
                *which = numbers[lane.min(numbers.len() - 1)] as usize;
            }
            RayLanes { origin, direction, t_max } = rays.gather(&which);
        }
        let skip;
        (skip, origin) = geometry.approached::<L>(origin, direction);
        let (origin, direction) = (turned(origin, axes), turned(direction, axes));
        let zero = L::splat(0.0);
        RayGroup {
            beam: PreparedRayLanes::of_rays(axes, origin, direction),
            origin,
            direction,
            t: t_max - skip,
            skip,
            u: zero,
            v: zero,
            primitive: zero,
            element: zero,
            found: 0,
        }
    }

    /// A bit for each ray that has a hit.
    #[inline(always)]
    pub fn found(&self) -> u32 {
        self.found
    }

    /// Hits so far, with distances from where the rays started.
    #[inline(always)]
    pub fn hits(&self) -> HitLanes<L> {
        let RayGroup { u, v, primitive, element, .. } = *self;
        HitLanes { t: self.skip + self.t, u, v, primitive, element }
    }

    /// Hits so far, ray by ray.
    #[inline(always)]
    pub fn bests(&self) -> [ClosestHit; LANES] {
        let [t, u, v] = [self.t.store(), self.u.store(), self.v.store()];
        let [primitive, element] = [self.primitive.store(), self.element.store()];
        let mut bests = [ClosestHit::within(0.0); LANES];
        for (i, best) in bests.iter_mut().enumerate() {
            let (primitive, element) = (primitive[i].to_bits(), element[i].to_bits());
            *best = ClosestHit { t: t[i], primitive, element, u: u[i], v: v[i], found: self.found >> i & 1 == 1 };
        }
        bests
    }

    /// Takes hits back into the lanes.
    #[inline(always)]
    pub fn set(&mut self, bests: &[ClosestHit; LANES]) {
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
        let nearer = L::and(hit, t.lt(self.t));
        let level = L::bits(L::and(hit, t.le(self.t))) & !L::bits(nearer) & self.found;
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

    /// Tests the primitives of a block that have a bit in `which`, one after the other; not a list.
    #[inline(always)]
    pub fn block<const ANY: bool>(&mut self, leaves: &Leaves, child: NodeRef, which: u32) {
        match child.held() {
            NodeKind::Triangles => {
                let block = &leaves.triangles[child.index()];
                for lane in lanes(which) {
                    self.triangle::<ANY>(&block.corners, lane & (LANES - 1), block.numbers[lane & (LANES - 1)]);
                }
            }
            NodeKind::Spheres => {
                let block = &leaves.spheres[child.index()];
                for lane in lanes(which) {
                    let lane = lane & (LANES - 1);
                    let (met, span) =
                        shapes::intersect_sphere(&self.beam, pick(&block.center, lane), L::splat(block.radius[lane]));
                    self.span::<ANY>(met, span, block.numbers[lane]);
                }
            }
            NodeKind::Boxes => {
                let block = &leaves.boxes[child.index()];
                for lane in lanes(which) {
                    let lane = lane & (LANES - 1);
                    let span = shapes::intersect_box(&self.beam, pick(&block.min, lane), pick(&block.max, lane));
                    self.span::<ANY>(span[0].le(span[1]), span, block.numbers[lane]);
                }
            }
            NodeKind::Cones => {
                let block = &leaves.cones[child.index()];
                for lane in lanes(which) {
                    self.cone::<ANY>(block, lane & (LANES - 1));
                }
            }
            NodeKind::List | NodeKind::Node => {}
        }
    }

    #[inline(always)]
    fn triangle<const ANY: bool>(&mut self, corners: &[[[f32; LANES]; 3]; 3], lane: usize, number: u32) {
        let [x, y, z] = self.beam.axes;
        let [a, b, c] = corners;
        let a = V3 { x: L::splat(a[x][lane]), y: L::splat(a[y][lane]), z: L::splat(a[z][lane]) };
        let b = V3 { x: L::splat(b[x][lane]), y: L::splat(b[y][lane]), z: L::splat(b[z][lane]) };
        let c = V3 { x: L::splat(c[x][lane]), y: L::splat(c[y][lane]), z: L::splat(c[z][lane]) };
        let Some(hits) = shapes::intersect_triangle(&self.beam, [a, b, c]) else { return };
        let mut hit = hits.hit;
        if number & NO_FRONT != 0 {
            hit = L::and(hit, L::not(hits.front));
        }
        if number & NO_BACK != 0 {
            hit = L::and(hit, hits.front);
        }
        let number = number & !(NO_FRONT | NO_BACK);
        self.offer::<ANY>(hit, hits.t, hits.u, hits.v, number, number);
    }

    #[inline(always)]
    fn cone<const ANY: bool>(&mut self, block: &ConeBlock, lane: usize) {
        let zero = L::splat(0.0);
        let [near, far] = shapes::intersect_box(&self.beam, pick(&block.min, lane), pick(&block.max, lane));
        let open = L::and(near.le(far), L::and(zero.lt(far), near.le(self.t)));
        if !L::any(open) {
            return;
        }
        let columns = ConeLanes {
            base: pick(&block.base, lane),
            axis: pick(&block.axis, lane),
            height: L::splat(block.height[lane]),
            base_radius: L::splat(block.base_radius[lane]),
            slope: L::splat(block.slope[lane]),
            capped: L::splat(block.capped[lane]),
        };
        let crossings = shapes::intersect_cone(&self.beam, &columns);
        let number = block.numbers[lane];
        for (crossing, part) in crossings.iter().zip(PARTS) {
            let mut hit = L::and(open, crossing.met);
            if number & NO_FRONT != 0 {
                hit = L::and(hit, L::not(crossing.enters));
            }
            if number & NO_BACK != 0 {
                hit = L::and(hit, crossing.enters);
            }
            let t = crossing.t.max(near).min(far);
            if L::any(L::and(hit, t.le(self.t))) {
                let code = L::splat(part as u8 as f32);
                self.offer::<ANY>(hit, t, t, code, number & !(NO_FRONT | NO_BACK), 0);
            }
        }
    }

    #[inline(always)]
    fn span<const ANY: bool>(&mut self, met: L::Mask, [near, far]: [L; 2], number: u32) {
        let zero = L::splat(0.0);
        let enters = if number & NO_FRONT == 0 { zero.lt(near) } else { zero.lt(zero) };
        let leaves = if number & NO_BACK == 0 { zero.lt(far) } else { zero.lt(zero) };
        let t = L::select(enters, near, far);
        let hit = L::and(met, L::or(enters, leaves));
        if L::any(L::and(hit, t.le(self.t))) {
            self.offer::<ANY>(hit, t, t, zero, number & !(NO_FRONT | NO_BACK), 0);
        }
    }
}

/// Coordinates in the order of the axes.
#[inline(always)]
fn turned<L: Wide>(v: V3<L>, [x, y, z]: [usize; 3]) -> [L; 3] {
    let v = [v.x, v.y, v.z];
    [v[x % 3], v[y % 3], v[z % 3]]
}

/// One vector of three columns, in every lane.
#[inline(always)]
fn pick<L: Wide>(columns: &[[f32; LANES]; 3], lane: usize) -> V3<L> {
    V3 { x: L::splat(columns[0][lane]), y: L::splat(columns[1][lane]), z: L::splat(columns[2][lane]) }
}

/// Eights of rays that go together. Four of them share more nodes and part ways more often: it comes to the same.
pub const GROUPS: usize = 2;
