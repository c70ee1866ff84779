//! A tree of boxes with eight children a node (Wald, Benthin and Boulos 2008; Ernst and Greiner 2008).
//!
//! Eight boxes are tested at once, and a leaf holds up to eight primitives of one kind in columns that are tested at
//! once: triangles, spheres and boxes. Other kinds are listed and tested one by one. A [`Model`] has a tree of its own,
//! into which the ray is carried by its instances.
//!
//! Boxes are tested with a margin by more than the tests of primitives err, so that no hit is ever lost and the tree
//! answers as brute force does; that alone lets their arithmetic differ from one processor to the next.

mod build;
mod frustum;
mod packet;
mod walk;

use std::sync::Arc;

use crate::components::MeshData;
use crate::trace::Geometry;
use crate::trace::geometry::{Bounds, Kind, Model};
use crate::trace::simd::{LANES, Width};

/// What a child of a node is, and where.
///
/// Three bits of kind, three of the number of primitives less one, the rest an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Child(u32);

const INDEX_BITS: u32 = 26;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Held {
    Node,
    Triangles,
    Spheres,
    Boxes,
    /// Primitives of other kinds.
    List,
}

impl Held {
    fn of(kind: Kind) -> Self {
        match kind {
            Kind::Triangle | Kind::MeshTriangle => Held::Triangles,
            Kind::Sphere => Held::Spheres,
            Kind::Box => Held::Boxes,
            _ => Held::List,
        }
    }
}

impl Child {
    const NONE: Child = Child(u32::MAX);

    fn new(held: Held, count: usize, index: usize) -> Self {
        debug_assert!(index < 1 << INDEX_BITS && (1..=LANES).contains(&count));
        Child((held as u32) << (INDEX_BITS + 3) | (count as u32 - 1) << INDEX_BITS | index as u32)
    }

    #[inline(always)]
    fn held(self) -> Held {
        match self.0 >> (INDEX_BITS + 3) {
            0 => Held::Node,
            1 => Held::Triangles,
            2 => Held::Spheres,
            3 => Held::Boxes,
            _ => Held::List,
        }
    }

    #[inline(always)]
    fn count(self) -> u32 {
        (self.0 >> INDEX_BITS & 7) + 1
    }

    #[inline(always)]
    fn index(self) -> usize {
        (self.0 & ((1 << INDEX_BITS) - 1)) as usize
    }
}

/// Boxes of eight children; those of missing ones are inside out.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    /// By axis, side (least, greatest) and child.
    bounds: [[[f32; LANES]; 2]; 3],
    children: [Child; LANES],
}

/// Set in a triangle's number where its front is not there for rays.
const NO_FRONT: u32 = 1 << 31;
/// Set where its back is not.
const NO_BACK: u32 = 1 << 30;

/// Eight triangles; missing ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
struct Triangles {
    /// By corner, axis and triangle.
    corners: [[[f32; LANES]; 3]; 3],
    /// With [`NO_FRONT`] and [`NO_BACK`].
    numbers: [u32; LANES],
}

/// Eight spheres; missing ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
struct Spheres {
    center: [[f32; LANES]; 3],
    radius: [f32; LANES],
    numbers: [u32; LANES],
}

/// Eight boxes; missing ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
struct Boxes {
    min: [[f32; LANES]; 3],
    max: [[f32; LANES]; 3],
    numbers: [u32; LANES],
}

/// One tree and its leaves.
#[derive(Clone, Debug)]
struct Tree {
    root: Child,
    nodes: Vec<Node>,
    triangles: Vec<Triangles>,
    spheres: Vec<Spheres>,
    boxes: Vec<Boxes>,
    lists: Vec<[u32; LANES]>,
    bounds: Bounds,
    /// Greatest coordinate of anything in it.
    extent: f32,
    /// Entries that the stack of a walk can come to hold.
    stack: usize,
}

impl Tree {
    fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.boxes[..])
            + size_of_val(&self.lists[..])
    }
}

