//! Rays that go nearly the same way, sixteen together, through any accelerator.
//!
//! Boxes are tested once for all of them, by the frustum around them (Reshetov, Soupikov and Hurley 2005; see
//! [`frustum`]); primitives are tested with a ray in each lane. What a ray hits cannot differ from its own walk: the
//! frustum only ever opens more boxes, and the tests are the same in every lane. Where the rays turn out to part ways,
//! the packet is given up and each goes on alone with what it has found.

mod frustum;
mod group;
mod run;

pub use frustum::PacketFrustum;
pub use group::{GROUPS, RayGroup};
pub use run::{HitSink, RayBatch, RayPacket, Traversal, alone, each_packet};
