//! What can be said about the encoding of a film, and whether it concerns the kind of film.

use super::wrong;
use crate::base::diagnostics::{Diagnostics, suggestion};
use crate::base::rate::Rate;
use crate::output::FilmFormat;
use crate::output::film::{FilmOptions, PaletteChoice, PlaneFormat, VideoCodec};

#[derive(Default, clap::Args)]
pub struct FilmOptionArguments {
    /// Frames per second, as a number or a fraction such as 24000/1001 [default: the script's; 24 for a folder]
    #[arg(long, value_name = "RATE", value_parser = parse_rate)]
    pub fps: Option<Rate>,
    /// How often an animation plays: a number, or `forever` [default: forever]
    #[arg(long, value_name = "N", value_parser = parse_plays)]
    plays: Option<u32>,
    /// Colours of a GIF: `shared` by all frames, others for each `frame`, or `auto` for what loses little
    #[arg(long, value_name = "KIND", value_parser = parse_palette)]
    palette: Option<PaletteChoice>,
    /// Show the nearest colours of a GIF, without a pattern of them
    #[arg(long)]
    no_dither: bool,
    /// h264, h265, vp9 or prores [default: h264; vp9 for .webm; prores for .mov with alpha]
    #[arg(long, value_name = "NAME", value_parser = parse_codec)]
    codec: Option<VideoCodec>,
    /// Quality of h264, h265 and vp9: lower is better and larger [default: 18, 20, 24]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=63))]
    crf: Option<u32>,
    /// How video stores colours: yuv420p, yuv422p, yuv444p, and with 10 at the end in 10 bits [default: yuv420p]
    #[arg(long, value_name = "NAME", value_parser = parse_planes)]
    pixel_format: Option<PlaneFormat>,
    /// Where the frames of a script are kept, as with -o of `render` [default: frames/NAME]
    #[arg(long, value_name = "PLACE")]
    pub frames_in: Option<String>,
}

fn parse_rate(text: &str) -> Result<Rate, String> {
    Rate::parse(text).ok_or_else(|| "expected a number above 0 or a fraction, as in 24, 23.976 or 24000/1001".into())
}

fn parse_plays(text: &str) -> Result<u32, String> {
    let number = || text.parse().ok().filter(|n| (1..=u32::from(u16::MAX)).contains(n));
    if text.eq_ignore_ascii_case("forever") { Some(0) } else { number() }
        .ok_or_else(|| "expected `forever` or a number from 1 to 65535".into())
}

fn parse_palette(text: &str) -> Result<PaletteChoice, String> {
    match text {
        "auto" => Ok(PaletteChoice::Auto),
        "shared" => Ok(PaletteChoice::Shared),
        "frame" => Ok(PaletteChoice::PerFrame),
        _ => Err("expected auto, shared or frame".into()),
    }
}

fn one_of(text: &str, names: &[&str]) -> String {
    suggestion(text, names.iter().copied()).unwrap_or_default()
}

fn parse_codec(text: &str) -> Result<VideoCodec, String> {
    VideoCodec::parse(text).ok_or_else(|| one_of(text, &VideoCodec::NAMES))
}

fn parse_planes(text: &str) -> Result<PlaneFormat, String> {
    PlaneFormat::parse(text).ok_or_else(|| one_of(text, &PlaneFormat::NAMES))
}

