//! Arithmetic on one number or on eight side by side: the only room with processor instructions in it.
//!
//! The tests of [`super::shapes`] are written once over [`Lanes`] and run on a single `f32`, on two SSE2 registers, on
//! one AVX register or on plain arrays. Every lane does what the single number does, operation by operation, none of
//! them fused, so that all widths give the same bits. Which width runs is decided once, from what the processor says of
//! itself ([`Width::detect`]).

#[cfg(any(test, not(target_arch = "x86_64")))]
mod plain;
mod words;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::Vec3;

#[cfg(any(test, not(target_arch = "x86_64")))]
use plain::Plain;
pub use words::Words;
#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Sse2};

/// How many lanes of [`Wide`] types.
pub const LANES: usize = 8;

/// One `f32`, or several that go through the same operations.
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    type Mask: Copy;

    fn splat(x: f32) -> Self;
    /// `if self < other { self } else { other }`: the other where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: the other where either is NaN.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    /// False where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    fn lt(self, other: Self) -> Self::Mask;
    /// True where either is NaN.
    fn ne(self, other: Self) -> Self::Mask;
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn any(mask: Self::Mask) -> bool;
    fn not(mask: Self::Mask) -> Self::Mask;
    /// The least number above, as [`f32::next_up`].
    fn next_up(self) -> Self;

    /// The greatest number below, as [`f32::next_down`].
    #[inline(always)]
    fn next_down(self) -> Self {
        -(-self).next_up()
    }
}

/// Eight lanes.
pub trait Wide: Lanes {
    /// Eight whole numbers beside them.
    type Words: Words<Floats = Self>;

    fn load(from: &[f32; LANES]) -> Self;
    fn store(self) -> [f32; LANES];
    /// Lane i is bit i.
    fn bits(mask: Self::Mask) -> u32;
    /// The mask that has these bits.
    fn mask(bits: u32) -> Self::Mask;
    /// The lanes that have a bit, moved to the front; what comes after them is any lane's.
    #[inline(always)]
    fn packed(self, which: u32) -> Self {
        let (from, order) = (self.store(), &PACKED[which as usize & 255]);
        let mut to = [0.0; LANES];
        for (x, lane) in to.iter_mut().zip(order) {
            *x = from[usize::from(lane & 7)];
        }
        Self::load(&to)
    }
    /// The least lane; no lane is NaN.
    #[inline(always)]
    fn least(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.store();
        Lanes::min(Lanes::min(Lanes::min(a, b), Lanes::min(c, d)), Lanes::min(Lanes::min(e, f), Lanes::min(g, h)))
    }
    /// The greatest lane; no lane is NaN.
    #[inline(always)]
    fn greatest(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.store();
        Lanes::max(Lanes::max(Lanes::max(a, b), Lanes::max(c, d)), Lanes::max(Lanes::max(e, f), Lanes::max(g, h)))
    }
    /// `self * factor - less`, perhaps fused: only for what cannot reach a pixel.
    fn scale_sub(self, factor: Self, less: Self) -> Self;
}

/// Three coordinates.
#[derive(Clone, Copy, Debug)]
pub struct V3<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

impl<L: Lanes> V3<L> {
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

    #[inline(always)]
    pub fn normalize(self) -> Self {
        self.scale(L::splat(1.0) / self.dot(self).sqrt())
    }

    /// The other vector where this one has no direction.
    #[inline(always)]
    pub fn normalize_or(self, other: Self) -> Self {
        let inverse = L::splat(1.0) / self.dot(self).sqrt();
        let good = L::both(L::splat(0.0).lt(inverse), inverse.lt(L::splat(f32::INFINITY)));
        V3::select(good, self.scale(inverse), other)
    }

    #[inline(always)]
    pub fn select(mask: L::Mask, yes: Self, no: Self) -> Self {
        V3 { x: L::select(mask, yes.x, no.x), y: L::select(mask, yes.y, no.y), z: L::select(mask, yes.z, no.z) }
    }

    #[inline(always)]
    pub fn scale(self, by: L) -> Self {
        V3 { x: self.x * by, y: self.y * by, z: self.z * by }
    }

    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        V3 { x: self.x.min(o.x), y: self.y.min(o.y), z: self.z.min(o.z) }
    }

    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        V3 { x: self.x.max(o.x), y: self.y.max(o.y), z: self.z.max(o.z) }
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        V3 { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }

    #[inline(always)]
    pub fn max_element(self) -> L {
        self.x.max(self.y).max(self.z)
    }

    #[inline(always)]
    pub fn min_element(self) -> L {
        self.x.min(self.y).min(self.z)
    }
}

