//! Eight lanes in the SSE2 registers of x86-64, two of four.
//!
//! Soundness: SSE2 is part of x86-64.

#![allow(unsafe_code, reason = "processor instructions are unsafe to call; the module says why these are sound")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::lanes::{LANES, Lanes, Wide};
use super::plain_u32x8::PlainU32x8;

/// Eight lanes in two registers.
#[derive(Clone, Copy, Debug)]
pub struct Sse2([__m128; 2]);

macro_rules! operators {
    ($($trait:ident $method:ident $four:ident),*) => { $(
        impl $trait for Sse2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                // SAFETY: see the module.
                self.zip(o, |a, b| unsafe { $four(a, b) })
            }
        }
    )* };
}
operators!(Add add _mm_add_ps, Sub sub _mm_sub_ps, Mul mul _mm_mul_ps, Div div _mm_div_ps);

impl Neg for Sse2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Sse2(self.0.map(|a| unsafe { _mm_xor_ps(a, _mm_set1_ps(-0.0)) }))
    }
}

impl Sse2 {
    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(__m128, __m128) -> __m128) -> Self {
        Sse2([f(self.0[0], o.0[0]), f(self.0[1], o.0[1])])
    }
}

// SAFETY of every block in the implementations: see the module; loads and stores are of arrays of eight.
impl Lanes for Sse2 {
    const COUNT: usize = LANES;
    type Mask = [__m128; 2];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Sse2([unsafe { _mm_set1_ps(x) }; 2])
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| unsafe { _mm_min_ps(a, b) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| unsafe { _mm_max_ps(a, b) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Sse2(self.0.map(|a| unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), a) }))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Sse2(self.0.map(|a| unsafe { _mm_sqrt_ps(a) }))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        self.zip(other, |a, b| unsafe { _mm_cmple_ps(a, b) }).0
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.zip(other, |a, b| unsafe { _mm_cmplt_ps(a, b) }).0
    }
    #[inline(always)]
    fn ne(self, other: Self) -> Self::Mask {
        self.zip(other, |a, b| unsafe { _mm_cmpneq_ps(a, b) }).0
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        let pick = |i: usize| unsafe { _mm_or_ps(_mm_and_ps(mask[i], yes.0[i]), _mm_andnot_ps(mask[i], no.0[i])) };
        Sse2([pick(0), pick(1)])
    }
    #[inline(always)]
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        Sse2(a).zip(Sse2(b), |a, b| unsafe { _mm_and_ps(a, b) }).0
    }
    #[inline(always)]
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        Sse2(a).zip(Sse2(b), |a, b| unsafe { _mm_or_ps(a, b) }).0
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        Self::bits(mask) != 0
    }
    #[inline(always)]
    fn not(mask: Self::Mask) -> Self::Mask {
        mask.map(|m| unsafe { _mm_xor_ps(m, _mm_castsi128_ps(_mm_set1_epi32(-1))) })
    }
    #[inline(always)]
    fn next_up(self) -> Self {
        Self::load(&self.store().map(f32::next_up))
    }
    #[inline(always)]
    fn load(from: &[f32; LANES]) -> Self {
        let p = from.as_ptr();
        Sse2(unsafe { [_mm_loadu_ps(p), _mm_loadu_ps(p.add(4))] })
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        let mut to = [0.0; LANES];
        let p = to.as_mut_ptr();
        unsafe {
            _mm_storeu_ps(p, self.0[0]);
            _mm_storeu_ps(p.add(4), self.0[1]);
        }
        to
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        let [low, high] = mask.map(|m| (unsafe { _mm_movemask_ps(m) }) as u32);
        low | high << 4
    }
    #[inline(always)]
    fn mask(bits: u32) -> Self::Mask {
        let own = unsafe { _mm_setr_epi32(1, 2, 4, 8) };
        [bits & 15, bits >> 4 & 15].map(|bits| unsafe {
            let set = _mm_and_si128(_mm_set1_epi32(bits as i32), own);
            _mm_castsi128_ps(_mm_cmpeq_epi32(set, own))
        })
    }
}

impl Wide for Sse2 {
    type U32x8 = PlainU32x8<Self>;

    #[inline(always)]
    fn scale_sub(self, factor: Self, less: Self) -> Self {
        self * factor - less
    }
    #[inline(always)]
    fn bit_planes(bytes: &[u8; 64]) -> [u64; LANES] {
        let mut planes = [0; LANES];
        for quarter in 0..4 {
            unsafe {
                let mut bytes = _mm_loadu_si128(bytes.as_ptr().add(16 * quarter).cast());
                for plane in planes.iter_mut().rev() {
                    *plane |= u64::from(_mm_movemask_epi8(bytes) as u32) << (16 * quarter);
                    bytes = _mm_add_epi8(bytes, bytes);
                }
            }
        }
        planes
    }
}

/// Asks for every cache line of it.
#[inline(always)]
pub fn prefetch<T>(wanted: &T) {
    let start: *const i8 = std::ptr::from_ref(wanted).cast();
    for line in 0..size_of::<T>() / 64 {
        // SAFETY: an address inside `wanted`; the instruction reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(64 * line)) };
    }
}
