//! Light along rays, wave by wave.
//!
//! The rays of many samples go through the scene together: all that left the camera, then all that these gave rise to,
//! and so on down to the depth cap. Neighbours in a wave run alike, so that they are traced in packets, and so are
//! their shadow rays, light by light. What a ray brings home is added to its sample in the order of the wave, so that
//! the sums do not depend on how samples are batched.
//!
//! [`recursive`] is Whitted (CACM 1980) and distribution ray tracing (Cook, Porter, Carpenter, SIGGRAPH 1984): every
//! hit spawns all the rays that its material asks for. What a Whitted picture leaves out (lens, gloss, soft shadows) is
//! switched off when the settings are resolved. [`path`] is path tracing (Kajiya 1986): every hit goes on in one
//! direction, chosen at random. No contribution is cut off for being small.

mod path;
mod recursive;
mod wave;

use glam::Vec3;

use super::camera::CameraRays;
use super::environment::CubeMap;
use super::lights::Lights;
use super::sampler::{Domain, Node, Sampler};
use super::surfacing::Surfacing;
use super::{Accelerator, Geometry, Worker};
use crate::components::{Fresnel, Integrator, Render, Shadows};
pub use wave::Buffers;

/// Where on a light a shadow ray ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSampling {
    Center,
    /// n x n cell centres.
    Fixed(u32),
    Random,
    Jittered,
}

/// Settings of the recursion, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub integrator: Integrator,
    pub strata: u32,
    pub max_depth: u32,
    pub light_sampling: LightSampling,
    pub gloss: bool,
    pub lens: bool,
    pub transparent_shadows: bool,
    pub fresnel: Fresnel,
    pub background: Vec3,
    pub seed: u64,
}

impl Settings {
    /// Resolves the settings of a scene; `seed` is that of the frame.
    pub fn new(render: &Render, seed: u64) -> Self {
        let distribution = render.integrator != Integrator::Whitted;
        let strata = render.strata();
        let light_sampling = match render.shadows {
            _ if !distribution => LightSampling::Center,
            Shadows::Hard => LightSampling::Center,
            Shadows::Auto if strata > 1 || render.integrator == Integrator::Path => LightSampling::Jittered,
            Shadows::Auto | Shadows::Fixed => LightSampling::Fixed(render.shadow_samples.isqrt().max(1)),
            Shadows::Random => LightSampling::Random,
            Shadows::Jittered => LightSampling::Jittered,
        };
        Settings {
            integrator: render.integrator,
            strata,
            max_depth: render.max_depth,
            light_sampling,
            gloss: distribution,
            lens: distribution,
            transparent_shadows: render.transparent_shadows,
            fresnel: render.fresnel,
            background: render.background.as_vec3(),
            seed,
        }
    }
}

impl Settings {
    /// The first sample of a pixel: paths are led by Sobol points, the rest by jittered strata.
    pub fn sampler(&self, [x, y]: [u32; 2], width: u32) -> Sampler {
        match self.integrator {
            Integrator::Path => Sampler::sobol(self.seed, [x, y], self.strata * self.strata),
            Integrator::Whitted | Integrator::Distribution => Sampler::new(self.seed, y * width + x, self.strata),
        }
    }
}

/// Everything that a frame is traced from.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub geometry: &'a Geometry,
    pub accelerator: &'a Accelerator,
    pub materials: &'a [Surfacing],
    pub lights: &'a Lights,
    pub camera: &'a CameraRays,
    /// Takes the place of the background colour.
    pub environment: Option<&'a CubeMap>,
    pub settings: &'a Settings,
    pub width: u32,
}

/// Samples that go through the scene together: enough to keep packets full, few enough for the cache.
const BATCH: usize = 2048;

/// Linear colours of pixels (x, y), counted from the top left: means of their samples, each clamped to 0..1.
///
/// Pixels that follow each other in the list should be neighbours.
pub fn pixels(view: View, places: &[[u32; 2]], worker: &mut Worker) -> Vec<[f32; 3]> {
    let strata = view.settings.strata;
    let samples = (strata * strata) as usize;
    let mut sums = vec![Vec3::ZERO; places.len()];
    let mut buffers = std::mem::take(&mut worker.waves);
    let total = places.len() * samples;
    for first in (0..total).step_by(BATCH) {
        let batch = first..(first + BATCH).min(total);
        buffers.begin(batch.len());
        let of_pixel = |place| view.settings.sampler(place, view.width);
        let mut sampler = of_pixel(places[first / samples]);
        for index in batch.clone() {
            let [x, y] = places[index / samples];
            if index % samples == 0 {
                sampler = of_pixel([x, y]);
            }
            sampler.sample = (index % samples) as u32;
            let offset = if strata == 1 { [0.5; 2] } else { sampler.in_own_cell(Node::CAMERA, Domain::Pixel) };
            buffers.start(view.camera.ray(x, y, offset, &sampler), sampler);
        }
        worker.counters.primary_rays += batch.len() as u64;
        wave::trace(view, &mut buffers, worker);
        for (index, color) in batch.zip(&buffers.colors) {
            sums[index / samples] += color.clamp(Vec3::ZERO, Vec3::ONE);
        }
    }
    worker.waves = buffers;
    sums.into_iter().map(|sum| (sum / samples as f32).to_array()).collect()
}
