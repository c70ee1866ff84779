//! Reading files that may be missing, huge or not what their name says.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::diagnostics::{Diagnostic, nearest};
use super::text;

/// The bytes of a file of at most `cap` bytes.
///
/// # Errors
/// A diagnostic of an input that is missing (with the nearest name in its folder), no file, or too large.
pub fn read_bytes(path: &Path, cap: u64) -> Result<Vec<u8>, Diagnostic> {
    let shown = path.display();
    let cannot = |error: std::io::Error| {
        let problem = Diagnostic::error(format!("cannot read {shown}: {}", plain(&error)));
        match nearest_file(path) {
            Some(name) if error.kind() == std::io::ErrorKind::NotFound => {
                problem.help(format!("did you mean `{name}`?"))
            }
            _ => problem,
        }
    };
    // Opening a pipe would wait for somebody to write to it, and a device may never end.
    match std::fs::metadata(path) {
        Ok(kind) if kind.is_dir() => return Err(Diagnostic::error(format!("cannot read {shown}: it is a folder"))),
        Ok(kind) if !kind.is_file() => {
            return Err(Diagnostic::error(format!("cannot read {shown}: it is a device or a pipe, not a file")));
        }
        _ => {}
    }
    let file = File::open(path).map_err(cannot)?;
    let mut bytes = Vec::new();
    file.take(cap + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > cap {
        return Err(Diagnostic::error(format!("{shown} is larger than the limit of {} MiB", cap >> 20)));
    }
    Ok(bytes)
}

/// The text of a file, without a byte order mark; what is not UTF-8 is read as Windows-1252.
///
/// # Errors
/// As [`read_bytes`]; texts in UTF-16.
pub fn read_text(path: &Path, cap: u64) -> Result<String, Diagnostic> {
    text::decode(read_bytes(path, cap)?, &path.to_string_lossy())
}

/// A path below a folder whose parts may be written in letters of another case; the first that fits, by name.
pub fn find_any_case(base: &Path, path: &Path) -> Option<PathBuf> {
    let mut found = PathBuf::new();
    for part in path.components() {
        let exact = found.join(part);
        if base.join(&exact).exists() {
            found = exact;
            continue;
        }
        let wanted = part.as_os_str().to_string_lossy().to_lowercase();
        let folder = base.join(&found);
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
        let names = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.file_name());
        let name = names.filter(|name| name.to_string_lossy().to_lowercase() == wanted).min()?;
        found.push(name);
    }
    Some(found)
}

/// The name in the same folder that is most like the one that is missing.
pub fn nearest_file(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).ok()?;
    let mut names: Vec<String> =
        entries.take(10_000).flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    let wanted = path.file_name()?.to_string_lossy();
    nearest(&wanted, names.iter().map(String::as_str)).map(str::to_string)
}

/// The reason alone, without the number that the system adds.
fn plain(error: &std::io::Error) -> String {
    let text = error.to_string();
    let end = text.find(" (os error").unwrap_or(text.len());
    text[..end].to_lowercase()
}

/// A file's name with a number in place of its last run of `#`, with as many digits at least.
pub fn numbered(name: &str, number: u64) -> String {
    let Some(end) = name.rfind('#').map(|i| i + 1) else { return name.to_string() };
    let start = name[..end].trim_end_matches('#').len();
    format!("{}{number:0width$}{}", &name[..start], &name[end..], width = end - start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_read_is_explained() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.ron"), "hello").unwrap();
        let said = |name: &str, cap| read_text(&folder.path().join(name), cap).unwrap_err().to_string();
        assert!(said("scen.ron", 9).contains("no such file"), "{}", said("scen.ron", 9));
        assert!(said("scen.ron", 9).contains("did you mean `scene.ron`?"));
        assert!(said("scene.ron", 4).contains("larger than the limit"));
        assert!(said("", 4).contains("it is a folder"));
        assert_eq!(read_text(&folder.path().join("scene.ron"), 5).unwrap(), "hello");
    }

    #[test]
    fn files_are_found_whatever_the_case_of_their_letters() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("Maps")).unwrap();
        std::fs::write(folder.path().join("Maps/Wood.PNG"), "x").unwrap();
        let find = |path: &str| find_any_case(folder.path(), Path::new(path));
        assert_eq!(find("maps/wood.png"), Some(PathBuf::from("Maps/Wood.PNG")));
        assert_eq!(find("maps/stone.png"), None);
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_refused_instead_of_waited_for() {
        for device in ["/dev/zero", "/dev/null", "/dev/tty"] {
            if Path::new(device).exists() {
                assert!(read_bytes(Path::new(device), 9).unwrap_err().message.contains("not a file"), "{device}");
            }
        }
    }

    #[test]
    fn numbers_take_the_place_of_hashes() {
        assert_eq!(numbered("a.####.obj", 12), "a.0012.obj");
        assert_eq!(numbered("a#1/b_##.ply", 123), "a#1/b_123.ply");
        assert_eq!(numbered("plain.obj", 7), "plain.obj");
    }
}
