//! How many samples the pixels of a frame have, and how noisy they are: what false colours show.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use super::{Shot, Slice, bands, files, moments, shutter};
use crate::base::diagnostics::Diagnostics;
use crate::components::{Aov, Edit};
use crate::film::{PixelAccumulator, PixelBounds};
use crate::systems::{self, PartialFrame};

/// Samples and noise of the pixels of a picture, top row first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NoiseMap {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// How many samples each pixel has.
    pub samples: Vec<u32>,
    /// Standard error of the luminance of each, in linear light: what is left of its noise, before it is filtered.
    pub noise: Vec<f32>,
}

impl NoiseMap {
    fn new(size: [u32; 2]) -> NoiseMap {
        let count = PixelBounds::whole(size).count();
        NoiseMap { size, samples: vec![0; count], noise: vec![0.0; count] }
    }

    fn put(&mut self, origin: [u32; 2], places: &[[u32; 2]], sums: &PixelAccumulator) {
        for (i, [x, y]) in places.iter().enumerate() {
            let at = (y - origin[1]) as usize * self.size[0] as usize + (x - origin[0]) as usize;
            let variance = sums.spread(i).map_or(0.0, |[_, variance]| variance);
            (self.samples[at], self.noise[at]) = (sums.samples(i), variance.sqrt().min(f64::from(f32::MAX)) as f32);
        }
    }
}

impl Shot {
    /// Samples and noise of a frame, as it is traced; `None` if `cancel` was raised.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn noise_of(&mut self, frame: u32, cancel: &AtomicBool) -> Result<Option<NoiseMap>, Diagnostics> {
        let Shot { stage, input, .. } = self;
        let mut slices = input.slices(frame)?;
        for Slice { edits, .. } in &mut slices {
            let mut settings = shutter::last_render(edits).unwrap_or(&input.settings).clone();
            (settings.aovs, settings.denoise) = (vec![Aov::Variance], false);
            edits.push(Edit::Render(settings));
        }
        let [origin, size] = bands::settings_of(&slices, &input.settings).pixel_bounds();
        let parts = bands::settings_of(&slices, &input.settings).parts_of_moment();
        let map = Arc::new(Mutex::new(NoiseMap::new(size)));
        let seen = map.clone();
        let mut partial = PartialFrame::default();
        partial.tile_sink = Some(Arc::new(move |places: &[[u32; 2]], sums: &PixelAccumulator| {
            seen.lock().unwrap_or_else(PoisonError::into_inner).put(origin, places, sums);
        }));
        let mut whole = true;
        input.with_slices(stage, frame, moments::refined(slices, parts), |stage, share| {
            files::load_all(stage)?;
            whole = systems::render_samples(stage, share, &mut partial, cancel, &|_, _| {})?;
            Ok(whole)
        })?;
        let map = std::mem::take(&mut *map.lock().unwrap_or_else(PoisonError::into_inner));
        Ok(whole.then_some(map))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shot::{self, OpenOptions};

    #[test]
    fn adaptive_samples_go_where_noise_is() {
        let desk = tempfile::tempdir().unwrap();
        let file = desk.path().join("a.ron");
        let scene = r#"(
            camera: (from: (0.0, 0.0, 5.0), at: (0.0, 0.0, 0.0), fov: 40.0),
            render: (size: (32, 16), samples: 64, min_samples: 16, noise_threshold: 0.02, integrator: Path),
            entities: [
                (sphere: (radius: 0.6)),
                (area_light: (size: (2.0, 2.0), color: (4.0, 4.0, 4.0)), transform: (translation: (0.0, 3.0, 2.0))),
            ],
        )"#;
        std::fs::write(&file, scene).unwrap();
        let (mut shot, _) = shot::open_with(&file, OpenOptions::default()).unwrap();
        let map = shot.noise_of(1, &AtomicBool::new(false)).unwrap().unwrap();
        assert_eq!((map.size, map.samples.len()), ([32, 16], 512));
        assert_eq!((map.samples[0], map.noise[0]), (16, 0.0));
        assert!(map.samples.iter().any(|count| *count > 16) && map.noise.iter().any(|noise| *noise > 0.0));
        assert_eq!(shot.noise_of(1, &AtomicBool::new(true)).unwrap(), None);
    }
}
