//! What is kept of a tile: what its samples are, and what their rays crossed.

use glam::Vec3;

use super::footprint::{Footprint, TouchMask};

/// What may have changed for rays since each of the pictures before, and may between this one and the next.
#[derive(Clone, Debug)]
pub struct Changes {
    /// Number of this picture, as [`SampleHistory`] keeps it.
    pub picture: u8,
    /// By picture; `None` where anything may have changed.
    pub since: Vec<Option<Change>>,
    /// Bits of places that bodies leave or take next.
    pub next: u64,
}

/// What is different between two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Bits of places that bodies left or took.
    pub bits: u64,
    /// Square of the distance from the middle within which rays start that are none the wiser; infinite if all do.
    pub near: f32,
}

impl Change {
    /// Whether it may be seen by rays.
    fn shows(self, mark: TouchMask) -> bool {
        self.bits & mark.crossed != 0 || (self.near < f32::INFINITY && mark.far >= self.near)
    }
}

/// The samples of a tile, each or those of a pixel together, as they were taken last.
#[derive(Clone, Debug)]
pub struct SampleHistory {
    /// Samples of a pixel that are kept one by one; 0 where pixels are kept as wholes.
    each: u32,
    /// By pixel and sample, if each is kept.
    colors: Vec<Vec3>,
    /// What rays touched, by sample or by pixel.
    crossed: Vec<u64>,
    far: Vec<f32>,
    /// The picture that it was taken for; [`NEVER`] before, and where its rays were not held against places.
    pictures: Vec<u8>,
}

const NEVER: u8 = u8::MAX;

/// What is taken again picture after picture is held against places in each so many of them.
pub const UNTESTED: u32 = 4;

impl SampleHistory {
    /// Of a tile of so many pixels; `each` is the number of samples that are kept one by one, or 0.
    pub fn new(pixels: usize, each: u32) -> Self {
        let units = pixels * each.max(1) as usize;
        SampleHistory {
            each,
            colors: vec![Vec3::ZERO; if each > 0 { units } else { 0 }],
            crossed: vec![0; units],
            far: vec![0.0; units],
            pictures: vec![NEVER; units],
        }
    }

    /// Memory of a history as [`Self::new`] makes it.
    pub fn bytes(pixels: usize, each: u32) -> usize {
        let of_color = if each > 0 { size_of::<Vec3>() } else { 0 };
        let of_one = of_color + size_of::<u64>() + size_of::<f32>() + size_of::<u8>();
        size_of::<SampleHistory>() + pixels * each.max(1) as usize * of_one
    }

    /// Memory that is taken, in bytes.
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

    /// Whether it holds no sample.
    pub fn is_empty(&self) -> bool {
        self.crossed.is_empty()
    }

    /// Samples or pixels that may look otherwise than when they were taken last, in order.
    pub fn stale(&self, changes: &Changes) -> Vec<u32> {
        let is_stale = |unit: &u32| {
            let i = *unit as usize;
            let change = changes.since.get(usize::from(self.pictures[i])).copied().flatten();
            change.is_none_or(|change| change.shows(TouchMask { crossed: self.crossed[i], far: self.far[i] }))
        };
        (0..self.len() as u32).filter(is_stale).collect()
    }

    /// What is known before a sample or pixel is taken: nothing, or that it will be taken again in the next picture
    /// anyhow, as far as its last rays tell, so that there is no use in holding its rays against places.
    pub fn outlook(&self, unit: u32, changes: &Changes) -> TouchMask {
        let again = self.crossed[unit as usize] & changes.next != 0;
        let tested = (unit + u32::from(changes.picture)).is_multiple_of(UNTESTED);
        if again && !tested { TouchMask::UNTESTED } else { TouchMask::default() }
    }

    /// The colours of a pixel's samples.
    pub fn colors_of(&self, pixel: usize) -> &[Vec3] {
        let each = self.each as usize;
        &self.colors[pixel * each..][..each]
    }

    /// Keeps the samples of a batch.
    pub fn keep_samples(&mut self, units: &[u32], colors: &[Vec3], footprint: &Footprint, picture: u8) {
        for ((unit, color), mark) in units.iter().zip(colors).zip(footprint.marks()) {
            self.colors[*unit as usize] = *color;
            self.keep(*unit as usize, *mark, picture);
        }
    }

    /// Makes room for what rays of whole pixels cross.
    pub fn begin_pixels(&self, pixels: &[u32], changes: &Changes, footprint: &mut Footprint) {
        footprint.pixels.clear();
        footprint.pixels.resize(self.len(), TouchMask::default());
        pixels.iter().for_each(|pixel| footprint.pixels[*pixel as usize] = self.outlook(*pixel, changes));
    }

    /// Keeps pixels as wholes.
    pub fn keep_pixels(&mut self, pixels: &[u32], footprint: &Footprint, picture: u8) {
        for pixel in pixels.iter().map(|pixel| *pixel as usize) {
            self.keep(pixel, footprint.pixels[pixel], picture);
        }
    }

    fn keep(&mut self, unit: usize, mark: TouchMask, picture: u8) {
        if mark.crossed == u64::MAX {
            // What its rays crossed before tells on.
            self.pictures[unit] = NEVER;
        } else {
            (self.crossed[unit], self.far[unit], self.pictures[unit]) = (mark.crossed, mark.far, picture);
        }
    }
}
