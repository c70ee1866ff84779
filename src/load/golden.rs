//! `golden.ron`: which frames of which scripts have golden pictures, and how near they must come.
//!
//! ```ron
//! (
//!     folder: "golden",
//!     size: (160, 90),
//!     samples: 4,
//!     entries: [
//!         (script: "rackfocus.rhai", frames: "1-48x8"),
//!         (name: "wide", script: "rackfocus.rhai", parameters: { "aperture": 0.4 }, frames: "24", flip: 0.02),
//!     ],
//! )
//! ```
//!
//! What stands beside `entries` holds for all of them, and an entry's own word goes first.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::ron::options;
use super::spans::{self, SyntaxField, SyntaxNode, mistake_in_name};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, suggestion};
use crate::base::{files, limits};
use crate::components::Integrator;

/// Name of the file, and of the folder of its pictures where it names none.
pub const GOLDEN_FILE: &str = "golden.ron";
const FOLDER: &str = "golden";

/// A list of golden frames.
#[derive(Clone, Debug, PartialEq)]
pub struct GoldenList {
    /// The file that it was read from.
    pub file: PathBuf,
    /// Where its pictures lie.
    pub folder: PathBuf,
    /// In the order of the file, each with the settings of all in it.
    pub entries: Vec<GoldenEntry>,
    /// How FLIP looks at the pictures; the usual distance where it is not given.
    pub pixels_per_degree: Option<f64>,
}

/// Some frames of one script, or one picture of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct GoldenEntry {
    /// What its pictures are called: `NAME.0001.png`. The script's own name where it is not given.
    pub name: String,
    /// The script or scene, beside the list.
    pub script: PathBuf,
    /// Values of the script's parameters, as `-D` takes them.
    pub parameters: Vec<(String, String)>,
    /// As `--frames` takes them; all where it is not given.
    pub frames: Option<String>,
    /// How its frames are rendered and compared.
    pub settings: GoldenSettings,
    /// Where it stands in its file.
    pub place: Place,
}

/// How frames are rendered and compared: of an entry, or of all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GoldenSettings {
    /// Width and height in pixels, over the scene's.
    pub size: Option<[u32; 2]>,
    /// Samples per pixel, over the scene's.
    pub samples: Option<u32>,
    /// Seed of all random numbers, over the scene's.
    pub seed: Option<u64>,
    /// Integrator, over the scene's.
    pub integrator: Option<Integrator>,
    /// Bits per channel: 8 or 16.
    pub bit_depth: Option<u32>,
    /// The largest mean FLIP error that is forgiven, 0 to 1.
    pub flip: Option<f64>,
    /// The largest difference of a channel that is forgiven, in steps of 1/255.
    pub max: Option<f64>,
}

const SETTINGS: [&str; 7] = ["size", "samples", "seed", "integrator", "bit_depth", "flip", "max"];
const OF_LIST: [&str; 3] = ["entries", "folder", "pixels_per_degree"];
const OF_ENTRY: [&str; 4] = ["name", "script", "parameters", "frames"];

/// Reads a list of golden frames.
///
/// # Errors
/// A file that cannot be read; every mistake in it, each with its place.
pub fn load_golden_list(path: &Path) -> Result<GoldenList, Diagnostics> {
    let text = files::read_text(path, limits::SCRIPT_FILE_BYTES)?;
    parse(&text, path)
}

fn parse(text: &str, path: &Path) -> Result<GoldenList, Diagnostics> {
    let file = path.to_string_lossy().into_owned();
    let tree = spans::parse(text).map_err(|broken| {
        Diagnostics::from(Diagnostic::error(broken.message).at(Place::of_span(&*file, text, broken.at, broken.at + 1)))
    })?;
    let base = path.parent().unwrap_or(Path::new(""));
    let mut reader = GoldenListReader { text, file, base, found: Diagnostics::default() };
    let list = reader.list(&tree, path);
    if reader.found.has_errors() { Err(reader.found) } else { Ok(list) }
}

struct GoldenListReader<'a> {
    text: &'a str,
    file: String,
    /// Folder that paths in the file are relative to.
    base: &'a Path,
    found: Diagnostics,
}

