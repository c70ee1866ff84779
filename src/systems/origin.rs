//! Where the space that is traced has its origin.
//!
//! The kernel counts in `f32`, which far from 0 has no room for detail: at a million units a step is 1/16. So all that it
//! is given is moved, in `f64`, to an origin near the camera. Near 0 that is 0 itself, and nothing is moved at all.

use glam::{DAffine3, DVec3};

use super::hierarchy::Placement;
use super::lens;
use super::stage::Stage;
use crate::base::math;

/// The origin for a camera at a point, world space: a camera that moves a little keeps its origin, and with it all that
/// was derived for it.
pub fn origin_for(camera: DVec3) -> DVec3 {
    math::lattice_origin(camera)
}

/// The origin for the camera of the World as it stands, its placements up to date.
pub(super) fn render_origin(stage: &Stage) -> DVec3 {
    // A camera that stands nowhere is answered where its rays are made.
    origin_for(lens::placed_camera(stage).map_or(DVec3::ZERO, |camera| camera.from))
}

/// The map from an entity's local space to the one that is traced.
pub(super) fn relative(placement: Option<&Placement>, origin: DVec3) -> DAffine3 {
    let map = placement.map_or(DAffine3::IDENTITY, |placement| placement.0);
    moved(map, -origin)
}

/// A map that leads elsewhere.
pub(super) fn moved(map: DAffine3, by: DVec3) -> DAffine3 {
    // Not even the sign of a zero changes where there is nothing to move.
    if by == DVec3::ZERO { map } else { DAffine3 { translation: map.translation + by, ..map } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_near_the_origin_keep_it() {
        assert_eq!(origin_for(DVec3::new(2_047.0, -2_047.0, -0.0)).to_array().map(f64::to_bits), [0; 3]);
        assert_eq!(origin_for(DVec3::new(1e6, -1e7, 3_000.0)), DVec3::new(1e6, -1e7, 3_008.0));
    }
}
