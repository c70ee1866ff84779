//! From files of frames to a film: read in their order, each as soon as it is there.

use std::path::{Path, PathBuf};

use super::options::FilmOptionArguments;
use crate::base::diagnostics::ranges;
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::digest::{Digest, Hasher};
use crate::base::rate::Rate;
use crate::base::{files, limits};
use crate::output::film::{
    FilmFrame, FilmOptions, FilmSpec, FilmWriter, GifPalette, PaletteChoice, PaletteFinder, VideoCodec, left_out,
};
use crate::output::{FilmFormat, Metadata};

/// A frame on disk.
pub struct FrameFile {
    pub number: u32,
    pub file: PathBuf,
    /// Digest of what decides its pixels, if it is known before the file is there.
    pub hash: Option<String>,
}

/// A film that is to be made.
pub struct Job {
    pub film: PathBuf,
    pub rate: Rate,
    pub frames: Vec<FrameFile>,
    format: FilmFormat,
    options: FilmOptions,
    plays: u32,
}

/// A film that was made.
pub struct Made {
    pub frames: u64,
    pub size: [u32; 2],
    pub warnings: Diagnostics,
}

impl Job {
    /// # Errors
    /// No frames, or options that do not concern the format.
    pub fn new(
        film: PathBuf,
        format: FilmFormat,
        options: &FilmOptionArguments,
        rate: Rate,
        frames: Vec<FrameFile>,
    ) -> Result<Job, Diagnostics> {
        let (options, plays) = options.resolve(format)?;
        Ok(Job { film, rate, frames, format, options, plays })
    }

    /// What ffmpeg has to be able to do, as far as that is known before the first frame.
    pub fn codec(&self) -> Option<VideoCodec> {
        self.options.codec.or(self.format.codec(false))
    }

    /// What is known once the first frame is there.
    fn spec(&self, kind: &FrameKind) -> FilmSpec {
        let holds_alpha = match self.options.codec.or(self.format.codec(kind.alpha)) {
            Some(codec) => codec.holds_alpha() && self.options.planes.is_none(),
            None => self.format != FilmFormat::Y4m,
        };
        FilmSpec {
            size: kind.size,
            rate: self.rate,
            frames: self.frames.len() as u64,
            alpha: kind.alpha && holds_alpha,
            deep: kind.deep,
            plays: self.plays,
            metadata: self.metadata(kind),
        }
    }

    /// What the film says of its making: the same whether its frames were rendered now or before.
    fn metadata(&self, kind: &FrameKind) -> Metadata {
        let mut hasher = Hasher::default();
        kind.hashes.iter().for_each(|hash| hasher.text(hash));
        let numbers: Vec<u32> = self.frames.iter().map(|frame| frame.number).collect();
        let mut metadata: Metadata = Vec::new();
        let mut add = |keyword: &str, text: String| metadata.push((keyword.to_string(), text));
        add("Software", concat!("anim ", env!("CARGO_PKG_VERSION")).into());
        add("Hash", hasher.finish().to_string());
        let known =
            |keyword: &str| kind.metadata.iter().find(|(known, _)| known == keyword).map(|(_, text)| text.clone());
        if let Some(source) = known("Source") {
            add("Source", source);
        }
        add("Frames", ranges(&numbers));
        add("Rate", self.rate.to_string());
        add("Encoding", self.encoding(kind));
        if let Some(settings) = known("Settings") {
            add("Settings", settings);
        }
        metadata
    }

    fn encoding(&self, kind: &FrameKind) -> String {
        let ending = self.format.ending();
        let FilmOptions { palette, dither, planes, crf, codec } = &self.options;
        let crf = crf.map_or(String::new(), |crf| format!(" crf={crf}"));
        match codec.or(self.format.codec(kind.alpha)) {
            Some(codec) => {
                let planes = planes.unwrap_or_else(|| codec.planes(kind.alpha));
                format!("{ending} codec={} pixels={}{crf}", codec.name(), planes.name())
            }
            None if self.format == FilmFormat::Gif => {
                let palette = match palette {
                    PaletteChoice::Auto => "auto",
                    PaletteChoice::Shared => "shared",
                    PaletteChoice::PerFrame => "frame",
                };
                format!("{ending} palette={palette} dither={dither} plays={}", self.plays)
            }
            None => format!("{ending} plays={}", self.plays),
        }
    }
}

