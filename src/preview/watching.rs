//! Files that are watched. Whoever watches hears of contents that changed, and of nothing else: an event of the system
//! only says where to look.
//!
//! Reading a file raises events too, an editor saves by writing another file and renaming it, a network drive raises
//! nothing, and a folder that was deleted and made again is another one for the system. So folders are watched, not files;
//! every event is answered by comparing contents by their digests; and once a second sizes and times are compared whatever
//! the system says.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use notify::{EventKind, RecommendedWatcher, RecursiveMode, Watcher};

use crate::base::diagnostics::{Cause, Diagnostic};
use crate::base::digest::{Digest, Hasher};
use crate::base::{files, limits};

/// Silence after which a burst of events is over: an editor writes a file in a few milliseconds.
const QUIET: Duration = Duration::from_millis(8);
/// Bursts are not waited for longer than this.
const LONGEST_BURST: Duration = Duration::from_millis(80);
/// What an editor has emptied or removed a moment ago it is about to write.
const HALF_SAVED: Duration = Duration::from_millis(50);
/// After so many looks it counts as emptied or removed.
const HALF_SAVED_LOOKS: u32 = 4;
/// How often files are looked at that raised no event, as on network drives.
const BEAT: Duration = Duration::from_secs(1);

/// A file as it was seen last.
#[derive(Clone, Debug)]
struct SeenFile {
    /// What the system says of it, to know without reading that it is the same.
    stamp: Option<Metadata>,
    /// `None` if it is not there.
    digest: Option<Digest>,
    is_empty: bool,
}

type SeenFiles = BTreeMap<PathBuf, SeenFile>;

/// A watch over some files, until it is dropped.
pub struct FileWatch {
    seen: Arc<Mutex<SeenFiles>>,
    wake: Sender<Option<PathBuf>>,
}

fn lock(seen: &Mutex<SeenFiles>) -> MutexGuard<'_, SeenFiles> {
    seen.lock().unwrap_or_else(PoisonError::into_inner)
}

impl FileWatch {
    /// Starts a watch over no files; `changed` is called from a thread of its own with those whose contents changed.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(changed: impl Fn(Vec<PathBuf>) + Send + 'static) -> Result<FileWatch, Diagnostic> {
        let (wake, events) = channel::<Option<PathBuf>>();
        let seen: Arc<Mutex<SeenFiles>> = Arc::default();
        let of_system = wake.clone();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            // An access is nobody's edit. Whatever else goes wrong with events, the next beat looks at all files.
            let Ok(event) = event else { return };
            if !matches!(event.kind, EventKind::Access(_)) {
                event.paths.into_iter().for_each(|path| drop(of_system.send(Some(path))));
            }
        });
        let stops = Arc::downgrade(&seen);
        let thread = std::thread::Builder::new().name("file watch".into());
        let started = thread.spawn(move || {
            let mut folders = WatchedFolders { watcher: watcher.ok(), known: BTreeSet::new() };
            while let Some(seen) = stops.upgrade() {
                folders.renew(&lock(&seen));
                let names = burst(&events);
                let found = look(&seen, &names);
                drop(seen);
                if !found.is_empty() {
                    changed(found);
                }
            }
        });
        started.map_err(|e| Diagnostic::error(format!("cannot watch files: {e}")).because(Cause::Io))?;
        Ok(FileWatch { seen, wake })
    }

    /// Watches these files and folders from now on, and no others. What was watched before is held against what it was
    /// then, so that no edit is lost between the reading of a file and this call.
    pub fn follow(&self, paths: impl IntoIterator<Item = PathBuf>) {
        let mut seen = lock(&self.seen);
        let before = std::mem::take(&mut *seen);
        for path in paths {
            let file = before.get(&path).cloned().unwrap_or_else(|| see(&path));
            seen.insert(path, file);
        }
        drop(seen);
        // The thread ends with this watch, not before.
        let _ = self.wake.send(None);
    }
}

/// Names of files that raised events until they were silent for a while; none after a beat without events.
fn burst(events: &Receiver<Option<PathBuf>>) -> BTreeSet<std::ffi::OsString> {
    let mut names = BTreeSet::new();
    let mut add = |path: Option<PathBuf>| names.extend(path.and_then(|path| path.file_name().map(Into::into)));
    let Ok(first) = events.recv_timeout(BEAT) else { return names };
    add(first);
    let start = Instant::now();
    while start.elapsed() < LONGEST_BURST {
        match events.recv_timeout(QUIET) {
            Ok(path) => add(path),
            Err(_) => break,
        }
    }
    names
}

/// Files that hold something else than when they were seen last.
fn look(seen: &Mutex<SeenFiles>, names: &BTreeSet<std::ffi::OsString>) -> Vec<PathBuf> {
    let known = lock(seen).clone();
    let differs = |path: &Path, then: &SeenFile| {
        let is_named = path.file_name().is_some_and(|name| names.contains(name));
        (is_named || !is_same(stamp(path).as_ref(), then.stamp.as_ref())).then(|| see(path))
    };
    let mut found: SeenFiles =
        known.iter().filter_map(|(path, then)| Some((path.clone(), differs(path, then)?))).collect();
    let is_half_saved = |(path, now): (&PathBuf, &SeenFile)| {
        let then = &known[path];
        then.digest.is_some() && !then.is_empty && (now.digest.is_none() || now.is_empty)
    };
    for _ in 0..HALF_SAVED_LOOKS {
        if !found.iter().any(is_half_saved) {
            break;
        }
        std::thread::sleep(HALF_SAVED);
        found = known.iter().filter_map(|(path, then)| Some((path.clone(), differs(path, then)?))).collect();
    }
    let mut seen = lock(seen);
    let mut changed = Vec::new();
    for (path, now) in found {
        // It may have been left out of the list meanwhile.
        let Some(then) = seen.get_mut(&path) else { continue };
        if then.digest != now.digest {
            changed.push(path);
        }
        *then = now;
    }
    changed
}

