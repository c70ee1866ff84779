//! Rays, and what they met, column by column: lanes load eight in a row at once, and are put down at once.

#![allow(
    clippy::needless_range_loop,
    reason = "iterators of arrays may be left out of the function with AVX2: see Kernel"
)]

use glam::Vec3;

use super::simd::{LANES, V3, Wide, lanes};
use super::{Hit, Ray};

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
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

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

    #[inline(always)]
    pub fn push(&mut self, row: [f32; N]) {
        self.set(self.len, row);
        self.len += 1;
        self.grow();
    }

    #[inline(always)]
    pub fn set(&mut self, i: usize, row: [f32; N]) {
        for c in 0..N {
            self.columns[c][i] = row[c];
        }
    }

    #[inline(always)]
    pub fn row(&self, i: usize) -> [f32; N] {
        let mut row = [0.0; N];
        for c in 0..N {
            row[c] = self.columns[c][i];
        }
        row
    }

    #[inline(always)]
    pub fn number(&self, column: usize, i: usize) -> f32 {
        self.columns[column][i]
    }

    /// Eight of a column from row `i` on.
    #[inline(always)]
    pub fn eight<L: Wide>(&self, column: usize, i: usize) -> L {
        L::load(eight(&self.columns[column][i..]))
    }

    /// The eight rows from `i` on.
    #[inline(always)]
    pub fn rows<L: Wide>(&self, i: usize) -> [L; N] {
        let mut rows = [L::splat(0.0); N];
        for c in 0..N {
            rows[c] = self.eight(c, i);
        }
        rows
    }

    /// Rows anywhere.
    #[inline(always)]
    pub fn gathered<L: Wide>(&self, numbers: &[usize; LANES]) -> [L; N] {
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
    pub fn store<L: Wide>(&mut self, i: usize, rows: &[L; N]) {
        for c in 0..N {
            *eight_mut(&mut self.columns[c][i..]) = rows[c].store();
        }
    }

    /// Adds the lanes that have a bit as rows, in their order.
    #[inline(always)]
    pub fn put<L: Wide>(&mut self, which: u32, rows: &[L; N]) {
        for c in 0..N {
            *eight_mut(&mut self.columns[c][self.len..]) = rows[c].packed(which).store();
        }
        self.len += which.count_ones() as usize;
        self.grow();
    }
}

/// The first eight of a slice that has so many.
#[inline(always)]
fn eight(of: &[f32]) -> &[f32; LANES] {
    of.first_chunk().expect("columns are longer than their rows by eight")
}

/// The same, to be overwritten: `copy_from_slice` would be a call.
#[inline(always)]
fn eight_mut(of: &mut [f32]) -> &mut [f32; LANES] {
    of.first_chunk_mut().expect("columns are longer than their rows by eight")
}

/// Many rays.
#[derive(Clone, Debug, Default)]
pub struct Rays(Columns<7>);

impl Rays {
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }

    #[inline(always)]
    pub fn push(&mut self, ray: Ray) {
        let (o, d) = (ray.origin, ray.direction);
        self.0.push([o.x, o.y, o.z, d.x, d.y, d.z, ray.t_max]);
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        let [ox, oy, oz, dx, dy, dz, t_max] = self.0.row(i);
        Ray { origin: Vec3::new(ox, oy, oz), direction: Vec3::new(dx, dy, dz), t_max }
    }

    pub fn iter(&self) -> impl Iterator<Item = Ray> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// Origins, directions and ends of rays anywhere.
    #[inline(always)]
    pub fn gathered<L: Wide>(&self, numbers: &[usize; LANES]) -> (V3<L>, V3<L>, L) {
        let [ox, oy, oz, dx, dy, dz, t_max] = self.0.gathered(numbers);
        (V3 { x: ox, y: oy, z: oz }, V3 { x: dx, y: dy, z: dz }, t_max)
    }

    /// Of the eight rays from number `i` on.
    #[inline(always)]
    pub fn origins<L: Wide>(&self, i: usize) -> V3<L> {
        V3 { x: self.0.eight(0, i), y: self.0.eight(1, i), z: self.0.eight(2, i) }
    }

    #[inline(always)]
    pub fn directions<L: Wide>(&self, i: usize) -> V3<L> {
        V3 { x: self.0.eight(3, i), y: self.0.eight(4, i), z: self.0.eight(5, i) }
    }

    #[inline(always)]
    pub fn ends<L: Wide>(&self, i: usize) -> L {
        self.0.eight(6, i)
    }

    /// Adds the rays of the lanes that have a bit.
    #[inline(always)]
    pub fn put<L: Wide>(&mut self, which: u32, origin: V3<L>, direction: V3<L>, t_max: L) {
        let (o, d) = (origin, direction);
        self.0.put(which, &[o.x, o.y, o.z, d.x, d.y, d.z, t_max]);
    }
}

impl FromIterator<Ray> for Rays {
    fn from_iter<I: IntoIterator<Item = Ray>>(rays: I) -> Self {
        let mut all = Rays::default();
        rays.into_iter().for_each(|ray| all.push(ray));
        all
    }
}

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
        if follow(numbers) {
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

/// Whether these numbers of rows, which grow, are eight in a row.
#[inline(always)]
pub fn follow(numbers: &[u32]) -> bool {
    numbers.len() == LANES && numbers[LANES - 1] - numbers[0] == LANES as u32 - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::simd::{Kernel, Width};

    struct Put<'a>(&'a mut Columns<2>, u32);

    impl Kernel for Put<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Wide>(self) {
            let numbers = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
            let first = L::load(&numbers);
            self.0.put(self.1, &[first, first + L::splat(10.0)]);
        }
    }

    #[test]
    fn lanes_that_have_a_bit_become_rows() {
        for width in Width::all() {
            let (mut columns, mut expected) = (Columns::default(), Vec::new());
            for which in 0..256 {
                width.run(Put(&mut columns, which));
                expected.extend(lanes(which).map(|lane| [lane as f32, lane as f32 + 10.0]));
                assert_eq!(columns.len(), expected.len());
            }
            assert!((0..expected.len()).all(|i| columns.row(i) == expected[i]), "{width:?}");
            columns.clear();
            columns.push([1.0, 2.0]);
            assert_eq!((columns.len(), columns.row(0)), (1, [1.0, 2.0]));
        }
    }

    struct Found<'a>(&'a mut Hits, &'a [u32], u32);

    impl Kernel for Found<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Wide>(self) {
            let t = L::load(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
            let bits = |x: u32| L::splat(f32::from_bits(x));
            self.0.set_eight(self.1, self.2, [t, t, t, bits(7), bits(9)]);
        }
    }

    #[test]
    fn hits_of_eight_rays_go_where_their_rays_are() {
        for width in Width::all() {
            let mut hits = Hits::default();
            hits.reset(20);
            (0..20).for_each(|i| hits.set(i, None));
            let (row, apart) = ([3, 4, 5, 6, 7, 8, 9, 10], [0, 12, 13, 19]);
            width.run(Found(&mut hits, &row, 0b1010_0001));
            width.run(Found(&mut hits, &apart, 0b1111_1010));
            let hit = |t: f32| Some(Hit { t, primitive: 7, element: 9, u: t, v: t });
            let met: Vec<_> = hits.iter().enumerate().filter_map(|(i, hit)| Some((i, hit?))).collect();
            let expected = [(3, hit(1.0)), (8, hit(6.0)), (10, hit(8.0)), (12, hit(2.0)), (19, hit(4.0))];
            assert_eq!(met, expected.map(|(i, hit)| (i, hit.unwrap())), "{width:?}");
        }
    }
}
