//! Work items: one by one as structs, eight side by side in lanes, and many column by column, so that lanes load eight
//! in a row at once. A work item is declared once, with `work_item!`; the rest follows from its fields.
//!
//! | file | |
//! |---|---|
//! | `work_item` | the macro; [`Field`]: what can be a field of a work item |
//! | `columns` | [`Columns`]: rows of numbers, column by column |
//! | `ray` | [`Ray`] and [`Rays`], [`Hit`] and [`Hits`] |

mod columns;
mod ray;
mod work_item;

pub use columns::{Columns, contiguous};
pub use ray::{Hit, HitColumns, HitLanes, Hits, Ray, RayLanes, Rays};
pub use work_item::Field;
pub(in crate::trace) use work_item::work_item;

#[cfg(test)]
mod tests;
