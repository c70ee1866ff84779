//! What films say of themselves: size, frames, time, and the metadata of their making.
//!
//! Every format is walked from box to box; pixels are passed over. Nothing is allocated from a length that a file merely
//! declares.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use super::super::Metadata;
use super::super::png::chunks::text_entry;
use super::spec::metadata_of;
use super::{xmp, y4m};
use crate::base::diagnostics::Diagnostic;

/// What is known of a film from its file alone.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmInfo {
    /// The format's common name.
    pub format: &'static str,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// How many there are.
    pub frames: u64,
    /// How long it plays once.
    pub seconds: f64,
    /// What it says of its making.
    pub metadata: Metadata,
}

/// Texts that are longer are not of ours.
const LONGEST_TEXT: u64 = 1 << 20;

/// Reads what a film says of itself; `None` if the file is no film of a known format, or a damaged one.
///
/// # Errors
/// A file that cannot be read.
pub fn read_film_info(path: &Path) -> Result<Option<FilmInfo>, Diagnostic> {
    let failed = |error: std::io::Error| Diagnostic::io(path.display(), "read", &error);
    let file = File::open(path).map_err(failed)?;
    let end = file.metadata().map_err(failed)?.len();
    Ok(film_info(&mut Source { file: BufReader::new(file), end }))
}

fn film_info<R: Read + Seek>(source: &mut Source<R>) -> Option<FilmInfo> {
    let start = source.bytes(0, 12)?;
    match &start[..4] {
        b"\x89PNG" => apng(source),
        b"GIF8" => gif(source),
        b"RIFF" if &start[8..] == b"WEBP" => webp(source),
        b"YUV4" => {
            source.file.seek(SeekFrom::Start(0)).ok()?;
            let found = y4m::read_headers(&mut source.file)?;
            let (above, below) = found.rate.split_once('/')?;
            let rate = above.parse::<f64>().ok()? / below.parse::<f64>().ok()?;
            let seconds = found.frames as f64 / rate;
            let (size, frames, metadata) = (found.size, found.frames, metadata_of(&found.text));
            Some(FilmInfo { format: "YUV4MPEG2", size, frames, seconds, metadata })
        }
        [0x1a, 0x45, 0xdf, 0xa3] => webm(source),
        _ if &start[4..8] == b"ftyp" => mp4(source),
        _ => None,
    }
}

/// A file that is read here and there.
struct Source<R> {
    file: R,
    end: u64,
}

impl<R: Read + Seek> Source<R> {
    fn bytes(&mut self, at: u64, length: u64) -> Option<Vec<u8>> {
        if length > LONGEST_TEXT || at.checked_add(length)? > self.end {
            return None;
        }
        self.file.seek(SeekFrom::Start(at)).ok()?;
        let mut bytes = vec![0; length as usize];
        self.file.read_exact(&mut bytes).ok()?;
        Some(bytes)
    }

    /// A number of `length` bytes, the highest first.
    fn number(&mut self, at: u64, length: u64) -> Option<u64> {
        Some(self.bytes(at, length)?.iter().fold(0, |number, byte| number << 8 | u64::from(*byte)))
    }

    /// A number of `length` bytes, the lowest first.
    fn little(&mut self, at: u64, length: u64) -> Option<u64> {
        Some(self.bytes(at, length)?.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte)))
    }
}

/// Sides of a picture, which are never 0.
fn sides(width: u64, height: u64) -> Option<[u32; 2]> {
    let side = |n: u64| u32::try_from(n).ok().filter(|n| *n > 0);
    Some([side(width)?, side(height)?])
}

