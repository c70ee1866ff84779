//! Building a grid: its resolution, what each cell lists, and which cells get grids of their own.

use glam::{DVec3, Vec3};

use super::cells::{GridCell, GridLevel, NestedGrid};
use crate::base::limits;
use crate::trace::accel::HiddenPrimitives;
use crate::trace::accel::leaves::{BuildInput, Leaves, NodeKind, NodeRef};
use crate::trace::primitive::Bounds;
use crate::trace::simd::LANES;

/// At most this many primitives stand outside of the grid: each costs every ray a test.
const MOST_LARGE: usize = 16;

/// A cell that lists more than this gets a grid of its own.
const DENSE: usize = 48;

/// Least side of a cell, in pads: nearer to them, primitives would be listed in cells that they do not touch.
const LEAST_SIDE: f32 = 6.0;

/// Lists the first `count` primitives of a source, but for those that are hidden.
pub fn nest<S: BuildInput>(source: &S, count: u32, density: f64, pad: f32, hidden: &HiddenPrimitives) -> NestedGrid {
    let boxes: Vec<Bounds> = (0..count).map(|n| source.bounds(n)).collect();
    let shown = hidden.shown(count);
    let bounds = shown.iter().fold(Bounds::default(), |b, n| b.union(boxes[*n as usize]));
    let extent = if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() };
    let large = choose_large(&boxes, &shown);
    let mut inside = vec![true; boxes.len()];
    large.iter().for_each(|n| inside[*n as usize] = false);
    let members: Vec<u32> = shown.into_iter().filter(|n| inside[*n as usize]).collect();
    let mut nest = NestedGrid {
        levels: Vec::new(),
        cells: Vec::new(),
        runs: vec![NodeRef::NONE],
        leaves: Leaves::default(),
        outside: 0,
        bounds,
        extent,
        pad,
        density,
    };
    let mut builder = GridBuilder { source, boxes, nest: &mut nest };
    let outside = builder.run(&large);
    builder.nest.outside = outside;
    let everywhere = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
    let outer = builder.level(&members, everywhere, limits::GRID_LISTED);
    let listed = builder.list(&outer, &members);
    builder.fill(&outer, &listed, true);
    nest
}

