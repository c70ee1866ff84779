//! A file that is being read: places in it, and what of it is not used.

use crate::base::diagnostics::{Diagnostic, Place};

/// The bytes of a file and what messages call it.
#[derive(Clone, Copy)]
pub struct SourceFile<'a> {
    pub file: &'a str,
    pub bytes: &'a [u8],
}

impl<'a> SourceFile<'a> {
    /// The place of some bytes: line and column, and the line itself.
    pub fn place(&self, start: usize, end: usize) -> Place {
        let start = start.min(self.bytes.len());
        let before = &self.bytes[..start];
        let line_start = before.iter().rposition(|b| matches!(b, b'\n' | b'\r')).map_or(0, |i| i + 1);
        let line_end = self.bytes[start..].iter().position(|b| matches!(b, b'\n' | b'\r'));
        let line_end = line_end.map_or(self.bytes.len(), |i| start + i);
        let count = |bytes: &[u8]| decode(bytes).chars().count() as u32;
        Place {
            file: self.file.into(),
            line: line_ends(before) + 1,
            column: count(&self.bytes[line_start..start]) + 1,
            width: count(&self.bytes[start..end.clamp(start, line_end)]).max(1),
            source: decode(&self.bytes[line_start..line_end]),
        }
    }

    pub fn error(&self, start: usize, end: usize, message: impl Into<String>) -> Diagnostic {
        Diagnostic::error(message).at(self.place(start, end))
    }

    /// An error of the file as a whole.
    pub fn whole(&self, message: impl Into<String>) -> Diagnostic {
        Diagnostic::error(message).at(Place::file(self.file))
    }

    /// Some bytes as a message shows them.
    pub fn short(&self, start: usize, end: usize) -> String {
        let end = end.min(self.bytes.len());
        decode(&self.bytes[start.min(end)..end]).chars().take(30).collect()
    }
}

/// Line ends: `\n`, `\r\n` or `\r` alone.
fn line_ends(bytes: &[u8]) -> u32 {
    let lone = |i: usize| bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n');
    let ends = (0..bytes.len()).filter(|i| bytes[*i] == b'\n' || lone(*i));
    ends.count() as u32
}

/// Text as UTF-8, or else as Latin-1.
pub fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_string(),
        Err(_) => bytes.iter().map(|b| char::from(*b)).collect(),
    }
}

/// What a reader passes over: a warning for each kind of it, at its first place.
#[derive(Default)]
pub struct Notes(Vec<Note>);

struct Note {
    kind: String,
    count: u64,
    warning: Diagnostic,
}

/// Kinds that are told apart: past this a file is no longer what its name says, and one more warning says nothing.
const KINDS: usize = 100;

impl Notes {
    /// Counts something of a kind; `warning` is asked for the first of them.
    pub fn add(&mut self, kind: &str, warning: impl FnOnce() -> Diagnostic) {
        if let Some(note) = self.0.iter_mut().find(|note| note.kind == kind) {
            note.count += 1;
        } else if self.0.len() < KINDS {
            self.0.push(Note { kind: kind.to_string(), count: 1, warning: warning() });
        }
    }

    /// Adds what another has found.
    pub fn take(&mut self, mut other: Notes) {
        self.0.append(&mut other.0);
    }

    /// The warnings in the order of the file, with how often there was reason for them.
    pub fn into_warnings(self) -> Vec<Diagnostic> {
        let told = |Note { count, mut warning, .. }: Note| {
            if count > 1 {
                warning.message = format!("{} ({count} times in this file)", warning.message);
            }
            warning
        };
        let mut warnings: Vec<Diagnostic> = self.0.into_iter().map(told).collect();
        warnings.sort_by_key(|warning| warning.place.as_ref().map(|place| (place.line, place.column)));
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_every_line_end_and_characters() {
        let source = SourceFile { file: "a.obj", bytes: b"v 1\r\nv 2\rv \xfc 3\nv 4" };
        let place = source.place(13, 14);
        assert_eq!((place.line, place.column, place.width), (3, 5, 1));
        assert_eq!(place.source, "v ü 3");
        assert_eq!(source.place(99, 200).line, 4);
    }

    #[test]
    fn what_happens_often_is_told_once() {
        let mut notes = Notes::default();
        (0..3).for_each(|_| notes.add("l", || Diagnostic::warning("`l` is not used")));
        let warnings = notes.into_warnings();
        assert_eq!(warnings[0].message, "`l` is not used (3 times in this file)");
    }
}