impl GoldenListReader<'_> {
    fn place(&self, (start, end): (usize, usize)) -> Place {
        Place::of_span(&*self.file, self.text, start, end)
    }

    fn report(&mut self, span: (usize, usize), message: String, help: Option<String>) {
        let diagnostic = Diagnostic::error(message).at(self.place(span));
        self.found.push(match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
    }

    fn list(&mut self, tree: &SyntaxNode, path: &Path) -> GoldenList {
        let known: Vec<&str> = OF_LIST.into_iter().chain(SETTINGS).collect();
        let (mut all, mut nodes) = (GoldenSettings::default(), None);
        let (mut folder, mut pixels_per_degree) = (FOLDER.to_string(), None);
        for child in self.fields(tree, "the list", &known) {
            match child.key.as_deref().unwrap_or("") {
                "entries" => nodes = Some(&child.value),
                "folder" => folder = self.value(child, "a folder in quotes").unwrap_or(folder),
                "pixels_per_degree" => pixels_per_degree = self.number(child, 1.0, 1000.0),
                _ => self.setting(child, &mut all),
            }
        }
        let mut entries: Vec<GoldenEntry> = Vec::new();
        let nodes = nodes.map(|node| &node.children[..]).unwrap_or_default();
        if nodes.is_empty() && self.found.0.is_empty() {
            let help = "add entries: [(script: \"show.rhai\", frames: \"1,24\")]".to_string();
            self.report((tree.start, tree.start + 1), "the list has no entries".into(), Some(help));
        }
        for node in nodes {
            let Some(entry) = self.entry(&node.value, &all) else { continue };
            if entries.iter().any(|other| other.name == entry.name) {
                let help = Some("give one of them a `name` of its own".to_string());
                let span = (node.value.start, node.value.end.min(node.value.start + 1));
                self.report(span, format!("two entries are called `{}`", entry.name), help);
            }
            entries.push(entry);
        }
        let folder = if folder == "." { self.base.to_path_buf() } else { self.base.join(folder) };
        GoldenList { file: path.to_path_buf(), folder, entries, pixels_per_degree }
    }

    fn entry(&mut self, node: &SyntaxNode, all: &GoldenSettings) -> Option<GoldenEntry> {
        let known: Vec<&str> = OF_ENTRY.into_iter().chain(SETTINGS).collect();
        let (mut settings, before) = (all.clone(), self.found.0.len());
        let (mut name, mut script, mut parameters, mut frames) = (None, None, Vec::new(), None);
        for child in self.fields(node, "an entry", &known) {
            match child.key.as_deref().unwrap_or("") {
                "name" => name = self.name(child),
                "script" => script = self.value::<String>(child, "the file of a script or a scene in quotes"),
                "parameters" => parameters = self.parameters(child),
                "frames" => frames = self.frames(child),
                _ => self.setting(child, &mut settings),
            }
        }
        if script.is_none() && self.found.0.len() == before {
            let span = (node.start, node.start + 1);
            self.report(span, "an entry needs a `script`".into(), Some("write (script: \"show.rhai\")".into()));
        }
        let script = self.base.join(script?);
        let stem = || script.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = name.unwrap_or_else(stem);
        Some(GoldenEntry {
            name,
            script,
            parameters,
            frames,
            settings,
            place: self.place((node.start, node.start + 1)),
        })
    }

    /// The fields of a struct whose keys are known and there once; the others are reported.
    fn fields<'n>(&mut self, node: &'n SyntaxNode, owner: &str, known: &[&str]) -> Vec<&'n SyntaxField> {
        if !self.text[node.start..].starts_with('(') {
            let help = Some("write (entries: [(script: \"show.rhai\")])".to_string());
            self.report((node.start, node.end), format!("{owner} stands in round brackets"), help);
            return Vec::new();
        }
        let mut good: Vec<&SyntaxField> = Vec::new();
        for child in &node.children {
            let Some(key) = child.key.as_deref() else {
                let help = Some("fields are written `name: value`".to_string());
                self.report(
                    (child.value.start, child.value.end),
                    format!("{owner} has a value without a field name"),
                    help,
                );
                continue;
            };
            let span = (child.key_start, child.key_end);
            match mistake_in_name(key, known, &good, owner) {
                Some((message, help)) => self.report(span, message, help),
                None => good.push(child),
            }
        }
        good
    }

    fn value<T: DeserializeOwned>(&mut self, child: &SyntaxField, expected: &str) -> Option<T> {
        let span = (child.value.start, child.value.end);
        let source = &self.text[span.0..span.1];
        let read = options().from_str::<T>(source).ok();
        if read.is_none() {
            let found: String = source.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(40).collect();
            self.refuse(child, expected, &found);
        }
        read
    }

    fn refuse(&mut self, child: &SyntaxField, expected: &str, found: &str) {
        let name = child.key.as_deref().unwrap_or("");
        let message = format!("`{name}`: expected {expected}, found {found}");
        self.report((child.value.start, child.value.end), message, None);
    }

    fn number(&mut self, child: &SyntaxField, least: f64, most: f64) -> Option<f64> {
        let expected = format!("a number from {least} to {most}");
        let number: f64 = self.value(child, &expected)?;
        if (least..=most).contains(&number) {
            return Some(number);
        }
        self.refuse(child, &expected, &number.to_string());
        None
    }

    fn whole(&mut self, child: &SyntaxField, most: u32) -> Option<u32> {
        let expected = format!("a whole number from 1 to {most}");
        let number: u32 = self.value(child, &expected)?;
        if (1..=most).contains(&number) {
            return Some(number);
        }
        self.refuse(child, &expected, &number.to_string());
        None
    }

    fn setting(&mut self, child: &SyntaxField, settings: &mut GoldenSettings) {
        let span = (child.value.start, child.value.end);
        match child.key.as_deref().unwrap_or("") {
            "size" => settings.size = self.size(child).or(settings.size),
            "samples" => settings.samples = self.whole(child, limits::SAMPLES).or(settings.samples),
            "seed" => settings.seed = self.value(child, "a whole number").or(settings.seed),
            "flip" => settings.flip = self.number(child, 0.0, 1.0).or(settings.flip),
            "max" => settings.max = self.number(child, 0.0, 255.0).or(settings.max),
            "bit_depth" => match self.whole(child, 16) {
                Some(bits @ (8 | 16)) => settings.bit_depth = Some(bits),
                Some(bits) => self.report(span, format!("`bit_depth`: expected 8 or 16, found {bits}"), None),
                None => {}
            },
            "integrator" => {
                let word = self.text[span.0..span.1].trim_matches('"');
                settings.integrator = Integrator::parse(word).or(settings.integrator);
                if Integrator::parse(word).is_none() {
                    let help = suggestion(word, Integrator::NAMES.iter().copied());
                    self.report(span, format!("`integrator`: unknown choice `{word}`"), help);
                }
            }
            _ => {}
        }
    }

    fn size(&mut self, child: &SyntaxField) -> Option<[u32; 2]> {
        let (width, height): (u32, u32) = self.value(child, "width and height, as in (160, 90)")?;
        let is_good = [width, height].iter().all(|side| (1..=limits::FRAME_SIDE).contains(side));
        if is_good && u64::from(width) * u64::from(height) <= limits::FRAME_PIXELS {
            return Some([width, height]);
        }
        let message = format!("`size`: sides go from 1 to {}, found {width} x {height}", limits::FRAME_SIDE);
        self.report((child.value.start, child.value.end), message, None);
        None
    }

    /// A name that is part of a file's, and that patterns can match.
    fn name(&mut self, child: &SyntaxField) -> Option<String> {
        let name: String = self.value(child, "a name in quotes")?;
        let is_plain = |c: char| c.is_alphanumeric() || "-_. ".contains(c);
        if !name.is_empty() && !name.starts_with('.') && name.chars().all(is_plain) {
            return Some(name);
        }
        let help = Some("it is part of a file's name: letters, digits, - and _".to_string());
        self.report((child.value.start, child.value.end), format!("`name`: `{name}` cannot be used"), help);
        None
    }

    fn frames(&mut self, child: &SyntaxField) -> Option<String> {
        let span = (child.value.start, child.value.end);
        // One frame may be given as a number.
        let source = self.text[span.0..span.1].trim();
        if !source.is_empty() && source.bytes().all(|b| b.is_ascii_digit()) {
            return Some(source.to_string());
        }
        self.value(child, "frames in quotes, as in \"1-10,20,30-60x5\"")
    }

    fn parameters(&mut self, child: &SyntaxField) -> Vec<(String, String)> {
        let mut found: Vec<(String, String)> = Vec::new();
        for parameter in &child.value.children {
            let span = (parameter.value.start, parameter.value.end);
            let Some(name) = parameter.key.clone().filter(|name| !name.is_empty()) else {
                let help = Some("write { \"aperture\": 0.4 }".to_string());
                self.report(span, "a parameter needs a name".into(), help);
                continue;
            };
            if found.iter().any(|(known, _)| *known == name) {
                self.report(
                    (parameter.key_start, parameter.key_end),
                    format!("parameter `{name}` is given twice"),
                    None,
                );
            }
            let source = self.text[span.0..span.1].trim();
            if !parameter.value.children.is_empty() {
                self.report(span, format!("parameter `{name}`: expected a number, a word or a text"), None);
            } else if source.starts_with(['"', 'r']) && source.ends_with(['"', '#']) {
                found.extend(self.value(parameter, "a text in quotes").map(|text| (name, text)));
            } else {
                found.push((name, source.to_string()));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> GoldenList {
        parse(text, Path::new("show/golden.ron")).unwrap()
    }

    #[track_caller]
    fn refused(text: &str, said: &[&str]) {
        let problems = parse(text, Path::new("g.ron")).unwrap_err().to_string();
        for word in said {
            assert!(problems.contains(word), "`{word}` is not in:\n{problems}");
        }
    }

    #[test]
    fn entries_take_what_holds_for_all() {
        let list = read(
            "( // all\n  size: (160, 90), samples: 4, flip: 0.01,\n  entries: [\n    (script: \"a.rhai\", frames: \"1-9x4\"),\n    \
             (name: \"wide\", script: \"../b.rhai\", parameters: {\"aperture\": 0.4, \"lens\": \"Square\"}, frames: 7,\n     \
             size: (64, 36), max: 2, integrator: Path, seed: 5, bit_depth: 16),\n  ],\n)",
        );
        let [a, b] = &list.entries[..] else { panic!("{list:?}") };
        assert_eq!((list.folder.as_path(), a.name.as_str()), (Path::new("show/golden"), "a"));
        assert_eq!((a.settings.size, a.settings.samples, a.settings.flip), (Some([160, 90]), Some(4), Some(0.01)));
        assert_eq!((b.name.as_str(), b.script.as_path()), ("wide", Path::new("show/../b.rhai")));
        let parameters = [("aperture".to_string(), "0.4".to_string()), ("lens".to_string(), "Square".to_string())];
        assert_eq!(b.parameters, parameters);
        assert_eq!((b.frames.as_deref(), b.settings.size, b.settings.max), (Some("7"), Some([64, 36]), Some(2.0)));
        assert_eq!((b.settings.integrator, b.settings.seed), (Some(Integrator::Path), Some(5)));
        assert_eq!((b.place.line, b.settings.bit_depth), (5, Some(16)));
    }

    #[test]
    fn mistakes_are_all_named_with_their_places() {
        refused("(entires: [])", &["g.ron:1:2", "unknown field `entires`", "did you mean `entries`?"]);
        refused("(entries: [])", &["no entries", "add entries"]);
        refused("(entries: [(frames: \"1\")])", &["needs a `script`"]);
        refused("(entries: [(script: \"a.rhai\"), (script: \"b/a.rhai\")])", &["two entries are called `a`", "`name`"]);
        refused(
            "(size: (0, 9), entries: [(script: \"a\", flip: 2, samples: \"x\")])",
            &["sides go", "from 0 to 1", "found \"x\""],
        );
        refused("(entries: [(script: \"a\", name: \"../x\")])", &["cannot be used"]);
        refused("(entries: [(script: \"a\", integrator: Pat)])", &["did you mean `Path`?"]);
        refused("(entries: [(script: \"a\", script: \"b\")])", &["given twice"]);
        refused("(entries: [(script: \"a\", parameters: {\"x\": (1, 2)})])", &["expected a number, a word"]);
        refused("[]", &["round brackets"]);
        refused("", &["empty"]);
        refused("(entries: [(script: \"a\"", &["g.ron:1"]);
    }
}
