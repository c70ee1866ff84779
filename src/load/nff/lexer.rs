//! Words of an NFF text: separated by white space, `#` to the end of the line is a comment, even in mid-word.

/// A word and where it starts, in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word<'a> {
    pub text: &'a str,
    pub start: usize,
}

impl Word<'_> {
    /// The number that the word is; none that is not finite.
    pub fn number(&self) -> Option<f64> {
        let first = *self.text.as_bytes().first()?;
        if !(first.is_ascii_digit() || matches!(first, b'-' | b'+' | b'.')) {
            return None;
        }
        self.text.parse().ok().filter(|x: &f64| x.is_finite())
    }

    pub fn is_number(&self) -> bool {
        self.number().is_some()
    }

    /// Whether the word is a number that is none: NaN, an infinity, or beyond what a number can hold.
    pub fn is_not_finite(&self) -> bool {
        self.text.parse().is_ok_and(|x: f64| !x.is_finite())
    }

    /// Whether the word starts as a number does.
    pub fn is_like_a_number(&self) -> bool {
        let digits = self.text.trim_start_matches(['+', '-', '.']);
        digits.starts_with(|c: char| c.is_ascii_digit())
    }

    /// Two numbers without a space between: `0.90.166667` is 0.9 and 0.166667.
    pub fn glued(&self) -> Option<[f64; 2]> {
        let second = self.text.match_indices('.').nth(1)?.0;
        let split = if self.text[..second].ends_with(|c: char| c.is_ascii_digit()) { second - 1 } else { second };
        let part = |text: &str| Word { text, start: 0 }.number();
        Some([part(self.text.get(..split)?)?, part(self.text.get(split..)?)?])
    }

    /// The word as a message shows it.
    pub fn short(&self) -> String {
        self.text.chars().take(30).collect()
    }
}

pub struct Lexer<'a> {
    pub text: &'a str,
    at: usize,
    peeked: Option<Option<Word<'a>>>,
}

impl<'a> Lexer<'a> {
    pub fn new(text: &'a str) -> Self {
        Lexer { text, at: 0, peeked: None }
    }

    pub fn peek(&mut self) -> Option<Word<'a>> {
        if self.peeked.is_none() {
            self.peeked = Some(self.read());
        }
        self.peeked.flatten()
    }

    /// The next word.
    #[allow(clippy::should_implement_trait, reason = "an iterator could not be peeked into from its own records")]
    pub fn next(&mut self) -> Option<Word<'a>> {
        match self.peeked.take() {
            Some(word) => word,
            None => self.read(),
        }
    }

    /// Goes to the end of the line that a word stands on.
    pub fn end_of_line(&mut self, word: Word) {
        self.peeked = None;
        let start = word.start;
        self.at = self.text[start..].find('\n').map_or(self.text.len(), |i| start + i);
    }

    fn read(&mut self) -> Option<Word<'a>> {
        let bytes = self.text.as_bytes();
        loop {
            while bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
                self.at += 1;
            }
            if bytes.get(self.at) != Some(&b'#') {
                break;
            }
            while bytes.get(self.at).is_some_and(|b| *b != b'\n') {
                self.at += 1;
            }
        }
        let start = self.at;
        while bytes.get(self.at).is_some_and(|b| !b.is_ascii_whitespace() && *b != b'#') {
            self.at += 1;
        }
        (self.at > start).then(|| Word { text: &self.text[start..self.at], start })
    }
}
