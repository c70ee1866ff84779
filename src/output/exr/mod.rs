//! OpenEXR: linear values of any size, with layers beside the colours, and metadata in the attribute `comments`.
//!
//! One part of scan lines, compressed by ZIP (lossless, sixteen lines at a time). Channels have the names that
//! compositors look for: `R G B` for the picture, `Z` for depth, `N.X` and so on for what else is asked for.

pub(super) mod header;
mod merge;
mod parts;

use std::io::Cursor;

use ::exr::math::Vec2;
use ::exr::meta::MetaData;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, IntegerBounds, Layer, LayerAttributes,
    LineOrder, ReadChannels, ReadLayers, Text, WritableImage, f16, read,
};

use super::format::{Decoded, Format, PictureHeader};
use super::metadata::{Metadata, with_pixels};
use crate::base::digest::{Digest, Hasher};
use crate::base::limits;
use crate::components::{Aov, Render};
use crate::film::Film;
use header::text_of;
pub use merge::{MergedPicture, merge_exr};
pub use parts::read_exr_parts;

/// OpenEXR in the table of formats.
pub const EXR: Format = Format {
    name: "EXR",
    extensions: &["exr"],
    signature: &[0x76, 0x2f, 0x31, 0x01],
    bit_depths: &[(8, "halves"), (16, "halves"), (32, "floats")],
    holds: |_| true,
    encode,
    decode,
    pixels,
    read_header,
    // The sums that tell damage are inside of the blocks: all are unpacked.
    checked_metadata: |bytes| decode(bytes).and_then(|_| read_header(bytes)).ok().map(|header| header.metadata),
    relabel: header::with_metadata,
};

/// Largest number of a half.
const MOST_OF_HALF: f32 = 65_504.0;
/// Layers and channels of a file that is read: far more than any renderer writes.
const MOST_CHANNELS: usize = 1_024;
/// How many times smaller than its values a file can be: the best that black pictures reach.
const MOST_SQUEEZED: u64 = 10_000;

/// All layers; a file has each once, however often it is asked for.
const LAYERS: [Aov; 8] =
    [Aov::Depth, Aov::Normal, Aov::Albedo, Aov::Position, Aov::Entity, Aov::Material, Aov::Motion, Aov::Variance];

/// The bytes of an EXR file: colours in halves, or in floats where `bit_depth` is 32; all else in floats.
///
/// # Errors
/// What the format cannot hold.
fn encode(film: &Film, render: &Render, metadata: &Metadata) -> Result<Vec<u8>, String> {
    let colors = &film.pixels;
    let mut channels: Vec<AnyChannel<FlatSamples>> = Vec::new();
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = colors.iter().map(|color| color[axis]);
        let samples = match render.bit_depth {
            32 => FlatSamples::F32(values.collect()),
            // What is too bright for a half is as bright as a half can be.
            _ => FlatSamples::F16(values.map(|x| f16::from_f32(x.min(MOST_OF_HALF))).collect()),
        };
        channels.push(AnyChannel::new(name, samples));
    }
    for aov in LAYERS {
        if render.aovs.contains(&aov) {
            channels.extend(
                columns(film, aov).into_iter().map(|(name, values)| AnyChannel::new(name, FlatSamples::F32(values))),
            );
        }
    }
    let size = [film.width, film.height];
    let metadata = with_pixels(metadata, || digest_of(size, &channels));
    // What is meant to be shown is the whole frame; there may be pixels for a part of it.
    let window = render.region.map(|_| (render.pixel_bounds()[0], render.size));
    file_of(size, channels, &metadata, window)
}

