//! Animated WebP, lossless.
//!
//! (RFC 9649: a RIFF file of chunks; `VP8X` says what is in it, `ANIM` how often it plays, each `ANMF` is a frame at an
//! even place, `XMP ` is text.) A frame holds the rectangle outside of which nothing changed.

use std::io::{Error, Result, Seek, SeekFrom, Write};

use image_webp::{ColorType, WebPEncoder};

use super::frame::{FilmFrame, FrameRect, changed_part, part_of};
use super::spec::{FilmEncoder, FilmSpec};
use super::xmp;

/// Delays are in thousandths of a second.
const PARTS: u32 = 1000;
/// Largest number that 24 bits hold.
const MOST: u64 = (1 << 24) - 1;
/// Offset of the file's length.
const LENGTH_AT: u64 = 4;

pub struct WebpEncoder<W> {
    out: W,
    spec: FilmSpec,
    written: u64,
    before: Option<Vec<[u8; 4]>>,
}

impl<W: Write + Seek> WebpEncoder<W> {
    pub fn new(mut out: W, spec: &FilmSpec) -> Result<Self> {
        let mut start = b"RIFF\0\0\0\0WEBP".to_vec();
        let [width, height] = spec.size.map(|side| u64::from(side) - 1);
        // Animation and XMP, and alpha where there is some.
        let flags = 0b0000_0110 | if spec.alpha { 0b0001_0000 } else { 0 };
        let head = [&[flags, 0, 0, 0][..], &three(width), &three(height)].concat();
        chunk(&mut start, *b"VP8X", &head);
        // Before a transparent background.
        let plays = u16::try_from(spec.plays).unwrap_or(u16::MAX).to_le_bytes();
        chunk(&mut start, *b"ANIM", &[0, 0, 0, 0, plays[0], plays[1]]);
        out.write_all(&start)?;
        Ok(WebpEncoder { out, spec: spec.clone(), written: 0, before: None })
    }
}

impl<W: Write + Seek + Send> FilmEncoder for WebpEncoder<W> {
    fn add(&mut self, frame: &FilmFrame) -> Result<()> {
        let pixels = frame.bytes().into_owned();
        let nothing = FrameRect { x: 0, y: 0, width: 1, height: 1 };
        let rect = match &self.before {
            None => frame.rect(),
            Some(before) => changed_part(before, &pixels, frame.width).map_or(nothing, at_even_place),
        };
        let delay = self.spec.rate.delay(self.written, PARTS);
        if delay > MOST {
            return Err(Error::other("a frame of a WebP cannot stay for so long"));
        }
        let place = [rect.x / 2, rect.y / 2, rect.width - 1, rect.height - 1].map(|n| three(n.into()));
        // It takes the place of what was there, without blending.
        let mut data = [place.as_flattened(), &three(delay), &[0b10]].concat();
        data.extend(compressed(&pixels, frame.width, rect, self.spec.alpha)?);
        let mut bytes = Vec::new();
        chunk(&mut bytes, *b"ANMF", &data);
        self.out.write_all(&bytes)?;
        self.written += 1;
        self.before = Some(pixels);
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let mut end = Vec::new();
        chunk(&mut end, *b"XMP ", xmp::packet(&self.spec.metadata).as_bytes());
        self.out.write_all(&end)?;
        let length = self.out.stream_position()? - LENGTH_AT - 4;
        let Ok(length) = u32::try_from(length) else {
            return Err(Error::other("a WebP file cannot be larger than 4 GiB"));
        };
        self.out.seek(SeekFrom::Start(LENGTH_AT))?;
        self.out.write_all(&length.to_le_bytes())?;
        self.out.flush()
    }
}

/// The low 24 bits of a number, the lowest first.
fn three(number: u64) -> [u8; 3] {
    let [a, b, c, ..] = number.to_le_bytes();
    [a, b, c]
}

/// A chunk, filled up to an even length.
fn chunk(out: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    out.extend(kind);
    out.extend((data.len() as u32).to_le_bytes());
    out.extend(data);
    if data.len() % 2 == 1 {
        out.push(0);
    }
}

/// The same part, from even numbers on.
fn at_even_place(rect: FrameRect) -> FrameRect {
    let (left, above) = (rect.x % 2, rect.y % 2);
    FrameRect { x: rect.x - left, y: rect.y - above, width: rect.width + left, height: rect.height + above }
}

/// The `VP8L` chunk of a part of a frame.
fn compressed(pixels: &[[u8; 4]], width: u32, rect: FrameRect, alpha: bool) -> Result<Vec<u8>> {
    let channels = if alpha { 4 } else { 3 };
    let samples: Vec<u8> = part_of(pixels, width, rect).flat_map(|p| p[..channels].iter().copied()).collect();
    let color = if alpha { ColorType::Rgba8 } else { ColorType::Rgb8 };
    let mut file = Vec::new();
    WebPEncoder::new(&mut file).encode(&samples, rect.width, rect.height, color).map_err(Error::other)?;
    // Behind `RIFF`, the length and `WEBP`.
    Ok(file.split_off(12))
}
