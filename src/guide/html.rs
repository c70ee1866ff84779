//! The guide as a site: a file for each page, a style, and a search that needs no server.

use super::pictures::{GuidePicture, pictures};
use super::{Block, CodeKind, GuideEntry, PAGES, Page};

/// Texts of the site by the names of their files; [`pictures`] stand beside them.
pub fn files(with_pictures: bool) -> Vec<(String, String)> {
    let pictures = if with_pictures { pictures() } else { Vec::new() };
    let mut files: Vec<(String, String)> =
        PAGES.iter().map(|page| (file_of(page), document(page, &pictures))).collect();
    files.push(("style.css".into(), STYLE.into()));
    files.push(("search.js".into(), search()));
    files
}

fn file_of(page: &Page) -> String {
    if page.name == PAGES[0].name { "index.html".into() } else { format!("{}.html", page.name) }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Words between backquotes become code.
fn inline(text: &str) -> String {
    let parts = text.split('`').enumerate();
    parts.map(|(i, part)| if i % 2 == 1 { format!("<code>{}</code>", escaped(part)) } else { escaped(part) }).collect()
}

/// A name as a fragment of an address.
fn anchor(form: &str) -> String {
    let name = form.split(['(', ' ']).next().unwrap_or(form);
    name.chars().filter(|c| c.is_alphanumeric() || ['_', '.'].contains(c)).collect()
}

/// The pictures of a field, or of a record as a whole.
fn figures(pictures: &[GuidePicture], record: &str, field: &str) -> String {
    let own = pictures.iter().filter(|picture| picture.record == record && picture.field == field);
    let figures: String = own
        .map(|picture| {
            let (file, choice) = (picture.file(), escaped(&picture.choice));
            let caption = if choice.is_empty() { String::new() } else { format!("<figcaption>{choice}</figcaption>") };
            let alt = if choice.is_empty() { record } else { &choice };
            format!("<figure><img src=\"{file}\" alt=\"{alt}\" width=\"120\" height=\"80\">{caption}</figure>\n")
        })
        .collect();
    if figures.is_empty() { figures } else { format!("<div class=\"figures\">\n{figures}</div>\n") }
}

fn document(page: &Page, pictures: &[GuidePicture]) -> String {
    let links: String = PAGES
        .iter()
        .map(|one| {
            let here = if one.name == page.name { " class=\"here\"" } else { "" };
            format!("<a href=\"{}\"{here}>{}</a>\n", file_of(one), escaped(one.title))
        })
        .collect();
    let (mut record, mut blocks) = (String::new(), String::new());
    for one in &(page.blocks)() {
        blocks += &block(one);
        // Fields stand below the heading of their record.
        match one {
            Block::Heading(text) => {
                record = text.trim_matches('`').to_string();
                blocks += &figures(pictures, &record, "");
            }
            Block::GuideEntry(entry) => {
                blocks += &entry.forms.first().map_or(String::new(), |field| figures(pictures, &record, field));
            }
            Block::Paragraph(_) | Block::Code(..) | Block::Pair(..) => {}
        }
    }
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>anim: {title}</title>\n\
         <link rel=\"stylesheet\" href=\"style.css\">\n</head>\n<body>\n<nav>\n\
         <input id=\"search\" type=\"search\" placeholder=\"Search\" aria-label=\"Search\">\n<ul id=\"found\"></ul>\n{links}</nav>\n\
         <main>\n<h1>{title}</h1>\n{blocks}</main>\n<script src=\"search.js\"></script>\n</body>\n</html>\n",
        title = escaped(page.title),
    )
}

fn block(block: &Block) -> String {
    match block {
        Block::Heading(text) => format!("<h2 id=\"{}\">{}</h2>\n", anchor(text), inline(text)),
        Block::Paragraph(text) => text.lines().map(|line| format!("<p>{}</p>\n", inline(line))).collect(),
        Block::Code(kind, text) => pre(*kind, text),
        Block::Pair(theirs, ours) => {
            format!("<div class=\"pair\"><span>{}</span><span>{}</span></div>\n", inline(theirs), inline(ours))
        }
        Block::GuideEntry(one) => entry(one),
    }
}

fn pre(kind: CodeKind, text: &str) -> String {
    let class = match kind {
        CodeKind::Scene => "scene",
        CodeKind::Script => "script",
        CodeKind::Command => "command",
        CodeKind::Answer => "answer",
    };
    format!("<pre class=\"{class}\">{}</pre>\n", escaped(text))
}

