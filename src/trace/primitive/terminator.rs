//! Where the light of a coarse smooth mesh ends.
//!
//! A mesh that is shaded as if it were round is not: near the edge of its shadow a facet turns away from light that its
//! smooth normals still face, and would be black up to its edges. For such light alone, rays start from a point above the
//! facet, about where the round surface would be (Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II, 2021). Where
//! the surface bends inwards there is no such point: no light leaks through walls.

use glam::Vec3;

use super::surface::{ROUNDING, SurfacePoint};
use crate::trace::soa::Hit;

/// A facet of a smooth mesh: its corners, and the normals there, of any length.
pub struct SmoothFacet {
    /// In the space that is traced.
    pub corners: [Vec3; 3],
    /// Unit, at the corners.
    pub normals: [Vec3; 3],
}

impl SmoothFacet {
    /// Where rays start that leave towards light ahead of the smooth normal and behind the facet; `surface` is the point of
    /// the hit and faces the side that is seen. `None` where the surface does not bulge towards that side.
    pub fn start(&self, hit: &Hit, surface: &SurfacePoint) -> Option<Vec3> {
        let SmoothFacet { corners, normals } = self;
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let mixed = (0..3).fold(Vec3::ZERO, |sum, i| sum + normals[i] * weights[i]);
        let side = if mixed.dot(surface.shading_normal) < 0.0 { -1.0 } else { 1.0 };
        let mut lift = Vec3::ZERO;
        for i in 0..3 {
            // Up to the plane that touches the round surface at the corner.
            let normal = normals[i].normalize_or_zero() * side;
            let below = (surface.point - corners[i]).dot(normal).min(0.0);
            lift -= normal * (below * weights[i]);
        }
        if !lift.is_finite() || lift.dot(surface.geometric_normal) <= 0.0 {
            return None;
        }
        let point = surface.point + lift;
        let error = surface.error + (point.abs() + lift.abs()) * ROUNDING;
        Some(SurfacePoint { point, error, ..*surface }.offset_origin(surface.geometric_normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facet(bulge: f32) -> SmoothFacet {
        let corners = [Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
        let middle = Vec3::new(0.0, 1.0 / 3.0, 0.0);
        SmoothFacet { corners, normals: corners.map(|corner| Vec3::Z + (corner - middle) * bulge) }
    }

    fn seen(hit: &Hit, facet: &SmoothFacet, side: f32) -> SurfacePoint {
        let [a, b, c] = facet.corners;
        let point = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
        let normal = Vec3::Z * side;
        SurfacePoint { point, geometric_normal: normal, shading_normal: normal, ..SurfacePoint::default() }
    }

    #[test]
    fn rays_start_above_a_facet_that_bulges_and_only_there() {
        let hit = Hit { u: 0.3, v: 0.4, ..Hit::default() };
        let start = |bulge: f32, side: f32| facet(bulge).start(&hit, &seen(&hit, &facet(bulge), side));
        let out = start(0.5, 1.0).unwrap();
        assert!(out.z > 0.1 && out.z < 0.5, "{out}");
        assert!(start(0.5, -1.0).is_none() && start(-0.5, 1.0).is_none() && start(0.0, 1.0).is_none());
        // Seen from behind, a hollow bulges.
        assert!(start(-0.5, -1.0).is_some_and(|start| start.z < -0.1));
    }

    #[test]
    fn at_the_corners_the_facet_is_the_surface() {
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            let hit = Hit { u, v, ..Hit::default() };
            let facet = facet(0.5);
            let surface = seen(&hit, &facet, 1.0);
            let near = facet.start(&hit, &surface).is_none_or(|start| (start - surface.point).length() < 1e-5);
            assert!(near, "{u} {v}");
        }
    }
}
