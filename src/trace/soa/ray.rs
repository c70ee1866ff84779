//! Rays, and what they met: one by one, eight side by side, and many column by column.

#![allow(
    clippy::needless_range_loop,
    reason = "iterators of arrays may be left out of the function with AVX2: see Kernel"
)]

use glam::Vec3;

use super::columns::contiguous;
use super::work_item::work_item;
use crate::trace::simd::{LANES, Wide, lanes};

work_item! {
    /// A half-line in world space.
    #[derive(Clone, Copy, Debug, PartialEq)]
    Ray, RayLanes, Rays {
        /// Where it starts.
        origin: Vec3,
        /// Unit length.
        direction: Vec3,
        /// Hits at or beyond this distance do not count.
        t_max: f32,
    }
}

impl Ray {
    /// An endless ray.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Ray { origin, direction, t_max: f32::INFINITY }
    }
}

impl Rays {
    /// All rays in order.
    pub fn iter(&self) -> impl Iterator<Item = Ray> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }
}

impl FromIterator<Ray> for Rays {
    fn from_iter<I: IntoIterator<Item = Ray>>(rays: I) -> Self {
        let mut all = Rays::default();
        rays.into_iter().for_each(|ray| all.push(ray));
        all
    }
}

work_item! {
    /// The nearest intersection.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    Hit, HitLanes, HitColumns {
        /// Distance along the ray, above 0.
        t: f32,
        /// The first of two parameters that the primitive's kind gives a meaning to (barycentrics of a triangle).
        u: f32,
        /// The second one.
        v: f32,
        /// Number of the primitive in its [`crate::trace::primitive::Geometry`].
        primitive: u32,
        /// Triangle within an instance.
        element: u32,
    }
}

/// What each of many rays met, if anything.
#[derive(Clone, Debug, Default)]
pub struct Hits(HitColumns);

/// The primitive of a ray that met nothing. As a number of a column it is NaN.
const NOTHING: u32 = u32::MAX;

impl Hits {
    /// Makes room for those of so many rays.
    pub fn reset(&mut self, rays: usize) {
        self.0.set_len(rays);
    }

    /// What the ray of this number met.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Option<Hit> {
        Some(self.0.get(i)).filter(|hit| hit.primitive != NOTHING)
    }

    /// How many met something.
    pub fn found_count(&self) -> u64 {
        self.iter().flatten().count() as u64
    }

    /// The eight from number `i` on.
    #[inline(always)]
    pub fn lanes<L: Wide>(&self, i: usize) -> HitLanes<L> {
        self.0.lanes(i)
    }

    /// Those of rays anywhere.
    #[inline(always)]
    pub fn gather<L: Wide>(&self, numbers: &[usize; LANES]) -> HitLanes<L> {
        self.0.gather(numbers)
    }

    /// The primitive that a ray met, if it met any.
    #[inline(always)]
    pub fn primitive(&self, i: usize) -> u32 {
        self.0.get(i).primitive
    }

    /// Which of the eight rays from number `i` on met something.
    #[inline(always)]
    pub fn found<L: Wide>(&self, i: usize) -> L::Mask {
        let primitive: L = self.0.primitive(i);
        L::not(primitive.ne(primitive))
    }

    /// Distances of the same.
    #[inline(always)]
    pub fn distances<L: Wide>(&self, i: usize) -> L {
        self.0.t(i)
    }

    /// What each ray met, in order.
    pub fn iter(&self) -> impl Iterator<Item = Option<Hit>> + '_ {
        (0..self.0.len()).map(|i| self.get(i))
    }

    /// Says what the ray of this number met.
    #[inline(always)]
    pub fn set(&mut self, i: usize, hit: Option<Hit>) {
        self.0.set(i, hit.unwrap_or(Hit { primitive: NOTHING, ..Hit::default() }));
    }

    /// Adds what one more ray met.
    pub fn push(&mut self, hit: Option<Hit>) {
        self.0.set_len(self.0.len() + 1);
        self.set(self.0.len() - 1, hit);
    }

    /// Those of eight rays at most, whose numbers grow; the ones with a bit met something.
    #[inline(always)]
    pub fn set_lanes<L: Wide>(&mut self, numbers: &[u32], found: u32, hits: HitLanes<L>) {
        let primitive = L::select(L::mask(found), hits.primitive, L::splat(f32::from_bits(NOTHING)));
        let hits = HitLanes { primitive, ..hits };
        if contiguous(numbers) {
            self.0.store(numbers[0] as usize, &hits);
            return;
        }
        let (t, u, v) = (hits.t.store(), hits.u.store(), hits.v.store());
        let (primitive, element) = (hits.primitive.store(), hits.element.store());
        for (lane, i) in lanes((1 << numbers.len()) - 1).zip(numbers) {
            let (primitive, element) = (primitive[lane].to_bits(), element[lane].to_bits());
            self.0.set(*i as usize, Hit { t: t[lane], u: u[lane], v: v[lane], primitive, element });
        }
    }
}
