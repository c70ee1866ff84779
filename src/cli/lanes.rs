//! How wide kernels compute, for the whole program.

use super::usage;
use crate::base::diagnostics::Diagnostics;
use crate::trace::simd::Width;

/// The variable that forces a width: for measuring, and to see that no picture depends on it.
const VARIABLE: &str = "ANIM_SIMD";

/// Takes the width that the environment asks for, or the widest.
///
/// # Errors
/// The widths that there are, if it is none of them.
pub fn start() -> Result<(), Diagnostics> {
    match std::env::var(VARIABLE) {
        Ok(name) if !name.is_empty() => Width::choose(&name).map_err(|why| usage(format!("{VARIABLE}={name}: {why}"))),
        _ => Ok(()),
    }
}
