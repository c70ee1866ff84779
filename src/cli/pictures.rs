//! `anim info`: pictures that are already there.

use std::path::PathBuf;

use super::{Exit, print};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::{files, limits};
use crate::output::{Format, PictureHeader};

#[derive(clap::Args)]
pub struct InfoArguments {
    /// A picture that anim wrote
    picture: PathBuf,
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
