//! `anim merge`: tiles become a picture.

use std::path::PathBuf;

use super::{Exit, print, say, usage};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::{files, limits};
use crate::output::{self, MergedPicture, merge_exr};

#[derive(clap::Args)]
#[command(
    after_help = "The parts are EXR files of `anim render --tiles`, in any order, which together cover the frame. The picture is equal to the \
            byte to the one that is rendered at once, denoised or not: each part is traced with the surroundings that it needs.

Examples:
  anim render still.ron --tiles 1/4 -o part.1.exr      on one machine, 2/4 and so on on others
  anim merge part.*.exr -o still.exr"
)]
pub struct MergeArguments {
    /// The parts
    #[arg(required = true, value_name = "PARTS")]
    parts: Vec<PathBuf>,
    /// The picture, an EXR file
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
}

pub fn run(arguments: &MergeArguments) -> Result<Exit, Diagnostics> {
    let MergeArguments { parts, out } = arguments;
    if out.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("exr")) {
        return Err(usage(format!("-o {}: parts are EXR files, and so is the whole", out.display())));
    }
    let read = |path: &PathBuf| -> Result<(String, Vec<u8>), Diagnostic> {
        Ok((path.display().to_string(), files::read_bytes(path, limits::FRAME_FILE_BYTES)?))
    };
    let read: Vec<(String, Vec<u8>)> = parts.iter().map(read).collect::<Result<_, _>>()?;
    let MergedPicture { bytes, size: [width, height], is_known } = merge_exr(&read).map_err(Diagnostic::error)?;
    output::write_atomic(out, &bytes)?;
    if !is_known {
        let message =
            format!("{} does not say which frame it is: its parts are of --region, not of --tiles", out.display());
        say(&Diagnostic::warning(message).into());
    }
    print(&format!("{}: {width}x{height} of {} parts\n", out.display(), parts.len()));
    Ok(Exit::Done)
}
