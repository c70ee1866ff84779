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
mod spec;
mod webp;
mod xmp;
mod y4m;

pub use ffmpeg::available as ffmpeg_available;
pub use frame::{FilmFrame, FrameHead, FramePixels, FrameRect};
pub use gif::{GifPalette, PaletteFinder};
pub use info::{FilmInfo, read_film_info};
pub use planes::{Chroma, PlaneFormat};
pub use reel::Reel;
use spec::FilmEncoder;
pub use spec::{FilmFormat, FilmOptions, FilmSpec, PaletteChoice, VideoCodec};

use std::io::{BufWriter, Result};
use std::path::Path;

use super::AtomicFile;
use crate::base::diagnostics::{Cause, Diagnostic};

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

#[cfg(test)]
mod tests;
