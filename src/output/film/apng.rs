//! APNG: a PNG file with further frames; the first is what a viewer of plain PNG shows.
//!
//! (PNG specification, third edition, chapters 5 and 11.3.5: `acTL` counts, `fcTL` places a frame and says how long it
//! stays, `fdAT` is an `IDAT` with a number before it.) A frame holds the rectangle outside of which nothing changed.

use std::io::{Error, Result, Seek, SeekFrom, Write};

use ::png::{BitDepth, ColorType, Compression, Encoder};

use super::super::png::chunks::{self, write_chunk as chunk, write_itxt};
use super::frame::{FilmFrame, FramePixels, FrameRect, changed_part, part_of};
use super::spec::{FilmEncoder, FilmSpec};

/// Browsers cut delays down to whole thousandths of a second; so that a film keeps its time, they are given those.
const PARTS: u32 = 1000;

pub struct ApngEncoder<W> {
    out: W,
    spec: FilmSpec,
    /// Numbers of the chunks of frames, and of frames.
    sequence: u32,
    written: u32,
    before: Option<FilmFrame>,
    /// Where the number of frames is, and what it says.
    counted: u64,
}

impl<W: Write + Seek> ApngEncoder<W> {
    pub fn new(mut out: W, spec: &FilmSpec) -> Result<Self> {
        let mut start = chunks::SIGNATURE.to_vec();
        let [width, height] = spec.size;
        let depth = if spec.deep { 16 } else { 8 };
        let color = if spec.alpha { 6 } else { 2 };
        let head = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[depth, color, 0, 0, 0]].concat();
        chunk(&mut start, *b"IHDR", &head);
        // Perceptual intent, as single frames have it.
        chunk(&mut start, *b"sRGB", &[0]);
        for (keyword, text) in &spec.metadata {
            write_itxt(&mut start, keyword, text);
        }
        let counted = start.len() as u64;
        chunk(&mut start, *b"acTL", &counts(spec.frames as u32, spec.plays));
        out.write_all(&start)?;
        Ok(ApngEncoder { out, spec: spec.clone(), sequence: 0, written: 0, before: None, counted })
    }

    fn next_number(&mut self) -> [u8; 4] {
        self.sequence += 1;
        (self.sequence - 1).to_be_bytes()
    }

    /// How long a frame stays, as a fraction of a second.
    fn delay(&self) -> Result<[u16; 2]> {
        let rate = self.spec.rate;
        let (above, below) = (u64::from(rate.denominator()), u64::from(rate.numerator()));
        let exact = (above * u64::from(PARTS)).is_multiple_of(below);
        let delay = if exact { [above, below] } else { [rate.delay(self.written.into(), PARTS), PARTS.into()] };
        match delay.map(u16::try_from) {
            [Ok(above), Ok(below)] => Ok([above, below]),
            // Longer than a minute: whole seconds, which reach for eighteen hours.
            _ => match u16::try_from(rate.delay(self.written.into(), 1)) {
                Ok(seconds) => Ok([seconds, 1]),
                Err(_) => Err(Error::other("a frame of an APNG cannot stay for so long")),
            },
        }
    }
}

impl<W: Write + Seek + Send> FilmEncoder for ApngEncoder<W> {
    fn add(&mut self, frame: &FilmFrame) -> Result<()> {
        let frame = as_deep(frame, self.spec.deep);
        let nothing = FrameRect { x: 0, y: 0, width: 1, height: 1 };
        let rect = match &self.before {
            None => frame.rect(),
            Some(before) => changed(before, &frame).unwrap_or(nothing),
        };
        let mut bytes = Vec::new();
        let number = self.next_number();
        let [above, below] = self.delay()?;
        let place = [rect.width, rect.height, rect.x, rect.y].map(u32::to_be_bytes);
        let stay = [above, below].map(u16::to_be_bytes);
        // Neither cleared afterwards nor blended with what was there.
        let control = [&number[..], place.as_flattened(), stay.as_flattened(), &[0, 0]].concat();
        chunk(&mut bytes, *b"fcTL", &control);
        for data in compressed(&frame, rect, &self.spec)? {
            if self.written == 0 {
                chunk(&mut bytes, *b"IDAT", &data);
            } else {
                let number = self.next_number();
                chunk(&mut bytes, *b"fdAT", &[&number[..], &data].concat());
            }
        }
        self.out.write_all(&bytes)?;
        self.written += 1;
        self.before = Some(frame);
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let mut end = Vec::new();
        chunk(&mut end, *b"IEND", &[]);
        self.out.write_all(&end)?;
        if u64::from(self.written) != self.spec.frames {
            let mut counted = Vec::new();
            chunk(&mut counted, *b"acTL", &counts(self.written, self.spec.plays));
            self.out.seek(SeekFrom::Start(self.counted))?;
            self.out.write_all(&counted)?;
        }
        self.out.flush()
    }
}

fn counts(frames: u32, plays: u32) -> Vec<u8> {
    [frames.to_be_bytes(), plays.to_be_bytes()].concat()
}

fn as_deep(frame: &FilmFrame, deep: bool) -> FilmFrame {
    let pixels = if deep {
        FramePixels::Words(frame.words().into_owned())
    } else {
        FramePixels::Bytes(frame.bytes().into_owned())
    };
    FilmFrame { pixels, ..*frame }
}

fn changed(before: &FilmFrame, after: &FilmFrame) -> Option<FrameRect> {
    match (&before.pixels, &after.pixels) {
        (FramePixels::Bytes(a), FramePixels::Bytes(b)) => changed_part(a, b, after.width),
        (FramePixels::Words(a), FramePixels::Words(b)) => changed_part(a, b, after.width),
        _ => Some(after.rect()),
    }
}

/// The compressed samples of a part of a frame, as the pieces that a PNG file of it would have.
fn compressed(frame: &FilmFrame, rect: FrameRect, spec: &FilmSpec) -> Result<Vec<Vec<u8>>> {
    let channels = if spec.alpha { 4 } else { 3 };
    let samples: Vec<u8> = match &frame.pixels {
        FramePixels::Bytes(pixels) => {
            part_of(pixels, frame.width, rect).flat_map(|p| p[..channels].iter().copied()).collect()
        }
        FramePixels::Words(pixels) => {
            part_of(pixels, frame.width, rect).flat_map(|p| &p[..channels]).flat_map(|x| x.to_be_bytes()).collect()
        }
    };
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, rect.width, rect.height);
    encoder.set_color(if spec.alpha { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(if spec.deep { BitDepth::Sixteen } else { BitDepth::Eight });
    encoder.set_compression(Compression::Fast);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&samples)?;
        writer.finish()
    });
    written.map_err(Error::other)?;
    let whole = chunks::chunks(&file).ok_or_else(|| Error::other("a frame could not be compressed"))?;
    Ok(whole.iter().filter(|chunk| chunk.kind == *b"IDAT").map(|chunk| chunk.data().to_vec()).collect())
}
