//! One ray against a block.

use super::block::{BoxBlock, ConeBlock, Leaves, NO_BACK, NO_FRONT, NodeKind, NodeRef, SphereBlock, TriangleBlock};
use crate::trace::counters::Counters;
use crate::trace::primitive::{ClosestHit, ConeLanes, PARTS, PreparedRay, PreparedRayLanes, Sides, shapes};
use crate::trace::simd::{LANES, V3, Wide, lanes};

/// Whose triangles are met, and how distances there relate to those in the world.
#[derive(Clone, Copy)]
pub struct HitSpace {
    pub scale: f32,
    /// Distance in the world before which nothing is met.
    near: f32,
    instance: Option<u32>,
    /// Sides that are not there for rays.
    hidden: u32,
}

impl HitSpace {
    pub const WORLD: HitSpace = HitSpace { scale: 1.0, near: 0.0, instance: None, hidden: 0 };

    /// `scale` and `near` as `Instance::enter` gives them.
    pub fn of_instance(number: u32, sides: Sides, scale: f32, near: f32) -> Self {
        let hidden = match sides {
            Sides::Both => 0,
            Sides::Front => NO_BACK,
            Sides::Back => NO_FRONT,
        };
        HitSpace { scale, near, instance: Some(number), hidden }
    }

    /// What a distance in the world is worth here; rounded up, so that nothing is passed over for the rounding.
    #[inline(always)]
    pub fn per_scale(&self) -> f32 {
        if self.scale == 1.0 { 1.0 } else { (1.0 / self.scale) * (1.0 + 4.0 * f32::EPSILON) }
    }
}

#[derive(Clone, Copy, Default)]
pub struct TraversalCost {
    pub steps: u32,
    pub tests: u32,
}

impl TraversalCost {
    pub fn count(self, counters: &mut Counters) {
        counters.steps += u64::from(self.steps);
        counters.intersection_tests += u64::from(self.tests);
    }
}

impl std::ops::AddAssign for TraversalCost {
    fn add_assign(&mut self, o: Self) {
        self.steps += o.steps;
        self.tests += o.tests;
    }
}

/// Tests the eight primitives of a block; not a list.
#[inline(always)]
pub fn block<L: Wide>(leaves: &Leaves, child: NodeRef, probe: &PreparedRay, scope: HitSpace, best: &mut ClosestHit) {
    // Spread over the lanes again for every leaf: kept across the loop, it would only be spilled.
    let probe = std::hint::black_box(probe);
    match child.held() {
        NodeKind::Triangles => triangles::<L>(&leaves.triangles[child.index()], &probe.beam(), scope, best),
        NodeKind::Spheres => spheres::<L>(&leaves.spheres[child.index()], &probe.beam(), best),
        NodeKind::Boxes => boxes::<L>(&leaves.boxes[child.index()], &probe.beam(), best),
        NodeKind::Cones => cones::<L>(&leaves.cones[child.index()], &probe.beam(), best),
        NodeKind::List | NodeKind::Node => {}
    }
}

/// Three columns, in the order of the axes.
#[inline(always)]
fn load<L: Wide>(columns: &[[f32; LANES]; 3], [x, y, z]: [usize; 3]) -> V3<L> {
    V3 { x: L::load(&columns[x]), y: L::load(&columns[y]), z: L::load(&columns[z]) }
}

#[inline(always)]
fn triangles<L: Wide>(block: &TriangleBlock, beam: &PreparedRayLanes<L>, scope: HitSpace, best: &mut ClosestHit) {
    let [x, y, z] = beam.axes;
    let [a, b, c] = &block.corners;
    let corners = [load(a, [x, y, z]), load(b, [x, y, z]), load(c, [x, y, z])];
    let Some(hits) = shapes::intersect_triangle(beam, corners) else { return };
    let t = (hits.t * L::splat(scope.scale)).max(L::splat(scope.near));
    let met = L::bits(L::and(hits.hit, t.le(L::splat(best.t))));
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
fn spheres<L: Wide>(block: &SphereBlock, beam: &PreparedRayLanes<L>, best: &mut ClosestHit) {
    let (met, spans) = shapes::intersect_sphere(beam, load(&block.center, [0, 1, 2]), L::load(&block.radius));
    offer_spans(met, spans, &block.numbers, best);
}

#[inline(always)]
fn boxes<L: Wide>(block: &BoxBlock, beam: &PreparedRayLanes<L>, best: &mut ClosestHit) {
    let spans = shapes::intersect_box(beam, load(&block.min, [0, 1, 2]), load(&block.max, [0, 1, 2]));
    offer_spans(spans[0].le(spans[1]), spans, &block.numbers, best);
}

#[inline(always)]
fn cones<L: Wide>(block: &ConeBlock, beam: &PreparedRayLanes<L>, best: &mut ClosestHit) {
    let (zero, limit) = (L::splat(0.0), L::splat(best.t));
    let [near, far] = shapes::intersect_box(beam, load(&block.min, [0, 1, 2]), load(&block.max, [0, 1, 2]));
    let open = L::and(near.le(far), L::and(zero.lt(far), near.le(limit)));
    if !L::any(open) {
        return;
    }
    let columns = ConeLanes {
        base: load(&block.base, [0, 1, 2]),
        axis: load(&block.axis, [0, 1, 2]),
        height: L::load(&block.height),
        base_radius: L::load(&block.base_radius),
        slope: L::load(&block.slope),
        capped: L::load(&block.capped),
    };
    let crossings = shapes::intersect_cone(beam, &columns);
    for (crossing, part) in crossings.iter().zip(PARTS) {
        let t = crossing.t.max(near).min(far);
        let met = L::bits(L::and(L::and(open, crossing.met), t.le(limit)));
        if met == 0 {
            continue;
        }
        let (t, enters) = (t.store(), L::bits(crossing.enters));
        for lane in lanes(met) {
            let number = block.numbers[lane];
            let side = if enters >> lane & 1 == 1 { NO_FRONT } else { NO_BACK };
            if number & side == 0 {
                best.offer(t[lane], number & !(NO_FRONT | NO_BACK), 0, t[lane], part as u8 as f32);
            }
        }
    }
}

#[inline(always)]
fn offer_spans<L: Wide>(met: L::Mask, [near, far]: [L; 2], numbers: &[u32; LANES], best: &mut ClosestHit) {
    let (zero, limit) = (L::splat(0.0), L::splat(best.t));
    // Whatever side shows, the hit is at `near` or behind it.
    let met = L::bits(L::and(met, L::and(near.le(limit), zero.lt(far))));
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
