//! The header of an EXR file as bytes: the same picture with other metadata.
//!
//! (OpenEXR file layout: magic number and version; attributes of name, type, length and value, behind the last of them a
//! zero; the places of all blocks, counted from the start of the file; the blocks.)

use crate::base::digest::Digest;
use crate::output::metadata::{Metadata, PIXELS};

/// Magic number, and version 2 of a plain picture: one part of scan lines with short names.
pub const START: [u8; 8] = [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];

/// Where the metadata lie in a file, and what lies behind the header.
struct ExrLayout {
    /// The length of the metadata, before their text.
    length: usize,
    /// Behind the text.
    end: usize,
    /// The places of the blocks, and the first block.
    table: usize,
    blocks: usize,
}

/// The bytes up to the next zero, and where it goes on behind that.
fn word(bytes: &[u8], from: usize) -> Option<(&[u8], usize)> {
    let rest = bytes.get(from..)?;
    let length = rest.iter().position(|byte| *byte == 0)?;
    Some((&rest[..length], from + length + 1))
}

fn layout(bytes: &[u8]) -> Option<ExrLayout> {
    if !bytes.starts_with(&START) {
        return None;
    }
    let (mut at, mut metadata) = (START.len(), None);
    loop {
        let (name, behind) = word(bytes, at)?;
        if name.is_empty() {
            at = behind;
            break;
        }
        let (kind, length) = word(bytes, behind)?;
        let size = u32::from_le_bytes(*bytes.get(length..)?.first_chunk()?);
        at = (length + 4).checked_add(size as usize)?;
        if name == b"comments" && kind == b"string" {
            metadata = Some((length, at));
        }
    }
    let (length, end) = metadata?;
    // The blocks begin where their places end.
    let blocks = usize::try_from(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?)).ok()?;
    let is_table = blocks > at && (blocks - at) % 8 == 0 && blocks <= bytes.len();
    is_table.then_some(ExrLayout { length, end, table: at, blocks })
}

/// The metadata as the text of the attribute.
pub fn text_of(metadata: &Metadata) -> String {
    let lines: Vec<String> = metadata.iter().map(|(keyword, text)| format!("{keyword}: {text}")).collect();
    lines.join("\n")
}

/// Puts the digest of the pixels in its place, the last of the metadata that a file was just written with.
pub fn set_pixels(bytes: &mut [u8], metadata: &Metadata, digest: Digest) {
    let text = digest.to_string();
    let Some(end) = layout(bytes).map(|layout| layout.end) else { return };
    if let Some(place) = bytes.get_mut(end.saturating_sub(text.len())..end)
        && metadata.last().is_some_and(|(keyword, _)| keyword == PIXELS)
    {
        place.copy_from_slice(text.as_bytes());
    }
}

/// The same picture with other values of some of its metadata: to the byte what encoding it with those would give.
///
/// `None` if it is not a plain picture with such metadata. Whether its blocks are whole is for others to see.
pub fn with_metadata(bytes: &[u8], metadata: &Metadata, changed: &Metadata) -> Option<Vec<u8>> {
    let ExrLayout { length, end, table, blocks } = layout(bytes)?;
    if bytes.get(length + 4..end)? != text_of(metadata).as_bytes() {
        return None;
    }
    let mut metadata = metadata.clone();
    for (keyword, text) in &mut metadata {
        if let Some((_, other)) = changed.iter().find(|(known, _)| known == keyword) {
            text.clone_from(other);
        }
    }
    let text = text_of(&metadata);
    let moved = (text.len() as u64).wrapping_sub((end - length - 4) as u64);
    let mut out = bytes[..length].to_vec();
    out.extend(u32::try_from(text.len()).ok()?.to_le_bytes());
    out.extend(text.as_bytes());
    out.extend(&bytes[end..table]);
    for place in bytes[table..blocks].chunks_exact(8) {
        let place = u64::from_le_bytes(*place.first_chunk()?);
        out.extend(place.wrapping_add(moved).to_le_bytes());
    }
    out.extend(&bytes[blocks..]);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::super::{EXR, read_header};
    use super::*;
    use crate::components::{Aov, Render};
    use crate::film::Film;

    #[test]
    fn a_picture_with_other_metadata_is_what_encoding_it_gives() {
        let mut film = Film { pixels: (0..3200).map(|i| [i as f32 / 1200.0, 0.3, 0.1]).collect(), ..Film::new(40, 80) };
        film.layers.make_room_for_features(3200);
        let metadata = |n: &str| -> Metadata {
            let entry = |keyword: &str, text: &str| (keyword.to_string(), text.to_string());
            vec![entry("Source", "\u{e4}.rhai"), entry("Frame", n), entry("Frames", "9")]
        };
        for (bit_depth, aovs) in [(16, vec![]), (32, vec![Aov::Depth, Aov::Normal])] {
            let render = Render { bit_depth, aovs, ..Render::default() };
            let [one, other] = ["1", "123"].map(|n| (EXR.encode)(&film, &render, &metadata(n)).unwrap());
            let changed = vec![("Frame".into(), "123".into())];
            assert!(with_metadata(&one, &metadata("1"), &changed) == Some(other.clone()));
            assert!(with_metadata(&other, &metadata("123"), &vec![("Frame".into(), "1".into())]) == Some(one.clone()));
            assert_eq!(read_header(&one).unwrap().metadata, metadata("1"));
            assert_eq!(with_metadata(&one, &metadata("2"), &changed), None);
            for cut in 0..one.len().min(600) {
                let _ = with_metadata(&one[..cut], &metadata("1"), &changed);
            }
        }
        assert_eq!(with_metadata(b"", &metadata("1"), &metadata("2")), None);
    }
}
