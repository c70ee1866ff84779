//! Work items: one by one as structs, many column by column, so that lanes load eight in a row at once.
//!
//! | file | |
//! |---|---|
//! | `ray` | [`Ray`], [`Hit`] |
//! | `columns` | [`Columns`]: rows of numbers, column by column |
//! | `rays`, `hits` | many rays, and what they met |

mod columns;
mod hits;
mod ray;
mod rays;
#[cfg(test)]
mod tests;

pub use columns::{Columns, contiguous, eight};
pub use hits::Hits;
pub use ray::{Hit, Ray};
pub use rays::Rays;
