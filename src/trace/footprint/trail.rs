//! What is kept of a tile: what its samples are, and what their rays crossed.

use glam::Vec3;

use super::Footprint;
use crate::trace::geometry::Bounds;

/// What may have changed for rays since each of the pictures before: bits of places that bodies left or took; `None`
/// where anything may have.
#[derive(Clone, Debug)]
pub struct Changes {
    /// Number of this picture, as [`Trail`] keeps it.
    pub picture: u8,
    pub since: Vec<Option<u64>>,
}

/// The samples of a tile, each or those of a pixel together, as they were taken last.
#[derive(Clone, Debug)]
pub struct Trail {
    /// Samples of a pixel that are kept one by one; 0 where pixels are kept as wholes.
    each: u32,
    /// By pixel and sample, if each is kept.
    colors: Vec<Vec3>,
    /// Bits of the places that rays crossed, by sample or by pixel.
    crossed: Vec<u64>,
    /// The picture that it was taken for; [`NEVER`] before.
    pictures: Vec<u8>,
    /// Around all points that rays started from.
    origins: Bounds,
}

const NEVER: u8 = u8::MAX;

impl Trail {
    /// Of a tile of so many pixels; `each` is the number of samples that are kept one by one, or 0.
    pub fn new(pixels: usize, each: u32) -> Self {
        let units = pixels * each.max(1) as usize;
        Trail {
            each,
            colors: vec![Vec3::ZERO; if each > 0 { units } else { 0 }],
            crossed: vec![0; units],
            pictures: vec![NEVER; units],
            origins: Bounds::default(),
        }
    }

    /// Memory of a trail as [`Self::new`] makes it.
    pub fn bytes(pixels: usize, each: u32) -> usize {
        let of_one = size_of::<u64>() + size_of::<u8>() + if each > 0 { size_of::<Vec3>() } else { 0 };
        size_of::<Trail>() + pixels * each.max(1) as usize * of_one
    }

    pub fn memory(&self) -> usize {
        Self::bytes(self.len() / self.each.max(1) as usize, self.each)
    }

    /// Samples of a pixel that are kept one by one; 0 where pixels are kept as wholes.
    pub fn each(&self) -> u32 {
        self.each
    }

    /// How many samples or pixels there are.
    pub fn len(&self) -> usize {
        self.crossed.len()
    }

    pub fn is_empty(&self) -> bool {
        self.crossed.is_empty()
    }

    pub fn origins(&self) -> Bounds {
        self.origins
    }

    /// Samples or pixels that may look otherwise than when they were taken last, in order.
    pub fn stale(&self, changes: &Changes) -> Vec<u32> {
        let is_stale = |unit: &u32| {
            let (picture, crossed) = (self.pictures[*unit as usize], self.crossed[*unit as usize]);
            let changed = changes.since.get(usize::from(picture)).copied().flatten();
            changed.is_none_or(|changed| changed & crossed != 0)
        };
        (0..self.len() as u32).filter(is_stale).collect()
    }

    /// The colours of a pixel's samples.
    pub fn colors_of(&self, pixel: usize) -> &[Vec3] {
        let each = self.each as usize;
        &self.colors[pixel * each..][..each]
    }

    /// Keeps the samples of a batch.
    pub fn keep_samples(&mut self, units: &[u32], colors: &[Vec3], footprint: &Footprint, picture: u8) {
        for (i, (unit, color)) in units.iter().zip(colors).enumerate() {
            let unit = *unit as usize;
            (self.colors[unit], self.crossed[unit], self.pictures[unit]) = (*color, footprint.crossed[i], picture);
        }
        self.origins = self.origins.union(footprint.origins);
    }

    /// Makes room for what rays of whole pixels cross.
    pub fn begin_pixels(&self, footprint: &mut Footprint) {
        footprint.pixels.clear();
        footprint.pixels.resize(self.len(), 0);
    }

    /// Keeps pixels as wholes.
    pub fn keep_pixels(&mut self, pixels: &[u32], footprint: &Footprint, picture: u8) {
        for pixel in pixels.iter().map(|pixel| *pixel as usize) {
            (self.crossed[pixel], self.pictures[pixel]) = (footprint.pixels[pixel], picture);
        }
        self.origins = self.origins.union(footprint.origins);
    }
}
