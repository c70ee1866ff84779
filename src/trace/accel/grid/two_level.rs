//! The grid of the world, over grids of the meshes that are shared.

use std::sync::Arc;

use super::build;
use super::cells::NestedGrid;
use crate::components::MeshData;
use crate::trace::accel::HiddenPrimitives;
use crate::trace::primitive::{Geometry, MeshPrototype};
use crate::trace::simd::Width;

/// Padding of every bound, in lengths of the scene's diagonal. A ray starts at most four and a half diagonals away from
/// whatever it meets; there, a walk and a test of a primitive together err by less than 3e-6 of one.
const PAD: f32 = 5e-6;

/// The world's grid, and those of its models.
pub struct Grid {
    pub(super) world: NestedGrid,
    pub(super) models: Vec<(Arc<MeshData>, Arc<NestedGrid>)>,
    pub(super) width: Width,
}

impl Grid {
    /// `density` is in cells per primitive; `before` may be any grid: what it holds of the same meshes is not built
    /// again.
    /// What is `hidden` is left out of the world.
    pub fn build(
        geometry: &Geometry,
        density: f64,
        width: Width,
        before: Option<&Grid>,
        hidden: &HiddenPrimitives,
    ) -> Self {
        let known = before.map_or(&[][..], |grid| &grid.models);
        let pad = geometry.bounds().size().length() * PAD;
        // The pad in the space of each model: that of the world where its instances make it largest there.
        let mut pads = vec![0.0f32; geometry.prototypes().len()];
        for instance in geometry.instances() {
            let pad = pad * instance.map.to_local.to_cols_array().iter().map(|x| x * x).sum::<f32>().sqrt();
            let most = &mut pads[instance.prototype as usize];
            *most = most.max(pad);
        }
        let nest = |(model, pad): (&MeshPrototype, f32)| {
            let same = known.iter().find(|(mesh, nest)| {
                Arc::ptr_eq(mesh, &model.mesh) && (pad..=4.0 * pad).contains(&nest.pad) && nest.density == density
            });
            let built = || {
                Arc::new(build::nest(
                    model,
                    model.mesh.triangles.len() as u32,
                    density,
                    2.0 * pad,
                    &HiddenPrimitives::NONE,
                ))
            };
            (model.mesh.clone(), same.map_or_else(built, |(_, nest)| nest.clone()))
        };
        let models = geometry.prototypes().iter().zip(pads).map(nest).collect();
        Grid { world: build::nest(geometry, geometry.finite(), density, pad, hidden), models, width }
    }

    pub fn bytes(&self) -> usize {
        self.world.bytes() + self.models.iter().map(|(_, nest)| nest.bytes()).sum::<usize>()
    }
}
