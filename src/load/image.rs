//! Image files: pictures of textures and of what surrounds a scene.

mod hdr;
mod jpeg;
mod open_exr;

use std::fmt::Display;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Rgb32FImage};
use rustc_hash::FxHashMap;

use super::gltf::Document;
use super::resolve::{Problem, component_path, key};
use super::spans::Step;
use crate::base::color::srgb_decode;
use crate::base::diagnostics::Diagnostic;
use crate::base::project::{FileRole, Folder};
use crate::base::{files, limits, memory};
use crate::components::*;
use crate::trace::light::environment::{CubeMap, EnvironmentMap, FACES, Face};

/// Endings of the faces of a cube map.
const FACE_ENDINGS: [&str; 6] = ["jpg", "jpeg", "png", "tga", "bmp", "webp"];

/// Reads the faces `right left top bottom front back` of a folder that a scene names, in letters of any case.
///
/// With `linear` their sRGB values are decoded to linear light; otherwise they are taken as they are.
///
/// # Errors
/// A face that is missing, too large, not an image, or outside of the project.
pub fn read_cube_map(base: &Folder, folder: &str, linear: bool) -> Result<CubeMap, Diagnostic> {
    let mut faces = Vec::new();
    let shown = base.find(folder, FileRole::Image)?;
    for name in FACES {
        let names = FACE_ENDINGS.map(|e| format!("{name}.{e}"));
        let found = names.iter().find_map(|name| files::find_any_case(&shown, Path::new(name)));
        let face = found.ok_or_else(|| {
            let endings = FACE_ENDINGS.map(|e| format!(".{e}")).join(", ");
            Diagnostic::error(format!("{} has no face `{name}` ({endings})", shown.display()))
        })?;
        faces.push(read_face(&base.admit(&format!("{folder}/{}", face.display()))?, linear)?);
    }
    match <[Face; 6]>::try_from(faces) {
        Ok(faces) => Ok(CubeMap { faces }),
        Err(_) => Err(Diagnostic::error("a cube map has six faces")),
    }
}

fn read_face(path: &Path, linear: bool) -> Result<Face, Diagnostic> {
    let bytes = files::read_bytes(path, limits::IMAGE_FILE_BYTES)?;
    let picture = decode(bytes, &path.display().to_string(), limits::TEXTURE_TEXELS / FACES.len() as u64)?.to_rgb8();
    let value = |x: u8| {
        let encoded = f32::from(x) / 255.0;
        if linear { srgb_decode(encoded) } else { encoded }
    };
    let texels = picture.pixels().map(|p| p.0.map(value)).collect();
    Ok(Face { width: picture.width(), height: picture.height(), texels })
}

/// Bytes of a pixel while a picture of floats is read: as decoded, as texels, and in smaller copies.
const BYTES_OF_FLOATS: u64 = 12 + 12 + 12 + 4;
/// As [`BYTES_OF_FLOATS`], of a picture of 16 bits a channel, whose texels are floats.
const BYTES_OF_WORDS: u64 = 8 + 6 + 12 + 4;
/// As [`BYTES_OF_FLOATS`], of one of 8 bits.
const BYTES_OF_BYTES: u64 = 4 + 3 + 3 + 1;

/// Endings and names of the image files that are read.
const KNOWN: &str = "known: PNG, JPEG, HDR (Radiance), EXR, TGA, BMP, WebP, PPM";

/// What a file is of which nothing is read, if its first bytes say so.
fn kind_of(bytes: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 4] = [
        (b"\xabKTX 20\xbb", "textures compressed for graphics cards (KTX2) are not read"),
        (b"\xabKTX 11\xbb", "textures compressed for graphics cards (KTX) are not read"),
        (b"DDS ", "textures compressed for graphics cards (DDS) are not read"),
        (b"GIF8", "GIF pictures are not read as textures"),
    ];
    kinds.into_iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, said)| said)
}

