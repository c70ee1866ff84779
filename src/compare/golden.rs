//! Golden pictures: small PNG files that carry the hash of the frame that they were, and what it was made from.
//!
//! They are never written by a comparison; whoever accepts a picture calls [`write()`].

use std::path::Path;

use super::description::FrameDescription;
use crate::base::diagnostics::{Cause, Diagnostic};
use crate::base::digest::Digest;
use crate::base::{files, limits};
use crate::output::{
    Format, LayeredPicture, Metadata, compressed_note_bytes, read_layered, small_png_of, write_atomic,
};

/// Keyword of the description of the frame; what a picture says of itself beside it is as a frame's file has it.
const SCENE: &str = "Scene";
const HASH: &str = "Hash";

/// A golden picture, or a new one that may become golden.
#[derive(Clone, Debug, PartialEq)]
pub struct GoldenPicture {
    /// Its pixels, all layers.
    pub picture: LayeredPicture,
    /// What it says of its making, without the description.
    pub metadata: Metadata,
    /// What it was made from, if it says so.
    pub description: Option<FrameDescription>,
}

impl GoldenPicture {
    /// Reads a PNG file.
    ///
    /// # Errors
    /// A file that is missing, too large or not a picture.
    pub fn read(path: &Path) -> Result<Self, Diagnostic> {
        let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES)?;
        let cannot = |why: &str| Diagnostic::error(format!("cannot read {}: {why}", path.display())).because(Cause::Io);
        let picture = read_layered(&bytes).map_err(|e| cannot(&e))?;
        let mut metadata = checked_metadata(&bytes).unwrap_or_default();
        let description = metadata.iter().find(|(keyword, _)| keyword == SCENE);
        let description = description.and_then(|(_, text)| FrameDescription::parse(text));
        metadata.retain(|(keyword, _)| keyword != SCENE);
        Ok(GoldenPicture { picture, metadata, description })
    }
}

/// What a picture says of its making, if no byte of it is damaged.
fn checked_metadata(bytes: &[u8]) -> Option<Metadata> {
    Format::of_bytes(bytes).and_then(|format| (format.checked_metadata)(bytes))
}

/// The hash that a golden carries; `None` for a file that is not whole, or was not made by this program.
pub fn hash_of(path: &Path) -> Option<Digest> {
    let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES).ok()?;
    let metadata = checked_metadata(&bytes)?;
    metadata.iter().find(|(keyword, _)| keyword == HASH)?.1.parse().ok()
}

/// The description of a frame in the best detail that a golden may carry, as text.
pub fn fitting_text(description: &FrameDescription) -> String {
    let is_small = |text: &str| compressed_note_bytes(SCENE, text) <= limits::DESCRIPTION_BYTES;
    let best = description.fitting(is_small);
    best.to_text()
}

/// Writes a golden: the pixels of a picture and what it says of its making, with the description of its frame.
///
/// # Errors
/// A picture that a golden cannot be; a file that cannot be written.
pub fn write(path: &Path, picture: &GoldenPicture, description: Option<&str>) -> Result<(), Diagnostic> {
    let long: Metadata = description.map(|text| (SCENE.to_string(), text.to_string())).into_iter().collect();
    let bytes = small_png_of(&picture.picture, &picture.metadata, &long)
        .map_err(|e| Diagnostic::error(format!("{} cannot be a golden picture: {e}", path.display())))?;
    write_atomic(path, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::description::{Detail, Fact, Topic};
    use crate::components::Render;
    use crate::film::Film;
    use crate::output::formats::FORMATS;

    fn crowd(entities: usize) -> FrameDescription {
        let fact = |i: usize| {
            let number = crate::base::random::mix(i as u64);
            Fact {
                topic: Topic::Entity,
                subject: format!("entity {i}"),
                field: "translation".into(),
                value: format!("({}, {})", number % 100_003, number / 7 % 99_991),
            }
        };
        FrameDescription { detail: Detail::Values, facts: (0..entities).map(fact).collect() }
    }

    #[test]
    fn a_golden_carries_its_hash_and_what_it_was_made_from() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let film = Film { pixels: vec![[0.1, 0.5, 0.9]; 6], ..Film::new(3, 2) };
        let metadata: Metadata = vec![(HASH.into(), Digest(77).to_string()), ("Frame".into(), "3".into())];
        write_atomic(&at("new.png"), &(FORMATS[0].encode)(&film, &Render::default(), &metadata).unwrap()).unwrap();
        let new = GoldenPicture::read(&at("new.png")).unwrap();
        assert_eq!(new.description, None);
        let text = fitting_text(&crowd(3));
        write(&at("golden.png"), &new, Some(&text)).unwrap();
        let golden = GoldenPicture::read(&at("golden.png")).unwrap();
        assert_eq!((&golden.picture, &golden.metadata), (&new.picture, &new.metadata));
        assert!(metadata.iter().all(|entry| golden.metadata.contains(entry)));
        assert_eq!(golden.description, Some(crowd(3)));
        assert_eq!(hash_of(&at("golden.png")), Some(Digest(77)));
        assert_eq!(hash_of(&at("nowhere.png")), None);
        let mut damaged = std::fs::read(at("golden.png")).unwrap();
        let middle = damaged.len() / 2;
        damaged[middle] ^= 1;
        std::fs::write(at("golden.png"), &damaged).unwrap();
        assert_eq!(hash_of(&at("golden.png")), None, "a damaged golden vouches for nothing");
    }

    #[test]
    fn the_description_is_small_whatever_the_scene() {
        let detail = |entities: usize| {
            let text = fitting_text(&crowd(entities));
            let bytes = compressed_note_bytes(SCENE, &text);
            assert!(bytes <= limits::DESCRIPTION_BYTES, "{entities} entities: {bytes} bytes");
            FrameDescription::parse(&text).unwrap().detail
        };
        assert_eq!([10, 1_500, 50_000].map(detail), [Detail::Values, Detail::Digests, Detail::Parts]);
    }
}
