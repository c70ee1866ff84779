//! A palette of at most 256 colours for pictures that have more.
//!
//! Colours are counted in cells of a grid; boxes of cells are cut in two where that lowers the squared error most (Wu
//! 1991), and a few rounds of k-means settle the result. Nothing is random, and sums are made in one order.

use rustc_hash::FxHashSet;

use super::nearest::{Nearest, distance};

/// Bits of a channel that cells are numbered by.
const CELL_BITS: u32 = 6;
const CELLS: usize = 1 << (3 * CELL_BITS);
/// Rounds of k-means: a fourth one lowers the error by less than a hundredth.
const ROUNDS: usize = 3;

/// The colours of one or more pictures.
pub struct ColorCounter {
    /// Count, and sums of red, green and blue.
    cells: Vec<[u64; 4]>,
    /// The colours themselves, while they fit in a palette.
    few: Option<FxHashSet<[u8; 3]>>,
    most: usize,
}

/// The colours of a cell: their mean and number.
#[derive(Clone, Copy)]
pub struct CellMean {
    pub color: [f32; 3],
    pub count: f32,
}

impl ColorCounter {
    /// For palettes of at most `most` colours.
    pub fn new(most: usize) -> Self {
        ColorCounter { cells: vec![[0; 4]; CELLS], few: Some(FxHashSet::default()), most }
    }

    pub fn add(&mut self, colors: impl Iterator<Item = [u8; 3]>) {
        let mut last = None;
        for color in colors {
            if let Some(few) = &mut self.few
                && last != Some(color)
            {
                few.insert(color);
                last = Some(color);
                if few.len() > self.most {
                    self.few = None;
                }
            }
            let index = color.iter().fold(0, |index, x| index << CELL_BITS | usize::from(x >> (8 - CELL_BITS)));
            let cell = &mut self.cells[index];
            cell[0] += 1;
            for (sum, x) in cell[1..].iter_mut().zip(color) {
                *sum += u64::from(x);
            }
        }
    }

    /// The means of the cells that have colours.
    pub fn means(&self) -> Vec<CellMean> {
        let filled = self.cells.iter().filter(|cell| cell[0] > 0);
        let mean = |[count, r, g, b]: &[u64; 4]| CellMean {
            color: [r, g, b].map(|sum| *sum as f32 / *count as f32),
            count: *count as f32,
        };
        filled.map(mean).collect()
    }

    /// The colours themselves if they are few enough, else colours near all of them; never none.
    pub fn palette(&self) -> Vec<[u8; 3]> {
        if let Some(few) = &self.few {
            let mut colors: Vec<[u8; 3]> = few.iter().copied().collect();
            colors.sort_unstable();
            if colors.is_empty() {
                colors.push([0; 3]);
            }
            return colors;
        }
        let mut means = self.means();
        let mut palette = cut(&mut means, self.most);
        for _ in 0..ROUNDS {
            palette = settled(&means, &palette);
        }
        palette.sort_unstable();
        palette.dedup();
        palette
    }
}

/// The mean squared error, by the measure that colours are chosen by, of showing colours by the nearest of a palette.
pub fn mean_error(means: &[CellMean], palette: &[[u8; 3]]) -> f64 {
    let nearest = Nearest::new(palette);
    let (mut sum, mut all) = (0.0, 0.0);
    for mean in means {
        let color = mean.color.map(|x| (x + 0.5) as i32);
        sum += f64::from(mean.count) * f64::from(distance(color, palette[nearest.index(color)].map(i32::from)));
        all += f64::from(mean.count);
    }
    if all > 0.0 { sum / all } else { 0.0 }
}

/// Cells `from..to` of the list, their mean colour, and the best cut.
struct ColorBox {
    from: usize,
    to: usize,
    /// What the cut lowers the error by.
    gain: f64,
    axis: usize,
    at: usize,
}

/// Weights of red, green and blue in the measure, as `distance` has them.
const WEIGHTS: [f64; 3] = [2.0, 4.0, 3.0];

fn cut(means: &mut [CellMean], most: usize) -> Vec<[u8; 3]> {
    let mut boxes = vec![best_cut(means, 0, means.len())];
    while boxes.len() < most {
        let best = boxes.iter().enumerate().max_by(|(_, a), (_, b)| a.gain.total_cmp(&b.gain)).map(|(i, _)| i);
        let Some(best) = best.filter(|best| boxes[*best].gain > 0.0) else { break };
        let ColorBox { from, to, axis, at, .. } = boxes.swap_remove(best);
        sort_along(&mut means[from..to], axis);
        boxes.push(best_cut(means, from, at));
        boxes.push(best_cut(means, at, to));
    }
    boxes.iter().map(|b| mean_color(&means[b.from..b.to])).collect()
}

