//! What many rays met, column by column.

#![allow(
    clippy::needless_range_loop,
    reason = "iterators of arrays may be left out of the function with AVX2: see Kernel"
)]

use super::columns::{Columns, contiguous};
use super::ray::Hit;
use crate::trace::simd::{LANES, Wide, lanes};

/// What each of many rays met: distance, parameters, and the bits of primitive and element.
#[derive(Clone, Debug, Default)]
pub struct Hits(Columns<5>);

/// The primitive of a ray that met nothing. As a number of a column it is NaN.
const NOTHING: u32 = u32::MAX;

impl Hits {
    /// Makes room for those of so many rays.
    pub fn reset(&mut self, rays: usize) {
        self.0.set_len(rays);
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> Option<Hit> {
        let [t, u, v, primitive, element] = self.0.row(i);
        let (primitive, element) = (primitive.to_bits(), element.to_bits());
        (primitive != NOTHING).then_some(Hit { t, primitive, element, u, v })
    }

    /// How many met something.
    pub fn found_count(&self) -> u64 {
        (0..self.0.len()).filter(|i| self.primitive(*i) != NOTHING).count() as u64
    }

    /// Distances, parameters, and bits of primitives and elements of eight from number `i` on.
    #[inline(always)]
    pub fn rows<L: Wide>(&self, i: usize) -> [L; 5] {
        self.0.rows(i)
    }

    /// The same of rays anywhere.
    #[inline(always)]
    pub fn gathered<L: Wide>(&self, numbers: &[usize; LANES]) -> [L; 5] {
        self.0.gathered(numbers)
    }

    /// The primitive that a ray met, if it met any.
    #[inline(always)]
    pub fn primitive(&self, i: usize) -> u32 {
        self.0.number(3, i).to_bits()
    }

    /// Which of the eight rays from number `i` on met something.
    #[inline(always)]
    pub fn found<L: Wide>(&self, i: usize) -> L::Mask {
        let primitive: L = self.0.eight(3, i);
        L::not(primitive.ne(primitive))
    }

    /// Distances of the same.
    #[inline(always)]
    pub fn distances<L: Wide>(&self, i: usize) -> L {
        self.0.eight(0, i)
    }

    pub fn iter(&self) -> impl Iterator<Item = Option<Hit>> + '_ {
        (0..self.0.len()).map(|i| self.get(i))
    }

    #[inline(always)]
    pub fn set(&mut self, i: usize, hit: Option<Hit>) {
        let hit = hit.unwrap_or(Hit { primitive: NOTHING, ..Hit::default() });
        self.0.set(i, [hit.t, hit.u, hit.v, f32::from_bits(hit.primitive), f32::from_bits(hit.element)]);
    }

    /// Those of eight rays, of which the ones with a bit met something: t, u, v and bits of primitive and element.
    #[inline(always)]
    pub fn set_eight<L: Wide>(&mut self, numbers: &[u32], found: u32, [t, u, v, primitive, element]: [L; 5]) {
        let primitive = L::select(L::mask(found), primitive, L::splat(f32::from_bits(NOTHING)));
        let rows = [t, u, v, primitive, element];
        if contiguous(numbers) {
            self.0.store(numbers[0] as usize, &rows);
            return;
        }
        let mut columns = [[0.0; LANES]; 5];
        for c in 0..5 {
            columns[c] = rows[c].store();
        }
        let [t, u, v, primitive, element] = &columns;
        for (lane, i) in lanes((1 << numbers.len()) - 1).zip(numbers) {
            self.0.set(*i as usize, [t[lane], u[lane], v[lane], primitive[lane], element[lane]]);
        }
    }
}
