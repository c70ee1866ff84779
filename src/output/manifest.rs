//! What lies in a folder of frames: one line for each file that was written, beside the files.
//!
//! A line is added before its file gets its name, in one write at the end of the file, so that several processes can
//! work on one folder and a kill leaves at most a last line that is cut short. The last line about a file counts, if
//! the bytes of the file are those that it speaks of; a line that is lost costs only a closer look at the file.

use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::metadata::{Provenance, hex};
use super::write_atomic;
use crate::base::digest::Digest;
use crate::base::{disk, files, limits};

/// Name of the manifest in its folder.
pub const NAME: &str = ".anim-manifest.jsonl";

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Relative to the manifest's folder.
    pub file: String,
    /// What the file holds.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Its length.
    pub bytes: u64,
    /// Digest of the file's bytes.
    #[serde(with = "hex")]
    pub checksum: Digest,
    /// Digest of its pixels, as the file itself says it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixels: Option<String>,
    /// The script or scene that it is of, as a path from the project's root: names alone may be those of two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<String>,
}

impl Entry {
    /// Whether a file is of another script or scene than this one. A path that ends as the other does is the same: the
    /// root may have moved up or down.
    pub fn is_of_another(&self, input: &str) -> bool {
        self.input.as_deref().is_some_and(|known| {
            let (known, input) = (Path::new(known), Path::new(input));
            !known.ends_with(input) && !input.ends_with(known)
        })
    }
}

/// The manifest of one folder, as it was when it was read.
#[derive(Debug, Default)]
pub struct Manifest {
    folder: PathBuf,
    /// The script or scene that files are added for, as a path from the project's root.
    input: String,
    entries: FxHashMap<String, Entry>,
}

impl Manifest {
    /// Reads what is there; what cannot be read is as if it were not there.
    ///
    /// A manifest that has grown to many times what it says is written anew.
    pub fn read(folder: &Path, input: &str) -> Self {
        let path = folder.join(NAME);
        let text = files::read_text(&path, limits::MANIFEST_BYTES).unwrap_or_default();
        let mut entries = FxHashMap::default();
        let mut lines = 0;
        for entry in text.lines().filter_map(|line| serde_json::from_str::<Entry>(line).ok()) {
            lines += 1;
            entries.insert(entry.file.clone(), entry);
        }
        let manifest = Manifest { folder: folder.to_path_buf(), input: input.to_string(), entries };
        let is_torn = !text.is_empty() && !text.ends_with('\n');
        if is_torn || lines > 4 * manifest.entries.len() + 1_000 {
            // Where it cannot be written, the old one still serves.
            let _ = manifest.text().map(|text| write_atomic(&path, text.as_bytes()));
        }
        manifest
    }

    /// As [`Self::read`], for whoever adds nothing: the file is left as it is.
    pub fn peek(folder: &Path) -> Self {
        let text = files::read_text(&folder.join(NAME), limits::MANIFEST_BYTES).unwrap_or_default();
        let read = text.lines().filter_map(|line| serde_json::from_str::<Entry>(line).ok());
        let entries = read.map(|entry| (entry.file.clone(), entry)).collect();
        Manifest { folder: folder.to_path_buf(), input: String::new(), entries }
    }

