//! All that an OpenEXR file shows, in any number of parts.
//!
//! Compositors write a part for each pass (Blender since version 5: part `ViewLayer.Combined`, channels
//! `ViewLayer.Combined.R` and so on) or all passes as channels of one part; both become a list of parts here.

use std::io::Cursor;

use ::exr::image::FlatSamples;
use ::exr::math::Vec2;
use ::exr::meta::attribute::Text;
use ::exr::prelude::{ReadChannels, ReadLayers, read};

use super::read_header;
use crate::output::parts::{ChannelSamples, PictureChannel, PicturePart, PixelWindow};

/// Reads what is meant to be shown of the plane, and all parts of an OpenEXR file; every half is a float.
///
/// # Errors
/// What is wrong with the file, larger than it may be, or of a kind that is not read, as deep data are.
pub fn read_exr_parts(bytes: &[u8]) -> Result<(PixelWindow, Vec<PicturePart>), String> {
    // What a file declares is judged before anything is allocated for it.
    read_header(bytes)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let window = |Vec2(x, y): Vec2<i32>, size: Vec2<usize>| PixelWindow {
        origin: [x, y],
        // Checked above: no side is longer than 32 bits.
        size: [size.width() as u32, size.height() as u32],
    };
    let display = image.attributes.display_window;
    let mut parts = Vec::new();
    for layer in image.layer_data {
        let data_window = window(layer.attributes.layer_position, layer.size);
        let mut channels = Vec::new();
        for channel in layer.channel_data.list {
            let name = text(&channel.name);
            if channel.sampling != Vec2(1, 1) {
                let Vec2(x, y) = channel.sampling;
                return Err(format!("channel `{name}` has a value for every {x} x {y} pixels only"));
            }
            let samples = match channel.sample_data {
                FlatSamples::F16(values) => ChannelSamples::Float(values.into_iter().map(|x| x.to_f32()).collect()),
                FlatSamples::F32(values) => ChannelSamples::Float(values),
                FlatSamples::U32(values) => ChannelSamples::Whole(values),
            };
            if samples.len() != layer.size.area() {
                return Err(format!("channel `{name}` does not fill its part"));
            }
            channels.push(PictureChannel { name, samples });
        }
        parts.push(PicturePart { name: layer.attributes.layer_name.as_ref().map(text), data_window, channels });
    }
    Ok((window(display.position, display.size), parts))
}

fn text(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::{
        AnyChannel, AnyChannels, Encoding, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes, SmallVec,
        WritableImage,
    };

    fn channel(name: &str, samples: FlatSamples) -> AnyChannel<FlatSamples> {
        AnyChannel::new(name, samples)
    }

    #[test]
    fn parts_windows_and_channels_come_back() {
        let layer = |name: &str, at: (i32, i32), channels: Vec<AnyChannel<FlatSamples>>| {
            let attributes =
                LayerAttributes { layer_position: Vec2(at.0, at.1), ..LayerAttributes::named(Text::from(name)) };
            Layer::new((2, 1), attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels.into()))
        };
        let combined = ["ViewLayer.Combined.R", "ViewLayer.Combined.A"]
            .map(|name| channel(name, FlatSamples::F32(vec![0.5, 2.0])));
        let ids = vec![channel("ViewLayer.Id.X", FlatSamples::U32(vec![7, u32::MAX]))];
        let mut layers: SmallVec<[_; 2]> = SmallVec::new();
        layers.push(layer("ViewLayer.Combined", (0, 0), combined.to_vec()));
        layers.push(layer("ViewLayer.Id", (-3, 5), ids));
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((4, 6)));
        let mut bytes = Vec::new();
        Image::from_layers(attributes, layers).write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
        let (display, parts) = read_exr_parts(&bytes).unwrap();
        assert_eq!(display, PixelWindow { origin: [0, 0], size: [4, 6] });
        let names: Vec<_> = parts.iter().map(|part| part.name.as_deref()).collect();
        assert_eq!(names, [Some("ViewLayer.Combined"), Some("ViewLayer.Id")]);
        assert_eq!(parts[0].channels[1].name, "ViewLayer.Combined.R");
        assert_eq!(parts[1].data_window, PixelWindow { origin: [-3, 5], size: [2, 1] });
        assert_eq!(parts[1].channels[0].samples, ChannelSamples::Whole(vec![7, u32::MAX]));
        for cut in 0..bytes.len() {
            let _ = read_exr_parts(&bytes[..cut]);
        }
        assert!(read_exr_parts(&bytes[..bytes.len() / 2]).is_err());
    }
}
