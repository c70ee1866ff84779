//! One number, or eight side by side: the traits that arithmetic is written over.

use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::Vec3;

/// How many lanes of [`Wide`] types.
pub const LANES: usize = 8;

/// One `f32`, or several that go through the same operations.
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// How many there are: 1 or [`LANES`].
    const COUNT: usize;
    /// Yes or no for each.
    type Mask: Copy;

    /// The same number in all.
    fn splat(x: f32) -> Self;
    /// The first [`Self::COUNT`] of eight numbers.
    fn load(from: &[f32; LANES]) -> Self;
    /// Eight numbers, of which the first [`Self::COUNT`] count.
    fn store(self) -> [f32; LANES];
    /// `if self < other { self } else { other }`: the other where either is NaN.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: the other where either is NaN.
    fn max(self, other: Self) -> Self;
    /// Magnitudes.
    fn abs(self) -> Self;
    /// Square roots, correctly rounded.
    fn sqrt(self) -> Self;
    /// False where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Where this is less; never for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// True where either is NaN.
    fn ne(self, other: Self) -> Self::Mask;
    /// The first where the mask is set, the second elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Where both are set.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Where either is set.
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Whether any is set.
    fn any(mask: Self::Mask) -> bool;
    /// Where it is not set.
    fn not(mask: Self::Mask) -> Self::Mask;
    /// Lane i is bit i.
    fn bits(mask: Self::Mask) -> u32;
    /// The mask that has these bits.
    fn mask(bits: u32) -> Self::Mask;
    /// The lanes that have a bit, moved to the front; what comes after them is any lane's.
    #[inline(always)]
    fn compress(self, which: u32) -> Self {
        let (from, order) = (self.store(), &COMPRESS[which as usize & 255]);
        let mut to = [0.0; LANES];
        for (x, lane) in to.iter_mut().zip(order) {
            *x = from[usize::from(lane & 7)];
        }
        Self::load(&to)
    }
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
    type U32x8: U32x8<Floats = Self>;

    /// The least lane; no lane is NaN.
    #[inline(always)]
    fn reduce_min(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.store();
        Lanes::min(Lanes::min(Lanes::min(a, b), Lanes::min(c, d)), Lanes::min(Lanes::min(e, f), Lanes::min(g, h)))
    }
    /// The greatest lane; no lane is NaN.
    #[inline(always)]
    fn reduce_max(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.store();
        Lanes::max(Lanes::max(Lanes::max(a, b), Lanes::max(c, d)), Lanes::max(Lanes::max(e, f), Lanes::max(g, h)))
    }
    /// `self * factor - less`, perhaps fused: only for what cannot reach a pixel.
    fn scale_sub(self, factor: Self, less: Self) -> Self;

    /// Bits of bytes, plane by plane: bit i of number k is bit k of byte i.
    #[inline(always)]
    fn bit_planes(bytes: &[u8; 64]) -> [u64; LANES] {
        let mut planes = [0; LANES];
        for (i, byte) in bytes.iter().enumerate() {
            for (k, plane) in planes.iter_mut().enumerate() {
                *plane |= u64::from(byte >> k & 1) << i;
            }
        }
        planes
    }
}

/// The vector of one lane of columns.
#[inline(always)]
pub fn lane([x, y, z]: &[[f32; LANES]; 3], i: usize) -> Vec3 {
    Vec3::new(x[i], y[i], z[i])
}

/// Lanes with these bits.
#[inline(always)]
pub fn lanes_from_bits<L: Lanes>(words: &[u32; LANES]) -> L {
    let mut numbers = [0.0; LANES];
    for (x, bits) in numbers.iter_mut().zip(words) {
        *x = f32::from_bits(*bits);
    }
    L::load(&numbers)
}

/// The bits of lanes.
#[inline(always)]
pub fn lanes_to_bits<L: Lanes>(lanes: L) -> [u32; LANES] {
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

impl Lanes for f32 {
    const COUNT: usize = 1;
    type Mask = bool;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }
    #[inline(always)]
    fn load(from: &[f32; LANES]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        [self; LANES]
    }
    #[inline(always)]
    fn bits(mask: bool) -> u32 {
        u32::from(mask)
    }
    #[inline(always)]
    fn mask(bits: u32) -> bool {
        bits & 1 == 1
    }
    #[inline(always)]
    fn compress(self, _: u32) -> Self {
        self
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
    fn and(a: bool, b: bool) -> bool {
        a & b
    }
    #[inline(always)]
    fn or(a: bool, b: bool) -> bool {
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
pub static COMPRESS: [[u8; LANES]; 256] = {
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

/// Something that is computed with lanes of any width.
pub trait Kernel {
    /// What a run gives.
    type Output;

    /// To be marked `#[inline(always)]`, and all that computes with lanes in it, closures never handed to functions
    /// that are not: what is left outside of the function that enables AVX2 becomes a call for every operation.
    fn run<L: Wide>(self) -> Self::Output;
}

/// Eight whole numbers, modulo 2^32.
pub trait U32x8: Copy {
    /// The lanes of `f32` of the same width.
    type Floats: Wide;

    /// The same number in all.
    fn splat(x: u32) -> Self;
    /// The numbers of an array, lane by lane.
    fn load(from: &[u32; LANES]) -> Self;
    /// Sums, modulo 2^32.
    fn wrapping_add(self, o: Self) -> Self;
    /// Products, modulo 2^32.
    fn wrapping_mul(self, o: Self) -> Self;
    /// Bits that both have.
    fn and(self, o: Self) -> Self;
    /// Bits that either has.
    fn or(self, o: Self) -> Self;
    /// Bits that one of them has.
    fn xor(self, o: Self) -> Self;
    /// By a number below 32.
    fn shl<const N: i32>(self) -> Self;
    /// Moves bits down by `N`; zeros follow.
    fn shr<const N: i32>(self) -> Self;
    /// Each by a number of its own below 32.
    fn shr_by(self, by: Self) -> Self;
    /// Of a table, those entries whose numbers are in the lowest three bits.
    fn permute(self, table: &[u32; LANES]) -> Self;
    /// The lowest bit becomes the highest.
    fn reverse_bits(self) -> Self;
    /// Numbers below 2^31, rounded.
    fn to_floats(self) -> Self::Floats;
}
