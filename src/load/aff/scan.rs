//! Words of an AFF text: separated by white space; `#` or `%` start a comment to the end of the line; brackets stand alone.

use crate::base::diagnostics::Place;

/// A word and where it starts, in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffWord<'a> {
    pub text: &'a str,
    pub start: usize,
}

impl AffWord<'_> {
    /// The number that the word is; none that is not finite as `f32`, in which all that is read is kept.
    pub fn number(&self) -> Option<f64> {
        let first = *self.text.as_bytes().first()?;
        if !(first.is_ascii_digit() || matches!(first, b'-' | b'+' | b'.')) {
            return None;
        }
        self.text.parse().ok().filter(|x: &f64| (*x as f32).is_finite())
    }

    /// The word as a message shows it.
    pub fn short(&self) -> String {
        self.text.chars().take(30).collect()
    }
}

/// A text that is read word by word.
pub struct Scan<'a> {
    text: &'a str,
    file: String,
    at: usize,
    peeked: Option<Option<AffWord<'a>>>,
    /// Brackets of this file that are open.
    pub depth: usize,
}

impl<'a> Scan<'a> {
    pub fn new(text: &'a str, file: &str) -> Self {
        let at = if text.starts_with('\u{feff}') { 3 } else { 0 };
        Scan { text, file: file.to_string(), at, peeked: None, depth: 0 }
    }

    pub fn peek(&mut self) -> Option<AffWord<'a>> {
        if self.peeked.is_none() {
            self.peeked = Some(self.read());
        }
        self.peeked.flatten()
    }

    /// The next word.
    #[allow(clippy::should_implement_trait, reason = "an iterator could not be peeked into from its own records")]
    pub fn next(&mut self) -> Option<AffWord<'a>> {
        match self.peeked.take() {
            Some(word) => word,
            None => self.read(),
        }
    }

    /// Bytes that are left.
    pub fn rest(&self) -> usize {
        self.text.len() - self.at
    }

    /// Where the text ends.
    pub fn end(&self) -> AffWord<'static> {
        AffWord { text: "", start: self.text.len() }
    }

    pub fn place(&self, word: AffWord) -> Place {
        Place::of_span(self.file.as_str(), self.text, word.start, word.start + word.text.len())
    }

    fn read(&mut self) -> Option<AffWord<'a>> {
        let bytes = self.text.as_bytes();
        loop {
            while bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
                self.at += 1;
            }
            if !matches!(bytes.get(self.at), Some(b'#' | b'%')) {
                break;
            }
            while bytes.get(self.at).is_some_and(|b| *b != b'\n') {
                self.at += 1;
            }
        }
        let start = self.at;
        if matches!(bytes.get(start), Some(b'{' | b'}')) {
            self.at += 1;
        } else {
            let part = |b: &u8| !b.is_ascii_whitespace() && !matches!(b, b'#' | b'%' | b'{' | b'}');
            while bytes.get(self.at).is_some_and(part) {
                self.at += 1;
            }
        }
        (self.at > start).then(|| AffWord { text: &self.text[start..self.at], start })
    }
}