/// A PNG without frames beside the first is no film.
fn apng<R: Read + Seek>(source: &mut Source<R>) -> Option<FilmInfo> {
    let (mut at, mut metadata, mut declared, mut frames, mut seconds) = (8, Metadata::new(), None, 0, 0.0);
    let size = sides(source.number(16, 4)?, source.number(20, 4)?)?;
    loop {
        let length = source.number(at, 4)?;
        let kind = source.bytes(at + 4, 4)?;
        let data = at + 8;
        match &*kind {
            b"acTL" => declared = Some(source.number(data, 4)?),
            b"fcTL" => {
                let [above, below] = [source.number(data + 20, 2)?, source.number(data + 22, 2)?];
                seconds += above as f64 / if below == 0 { 100.0 } else { below as f64 };
                frames += 1;
            }
            b"iTXt" | b"tEXt" => metadata.extend(source.bytes(data, length).and_then(|data| text_entry(&kind, &data))),
            b"IEND" => break,
            _ => {}
        }
        at = data.checked_add(length)?.checked_add(4)?;
    }
    (declared? == frames).then_some(FilmInfo { format: "APNG", size, frames, seconds, metadata })
}

fn gif<R: Read + Seek>(source: &mut Source<R>) -> Option<FilmInfo> {
    let size = sides(source.little(6, 2)?, source.little(8, 2)?)?;
    let table = |flags: u64| if flags & 0x80 != 0 { 3 << ((flags & 7) + 1) } else { 0 };
    let mut at = 13 + table(source.number(10, 1)?);
    let (mut frames, mut hundredths, mut comment) = (0, 0, Vec::new());
    loop {
        match source.number(at, 1)? {
            0x2c => {
                frames += 1;
                at += 10 + table(source.number(at + 9, 1)?) + 1;
                at = blocks(source, at, |_| {})?;
            }
            0x21 => {
                let label = source.number(at + 1, 1)?;
                if label == 0xf9 {
                    hundredths += source.little(at + 4, 2)?;
                }
                at = blocks(source, at + 2, |data| {
                    if label == 0xfe && (comment.len() as u64) < LONGEST_TEXT {
                        comment.extend(data);
                    }
                })?;
            }
            0x3b => break,
            _ => return None,
        }
    }
    let metadata = metadata_of(&String::from_utf8_lossy(&comment));
    Some(FilmInfo { format: "GIF", size, frames, seconds: hundredths as f64 / 100.0, metadata })
}

/// Walks over blocks up to the empty one; gives the place behind it.
fn blocks<R: Read + Seek>(source: &mut Source<R>, mut at: u64, mut see: impl FnMut(&[u8])) -> Option<u64> {
    loop {
        let length = source.number(at, 1)?;
        if length == 0 {
            return Some(at + 1);
        }
        see(&source.bytes(at + 1, length)?);
        at += 1 + length;
    }
}

fn webp<R: Read + Seek>(source: &mut Source<R>) -> Option<FilmInfo> {
    let end = source.little(4, 4)?.checked_add(8)?;
    let (mut at, mut size, mut frames, mut milliseconds, mut metadata) = (12, None, 0, 0, Metadata::new());
    while at < end {
        let (kind, length) = (source.bytes(at, 4)?, source.little(at + 4, 4)?);
        let data = at + 8;
        match &*kind {
            b"VP8X" => size = sides(source.little(data + 4, 3)? + 1, source.little(data + 7, 3)? + 1),
            b"ANMF" => {
                milliseconds += source.little(data + 12, 3)?;
                frames += 1;
            }
            b"XMP " => {
                let packet = source.bytes(data, length)?;
                metadata = xmp::metadata_in(&String::from_utf8_lossy(&packet));
            }
            _ => {}
        }
        at = data + length + length % 2;
    }
    let is_whole = end <= source.end && frames > 0;
    let seconds = milliseconds as f64 / 1000.0;
    is_whole.then_some(FilmInfo { format: "WebP", size: size?, frames, seconds, metadata })
}

