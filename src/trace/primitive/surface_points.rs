//! Points of eight hits, side by side.

use super::geometry::Geometry;
use super::interaction::InteractionLanes;
use super::sphere::sphere_point;
use super::surface::SurfacePointLanes;
use super::triangle::{smoothed, triangle_point};
use crate::trace::simd::{LANES, V3, Wide, lane, lanes_to_bits};
use crate::trace::soa::{Hit, HitLanes, Ray, RayLanes};

impl Geometry {
    /// As [`Self::surface_point`] for eight hits.
    #[inline(always)]
    pub fn surface_points<L: Wide>(&self, rays: &RayLanes<L>, hits: &HitLanes<L>) -> SurfacePointLanes<L> {
        let mut lanes = InteractionLanes::default();
        let (u, v) = (hits.u.store(), hits.v.store());
        let (primitives, elements) = (lanes_to_bits(hits.primitive), lanes_to_bits(hits.element));
        for i in 0..LANES {
            if !self.gather(primitives[i], [u[i], v[i]], i, &mut lanes) {
                let ray = Ray::new(lane(&rays.origin.store(), i), lane(&rays.direction.store(), i));
                let (primitive, element) = (primitives[i], elements[i]);
                let hit = Hit { t: hits.t.store()[i], u: u[i], v: v[i], primitive, element };
                lanes.add_other(i, &self.surface_point(&ray, &hit));
            }
        }
        let [point, error, geometric, shading] = &lanes.others;
        let mut points = SurfacePointLanes {
            point: V3::load(point),
            error: V3::load(error),
            geometric_normal: V3::load(geometric),
            shading_normal: V3::load(shading),
        };
        if lanes.triangles != 0 {
            let [a, b, c] = &lanes.corners;
            let corners = [V3::load(a), V3::load(b), V3::load(c)];
            let (point, normal, error) = triangle_point(corners, [hits.u, hits.v]);
            let mut shading = normal;
            if lanes.smooth != 0 {
                let smooth = smoothed(V3::load(&lanes.mixed), normal);
                shading = V3::select(L::mask(lanes.smooth), smooth, normal);
            }
            points.put(L::mask(lanes.triangles), [point, error, normal, shading]);
        }
        if lanes.spheres != 0 {
            let center = V3::load(&lanes.center);
            let (_, origin) = self.approached(rays.origin, rays.direction);
            let near = origin + rays.direction.scale(hits.u);
            let (point, normal, error) = sphere_point(near, center, L::load(&lanes.radius));
            points.put(L::mask(lanes.spheres), [point, error, normal, normal]);
        }
        points
    }
}
