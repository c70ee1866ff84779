//! GIF: 256 colours a picture, delays in hundredths of a second, pixels that show or do not.
//!
//! Pixels that do not change from one frame to the next are left alone, so that they neither flicker nor cost anything.
//! A palette for the whole film keeps what moves from flickering; one per frame is nearer to the colours of a film whose
//! scenes differ much.

mod dither;
mod nearest;
mod palette;

use std::borrow::Cow;
use std::io::{Error, Result, Write};

use ::gif::{DisposalMethod, Encoder, EncodingError, Extension, Frame, Repeat};

use super::frame::{FilmFrame, FrameRect, changed_part, part_of};
use super::spec::{FilmEncoder, FilmSpec, PaletteChoice, lines_of};
use dither::Ditherer;
use palette::{CellMean, ColorCounter, mean_error};

/// Delays are in hundredths of a second, and browsers show shorter ones than two as ten.
const PARTS: u32 = 100;
const SHORTEST: u64 = 2;
/// Alpha from which a pixel shows.
const SHOWN_FROM: u8 = 128;
/// Colours of a palette that has a place left for pixels that do not show.
const COLORS: usize = 255;
/// A palette for the whole film is good enough if its squared error is not more than so many times that of palettes for
/// single frames ...
const BEARABLE: f64 = 2.0;
/// ... or if nobody would see it: two codes in each channel.
const INVISIBLE: f64 = 36.0;
/// Frames, spread over the film, that this is measured on.
const MEASURED: u64 = 16;

/// Which colours a film has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GifPalette {
    /// The same for all frames.
    Shared(Vec<[u8; 3]>),
    /// Others in each frame.
    PerFrame,
}

/// Looks at all frames before the film is written, for the palette that they share.
pub struct PaletteFinder {
    choice: PaletteChoice,
    frames: u64,
    seen: u64,
    all: ColorCounter,
    measured: Vec<(Vec<CellMean>, f64)>,
}

impl PaletteFinder {
    /// For a film of so many frames.
    pub fn new(choice: PaletteChoice, frames: u64) -> Self {
        PaletteFinder { choice, frames, seen: 0, all: ColorCounter::new(COLORS), measured: Vec::new() }
    }

    /// Whether frames have to be looked at.
    pub fn looks(choice: PaletteChoice) -> bool {
        choice != PaletteChoice::PerFrame
    }

    /// Counts the colours of one more frame of the film.
    pub fn add(&mut self, frame: &FilmFrame) {
        let pixels = frame.bytes();
        let colors = || shown(pixels.iter());
        self.all.add(colors());
        let is_measured = (self.seen * MEASURED) % self.frames.max(1) < MEASURED;
        if self.choice == PaletteChoice::Auto && is_measured {
            let mut own = ColorCounter::new(COLORS);
            own.add(colors());
            let means = own.means();
            let error = mean_error(&means, &own.palette());
            self.measured.push((means, error));
        }
        self.seen += 1;
    }

    /// The palette, once all frames were seen.
    pub fn choose(self) -> GifPalette {
        if self.choice == PaletteChoice::PerFrame {
            return GifPalette::PerFrame;
        }
        let palette = self.all.palette();
        let [mut shared, mut own] = [0.0; 2];
        for (means, error) in &self.measured {
            shared += mean_error(means, &palette);
            own += error;
        }
        let count = self.measured.len().max(1) as f64;
        if shared > (BEARABLE * own).max(INVISIBLE * count) {
            GifPalette::PerFrame
        } else {
            GifPalette::Shared(palette)
        }
    }
}

/// The colours of the pixels that show.
fn shown<'a>(pixels: impl Iterator<Item = &'a [u8; 4]>) -> impl Iterator<Item = [u8; 3]> {
    pixels.filter(|p| p[3] >= SHOWN_FROM).map(|[r, g, b, _]| [*r, *g, *b])
}

/// A frame that waits for the next one: how long it stays and how it goes depend on that.
struct Waiting {
    pixels: Vec<[u8; 4]>,
    /// In hundredths of a second from the start of the film.
    start: u64,
}

pub struct GifEncoder<W: Write> {
    encoder: Encoder<W>,
    spec: FilmSpec,
    shared: Option<Shared>,
    dithers: bool,
    waiting: Option<Waiting>,
    /// What the screen shows before the waiting frame; nothing before the first.
    canvas: Vec<[u8; 4]>,
    added: u64,
}

struct Shared {
    ditherer: Ditherer,
    /// The place of pixels that do not show.
    clear: u8,
}