/// The pixels of an image file of at most `cap` of them; the size is known before anything is allocated for it.
///
/// `name` is what the file is called.
fn decode(bytes: Vec<u8>, name: &str, cap: u64) -> Result<DynamicImage, Diagnostic> {
    let broken = |e: &dyn Display| Diagnostic::error(format!("cannot read {name}: {e}"));
    if bytes.starts_with(b"version https://git-lfs") {
        let problem = broken(&"this is a pointer of Git LFS, not the file itself");
        return Err(problem.help("fetch it with `git lfs pull`"));
    }
    let fits = |[width, height]: [u32; 2]| {
        if width == 0 || height == 0 {
            return Err(broken(&"it has no pixels"));
        }
        if width > limits::IMAGE_SIDE || height > limits::IMAGE_SIDE {
            return Err(broken(&format!("{width} x {height} is over the limit of {} a side", limits::IMAGE_SIDE)));
        }
        if u64::from(width) * u64::from(height) > cap {
            return Err(broken(&format!("{width} x {height} is over the limit of {cap} pixels for all images")));
        }
        Ok(())
    };
    let foresee = |[width, height]: [u32; 2], bytes: u64| {
        let pixels = u64::from(width) * u64::from(height);
        memory::check(pixels * bytes, || format!("the {width} x {height} pixels of {name}"))
    };
    let floats = |[width, height]: [u32; 2], texels: Vec<f32>| {
        let picture = Rgb32FImage::from_raw(width, height, texels);
        picture.map(DynamicImage::ImageRgb32F).ok_or_else(|| broken(&"it has fewer pixels than it says"))
    };
    if hdr::is_hdr(&bytes) {
        let header = hdr::header(&bytes).map_err(|e| broken(&e))?;
        fits(header.size)?;
        foresee(header.size, BYTES_OF_FLOATS)?;
        return floats(header.size, hdr::texels(&bytes, &header).map_err(|e| broken(&e))?);
    }
    if open_exr::is_exr(&bytes) {
        let size = open_exr::size(&bytes).map_err(|e| broken(&e))?;
        fits(size)?;
        foresee(size, BYTES_OF_FLOATS)?;
        return floats(size, open_exr::texels(&bytes, size).map_err(|e| broken(&e))?);
    }
    let is_tga = Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"));
    let reader = || {
        let mut reader = ImageReader::new(Cursor::new(&bytes)).with_guessed_format().map_err(|e| broken(&e))?;
        if reader.format().is_none() && is_tga {
            // Nothing in a TGA file says that it is one.
            reader.set_format(ImageFormat::Tga);
        }
        Ok::<_, Diagnostic>(reader)
    };
    let known =
        [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Tga, ImageFormat::Bmp, ImageFormat::WebP, ImageFormat::Pnm];
    let format = reader()?.format().filter(|format| known.contains(format));
    let Some(format) = format else {
        let what = kind_of(&bytes).unwrap_or("not an image of a known kind");
        return Err(broken(&what).help(KNOWN));
    };
    let (width, height) = reader()?.into_dimensions().map_err(|e| broken(&e))?;
    fits([width, height])?;
    let jpeg = if format == ImageFormat::Jpeg { jpeg::scan(&bytes) } else { jpeg::JpegScan::default() };
    if format == ImageFormat::Jpeg && !jpeg.is_whole {
        return Err(broken(&"the file ends too early"));
    }
    let mut reader = reader()?;
    let mut caps = image::Limits::default();
    caps.max_alloc = Some(limits::IMAGE_BYTES);
    reader.limits(caps);
    let mut decoder = reader.into_decoder().map_err(|e| broken(&e))?;
    let is_deep = decoder.color_type().bits_per_pixel() > 8 * u16::from(decoder.color_type().channel_count());
    foresee([width, height], if is_deep { BYTES_OF_WORDS } else { BYTES_OF_BYTES })?;
    let orientation = decoder.orientation().map_err(|e| broken(&e))?;
    let mut picture = match jpeg.is_apart {
        false => DynamicImage::from_decoder(decoder).map_err(|e| broken(&e))?,
        true => decode_apart(&bytes).map_err(|e| broken(&e))?,
    };
    picture.apply_orientation(orientation);
    Ok(picture)
}

/// Decodes a JPEG whose components stand apart.
fn decode_apart(bytes: &[u8]) -> Result<DynamicImage, String> {
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    let texels = decoder.decode().map_err(|e| e.to_string())?;
    let info = decoder.info().ok_or("it has no picture")?;
    let (width, height) = (info.width.into(), info.height.into());
    match info.pixel_format {
        jpeg_decoder::PixelFormat::RGB24 => {
            let picture = image::RgbImage::from_raw(width, height, texels).ok_or("it has fewer pixels than it says")?;
            Ok(DynamicImage::ImageRgb8(picture))
        }
        _ => Err("its colours are of a kind that is not read where components stand apart".into()),
    }
}

