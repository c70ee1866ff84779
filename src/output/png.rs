//! PNG: 8 or 16 bits a channel, marked as sRGB, with what the picture says of its making.

use std::io::Cursor;

use ::png::{
    BitDepth, ColorType, Compression, Decoder, Encoder, EncodingError, Limits, SrgbRenderingIntent, Transformations,
};

use super::state::PIXELS;
use crate::base::digest::{Digest, Hasher};
use crate::base::limits;
use crate::components::Render;
use crate::film::{DisplayTransform, Film};

/// What a picture says of its making: keyword and text, in order.
pub type Metadata = Vec<(String, String)>;

/// The settings that decide a picture's pixels, as one line. The accelerator is not among them: it does not show.
pub fn settings_text(render: &Render) -> String {
    let [width, height] = render.size;
    let Render { samples, max_depth, shadow_samples, light_size, .. } = render;
    format!(
        "size={width}x{height} samples={samples} integrator={} max_depth={max_depth} shadows={} \
         shadow_samples={shadow_samples} light_size={light_size} transparent_shadows={} fresnel={} transfer={}",
        render.integrator.name(),
        render.shadows.name(),
        render.transparent_shadows,
        render.fresnel.name(),
        render.transfer.name(),
    ) + film_settings_text(render).as_str()
}

/// The settings of the film that are not as they usually are.
fn film_settings_text(render: &Render) -> String {
    let usual = Render::default();
    let mut note = String::new();
    let mut add = |name: &str, value: String, differs: bool| {
        if differs {
            note += &format!(" {name}={value}");
        }
    };
    if let Some(clamp) = render.clamp {
        add("clamp", clamp.to_string(), true);
    }
    add("exposure", render.exposure.to_string(), render.exposure != usual.exposure);
    add("tone_map", render.tone_map.name().into(), render.tone_map != usual.tone_map);
    add("filter", render.filter.name().into(), render.filter != usual.filter);
    add("filter_width", render.filter_width().to_string(), render.filter_width() != usual.filter_width());
    if let Some(threshold) = render.noise_threshold {
        add("noise_threshold", threshold.to_string(), true);
        add("min_samples", render.min_samples.to_string(), true);
    }
    add("denoise", render.denoise.to_string(), render.denoise);
    note
}

/// The bytes of a PNG file.
///
/// # Errors
/// Only a note that PNG cannot hold.
pub fn encode_png(film: &Film, render: &Render, metadata: &Metadata) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, film.width, film.height);
    encoder.set_color(ColorType::Rgb);
    // A fifth larger than the usual, in a twentieth of the time: where little changes, that is what a frame costs.
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let is_deep = render.bit_depth == 16;
    let data = if is_deep {
        film.to_rgb16(DisplayTransform::new(render)).into_iter().flat_map(u16::to_be_bytes).collect()
    } else {
        film.to_rgb8(DisplayTransform::new(render))
    };
    for (keyword, text) in metadata {
        encoder.add_itxt_chunk(keyword.clone(), text.clone())?;
    }
    if metadata.iter().any(|(keyword, _)| keyword == "Hash") {
        let pixels = digest_of(film.width, film.height, &data, is_deep, 3);
        encoder.add_itxt_chunk(PIXELS.into(), pixels.to_string())?;
    }
    encoder.set_depth(if is_deep { BitDepth::Sixteen } else { BitDepth::Eight });
    encoder.write_header()?.write_image_data(&data)?;
    Ok(bytes)
}

/// The digest of a picture's size and its colours in sixteen bits a channel, however they are stored.
fn digest_of(width: u32, height: u32, data: &[u8], is_deep: bool, channels: usize) -> Digest {
    let mut hasher = Hasher::default();
    hasher.word(width.into());
    hasher.word(height.into());
    let mut block = Vec::with_capacity(BLOCK);
    let step = if is_deep { 2 } else { 1 };
    for pixel in data.chunks_exact(step * channels) {
        for channel in 0..3 {
            // Grey is the same in all three.
            let at = if channels < 3 { 0 } else { channel * step };
            block.extend([pixel[at], pixel[at + step - 1]]);
        }
        if block.len() + 6 > BLOCK {
            hasher.bytes(&block);
            block.clear();
        }
    }
    hasher.bytes(&block);
    hasher.finish()
}

/// Bytes that are hashed at once.
const BLOCK: usize = 1 << 14;

