//! Pictures on disk: formats with metadata, names of frames, atomic writes, and what is there already.
//!
//! What is written depends on the picture and its making alone: no time stamps, no paths, no machine. A file appears
//! under its final name only when it is whole, and a [`manifest`] beside it knew of it a moment before.
//!
//! | file | |
//! |---|---|
//! | `format`, [`formats`] | what a picture format is, and the table of them |
//! | `png/`, `exr/` | the formats; PNG's metadata are put together in `metadata` and encoded in `png` |
//! | [`metadata`] | what a picture says of its making |
//! | `parts`, `layered` | parts, places and channels of files with many |
//! | `film/`, `sheet/` | films and contact sheets |
//! | `names`, [`manifest`], `state` | names of frames, what lies in a folder, whether a file is its frame |
//! | `claims` | which worker renders which frame |
//! | `small_png` | PNG as small as can be, for goldens and pages |
//!
//! [`formats`] holds the table of picture formats; to add one touches that table and a file of its own.

pub mod claims;
mod exr;
pub mod film;
pub mod format;
pub mod formats;
mod layered;
pub mod manifest;
pub mod metadata;
pub mod names;
mod parts;
mod png;
pub mod sheet;
mod small_png;
mod state;

pub use exr::{MergedPicture, merge_exr};
pub use film::FilmFormat;
pub use format::{Decoded, Format, PictureHeader};
pub use layered::read_layered;
pub use metadata::{Metadata, Provenance, frame_metadata, provenance_metadata, with_whole};
pub use parts::{ChannelSamples, ColorEncoding, LayeredPicture, PictureChannel, PicturePart, PixelWindow};
pub use png::encode_rgb8;
pub use small_png::{PngPixels, compressed_note_bytes, encode_small_png, small_png_of};
pub use state::{FileState, inspect, relabelled};

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use crate::base::diagnostics::Diagnostic;
use crate::base::disk::{self, DiskFile};

/// Names of files that are not whole yet start so.
const TEMPORARY: &str = ".anim-tmp-";

/// Why a file was not written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WriteFailure {
    /// It names the file and the system's reason.
    pub problem: Box<Diagnostic>,
    /// No other file can be written there either, as on a full disk.
    pub is_general: bool,
}

/// Writes a file under a temporary name beside it and renames it; folders above it are made.
///
/// # Errors
/// A diagnostic that names the file and the system's reason; nothing is left behind.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
    write_after(path, bytes, || Ok(())).map_err(|failure| *failure.problem)
}

/// As [`write_atomic`]; calls `before` when the bytes are on disk, just before they get their name.
///
/// # Errors
/// As [`write_atomic`], and those of `before`.
pub fn write_after(
    path: &Path,
    bytes: &[u8],
    before: impl FnOnce() -> std::io::Result<()>,
) -> Result<(), WriteFailure> {
    use std::io::ErrorKind as K;
    let failed = |is_general: bool| {
        move |error: std::io::Error| WriteFailure {
            is_general: is_general || matches!(error.kind(), K::StorageFull | K::QuotaExceeded | K::ReadOnlyFilesystem),
            problem: Diagnostic::io(path.display(), "write", &error).into(),
        }
    };
    let folder = folder_of(path);
    disk::create_dir_all(folder).map_err(failed(false))?;
    let file = held_in(folder).map_err(failed(true))?;
    // Errors of the file itself: those of the wrapper name the temporary one, which nobody knows.
    disk::write_all(file.as_file(), file.path(), bytes).map_err(failed(false))?;
    open_to_all(&file).map_err(failed(false))?;
    before().map_err(failed(true))?;
    disk::persist(file, path).map_err(failed(false))
}

/// A file that is written piece by piece under a temporary name, and gets its own when it is whole. If it is dropped
/// before that, nothing is left of it.
pub struct AtomicFile {
    file: tempfile::NamedTempFile,
    path: PathBuf,
}

