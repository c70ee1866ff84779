//! YUV4MPEG2: raw video with a line of text before it and before every frame; what encoders of video read.
//!
//! A header must stay below 80 bytes for some readers, ffmpeg up to version 4 and x264 among them. So what the film says
//! of its making is cut in pieces, which lie as comments in the headers of its first frames.

use std::io::{Read, Result, Write};

use super::frame::FilmFrame;
use super::planes::{Chroma, PlaneFormat};
use super::spec::{FilmEncoder, FilmSpec, lines_of};
use crate::base::limits;

/// The longest header with its end of line.
const LONGEST_HEADER: usize = 80;
const COMMENT: &str = "FRAME Xanim=";

pub struct Y4mEncoder<W> {
    out: W,
    format: PlaneFormat,
    size: [u32; 2],
    /// What is still to be said, as comments can hold it.
    comment: String,
    buffer: Vec<u8>,
}

impl<W: Write> Y4mEncoder<W> {
    pub fn new(mut out: W, spec: &FilmSpec, format: PlaneFormat) -> Result<Self> {
        let [width, height] = spec.size;
        let format = PlaneFormat { alpha: false, ..format };
        let (above, below) = (spec.rate.numerator(), spec.rate.denominator());
        let siting = if format.bits == 10 { "p10" } else { "mpeg2" };
        let colors = match (format.chroma, format.bits) {
            (Chroma::Quarter, _) => format!("420{siting}"),
            (_, 10) => format!("{}p10", format.chroma_digits()),
            _ => format.chroma_digits().to_string(),
        };
        writeln!(out, "YUV4MPEG2 W{width} H{height} F{above}:{below} Ip A1:1 C{colors} XCOLORRANGE=LIMITED")?;
        let comment = escaped(&lines_of(&spec.metadata));
        Ok(Y4mEncoder { out, format, size: spec.size, comment, buffer: Vec::new() })
    }
}

impl<W: Write + Send> FilmEncoder for Y4mEncoder<W> {
    fn add(&mut self, frame: &FilmFrame) -> Result<()> {
        self.buffer.clear();
        if self.comment.is_empty() {
            self.buffer.extend(b"FRAME\n");
        } else {
            let piece = self.comment.len().min(LONGEST_HEADER - COMMENT.len() - 1);
            let rest = self.comment.split_off(piece);
            self.buffer.extend(format!("{COMMENT}{}\n", self.comment).bytes());
            self.comment = rest;
        }
        self.format.put(frame, self.size, &mut self.buffer);
        self.out.write_all(&self.buffer)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.out.flush()
    }
}

