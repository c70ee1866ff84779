//! A uniform grid of two levels, walked cell by cell (Amanatides and Woo 1987), or slice by slice with the rays of a
//! packet (Wald, Ize, Kensler, Knoll and Parker 2006).
//!
//! A primitive is listed in every cell that it touches, in blocks of eight that are tested side by side; mailboxes per
//! worker keep what a ray or a packet meets again from being tested again where that costs more than asking. A cell
//! that holds much more than its share has a grid of its own: "a teapot in a stadium". A few primitives that would
//! stretch the grid over empty space, the floor under a small model, stand outside of it and are tested first.
//!
//! Primitives are listed with a pad by more than the walk and the tests of primitives err, so that a cell which
//! rounding makes the walk miss is one in which nothing stands alone: no hit is ever lost, and the grid answers as
//! brute force does. A [`Model`] has a grid of its own, into which the ray is carried by its instances.

mod build;
mod packet;
mod walk;

use std::sync::Arc;

use glam::Vec3;

use super::Worker;
use super::leaves::{Child, Leaves};
use super::packet::{GROUPS, Group, Packet, Structure};
use crate::components::MeshData;
use crate::trace::Geometry;
use crate::trace::geometry::{Best, Bounds, Model};
use crate::trace::shapes::Probe;
use crate::trace::simd::{Wide, Width};

/// Padding of every bound, in lengths of the scene's diagonal. A ray starts at most four and a half diagonals away from
/// whatever it meets; there, a walk and a test of a primitive together err by less than 3e-6 of one.
const PAD: f32 = 5e-6;

/// What a cell holds: nothing, a grid, or blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell(u32);

enum Content {
    Nothing,
    /// Index of a level.
    Level(usize),
    /// Where a run of blocks starts.
    Run(usize),
}

impl Cell {
    const EMPTY: Cell = Cell(0);
    const LEVEL: u32 = 1 << 31;

    #[inline(always)]
    fn content(self) -> Content {
        if self.0 == 0 {
            Content::Nothing
        } else if self.0 & Cell::LEVEL != 0 {
            Content::Level((self.0 & !Cell::LEVEL) as usize)
        } else {
            Content::Run(self.0 as usize)
        }
    }
}

/// A box cut into equal cells.
#[derive(Clone, Debug)]
struct Level {
    bounds: Bounds,
    counts: [u32; 3],
    size: Vec3,
    per_size: Vec3,
    /// Where its cells start, x fastest.
    first: usize,
}

impl Level {
    fn cells(&self) -> usize {
        self.counts.iter().map(|c| *c as usize).product()
    }

    #[inline(always)]
    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.counts[1] as usize + y as usize) * self.counts[0] as usize + x as usize
    }

    /// The cell of a point, given from the least corner; the nearest one if it lies outside.
    #[inline(always)]
    fn cell_of(&self, from_corner: Vec3) -> [u32; 3] {
        let at = from_corner * self.per_size;
        // The cast of a float saturates: below 0 is 0, NaN is 0.
        std::array::from_fn(|axis| (at[axis] as u32).min(self.counts[axis] - 1))
    }
}

/// A grid, the grids in its cells, and what they hold.
#[derive(Clone, Debug)]
struct Nest {
    /// The outer one first.
    levels: Vec<Level>,
    cells: Vec<Cell>,
    /// Blocks of cells; [`Child::NONE`] ends a run. The first run is empty.
    runs: Vec<Child>,
    leaves: Leaves,
    /// Run of what stands outside.
    outside: usize,
    /// Bounds of everything, and its greatest coordinate.
    bounds: Bounds,
    extent: f32,
    pad: f32,
    density: f64,
}

impl Nest {
    fn bytes(&self) -> usize {
        size_of_val(&self.levels[..]) + size_of_val(&self.cells[..]) + size_of_val(&self.runs[..]) + self.leaves.bytes()
    }

    #[inline(always)]
    fn run(&self, start: usize) -> impl Iterator<Item = Child> {
        let mut at = start;
        std::iter::from_fn(move || {
            let child = self.runs[at];
            at += 1;
            (child != Child::NONE).then_some(child)
        })
    }
}

/// The world's grid, and those of its models.
pub struct Grid {
    world: Nest,
    models: Vec<(Arc<MeshData>, Arc<Nest>)>,
    width: Width,
}

impl Grid {
    /// `density` is in cells per primitive; `before` may be any grid: what it holds of the same meshes is not built
    /// again.
    pub fn build(geometry: &Geometry, density: f64, width: Width, before: Option<&Grid>) -> Self {
        let known = before.map_or(&[][..], |grid| &grid.models);
        let pad = geometry.bounds().size().length() * PAD;
        // The pad in the space of each model: that of the world where its instances make it largest there.
        let mut pads = vec![0.0f32; geometry.models().len()];
        for instance in geometry.instances() {
            let pad = pad * instance.map.to_local.to_cols_array().iter().map(|x| x * x).sum::<f32>().sqrt();
            let most = &mut pads[instance.model as usize];
            *most = most.max(pad);
        }
        let nest = |(model, pad): (&Model, f32)| {
            let same = known.iter().find(|(mesh, nest)| {
                Arc::ptr_eq(mesh, &model.mesh) && (pad..=4.0 * pad).contains(&nest.pad) && nest.density == density
            });
            let built = || Arc::new(build::nest(model, model.mesh.triangles.len() as u32, density, 2.0 * pad));
            (model.mesh.clone(), same.map_or_else(built, |(_, nest)| nest.clone()))
        };
        let models = geometry.models().iter().zip(pads).map(nest).collect();
        Grid { world: build::nest(geometry, geometry.finite(), density, pad), models, width }
    }

    pub fn bytes(&self) -> usize {
        self.world.bytes() + self.models.iter().map(|(_, nest)| nest.bytes()).sum::<usize>()
    }
}

impl Structure for Grid {
    fn width(&self) -> Width {
        self.width
    }

    fn make_room(&self, _: &mut Worker) {}

    #[inline(always)]
    fn one<L: Wide, const ANY: bool>(&self, geometry: &Geometry, probe: &Probe, best: &mut Best, worker: &mut Worker) {
        walk::world::<L, ANY>(self, geometry, probe, best, worker);
    }

    #[inline(always)]
    fn many<L: Wide, const ANY: bool>(
        &self,
        packet: Packet,
        groups: &mut [Group<L>; GROUPS],
        worker: &mut Worker,
    ) -> bool {
        packet::descend::<L, ANY>(self, packet, groups, worker)
    }
}
