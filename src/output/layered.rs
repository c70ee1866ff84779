//! A picture file with everything in it: parts, where each lies, and every channel of them.
//!
//! A PNG is one part with the channels `R`, `G`, `B`, and `A` where it is not opaque; an EXR file has what it has.

use std::io::Cursor;

use image::ImageReader;

use super::exr::{EXR, read_exr_parts};
use super::parts::{ChannelSamples, ColorEncoding, LayeredPicture, PictureChannel, PicturePart, PixelWindow};
use crate::base::limits;

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