/// The bytes of a file; `window` is where a part of a frame lies in it, and the frame's size.
fn file_of(
    size: [u32; 2],
    channels: Vec<AnyChannel<FlatSamples>>,
    metadata: &Metadata,
    window: Option<([u32; 2], [u32; 2])>,
) -> Result<Vec<u8>, String> {
    // One attribute for all metadata: the crate writes several in an order that changes from run to run.
    let comments = Some(Text::from_slice_unchecked(text_of(metadata).as_bytes()));
    let attributes = LayerAttributes { comments, ..LayerAttributes::default() };
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let side = |[width, height]: [u32; 2]| Vec2(width as usize, height as usize);
    let layer = Layer::new(side(size), attributes, encoding, AnyChannels::sort(channels.into()));
    let mut image = Image::from_layer(layer);
    if let Some(([x, y], frame)) = window {
        image.attributes.display_window = IntegerBounds::from_dimensions(side(frame));
        image.layer_data.attributes.layer_position = Vec2(x as i32, y as i32);
    }
    let mut bytes = Vec::new();
    // On one thread: blocks lie in the file in the order of their lines.
    let written = image.write().non_parallel().to_buffered(Cursor::new(&mut bytes));
    written.map(|()| bytes).map_err(|e| e.to_string())
}

/// The digest of a picture's size and the values of all its channels, whatever their order and the file's compression.
fn digest_of(size: [u32; 2], channels: &[AnyChannel<FlatSamples>]) -> Digest {
    let mut sorted: Vec<&AnyChannel<FlatSamples>> = channels.iter().collect();
    sorted.sort_by(|a, b| a.name.as_slice().cmp(b.name.as_slice()));
    let mut hasher = Hasher::default();
    size.into_iter().for_each(|side| hasher.word(side.into()));
    for channel in sorted {
        hasher.bytes(channel.name.as_slice());
        for value in channel.sample_data.values_as_f32() {
            hasher.bytes(&value.to_bits().to_le_bytes());
        }
    }
    hasher.finish()
}

/// The digest of what a file shows.
fn pixels(bytes: &[u8]) -> Option<Digest> {
    let (size, image) = read_image(bytes).ok()?;
    Some(digest_of(size, &image.layer_data.channel_data.list))
}

/// The channels of a layer, by name.
fn columns(film: &Film, aov: Aov) -> Vec<(&'static str, Vec<f32>)> {
    let layers = &film.layers;
    let axis = |of: &[[f32; 3]], i: usize| of.iter().map(|v| v[i]).collect();
    let side = |i: usize| layers.motion.iter().map(|v| v[i]).collect();
    let three = |names: [&'static str; 3], of: &[[f32; 3]]| (0..3).map(|i| (names[i], axis(of, i))).collect();
    // Exact: there are fewer entities and materials than 2^24.
    let numbers = |of: &[u32]| of.iter().map(|n| *n as f32).collect();
    match aov {
        Aov::Depth => vec![("Z", layers.depth.clone())],
        Aov::Normal => three(["N.X", "N.Y", "N.Z"], &layers.normal),
        Aov::Albedo => three(["albedo.R", "albedo.G", "albedo.B"], &layers.albedo),
        Aov::Position => three(["P.X", "P.Y", "P.Z"], &layers.position),
        Aov::Entity => vec![("entityId", numbers(&layers.entity))],
        Aov::Material => vec![("materialId", numbers(&layers.material))],
        Aov::Motion => vec![("motion.X", side(0)), ("motion.Y", side(1))],
        Aov::Variance => vec![("variance", layers.variance.clone())],
    }
}

/// What the header of an EXR file says.
///
/// # Errors
/// What is wrong with the file, or larger than it may be.
fn read_header(bytes: &[u8]) -> Result<PictureHeader, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    let header = meta.headers.first().ok_or("it has no picture")?;
    let side = |n: usize| u32::try_from(n).ok().filter(|n| (1..=limits::IMAGE_SIDE).contains(n));
    let size = header.layer_size;
    let (Some(width), Some(height)) = (side(size.width()), side(size.height())) else {
        return Err(format!("it declares {} x {} pixels", size.width(), size.height()));
    };
    // Files are read whole, all of their parts and channels: what they declare has to be bearable.
    let channels: usize = meta.headers.iter().map(|h| h.channels.list.len()).sum();
    let pixels = meta.headers.iter().map(|h| h.layer_size.area() as u64).max().unwrap_or(0);
    let bytes_of = |h: &::exr::meta::header::Header| h.layer_size.area() as u64 * h.channels.bytes_per_pixel as u64;
    let raw = meta.headers.iter().map(bytes_of).fold(0, u64::saturating_add);
    let is_huge = pixels > limits::FRAME_PIXELS || raw > limits::EXR_BYTES;
    if channels > MOST_CHANNELS || is_huge || raw / MOST_SQUEEZED > bytes.len() as u64 {
        return Err(format!("it declares {channels} channels of {pixels} pixels in {} bytes", bytes.len()));
    }
    let text = |text: &Text| String::from_utf8_lossy(text.as_slice()).into_owned();
    let comments = header.own_attributes.comments.as_ref().map(text).unwrap_or_default();
    let entry = |line: &str| line.split_once(": ").map(|(keyword, text)| (keyword.to_string(), text.to_string()));
    let metadata = comments.lines().filter_map(entry).collect();
    let channels = header.channels.list.iter().map(|c| text(&c.name)).collect();
    Ok(PictureHeader { size: [width, height], channels, metadata })
}

