//! Primitives in blocks of eight, column by column, which are tested side by side: what trees and grids hold.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use crate::trace::primitive::{Bounds, BoxPrim, ConeFrustum, Geometry, MeshPrototype, PrimitiveKind, SpherePrim, Tag};
use crate::trace::simd::{LANES, Wide};

/// What a child of a node is, and where.
///
/// Three bits of kind, three of the number of primitives less one, the rest an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeRef(u32);

const INDEX_BITS: u32 = 26;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum NodeKind {
    Node,
    Triangles,
    Spheres,
    Boxes,
    Cones,
    /// Primitives of other kinds.
    List,
}

impl NodeKind {
    fn of(kind: PrimitiveKind) -> Self {
        match kind {
            PrimitiveKind::Triangle | PrimitiveKind::MeshTriangle => NodeKind::Triangles,
            PrimitiveKind::Sphere => NodeKind::Spheres,
            PrimitiveKind::Box => NodeKind::Boxes,
            PrimitiveKind::Cone => NodeKind::Cones,
            PrimitiveKind::Transformed | PrimitiveKind::Instance | PrimitiveKind::Plane => NodeKind::List,
        }
    }

    #[inline(always)]
    pub fn of_bits(bits: u32) -> Self {
        match bits {
            0 => NodeKind::Node,
            1 => NodeKind::Triangles,
            2 => NodeKind::Spheres,
            3 => NodeKind::Boxes,
            4 => NodeKind::Cones,
            _ => NodeKind::List,
        }
    }
}

impl NodeRef {
    pub const NONE: NodeRef = NodeRef(u32::MAX);

    pub fn new(held: NodeKind, count: usize, index: usize) -> Self {
        debug_assert!(index < 1 << INDEX_BITS && (1..=LANES).contains(&count));
        NodeRef((held as u32) << (INDEX_BITS + 3) | (count as u32 - 1) << INDEX_BITS | index as u32)
    }

    #[inline(always)]
    pub fn held(self) -> NodeKind {
        NodeKind::of_bits(self.0 >> (INDEX_BITS + 3))
    }

    #[inline(always)]
    pub fn count(self) -> u32 {
        (self.0 >> INDEX_BITS & 7) + 1
    }

    /// The bits of it.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub fn of_bits(bits: u32) -> Self {
        NodeRef(bits)
    }

    /// The same, with this much added to its index.
    pub fn moved(self, by: usize) -> Self {
        NodeRef(self.0 + by as u32)
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & ((1 << INDEX_BITS) - 1)) as usize
    }
}

/// Set in a triangle's number where its front is not there for rays.
pub const NO_FRONT: u32 = 1 << 31;

/// Set where its back is not.
pub const NO_BACK: u32 = 1 << 30;

/// Eight triangles; missing ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct TriangleBlock {
    /// By corner, axis and triangle.
    pub corners: [[[f32; LANES]; 3]; 3],
    /// With [`NO_FRONT`] and [`NO_BACK`].
    pub numbers: [u32; LANES],
}

/// Eight spheres; missing ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct SphereBlock {
    pub center: [[f32; LANES]; 3],
    pub radius: [f32; LANES],
    pub numbers: [u32; LANES],
}

/// Eight boxes; missing ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct BoxBlock {
    pub min: [[f32; LANES]; 3],
    pub max: [[f32; LANES]; 3],
    pub numbers: [u32; LANES],
}

/// Eight cones; missing ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub struct ConeBlock {
    pub base: [[f32; LANES]; 3],
    pub axis: [[f32; LANES]; 3],
    pub height: [f32; LANES],
    pub base_radius: [f32; LANES],
    pub slope: [f32; LANES],
    /// 1 or 0.
    pub capped: [f32; LANES],
    /// What hits are held to.
    pub min: [[f32; LANES]; 3],
    pub max: [[f32; LANES]; 3],
    pub numbers: [u32; LANES],
}

/// Blocks by kind.
#[derive(Clone, Debug, Default)]
pub struct Leaves {
    pub triangles: Vec<TriangleBlock>,
    pub spheres: Vec<SphereBlock>,
    pub boxes: Vec<BoxBlock>,
    pub cones: Vec<ConeBlock>,
    pub lists: Vec<[u32; LANES]>,
}

