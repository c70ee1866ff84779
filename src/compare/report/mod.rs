//! Reports of comparisons: one HTML file that needs nothing else, and what other tools read.
//!
//! The page shows each pair in the viewer (`compare/viewer`), says what differs and why, and puts together the command
//! that accepts what was ticked. Its text, style and scripts lie beside this file.

mod junit;
mod views;

use std::fmt::Write;

use serde_json::{Value, json};

use super::flip::magma::MAGMA;
use super::judge::Judgement;
use super::viewer;
use crate::output::LayeredPicture;

pub use junit::{JunitCase, junit};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// A page about pairs of pictures.
#[derive(Clone, Debug, Default)]
pub struct ReportPage {
    /// The page's heading.
    pub title: String,
    /// What came of it, in a sentence.
    pub summary: String,
    /// What the first and the second picture of a pair are called.
    pub names: [&'static str; 2],
    /// The command that accepts pictures once `--accept PATTERN` is added; without it nothing can be ticked.
    pub command: Option<String>,
    /// Every pair that is to be seen, the worst first.
    pub items: Vec<ReportItem>,
}

/// One pair of pictures in a report, or one that has no partner.
#[derive(Clone, Debug, Default)]
pub struct ReportItem {
    /// Its name, as patterns match it: `show.0003`.
    pub id: String,
    /// One word: `different`, `missing`, `failed`, ...
    pub status: &'static str,
    /// What was found, a line each; the first is shown in the list.
    pub lines: Vec<String>,
    /// Text that keeps its lines, such as the mistakes of a frame that was not rendered.
    pub message: Option<String>,
    /// How what the frame is made from has changed, as far as both pictures tell.
    pub why: Vec<SceneChange>,
    /// Where the two pictures lie.
    pub files: [Option<String>; 2],
    /// Whether there is a new picture that could take the place of the old one.
    pub is_acceptable: bool,
    /// Its pictures, as the viewer takes them; [`ReportItem::with_pictures`] puts them here.
    pub views: Vec<Value>,
}

/// Something that is not as it was.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneChange {
    /// What it is about: "entity `key`: translation".
    pub what: String,
    /// Its value before; `None` if it was not there.
    pub before: Option<String>,
    /// Its value now; `None` if it is gone.
    pub after: Option<String>,
}

impl std::fmt::Display for SceneChange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.what)?;
        match (&self.before, &self.after) {
            (Some(before), Some(after)) => write!(f, " {before} -> {after}"),
            (None, Some(after)) => write!(f, " {after} (new)"),
            (Some(before), None) => write!(f, " {before} (gone)"),
            (None, None) => Ok(()),
        }
    }
}

impl ReportItem {
    /// Takes in the pictures of the pair, as far as they are there.
    pub fn with_pictures(
        mut self,
        a: Option<&LayeredPicture>,
        b: Option<&LayeredPicture>,
        judgement: Option<&Judgement>,
    ) -> Self {
        let (list, left_out) = views::views(a, b, judgement);
        self.views = list;
        if left_out > 0 {
            self.lines.push(format!(
                "{left_out} more channels differ, and are not shown since the page would grow too large"
            ));
        }
        self
    }

    /// What its pictures take in the page.
    pub fn picture_bytes(&self) -> usize {
        self.views.iter().map(|view| view.to_string().len()).sum()
    }

    /// Drops its pictures and says why.
    pub fn leave_out_pictures(&mut self, why: &str) {
        self.views.clear();
        self.lines.push(why.into());
    }

    fn to_json(&self) -> Value {
        let [a, b] = &self.files;
        let why = self.why.iter().map(|change| {
            let mut entry = serde_json::Map::new();
            entry.insert("what".into(), change.what.clone().into());
            let sides = [("before", &change.before), ("after", &change.after)];
            entry.extend(sides.into_iter().filter_map(|(key, text)| Some((key.to_string(), text.clone()?.into()))));
            Value::Object(entry)
        });
        json!({
            "id": self.id,
            "status": self.status,
            "lines": self.lines,
            "message": self.message,
            "why": why.collect::<Vec<_>>(),
            "a": a,
            "b": b,
            "acceptable": self.is_acceptable,
            "layers": self.views,
        })
    }

    fn row(&self) -> String {
        let tick = match self.is_acceptable {
            true => format!("<input class=\"tick\" type=\"checkbox\" aria-label=\"Accept {}\">", escaped(&self.id)),
            false => "<span class=\"tick\"></span>".into(),
        };
        let line = self.lines.first().map(String::as_str).unwrap_or_default();
        let why = self.why.first().map(|change| format!("<br>{}", escaped(&change.to_string()))).unwrap_or_default();
        format!(
            "<li class=\"item\">{tick}<a href=\"#{0}\">{0}</a><p><span class=\"status {1}\">{1}</span> {2}{why}</p></li>",
            escaped(&self.id),
            self.status,
            escaped(line),
        )
    }
}

impl ReportPage {
    /// The page as one HTML file. It depends on what it shows alone: no time, no machine.
    pub fn to_html(&self) -> String {
        let rows = self.items.iter().fold(String::new(), |mut rows, item| {
            let _ = writeln!(rows, "{}", item.row());
            rows
        });
        let data = json!({
            "names": self.names,
            "palette": MAGMA,
            "command": self.command,
            "items": self.items.iter().map(ReportItem::to_json).collect::<Vec<_>>(),
        });
        // A text in the data must not end the element that holds it.
        let data = data.to_string().replace('<', "\\u003c");
        let parts = [
            ("title", escaped(&self.title)),
            ("summary", escaped(&self.summary)),
            ("style", format!("{}\n{STYLE}", viewer::STYLE)),
            ("rows", rows),
            ("data", data),
            ("script", format!("{}\n{SCRIPT}", viewer::SCRIPT)),
        ];
        filled(PAGE, &parts)
    }
}

/// The template with its `{{places}}` filled; what is filled in is not looked at again.
fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let mut page = String::new();
    let mut rest = template;
    while let Some((before, behind)) = rest.split_once("{{") {
        let (name, after) = behind.split_once("}}").unwrap_or((behind, ""));
        page.push_str(before);
        page.push_str(parts.iter().find(|(known, _)| *known == name).map_or("", |(_, text)| text.as_str()));
        rest = after;
    }
    page + rest
}

/// Text as HTML and XML have it, in elements and in attributes. Signs that XML cannot hold become spaces.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests;