    /// The last line about every file, in no order.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.entries.values()
    }

    /// The script or scene that files are added for.
    pub fn input(&self) -> &str {
        &self.input
    }

    /// The last line about a file.
    pub fn get(&self, file: &Path) -> Option<&Entry> {
        self.entries.get(&self.key(file))
    }

    /// Adds a line about a file that is about to get its name; `None` if the folder keeps no manifest.
    ///
    /// # Errors
    /// The manifest cannot be written.
    pub fn add(&self, file: &Path, provenance: &Provenance, bytes: &[u8]) -> std::io::Result<()> {
        let checksum = Digest::of(bytes);
        let entry = Entry {
            file: self.key(file),
            provenance: provenance.clone(),
            bytes: bytes.len() as u64,
            checksum,
            pixels: super::formats::pixels_note(bytes),
            input: Some(self.input.clone()).filter(|input| !input.is_empty()),
        };
        let path = self.folder.join(NAME);
        let log = disk::open(OpenOptions::new().append(true).create(true), &path)?;
        disk::write_all(&log, &path, line(&entry)?.as_bytes())
    }

    fn key(&self, file: &Path) -> String {
        file.strip_prefix(&self.folder).unwrap_or(file).to_string_lossy().into_owned()
    }

    fn text(&self) -> std::io::Result<String> {
        let mut entries: Vec<&Entry> = self.entries.values().collect();
        entries.sort_by(|a, b| a.file.cmp(&b.file));
        entries.into_iter().map(line).collect()
    }
}

fn line(entry: &Entry) -> std::io::Result<String> {
    Ok(serde_json::to_string(entry)? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn provenance(frame: u32) -> Provenance {
        Provenance { source: "a.rhai".into(), frame, hash: Digest(u128::from(frame)) }
    }

    #[test]
    fn the_last_line_about_a_file_counts() {
        let folder = tempfile::tempdir().unwrap();
        let file = |frame: u32| folder.path().join(format!("a.{frame}.png"));
        let manifest = Manifest::read(folder.path(), "x/a.rhai");
        assert_eq!(manifest.get(&file(1)), None);
        manifest.add(&file(1), &provenance(1), b"one").unwrap();
        manifest.add(&file(2), &provenance(2), b"two").unwrap();
        manifest.add(&file(1), &provenance(3), b"three").unwrap();
        let again = Manifest::read(folder.path(), "x/a.rhai");
        let first = again.get(&file(1)).unwrap();
        assert_eq!((first.provenance.frame, first.bytes, first.checksum), (3, 5, Digest::of(b"three")));
        assert_eq!(again.get(&file(2)).unwrap().provenance, provenance(2));
    }

    #[test]
    fn a_line_that_was_cut_short_spoils_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        Manifest::read(folder.path(), "x/a.rhai").add(&folder.path().join("a"), &provenance(1), b"x").unwrap();
        let whole = std::fs::read(&path).unwrap();
        for cut in 0..whole.len() {
            std::fs::write(&path, [&whole[..], &whole[..cut]].concat()).unwrap();
            Manifest::read(folder.path(), "x/a.rhai").add(&folder.path().join("b"), &provenance(2), b"y").unwrap();
            let read = Manifest::read(folder.path(), "x/a.rhai");
            assert!(read.get(&folder.path().join("a")).is_some() && read.get(&folder.path().join("b")).is_some());
        }
        std::fs::write(&path, b"\xff\x00 nonsense\n{}\n").unwrap();
        assert!(Manifest::read(folder.path(), "x/a.rhai").entries.is_empty());
    }

    #[test]
    fn a_manifest_does_not_grow_for_ever() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let manifest = Manifest::read(folder.path(), "x/a.rhai");
        manifest.add(&folder.path().join("a"), &provenance(1), b"x").unwrap();
        let one = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, one.repeat(2_000)).unwrap();
        assert!(Manifest::read(folder.path(), "x/a.rhai").get(&folder.path().join("a")).is_some());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), one);
    }

    #[test]
    fn two_scripts_of_one_name_are_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.0001.png");
        Manifest::read(folder.path(), "x/a.rhai").add(&file, &provenance(1), b"one").unwrap();
        let manifest = Manifest::read(folder.path(), "y/a.rhai");
        let entry = manifest.get(&file).unwrap();
        assert!(entry.is_of_another("y/a.rhai") && entry.is_of_another("y/x.rhai"));
        for same in ["x/a.rhai", "a.rhai", "root/x/a.rhai"] {
            assert!(!entry.is_of_another(same), "{same}");
        }
    }
}
