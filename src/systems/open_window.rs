//! Objects of a window whose later frames are not known, as while a scene is edited.
//!
//! A window of a sequence knows all states of all objects before its first frame is traced. Here any object may change
//! next, and to anything. So while samples are traced it is noted which objects their rays crossed, each object as it is
//! then, or a few neighbours together; and which cells of a coarse grid around all of them. A state that an object takes
//! later is known by the cells that it touches: samples whose rays crossed none of them cannot see it.

use crate::base::limits;
use crate::trace::primitive::Bounds;
use crate::trace::reuse::Kdop;

use super::reuse_bounds::ReuseBounds;

/// Bits of cells; the others are of objects. All of them together must not fill a word, which stands for rays that were
/// not tested.
const CELLS: usize = 16;
/// Bits of objects.
const CLUSTERS: usize = 63 - CELLS;
/// How far the grid reaches beyond the objects, in sizes of all of them.
const MARGIN: f32 = 1.0;

/// The regions that rays are tested against, with their bits, and what is known of the objects.
#[derive(Debug, Default)]
pub struct OpenObjects {
    /// The cells of the grid; the bit of each is its number.
    cells: Vec<Bounds>,
    around: Bounds,
    /// Objects in the frame that was added last.
    latest: Vec<ReuseBounds>,
}

/// The objects of a first frame, with the bits of each (0 for those that are not there or reach everywhere), and the
/// regions that rays are tested against with theirs.
pub type FirstFrame = (OpenObjects, Vec<u64>, Vec<(Kdop, u64)>);

/// What an object is in a frame that is added.
pub enum NextState {
    Same,
    Gone,
    /// It has a state that it has not had in the frame before, with these bits.
    New(u64),
    /// It reaches everywhere, or beyond the grid.
    Unbounded,
}

impl OpenObjects {
    /// Starts with these objects; `None` if there are too many, or none that has a size.
    pub fn new(objects: &[ReuseBounds]) -> Option<FirstFrame> {
        let place = |object: &ReuseBounds| match object {
            ReuseBounds::Bounded { place, .. } => Some(*place),
            ReuseBounds::Nothing | ReuseBounds::Everywhere { .. } => None,
        };
        let mut bounded: Vec<(usize, Kdop)> =
            objects.iter().enumerate().filter_map(|(i, object)| Some((i, place(object)?))).collect();
        if bounded.is_empty() || bounded.len() > limits::REUSE_CHANGED_ENTITIES {
            return None;
        }
        let all = bounded.iter().fold(Bounds::default(), |all, (_, place)| all.union(place.bounds()));
        let room = glam::Vec3::splat(all.size().max_element().max(1e-3) * MARGIN);
        let around = Bounds { min: all.min - room, max: all.max + room };
        let cells = cells(all, around);
        let mut bits = vec![0; objects.len()];
        let mut regions: Vec<(Kdop, u64)> = cells.iter().enumerate().map(|(i, cell)| (kdop(*cell), 1 << i)).collect();
        let mut cluster = CELLS;
        let room_for_regions = limits::REUSE_BOUNDS - regions.len();
        let merges = bounded.len() > room_for_regions;
        split(&mut bounded, CLUSTERS, &mut |members| {
            let bit = 1u64 << cluster;
            cluster += 1;
            members.iter().for_each(|(object, _)| bits[*object] = bit);
            if merges {
                let union = members.iter().fold(Kdop::default(), |all, (_, place)| all.union(*place));
                regions.push((union, bit));
            } else {
                regions.extend(members.iter().map(|(_, place)| (*place, bit)));
            }
        });
        Some((OpenObjects { cells, around, latest: objects.to_vec() }, bits, regions))
    }

