//! Which lanes a processor has, and running a kernel with them.

use super::lanes::Kernel;
#[cfg(any(test, not(target_arch = "x86_64")))]
use super::plain::Plain;
#[cfg(target_arch = "x86_64")]
use super::x86;
#[cfg(target_arch = "x86_64")]
#[cfg(target_arch = "x86_64")]
use super::x86::Sse2;

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
