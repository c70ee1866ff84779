//! Numbered frames on disk: which belong together, and whether all are there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;

/// Frames of one name in the order of their numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reel {
    /// What their names have in common, with `#` for the digits.
    pub pattern: String,
    /// Number and file; numbers ascend.
    pub frames: Vec<(u32, PathBuf)>,
}

/// A file's name around its number.
type Around = (String, String);

impl Reel {
    /// The frames of a folder, or those of a pattern like `shot.####.png` or `shot.%04d.png`.
    ///
    /// Without a pattern the number is the last one in a file's name.
    ///
    /// # Errors
    /// A folder that cannot be read; no frames, more than one sequence of them, two files with one number.
    pub fn find(input: &Path) -> Result<Reel, Diagnostics> {
        let name = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let wanted = parts_of(&name).filter(|_| !input.is_dir());
        let folder = if input.is_dir() { input } else { super::super::folder_of(input) };
        let entries = std::fs::read_dir(folder).map_err(|e| Diagnostic::io(folder.display(), "read", &e))?;
        let mut found: BTreeMap<Around, Vec<(u32, String)>> = BTreeMap::new();
        for file in
            entries.take(limits::FRAMES as usize).flatten().map(|e| e.file_name().to_string_lossy().into_owned())
        {
            let numbered = match &wanted {
                Some((before, digits, after)) => in_pattern(&file, before, *digits, after),
                None => last_number(&file).filter(|_| is_picture(&file)),
            };
            if let Some((around, number)) = numbered {
                found.entry(around).or_default().push((number, file));
            }
        }
        if found.len() > 1 {
            return Err(several(folder, &found).into());
        }
        let Some(((before, after), mut numbered)) = found.pop_first() else {
            let what = format!("{}: no numbered frames (.png or .exr) are there", input.display());
            return Err(Diagnostic::error(what).help("expected names like shot.0001.png").into());
        };
        numbered.sort();
        if let Some(pair) = numbered.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let what = format!("{}: {} and {} have the same number", folder.display(), pair[0].1, pair[1].1);
            return Err(Diagnostic::error(what).into());
        }
        let pattern = format!("{before}####{after}");
        let frames = numbered.into_iter().map(|(number, file)| (number, folder.join(file))).collect();
        Ok(Reel { pattern, frames })
    }

    /// Whether a path names numbered frames by a pattern.
    pub fn is_pattern(input: &Path) -> bool {
        let name = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
        parts_of(&name).is_some()
    }

    /// Keeps the frames with these numbers, in that order.
    ///
    /// # Errors
    /// The numbers that are not there.
    pub fn select(&mut self, numbers: &[u32]) -> Result<(), Diagnostic> {
        let known: BTreeMap<u32, &PathBuf> = self.frames.iter().map(|(number, file)| (*number, file)).collect();
        let missing: Vec<u32> = numbers.iter().copied().filter(|number| !known.contains_key(number)).collect();
        if !missing.is_empty() {
            return Err(self.lacks(&missing));
        }
        self.frames = numbers.iter().filter_map(|n| Some((*n, known.get(n)?.to_path_buf()))).collect();
        Ok(())
    }

    /// Sees to it that no number between the first and the last is missing.
    ///
    /// # Errors
    /// The numbers that are.
    pub fn check_whole(&self) -> Result<(), Diagnostic> {
        let gaps = self.frames.windows(2).flat_map(|pair| pair[0].0 + 1..pair[1].0);
        let missing: Vec<u32> = gaps.take(MOST_NAMED).collect();
        if missing.is_empty() { Ok(()) } else { Err(self.lacks(&missing)) }
    }

    fn lacks(&self, missing: &[u32]) -> Diagnostic {
        let are = if missing.len() == 1 { "frame" } else { "frames" };
        let folder = self.frames.first().and_then(|(_, file)| file.parent()).unwrap_or(Path::new(""));
        let what = format!("{}: {are} {} missing", folder.join(&self.pattern).display(), ranges(missing));
        Diagnostic::error(what).help("render what is missing, or choose what to show with --frames")
    }
}

/// Missing frames that are counted up.
const MOST_NAMED: usize = 10_000;

fn ranges(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [one] => one.to_string(),
        _ => format!("{}-{}", run[0], run[run.len() - 1]),
    });
    let is = if numbers.len() == 1 { "is" } else { "are" };
    format!("{} {is}", runs.take(20).collect::<Vec<_>>().join(", "))
}

fn is_picture(file: &str) -> bool {
    let lower = file.to_lowercase();
    !file.starts_with('.') && (lower.ends_with(".png") || lower.ends_with(".exr"))
}

