//! A full disk at every step of every command that writes: the exit code says so, what is there is whole, and the same
//! command finishes it when there is room.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Parser;

use super::{Arguments, Exit, exit_code, run};
use crate::base::disk::FullDisk;

const STILL: &str = "(
    render: (size: (12, 8), samples: 1),
    entities: [(name: \"ball\", sphere: ()), (point_light: (position: (2.0, 3.0, 4.0)))],
)";

/// A sequence that needs no script, and so no process beside this one.
const SEQUENCE: &str = "a 0 1 3
v
from 0 1 6
at 0 0 0
up 0 1 0
angle 40
hither 0.1
resolution 12 8
l -2 3 4
xs 1 1 1 0 1 0 30 1 0 0 {
f 0.2 0.4 0.8 0.7 0.3 10 0 1
s 0 0 0 1
}
k camera {
transl 4
-1 0 1 6 0 0 0
0 0 1 6 0 0 0
1 0 1 5 0 0 0
2 0 1 4 0 0 0
}
";

/// Every file below a folder, but what workers and manifests note for themselves.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            assert!(!name.starts_with(".anim-tmp-"), "{name} is left");
            match entry.path() {
                path if path.is_dir() && name != ".anim-claims" => folders.push(path),
                path if path.is_file() && !name.ends_with(".jsonl") => {
                    drop(found.insert(path.clone(), std::fs::read(path).unwrap()));
                }
                _ => {}
            }
        }
    }
    found
}

/// A folder with inputs, and one to write to.
struct DiskDesk {
    folder: tempfile::TempDir,
}

impl DiskDesk {
    fn new() -> DiskDesk {
        DiskDesk { folder: tempfile::tempdir().unwrap() }
    }

    /// Where is written.
    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// Runs a command; `@` stands for the folder. Gives the exit code and what is wrong.
    fn run(&self, words: &str) -> (Exit, String) {
        let folder = self.folder.path().to_string_lossy().into_owned();
        let words = words.split(' ').map(|word| OsString::from(word.replace('@', &folder)));
        let parsed = Arguments::try_parse_from([OsString::from("anim")].into_iter().chain(words));
        match run(parsed.unwrap_or_else(|error| panic!("{error}")).command) {
            Ok(exit) => (exit, String::new()),
            Err(problems) => (exit_code(&problems), problems.to_string()),
        }
    }

    /// Runs a command that does what it should.
    #[track_caller]
    fn ok(&self, words: &str) {
        assert_eq!(self.run(words), (Exit::Done, String::new()), "{words}");
    }

    /// The inputs, and nothing else.
    fn lay(&self, prepared: &BTreeMap<PathBuf, Vec<u8>>) {
        let _ = std::fs::remove_dir_all(self.out());
        std::fs::create_dir_all(self.out()).unwrap();
        for (path, bytes) in prepared {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
    }
}

/// Fails every step of a command in turn; gives what the steps are.
fn with_a_full_disk(desk: &DiskDesk, words: &str) -> Vec<&'static str> {
    let before = files(&desk.out());
    let disk = FullDisk::below(&desk.out(), usize::MAX, false);
    desk.ok(words);
    let steps = disk.steps();
    drop(disk);
    let after = files(&desk.out());
    assert!(!steps.is_empty() && after != before, "{words}: {steps:?}");
    for (at, step) in steps.iter().enumerate() {
        for lasts in [true, false] {
            let case = format!("{words}: `{step}`, {at} of {}, lasts: {lasts}", steps.len());
            desk.lay(&before);
            let disk = FullDisk::below(&desk.out(), at, lasts);
            let (exit, said) = desk.run(words);
            drop(disk);
            let there = files(&desk.out());
            // A worker whose notes cannot be written loses claims, not frames.
            let is_lost = exit == Exit::Done && words.contains("--claims") && there == after;
            assert!(is_lost || matches!(exit, Exit::Failed | Exit::Io), "{case}: {exit:?} {said}");
            for (path, bytes) in &there {
                let is_whole = after.get(path) == Some(bytes) || before.get(path) == Some(bytes);
                assert!(is_whole, "{case}: {} is neither old nor new", path.display());
            }
            assert!(before.keys().all(|path| there.contains_key(path)), "{case}: a file is gone");
            desk.ok(words);
            assert_eq!(files(&desk.out()), after, "{case}: again");
        }
    }
    steps
}

/// A desk with what commands begin with.
fn desk() -> DiskDesk {
    let desk = DiskDesk::new();
    std::fs::create_dir_all(desk.out()).unwrap();
    let write = |name: &str, text: &str| std::fs::write(desk.folder.path().join(name), text).unwrap();
    write("still.ron", STILL);
    write("show.aff", SEQUENCE);
    desk
}

#[test]
fn frames_are_whole_or_missing_on_a_full_disk() {
    let desk = desk();
    let mut steps = Vec::new();
    for words in [
        "render @/still.ron -o @/out/a.png",
        "render @/still.ron -o @/out/deeper/a.exr",
        "render @/show.aff --frames 1-2 -o @/out/frames/",
        "render @/show.aff --frames 1-2 -o @/out/frames/ --claims",
    ] {
        desk.lay(&BTreeMap::new());
        steps.extend(with_a_full_disk(&desk, words));
    }
    for step in ["make a folder", "make a temporary file", "open", "write", "name", "link"] {
        assert!(steps.contains(&step), "{step}: {steps:?}");
    }
}

#[test]
fn films_archives_and_texts_are_whole_or_missing_on_a_full_disk() {
    let desk = desk();
    desk.ok("render @/show.aff --frames 1-2 -o @/frames/");
    desk.ok("render @/still.ron --size 32x16 --tiles 1/2 -o @/1.exr");
    desk.ok("render @/still.ron --size 32x16 --tiles 2/2 -o @/2.exr");
    let mut steps = Vec::new();
    for words in [
        "film @/frames -o @/out/x.apng",
        "film @/frames -o @/out/x.webp",
        "film @/frames -o @/out/x.gif",
        "film @/frames -o @/out/x.y4m",
        "sheet @/frames -o @/out/sheet.png",
        "merge @/1.exr @/2.exr -o @/out/whole.exr",
        "pack @/still.ron -o @/out/a.anim.zip",
        "pack @/still.ron -o @/out/a.anim",
        "convert @/show.aff -o @/out/b.ron",
        "dump @/still.ron -o @/out/c.ron",
        "farm make @/show.aff --to @/out/show.mk",
    ] {
        desk.lay(&BTreeMap::new());
        steps.extend(with_a_full_disk(&desk, words));
    }
    assert!(steps.contains(&"write a piece"), "{steps:?}");
}

#[test]
fn an_edited_scene_is_the_old_or_the_new_one_on_a_full_disk() {
    let desk = desk();
    let scene = BTreeMap::from([(desk.out().join("scene.ron"), STILL.as_bytes().to_vec())]);
    desk.lay(&scene);
    with_a_full_disk(&desk, "set @/out/scene.ron entities.ball.sphere.radius=0.5");
}
