//! Texts as people save them: byte order marks, encodings, and characters that only look like those that are meant.

use super::diagnostics::{Diagnostic, Place};

/// The text of some bytes: UTF-8, or else Windows-1252, without a byte order mark.
///
/// # Errors
/// UTF-16 and UTF-32, which are named.
pub fn decode(bytes: Vec<u8>, file: &str) -> Result<String, Diagnostic> {
    let wide = match bytes[..] {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => Some("UTF-32"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("UTF-16"),
        // Without a mark: every other byte of plain letters is zero.
        [a, 0, b, 0, ..] | [0, a, 0, b, ..] if a != 0 && b != 0 => Some("UTF-16"),
        _ => None,
    };
    if let Some(encoding) = wide {
        let place = Place { line: 1, column: 1, ..Place::file(file) };
        return Err(Diagnostic::error(format!("the file is in {encoding}")).at(place).help("save it in UTF-8"));
    }
    let text = String::from_utf8(bytes);
    let mut text = text.unwrap_or_else(|error| error.as_bytes().iter().map(|byte| western(*byte)).collect());
    if text.starts_with('\u{feff}') {
        text.drain(..'\u{feff}'.len_utf8());
    }
    Ok(text)
}

/// The character of a byte in Windows-1252, which is Latin-1 with letters and signs where that has controls.
fn western(byte: u8) -> char {
    const SIGNS: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘',
        '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => SIGNS[usize::from(byte - 0x80)],
        _ => char::from(byte),
    }
}

/// A character that looks like one of a scene or a script: what it is called, and what is meant.
fn double(c: char) -> Option<(&'static str, &'static str)> {
    Some(match c {
        '\u{a0}' | '\u{202f}' | '\u{2007}' => ("a no-break space", "a plain space"),
        '\u{2000}'..='\u{2006}' | '\u{2008}'..='\u{200a}' | '\u{205f}' | '\u{3000}' => {
            ("a wide space", "a plain space")
        }
        '\u{200b}'..='\u{200f}' | '\u{2060}' | '\u{feff}' | '\u{ad}' => ("an invisible character", "nothing"),
        '“' | '”' | '„' | '‟' | '«' | '»' | '″' | '＂' => ("a curly quote", "a plain `\"`"),
        '‘' | '’' | '‚' | '‛' | '′' | '＇' => ("a curly quote", "a plain `'`, or `\"` around a text"),
        '−' | '–' | '—' | '‐' | '‑' | '－' => ("a dash", "a plain `-`"),
        '，' | '、' => ("a wide comma", "a plain `,`"),
        '．' => ("a wide point", "a plain `.`"),
        '：' => ("a wide colon", "a plain `:`"),
        '；' | '\u{37e}' => ("a wide semicolon", "a plain `;`"),
        '（' | '）' | '［' | '］' | '｛' | '｝' => ("a wide bracket", "a plain bracket"),
        '×' => ("a multiplication sign", "`*`"),
        _ => return None,
    })
}

/// Where characters that only look like those of a scene or a script stand, outside of quotes and comments.
pub fn doubles(text: &str, file: &str) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut rest = text.char_indices().peekable();
    while let Some((at, c)) = rest.next() {
        let after = &text[at + c.len_utf8()..];
        let skipped = match c {
            '"' | '`' => quoted(after, c),
            '\'' => letter(after),
            'r' if after.starts_with(['"', '#']) && !before_is_word(text, at) => raw(after),
            '/' if after.starts_with('/') => after.find('\n').unwrap_or(after.len()),
            '/' if after.starts_with('*') => block(after),
            _ => 0,
        };
        if skipped > 0 {
            let end = at + c.len_utf8() + skipped;
            while rest.next_if(|(i, _)| *i < end).is_some() {}
            continue;
        }
        if let Some((name, meant)) = double(c) {
            let place = Place::of_span(file, text, at, at + c.len_utf8());
            let message = format!("{name} (U+{:04X}) stands here", u32::from(c));
            found.push(Diagnostic::error(message).at(place).help(format!("write {meant} instead")));
        }
    }
    found
}

