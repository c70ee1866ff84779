//! The tree of the world, over trees of the meshes that are shared.

use std::sync::Arc;

use super::tree::{Tree, repays};
use super::{build, fast};
use crate::components::MeshData;
use crate::trace::accel::HiddenPrimitives;
use crate::trace::accel::leaves::BuildInput;
use crate::trace::primitive::{Geometry, MeshPrototype, PrimitiveKind, PrimitiveLayout};
use crate::trace::simd::{LANES, Width};

/// Trees of more bytes are larger than the caches that are near: what streams will visit is asked for in advance there,
/// and only there (1.1 times the rate on 874 k triangles, 0.95 to 0.98 on 69 k).
const LARGE: usize = 16 << 20;

/// The world's tree, and those of its models.
pub struct Bvh {
    pub(super) world: Tree,
    /// Numbers at which each kind ended when the world's tree was built.
    layout: PrimitiveLayout,
    /// By model; a mesh that was there before keeps its tree.
    pub(super) models: Vec<(Arc<MeshData>, Arc<Tree>)>,
    pub(super) width: Width,
    /// Entries that the stack of a walk can come to hold.
    pub(super) stack: usize,
    /// The world's tree is larger than the caches that are near.
    pub(super) is_large: bool,
    /// The world's tree is an older one, with its boxes fitted to what moved.
    pub is_fitted: bool,
}

impl Tree {
    fn build<S: BuildInput>(source: &S, count: u32, rays: f64, hidden: &HiddenPrimitives) -> Tree {
        if repays(rays, count) { build::full(source, count, hidden) } else { fast::fast(source, count, hidden) }
    }
}

impl Bvh {
    /// `rays` are expected to go through it. `before` may be any tree: what it holds of the same meshes is not built
    /// again, and where the world has as many primitives of each kind its boxes are fitted to them while that is good
    /// enough. What rays cost then depends on the trees before, what they find does not.
    ///
    /// What is `hidden` is left out of the world; `refits` says whether `before` leaves out the same.
    pub fn build(
        geometry: &Geometry,
        width: Width,
        rays: f64,
        (before, refits): (Option<&Bvh>, bool),
        hidden: &HiddenPrimitives,
    ) -> Self {
        let known = before.map_or(&[][..], |bvh| &bvh.models);
        let tree = |model: &MeshPrototype| {
            let count = model.mesh.triangles.len() as u32;
            let same = known.iter().find(|(mesh, _)| Arc::ptr_eq(mesh, &model.mesh));
            let good = same.filter(|(_, tree)| !tree.is_outgrown(rays, count));
            good.map_or_else(
                || Arc::new(Tree::build(model, count, rays, &HiddenPrimitives::NONE)),
                |(_, tree)| tree.clone(),
            )
        };
        let models: Vec<_> = geometry.prototypes().iter().map(|model| (model.mesh.clone(), tree(model))).collect();
        let (layout, count) = (geometry.layout(), geometry.finite());
        let same = before.filter(|bvh| refits && bvh.layout == layout && !bvh.world.is_outgrown(rays, count));
        let fitted = same.and_then(|bvh| bvh.world.refit(geometry));
        let is_fitted = fitted.is_some();
        let mut world = fitted.unwrap_or_else(|| Tree::build(geometry, count, rays, hidden));
        world.order_children();
        // Each walk puts down eight at once, of which the last may be none.
        let of_models = models.iter().map(|(_, tree)| tree.stack).max().unwrap_or(0);
        let stack = world.stack + of_models + 2 * LANES;
        let is_large = world.bytes() > LARGE;
        Bvh { world, layout, models, width, stack, is_large, is_fitted }
    }

    /// Whether a part of it was built fast, and would not be for so many rays.
    pub fn is_outgrown(&self, rays: f64) -> bool {
        let of_model = |(mesh, tree): &(Arc<MeshData>, Arc<Tree>)| tree.is_outgrown(rays, mesh.triangles.len() as u32);
        self.world.is_outgrown(rays, self.layout[PrimitiveKind::Instance as usize]) || self.models.iter().any(of_model)
    }

    /// Memory of trees and leaves.
    pub fn bytes(&self) -> usize {
        self.world.bytes() + self.models.iter().map(|(_, tree)| tree.bytes()).sum::<usize>()
    }
}
