//! What an input may read: the files below its project root, and folders that its user has allowed.
//!
//! A scene or a script is often somebody else's. What it names is read only below the *project root*, which is the
//! nearest folder above the input that holds `.git`, `golden.ron` or `scenes/`; without one of these it is the input's
//! own folder, and for NFF and P3F scenes the folder above that, where their skies lie. A name that leads out, by `..`,
//! as an absolute path or through a link, is refused, unless it leads into a folder of `--allow-read`.
//!
//! Every file that is looked for is remembered: this one list of a shot's files serves watching, packing and hashing.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::diagnostics::{Cause, Diagnostic};
use super::digest::Digest;

/// What a file is read as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FileRole {
    /// A script in Rhai that is run itself.
    Script,
    /// A script that another one imports.
    Module,
    /// A scene, in any of the formats that are read.
    Scene,
    /// A mesh or an asset.
    Mesh,
    /// A picture, or a folder of pictures.
    Image,
    /// What a script or a scene reads beside these.
    Data,
}

impl FileRole {
    /// Every role.
    pub const ALL: [FileRole; 6] =
        [FileRole::Script, FileRole::Module, FileRole::Scene, FileRole::Mesh, FileRole::Image, FileRole::Data];

    /// The role as messages and archives call it.
    pub fn word(self) -> &'static str {
        match self {
            FileRole::Script => "script",
            FileRole::Module => "module",
            FileRole::Scene => "scene",
            FileRole::Mesh => "mesh",
            FileRole::Image => "image",
            FileRole::Data => "data",
        }
    }
}

/// What the user of a command allows beyond the project root.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Access {
    /// The project root, where the usual one is not meant.
    pub root: Option<PathBuf>,
    /// Folders that may be read too.
    pub allow_read: Vec<PathBuf>,
}

/// Endings of pictures in a folder that a scene names as a whole, as it does for a cube map.
const PICTURES: [&str; 8] = ["jpg", "jpeg", "png", "hdr", "exr", "tga", "bmp", "webp"];
/// What marks a project root.
const MARKS: [&str; 3] = [".git", "golden.ron", "scenes"];

/// One project root with what is allowed beside it, and the files that were looked for.
#[derive(Debug, Default)]
pub struct Project {
    root: PathBuf,
    allowed: Vec<PathBuf>,
    /// The folders above without links, in the same order, the root first.
    resolved: OnceLock<Vec<PathBuf>>,
    files: Arc<Mutex<BTreeMap<PathBuf, FileRole>>>,
    /// Of texts and data that scripts have read: what was in them then.
    read: Arc<Mutex<BTreeMap<PathBuf, ReadFile>>>,
}

/// What a file held when a script read it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadFile {
    /// As what it was read.
    pub role: FileRole,
    /// Of its text or bytes; that of nothing where it could not be read.
    pub content: Digest,
}

impl Project {
    /// The project of an input file, which need not be there.
    ///
    /// # Errors
    /// A root or an allowed folder that is not there; an input outside of the root that was asked for.
    pub fn of(input: &Path, access: &Access) -> Result<Arc<Project>, Diagnostic> {
        for folder in access.root.iter().chain(&access.allow_read) {
            if !folder.is_dir() {
                let flag = if access.root.as_ref() == Some(folder) { "--root" } else { "--allow-read" };
                let message = format!("{flag} {}: there is no such folder", folder.display());
                return Err(Diagnostic::error(message).because(Cause::Usage));
            }
        }
        let own = folder_of(input);
        let project = match &access.root {
            Some(root) => Project::new(root.clone(), access.allow_read.clone()),
            None => Project::new(usual_root(input, own), access.allow_read.clone()),
        };
        if access.root.is_some() && own.is_dir() && !project.holds(own) {
            let message = format!("{} does not lie below --root {}", input.display(), project.root.display());
            return Err(Diagnostic::error(message).because(Cause::Usage));
        }
        Ok(Arc::new(project))
    }

    /// A project of these folders.
    pub fn new(root: PathBuf, allowed: Vec<PathBuf>) -> Project {
        Project { root, allowed, ..Project::default() }
    }

