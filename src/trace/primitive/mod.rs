//! Primitives: what rays can meet, as columns by kind, numbered through ([`Geometry`]).
//!
//! | file | |
//! |---|---|
//! | `geometry` | [`Geometry`]: all primitives of a frame; [`PrimitiveKind`]: the list of kinds |
//! | `shapes` | tests of a ray against one shape, over any lanes; [`PreparedRay`] |
//! | `intersect` | a ray against one primitive; [`ClosestHit`] and the rule for ties |
//! | `interaction` | point, error bound and normals of a hit, for one and for eight |
//! | `uv` | texture coordinates of a hit |
//! | `surface` | [`SurfacePoint`]: where a hit is and how exactly that is known |
//! | `mesh` | meshes baked into the world, prototypes and instances |
//! | `transformed` | shapes under any affine map |
//! | `bounds` | axis-aligned boxes |

mod bounds;
mod geometry;
mod interaction;
mod intersect;
mod mesh;
pub mod shapes;
mod surface;
mod tag;
mod transformed;
mod uv;

pub use bounds::{Bounds, MARGIN};
pub use geometry::{Geometry, PrimitiveKind, PrimitiveLayout};
pub use intersect::ClosestHit;
pub use mesh::MeshPrototype;
pub use shapes::{ConeFrustum, ConeLanes, PARTS, PreparedRay, PreparedRayLanes, finite_recip, intersect_box};
pub use surface::{ROUNDING, SurfacePoint, SurfacePointLanes};
pub use tag::{Sides, Tag};
pub use transformed::{AffineMap, LocalShape};
pub use uv::{ObjectSpace, SurfaceUv};

#[cfg(test)]
mod tests;
