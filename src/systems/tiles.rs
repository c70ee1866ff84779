//! The tiles that a frame, or a part of one, is traced in.

use crate::components::Render;
use crate::film::{DENOISE_REACH, PixelBounds};

/// Side of a tile in pixels: small enough to share out evenly, large enough for neighbours to share cells.
const TILE: u32 = 16;
/// Side of the squares of pixels that get rounds of samples together, where noise decides how many.
const ADAPTIVE_BLOCK: u32 = 4;

/// The tiles of the frame's own grid that hold the traced part of it.
///
/// What a pixel looks like does not depend on what else is traced: tiles of a part are those of the whole, less pixels
/// that nobody needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileGrid {
    /// What is wanted.
    pub bounds: PixelBounds,
    /// What has to be traced for it: neighbours decide about pixels where noise is filtered out, or measured.
    pub traced: PixelBounds,
}

impl TileGrid {
    /// The tiles of what is rendered under these settings.
    pub fn new(settings: &Render) -> Self {
        let [origin, size] = settings.pixel_bounds();
        let bounds = PixelBounds { origin, size };
        let mut traced = bounds;
        if settings.denoise {
            traced = traced.grown(DENOISE_REACH, settings.size);
        }
        if settings.noise_threshold.is_some() {
            traced = traced.in_squares(ADAPTIVE_BLOCK, settings.size);
        }
        TileGrid { bounds, traced }
    }

    /// The tiles of one band of a larger frame: nothing but the band itself.
    pub fn of_band(band: PixelBounds) -> Self {
        TileGrid { bounds: band, traced: band }
    }

    /// The bands of so many rows of tiles each that what is traced can be divided into, from the top.
    pub fn bands(self, rows: u32) -> impl Iterator<Item = PixelBounds> {
        let PixelBounds { origin: [left, top], size: [width, _] } = self.traced;
        let (first, end, height) = (top / TILE * TILE, self.traced.end()[1], rows * TILE);
        (first..end).step_by(height as usize).map(move |row| {
            let from = row.max(top);
            PixelBounds { origin: [left, from], size: [width, (row + height).min(end) - from] }
        })
    }

    /// Rows of tiles of a band in which so many bytes are enough for pixels of so many bytes each; one at least.
    pub fn rows_within(self, bytes: u64, of_pixel: u64) -> u32 {
        let row = u64::from(self.traced.size[0]) * u64::from(TILE) * of_pixel;
        u32::try_from(bytes / row.max(1)).unwrap_or(u32::MAX).clamp(1, self.traced.size[1].div_ceil(TILE).max(1))
    }

    /// First column and row of tiles, and how many there are.
    fn span(self) -> [[u32; 2]; 2] {
        let first = self.traced.origin.map(|at| at / TILE);
        let end = self.traced.end().map(|end| end.div_ceil(TILE));
        [first, std::array::from_fn(|axis| end[axis] - first[axis])]
    }

    /// How many tiles there are.
    pub fn count(self) -> usize {
        let [_, [across, down]] = self.span();
        across as usize * down as usize
    }

    /// Pixels of a tile in Morton order (1966), so that those that follow each other are neighbours; as places in the
    /// frame.
    pub fn pixels(self, tile: usize) -> Vec<[u32; 2]> {
        let [first, [across, _]] = self.span();
        let corner = [(first[0] + tile as u32 % across) * TILE, (first[1] + tile as u32 / across) * TILE];
        let every_second = |n: u32| (0..4).fold(0, |sum, bit| sum | (n >> (2 * bit) & 1) << bit);
        let place = |n: u32| [corner[0] + every_second(n), corner[1] + every_second(n >> 1)];
        (0..TILE * TILE).map(place).filter(|pixel| self.traced.contains(*pixel)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_traced_pixel_lies_in_one_tile() {
        for (denoise, noise_threshold) in [(false, None), (true, None), (false, Some(0.1)), (true, Some(0.1))] {
            for region in [None, Some([37, 18, 30, 3]), Some([0, 0, 1, 1]), Some([99, 49, 1, 1])] {
                let settings = Render { size: [100, 50], region, denoise, noise_threshold, ..Render::default() };
                let grid = TileGrid::new(&settings);
                let bands: Vec<_> = grid.bands(2).collect();
                assert_eq!(bands.iter().map(|band| band.count()).sum::<usize>(), grid.traced.count());
                assert!(bands.windows(2).all(|pair| pair[0].end()[1] == pair[1].origin[1]));
                assert!(bands.iter().skip(1).all(|band| band.origin[1] % TILE == 0));
                let mut pixels: Vec<[u32; 2]> = (0..grid.count()).flat_map(|tile| grid.pixels(tile)).collect();
                assert!(grid.traced.count() >= grid.bounds.count());
                assert_eq!(pixels.len(), grid.traced.count());
                pixels.sort_by_key(|[x, y]| [*y, *x]);
                pixels.dedup();
                assert_eq!(pixels.len(), grid.traced.count());
                assert!(pixels.iter().all(|pixel| grid.traced.contains(*pixel)));
            }
        }
    }
}
