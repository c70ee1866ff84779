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
use super::lights::Light;
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

/// Everything that a frame is traced from.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub geometry: &'a Geometry,
    pub accelerator: &'a Accelerator,
    pub materials: &'a [Surfacing],
    pub lights: &'a [Light],
    pub camera: &'a CameraRays,
    /// Takes the place of the background colour.
    pub environment: Option<&'a CubeMap>,
    pub settings: &'a Settings,
    pub width: u32,
}

/// One of the equal parts that the samples of every pixel are divided into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    pub index: u32,
    pub of: u32,
}

impl Share {
    pub const WHOLE: Share = Share { index: 0, of: 1 };

    /// Samples of a pixel that belong to this part.
    ///
    /// Which ones is drawn anew for each pixel, so that parts are strangers to strata of pixel, lens and lights. Where
    /// the number of samples is no multiple of the parts, chance decides per pixel which parts have one more: no part
    /// counts for more than another in the mean.
    fn samples(self, pixel: &Sampler) -> impl Iterator<Item = u32> + use<> {
        const STEPS: u64 = 1 << 24;
        let pixel = *pixel;
        let count = pixel.strata * pixel.strata;
        let shift = pixel.offset(Domain::Time, STEPS);
        let bound = move |part: u32| {
            let at = (u64::from(part) * u64::from(count) * STEPS).div_ceil(u64::from(self.of));
            (at.saturating_sub(shift).div_ceil(STEPS) as u32).min(count)
        };
        let whole = self.of == 1;
        (bound(self.index)..bound(self.index + 1))
            .map(move |slot| if whole { slot } else { pixel.shuffled(Domain::Time, slot) })
    }
}

/// Samples that go through the scene together: enough to keep packets full, few enough for the cache.
const BATCH: usize = 2048;

/// Sums over a share of the samples of pixels (x, y), counted from the top left: linear colours, each clamped to 0..1.
///
/// Pixels that follow each other in the list should be neighbours.
pub fn pixels(view: View, places: &[[u32; 2]], share: Share, worker: &mut Worker) -> Vec<Vec3> {
    let strata = view.settings.strata;
    let mut sums = vec![Vec3::ZERO; places.len()];
    let mut buffers = std::mem::take(&mut worker.waves);
    let of_pixel = |[x, y]: [u32; 2]| Sampler::new(view.settings.seed, y * view.width + x, strata);
    let mut work = places.iter().enumerate().flat_map(|(place, at)| {
        let mut sampler = of_pixel(*at);
        share.samples(&sampler).map(move |sample| {
            sampler.sample = sample;
            (place, sampler)
        })
    });
    let mut batch: Vec<usize> = Vec::with_capacity(BATCH);
    loop {
        batch.clear();
        buffers.begin();
        for (place, sampler) in work.by_ref().take(BATCH) {
            let [x, y] = places[place];
            let offset = if strata == 1 { [0.5; 2] } else { sampler.in_own_cell(Node::CAMERA, Domain::Pixel) };
            buffers.start(view.camera.ray(x, y, offset, &sampler), sampler);
            batch.push(place);
        }
        if batch.is_empty() {
            break;
        }
        worker.counters.primary_rays += batch.len() as u64;
        wave::trace(view, &mut buffers, worker);
        for (place, color) in batch.iter().zip(&buffers.colors) {
            sums[*place] += color.clamp(Vec3::ZERO, Vec3::ONE);
        }
    }
    worker.waves = buffers;
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_a_fair_partition_of_the_samples() {
        for (strata, of) in [(1, 1), (2, 4), (3, 7), (4, 16), (4, 5), (6, 1)] {
            let mut sizes = vec![0u32; of as usize];
            for pixel in 0..4000 {
                let sampler = Sampler::new(3, pixel, strata);
                let mut seen = vec![false; (strata * strata) as usize];
                for index in 0..of {
                    for sample in (Share { index, of }).samples(&sampler) {
                        assert!(!std::mem::replace(&mut seen[sample as usize], true));
                        sizes[index as usize] += 1;
                    }
                }
                assert!(seen.iter().all(|s| *s), "{strata} {of}");
            }
            let mean = f64::from(4000 * strata * strata) / f64::from(of);
            assert!(sizes.iter().all(|n| (f64::from(*n) / mean - 1.0).abs() < 0.03), "{strata} {of}: {sizes:?}");
        }
        let whole: Vec<u32> = Share::WHOLE.samples(&Sampler::new(1, 2, 3)).collect();
        assert_eq!(whole, (0..9).collect::<Vec<_>>());
    }
}