/// Before the number, its least number of digits, and behind it.
fn parts_of(name: &str) -> Option<(String, usize, String)> {
    if let Some(last) = name.rfind('#') {
        let start = name[..last].trim_end_matches('#').len();
        return Some((name[..start].into(), last + 1 - start, name[last + 1..].into()));
    }
    // As C and ffmpeg have it: `%d`, `%4d`, `%04d`.
    let start = name.find('%')?;
    let length = name[start + 1..].find('d')?;
    let digits = &name[start + 1..start + 1 + length];
    let digits = if digits.is_empty() { 1 } else { digits.parse().ok().filter(|n| (1..=20).contains(n))? };
    Some((name[..start].into(), digits, name[start + length + 2..].into()))
}

fn in_pattern(file: &str, before: &str, digits: usize, after: &str) -> Option<(Around, u32)> {
    let number = file.strip_prefix(before)?.strip_suffix(after)?;
    let is_number = number.len() >= digits && number.bytes().all(|b| b.is_ascii_digit());
    Some(((before.into(), after.into()), number.parse().ok().filter(|_| is_number)?))
}

fn last_number(file: &str) -> Option<(Around, u32)> {
    let stem = &file[..file.rfind('.')?];
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = stem[..end].trim_end_matches(|c: char| c.is_ascii_digit()).len();
    Some(((file[..start].into(), file[end..].into()), file[start..end].parse().ok()?))
}

fn several(folder: &Path, found: &BTreeMap<Around, Vec<(u32, String)>>) -> Diagnostic {
    let one = |((before, after), files): (&Around, &Vec<(u32, String)>)| {
        let frames = if files.len() == 1 { "1 frame".into() } else { format!("{} frames", files.len()) };
        format!("{before}####{after} ({frames})")
    };
    let mut names: Vec<String> = found.iter().map(one).take(8).collect();
    if found.len() > names.len() {
        names.push("...".into());
    }
    let first = found.keys().next().map_or(String::new(), |(before, after)| format!("{before}####{after}"));
    let what = format!("{} has several sequences: {}", folder.display(), names.join(", "));
    Diagnostic::error(what).help(format!("name one of them, as in '{}'", folder.join(first).display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|file| std::fs::write(folder.path().join(file), "").unwrap());
        folder
    }

    fn numbers(folder: &tempfile::TempDir, pattern: &str) -> Result<Vec<u32>, String> {
        let reel = Reel::find(&folder.path().join(pattern)).map_err(|e| e.to_string())?;
        Ok(reel.frames.iter().map(|(number, _)| *number).collect())
    }

    #[test]
    fn frames_are_found_in_the_order_of_their_numbers() {
        let files =
            folder(&["a2.0010.png", "a2.0002.png", "a2.0001.png", "metadata.txt", ".anim-tmp-1.png", "cover.png"]);
        assert_eq!(numbers(&files, ""), Ok(vec![1, 2, 10]));
        for pattern in ["a2.####.png", "a2.#.png", "a2.%04d.png", "a2.%d.png"] {
            assert_eq!(numbers(&files, pattern), Ok(vec![1, 2, 10]), "{pattern}");
            assert!(Reel::is_pattern(Path::new(pattern)));
        }
        assert!(numbers(&files, "a2.#####.png").unwrap_err().contains("no numbered frames"));
        assert!(!Reel::is_pattern(Path::new("100%.rhai")));
    }

    #[test]
    fn what_is_not_one_sequence_is_explained() {
        let two = folder(&["a.1.png", "a.2.png", "b.1.png"]);
        let said = numbers(&two, "").unwrap_err();
        assert!(said.contains("a.####.png (2 frames), b.####.png (1 frame)") && said.contains("a.####.png'"), "{said}");
        assert_eq!(numbers(&two, "a.#.png"), Ok(vec![1, 2]));
        assert!(numbers(&folder(&["a.1.png", "a.01.png"]), "").unwrap_err().contains("same number"));
        assert!(numbers(&folder(&["a.png"]), "").unwrap_err().contains("shot.0001.png"));
        assert!(numbers(&two, "nowhere/a.#.png").unwrap_err().contains("cannot read"));
    }

    #[test]
    fn gaps_are_named() {
        let files = folder(&["a.1.png", "a.4.png", "a.5.png", "a.7.png"]);
        let mut reel = Reel::find(files.path()).unwrap();
        assert!(reel.check_whole().unwrap_err().message.contains("frames 2-3, 6 are missing"));
        assert!(reel.select(&[1, 2]).unwrap_err().message.contains("frame 2 is missing"));
        reel.select(&[7, 1]).unwrap();
        assert_eq!(reel.frames.iter().map(|(n, _)| *n).collect::<Vec<_>>(), [7, 1]);
    }
}
