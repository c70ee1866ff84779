//! Parts of a frame, each an OpenEXR file that says where in the frame it lies, joined to the file of the whole frame:
//! to the byte what rendering it at once would have written.

use ::exr::image::FlatSamples;
use ::exr::math::Vec2;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder, Text,
    WritableImage, f16,
};

use super::channels::ChannelDigests;
use super::header::text_of;
use super::{FlatImage, read_header, read_image};
use crate::base::limits;
use crate::output::metadata::{HASH, Metadata, PIXELS, WHOLE, text_under, with_pixels};
use crate::output::parts::PixelWindow;

/// A part that was read.
struct TilePart {
    name: String,
    window: PixelWindow,
    display: PixelWindow,
    image: FlatImage,
    metadata: Metadata,
}

/// A frame that was joined.
#[derive(Clone, Debug, PartialEq)]
pub struct MergedPicture {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// Width and height of the whole frame in pixels.
    pub size: [u32; 2],
    /// Whether its parts say which frame they are parts of, so that the file is known as that frame.
    pub is_known: bool,
}

fn read(name: &str, bytes: &[u8]) -> Result<TilePart, String> {
    let wrong = |why: String| format!("{name}: {why}");
    let metadata = read_header(bytes).map_err(wrong)?.metadata;
    let (size, image) = read_image(bytes).map_err(wrong)?;
    let Vec2(x, y) = image.layer_data.attributes.layer_position;
    let display = image.attributes.display_window;
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let display = PixelWindow {
        origin: [display.position.0, display.position.1],
        size: [side(display.size.0), side(display.size.1)],
    };
    let window = PixelWindow { origin: [x, y], size };
    if display.origin != [0, 0] || window.common(display) != Some(window) {
        return Err(wrong(format!("it lies at {window}, outside of its frame of {display}")));
    }
    Ok(TilePart { name: name.to_string(), window, display, image, metadata })
}

/// What all parts of a frame say alike: all but what is of the part itself.
fn common(metadata: &Metadata) -> Metadata {
    let is_own = |keyword: &str| [HASH, PIXELS].contains(&keyword);
    let entry = |(keyword, text): &(String, String)| (keyword.clone(), without_region(text));
    metadata.iter().filter(|(keyword, _)| !is_own(keyword)).map(entry).collect()
}

/// Settings of the whole: the region is that of the part.
fn without_region(settings: &str) -> String {
    let words = settings.split(' ').filter(|word| !word.starts_with("region=["));
    words.collect::<Vec<_>>().join(" ")
}

/// The metadata of the whole, as rendering it at once would write them.
fn whole_metadata(first: &Metadata) -> Metadata {
    let whole = text_under(first, WHOLE).map(str::to_string);
    let kept = first.iter().filter(|(keyword, _)| ![WHOLE, PIXELS].contains(&keyword.as_str()));
    let entry = |(keyword, text): &(String, String)| match (keyword.as_str(), &whole) {
        (HASH, Some(whole)) => Some((keyword.clone(), whole.clone())),
        // The digest of a part would take the whole for the part.
        (HASH, None) => None,
        _ => Some((keyword.clone(), without_region(text))),
    };
    kept.filter_map(entry).collect()
}

/// Joins the parts of a frame, given by name and content, in any order.
///
/// # Errors
/// Which part cannot be read, is of another frame, lies over another one, or is missing.
pub fn merge_exr(files: &[(String, Vec<u8>)]) -> Result<MergedPicture, String> {
    let parts: Vec<TilePart> = files.iter().map(|(name, bytes)| read(name, bytes)).collect::<Result<_, _>>()?;
    let first = parts.first().ok_or("there is nothing to merge")?;
    let [width, height] = first.display.size;
    if u64::from(width) * u64::from(height) > limits::FRAME_PIXELS {
        return Err(format!("{}: it says that its frame has {} pixels", first.name, first.display));
    }
    for part in &parts {
        check_alike(first, part)?;
    }
    let owners = owners(&parts)?;
    let list = &first.image.layer_data.channel_data.list;
    let channels = (0..list.len()).map(|channel| AnyChannel {
        sample_data: joined(&parts, channel, &owners, width as usize),
        ..list[channel].clone()
    });
    let channels: Vec<AnyChannel<FlatSamples>> = channels.collect();
    let metadata = whole_metadata(&first.metadata);
    let mut digests = ChannelDigests::default();
    digests.add(&channels);
    let metadata = with_pixels(&metadata, || digests.finish([width, height]));
    let is_known = text_under(&metadata, HASH).is_some();
    let bytes = file_of([width, height], channels, &metadata)?;
    Ok(MergedPicture { bytes, size: [width, height], is_known })
}

