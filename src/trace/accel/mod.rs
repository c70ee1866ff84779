//! What finds the primitive along a ray: brute force, a uniform grid of two levels, or a tree of boxes.
//!
//! All share one front: far rays are moved up to the scene, then finite primitives and infinite planes are met, always
//! by the same tests and with the same rule for ties. The answer is therefore the same to the bit; only the cost
//! differs. A [`TraversalScratch`] belongs to one thread; what it counts for the rays of a tile depends on that tile
//! alone.
//!
//! | room | |
//! |---|---|
//! | `accelerator` | [`Accelerator`]: the choice, and the front that all share |
//! | `hidden` | [`HiddenPrimitives`]: what is not there for some rays |
//! | `scratch` | [`TraversalScratch`]: what one thread owns while it walks |
//! | `leaves` | blocks of eight primitives that are tested side by side |
//! | `packet` | rays that go the same way, sixteen together |
//! | `stream` | rays that share nothing but an octant, up to 64 together |
//! | `bvh` | a tree of boxes with eight children a node |
//! | `grid` | a uniform grid of two levels |
//!
//! # What was found
//!
//! Measured with the `rays` bench on one thread of a Zen 3, in turns with Embree 3.13; in millions of rays a second,
//! Embree's single rays / its packets of eight / the tree here, the median of three (they differed by up to a half on
//! that machine, which others used too):
//!
//! | | primary | diffuse bounce | shadow |
//! |---|---|---|---|
//! | bunny, 69 k triangles | 13 / 29 / 21 | 9.1 / 10 / 5.8 | 14 / 20 / 12 |
//! | blob, 874 k triangles | 9.7 / 13 / 17 | 5.6 / 5.6 / 3.0 | 8.6 / 11 / 6.2 |
//! | bunny in a stadium | 6.9 / 19 / 14 | 6.3 / 6.9 / 3.3 | 12 / 25 / 21 |
//!
//! Spheres, before rays lay in columns, against a build of Embree that picked AVX-512:
//!
//! | | primary | diffuse bounce | shadow |
//! |---|---|---|---|
//! | sphereflake, 7 k spheres | 12.3 / 18 / 32 | 9.8 / 11.5 / 12 | 14.3 / 26 / 29 |
//! | sphereflake, 598 k spheres | 9.6 / 12.3 / 16 | 6.3 / 7 / 7.3 | 11.1 / 17 / 13 |
//!
//! That was before rays that share nothing went down the tree in streams, and before boxes had margins of their own. On
//! a Sapphire Rapids that other work kept busy (CPU time, AVX2, three alternations) streams then were 1.2, 1.1 and 1.1
//! times as fast as the same rays one by one on bounces off the bunny, 1.5, 1.05 and 1.5 times in the stadium. Margins by
//! the greatest coordinate of each box, not of the whole tree: a bounce in the stadium tests 9.5 triangles instead of
//! 15.6. Tried for streams elsewhere and of no use: a finer order than octants (20 ns a ray), entry distances on the
//! stack, streams of 16 (a tenth slower).
//!
//! The grid reaches 0.56 / 0.55 / 0.42 of the tree's rates on the bunny, 0.59 / 0.68 / 0.46 on the sphereflake of 7 k
//! spheres and 0.32 / 0.32 / 0.49 in the stadium (0.20 / 0.11 / 0.09 on the bunny before cells had blocks, packets and
//! grids of their own). Finer cells than one a primitive lose: their blocks stay nearly empty. Blocks of cones are met
//! 2.3 to 3.3 times as fast as cones one by one.
//!
//! Over whole frames the tree was ahead of the grid, or within a twentieth, in all of some forty scenes, which is why
//! `Accel::Auto` is the tree. User seconds of one thread, tree / grid: 0.12 to 0.17 for a crowd of 1,000 instances
//! whose boxes overlap, 0.26 for 3,000 tufts side by side, 0.54 for 100 large instances in one place, 0.8 to 0.86 for
//! 10,000 instances apart; 0.66 for the sphereflake, 0.68 for 2,000 spheres through each other, 0.85 to 0.9 and 0.77 to
//! 0.96 for clouds of 1,000 and 100,000 small spheres, 0.82 for 5,000 cones, 0.97 for 5,000 boxes, 0.76 for the bunny,
//! 0.59 for the stadium, 1.0 for the Cornell box, 0.55 to 1.03 for the scenes of the SPD. An estimate of costs would
//! have nothing to choose.
//!
//! Where few rays are expected, a tree is built in `bvh::fast` from a curve that fills space, at 1.7 times the rate of
//! a full build (874 k triangles, on one thread and two: 1.6 and 2.5 millions a second in full, 2.7 and 4.4 fast).
//! Diffuse bounces then visit 1.12 to 1.17 times as many nodes and test 1.1 to 1.5 times as many primitives, at 0.87 of
//! the rate on meshes. A third of what is left goes into reading and writing primitives. Blocks that dynamic
//! programming cuts from the curve, and cuts at multiples of eight, cost less to find and made up to 3 times as many
//! tests; in the stadium rays visit 1.4 times as many nodes as in the full tree if nodes are cut from the curve
//! whatever surface that wastes.
//!
//! Full builds took 1.4 times as long while numbers of primitives stood beside their coordinates as subnormal floats.
//! Nodes of eight that are made of a binary tree at least surface, not by opening the widest range, let shadow rays
//! visit 0.73 (bunny) and 0.81 (blob) of the nodes, bounces 0.94 to 0.99, and take 74 bytes a triangle instead of 78.
//!
//! What helped most, in order: arithmetic that is inlined into the one function that enables AVX2 (a closure handed to
//! the standard library is not: every addition becomes a call); one frustum test of a node for sixteen rays instead of
//! sixteen tests of eight boxes; a ray in each lane at the leaves of packets; spreading the ray over the lanes again at
//! every leaf instead of keeping it in registers that spill; a cost of splits that counts a leaf half by its primitives
//! and half by its block (blocks alone put the floor into a leaf with the model that stands on it); 32 bins. Leaves of
//! four were slower everywhere; prefetching the children of a node pays where the tree is larger than the cache.

mod accelerator;
mod bvh;
mod grid;
mod hidden;
mod leaves;
mod packet;
mod scratch;
mod stream;

pub use accelerator::Accelerator;
pub use hidden::HiddenPrimitives;
pub use scratch::TraversalScratch;

#[cfg(test)]
mod tests;
