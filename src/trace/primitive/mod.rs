//! Primitives: what rays can meet, one file a kind, in columns that are numbered through ([`Geometry`]).
//!
//! | file | |
//! |---|---|
//! | `geometry` | the list of kinds ([`PrimitiveKind`]); [`Geometry`]: all primitives of a frame |
//! | `column` | what every kind provides: bounds, intersection, point of a hit, texture coordinates, area sampling |
//! | `sphere` `triangle` `aabox` `cone` `plane` | shapes: tests over any lanes, points, texture coordinates, sampling |
//! | `mesh` `instance` | meshes baked into the world, and prototypes with instances |
//! | `transformed` | the list of solids; shapes under any affine map |
//! | `area`, `area_shape` | sampling of surfaces, and the list of shapes that are sampled |
//! | `prepared_ray`, `closest_hit` | a ray ready for tests, and the rule for ties |
//! | `surface`, `interaction`, `surface_points` | where a hit is and how exactly that is known, for one and for eight |
//! | `terminator` | where the light of a coarse smooth mesh ends |
//! | `uv` | texture coordinates, and how they change along a surface |
//! | `affine`, `bounds`, `tag` | maps, boxes, and what a primitive belongs to |

mod aabox;
mod affine;
mod area;
mod area_shape;
mod bounds;
mod closest_hit;
mod column;
mod cone;
mod geometry;
mod instance;
mod interaction;
mod mesh;
mod plane;
mod prepared_ray;
mod sphere;
mod surface;
mod surface_points;
mod tag;
mod terminator;
mod transformed;
mod triangle;
mod uv;

pub use aabox::{BoxPrim, intersect_box};
pub use affine::AffineMap;
pub use area::AreaSample;
pub use area_shape::AreaShape;
pub use bounds::{Bounds, MARGIN};
pub use closest_hit::ClosestHit;
pub use cone::{ConeFrustum, ConeLanes, PARTS, intersect_cone};
pub use geometry::{Geometry, PrimitiveKind, PrimitiveLayout};
pub use instance::{Instance, MeshPrototype};
pub use prepared_ray::{PreparedRay, PreparedRayLanes, dominant, finite_recip};
pub use sphere::{SpherePrim, intersect_sphere};
pub use surface::{ROUNDING, SurfacePoint, SurfacePointLanes};
pub use tag::{Sides, Tag};
pub use terminator::SmoothFacet;
pub use transformed::LocalShape;
pub use triangle::intersect_triangle;
pub use uv::{ObjectSpace, SurfaceUv};

#[cfg(test)]
mod tests;
