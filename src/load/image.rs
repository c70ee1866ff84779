//! Image files: the six faces of a cube map.

use std::io::Cursor;
use std::path::Path;

use crate::base::color::srgb_decode;
use crate::base::diagnostics::Diagnostic;
use crate::base::{files, limits};
use crate::trace::environment::{CubeMap, FACES, Face};

/// Reads the faces `right left top bottom front back` (.jpg, .jpeg or .png) of a folder.
///
/// With `linear` their sRGB values are decoded to linear light; otherwise they are taken as they are.
///
/// # Errors
/// A face that is missing, too large or not an image.
pub fn read_cube_map(folder: &Path, linear: bool) -> Result<CubeMap, Diagnostic> {
    let mut faces = Vec::new();
    for name in FACES {
        let paths = ["jpg", "jpeg", "png"].map(|e| folder.join(format!("{name}.{e}")));
        let path = paths.iter().find(|path| path.is_file());
        let path = path.ok_or_else(|| {
            Diagnostic::error(format!("{} has no face `{name}` (.jpg, .jpeg or .png)", folder.display()))
        })?;
        faces.push(read_face(path, linear)?);
    }
    match <[Face; 6]>::try_from(faces) {
        Ok(faces) => Ok(CubeMap { faces }),
        Err(_) => Err(Diagnostic::error("a cube map has six faces")),
    }
}

fn read_face(path: &Path, linear: bool) -> Result<Face, Diagnostic> {
    let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES)?;
    let broken = |e: &dyn std::fmt::Display| Diagnostic::error(format!("cannot read {}: {e}", path.display()));
    let mut reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| broken(&e))?;
    let mut caps = image::Limits::default();
    caps.max_image_width = Some(limits::IMAGE_SIDE);
    caps.max_image_height = Some(limits::IMAGE_SIDE);
    reader.limits(caps);
    let picture = reader.decode().map_err(|e| broken(&e))?.to_rgb8();
    let value = |x: u8| {
        let encoded = f32::from(x) / 255.0;
        if linear { srgb_decode(encoded) } else { encoded }
    };
    let texels = picture.pixels().map(|p| p.0.map(value)).collect();
    Ok(Face { width: picture.width(), height: picture.height(), texels })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn six_faces_make_a_sky_and_five_do_not() {
        let folder = tempfile::tempdir().unwrap();
        for (i, name) in FACES.iter().enumerate() {
            let picture = image::RgbImage::from_pixel(2, 2, image::Rgb([40 * i as u8, 0, 255]));
            picture.save(folder.path().join(format!("{name}.png"))).unwrap();
        }
        let sky = read_cube_map(folder.path(), false).unwrap();
        assert!((sky.lookup(Vec3::Y).x - 80.0 / 255.0).abs() < 1e-6);
        std::fs::remove_file(folder.path().join("back.png")).unwrap();
        assert!(read_cube_map(folder.path(), false).unwrap_err().message.contains("`back`"));
        std::fs::write(folder.path().join("back.png"), b"junk").unwrap();
        assert!(read_cube_map(folder.path(), false).is_err());
    }
}