impl FilmOptionArguments {
    /// The options for a kind of film, and how often it plays.
    ///
    /// # Errors
    /// An option that such a film does not have.
    pub fn resolve(&self, format: FilmFormat) -> Result<(FilmOptions, u32), Diagnostics> {
        let ending = format.ending();
        let refuse = |flag: &str, what: &str| Err(wrong(format!("{flag} does not concern a .{ending} film"), what));
        if format != FilmFormat::Gif && (self.palette.is_some() || self.no_dither) {
            return refuse(
                if self.no_dither { "--no-dither" } else { "--palette" },
                "it is for .gif, which has 256 colours",
            );
        }
        if !format.says_plays() && self.plays.is_some() {
            return refuse(
                "--plays",
                "only .apng, .gif and .webp say how often they play; players decide for the others",
            );
        }
        let is_coded = format.codec(false).is_some();
        if !is_coded && (self.codec.is_some() || self.crf.is_some()) {
            return refuse(if self.codec.is_some() { "--codec" } else { "--crf" }, "it is for .mp4, .webm and .mov");
        }
        if !is_coded && format != FilmFormat::Y4m && self.pixel_format.is_some() {
            return refuse("--pixel-format", "it is for .y4m, .mp4, .webm and .mov; the others store RGB");
        }
        if let Some(codec) = self.codec.filter(|codec| !codec.suits(format)) {
            let suited: Vec<&str> = VideoCodec::ALL.iter().filter(|c| c.suits(format)).map(|c| c.name()).collect();
            let message = format!("a .{ending} film cannot be compressed by {}", codec.name());
            return Err(wrong(message, &format!("it can be by {}", suited.join(", "))));
        }
        if let (Some(codec), Some(planes)) = (self.codec.or(format.codec(false)), self.pixel_format)
            && !codec.takes(planes)
        {
            let taken: Vec<&str> = PlaneFormat::NAMES
                .into_iter()
                .filter(|n| PlaneFormat::parse(n).is_some_and(|p| codec.takes(p)))
                .collect();
            let message = format!("{} cannot store {}", codec.name(), planes.name());
            return Err(wrong(message, &format!("it can store {}", taken.join(", "))));
        }
        if self.crf.is_some() && self.codec == Some(VideoCodec::Prores) {
            return Err(wrong("--crf does not concern prores".into(), "its quality is that of its profile"));
        }
        if let Some(crf) = self.crf.filter(|crf| *crf > 51)
            && self.codec.or(format.codec(false)) != Some(VideoCodec::Vp9)
        {
            return Err(wrong(format!("--crf {crf}: h264 and h265 go from 0 to 51"), "0 is the best"));
        }
        let options = FilmOptions {
            palette: self.palette.unwrap_or(PaletteChoice::Auto),
            dither: !self.no_dither,
            codec: self.codec,
            crf: self.crf,
            planes: self.pixel_format,
        };
        Ok((options, self.plays.unwrap_or(0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_that_do_not_concern_a_film_are_refused() {
        let none = FilmOptionArguments::default;
        let said = |options: FilmOptionArguments, format| options.resolve(format).unwrap_err().to_string();
        for format in FilmFormat::ALL {
            assert_eq!(none().resolve(format).unwrap(), (FilmOptions::default(), 0));
        }
        let crf = |crf| FilmOptionArguments { crf: Some(crf), ..none() };
        assert!(said(crf(20), FilmFormat::Gif).contains("--crf does not concern a .gif film"));
        assert!(said(crf(60), FilmFormat::Mp4).contains("0 to 51"));
        assert!(crf(60).resolve(FilmFormat::Webm).is_ok());
        let codec = |codec| FilmOptionArguments { codec: Some(codec), ..none() };
        assert!(said(codec(VideoCodec::Prores), FilmFormat::Mp4).contains("it can be by h264, h265"));
        assert!(said(FilmOptionArguments { no_dither: true, ..none() }, FilmFormat::Webp).contains("--no-dither"));
        assert!(said(FilmOptionArguments { plays: Some(2), ..none() }, FilmFormat::Mp4).contains("--plays"));
        let planes = FilmOptionArguments { pixel_format: PlaneFormat::parse("yuv420p"), ..codec(VideoCodec::Prores) };
        assert!(said(planes, FilmFormat::Mov).contains("yuv422p10, yuv444p10"));
        assert!(parse_codec("h256").unwrap_err().contains("did you mean"));
        assert_eq!((parse_plays("forever"), parse_plays("3")), (Ok(0), Ok(3)));
        assert!(parse_plays("0").is_err() && parse_rate("0").is_err() && parse_palette("x").is_err());
    }
}
