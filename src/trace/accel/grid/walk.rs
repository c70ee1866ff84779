//! Walking a grid with one ray.

use glam::Vec3;

use super::cells::{CellContent, GridCell, GridLevel, NestedGrid};
use super::two_level::Grid;
use crate::trace::accel::TraversalScratch;
use crate::trace::accel::leaves::{HitSpace, NodeKind, TraversalCost, block};
use crate::trace::primitive::{ClosestHit, Geometry, PreparedRay, PrimitiveKind, intersect_box};
use crate::trace::simd::{Kernel, V3, Wide};

/// A walk of the world's grid; the best so far may already be a hit.
#[inline(always)]
pub fn world<L: Wide, const ANY: bool>(
    grid: &Grid,
    geometry: &Geometry,
    probe: &PreparedRay,
    best: &mut ClosestHit,
    scratch: &mut TraversalScratch,
) {
    scratch.next_ray();
    let mut lists = WorldCells { grid, geometry, scratch };
    let cost = nest::<L, ANY, _>(&grid.world, probe, HitSpace::WORLD, best, &mut lists);
    cost.count(&mut scratch.counters);
}

/// [`world`] as a kernel of its own: those who call it are entered by the same processor instructions already, and share
/// one copy.
pub struct RestKernel<'a, const ANY: bool> {
    pub grid: &'a Grid,
    pub geometry: &'a Geometry,
    pub probe: &'a PreparedRay,
    pub best: &'a mut ClosestHit,
    pub scratch: &'a mut TraversalScratch,
}

impl<const ANY: bool> Kernel for RestKernel<'_, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        world::<L, ANY>(self.grid, self.geometry, self.probe, self.best, self.scratch);
    }
}

/// Tests lists of primitives of other kinds in cells. A trait and no closure: what closures compute is left outside of
/// the function that enables AVX2.
trait CellListTester {
    fn test<const ANY: bool>(&mut self, list: &[u32], probe: &PreparedRay, best: &mut ClosestHit) -> TraversalCost;
}

/// Those of the world.
struct WorldCells<'a> {
    grid: &'a Grid,
    geometry: &'a Geometry,
    scratch: &'a mut TraversalScratch,
}

impl CellListTester for WorldCells<'_> {
    #[inline(always)]
    fn test<const ANY: bool>(&mut self, list: &[u32], probe: &PreparedRay, best: &mut ClosestHit) -> TraversalCost {
        let mut cost = TraversalCost::default();
        for &n in list {
            if self.scratch.is_new(n) {
                cost += other::<ANY>(self.grid, self.geometry, n, probe, best);
            }
        }
        cost
    }
}

/// Grids of meshes have none.
struct NoCells;

impl CellListTester for NoCells {
    #[inline(always)]
    fn test<const ANY: bool>(&mut self, _: &[u32], _: &PreparedRay, _: &mut ClosestHit) -> TraversalCost {
        TraversalCost::default()
    }
}

/// A primitive of a kind that has no lanes.
#[inline(always)]
pub fn other<const ANY: bool>(
    grid: &Grid,
    geometry: &Geometry,
    number: u32,
    probe: &PreparedRay,
    best: &mut ClosestHit,
) -> TraversalCost {
    if geometry.kind_of(number) != PrimitiveKind::Instance {
        geometry.intersect(number, probe, best);
        return TraversalCost { steps: 0, tests: 1 };
    }
    grid.width.run(InstanceGridKernel::<ANY> { grid, geometry, number, probe, best })
}

/// Carries the ray into the grid of an instance. A kernel of its own, as [`RestKernel`].
struct InstanceGridKernel<'a, const ANY: bool> {
    grid: &'a Grid,
    geometry: &'a Geometry,
    number: u32,
    probe: &'a PreparedRay,
    best: &'a mut ClosestHit,
}

impl<const ANY: bool> Kernel for InstanceGridKernel<'_, ANY> {
    type Output = TraversalCost;

    #[inline(always)]
    fn run<L: Wide>(self) -> TraversalCost {
        let InstanceGridKernel { grid, geometry, number, probe, best } = self;
        let instance = geometry.instance(number);
        let Some((local, scale, near)) = instance.enter(probe, best.t) else { return TraversalCost::default() };
        let scope = HitSpace::of_instance(number, geometry.tag(number).sides, scale, near);
        nest::<L, ANY, _>(&grid.models[instance.prototype as usize].1, &local, scope, best, &mut NoCells)
    }
}

