//! What is done to a disk when files are written, each step in one place, so that tests can let any of them fail as on a
//! disk that is full.
//!
//! These are the functions of the standard library under their own names. Files that are whole before they get their
//! names, locks and removals are the business of whoever calls them.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

#[cfg(test)]
pub use faults::FullDisk;

/// Makes a folder and those above it.
///
/// # Errors
/// Those of the system.
pub fn create_dir_all(path: &Path) -> io::Result<()> {
    step("make a folder", path)?;
    std::fs::create_dir_all(path)
}

/// Makes a temporary file in a folder.
///
/// # Errors
/// Those of the system.
pub fn temporary(names: &tempfile::Builder<'_, '_>, folder: &Path) -> io::Result<NamedTempFile> {
    step("make a temporary file", folder)?;
    names.tempfile_in(folder)
}

/// Opens a file for writing.
///
/// # Errors
/// Those of the system.
pub fn open(options: &OpenOptions, path: &Path) -> io::Result<File> {
    step("open", path)?;
    options.open(path)
}

/// Writes bytes to the end of a file that lies at `path`.
///
/// # Errors
/// Those of the system; some of the bytes may be there.
pub fn write_all(mut file: &File, path: &Path, bytes: &[u8]) -> io::Result<()> {
    if let Err(full) = step("write", path) {
        // A full disk takes what it has room for.
        let _ = file.write_all(&bytes[..bytes.len() / 2]);
        return Err(full);
    }
    file.write_all(bytes)
}

/// Gives a temporary file its name.
///
/// # Errors
/// Those of the system; the temporary file is gone.
pub fn persist(file: NamedTempFile, path: &Path) -> io::Result<()> {
    step("name", path)?;
    file.persist(path).map(drop).map_err(|failed| failed.error)
}

/// Gives a file a second name.
///
/// # Errors
/// Those of the system.
pub fn hard_link(from: &Path, to: &Path) -> io::Result<()> {
    step("link", to)?;
    std::fs::hard_link(from, to)
}

/// A file that is written piece by piece.
#[derive(Debug)]
pub struct DiskFile {
    file: File,
    path: PathBuf,
}

impl DiskFile {
    /// An open file, and where it lies.
    pub fn new(file: File, path: &Path) -> DiskFile {
        DiskFile { file, path: path.to_path_buf() }
    }
}

impl Write for DiskFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        step("write a piece", &self.path)?;
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for DiskFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(not(test))]
#[inline(always)]
fn step(_: &'static str, _: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
use faults::step;

/// Disks that are full on demand.
#[cfg(test)]
mod faults {
    use std::io;
    use std::path::{Path, PathBuf};
    use std::sync::{Mutex, MutexGuard, PoisonError};

    struct Fault {
        folder: PathBuf,
        /// Steps that still succeed.
        left: usize,
        /// Whether everything after the first failure fails, too.
        lasts: bool,
        steps: Vec<&'static str>,
    }

    static FAULTS: Mutex<Vec<Fault>> = Mutex::new(Vec::new());

    fn faults() -> MutexGuard<'static, Vec<Fault>> {
        FAULTS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn step(what: &'static str, path: &Path) -> io::Result<()> {
        let mut faults = faults();
        let Some(fault) = faults.iter_mut().find(|fault| path.starts_with(&fault.folder)) else { return Ok(()) };
        fault.steps.push(what);
        match fault.left {
            0 => {
                fault.left = if fault.lasts { 0 } else { usize::MAX };
                Err(io::ErrorKind::StorageFull.into())
            }
            _ => {
                fault.left -= 1;
                Ok(())
            }
        }
    }

    /// Below a folder the disk is full after some steps, until this is dropped.
    pub struct FullDisk(PathBuf);

    impl FullDisk {
        /// The step behind the first `after` ones fails, and if it `lasts` all that follow.
        pub fn below(folder: &Path, after: usize, lasts: bool) -> FullDisk {
            faults().push(Fault { folder: folder.to_path_buf(), left: after, lasts, steps: Vec::new() });
            FullDisk(folder.to_path_buf())
        }

        /// What was tried below the folder.
        pub fn steps(&self) -> Vec<&'static str> {
            faults().iter().find(|fault| fault.folder == self.0).map_or_else(Vec::new, |fault| fault.steps.clone())
        }
    }

    impl Drop for FullDisk {
        fn drop(&mut self) {
            faults().retain(|fault| fault.folder != self.0);
        }
    }
}
