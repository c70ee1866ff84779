//! A tree of boxes with eight children a node (Wald, Benthin and Boulos 2008; Ernst and Greiner 2008).
//!
//! Eight boxes are tested at once, and a leaf holds a block of up to eight primitives of one kind that are tested at
//! once (see [`super::leaves`]); kinds without blocks are listed and tested one by one. A
//! [`crate::trace::primitive::MeshPrototype`] has a tree of its own, into which the ray is carried by its instances.
//! Where primitives only moved, boxes are fitted to them instead of building again (`refit`); where few rays are
//! expected, a tree is built in three fifths of the time (`fast`).
//!
//! Boxes are tested with a margin by more than the tests of primitives err, so that no hit is ever lost and the tree
//! answers as brute force does; that alone lets their arithmetic differ from one processor to the next.
//!
//! Where a ray meets boxes: `walk` tests one ray against eight, `stream` rays of a stream, [`super::packet`] eight rays
//! against one; where it meets primitives: [`super::leaves`], and each kind's file in [`crate::trace::primitive`].

mod build;
mod collapse;
mod fast;
mod morton;
mod packet;
mod prim_ref;
mod refit;
mod split;
mod stream;
mod traverse;
mod tree;
mod two_level;
mod walk;

pub use two_level::Bvh;
