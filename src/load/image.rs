//! Image files: pictures of textures and of what surrounds a scene.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use image::{DynamicImage, ImageFormat, ImageReader};

use super::resolve::{Problem, component_path, key};
use super::spans::Step;
use crate::base::color::srgb_decode;
use crate::base::diagnostics::Diagnostic;
use crate::base::project::{FileRole, Folder};
use crate::base::{files, limits};
use crate::components::*;
use crate::trace::light::environment::{CubeMap, EnvironmentMap, FACES, Face};

/// Reads the faces `right left top bottom front back` (.jpg, .jpeg or .png) of a folder that a scene names.
///
/// With `linear` their sRGB values are decoded to linear light; otherwise they are taken as they are.
///
/// # Errors
/// A face that is missing, too large, not an image, or outside of the project.
pub fn read_cube_map(base: &Folder, folder: &str, linear: bool) -> Result<CubeMap, Diagnostic> {
    let mut faces = Vec::new();
    let shown = base.find(folder, FileRole::Image)?;
    for name in FACES {
        let names = ["jpg", "jpeg", "png"].map(|e| format!("{folder}/{name}.{e}"));
        let face = names.iter().find(|name| base.join(name).is_file());
        let face = face.ok_or_else(|| {
            Diagnostic::error(format!("{} has no face `{name}` (.jpg, .jpeg or .png)", shown.display()))
        })?;
        faces.push(read_face(&base.admit(face)?, linear)?);
    }
    match <[Face; 6]>::try_from(faces) {
        Ok(faces) => Ok(CubeMap { faces }),
        Err(_) => Err(Diagnostic::error("a cube map has six faces")),
    }
}

fn read_face(path: &Path, linear: bool) -> Result<Face, Diagnostic> {
    let picture = decode(path, limits::TEXTURE_TEXELS / FACES.len() as u64)?.to_rgb8();
    let value = |x: u8| {
        let encoded = f32::from(x) / 255.0;
        if linear { srgb_decode(encoded) } else { encoded }
    };
    let texels = picture.pixels().map(|p| p.0.map(value)).collect();
    Ok(Face { width: picture.width(), height: picture.height(), texels })
}

/// The pixels of an image file of at most `cap` of them; the size is known before anything is allocated for it.
fn decode(path: &Path, cap: u64) -> Result<DynamicImage, Diagnostic> {
    let bytes = signed_radiance(files::read_bytes(path, limits::IMAGE_FILE_BYTES)?);
    let broken = |e: &dyn std::fmt::Display| Diagnostic::error(format!("cannot read {}: {e}", path.display()));
    let guessed = || ImageReader::new(Cursor::new(&bytes)).with_guessed_format().map_err(|e| broken(&e));
    let known = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Hdr];
    let format = guessed()?.format().filter(|format| known.contains(format));
    let Some(format) = format else {
        return Err(broken(&"not an image of a known kind").help("known: PNG, JPEG, HDR (Radiance)"));
    };
    let (width, height) = guessed()?.into_dimensions().map_err(|e| broken(&e))?;
    if width == 0 || height == 0 {
        return Err(broken(&"it has no pixels"));
    }
    if width > limits::IMAGE_SIDE || height > limits::IMAGE_SIDE {
        return Err(broken(&format!("{width} x {height} is over the limit of {} a side", limits::IMAGE_SIDE)));
    }
    if u64::from(width) * u64::from(height) > cap {
        return Err(broken(&format!("{width} x {height} is over the limit of {cap} pixels for all images")));
    }
    if format == ImageFormat::Jpeg && !is_whole_jpeg(&bytes) {
        return Err(broken(&"the file ends too early"));
    }
    let mut reader = guessed()?;
    let mut caps = image::Limits::default();
    caps.max_alloc = Some(limits::IMAGE_BYTES);
    reader.limits(caps);
    reader.decode().map_err(|e| broken(&e))
}

/// Some programs sign HDR files as `#?RGBE`, which the decoder takes for another format.
fn signed_radiance(bytes: Vec<u8>) -> Vec<u8> {
    match bytes.strip_prefix(b"#?RGBE") {
        Some(rest) => [b"#?RADIANCE", rest].concat(),
        None => bytes,
    }
}

/// Whether the picture data of a JPEG end with their marker: its decoder fills up with grey what is missing.
fn is_whole_jpeg(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let Some([0xff, marker, high, low]) = bytes.get(at..at + 4) {
        at += 2 + usize::from(u16::from_be_bytes([*high, *low]));
        if *marker == 0xda {
            return bytes.get(at..).is_some_and(|data| data.windows(2).any(|pair| pair == [0xff, 0xd9]));
        }
    }
    false
}