    /// What each object is in the next frame; there may be more of them or fewer.
    pub fn next(&mut self, objects: &[ReuseBounds]) -> Vec<NextState> {
        let nothing = ReuseBounds::Nothing;
        let count = self.latest.len().max(objects.len());
        let next = |i: usize| {
            let (before, now) = (self.latest.get(i).unwrap_or(&nothing), objects.get(i).unwrap_or(&nothing));
            match (before, now) {
                _ if is_same(before, now) => NextState::Same,
                (ReuseBounds::Everywhere { .. }, _) | (_, ReuseBounds::Everywhere { .. }) => NextState::Unbounded,
                (_, ReuseBounds::Nothing) => NextState::Gone,
                (_, ReuseBounds::Bounded { place, .. }) => self.touched(place.bounds()),
            }
        };
        let states = (0..count).map(next).collect();
        self.latest = objects.to_vec();
        self.latest.resize(count, ReuseBounds::Nothing);
        states
    }

    fn touched(&self, place: Bounds) -> NextState {
        if !(place.min.cmpge(self.around.min).all() && place.max.cmple(self.around.max).all()) {
            return NextState::Unbounded;
        }
        let touches = |cell: &Bounds| cell.min.cmple(place.max).all() && cell.max.cmpge(place.min).all();
        let bit = |(i, cell): (usize, &Bounds)| if touches(cell) { 1u64 << i } else { 0 };
        NextState::New(self.cells.iter().enumerate().map(bit).fold(0, |bits, bit| bits | bit))
    }
}

/// How a mesh is stored is in the digest by then; its address says nothing from one reading of a file to the next.
fn is_same(a: &ReuseBounds, b: &ReuseBounds) -> bool {
    match (a, b) {
        (ReuseBounds::Bounded { digest: a, .. }, ReuseBounds::Bounded { digest: b, .. })
        | (ReuseBounds::Everywhere { digest: a }, ReuseBounds::Everywhere { digest: b }) => a == b,
        (ReuseBounds::Nothing, ReuseBounds::Nothing) => true,
        _ => false,
    }
}

/// Cells that fill a box, nearly cubes: halves of the longest one, again and again; those at the rim of the objects reach
/// out to the rim of all.
fn cells(objects: Bounds, around: Bounds) -> Vec<Bounds> {
    let mut cells = vec![objects];
    while cells.len() < CELLS {
        cells = cells
            .into_iter()
            .flat_map(|cell| {
                let size = cell.size();
                let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
                let (mut low, mut high) = (cell, cell);
                let middle = 0.5 * (cell.min[axis] + cell.max[axis]);
                (low.max[axis], high.min[axis]) = (middle, middle);
                [low, high]
            })
            .collect();
    }
    for cell in &mut cells {
        for axis in 0..3 {
            if cell.min[axis] <= objects.min[axis] {
                cell.min[axis] = around.min[axis];
            }
            if cell.max[axis] >= objects.max[axis] {
                cell.max[axis] = around.max[axis];
            }
        }
    }
    cells
}

fn kdop(cell: Bounds) -> Kdop {
    let (min, max) = (cell.min.as_dvec3(), cell.max.as_dvec3());
    Kdop::new(|d| (d * min).max(d * max).element_sum())
}

/// Divides objects into `clusters` groups at most of those that lie near each other.
fn split(objects: &mut [(usize, Kdop)], clusters: usize, found: &mut impl FnMut(&[(usize, Kdop)])) {
    if objects.len() <= 1 || clusters <= 1 {
        return found(objects);
    }
    let middle = |(_, place): &(usize, Kdop)| place.bounds().center();
    let centers: Vec<_> = objects.iter().map(middle).collect();
    let sides = Bounds::around(&centers).size();
    let axis = (0..3).max_by(|a, b| sides[*a].total_cmp(&sides[*b])).unwrap_or(0);
    objects.sort_by(|a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
    let half = clusters / 2;
    let (left, right) = objects.split_at_mut(objects.len() * half / clusters);
    if !left.is_empty() {
        split(left, half, found);
    }
    split(right, clusters - half, found);
}
