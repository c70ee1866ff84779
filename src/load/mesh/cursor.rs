//! Reading words and numbers out of bytes, as fast as a hundred megabytes want it.

/// A place in a text, between two words.
#[derive(Clone, Copy)]
pub struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
}

/// What stands where a number was expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// A number, perhaps not a finite one.
    Value(f64),
    /// A word that is none; its first and last byte.
    Word(usize, usize),
    /// The end of the line.
    Missing,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Cursor { bytes, at: 0 }
    }

    #[inline(always)]
    pub fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Passes over blanks inside of a line; a backslash at the end of one makes the next a part of it.
    #[inline(always)]
    pub fn blanks(&mut self) {
        loop {
            match self.peek() {
                Some(b' ' | b'\t' | 0x0b | 0x0c) => self.at += 1,
                Some(b'\\') if self.continues() => {}
                _ => return,
            }
        }
    }

    /// Passes over a backslash and the line end behind it, if that is what stands here.
    #[cold]
    fn continues(&mut self) -> bool {
        let mut end = self.at + 1;
        while matches!(self.bytes.get(end), Some(b' ' | b'\t')) {
            end += 1;
        }
        match (self.bytes.get(end), self.bytes.get(end + 1)) {
            (Some(b'\r'), Some(b'\n')) => self.at = end + 2,
            (Some(b'\r' | b'\n'), _) => self.at = end + 1,
            (None, _) => self.at = end,
            _ => return false,
        }
        true
    }

    /// Whether the line, or what of it is no comment, ends here.
    #[inline(always)]
    pub fn at_end(&self) -> bool {
        matches!(self.peek(), None | Some(b'\n' | b'\r' | b'#'))
    }

    /// Goes behind the end of the line; a backslash in a comment continues nothing.
    #[inline(always)]
    pub fn next_line(&mut self) {
        while let Some(byte) = self.peek() {
            self.at += 1;
            if byte == b'\n' {
                return;
            }
            if byte == b'\r' {
                self.at += usize::from(self.peek() == Some(b'\n'));
                return;
            }
        }
    }

    /// Passes over the rest of a line with all that continues it.
    pub fn skip_line(&mut self) {
        loop {
            self.blanks();
            match self.peek() {
                None | Some(b'\n' | b'\r' | b'#') => return self.next_line(),
                _ => self.at += 1,
            }
        }
    }

    /// Where the word that starts here ends.
    #[inline]
    pub fn word_end(&self) -> usize {
        let is_end = |b: &u8| matches!(b, b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c | b'#');
        self.bytes[self.at..].iter().position(is_end).map_or(self.bytes.len(), |i| self.at + i)
    }

    /// The word that starts here.
    pub fn word(&mut self) -> &'a [u8] {
        let (start, end) = (self.at, self.word_end());
        self.at = end;
        &self.bytes[start..end]
    }

    /// The rest of the line without a comment behind it, and without blanks at its ends: its first and last byte.
    pub fn rest(&mut self) -> [usize; 2] {
        self.blanks();
        let start = self.at;
        let is_comment = |at: usize| at == start || self.bytes[at - 1].is_ascii_whitespace();
        let mut end = start;
        while !matches!(self.bytes.get(end), None | Some(b'\n' | b'\r')) {
            if self.bytes[end] == b'#' && is_comment(end) {
                break;
            }
            end += 1;
        }
        self.at = end;
        [start, start + self.bytes[start..end].trim_ascii_end().len()]
    }

    /// The number that comes next in the line.
    #[inline(always)]
    pub fn number(&mut self) -> Number {
        self.blanks();
        if self.at_end() {
            return Number::Missing;
        }
        match decimal(&self.bytes[self.at..]) {
            Some((value, length)) if self.ends_at(self.at + length) => {
                self.at += length;
                Number::Value(value)
            }
            _ => self.strange(),
        }
    }

    #[inline(always)]
    fn ends_at(&self, at: usize) -> bool {
        let end = self.bytes.get(at);
        // `1.#QNAN` is no comment.
        matches!(end, None | Some(b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c | b'\\'))
            || (end == Some(&b'#') && at > 0 && self.bytes[at - 1] != b'.')
    }

    /// Infinities and what is no number, in all the ways in which systems write them; or a word.
    #[cold]
    fn strange(&mut self) -> Number {
        let start = self.at;
        let mut end = self.word_end();
        if self.bytes.get(end) == Some(&b'#') && self.bytes[start..end].ends_with(b".") {
            let inner = Cursor { bytes: self.bytes, at: end + 1 };
            end = inner.word_end();
        }
        self.at = end;
        let word = self.bytes[start..end].to_ascii_lowercase();
        let plain = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(&word);
        let is_nan = plain.starts_with(b"nan") || plain.starts_with(b"1.#qnan") || plain.starts_with(b"1.#snan");
        if is_nan || plain.starts_with(b"1.#ind") {
            return Number::Value(f64::NAN);
        }
        if plain.starts_with(b"inf") || plain.starts_with(b"1.#inf") {
            return Number::Value(if word.starts_with(b"-") { f64::NEG_INFINITY } else { f64::INFINITY });
        }
        Number::Word(start, end)
    }
}

