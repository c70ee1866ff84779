//! RGB to the planes that video is made of: BT.709 luma and colour differences in the narrow range.
//!
//! Recommendation ITU-R BT.709-6: E'Y = 0.2126 E'R + 0.7152 E'G + 0.0722 E'B; luma codes go from 16 to 235 (of 255, or
//! 64 to 940 of 1023), colour differences from 16 to 240. sRGB values go in as they are: its primaries are those of
//! BT.709, and players show both transfer curves alike. Halved colour differences lie where MPEG-2 has them: on every
//! second pixel of a row, and between two rows.

use super::frame::FilmFrame;

/// How many colour differences there are for the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chroma {
    /// One for two by two pixels.
    Quarter,
    /// One for two pixels of a row.
    Half,
    /// One for each pixel.
    Full,
}

/// How the pixels of a film are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaneFormat {
    /// How many values of colour there are.
    pub chroma: Chroma,
    /// 8 or 10 bits.
    pub bits: u32,
    /// A fourth plane of straight alpha, over the full range.
    pub alpha: bool,
}

impl PlaneFormat {
    /// What nearly every player can show.
    pub const USUAL: PlaneFormat = PlaneFormat { chroma: Chroma::Quarter, bits: 8, alpha: false };

    /// Names as ffmpeg has them, without alpha.
    pub const NAMES: [&str; 6] = ["yuv420p", "yuv422p", "yuv444p", "yuv420p10", "yuv422p10", "yuv444p10"];

    /// The format of a name of [`Self::NAMES`]; `le` may follow it.
    pub fn parse(name: &str) -> Option<PlaneFormat> {
        let plain = name.strip_suffix("le").unwrap_or(name);
        let index = Self::NAMES.iter().position(|known| *known == plain)?;
        let chroma = [Chroma::Quarter, Chroma::Half, Chroma::Full][index % 3];
        Some(PlaneFormat { chroma, bits: if index < 3 { 8 } else { 10 }, alpha: false })
    }

    /// The name that ffmpeg knows it by.
    pub fn name(self) -> String {
        let alpha = if self.alpha { "a" } else { "" };
        let bits = if self.bits == 10 { "10le" } else { "" };
        format!("yuv{alpha}{}p{bits}", self.chroma_digits())
    }

