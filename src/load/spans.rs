//! Where things stand in a RON text: a tolerant tree of keys and values with their byte offsets.
//!
//! It is built only when something is wrong, to say where. It knows brackets, strings, comments and words, not types.

use crate::base::diagnostics::suggestion;
use crate::base::limits;

/// A value and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct SyntaxNode {
    /// Offset of its first byte.
    pub start: usize,
    /// Offset behind its last byte.
    pub end: usize,
    /// Elements or fields, in the order of the text.
    pub children: Vec<SyntaxField>,
}

/// One part of a value: an element, or a field with its key.
#[derive(Clone, Debug, PartialEq)]
pub struct SyntaxField {
    /// The key as it is meant: without quotes.
    pub key: Option<String>,
    /// Offset of the first byte of the key, or of the value if there is none.
    pub key_start: usize,
    /// Offset behind the key.
    pub key_end: usize,
    /// The element, or what stands behind the key.
    pub value: SyntaxNode,
}

/// A text that is not even brackets in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broken {
    /// Offset of the mistake.
    pub at: usize,
    /// What is wrong there.
    pub message: String,
}

/// A step down the tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// To the field of this name.
    Key(String),
    /// To this element, from 0.
    Index(usize),
}

impl SyntaxNode {
    /// The field of a name, if it is there.
    pub fn field(&self, key: &str) -> Option<&SyntaxField> {
        self.children.iter().find(|child| child.key.as_deref() == Some(key))
    }

    /// The span of the deepest part of a path that is there; of the key, if the last step is one and `key` is asked.
    pub fn locate(&self, path: &[Step]) -> (usize, usize) {
        let mut node = self;
        for step in path {
            let next = match step {
                Step::Key(key) => node.field(key),
                Step::Index(i) => node.children.get(*i),
            };
            match next {
                Some(child) => node = &child.value,
                None => break,
            }
        }
        (node.start, node.end)
    }
}

/// Reads the one value that a text holds.
pub fn parse(text: &str) -> Result<SyntaxNode, Broken> {
    let mut reader = SyntaxReader { text, at: 0 };
    reader.blank()?;
    while text[reader.at..].starts_with("#!") {
        reader.at = text[reader.at..].find(']').map_or(text.len(), |i| reader.at + i + 1);
        reader.blank()?;
    }
    if reader.at == text.len() {
        return Err(Broken { at: 0, message: "the file is empty; it starts with `(`".into() });
    }
    let node = reader.value(0)?;
    reader.blank()?;
    if reader.at < text.len() {
        return Err(Broken { at: reader.at, message: "nothing may follow the closing bracket".into() });
    }
    Ok(node)
}

