//! Pictures and patterns on surfaces.
//!
//! [`TextureBindings`] says which entities have any: those without pay one comparison. Where a hit is on one with
//! textures, [`TextureBindings::evaluate`] finds the texture coordinates, averages every map over the footprint of the
//! ray's [`RayCone`], and gives back the material of this one point, with the shading normal perturbed.

mod bindings;
mod image;
mod noise;
mod pattern;
mod perturb_normal;
mod ray_cone;

pub use bindings::{TextureBindings, TextureLayer, TextureSet};
pub use image::ImageSampler;
pub use ray_cone::RayCone;

#[cfg(test)]
mod tests;
