//! `anim info`: pictures and films that are already there, and models.

use std::path::{Path, PathBuf};

use super::{AccessArguments, Exit, print, say};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::project::Project;
use crate::base::{files, limits};
use crate::load::{self, measures::SceneMeasures};
use crate::output::film::{FilmInfo, read_film_info};
use crate::output::{Format, PictureHeader};

#[derive(clap::Args)]
pub struct InfoArguments {
    /// A picture or a film that anim wrote, or a scene or a model: how much there is of it, and how large it is
    picture: PathBuf,
    #[command(flatten)]
    access: AccessArguments,
}

pub fn info(arguments: InfoArguments) -> Result<Exit, Diagnostics> {
    let path = &arguments.picture;
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if load::EXTENSIONS.contains(&ending.as_str()) {
        return model(path, &arguments.access);
    }
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

/// Says what a scene or a model holds.
fn model(path: &Path, access: &AccessArguments) -> Result<Exit, Diagnostics> {
    let (scene, warnings) = load::load_contents(path, &Project::of(path, &access.access())?)?;
    say(&warnings);
    let SceneMeasures { entities, meshes, triangles, area, bounds, lights, viewpoints, materials, clips } =
        SceneMeasures::of(&scene);
    print(&format!("Entities: {entities}, of them {meshes} meshes, {lights} lights, {viewpoints} cameras\n"));
    print(&format!("Triangles: {triangles}\nArea: {area}\n"));
    if let Some([min, max]) = bounds {
        let size = max - min;
        print(&format!(
            "Bounds: ({}, {}, {}) to ({}, {}, {}), size ({}, {}, {})\n",
            min.x, min.y, min.z, max.x, max.y, max.z, size.x, size.y, size.z
        ));
    }
    if !materials.is_empty() {
        print(&format!("Materials: {}\n", materials.join(", ")));
    }
    for (name, [first, last]) in clips {
        print(&format!("Clip: {name}, {first} to {last} s\n"));
    }
    Ok(Exit::Done)
}
