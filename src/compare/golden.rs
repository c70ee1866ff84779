//! Golden frames: a rendered picture against the one that was blessed.
//!
//! A golden that is missing fails; only blessing writes one. What differs is shown as a picture.

use std::path::Path;

use super::{Picture, difference, difference_picture};
use crate::output::write_atomic;

/// Compares the picture file `rendered` with `golden`, to the last bit.
///
/// With `bless` the golden becomes the rendered picture. A difference is left as `NAME.diff.png` in `failures`.
///
/// # Errors
/// What differs, and where to look at it.
pub fn check(rendered: &Path, golden: &Path, failures: &Path, bless: bool) -> Result<(), String> {
    let found = Picture::read(rendered).map_err(|d| d.to_string())?;
    let write = |path: &Path, picture: &Picture| {
        let bytes = picture.to_png().map_err(|d| d.to_string())?;
        write_atomic(path, &bytes).map_err(|d| d.to_string())
    };
    let known = golden.exists().then(|| Picture::read(golden).map_err(|d| d.to_string())).transpose()?;
    if known.as_ref() == Some(&found) {
        return Ok(());
    }
    if bless {
        return write(golden, &found);
    }
    let Some(known) = known else { return Err(format!("{} is missing", golden.display())) };
    let name = golden.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let shown = failures.join(format!("{name}.diff.png"));
    write(&shown, &difference_picture(&known, &found))?;
    let how = match difference(&known, &found) {
        Some(d) => format!("{} pixels, at most {:.4}, RMSE {:.5}", d.pixels, d.largest, d.rmse),
        None => format!("{}x{} instead of {}x{}", found.width, found.height, known.width, known.height),
    };
    Err(format!("{name} differs from its golden: {how}; see {}", shown.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_golden_is_never_written_unless_blessed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let picture = |x: u8| Picture { width: 1, height: 1, pixels: vec![[f32::from(x) / 255.0; 3]] };
        write_atomic(&at("new.png"), &picture(3).to_png().unwrap()).unwrap();
        let run = |bless| check(&at("new.png"), &at("golden.png"), &at("failures"), bless);
        assert!(run(false).unwrap_err().contains("is missing"));
        assert!(!at("golden.png").exists());
        run(true).unwrap();
        run(false).unwrap();
        write_atomic(&at("new.png"), &picture(4).to_png().unwrap()).unwrap();
        assert!(run(false).unwrap_err().contains("1 pixels"));
        assert!(at("failures/golden.diff.png").exists());
    }
}
