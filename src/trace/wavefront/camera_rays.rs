//! The camera rays of samples, eight at a time.

use super::buffers::{FilterSample, WavefrontBuffers};
use super::context::RenderContext;
use crate::trace::material::texture::RayCone;
use crate::trace::sampler::{Domain, RayNode, SampleSet};
use crate::trace::simd::{Kernel, LANES, Wide};

/// Groups of eight whose points are drawn one right after the other: a point is a long chain of products, and the
/// processor is at several of them at once.
const AHEAD: usize = 4;

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
        let count = samples.count();
        let (mut squares, mut lenses) = ([[[0.5; LANES]; 2]; AHEAD], [[[0.5; LANES]; 2]; AHEAD]);
        for start in (0..count).step_by(AHEAD * LANES) {
            let groups = AHEAD.min((count - start).div_ceil(LANES));
            for group in 0..groups {
                let eight = samples.eight(numbers(start + group * LANES, count), [RayNode::CAMERA; LANES]);
                if context.settings.strata > 1 {
                    let [x, y] = eight.in_own_cell::<L>(Domain::Pixel);
                    squares[group] = [x.store(), y.store()];
                }
                if context.camera.has_lens() {
                    let [x, y] = eight.stratified::<L>(Domain::Lens);
                    lenses[group] = [x.store(), y.store()];
                }
            }
            for group in 0..groups {
                let first = start + group * LANES;
                let (which, square) = (numbers(first, count), &squares[group]);
                let mut place = [[0.0; LANES]; 2];
                let mut filter_samples = [FilterSample::default(); LANES];
                for i in 0..LANES {
                    let [x, y] = samples.pixel(which[i]);
                    let (offset, weight) = context.filter.sample([square[0][i], square[1][i]]);
                    [place[0][i], place[1][i]] = [x as f32 + offset[0], y as f32 + offset[1]];
                    let (dx, dy) = (offset[0] - 0.5, offset[1] - 0.5);
                    filter_samples[i] = FilterSample { weight, off_center: dx * dx + dy * dy };
                }
                let lens = [L::load(&lenses[group][0]), L::load(&lenses[group][1])];
                let (origin, direction) = context.camera.aim([L::load(&place[0]), L::load(&place[1])], lens);
                buffers.start(origin, direction, cone, &filter_samples[..LANES.min(count - first)]);
            }
        }
    }
}

/// Eight numbers from the first on, below `count`.
#[inline(always)]
fn numbers(first: usize, count: usize) -> [u32; LANES] {
    let mut which = [0; LANES];
    for (i, sample) in which.iter_mut().enumerate() {
        *sample = (first + i).min(count - 1) as u32;
    }
    which
}
