//! Ground floor: what every room needs and nothing about scenes.
//!
//! Exact mathematics ([`math`]), stateless random numbers ([`random`]), colour transfer ([`color`]), every cap of the
//! program ([`limits`]), capped reading ([`files`]), encodings ([`text`]), digests of content ([`digest`]) and the one shape that all mistakes are reported in
//! ([`diagnostics`]).

pub mod color;
pub mod diagnostics;
pub mod digest;
pub mod files;
pub mod limits;
pub mod math;
pub mod random;
pub mod text;