fn before_is_word(text: &str, at: usize) -> bool {
    text[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || c == '_')
}

/// Length of a text behind its first quote, with the last one.
fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (i, c) in text.char_indices() {
        if escaped {
            escaped = false;
        } else if c == '\\' && quote == '"' {
            escaped = true;
        } else if c == quote {
            return i + c.len_utf8();
        }
    }
    text.len()
}

/// Length of a single character behind its first quote; 0 if it is none.
fn letter(text: &str) -> usize {
    let mut inside = text.char_indices();
    match inside.next() {
        Some((_, '\\')) => text.get(2..).and_then(|rest| rest.find('\'')).filter(|i| *i < 10).map_or(0, |i| i + 3),
        Some((_, c)) if text[c.len_utf8()..].starts_with('\'') => c.len_utf8() + 1,
        _ => 0,
    }
}

/// Length of a raw text behind its `r`; 0 if it is none.
fn raw(text: &str) -> usize {
    let hashes = text.chars().take_while(|c| *c == '#').count();
    let Some(body) = text[hashes..].strip_prefix('"') else { return 0 };
    let close = format!("\"{}", "#".repeat(hashes));
    hashes + 1 + body.find(&close).map_or(body.len(), |i| i + close.len())
}

/// Length of a block comment behind its first stroke; they nest.
fn block(text: &str) -> usize {
    let (bytes, mut depth, mut i) = (text.as_bytes(), 1usize, 1);
    while i + 1 < bytes.len() {
        match &bytes[i..i + 2] {
            b"/*" => (depth, i) = (depth + 1, i + 2),
            b"*/" => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            return i;
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn marks_are_dropped_and_wide_encodings_named() {
        let read = |bytes: &[u8]| decode(bytes.to_vec(), "a.ron").map_err(|d| d.to_string());
        assert_eq!(read(b"\xef\xbb\xbf(a)"), Ok("(a)".into()));
        assert_eq!(read("(ä)".as_bytes()), Ok("(ä)".into()));
        assert_eq!(read(b"(\xe4 \x93x\x94)"), Ok("(ä “x”)".into()));
        for wide in [&b"\xff\xfe(\0a\0"[..], b"\xfe\xff\0(\0a", b"(\0a\0", b"\0(\0a"] {
            let said = read(wide).unwrap_err();
            assert!(said.starts_with("a.ron:1:1: error: the file is in UTF-16") && said.contains("UTF-8"), "{said}");
        }
        assert!(read(b"\xff\xfe\0\0(\0\0\0").unwrap_err().contains("UTF-32"));
        assert_eq!(read(b""), Ok(String::new()));
    }

    #[test]
    fn look_alikes_are_named_where_they_stand() {
        let text = "(\n  radius:\u{a0}1, // it’s fine\n  name: “a”, /* – /* – */ – */ b: \"„x“ \\\" –\", c: r#\"’\"#, d: −1\n)";
        let said: Vec<String> = doubles(text, "a.ron").iter().map(ToString::to_string).collect();
        let starts = ["a.ron:2:10: error: a no-break space (U+00A0)", "a.ron:3:9: error: a curly quote (U+201C)"];
        let more = ["a.ron:3:11: error: a curly quote (U+201D)", "error: a dash (U+2212)"];
        assert_eq!(said.len(), 4, "{said:#?}");
        for (said, start) in said.iter().zip(starts.iter().chain(&more)) {
            assert!(said.contains(start), "{said}");
        }
        assert!(doubles("let x = `–` + '\"' + '–' + '\\''; // –", "a.rhai").is_empty());
    }

    proptest! {
        #[test]
        fn any_text_is_looked_through(text in "[\\PC\\n\"'`/*\\\\#r”–]{0,60}") {
            doubles(&text, "a");
        }
    }
}