    /// The folder below which files are read.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Folders that may be read beside the root.
    pub fn allowed(&self) -> &[PathBuf] {
        &self.allowed
    }

    /// The same with one more folder that may be read; what is looked for in either is one list.
    pub fn and(&self, folder: &Path) -> Project {
        let allowed = self.allowed.iter().cloned().chain([folder.to_path_buf()]).collect();
        let (files, read) = (self.files.clone(), self.read.clone());
        Project { root: self.root.clone(), allowed, resolved: OnceLock::new(), files, read }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<PathBuf, FileRole>> {
        // Whoever fell over left a whole map behind.
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Remembers a file that is or was to be read.
    pub fn record(&self, path: &Path, role: FileRole) {
        let mut files = self.lock();
        let known = files.entry(tidy(path)).or_insert(role);
        if *known == FileRole::Data {
            // What a digest depends on counts as data until somebody says more.
            *known = role;
        }
    }

    /// Remembers what was in a file that a script has read, the first time.
    pub fn note_content(&self, path: &Path, role: FileRole, content: &[u8]) {
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        read.entry(tidy(path)).or_insert(ReadFile { role, content: Digest::of(content) });
    }

    /// What scripts have read, and what was in it.
    pub fn contents(&self) -> Vec<(PathBuf, ReadFile)> {
        let read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        read.iter().map(|(path, file)| (path.clone(), *file)).collect()
    }

    /// How many files and folders were looked for.
    pub fn count(&self) -> usize {
        self.lock().len()
    }

    /// What was looked for, folders as such.
    pub fn recorded(&self) -> Vec<(PathBuf, FileRole)> {
        self.lock().iter().map(|(path, role)| (path.clone(), *role)).collect()
    }

    /// Every file that was looked for, there or not, in the order of their paths; a folder of pictures as the pictures
    /// that are in it.
    pub fn files(&self) -> Vec<(PathBuf, FileRole)> {
        let known = self.lock().clone();
        known.into_iter().flat_map(|(path, role)| contents(&path).into_iter().map(move |path| (path, role))).collect()
    }

    /// Where a file lies as seen from the root: what it is called in a list or an archive. The path itself where it lies
    /// elsewhere.
    pub fn shown(&self, path: &Path) -> PathBuf {
        let (root, full) = (self.root.canonicalize(), path.canonicalize());
        let below =
            root.ok().zip(full.ok()).and_then(|(root, full)| full.strip_prefix(root).ok().map(Path::to_path_buf));
        below.unwrap_or_else(|| path.to_path_buf())
    }

    /// Whether something that is there may be read, links followed.
    pub fn holds(&self, path: &Path) -> bool {
        path.canonicalize().is_ok_and(|full| self.folders().iter().any(|folder| full.starts_with(folder)))
    }

    fn folders(&self) -> &[PathBuf] {
        self.resolved.get_or_init(|| {
            let all = std::iter::once(&self.root).chain(&self.allowed);
            all.filter_map(|folder| or_here(folder).canonicalize().ok()).collect()
        })
    }

    /// Whether a path that leads nowhere yet would be inside, going by its name.
    fn would_hold(&self, path: &Path) -> bool {
        let full =
            or_here(folder_of(path)).canonicalize().map(|folder| folder.join(path.file_name().unwrap_or_default()));
        let full = full.or_else(|_| std::path::absolute(path)).map(|full| tidy(&full)).unwrap_or_default();
        self.folders().iter().any(|folder| full.starts_with(folder)) || self.roots_by_name(&full)
    }

    fn roots_by_name(&self, full: &Path) -> bool {
        let all = std::iter::once(&self.root).chain(&self.allowed);
        all.filter_map(|folder| std::path::absolute(or_here(folder)).ok()).any(|folder| full.starts_with(tidy(&folder)))
    }

    /// The refusal of a name that leads out.
    fn refusal(&self, name: &str) -> Diagnostic {
        let root = or_here(&self.root);
        let root = root.canonicalize().unwrap_or_else(|_| root.to_path_buf());
        Diagnostic::error(format!("`{name}` lies outside of the project {}", root.display())).help(
            "files are read below the project root: --root DIR sets another one, --allow-read DIR allows a folder more",
        )
    }
}

/// The folder that a file lies in.
fn folder_of(path: &Path) -> &Path {
    or_here(path.parent().unwrap_or(Path::new("")))
}

fn or_here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

fn usual_root(input: &Path, own: &Path) -> PathBuf {
    let Ok(start) = own.canonicalize() else { return own.to_path_buf() };
    let is_root = |folder: &&Path| MARKS.iter().any(|mark| folder.join(mark).exists());
    if let Some(root) = start.ancestors().find(is_root) {
        return root.to_path_buf();
    }
    let has_sky_above =
        input.extension().is_some_and(|e| ["nff", "p3f"].iter().any(|known| e.eq_ignore_ascii_case(known)));
    let above = start.parent().filter(|above| has_sky_above && above.parent().is_some());
    above.unwrap_or(&start).to_path_buf()
}

/// The path without `.` and without `x/..`.
pub fn tidy(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::Normal(_))) => {
                out.pop();
            }
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::RootDir)) => {}
            part => out.push(part),
        }
    }
    out
}

