//! Walking a grid with the rays of a packet: slice by slice along the axis that they all follow, through the cells that
//! their frustum covers.

use super::cells::{CellContent, GridLevel, NestedGrid};
use super::two_level::Grid;
use super::walk;
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::leaves::{NodeKind, NodeRef};
use crate::trace::accel::packet::{GROUPS, PacketFrustum, RayGroup, RayPacket};
use crate::trace::simd::{LANES, Wide, lanes};

/// Cells that a packet may cover in a slice before it is given up.
const WIDEST: u32 = 16;

/// False if the packet was given up.
#[inline(always)]
pub fn descend<L: Wide, const ANY: bool>(
    grid: &Grid,
    packet: RayPacket,
    groups: &mut [RayGroup<L>; GROUPS],
    scratch: &mut TraversalScratch,
) -> bool {
    let nest = &grid.world;
    let Some(sight) = PacketFrustum::new(groups, nest.bounds, nest.extent) else { return true };
    scratch.next_ray();
    let mut walk = PacketWalk::<L> { grid, packet, groups, scratch, limit: 0.0, last: usize::MAX };
    walk.limit = sight.limit(walk.groups);
    let (mut outer, mut inner) = (Slices::new(&nest.levels[0], &sight), None::<Slices>);
    let mut start = nest.outside;
    loop {
        walk.intersect::<ANY>(&sight, start);
        start = loop {
            let slices = inner.as_mut().unwrap_or(&mut outer);
            let Some(content) = slices.seek(nest, &sight, walk.limit, &mut walk.scratch.counters.steps) else {
                return false;
            };
            match content {
                CellContent::Run(start) => break start,
                CellContent::Level(level) => inner = Some(Slices::new(&nest.levels[level], &sight)),
                CellContent::Nothing if inner.is_some() => inner = None,
                CellContent::Nothing => return true,
            }
        };
    }
}

struct PacketWalk<'a, L: Wide> {
    grid: &'a Grid,
    packet: RayPacket<'a>,
    groups: &'a mut [RayGroup<L>; GROUPS],
    scratch: &'a mut TraversalScratch,
    /// The greatest depth that still matters to any ray.
    limit: f32,
    /// The run that was met last.
    last: usize,
}

impl<L: Wide> PacketWalk<'_, L> {
    /// Tests the blocks of a run.
    #[inline(always)]
    fn intersect<const ANY: bool>(&mut self, sight: &PacketFrustum<L>, start: usize) {
        if start == self.last {
            return;
        }
        self.last = start;
        let grid = self.grid;
        let nest = &grid.world;
        for child in nest.run(start) {
            if child.held() == NodeKind::List {
                self.list::<ANY>(nest, child);
                continue;
            }
            // Most of what a cell holds stands beside the frustum.
            let (numbers, boxes) = nest.leaves.boxes_of::<L>(child);
            let (_, near) = sight.clip(boxes, self.limit);
            let mut which = 0;
            for lane in lanes(near & ((1 << child.count()) - 1)) {
                which |= u32::from(self.scratch.is_new(numbers[lane])) << lane;
            }
            if which != 0 {
                self.scratch.counters.intersection_tests += u64::from(which.count_ones()) * self.packet.len() as u64;
                for group in &mut *self.groups {
                    group.block::<ANY>(&nest.leaves, child, which);
                }
            }
        }
        self.limit = sight.limit(self.groups);
    }

    /// Tests primitives of other kinds, ray by ray.
    #[inline(always)]
    fn list<const ANY: bool>(&mut self, nest: &NestedGrid, child: NodeRef) {
        for &n in &nest.leaves.lists[child.index()][..child.count() as usize] {
            if !self.scratch.is_new(n) {
                continue;
            }
            for (g, group) in self.groups.iter_mut().enumerate() {
                let mut bests = group.bests();
                for (lane, best) in bests.iter_mut().enumerate() {
                    let Some(probe) = self.packet.probe(g * LANES + lane) else { break };
                    let cost = walk::other::<ANY>(self.grid, self.packet.geometry, n, &probe, best);
                    cost.count(&mut self.scratch.counters);
                    if ANY && best.found {
                        best.t = f32::NEG_INFINITY;
                    }
                }
                group.set(&bests);
            }
        }
    }
}

