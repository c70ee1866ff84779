//! Dithering that stays where it is: a pixel whose colour does not change from frame to frame does not change.
//!
//! For each colour a list of palette colours is made whose mean is near it, each one chosen to make good the error of
//! those before it (Knoll's pattern dithering). Which of them a pixel shows depends on its place alone. Error diffusion
//! would carry every change through the rest of the picture, which then crawls.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::nearest::Nearest;

/// Colours of a list: so many steps there are between two colours of the palette.
const LEVELS: usize = 16;
/// Colours that are remembered; past this all are forgotten, which costs time alone.
const REMEMBERED: usize = 1 << 20;

/// Makes pixels to places in a palette.
pub struct Ditherer {
    nearest: Nearest,
    /// For each colour the places in the palette, from dark to bright.
    lists: FxHashMap<[u8; 3], [u8; LEVELS]>,
    dithers: bool,
}

impl Ditherer {
    /// Without `dithers` each pixel gets the nearest colour.
    pub fn new(palette: &[[u8; 3]], dithers: bool) -> Self {
        Ditherer { nearest: Nearest::new(palette), lists: FxHashMap::default(), dithers }
    }

    /// Sees to it that these colours are known; must come before [`Self::index`] of them.
    pub fn learn(&mut self, colors: impl Iterator<Item = [u8; 3]>) {
        let mut new: Vec<[u8; 3]> = colors.filter(|color| !self.lists.contains_key(color)).collect();
        new.sort_unstable();
        new.dedup();
        if self.lists.len() + new.len() > REMEMBERED {
            self.lists.clear();
        }
        let list = |color: &[u8; 3]| (*color, list_of(*color, &self.nearest, self.dithers));
        let lists: Vec<_> = new.par_iter().map(list).collect();
        self.lists.extend(lists);
    }

    /// What the pixel at `x`, `y` shows for a colour, as a place in the palette.
    pub fn index(&self, color: [u8; 3], x: u32, y: u32) -> u8 {
        self.lists.get(&color).map_or(0, |list| list[threshold(x, y)])
    }
}

/// Palette colours whose mean is near a colour.
fn list_of(color: [u8; 3], nearest: &Nearest, dithers: bool) -> [u8; LEVELS] {
    let wanted = color.map(i32::from);
    let mut list = [0u8; LEVELS];
    if !dithers {
        list.fill(nearest.index(wanted) as u8);
        return list;
    }
    let mut error = [0; 3];
    for place in &mut list {
        let index = nearest.index(std::array::from_fn(|i| wanted[i] + error[i]));
        *place = index as u8;
        let shown = nearest.color(index);
        for i in 0..3 {
            // Bounded, so that a colour outside of the palette's reach does not run up a debt.
            error[i] = (error[i] + wanted[i] - shown[i]).clamp(-255, 255);
        }
    }
    let brightness = |index: &u8| {
        let [r, g, b] = nearest.color(usize::from(*index));
        (2126 * r + 7152 * g + 722 * b, *index)
    };
    list.sort_unstable_by_key(brightness);
    list
}

/// A number below [`LEVELS`] for a pixel, spread evenly over any patch: multiples of the two numbers by which the
/// plastic ratio fills a square (Roberts 2018), as parts of 2^32.
fn threshold(x: u32, y: u32) -> usize {
    let turned = x.wrapping_mul(3_242_174_889).wrapping_add(y.wrapping_mul(2_447_445_414));
    (turned >> 28) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_have_the_mean_of_their_colour() {
        let palette = [[0, 0, 0], [255, 255, 255], [255, 0, 0], [0, 0, 255]];
        let mut ditherer = Ditherer::new(&palette, true);
        for color in [[0, 0, 0], [128, 128, 128], [64, 64, 64], [200, 60, 60], [255, 255, 255]] {
            ditherer.learn(std::iter::once(color));
            let mut sum = [0.0; 3];
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let shown = palette[usize::from(ditherer.index(color, x, y))];
                (0..3).for_each(|i| sum[i] += f64::from(shown[i]) / 4096.0);
            }
            for i in 0..3 {
                assert!((sum[i] - f64::from(color[i])).abs() < 9.0, "{color:?}: {sum:?}");
            }
        }
    }

    #[test]
    fn every_level_occurs_equally_often() {
        let mut counts = [0; LEVELS];
        (0..128).flat_map(|y| (0..128).map(move |x| (x, y))).for_each(|(x, y)| counts[threshold(x, y)] += 1);
        assert!(counts.iter().all(|n| (1004..=1044).contains(n)), "{counts:?}");
    }

    #[test]
    fn colours_of_the_palette_stay_and_nothing_is_spread_where_nobody_asks() {
        let palette = [[10, 20, 30], [200, 10, 10], [90, 90, 90]];
        for dithers in [true, false] {
            let mut ditherer = Ditherer::new(&palette, dithers);
            ditherer.learn(palette.iter().copied());
            for (i, color) in palette.iter().enumerate() {
                assert!((0..99).all(|x| usize::from(ditherer.index(*color, x, 3 * x)) == i));
            }
        }
        let mut plain = Ditherer::new(&palette, false);
        plain.learn(std::iter::once([80, 80, 80]));
        assert!((0..99).all(|x| plain.index([80, 80, 80], x, x) == 2));
    }
}
