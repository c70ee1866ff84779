//! Films: frames, one after another, as one file.
//!
//! APNG, GIF, WebP and YUV4MPEG2 are written here, byte for byte alike on every machine; MP4, WebM and MOV by `ffmpeg`,
//! which is given the planes of every frame. A film gets its name when it is whole.

mod apng;
mod ffmpeg;
mod frame;
mod gif;
mod info;
mod planes;
mod reel;
mod webp;
mod xmp;
mod y4m;

pub use ffmpeg::{Codec, available as ffmpeg_available};
pub use frame::{FilmFrame, FrameHead, FramePixels, FrameRect};
pub use gif::{GifPalette, PaletteChoice, PaletteFinder};
pub use info::{FilmInfo, read_film_info};
pub use planes::{Chroma, PlaneFormat};
pub use reel::Reel;

use std::io::{BufWriter, Result};
use std::path::Path;

use super::exr::header::text_of as lines_of;
use super::{AtomicFile, Metadata};
use crate::base::diagnostics::{Cause, Diagnostic};
use crate::base::rate::Rate;

/// Kinds of films, known by the ending of their name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmFormat {
    Apng,
    Gif,
    Webp,
    Y4m,
    Mp4,
    Webm,
    Mov,
}

impl FilmFormat {
    pub const ALL: [FilmFormat; 7] = [
        FilmFormat::Apng,
        FilmFormat::Gif,
        FilmFormat::Webp,
        FilmFormat::Y4m,
        FilmFormat::Mp4,
        FilmFormat::Webm,
        FilmFormat::Mov,
    ];

    pub fn of_path(path: &Path) -> Option<FilmFormat> {
        let ending = path.extension()?.to_string_lossy().to_lowercase();
        Self::ALL.into_iter().find(|format| format.ending() == ending)
    }

    /// Of a file's name, without the dot.
    pub fn ending(self) -> &'static str {
        match self {
            FilmFormat::Apng => "apng",
            FilmFormat::Gif => "gif",
            FilmFormat::Webp => "webp",
            FilmFormat::Y4m => "y4m",
            FilmFormat::Mp4 => "mp4",
            FilmFormat::Webm => "webm",
            FilmFormat::Mov => "mov",
        }
    }

    /// Whether the file itself says how often it is played.
    pub fn says_plays(self) -> bool {
        matches!(self, FilmFormat::Apng | FilmFormat::Gif | FilmFormat::Webp)
    }

    /// The codec that ffmpeg is asked for; `None` for what is written without it.
    ///
    /// MOV has a codec with alpha where there is some to keep; WebM has one that does both; MP4 has none.
    pub fn codec(self, alpha: bool) -> Option<Codec> {
        match self {
            FilmFormat::Apng | FilmFormat::Gif | FilmFormat::Webp | FilmFormat::Y4m => None,
            FilmFormat::Mov if alpha => Some(Codec::Prores),
            FilmFormat::Mp4 | FilmFormat::Mov => Some(Codec::H264),
            FilmFormat::Webm => Some(Codec::Vp9),
        }
    }

    /// Below so many thousandths of a second browsers show a frame for a tenth of one; `None` where it does not matter.
    pub fn shortest_delay(self) -> Option<u32> {
        match self {
            FilmFormat::Apng | FilmFormat::Webp => Some(11),
            // Frames of a GIF are left out instead.
            FilmFormat::Gif | FilmFormat::Y4m | FilmFormat::Mp4 | FilmFormat::Webm | FilmFormat::Mov => None,
        }
    }
}

/// What is known of a film before its first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSpec {
    pub size: [u32; 2],
    pub rate: Rate,
    /// How many frames are expected; fewer may come.
    pub frames: u64,
    /// Some frames may have pixels that let something through.
    pub alpha: bool,
    /// Frames have 16 bits a channel.
    pub deep: bool,
    /// How often it is played; 0 for ever.
    pub plays: u32,
    pub metadata: Metadata,
}

/// What the user can choose about the encoding; what does not concern a format has no effect on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmOptions {
    pub palette: PaletteChoice,
    pub dither: bool,
    pub codec: Option<Codec>,
    /// Constant rate factor, 0 to 63: lower is better and larger.
    pub crf: Option<u32>,
    pub planes: Option<PlaneFormat>,
}

impl Default for FilmOptions {
    fn default() -> Self {
        FilmOptions { palette: PaletteChoice::Auto, dither: true, codec: None, crf: None, planes: None }
    }
}

