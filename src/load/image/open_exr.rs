//! OpenEXR pictures: red, green and blue of the first layer that has them, or luminance alone.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::prelude::*;

pub fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Width and height of the layer that is read.
///
/// # Errors
/// A header that cannot be read, or no layer of colours in it.
pub fn size(bytes: &[u8]) -> std::result::Result<[u32; 2], String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    let is_colored = |header: &&exr::meta::header::Header| {
        let has = |name: &str| header.channels.list.iter().any(|channel| channel.name.eq_case_insensitive(name));
        !header.deep && ((has("R") && has("G") && has("B")) || has("Y"))
    };
    let header = meta.headers.iter().find(is_colored).ok_or("it has no layer with channels R, G and B, or Y")?;
    let side = |x: usize| u32::try_from(x).map_err(|_| "it is too large".to_string());
    Ok([side(header.layer_size.width())?, side(header.layer_size.height())?])
}

/// Texels in rows from the top, three numbers each; `size` is what [`size`] says.
///
/// # Errors
/// Data that cannot be read.
pub fn texels(bytes: &[u8], size: [u32; 2]) -> std::result::Result<Vec<f32>, String> {
    let [width, height] = size.map(|side| side as usize);
    let room = 3 * width * height;
    let put = move |texels: &mut Vec<f32>, at: Vec2<usize>, color: [f32; 3]| {
        let start = 3 * (at.y() * width + at.x());
        // Filters leave a little less than nothing beside what is bright.
        texels[start..start + 3].copy_from_slice(&color.map(|x| if x < 0.0 { 0.0 } else { x }));
    };
    let colored = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            move |_, _| vec![0.0; room],
            move |texels: &mut Vec<f32>, at, (r, g, b): (f32, f32, f32)| put(texels, at, [r, g, b]),
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes));
    match colored {
        Ok(image) if image.layer_data.size == Vec2(width, height) => return Ok(image.layer_data.channel_data.pixels),
        Ok(_) => return Err("its layers are of different sizes".into()),
        Err(_) => {}
    }
    let grey = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("Y")
        .collect_pixels(
            move |_, _| vec![0.0; room],
            move |texels: &mut Vec<f32>, at, (y,): (f32,)| put(texels, at, [y; 3]),
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| e.to_string())?;
    match grey.layer_data.size == Vec2(width, height) {
        true => Ok(grey.layer_data.channel_data.pixels),
        false => Err("its layers are of different sizes".into()),
    }
}
