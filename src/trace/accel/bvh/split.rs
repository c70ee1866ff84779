//! Where to split a range: the surface area heuristic over bins (Wald 2007).

use glam::Vec4;
use rayon::prelude::*;

use super::prim_ref::{Extent, FORK, PrimRange, PrimRef};
use crate::trace::simd::LANES;

/// Slices of an axis among which a split is chosen. Eight of the longest axis alone, for trees that last one frame,
/// build hardly faster (0.97 of the time): it goes into reading and moving references, not into the choice.
const BINS: usize = 32;

/// Parts in which such a range is binned.
const PARTS: usize = 8;

/// Deeper than this, ranges are split in the middle: the stack of a walk stays bounded.
const DEEPEST: usize = 40;

/// What so many in a box are expected to cost where leaves take `block` of them: half by number, half by leaf.
#[inline]
pub fn cost(around: &Extent, count: usize, block: usize) -> f32 {
    around.half_area() * (count.div_ceil(block) * block + count) as f32
}

/// Where primitives fall along each axis.
pub struct SahBins {
    count: usize,
    base: Vec4,
    scale: Vec4,
    extents: [[Extent; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl SahBins {
    pub(super) fn new() -> Box<SahBins> {
        let (extents, counts) = ([[Extent::EMPTY; BINS]; 3], [[0; BINS]; 3]);
        Box::new(SahBins { count: 0, base: Vec4::ZERO, scale: Vec4::ZERO, extents, counts })
    }

    /// Makes the bins ready for a range.
    fn reset(&mut self, range: &PrimRange) {
        self.count = BINS.min(4 + range.refs.len() / 16);
        for axis in 0..3 {
            self.extents[axis][..self.count].fill(Extent::EMPTY);
            self.counts[axis][..self.count].fill(0);
        }
        let size = range.centroids.high - range.centroids.low;
        // Flat axes go to bin 0; the last centroid falls inside the last bin.
        let end = self.count as f32 - 0.01;
        self.base = range.centroids.low;
        self.scale = size.map(|s| if s > 0.0 && (end / s).is_finite() { end / s } else { 0.0 });
    }

    #[inline(always)]
    fn place(&self, r: &PrimRef) -> [usize; 3] {
        /// 2^15: a small number added to it stands in its lowest bits, eight of them behind the point.
        const FIXED: Vec4 = Vec4::splat(32_768.0);
        let at = (r.doubled_centroid() - self.base) * self.scale + FIXED;
        let bin = |x: f32| x.to_bits() as usize >> 8 & (BINS - 1);
        [bin(at.x), bin(at.y), bin(at.z)]
    }

    fn fill(&mut self, refs: &[PrimRef]) {
        for r in refs {
            let [x, y, z] = self.place(r);
            self.extents[0][x].add(r.low, r.high);
            self.extents[1][y].add(r.low, r.high);
            self.extents[2][z].add(r.low, r.high);
            self.counts[0][x] += 1;
            self.counts[1][y] += 1;
            self.counts[2][z] += 1;
        }
    }

    fn merge(&mut self, other: &SahBins) {
        for axis in 0..3 {
            for i in 0..self.count {
                self.extents[axis][i] = self.extents[axis][i].union(other.extents[axis][i]);
                self.counts[axis][i] += other.counts[axis][i];
            }
        }
    }

    /// The cheapest split where leaves take so many: axis, and the first bin on its far side.
    fn choose(&self, block: usize) -> Option<(usize, usize)> {
        let cost = |extent: &Extent, count: u32| cost(extent, count as usize, block);
        let mut best = (f32::INFINITY, None);
        for axis in 0..3 {
            if self.scale[axis] == 0.0 {
                continue;
            }
            let (extents, counts) = (&self.extents[axis], &self.counts[axis]);
            let mut above = [f32::INFINITY; BINS];
            let (mut extent, mut count) = (Extent::EMPTY, 0);
            for i in (1..self.count).rev() {
                extent = extent.union(extents[i]);
                count += counts[i];
                if count > 0 {
                    above[i] = cost(&extent, count);
                }
            }
            let (mut extent, mut count) = (Extent::EMPTY, 0);
            for (first, above) in above.iter().enumerate().take(self.count).skip(1) {
                extent = extent.union(extents[first - 1]);
                count += counts[first - 1];
                let total = cost(&extent, count) + above;
                if count > 0 && total < best.0 {
                    best = (total, Some((axis, first)));
                }
            }
        }
        best.1
    }
}

/// The cheapest halves of a range.
pub fn split<'a>(range: PrimRange<'a>, block: usize, bins: &mut SahBins, depth: usize) -> [PrimRange<'a>; 2] {
    if range.refs.len() <= LANES && range.mixed() {
        return by_kind(range);
    }
    bins.reset(&range);
    if range.refs.len() > FORK {
        let chunks = range.refs.par_chunks(range.refs.len().div_ceil(PARTS)).map(|refs| {
            let mut bins = SahBins::new();
            bins.reset(&range);
            bins.fill(refs);
            bins
        });
        chunks.collect::<Vec<_>>().iter().for_each(|part| bins.merge(part));
    } else {
        bins.fill(range.refs);
    }
    let chosen = if depth > DEEPEST { None } else { bins.choose(block) };
    let Some((axis, first)) = chosen else {
        let (a, b) = range.refs.split_at_mut(range.refs.len() / 2);
        return [PrimRange::new(a), PrimRange::new(b)];
    };
    let mut centroids = [Extent::EMPTY; 2];
    let (mut i, mut j) = (0, range.refs.len());
    // Everything before i goes to the near side, everything from j to the far one.
    while i < j {
        let r = range.refs[i];
        let side = usize::from(bins.place(&r)[axis] >= first);
        centroids[side].add(r.doubled_centroid(), r.doubled_centroid());
        if side == 0 {
            i += 1;
        } else {
            j -= 1;
            range.refs.swap(i, j);
        }
    }
    let side = |part: &[Extent]| part.iter().fold(Extent::EMPTY, |e, bin| e.union(*bin));
    let bounds = [side(&bins.extents[axis][..first]), side(&bins.extents[axis][first..bins.count])];
    let (a, b) = range.refs.split_at_mut(i);
    [
        PrimRange { refs: a, bounds: bounds[0], centroids: centroids[0] },
        PrimRange { refs: b, bounds: bounds[1], centroids: centroids[1] },
    ]
}

/// The kind of the first reference, and the others.
fn by_kind(range: PrimRange) -> [PrimRange; 2] {
    range.refs.sort_unstable_by_key(|r| (r.held(), r.number()));
    let first = range.refs[0].held();
    let (a, b) = range.refs.split_at_mut(range.refs.partition_point(|r| r.held() == first));
    [PrimRange::new(a), PrimRange::new(b)]
}
