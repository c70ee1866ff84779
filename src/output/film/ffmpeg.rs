//! MP4, WebM and MOV through `ffmpeg`: it gets the planes of each frame through a pipe, so that it has nothing to convert.
//!
//! The planes are BT.709 in the narrow range ([`super::planes`]), and are said to be: ffmpeg's filter `setparams` marks
//! the frames and the options of the encoder mark the stream. With one of the two alone some versions from 4.2 to 9.0
//! leave marks out or convert what needs no conversion. A numbered sequence on disk is not used as input: at a gap ffmpeg
//! ends the film and exits with 0.

use std::io::{Error, ErrorKind, Read, Result, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

use super::frame::FilmFrame;
use super::info::read_film_info;
use super::planes::{Chroma, PlaneFormat};
use super::spec::{FilmEncoder, FilmFormat, FilmOptions, FilmSpec, VideoCodec, lines_of};
use crate::base::diagnostics::{Cause, Diagnostic};

impl VideoCodec {
    /// Every codec, in the order of [`Self::NAMES`].
    pub const ALL: [VideoCodec; 4] = [VideoCodec::H264, VideoCodec::H265, VideoCodec::Vp9, VideoCodec::Prores];
    /// Their names as options take them.
    pub const NAMES: [&str; 4] = ["h264", "h265", "vp9", "prores"];

    /// The codec of a name, whatever its case.
    pub fn parse(name: &str) -> Option<VideoCodec> {
        Self::NAMES.iter().position(|known| known.eq_ignore_ascii_case(name)).map(|i| Self::ALL[i])
    }

    /// Its name as options take it.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// What ffmpeg calls its encoder.
    fn encoder(self) -> &'static str {
        match self {
            VideoCodec::H264 => "libx264",
            VideoCodec::H265 => "libx265",
            VideoCodec::Vp9 => "libvpx-vp9",
            VideoCodec::Prores => "prores_ks",
        }
    }

    /// Whether films of a format may be compressed so.
    pub fn suits(self, format: FilmFormat) -> bool {
        match format {
            FilmFormat::Mp4 => matches!(self, VideoCodec::H264 | VideoCodec::H265),
            FilmFormat::Mov => self != VideoCodec::Vp9,
            FilmFormat::Webm => self == VideoCodec::Vp9,
            FilmFormat::Apng | FilmFormat::Gif | FilmFormat::Webp | FilmFormat::Y4m => false,
        }
    }

    /// Whether it can keep transparency.
    pub fn holds_alpha(self) -> bool {
        matches!(self, VideoCodec::Vp9 | VideoCodec::Prores)
    }

    /// The planes unless the user asks for others.
    pub fn planes(self, alpha: bool) -> PlaneFormat {
        match self {
            VideoCodec::Prores if alpha => PlaneFormat { chroma: Chroma::Full, bits: 10, alpha },
            VideoCodec::Prores => PlaneFormat { chroma: Chroma::Half, bits: 10, alpha },
            VideoCodec::H264 | VideoCodec::H265 | VideoCodec::Vp9 => {
                PlaneFormat { alpha: alpha && self.holds_alpha(), ..PlaneFormat::USUAL }
            }
        }
    }

    /// Whether the planes can be compressed so.
    pub fn takes(self, planes: PlaneFormat) -> bool {
        match self {
            VideoCodec::H264 | VideoCodec::H265 => !planes.alpha,
            VideoCodec::Vp9 => !planes.alpha || planes == PlaneFormat { alpha: true, ..PlaneFormat::USUAL },
            VideoCodec::Prores => planes.bits == 10 && planes.chroma != Chroma::Quarter,
        }
    }

    fn options(self, crf: Option<u32>, planes: PlaneFormat) -> Vec<String> {
        let crf = |usual: u32| crf.unwrap_or(usual).to_string();
        let text = match self {
            VideoCodec::H264 => format!("-preset medium -crf {}", crf(18)),
            VideoCodec::H265 => format!("-preset medium -crf {} -tag:v hvc1 -x265-params log-level=error", crf(20)),
            VideoCodec::Vp9 => {
                // With alpha the encoder must not reorder frames.
                let alpha = if planes.alpha { " -auto-alt-ref 0" } else { "" };
                format!("-b:v 0 -crf {} -deadline good -cpu-used 2 -row-mt 1{alpha}", crf(24))
            }
            VideoCodec::Prores if planes.alpha => "-profile:v 4444 -alpha_bits 16 -vendor apl0".to_string(),
            VideoCodec::Prores if planes.chroma == Chroma::Full => "-profile:v 4444 -vendor apl0".to_string(),
            VideoCodec::Prores => "-profile:v hq -vendor apl0".to_string(),
        };
        text.split(' ').map(str::to_string).collect()
    }
}

