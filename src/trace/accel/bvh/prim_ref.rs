//! References to primitives while a tree is built, and ranges of them.

use glam::Vec4;
use rayon::prelude::*;

use crate::trace::accel::HiddenPrimitives;
use crate::trace::accel::leaves::{BuildInput, NodeKind};
use crate::trace::primitive::Bounds;

/// Ranges above this are binned on all threads, and their children built on all threads.
pub const FORK: usize = 16 * 1024;

/// Something that is being sorted: its box, with number and kind in the fourth coordinates.
#[derive(Clone, Copy)]
pub struct PrimRef {
    pub low: Vec4,
    pub high: Vec4,
}

/// What makes a number of less than 30 bits one that is not subnormal as a float: to multiply such, which happens to
/// the fourth coordinate beside the others, took a third of a build.
const NORMAL: u32 = 1 << 30;

impl PrimRef {
    #[inline]
    pub fn new(bounds: Extent, number: u32, held: NodeKind) -> Self {
        let (mut low, mut high) = (bounds.low, bounds.high);
        low.w = f32::from_bits(number | NORMAL);
        high.w = f32::from_bits(held as u32 | NORMAL);
        PrimRef { low, high }
    }

    fn of<S: BuildInput>(source: &S, number: u32) -> Self {
        let Bounds { min, max } = source.bounds(number);
        PrimRef::new(Extent { low: min.extend(0.0), high: max.extend(0.0) }, number, source.held(number))
    }

    #[inline]
    pub fn number(&self) -> u32 {
        self.low.w.to_bits() & !NORMAL
    }

    #[inline]
    pub fn held(&self) -> u32 {
        self.high.w.to_bits() & !NORMAL
    }

    #[inline]
    pub fn extent(&self) -> Extent {
        Extent { low: self.low, high: self.high }
    }

    /// Twice the centroid of the box.
    #[inline]
    pub fn doubled_centroid(&self) -> Vec4 {
        self.low + self.high
    }
}

/// The first `count` primitives of a source, but for those that are hidden.
pub fn refs<S: BuildInput>(source: &S, count: u32, hidden: &HiddenPrimitives) -> Vec<PrimRef> {
    if !hidden.is_empty() {
        return hidden.shown(count).into_par_iter().with_min_len(4096).map(|n| PrimRef::of(source, n)).collect();
    }
    (0..count).into_par_iter().with_min_len(4096).map(|n| PrimRef::of(source, n)).collect()
}

/// A box whose fourth coordinates mean nothing.
#[derive(Clone, Copy)]
pub struct Extent {
    pub low: Vec4,
    pub high: Vec4,
}

impl Extent {
    pub const EMPTY: Extent = Extent { low: Vec4::splat(f32::INFINITY), high: Vec4::splat(f32::NEG_INFINITY) };

    #[inline]
    pub fn add(&mut self, low: Vec4, high: Vec4) {
        self.low = self.low.min(low);
        self.high = self.high.max(high);
    }

    #[inline]
    pub fn union(mut self, other: Extent) -> Self {
        self.add(other.low, other.high);
        self
    }

    #[inline]
    pub fn half_area(&self) -> f32 {
        let s = (self.high - self.low).max(Vec4::ZERO);
        s.x * s.y + s.y * s.z + s.z * s.x
    }
}

/// References side by side, with the bounds of their boxes and of their centroids.
pub struct PrimRange<'a> {
    pub(super) refs: &'a mut [PrimRef],
    pub bounds: Extent,
    pub centroids: Extent,
}

impl<'a> PrimRange<'a> {
    pub(super) fn new(refs: &'a mut [PrimRef]) -> Self {
        let (mut bounds, mut centroids) = (Extent::EMPTY, Extent::EMPTY);
        for r in refs.iter() {
            bounds.add(r.low, r.high);
            centroids.add(r.doubled_centroid(), r.doubled_centroid());
        }
        PrimRange { refs, bounds, centroids }
    }

    /// The same on all threads.
    pub fn of_many(refs: &'a mut [PrimRef]) -> Self {
        let parts = refs.par_chunks_mut(FORK).map(|refs| {
            let PrimRange { bounds, centroids, .. } = PrimRange::new(refs);
            (bounds, centroids)
        });
        let all = |a: (Extent, Extent), b: (Extent, Extent)| (a.0.union(b.0), a.1.union(b.1));
        let (bounds, centroids) = parts.reduce(|| (Extent::EMPTY, Extent::EMPTY), all);
        PrimRange { refs, bounds, centroids }
    }

    pub fn into_refs(self) -> &'a [PrimRef] {
        self.refs
    }

    pub(super) fn mixed(&self) -> bool {
        self.refs.iter().any(|r| r.held() != self.refs[0].held())
    }

    /// Whether it can be one leaf: a block, or one of what has no blocks. To carry a ray into an instance costs more
    /// than a node, so that each has a box of its own.
    pub fn is_leaf(&self, block: usize) -> bool {
        let most = if self.refs[0].held() == NodeKind::List as u32 { 1 } else { block };
        self.refs.len() <= most && !self.mixed()
    }
}
