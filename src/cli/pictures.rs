//! `anim diff` and `anim info`: pictures that are already there.

use std::path::{Path, PathBuf};

use super::{Exit, print, usage};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::{files, limits};
use crate::compare::{Picture, difference, difference_picture};
use crate::output::{Format, PictureHeader, write_atomic};

#[derive(clap::Args)]
pub struct DiffArguments {
    /// A picture or a folder of pictures
    a: PathBuf,
    /// What to compare it with
    b: PathBuf,
    /// Largest difference of a channel that counts as equal, 0 to 1
    #[arg(long, default_value_t = 0.0)]
    tolerance: f64,
    /// Write both pictures and their difference, side by side
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(clap::Args)]
pub struct InfoArguments {
    /// A picture that anim wrote
    picture: PathBuf,
}

pub fn diff(arguments: DiffArguments) -> Result<Exit, Diagnostics> {
    let DiffArguments { a, b, tolerance, out } = &arguments;
    let mut equal = true;
    for path in [a, b] {
        std::fs::metadata(path).map_err(|e| Diagnostic::io(path.display(), "read", &e))?;
    }
    if a.is_dir() != b.is_dir() {
        return Err(usage("diff compares two pictures or two folders, not one with the other"));
    }
    if !a.is_dir() {
        equal = pair(a, b, *tolerance, out.as_deref())?;
    } else if out.is_some() {
        return Err(usage("-o shows the difference of two pictures, not of two folders"));
    } else {
        let (in_a, in_b) = (pictures_in(a)?, pictures_in(b)?);
        for name in in_a.iter().filter(|name| !in_b.contains(name)) {
            print(&format!("{name}: only in {}\n", a.display()));
            equal = false;
        }
        for name in &in_b {
            if in_a.contains(name) {
                equal &= pair(&a.join(name), &b.join(name), *tolerance, None)?;
            } else {
                print(&format!("{name}: only in {}\n", b.display()));
                equal = false;
            }
        }
    }
    Ok(if equal { Exit::Done } else { Exit::Differences })
}

fn pictures_in(folder: &Path) -> Result<Vec<String>, Diagnostic> {
    let entries = std::fs::read_dir(folder).map_err(|e| Diagnostic::io(folder.display(), "read", &e))?;
    let mut names: Vec<String> = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.retain(|name| Format::of_path(Path::new(name)).is_some());
    names.sort();
    Ok(names)
}

fn pair(a: &Path, b: &Path, tolerance: f64, out: Option<&Path>) -> Result<bool, Diagnostic> {
    let (pa, pb) = (Picture::read(a)?, Picture::read(b)?);
    if let Some(out) = out {
        write_atomic(out, &difference_picture(&pa, &pb).to_png()?)?;
    }
    let Some(d) = difference(&pa, &pb) else {
        print(&format!("{}: {}x{}, {}: {}x{}\n", a.display(), pa.width, pa.height, b.display(), pb.width, pb.height));
        return Ok(false);
    };
    if d.largest <= tolerance {
        return Ok(true);
    }
    let (pixels, all) = (d.pixels, pa.pixels.len());
    let numbers = format!("largest {:.5}, RMSE {:.6}, PSNR {:.2} dB", d.largest, d.rmse, d.psnr);
    print(&format!("{}: {pixels} of {all} pixels differ, {numbers}\n", b.display()));
    Ok(false)
}

pub fn info(arguments: InfoArguments) -> Result<Exit, Diagnostics> {
    let path = &arguments.picture;
    let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES)?;
    let no_picture = |why: &str| Diagnostic::error(format!("{}: {why}", path.display()));
    let format = Format::of_bytes(&bytes).ok_or_else(|| no_picture("not a picture of a format that anim writes"))?;
    let PictureHeader { size, channels, mut metadata } = (format.read_header)(&bytes).map_err(|e| no_picture(&e))?;
    if !channels.is_empty() {
        metadata.push(("Channels".into(), channels.join(" ")));
    }
    print(&format!("Size: {}x{}\n", size[0], size[1]));
    metadata.iter().for_each(|(keyword, text)| print(&format!("{keyword}: {text}\n")));
    Ok(Exit::Done)
}
