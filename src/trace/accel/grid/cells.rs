//! Cells, and a grid with the grids in its cells.

use glam::Vec3;

use crate::trace::accel::leaves::{Leaves, NodeRef};
use crate::trace::primitive::Bounds;

/// What a cell holds: nothing, a grid, or blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridCell(pub u32);

pub enum CellContent {
    Nothing,
    /// Index of a level.
    Level(usize),
    /// Where a run of blocks starts.
    Run(usize),
}

impl GridCell {
    pub(super) const EMPTY: GridCell = GridCell(0);
    pub(super) const LEVEL: u32 = 1 << 31;

    #[inline(always)]
    pub(super) fn content(self) -> CellContent {
        if self.0 == 0 {
            CellContent::Nothing
        } else if self.0 & GridCell::LEVEL != 0 {
            CellContent::Level((self.0 & !GridCell::LEVEL) as usize)
        } else {
            CellContent::Run(self.0 as usize)
        }
    }
}

/// A box cut into equal cells.
#[derive(Clone, Debug)]
pub struct GridLevel {
    pub(super) bounds: Bounds,
    pub(super) counts: [u32; 3],
    pub(super) size: Vec3,
    pub(super) per_size: Vec3,
    /// Where its cells start, x fastest.
    pub(super) first: usize,
}

impl GridLevel {
    pub(super) fn cells(&self) -> usize {
        self.counts.iter().map(|c| *c as usize).product()
    }

    #[inline(always)]
    pub(super) fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.counts[1] as usize + y as usize) * self.counts[0] as usize + x as usize
    }

    /// The cell of a point, given from the least corner; the nearest one if it lies outside.
    #[inline(always)]
    pub(super) fn cell_of(&self, from_corner: Vec3) -> [u32; 3] {
        let at = from_corner * self.per_size;
        // The cast of a float saturates: below 0 is 0, NaN is 0.
        std::array::from_fn(|axis| (at[axis] as u32).min(self.counts[axis] - 1))
    }
}

/// A grid, the grids in its cells, and what they hold.
#[derive(Clone, Debug)]
pub struct NestedGrid {
    /// The outer one first.
    pub(super) levels: Vec<GridLevel>,
    pub(super) cells: Vec<GridCell>,
    /// Blocks of cells; [`NodeRef::NONE`] ends a run. The first run is empty.
    pub(super) runs: Vec<NodeRef>,
    pub(super) leaves: Leaves,
    /// Run of what stands outside.
    pub(super) outside: usize,
    /// Bounds of everything, and its greatest coordinate.
    pub(super) bounds: Bounds,
    pub(super) extent: f32,
    pub(super) pad: f32,
    pub(super) density: f64,
}

impl NestedGrid {
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.levels[..]) + size_of_val(&self.cells[..]) + size_of_val(&self.runs[..]) + self.leaves.bytes()
    }

    #[inline(always)]
    pub(super) fn run(&self, start: usize) -> impl Iterator<Item = NodeRef> {
        let mut at = start;
        std::iter::from_fn(move || {
            let child = self.runs[at];
            at += 1;
            (child != NodeRef::NONE).then_some(child)
        })
    }
}
