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
//! direction, chosen at random; [`photon`] reads indirect light from photons instead. No contribution is cut off for
//! being small. [`again`] takes only those samples that may look otherwise than in a picture before.
//!
//! # Side by side
//!
//! Camera rays, and hits on surfaces of the usual kinds ([`matt`] on paths, [`classic`] else), go through lanes of eight:
//! points, light, directions and Sobol points by the same generic code that a single hit runs, so that the bits agree.
//! Rays, their errands and their hits lie in columns all the way ([`errand`], [`crate::trace::columns`]): eight neighbours
//! are loaded at once, and the lanes that go on are packed and put down at once. [`sift`] finds the rays that want a look
//! of their own (they left the scene, crossed a lamp, ran through glass that swallows light), and what is special about
//! surfaces (maps, glass, gloss, microfacets, what shines) goes alone. A sample's colour does not depend on which others
//! stand beside it.
//!
//! With one ray after the other, three fifths of a frame were spent outside traversal, most of it on Sobol points and on
//! copies of hits and surfaces. Lanes took 0.75 (matt meshes), 0.6 (Cornell box) and 0.5 (thin lens) of that time, columns
//! in place of rows 0.73, 0.8 and 0.59 of what was left. A closure or a function of arrays that is handed values of lanes
//! costs more than all of that gains: see [`Kernel::run`].

mod adaptive;
mod again;
mod classic;
mod errand;
mod feature;
mod group;
mod matt;
mod path;
mod photon;
mod recursive;
mod sift;
mod wave;

use glam::Vec3;

use super::before::Before;
use super::camera::CameraRays;
use super::environment::Environment;
use super::footprint::Lookout;
use super::lights::Lights;
use super::sampler::{Domain, Node, Sample, Sampler, Set};
use super::simd::{Kernel, LANES, Wide, Width};
use super::surfacing::Surfacing;
use super::texture::{Cone, Skins};
use super::{Accelerator, Geometry, Worker};
use crate::base::random::combine;
use crate::components::{Fresnel, Integrator, Render, Shadows};
use crate::film::{FilterTable, PixelAccumulator};
pub use adaptive::Noise;
pub use again::expose_again;
pub use photon::{Guide, Photons, Shelf};
pub use wave::Buffers;
use wave::Lot;

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
    /// Side of the strata of one round of samples.
    pub strata: u32,
    pub rounds: u32,
    /// When a pixel has had rounds enough.
    pub noise: Option<Noise>,
    /// Whether the film wants to know what the camera's rays meet first.
    pub features: bool,
    pub max_depth: u32,
    pub light_sampling: LightSampling,
    pub gloss: bool,
    pub lens: bool,
    pub transparent_shadows: bool,
    pub fresnel: Fresnel,
    pub background: Vec3,
    pub seed: u64,
    /// Photons of a pass, and the seed of theirs: the camera is not in it.
    pub photons: u32,
    pub photon_seed: u64,
    /// Of the first pass; follows from the photons if not given.
    pub photon_radius: Option<f64>,
}

impl Settings {
    /// Resolves the settings of a scene; `seed` is that of the frame.
    pub fn new(render: &Render, seed: u64) -> Self {
        let distribution = render.integrator != Integrator::Whitted;
        let strata = render.strata();
        let paths = matches!(render.integrator, Integrator::Path | Integrator::Photon);
        let light_sampling = match render.shadows {
            _ if !distribution => LightSampling::Center,
            Shadows::Hard => LightSampling::Center,
            Shadows::Auto if strata > 1 || paths => LightSampling::Jittered,
            Shadows::Auto | Shadows::Fixed => LightSampling::Fixed(render.shadow_samples.isqrt().max(1)),
            Shadows::Random => LightSampling::Random,
            Shadows::Jittered => LightSampling::Jittered,
        };
        Settings {
            integrator: render.integrator,
            strata,
            rounds: render.rounds(),
            noise: render.noise_threshold.map(|threshold| Noise { threshold, exposure: render.exposure }),
            features: render.gathers_features(),
            max_depth: render.max_depth,
            light_sampling,
            gloss: distribution,
            lens: distribution,
            transparent_shadows: render.transparent_shadows && render.integrator != Integrator::Photon,
            fresnel: render.fresnel,
            background: render.background.as_vec3(),
            seed,
            photons: render.photons,
            photon_seed: render.seed.unwrap_or(0),
            photon_radius: render.photon_radius,
        }
    }
}

