//! Building a tree: surface area heuristic over bins, top down (Wald 2007), the same tree on any number of threads.
//!
//! Ranges of references are split in two down to leaves, of which nodes of eight children are made ([`collapse`]). Above
//! what one thread builds, ranges are split until a node has eight children, the one with the largest surface first, so
//! that what a wide node skips is the least likely to be met. Costs count leaves in blocks of eight, which fills them.

use glam::Vec4;
use rayon::prelude::*;

use super::{Child, Held, LANES, Leaves, Node, Source, Tree, collapse};
use crate::trace::geometry::Bounds;

/// Slices of an axis among which a split is chosen. Eight of the longest axis alone, for trees that last one frame, build
/// hardly faster (0.97 of the time): it goes into reading and moving references, not into the choice.
const BINS: usize = 32;

/// Ranges above this are binned on all threads, and their children built on all threads.
pub const FORK: usize = 16 * 1024;

/// Parts in which such a range is binned.
const PARTS: usize = 8;

/// Deeper than this, ranges are split in the middle: the stack of a walk stays bounded.
const DEEPEST: usize = 40;

/// Something that is being sorted: its box, with number and kind in the fourth coordinates.
#[derive(Clone, Copy)]
pub struct Ref {
    pub low: Vec4,
    pub high: Vec4,
}

/// What makes a number of less than 30 bits one that is not subnormal as a float: to multiply such, which happens to the
/// fourth coordinate beside the others, took a third of a build.
const NORMAL: u32 = 1 << 30;

impl Ref {
    #[inline]
    pub fn new(bounds: Extent, number: u32, held: Held) -> Self {
        let (mut low, mut high) = (bounds.low, bounds.high);
        low.w = f32::from_bits(number | NORMAL);
        high.w = f32::from_bits(held as u32 | NORMAL);
        Ref { low, high }
    }

    fn of<S: Source>(source: &S, number: u32) -> Self {
        let Bounds { min, max } = source.bounds(number);
        Ref::new(Extent { low: min.extend(0.0), high: max.extend(0.0) }, number, source.held(number))
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

    /// Twice the middle of the box.
    #[inline]
    pub fn middle(&self) -> Vec4 {
        self.low + self.high
    }
}

/// The first `count` primitives of a source.
pub fn refs<S: Source>(source: &S, count: u32) -> Vec<Ref> {
    (0..count).into_par_iter().with_min_len(4096).map(|n| Ref::of(source, n)).collect()
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

/// References side by side, with the bounds of their boxes and of their middles.
pub struct Range<'a> {
    refs: &'a mut [Ref],
    pub bounds: Extent,
    pub middles: Extent,
}

impl<'a> Range<'a> {
    fn new(refs: &'a mut [Ref]) -> Self {
        let (mut bounds, mut middles) = (Extent::EMPTY, Extent::EMPTY);
        for r in refs.iter() {
            bounds.add(r.low, r.high);
            middles.add(r.middle(), r.middle());
        }
        Range { refs, bounds, middles }
    }

    /// The same on all threads.
    pub fn of_many(refs: &'a mut [Ref]) -> Self {
        let parts = refs.par_chunks_mut(FORK).map(|refs| {
            let Range { bounds, middles, .. } = Range::new(refs);
            (bounds, middles)
        });
        let all = |a: (Extent, Extent), b: (Extent, Extent)| (a.0.union(b.0), a.1.union(b.1));
        let (bounds, middles) = parts.reduce(|| (Extent::EMPTY, Extent::EMPTY), all);
        Range { refs, bounds, middles }
    }

    pub fn into_refs(self) -> &'a [Ref] {
        self.refs
    }

    fn mixed(&self) -> bool {
        self.refs.iter().any(|r| r.held() != self.refs[0].held())
    }

    /// Whether it can be one leaf: a block, or one of what has no blocks. To carry a ray into an instance costs more
    /// than a node, so that each has a box of its own.
    pub fn is_leaf(&self, block: usize) -> bool {
        let most = if self.refs[0].held() == Held::List as u32 { 1 } else { block };
        self.refs.len() <= most && !self.mixed()
    }
}

/// What a tree grows down to.
pub struct Ground<F> {
    /// How many references of one kind a leaf takes.
    pub block: usize,
    /// Makes a leaf of them.
    pub leaf: F,
}