/// What the frames of a film have in common.
struct FrameKind {
    size: [u32; 2],
    /// Some let something through.
    alpha: bool,
    deep: bool,
    /// Of the first frame.
    metadata: Metadata,
    /// Of all frames.
    hashes: Vec<String>,
}

/// Writes a film; `ready` waits for the frame at an index and says whether it is there. `None` if one will never be.
///
/// # Errors
/// Frames that cannot be read or are not of one size; a film that cannot be written.
pub fn encode(job: &Job, ready: &mut dyn FnMut(usize) -> bool) -> Result<Option<Made>, Diagnostics> {
    let palette = match palette(job, ready)? {
        Some(palette) => palette,
        None => return Ok(None),
    };
    if job.frames.is_empty() || !ready(0) {
        return Ok(None);
    }
    let kind = kind_of(job)?;
    let spec = job.spec(&kind);
    let mut writer = FilmWriter::create(&job.film, &spec, &job.options, palette)?;
    let mut warnings = warnings(job, &spec, &kind);
    let mut seam = Seam::default();
    let joins = spec.plays != 1 && job.format.says_plays();
    for index in 0..job.frames.len() {
        if !ready(index) {
            return Ok(None);
        }
        let frame = read(&job.frames[index].file)?;
        check_size(job, index, &frame, kind.size)?;
        let next = if joins { seam.hold(frame) } else { Some(frame) };
        if let Some(frame) = next {
            writer.add(&frame)?;
        }
    }
    if let Some(last) = seam.last() {
        writer.add(&last)?;
    } else if joins {
        let message =
            "the last frame shows the first one again: it is left out, so that the film goes on without a halt";
        warnings.push(Diagnostic::warning(message).help("--plays 1 keeps it"));
    }
    if writer.lost_alpha() {
        let message = format!("a .{} film has no alpha: what lets something through shows black", job.format.ending());
        warnings.push(Diagnostic::warning(message).help(".apng, .gif, .webp, .webm and .mov have some"));
    }
    let frames = writer.finish()?;
    Ok(Some(Made { frames, size: spec.size, warnings }))
}

/// The palette of a GIF, after a look at all frames where it is shared.
fn palette(job: &Job, ready: &mut dyn FnMut(usize) -> bool) -> Result<Option<GifPalette>, Diagnostics> {
    if job.format != FilmFormat::Gif || !PaletteFinder::looks(job.options.palette) {
        return Ok(Some(GifPalette::PerFrame));
    }
    let mut finder = PaletteFinder::new(job.options.palette, job.frames.len() as u64);
    for (index, frame) in job.frames.iter().enumerate() {
        if !ready(index) {
            return Ok(None);
        }
        finder.add(&read(&frame.file)?);
    }
    Ok(Some(finder.choose()))
}

fn bytes_of(file: &Path) -> Result<Vec<u8>, Diagnostic> {
    files::read_bytes(file, limits::FRAME_FILE_BYTES).map_err(|problem| problem.because(Cause::Io))
}

fn unreadable(file: &Path, why: &str) -> Diagnostic {
    Diagnostic::error(format!("cannot read {}: {why}", file.display()))
}

fn read(file: &Path) -> Result<FilmFrame, Diagnostic> {
    let bytes = bytes_of(file)?;
    FilmFrame::read(&bytes).map(|(frame, _)| frame).map_err(|why| unreadable(file, &why))
}

/// Frames that are being rendered are all like the first; of others, each is asked.
fn kind_of(job: &Job) -> Result<FrameKind, Diagnostics> {
    let mut kind: Option<FrameKind> = None;
    for (index, frame) in job.frames.iter().enumerate() {
        if let (Some(kind), Some(hash)) = (&mut kind, &frame.hash) {
            kind.hashes.push(hash.clone());
            continue;
        }
        let bytes = bytes_of(&frame.file)?;
        let head = FilmFrame::head(&bytes).map_err(|why| unreadable(&frame.file, &why))?;
        let said = || head.metadata.iter().find(|(keyword, _)| keyword == "Hash").map(|(_, text)| text.clone());
        let hash = frame.hash.clone().or_else(said).unwrap_or_else(|| Digest::of(&bytes).to_string());
        let known = kind.get_or_insert_with(|| FrameKind {
            size: head.size,
            alpha: false,
            deep: false,
            metadata: head.metadata.clone(),
            hashes: Vec::new(),
        });
        known.alpha |= head.alpha;
        known.deep |= head.deep;
        known.hashes.push(hash);
        if head.size != known.size {
            return Err(another_size(job, index, head.size, known.size).into());
        }
    }
    kind.ok_or_else(|| Diagnostic::error("there are no frames").into())
}

