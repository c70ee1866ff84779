//! Contact sheets: pictures of one size in rows and columns, each with a line of text below it.

mod scale;
mod text;

use super::film::FilmFrame;
use crate::base::color::{srgb_byte, srgb_decode};
use crate::base::{font, limits};

/// A picture and what is written below it.
pub struct SheetTile {
    /// The picture, of any size.
    pub picture: FilmFrame,
    /// A line of text; nothing is written where it is empty.
    pub label: String,
}

/// How a sheet is laid out, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SheetLayout {
    /// Tiles of a row.
    pub columns: u32,
    /// Rows of tiles.
    pub rows: u32,
    /// Of the pictures as they are shown.
    pub tile: [u32; 2],
    /// Around and between tiles.
    pub gap: u32,
    /// Of letters; 0 if nothing is written.
    pub letters: u32,
}

/// Widest sheet unless the user says how wide tiles are: that of a usual screen.
const WIDEST: u32 = 1_920;
/// Smallest and largest letters, and how many fit side by side in a tile, about.
const LETTERS: [u32; 2] = [13, 30];
const LETTERS_IN_TILE: u32 = 20;
/// Width of a sheet over its height that is aimed at where nobody says how many columns there are.
const SHAPE: f64 = 1.4;

/// sRGB: a dark grey that flatters no picture, and light letters on it.
const PAPER: [u8; 3] = [24, 24, 27];
const INK: [u8; 3] = [228, 228, 231];

impl SheetLayout {
    /// A layout for so many pictures of one size. `columns` and `tile`, the width of a picture on the sheet, are chosen
    /// where they are not given; pictures are never enlarged.
    ///
    /// # Errors
    /// A sheet that would be larger than a picture may be.
    pub fn new(
        count: u32,
        [width, height]: [u32; 2],
        columns: Option<u32>,
        tile: Option<u32>,
        labels: bool,
    ) -> Result<SheetLayout, String> {
        let shape = f64::from(width) / f64::from(height);
        let fits = |columns: u32| f64::from(columns) * shape >= SHAPE * f64::from(count.div_ceil(columns));
        let chosen = columns.or_else(|| (1..=count).find(|columns| fits(*columns)));
        let columns = chosen.unwrap_or(count).clamp(1, count.max(1));
        let rows = count.div_ceil(columns);
        let gap_of = |tile: u32| (tile / 24).clamp(6, 24);
        let widest = (WIDEST / columns).saturating_sub(gap_of(WIDEST / columns) * 2).max(16);
        let tile_width = tile.unwrap_or(widest).min(width).max(1);
        let tile_height = (f64::from(height) * f64::from(tile_width) / f64::from(width) + 0.5) as u32;
        let letters = if labels { (tile_width / LETTERS_IN_TILE).clamp(LETTERS[0], LETTERS[1]) } else { 0 };
        let gap = gap_of(tile_width);
        let layout = SheetLayout { columns, rows, tile: [tile_width, tile_height.max(1)], gap, letters };
        let [width, height] = layout.size();
        let is_too_large = |side: u64| side > u64::from(limits::FRAME_SIDE);
        if is_too_large(width) || is_too_large(height) || width * height > limits::FRAME_PIXELS {
            return Err(format!(
                "the sheet would be {width}x{height}, over the limit of {} a side and {} pixels",
                limits::FRAME_SIDE,
                limits::FRAME_PIXELS
            ));
        }
        Ok(layout)
    }

    /// Width and height of the sheet.
    pub fn size(&self) -> [u64; 2] {
        let [width, height] = self.tile.map(u64::from);
        let (gap, line) = (u64::from(self.gap), u64::from(self.line()));
        let (columns, rows) = (u64::from(self.columns), u64::from(self.rows));
        [gap + columns * (width + gap), gap + rows * (height + line + gap)]
    }

    /// Height of a line of text with the room above it.
    fn line(&self) -> u32 {
        if self.letters == 0 { 0 } else { self.letters + self.letters / 2 }
    }

    /// Upper left corner of a tile.
    fn corner(&self, index: u32) -> [u32; 2] {
        let [width, height] = self.tile;
        let (column, row) = (index % self.columns, index / self.columns);
        [self.gap + column * (width + self.gap), self.gap + row * (height + self.line() + self.gap)]
    }
}

/// Draws a sheet: RGB bytes in rows. Pictures of another shape than the tiles are fitted into them.
pub fn draw_sheet(layout: &SheetLayout, tiles: &[SheetTile]) -> Vec<u8> {
    let [width, height] = layout.size().map(|side| side as u32);
    let mut sheet = Canvas { width, pixels: vec![PAPER; width as usize * height as usize] };
    for (index, tile) in (0..layout.columns * layout.rows).zip(tiles) {
        let [x, y] = layout.corner(index);
        let size = fitted([tile.picture.width, tile.picture.height], layout.tile);
        let shown = scale::shrunk(&tile.picture, size, PAPER.map(decode));
        let inset: [u32; 2] = std::array::from_fn(|i| (layout.tile[i] - size[i]) / 2);
        sheet.put(&shown, size[0], [x + inset[0], y + inset[1]]);
        if layout.letters > 0 {
            let base = y + layout.tile[1] + layout.line() - layout.letters / 4;
            sheet.write(&tile.label, layout.letters, layout.tile[0], [x, base]);
        }
    }
    sheet.pixels.into_flattened()
}