/// What a name stands for: the file itself, or the pictures in a folder in the order of their names.
pub fn contents(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return vec![path.to_path_buf()];
    }
    let is_picture =
        |path: &PathBuf| path.extension().is_some_and(|e| PICTURES.iter().any(|known| e.eq_ignore_ascii_case(known)));
    let Ok(entries) = std::fs::read_dir(path) else { return Vec::new() };
    let mut pictures: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_picture).collect();
    pictures.sort();
    pictures
}

/// A folder that names in an input are relative to, in its project.
#[derive(Clone, Default)]
pub struct Folder {
    path: PathBuf,
    project: Arc<Project>,
}

impl Folder {
    /// The folder `path` of a project.
    pub fn new(path: impl Into<PathBuf>, project: Arc<Project>) -> Self {
        Folder { path: path.into(), project }
    }

    /// The folder that a file lies in.
    pub fn around(file: &Path, project: Arc<Project>) -> Self {
        Folder::new(file.parent().unwrap_or(Path::new("")), project)
    }

    /// The project that the files belong to.
    pub fn project(&self) -> &Arc<Project> {
        &self.project
    }

    /// The path of a file or folder that an input names; it need not be there. It is remembered as one of the project.
    ///
    /// # Errors
    /// The name leads out of the project.
    pub fn find(&self, name: &str, role: FileRole) -> Result<PathBuf, Diagnostic> {
        let path = self.admit(name)?;
        self.project.record(&path, role);
        Ok(path)
    }

    /// As [`Self::find`], for a name that may not be one of a file: it is not remembered.
    ///
    /// # Errors
    /// The name leads out of the project.
    pub fn admit(&self, name: &str) -> Result<PathBuf, Diagnostic> {
        let path = self.path.join(name);
        let is_inside = match path.symlink_metadata() {
            Ok(_) => self.project.holds(&path) || (path.canonicalize().is_err() && self.project.would_hold(&path)),
            Err(_) => self.project.would_hold(&path),
        };
        if is_inside { Ok(path) } else { Err(self.project.refusal(name)) }
    }
}

/// A folder that is its own project.
impl From<PathBuf> for Folder {
    fn from(path: PathBuf) -> Self {
        let project = Arc::new(Project::new(path.clone(), Vec::new()));
        Folder { path, project }
    }
}

impl From<&Path> for Folder {
    fn from(path: &Path) -> Self {
        path.to_path_buf().into()
    }
}

impl Deref for Folder {
    type Target = Path;
    fn deref(&self) -> &Path {
        &self.path
    }
}

impl std::fmt::Debug for Folder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.path.fmt(f)
    }
}