fn entry(entry: &GuideEntry) -> String {
    let mut out = format!("<section id=\"{}\">\n", entry.forms.first().map_or(String::new(), |form| anchor(form)));
    for form in &entry.forms {
        out += &format!("<h3><code>{}</code>", escaped(form));
        if !entry.kind.is_empty() {
            out += &format!(" <small>{}</small>", escaped(&entry.kind));
        }
        if !entry.default.is_empty() {
            out += &format!(" <small>default {}</small>", escaped(&entry.default));
        }
        out += "</h3>\n";
    }
    out += &entry.text.lines().map(|line| format!("<p>{}</p>\n", inline(line))).collect::<String>();
    if !entry.arguments.is_empty() {
        let rows = entry.arguments.iter();
        let rows =
            rows.map(|(name, text)| format!("<dt><code>{}</code></dt><dd>{}</dd>\n", escaped(name), inline(text)));
        out += &format!("<dl>\n{}</dl>\n", rows.collect::<String>());
    }
    if let Some((kind, code)) = &entry.example {
        out += &pre(*kind, code);
    }
    out + "</section>\n"
}

/// The script of the search, with its index.
fn search() -> String {
    let mut index = Vec::new();
    for page in PAGES {
        let file = file_of(page);
        index.push(serde_json::json!([page.title, file, page.summary]));
        for one in (page.blocks)() {
            match one {
                Block::GuideEntry(entry) => {
                    let form = entry.forms.first().cloned().unwrap_or_default();
                    let address = format!("{file}#{}", anchor(&form));
                    index.push(serde_json::json!([form, address, entry.text]));
                }
                Block::Pair(theirs, ours) => index.push(serde_json::json!([theirs, file, ours])),
                Block::Heading(_) | Block::Paragraph(_) | Block::Code(..) => {}
            }
        }
    }
    format!("const INDEX = {};\n{SEARCH}", serde_json::Value::Array(index))
}

const SEARCH: &str = "const field = document.getElementById('search');
const found = document.getElementById('found');
field.addEventListener('input', () => {
  const words = field.value.toLowerCase().split(/\\s+/).filter(Boolean);
  found.replaceChildren();
  if (!words.length) return;
  const score = ([name, , text]) => words.every(w => (name + ' ' + text).toLowerCase().includes(w))
    ? (name.toLowerCase().includes(words[0]) ? 2 : 1) : 0;
  INDEX.map(one => [score(one), one]).filter(([s]) => s > 0).sort((a, b) => b[0] - a[0]).slice(0, 20)
    .forEach(([, [name, address]]) => {
      const item = document.createElement('li');
      const link = document.createElement('a');
      link.href = address;
      link.textContent = name;
      item.append(link);
      found.append(item);
    });
});
";

const STYLE: &str = "body { display: flex; margin: 0; font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fdfdfb; }
nav { position: sticky; top: 0; height: 100vh; overflow: auto; flex: 0 0 15rem; padding: 1rem; box-sizing: border-box; background: #eee9df; }
nav a { display: block; color: #333; text-decoration: none; padding: 0.15rem 0; }
nav a.here { font-weight: bold; }
nav input { width: 100%; box-sizing: border-box; padding: 0.3rem; }
nav ul { list-style: none; padding: 0; margin: 0.3rem 0 1rem; font-size: 0.9rem; }
main { flex: 1; max-width: 52rem; padding: 1rem 2rem 4rem; min-width: 0; }
pre { background: #f2f0ea; padding: 0.6rem 0.8rem; overflow: auto; border-left: 3px solid #c9a24d; }
pre.answer { border-color: #b04030; }
pre.command { border-color: #507050; }
section { border-top: 1px solid #e5e0d5; padding-top: 0.4rem; }
h3 { font-size: 1rem; margin: 0.4rem 0; }
small { color: #777; font-weight: normal; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.1rem 0.8rem; }
dd { margin: 0; }
.figures { display: flex; flex-wrap: wrap; gap: 0.6rem; margin: 0.5rem 0; }
figure { margin: 0; }
figcaption { font-size: 0.8rem; color: #777; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 1rem; border-top: 1px solid #e5e0d5; padding: 0.2rem 0; }
@media (max-width: 45rem) { body { display: block; } nav { position: static; height: auto; } }
@media (prefers-color-scheme: dark) {
  body { color: #ddd; background: #1c1b19; } nav { background: #262420; } nav a { color: #ccc; }
  pre { background: #262420; } section, .pair { border-color: #3a3732; } small { color: #999; }
}
";