/// What so many in a box are expected to cost where leaves take `block` of them: half by number, half by leaf.
#[inline]
pub fn cost(around: &Extent, count: usize, block: usize) -> f32 {
    around.half_area() * (count.div_ceil(block) * block + count) as f32
}

/// Where primitives fall along each axis.
pub struct Bins {
    count: usize,
    base: Vec4,
    scale: Vec4,
    extents: [[Extent; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    fn new() -> Box<Bins> {
        let (extents, counts) = ([[Extent::EMPTY; BINS]; 3], [[0; BINS]; 3]);
        Box::new(Bins { count: 0, base: Vec4::ZERO, scale: Vec4::ZERO, extents, counts })
    }

    /// Makes the bins ready for a range.
    fn reset(&mut self, range: &Range) {
        self.count = BINS.min(4 + range.refs.len() / 16);
        for axis in 0..3 {
            self.extents[axis][..self.count].fill(Extent::EMPTY);
            self.counts[axis][..self.count].fill(0);
        }
        let size = range.middles.high - range.middles.low;
        // Flat axes go to bin 0; the last middle falls inside the last bin.
        let end = self.count as f32 - 0.01;
        self.base = range.middles.low;
        self.scale = size.map(|s| if s > 0.0 && (end / s).is_finite() { end / s } else { 0.0 });
    }

    #[inline(always)]
    fn place(&self, r: &Ref) -> [usize; 3] {
        /// 2^15: a small number added to it stands in its lowest bits, eight of them behind the point.
        const FIXED: Vec4 = Vec4::splat(32_768.0);
        let at = (r.middle() - self.base) * self.scale + FIXED;
        let bin = |x: f32| x.to_bits() as usize >> 8 & (BINS - 1);
        [bin(at.x), bin(at.y), bin(at.z)]
    }

    fn fill(&mut self, refs: &[Ref]) {
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

    fn merge(&mut self, other: &Bins) {
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
pub fn split<'a>(range: Range<'a>, block: usize, bins: &mut Bins, depth: usize) -> [Range<'a>; 2] {
    if range.refs.len() <= LANES && range.mixed() {
        return by_kind(range);
    }
    bins.reset(&range);
    if range.refs.len() > FORK {
        let chunks = range.refs.par_chunks(range.refs.len().div_ceil(PARTS)).map(|refs| {
            let mut bins = Bins::new();
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
        return [Range::new(a), Range::new(b)];
    };
    let mut middles = [Extent::EMPTY; 2];
    let (mut i, mut j) = (0, range.refs.len());
    // Everything before i goes to the near side, everything from j to the far one.
    while i < j {
        let r = range.refs[i];
        let side = usize::from(bins.place(&r)[axis] >= first);
        middles[side].add(r.middle(), r.middle());
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
        Range { refs: a, bounds: bounds[0], middles: middles[0] },
        Range { refs: b, bounds: bounds[1], middles: middles[1] },
    ]
}

/// The kind of the first reference, and the others.
fn by_kind(range: Range) -> [Range; 2] {
    range.refs.sort_unstable_by_key(|r| (r.held(), r.number()));
    let first = range.refs[0].held();
    let (a, b) = range.refs.split_at_mut(range.refs.partition_point(|r| r.held() == first));
    [Range::new(a), Range::new(b)]
}

/// Full quality: a block of a leaf is chosen as every split is.
pub fn full<S: Source>(source: &S, count: u32) -> Tree {
    let mut refs = refs(source, count);
    let leaf = |refs: &[Ref], leaves: &mut Leaves| {
        let mut numbers = [0; LANES];
        refs.iter().zip(&mut numbers).for_each(|(r, n)| *n = r.number());
        leaves.put(source, &numbers[..refs.len()])
    };
    let mut tree = plant(&mut refs, &Ground { block: LANES, leaf });
    tree.fresh = tree.estimate();
    tree
}

/// The tree over references.
pub fn plant<F: Fn(&[Ref], &mut Leaves) -> Child + Sync>(refs: &mut [Ref], ground: &Ground<F>) -> Tree {
    let empty = refs.is_empty();
    let range = Range::of_many(refs);
    let mut tree = Tree::empty(Bounds { min: range.bounds.low.truncate(), max: range.bounds.high.truncate() });
    if !empty {
        let depth;
        (tree.root, depth) = grow(ground, range, &mut tree, &mut Bins::new(), 0);
        tree.stack = (LANES - 1) * depth + 1;
    }
    tree
}

/// Adds a range to the tree: the child that it becomes, and how many nodes deep it is.
fn grow<F>(ground: &Ground<F>, range: Range, tree: &mut Tree, bins: &mut Bins, depth: usize) -> (Child, usize)
where
    F: Fn(&[Ref], &mut Leaves) -> Child + Sync,
{
    let block = ground.block;
    if range.is_leaf(block) {
        return ((ground.leaf)(range.refs, &mut tree.leaves), 0);
    }
    if range.refs.len() <= FORK {
        return collapse::grow(ground, range, tree, bins, depth);
    }
    let mut ranges = Vec::with_capacity(LANES);
    ranges.push(range);
    while ranges.len() < LANES {
        let open = ranges.iter().enumerate().filter(|(_, r)| !r.is_leaf(block));
        let Some((widest, _)) = open.max_by(|a, b| a.1.bounds.half_area().total_cmp(&b.1.bounds.half_area())) else {
            break;
        };
        let [a, b] = split(ranges.swap_remove(widest), block, bins, depth);
        ranges.extend([a, b]);
    }
    let at = tree.nodes.len();
    let mut node = Node::EMPTY;
    ranges.iter().enumerate().for_each(|(i, range)| node.put(i, range.bounds, Child::NONE));
    tree.nodes.push(node);
    let grown: Vec<_> = ranges
        .into_par_iter()
        .map(|range| {
            let mut branch = Tree::empty(tree.bounds);
            let child = grow(ground, range, &mut branch, &mut Bins::new(), depth + 1);
            (branch, child)
        })
        .collect();
    tree.reserve(&grown.iter().map(|(branch, _)| branch).collect::<Vec<_>>());
    let mut deepest = 0;
    for (i, (branch, (child, below))) in grown.into_iter().enumerate() {
        tree.nodes[at].children[i] = tree.graft(branch, child);
        deepest = deepest.max(below);
    }
    (Child::new(Held::Node, 1, at), deepest + 1)
}

/// A child whose index counted from what is behind so many nodes and blocks of each kind.
pub fn regrafted(child: Child, before: &[usize; 6]) -> Child {
    if child == Child::NONE { child } else { child.moved(before[child.held() as usize]) }
}

impl Node {
    pub const EMPTY: Node =
        Node { bounds: [[[f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]]; 3], children: [Child::NONE; LANES] };

    #[inline]
    pub fn put(&mut self, slot: usize, around: Extent, child: Child) {
        for axis in 0..3 {
            self.bounds[axis][0][slot] = around.low[axis];
            self.bounds[axis][1][slot] = around.high[axis];
        }
        self.children[slot] = child;
    }
}

impl Tree {
    fn empty(bounds: Bounds) -> Tree {
        let mut tree = Tree {
            root: Child::NONE,
            nodes: Vec::new(),
            leaves: Leaves::default(),
            bounds,
            extent: 0.0,
            stack: 0,
            fresh: 0.0,
            is_fast: false,
        };
        tree.set_bounds(bounds);
        tree
    }

    pub fn set_bounds(&mut self, bounds: Bounds) {
        self.bounds = bounds;
        self.extent = if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() };
    }

    /// Makes room for branches.
    fn reserve(&mut self, branches: &[&Tree]) {
        self.nodes.reserve(branches.iter().map(|branch| branch.nodes.len()).sum());
        let add = |total: [usize; 5], branch: &&Tree| std::array::from_fn(|i| total[i] + branch.leaves.lens()[i]);
        self.leaves.reserve(branches.iter().fold([0; 5], add));
    }

    /// Takes over a branch; gives the child of it as it is numbered here.
    fn graft(&mut self, mut branch: Tree, child: Child) -> Child {
        let [triangles, spheres, boxes, cones, lists] = self.leaves.lens();
        let before = [self.nodes.len(), triangles, spheres, boxes, cones, lists];
        let moved = |child| regrafted(child, &before);
        for node in &mut branch.nodes {
            node.children = node.children.map(moved);
        }
        self.nodes.append(&mut branch.nodes);
        self.leaves.append(&mut branch.leaves);
        moved(child)
    }
}