impl AtomicFile {
    /// Starts a file; folders above it are made.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn create(path: &Path) -> Result<AtomicFile, Diagnostic> {
        let failed = |error: std::io::Error| Diagnostic::io(path.display(), "write", &error);
        let folder = folder_of(path);
        disk::create_dir_all(folder).map_err(failed)?;
        Ok(AtomicFile { file: held_in(folder).map_err(failed)?, path: path.to_path_buf() })
    }

    /// For writing to it.
    ///
    /// # Errors
    /// The system gives no second handle.
    pub fn handle(&self) -> Result<DiskFile, Diagnostic> {
        let file = self.file.as_file().try_clone().map_err(|error| self.failed(&error))?;
        Ok(DiskFile::new(file, self.file.path()))
    }

    /// Where it is now, for programs that write to it by its name.
    pub fn temporary_path(&self) -> &Path {
        self.file.path()
    }

    /// The diagnostic of what went wrong with writing it.
    pub fn failed(&self, error: &std::io::Error) -> Diagnostic {
        Diagnostic::io(self.path.display(), "write", error)
    }

    /// Gives the file its name; what was under that name is gone.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn commit(self) -> Result<(), Diagnostic> {
        let failed = |error: std::io::Error| Diagnostic::io(self.path.display(), "write", &error);
        open_to_all(&self.file).map_err(failed)?;
        disk::persist(self.file, &self.path).map_err(failed)
    }
}

/// Sees to it that files can be written to a folder, which need not be there yet, before any work is done for them.
///
/// # Errors
/// As [`write_atomic`] would have them for this file.
pub fn probe(path: &Path) -> Result<(), Diagnostic> {
    let there = path.ancestors().skip(1).map(|folder| if folder == Path::new("") { Path::new(".") } else { folder });
    let Some(folder) = there.into_iter().find(|folder| folder.exists()) else { return Ok(()) };
    temporary_in(folder).map(drop).map_err(|error| Diagnostic::io(path.display(), "write", &error))
}

/// Errors name no temporary file: nobody knows it.
fn temporary_in(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    disk::temporary(tempfile::Builder::new().prefix(TEMPORARY), folder).map_err(|error| error.kind().into())
}

/// A temporary file that is held until it has its name: `sweep` leaves what is locked alone. Where there are no locks,
/// it sweeps nothing.
fn held_in(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut file = temporary_in(folder)?;
    for _ in 0..MOST_TRIES {
        let lock = file.as_file().try_lock();
        // Before it was locked it looked like one that the dead have left.
        let is_swept = matches!(lock, Err(TryLockError::WouldBlock)) || !file.path().exists();
        if !is_swept {
            break;
        }
        file = temporary_in(folder)?;
    }
    Ok(file)
}

/// So often somebody may sweep a new file away in the moment before it is held.
const MOST_TRIES: usize = 100;

/// The folder that a file lies in.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Removes the temporary files that killed processes left in a folder; those of living ones are locked.
pub fn sweep(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten().filter(|e| e.file_name().to_string_lossy().starts_with(TEMPORARY)) {
        let Ok(file) = File::open(entry.path()) else { continue };
        if file.try_lock().is_ok() {
            // Still locked, so that nobody takes it for his own. Somebody else may have been faster.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Temporary files are private to their owner; a finished one has the usual rights.
#[cfg(unix)]
fn open_to_all(file: &tempfile::NamedTempFile) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn open_to_all(_: &tempfile::NamedTempFile) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_whole_or_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b/c.bin");
        write_atomic(&path, b"one").unwrap();
        write_atomic(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        let below_a_file = path.join("d.bin");
        assert!(write_atomic(&below_a_file, b"x").unwrap_err().to_string().contains("d.bin"));
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        probe(&folder.path().join("not/there/yet.bin")).unwrap();
        let message = probe(&below_a_file).unwrap_err().to_string();
        assert!(message.contains("d.bin") && !message.contains(TEMPORARY), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn only_what_the_dead_left_is_swept_away() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in [".anim-tmp-dead", ".anim-tmp-alive", ".anim-tmp-empty", "frame.png"] {
            std::fs::write(path(name), if name.ends_with("empty") { "" } else { "half" }).unwrap();
        }
        let alive = File::open(path(".anim-tmp-alive")).unwrap();
        alive.lock().unwrap();
        sweep(folder.path());
        let left = |name: &str| path(name).exists();
        assert!(!left(".anim-tmp-dead") && left(".anim-tmp-alive") && !left(".anim-tmp-empty") && left("frame.png"));
        sweep(&path("nowhere"));
    }

    #[test]
    fn who_sweeps_takes_nothing_from_who_writes() {
        let folder = tempfile::tempdir().unwrap();
        let done = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(std::sync::atomic::Ordering::Relaxed) {
                    sweep(folder.path());
                }
            });
            for i in 0..200 {
                write_atomic(&folder.path().join(format!("{i}")), b"whole").unwrap();
            }
            done.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 200);
    }
}
