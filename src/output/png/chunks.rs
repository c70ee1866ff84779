//! PNG as a row of chunks: whether each is whole, and the same picture with other metadata.
//!
//! (PNG specification, third edition, chapter 5: length, type, data, and a CRC over type and data.)

use crate::output::metadata::Metadata;

/// What every PNG file starts with.
pub const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];

struct Chunk<'a> {
    kind: [u8; 4],
    /// Length, type, data and CRC.
    bytes: &'a [u8],
}

/// The chunks of a PNG file, if all are whole and the file ends with its last.
fn chunks(bytes: &[u8]) -> Option<Vec<Chunk<'_>>> {
    let mut rest = bytes.strip_prefix(&SIGNATURE)?;
    let mut found = Vec::new();
    while !rest.is_empty() {
        let (length, _) = rest.split_first_chunk::<4>()?;
        let length = u32::from_be_bytes(*length) as usize;
        let (chunk, behind) = rest.split_at_checked(length.checked_add(12)?)?;
        let (covered, crc) = chunk[4..].split_last_chunk::<4>()?;
        if crc32fast::hash(covered) != u32::from_be_bytes(*crc) {
            return None;
        }
        found.push(Chunk { kind: *covered.first_chunk()?, bytes: chunk });
        rest = behind;
    }
    (found.first()?.kind == *b"IHDR" && found.last()?.kind == *b"IEND").then_some(found)
}

/// Whether every chunk is whole and the file ends with its last.
pub fn are_whole(bytes: &[u8]) -> bool {
    chunks(bytes).is_some()
}

/// The same picture with other values of some of its metadata: to the byte what encoding it with those would give.
///
/// `None` if it is not a whole PNG file.
pub fn with_metadata(bytes: &[u8], changed: &Metadata) -> Option<Vec<u8>> {
    let mut out = SIGNATURE.to_vec();
    for chunk in chunks(bytes)? {
        let known = changed.iter().find(|(keyword, _)| {
            chunk.kind == *b"iTXt" && chunk.bytes[8..].starts_with(keyword.as_bytes()) && {
                chunk.bytes.get(8 + keyword.len()) == Some(&0)
            }
        });
        match known {
            Some((keyword, text)) => write_itxt(&mut out, keyword, text),
            None => out.extend(chunk.bytes),
        }
    }
    Some(out)
}

/// An uncompressed text chunk without a language (chapter 11.3.3.4).
fn write_itxt(out: &mut Vec<u8>, keyword: &str, text: &str) {
    let data = [b"iTXt", keyword.as_bytes(), b"\0\0\0\0\0", text.as_bytes()].concat();
    out.extend((data.len() as u32 - 4).to_be_bytes());
    out.extend(&data);
    out.extend(crc32fast::hash(&data).to_be_bytes());
}

#[cfg(test)]
mod tests {
    use super::super::{checked_metadata, encode};
    use super::*;
    use crate::components::Render;
    use crate::film::Film;

    #[test]
    fn a_picture_with_other_metadata_is_what_encoding_it_gives() {
        let film = Film { pixels: (0..1200).map(|i| [i as f32 / 1200.0, 0.3, 0.1]).collect(), ..Film::new(40, 30) };
        let metadata = |n: &str| -> Metadata {
            let entry = |keyword: &str, text: &str| (keyword.to_string(), text.to_string());
            vec![entry("Source", "\u{e4}.rhai"), entry("Frame", n), entry("Frames", "9")]
        };
        for bit_depth in [8, 16] {
            let render = Render { bit_depth, ..Render::default() };
            let one = encode(&film, &render, &metadata("1")).unwrap();
            let other = encode(&film, &render, &metadata("123")).unwrap();
            assert_eq!(with_metadata(&one, &vec![("Frame".into(), "123".into())]), Some(other));
            assert_eq!(checked_metadata(&one), Some(metadata("1")));
            assert_eq!(with_metadata(&one[..one.len() - 1], &metadata("2")), None);
        }
        assert_eq!(checked_metadata(b""), None);
    }
}