/// Slices of a level along the axis of a packet, from its front to its back.
struct Slices<'a> {
    level: &'a GridLevel,
    axes: [usize; 3],
    /// The slice, how many are left after it, and what leads to the next.
    at: u32,
    left: u32,
    up: bool,
    begun: bool,
    /// Least and greatest cell that the frustum covers in the slice, along the other axes.
    x: [u32; 2],
    y: [u32; 2],
    /// The next of them to be looked into.
    next: [u32; 2],
}

impl<'a> Slices<'a> {
    #[inline(always)]
    fn new<L: Wide>(level: &'a GridLevel, sight: &PacketFrustum<L>) -> Self {
        let axes = sight.axes();
        let axis = axes[2];
        let up = sight.up();
        let [front, back] = sight.range();
        let [low, high] = if up { [front, back] } else { [-back, -front] };
        let last = level.counts[axis] - 1;
        let slice = |at: f32| (((at - level.bounds.min[axis]) * level.per_size[axis]) as u32).min(last);
        let (low_slice, high_slice) = (slice(low), slice(high));
        let (at, to) = if up { (low_slice, high_slice) } else { (high_slice, low_slice) };
        let apart = high < level.bounds.min[axis] || low > level.bounds.max[axis];
        // None are left where the level lies beside the rays' depths: not even the first is begun.
        let left = if apart { 0 } else { at.abs_diff(to) };
        Slices { level, axes, at, left, up, begun: apart, x: [1, 0], y: [1, 0], next: [1, 1] }
    }

    /// What the next cell with something in it holds; nothing where there is none, `None` where rays part ways.
    #[inline(always)]
    fn seek<L: Wide>(
        &mut self,
        nest: &NestedGrid,
        sight: &PacketFrustum<L>,
        limit: f32,
        steps: &mut u64,
    ) -> Option<CellContent> {
        loop {
            let [x, y] = self.next;
            if y > self.y[1] || self.x[0] > self.x[1] {
                if !self.advance(sight, limit) {
                    return Some(CellContent::Nothing);
                }
                self.next = [self.x[0], self.y[0]];
                if self.covers() > WIDEST {
                    return None;
                }
                continue;
            }
            self.next = if x < self.x[1] { [x + 1, y] } else { [self.x[0], y + 1] };
            *steps += 1;
            match nest.cells[self.cell(x, y)].content() {
                CellContent::Nothing => {}
                content => return Some(content),
            }
        }
    }

    /// Goes to the next slice that begins before the depth `limit`.
    #[inline(always)]
    fn advance<L: Wide>(&mut self, sight: &PacketFrustum<L>, limit: f32) -> bool {
        if self.begun {
            if self.left == 0 {
                return false;
            }
            self.left -= 1;
            self.at = if self.up { self.at + 1 } else { self.at - 1 };
        }
        self.begun = true;
        let axis = self.axes[2];
        let low = self.level.bounds.min[axis] + self.at as f32 * self.level.size[axis];
        let high = low + self.level.size[axis];
        let [start, end] = if self.up { [low, high] } else { [-high, -low] };
        if start > limit {
            return false;
        }
        let [front, back] = sight.range();
        let depths = [start.max(front), end.min(back).max(front)];
        let [x, y] = sight.across(depths);
        (self.x, self.y) = (self.cover(self.axes[0], x), self.cover(self.axes[1], y));
        true
    }

    /// The cells between two coordinates; the greatest below the least where there are none.
    #[inline(always)]
    fn cover(&self, axis: usize, [low, high]: [f32; 2]) -> [u32; 2] {
        let GridLevel { bounds, per_size, counts, .. } = self.level;
        let apart = high < bounds.min[axis] || low > bounds.max[axis];
        if apart {
            return [1, 0];
        }
        [low, high].map(|x| (((x - bounds.min[axis]) * per_size[axis]) as u32).min(counts[axis] - 1))
    }

    /// How many cells the slice has under the frustum.
    #[inline(always)]
    fn covers(&self) -> u32 {
        (self.x[1] + 1 - self.x[0]) * (self.y[1] + 1 - self.y[0])
    }

    #[inline(always)]
    fn cell(&self, x: u32, y: u32) -> usize {
        let mut at = [0; 3];
        at[self.axes[0] % 3] = x;
        at[self.axes[1] % 3] = y;
        at[self.axes[2] % 3] = self.at;
        self.level.first + self.level.index(at)
    }
}
