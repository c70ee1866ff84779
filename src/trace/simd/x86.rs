//! Eight lanes in the registers of x86-64.
//!
//! Soundness: SSE2 is part of x86-64. An [`Avx2`] is only ever computed with inside [`run_avx2`], which is entered only
//! where the processor has what it enables.

#![allow(unsafe_code, reason = "processor instructions are unsafe to call; the module says why these are sound")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

use super::{Kernel, LANES, Lanes, Wide};

pub fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// # Panics
/// Where the processor has no AVX2.
#[inline]
pub fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    #[target_feature(enable = "avx2,fma")]
    fn enabled<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx2>()
    }
    assert!(has_avx2(), "this processor has no AVX2");
    // SAFETY: it has.
    unsafe { enabled(kernel) }
}

/// Eight lanes in one register.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(__m256);

/// Eight lanes in two registers.
#[derive(Clone, Copy, Debug)]
pub struct Sse2([__m128; 2]);

macro_rules! operators {
    ($($trait:ident $method:ident $eight:ident $four:ident),*) => { $(
        impl $trait for Avx2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                // SAFETY: see the module.
                Avx2(unsafe { $eight(self.0, o.0) })
            }
        }
        impl $trait for Sse2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                self.zip(o, |a, b| unsafe { $four(a, b) })
            }
        }
    )* };
}
operators!(
    Add add _mm256_add_ps _mm_add_ps,
    Sub sub _mm256_sub_ps _mm_sub_ps,
    Mul mul _mm256_mul_ps _mm_mul_ps,
    Div div _mm256_div_ps _mm_div_ps
);

impl Sse2 {
    #[inline(always)]
    fn zip(self, o: Self, f: impl Fn(__m128, __m128) -> __m128) -> Self {
        Sse2([f(self.0[0], o.0[0]), f(self.0[1], o.0[1])])
    }
}

// SAFETY of every block in the two implementations: see the module; loads and stores are of arrays of eight.
impl Lanes for Avx2 {
    type Mask = __m256;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Avx2(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Avx2(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Avx2(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Avx2(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Avx2(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn ne(self, other: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_NEQ_UQ>(self.0, other.0) }
    }
    #[inline(always)]
    fn select(mask: __m256, yes: Self, no: Self) -> Self {
        Avx2(unsafe { _mm256_blendv_ps(no.0, yes.0, mask) })
    }
    #[inline(always)]
    fn both(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_and_ps(a, b) }
    }
    #[inline(always)]
    fn either(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_or_ps(a, b) }
    }
    #[inline(always)]
    fn any(mask: __m256) -> bool {
        Self::bits(mask) != 0
    }
    #[inline(always)]
    fn not(mask: __m256) -> __m256 {
        unsafe { _mm256_xor_ps(mask, _mm256_castsi256_ps(_mm256_set1_epi32(-1))) }
    }
}

impl Wide for Avx2 {
    #[inline(always)]
    fn load(from: &[f32; LANES]) -> Self {
        Avx2(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        let mut to = [0.0; LANES];
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) };
        to
    }
    #[inline(always)]
    fn bits(mask: __m256) -> u32 {
        (unsafe { _mm256_movemask_ps(mask) }) as u32
    }
    #[inline(always)]
    fn scale_sub(self, factor: Self, less: Self) -> Self {
        Avx2(unsafe { _mm256_fmsub_ps(self.0, factor.0, less.0) })
    }
}

impl Lanes for Sse2 {
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
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        Sse2(a).zip(Sse2(b), |a, b| unsafe { _mm_and_ps(a, b) }).0
    }
    #[inline(always)]
    fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask {
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
}

impl Wide for Sse2 {
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
    fn scale_sub(self, factor: Self, less: Self) -> Self {
        self * factor - less
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