#[inline(always)]
fn nest<L: Wide, const ANY: bool, T: CellListTester>(
    nest: &NestedGrid,
    probe: &PreparedRay,
    scope: HitSpace,
    best: &mut ClosestHit,
    lists: &mut T,
) -> TraversalCost {
    let mut cost = TraversalCost::default();
    let slack = 2.0 * nest.pad;
    let per_scale = scope.per_scale();
    let (mut outer, mut inner) = (None::<CellWalk>, None::<CellWalk>);
    let (mut entered, mut start) = (false, nest.outside);
    // The run that was met last: a large primitive fills many cells in a row.
    let mut last = usize::MAX;
    loop {
        if start != last {
            last = start;
            for child in nest.run(start) {
                if child.held() == NodeKind::List {
                    cost += lists.test::<ANY>(&nest.leaves.lists[child.index()][..child.count() as usize], probe, best);
                } else {
                    cost.tests += child.count();
                    block::<L>(&nest.leaves, child, probe, scope, best);
                }
            }
            if ANY && best.found {
                return cost;
            }
        }
        let limit = best.t * per_scale + slack;
        if !entered {
            entered = true;
            outer = CellWalk::new(&nest.levels[0], probe, slack, limit);
        }
        start = loop {
            if let Some(walk) = &mut inner {
                match walk.seek(nest, limit, &mut cost.steps) {
                    CellContent::Run(start) => break start,
                    _ => inner = None,
                }
            } else if let Some(walk) = &mut outer {
                match walk.seek(nest, limit, &mut cost.steps) {
                    CellContent::Run(start) => break start,
                    CellContent::Level(level) => inner = CellWalk::new(&nest.levels[level], probe, slack, limit),
                    CellContent::Nothing => return cost,
                }
            } else {
                return cost;
            }
        };
    }
}

/// Where a ray is among the cells, and the planes between them as it meets them.
struct CellWalk {
    /// Position of the cell in the list of all.
    index: usize,
    /// What a step along each axis adds to it.
    stride: [usize; 3],
    /// Distance to the plane where the ray leaves the cell along each axis: start + plane * pitch.
    next: Vec3,
    start: Vec3,
    pitch: Vec3,
    plane: Vec3,
    /// What a step adds to the number of the plane: 1 or -1.
    toward: Vec3,
    /// Distance to the plane where the ray leaves the level.
    end: f32,
    /// Whether the cell has been looked into.
    seen: bool,
}

impl CellWalk {
    /// `None` if the ray does not meet the level before `limit`.
    #[inline(always)]
    fn new(level: &GridLevel, probe: &PreparedRay, slack: f32, limit: f32) -> Option<Self> {
        let GridLevel { bounds, counts, size, .. } = level;
        let [near, far] = intersect_box::<f32>(&probe.beam(), V3::splat(bounds.min), V3::splat(bounds.max));
        let enter = near.max(0.0);
        // Written so that a level without bounds is never entered.
        let meets = enter <= far + slack && enter <= limit;
        if !meets {
            return None;
        }
        // From the corner first: what is added stays small.
        let cell = level.cell_of((probe.origin - bounds.min) + probe.direction * enter);
        let counts = Vec3::new(counts[0] as f32, counts[1] as f32, counts[2] as f32);
        let at = Vec3::new(cell[0] as f32, cell[1] as f32, cell[2] as f32);
        let strides = [1, level.counts[0] as usize, level.counts[0] as usize * level.counts[1] as usize];
        let up = probe.inverse.cmpgt(Vec3::ZERO);
        let toward = Vec3::select(up, Vec3::ONE, Vec3::NEG_ONE);
        let start = (bounds.min - probe.origin) * probe.inverse;
        let pitch = *size * probe.inverse;
        let plane = Vec3::select(up, at + 1.0, at);
        let last = Vec3::select(up, counts, Vec3::ZERO);
        Some(CellWalk {
            index: level.first + level.index(cell),
            stride: [0, 1, 2].map(|axis| if toward[axis] > 0.0 { strides[axis] } else { strides[axis].wrapping_neg() }),
            next: start + plane * pitch,
            start,
            pitch,
            plane,
            toward,
            end: (start + last * pitch).min_element(),
            seen: false,
        })
    }

    /// What the next cell with something in it holds; nothing where there is none before `limit`.
    #[inline(always)]
    fn seek(&mut self, nest: &NestedGrid, limit: f32, steps: &mut u32) -> CellContent {
        loop {
            if self.seen && !self.step(limit) {
                return CellContent::Nothing;
            }
            self.seen = true;
            *steps += 1;
            match nest.cells.get(self.index) {
                Some(&GridCell::EMPTY) => {}
                Some(cell) => return cell.content(),
                None => return CellContent::Nothing,
            }
        }
    }

    /// Moves on to the next cell; false at the edge of the level, or where that cell begins beyond `limit`.
    #[inline(always)]
    fn step(&mut self, limit: f32) -> bool {
        let limit = if self.end < limit { self.end } else { limit };
        // From the start each time: a running sum would drift over a thousand cells. The last plane along each axis is
        // computed like all others, so that its distance is not below the end and the walk stays inside.
        macro_rules! step {
            ($axis:ident, $number:literal) => {{
                if self.next.$axis >= limit {
                    return false;
                }
                self.index = self.index.wrapping_add(self.stride[$number]);
                self.plane.$axis += self.toward.$axis;
                self.next.$axis = self.start.$axis + self.plane.$axis * self.pitch.$axis;
            }};
        }
        let Vec3 { x, y, z } = self.next;
        if x <= y && x <= z {
            step!(x, 0);
        } else if y <= z {
            step!(y, 1);
        } else {
            step!(z, 2);
        }
        true
    }
}
