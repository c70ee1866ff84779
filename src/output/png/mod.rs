//! PNG: 8 or 16 bits a channel, marked as sRGB, with what the picture says of its making.

pub(super) mod chunks;

use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, EncodingError, SrgbRenderingIntent};

use super::format::{Decoded, Format, PictureHeader};
use super::metadata::Metadata;
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
    decode,
    read_header: |bytes| read_header(bytes).ok_or_else(|| "not a PNG picture".into()),
    checked_metadata,
    relabel: |bytes, _, changed| chunks::with_metadata(bytes, changed),
};

/// The bytes of a PNG file.
///
/// # Errors
/// Only a entry that PNG cannot hold.
fn encode(film: &Film, render: &Render, metadata: &Metadata) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, film.width, film.height);
    encoder.set_color(ColorType::Rgb);
    // A fifth larger than the usual, in a twentieth of the time: where little changes, that is what a frame costs.
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    for (keyword, text) in metadata {
        encoder.add_itxt_chunk(keyword.clone(), text.clone())?;
    }
    if render.bit_depth == 16 {
        encoder.set_depth(BitDepth::Sixteen);
        let data: Vec<u8> =
            film.to_rgb16(DisplayTransform::new(render)).into_iter().flat_map(u16::to_be_bytes).collect();
        encoder.write_header()?.write_image_data(&data)?;
    } else {
        encoder.set_depth(BitDepth::Eight);
        encoder.write_header()?.write_image_data(&film.to_rgb8(DisplayTransform::new(render)))?;
    }
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

/// Colours of 8 or 16 bits, 0 to 1.
fn decode(bytes: &[u8]) -> Result<Decoded, String> {
    let picture = image::load_from_memory_with_format(bytes, image::ImageFormat::Png).map_err(|e| e.to_string())?;
    let picture = picture.to_rgb16();
    let pixels = picture.pixels().map(|p| p.0.map(|x| f32::from(x) / 65535.0)).collect();
    Ok(Decoded { size: [picture.width(), picture.height()], pixels })
}

/// Size and metadata of a PNG file; `None` if it is not one.
fn read_header(bytes: &[u8]) -> Option<PictureHeader> {
    let mut reader = Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
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
}
