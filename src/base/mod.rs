//! Ground floor: what every room needs and nothing about scenes.
//!
//! Exact mathematics ([`math`], [`rotation`]), stateless random numbers ([`random`]), colour transfer ([`color`]), every cap
//! of the program ([`limits`]), words of other tools ([`synonyms`]), capped reading ([`files`]) below a project's root
//! ([`project`]), what writing does to a disk ([`disk`]), encodings ([`text`], [`base64`]), digests of content ([`digest`]), values as bytes for another process ([`codec`]), processor time
//! ([`clock`]), memory held ([`memory`]), frame rates as fractions ([`rate`]), the built-in font ([`font`]) and the one shape
//! that all mistakes are reported in ([`diagnostics`]).

pub mod base64;
pub mod clock;
pub mod codec;
pub mod color;
pub mod diagnostics;
pub mod digest;
pub mod disk;
pub mod files;
pub mod font;
pub mod limits;
pub mod math;
pub mod memory;
pub mod project;
pub mod random;
pub mod rate;
pub mod rotation;
pub mod synonyms;
pub mod text;
