//! The film: linear pixels of one frame and their way to numbers of a picture file.

use crate::base::color::{srgb_byte, srgb_encode};
use crate::components::Transfer;

/// Linear RGB pixels, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 3]>,
}

impl Film {
    pub fn new(width: u32, height: u32) -> Self {
        Film { width, height, pixels: vec![[0.0; 3]; width as usize * height as usize] }
    }

    /// RGB bytes, three per pixel, rounded to nearest.
    pub fn to_rgb8(&self, transfer: Transfer) -> Vec<u8> {
        let byte = |x: &f32| match transfer {
            Transfer::Srgb => srgb_byte(*x),
            Transfer::Linear => (encode(*x, transfer) * 255.0 + 0.5) as u8,
        };
        self.pixels.iter().flatten().map(byte).collect()
    }

    /// RGB in 16 bits, three per pixel, rounded to nearest.
    pub fn to_rgb16(&self, transfer: Transfer) -> Vec<u16> {
        self.pixels.iter().flatten().map(|x| (encode(*x, transfer) * 65535.0 + 0.5) as u16).collect()
    }
}

fn encode(x: f32, transfer: Transfer) -> f32 {
    match transfer {
        Transfer::Srgb => srgb_encode(x),
        Transfer::Linear if x > 0.0 => x.min(1.0),
        Transfer::Linear => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_clamped_rounded_and_never_nan() {
        let film = Film { width: 2, height: 1, pixels: vec![[-1.0, 0.5, 2.0], [f32::NAN, 1.0 / 255.0, 1.0]] };
        assert_eq!(film.to_rgb8(Transfer::Linear), [0, 128, 255, 0, 1, 255]);
        assert_eq!(film.to_rgb8(Transfer::Srgb), [0, 188, 255, 0, 13, 255]);
        assert_eq!(film.to_rgb16(Transfer::Linear)[1], 32768);
    }
}
