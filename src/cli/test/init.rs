//! `anim test --init`: a first list of golden frames for scripts and scenes.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::shown;
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::cli::{AccessArguments, Exit, evaluation, print, say};
use crate::load::golden::GOLDEN_FILE;
use crate::output::write_atomic;
use crate::shot::{self, OpenOptions};

/// The longer side of a golden, and its samples, unless the list says otherwise: small files, and quick to render.
const SIDE: u32 = 160;
const SAMPLES: u32 = 4;
/// Frames of a script that are golden at first, spread over it.
const FRAMES: u32 = 4;

/// Writes `golden.ron` beside the first input; without inputs, for the scripts of this folder.
///
/// # Errors
/// A list that is there already; inputs that are wrong.
pub fn run(inputs: &[PathBuf], access: &AccessArguments) -> Result<Exit, Diagnostics> {
    let inputs = if inputs.is_empty() { scripts_here()? } else { inputs.to_vec() };
    let Some(first) = inputs.first() else {
        let help = "name scripts or scenes: anim test --init show.rhai";
        return Err(Diagnostic::error("there is no script in this folder").help(help).because(Cause::Usage).into());
    };
    let folder = first.parent().unwrap_or(Path::new("")).to_path_buf();
    let file = folder.join(GOLDEN_FILE);
    if file.exists() {
        let help = "add entries to it, or remove it first";
        let problem = Diagnostic::error(format!("{} is there already", shown(&file))).help(help);
        return Err(problem.because(Cause::Usage).into());
    }
    let mut entries = String::new();
    let mut names: Vec<String> = Vec::new();
    let mut count = 0;
    for input in &inputs {
        let options = OpenOptions { access: access.access(), evaluation: evaluation()?, ..OpenOptions::default() };
        let (mut shot, warnings) = shot::open_with(input, options)?;
        say(&warnings);
        let frames = spread(shot.frames());
        count += frames.len();
        let [width, height] = shot.scene_of(1)?.render.size.map(f64::from);
        let shrunk = |side: f64| ((side * f64::from(SIDE) / width.max(height)).round() as u32).max(1);
        let name = unique(&shot.name, &mut names);
        let given_name = if name == shot.name { String::new() } else { format!("name: {name:?}, ") };
        let frames: Vec<String> = frames.iter().map(u32::to_string).collect();
        let frames = if shot.is_sequence() { format!(", frames: \"{}\"", frames.join(",")) } else { String::new() };
        let script = relative(input, &folder);
        let size = format!("size: ({}, {})", shrunk(width), shrunk(height));
        let _ = writeln!(entries, "        ({given_name}script: {script:?}{frames}, {size}),");
    }
    write_atomic(&file, text(&entries).as_bytes())?;
    let list = if folder.as_os_str().is_empty() { String::new() } else { format!(" {}", shown(&file)) };
    print(&format!("{}: {count} golden frames of {}\n", shown(&file), counted(inputs.len())));
    print(&format!("next: `anim test{list} --accept` renders them and makes them golden; `anim test{list}` tests\n"));
    Ok(Exit::Done)
}

fn counted(inputs: usize) -> String {
    if inputs == 1 { "1 input".into() } else { format!("{inputs} inputs") }
}

fn text(entries: &str) -> String {
    format!(
        "// Golden frames: `anim test` renders these and compares them with the pictures in `folder`.\n\
         // Pictures change only when you accept them: `anim test --accept`, or one by one with `anim test --review`.\n\
         (\n    folder: \"golden\",\n    samples: {SAMPLES},\n\
         \x20   // flip: 0.02,    // forgives a mean FLIP error of so much, 0 to 1; without it every pixel counts\n\
         \x20   // max: 2,        // forgives so many steps of 255 in any channel\n\
         \x20   entries: [\n{entries}    ],\n)\n"
    )
}

/// The first frame, the last, and some between.
fn spread(count: u32) -> Vec<u32> {
    let last = u64::from(count.max(1)) - 1;
    let steps = u64::from(FRAMES.min(count.max(1))) - 1;
    let mut frames: Vec<u32> = (0..=steps).map(|i| (1 + i * last / steps.max(1)) as u32).collect();
    frames.dedup();
    frames
}

fn unique(stem: &str, names: &mut Vec<String>) -> String {
    let mut name = stem.to_string();
    let mut number = 2;
    while names.contains(&name) {
        name = format!("{stem}-{number}");
        number += 1;
    }
    names.push(name.clone());
    name
}

/// An input as seen from the list's folder, if it lies below; as it was named otherwise.
fn relative(input: &Path, folder: &Path) -> String {
    let below = input.strip_prefix(folder).map(Path::to_path_buf);
    let path = below.unwrap_or_else(|_| std::path::absolute(input).unwrap_or_else(|_| input.to_path_buf()));
    path.to_string_lossy().replace('\\', "/")
}

fn scripts_here() -> Result<Vec<PathBuf>, Diagnostics> {
    let entries = std::fs::read_dir(".").map_err(|e| Diagnostic::io(".", "read", &e))?;
    let is_script = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("rhai"));
    let mut scripts: Vec<PathBuf> =
        entries.flatten().map(|entry| PathBuf::from(entry.file_name())).filter(is_script).collect();
    scripts.sort();
    Ok(scripts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_spread_and_names_differ() {
        assert_eq!(spread(48), [1, 16, 32, 48]);
        assert_eq!((spread(1), spread(2), spread(4)), (vec![1], vec![1, 2], vec![1, 2, 3, 4]));
        assert_eq!(spread(1_000_000).last(), Some(&1_000_000));
        let mut names = Vec::new();
        assert_eq!((unique("a", &mut names), unique("a", &mut names)), ("a".into(), "a-2".into()));
        assert_eq!(relative(Path::new("x/a.rhai"), Path::new("x")), "a.rhai");
        assert_eq!(relative(Path::new("a.rhai"), Path::new("")), "a.rhai");
    }
}
