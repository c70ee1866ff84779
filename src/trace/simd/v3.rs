//! Vectors of three coordinates, one or eight side by side.

use std::ops::{Add, Mul, Neg, Sub};

use glam::Vec3;

use super::lanes::{LANES, Lanes};

/// Three coordinates.
#[derive(Clone, Copy, Debug)]
pub struct V3<L> {
    /// First coordinates.
    pub x: L,
    /// Second coordinates.
    pub y: L,
    /// Third coordinates.
    pub z: L,
}

impl<L: Lanes> V3<L> {
    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        V3 { x: L::splat(v.x), y: L::splat(v.y), z: L::splat(v.z) }
    }

    /// In the order of operations of `glam`.
    #[inline(always)]
    pub fn dot(self, o: Self) -> L {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// In the order of operations of `glam`, as all that follows.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        V3 { x: self.y * o.z - o.y * self.z, y: self.z * o.x - o.z * self.x, z: self.x * o.y - o.x * self.y }
    }

    /// Vectors of length 1.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self.scale(L::splat(1.0) / self.dot(self).sqrt())
    }

    /// The other vector where this one has no direction.
    #[inline(always)]
    pub fn normalize_or(self, other: Self) -> Self {
        let inverse = L::splat(1.0) / self.dot(self).sqrt();
        let good = L::and(L::splat(0.0).lt(inverse), inverse.lt(L::splat(f32::INFINITY)));
        V3::select(good, self.scale(inverse), other)
    }

    /// The first where the mask is set, the second elsewhere.
    #[inline(always)]
    pub fn select(mask: L::Mask, yes: Self, no: Self) -> Self {
        V3 { x: L::select(mask, yes.x, no.x), y: L::select(mask, yes.y, no.y), z: L::select(mask, yes.z, no.z) }
    }

    /// Each times a number of its own.
    #[inline(always)]
    pub fn scale(self, by: L) -> Self {
        V3 { x: self.x * by, y: self.y * by, z: self.z * by }
    }

    /// The lesser of each coordinate.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        V3 { x: self.x.min(o.x), y: self.y.min(o.y), z: self.z.min(o.z) }
    }

    /// The greater of each coordinate.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        V3 { x: self.x.max(o.x), y: self.y.max(o.y), z: self.z.max(o.z) }
    }

    /// Magnitudes of each coordinate.
    #[inline(always)]
    pub fn abs(self) -> Self {
        V3 { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }

    /// The greatest coordinate of each.
    #[inline(always)]
    pub fn max_element(self) -> L {
        self.x.max(self.y).max(self.z)
    }

    /// The least coordinate of each.
    #[inline(always)]
    pub fn min_element(self) -> L {
        self.x.min(self.y).min(self.z)
    }
}

impl<L: Lanes> V3<L> {
    /// Columns, lane by lane.
    #[inline(always)]
    pub fn load([x, y, z]: &[[f32; LANES]; 3]) -> Self {
        V3 { x: L::load(x), y: L::load(y), z: L::load(z) }
    }

    /// Column by column.
    #[inline(always)]
    pub fn store(self) -> [[f32; LANES]; 3] {
        [self.x.store(), self.y.store(), self.z.store()]
    }
}

impl From<Vec3> for V3<f32> {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        V3 { x: v.x, y: v.y, z: v.z }
    }
}

impl From<V3<f32>> for Vec3 {
    #[inline(always)]
    fn from(v: V3<f32>) -> Self {
        Vec3::new(v.x, v.y, v.z)
    }
}

impl<L: Lanes> Add for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        V3 { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<L: Lanes> Neg for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        V3 { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<L: Lanes> Sub for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        V3 { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl<L: Lanes> Mul for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        V3 { x: self.x * o.x, y: self.y * o.y, z: self.z * o.z }
    }
}