/// Powers of ten that a double holds exactly.
const EXACT: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// The decimal number at the start of some bytes, rounded as `str::parse` rounds it, and how long it is.
///
/// A mantissa below 2^53 and a power of ten that is exact give the right double by one operation (Clinger 1990).
#[inline]
pub fn decimal(bytes: &[u8]) -> Option<(f64, usize)> {
    let mut at = usize::from(matches!(bytes.first(), Some(b'-' | b'+')));
    let negative = bytes.first() == Some(&b'-');
    let (mut mantissa, mut digits, mut exponent) = (0u64, 0u32, 0i32);
    while let Some(digit) = bytes.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        (digits, at) = (digits + 1, at + 1);
    }
    if bytes.get(at) == Some(&b'.') {
        at += 1;
        let start = at;
        while let Some(digit) = bytes.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
            (digits, at) = (digits + 1, at + 1);
        }
        exponent = -i32::try_from(at - start).ok()?;
    }
    if digits == 0 {
        return None;
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let mut end = at + 1 + usize::from(matches!(bytes.get(at + 1), Some(b'-' | b'+')));
        let (first, mut power) = (end, 0i32);
        while let Some(digit) = bytes.get(end).map(|b| b.wrapping_sub(b'0')).filter(|d| *d < 10) {
            power = power.saturating_mul(10).saturating_add(i32::from(digit));
            end += 1;
        }
        // Without digits it is no exponent, and the number ends before it.
        if end > first {
            exponent = exponent.saturating_add(if bytes[at + 1] == b'-' { -power } else { power });
            at = end;
        }
    }
    // 19 digits cannot have wrapped around; zeros in front only make this refuse too much.
    if digits <= 19 && mantissa < 1 << 53 && exponent.unsigned_abs() < EXACT.len() as u32 {
        let power = EXACT[exponent.unsigned_abs() as usize];
        let value = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
        return Some((if negative { -value } else { value }, at));
    }
    let text = std::str::from_utf8(&bytes[..at]).ok()?;
    text.parse().ok().map(|value| (value, at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_of_every_spelling_are_read() {
        let read = |text: &str| Cursor::new(text.as_bytes()).number();
        for text in ["1", "-.5", "1.", "+2e3", "1e-16", "0.1", "123456789012345678901234567890", "4.9e-324", "1e400"] {
            assert_eq!(read(text), Number::Value(text.parse().unwrap()), "{text}");
        }
        for text in ["nan", "-nan(ind)", "NaN", "1.#QNAN", "-1.#IND00"] {
            assert!(matches!(read(text), Number::Value(x) if x.is_nan()), "{text}");
        }
        assert_eq!(read("-1.#INF"), Number::Value(f64::NEG_INFINITY));
        assert_eq!(read("1.5#comment"), Number::Value(1.5));
        assert_eq!(read("1,5"), Number::Word(0, 3));
        assert_eq!(read("1.5f"), Number::Word(0, 4));
        assert_eq!(read("e5"), Number::Word(0, 2));
        assert_eq!(read(" \n"), Number::Missing);
        assert_eq!(read("# 1"), Number::Missing);
    }

    #[test]
    fn a_backslash_continues_a_line_and_a_comment_does_not() {
        let mut cursor = Cursor::new(b"1 \\\r\n 2 \\\n3 # 4 \\\n5");
        let numbers: Vec<Number> = (0..4).map(|_| cursor.number()).collect();
        assert_eq!(numbers, [Number::Value(1.0), Number::Value(2.0), Number::Value(3.0), Number::Missing]);
        cursor.next_line();
        assert_eq!(cursor.number(), Number::Value(5.0));
        let mut cursor = Cursor::new(b"skip \\\nthis too\n7");
        cursor.skip_line();
        assert_eq!(cursor.number(), Number::Value(7.0));
    }

    proptest! {
        #[test]
        fn decimals_are_read_as_the_standard_library_reads_them(text in "[+-]?[0-9]{0,24}\\.?[0-9]{0,24}([eE][+-]?[0-9]{1,3})?") {
            let expected: Option<f64> = text.parse().ok();
            let found = decimal(text.as_bytes());
            prop_assert_eq!(found.map(|(x, _)| x.to_bits()), expected.map(f64::to_bits), "{}", text);
            prop_assert!(found.is_none_or(|(_, length)| length == text.len()));
        }

        #[test]
        fn numbers_that_were_written_come_back(x in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            let text = format!("{x}");
            prop_assert_eq!(decimal(text.as_bytes()).unwrap().0.to_bits(), x.to_bits());
        }
    }
}
