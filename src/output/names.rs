//! What a frame's file is called.

use std::path::{Component, Path, PathBuf};

use super::format::Format;
use super::formats::FORMATS;

/// Where pictures go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// One file, for one frame.
    File(PathBuf),
    /// A file per frame: the text before the number, its least number of digits, and the text after it.
    Pattern {
        /// The text before the number, folders included.
        before: String,
        /// Least number of digits.
        digits: usize,
        /// The text after the number, with the ending.
        after: String,
    },
}

impl Target {
    /// The file of a frame, counted from 1.
    pub fn path(&self, frame: u32) -> PathBuf {
        match self {
            Target::File(path) => path.clone(),
            Target::Pattern { before, digits, after } => format!("{before}{frame:0digits$}{after}").into(),
        }
    }

    /// The folder that holds all frames of a pattern, at whatever depth; a single file has none.
    pub fn folder(&self) -> Option<PathBuf> {
        match self {
            Target::File(_) => None,
            Target::Pattern { before, .. } => {
                let end = before.rfind(std::path::is_separator).map_or(0, |last| last + 1);
                Some(if end == 0 { ".".into() } else { before[..end].into() })
            }
        }
    }
}

/// Resolves `-o`: a folder, a pattern with `####`, or a file; without it, the `frames` folder.
///
/// `name` is that of the scene or script, `sequence` whether it is a script, `frames` how many are to be written.
///
/// # Errors
/// What is wrong with `-o`, and what to write instead.
pub fn resolve(out: Option<&str>, name: &str, sequence: bool, frames: usize) -> Result<Target, String> {
    let usual = FORMATS[0].extensions[0];
    let in_folder = |folder: &str| {
        // A script called `...rhai` has the name `..`, which would lead out of the folder.
        if !is_plain(name) {
            return Err(format!("no file can be called `{name}`: name it with -o, as in -o frame.####.png"));
        }
        // `/` alone stays what it is.
        let folder = if folder.len() > 1 { folder.trim_end_matches(['/', '\\']) } else { folder };
        let file = Path::new(folder).join(name).to_string_lossy().into_owned();
        Ok(match sequence {
            true => Target::Pattern { before: format!("{file}."), digits: 4, after: format!(".{usual}") },
            false => Target::File(format!("{file}.{usual}").into()),
        })
    };
    let Some(out) = out else {
        let folder = if sequence { format!("frames/{name}") } else { "frames".into() };
        return in_folder(&folder);
    };
    if out.is_empty() {
        return Err("-o: a folder, a pattern or a file name was expected".into());
    }
    let hashes = out.rfind('#').map(|last| {
        let start = out[..last].trim_end_matches('#').len();
        (start, last + 1 - start)
    });
    if let Some((start, digits)) = hashes {
        let (before, after) = (&out[..start], &out[start + digits..]);
        let after = if after.contains('.') { after.to_string() } else { format!("{after}.{usual}") };
        return known(&format!("frame{after}")).map(|()| Target::Pattern {
            before: before.to_string(),
            digits,
            after: after.clone(),
        });
    }
    if Path::new(out).extension().is_none() || Path::new(out).is_dir() || out.ends_with('/') {
        return in_folder(out);
    }
    known(out)?;
    if frames > 1 {
        let (stem, ending) = out.split_at(out.rfind('.').unwrap_or(out.len()));
        return Err(format!("-o {out}: {frames} frames need a number in their name, as in {stem}.####{ending}"));
    }
    Ok(Target::File(out.into()))
}

/// Whether a name is one part of a path and leads nowhere else.
fn is_plain(name: &str) -> bool {
    let parts: Vec<Component> = Path::new(name).components().collect();
    matches!(parts[..], [Component::Normal(part)] if part == name)
}

/// Sees to it that pictures can be written under a name.
fn known(name: &str) -> Result<(), String> {
    match Format::of_path(Path::new(name)) {
        Some(_) => Ok(()),
        None => Err(format!("-o: pictures are written as {}, not `{name}`", Format::known_extensions())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(out: Option<&str>, sequence: bool, frames: usize) -> String {
        match resolve(out, "show", sequence, frames) {
            Ok(target) => target.path(7).to_string_lossy().into_owned(),
            Err(message) => message,
        }
    }

    #[test]
    fn no_name_leads_out_of_its_folder() {
        for name in ["..", ".", "", "a/b"] {
            for out in [None, Some("out/")] {
                assert!(resolve(out, name, true, 3).unwrap_err().contains("-o frame.####.png"), "{name}");
            }
            assert!(resolve(Some("x.##.png"), name, true, 3).is_ok());
        }
    }

    #[test]
    fn frames_have_their_promised_names() {
        assert_eq!(name(None, true, 9), "frames/show/show.0007.png");
        assert_eq!(name(None, false, 1), "frames/show.png");
        assert_eq!(name(Some("out"), true, 9), "out/show.0007.png");
        assert_eq!(name(Some("out/"), false, 1), "out/show.png");
        assert_eq!(name(Some("x/f##.png"), true, 9), "x/f07.png");
        assert_eq!(name(Some("x/f-#"), true, 9), "x/f-7.png");
        assert_eq!(name(Some("one.png"), true, 1), "one.png");
        assert_eq!(name(Some("x/f####.exr"), true, 9), "x/f0007.exr");
        assert!(name(Some("one.EXR"), true, 2).contains("one.####.EXR"));
        assert!(name(Some("one.png"), true, 2).contains("one.####.png"));
        assert!(name(Some("one.jpg"), true, 1).contains(".png"));
        let Ok(target) = resolve(None, "show", true, 1) else { panic!() };
        assert!(target.path(123_456).ends_with("show.123456.png"));
        assert_eq!(target.folder(), Some("frames/show/".into()));
        let folder = |out: &str| resolve(Some(out), "show", true, 1).unwrap().folder();
        assert_eq!(folder("f.##.png"), Some(".".into()));
        assert_eq!(folder("a/b##/c.png"), Some("a/".into()));
        assert_eq!(folder("one.png"), None);
    }
}