impl Settings {
    /// Whether light is looked for along single paths.
    pub fn follows_paths(&self) -> bool {
        matches!(self.integrator, Integrator::Path | Integrator::Photon)
    }

    /// The first sample of a pixel in a round with a seed of its own: paths are led by Sobol points, the rest by
    /// jittered strata.
    pub fn sampler(&self, seed: u64, [x, y]: [u32; 2], width: u32) -> Sampler {
        match self.integrator {
            Integrator::Path | Integrator::Photon => Sampler::sobol(seed, [x, y], self.strata * self.strata),
            Integrator::Whitted | Integrator::Distribution => Sampler::new(seed, y * width + x, self.strata),
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
    pub skins: &'a Skins,
    pub camera: &'a CameraRays,
    /// The frame before, where the film wants to know what has moved.
    pub before: Option<&'a Before>,
    /// Takes the place of the background colour.
    pub environment: Option<&'a Environment>,
    pub settings: &'a Settings,
    /// What shading that goes side by side runs in.
    pub lanes: Width,
    /// Where in and around a pixel its samples lie.
    pub filter: &'a FilterTable,
    pub width: u32,
    /// Passes that lights are divided into, 1 at least.
    pub passes: usize,
    /// Places that are noted where rays cross them.
    pub lookout: Option<Lookout<'a>>,
    /// What a pass of photon mapping knows of the light.
    pub photons: Option<&'a Photons>,
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
        let whole = self.of == 1;
        let shift = if whole { 0 } else { pixel.offset(Domain::Time, STEPS) };
        let bound = |part: u32| {
            let at = (u64::from(part) * u64::from(count) * STEPS).div_ceil(u64::from(self.of));
            (at.saturating_sub(shift).div_ceil(STEPS) as u32).min(count)
        };
        let slots = if whole { 0..count } else { bound(self.index)..bound(self.index + 1) };
        slots.map(move |slot| if whole { slot } else { pixel.shuffled(Domain::Time, slot) })
    }
}

/// Samples that go through the scene together: enough to keep packets full, few enough for the cache.
const BATCH: usize = 2048;

/// Adds the samples of pixels (x, y), counted from the top left, to a tally with a place for each.
///
/// Pixels that follow each other in the list should be neighbours, and all of one tile. Samples come in rounds, each of
/// them well spread by itself: n x n strata under a key of its own. After each round the pixels that are still noisy go
/// on; which these are depends on their tile alone.
///
/// Of the samples of a round only a share is taken; where that is not the whole, all pixels get all rounds, so that
/// shares stay equal.
///
/// There is a tally for each pass; all but the light of what has a pass of its own goes into the first.
pub fn expose(view: View, places: &[[u32; 2]], share: Share, tallies: &mut [PixelAccumulator], worker: &mut Worker) {
    expose_pixels(view, places, (0..places.len() as u32).collect(), share, tallies, worker);
}

/// As [`expose`], of some of the pixels: all of a block, where noise decides about rounds.
fn expose_pixels(
    view: View,
    places: &[[u32; 2]],
    mut active: Vec<u32>,
    share: Share,
    tallies: &mut [PixelAccumulator],
    worker: &mut Worker,
) {
    for round in 0..view.settings.rounds {
        if let Some(noise) = view.settings.noise.filter(|_| round > 0 && share == Share::WHOLE) {
            noise.retain_noisy(places, &tallies[0], &mut active);
        }
        if active.is_empty() {
            return;
        }
        let picked = Picked { round, share, places, active: &active };
        sample(view, picked, tallies, worker);
    }
}

/// Samples that are to be taken.
struct Picked<'a> {
    round: u32,
    share: Share,
    places: &'a [[u32; 2]],
    active: &'a [u32],
}

/// Adds a share of one round of samples to the active pixels.
fn sample(view: View, picked: Picked, tallies: &mut [PixelAccumulator], worker: &mut Worker) {
    let Picked { round, share, places, active } = picked;
    let seed = if round == 0 { view.settings.seed } else { combine(view.settings.seed, round.into()) };
    let mut batch = Batch::default();
    for pixel in active {
        let place = places[*pixel as usize];
        let mut sampler = view.settings.sampler(seed, place, view.width);
        for sample in share.samples(&sampler) {
            sampler.sample = sample;
            batch.pixels.push(*pixel as usize);
            batch.samples.push((place, sampler));
            if batch.samples.len() == BATCH {
                add_batch(view, &mut batch, tallies, worker);
            }
        }
    }
    add_batch(view, &mut batch, tallies, worker);
}

