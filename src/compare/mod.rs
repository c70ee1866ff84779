//! How far two pictures are apart: numbers, FLIP, a picture of the difference, and golden frames.

pub mod colors;
pub mod comparison;
pub mod description;
pub mod flip;
pub mod golden;
pub mod judge;
pub mod report;
pub mod viewer;

use std::path::Path;

pub use comparison::Difference;

use crate::base::diagnostics::Diagnostic;
use crate::base::{color, files, limits};
use crate::output::{ColorEncoding, LayeredPicture, read_layered};
use comparison::ErrorSums;

/// The colours of a picture as they were written: RGB, top row first; 0 to 1 as a PNG has it, linear and of any size as
/// an EXR has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels of a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green and blue, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

/// Reads a picture of 8 or 16 bits a channel, or an EXR file, with everything in it.
///
/// # Errors
/// A file that is missing, too large or not a picture.
pub fn read(path: &Path) -> Result<LayeredPicture, Diagnostic> {
    let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES)?;
    read_layered(&bytes).map_err(|e| Diagnostic::error(format!("cannot read {}: {e}", path.display())))
}

impl Picture {
    /// Reads the colours of a picture file.
    ///
    /// # Errors
    /// As [`read`]; a file without colours.
    pub fn read(path: &Path) -> Result<Self, Diagnostic> {
        let first = Self::of(&read(path)?);
        first.ok_or_else(|| Diagnostic::error(format!("cannot read {}: it has no channels R, G and B", path.display())))
    }

    /// The first colours of a picture file, as they are stored.
    pub fn of(picture: &LayeredPicture) -> Option<Self> {
        let layer = colors::color_layers(picture).into_iter().next()?;
        let [width, height] = layer.window.size;
        Some(Picture { width, height, pixels: layer.colors })
    }

    /// The first colours of a picture file, as a screen shows them: linear light along the sRGB curve, cut at white.
    pub fn shown(picture: &LayeredPicture) -> Option<Self> {
        let mut colors = Self::of(picture)?;
        if picture.encoding == ColorEncoding::Linear {
            colors.pixels.iter_mut().for_each(|pixel| *pixel = pixel.map(color::srgb_encode));
        }
        Some(colors)
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

/// Compares the colours of two pictures; `None` if their sizes differ.
pub fn difference(a: &Picture, b: &Picture) -> Option<Difference> {
    if (a.width, a.height) != (b.width, b.height) {
        return None;
    }
    let (mut sums, mut pixels) = (ErrorSums::default(), 0);
    for (pa, pb) in a.pixels.iter().zip(&b.pixels) {
        let differing = pa.iter().zip(pb).filter(|(x, y)| sums.add(f64::from(**x), f64::from(**y))).count();
        pixels += usize::from(differing > 0);
    }
    Some(sums.difference(pixels))
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