    /// Colour as ffmpeg's names have it: `420`, `422` or `444`.
    pub fn chroma_digits(self) -> &'static str {
        match self.chroma {
            Chroma::Quarter => "420",
            Chroma::Half => "422",
            Chroma::Full => "444",
        }
    }

    /// Width and height with the columns and rows that halved colour differences need: even ones.
    pub fn padded(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self.chroma {
            Chroma::Quarter => [width.next_multiple_of(2), height.next_multiple_of(2)],
            Chroma::Half => [width.next_multiple_of(2), height],
            Chroma::Full => [width, height],
        }
    }

    /// Appends the planes of a frame to `out`: Y, Cb, Cr and alpha, row by row, samples of 10 bits as two bytes with
    /// the low one first. `size` is the frame's own or larger by a column or a row, which repeat the last ones.
    pub fn put(self, frame: &FilmFrame, size: [u32; 2], out: &mut Vec<u8>) {
        let [width, height] = size.map(|n| n as usize);
        let (own_width, own_height) = (frame.width as usize, frame.height as usize);
        let words = frame.words();
        let mut luma = Vec::with_capacity(width * height);
        let mut differences = [Vec::with_capacity(width * height), Vec::with_capacity(width * height)];
        let mut alpha = Vec::with_capacity(if self.alpha { width * height } else { 0 });
        for y in 0..height {
            let row = &words[y.min(own_height - 1) * own_width..][..own_width];
            let padding = std::iter::repeat_n(&row[own_width - 1], width - own_width);
            for pixel in row.iter().chain(padding) {
                let [r, g, b, a] = pixel.map(|x| f32::from(x) / 65_535.0);
                let l = 0.2126 * r + 0.7152 * g + 0.0722 * b;
                luma.push(l);
                differences[0].push((b - l) / 1.8556);
                differences[1].push((r - l) / 1.5748);
                if self.alpha {
                    alpha.push(a);
                }
            }
        }
        let step = (1 << (self.bits - 8)) as f32;
        let code = |x: f32, scale: f32, zero: f32| ((x * scale + zero) * step + 0.5) as u16;
        self.put_samples(luma.iter().map(|x| code(*x, 219.0, 16.0)), out);
        for plane in &differences {
            let plane = self.thinned(plane, width, height);
            self.put_samples(plane.iter().map(|x| code(*x, 224.0, 128.0)), out);
        }
        let most = ((1 << self.bits) - 1) as f32;
        self.put_samples(alpha.iter().map(|x| (x * most + 0.5) as u16), out);
    }

    fn put_samples(self, samples: impl Iterator<Item = u16>, out: &mut Vec<u8>) {
        match self.bits {
            8 => out.extend(samples.map(|x| x as u8)),
            _ => out.extend(samples.flat_map(u16::to_le_bytes)),
        }
    }

    /// Fewer colour differences: along rows by the weights 1 2 1 around every second one, then the mean of two rows.
    fn thinned(self, plane: &[f32], width: usize, height: usize) -> Vec<f32> {
        let (thin_width, thin_height) = match self.chroma {
            Chroma::Full => return plane.to_vec(),
            Chroma::Half => (width.div_ceil(2), height),
            Chroma::Quarter => (width.div_ceil(2), height.div_ceil(2)),
        };
        let in_row = |y: usize, x: usize| {
            let row = &plane[y.min(height - 1) * width..][..width];
            let (left, right) = (row[x.saturating_sub(1)], row[(x + 1).min(width - 1)]);
            (left + 2.0 * row[x] + right) / 4.0
        };
        let mut thin = Vec::with_capacity(thin_width * thin_height);
        for y in 0..thin_height {
            thin.extend((0..thin_width).map(|x| match self.chroma {
                Chroma::Quarter => (in_row(2 * y, 2 * x) + in_row(2 * y + 1, 2 * x)) / 2.0,
                Chroma::Half | Chroma::Full => in_row(y, 2 * x),
            }));
        }
        thin
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::FramePixels;
    use super::*;

    fn planes(format: &str, width: u32, colors: &[[u8; 3]]) -> Vec<u8> {
        let pixels = colors.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        let height = colors.len() as u32 / width;
        let frame = FilmFrame { width, height, pixels: FramePixels::Bytes(pixels) };
        let mut out = Vec::new();
        PlaneFormat::parse(format).unwrap().put(&frame, [width, height], &mut out);
        out
    }

    /// The codes of the 75 % and 100 % colour bars of BT.709, as broadcast tables give them.
    #[test]
    fn bars_have_their_codes() {
        let of = |color| planes("yuv444p", 1, &[color]);
        assert_eq!(of([255, 255, 255]), [235, 128, 128]);
        assert_eq!(of([0, 0, 0]), [16, 128, 128]);
        assert_eq!(of([255, 0, 0]), [63, 102, 240]);
        assert_eq!(of([0, 255, 0]), [173, 42, 26]);
        assert_eq!(of([0, 0, 255]), [32, 240, 118]);
        assert_eq!(of([255, 255, 0]), [219, 16, 138]);
        assert_eq!(of([128, 128, 128]), [126, 128, 128]);
        assert_eq!(planes("yuv444p10", 1, &[[255, 255, 255]]), [940u16, 512, 512].map(u16::to_le_bytes).concat());
        assert_eq!(planes("yuv444p10", 1, &[[255, 0, 0]]), [250u16, 409, 960].map(u16::to_le_bytes).concat());
    }

    #[test]
    fn every_grey_comes_back() {
        for grey in 0..=255u8 {
            let [y, cb, cr] = *planes("yuv444p", 1, &[[grey; 3]]) else { panic!() };
            let back = (f32::from(y) - 16.0) * 255.0 / 219.0;
            assert!((back - f32::from(grey)).abs() <= 0.6 && cb == 128 && cr == 128, "{grey}: {back}");
        }
    }

    #[test]
    fn halved_colours_lie_on_even_columns_and_between_rows() {
        let (grey, red) = ([128; 3], [255, 0, 0]);
        // One red column: the colour sample on it has half of its weight, and those beside it a quarter.
        let wide = planes("yuv422p", 5, &[grey, grey, red, grey, grey]);
        assert_eq!(wide[..5], [126, 126, 63, 126, 126]);
        assert_eq!(wide[8..], [128, 184, 128]);
        let odd = planes("yuv422p", 5, &[grey, red, grey, grey, grey]);
        assert_eq!(odd[8..], [156, 156, 128]);
        let tall = planes("yuv420p", 2, &[red, red, grey, grey, red, red]);
        assert_eq!((tall.len(), &tall[8..]), (10, &[184, 240][..]));
    }

    #[test]
    fn padding_repeats_the_edge_and_alpha_has_a_plane_of_its_own() {
        let pixels = vec![[255, 255, 255, 255], [255, 255, 255, 0], [255, 255, 255, 51]];
        let frame = FilmFrame { width: 3, height: 1, pixels: FramePixels::Bytes(pixels) };
        let mut out = Vec::new();
        PlaneFormat::USUAL.put(&frame.before_black(), PlaneFormat::USUAL.padded([3, 1]), &mut out);
        assert_eq!(out, [235, 16, 60, 60, 235, 16, 60, 60, 128, 128, 128, 128]);
        let mut out = Vec::new();
        let with_alpha = PlaneFormat { alpha: true, ..PlaneFormat::USUAL };
        with_alpha.put(&frame, [3, 1], &mut out);
        assert_eq!(out[7..], [255, 0, 51]);
        assert_eq!(with_alpha.name(), "yuva420p");
        assert_eq!(PlaneFormat::parse("yuv422p10le").unwrap().name(), "yuv422p10le");
        assert_eq!(PlaneFormat::parse("rgb24"), None);
    }
}
