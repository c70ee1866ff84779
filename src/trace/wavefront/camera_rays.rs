//! The camera rays of samples, eight at a time.

use super::buffers::{FilterSample, WavefrontBuffers};
use super::context::RenderContext;
use crate::trace::material::texture::RayCone;
use crate::trace::sampler::{Domain, RayNode, SampleSet};
use crate::trace::simd::{Kernel, LANES, Wide};

/// The camera rays of samples.
pub struct CameraRayKernel<'a> {
    /// What is traced.
    pub context: RenderContext<'a>,
    /// The samples that rays are made for.
    pub samples: SampleSet<'a>,
    /// Where the rays go.
    pub buffers: &'a mut WavefrontBuffers,
}

impl Kernel for CameraRayKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let CameraRayKernel { context, samples, buffers } = self;
        let (pixel, strata) = (context.camera.footprint(), context.settings.strata as f32);
        let cone = RayCone { width: pixel.width / strata, spread: pixel.spread / strata };
        for first in (0..samples.count()).step_by(LANES) {
            let mut which = [0; LANES];
            for (i, sample) in which.iter_mut().enumerate() {
                *sample = (first + i).min(samples.count() - 1) as u32;
            }
            let eight = samples.eight(which, [RayNode::CAMERA; LANES]);
            let mut square = [[0.5; LANES]; 2];
            if context.settings.strata > 1 {
                let [x, y] = eight.in_own_cell::<L>(Domain::Pixel);
                square = [x.store(), y.store()];
            }
            let mut place = [[0.0; LANES]; 2];
            let mut filter_samples = [FilterSample::default(); LANES];
            for i in 0..LANES {
                let [x, y] = samples.pixel(which[i]);
                let (offset, weight) = context.filter.sample([square[0][i], square[1][i]]);
                [place[0][i], place[1][i]] = [x as f32 + offset[0], y as f32 + offset[1]];
                let (dx, dy) = (offset[0] - 0.5, offset[1] - 0.5);
                filter_samples[i] = FilterSample { weight, off_center: dx * dx + dy * dy };
            }
            let mut lens = [L::splat(0.5); 2];
            if context.camera.has_lens() {
                lens = eight.stratified(Domain::Lens);
            }
            let (origin, direction) = context.camera.aim([L::load(&place[0]), L::load(&place[1])], lens);
            buffers.start(origin, direction, cone, &filter_samples[..LANES.min(samples.count() - first)]);
        }
    }
}