/// Takes frames of one size.
trait FilmEncoder: Send {
    /// # Errors
    /// What cannot be written, or what the format cannot hold.
    fn add(&mut self, frame: &FilmFrame) -> Result<()>;

    /// Writes what stands behind the last frame.
    ///
    /// # Errors
    /// As [`Self::add`].
    fn finish(self: Box<Self>) -> Result<()>;
}

/// A film that is being written.
pub struct FilmWriter {
    file: AtomicFile,
    encoder: Box<dyn FilmEncoder>,
    spec: FilmSpec,
    written: u64,
    lost_alpha: bool,
}

impl FilmWriter {
    /// Starts a film that will be at `path`. `palette` is that of a GIF.
    ///
    /// # Errors
    /// A file that cannot be made, an encoder that cannot be run, a name whose ending is none of a film.
    pub fn create(
        path: &Path,
        spec: &FilmSpec,
        options: &FilmOptions,
        palette: GifPalette,
    ) -> std::result::Result<FilmWriter, Diagnostic> {
        let format = FilmFormat::of_path(path).ok_or_else(|| unknown_ending(path))?;
        let file = AtomicFile::create(path)?;
        let out = BufWriter::new(file.handle()?);
        let encoder: Result<Box<dyn FilmEncoder>> = match format {
            FilmFormat::Apng => apng::ApngEncoder::new(out, spec).map(boxed),
            FilmFormat::Gif => gif::GifEncoder::new(out, spec, &palette, options.dither).map(boxed),
            FilmFormat::Webp => webp::WebpEncoder::new(out, spec).map(boxed),
            FilmFormat::Y4m => y4m::Y4mEncoder::new(out, spec, options.planes.unwrap_or(PlaneFormat::USUAL)).map(boxed),
            FilmFormat::Mp4 | FilmFormat::Webm | FilmFormat::Mov => {
                ffmpeg::FfmpegEncoder::start(file.temporary_path(), format, spec, options).map(boxed)
            }
        };
        let encoder = encoder.map_err(|error| Diagnostic::io(path.display(), "write", &error))?;
        Ok(FilmWriter { file, encoder, spec: spec.clone(), written: 0, lost_alpha: false })
    }

    /// Whether a frame let something through that the film cannot: it shows black there.
    pub fn lost_alpha(&self) -> bool {
        self.lost_alpha
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// A frame of another size than the first one; a file that cannot be written, an encoder that has died.
    pub fn add(&mut self, frame: &FilmFrame) -> std::result::Result<(), Diagnostic> {
        let [width, height] = self.spec.size;
        if [frame.width, frame.height] != self.spec.size {
            let (w, h) = (frame.width, frame.height);
            return Err(Diagnostic::error(format!("a frame of {w}x{h} pixels in a film of {width}x{height}")));
        }
        let added = if !self.spec.alpha && frame.is_transparent() {
            self.lost_alpha = true;
            self.encoder.add(&frame.before_black())
        } else {
            self.encoder.add(frame)
        };
        added.map_err(|error| self.file.failed(&error))?;
        self.written += 1;
        Ok(())
    }

    /// Finishes the film and gives it its name; says how many frames were added.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub fn finish(self) -> std::result::Result<u64, Diagnostic> {
        let FilmWriter { file, encoder, written, .. } = self;
        encoder.finish().map_err(|error| file.failed(&error))?;
        file.commit()?;
        Ok(written)
    }
}

fn boxed(encoder: impl FilmEncoder + 'static) -> Box<dyn FilmEncoder> {
    Box::new(encoder)
}

/// The error of a film's name that says of no format.
pub fn unknown_ending(path: &Path) -> Diagnostic {
    let endings: Vec<String> = FilmFormat::ALL.iter().map(|format| format!(".{}", format.ending())).collect();
    let message = format!("a film's name ends in one of {}, not `{}`", endings.join(" "), path.display());
    Diagnostic::error(message).because(Cause::Usage)
}

/// How many frames of a film its format leaves out, since nobody could show them for so short a time.
pub fn left_out(format: FilmFormat, spec: &FilmSpec) -> u64 {
    if format == FilmFormat::Gif { gif::left_out(spec) } else { 0 }
}

/// Metadata from the lines that [`lines_of`] makes of them.
fn metadata_of(text: &str) -> Metadata {
    let note = |line: &str| line.split_once(": ").map(|(keyword, text)| (keyword.to_string(), text.to_string()));
    text.lines().filter_map(note).collect()
}

#[cfg(test)]
mod tests;
