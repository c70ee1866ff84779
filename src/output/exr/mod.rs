//! OpenEXR: linear values of any size, with layers beside the colours, and metadata in the attribute `comments`.
//!
//! One part of scan lines, compressed by ZIP (lossless, sixteen lines at a time). Channels have the names that
//! compositors look for: `R G B` for the picture, `Z` for depth, `N.X` and so on for what else is asked for.

mod channels;
pub(super) mod header;
mod merge;
mod parts;
mod rows;

use std::borrow::Cow;
use std::io::Cursor;

use ::exr::meta::MetaData;
use ::exr::prelude::{AnyChannels, FlatSamples, Image, Layer, ReadChannels, ReadLayers, Text, read};

use super::format::{Decoded, Format, PictureHeader};
use crate::base::digest::Digest;
use crate::base::limits;
use channels::ChannelDigests;
pub use merge::{MergedPicture, merge_exr};
pub use parts::read_exr_parts;

/// OpenEXR in the table of formats.
pub const EXR: Format = Format {
    name: "EXR",
    extensions: &["exr"],
    signature: &[0x76, 0x2f, 0x31, 0x01],
    bit_depths: &[(8, "halves"), (16, "halves"), (32, "floats")],
    holds: |_| true,
    encode: |film, render, metadata| {
        rows::encode_bands([film.width, film.height], render, metadata, &mut || Some(Cow::Borrowed(film)))
    },
    encode_rows: |size, render, metadata, next| {
        rows::encode_bands(size, render, metadata, &mut || next().map(Cow::Owned))
    },
    decode,
    pixels,
    read_header,
    // The sums that tell damage are inside of the blocks: all are unpacked.
    checked_metadata: |bytes| decode(bytes).and_then(|_| read_header(bytes)).ok().map(|header| header.metadata),
    relabel: header::with_metadata,
};

/// Layers and channels of a file that is read: far more than any renderer writes.
const MOST_CHANNELS: usize = 1_024;
/// How many times smaller than its values a file can be: the best that black pictures reach.
const MOST_SQUEEZED: u64 = 10_000;

/// The digest of what a file shows.
fn pixels(bytes: &[u8]) -> Option<Digest> {
    let (size, image) = read_image(bytes).ok()?;
    let mut digests = ChannelDigests::default();
    digests.add(&image.layer_data.channel_data.list);
    Some(digests.finish(size))
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
    decode_with_alpha(bytes).map(|(decoded, _)| decoded)
}

/// As `decode`, and the channel `A` if there is one: the colours are multiplied by it.
///
/// # Errors
/// As for `decode`.
pub fn decode_with_alpha(bytes: &[u8]) -> Result<(Decoded, Option<Vec<f32>>), String> {
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
    let alpha = layer.channel_data.list.iter().find(|c| c.name.eq("A"));
    let alpha = alpha.map(|channel| channel.sample_data.values_as_f32().collect());
    Ok((Decoded { size, pixels: colors }, alpha))
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
    use crate::components::{Aov, Render};
    use crate::film::{Film, PixelBounds};
    use crate::output::metadata::Metadata;

    fn file() -> Vec<u8> {
        let mut film = Film::new(19, 18);
        film.pixels.iter_mut().enumerate().for_each(|(i, p)| *p = [i as f32, 0.1, 1e9]);
        film.layers.make_room_for_features(19 * 18);
        let render = Render { aovs: vec![Aov::Entity, Aov::Depth], ..Render::default() };
        let metadata: Metadata = vec![("Source".into(), "schön: 雪.rhai".into()), ("Frame".into(), "7".into())];
        (EXR.encode)(&film, &render, &metadata).unwrap()
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
    fn a_file_of_bands_is_that_of_the_whole() {
        let mut whole = Film::new(7, 75);
        let count = whole.pixels.len();
        whole.pixels.iter_mut().enumerate().for_each(|(i, p)| *p = [i as f32 / 9.0, 0.1, 1e9]);
        whole.layers.make_room_for_features(count);
        let metadata: Metadata = vec![("Frame".into(), "7".into()), ("Hash".into(), "0".into())];
        for (region, aovs) in [(None, vec![Aov::Normal, Aov::Depth]), (Some([2, 5, 7, 75]), Vec::new())] {
            let render = Render { size: [20, 90], region, aovs, ..Render::default() };
            let expected = (EXR.encode)(&whole, &render, &metadata).unwrap();
            let said = read_header(&expected).unwrap().metadata;
            assert_eq!(said.last().unwrap().1, pixels(&expected).unwrap().to_string());
            for heights in [vec![16, 48, 11], vec![5, 30, 1, 39], vec![75]] {
                let bounds = PixelBounds::whole([7, 75]);
                let (mut top, mut heights) = (0, heights.into_iter());
                let mut next = || {
                    let height = heights.next()?;
                    top += height;
                    Some(whole.cropped(bounds, PixelBounds { origin: [0, top - height], size: [7, height] }))
                };
                let found = (EXR.encode_rows)([7, 75], &render, &metadata, &mut next).unwrap();
                assert!(found == expected);
            }
            assert!((EXR.encode_rows)([7, 75], &render, &metadata, &mut || None).is_err());
        }
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
