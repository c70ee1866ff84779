//! Pages for the terminal: lines of a hundred letters, with marks for colours where they are wanted.

use super::{Block, GuideEntry, PAGES, Page};

/// Letters of a line.
const WIDTH: usize = 100;

/// How headings, names and code are shown.
#[derive(Clone, Copy)]
struct Style {
    is_colored: bool,
}

impl Style {
    fn heading(self, text: &str) -> String {
        self.mark(text, "\x1b[1;36m")
    }

    fn name(self, text: &str) -> String {
        self.mark(text, "\x1b[1m")
    }

    fn code(self, text: &str) -> String {
        self.mark(text, "\x1b[33m")
    }

    fn mark(self, text: &str, start: &str) -> String {
        if self.is_colored { format!("{start}{text}\x1b[0m") } else { text.to_string() }
    }
}

/// The list of all pages.
pub fn contents(is_colored: bool) -> String {
    let style = Style { is_colored };
    let mut out = format!("{}\n\n", style.heading("The guide: anim guide PAGE"));
    for page in PAGES {
        out += &format!("  {}  {}\n", style.name(&format!("{:<12}", page.name)), page.summary);
    }
    out
}

/// A page.
pub fn page(page: &Page, is_colored: bool) -> String {
    let style = Style { is_colored };
    let mut out = format!("{}\n\n", style.heading(page.title));
    for block in (page.blocks)() {
        match block {
            Block::Heading(text) => out += &format!("{}\n\n", style.heading(&text)),
            Block::Paragraph(text) => out += &format!("{}\n", wrapped(&text, 0)),
            Block::Code(_, text) => {
                text.lines().for_each(|line| out += &code_line(line, 4, style));
                out.push('\n');
            }
            Block::GuideEntry(one) => out += &entry(&one, style),
            Block::Pair(theirs, ours) => {
                out += &format!("  {}  {ours}\n", style.name(&format!("{theirs:<34}")));
            }
        }
    }
    out
}

fn entry(entry: &GuideEntry, style: Style) -> String {
    let mut out = String::new();
    for form in &entry.forms {
        out += &format!("  {}", style.name(form));
        if !entry.kind.is_empty() {
            out += &format!("   {}", entry.kind);
        }
        if !entry.default.is_empty() {
            out += &format!(" [{}]", entry.default);
        }
        out.push('\n');
    }
    out += &wrapped(&entry.text, 6);
    for (name, text) in &entry.arguments {
        out += &wrapped(&format!("{name}: {text}"), 8);
    }
    if let Some((_, code)) = &entry.example {
        code.lines().for_each(|line| out += &code_line(line, 8, style));
    }
    out.push('\n');
    out
}

fn code_line(line: &str, indent: usize, style: Style) -> String {
    if line.is_empty() { "\n".into() } else { format!("{}{}\n", " ".repeat(indent), style.code(line)) }
}

/// A text as lines, each with so many blanks before it.
fn wrapped(text: &str, indent: usize) -> String {
    let mut out = String::new();
    for paragraph in text.lines() {
        let mut line = " ".repeat(indent);
        for word in paragraph.split_whitespace() {
            if line.chars().count() + word.chars().count() > WIDTH && line.len() > indent {
                out += line.trim_end();
                out.push('\n');
                line = " ".repeat(indent);
            }
            line += word;
            line.push(' ');
        }
        out += line.trim_end();
        out.push('\n');
    }
    out
}
