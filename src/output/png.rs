//! PNG: 8 or 16 bits a channel, marked as sRGB, with what the picture says of its making.

use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, EncodingError, SrgbRenderingIntent};

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

/// The notes of a PNG file, and its size; `None` if it is not one.
pub fn read_png_metadata(bytes: &[u8]) -> Option<([u32; 2], Metadata)> {
    let mut reader = Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
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
}
