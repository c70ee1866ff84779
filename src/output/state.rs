//! Whether a file under a frame's name is that frame.

use std::io::ErrorKind;
use std::path::Path;

use super::chunks::sound_notes;
use super::exr::{is_exr, read_exr, read_exr_header};
use super::manifest::{Entry, Making};
use super::png::read_notes;
use super::{Notes, attributes, chunks};
use crate::base::digest::Digest;
use crate::base::{files, limits};

/// What is found under a frame's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// The frame as it would be rendered now, to the byte.
    Done,
    /// A picture of another content, as an edit leaves it.
    Stale,
    Missing,
    /// A frame once, but damaged.
    Corrupt,
    /// Something that is no frame of this program.
    Foreign,
}

impl State {
    pub fn word(self) -> &'static str {
        match self {
            State::Done => "done",
            State::Stale => "stale",
            State::Missing => "missing",
            State::Corrupt => "corrupt",
            State::Foreign => "foreign",
        }
    }
}

/// The notes by which a picture says what it is; a frame's file starts with them.
pub fn making_notes(making: &Making) -> Notes {
    let note = |keyword: &str, text: String| (keyword.to_string(), text);
    vec![
        note("Software", concat!("anim ", env!("CARGO_PKG_VERSION")).into()),
        note("Source", making.source.clone()),
        note("Frame", making.frame.to_string()),
        note("Hash", making.hash.to_string()),
    ]
}

/// The file of a frame made from that of one with the same pixels: to the byte what rendering it would give.
///
/// `None` if the file is not a whole picture of the same content.
pub fn renamed(bytes: &[u8], making: &Making) -> Option<Vec<u8>> {
    let (notes, wanted) = (whole_notes(bytes)?, making_notes(making));
    if !notes.iter().any(|(keyword, text)| keyword == "Hash" && *text == making.hash.to_string()) {
        return None;
    }
    if is_exr(bytes) { attributes::with_notes(bytes, &notes, &wanted) } else { chunks::with_notes(bytes, &wanted) }
}

/// Looks at all bytes of the file: time stamps are not trusted.
///
/// The manifest's word for them is enough; without it the picture itself must be whole and say what it is.
pub fn look(path: &Path, known: Option<&Entry>, wanted: &Making) -> State {
    if std::fs::metadata(path).is_err_and(|e| e.kind() == ErrorKind::NotFound) {
        return State::Missing;
    }
    let Ok(bytes) = files::read_bytes(path, limits::FRAME_FILE_BYTES) else { return State::Foreign };
    let as_known = |entry: &&Entry| entry.bytes == bytes.len() as u64 && entry.checksum == Digest::of(&bytes);
    let recorded = known.filter(as_known);
    if let Some(entry) = recorded {
        return if entry.making == *wanted { State::Done } else { State::Stale };
    }
    match whole_notes(&bytes) {
        Some(notes) if notes.starts_with(&making_notes(wanted)) => State::Done,
        Some(notes) if notes.iter().any(|(keyword, _)| keyword == "Hash") => State::Stale,
        Some(_) => State::Foreign,
        None if known.is_some() || read_notes(&bytes).is_some() || read_exr_header(&bytes).is_ok() => State::Corrupt,
        None => State::Foreign,
    }
}

/// The notes of a picture that is whole. Of an EXR file all blocks are unpacked, since the sums that tell damage are
/// inside of them.
fn whole_notes(bytes: &[u8]) -> Option<Notes> {
    if !is_exr(bytes) {
        return sound_notes(bytes);
    }
    read_exr(bytes).ok()?;
    read_exr_header(bytes).ok().map(|file| file.notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::Render;
    use crate::film::Film;
    use crate::output::{encode_exr, encode_png};

    #[test]
    fn damage_anywhere_is_seen_with_and_without_a_manifest() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let making = Making { source: "a.rhai".into(), frame: 3, hash: Digest(77) };
        let film = Film { pixels: vec![[0.1, 0.5, 0.9]; 6], ..Film::new(3, 2) };
        let bytes = encode_png(&film, &Render::default(), &making_notes(&making)).unwrap();
        let entry = Entry {
            file: "a.png".into(),
            making: making.clone(),
            bytes: bytes.len() as u64,
            checksum: Digest::of(&bytes),
        };
        let looks = |bytes: &[u8], known: Option<&Entry>| {
            std::fs::write(&path, bytes).unwrap();
            look(&path, known, &making)
        };
        assert_eq!(look(&path, Some(&entry), &making), State::Missing);
        for known in [None, Some(&entry)] {
            assert_eq!(looks(&bytes, known), State::Done);
            for at in 0..bytes.len() {
                let mut damaged = bytes.clone();
                damaged[at] ^= 0x10;
                assert!(matches!(looks(&damaged, known), State::Corrupt | State::Foreign), "byte {at}");
                assert!(matches!(looks(&bytes[..at], known), State::Corrupt | State::Foreign), "cut at {at}");
            }
            assert_ne!(looks(&[&bytes[..], b"x"].concat(), known), State::Done);
        }
        let other = Making { hash: Digest(78), ..making.clone() };
        let edited = encode_png(&film, &Render::default(), &making_notes(&other)).unwrap();
        assert_eq!(looks(&edited, None), State::Stale);
        assert_eq!(looks(&edited, Some(&entry)), State::Stale);
        let another_frame = Making { frame: 4, ..making.clone() };
        let renamed = encode_png(&film, &Render::default(), &making_notes(&another_frame)).unwrap();
        assert_eq!(looks(&renamed, None), State::Stale);
        let plain = encode_png(&film, &Render::default(), &Notes::new()).unwrap();
        assert_eq!(looks(&plain, None), State::Foreign);
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        assert_eq!(look(&path, None, &making), State::Foreign);
    }

    #[test]
    fn damage_of_an_exr_file_is_seen_without_a_manifest_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let making = Making { source: "a.rhai".into(), frame: 3, hash: Digest(77) };
        let pixels = (0..2400).map(|i| [i as f32 / 7.0, 1.0 / (i + 1) as f32, 0.5]).collect();
        let film = Film { pixels, ..Film::new(60, 40) };
        let bytes = encode_exr(&film, &Render::default(), &making_notes(&making)).unwrap();
        let looks = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            look(&path, None, &making)
        };
        assert_eq!(looks(&bytes), State::Done);
        for at in (bytes.len() / 2..bytes.len()).step_by(97) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert_ne!(looks(&damaged), State::Done, "byte {at} of {}", bytes.len());
            assert_ne!(looks(&bytes[..at]), State::Done, "cut at {at}");
        }
        let other = Making { hash: Digest(78), ..making.clone() };
        assert_eq!(looks(&encode_exr(&film, &Render::default(), &making_notes(&other)).unwrap()), State::Stale);
    }
}