/// Members by cell, one list after the other.
struct CellLists {
    /// Where each list starts; one more at the end.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl CellLists {
    fn of(&self, cell: usize) -> &[u32] {
        &self.members[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

struct GridBuilder<'a, S> {
    source: &'a S,
    boxes: Vec<Bounds>,
    nest: &'a mut NestedGrid,
}

impl<S: BuildInput> GridBuilder<'_, S> {
    /// Adds a level around what some primitives have in a box, all of its cells empty; lists will hold each of them
    /// `most` times on average.
    fn level(&mut self, members: &[u32], within: Bounds, most: u64) -> GridLevel {
        let pad = self.nest.pad;
        let around = members.iter().fold(Bounds::default(), |b, n| b.union(self.boxes[*n as usize]));
        let bounds = Bounds { min: (around.min - pad).max(within.min), max: (around.max + pad).min(within.max) };
        let mut counts = resolution(bounds.size(), members.len(), self.nest.density, LEAST_SIDE * pad);
        let room = members.len() as u64 * most + 64;
        let level = loop {
            let size = bounds.size() / Vec3::new(counts[0] as f32, counts[1] as f32, counts[2] as f32);
            let per_size = size.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 });
            let level = GridLevel { bounds, counts, size, per_size, first: self.nest.cells.len() };
            let touched = |n: &u32| {
                let [low, high] = self.touched(&level, *n);
                (0..3).map(|axis| u64::from(high[axis] - low[axis] + 1)).product::<u64>()
            };
            // Large primitives among many small ones: coarser, until the lists fit.
            if counts == [1; 3] || members.iter().map(touched).sum::<u64>() <= room {
                break level;
            }
            counts = counts.map(|c| c.div_ceil(2));
        };
        self.nest.cells.resize(level.first + level.cells(), GridCell::EMPTY);
        self.nest.levels.push(level.clone());
        level
    }

    /// The cells that the bounds of a primitive touch.
    fn touched(&self, level: &GridLevel, number: u32) -> [[u32; 3]; 2] {
        let (bounds, pad) = (self.boxes[number as usize], self.nest.pad);
        let corner = level.bounds.min;
        [level.cell_of(bounds.min - pad - corner), level.cell_of(bounds.max + pad - corner)]
    }

    fn each_cell(&self, level: &GridLevel, number: u32, mut visit: impl FnMut(usize)) {
        let [low, high] = self.touched(level, number);
        let flat = (0..3).filter(|axis| low[*axis] == high[*axis]).count();
        let sheet = (flat < 2 && self.source.held(number) == NodeKind::Triangles)
            .then(|| PlaneTest::new(self.source.corners(number), level, self.nest.pad));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    if sheet.as_ref().is_none_or(|sheet| sheet.touches([x, y, z])) {
                        visit(level.index([x, y, z]));
                    }
                }
            }
        }
    }

    /// Lists members in two passes: count, then place.
    fn list(&self, level: &GridLevel, members: &[u32]) -> CellLists {
        let total = level.cells();
        let mut starts = vec![0u32; total + 1];
        for n in members {
            self.each_cell(level, *n, |cell| starts[cell + 1] += 1);
        }
        for i in 0..total {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut listed = vec![0u32; starts[total] as usize];
        for n in members {
            self.each_cell(level, *n, |cell| {
                listed[next[cell] as usize] = *n;
                next[cell] += 1;
            });
        }
        CellLists { starts, members: listed }
    }

    /// Writes what was listed into the cells of a level.
    fn fill(&mut self, level: &GridLevel, listed: &CellLists, outer: bool) {
        for cell in 0..level.cells() {
            let members = listed.of(cell);
            let at = level.first + cell;
            self.nest.cells[at] = if members.is_empty() {
                GridCell::EMPTY
            } else if cell > 0 && members == listed.of(cell - 1) {
                // A large primitive, or a gap between them: the same blocks serve.
                self.nest.cells[at - 1]
            } else if outer && members.len() > DENSE && self.divides(level, cell, members) {
                GridCell(GridCell::LEVEL | (self.nest.levels.len() as u32 - 1))
            } else {
                GridCell(self.run(members) as u32)
            };
        }
    }

    /// Gives a cell a grid of its own, unless that would list everything everywhere.
    fn divides(&mut self, level: &GridLevel, cell: usize, members: &[u32]) -> bool {
        let [nx, ny] = [level.counts[0] as usize, level.counts[1] as usize];
        let at = Vec3::new((cell % nx) as f32, (cell / nx % ny) as f32, (cell / nx / ny) as f32);
        // Beyond the cell itself by what a walk errs.
        let min = level.bounds.min + at * level.size - self.nest.pad;
        let within = Bounds { min, max: min + level.size + 2.0 * self.nest.pad };
        let (levels, cells) = (self.nest.levels.len(), self.nest.cells.len());
        let inner = self.level(members, within, limits::GRID_LISTED_INSIDE);
        let listed = self.list(&inner, members);
        let fullest = (0..inner.cells()).map(|cell| listed.of(cell).len()).max().unwrap_or(0);
        if 2 * fullest > members.len() {
            self.nest.levels.truncate(levels);
            self.nest.cells.truncate(cells);
            return false;
        }
        self.fill(&inner, &listed, false);
        true
    }

    /// Puts primitives into blocks, kind by kind; gives where their run starts.
    fn run(&mut self, members: &[u32]) -> usize {
        let start = self.nest.runs.len();
        // Numbers go by kind, and members by number.
        for some in members.chunk_by(|a, b| self.source.held(*a) == self.source.held(*b)) {
            for block in some.chunks(LANES) {
                let child = self.nest.leaves.put(self.source, block);
                self.nest.runs.push(child);
            }
        }
        self.nest.runs.push(NodeRef::NONE);
        start
    }
}

