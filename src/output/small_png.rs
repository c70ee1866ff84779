//! PNG files that are kept or sent: as small as can be, whatever time that takes, with long notes compressed.

use std::borrow::Cow;
use std::io::Write;

use ::png::chunk::iTXt;
use ::png::{BitDepth, ColorType, Compression, Encoder, EncodingError, Filter, SrgbRenderingIntent};

use flate2::write::ZlibEncoder;

use super::{ChannelSamples, ColorEncoding, LayeredPicture, Metadata};

/// Pixels of a PNG file, row by row from the top.
pub enum PngPixels<'a> {
    /// One byte a pixel.
    Gray(&'a [u8]),
    /// Three bytes a pixel, along the sRGB curve.
    Rgb(&'a [u8]),
    /// Three big-endian words a pixel, along the sRGB curve.
    Rgb16(&'a [u8]),
}

/// The bytes of a small PNG file, with `notes` as they are and then `long` ones compressed.
///
/// # Errors
/// A note that PNG cannot hold; pixels that do not fill the size.
pub fn encode_small_png(
    [width, height]: [u32; 2],
    pixels: &PngPixels,
    notes: &Metadata,
    long: &Metadata,
) -> Result<Vec<u8>, String> {
    encode([width, height], pixels, notes, long).map_err(|e| e.to_string())
}

fn encode(
    [width, height]: [u32; 2],
    pixels: &PngPixels,
    notes: &Metadata,
    long: &Metadata,
) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    let (color, depth, data) = match pixels {
        PngPixels::Gray(data) => (ColorType::Grayscale, BitDepth::Eight, data),
        PngPixels::Rgb(data) => (ColorType::Rgb, BitDepth::Eight, data),
        PngPixels::Rgb16(data) => (ColorType::Rgb, BitDepth::Sixteen, data),
    };
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(Compression::High);
    encoder.set_filter(Filter::Adaptive);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    for (keyword, text) in notes {
        encoder.add_itxt_chunk(keyword.clone(), text.clone())?;
    }
    let mut writer = encoder.write_header()?;
    for (keyword, text) in long {
        writer.write_chunk(iTXt, &compressed_note(keyword, text))?;
    }
    writer.write_image_data(data)?;
    writer.finish()?;
    Ok(bytes)
}

/// The data of an iTXt chunk without a language, as small as can be (PNG specification, 11.3.3.4).
fn compressed_note(keyword: &str, text: &str) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    // Writing to memory does not fail.
    let packed = encoder.write_all(text.as_bytes()).and_then(|()| encoder.finish()).unwrap_or_default();
    [keyword.as_bytes(), b"\0\x01\0\0\0", &packed].concat()
}

/// How many bytes a note takes in a file when it is compressed.
pub fn compressed_note_bytes(keyword: &str, text: &str) -> usize {
    const CHUNK: usize = 12;
    compressed_note(keyword, text).len() + CHUNK
}

/// The small PNG file of a picture of 8 or 16 bits a channel without alpha: the same pixels, other notes.
///
/// # Errors
/// A picture that is of another kind, and why; a note that PNG cannot hold.
pub fn small_png_of(picture: &LayeredPicture, notes: &Metadata, long: &Metadata) -> Result<Vec<u8>, String> {
    let ColorEncoding::Srgb { bits } = picture.encoding else { return Err("it holds linear light".into()) };
    let [part] = &picture.parts[..] else { return Err("it has several parts".into()) };
    let channel = |name: &str| part.channels.iter().find(|c| c.name == name).map(|c| &c.samples);
    let (3, Some(red), Some(green), Some(blue)) = (part.channels.len(), channel("R"), channel("G"), channel("B"))
    else {
        return Err("it has other channels than R, G and B".into());
    };
    let values = |samples: &ChannelSamples, i: usize| samples.get(i);
    let pixels = 0..part.data_window.pixels();
    let colors = pixels.flat_map(|i| [red, green, blue].map(|samples| values(samples, i)));
    let size = part.data_window.size;
    let data: Cow<[u8]> = match bits {
        16 => colors.flat_map(|x| ((x * 65535.0 + 0.5) as u16).to_be_bytes()).collect(),
        _ => colors.map(|x| (x * 255.0 + 0.5) as u8).collect(),
    };
    let pixels = if bits == 16 { PngPixels::Rgb16(&data) } else { PngPixels::Rgb(&data) };
    encode_small_png(size, &pixels, notes, long)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::Render;
    use crate::film::Film;
    use crate::output::png::PNG;
    use crate::output::read_layered;

    #[test]
    fn the_small_file_has_the_same_pixels_and_its_notes() {
        let pixels = (0..1200).map(|i| [i as f32 / 1200.0, 0.3, 0.1]).collect();
        let film = Film { pixels, ..Film::new(40, 30) };
        let text = "transform.translation (1, 2, 3)\n".repeat(100);
        let note = |keyword: &str, text: &str| (keyword.to_string(), text.to_string());
        for bit_depth in [8, 16] {
            let bytes = (PNG.encode)(&film, &Render { bit_depth, ..Render::default() }, &Metadata::new()).unwrap();
            let picture = read_layered(&bytes).unwrap();
            let (notes, long) = (vec![note("Frame", "7")], vec![note("Scene", &text)]);
            let small = small_png_of(&picture, &notes, &long).unwrap();
            assert_eq!(read_layered(&small).unwrap(), picture);
            let header = (PNG.read_header)(&small).unwrap();
            assert_eq!((header.size, header.metadata), ([40, 30], [notes, long].concat()));
            assert_eq!(small, small_png_of(&picture, &vec![note("Frame", "7")], &vec![note("Scene", &text)]).unwrap());
        }
        let size = compressed_note_bytes("Scene", &text);
        assert!(size > 20 && size < 200, "{size}");
    }
}
