//! `anim info`: pictures that are already there.

use std::path::PathBuf;

use super::{Exit, print};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::{files, limits};
use crate::output::{ExrFile, is_exr, read_exr_header, read_png_metadata};

#[derive(clap::Args)]
pub struct InfoArguments {
    /// A picture that anim wrote
    picture: PathBuf,
}

pub fn info(arguments: InfoArguments) -> Result<Exit, Diagnostics> {
    let path = &arguments.picture;
    let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES)?;
    let no_picture = |why: &str| Diagnostic::error(format!("{}: {why}", path.display()));
    let (size, metadata) = if is_exr(&bytes) {
        let ExrFile { size, channels, mut metadata } = read_exr_header(&bytes).map_err(|e| no_picture(&e))?;
        metadata.push(("Channels".into(), channels.join(" ")));
        (size, metadata)
    } else {
        read_png_metadata(&bytes).ok_or_else(|| no_picture("not a PNG or EXR picture"))?
    };
    print(&format!("Size: {}x{}\n", size[0], size[1]));
    metadata.iter().for_each(|(keyword, text)| print(&format!("{keyword}: {text}\n")));
    Ok(Exit::Done)
}