/// The world's tree, and those of its models.
pub struct Bvh {
    world: Tree,
    /// By model; a mesh that was there before keeps its tree.
    models: Vec<(Arc<MeshData>, Arc<Tree>)>,
    width: Width,
    /// Entries that the stack of a walk can come to hold.
    stack: usize,
}

impl Bvh {
    /// `before` may be any tree: what it holds of the same meshes is not built again.
    pub fn build(geometry: &Geometry, width: Width, before: Option<&Bvh>) -> Self {
        let known = before.map_or(&[][..], |bvh| &bvh.models);
        let tree = |model: &Model| {
            let same = known.iter().find(|(mesh, _)| Arc::ptr_eq(mesh, &model.mesh));
            same.map_or_else(|| Arc::new(build::model(model)), |(_, tree)| tree.clone())
        };
        let models: Vec<_> = geometry.models().iter().map(|model| (model.mesh.clone(), tree(model))).collect();
        let world = build::world(geometry);
        let stack = world.stack + models.iter().map(|(_, tree)| tree.stack).max().unwrap_or(0);
        Bvh { world, models, width, stack }
    }

    /// Memory of trees and leaves.
    pub fn bytes(&self) -> usize {
        self.world.bytes() + self.models.iter().map(|(_, tree)| tree.bytes()).sum::<usize>()
    }
}

/// What a tree is built over.
trait Source: Sync {
    fn bounds(&self, number: u32) -> Bounds;
    fn held(&self, number: u32) -> Held;
    fn corners(&self, number: u32) -> [glam::Vec3; 3];
    /// The number as a leaf keeps it.
    fn marked(&self, number: u32) -> u32;
    fn sphere(&self, number: u32) -> [f32; 4];
    fn aabox(&self, number: u32) -> [glam::Vec3; 2];
}

impl Source for Geometry {
    fn bounds(&self, number: u32) -> Bounds {
        self.bounds_of(number)
    }
    fn held(&self, number: u32) -> Held {
        Held::of(self.kind_of(number))
    }
    fn corners(&self, number: u32) -> [glam::Vec3; 3] {
        self.corners(number)
    }
    fn marked(&self, number: u32) -> u32 {
        let sides = self.tag(number).sides;
        let front = if sides.shows(true) { 0 } else { NO_FRONT };
        let back = if sides.shows(false) { 0 } else { NO_BACK };
        number | front | back
    }
    fn sphere(&self, number: u32) -> [f32; 4] {
        self.sphere(number)
    }
    fn aabox(&self, number: u32) -> [glam::Vec3; 2] {
        self.aabox(number)
    }
}

impl Source for Model {
    fn bounds(&self, number: u32) -> Bounds {
        Bounds::around(&self.corners(number))
    }
    fn held(&self, _: u32) -> Held {
        Held::Triangles
    }
    fn corners(&self, number: u32) -> [glam::Vec3; 3] {
        self.corners(number)
    }
    fn marked(&self, number: u32) -> u32 {
        number
    }
    fn sphere(&self, _: u32) -> [f32; 4] {
        [f32::NAN; 4]
    }
    fn aabox(&self, _: u32) -> [glam::Vec3; 2] {
        [glam::Vec3::NAN; 2]
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3, Vec3};

    use super::*;
    use crate::trace::Tag;

    #[test]
    fn a_moved_instance_does_not_build_its_mesh_again() {
        let mesh = Arc::new(MeshData::new(vec![Vec3::X, Vec3::Y, Vec3::Z], vec![[0, 1, 2]], Vec::new()));
        let build = |mesh: &Arc<MeshData>, x: f64, before: Option<&Bvh>| {
            let mut geometry = Geometry::default();
            geometry.push_instance(Tag::default(), mesh, false, &DAffine3::from_translation(DVec3::X * x));
            geometry.finish();
            Bvh::build(&geometry, Width::detect(), before)
        };
        let first = build(&mesh, 0.0, None);
        assert!(Arc::ptr_eq(&build(&mesh, 5.0, Some(&first)).models[0].1, &first.models[0].1));
        let other = Arc::new(MeshData::clone(&mesh));
        assert!(!Arc::ptr_eq(&build(&other, 5.0, Some(&first)).models[0].1, &first.models[0].1));
    }
}
