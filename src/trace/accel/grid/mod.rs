//! A uniform grid of two levels, walked cell by cell (Amanatides and Woo 1987), or slice by slice with the rays of a
//! packet (Wald, Ize, Kensler, Knoll and Parker 2006).
//!
//! A primitive is listed in every cell that it touches, in blocks of eight that are tested side by side; mailboxes per
//! worker keep what a ray or a packet meets again from being tested again where that costs more than asking. A cell
//! that holds much more than its share has a grid of its own: "a teapot in a stadium". A few primitives that would
//! stretch the grid over empty space, the floor under a small model, stand outside of it and are tested first.
//!
//! Primitives are listed with a pad by more than the walk and the tests of primitives err, so that a cell which
//! rounding makes the walk miss is one in which nothing stands alone: no hit is ever lost, and the grid answers as
//! brute force does. A [`crate::trace::primitive::MeshPrototype`] has a grid of its own, into which the ray is carried
//! by its instances.

mod build;
mod cells;
mod packet;
mod traverse;
mod two_level;
mod walk;

pub use two_level::Grid;