impl<L: Wide> V3<L> {
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

/// The vector of one lane of columns.
#[inline(always)]
pub fn lane([x, y, z]: &[[f32; LANES]; 3], i: usize) -> Vec3 {
    Vec3::new(x[i], y[i], z[i])
}

/// Lanes with these bits.
#[inline(always)]
pub fn bits_of<L: Wide>(words: &[u32; LANES]) -> L {
    let mut numbers = [0.0; LANES];
    for (x, bits) in numbers.iter_mut().zip(words) {
        *x = f32::from_bits(*bits);
    }
    L::load(&numbers)
}

/// The bits of lanes.
#[inline(always)]
pub fn words_of<L: Wide>(lanes: L) -> [u32; LANES] {
    let mut words = [0; LANES];
    for (bits, x) in words.iter_mut().zip(&lanes.store()) {
        *bits = x.to_bits();
    }
    words
}

/// Writes a vector into one lane of columns.
#[inline(always)]
pub fn set_lane([x, y, z]: &mut [[f32; LANES]; 3], i: usize, v: Vec3) {
    (x[i], y[i], z[i]) = (v.x, v.y, v.z);
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

impl Lanes for f32 {
    type Mask = bool;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn ne(self, other: Self) -> bool {
        self != other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn both(a: bool, b: bool) -> bool {
        a & b
    }
    #[inline(always)]
    fn either(a: bool, b: bool) -> bool {
        a | b
    }
    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }
    #[inline(always)]
    fn not(mask: bool) -> bool {
        !mask
    }
    #[inline(always)]
    fn next_up(self) -> f32 {
        f32::next_up(self)
    }
    #[inline(always)]
    fn next_down(self) -> f32 {
        f32::next_down(self)
    }
}

/// Numbers of the bits that are set among the lowest eight.
#[inline(always)]
pub fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

/// By bits: the lanes that have one, in their order, then lane 0.
static PACKED: [[u8; LANES]; 256] = {
    let (mut packed, mut bits) = ([[0; LANES]; 256], 0);
    while bits < 256 {
        let (mut lane, mut n) = (0, 0);
        while lane < LANES {
            if bits >> lane & 1 == 1 {
                packed[bits][n] = lane as u8;
                n += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    packed
};

/// Asks for memory that will be read soon.
#[inline(always)]
pub fn prefetch<T>(wanted: &T) {
    #[cfg(target_arch = "x86_64")]
    x86::prefetch(wanted);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = wanted;
}

/// What the eight lanes are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// Arrays: any processor. Where there are registers for sure, tests alone need them.
    #[cfg(any(test, not(target_arch = "x86_64")))]
    Plain,
    /// Two registers of four.
    #[cfg(target_arch = "x86_64")]
    Sse2,
    /// One register of eight; needs AVX2 and what comes with it on all processors: FMA, BMI and POPCNT.
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

/// Something that is computed with lanes of any width.
pub trait Kernel {
    type Output;

    /// To be marked `#[inline(always)]`, and all that computes with lanes in it, closures never handed to functions
    /// that are not: what is left outside of the function that enables AVX2 becomes a call for every operation.
    fn run<L: Wide>(self) -> Self::Output;
}

impl Width {
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(any(test, not(target_arch = "x86_64")))]
            Width::Plain => kernel.run::<Plain>(),
            #[cfg(target_arch = "x86_64")]
            Width::Sse2 => kernel.run::<Sse2>(),
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => x86::run_avx2(kernel),
        }
    }

    /// The widest that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if x86::has_avx2() { Width::Avx2 } else { Width::Sse2 }
        }
        #[cfg(not(target_arch = "x86_64"))]
        Width::Plain
    }

    /// Every width that this processor has.
    #[cfg(test)]
    pub fn all() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        {
            let mut all = vec![Width::Plain, Width::Sse2];
            all.extend(x86::has_avx2().then_some(Width::Avx2));
            all
        }
        #[cfg(not(target_arch = "x86_64"))]
        vec![Width::Plain]
    }
}

#[cfg(test)]
mod tests;