/// Sees to it that ffmpeg is there and has the encoder.
///
/// # Errors
/// What is missing, how it is installed, and what does without.
pub fn available(codec: VideoCodec, film: &Path) -> std::result::Result<(), Diagnostic> {
    let without = "or write .apng, .gif, .webp or .y4m, which need nothing";
    let wrong = |what: String, help: String| Err(Diagnostic::error(what).help(help).because(Cause::Io));
    let found = Command::new("ffmpeg").args(["-hide_banner", "-encoders"]).stdin(Stdio::null()).output();
    let output = match found {
        Ok(output) => output,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let what = format!("{} is written by `ffmpeg`, which is not on the PATH", film.display());
            let install = "`apt install ffmpeg`, `brew install ffmpeg` or `winget install ffmpeg`";
            return wrong(what, format!("install it with {install}, {without}"));
        }
        Err(error) => return wrong(format!("cannot run `ffmpeg`: {error}"), without.into()),
    };
    let list = String::from_utf8_lossy(&output.stdout);
    if list.lines().any(|line| line.split_whitespace().nth(1) == Some(codec.encoder())) {
        return Ok(());
    }
    let place = on_path().map_or("ffmpeg".into(), |path| path.display().to_string());
    wrong(
        format!("{place} has no encoder `{}`, which {} needs", codec.encoder(), film.display()),
        format!("install a build of ffmpeg that has it, choose another with --codec, {without}"),
    )
}

/// Where the program is that would be run.
fn on_path() -> Option<std::path::PathBuf> {
    let name = if cfg!(windows) { "ffmpeg.exe" } else { "ffmpeg" };
    std::env::split_paths(&std::env::var_os("PATH")?).map(|folder| folder.join(name)).find(|path| path.is_file())
}

/// A running ffmpeg.
pub struct FfmpegEncoder {
    child: Child,
    /// Closed when all frames were given.
    pipe: Option<ChildStdin>,
    /// Collects what it says.
    said: Option<JoinHandle<String>>,
    planes: PlaneFormat,
    size: [u32; 2],
    written: u64,
    film: std::path::PathBuf,
    buffer: Vec<u8>,
}

/// Bytes of ffmpeg's complaints that are kept, and lines that are shown.
const KEPT: usize = 1 << 16;
const SHOWN: usize = 4;

impl FfmpegEncoder {
    /// Starts ffmpeg, which writes the film to `film`, whatever that is called.
    pub fn start(film: &Path, format: FilmFormat, spec: &FilmSpec, options: &FilmOptions) -> Result<Self> {
        let codec = options.codec.or(format.codec(spec.alpha)).unwrap_or(VideoCodec::H264);
        let planes = options.planes.unwrap_or_else(|| codec.planes(spec.alpha));
        let size = planes.padded(spec.size);
        let mut command = Command::new("ffmpeg");
        command.args(arguments(format, codec, planes, size, spec, options)).arg(film);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
        let (pipe, errors) = (child.stdin.take(), child.stderr.take());
        let said = errors.map(|errors| std::thread::spawn(move || collected(errors)));
        let film = film.to_path_buf();
        Ok(FfmpegEncoder { child, pipe, said, planes, size, written: 0, film, buffer: Vec::new() })
    }

    /// What ffmpeg said when it ended, as an error.
    fn complaint(&mut self) -> Error {
        self.pipe = None;
        let status = self.child.wait();
        let said = self.said();
        let lines: Vec<&str> = said.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let shown = lines[lines.len().saturating_sub(SHOWN)..].join("; ");
        let how = status.map_or_else(|error| error.to_string(), |status| status.to_string());
        let shown = if shown.is_empty() { "it gave no reason".into() } else { shown };
        Error::other(format!("ffmpeg ended early ({how}): {shown}"))
    }

    /// All that ffmpeg said, once it has ended, without the temporary name of the film.
    fn said(&mut self) -> String {
        let said = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        said.replace(&*self.film.to_string_lossy(), "the film")
    }
}

fn collected(mut errors: impl Read) -> String {
    let (mut all, mut piece) = (Vec::new(), [0; 4096]);
    while let Ok(length) = errors.read(&mut piece)
        && length > 0
    {
        all.extend(&piece[..length]);
        let surplus = all.len().saturating_sub(KEPT);
        all.drain(..surplus);
    }
    String::from_utf8_lossy(&all).into_owned()
}