/// Boxes of an MP4 or MOV file (ISO/IEC 14496-12): where each begins behind its head, and where it ends.
fn boxes<R: Read + Seek>(source: &mut Source<R>, from: u64, to: u64) -> Vec<([u8; 4], u64, u64)> {
    let (mut at, mut found) = (from, Vec::new());
    while at + 8 <= to && found.len() < MOST_BOXES {
        let (Some(short), Some(kind)) = (source.number(at, 4), source.bytes(at + 4, 4)) else { break };
        let (head, length) = match short {
            0 => (8, to - at),
            1 => (16, source.number(at + 8, 8).unwrap_or(0)),
            length => (8, length),
        };
        let Some(end) = at.checked_add(length).filter(|end| *end <= to && length >= head) else { break };
        found.push(([kind[0], kind[1], kind[2], kind[3]], at + head, end));
        at = end;
    }
    found
}

/// More than any film has on one level, other than pieces of a stream, which are not of ours.
const MOST_BOXES: usize = 10_000;

fn inside<R: Read + Seek>(source: &mut Source<R>, from: u64, to: u64, path: &[&[u8; 4]]) -> Option<(u64, u64)> {
    let Some((first, rest)) = path.split_first() else { return Some((from, to)) };
    let (_, start, end) = boxes(source, from, to).into_iter().find(|(kind, ..)| kind == *first)?;
    inside(source, start, end, rest)
}

fn mp4<R: Read + Seek>(source: &mut Source<R>) -> Option<FilmInfo> {
    let end = source.end;
    let is_quicktime = source.bytes(8, 4)? == b"qt  ";
    let (moov, moov_end) = inside(source, 0, end, &[b"moov"])?;
    let (media, media_end) = inside(source, moov, moov_end, &[b"trak", b"mdia"])?;
    let (table, table_end) = inside(source, media, media_end, &[b"minf", b"stbl"])?;
    let (sizes, _) = inside(source, table, table_end, &[b"stsz"])?;
    let (description, _) = inside(source, table, table_end, &[b"stsd"])?;
    let (head, _) = inside(source, media, media_end, &[b"mdhd"])?;
    let frames = source.number(sizes + 8, 4)?;
    // Behind the count of entries: length and kind of the entry, six reserved bytes, an index and 16 more.
    let size = sides(source.number(description + 40, 2)?, source.number(description + 42, 2)?)?;
    let (scale, length) = match source.number(head, 1)? {
        0 => (source.number(head + 12, 4)?, source.number(head + 16, 4)?),
        _ => (source.number(head + 20, 4)?, source.number(head + 24, 8)?),
    };
    let seconds = if scale > 0 { length as f64 / scale as f64 } else { 0.0 };
    let metadata = metadata_of(&comment_of(source, moov, moov_end).unwrap_or_default());
    Some(FilmInfo { format: if is_quicktime { "MOV" } else { "MP4" }, size, frames, seconds, metadata })
}

/// The comment, as iTunes or as QuickTime has it.
fn comment_of<R: Read + Seek>(source: &mut Source<R>, moov: u64, moov_end: u64) -> Option<String> {
    let comment = b"\xa9cmt";
    let (user, user_end) = inside(source, moov, moov_end, &[b"udta"])?;
    let text = if let Some((meta, meta_end)) = inside(source, user, user_end, &[b"meta"]) {
        // Version and flags come first, and so do the kind and the language of the data.
        let (data, end) = inside(source, meta + 4, meta_end, &[b"ilst", comment, b"data"])?;
        source.bytes(data + 8, end.checked_sub(data + 8)?)?
    } else {
        let (data, _) = inside(source, user, user_end, &[comment])?;
        let length = source.number(data, 2)?;
        source.bytes(data + 4, length)?
    };
    Some(String::from_utf8_lossy(&text).into_owned())
}

