//! Where things stand in a RON text: a tolerant tree of keys and values with their byte offsets.
//!
//! It is built only when something is wrong, to say where. It knows brackets, strings, comments and words, not types.

use crate::base::diagnostics::{did_you_mean, suggestion};
use crate::base::limits;
use crate::base::synonyms::by_meaning;
use crate::components::homes::{home_by_meaning, home_of};

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
    /// What to do about it.
    pub help: Option<String>,
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

    /// Whether all of a path is there.
    pub fn has(&self, path: &[Step]) -> bool {
        let next = |node: &'_ SyntaxNode, step: &Step| match step {
            Step::Key(key) => node.children.iter().position(|child| child.key.as_deref() == Some(key)),
            Step::Index(i) => (*i < node.children.len()).then_some(*i),
        };
        let mut node = self;
        path.iter().all(|step| {
            let child = next(node, step).map(|i| &node.children[i].value);
            child.is_some_and(|child| {
                node = child;
                true
            })
        })
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
    let mut reader = SyntaxReader { text, at: 0, unclosed: None };
    reader.blank()?;
    while text[reader.at..].starts_with("#!") {
        reader.at = text[reader.at..].find(']').map_or(text.len(), |i| reader.at + i + 1);
        reader.blank()?;
    }
    if reader.at == text.len() {
        return Err(Broken { at: 0, message: "the file is empty; it starts with `(`".into(), help: None });
    }
    let node = reader.value(0)?;
    reader.blank()?;
    if reader.at < text.len() {
        let message = "nothing may follow the closing bracket";
        return Err(reader.foreign(reader.at).unwrap_or_else(|| reader.broken(reader.at, message)));
    }
    Ok(node)
}

struct SyntaxReader<'a> {
    text: &'a str,
    at: usize,
    /// A bracket whose values are followed by fields, as where it is not closed.
    unclosed: Option<usize>,
}

impl<'a> SyntaxReader<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn broken(&self, at: usize, message: impl Into<String>) -> Broken {
        Broken { at, message: message.into(), help: None }
    }

    /// What a sign of another notation means that stands where none of this one can.
    fn foreign(&self, at: usize) -> Option<Broken> {
        let rest = &self.text[at..];
        let is_line_start = self.text[..at].rsplit('\n').next().is_some_and(|before| before.trim().is_empty());
        let is_joined = self.text[..at].ends_with(|c: char| c.is_alphanumeric());
        let (message, help) = match rest.chars().next()? {
            '=' if rest.starts_with("=>") => ("`=>` stands between a field and its value", "write `name: value`"),
            '=' => ("`=` stands between a field and its value", "write `name: value`"),
            '#' => ("a comment begins with //, not with #", "write // in its place"),
            '-' if rest.starts_with("--") && is_line_start => {
                ("a comment begins with //, not with --", "write // in its place")
            }
            ';' if is_line_start => ("a comment begins with //, not with ;", "write // in its place"),
            ';' => ("`;` stands where a comma belongs", "write `,` between two values"),
            ',' => ("there is one comma too many", "a value stands before every comma"),
            '<' if at == 0 => {
                ("this is no scene in RON", "it begins with `(`, as in (camera: (fov: 40.0), entities: [])")
            }
            '<' => ("a vector stands in round brackets", "write (0.0, 1.0, 2.0)"),
            '+' | '*' | '/' => {
                ("a scene holds plain numbers, and calculates none", "write the result, or set it by a script")
            }
            '"' if is_joined => {
                ("a quote is missing before this word, or is one too many", "texts stand between two quotes: \"name\"")
            }
            ':' if self.text[..at].trim_start_matches('\u{feff}').chars().all(|c| c.is_alphanumeric() || c == '_') => {
                ("this is no scene in RON", "it begins with `(`, as in (camera: (fov: 40.0), entities: [])")
            }
            _ => return None,
        };
        Some(Broken { at, message: message.into(), help: Some(help.into()) })
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
            Some(c) => {
                let unexpected = || self.broken(self.at, format!("unexpected `{c}`"));
                return Err(self.foreign(self.at).unwrap_or_else(unexpected));
            }
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
                    let open = self.unclosed.unwrap_or(open);
                    let bracket = &self.text[open..open + 1];
                    return Err(self.broken(open, format!("this `{bracket}` is never closed: the file ends before")));
                }
                Some(c @ (')' | ']' | '}')) => {
                    return Err(self.broken(self.at, format!("found `{c}` where `{close}` or a value was expected")));
                }
                _ => {}
            }
            let child = self.child(depth)?;
            if child.key.is_some() && close != '}' && node.children.last().is_some_and(|before| before.key.is_none()) {
                self.unclosed.get_or_insert(open);
            }
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
                    let last = node.children.last().filter(|child| child.key.is_none() && close == ')');
                    let word = last.map_or("", |child| &self.text[child.value.start..child.value.end]);
                    let is_name = word.starts_with(char::is_alphabetic) && !word.contains(['(', '"']);
                    let missing = || match is_name {
                        true => self.broken(end, format!("a `:` is missing between `{word}` and its value")),
                        false => self.broken(end, "a comma is missing here"),
                    };
                    let before = node.children.last().filter(|child| child.key.is_none()).map(|child| child.key_start);
                    let comment = before.filter(|at| self.text[*at..].starts_with(['#', '-']));
                    let found = comment.and_then(|at| self.foreign(at)).or_else(|| self.foreign(self.at));
                    return Err(found.unwrap_or_else(missing));
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

/// Help for a field that something does not have: the word of ours for it there, a slip of the fingers, the part of a scene
/// that has it, or what there is.
fn help_for_name(key: &str, known: &[&str]) -> Option<String> {
    let is_meant = by_meaning(key, known).is_some() || (key.chars().count() > 3 && did_you_mean(key, known).is_some());
    if is_meant {
        return suggestion(key, known.iter().copied());
    }
    let home = home_of(key).map(|home| home.in_scene(key));
    let meant = || home_by_meaning(key).map(|(home, field)| home.in_scene(field));
    home.or_else(meant).or_else(|| suggestion(key, known.iter().copied()))
}

/// What is wrong with the name of a field beside those that are `good`, and what to do about it.
pub fn mistake_in_name(
    key: &str,
    known: &[&str],
    good: &[&SyntaxField],
    owner: &str,
) -> Option<(String, Option<String>)> {
    if !known.contains(&key) {
        return Some((format!("unknown field `{key}` in {owner}"), help_for_name(key, known)));
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
        assert!(tree.has(&[key("m"), key("k"), key("q")]) && !tree.has(&[key("m"), key("k"), key("none")]));
    }

    #[test]
    fn broken_brackets_are_pointed_at() {
        let said = |text: &str| parse(text).map_err(|b| (b.at, b.message)).unwrap_err();
        assert_eq!(said("(a: 1").0, 0);
        assert_eq!(said("(a: [1, 2)").0, 9);
        assert_eq!(said("(a: 1 b: 2)"), (5, "a comma is missing here".into()));
        assert_eq!(said("(a: 1, b 2)"), (8, "a `:` is missing between `b` and its value".into()));
        assert_eq!(said("(a: (b: (1, 2, c: 3), d: 4").0, 8);
        assert!(said("(a = 1)").1.contains("between a field and its value"));
        assert!(said("(a: 1,\n# b\n)").1.contains("begins with //"));
        assert!(said("(a: 1; b: 2)").1.contains("where a comma belongs"));
        assert!(said("(a: <1, 2, 3>)").1.contains("round brackets"));
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
