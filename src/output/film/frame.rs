//! One frame on its way into a film: pixels as a screen shows them, with alpha.

use std::borrow::Cow;

use ::png::{BitDepth, ColorType};
use image::DynamicImage;

use super::super::exr::{EXR, decode_with_alpha};
use super::super::png::PNG;
use super::super::{Decoded, Format, Metadata};
use crate::base::limits;
use crate::components::{Render, ToneMap, Transfer};
use crate::film::DisplayTransform;

/// A picture of sRGB values with straight (not premultiplied) alpha, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFrame {
    /// Pixels of a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row from the top: red, green, blue, alpha.
    pub pixels: FramePixels,
}

/// Pixels in the depth that their file had.
#[derive(Clone, Debug, PartialEq)]
pub enum FramePixels {
    /// Of 8 bits a channel.
    Bytes(Vec<[u8; 4]>),
    /// Of 16 bits a channel.
    Words(Vec<[u16; 4]>),
}

/// What a frame's file says before its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameHead {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Pixels may let something through.
    pub alpha: bool,
    /// More than 8 bits a channel.
    pub deep: bool,
    /// What the file says of its making.
    pub metadata: Metadata,
}

/// A part of a frame, in pixels from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRect {
    /// Pixels left of it.
    pub x: u32,
    /// Rows above it.
    pub y: u32,
    /// Pixels of a row of it.
    pub width: u32,
    /// Its rows.
    pub height: u32,
}

impl FilmFrame {
    /// Reads a PNG file of any kind, or an EXR file, with the metadata that are in it.
    ///
    /// Linear values of an EXR are shown as its own metadata say (exposure and tone map), or else cut off at 1.
    ///
    /// # Errors
    /// Why the file cannot be read: it is neither, damaged, cut short, or too large.
    pub fn read(bytes: &[u8]) -> Result<(FilmFrame, Metadata), String> {
        if Format::of_bytes(bytes) == Some(&EXR) {
            return from_exr(bytes);
        }
        if !bytes.starts_with(b"\x89PNG") {
            return Err("it is no PNG or EXR picture".into());
        }
        let metadata = (PNG.checked_metadata)(bytes).ok_or("the file is damaged or cut short")?;
        let cursor = std::io::Cursor::new(bytes);
        let mut reader = image::ImageReader::with_format(cursor, image::ImageFormat::Png);
        let mut caps = image::Limits::default();
        caps.max_image_width = Some(limits::FRAME_SIDE);
        caps.max_image_height = Some(limits::FRAME_SIDE);
        caps.max_alloc = Some(limits::FRAME_FILE_BYTES);
        reader.limits(caps);
        let picture = reader.decode().map_err(|e| e.to_string())?;
        Ok((FilmFrame::from_image(picture), metadata))
    }

    /// What a file says of a frame without its pixels.
    ///
    /// # Errors
    /// As [`Self::read`], as far as that shows.
    pub fn head(bytes: &[u8]) -> Result<FrameHead, String> {
        if Format::of_bytes(bytes) == Some(&EXR) {
            let file = (EXR.read_header)(bytes)?;
            let alpha = file.channels.iter().any(|name| name == "A");
            return Ok(FrameHead { size: file.size, alpha, deep: true, metadata: file.metadata });
        }
        let metadata = (PNG.checked_metadata)(bytes).ok_or("it is no PNG or EXR picture, or a damaged one")?;
        let reader = ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(|e| e.to_string())?;
        let info = reader.info();
        let alpha = info.trns.is_some() || matches!(info.color_type, ColorType::Rgba | ColorType::GrayscaleAlpha);
        let deep = info.bit_depth == BitDepth::Sixteen;
        Ok(FrameHead { size: [info.width, info.height], alpha, deep, metadata })
    }

