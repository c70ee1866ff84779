//! Arithmetic on one number or on eight side by side: the only room with processor instructions in it.
//!
//! Code is written once over [`Lanes`] and runs on a single `f32`, on two SSE2 registers, on one AVX register or on
//! plain arrays. Every lane does what the single number does, operation by operation, none of them fused, so that all
//! widths give the same bits. Which width runs is decided once, from what the processor says of itself
//! ([`Width::detect`]).
//!
//! | file | |
//! |---|---|
//! | `lanes` | the traits: [`Lanes`] (one or many), [`Wide`] (eight), [`U32x8`] (whole numbers), [`Kernel`] |
//! | `v3` | vectors of three coordinates |
//! | `width` | [`Width`]: which lanes the processor has, and running a [`Kernel`] with them |
//! | `avx2`, `sse2`, `plain`, `plain_u32x8` | what lanes are made of |

#[cfg(all(target_arch = "x86_64", any(test, not(debug_assertions))))]
mod avx2;
mod lanes;
#[cfg(any(test, not(target_arch = "x86_64")))]
mod plain;
mod plain_u32x8;
#[cfg(target_arch = "x86_64")]
mod sse2;
mod v3;
mod width;

pub use lanes::{Kernel, LANES, Lanes, U32x8, Wide, lane, lanes, lanes_from_bits, lanes_to_bits, set_lane};
pub use v3::V3;
pub use width::{Width, prefetch};

#[cfg(test)]
mod tests;