/// The plane of a triangle, against cells.
struct PlaneTest {
    normal: DVec3,
    /// Along the normal, from the corner of the level.
    place: f64,
    /// How far a cell with its pad reaches along the normal.
    reach: f64,
    size: DVec3,
}

impl PlaneTest {
    fn new([a, b, c]: [Vec3; 3], level: &GridLevel, pad: f32) -> Self {
        let [a, b, c] = [a, b, c].map(|p| p.as_dvec3() - level.bounds.min.as_dvec3());
        let (normal, size) = ((b - a).cross(c - a), level.size.as_dvec3());
        let reach = (size * 0.5 + f64::from(pad)).dot(normal.abs()) * (1.0 + 1e-6);
        PlaneTest { normal, place: a.dot(normal), reach, size }
    }

    /// False only if the cell is clear of the plane.
    fn touches(&self, [x, y, z]: [u32; 3]) -> bool {
        let middle = (DVec3::new(f64::from(x), f64::from(y), f64::from(z)) + 0.5) * self.size;
        let clear = (middle.dot(self.normal) - self.place).abs() > self.reach;
        !clear
    }
}

/// Cells per axis: cubes, as many as `density` asks for (Woo's rule as Havran states it), none smaller than `least`.
fn resolution(size: Vec3, count: usize, density: f64, least: f32) -> [u32; 3] {
    let size = size.as_dvec3();
    let longest = size.max_element();
    if count == 0 || longest <= 0.0 {
        return [1; 3];
    }
    let wanted = (count as f64 * density).min(limits::GRID_CELLS as f64 / 2.0);
    // An axis that is nearly flat has one cell and does not count for the volume.
    let size = size.max(DVec3::splat(longest * 1e-4));
    let mut side = libm::cbrt(size.x * size.y * size.z / wanted);
    for _ in 0..2 {
        // Where the volume rule leaves an axis with less than one cell, share the cells among the others.
        let thick: Vec<f64> = size.to_array().into_iter().filter(|s| *s >= side).collect();
        side = match thick.len() {
            0 => longest,
            1 => thick[0] / wanted,
            2 => (thick[0] * thick[1] / wanted).sqrt(),
            _ => side,
        };
    }
    let side = side.max(f64::from(least));
    size.to_array().map(|s| ((s / side) as u32).clamp(1, limits::GRID_SIDE))
}

/// The primitives that are better kept out: few, large, and without them the rest is much smaller.
fn choose_large(boxes: &[Bounds], shown: &[u32]) -> Vec<u32> {
    let extent = |b: &Bounds| b.size().max_element();
    let mut by_size: Vec<u32> = shown.to_vec();
    if by_size.len() > MOST_LARGE {
        let key = |n: &u32| (std::cmp::Reverse(extent(&boxes[*n as usize]).to_bits()), *n);
        by_size.select_nth_unstable_by_key(MOST_LARGE, key);
        by_size[..=MOST_LARGE].sort_unstable_by_key(key);
    } else {
        return Vec::new();
    }
    let (candidates, rest) = by_size.split_at(MOST_LARGE);
    // Bounds of all but the first k, for every k.
    let mut remaining = rest.iter().fold(Bounds::default(), |b, n| b.union(boxes[*n as usize]));
    let mut extents = vec![extent(&remaining)];
    for n in candidates.iter().rev() {
        remaining = remaining.union(boxes[*n as usize]);
        extents.push(extent(&remaining));
    }
    extents.reverse();
    let mut keep_out = 0;
    for k in 1..=MOST_LARGE {
        if extents[k] < 0.5 * extents[keep_out] {
            keep_out = k;
        }
    }
    candidates[..keep_out].to_vec()
}
