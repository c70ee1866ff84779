//! The repository holds to its own rules: floors, sizes, banned calls, and examples that pass `anim check`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Rooms from the top floor down; rooms on one line do not import each other.
const FLOORS: &[&[&str]] = &[
    &["cli"],
    &["guide"],
    &["preview", "farm"],
    &["shot"],
    &["compare"],
    &["systems"],
    &["script", "load", "output"],
    &["trace"],
    &["film"],
    &["components"],
    &["base"],
];

/// Crates that only some rooms may name.
const CRATES: &[(&str, &[&str])] = &[
    ("hecs", &["systems", "components"]),
    ("rhai", &["script"]),
    ("csv", &["script"]),
    ("ron", &["load"]),
    ("earcutr", &["load", "components"]),
    ("jpeg_decoder", &["load"]),
    ("png", &["output"]),
    ("exr", &["load", "output"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("ctrlc", &["cli"]),
    ("rawzip", &["farm"]),
    ("axum", &["preview"]),
    ("tokio", &["preview"]),
    ("notify", &["preview"]),
    ("getrandom", &["preview"]),
];

/// Rooms that may ask what time it is: nothing in them reaches a picture.
const CLOCKS: &[&str] = &["farm"];

const LONGEST_FILE: usize = 500;

/// Type names that are declared more than once, each with the reason. The list may only shrink.
const SHARED_NAMES: &[(&str, &str)] = &[];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            found.extend(files(&entry, extension));
        } else if entry.extension().is_some_and(|e| e == extension) {
            found.push(entry);
        }
    }
    found.sort();
    found
}

pub struct Source {
    pub path: PathBuf,
    room: String,
    pub text: String,
}

impl Source {
    /// Lines of code with their numbers: no comments, and nothing below the tests.
    pub fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        let is_test_file = self.path.ends_with("tests.rs");
        let lines = self.text.lines().enumerate().take_while(move |(_, line)| !is_test_file && *line != "#[cfg(test)]");
        lines.map(|(i, line)| (i + 1, line.split("//").next().unwrap_or("")))
    }
}

pub fn sources() -> Vec<Source> {
    let src = root().join("src");
    let read = |path: PathBuf| {
        let below = path.strip_prefix(&src).unwrap();
        let room = below.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).unwrap();
        Source { room, text, path }
    };
    files(&src, "rs").into_iter().map(read).collect()
}

fn floor(room: &str) -> Option<usize> {
    FLOORS.iter().position(|rooms| rooms.contains(&room))
}

/// Names that follow `crate::` in a line, lists in braces included.
fn imported(line: &str) -> Vec<String> {
    let mut names = Vec::new();
    for tail in line.split("crate::").skip(1) {
        let list = tail.strip_prefix('{').map_or(vec![tail], |inner| inner.split(',').collect());
        let word = |s: &str| s.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
        names.extend(list.into_iter().map(word));
    }
    names
}

pub fn fail_on(problems: Vec<String>) {
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
}

#[test]
fn imports_only_go_down_the_floors() {
    let mut problems = Vec::new();
    for source in sources() {
        let Some(here) = floor(&source.room) else { continue };
        for (number, line) in source.code() {
            for room in imported(line).into_iter().filter(|room| *room != source.room) {
                if floor(&room).is_some_and(|there| there <= here) {
                    problems.push(format!("{}:{number}: {} imports {room}", source.path.display(), source.room));
                }
            }
        }
    }
    fail_on(problems);
}

#[test]
fn every_room_stands_on_a_floor() {
    let strays = sources().into_iter().filter(|s| !s.room.ends_with(".rs") && floor(&s.room).is_none());
    fail_on(strays.map(|s| format!("{} is in no known room", s.path.display())).collect());
}

#[test]
fn crates_are_named_only_where_they_belong() {
    let mut problems = Vec::new();
    for source in sources() {
        for (name, rooms) in CRATES {
            let uses = |line: &str| {
                line.contains(&format!("use {name}::"))
                    || line
                        .match_indices(&format!("{name}::"))
                        .any(|(i, _)| !line[..i].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':'))
            };
            for (number, _) in source.code().filter(|(_, line)| uses(line)) {
                // `crate::load::ron` and the like are modules, which the pattern above leaves out.
                if !rooms.contains(&source.room.as_str()) {
                    problems.push(format!("{}:{number}: {name} outside {rooms:?}", source.path.display()));
                }
            }
        }
    }
    fail_on(problems);
}

