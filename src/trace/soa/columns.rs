//! Rays, and what they met, column by column: lanes load eight in a row at once, and are put down at once.

#![allow(
    clippy::needless_range_loop,
    reason = "iterators of arrays may be left out of the function with AVX2: see Kernel"
)]

use crate::trace::simd::{LANES, Lanes};

/// Rows of `N` numbers. Columns are longer than there are rows by a group of lanes at least: any eight that begin among
/// the rows can be loaded and put down, whatever the last of them hold.
#[derive(Clone, Debug)]
pub struct Columns<const N: usize> {
    columns: [Vec<f32>; N],
    len: usize,
}

impl<const N: usize> Default for Columns<N> {
    fn default() -> Self {
        Columns { columns: std::array::from_fn(|_| vec![0.0; LANES]), len: 0 }
    }
}

impl<const N: usize> Columns<N> {
    /// Number of rows.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no rows.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Forgets all rows; memory stays.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// This many rows, whatever they hold.
    pub fn set_len(&mut self, len: usize) {
        self.len = len;
        self.grow();
    }

    /// Lengthens the columns where fewer than eight numbers are left behind the rows.
    #[inline(always)]
    fn grow(&mut self) {
        if self.columns[0].len() < self.len + LANES {
            self.lengthen();
        }
    }

    #[cold]
    fn lengthen(&mut self) {
        let len = (2 * self.len).max(64) + LANES;
        self.columns.iter_mut().for_each(|column| column.resize(len, 0.0));
    }

    /// Adds a row.
    #[inline(always)]
    pub fn push(&mut self, row: [f32; N]) {
        self.set(self.len, row);
        self.len += 1;
        self.grow();
    }

    /// Replaces a row.
    #[inline(always)]
    pub fn set(&mut self, i: usize, row: [f32; N]) {
        for c in 0..N {
            self.columns[c][i] = row[c];
        }
    }

    /// A row.
    #[inline(always)]
    pub fn row(&self, i: usize) -> [f32; N] {
        let mut row = [0.0; N];
        for c in 0..N {
            row[c] = self.columns[c][i];
        }
        row
    }

    /// One number of a row.
    #[inline(always)]
    pub fn number(&self, column: usize, i: usize) -> f32 {
        self.columns[column][i]
    }

    /// Eight of a column from row `i` on.
    #[inline(always)]
    pub fn eight<L: Lanes>(&self, column: usize, i: usize) -> L {
        L::load(eight(&self.columns[column][i..]))
    }

    /// The eight rows from `i` on.
    #[inline(always)]
    pub fn rows<L: Lanes>(&self, i: usize) -> [L; N] {
        let mut rows = [L::splat(0.0); N];
        for c in 0..N {
            rows[c] = self.eight(c, i);
        }
        rows
    }

    /// Rows anywhere.
    #[inline(always)]
    pub fn gathered<L: Lanes>(&self, numbers: &[usize; LANES]) -> [L; N] {
        let mut rows = [L::splat(0.0); N];
        for c in 0..N {
            let column = &self.columns[c][..];
            let mut eight = [0.0; LANES];
            for lane in 0..LANES {
                eight[lane] = column[numbers[lane]];
            }
            rows[c] = L::load(&eight);
        }
        rows
    }

    /// Overwrites the eight rows from `i` on.
    #[inline(always)]
    pub fn store<L: Lanes>(&mut self, i: usize, rows: &[L; N]) {
        for c in 0..N {
            *eight_mut(&mut self.columns[c][i..]) = rows[c].store();
        }
    }

    /// Adds the lanes that have a bit as rows, in their order.
    #[inline(always)]
    pub fn compress_store<L: Lanes>(&mut self, which: u32, rows: &[L; N]) {
        for c in 0..N {
            if L::COUNT == 1 {
                self.columns[c][self.len] = rows[c].store()[0];
            } else {
                *eight_mut(&mut self.columns[c][self.len..]) = rows[c].compress(which).store();
            }
        }
        self.len += which.count_ones() as usize;
        self.grow();
    }
}

/// The first eight of a slice that has so many.
#[inline(always)]
pub fn eight(of: &[f32]) -> &[f32; LANES] {
    of.first_chunk().expect("columns are longer than their rows by eight")
}

/// The same, to be overwritten: `copy_from_slice` would be a call.
#[inline(always)]
fn eight_mut(of: &mut [f32]) -> &mut [f32; LANES] {
    of.first_chunk_mut().expect("columns are longer than their rows by eight")
}

/// Whether these numbers of rows, which grow, are eight in a row.
#[inline(always)]
pub fn contiguous(numbers: &[u32]) -> bool {
    numbers.len() == LANES && numbers[LANES - 1] - numbers[0] == LANES as u32 - 1
}
