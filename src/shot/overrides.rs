//! What the command line gives over a script and its scene.

use crate::components::{Accel, Aov, Integrator, Render};

/// Settings of the command line; they have the last word in every frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// The part of the frame that is rendered: left, top, width and height in pixels.
    pub region: Option<[u32; 4]>,
    /// The camera, by its name, that all frames are seen from.
    pub camera: Option<String>,
    /// Samples per pixel.
    pub samples: Option<u32>,
    /// Seed of all sampling.
    pub seed: Option<u64>,
    /// Which light paths are followed.
    pub integrator: Option<Integrator>,
    /// What finds primitives along rays.
    pub accel: Option<Accel>,
    /// Side of the squares that point lights are widened to.
    pub light_size: Option<f64>,
    /// Bits per channel of the picture file.
    pub bit_depth: Option<u32>,
    /// Layers beside the colours.
    pub aovs: Option<Vec<Aov>>,
    /// Whether noise is filtered out.
    pub denoise: Option<bool>,
}

impl Overrides {
    /// Whether they have a say in how light is followed, and so in which settings count.
    pub(super) fn change_light(&self) -> bool {
        self.integrator.is_some()
            || self.samples.is_some()
            || self.accel.is_some()
            || self.light_size.is_some()
            || self.bit_depth.is_some()
            || self.denoise.is_some()
    }

    pub(super) fn apply(&self, render: Render) -> Render {
        Render {
            size: self.size.unwrap_or(render.size),
            region: self.region.or(render.region),
            samples: self.samples.unwrap_or(render.samples),
            seed: self.seed.or(render.seed),
            integrator: self.integrator.unwrap_or(render.integrator),
            accel: self.accel.unwrap_or(render.accel),
            light_size: self.light_size.unwrap_or(render.light_size),
            bit_depth: self.bit_depth.unwrap_or(render.bit_depth),
            aovs: self.aovs.clone().unwrap_or(render.aovs),
            denoise: self.denoise.unwrap_or(render.denoise),
            ..render
        }
    }
}