#[test]
fn nothing_is_random_timed_or_printed_where_it_must_not_be() {
    let random = ["thread_rng", "rand::rng()", "from_os_rng", "from_entropy", "SysRng", "ThreadRng"];
    let clocks = ["SystemTime", "UNIX_EPOCH", "chrono"];
    let printing = ["println!", "eprintln!", "print!(", "eprint!(", "dbg!("];
    let unfinished = ["todo!", "unimplemented!"];
    let mut problems = Vec::new();
    for source in sources() {
        let prints = source.room == "cli";
        for (number, line) in source.code() {
            let timed: &[&str] = if CLOCKS.contains(&source.room.as_str()) { &[] } else { &clocks };
            let banned = random.iter().chain(timed).chain(&unfinished);
            let banned = banned.chain(printing.iter().filter(|_| !prints));
            for word in banned.filter(|word| line.contains(**word)) {
                problems.push(format!("{}:{number}: {word}", source.path.display()));
            }
        }
    }
    fail_on(problems);
}

/// The system's mathematics differs from machine to machine; only IEEE operations and `libm` reach a picture.
#[test]
fn no_mathematics_of_the_system_library() {
    let names = ["sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sin_cos", "exp", "exp2", "ln", "log2", "log10"];
    let more = ["powf", "powi", "cbrt", "hypot", "tanh", "sinh", "cosh", "mul_add", "exp_m1", "ln_1p"];
    let mut problems = Vec::new();
    for source in sources().into_iter().filter(|s| !["cli", "output"].contains(&s.room.as_str())) {
        for (number, line) in source.code() {
            for name in names.iter().chain(&more) {
                let calls = [format!(".{name}("), format!("f32::{name}"), format!("f64::{name}")];
                if calls.iter().any(|call| line.contains(call.as_str())) && !line.contains("libm::") {
                    problems.push(format!("{}:{number}: {name}", source.path.display()));
                }
            }
        }
    }
    fail_on(problems);
}

/// The name of the type that a line declares, if it declares one. Associated types of traits are indented and do not
/// count; a type that a function keeps to itself does.
fn declared(line: &str) -> Option<&str> {
    let bare = line.trim_start().trim_start_matches("pub ");
    let bare = bare.strip_prefix("pub(").and_then(|rest| rest.split_once(") ")).map_or(bare, |(_, rest)| rest);
    let (word, rest) = bare.split_once(' ')?;
    let is_type = ["struct", "enum", "trait", "union"].contains(&word) || (word == "type" && !line.starts_with(' '));
    let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
    (is_type && name.starts_with(|c: char| c.is_uppercase())).then_some(name)
}

/// One name, one meaning: a reader who finds a type by its name finds the right one.
#[test]
fn a_type_name_is_declared_once() {
    let all = sources();
    let mut places: std::collections::BTreeMap<&str, Vec<String>> = Default::default();
    for source in &all {
        for (number, line) in source.code() {
            if let Some(name) = declared(line) {
                places.entry(name).or_default().push(format!("{}:{number}", source.path.display()));
            }
        }
    }
    let is_listed = |name: &str| SHARED_NAMES.iter().any(|(known, _)| *known == name);
    let twice = places.iter().filter(|(name, at)| at.len() > 1 && !is_listed(name));
    let mut problems: Vec<String> = twice.map(|(name, at)| format!("{name}: {}", at.join(", "))).collect();
    let once = SHARED_NAMES.iter().filter(|(name, _)| places.get(name).is_none_or(|at| at.len() < 2));
    problems.extend(once.map(|(name, _)| format!("{name} is declared once: take it off the list")));
    fail_on(problems);
}

#[test]
fn files_stay_short() {
    let long = sources().into_iter().map(|s| (s.text.lines().count(), s.path)).filter(|(n, _)| *n > LONGEST_FILE);
    fail_on(long.map(|(n, path)| format!("{}: {n} lines", path.display())).collect());
}

#[test]
fn every_example_passes_check() {
    let mut examples = files(&root().join("scripts"), "rhai");
    // What shows import is no sequence by itself.
    examples.retain(|path| !path.starts_with(root().join("scripts/parts")));
    for extension in ["ron", "nff", "p3f"] {
        examples.extend(files(&root().join("scenes"), extension));
    }
    assert!(examples.len() >= 6, "{examples:?}");
    let output = Command::new(env!("CARGO_BIN_EXE_anim")).arg("check").args(&examples).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
