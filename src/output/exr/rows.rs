//! An EXR file from rows that come in bands: blocks of sixteen lines, each compressed by itself.

use std::borrow::Cow;
use std::io::Cursor;

use ::exr::block::writer::ChunksWriter;
use ::exr::block::{self, BlockIndex, UncompressedBlock};
use ::exr::error::Error;
use ::exr::image::write::layers::{LayersWriter, WritableLayers};
use ::exr::math::Vec2;
use ::exr::meta::header::{Header, ImageAttributes};
use ::exr::meta::{Headers, compute_chunk_count};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, IntegerBounds, Layer, LayerAttributes,
    LineOrder, Text,
};
use rayon::prelude::*;

use super::channels::{ChannelDigests, channels_of};
use super::header::{self, text_of};
use crate::base::digest::Digest;
use crate::components::Render;
use crate::film::{Film, PixelBounds};
use crate::output::metadata::{Metadata, with_pixels};

/// Lines of a block under ZIP16.
const LINES: u32 = 16;

const ENCODING: Encoding =
    Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };

/// The bytes of a file of this size; `next` gives its rows from the top.
///
/// # Errors
/// What the format cannot hold, and rows that are missing.
pub fn encode_bands<'f>(
    size: [u32; 2],
    render: &Render,
    metadata: &Metadata,
    next: &mut dyn FnMut() -> Option<Cow<'f, Film>>,
) -> Result<Vec<u8>, String> {
    // The digest of the pixels stands before them, and is known behind them: its place is held by zeros.
    let metadata = with_pixels(metadata, Digest::default);
    let mut rows = RowBuffer { pending: None, next, left: size[1] };
    let mut digests = ChannelDigests::default();
    let first = rows.take().ok_or("rows are missing")?;
    let header = header_of(size, &layer(&first, render), render, &metadata);
    let mut bytes = Vec::new();
    let written = block::write(Cursor::new(&mut bytes), Headers::from_vec(vec![header]), true, |meta, chunks| {
        let (mut film, mut top) = (first, 0);
        loop {
            let layer = layer(&film, render);
            digests.add(&layer.channel_data.list);
            let own = layer.infer_headers(&ImageAttributes::new(IntegerBounds::from_dimensions(layer.size)));
            let writer = layer.create_writer(&own);
            let compressed = |block: u32| {
                let lines = LINES.min(film.height - block * LINES);
                let inside = BlockIndex {
                    layer: 0,
                    pixel_position: vec2([0, block * LINES]),
                    pixel_size: vec2([film.width, lines]),
                    level: Vec2(0, 0),
                };
                let data = writer.extract_uncompressed_block(&own, inside);
                let index = BlockIndex { pixel_position: vec2([0, top + block * LINES]), ..inside };
                UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)
            };
            let blocks = 0..film.height.div_ceil(LINES);
            let compressed: Vec<_> = blocks.into_par_iter().map(compressed).collect::<Result<_, Error>>()?;
            for (number, chunk) in ((top / LINES) as usize..).zip(compressed) {
                chunks.write_chunk(number, chunk)?;
            }
            top += film.height;
            if top == size[1] {
                return Ok(());
            }
            film = rows.take().ok_or(Error::Invalid("rows are missing".into()))?;
        }
    });
    written.map_err(|e| e.to_string())?;
    header::set_pixels(&mut bytes, &metadata, digests.finish(size));
    Ok(bytes)
}

fn vec2([x, y]: [u32; 2]) -> Vec2<usize> {
    Vec2(x as usize, y as usize)
}

fn layer(film: &Film, render: &Render) -> Layer<AnyChannels<FlatSamples>> {
    let channels: Vec<AnyChannel<FlatSamples>> = channels_of(film, render);
    let size = vec2([film.width, film.height]);
    Layer::new(size, LayerAttributes::default(), ENCODING, AnyChannels::sort(channels.into()))
}

/// The header of the whole, with the channels of a layer of its rows.
fn header_of(size: [u32; 2], rows: &Layer<AnyChannels<FlatSamples>>, render: &Render, metadata: &Metadata) -> Header {
    let [origin, _] = render.pixel_bounds();
    // What is meant to be shown is the whole frame, should there be pixels for a region of it alone.
    let shown = if render.region.is_some() { render.size } else { size };
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(vec2(shown)));
    // One attribute for all metadata: the crate writes several in an order that changes from run to run.
    let comments = Some(Text::from_slice_unchecked(text_of(metadata).as_bytes()));
    let layer_position = if render.region.is_some() { Vec2(origin[0] as i32, origin[1] as i32) } else { Vec2(0, 0) };
    let header = rows.infer_headers(&attributes).remove(0);
    Header {
        layer_size: vec2(size),
        chunk_count: compute_chunk_count(ENCODING.compression, vec2(size), header.blocks),
        own_attributes: LayerAttributes { comments, layer_position, ..LayerAttributes::default() },
        ..header
    }
}

/// Rows that are given in bands of any height, and taken in whole blocks.
struct RowBuffer<'r, 'f> {
    pending: Option<Film>,
    next: &'r mut dyn FnMut() -> Option<Cow<'f, Film>>,
    /// Rows that were not taken yet.
    left: u32,
}

impl<'f> RowBuffer<'_, 'f> {
    /// The next rows: whole blocks, but for the last of the picture.
    fn take(&mut self) -> Option<Cow<'f, Film>> {
        loop {
            let held = self.pending.as_ref().map_or(0, |film| film.height);
            if held >= LINES || (held > 0 && held == self.left) {
                break;
            }
            let rows = (self.next)()?;
            if self.pending.is_none() && rows.height == self.left {
                // All at once: nothing has to be copied.
                self.left = 0;
                return Some(rows);
            }
            match &mut self.pending {
                Some(film) => film.append(rows.into_owned()),
                None => self.pending = Some(rows.into_owned()),
            }
        }
        let film = self.pending.take()?;
        let whole = if film.height == self.left { film.height } else { film.height / LINES * LINES };
        self.left -= whole;
        if whole == film.height {
            return Some(Cow::Owned(film));
        }
        let bounds = PixelBounds::whole([film.width, film.height]);
        let part = |first: u32, end: u32| PixelBounds { origin: [0, first], size: [film.width, end - first] };
        self.pending = Some(film.cropped(bounds, part(whole, film.height)));
        Some(Cow::Owned(film.cropped(bounds, part(0, whole))))
    }
}
