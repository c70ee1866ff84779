//! Many rays, column by column.

#![allow(
    clippy::needless_range_loop,
    reason = "iterators of arrays may be left out of the function with AVX2: see Kernel"
)]

use glam::Vec3;

use super::columns::Columns;
use super::ray::Ray;
use crate::trace::simd::{LANES, V3, Wide};

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
    pub fn compress_store<L: Wide>(&mut self, which: u32, origin: V3<L>, direction: V3<L>, t_max: L) {
        let (o, d) = (origin, direction);
        self.0.compress_store(which, &[o.x, o.y, o.z, d.x, d.y, d.z, t_max]);
    }
}

impl FromIterator<Ray> for Rays {
    fn from_iter<I: IntoIterator<Item = Ray>>(rays: I) -> Self {
        let mut all = Rays::default();
        rays.into_iter().for_each(|ray| all.push(ray));
        all
    }
}
