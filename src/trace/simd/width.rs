//! Which lanes a processor has, and running a kernel with them.
//!
//! Every kernel is compiled once for every width, and kernels are most of this crate: builds with debug assertions have
//! no AVX2 among their widths, but for the unit tests, which hold whole pictures of both widths equal.

#[cfg(all(target_arch = "x86_64", any(test, not(debug_assertions))))]
use super::avx2;
use super::lanes::Kernel;
#[cfg(not(target_arch = "x86_64"))]
use super::plain::Plain;
#[cfg(target_arch = "x86_64")]
use super::sse2::{self, Sse2};

/// Asks for memory that will be read soon.
#[inline(always)]
pub fn prefetch<T>(wanted: &T) {
    #[cfg(target_arch = "x86_64")]
    sse2::prefetch(wanted);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = wanted;
}

/// What the eight lanes are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// Arrays: any processor.
    #[cfg(not(target_arch = "x86_64"))]
    Plain,
    /// Two registers of four.
    #[cfg(target_arch = "x86_64")]
    Sse2,
    /// One register of eight; needs AVX2 and what comes with it on all processors: FMA, BMI and POPCNT.
    #[cfg(all(target_arch = "x86_64", any(test, not(debug_assertions))))]
    Avx2(avx2::HasAvx2),
}

impl Width {
    /// Runs a kernel with lanes of this width.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(not(target_arch = "x86_64"))]
            Width::Plain => kernel.run::<Plain>(),
            #[cfg(target_arch = "x86_64")]
            Width::Sse2 => kernel.run::<Sse2>(),
            #[cfg(all(target_arch = "x86_64", any(test, not(debug_assertions))))]
            Width::Avx2(proof) => avx2::run_avx2(proof, kernel),
        }
    }

    /// The widest that was compiled and that this processor has.
    pub fn detect() -> Self {
        #[cfg(all(target_arch = "x86_64", any(test, not(debug_assertions))))]
        if let Some(proof) = avx2::HasAvx2::detect() {
            return Width::Avx2(proof);
        }
        #[cfg(target_arch = "x86_64")]
        return Width::Sse2;
        #[cfg(not(target_arch = "x86_64"))]
        return Width::Plain;
    }

    /// Every width that this processor has.
    #[cfg(test)]
    pub fn all() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        return [Width::Sse2].into_iter().chain(avx2::HasAvx2::detect().map(Width::Avx2)).collect();
        #[cfg(not(target_arch = "x86_64"))]
        return vec![Width::Plain];
    }
}
