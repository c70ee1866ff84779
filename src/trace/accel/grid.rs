//! A uniform grid, walked cell by cell (Amanatides and Woo 1987) with mailboxes per worker.
//!
//! A primitive is listed in every cell that its bounds touch. Bounds are padded by far more than the walk can err, so
//! that a cell which rounding makes the walk miss is one in which nothing stands alone: no hit is ever lost, and the
//! grid answers as brute force does. A few primitives that would stretch the grid over empty space (the floor under a
//! small model: "a teapot in a stadium") are kept out of it and tested with every ray.

use glam::Vec3;

use super::Worker;
use crate::base::limits;
use crate::trace::Geometry;
use crate::trace::geometry::{Best, Bounds};
use crate::trace::shapes::{Probe, slab};
use crate::trace::simd::V3;

/// Padding of every bound, in lengths of the scene's diagonal. A ray starts at most four diagonals away, where
/// positions are good to about 2e-6 of one.
const PAD: f32 = 1e-5;

/// At most this many primitives are kept out of the grid: each costs every ray a test.
const MOST_LARGE: usize = 16;

pub struct Grid {
    bounds: Bounds,
    cells: [u32; 3],
    cell_size: Vec3,
    /// Where each cell's list starts in `members`, x fastest; one more at the end.
    starts: Vec<u32>,
    members: Vec<u32>,
    /// Primitives outside the grid.
    large: Vec<u32>,
    /// A distance along a ray by which the walk may err.
    slack: f32,
}

impl Grid {
    /// `density` is in cells per primitive.
    pub fn build(geometry: &Geometry, density: f64) -> Self {
        let boxes: Vec<Bounds> = (0..geometry.finite()).map(|n| geometry.bounds_of(n)).collect();
        let pad = geometry.bounds().size().length() * PAD;
        let large = choose_large(&boxes);
        let mut inside = vec![true; boxes.len()];
        large.iter().for_each(|n| inside[*n as usize] = false);
        let members = || (0..boxes.len()).filter(|n| inside[*n]);
        let mut bounds = members().fold(Bounds::default(), |b, n| b.union(boxes[n]));
        let count = boxes.len() - large.len();
        if count > 0 {
            bounds = Bounds { min: bounds.min - pad, max: bounds.max + pad };
        }
        let cells = resolution(bounds.size(), count, density);
        let cell_size = bounds.size() / Vec3::new(cells[0] as f32, cells[1] as f32, cells[2] as f32);
        let mut grid =
            Grid { bounds, cells, cell_size, starts: Vec::new(), members: Vec::new(), large, slack: 2.0 * pad };
        grid.fill(&boxes, pad, members);
        grid
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + size_of_val(&self.members[..])
    }

    /// Lists the members of every cell in two passes: count, then place.
    fn fill<I: Iterator<Item = usize>>(&mut self, boxes: &[Bounds], pad: f32, members: impl Fn() -> I) {
        let total = self.cells.iter().map(|c| *c as usize).product::<usize>();
        let mut starts = vec![0u32; total + 1];
        for n in members() {
            self.each_cell(&boxes[n], pad, |cell| starts[cell + 1] += 1);
        }
        for i in 0..total {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut listed = vec![0u32; starts[total] as usize];
        for n in members() {
            self.each_cell(&boxes[n], pad, |cell| {
                listed[next[cell] as usize] = n as u32;
                next[cell] += 1;
            });
        }
        self.starts = starts;
        self.members = listed;
    }

    fn each_cell(&self, bounds: &Bounds, pad: f32, mut visit: impl FnMut(usize)) {
        let low = self.cell_of(bounds.min - pad);
        let high = self.cell_of(bounds.max + pad);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    visit(self.index([x, y, z]));
                }
            }
        }
    }

    fn cell_of(&self, point: Vec3) -> [u32; 3] {
        let at = (point - self.bounds.min) / self.cell_size;
        // The cast of a float saturates: below 0 is 0, NaN is 0.
        std::array::from_fn(|axis| (at[axis] as u32).min(self.cells[axis] - 1))
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.cells[1] as usize + y as usize) * self.cells[0] as usize + x as usize
    }

    /// Tests the primitives along the ray in the order of their cells until none can be nearer than the best.
    pub fn walk<const ANY: bool>(&self, geometry: &Geometry, probe: &Probe, best: &mut Best, worker: &mut Worker) {
        worker.counters.intersection_tests += self.large.len() as u64;
        self.large.iter().for_each(|n| geometry.test(*n, probe, best));
        if (ANY && best.found) || self.members.is_empty() {
            return;
        }
        let [near, far] = slab::<f32>(&probe.beam(), V3::splat(self.bounds.min), V3::splat(self.bounds.max));
        let enter = near.max(0.0);
        if enter > far + self.slack || enter > best.t + self.slack {
            return;
        }
        worker.next_ray();
        let mut walk = Walk::new(self, probe, self.cell_of(probe.origin + probe.direction * enter));
        loop {
            worker.counters.steps += 1;
            let list = self.starts[walk.index] as usize..self.starts[walk.index + 1] as usize;
            for n in &self.members[list] {
                if worker.is_new(*n) {
                    worker.counters.intersection_tests += 1;
                    geometry.test(*n, probe, best);
                }
            }
            if ANY && best.found {
                return;
            }
            if !walk.step(best.t + self.slack) {
                return;
            }
        }
    }
}