/// A picture with its channels as they are in the file.
type FlatImage = Image<Layer<AnyChannels<FlatSamples>>>;

/// The linear colours of an EXR file, top row first.
///
/// # Errors
/// As [`read_header`]; a file without `R`, `G` and `B`.
fn decode(bytes: &[u8]) -> Result<Decoded, String> {
    let (size, image) = read_image(bytes)?;
    let layer = &image.layer_data;
    let mut colors = vec![[0.0; 3]; layer.size.area()];
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        let found = layer.channel_data.list.iter().find(|c| c.name.eq(name));
        let channel = found.ok_or_else(|| format!("it has no channel `{name}`"))?;
        for (color, value) in colors.iter_mut().zip(channel.sample_data.values_as_f32()) {
            color[axis] = value;
        }
    }
    Ok(Decoded { size, pixels: colors })
}

/// All channels of the first part of an EXR file.
fn read_image(bytes: &[u8]) -> Result<([u32; 2], FlatImage), String> {
    let PictureHeader { size, .. } = read_header(bytes)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    let layer = &image.layer_data;
    if [layer.size.width(), layer.size.height()] != size.map(|n| n as usize) {
        return Err("its first part is not a plain picture".into());
    }
    Ok((size, image))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> Vec<u8> {
        let mut film = Film::new(19, 18);
        film.pixels.iter_mut().enumerate().for_each(|(i, p)| *p = [i as f32, 0.1, 1e9]);
        film.layers.make_room_for_features(19 * 18);
        let render = Render { aovs: vec![Aov::Entity, Aov::Depth], ..Render::default() };
        let metadata: Metadata = vec![("Source".into(), "schön: 雪.rhai".into()), ("Frame".into(), "7".into())];
        encode(&film, &render, &metadata).unwrap()
    }

    #[test]
    fn colors_names_and_metadata_come_back() {
        let bytes = file();
        assert!(bytes.starts_with(EXR.signature) && bytes == file());
        let Decoded { size, pixels: colors } = decode(&bytes).unwrap();
        // The smallest step of a half near 0.1 is 2^-14.
        assert_eq!((size, colors.len()), ([19, 18], 19 * 18));
        assert!(
            colors.iter().enumerate().all(|(i, c)| c[0] == i as f32 && (c[1] - 0.1).abs() < 1e-4 && c[2] == 65504.0)
        );
        let header = read_header(&bytes).unwrap();
        assert_eq!(header.channels, ["B", "G", "R", "Z", "entityId"]);
        assert_eq!(header.metadata[0], ("Source".to_string(), "schön: 雪.rhai".to_string()));
    }

    #[test]
    fn broken_files_are_refused_and_nothing_worse() {
        let whole = file();
        for i in 0..whole.len() {
            let _ = decode(&whole[..i]);
            for flip in [1, 0x80, 0xff] {
                let mut broken = whole.clone();
                broken[i] ^= flip;
                let _ = decode(&broken);
            }
        }
        assert!(decode(b"not a picture").is_err() && decode(&whole[..whole.len() / 2]).is_err());
    }
}