    fn from_image(picture: DynamicImage) -> FilmFrame {
        let (width, height) = (picture.width(), picture.height());
        let is_deep = matches!(
            picture,
            DynamicImage::ImageLuma16(_)
                | DynamicImage::ImageLumaA16(_)
                | DynamicImage::ImageRgb16(_)
                | DynamicImage::ImageRgba16(_)
        );
        let pixels = match is_deep {
            true => FramePixels::Words(picture.into_rgba16().pixels().map(|p| p.0).collect()),
            false => FramePixels::Bytes(picture.into_rgba8().pixels().map(|p| p.0).collect()),
        };
        FilmFrame { width, height, pixels }
    }

    /// Whether a pixel lets something through.
    pub fn is_transparent(&self) -> bool {
        match &self.pixels {
            FramePixels::Bytes(pixels) => pixels.iter().any(|p| p[3] != u8::MAX),
            FramePixels::Words(pixels) => pixels.iter().any(|p| p[3] != u16::MAX),
        }
    }

    /// The pixels in 8 bits, rounded to nearest.
    pub fn bytes(&self) -> Cow<'_, [[u8; 4]]> {
        match &self.pixels {
            FramePixels::Bytes(pixels) => Cow::Borrowed(pixels),
            FramePixels::Words(pixels) => pixels.iter().map(|p| p.map(byte_of)).collect(),
        }
    }

    /// The pixels in 16 bits.
    pub fn words(&self) -> Cow<'_, [[u16; 4]]> {
        match &self.pixels {
            FramePixels::Words(pixels) => Cow::Borrowed(pixels),
            FramePixels::Bytes(pixels) => pixels.iter().map(|p| p.map(|x| u16::from(x) * 257)).collect(),
        }
    }

    /// The frame as it shows before black.
    pub fn before_black(&self) -> FilmFrame {
        let over = |x: u16, alpha: u16| ((u32::from(x) * u32::from(alpha) + 32_767) / 65_535) as u16;
        let dark =
            self.words().iter().map(|[r, g, b, a]| [over(*r, *a), over(*g, *a), over(*b, *a), u16::MAX]).collect();
        let frame = FilmFrame { pixels: FramePixels::Words(dark), ..*self };
        match self.pixels {
            FramePixels::Bytes(_) => FilmFrame { pixels: FramePixels::Bytes(frame.bytes().into_owned()), ..frame },
            FramePixels::Words(_) => frame,
        }
    }

    /// The whole frame.
    pub fn rect(&self) -> FrameRect {
        FrameRect { x: 0, y: 0, width: self.width, height: self.height }
    }
}

fn byte_of(word: u16) -> u8 {
    ((u32::from(word) * 255 + 32_767) / 65_535) as u8
}

fn from_exr(bytes: &[u8]) -> Result<(FilmFrame, Metadata), String> {
    let metadata = (EXR.read_header)(bytes)?.metadata;
    let (Decoded { size: [width, height], pixels: colors }, alpha) = decode_with_alpha(bytes)?;
    let look = display_of(&metadata);
    let shown = colors.into_iter().enumerate().map(|(i, color)| {
        let alpha = alpha.as_ref().map_or(1.0, |alpha| alpha[i].clamp(0.0, 1.0));
        let straight = if alpha > 0.0 { color.map(|x| x / alpha) } else { [0.0; 3] };
        let [r, g, b] = look.expose(straight).map(|x| look.word(x));
        [r, g, b, (alpha * 65535.0 + 0.5) as u16]
    });
    Ok((FilmFrame { width, height, pixels: FramePixels::Words(shown.collect()) }, metadata))
}

/// How the settings that a picture was made with would have it shown.
fn display_of(metadata: &Metadata) -> DisplayTransform {
    let settings = metadata.iter().find(|(keyword, _)| keyword == "Settings").map_or("", |(_, text)| text.as_str());
    let mut render = Render::default();
    for (name, value) in settings.split(' ').filter_map(|word| word.split_once('=')) {
        match name {
            "exposure" => render.exposure = value.parse().ok().filter(|x: &f64| x.is_finite()).unwrap_or(0.0),
            "tone_map" => render.tone_map = ToneMap::parse(value).unwrap_or(render.tone_map),
            "transfer" => render.transfer = Transfer::parse(value).unwrap_or(render.transfer),
            _ => {}
        }
    }
    DisplayTransform::new(&render)
}

