//! Pictures on disk: PNG and EXR with metadata, names of frames, atomic writes.
//!
//! What is written depends on the picture and its making alone: no time stamps, no paths, no machine. A file appears
//! under its final name only when it is whole.

mod exr;
pub mod names;
mod png;

pub use exr::{ExrFile, encode_exr, is_exr, read_exr, read_exr_header};
pub use png::{Notes, encode_png, read_notes, settings_note};

use std::io::Write;
use std::path::Path;

use crate::base::diagnostics::Diagnostic;

/// Writes a file under a temporary name beside it and renames it; folders above it are made.
///
/// # Errors
/// A diagnostic that names the file and the system's reason; nothing is left behind.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
    let failed = |error: std::io::Error| Diagnostic::io(path.display(), "write", &error);
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(failed)?;
    let mut file = tempfile::Builder::new().prefix(".anim-").tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    open_to_all(&file).map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
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
    }
}