/// The largest size of the same shape inside of another one, and not larger than itself.
fn fitted([width, height]: [u32; 2], within: [u32; 2]) -> [u32; 2] {
    let scale = (f64::from(within[0]) / f64::from(width)).min(f64::from(within[1]) / f64::from(height)).min(1.0);
    let side = |side: u32, most: u32| ((f64::from(side) * scale + 0.5) as u32).clamp(1, most);
    [side(width, within[0]), side(height, within[1])]
}

fn decode(byte: u8) -> f32 {
    srgb_decode(f32::from(byte) / 255.0)
}

struct Canvas {
    width: u32,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    fn put(&mut self, picture: &[[u8; 3]], width: u32, [x, y]: [u32; 2]) {
        for (row, colors) in picture.chunks_exact(width as usize).enumerate() {
            let start = (y as usize + row) * self.width as usize + x as usize;
            self.pixels[start..start + colors.len()].copy_from_slice(colors);
        }
    }

    /// Writes a line whose letters stand on `base`; what is too long for the room ends in an ellipsis.
    fn write(&mut self, label: &str, letters: u32, room: u32, [x, base]: [u32; 2]) {
        let size = f64::from(letters);
        let line = text::shortened(label, f64::from(room) / size);
        let coverage = text::coverage(&font::outline(&line), size);
        for (row, values) in coverage.rows() {
            let y = i64::from(base) + row;
            let Some(y) = usize::try_from(y).ok().filter(|y| *y < self.pixels.len() / self.width as usize) else {
                continue;
            };
            let from = y * self.width as usize + x as usize;
            let end = (from + values.len()).min((y + 1) * self.width as usize);
            for (pixel, share) in self.pixels[from..end].iter_mut().zip(values) {
                // In linear light, so that thin strokes are as bright as they should be.
                *pixel = std::array::from_fn(|i| {
                    let (paper, ink) = (decode(pixel[i]), decode(INK[i]));
                    srgb_byte(paper + (ink - paper) * share)
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::film::FramePixels;

    fn plain(width: u32, height: u32, color: [u8; 4]) -> FilmFrame {
        let pixels = FramePixels::Bytes(vec![color; (width * height) as usize]);
        FilmFrame { width, height, pixels }
    }

    #[test]
    fn layouts_fill_a_screen_and_never_enlarge() {
        let layout = SheetLayout::new(12, [640, 360], None, None, true).unwrap();
        assert_eq!((layout.columns, layout.rows), (4, 3));
        let [width, height] = layout.size();
        assert!((1800..=1920).contains(&width) && height < width, "{width}x{height}");
        let small = SheetLayout::new(4, [32, 18], Some(9), None, false).unwrap();
        assert_eq!((small.columns, small.tile, small.letters), (4, [32, 18], 0));
        let asked = SheetLayout::new(5, [640, 360], Some(2), Some(100), true).unwrap();
        assert_eq!((asked.rows, asked.tile), (3, [100, 56]));
        assert!(SheetLayout::new(10_000, [640, 360], Some(1), Some(640), true).unwrap_err().contains("limit"));
        assert_eq!(SheetLayout::new(1, [1, 5000], None, None, true).unwrap().columns, 1);
    }

    #[test]
    fn pictures_lie_in_their_places_and_labels_below_them() {
        let layout = SheetLayout::new(3, [40, 20], Some(2), None, true).unwrap();
        let colors = [[250, 0, 0, 255], [0, 250, 0, 255], [0, 0, 250, 255]];
        let tiles: Vec<SheetTile> =
            colors.into_iter().map(|color| SheetTile { picture: plain(40, 20, color), label: "Hg".into() }).collect();
        let [width, height] = layout.size();
        let bytes = draw_sheet(&layout, &tiles);
        assert_eq!(bytes.len() as u64, 3 * width * height);
        let at = |x: u32, y: u32| {
            let i = 3 * (y as usize * width as usize + x as usize);
            [bytes[i], bytes[i + 1], bytes[i + 2]]
        };
        for (index, [r, g, b, _]) in (0..3).zip(colors) {
            let [x, y] = layout.corner(index);
            assert_eq!(at(x, y), [r, g, b]);
            assert_eq!(at(x + 39, y + 19), [r, g, b]);
            assert_eq!(at(x.saturating_sub(1), y), PAPER);
            let below = (y + 20..y + 20 + layout.line()).flat_map(|y| (x..x + 40).map(move |x| (x, y)));
            let inked = below.filter(|(x, y)| at(*x, *y)[0] > 180).count();
            assert!((15..150).contains(&inked), "{inked}");
        }
        // The fourth place stays empty.
        let [x, y] = layout.corner(3);
        assert_eq!(at(x + 5, y + 5), PAPER);
        assert_eq!(bytes, draw_sheet(&layout, &tiles));
    }

    #[test]
    fn a_picture_of_another_shape_is_fitted_and_alpha_shows_the_paper() {
        assert_eq!(fitted([100, 50], [40, 40]), [40, 20]);
        assert_eq!(fitted([10, 5], [40, 40]), [10, 5]);
        assert_eq!(fitted([1, 5000], [40, 20]), [1, 20]);
        let layout = SheetLayout::new(1, [40, 20], None, None, false).unwrap();
        let tiles = [SheetTile { picture: plain(20, 20, [255, 255, 255, 0]), label: String::new() }];
        assert!(draw_sheet(&layout, &tiles).as_chunks::<3>().0.iter().all(|pixel| *pixel == PAPER));
    }
}
