//! Eight whole numbers of 32 bits beside eight `f32`: what hashes and digits are made of.

use std::marker::PhantomData;

use super::{LANES, Wide};

/// Eight whole numbers, modulo 2^32.
pub trait Words: Copy {
    /// The lanes of `f32` of the same width.
    type Floats: Wide;

    fn splat(x: u32) -> Self;
    fn load(from: &[u32; LANES]) -> Self;
    fn plus(self, o: Self) -> Self;
    fn times(self, o: Self) -> Self;
    fn and(self, o: Self) -> Self;
    fn or(self, o: Self) -> Self;
    fn xor(self, o: Self) -> Self;
    /// By a number below 32.
    fn left<const N: i32>(self) -> Self;
    fn right<const N: i32>(self) -> Self;
    /// Each by a number of its own below 32.
    fn right_by(self, by: Self) -> Self;
    /// Of a table, those entries whose numbers are in the lowest three bits.
    fn pick(self, table: &[u32; LANES]) -> Self;
    fn reverse_bits(self) -> Self;
    /// Numbers below 2^31, rounded.
    fn floats(self) -> Self::Floats;
}

/// Arrays: for all widths that have no instructions for all of this.
#[derive(Debug)]
pub struct PlainWords<L>([u32; LANES], PhantomData<L>);

impl<L> Clone for PlainWords<L> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for PlainWords<L> {}

impl<L> PlainWords<L> {
    #[inline(always)]
    fn each(self, f: impl Fn(u32) -> u32) -> Self {
        PlainWords(self.0.map(f), PhantomData)
    }

    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        PlainWords(std::array::from_fn(|i| f(self.0[i], o.0[i])), PhantomData)
    }
}

impl<L: Wide> Words for PlainWords<L> {
    type Floats = L;

    #[inline(always)]
    fn splat(x: u32) -> Self {
        PlainWords([x; LANES], PhantomData)
    }
    #[inline(always)]
    fn load(from: &[u32; LANES]) -> Self {
        PlainWords(*from, PhantomData)
    }
    #[inline(always)]
    fn plus(self, o: Self) -> Self {
        self.zip(o, u32::wrapping_add)
    }
    #[inline(always)]
    fn times(self, o: Self) -> Self {
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
    fn left<const N: i32>(self) -> Self {
        self.each(|a| a << N)
    }
    #[inline(always)]
    fn right<const N: i32>(self) -> Self {
        self.each(|a| a >> N)
    }
    #[inline(always)]
    fn right_by(self, by: Self) -> Self {
        self.zip(by, |a, by| a >> (by & 31))
    }
    #[inline(always)]
    fn pick(self, table: &[u32; LANES]) -> Self {
        self.each(|i| table[i as usize % LANES])
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        self.each(u32::reverse_bits)
    }
    #[inline(always)]
    fn floats(self) -> L {
        L::load(&self.0.map(|x| x as f32))
    }
}