fn stamp(path: &Path) -> Option<Metadata> {
    std::fs::metadata(path).ok()
}

fn is_same(a: Option<&Metadata>, b: Option<&Metadata>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.len() == b.len() && a.modified().ok() == b.modified().ok(),
        (None, None) => true,
        (Some(_), None) | (None, Some(_)) => false,
    }
}

fn see(path: &Path) -> SeenFile {
    let stamp = stamp(path);
    if path.is_dir() {
        let mut hasher = Hasher::default();
        let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        let mut names: Vec<_> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names.iter().for_each(|name| hasher.text(name));
        return SeenFile { stamp, digest: Some(hasher.finish()), is_empty: false };
    }
    let bytes = files::read_bytes(path, limits::MESH_FILE_BYTES).ok();
    SeenFile {
        stamp,
        is_empty: bytes.as_ref().is_some_and(Vec::is_empty),
        digest: bytes.map(|bytes| Digest::of(&bytes)),
    }
}

/// Folders that the system tells of.
struct WatchedFolders {
    watcher: Option<RecommendedWatcher>,
    known: BTreeSet<PathBuf>,
}

impl WatchedFolders {
    /// Watches the folders of the files, or the nearest ones above that are there.
    fn renew(&mut self, files: &SeenFiles) {
        let Some(watcher) = &mut self.watcher else { return };
        let there = |path: &PathBuf| {
            let here = Path::new(".");
            let above = path.ancestors().skip(1).map(|folder| if folder == Path::new("") { here } else { folder });
            above.chain([here]).find(|folder| folder.is_dir()).map(Path::to_path_buf)
        };
        let wanted: BTreeSet<PathBuf> = files.keys().filter_map(there).collect();
        for gone in self.known.difference(&wanted) {
            // A folder that was deleted is unwatched already.
            let _ = watcher.unwatch(gone);
        }
        for folder in &wanted {
            // Also those that are known: one that was deleted and made again is another one. What cannot be watched, since
            // the system has no more watches, is looked at once a second all the same.
            let _ = watcher.watch(folder, RecursiveMode::NonRecursive);
        }
        self.known = wanted;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is heard within three seconds; nothing is as good as silence.
    fn heard(events: &Receiver<Vec<PathBuf>>) -> Vec<String> {
        let found = events.recv_timeout(Duration::from_secs(3)).unwrap_or_default();
        found.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn contents_that_change_are_heard_of_however_they_are_saved() {
        let desk = tempfile::tempdir().unwrap();
        let at = |name: &str| desk.path().join(name);
        std::fs::write(at("a.ron"), "1").unwrap();
        std::fs::create_dir(at("maps")).unwrap();
        let (send, events) = channel();
        let watch = FileWatch::start(move |found| drop(send.send(found))).unwrap();
        watch.follow([at("a.ron"), at("maps/b.png"), at("none/c.ron")]);
        std::thread::sleep(Duration::from_millis(50));
        std::fs::write(at("a.ron"), "2").unwrap();
        assert_eq!(heard(&events), ["a.ron"]);
        // Saved by another file and a rename.
        std::fs::write(at("a.ron~"), "3").unwrap();
        std::fs::rename(at("a.ron~"), at("a.ron")).unwrap();
        assert_eq!(heard(&events), ["a.ron"]);
        // A file that was looked for appears, in a folder that was made again.
        std::fs::remove_dir(at("maps")).unwrap();
        std::fs::create_dir(at("maps")).unwrap();
        std::fs::write(at("maps/b.png"), "x").unwrap();
        assert_eq!(heard(&events), ["b.png"]);
        std::fs::create_dir(at("none")).unwrap();
        std::fs::write(at("none/c.ron"), "x").unwrap();
        assert_eq!(heard(&events), ["c.ron"]);
        std::fs::remove_file(at("a.ron")).unwrap();
        assert_eq!(heard(&events), ["a.ron"]);
    }

    #[test]
    fn what_is_read_touched_or_emptied_for_a_moment_is_not_heard_of() {
        let desk = tempfile::tempdir().unwrap();
        let file = desk.path().join("a.ron");
        std::fs::write(&file, "1").unwrap();
        let (send, events) = channel();
        let watch = FileWatch::start(move |found| drop(send.send(found))).unwrap();
        watch.follow([file.clone()]);
        std::thread::sleep(Duration::from_millis(50));
        for _ in 0..3 {
            std::fs::read(&file).unwrap();
            std::fs::write(&file, "").unwrap();
            std::thread::sleep(Duration::from_millis(10));
            std::fs::write(&file, "1").unwrap();
            std::thread::sleep(Duration::from_millis(250));
        }
        std::fs::write(desk.path().join("other"), "x").unwrap();
        assert_eq!(events.recv_timeout(Duration::from_millis(1300)).ok(), None);
        std::fs::write(&file, "2").unwrap();
        assert_eq!(heard(&events), ["a.ron"]);
    }
}
