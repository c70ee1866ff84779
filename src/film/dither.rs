//! Dither of 8-bit pictures: a mask of blue noise decides where a value between two codes becomes the one or the other.
//!
//! Without it a slow gradient shows bands. The mask repeats every 64 pixels, is the same for every frame, so that what
//! stands still stays still, and never changes a value that is a code already. It is made by void and cluster (Ulichney,
//! SPIE 1993): ranks are given to the pixels of a torus so that those below any rank are spread as evenly as can be.

use std::sync::LazyLock;

/// Side of the mask in pixels, a power of two.
const SIDE: usize = 64;
const COUNT: usize = SIDE * SIDE;
/// Deviation of the Gaussian that emptiness is measured by, in pixels.
const DEVIATION: f32 = 1.5;
/// Distance at which it counts as nothing.
const REACH: isize = 7;
/// Shift of the mask from channel to channel, so that they do not err together.
const SHIFTS: [[usize; 2]; 3] = [[0, 0], [23, 41], [47, 17]];

static MASK: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let ranks = ranks();
    ranks.into_iter().map(|rank| (rank as f32 + 0.5) / COUNT as f32).collect()
});

/// The threshold of a channel of a pixel, between 0 and 1.
pub fn threshold(x: usize, y: usize, channel: usize) -> f32 {
    let [right, down] = SHIFTS[channel];
    MASK[(y + down) % SIDE * SIDE + (x + right) % SIDE]
}

/// How crowded each pixel is by those that are set.
struct Crowding {
    is_set: Vec<bool>,
    sums: Vec<f32>,
    kernel: Vec<(isize, isize, f32)>,
}

impl Crowding {
    fn new() -> Self {
        let taps = (-REACH..=REACH).flat_map(|dy| (-REACH..=REACH).map(move |dx| (dx, dy)));
        let weight = |dx: isize, dy: isize| libm::expf(-((dx * dx + dy * dy) as f32) / (2.0 * DEVIATION * DEVIATION));
        let kernel = taps.map(|(dx, dy)| (dx, dy, weight(dx, dy))).collect();
        Crowding { is_set: vec![false; COUNT], sums: vec![0.0; COUNT], kernel }
    }

    fn toggle(&mut self, pixel: usize) {
        let (x, y) = ((pixel % SIDE) as isize, (pixel / SIDE) as isize);
        self.is_set[pixel] = !self.is_set[pixel];
        let sign = if self.is_set[pixel] { 1.0 } else { -1.0 };
        for (dx, dy, weight) in &self.kernel {
            let at = |v: isize| v.rem_euclid(SIDE as isize) as usize;
            self.sums[at(y + dy) * SIDE + at(x + dx)] += sign * weight;
        }
    }

    /// The most crowded of the set pixels, or the emptiest of the others; the first of equals.
    fn extreme(&self, set: bool) -> usize {
        let mut best: Option<usize> = None;
        for pixel in (0..COUNT).filter(|pixel| self.is_set[*pixel] == set) {
            let better = |known: usize| {
                if set { self.sums[pixel] > self.sums[known] } else { self.sums[pixel] < self.sums[known] }
            };
            if best.is_none_or(better) {
                best = Some(pixel);
            }
        }
        best.unwrap_or(0)
    }
}

/// A rank for every pixel.
fn ranks() -> Vec<usize> {
    let mut crowding = Crowding::new();
    // A tenth of the pixels, scattered by a fixed generator, then moved from clusters into voids until that is idle.
    let mut state = 1u64;
    let mut placed = 0;
    while placed < COUNT / 10 {
        state = crate::base::random::mix(state);
        let pixel = (state % COUNT as u64) as usize;
        if !crowding.is_set[pixel] {
            crowding.toggle(pixel);
            placed += 1;
        }
    }
    for _ in 0..COUNT {
        let cluster = crowding.extreme(true);
        crowding.toggle(cluster);
        let void = crowding.extreme(false);
        crowding.toggle(void);
        if void == cluster {
            break;
        }
    }
    let mut ranks = vec![0; COUNT];
    let start: Vec<usize> = (0..COUNT).filter(|pixel| crowding.is_set[*pixel]).collect();
    for rank in (0..start.len()).rev() {
        let cluster = crowding.extreme(true);
        crowding.toggle(cluster);
        ranks[cluster] = rank;
    }
    start.iter().for_each(|pixel| crowding.toggle(*pixel));
    for rank in start.len()..COUNT {
        let void = crowding.extreme(false);
        crowding.toggle(void);
        ranks[void] = rank;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_threshold_occurs_once_and_neighbours_differ() {
        let mut all: Vec<f32> = MASK.clone();
        let apart = |i: usize, j: usize| (MASK[i] - MASK[j]).abs();
        let mean = (0..COUNT).map(|i| apart(i, i / SIDE * SIDE + (i + 1) % SIDE)).sum::<f32>() / COUNT as f32;
        // Of white noise it would be a third.
        assert!(mean > 0.4, "{mean}");
        all.sort_by(f32::total_cmp);
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]) && all[0] > 0.0 && all[COUNT - 1] < 1.0);
    }
}
