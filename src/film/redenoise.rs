//! Noise is filtered again only where a picture differs from the one before, with as many pixels around as the filter
//! reaches, so that the result is that of filtering all of it.

use std::sync::atomic::{AtomicBool, Ordering};

use super::{DENOISE_REACH, DenoisePixel, Film, PixelBounds, denoise_until};

/// Side of the squares in which differences are looked for, in pixels.
const SQUARE: u32 = 16;
/// Where the parts take this share of the whole, the whole is filtered.
const WORTH: f64 = 0.8;
/// Cutting a part in two must save this share of it.
const GAIN: f64 = 0.1;

/// A picture as it came, and as it was filtered.
#[derive(Debug, Default)]
pub struct DenoiseHistory {
    size: [u32; 2],
    noisy: Vec<DenoisePixel>,
    filtered: Vec<[f32; 3]>,
    /// Most bytes that it may hold.
    room: usize,
}

impl DenoiseHistory {
    /// Nothing yet; at most `room` bytes of the next picture are kept.
    pub fn new(room: usize) -> Self {
        DenoiseHistory { room, ..DenoiseHistory::default() }
    }

    /// Memory that is taken.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.noisy) + size_of_val(&*self.filtered)
    }

    /// Changes how many bytes the next picture may take.
    pub fn set_room(&mut self, room: usize) {
        self.room = room;
    }

    /// As [`denoise`](super::denoise); false if `cancel` was raised, and the film is none then.
    pub fn denoise(&mut self, film: &mut Film, cancel: &AtomicBool) -> bool {
        let size = [film.width, film.height];
        let count = film.pixels.len();
        let is_usual = film.layers.halves.len() == count && film.layers.caught.is_empty();
        let bytes = count * (size_of::<DenoisePixel>() + size_of::<[f32; 3]>());
        // Pixels with too few samples leave all of a picture as it came.
        if !is_usual || bytes > self.room || film.layers.halves.iter().any(|pixel| pixel.samples < 2.0) {
            self.forget();
            return denoise_until(film, cancel);
        }
        let noisy = film.layers.halves.clone();
        let parts = (self.size == size && self.noisy.len() == count).then(|| parts(size, &self.noisy, &noisy));
        match parts.flatten() {
            None => {
                if !denoise_until(film, cancel) {
                    return false;
                }
                self.filtered.clone_from(&film.pixels);
            }
            Some(parts) => {
                let mut filtered = self.filtered.clone();
                for part in parts {
                    if !refilter(&noisy, size, part, &mut filtered, cancel) {
                        return false;
                    }
                }
                film.layers.halves = Vec::new();
                film.pixels.clone_from(&filtered);
                self.filtered = filtered;
            }
        }
        (self.size, self.noisy) = (size, noisy);
        true
    }

    fn forget(&mut self) {
        *self = DenoiseHistory::new(self.room);
    }
}

/// Filters a part of a picture anew.
fn refilter(
    noisy: &[DenoisePixel],
    size: [u32; 2],
    part: PixelBounds,
    filtered: &mut [[f32; 3]],
    cancel: &AtomicBool,
) -> bool {
    let around = part.grown(DENOISE_REACH, size);
    let whole = PixelBounds::whole(size);
    let mut film = Film::new(around.size[0], around.size[1]);
    film.layers.halves = whole.crop(noisy, around);
    if !denoise_until(&mut film, cancel) {
        return false;
    }
    let rows = around.crop(&film.pixels, part);
    for (row, y) in rows.chunks_exact(part.size[0] as usize).zip(part.origin[1]..) {
        let first = y as usize * size[0] as usize + part.origin[0] as usize;
        filtered[first..first + row.len()].copy_from_slice(row);
    }
    !cancel.load(Ordering::Relaxed)
}

/// Parts of a picture that hold all pixels whose filtered colours may differ; `None` if it is as well to filter all.
fn parts(size: [u32; 2], before: &[DenoisePixel], now: &[DenoisePixel]) -> Option<Vec<PixelBounds>> {
    let squares = Squares::new(size, before, now);
    let mut parts = Vec::new();
    squares.cover(PixelBounds::whole(squares.count), &mut parts);
    let cost: f64 = parts.iter().map(|part| squares.cost(*part)).sum();
    let reached = |part: &PixelBounds| {
        let pixels = PixelBounds { origin: part.origin.map(|at| at * SQUARE), size: part.size.map(|n| n * SQUARE) };
        let pixels = pixels.common(PixelBounds::whole(size)).unwrap_or(pixels);
        pixels.grown(DENOISE_REACH, size)
    };
    (cost < WORTH * f64::from(size[0]) * f64::from(size[1])).then(|| parts.iter().map(reached).collect())
}

/// Squares of a picture that hold a pixel that differs.
struct Squares {
    size: [u32; 2],
    count: [u32; 2],
    differ: Vec<bool>,
}

impl Squares {
    fn new(size: [u32; 2], before: &[DenoisePixel], now: &[DenoisePixel]) -> Squares {
        let count = size.map(|side| side.div_ceil(SQUARE));
        let width = size[0] as usize;
        let mut differ = vec![false; count[0] as usize * count[1] as usize];
        for (y, (a, b)) in before.chunks(width).zip(now.chunks(width)).enumerate() {
            let row = y / SQUARE as usize * count[0] as usize;
            let pieces = a.chunks(SQUARE as usize).zip(b.chunks(SQUARE as usize));
            for ((a, b), differ) in pieces.zip(&mut differ[row..]) {
                *differ |= a != b;
            }
        }
        Squares { size, count, differ }
    }