/// Where a ray is among the cells, and the planes between them as it meets them.
struct Walk {
    /// Position of the cell in the grid's lists.
    index: usize,
    /// What a step along each axis adds to it.
    stride: [usize; 3],
    /// Steps along each axis that stay inside the grid.
    left: [u32; 3],
    /// Distance to the plane where the ray leaves the cell along each axis: start + plane * pitch.
    next: [f32; 3],
    start: [f32; 3],
    pitch: [f32; 3],
    plane: [f32; 3],
    /// What a step adds to the number of the plane: 1 or -1.
    toward: [f32; 3],
}

impl Walk {
    #[inline]
    fn new(grid: &Grid, probe: &Probe, cell: [u32; 3]) -> Self {
        let strides = [1, grid.cells[0] as usize, grid.cells[0] as usize * grid.cells[1] as usize];
        let mut walk = Walk {
            index: grid.index(cell),
            stride: strides,
            left: [0; 3],
            next: [f32::INFINITY; 3],
            start: ((grid.bounds.min - probe.origin) * probe.inverse).to_array(),
            pitch: (grid.cell_size * probe.inverse).to_array(),
            plane: [0.0; 3],
            toward: [1.0; 3],
        };
        for axis in 0..3 {
            let d = probe.direction[axis];
            if d == 0.0 {
                // Never left along this axis.
                continue;
            }
            if d > 0.0 {
                walk.plane[axis] = (cell[axis] + 1) as f32;
                walk.left[axis] = grid.cells[axis] - 1 - cell[axis];
            } else {
                walk.plane[axis] = cell[axis] as f32;
                walk.left[axis] = cell[axis];
                walk.stride[axis] = strides[axis].wrapping_neg();
                walk.toward[axis] = -1.0;
            }
            walk.next[axis] = walk.start[axis] + walk.plane[axis] * walk.pitch[axis];
        }
        walk
    }

    /// Moves on to the next cell; false at the edge of the grid, or where that cell begins beyond `limit`.
    #[inline]
    fn step(&mut self, limit: f32) -> bool {
        let [x, y, z] = self.next;
        let axis = if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        if limit < self.next[axis] || self.left[axis] == 0 {
            return false;
        }
        self.left[axis] -= 1;
        self.index = self.index.wrapping_add(self.stride[axis]);
        self.plane[axis] += self.toward[axis];
        // From the start each time: a running sum would drift over a thousand cells.
        self.next[axis] = self.start[axis] + self.plane[axis] * self.pitch[axis];
        true
    }
}

/// Cells per axis: cubes, as many as `density` asks for (Woo's rule as Havran states it).
fn resolution(size: Vec3, count: usize, density: f64) -> [u32; 3] {
    let size = size.as_dvec3();
    let longest = size.max_element();
    if count == 0 || longest <= 0.0 {
        return [1; 3];
    }
    let wanted = (count as f64 * density).min(limits::GRID_CELLS as f64 / 2.0);
    // An axis that is nearly flat has one cell and does not count for the volume.
    let size = size.max(glam::DVec3::splat(longest * 1e-4));
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
    size.to_array().map(|s| ((s / side) as u32).clamp(1, limits::GRID_SIDE))
}

/// The primitives that are better kept out: few, large, and without them the rest is much smaller.
fn choose_large(boxes: &[Bounds]) -> Vec<u32> {
    let extent = |b: &Bounds| b.size().max_element();
    let mut by_size: Vec<u32> = (0..boxes.len() as u32).collect();
    if boxes.len() > MOST_LARGE {
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
