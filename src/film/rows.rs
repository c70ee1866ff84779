//! Noise is filtered out of a frame that comes band by band, as it is out of the whole.

use super::{DENOISE_REACH, Film, PixelBounds, denoise};

/// Takes the bands of a frame in their order, and gives rows as soon as all that they depend on is there.
pub struct RowDenoiser {
    frame: PixelBounds,
    /// Rows as they came that later ones depend on.
    kept: Option<(PixelBounds, Film)>,
    /// The first row that was not given yet.
    next: u32,
}

impl RowDenoiser {
    /// For the bands of these pixels.
    pub fn new(frame: PixelBounds) -> Self {
        RowDenoiser { frame, kept: None, next: frame.origin[1] }
    }

    /// Adds the band below those before; gives the rows that are done with it, if there are any, and where they lie.
    pub fn add(&mut self, band: PixelBounds, rows: Film) -> Option<(PixelBounds, Film)> {
        let (known, mut film) = match self.kept.take() {
            Some((known, mut film)) => {
                film.append(rows);
                let [width, height] = known.size;
                (PixelBounds { size: [width, height + band.size[1]], ..known }, film)
            }
            None => (band, rows),
        };
        let end = known.end()[1];
        let is_last = end == self.frame.end()[1];
        let done = if is_last { end } else { end.saturating_sub(DENOISE_REACH).max(self.next) };
        let rows_of =
            |first: u32, end: u32| PixelBounds { origin: [known.origin[0], first], size: [known.size[0], end - first] };
        if done == self.next {
            self.kept = Some((known, film));
            return None;
        }
        let as_they_came = (film.pixels.clone(), film.layers.clone());
        denoise(&mut film);
        film.cast_shadows();
        let ready = rows_of(self.next, done);
        let filtered = film.cropped(known, ready);
        if !is_last {
            (film.pixels, film.layers) = as_they_came;
            let kept = rows_of(done.saturating_sub(DENOISE_REACH).max(known.origin[1]), end);
            self.kept = Some((kept, film.cropped(known, kept)));
        }
        self.next = done;
        Some((ready, filtered))
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::random::{combine, unit_f32};
    use crate::film::denoise::{DenoisePixel, HalfPixel};

    #[test]
    fn bands_are_filtered_as_the_whole_is() {
        let size = [24, 240];
        let mut whole = Film::new(size[0], size[1]);
        let count = whole.pixels.len();
        whole.layers.make_room_for_features(count);
        whole.layers.variance = vec![0.08; count];
        whole.layers.halves = vec![DenoisePixel::default(); count];
        for i in 0..count {
            let noise = |dimension| unit_f32(combine(dimension, i as u64));
            whole.pixels[i] = [noise(1), noise(2), noise(3)];
            whole.layers.depth[i] = 5.0 + noise(4);
            whole.layers.albedo[i] = [0.5; 3];
            whole.layers.coverage[i] = 1.0;
            let half = |first: u64| HalfPixel {
                color: Vec3::new(noise(first), noise(first + 1), noise(first + 2)),
                albedo: Vec3::splat(0.5),
                disparity: 0.2 + 0.02 * noise(first + 3),
                ..HalfPixel::default()
            };
            let halves = [half(10), half(20)];
            whole.layers.halves[i] = DenoisePixel { halves, variance: Vec3::splat(0.08), samples: 16.0 };
        }
        let frame = PixelBounds::whole(size);
        for height in [16, 64, 112, 240] {
            let mut denoiser = RowDenoiser::new(frame);
            let mut found: Option<Film> = None;
            for first in (0..size[1]).step_by(height as usize) {
                let band = PixelBounds { origin: [0, first], size: [size[0], height.min(size[1] - first)] };
                let Some((bounds, rows)) = denoiser.add(band, whole.cropped(frame, band)) else { continue };
                assert_eq!(bounds.origin[1], found.as_ref().map_or(0, |film| film.height));
                match &mut found {
                    Some(film) => film.append(rows),
                    None => found = Some(rows),
                }
            }
            let mut expected = whole.clone();
            denoise(&mut expected);
            assert!(expected.pixels != whole.pixels);
            assert!(found == Some(expected), "{height}");
        }
    }
}