struct SyntaxReader<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> SyntaxReader<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn broken(&self, at: usize, message: impl Into<String>) -> Broken {
        Broken { at, message: message.into() }
    }

    /// Passes over white space and comments.
    fn blank(&mut self) -> Result<(), Broken> {
        loop {
            let trimmed = self.rest().trim_start();
            self.at = self.text.len() - trimmed.len();
            if trimmed.starts_with("//") {
                self.at += trimmed.find('\n').unwrap_or(trimmed.len());
            } else if trimmed.starts_with("/*") {
                self.at += self.block_comment()?;
            } else {
                return Ok(());
            }
        }
    }

    /// Length of the block comment here; they nest.
    fn block_comment(&self) -> Result<usize, Broken> {
        let (rest, mut depth, mut i) = (self.rest().as_bytes(), 0usize, 0);
        while i + 1 < rest.len() {
            match &rest[i..i + 2] {
                b"/*" => (depth, i) = (depth + 1, i + 2),
                b"*/" => (depth, i) = (depth - 1, i + 2),
                _ => i += 1,
            }
            if depth == 0 {
                return Ok(i);
            }
        }
        Err(self.broken(self.at, "this comment is never closed"))
    }

    /// A value: an optional word, then brackets, a string or a number.
    fn value(&mut self, depth: usize) -> Result<SyntaxNode, Broken> {
        if depth > limits::NESTING {
            return Err(self.broken(self.at, format!("brackets nest deeper than {}", limits::NESTING)));
        }
        let start = self.at;
        let mut node = SyntaxNode { start, end: start, children: Vec::new() };
        if self.string()? {
            node.end = self.at;
            return Ok(node);
        }
        if self.word() {
            node.end = self.at;
            let back = self.at;
            self.blank()?;
            if self.peek() != Some('(') {
                self.at = back;
                return Ok(node);
            }
        }
        let close = match self.peek() {
            Some('(') => ')',
            Some('[') => ']',
            Some('{') => '}',
            Some(c) => return Err(self.broken(self.at, format!("unexpected `{c}`"))),
            None => return Err(self.broken(self.at, "the file ends where a value was expected")),
        };
        let open = self.at;
        self.at += 1;
        self.children(&mut node, open, close, depth)?;
        node.end = self.at;
        Ok(node)
    }

    fn children(&mut self, node: &mut SyntaxNode, open: usize, close: char, depth: usize) -> Result<(), Broken> {
        loop {
            self.blank()?;
            match self.peek() {
                Some(c) if c == close => {
                    self.at += 1;
                    return Ok(());
                }
                None => {
                    let bracket = &self.text[open..open + 1];
                    return Err(self.broken(open, format!("this `{bracket}` is never closed: the file ends before")));
                }
                Some(c @ (')' | ']' | '}')) => {
                    return Err(self.broken(self.at, format!("found `{c}` where `{close}` or a value was expected")));
                }
                _ => {}
            }
            let child = self.child(depth)?;
            node.children.push(child);
            self.blank()?;
            match self.peek() {
                Some(',') => self.at += 1,
                Some(c) if c == close => {}
                None => {}
                Some(c @ (')' | ']' | '}')) => {
                    return Err(self.broken(self.at, format!("found `{c}` where `{close}` was expected")));
                }
                Some(_) => {
                    let end = node.children.last().map_or(self.at, |child| child.value.end);
                    return Err(self.broken(end, "a comma is missing here"));
                }
            }
        }
    }

    fn child(&mut self, depth: usize) -> Result<SyntaxField, Broken> {
        let first = self.value(depth + 1)?;
        let back = self.at;
        self.blank()?;
        if self.peek() != Some(':') {
            self.at = back;
            return Ok(SyntaxField { key: None, key_start: first.start, key_end: first.start, value: first });
        }
        self.at += 1;
        self.blank()?;
        let value = self.value(depth + 1)?;
        let key = self.text[first.start..first.end].trim_matches('"').to_string();
        Ok(SyntaxField { key: Some(key), key_start: first.start, key_end: first.end, value })
    }

    /// Passes over a string, raw string or character, if one starts here.
    fn string(&mut self) -> Result<bool, Broken> {
        let (start, rest) = (self.at, self.rest());
        let hashes = rest.strip_prefix('r').map_or(0, |r| r.chars().take_while(|c| *c == '#').count());
        if rest.starts_with('r') && rest[1 + hashes..].starts_with('"') {
            let close = format!("\"{}", "#".repeat(hashes));
            let body = 2 + hashes;
            let end = rest[body..].find(&close).ok_or_else(|| self.broken(start, "this text is never closed"))?;
            self.at += body + end + close.len();
            return Ok(true);
        }
        let Some(quote @ ('"' | '\'')) = self.peek() else { return Ok(false) };
        let mut escaped = false;
        let inside = rest.char_indices().skip(1);
        for (i, c) in inside {
            if escaped {
                escaped = false;
            } else if c == '\\' {
                escaped = true;
            } else if c == quote {
                self.at += i + 1;
                return Ok(true);
            } else if c == '\n' && quote == '\'' {
                break;
            }
        }
        Err(self.broken(start, "this text is never closed"))
    }

    /// Passes over a word or a number, if one starts here.
    fn word(&mut self) -> bool {
        let part = |c: char| c.is_alphanumeric() || "_+-.#".contains(c);
        let length = self.rest().find(|c| !part(c)).unwrap_or(self.rest().len());
        self.at += length;
        length > 0
    }
}

/// What is wrong with the name of a field beside those that are `good`, and what to do about it.
pub fn mistake_in_name(
    key: &str,
    known: &[&str],
    good: &[&SyntaxField],
    owner: &str,
) -> Option<(String, Option<String>)> {
    if !known.contains(&key) {
        return Some((format!("unknown field `{key}` in {owner}"), suggestion(key, known.iter().copied())));
    }
    let is_twice = good.iter().any(|other| other.key.as_deref() == Some(key));
    is_twice.then(|| (format!("`{key}` is given twice in {owner}"), None))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_path_leads_to_its_text() {
        let text = "// c\n( a: 1, list: [(x: \"y, )\"), Some(2.5)], /* /* n */ */ m: {\"k\": (q: r#\"z\"#)} )";
        let tree = parse(text).unwrap();
        let at = |path: &[Step]| {
            let (start, end) = tree.locate(path);
            &text[start..end]
        };
        let key = |k: &str| Step::Key(k.into());
        assert_eq!(at(&[key("a")]), "1");
        assert_eq!(at(&[key("list"), Step::Index(0), key("x")]), "\"y, )\"");
        assert_eq!(at(&[key("list"), Step::Index(1)]), "Some(2.5)");
        assert_eq!(at(&[key("m"), key("k"), key("q")]), "r#\"z\"#");
        assert_eq!(at(&[key("m"), key("k"), key("none")]), "(q: r#\"z\"#)");
    }

    #[test]
    fn broken_brackets_are_pointed_at() {
        let said = |text: &str| parse(text).map_err(|b| (b.at, b.message)).unwrap_err();
        assert_eq!(said("(a: 1").0, 0);
        assert_eq!(said("(a: [1, 2)").0, 9);
        assert_eq!(said("(a: 1 b: 2)"), (5, "a comma is missing here".into()));
        assert_eq!(said("(a: \"x)").0, 4);
        assert_eq!(said("(a: 1) x").0, 7);
        assert!(said(&"(".repeat(100_000)).1.contains("deeper"));
    }

    proptest! {
        #[test]
        fn any_text_is_read_without_panic(text in "[\\PC\\n\"'(){}\\[\\]:,/*#r]{0,80}") {
            if let Ok(tree) = parse(&text) {
                prop_assert!(tree.end <= text.len());
            }
        }
    }
}
