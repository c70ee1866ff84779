//! Files that a World names are read before it is rendered, never while.

use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::components::ImagePlane;
use crate::load::image;
use crate::systems::{self, FileRequest, Stage};

/// Reads the images of textures that are not loaded.
///
/// # Errors
/// An image that cannot be read, and who names it.
pub fn load_images(stage: &mut Stage) -> Result<(), Diagnostics> {
    let missing = systems::missing_images(stage);
    if !missing.is_empty() && stage.files_mut().images.texels() > limits::TEXTURE_TEXELS / 2 {
        // A sequence of images would fill all of the room: those that this frame does not name make place.
        let named = systems::named_images(stage);
        stage.files_mut().images.0.retain(|key, _| named.contains(key));
    }
    for FileRequest { file, plane, owner, subject } in missing {
        let base = stage.base().clone();
        let loaded = image::fetch(&mut stage.files_mut().images, &base, &file, plane);
        loaded.map_err(|e| Diagnostic { message: format!("{owner}: {}", e.message), ..e }.about(subject))?;
    }
    Ok(())
}

/// Reads all that rendering the World needs and that is not loaded.
///
/// # Errors
/// A file that cannot be read.
pub fn load_all(stage: &mut Stage) -> Result<(), Diagnostics> {
    load_images(stage)?;
    let Some(FileRequest { file, plane, subject, .. }) = systems::missing_environment(stage) else { return Ok(()) };
    let decoded = plane == ImagePlane::Srgb;
    let base = stage.base().clone();
    let source = image::read_surroundings(&mut stage.files_mut().images, &base, &file, decoded);
    let source = source.map_err(|e| e.about(subject))?;
    stage.files_mut().environment = Some(((file, decoded), source));
    Ok(())
}