/// The bytes of a file: to the byte what a frame of these channels is written as.
fn file_of(
    [width, height]: [u32; 2],
    channels: Vec<AnyChannel<FlatSamples>>,
    metadata: &Metadata,
) -> Result<Vec<u8>, String> {
    let comments = Some(Text::from_slice_unchecked(text_of(metadata).as_bytes()));
    let attributes = LayerAttributes { comments, ..LayerAttributes::default() };
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = Vec2(width as usize, height as usize);
    let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels.into()));
    let mut bytes = Vec::new();
    // On one thread: blocks lie in the file in the order of their lines.
    let written = Image::from_layer(layer).write().non_parallel().to_buffered(std::io::Cursor::new(&mut bytes));
    written.map(|()| bytes).map_err(|e| e.to_string())
}

fn check_alike(first: &TilePart, part: &TilePart) -> Result<(), String> {
    let differ = |what: &str| Err(format!("{} and {} are parts of different frames: {what}", first.name, part.name));
    if part.display != first.display {
        return differ(&format!("one of {}, one of {} pixels", first.display, part.display));
    }
    let kinds = |part: &TilePart| -> Vec<(String, std::mem::Discriminant<FlatSamples>)> {
        let list = &part.image.layer_data.channel_data.list;
        list.iter().map(|c| (c.name.to_string(), std::mem::discriminant(&c.sample_data))).collect()
    };
    if kinds(part) != kinds(first) {
        return differ("they have other channels");
    }
    let (ours, theirs) = (common(&first.metadata), common(&part.metadata));
    match ours.iter().zip(&theirs).find(|(a, b)| a != b) {
        Some((a, b)) => differ(&format!("{} is {} in one and {} in the other", a.0, a.1, b.1)),
        None if ours.len() != theirs.len() => differ("they say different things of their making"),
        None => Ok(()),
    }
}

/// Which part every pixel is of.
fn owners(parts: &[TilePart]) -> Result<Vec<u32>, String> {
    let frame = parts[0].display;
    let mut owners = vec![u32::MAX; frame.pixels()];
    for (number, part) in parts.iter().enumerate() {
        let [x, y] = part.window.origin.map(|at| at as usize);
        let [width, height] = part.window.size.map(|side| side as usize);
        for row in y..y + height {
            let start = row * frame.size[0] as usize + x;
            for owner in &mut owners[start..start + width] {
                if *owner != u32::MAX {
                    return Err(format!("{} and {} lie over each other", parts[*owner as usize].name, part.name));
                }
                *owner = number as u32;
            }
        }
    }
    match owners.iter().position(|owner| *owner == u32::MAX) {
        None => Ok(owners),
        Some(at) => {
            let (x, y) = (at % frame.size[0] as usize, at / frame.size[0] as usize);
            let missing = owners.iter().filter(|owner| **owner == u32::MAX).count();
            Err(format!("a part is missing: {missing} of {} pixels, from ({x}, {y}) on", frame.pixels()))
        }
    }
}

/// The values of a channel of the whole frame. Parts have the same kinds of channels; that was checked.
fn joined(parts: &[TilePart], channel: usize, owners: &[u32], width: usize) -> FlatSamples {
    let samples = |part: usize| &parts[part].image.layer_data.channel_data.list[channel].sample_data;
    let mut whole = match samples(0) {
        FlatSamples::F16(_) => FlatSamples::F16(vec![f16::ZERO; owners.len()]),
        FlatSamples::F32(_) => FlatSamples::F32(vec![0.0; owners.len()]),
        FlatSamples::U32(_) => FlatSamples::U32(vec![0; owners.len()]),
    };
    for (at, owner) in owners.iter().enumerate() {
        let PixelWindow { origin: [x, y], size } = parts[*owner as usize].window;
        let from = (at / width - y as usize) * size[0] as usize + at % width - x as usize;
        match (&mut whole, samples(*owner as usize)) {
            (FlatSamples::F16(whole), FlatSamples::F16(part)) => whole[at] = part[from],
            (FlatSamples::F32(whole), FlatSamples::F32(part)) => whole[at] = part[from],
            (FlatSamples::U32(whole), FlatSamples::U32(part)) => whole[at] = part[from],
            (FlatSamples::F16(_) | FlatSamples::F32(_) | FlatSamples::U32(_), _) => {}
        }
    }
    whole
}
