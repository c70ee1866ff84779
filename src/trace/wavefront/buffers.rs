//! Memory of the waves, kept from batch to batch.

use glam::Vec3;

use super::batch::ShadingEntry;
use super::context::RenderContext;
use super::path_state::PathStateLanes;
use super::ray_queue::RayQueue;
use super::shadow_ray_queue::ShadowRayQueue;
use super::slots::BATCH;
use crate::film::{Feature, SeenFeature};
use crate::trace::material::texture::RayCone;
use crate::trace::simd::{LANES, V3, Wide};
use crate::trace::soa::Hits;

/// A sample's part in its pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct FilterSample {
    pub weight: f32,
    /// Square of its distance from the pixel's centre.
    pub off_center: f32,
}

/// Hits that are shaded side by side, by what shades them.
#[derive(Debug, Default)]
pub struct ShadingPlaces {
    /// On paths those of Lambert's law, elsewhere those of Blinn-Phong's.
    pub usual: Vec<ShadingEntry>,
    /// Mirrors and clear glass on paths.
    pub polished: Vec<ShadingEntry>,
    /// All other surfaces on paths that send out no light.
    pub mixed: Vec<ShadingEntry>,
}

impl ShadingPlaces {
    /// Forgets all; memory stays.
    pub fn clear(&mut self) {
        [&mut self.usual, &mut self.polished, &mut self.mixed].into_iter().for_each(Vec::clear);
    }
}

/// Memory of the waves, kept from batch to batch.
#[derive(Debug, Default)]
pub struct WavefrontBuffers {
    /// Rays that are traced now.
    pub wave: RayQueue,
    /// Rays that follow them.
    pub next: RayQueue,
    /// What the wave met.
    pub hits: Hits,
    /// By eights of rays: which of them are to be looked at before they are shaded.
    pub special: Vec<u8>,
    /// Which rays crossed a lamp, likewise.
    pub crossed: Vec<u8>,
    /// Whether something stops each shadow ray of a queue.
    pub blocked: Vec<bool>,
    /// By light.
    pub shadows: Vec<ShadowRayQueue>,
    /// Hits that are shaded side by side.
    pub places: ShadingPlaces,
    /// Colour of each sample, light group by light group or row by row: see [`super::accumulator_slot`].
    pub colors: Vec<Vec3>,
    /// Numbers of the samples, see `SampleSet`.
    pub numbers: Vec<u32>,
    /// Where each sample lies in its pixel.
    pub filter_samples: Vec<FilterSample>,
    /// What the camera ray of each sample met; empty unless the film wants it.
    pub features: Vec<Option<Feature>>,
    /// How much fog hides of what lies behind everything, by sample; empty where nobody asks for it.
    pub veils: Vec<f32>,
    /// What each sample shows through mirrors and clear glass; empty as `features` is.
    pub seen: Vec<SeenFeature>,
    /// Whether the camera ray of each sample met a shadow catcher; empty where there are none.
    pub caught: Vec<bool>,
}

impl WavefrontBuffers {
    /// Makes room for the colours of so many samples.
    pub fn begin(&mut self, context: RenderContext, samples: usize) {
        let features = context.settings.features;
        self.wave.clear();
        self.filter_samples.clear();
        self.features.clear();
        self.features.resize(if features { samples } else { 0 }, None);
        self.veils.clear();
        self.veils.resize(if features { samples } else { 0 }, 0.0);
        self.seen.clear();
        self.seen.resize(if features { samples } else { 0 }, SeenFeature::default());
        self.caught.clear();
        self.caught.resize(if context.catchers { samples } else { 0 }, false);
        self.colors.clear();
        self.colors.resize((context.rows() - 1) * BATCH + samples, Vec3::ZERO);
    }

    /// Adds the camera rays of the next samples, one for each filter sample.
    #[inline(always)]
    pub fn start<L: Wide>(&mut self, origin: V3<L>, direction: V3<L>, cone: RayCone, filter_samples: &[FilterSample]) {
        let first = self.filter_samples.len() as u32;
        let mut samples = [0; LANES];
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample = first + i as u32;
        }
        self.wave.compress_store(
            (1 << filter_samples.len()) - 1,
            origin,
            direction,
            &PathStateLanes::first(&samples, cone),
        );
        for filter_sample in filter_samples {
            self.filter_samples.push(*filter_sample);
        }
    }
}
