//! PNG: 8 or 16 bits a channel, marked as sRGB, with what the picture says of its making.

pub(super) mod chunks;

use std::io::Cursor;

use ::png::{
    BitDepth, ColorType, Compression, Decoder, Encoder, EncodingError, Limits, SrgbRenderingIntent, Transformations,
};

use super::format::{Decoded, Format, PictureHeader};
use super::metadata::{Metadata, with_pixels};
use crate::base::digest::{Digest, Hasher};
use crate::base::limits;
use crate::components::Render;
use crate::film::{DisplayTransform, Film};

/// PNG in the table of formats.
pub const PNG: Format = Format {
    name: "PNG",
    extensions: &["png"],
    signature: &chunks::SIGNATURE,
    bit_depths: &[(8, "8 bits a channel"), (16, "16 bits a channel")],
    holds: |_| false,
    encode: |film, render, metadata| encode(film, render, metadata).map_err(|e| e.to_string()),
    encode_rows,
    decode,
    pixels,
    read_header: |bytes| read_header(bytes).ok_or_else(|| "not a PNG picture".into()),
    checked_metadata,
    relabel: |bytes, _, changed| chunks::with_metadata(bytes, changed),
};

/// The bytes of a PNG file.
///
/// # Errors
/// Only a entry that PNG cannot hold.
fn encode(film: &Film, render: &Render, metadata: &Metadata) -> Result<Vec<u8>, EncodingError> {
    let mut data = Vec::new();
    append(&mut data, film, render);
    encode_data([film.width, film.height], &data, render, metadata)
}

/// As [`encode`], of bands of rows: what a screen shows of them is small beside the light on the film.
fn encode_rows(
    size: [u32; 2],
    render: &Render,
    metadata: &Metadata,
    next: &mut dyn FnMut() -> Option<Film>,
) -> Result<Vec<u8>, String> {
    let (mut data, mut rows) = (Vec::new(), 0);
    while rows < size[1] {
        let film = next().ok_or("rows are missing")?;
        append(&mut data, &film, render);
        rows += film.height;
    }
    encode_data(size, &data, render, metadata).map_err(|e| e.to_string())
}

/// Adds the values of rows as they stand in the file.
fn append(data: &mut Vec<u8>, film: &Film, render: &Render) {
    let display = DisplayTransform::new(render);
    match (render.bit_depth == 16, render.transparent) {
        (true, false) => data.extend(film.to_rgb16(display).into_iter().flat_map(u16::to_be_bytes)),
        (true, true) => data.extend(film.to_rgba16(display).into_iter().flat_map(u16::to_be_bytes)),
        (false, false) => data.append(&mut film.to_rgb8(display)),
        (false, true) => data.append(&mut film.to_rgba8(display)),
    }
}

fn encode_data(
    [width, height]: [u32; 2],
    data: &[u8],
    render: &Render,
    metadata: &Metadata,
) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    let (color, channels) = if render.transparent { (ColorType::Rgba, 4) } else { (ColorType::Rgb, 3) };
    encoder.set_color(color);
    // A fifth larger than the usual, in a twentieth of the time: where little changes, that is what a frame costs.
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let is_deep = render.bit_depth == 16;
    for (keyword, text) in with_pixels(metadata, || digest_of(width, height, data, is_deep, channels)) {
        encoder.add_itxt_chunk(keyword, text)?;
    }
    encoder.set_depth(if is_deep { BitDepth::Sixteen } else { BitDepth::Eight });
    encoder.write_header()?.write_image_data(data)?;
    Ok(bytes)
}

/// The bytes of a PNG file of sRGB values in 8 bits, three for each pixel.
///
/// # Errors
/// Metadata that PNG cannot hold; bytes that do not fill the size.
pub fn encode_rgb8(pixels: &[u8], [width, height]: [u32; 2], metadata: &Metadata) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    for (keyword, text) in metadata {
        encoder.add_itxt_chunk(keyword.clone(), text.clone())?;
    }
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(bytes)
}

/// The digest of a picture's size and its colours in sixteen bits a channel, however they are stored; with alpha, unless it
/// is 1 everywhere.
fn digest_of(width: u32, height: u32, data: &[u8], is_deep: bool, channels: usize) -> Digest {
    let mut hasher = Hasher::default();
    hasher.word(width.into());
    hasher.word(height.into());
    let mut block = Vec::with_capacity(BLOCK);
    let step = if is_deep { 2 } else { 1 };
    let is_opaque = |pixel: &[u8]| pixel[step * (channels - 1)..].iter().all(|byte| *byte == u8::MAX);
    let has_alpha = channels.is_multiple_of(2) && !data.chunks_exact(step * channels).all(is_opaque);
    for pixel in data.chunks_exact(step * channels) {
        for channel in 0..3 {
            // Grey is the same in all three.
            let at = if channels < 3 { 0 } else { channel * step };
            block.extend([pixel[at], pixel[at + step - 1]]);
        }
        if has_alpha {
            let at = (channels - 1) * step;
            block.extend([pixel[at], pixel[at + step - 1]]);
        }
        if block.len() + 8 > BLOCK {
            hasher.bytes(&block);
            block.clear();
        }
    }
    hasher.bytes(&block);
    hasher.finish()
}