/// Samples that are traced together, [`BATCH`] at most.
#[derive(Default)]
struct Batch {
    /// Numbers of their pixels in the list.
    pixels: Vec<usize>,
    /// Pixels, and samples of theirs.
    samples: Vec<Sample>,
}

/// Adds the samples to their pixels, and empties the batch.
fn add_batch(view: View, batch: &mut Batch, tallies: &mut [PixelAccumulator], worker: &mut Worker) {
    let mut buffers = std::mem::take(&mut worker.waves);
    if view.lookout.is_some() {
        worker.footprint.begin_of_pixels(batch.pixels.iter().copied());
    }
    trace_batch(view, &batch.samples, &mut buffers, worker);
    for (i, (pixel, lot)) in batch.pixels.drain(..).zip(&buffers.lots).enumerate() {
        for (pass, tally) in tallies.iter_mut().enumerate() {
            tally.add(pixel, buffers.colors[pass * BATCH + i], lot.weight);
        }
        if view.settings.features {
            tallies[0].add_feature(pixel, buffers.features[i].as_ref(), lot.off_center);
        }
        if view.lookout.is_some() {
            worker.footprint.put_down(i, pixel);
        }
    }
    batch.samples.clear();
    worker.waves = buffers;
}

/// Traces samples of pixels, [`BATCH`] at most.
fn trace_batch(view: View, samples: &[Sample], buffers: &mut Buffers, worker: &mut Worker) {
    buffers.begin(samples.len(), view.passes, view.settings.features);
    let mut numbers = std::mem::take(&mut buffers.numbers);
    let set = Set::new(samples, &mut numbers);
    view.lanes.run(Start { view, samples: set, buffers });
    worker.counters.primary_rays += samples.len() as u64;
    wave::trace(view, set, buffers, worker);
    buffers.numbers = numbers;
}

/// Where in and around its pixel a sample lies, from the top left corner, and its weight.
fn place_in_pixel(view: View, sampler: &Sampler) -> ([f32; 2], f32) {
    let square = if view.settings.strata == 1 { [0.5; 2] } else { sampler.in_own_cell(Node::CAMERA, Domain::Pixel) };
    view.filter.sample(square)
}

/// The camera rays of samples.
struct Start<'a> {
    view: View<'a>,
    samples: Set<'a>,
    buffers: &'a mut Buffers,
}

impl Kernel for Start<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let Start { view, samples, buffers } = self;
        let cone = Cone { width: 0.0, spread: view.camera.spread() / view.settings.strata as f32 };
        for first in (0..samples.count()).step_by(LANES) {
            let mut which = [0; LANES];
            for (i, sample) in which.iter_mut().enumerate() {
                *sample = (first + i).min(samples.count() - 1) as u32;
            }
            let eight = samples.eight(which, [Node::CAMERA; LANES]);
            let mut square = [[0.5; LANES]; 2];
            if view.settings.strata > 1 {
                let [x, y] = eight.in_own_cell::<L>(Domain::Pixel);
                square = [x.store(), y.store()];
            }
            let mut place = [[0.0; LANES]; 2];
            let mut lots = [Lot::default(); LANES];
            for i in 0..LANES {
                let [x, y] = samples.pixel(which[i]);
                let (offset, weight) = view.filter.sample([square[0][i], square[1][i]]);
                [place[0][i], place[1][i]] = [x as f32 + offset[0], y as f32 + offset[1]];
                let (dx, dy) = (offset[0] - 0.5, offset[1] - 0.5);
                lots[i] = Lot { weight, off_center: dx * dx + dy * dy };
            }
            let mut lens = [L::splat(0.5); 2];
            if view.camera.has_lens() {
                lens = eight.stratified(Domain::Lens);
            }
            let (origin, direction) = view.camera.aim([L::load(&place[0]), L::load(&place[1])], lens);
            buffers.start(origin, direction, cone, &lots[..LANES.min(samples.count() - first)]);
        }
    }
}

#[cfg(test)]
mod tests;