fn arguments(
    format: FilmFormat,
    codec: VideoCodec,
    planes: PlaneFormat,
    [width, height]: [u32; 2],
    spec: &FilmSpec,
    options: &FilmOptions,
) -> Vec<String> {
    let name = planes.name();
    let before = format!(
        "-hide_banner -loglevel error -nostdin -y -f rawvideo -pixel_format {name} -video_size {width}x{height} \
         -framerate {} -i pipe:0 -map 0:v -an",
        spec.rate
    );
    let mut all: Vec<String> = before.split_whitespace().map(str::to_string).collect();
    let mut add = |words: &[&str]| all.extend(words.iter().map(|word| word.to_string()));
    add(&["-vf", "setparams=range=tv:color_primaries=bt709:color_trc=bt709:colorspace=bt709"]);
    add(&["-c:v", codec.encoder(), "-pix_fmt", &name]);
    let quality = codec.options(options.crf, planes);
    add(&quality.iter().map(String::as_str).collect::<Vec<_>>());
    add(&["-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709", "-color_range", "tv"]);
    // No versions and no times in the file.
    add(&["-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"]);
    add(&["-metadata", &format!("comment={}", lines_of(&spec.metadata))]);
    match format {
        FilmFormat::Mp4 => add(&["-movflags", "+faststart+write_colr", "-f", "mp4"]),
        FilmFormat::Mov => add(&["-movflags", "+faststart+write_colr", "-f", "mov"]),
        FilmFormat::Webm => add(&["-f", "webm"]),
        FilmFormat::Apng | FilmFormat::Gif | FilmFormat::Webp | FilmFormat::Y4m => {}
    }
    all
}

impl FilmEncoder for FfmpegEncoder {
    fn add(&mut self, frame: &FilmFrame) -> Result<()> {
        self.buffer.clear();
        self.planes.put(frame, self.size, &mut self.buffer);
        let written = match &mut self.pipe {
            Some(pipe) => pipe.write_all(&self.buffer),
            None => Err(ErrorKind::BrokenPipe.into()),
        };
        self.written += 1;
        match written {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(self.complaint()),
            other => other,
        }
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.pipe = None;
        let status = self.child.wait()?;
        if !status.success() {
            return Err(self.complaint());
        }
        // A film that came out short is no success, whatever the exit code says.
        let frames = read_film_info(&self.film).ok().flatten().map_or(0, |info| info.frames);
        if frames != self.written {
            let (said, all) = (self.said(), self.written);
            let said = said.lines().last().map_or(" and gives no reason".into(), |line| format!(": {}", line.trim()));
            return Err(Error::other(format!("ffmpeg has written {frames} of {all} frames{said}")));
        }
        Ok(())
    }
}

impl Drop for FfmpegEncoder {
    /// A film that is given up leaves no process behind.
    fn drop(&mut self) {
        self.pipe = None;
        if !matches!(self.child.try_wait(), Ok(Some(_))) {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_codec_takes_its_own_planes_and_suits_its_formats() {
        for codec in VideoCodec::ALL {
            assert_eq!(VideoCodec::parse(&codec.name().to_uppercase()), Some(codec));
            for alpha in [false, true] {
                assert!(codec.takes(codec.planes(alpha)), "{codec:?} {alpha}");
                assert!(!codec.planes(alpha).alpha || codec.holds_alpha());
            }
        }
        for format in FilmFormat::ALL {
            for alpha in [false, true] {
                assert!(format.codec(alpha).is_none_or(|codec| codec.suits(format)), "{format:?}");
            }
        }
        assert!(
            !VideoCodec::Prores.takes(PlaneFormat::USUAL) && !VideoCodec::H264.takes(VideoCodec::Prores.planes(true))
        );
    }

    #[test]
    fn the_stream_is_marked_on_both_ways_and_the_rate_is_a_fraction() {
        let spec = super::super::tests::spec(5, 3, 2);
        let planes = PlaneFormat::USUAL;
        let all = arguments(
            FilmFormat::Mp4,
            VideoCodec::H264,
            planes,
            planes.padded(spec.size),
            &spec,
            &FilmOptions::default(),
        );
        let all = all.join(" ");
        for part in [
            "-pixel_format yuv420p -video_size 6x4 -framerate 24000/1001 -i pipe:0",
            "setparams=range=tv:color_primaries=bt709:color_trc=bt709:colorspace=bt709",
            "-color_primaries bt709 -color_trc bt709 -colorspace bt709 -color_range tv",
            "-crf 18",
            "+faststart",
        ] {
            assert!(all.contains(part), "{part}: {all}");
        }
    }
}
