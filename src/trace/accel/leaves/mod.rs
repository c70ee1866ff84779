//! Primitives in blocks of eight, column by column, which are tested side by side: what trees and grids hold.
//!
//! | file | |
//! |---|---|
//! | `block` | blocks by kind; [`NodeRef`]: what a child of a node is; [`BuildInput`]: what an accelerator is built over |
//! | `intersect` | one ray against a block |

mod block;
mod intersect;

pub use block::{BuildInput, ConeBlock, Leaves, NO_BACK, NO_FRONT, NodeKind, NodeRef};
pub use intersect::{HitSpace, TraversalCost, block};
