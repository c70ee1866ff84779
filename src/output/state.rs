//! Whether a file under a frame's name is that frame.

use std::io::ErrorKind;
use std::path::Path;

use super::format::Format;
use super::manifest::Entry;
use super::metadata::{HASH, Metadata, PIXELS, Provenance, provenance_metadata, text_under};
use crate::base::digest::Digest;
use crate::base::{files, limits};

/// What is found under a frame's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileState {
    /// The frame as it would be rendered now, to the byte.
    Done,
    /// A picture of another content, as an edit leaves it.
    Stale,
    /// There is no file.
    Missing,
    /// A frame once, but damaged.
    Corrupt,
    /// Something that is no frame of this program.
    Foreign,
}

impl FileState {
    /// The word for it in reports.
    pub fn word(self) -> &'static str {
        match self {
            FileState::Done => "done",
            FileState::Stale => "stale",
            FileState::Missing => "missing",
            FileState::Corrupt => "corrupt",
            FileState::Foreign => "foreign",
        }
    }
}

/// The file of a frame made from that of one with the same pixels: to the byte what rendering it would give.
///
/// `None` if the file is not a whole picture of the same content.
pub fn relabelled(bytes: &[u8], provenance: &Provenance) -> Option<Vec<u8>> {
    let format = Format::of_bytes(bytes)?;
    let metadata = (format.checked_metadata)(bytes)?;
    let is_same = hash_of(&metadata) == Some(provenance.hash.to_string().as_str());
    let is_untouched = text_under(&metadata, PIXELS).is_some_and(|said| pixels_of(bytes).as_deref() == Some(said));
    (is_same && is_untouched).then(|| (format.relabel)(bytes, &metadata, &provenance_metadata(provenance)))?
}

fn hash_of(metadata: &Metadata) -> Option<&str> {
    text_under(metadata, HASH)
}

/// The digest of a file's pixels as they are.
fn pixels_of(bytes: &[u8]) -> Option<String> {
    (Format::of_bytes(bytes)?.pixels)(bytes).map(|digest| digest.to_string())
}