/// Bytes that are hashed at once.
const BLOCK: usize = 1 << 14;

/// The digest of the pixels of a PNG file, as they are in it; `None` if it is none.
fn pixels(bytes: &[u8]) -> Option<Digest> {
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
    Some(digest_of(width, height, &data, is_deep, channels))
}

/// Colours of 8 or 16 bits, 0 to 1.
fn decode(bytes: &[u8]) -> Result<Decoded, String> {
    let picture = image::load_from_memory_with_format(bytes, image::ImageFormat::Png).map_err(|e| e.to_string())?;
    let picture = picture.to_rgb16();
    let pixels = picture.pixels().map(|p| p.0.map(|x| f32::from(x) / 65535.0)).collect();
    Ok(Decoded { size: [picture.width(), picture.height()], pixels })
}

/// Size and metadata of a PNG file; `None` if it is not one.
fn read_header(bytes: &[u8]) -> Option<PictureHeader> {
    let mut reader = Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    reader.finish().ok()?;
    let info = reader.info();
    let plain = info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone()));
    let utf8 = info.utf8_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?)));
    Some(PictureHeader { size: [info.width, info.height], channels: Vec::new(), metadata: plain.chain(utf8).collect() })
}

/// The metadata of a PNG file of which every chunk is whole.
fn checked_metadata(bytes: &[u8]) -> Option<Metadata> {
    if chunks::are_whole(bytes) { read_header(bytes).map(|header| header.metadata) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::Transfer;

    #[test]
    fn pixels_and_metadata_come_back() {
        let film = Film { pixels: vec![[0.0, 0.5, 1.0], [0.25, 2.0, -1.0]], ..Film::new(2, 1) };
        let metadata: Metadata = vec![("Frame".into(), "7".into()), ("Source".into(), "schön.rhai".into())];
        for (bit_depth, expected) in [(8, [0u32, 128, 255]), (16, [0, 32768, 65535])] {
            let render = Render { bit_depth, transfer: Transfer::Linear, ..Render::default() };
            let bytes = encode(&film, &render, &metadata).unwrap();
            assert_eq!(bytes, encode(&film, &render, &metadata).unwrap());
            let header = read_header(&bytes).unwrap();
            assert_eq!((header.size, &header.metadata), ([2, 1], &metadata));
            let picture = image::load_from_memory(&bytes).unwrap();
            let first = match bit_depth {
                8 => picture.to_rgb8().get_pixel(0, 0).0.map(u32::from),
                _ => picture.to_rgb16().get_pixel(0, 0).0.map(u32::from),
            };
            assert_eq!(first, expected);
        }
        assert_eq!(read_header(b"not a picture"), None);
    }

    #[test]
    fn the_digest_is_of_what_is_shown_and_not_of_how_it_is_stored() {
        let grey = |x: f32| Film { pixels: vec![[x; 3]; 6], ..Film::new(3, 2) };
        let hash: Metadata = vec![("Hash".into(), "0".into())];
        let file = |film: &Film, bit_depth| {
            encode(film, &Render { bit_depth, transfer: Transfer::Linear, ..Render::default() }, &hash).unwrap()
        };
        let stored = |color: ColorType, depth: BitDepth, data: &[u8]| {
            let mut bytes = Vec::new();
            let mut encoder = Encoder::new(&mut bytes, 3, 2);
            encoder.set_color(color);
            encoder.set_depth(depth);
            encoder.write_header().unwrap().write_image_data(data).unwrap();
            pixels(&bytes)
        };
        let white = pixels(&file(&grey(1.0), 8));
        assert!(white.is_some() && white == pixels(&file(&grey(1.0), 16)));
        assert_eq!(stored(ColorType::Grayscale, BitDepth::Eight, &[255; 6]), white);
        assert_eq!(stored(ColorType::Grayscale, BitDepth::One, &[0xff; 2]), white);
        assert_eq!(stored(ColorType::Rgba, BitDepth::Eight, &[255; 24]), white);
        let veil = stored(ColorType::GrayscaleAlpha, BitDepth::Eight, &[255, 254].repeat(6));
        assert!(veil.is_some() && veil != white);
        assert_eq!(stored(ColorType::Rgba, BitDepth::Eight, &[255, 255, 255, 254].repeat(6)), veil);
        assert_ne!(stored(ColorType::Grayscale, BitDepth::Eight, &[254; 6]), white);
        assert_ne!(pixels(&file(&grey(0.5), 8)), pixels(&file(&grey(0.5), 16)));
        let metadata = read_header(&file(&grey(1.0), 8)).unwrap().metadata;
        assert_eq!(metadata[1], ("Pixels".to_string(), white.unwrap().to_string()));
        assert_eq!(pixels(b"no picture"), None);
    }
}