/// The smallest part outside of which two pictures of one width are equal; `None` if they are equal.
pub fn changed_part<T: PartialEq>(before: &[T], after: &[T], width: u32) -> Option<FrameRect> {
    let row = width as usize;
    let rows = || before.chunks_exact(row).zip(after.chunks_exact(row));
    let top = rows().position(|(a, b)| a != b)?;
    let bottom = rows().rposition(|(a, b)| a != b)?;
    let (mut left, mut right) = (row - 1, 0);
    for (a, b) in rows().skip(top).take(bottom + 1 - top) {
        let first = a.iter().zip(b).position(|(x, y)| x != y);
        let last = a.iter().zip(b).rposition(|(x, y)| x != y);
        if let (Some(first), Some(last)) = (first, last) {
            left = left.min(first);
            right = right.max(last);
        }
    }
    let (x, y) = (left as u32, top as u32);
    Some(FrameRect { x, y, width: (right + 1 - left) as u32, height: (bottom + 1 - top) as u32 })
}

/// The pixels of a part, row by row.
pub fn part_of<'a, T>(pixels: &'a [T], width: u32, rect: FrameRect) -> impl Iterator<Item = &'a T> + use<'a, T> {
    let rows = pixels.chunks_exact(width as usize).skip(rect.y as usize).take(rect.height as usize);
    let FrameRect { x, width, .. } = rect;
    rows.flat_map(move |row| &row[x as usize..(x + width) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Film;

    #[test]
    fn the_changed_part_is_as_small_as_can_be() {
        let before = vec![0u8; 12];
        assert_eq!(changed_part(&before, &before, 4), None);
        let mut after = before.clone();
        after[6] = 1;
        let rect = |x, y, width, height| Some(FrameRect { x, y, width, height });
        assert_eq!(changed_part(&before, &after, 4), rect(2, 1, 1, 1));
        after[8] = 1;
        assert_eq!(changed_part(&before, &after, 4), rect(0, 1, 3, 2));
        let found: Vec<u8> = part_of(&after, 4, rect(0, 1, 3, 2).unwrap()).copied().collect();
        assert_eq!(found, [0, 0, 1, 1, 0, 0]);
    }

    #[test]
    fn pictures_are_read_as_they_were_shown() {
        let film = Film { pixels: vec![[0.0, 0.5, 1.0], [0.25, 2.0, -1.0]], ..Film::new(2, 1) };
        let render = Render { exposure: -1.0, tone_map: ToneMap::Reinhard, bit_depth: 16, ..Render::default() };
        let metadata = vec![("Settings".to_string(), crate::output::metadata::settings_text(&render))];
        let (png, _) = FilmFrame::read(&(PNG.encode)(&film, &render, &metadata).unwrap()).unwrap();
        let render = Render { bit_depth: 32, ..render };
        let (exr, said) = FilmFrame::read(&(EXR.encode)(&film, &render, &metadata).unwrap()).unwrap();
        assert_eq!((&png, said), (&exr, metadata.clone()));
        let shallow = Render { bit_depth: 8, ..render };
        let (small, _) = FilmFrame::read(&(PNG.encode)(&film, &shallow, &metadata).unwrap()).unwrap();
        assert_eq!(png.bytes(), small.bytes());
        assert!(!png.is_transparent());
    }

    #[test]
    fn damaged_pictures_are_refused() {
        let film = Film { pixels: vec![[0.5; 3]; 64], ..Film::new(8, 8) };
        let bytes = (PNG.encode)(&film, &Render::default(), &Metadata::new()).unwrap();
        for cut in 0..bytes.len() {
            assert!(FilmFrame::read(&bytes[..cut]).is_err(), "{cut}");
        }
        assert!(FilmFrame::read(b"GIF89a").unwrap_err().contains("no PNG"));
    }
}
