//! Eight lanes in the AVX2 registers of x86-64.
//!
//! Soundness: [`Avx2`] and [`AvxU32x8`] are only ever computed with inside [`run_avx2`], which asks for a proof that the
//! processor has what it enables.

#![allow(unsafe_code, reason = "processor instructions are unsafe to call; the module says why these are sound")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::lanes::{COMPRESS, Kernel, LANES, Lanes, U32x8, Wide};

/// Proof that this processor has AVX2 and what comes with it. There is no other way to one than [`Self::detect`]: kernels
/// are entered for every ray, and to ask the processor each time took 1.5 % of the time of bounces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HasAvx2(());

impl HasAvx2 {
    pub fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt");
        has.then_some(HasAvx2(()))
    }
}

#[inline]
pub fn run_avx2<K: Kernel>(_: HasAvx2, kernel: K) -> K::Output {
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt")]
    fn enabled<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx2>()
    }
    // SAFETY: the processor has what is enabled.
    unsafe { enabled(kernel) }
}

/// Eight lanes in one register.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(__m256);

macro_rules! operators {
    ($($trait:ident $method:ident $eight:ident),*) => { $(
        impl $trait for Avx2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                // SAFETY: see the module.
                Avx2(unsafe { $eight(self.0, o.0) })
            }
        }
    )* };
}
operators!(Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps);

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Avx2(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

// SAFETY of every block in the implementations: see the module; loads and stores are of arrays of eight.
impl Lanes for Avx2 {
    const COUNT: usize = LANES;
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
    fn and(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_and_ps(a, b) }
    }
    #[inline(always)]
    fn or(a: __m256, b: __m256) -> __m256 {
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
    #[inline(always)]
    fn next_up(self) -> Self {
        unsafe {
            let bits = _mm256_castps_si256(self.0);
            // One bit up, or down where the sign is set; from either zero to the least number.
            let step = _mm256_or_si256(_mm256_srai_epi32::<31>(bits), _mm256_set1_epi32(1));
            let next = _mm256_castsi256_ps(_mm256_add_epi32(bits, step));
            let zero = _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, _mm256_setzero_ps());
            let next = _mm256_blendv_ps(next, _mm256_castsi256_ps(_mm256_set1_epi32(1)), zero);
            let moves = _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, _mm256_set1_ps(f32::INFINITY));
            Avx2(_mm256_blendv_ps(self.0, next, moves))
        }
    }
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
    fn mask(bits: u32) -> __m256 {
        unsafe {
            let own = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), own);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, own))
        }
    }
    #[inline(always)]
    fn compress(self, which: u32) -> Self {
        let order = &COMPRESS[which as usize & 255];
        unsafe {
            let order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(order.as_ptr().cast()));
            Avx2(_mm256_permutevar8x32_ps(self.0, order))
        }
    }
}

impl Wide for Avx2 {
    type U32x8 = AvxU32x8;

    #[inline(always)]
    fn scale_sub(self, factor: Self, less: Self) -> Self {
        Avx2(unsafe { _mm256_fmsub_ps(self.0, factor.0, less.0) })
    }
    #[inline(always)]
    fn bit_planes(bytes: &[u8; 64]) -> [u64; LANES] {
        let mut planes = [0; LANES];
        unsafe {
            let mut low = _mm256_loadu_si256(bytes.as_ptr().cast());
            let mut high = _mm256_loadu_si256(bytes.as_ptr().add(32).cast());
            for plane in planes.iter_mut().rev() {
                let [low_bits, high_bits] = [_mm256_movemask_epi8(low) as u32, _mm256_movemask_epi8(high) as u32];
                *plane = u64::from(high_bits) << 32 | u64::from(low_bits);
                (low, high) = (_mm256_add_epi8(low, low), _mm256_add_epi8(high, high));
            }
        }
        planes
    }
}

/// Eight whole numbers in one register.
#[derive(Clone, Copy, Debug)]
pub struct AvxU32x8(__m256i);

impl AvxU32x8 {
    /// Bytes of the table by the lowest four bits of each byte, which are its only ones.
    #[inline(always)]
    fn bytes_of(self, table: [u8; 16]) -> Self {
        unsafe {
            let table = _mm256_broadcastsi128_si256(_mm_loadu_si128(table.as_ptr().cast()));
            AvxU32x8(_mm256_shuffle_epi8(table, self.0))
        }
    }
}

// SAFETY of every block: as that of `Lanes for Avx2`.
impl U32x8 for AvxU32x8 {
    type Floats = Avx2;

    #[inline(always)]
    fn splat(x: u32) -> Self {
        AvxU32x8(unsafe { _mm256_set1_epi32(x as i32) })
    }
    #[inline(always)]
    fn load(from: &[u32; LANES]) -> Self {
        AvxU32x8(unsafe { _mm256_loadu_si256(from.as_ptr().cast()) })
    }
    #[inline(always)]
    fn wrapping_add(self, o: Self) -> Self {
        AvxU32x8(unsafe { _mm256_add_epi32(self.0, o.0) })
    }
    #[inline(always)]
    fn wrapping_mul(self, o: Self) -> Self {
        AvxU32x8(unsafe { _mm256_mullo_epi32(self.0, o.0) })
    }
    #[inline(always)]
    fn and(self, o: Self) -> Self {
        AvxU32x8(unsafe { _mm256_and_si256(self.0, o.0) })
    }
    #[inline(always)]
    fn or(self, o: Self) -> Self {
        AvxU32x8(unsafe { _mm256_or_si256(self.0, o.0) })
    }
    #[inline(always)]
    fn xor(self, o: Self) -> Self {
        AvxU32x8(unsafe { _mm256_xor_si256(self.0, o.0) })
    }
    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        AvxU32x8(unsafe { _mm256_slli_epi32::<N>(self.0) })
    }
    #[inline(always)]
    fn shr<const N: i32>(self) -> Self {
        AvxU32x8(unsafe { _mm256_srli_epi32::<N>(self.0) })
    }
    #[inline(always)]
    fn shr_by(self, by: Self) -> Self {
        AvxU32x8(unsafe { _mm256_srlv_epi32(self.0, _mm256_and_si256(by.0, _mm256_set1_epi32(31))) })
    }
    #[inline(always)]
    fn permute(self, table: &[u32; LANES]) -> Self {
        AvxU32x8(unsafe { _mm256_permutevar8x32_epi32(Self::load(table).0, self.0) })
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        // The halves of each byte by a table, then the order of bytes.
        const HALF: [u8; 16] = [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15];
        let low = Self::splat(0x0f0f_0f0f);
        let turned = self.and(low).bytes_of(HALF).shl::<4>().or(self.shr::<4>().and(low).bytes_of(HALF));
        unsafe {
            let order = _mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12);
            AvxU32x8(_mm256_shuffle_epi8(turned.0, _mm256_broadcastsi128_si256(order)))
        }
    }
    #[inline(always)]
    fn to_floats(self) -> Avx2 {
        Avx2(unsafe { _mm256_cvtepi32_ps(self.0) })
    }
}
