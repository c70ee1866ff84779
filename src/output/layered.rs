//! A picture file with everything in it: parts, where each lies, and every channel of them.
//!
//! A PNG is one part with the channels `R`, `G`, `B`, and `A` where it is not opaque; an EXR file has what it has.

use std::io::Cursor;

use image::ImageReader;

use super::exr::{EXR, read_exr_parts};
use crate::base::limits;

/// A rectangle of the plane that pictures lie in: its top left pixel, and its width and height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelWindow {
    pub origin: [i32; 2],
    pub size: [u32; 2],
}

impl PixelWindow {
    /// The rectangle that both cover; `None` if they have no pixel in common.
    pub fn common(self, other: Self) -> Option<Self> {
        let end = |window: Self, axis: usize| i64::from(window.origin[axis]) + i64::from(window.size[axis]);
        let origin: [i32; 2] = std::array::from_fn(|axis| self.origin[axis].max(other.origin[axis]));
        let side = |axis: usize| end(self, axis).min(end(other, axis)) - i64::from(origin[axis]);
        let size = [u32::try_from(side(0)).ok()?, u32::try_from(side(1)).ok()?];
        (size[0] > 0 && size[1] > 0).then_some(PixelWindow { origin, size })
    }

    pub fn pixels(self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

impl std::fmt::Display for PixelWindow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([x, y], [width, height]) = (self.origin, self.size);
        if (x, y) == (0, 0) { write!(f, "{width}x{height}") } else { write!(f, "{width}x{height} at ({x}, {y})") }
    }
}

/// How the colours of a file are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorEncoding {
    /// From 0 to 1 along the sRGB curve, in so many bits: what a screen is sent.
    Srgb { bits: u32 },
    /// Light, of any brightness.
    Linear,
}

/// A picture file.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredPicture {
    pub encoding: ColorEncoding,
    /// What is meant to be shown of the plane.
    pub display_window: PixelWindow,
    pub parts: Vec<PicturePart>,
}

/// One part of a picture file.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePart {
    /// Files of a single part may leave it out.
    pub name: Option<String>,
    /// Where there are pixels.
    pub data_window: PixelWindow,
    pub channels: Vec<PictureChannel>,
}

/// A channel of a part: a value for each pixel of its data window, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureChannel {
    pub name: String,
    pub samples: ChannelSamples,
}

/// The values of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum ChannelSamples {
    Float(Vec<f32>),
    /// Numbers of objects and the like, which a float cannot hold.
    Whole(Vec<u32>),
}

impl ChannelSamples {
    pub fn len(&self) -> usize {
        match self {
            ChannelSamples::Float(values) => values.len(),
            ChannelSamples::Whole(values) => values.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A value as a number; 0 for one that is not there.
    pub fn get(&self, index: usize) -> f64 {
        match self {
            ChannelSamples::Float(values) => values.get(index).map_or(0.0, |x| f64::from(*x)),
            ChannelSamples::Whole(values) => values.get(index).map_or(0.0, |x| f64::from(*x)),
        }
    }
}

/// Reads a PNG or EXR file with all of its parts and channels.
///
/// # Errors
/// What is wrong with the file, larger than it may be, or of a kind that is not read.
pub fn read_layered(bytes: &[u8]) -> Result<LayeredPicture, String> {
    if bytes.starts_with(EXR.signature) {
        let (display_window, parts) = read_exr_parts(bytes)?;
        return Ok(LayeredPicture { encoding: ColorEncoding::Linear, display_window, parts });
    }
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut most = image::Limits::default();
    (most.max_image_width, most.max_image_height) = (Some(limits::IMAGE_SIDE), Some(limits::IMAGE_SIDE));
    most.max_alloc = Some(limits::IMAGE_BYTES);
    reader.limits(most);
    let picture = reader.decode().map_err(|e| e.to_string())?;
    let color = picture.color();
    let samples = u32::from(color.channel_count()).max(1);
    let bits = u32::from(color.bits_per_pixel()) / samples;
    let pixels = picture.into_rgba16();
    let data_window = PixelWindow { origin: [0, 0], size: [pixels.width(), pixels.height()] };
    let has_alpha = color.has_alpha() && pixels.pixels().any(|pixel| pixel.0[3] != u16::MAX);
    let names = ["R", "G", "B", "A"].into_iter().take(if has_alpha { 4 } else { 3 });
    let channel = |(i, name): (usize, &str)| {
        let values = pixels.pixels().map(|pixel| f32::from(pixel.0[i]) / 65535.0).collect();
        PictureChannel { name: name.into(), samples: ChannelSamples::Float(values) }
    };
    let channels = names.enumerate().map(channel).collect();
    let part = PicturePart { name: None, data_window, channels };
    Ok(LayeredPicture { encoding: ColorEncoding::Srgb { bits }, display_window: data_window, parts: vec![part] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_have_their_common_part() {
        let window = |x, y, w, h| PixelWindow { origin: [x, y], size: [w, h] };
        assert_eq!(window(0, 0, 4, 4).common(window(2, -1, 4, 3)), Some(window(2, 0, 2, 2)));
        assert_eq!(window(0, 0, 4, 4).common(window(4, 0, 4, 4)), None);
        let far = window(i32::MIN, 0, u32::MAX, 1);
        assert_eq!(far.common(window(i32::MAX, 0, 5, 1)), None);
        assert_eq!(window(3, 4, 5, 6).to_string(), "5x6 at (3, 4)");
        assert_eq!(window(0, 0, 5, 6).to_string(), "5x6");
    }

    #[test]
    fn a_png_has_alpha_only_where_it_is_not_opaque() {
        let file = |alpha: u8| {
            let mut out = Cursor::new(Vec::new());
            let picture = image::RgbaImage::from_raw(1, 1, vec![255, 0, 51, alpha]).unwrap();
            picture.write_to(&mut out, image::ImageFormat::Png).unwrap();
            out.into_inner()
        };
        let names = |bytes: &[u8]| -> Vec<String> {
            let picture = read_layered(bytes).unwrap();
            assert_eq!(picture.encoding, ColorEncoding::Srgb { bits: 8 });
            assert_eq!(picture.parts[0].channels[2].samples, ChannelSamples::Float(vec![0.2]));
            picture.parts[0].channels.iter().map(|channel| channel.name.clone()).collect()
        };
        assert_eq!(names(&file(255)), ["R", "G", "B"]);
        assert_eq!(names(&file(254)), ["R", "G", "B", "A"]);
        let whole = file(1);
        for cut in 0..whole.len() {
            let _ = read_layered(&whole[..cut]);
        }
        assert!(read_layered(b"no picture").is_err() && read_layered(b"").is_err());
    }
}