/// Along an axis, and among equal ones by the others, so that the order is always the same.
fn sort_along(cells: &mut [CellMean], axis: usize) {
    let key = |cell: &CellMean| [0, 1, 2].map(|i| cell.color[(axis + i) % 3]);
    cells.sort_unstable_by(|a, b| {
        let pairs = key(a).into_iter().zip(key(b));
        pairs.fold(std::cmp::Ordering::Equal, |order, (x, y)| order.then(x.total_cmp(&y)))
    });
}

/// The cut of a box that leaves the least squared error in its two halves.
fn best_cut(means: &mut [CellMean], from: usize, to: usize) -> ColorBox {
    let mut best = ColorBox { from, to, gain: 0.0, axis: 0, at: from };
    let cells = &mut means[from..to];
    for axis in 0..3 {
        sort_along(cells, axis);
        let (all, all_count) = sums(cells);
        let (mut left, mut count) = ([0.0; 3], 0.0);
        for (i, cell) in cells.iter().enumerate().take(cells.len().saturating_sub(1)) {
            for (sum, x) in left.iter_mut().zip(cell.color) {
                *sum += f64::from(x) * f64::from(cell.count);
            }
            count += f64::from(cell.count);
            // The error falls by how far the means of the halves are apart.
            let gain = (0..3).fold(0.0, |gain, i| {
                let apart = left[i] / count - (all[i] - left[i]) / (all_count - count);
                gain + WEIGHTS[i] * apart * apart
            }) * count
                * (all_count - count)
                / all_count;
            if gain > best.gain {
                best = ColorBox { gain, axis, at: from + i + 1, ..best };
            }
        }
    }
    best
}

fn sums(cells: &[CellMean]) -> ([f64; 3], f64) {
    cells.iter().fold(([0.0; 3], 0.0), |(mut sum, count), cell| {
        for (sum, x) in sum.iter_mut().zip(cell.color) {
            *sum += f64::from(x) * f64::from(cell.count);
        }
        (sum, count + f64::from(cell.count))
    })
}

fn mean_color(cells: &[CellMean]) -> [u8; 3] {
    let (sum, count) = sums(cells);
    sum.map(|x| (x / count.max(1.0) + 0.5) as u8)
}

/// Each colour of the palette moved to the mean of what it stands for.
fn settled(means: &[CellMean], palette: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let nearest = Nearest::new(palette);
    let mut moved = vec![([0.0f64; 3], 0.0f64); palette.len()];
    for mean in means {
        let (sum, count) = &mut moved[nearest.index(mean.color.map(|x| (x + 0.5) as i32))];
        for (sum, x) in sum.iter_mut().zip(mean.color) {
            *sum += f64::from(x) * f64::from(mean.count);
        }
        *count += f64::from(mean.count);
    }
    let place = |((sum, count), before): (&([f64; 3], f64), &[u8; 3])| match *count > 0.0 {
        true => sum.map(|x| (x / count + 0.5) as u8),
        false => *before,
    };
    moved.iter().zip(palette).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_kept_as_they_are() {
        let colors: Vec<[u8; 3]> = (0..=255).map(|i| [i, 255 - i, 7]).collect();
        let mut counter = ColorCounter::new(256);
        counter.add(colors.iter().rev().copied());
        counter.add(colors.iter().copied());
        let palette = counter.palette();
        assert_eq!(palette, colors);
        // Colours of one cell are measured by their mean.
        assert!(mean_error(&counter.means(), &palette) < 10.0);
        assert_eq!(ColorCounter::new(255).palette(), [[0; 3]]);
    }

    #[test]
    fn many_colours_are_near_a_palette_that_has_no_more_than_it_may() {
        // A ramp through the whole cube and a patch of one colour.
        let ramp = (0..=255u8).flat_map(|i| (0..=255u8).map(move |j| [i, j, i.wrapping_add(j) / 2]));
        let mut counter = ColorCounter::new(255);
        counter.add(ramp.clone());
        counter.add(std::iter::repeat_n([200, 30, 40], 60_000));
        let palette = counter.palette();
        assert!((240..=255).contains(&palette.len()), "{}", palette.len());
        // 256 cells of 16 x 16 codes: (256 / 12) x 4 + (256 / 12) x 2 and some for blue.
        let error = mean_error(&counter.means(), &palette);
        assert!(error < 200.0, "{error}");
        let red = palette.iter().map(|c| distance([200, 30, 40], c.map(i32::from))).min().unwrap();
        assert!(red < 20, "{red}");
        assert_eq!(palette, counter.palette());
    }
}