    /// The smallest rectangle around those that differ, of some of them.
    fn tight(&self, within: PixelBounds) -> Option<PixelBounds> {
        let [left, top] = within.origin;
        let [right, bottom] = within.end();
        let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
        for (x, y) in (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))) {
            if self.differ[(y * self.count[0] + x) as usize] {
                low = [low[0].min(x), low[1].min(y)];
                high = [high[0].max(x + 1), high[1].max(y + 1)];
            }
        }
        (low[0] < high[0]).then(|| PixelBounds { origin: low, size: [high[0] - low[0], high[1] - low[1]] })
    }

    /// Pixels that are read to filter what the squares reach.
    fn cost(&self, part: PixelBounds) -> f64 {
        let side = |axis: usize| {
            let (first, end) = (part.origin[axis] * SQUARE, part.end()[axis] * SQUARE);
            let end = end.saturating_add(2 * DENOISE_REACH).min(self.size[axis]);
            f64::from(end - first.saturating_sub(2 * DENOISE_REACH).min(end))
        };
        side(0) * side(1)
    }

    /// Rectangles that hold all that differ, cut in two for as long as that saves enough.
    fn cover(&self, within: PixelBounds, parts: &mut Vec<PixelBounds>) {
        let Some(tight) = self.tight(within) else { return };
        let cost = self.cost(tight);
        let halves = |axis: usize, at: u32| {
            let mut halves = [tight, tight];
            halves[0].size[axis] = at;
            halves[1].origin[axis] += at;
            halves[1].size[axis] -= at;
            halves
        };
        let cuts = [0, 1].into_iter().flat_map(|axis| (1..tight.size[axis]).map(move |at| halves(axis, at)));
        let of_both = |halves: &[PixelBounds; 2]| {
            halves.iter().filter_map(|half| self.tight(*half)).map(|half| self.cost(half)).sum()
        };
        let best = cuts.map(|halves| (of_both(&halves), halves)).min_by(|(a, _): &(f64, _), (b, _)| a.total_cmp(b));
        match best {
            Some((both, halves)) if both < (1.0 - GAIN) * cost => {
                halves.iter().for_each(|half| self.cover(*half, parts))
            }
            _ => parts.push(tight),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::random::{combine, unit_f32};
    use crate::film::denoise;

    fn noisy(size: [u32; 2], seed: impl Fn(u32, u32) -> u64) -> Film {
        let mut film = Film::new(size[0], size[1]);
        let pixel = |i: u32| {
            let own = seed(i % size[0], i / size[0]);
            let noise = |dimension: u64| unit_f32(combine(combine(own, dimension), u64::from(i)));
            let mut pixel = DenoisePixel { samples: 16.0, variance: Vec3::splat(0.05), ..DenoisePixel::default() };
            for (half, first) in pixel.halves.iter_mut().zip([0, 8]) {
                half.color = Vec3::new(noise(first), noise(first + 1), noise(first + 2));
                (half.albedo, half.disparity) = (Vec3::splat(0.5), 0.2 + 0.02 * noise(first + 3));
            }
            pixel
        };
        film.layers.halves = (0..size[0] * size[1]).map(pixel).collect();
        film
    }

    #[test]
    fn what_is_filtered_again_is_what_filtering_all_gives() {
        let size = [420, 96];
        let never = AtomicBool::new(false);
        let mut history = DenoiseHistory::new(1 << 30);
        history.denoise(&mut noisy(size, |_, _| 1), &never);
        let is_edited = |seed: u64, x: u32, y: u32| match seed {
            2 => x < 9 && y > 80,
            3 => x == 200,
            4 => !(9..=400).contains(&x),
            _ => false,
        };
        for seed in 2..6 {
            let picture = || noisy(size, |x, y| if is_edited(seed, x, y) { seed } else { 1 });
            let (mut again, mut whole) = (picture(), picture());
            assert!(history.denoise(&mut again, &never));
            denoise(&mut whole);
            assert!(again == whole, "edit {seed}");
        }
    }

    #[test]
    fn parts_hold_what_a_change_reaches_and_little_else() {
        let size = [1600, 160];
        let before = noisy(size, |_, _| 1).layers.halves;
        let now = noisy(size, |x, y| 1 + u64::from(!(5..=1590).contains(&x) && y < 5)).layers.halves;
        let found = parts(size, &before, &now).unwrap();
        assert_eq!(found.len(), 2);
        for (x, y) in [(0, 0), (4 + DENOISE_REACH, 4 + DENOISE_REACH), (1599, 0), (1591 - DENOISE_REACH, 3)] {
            assert!(found.iter().any(|part| part.contains([x, y])), "{x} {y}");
        }
        assert!(found.iter().map(|part| part.count()).sum::<usize>() < 20_000);
        assert!(parts(size, &before, &before).unwrap().is_empty());
        assert!(parts(size, &before, &noisy(size, |_, _| 9).layers.halves).is_none());
    }

    #[test]
    fn what_is_given_up_or_has_no_room_leaves_nothing_behind() {
        let raised = AtomicBool::new(true);
        let mut history = DenoiseHistory::new(1 << 30);
        assert!(!history.denoise(&mut noisy([64, 64], |_, _| 1), &raised));
        assert_eq!(history.bytes(), 0);
        let mut small = DenoiseHistory::new(1000);
        assert!(small.denoise(&mut noisy([64, 64], |_, _| 1), &AtomicBool::new(false)));
        assert_eq!(small.bytes(), 0);
    }
}