/// The image of a file for a texture, with its smaller copies; `name` is what errors call it.
fn mip_map(bytes: Vec<u8>, name: &str, plane: ImagePlane, cap: u64) -> Result<MipMap, Diagnostic> {
    let image = decode(bytes, name, cap)?;
    let (width, height) = (image.width(), image.height());
    let decoded = plane == ImagePlane::Srgb;
    let texels = match image {
        _ if plane == ImagePlane::Alpha => alpha(image),
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
            let message = format!("{name}: pixel ({x}, {y}) is ({r}, {g}, {b}), which is no colour");
            let help = format!("values must be from 0 to {:e}", limits::TEXEL_VALUE);
            return Err(Diagnostic::error(message).help(help));
        }
    }
    Ok(MipMap::new(width, height, texels))
}

/// The alpha of an image as grey.
fn alpha(image: DynamicImage) -> Texels {
    if matches!(image, DynamicImage::ImageRgba32F(_) | DynamicImage::ImageRgba16(_) | DynamicImage::ImageLumaA16(_)) {
        return Texels::Floats(image.into_rgba32f().pixels().map(|p| [p.0[3]; 3]).collect());
    }
    Texels::Bytes(image.into_rgba8().pixels().map(|p| [p.0[3]; 3]).collect())
}

/// The picture of a file that a scene names, read unless it was before. `x.glb#images/2` is the third image in a glTF.
///
/// # Errors
/// A file that is missing, broken, too large or with values that are no colours; and if all pictures together have too
/// many texels.
pub fn fetch(
    images: &mut ImageCache,
    base: &Folder,
    file: &Text,
    plane: ImagePlane,
) -> Result<Arc<MipMap>, Diagnostic> {
    put(images, base, file, plane, || match embedded(file) {
        Some((asset, number)) => {
            let document = Document::open(base, asset).map_err(|mut all| all.0.swap_remove(0))?;
            document.image(number).map_err(|mut all| all.0.swap_remove(0))
        }
        None => files::read_bytes(&base.find(file, FileRole::Image)?, limits::IMAGE_FILE_BYTES),
    })
}

/// The glTF file and the number in it of an image that is not a file of its own.
fn embedded(file: &str) -> Option<(&str, usize)> {
    let (asset, number) = file.rsplit_once("#images/")?;
    Some((asset, number.parse().ok()?))
}

fn put(
    images: &mut ImageCache,
    base: &Folder,
    file: &Text,
    plane: ImagePlane,
    bytes: impl FnOnce() -> Result<Vec<u8>, Diagnostic>,
) -> Result<Arc<MipMap>, Diagnostic> {
    if let Some(known) = images.0.get(&(file.clone(), plane)) {
        return Ok(known.clone());
    }
    let room = limits::TEXTURE_TEXELS.saturating_sub(images.texels());
    let name = base.join(&**file).display().to_string();
    let picture = Arc::new(mip_map(bytes()?, &name, plane, room)?);
    images.0.insert((file.clone(), plane), picture.clone());
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
    fetch(images, base, name, ImagePlane::of_colors(decoded)).map(EnvironmentMap::Sphere)
}

/// Reads the pictures that the textures of a scene name; each file is read once and shared. `documents` are the glTF
/// files that are open, by their names in the scene.
pub fn load_all(scene: &mut Scene, documents: &FxHashMap<Text, Document>) -> Vec<Problem> {
    let mut problems = Vec::new();
    let Scene { materials, entities, images, base, render, .. } = scene;
    let mut read = |path: Vec<Step>, texture: &Texture, coloured: bool| {
        let Some(file) = &texture.file() else { return };
        let plane = texture.plane(coloured && render.transfer == Transfer::Srgb);
        let open = embedded(file).and_then(|(asset, number)| Some((documents.get(asset)?, number)));
        let fetched = match open {
            Some((document, number)) => {
                put(images, base, file, plane, || document.image(number).map_err(|mut all| all.0.swap_remove(0)))
            }
            None => fetch(images, base, file, plane),
        };
        if problems.len() < limits::DIAGNOSTICS
            && let Err(problem) = fetched
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
}
