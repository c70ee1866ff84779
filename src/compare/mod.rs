//! How far two pictures are apart: numbers, a picture of the difference, and golden frames.

pub mod golden;

use std::path::Path;

use crate::base::diagnostics::Diagnostic;
use crate::base::{files, limits};
use crate::output::{Decoded, Format};

/// A picture as it was written: RGB, top row first; 0 to 1 as a PNG has it, linear and of any size as an EXR has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// Top row first.
    pub pixels: Vec<[f32; 3]>,
}

/// Numbers that say how far two pictures of one size are apart, in the pictures' own units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Pixels that differ at all.
    pub pixels: usize,
    /// Largest difference of one channel.
    pub largest: f64,
    /// Root of the mean square over all channels.
    pub rmse: f64,
    /// Peak signal to noise ratio in decibels, infinite for equal pictures.
    pub psnr: f64,
}

impl Picture {
    /// Reads a picture of a format that anim writes, or another one of 8 or 16 bits a channel.
    ///
    /// # Errors
    /// A file that is missing, too large or not a picture.
    pub fn read(path: &Path) -> Result<Self, Diagnostic> {
        let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES)?;
        let unreadable = |e: String| Diagnostic::error(format!("cannot read {}: {e}", path.display()));
        if let Some(format) = Format::of_bytes(&bytes) {
            let Decoded { size: [width, height], pixels } = (format.decode)(&bytes).map_err(unreadable)?;
            return Ok(Picture { width, height, pixels });
        }
        let picture = image::load_from_memory(&bytes).map_err(|e| unreadable(e.to_string()))?.to_rgb16();
        let pixels = picture.pixels().map(|p| p.0.map(|x| f32::from(x) / 65535.0)).collect();
        Ok(Picture { width: picture.width(), height: picture.height(), pixels })
    }

    /// The PNG file of the picture, in 8 bits.
    ///
    /// # Errors
    /// A picture whose pixels do not fill its size.
    pub fn to_png(&self) -> Result<Vec<u8>, Diagnostic> {
        let bytes = self.pixels.iter().flatten().map(|x| (x * 255.0 + 0.5) as u8).collect();
        let picture = image::RgbImage::from_raw(self.width, self.height, bytes);
        let mut out = std::io::Cursor::new(Vec::new());
        let written = picture.map(|p| p.write_to(&mut out, image::ImageFormat::Png));
        match written {
            Some(Ok(())) => Ok(out.into_inner()),
            _ => Err(Diagnostic::error("a picture's pixels do not fill its size")),
        }
    }
}

/// Compares two pictures; `None` if their sizes differ.
pub fn difference(a: &Picture, b: &Picture) -> Option<Difference> {
    if (a.width, a.height) != (b.width, b.height) {
        return None;
    }
    let (mut found, mut squares) = (Difference::default(), 0.0);
    for (pa, pb) in a.pixels.iter().zip(&b.pixels) {
        found.pixels += usize::from(pa != pb);
        for (x, y) in pa.iter().zip(pb) {
            let apart = if x.to_bits() == y.to_bits() { 0.0 } else { (f64::from(*x) - f64::from(*y)).abs() };
            // An EXR may hold what is no number.
            let apart = if apart.is_nan() { f64::INFINITY } else { apart };
            found.largest = found.largest.max(apart);
            squares += apart * apart;
        }
    }
    found.rmse = (squares / (3 * a.pixels.len().max(1)) as f64).sqrt();
    found.psnr = -20.0 * found.rmse.log10();
    Some(found)
}

/// Both pictures and eight times their difference, side by side.
pub fn difference_picture(a: &Picture, b: &Picture) -> Picture {
    let (width, height) = (a.width.max(b.width), a.height.max(b.height));
    let at = |p: &Picture, x: u32, y: u32| match x < p.width && y < p.height {
        true => p.pixels[(y * p.width + x) as usize],
        false => [0.0; 3],
    };
    let mut pixels = Vec::with_capacity(3 * (width * height) as usize);
    for y in 0..height {
        pixels.extend((0..width).map(|x| at(a, x, y)));
        pixels.extend((0..width).map(|x| at(b, x, y)));
        pixels.extend((0..width).map(|x| {
            let (pa, pb) = (at(a, x, y), at(b, x, y));
            std::array::from_fn(|i| 8.0 * (pa[i] - pb[i]).abs())
        }));
    }
    Picture { width: 3 * width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_have_their_known_numbers() {
        let black = Picture { width: 2, height: 1, pixels: vec![[0.0; 3]; 2] };
        let dot = Picture { pixels: vec![[0.0; 3], [1.0, 0.0, 0.0]], ..black.clone() };
        let found = difference(&black, &dot).unwrap();
        assert_eq!((found.pixels, found.largest), (1, 1.0));
        assert!((found.rmse - (1.0f64 / 6.0).sqrt()).abs() < 1e-12);
        assert_eq!(difference(&dot, &dot).unwrap().psnr, f64::INFINITY);
        let tall = Picture { width: 1, height: 2, ..black.clone() };
        assert_eq!(difference(&black, &tall), None);
        let shown = difference_picture(&black, &dot);
        assert_eq!((shown.width, shown.pixels[5]), (6, [8.0, 0.0, 0.0]));
        assert!(shown.to_png().is_ok());
    }
}