fn check_size(job: &Job, index: usize, frame: &FilmFrame, size: [u32; 2]) -> Result<(), Diagnostic> {
    let found = [frame.width, frame.height];
    if found == size { Ok(()) } else { Err(another_size(job, index, found, size)) }
}

fn another_size(job: &Job, index: usize, [width, height]: [u32; 2], [w, h]: [u32; 2]) -> Diagnostic {
    let [first, other] = [&job.frames[0], &job.frames[index]].map(|frame| frame.file.display());
    Diagnostic::error(format!("{other} has {width}x{height} pixels and {first} {w}x{h}: a film has one size"))
}

/// What a user might not expect of the film.
fn warnings(job: &Job, spec: &FilmSpec, kind: &FrameKind) -> Diagnostics {
    let mut warnings = Diagnostics::default();
    let left = left_out(job.format, spec);
    if left > 0 {
        let all = spec.frames;
        let message = format!("browsers show at most 50 frames of a GIF in a second: {left} of {all} are left out");
        warnings.push(Diagnostic::warning(message).help(".webp and .apng keep them all"));
    }
    let shortest = job.format.shortest_delay();
    if shortest.is_some_and(|shortest| spec.rate.per_second() * f64::from(shortest) > 1000.0) {
        let message = format!("browsers slow {} frames a second down to 10", spec.rate);
        warnings.push(
            Diagnostic::warning(message).help("they keep to at most 90 frames a second; video has no such limit"),
        );
    }
    if let Some(codec) = job.options.codec.or(job.format.codec(spec.alpha)) {
        let planes = job.options.planes.unwrap_or_else(|| codec.planes(spec.alpha));
        let [width, height] = planes.padded(kind.size);
        if [width, height] != kind.size {
            let [w, h] = kind.size;
            let message =
                format!("{} needs even sides: {w}x{h} becomes {width}x{height}, its last ones twice", planes.name());
            warnings
                .push(Diagnostic::warning(message).help("--pixel-format yuv444p has odd ones, where it can be played"));
        }
    }
    warnings
}

/// Whether the end of a film is its beginning again. A film that plays again and again would stand still there for a
/// frame. It is not so where a film rests at its beginning or its end, which is meant.
#[derive(Default)]
struct Seam {
    first: Option<FilmFrame>,
    /// The second frame is not the first one.
    leaves: bool,
    /// The last frame is not the one before it.
    arrives: bool,
    count: usize,
    held: Option<FilmFrame>,
}

impl Seam {
    /// Takes a frame and gives the one before it.
    fn hold(&mut self, frame: FilmFrame) -> Option<FilmFrame> {
        self.arrives = self.held.as_ref().is_some_and(|held| *held != frame);
        if self.count == 1 {
            self.leaves = self.arrives;
        }
        if self.count == 0 {
            self.first = Some(frame.clone());
        }
        self.count += 1;
        self.held.replace(frame)
    }

    /// The last frame, unless it is the first one again.
    fn last(self) -> Option<FilmFrame> {
        let doubled = self.leaves && self.arrives && self.count > 2 && self.first == self.held;
        self.held.filter(|_| !doubled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::film::FramePixels;

    /// How many of frames that show these numbers are kept.
    fn kept(numbers: &[u8]) -> usize {
        let mut seam = Seam::default();
        let frame = |n: u8| FilmFrame { width: 1, height: 1, pixels: FramePixels::Bytes(vec![[n, 0, 0, 255]]) };
        let given = numbers.iter().filter_map(|n| seam.hold(frame(*n))).count();
        given + usize::from(seam.last().is_some())
    }

    #[test]
    fn only_an_end_that_is_the_beginning_again_is_left_out() {
        assert_eq!(kept(&[1, 2, 3, 4]), 4);
        assert_eq!(kept(&[1, 2, 3, 1]), 3);
        assert_eq!(kept(&[1, 1, 3, 1]), 4);
        assert_eq!(kept(&[1, 2, 1, 1]), 4);
        assert_eq!(kept(&[1, 1, 1]), 3);
        assert_eq!(kept(&[1, 2, 1]), 2);
        assert_eq!((kept(&[1, 1]), kept(&[1]), kept(&[])), (2, 1, 0));
    }
}
