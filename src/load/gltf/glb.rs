//! The binary form of glTF: a header, a chunk of JSON, and a chunk of what its buffers hold.

use std::ops::Range;

/// The chunks of a .glb: where its JSON stands, and its binary data if there are any.
pub fn chunks(bytes: &[u8]) -> Result<(Range<usize>, Option<Range<usize>>), String> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(format!("binary glTF of version {version} is not read; version 2 is")),
        None => return Err("the file ends in its header".into()),
    }
    let declared = word(8).ok_or("the file ends in its header")? as usize;
    if declared > bytes.len() {
        return Err(format!("the file has {} bytes of the {declared} it declares", bytes.len()));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at + 8 <= declared {
        let (Some(length), Some(kind)) = (word(at), word(at + 4)) else { break };
        let range = at + 8..(at + 8).saturating_add(length as usize);
        if range.end > declared {
            return Err(format!("a chunk of {length} bytes at byte {at} goes on past the end of the file"));
        }
        at = range.end;
        match kind.to_le_bytes() {
            [b'J', b'S', b'O', b'N'] if json.is_none() => json = Some(range),
            [b'B', b'I', b'N', 0] if binary.is_none() => binary = Some(range),
            _ => {}
        }
    }
    json.map(|json| (json, binary)).ok_or_else(|| "the file has no chunk of JSON".into())
}
