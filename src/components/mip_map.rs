//! Image files as texels: what the loader reads and the kernel looks up, shared by all who use it.

use std::sync::{Arc, LazyLock};

use glam::Vec3;
use rustc_hash::FxHashMap;

use super::Text;
use crate::base::color::srgb_decode;

/// A image and its smaller copies, each half the one before, down to a single texel.
#[derive(Clone, Debug, PartialEq)]
pub struct MipMap {
    /// The first is the image itself.
    pub levels: Vec<MipLevel>,
}

/// Texels in rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct MipLevel {
    /// In texels.
    pub width: u32,
    /// In texels.
    pub height: u32,
    /// Width times height of them.
    pub texels: Texels,
}

/// RGB values as they are kept: in bytes where the file had no more.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Encoded by the sRGB curve.
    Srgb(Vec<[u8; 3]>),
    /// 0..255 for 0..1, linear.
    Bytes(Vec<[u8; 3]>),
    /// Linear, 0 and up.
    Floats(Vec<[f32; 3]>),
}

static DECODED: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| srgb_decode(i as f32 / 255.0)));

impl MipLevel {
    /// Linear value of a texel; x from the left, y from the top, both inside.
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> Vec3 {
        let i = (y * self.width + x) as usize;
        match &self.texels {
            Texels::Srgb(bytes) => Vec3::from_array(bytes[i].map(|b| DECODED[usize::from(b)])),
            Texels::Bytes(bytes) => Vec3::from_array(bytes[i].map(|b| f32::from(b) * (1.0 / 255.0))),
            Texels::Floats(floats) => Vec3::from_array(floats[i]),
        }
    }
}

impl MipMap {
    /// A image with its smaller copies. `texels` has width x height of them, and both are above 0.
    pub fn new(width: u32, height: u32, texels: Texels) -> Self {
        let mut levels = vec![MipLevel { width, height, texels }];
        while let Some(last) = levels.last().filter(|level| level.width > 1 || level.height > 1) {
            levels.push(halved(last));
        }
        MipMap { levels }
    }

    /// Texels of the image itself.
    pub fn texels(&self) -> u64 {
        self.levels.first().map_or(0, |level| u64::from(level.width) * u64::from(level.height))
    }
}

/// The source texels under each texel of a side half as long, with their shares; the shares of all have one sum.
fn shares(from: u32) -> Vec<[(u32, f32); 3]> {
    let to = (from / 2).max(1);
    let step = from as f32 / to as f32;
    let under = |i: u32| {
        // Whole numbers of 1/to: exact ends, whatever the rounding of the step.
        let (start, end) = (u64::from(i) * u64::from(from), (u64::from(i) + 1) * u64::from(from));
        let first = (start / u64::from(to)) as u32;
        std::array::from_fn(|k| {
            let at = first + k as u32;
            let (low, high) = (u64::from(at) * u64::from(to), (u64::from(at) + 1) * u64::from(to));
            let covered = high.min(end).saturating_sub(low.max(start)) as f32 / to as f32;
            (at.min(from - 1), covered / step)
        })
    };
    (0..to).map(under).collect()
}

/// The mean of the texels under each texel of half the size: means of levels are all the same.
fn halved(level: &MipLevel) -> MipLevel {
    let (across, down) = (shares(level.width), shares(level.height));
    let mut texels = Vec::with_capacity(across.len() * down.len());
    for rows in &down {
        for columns in &across {
            let mut sum = Vec3::ZERO;
            for (y, tall) in rows {
                for (x, wide) in columns.iter().filter(|(_, wide)| *wide * *tall > 0.0) {
                    sum += level.texel(*x, *y) * (*tall * *wide);
                }
            }
            texels.push(sum.to_array());
        }
    }
    MipLevel { width: across.len() as u32, height: down.len() as u32, texels: Texels::Floats(texels) }
}

/// What is read of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImagePlane {
    /// Colours, whose bytes stand for the sRGB curve.
    Srgb,
    /// Colours or numbers as they stand.
    Linear,
    /// Alpha as grey; white if the file has none.
    Alpha,
}

impl ImagePlane {
    /// What is read of an image of colours, whose bytes stand for the sRGB curve if they are to be `decoded`.
    pub fn of_colors(decoded: bool) -> Self {
        if decoded { ImagePlane::Srgb } else { ImagePlane::Linear }
    }
}

/// The images that were read for a scene, by the file's name in it and what was read of it.
#[derive(Clone, Debug, Default)]
pub struct ImageCache(pub FxHashMap<(Text, ImagePlane), Arc<MipMap>>);

impl ImageCache {
    /// Texels of all images together.
    pub fn texels(&self) -> u64 {
        self.0.values().map(|image| image.texels()).sum()
    }
}

/// They follow from the rest of the scene and its files, and take no part in comparisons.
impl PartialEq for ImageCache {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(level: &MipLevel) -> Vec3 {
        let at = |i: u32| level.texel(i % level.width, i / level.width);
        (0..level.width * level.height).map(at).sum::<Vec3>() / (level.width * level.height) as f32
    }

    #[test]
    fn smaller_copies_keep_the_mean_of_any_size() {
        for (width, height) in [(1, 1), (2, 2), (3, 5), (17, 4), (1, 9), (31, 33)] {
            let byte = |i: u32| (crate::base::random::mix(u64::from(i)) & 255) as u8;
            let bytes: Vec<[u8; 3]> = (0..width * height).map(|i| [byte(i), byte(i + 9), 255]).collect();
            let image = MipMap::new(width, height, Texels::Srgb(bytes));
            let last = image.levels.last().unwrap();
            assert_eq!((last.width, last.height), (1, 1));
            let whole = mean(&image.levels[0]);
            for level in &image.levels {
                assert!((mean(level) - whole).abs().max_element() < 1e-5, "{width} x {height}: {whole}");
            }
        }
    }
}