/// The digest of the pixels of a PNG file, as they are in it; `None` if it is none, or shows what is behind it.
pub fn png_pixels(bytes: &[u8]) -> Option<Digest> {
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: limits::FRAME_FILE_BYTES as usize });
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().ok()?;
    let (width, height) = reader.info().size();
    if u64::from(width) * u64::from(height) > limits::FRAME_PIXELS {
        return None;
    }
    let mut data = vec![0; reader.output_buffer_size()?];
    let frame = reader.next_frame(&mut data).ok()?;
    data.truncate(frame.buffer_size());
    let is_deep = frame.bit_depth == BitDepth::Sixteen;
    let channels = frame.color_type.samples();
    let step = if is_deep { 2 } else { 1 };
    let is_opaque = |pixel: &[u8]| pixel[step * (channels - 1)..].iter().all(|byte| *byte == u8::MAX);
    if matches!(frame.color_type, ColorType::Rgba | ColorType::GrayscaleAlpha)
        && !data.chunks_exact(step * channels).all(is_opaque)
    {
        return None;
    }
    Some(digest_of(width, height, &data, is_deep, channels))
}

/// The notes of a PNG file, and its size; `None` if it is not one.
pub fn read_png_metadata(bytes: &[u8]) -> Option<([u32; 2], Metadata)> {
    let mut reader = Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    reader.finish().ok()?;
    let info = reader.info();
    let plain = info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone()));
    let utf8 = info.utf8_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?)));
    Some(([info.width, info.height], plain.chain(utf8).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::Transfer;

    #[test]
    fn pixels_and_notes_come_back() {
        let film = Film { pixels: vec![[0.0, 0.5, 1.0], [0.25, 2.0, -1.0]], ..Film::new(2, 1) };
        let metadata: Metadata = vec![("Frame".into(), "7".into()), ("Source".into(), "schön.rhai".into())];
        for (bit_depth, expected) in [(8, [0u32, 128, 255]), (16, [0, 32768, 65535])] {
            let render = Render { bit_depth, transfer: Transfer::Linear, ..Render::default() };
            let bytes = encode_png(&film, &render, &metadata).unwrap();
            assert_eq!(bytes, encode_png(&film, &render, &metadata).unwrap());
            assert_eq!(read_png_metadata(&bytes), Some(([2, 1], metadata.clone())));
            let picture = image::load_from_memory(&bytes).unwrap();
            let first = match bit_depth {
                8 => picture.to_rgb8().get_pixel(0, 0).0.map(u32::from),
                _ => picture.to_rgb16().get_pixel(0, 0).0.map(u32::from),
            };
            assert_eq!(first, expected);
        }
        assert_eq!(read_png_metadata(b"not a picture"), None);
    }

    #[test]
    fn the_digest_is_of_what_is_shown_and_not_of_how_it_is_stored() {
        let grey = |x: f32| Film { pixels: vec![[x; 3]; 6], ..Film::new(3, 2) };
        let hash: Metadata = vec![("Hash".into(), "0".into())];
        let encode = |film: &Film, bit_depth| {
            encode_png(film, &Render { bit_depth, transfer: Transfer::Linear, ..Render::default() }, &hash).unwrap()
        };
        let stored = |color: ColorType, depth: BitDepth, data: &[u8]| {
            let mut bytes = Vec::new();
            let mut encoder = Encoder::new(&mut bytes, 3, 2);
            encoder.set_color(color);
            encoder.set_depth(depth);
            encoder.write_header().unwrap().write_image_data(data).unwrap();
            png_pixels(&bytes)
        };
        let white = png_pixels(&encode(&grey(1.0), 8));
        assert!(white.is_some() && white == png_pixels(&encode(&grey(1.0), 16)));
        assert_eq!(stored(ColorType::Grayscale, BitDepth::Eight, &[255; 6]), white);
        assert_eq!(stored(ColorType::Grayscale, BitDepth::One, &[0xff; 2]), white);
        assert_eq!(stored(ColorType::Rgba, BitDepth::Eight, &[255; 24]), white);
        assert_eq!(stored(ColorType::GrayscaleAlpha, BitDepth::Eight, &[255, 254].repeat(6)), None);
        assert_ne!(stored(ColorType::Grayscale, BitDepth::Eight, &[254; 6]), white);
        assert_ne!(png_pixels(&encode(&grey(0.5), 8)), png_pixels(&encode(&grey(0.5), 16)));
        let (_, metadata) = read_png_metadata(&encode(&grey(1.0), 8)).unwrap();
        assert_eq!(metadata[1], (PIXELS.into(), white.unwrap().to_string()));
        assert_eq!(png_pixels(b"no picture"), None);
    }
}