/// An element of a WebM file (EBML, RFC 8794): its kind, where its data begin, and how long they are.
fn element<R: Read + Seek>(source: &mut Source<R>, at: u64, to: u64) -> Option<(u64, u64, u64)> {
    let first = source.number(at, 1)?;
    let length = u64::from((first as u8).leading_zeros()) + 1;
    let kind = source.number(at, length.min(4))?;
    let size_at = at + length;
    let first = source.number(size_at, 1)?;
    let size_length = u64::from((first as u8).leading_zeros()) + 1;
    if length > 4 || size_length > 8 {
        return None;
    }
    let mask = (1u64 << (7 * size_length)) - 1;
    let size = source.number(size_at, size_length)? & mask;
    let data = size_at + size_length;
    // All ones: up to the end of what it lies in.
    let size = if size == mask { to.checked_sub(data)? } else { size };
    (data.checked_add(size)? <= to).then_some((kind, data, size))
}

fn webm<R: Read + Seek>(source: &mut Source<R>) -> Option<FilmInfo> {
    let mut film = FilmInfo { format: "WebM", size: [0; 2], frames: 0, seconds: 0.0, metadata: Metadata::new() };
    let mut time = (1_000_000, 0.0);
    let end = source.end;
    elements(source, 0, end, &mut film, &mut time)?;
    film.seconds = time.1 * time.0 as f64 / 1e9;
    (film.size[0] > 0 && film.size[1] > 0).then_some(film)
}

