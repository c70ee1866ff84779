//! Eight lanes in arrays.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::lanes::{LANES, Lanes, Wide};
use super::plain_u32x8::PlainU32x8;

/// Eight lanes on any processor.
#[derive(Clone, Copy, Debug)]
pub struct Plain([f32; LANES]);

impl Plain {
    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Plain(std::array::from_fn(|i| f(self.0[i], o.0[i])))
    }

    #[inline(always)]
    fn compare(self, o: Self, f: impl Fn(&f32, &f32) -> bool) -> u32 {
        (0..LANES).fold(0, |bits, i| bits | u32::from(f(&self.0[i], &o.0[i])) << i)
    }
}

macro_rules! plain_operator {
    ($($trait:ident $method:ident $op:tt),*) => { $(
        impl $trait for Plain {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, |a, b| a $op b)
            }
        }
    )* };
}

plain_operator!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Plain {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Plain(self.0.map(|x| -x))
    }
}

impl Lanes for Plain {
    const COUNT: usize = LANES;
    type Mask = u32;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Plain([x; LANES])
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, Lanes::min)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, Lanes::max)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Plain(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Plain(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> u32 {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn ne(self, other: Self) -> u32 {
        self.compare(other, |a, b| a != b)
    }
    #[inline(always)]
    fn select(mask: u32, yes: Self, no: Self) -> Self {
        Plain(std::array::from_fn(|i| if mask >> i & 1 == 1 { yes.0[i] } else { no.0[i] }))
    }
    #[inline(always)]
    fn and(a: u32, b: u32) -> u32 {
        a & b
    }
    #[inline(always)]
    fn or(a: u32, b: u32) -> u32 {
        a | b
    }
    #[inline(always)]
    fn any(mask: u32) -> bool {
        mask != 0
    }
    #[inline(always)]
    fn not(mask: u32) -> u32 {
        !mask & ((1 << LANES) - 1)
    }
    #[inline(always)]
    fn next_up(self) -> Self {
        Plain(self.0.map(f32::next_up))
    }
    #[inline(always)]
    fn load(from: &[f32; LANES]) -> Self {
        Plain(*from)
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        self.0
    }
    #[inline(always)]
    fn bits(mask: u32) -> u32 {
        mask
    }
    #[inline(always)]
    fn mask(bits: u32) -> u32 {
        bits & ((1 << LANES) - 1)
    }
}

impl Wide for Plain {
    type U32x8 = PlainU32x8<Self>;

    #[inline(always)]
    fn scale_sub(self, factor: Self, less: Self) -> Self {
        self * factor - less
    }
}