/// Text in which blanks, ends of lines, `%` and all that is not ASCII are numbers.
fn escaped(text: &str) -> String {
    let plain = |b: u8| b.is_ascii_graphic() && b != b'%';
    text.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

fn unescaped(text: &[u8]) -> String {
    let mut out = Vec::new();
    let mut rest = text;
    while let Some((first, behind)) = rest.split_first() {
        let code = behind.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        match code.and_then(|two| u8::from_str_radix(two, 16).ok()) {
            Some(byte) if *first == b'%' => {
                out.push(byte);
                rest = &behind[2..];
            }
            _ => {
                out.push(*first);
                rest = behind;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// A header up to its end of line; `None` at the end of the file or where there is none.
fn header(source: &mut impl Read) -> Option<Vec<u8>> {
    let mut line = Vec::new();
    let mut byte = [0];
    while line.len() < 4 * LONGEST_HEADER {
        source.read_exact(&mut byte).ok()?;
        if byte[0] == b'\n' {
            return Some(line);
        }
        line.push(byte[0]);
    }
    None
}

/// What is said of a film by its headers: size, frames a second as they are written, frames, and its metadata as text.
pub struct Y4mHeaders {
    pub size: [u32; 2],
    pub rate: String,
    pub frames: u64,
    pub text: String,
}

/// Walks over the headers; `None` if this is no film, or the last frame is cut short.
pub fn read_headers(source: &mut (impl Read + std::io::Seek)) -> Option<Y4mHeaders> {
    let first = header(source)?;
    let text = String::from_utf8(first).ok()?;
    let mut words = text.split(' ');
    if words.next() != Some("YUV4MPEG2") {
        return None;
    }
    let (mut size, mut rate, mut colors) = ([0u32; 2], String::new(), "420");
    for word in words {
        match word.split_at_checked(1)? {
            ("W", n) => size[0] = n.parse().ok()?,
            ("H", n) => size[1] = n.parse().ok()?,
            ("F", n) => rate = n.replace(':', "/"),
            ("C", name) => colors = name,
            _ => {}
        }
    }
    if size.iter().any(|side| !(1..=limits::IMAGE_SIDE).contains(side)) {
        return None;
    }
    let [width, height] = size.map(u64::from);
    let chroma = match colors.get(..3)? {
        "420" => 2 * width.div_ceil(2) * height.div_ceil(2),
        "422" => 2 * width.div_ceil(2) * height,
        "444" => 2 * width * height,
        "mon" => 0,
        _ => return None,
    };
    let length = (width * height + chroma) * if colors.contains("p1") { 2 } else { 1 };
    let end = source.seek(std::io::SeekFrom::End(0)).ok()?;
    source.seek(std::io::SeekFrom::Start(text.len() as u64 + 1)).ok()?;
    let (mut frames, mut comment) = (0, Vec::new());
    while let Some(line) = header(source).filter(|line| line.starts_with(b"FRAME")) {
        comment.extend(line.strip_prefix(COMMENT.as_bytes()).unwrap_or_default());
        let at = source.seek(std::io::SeekFrom::Current(i64::try_from(length).ok()?)).ok()?;
        if at > end {
            return None;
        }
        frames += 1;
    }
    Some(Y4mHeaders { size, rate, frames, text: unescaped(&comment) })
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::super::tests::{frames, spec};
    use super::*;

    fn film(format: &str) -> Vec<u8> {
        let mut out = Vec::new();
        let format = PlaneFormat::parse(format).unwrap();
        let mut encoder = Box::new(Y4mEncoder::new(&mut out, &spec(5, 3, 12), format).unwrap());
        frames(5, 3, 12).iter().for_each(|frame| encoder.add(frame).unwrap());
        encoder.finish().unwrap();
        out
    }

    #[test]
    fn headers_are_short_and_what_was_said_comes_back() {
        let bytes = film("yuv420p");
        assert!(bytes.starts_with(b"YUV4MPEG2 W5 H3 F24000:1001 Ip A1:1 C420mpeg2 XCOLORRANGE=LIMITED\nFRAME Xanim="));
        let found = read_headers(&mut Cursor::new(&bytes)).unwrap();
        assert_eq!((found.size, found.rate.as_str(), found.frames), ([5, 3], "24000/1001", 12));
        assert_eq!(found.text, lines_of(&spec(5, 3, 12).metadata));
        // 5 x 3 of luma and twice 3 x 2 of colours, behind a header.
        let last = bytes.len() - (15 + 12);
        assert_eq!(&bytes[last - 6..last], b"FRAME\n");
        let longest = "YUV4MPEG2 W16384 H16384 F120000:1001 Ip A1:1 C420mpeg2 XCOLORRANGE=LIMITED\n";
        assert!(longest.len() <= LONGEST_HEADER);
    }

    #[test]
    fn every_format_has_the_length_that_its_header_says() {
        for format in PlaneFormat::NAMES {
            let bytes = film(format);
            assert_eq!(read_headers(&mut Cursor::new(&bytes)).unwrap().frames, 12, "{format}");
            assert!(read_headers(&mut Cursor::new(&bytes[..bytes.len() - 1])).is_none(), "{format}");
        }
    }

    #[test]
    fn nonsense_is_no_film() {
        for text in
            ["", "YUV4MPEG2", "YUV4MPEG2 W1 H1 C999\n", "YUV4MPEG2 Wx\n", "YUV4MPEG2 W4294967295 H4294967295\nFRAME\n"]
        {
            assert!(read_headers(&mut Cursor::new(text.as_bytes())).is_none(), "{text}");
        }
        assert_eq!(unescaped(escaped("a b\n% \u{e4}").as_bytes()), "a b\n% \u{e4}");
        assert_eq!(unescaped(b"%zz%4"), "%zz%4");
    }
}