impl Leaves {
    /// Many blocks at once: runs of `numbers` of one kind each, the kinds in their order. An index counts the runs of
    /// its kind.
    pub fn of<S: BuildInput>(source: &S, numbers: &[u32], runs: &[Range<usize>]) -> Leaves {
        let mut rest = runs;
        let mut next = |held: NodeKind| {
            let (of_kind, others) = rest.split_at(rest.partition_point(|run| source.held(numbers[run.start]) <= held));
            rest = others;
            of_kind.par_iter().with_min_len(256).map(|run| {
                let mut block = [u32::MAX; LANES];
                block[..run.len()].copy_from_slice(&numbers[run.clone()]);
                (block, run.len())
            })
        };
        Leaves {
            triangles: next(NodeKind::Triangles)
                .map(|(block, count)| TriangleBlock::new(source, block, count))
                .collect(),
            spheres: next(NodeKind::Spheres).map(|(block, count)| SphereBlock::new(source, block, count)).collect(),
            boxes: next(NodeKind::Boxes).map(|(block, count)| BoxBlock::new(source, block, count)).collect(),
            cones: next(NodeKind::Cones).map(|(block, count)| ConeBlock::new(source, block, count)).collect(),
            lists: next(NodeKind::List).map(|(block, _)| block).collect(),
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.triangles[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.boxes[..])
            + size_of_val(&self.cones[..])
            + size_of_val(&self.lists[..])
    }

    /// Number of blocks of each kind, in the order of the kinds.
    pub fn lens(&self) -> [usize; 5] {
        [self.triangles.len(), self.spheres.len(), self.boxes.len(), self.cones.len(), self.lists.len()]
    }

    pub fn reserve(&mut self, [triangles, spheres, boxes, cones, lists]: [usize; 5]) {
        self.triangles.reserve(triangles);
        self.spheres.reserve(spheres);
        self.boxes.reserve(boxes);
        self.cones.reserve(cones);
        self.lists.reserve(lists);
    }

    pub fn append(&mut self, other: &mut Leaves) {
        self.triangles.append(&mut other.triangles);
        self.spheres.append(&mut other.spheres);
        self.boxes.append(&mut other.boxes);
        self.cones.append(&mut other.cones);
        self.lists.append(&mut other.lists);
    }

    /// Writes all blocks again: primitives have moved. Numbers must stand for the same kinds as before.
    pub fn renew<S: BuildInput>(&mut self, source: &S) {
        let held = |numbers: &[u32; LANES]| {
            // Missing ones come last.
            let count = numbers.iter().position(|n| *n == u32::MAX).unwrap_or(LANES);
            (numbers.map(|n| if n == u32::MAX { n } else { n & !(NO_FRONT | NO_BACK) }), count)
        };
        self.triangles.par_iter_mut().with_min_len(256).for_each(|block| {
            let (numbers, count) = held(&block.numbers);
            *block = TriangleBlock::new(source, numbers, count);
        });
        self.spheres.par_iter_mut().with_min_len(256).for_each(|block| {
            let (numbers, count) = held(&block.numbers);
            *block = SphereBlock::new(source, numbers, count);
        });
        self.boxes.par_iter_mut().with_min_len(256).for_each(|block| {
            let (numbers, count) = held(&block.numbers);
            *block = BoxBlock::new(source, numbers, count);
        });
        self.cones.par_iter_mut().with_min_len(256).for_each(|block| {
            let (numbers, count) = held(&block.numbers);
            *block = ConeBlock::new(source, numbers, count);
        });
    }

    /// Bounds of what a block holds.
    pub fn bounds<S: BuildInput>(&self, source: &S, child: NodeRef) -> Bounds {
        let numbers = match child.held() {
            NodeKind::Triangles => &self.triangles[child.index()].numbers,
            NodeKind::Spheres => &self.spheres[child.index()].numbers,
            NodeKind::Boxes => &self.boxes[child.index()].numbers,
            NodeKind::Cones => &self.cones[child.index()].numbers,
            NodeKind::List | NodeKind::Node => &self.lists[child.index()],
        };
        let plain = |n: &u32| if child.held() == NodeKind::List { *n } else { n & !(NO_FRONT | NO_BACK) };
        let each = numbers[..child.count() as usize].iter().map(|n| source.bounds(plain(n)));
        each.fold(Bounds::default(), Bounds::union)
    }

    /// Numbers of the primitives of a block, and their boxes, by axis and side; not a list.
    #[inline(always)]
    pub fn boxes_of<L: Wide>(&self, child: NodeRef) -> (&[u32; LANES], [[L; 2]; 3]) {
        match child.held() {
            NodeKind::Spheres => {
                let SphereBlock { center: [x, y, z], radius, numbers } = &self.spheres[child.index()];
                let (x, y, z, r) = (L::load(x), L::load(y), L::load(z), L::load(radius));
                (numbers, [[x - r, x + r], [y - r, y + r], [z - r, z + r]])
            }
            NodeKind::Boxes => {
                let BoxBlock { min: [ax, ay, az], max: [bx, by, bz], numbers } = &self.boxes[child.index()];
                let (x, y, z) = ([L::load(ax), L::load(bx)], [L::load(ay), L::load(by)], [L::load(az), L::load(bz)]);
                (numbers, [x, y, z])
            }
            NodeKind::Cones => {
                let ConeBlock { min: [ax, ay, az], max: [bx, by, bz], numbers, .. } = &self.cones[child.index()];
                let (x, y, z) = ([L::load(ax), L::load(bx)], [L::load(ay), L::load(by)], [L::load(az), L::load(bz)]);
                (numbers, [x, y, z])
            }
            _ => {
                let TriangleBlock { corners: [a, b, c], numbers } = &self.triangles[child.index()];
                let mut sides = [[L::splat(0.0); 2]; 3];
                for (axis, side) in sides.iter_mut().enumerate() {
                    let (a, b, c) = (L::load(&a[axis]), L::load(&b[axis]), L::load(&c[axis]));
                    *side = [a.min(b).min(c), a.max(b).max(c)];
                }
                (numbers, sides)
            }
        }
    }

    /// Writes up to eight primitives of one kind into a new block.
    pub fn put<S: BuildInput>(&mut self, source: &S, some: &[u32]) -> NodeRef {
        let mut numbers = [u32::MAX; LANES];
        numbers[..some.len()].copy_from_slice(some);
        let held = source.held(some[0]);
        let index = match held {
            NodeKind::Triangles => {
                self.triangles.push(TriangleBlock::new(source, numbers, some.len()));
                self.triangles.len()
            }
            NodeKind::Spheres => {
                self.spheres.push(SphereBlock::new(source, numbers, some.len()));
                self.spheres.len()
            }
            NodeKind::Boxes => {
                self.boxes.push(BoxBlock::new(source, numbers, some.len()));
                self.boxes.len()
            }
            NodeKind::Cones => {
                self.cones.push(ConeBlock::new(source, numbers, some.len()));
                self.cones.len()
            }
            NodeKind::List | NodeKind::Node => {
                self.lists.push(numbers);
                self.lists.len()
            }
        };
        NodeRef::new(held, some.len(), index - 1)
    }
}

/// Puts a vector into one lane of three columns.
#[inline]
fn put(to: &mut [[f32; LANES]; 3], lane: usize, v: Vec3) {
    (0..3).for_each(|axis| to[axis][lane] = v[axis]);
}

impl TriangleBlock {
    fn new<S: BuildInput>(source: &S, numbers: [u32; LANES], count: usize) -> Self {
        let mut block = TriangleBlock { corners: [[[f32::NAN; LANES]; 3]; 3], numbers };
        for (lane, n) in numbers.iter().enumerate().take(count) {
            let (corners, marked) = source.triangle(*n);
            (0..3).for_each(|corner| put(&mut block.corners[corner], lane, corners[corner]));
            block.numbers[lane] = marked;
        }
        block
    }
}

impl SphereBlock {
    fn new<S: BuildInput>(source: &S, numbers: [u32; LANES], count: usize) -> Self {
        let mut block = SphereBlock { center: [[f32::NAN; LANES]; 3], radius: [f32::NAN; LANES], numbers };
        for (lane, n) in numbers.iter().enumerate().take(count) {
            let SpherePrim { center, radius } = source.sphere(*n);
            put(&mut block.center, lane, center);
            block.radius[lane] = radius;
            block.numbers[lane] = source.marked(*n);
        }
        block
    }
}

impl BoxBlock {
    fn new<S: BuildInput>(source: &S, numbers: [u32; LANES], count: usize) -> Self {
        let mut block = BoxBlock { min: [[f32::NAN; LANES]; 3], max: [[f32::NAN; LANES]; 3], numbers };
        for (lane, n) in numbers.iter().enumerate().take(count) {
            let BoxPrim { min, max } = source.aabox(*n);
            put(&mut block.min, lane, min);
            put(&mut block.max, lane, max);
            block.numbers[lane] = source.marked(*n);
        }
        block
    }
}

impl ConeBlock {
    fn new<S: BuildInput>(source: &S, numbers: [u32; LANES], count: usize) -> Self {
        let (column, columns) = ([f32::NAN; LANES], [[f32::NAN; LANES]; 3]);
        let mut block = ConeBlock {
            base: columns,
            axis: columns,
            height: column,
            base_radius: column,
            slope: column,
            capped: column,
            min: columns,
            max: columns,
            numbers,
        };
        for (lane, n) in numbers.iter().enumerate().take(count) {
            let (cone, bounds) = (source.cone(*n), source.bounds(*n));
            put(&mut block.base, lane, cone.base);
            put(&mut block.axis, lane, cone.axis);
            block.height[lane] = cone.height;
            block.base_radius[lane] = cone.base_radius;
            block.slope[lane] = cone.slope;
            block.capped[lane] = f32::from(u8::from(cone.capped));
            put(&mut block.min, lane, bounds.min);
            put(&mut block.max, lane, bounds.max);
            block.numbers[lane] = source.marked(*n);
        }
        block
    }
}

/// What an accelerator is built over.
pub trait BuildInput: Sync {
    fn bounds(&self, number: u32) -> Bounds;
    fn held(&self, number: u32) -> NodeKind;
    fn corners(&self, number: u32) -> [Vec3; 3];
    /// Corners of a triangle, and its number as a leaf keeps it.
    fn triangle(&self, number: u32) -> ([Vec3; 3], u32);
    /// The number as a leaf keeps it.
    fn marked(&self, number: u32) -> u32;
    fn sphere(&self, number: u32) -> SpherePrim;
    fn aabox(&self, number: u32) -> BoxPrim;
    fn cone(&self, number: u32) -> ConeFrustum;
}

/// A number with what its sides are marked by.
fn mark(number: u32, tag: Tag) -> u32 {
    let front = if tag.sides.shows(true) { 0 } else { NO_FRONT };
    let back = if tag.sides.shows(false) { 0 } else { NO_BACK };
    number | front | back
}

impl BuildInput for Geometry {
    fn bounds(&self, number: u32) -> Bounds {
        self.bounds_of(number)
    }
    fn held(&self, number: u32) -> NodeKind {
        NodeKind::of(self.kind_of(number))
    }
    fn corners(&self, number: u32) -> [Vec3; 3] {
        self.corners(number)
    }
    fn triangle(&self, number: u32) -> ([Vec3; 3], u32) {
        let (corners, tag) = self.tagged_triangle(number);
        (corners, mark(number, tag))
    }
    fn marked(&self, number: u32) -> u32 {
        mark(number, self.tag(number))
    }
    fn sphere(&self, number: u32) -> SpherePrim {
        self.sphere(number)
    }
    fn aabox(&self, number: u32) -> BoxPrim {
        self.aabox(number)
    }
    fn cone(&self, number: u32) -> ConeFrustum {
        self.cone(number)
    }
}

impl BuildInput for MeshPrototype {
    fn bounds(&self, number: u32) -> Bounds {
        Bounds::around(&self.corners(number))
    }
    fn held(&self, _: u32) -> NodeKind {
        NodeKind::Triangles
    }
    fn corners(&self, number: u32) -> [Vec3; 3] {
        self.corners(number)
    }
    fn triangle(&self, number: u32) -> ([Vec3; 3], u32) {
        (self.corners(number), number)
    }
    fn marked(&self, number: u32) -> u32 {
        number
    }
    fn sphere(&self, _: u32) -> SpherePrim {
        SpherePrim { center: Vec3::NAN, radius: f32::NAN }
    }
    fn aabox(&self, _: u32) -> BoxPrim {
        BoxPrim { min: Vec3::NAN, max: Vec3::NAN }
    }
    fn cone(&self, _: u32) -> ConeFrustum {
        ConeFrustum::new(Vec3::NAN, f32::NAN, Vec3::NAN, f32::NAN, false)
    }
}
