//! Pictures change only together with their version.
//!
//! `tests/golden/VERSION` holds the picture version that the goldens were blessed at, and a digest of the pixels of each
//! show. Users' frames are known by that version: were a pixel to change without it, a frame of the older program would
//! count as done.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use anim::base::digest::{Digest, Hasher};
use anim::compare::Picture;
use anim::shot::fingerprint::PICTURES;

/// The picture version and the digest of each show.
#[derive(Debug, Default, PartialEq)]
struct Record {
    version: u32,
    shows: BTreeMap<String, Digest>,
}

impl Record {
    fn parse(text: &str) -> Record {
        let mut record = Record::default();
        for (word, value) in text.lines().filter_map(|line| line.split_once(' ')) {
            match word {
                "pictures" => record.version = value.parse().unwrap(),
                show => drop(record.shows.insert(show.into(), value.parse().unwrap())),
            }
        }
        record
    }

    fn text(&self) -> String {
        let mut text = format!("pictures {}\n", self.version);
        self.shows.iter().for_each(|(show, digest)| writeln!(text, "{show} {digest}").unwrap());
        text
    }

    /// The goldens as they are.
    fn of(folder: &Path) -> Record {
        let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.retain(|file| file.extension().is_some_and(|ending| ending == "png"));
        files.sort();
        let mut hashers: BTreeMap<String, Hasher> = BTreeMap::new();
        for file in files {
            let name = file.file_name().unwrap().to_string_lossy().into_owned();
            let hasher = hashers.entry(name.split('.').next().unwrap().to_string()).or_default();
            hasher.text(&name);
            let picture = Picture::read(&file).unwrap();
            hasher.word(picture.width.into());
            picture.pixels.iter().flatten().for_each(|x| hasher.number(f64::from(*x)));
        }
        let shows = hashers.into_iter().map(|(show, hasher)| (show, hasher.finish())).collect();
        Record { version: PICTURES, shows }
    }

    /// What is wrong with the goldens as they are `now`, after they were blessed as `self` says.
    fn complaint(&self, now: &Record) -> Option<String> {
        let is_other = |show: &&String| self.shows[*show] != now.shows.get(*show).copied().unwrap_or_default();
        let changed: Vec<&String> = self.shows.keys().filter(is_other).collect();
        if !changed.is_empty() && self.version == now.version {
            return Some(format!("{changed:?} changed: raise `PICTURES`, {}, and bless again", self.version));
        }
        (self != now).then(|| "bless with ANIM_BLESS=1 cargo test golden, then ANIM_BLESS=1 cargo test version".into())
    }
}

#[test]
fn goldens_change_only_with_the_picture_version() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let path = folder.join("VERSION");
    let known = Record::parse(&std::fs::read_to_string(&path).unwrap_or_default());
    let now = Record::of(&folder);
    let complaint = known.complaint(&now);
    let may_bless = complaint.as_ref().is_some_and(|complaint| complaint.starts_with("bless"));
    if may_bless && std::env::var_os("ANIM_BLESS").is_some() {
        return std::fs::write(&path, now.text()).unwrap();
    }
    assert_eq!(complaint, None);
}

#[test]
fn a_changed_golden_asks_for_a_new_version_and_a_new_show_does_not() {
    let record = |version: u32, shows: &[(&str, u128)]| Record {
        version,
        shows: shows.iter().map(|(show, digest)| (show.to_string(), Digest(*digest))).collect(),
    };
    let known = record(3, &[("a", 1), ("b", 2)]);
    assert_eq!(Record::parse(&known.text()), known);
    assert_eq!(known.complaint(&known), None);
    let raise = |now: Record| known.complaint(&now).unwrap().contains("raise `PICTURES`");
    assert!(raise(record(3, &[("a", 1), ("b", 7)])) && raise(record(3, &[("a", 1)])));
    assert!(!raise(record(4, &[("a", 1), ("b", 7)])) && !raise(record(3, &[("a", 1), ("b", 2), ("c", 3)])));
}