/// Which project it belongs to is no part of what a scene says.
impl PartialEq for Folder {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn desk(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "x").unwrap();
        }
        folder
    }

    fn project(input: &Path) -> Arc<Project> {
        Project::of(input, &Access::default()).unwrap()
    }

    #[test]
    fn the_root_is_the_nearest_marked_folder_or_the_inputs_own() {
        let desk = desk(&[
            "p/scenes/a.ron",
            "p/scripts/x/s.rhai",
            "q/golden.ron",
            "q/r/.git/HEAD",
            "q/r/s/a.ron",
            "n/m/a.nff",
        ]);
        let root = |input: &str| project(&desk.path().join(input)).shown_root(desk.path());
        assert_eq!(root("p/scenes/a.ron"), "p");
        assert_eq!(root("p/scripts/x/s.rhai"), "p");
        assert_eq!(root("q/r/s/a.ron"), "q/r");
        assert_eq!(root("q/a.ron"), "q");
        assert_eq!(root("n/m/a.nff"), "n");
        assert_eq!(root("n/m/a.ron"), "n/m");
    }

    impl Project {
        fn shown_root(&self, desk: &Path) -> String {
            self.root.strip_prefix(desk.canonicalize().unwrap()).unwrap().to_string_lossy().replace('\\', "/")
        }
    }

    #[test]
    fn names_that_lead_out_are_refused_there_or_not() {
        let desk = desk(&["p/scenes/a.ron", "p/t/x.png", "out/x.png", "p.png"]);
        let input = desk.path().join("p/scenes/a.ron");
        let folder = Folder::around(&input, project(&input));
        for inside in ["x.png", "../t/x.png", "../t/none.png", "none/x.png", "../../p/t/x.png", "."] {
            assert!(folder.find(inside, FileRole::Image).is_ok(), "{inside}");
        }
        let outside = desk.path().join("out/x.png");
        for name in ["../../out/x.png", "../../out/none.png", "none/../../../out/x.png", "../../p.png", "../..", "/"] {
            let said = folder.find(name, FileRole::Image).unwrap_err().to_string();
            assert!(said.contains("outside of the project") && said.contains("--allow-read"), "{name}: {said}");
        }
        assert!(folder.find(&outside.to_string_lossy(), FileRole::Image).is_err());
        let access = Access { root: None, allow_read: vec![desk.path().join("out")] };
        let folder = Folder::around(&input, Project::of(&input, &access).unwrap());
        assert!(folder.find(&outside.to_string_lossy(), FileRole::Image).is_ok());
        assert!(folder.find("../../p.png", FileRole::Image).is_err());
        let narrow = Access { root: Some(desk.path().join("p/t")), allow_read: vec![] };
        assert!(Project::of(&input, &narrow).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_those_that_leave_are_refused() {
        use std::os::unix::fs::symlink;
        let desk = desk(&["p/a.ron", "p/t/x.png", "out/x.png"]);
        let at = |name: &str| desk.path().join(name);
        symlink(at("out"), at("p/leaves")).unwrap();
        symlink("t", at("p/stays")).unwrap();
        symlink(at("out/x.png"), at("p/x.png")).unwrap();
        symlink(at("nowhere"), at("p/dangling.png")).unwrap();
        let folder: Folder = at("p").into();
        assert!(folder.find("stays/x.png", FileRole::Image).is_ok());
        for name in ["leaves/x.png", "leaves/none.png", "x.png", "stays/../leaves/x.png"] {
            assert!(folder.find(name, FileRole::Image).is_err(), "{name}");
        }
        // What it would lead to cannot be read, whoever asks.
        assert!(folder.find("dangling.png", FileRole::Image).is_ok());
    }

    #[test]
    fn what_was_looked_for_is_one_list() {
        let desk = desk(&["a.ron", "sky/left.png", "sky/notes.txt", "sky/up.JPG"]);
        let input = desk.path().join("a.ron");
        let project = Project::of(&input, &Access { root: Some(desk.path().into()), ..Access::default() }).unwrap();
        let folder = Folder::around(&input, project.clone());
        for name in ["sky", "./none.png", "sky/../none.png"] {
            folder.find(name, FileRole::Image).unwrap();
        }
        project.record(&input, FileRole::Scene);
        folder.admit("not a file").unwrap();
        let list: Vec<String> =
            project.files().iter().map(|(path, _)| project.shown(path).display().to_string()).collect();
        assert_eq!(list[0], "a.ron");
        assert!(list[1].ends_with("none.png"));
        assert_eq!(list[2..], ["sky/left.png", "sky/up.JPG"]);
    }
}