/// Reads an image for a texture, with its smaller copies. `decoded` says that its bytes stand for the sRGB curve.
///
/// # Errors
/// A file that is missing, broken, larger than `cap` texels, or with values that are no colours.
pub fn read_mip_map(path: &Path, decoded: bool, cap: u64) -> Result<MipMap, Diagnostic> {
    let image = decode(path, cap)?;
    let (width, height) = (image.width(), image.height());
    let texels = match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            Texels::Floats(image.into_rgb32f().pixels().map(|p| p.0).collect())
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let value = |x: u16| {
                let encoded = f32::from(x) / 65535.0;
                if decoded { srgb_decode(encoded) } else { encoded }
            };
            Texels::Floats(image.into_rgb16().pixels().map(|p| p.0.map(value)).collect())
        }
        _ => {
            let bytes = image.into_rgb8().pixels().map(|p| p.0).collect();
            if decoded { Texels::Srgb(bytes) } else { Texels::Bytes(bytes) }
        }
    };
    if let Texels::Floats(floats) = &texels {
        let good = |x: &f32| (0.0..=limits::TEXEL_VALUE).contains(x);
        if let Some(i) = floats.iter().position(|texel| !texel.iter().all(good)) {
            let (x, y, [r, g, b]) = (i as u32 % width, i as u32 / width, floats[i]);
            let message = format!("{}: pixel ({x}, {y}) is ({r}, {g}, {b}), which is no colour", path.display());
            let help = format!("values must be from 0 to {:e}", limits::TEXEL_VALUE);
            return Err(Diagnostic::error(message).help(help));
        }
    }
    Ok(MipMap::new(width, height, texels))
}

/// The picture of a file that a scene names, read unless it was before.
///
/// # Errors
/// As [`read_mip_map`]; and if all pictures together have too many texels.
pub fn fetch(images: &mut ImageCache, base: &Folder, file: &Text, decoded: bool) -> Result<Arc<MipMap>, Diagnostic> {
    if let Some(known) = images.0.get(&(file.clone(), decoded)) {
        return Ok(known.clone());
    }
    let taken: u64 = images.0.values().map(|picture| picture.texels()).sum();
    let room = limits::TEXTURE_TEXELS.saturating_sub(taken);
    let picture = Arc::new(read_mip_map(&base.find(file, FileRole::Image)?, decoded, room)?);
    images.0.insert((file.clone(), decoded), picture.clone());
    Ok(picture)
}

/// Reads what surrounds a scene: the folder of a cube map, or a picture of the whole sphere.
///
/// With `decoded` their bytes stand for the sRGB curve; otherwise they are taken as they are.
///
/// # Errors
/// As [`read_cube_map`] and [`fetch`].
pub fn read_surroundings(
    images: &mut ImageCache,
    base: &Folder,
    name: &Text,
    decoded: bool,
) -> Result<EnvironmentMap, Diagnostic> {
    if base.find(name, FileRole::Image)?.is_dir() {
        return read_cube_map(base, name, decoded).map(|cube| EnvironmentMap::Cube(Arc::new(cube)));
    }
    fetch(images, base, name, decoded).map(EnvironmentMap::Sphere)
}

/// Reads the pictures that the textures of a scene name; each file is read once and shared.
pub fn load_all(scene: &mut Scene) -> Vec<Problem> {
    let mut problems = Vec::new();
    let Scene { materials, entities, images, base, render, .. } = scene;
    let mut read = |path: Vec<Step>, texture: &Texture, coloured: bool| {
        let Some(file) = &texture.image else { return };
        let decoded = texture.decodes(coloured && render.transfer == Transfer::Srgb);
        if problems.len() < limits::DIAGNOSTICS
            && let Err(problem) = fetch(images, base, file, decoded)
        {
            let path = path.into_iter().chain([key("image")]).collect();
            problems.push(Problem::new(path, problem.message).help(problem.help));
        }
    };
    for (name, material) in materials.iter() {
        for (field, texture, coloured) in material.maps() {
            read(vec![key("materials"), key(name), key(field)], texture, coloured);
        }
    }
    for (index, desc) in entities.iter().enumerate() {
        if let Some(texture) = desc.component::<Texture>() {
            read(component_path(index, Kind::Texture), texture, true);
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn six_faces_make_a_sky_and_five_do_not() {
        let folder = tempfile::tempdir().unwrap();
        for (i, name) in FACES.iter().enumerate() {
            let picture = image::RgbImage::from_pixel(2, 2, image::Rgb([40 * i as u8, 0, 255]));
            picture.save(folder.path().join(format!("{name}.png"))).unwrap();
        }
        let sky = read_cube_map(&folder.path().into(), ".", false).unwrap();
        assert!((sky.lookup(Vec3::Y).x - 80.0 / 255.0).abs() < 1e-6);
        std::fs::remove_file(folder.path().join("back.png")).unwrap();
        assert!(read_cube_map(&folder.path().into(), ".", false).unwrap_err().message.contains("`back`"));
        std::fs::write(folder.path().join("back.png"), b"junk").unwrap();
        assert!(read_cube_map(&folder.path().into(), ".", false).is_err());
    }

    #[test]
    fn hdr_files_of_either_signature_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hdr");
        let mut bytes = Vec::new();
        let texels = [image::Rgb([0.5f32, 1.0, 8.0]); 6];
        image::codecs::hdr::HdrEncoder::new(&mut bytes).encode(&texels, 3, 2).unwrap();
        let rgbe = [b"#?RGBE", bytes.strip_prefix(b"#?RADIANCE").unwrap()].concat();
        for file in [bytes, rgbe] {
            std::fs::write(&path, file).unwrap();
            let image = decode(&path, 100).unwrap();
            assert_eq!(image.into_rgb32f().get_pixel(2, 1).0, [0.5, 1.0, 8.0]);
        }
    }
}
