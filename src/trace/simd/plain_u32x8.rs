//! Eight whole numbers in arrays: for all widths that have no instructions for all of this.

use std::marker::PhantomData;

use super::lanes::{LANES, U32x8, Wide};

/// Arrays: for all widths that have no instructions for all of this.
#[derive(Debug)]
pub struct PlainU32x8<L>([u32; LANES], PhantomData<L>);

impl<L> Clone for PlainU32x8<L> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for PlainU32x8<L> {}

impl<L> PlainU32x8<L> {
    #[inline(always)]
    fn each(self, f: impl Fn(u32) -> u32) -> Self {
        PlainU32x8(self.0.map(f), PhantomData)
    }

    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        PlainU32x8(std::array::from_fn(|i| f(self.0[i], o.0[i])), PhantomData)
    }
}

impl<L: Wide> U32x8 for PlainU32x8<L> {
    type Floats = L;

    #[inline(always)]
    fn splat(x: u32) -> Self {
        PlainU32x8([x; LANES], PhantomData)
    }
    #[inline(always)]
    fn load(from: &[u32; LANES]) -> Self {
        PlainU32x8(*from, PhantomData)
    }
    #[inline(always)]
    fn wrapping_add(self, o: Self) -> Self {
        self.zip(o, u32::wrapping_add)
    }
    #[inline(always)]
    fn wrapping_mul(self, o: Self) -> Self {
        self.zip(o, u32::wrapping_mul)
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        self.zip(o, |a, b| a & b)
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        self.zip(o, |a, b| a | b)
    }
    #[inline(always)]
    fn xor(self, o: Self) -> Self {
        self.zip(o, |a, b| a ^ b)
    }
    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        self.each(|a| a << N)
    }
    #[inline(always)]
    fn shr<const N: i32>(self) -> Self {
        self.each(|a| a >> N)
    }
    #[inline(always)]
    fn shr_by(self, by: Self) -> Self {
        self.zip(by, |a, by| a >> (by & 31))
    }
    #[inline(always)]
    fn permute(self, table: &[u32; LANES]) -> Self {
        self.each(|i| table[i as usize % LANES])
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        self.each(u32::reverse_bits)
    }
    #[inline(always)]
    fn to_floats(self) -> L {
        L::load(&self.0.map(|x| x as f32))
    }
}
