//! Which lanes a processor has, and running a kernel with them.
//!
//! Every kernel is compiled once for every width, and kernels are most of this crate: builds with debug assertions have
//! no AVX2 among their widths, but for the unit tests, which hold whole pictures of both widths equal.

use std::sync::OnceLock;

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

/// What every kernel runs in.
static CHOSEN: OnceLock<Width> = OnceLock::new();

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

    /// The one that was chosen for the whole program, or else the widest that was compiled and that this processor has.
    pub fn detect() -> Self {
        *CHOSEN.get_or_init(Self::widest)
    }

    /// Makes everything run in lanes of this name. No bit of any picture depends on it.
    ///
    /// # Errors
    /// The names that there are, if this is none of them; the width that runs already, if it is another one.
    pub fn choose(name: &str) -> Result<(), String> {
        let names = || Self::all().iter().map(|width| width.name()).collect::<Vec<_>>().join(", ");
        let Some(width) = Self::all().into_iter().find(|width| width.name() == name) else {
            return Err(format!("expected one of those that this program and this processor have: {}", names()));
        };
        let runs = *CHOSEN.get_or_init(|| width);
        if runs == width { Ok(()) } else { Err(format!("{} runs already", runs.name())) }
    }

    /// What the lanes are made of, in a word.
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(not(target_arch = "x86_64"))]
            Width::Plain => "scalar",
            #[cfg(target_arch = "x86_64")]
            Width::Sse2 => "sse2",
            #[cfg(all(target_arch = "x86_64", any(test, not(debug_assertions))))]
            Width::Avx2(_) => "avx2",
        }
    }

    fn widest() -> Self {
        #[cfg(all(target_arch = "x86_64", any(test, not(debug_assertions))))]
        if let Some(proof) = avx2::HasAvx2::detect() {
            return Width::Avx2(proof);
        }
        #[cfg(target_arch = "x86_64")]
        return Width::Sse2;
        #[cfg(not(target_arch = "x86_64"))]
        return Width::Plain;
    }

    /// Every width that was compiled and that this processor has, the narrowest first.
    pub fn all() -> Vec<Self> {
        #[cfg(not(target_arch = "x86_64"))]
        let narrow = Width::Plain;
        #[cfg(target_arch = "x86_64")]
        let narrow = Width::Sse2;
        let widest = Some(Self::widest()).filter(|widest| *widest != narrow);
        [narrow].into_iter().chain(widest).collect()
    }
}
