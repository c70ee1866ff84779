//! What a film is to be: its format, what is known before its first frame, and what the user can choose.

use std::io::Result;
use std::path::Path;

use super::frame::FilmFrame;
use super::planes::PlaneFormat;
use crate::base::rate::Rate;
use crate::output::Metadata;
/// Metadata as lines of text, and back by [`metadata_of`].
pub use crate::output::exr::header::text_of as lines_of;

/// Kinds of films, known by the ending of their name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmFormat {
    /// PNG that moves: lossless, in browsers.
    Apng,
    /// 256 colours a frame, everywhere.
    Gif,
    /// Lossless here, in browsers.
    Webp,
    /// Raw planes, for other programs.
    Y4m,
    /// MPEG-4, by ffmpeg.
    Mp4,
    /// WebM, by ffmpeg.
    Webm,
    /// QuickTime, by ffmpeg.
    Mov,
}

impl FilmFormat {
    /// Every format.
    pub const ALL: [FilmFormat; 7] = [
        FilmFormat::Apng,
        FilmFormat::Gif,
        FilmFormat::Webp,
        FilmFormat::Y4m,
        FilmFormat::Mp4,
        FilmFormat::Webm,
        FilmFormat::Mov,
    ];

    /// The format that the ending of a name says, whatever its case.
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
    pub fn codec(self, alpha: bool) -> Option<VideoCodec> {
        match self {
            FilmFormat::Apng | FilmFormat::Gif | FilmFormat::Webp | FilmFormat::Y4m => None,
            FilmFormat::Mov if alpha => Some(VideoCodec::Prores),
            FilmFormat::Mp4 | FilmFormat::Mov => Some(VideoCodec::H264),
            FilmFormat::Webm => Some(VideoCodec::Vp9),
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

/// How pictures are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VideoCodec {
    /// AVC, by libx264.
    H264,
    /// HEVC, by libx265.
    H265,
    /// VP9, by libvpx.
    Vp9,
    /// Apple ProRes 4444 or 422 HQ, for editing.
    Prores,
}

/// What is known of a film before its first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmSpec {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Frames a second.
    pub rate: Rate,
    /// How many frames are expected; fewer may come.
    pub frames: u64,
    /// Some frames may have pixels that let something through.
    pub alpha: bool,
    /// Frames have 16 bits a channel.
    pub deep: bool,
    /// How often it is played; 0 for ever.
    pub plays: u32,
    /// What the film says of its making.
    pub metadata: Metadata,
}

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaletteChoice {
    /// Shared unless colours lose too much by it.
    Auto,
    /// One of 256 colours for all frames.
    Shared,
    /// One of 256 colours for each frame.
    PerFrame,
}

/// What the user can choose about the encoding; what does not concern a format has no effect on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmOptions {
    /// How colours of a GIF are chosen.
    pub palette: PaletteChoice,
    /// Whether colours that a GIF does not have are mixed from those beside them.
    pub dither: bool,
    /// How MP4, WebM and MOV are compressed; what suits the format where it is not given.
    pub codec: Option<VideoCodec>,
    /// Constant rate factor, 0 to 63: lower is better and larger.
    pub crf: Option<u32>,
    /// How pixels are stored in Y4M, MP4, WebM and MOV; what suits the codec where it is not given.
    pub planes: Option<PlaneFormat>,
}

impl Default for FilmOptions {
    fn default() -> Self {
        FilmOptions { palette: PaletteChoice::Auto, dither: true, codec: None, crf: None, planes: None }
    }
}

/// Takes frames of one size.
pub trait FilmEncoder: Send {
    /// # Errors
    /// What cannot be written, or what the format cannot hold.
    fn add(&mut self, frame: &FilmFrame) -> Result<()>;

    /// Writes what stands behind the last frame.
    ///
    /// # Errors
    /// As [`Self::add`].
    fn finish(self: Box<Self>) -> Result<()>;
}

/// Metadata from the lines that [`lines_of`] makes of them.
pub fn metadata_of(text: &str) -> Metadata {
    let note = |line: &str| line.split_once(": ").map(|(keyword, text)| (keyword.to_string(), text.to_string()));
    text.lines().filter_map(note).collect()
}