/// Looks at all bytes of the file: time stamps are not trusted.
///
/// The manifest's word for them is enough. Without it the picture itself must be whole and say what it is, and its pixels
/// must be those that it speaks of: other tools change pictures and leave their notes as they were. So a picture that was
/// packed more tightly is as good as before, and one that was painted over is not.
pub fn inspect(path: &Path, known: Option<&Entry>, wanted: &Provenance, input: &str) -> FileState {
    if std::fs::metadata(path).is_err_and(|e| e.kind() == ErrorKind::NotFound) {
        return FileState::Missing;
    }
    let Ok(bytes) = files::read_bytes(path, limits::FRAME_FILE_BYTES) else { return FileState::Foreign };
    if known.is_some_and(|entry| entry.is_of_another(input)) {
        return FileState::Foreign;
    }
    let as_known = |entry: &&Entry| entry.bytes == bytes.len() as u64 && entry.checksum == Digest::of(&bytes);
    let recorded = known.filter(as_known);
    if let Some(entry) = recorded {
        return if entry.provenance == *wanted { FileState::Done } else { FileState::Stale };
    }
    let format = Format::of_bytes(&bytes);
    match format.and_then(|format| (format.checked_metadata)(&bytes)) {
        Some(metadata) if metadata.starts_with(&provenance_metadata(wanted)) => {
            let said = text_under(&metadata, PIXELS);
            let contradicts = known.is_some_and(|entry| entry.provenance == *wanted && entry.pixels.as_deref() != said);
            let is_untouched = said.is_some() && !contradicts && pixels_of(&bytes).as_deref() == said;
            if is_untouched { FileState::Done } else { FileState::Stale }
        }
        Some(metadata) if hash_of(&metadata).is_some() => FileState::Stale,
        Some(_) => FileState::Foreign,
        None if known.is_some() || format.is_some_and(|format| (format.read_header)(&bytes).is_ok()) => {
            FileState::Corrupt
        }
        None => FileState::Foreign,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::Render;
    use crate::film::Film;
    use crate::output::formats::pixels_note;
    use crate::output::{exr::EXR, png::PNG};

    #[test]
    fn damage_anywhere_is_seen_with_and_without_a_manifest() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let provenance = Provenance { source: "a.rhai".into(), frame: 3, hash: Digest(77) };
        let film = Film { pixels: vec![[0.1, 0.5, 0.9]; 6], ..Film::new(3, 2) };
        let bytes = (PNG.encode)(&film, &Render::default(), &provenance_metadata(&provenance)).unwrap();
        let entry = Entry {
            file: "a.png".into(),
            provenance: provenance.clone(),
            bytes: bytes.len() as u64,
            checksum: Digest::of(&bytes),
            pixels: pixels_note(&bytes),
            input: Some("x/a.rhai".into()),
        };
        let looks = |bytes: &[u8], known: Option<&Entry>| {
            std::fs::write(&path, bytes).unwrap();
            inspect(&path, known, &provenance, "a.rhai")
        };
        assert_eq!(inspect(&path, Some(&entry), &provenance, "a.rhai"), FileState::Missing);
        for known in [None, Some(&entry)] {
            assert_eq!(looks(&bytes, known), FileState::Done);
            for at in 0..bytes.len() {
                let mut damaged = bytes.clone();
                damaged[at] ^= 0x10;
                assert!(matches!(looks(&damaged, known), FileState::Corrupt | FileState::Foreign), "byte {at}");
                assert!(matches!(looks(&bytes[..at], known), FileState::Corrupt | FileState::Foreign), "cut at {at}");
            }
            assert_ne!(looks(&[&bytes[..], b"x"].concat(), known), FileState::Done);
        }
        let other = Provenance { hash: Digest(78), ..provenance.clone() };
        let edited = (PNG.encode)(&film, &Render::default(), &provenance_metadata(&other)).unwrap();
        assert_eq!(looks(&edited, None), FileState::Stale);
        assert_eq!(looks(&edited, Some(&entry)), FileState::Stale);
        let another_frame = Provenance { frame: 4, ..provenance.clone() };
        let relabelled = (PNG.encode)(&film, &Render::default(), &provenance_metadata(&another_frame)).unwrap();
        assert_eq!(looks(&relabelled, None), FileState::Stale);
        let plain = (PNG.encode)(&film, &Render::default(), &Metadata::new()).unwrap();
        assert_eq!(looks(&plain, None), FileState::Foreign);
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        assert_eq!(inspect(&path, None, &provenance, "a.rhai"), FileState::Foreign);
    }

    #[test]
    fn damage_of_an_exr_file_is_seen_without_a_manifest_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let provenance = Provenance { source: "a.rhai".into(), frame: 3, hash: Digest(77) };
        let pixels = (0..2400).map(|i| [i as f32 / 7.0, 1.0 / (i + 1) as f32, 0.5]).collect();
        let film = Film { pixels, ..Film::new(60, 40) };
        let bytes = (EXR.encode)(&film, &Render::default(), &provenance_metadata(&provenance)).unwrap();
        let looks = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            inspect(&path, None, &provenance, "a.rhai")
        };
        assert_eq!(looks(&bytes), FileState::Done);
        for at in (bytes.len() / 2..bytes.len()).step_by(97) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert_ne!(looks(&damaged), FileState::Done, "byte {at} of {}", bytes.len());
            assert_ne!(looks(&bytes[..at]), FileState::Done, "cut at {at}");
        }
        let other = Provenance { hash: Digest(78), ..provenance.clone() };
        assert_eq!(
            looks(&(EXR.encode)(&film, &Render::default(), &provenance_metadata(&other)).unwrap()),
            FileState::Stale
        );
    }
}