/// Walks over the elements from `at` to `to`; `time` is the scale of times in nanoseconds, and the film's length.
fn elements<R: Read + Seek>(
    source: &mut Source<R>,
    mut at: u64,
    to: u64,
    film: &mut FilmInfo,
    time: &mut (u64, f64),
) -> Option<()> {
    let mut name = String::new();
    while at < to {
        let (kind, data, size) = element(source, at, to)?;
        match kind {
            // Segment, Info, Tracks, TrackEntry, Video, Cluster, Tags, Tag, SimpleTag.
            0x1853_8067 | 0x1549_a966 | 0x1654_ae6b | 0xae | 0xe0 | 0x1f43_b675 | 0x1254_c367 | 0x7373 | 0x67c8 => {
                elements(source, data, data + size, film, time)?;
            }
            // SimpleBlock, and BlockGroup, which holds one frame and its alpha.
            0xa3 | 0xa0 => film.frames += 1,
            0x2a_d7b1 => time.0 = source.number(data, size.min(8))?,
            0x4489 if size == 4 => time.1 = f64::from(f32::from_bits(source.number(data, 4)? as u32)),
            0x4489 => time.1 = f64::from_bits(source.number(data, size.min(8))?),
            0xb0 => film.size[0] = source.number(data, size.min(4))? as u32,
            0xba => film.size[1] = source.number(data, size.min(4))? as u32,
            // TagName and TagString.
            0x45a3 => name = String::from_utf8_lossy(&source.bytes(data, size)?).into_owned(),
            0x4487 if name == "COMMENT" => {
                film.metadata = metadata_of(&String::from_utf8_lossy(&source.bytes(data, size)?));
            }
            _ => {}
        }
        at = data + size;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn of(bytes: &[u8]) -> Option<FilmInfo> {
        film_info(&mut Source { file: Cursor::new(bytes), end: bytes.len() as u64 })
    }

    #[test]
    fn an_element_that_goes_on_to_the_end_of_too_short_a_film_is_none() {
        let bytes = b"\x1a\x45\xdf\xa3\x84\x01\x02\x03\x04\x18\x53\x80\x67\x84\x15\x7f\xff\xff\xff";
        for length in 0..=bytes.len() {
            assert_eq!(of(&bytes[..length]).map(|film| film.frames).unwrap_or(0), 0);
        }
    }

    fn boxed(kind: &[u8; 4], parts: &[&[u8]]) -> Vec<u8> {
        let data = parts.concat();
        [&(data.len() as u32 + 8).to_be_bytes()[..], kind, &data].concat()
    }

    /// A film of seven frames in a third of a second, as small as one can be.
    fn smallest_mp4() -> Vec<u8> {
        let head = boxed(b"mdhd", &[&[0; 12], &24_000u32.to_be_bytes(), &7007u32.to_be_bytes(), &[0; 4]]);
        let entry = boxed(b"avc1", &[&[0; 24], &640u16.to_be_bytes(), &360u16.to_be_bytes(), &[0; 50]]);
        let description = boxed(b"stsd", &[&[0, 0, 0, 0, 0, 0, 0, 1], &entry]);
        let sizes = boxed(b"stsz", &[&[0; 8], &7u32.to_be_bytes(), &[0; 28]]);
        let table = boxed(b"stbl", &[&description, &sizes]);
        let track = boxed(b"trak", &[&boxed(b"mdia", &[&head, &boxed(b"minf", &[&table])])]);
        let data = boxed(b"data", &[&[0, 0, 0, 1, 0, 0, 0, 0], b"Source: a.rhai\nHash: 12"]);
        let list = boxed(b"ilst", &[&boxed(b"\xa9cmt", &[&data])]);
        let user = boxed(b"udta", &[&boxed(b"meta", &[&[0; 4], &list])]);
        [boxed(b"ftyp", &[b"isom\0\0\0\0"]), boxed(b"moov", &[&track, &user])].concat()
    }

    fn tagged(kind: &[u8], data: &[u8]) -> Vec<u8> {
        [
            kind,
            &[0x10 | (data.len() >> 24) as u8, (data.len() >> 16) as u8, (data.len() >> 8) as u8],
            &[data.len() as u8],
            data,
        ]
        .concat()
    }

    fn smallest_webm() -> Vec<u8> {
        let info = tagged(b"\x15\x49\xa9\x66", &tagged(b"\x44\x89", &291.9583f64.to_be_bytes()));
        let video = tagged(b"\xe0", &[tagged(b"\xb0", &[2, 0x80]), tagged(b"\xba", &[1, 0x68])].concat());
        let tracks = tagged(b"\x16\x54\xae\x6b", &tagged(b"\xae", &video));
        let block = tagged(b"\xa3", &[0x81, 0, 0, 0]);
        let cluster = tagged(b"\x1f\x43\xb6\x75", &block.repeat(7));
        let simple = [tagged(b"\x45\xa3", b"COMMENT"), tagged(b"\x44\x87", b"Source: a.rhai\nHash: 12")].concat();
        let tags = tagged(b"\x12\x54\xc3\x67", &tagged(b"\x73\x73", &tagged(b"\x67\xc8", &simple)));
        // The length of the segment is not known.
        let segment = [&b"\x18\x53\x80\x67\xff"[..], &info, &tracks, &cluster, &tags].concat();
        [tagged(b"\x1a\x45\xdf\xa3", &[0; 3]), segment].concat()
    }

    #[test]
    fn films_of_ffmpeg_are_understood() {
        let metadata = vec![("Source".to_string(), "a.rhai".to_string()), ("Hash".into(), "12".into())];
        for (format, bytes) in [("MP4", smallest_mp4()), ("WebM", smallest_webm())] {
            let found = of(&bytes).unwrap();
            assert!((found.seconds - 7.0 * 1001.0 / 24_000.0).abs() < 1e-6, "{format} {}", found.seconds);
            assert_eq!((found.format, found.size, found.frames), (format, [640, 360], 7));
            assert_eq!(found.metadata, metadata, "{format}");
        }
    }

    #[test]
    fn broken_films_are_none_and_nothing_worse() {
        for whole in [smallest_mp4(), smallest_webm(), b"GIF89a\x01\0\x01\0\0\0\0\x3b".to_vec()] {
            assert!(of(&whole).is_some());
            for i in 0..whole.len() {
                let _ = of(&whole[..i]);
                for value in [0, 1, 0x7f, 0xff] {
                    let mut broken = whole.clone();
                    broken[i] = value;
                    let _ = of(&broken);
                }
            }
        }
        assert_eq!(of(b""), None);
        assert_eq!(of(b"RIFF\xff\xff\xff\xffWEBP"), None);
    }
}