impl<W: Write> GifEncoder<W> {
    pub fn new(out: W, spec: &FilmSpec, palette: &GifPalette, dithers: bool) -> Result<Self> {
        let [width, height] = spec.size.map(u16::try_from);
        let (Ok(width), Ok(height)) = (width, height) else {
            return Err(Error::other("a GIF cannot be wider or higher than 65535 pixels"));
        };
        let (table, shared) = match palette {
            GifPalette::PerFrame => (Vec::new(), None),
            GifPalette::Shared(colors) => {
                let shared = Shared { ditherer: Ditherer::new(colors, dithers), clear: colors.len() as u8 };
                (with_clear(colors), Some(shared))
            }
        };
        let mut encoder = Encoder::new(out, width, height, &table).map_err(plain)?;
        if spec.plays != 1 {
            // The block says how often it plays again.
            let again = u16::try_from(spec.plays.saturating_sub(1)).unwrap_or(u16::MAX);
            let repeat = if spec.plays == 0 { Repeat::Infinite } else { Repeat::Finite(again) };
            encoder.set_repeat(repeat).map_err(plain)?;
        }
        let comment = lines_of(&spec.metadata);
        let pieces: Vec<&[u8]> = comment.as_bytes().chunks(255).collect();
        encoder.write_raw_extension(Extension::Comment.into(), &pieces).map_err(plain)?;
        let canvas = vec![[0; 4]; spec.size.iter().map(|n| *n as usize).product()];
        Ok(GifEncoder { encoder, spec: spec.clone(), shared, dithers, waiting: None, canvas, added: 0 })
    }

    /// Writes the waiting frame. `end` is when the next one begins, `next` what it shows.
    fn write(&mut self, end: u64, next: Option<&[[u8; 4]]>) -> Result<()> {
        let Some(Waiting { pixels, start }) = self.waiting.take() else { return Ok(()) };
        // What shows now and does not then has to be wiped, which frames can only do as a whole.
        let wipes = next.is_some_and(|next| pixels.iter().zip(next).any(|(now, then)| now[3] > 0 && then[3] == 0));
        let [width, height] = self.spec.size;
        let whole = FrameRect { x: 0, y: 0, width, height };
        let nothing = FrameRect { width: 1, height: 1, ..whole };
        let is_first = start == 0;
        let rect =
            if wipes || is_first { whole } else { changed_part(&self.canvas, &pixels, width).unwrap_or(nothing) };
        let delay = (end - start).max(SHORTEST);
        let delay = u16::try_from(delay).map_err(|_| Error::other("a frame of a GIF cannot stay for so long"))?;
        let changed: Vec<Option<[u8; 3]>> = part_of(&self.canvas, width, rect)
            .zip(part_of(&pixels, width, rect))
            .map(|(before, now)| (now[3] > 0 && before != now).then_some([now[0], now[1], now[2]]))
            .collect();
        let mut own = None;
        let shared = match &mut self.shared {
            Some(shared) => shared,
            None => {
                let mut counter = ColorCounter::new(COLORS);
                counter.add(changed.iter().copied().flatten());
                let colors = counter.palette();
                let shared = Shared { ditherer: Ditherer::new(&colors, self.dithers), clear: colors.len() as u8 };
                &mut own.insert((with_clear(&colors), shared)).1
            }
        };
        shared.ditherer.learn(changed.iter().copied().flatten());
        let place = |(i, color): (usize, &Option<[u8; 3]>)| {
            let (x, y) = (rect.x + i as u32 % rect.width, rect.y + i as u32 / rect.width);
            color.map_or(shared.clear, |color| shared.ditherer.index(color, x, y))
        };
        let buffer: Vec<u8> = changed.iter().enumerate().map(place).collect();
        let clear = shared.clear;
        let [left, top, width, height] = [rect.x, rect.y, rect.width, rect.height].map(|n| n as u16);
        let frame = Frame {
            delay,
            dispose: if wipes { DisposalMethod::Background } else { DisposalMethod::Keep },
            transparent: buffer.contains(&clear).then_some(clear),
            left,
            top,
            width,
            height,
            palette: own.map(|(table, _)| table),
            buffer: Cow::Owned(buffer),
            ..Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(plain)?;
        self.canvas = if wipes { vec![[0; 4]; pixels.len()] } else { pixels };
        Ok(())
    }
}

impl<W: Write + Send> FilmEncoder for GifEncoder<W> {
    fn add(&mut self, frame: &FilmFrame) -> Result<()> {
        let start = self.spec.rate.start(self.added, PARTS);
        self.added += 1;
        if self.waiting.as_ref().is_some_and(|waiting| start < waiting.start + SHORTEST) {
            return Ok(());
        }
        // Half transparent pixels show or do not; what does not show has no colour.
        let cut = |[r, g, b, a]: &[u8; 4]| if *a >= SHOWN_FROM { [*r, *g, *b, u8::MAX] } else { [0; 4] };
        let pixels: Vec<[u8; 4]> = frame.bytes().iter().map(cut).collect();
        self.write(start, Some(&pixels))?;
        self.waiting = Some(Waiting { pixels, start });
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let end = self.spec.rate.start(self.added, PARTS);
        self.write(end, None)?;
        let mut out = self.encoder.into_inner().map_err(plain)?;
        out.flush()
    }
}

/// How many frames of so many are left out because they would stay for less than two hundredths of a second.
pub fn left_out(spec: &FilmSpec) -> u64 {
    let mut shown = 0;
    let mut last = None;
    for start in (0..spec.frames).map(|frame| spec.rate.start(frame, PARTS)) {
        if last.is_none_or(|last| start >= last + SHORTEST) {
            (shown, last) = (shown + 1, Some(start));
        }
    }
    spec.frames - shown
}

/// The palette as a table, with one more colour for what does not show.
fn with_clear(colors: &[[u8; 3]]) -> Vec<u8> {
    colors.iter().chain(&[[0; 3]]).flatten().copied().collect()
}

fn plain(error: EncodingError) -> Error {
    if let EncodingError::Io(error) = error { error } else { Error::other(error) }
}
