//! `anim info`: pictures that are already there.

use std::path::PathBuf;

use super::{Exit, print};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::{files, limits};
use crate::output::film::{FilmInfo, read_film_info};
use crate::output::{Format, PictureHeader};

#[derive(clap::Args)]
pub struct InfoArguments {
    /// A picture or a film that anim wrote
    picture: PathBuf,
}

pub fn info(arguments: InfoArguments) -> Result<Exit, Diagnostics> {
    let path = &arguments.picture;
    if let Ok(Some(film)) = read_film_info(path) {
        let FilmInfo { format, size, frames, seconds, metadata } = film;
        let rate = if seconds > 0.0 { format!(", {:.3} a second", frames as f64 / seconds) } else { String::new() };
        print(&format!("Size: {}x{}\nFilm: {format}, {frames} frames, {seconds:.3} s{rate}\n", size[0], size[1]));
        metadata.iter().for_each(|(keyword, text)| print(&format!("{keyword}: {text}\n")));
        return Ok(Exit::Done);
    }
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
