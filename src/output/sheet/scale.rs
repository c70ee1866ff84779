//! Smaller pictures: each pixel is the mean of what it covers, in linear light.

use super::super::film::{FilmFrame, FramePixels};
use crate::base::color::{srgb_byte, srgb_decode};

/// A picture at a size that is not larger than its own, in front of a linear colour.
pub fn shrunk(picture: &FilmFrame, size: [u32; 2], behind: [f32; 3]) -> Vec<[u8; 3]> {
    let pixels = linear(picture, behind);
    let (width, height) = (picture.width as usize, picture.height as usize);
    let [columns, rows] = [shares(width, size[0] as usize), shares(height, size[1] as usize)];
    let mut narrow: Vec<[f32; 3]> = Vec::with_capacity(columns.len() * height);
    for row in pixels.chunks_exact(width) {
        narrow.extend(columns.iter().map(|(from, weights)| mean(weights, |i| row[from + i])));
    }
    let mut shown = Vec::with_capacity(columns.len() * rows.len());
    for (from, weights) in &rows {
        for x in 0..columns.len() {
            shown.push(mean(weights, |i| narrow[(from + i) * columns.len() + x]).map(srgb_byte));
        }
    }
    shown
}

fn mean(weights: &[f32], color: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
    weights.iter().enumerate().fold([0.0; 3], |sum, (i, weight)| {
        let color = color(i);
        std::array::from_fn(|axis| sum[axis] + color[axis] * weight)
    })
}

/// For each of `parts` equal parts of a line of `length` pixels: the first pixel that it covers, and what share of it
/// each one is. In whole numbers up to the last step, so that a part of the same size is the same everywhere.
fn shares(length: usize, parts: usize) -> Vec<(usize, Vec<f32>)> {
    let part = |i: usize| {
        // In units of 1 / parts of a pixel.
        let (from, to) = (i * length, (i + 1) * length);
        let pixels = from / parts..to.div_ceil(parts);
        let covered = |pixel: usize| to.min((pixel + 1) * parts) - from.max(pixel * parts);
        (pixels.start, pixels.map(|pixel| covered(pixel) as f32 / length as f32).collect())
    };
    (0..parts).map(part).collect()
}

/// The pixels of a frame in linear light, alpha in front of a colour.
fn linear(frame: &FilmFrame, behind: [f32; 3]) -> Vec<[f32; 3]> {
    let over = |color: [f32; 3], alpha: f32| std::array::from_fn(|i| behind[i] + (color[i] - behind[i]) * alpha);
    match &frame.pixels {
        FramePixels::Bytes(pixels) => {
            let table: Vec<f32> = (0..=255u8).map(|byte| srgb_decode(f32::from(byte) / 255.0)).collect();
            let value = |x: u8| table[usize::from(x)];
            pixels.iter().map(|[r, g, b, a]| over([*r, *g, *b].map(value), f32::from(*a) / 255.0)).collect()
        }
        FramePixels::Words(pixels) => {
            let value = |x: u16| srgb_decode(f32::from(x) / 65_535.0);
            pixels.iter().map(|[r, g, b, a]| over([*r, *g, *b].map(value), f32::from(*a) / 65_535.0)).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_cover_the_line_once() {
        for (length, parts) in [(10, 10), (10, 3), (7, 5), (640, 311), (5, 1)] {
            let shares = shares(length, parts);
            let mut covered = vec![0.0; length];
            for (from, weights) in &shares {
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                weights.iter().enumerate().for_each(|(i, weight)| covered[from + i] += weight);
            }
            let each = parts as f32 / length as f32;
            assert!(covered.iter().all(|share| (share - each).abs() < 1e-5), "{length} {parts}");
        }
    }

    #[test]
    fn black_and_white_make_the_grey_that_they_look_like_from_afar() {
        let pixels = (0..64).map(|i| if (i + i / 8) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] }).collect();
        let board = FilmFrame { width: 8, height: 8, pixels: FramePixels::Bytes(pixels) };
        assert!(shrunk(&board, [4, 4], [0.0; 3]).iter().all(|pixel| *pixel == [188; 3]));
        // As it is.
        let same = shrunk(&board, [8, 8], [0.0; 3]);
        assert!(same.iter().zip(&*board.bytes()).all(|(a, b)| a[..] == b[..3]));
    }
}
