//! Running the program as a user would, in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;

use anim::components::{Render, Scene};
use anim::film::Film;
use anim::systems;
use tempfile::TempDir;

/// The picture of a scene with other settings, rendered in this process.
pub fn film(scene: &Scene, render: Render) -> Film {
    let mut stage = systems::spawn(Scene { render, ..scene.clone() }).unwrap();
    let (film, _) = systems::render(&mut stage, &AtomicBool::new(false), &|_, _| {}).unwrap().unwrap();
    film
}

/// A folder with a few files in it, gone when dropped.
pub struct Sandbox {
    folder: TempDir,
}

/// What one run left behind.
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Sandbox {
    pub fn new() -> Self {
        Sandbox { folder: TempDir::new().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) -> &Self {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
        self
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// Every file below the folder, by its path relative to it.
    pub fn files(&self) -> Vec<String> {
        let mut found = Vec::new();
        list(self.folder.path(), self.folder.path(), &mut found);
        found.sort();
        found
    }

    /// Runs `anim` with the words of `arguments` in this folder.
    pub fn anim(&self, arguments: &str) -> Run {
        self.anim_with(&[], arguments)
    }

    /// As [`Self::anim`], with variables of the environment.
    pub fn anim_with(&self, variables: &[(&str, &str)], arguments: &str) -> Run {
        let output = Command::new(env!("CARGO_BIN_EXE_anim"))
            .args(arguments.split_whitespace())
            .envs(variables.iter().copied())
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        Run {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

impl Run {
    /// The run, if it ended well.
    #[track_caller]
    pub fn ok(self) -> Self {
        assert_eq!(self.code, 0, "{}\n{}", self.stdout, self.stderr);
        self
    }

    /// The run, if it ended with this exit code and said all of this on stderr.
    #[track_caller]
    pub fn fails(self, code: i32, said: &[&str]) -> Self {
        assert_eq!(self.code, code, "{}\n{}", self.stdout, self.stderr);
        for text in said {
            assert!(self.stderr.contains(text), "`{text}` is not in:\n{}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }
}

fn list(root: &Path, folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            list(root, &entry, found);
        } else {
            found.push(entry.strip_prefix(root).unwrap().to_string_lossy().into_owned());
        }
    }
}

/// The picture of a scene as the program writes it, rendered with these arguments.
pub fn picture(sandbox: &Sandbox, scene: &str, arguments: &str) -> image::Rgb32FImage {
    sandbox.write("scene.ron", scene);
    sandbox.anim(&format!("scene.ron -o out.png --depth 16 {arguments}")).ok();
    image::load_from_memory(&sandbox.read("out.png")).unwrap().to_rgb32f()
}

/// The mean over all pixels and channels.
pub fn mean(picture: &image::Rgb32FImage) -> f32 {
    picture.pixels().map(|p| p.0.iter().sum::<f32>() / 3.0).sum::<f32>() / (picture.width() * picture.height()) as f32
}
