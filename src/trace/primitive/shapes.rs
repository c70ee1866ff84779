//! Ray against one shape, in `f32`.
//!
//! Every function gives distances, and which of them enter; what is hidden or behind is the caller's matter. All but
//! the plane are written over [`Lanes`]: the eight primitives of a leaf are tested by the same code as a single one, to
//! the same bits. Forms are chosen for what they do to rounding: the sphere by Hearn and Baker (Ray Tracing Gems,
//! chapter 7), the triangle by Woop, Benthin and Wald (Watertight Ray/Triangle Intersection, JCGT 2013): edge functions
//! whose signs are exactly opposite along a shared edge, so that no ray slips between two triangles.

use glam::Vec3;

use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::Ray;

/// A ray with what every test needs of it.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    pub origin: Vec3,
    /// Unit length.
    pub direction: Vec3,
    /// 1 / direction; very large, not infinite, where that is 0.
    pub inverse: Vec3,
    /// The axes in cyclic order, so that the ray runs mostly along the last.
    pub axes: [usize; 3],
    /// What moves the ray onto the last axis: x -= shear[0] z, y -= shear[1] z, and z shear[2] is the distance.
    shear: Vec3,
    turned_origin: Vec3,
    turned_inverse: Vec3,
}

/// 1 / x, finite: 0 times it is 0, and no test meets a NaN.
#[inline(always)]
pub fn finite_recip<L: Lanes>(x: L) -> L {
    const LEAST: f32 = 1e-18;
    let (zero, most) = (L::splat(0.0), L::splat(1.0 / LEAST));
    let most = L::select(x.lt(zero), zero - most, most);
    L::select(x.abs().lt(L::splat(LEAST)), most, L::splat(1.0) / x)
}

/// The axis along which a ray mostly runs.
#[inline(always)]
pub fn dominant(direction: Vec3) -> usize {
    let [x, y, z] = direction.abs().to_array();
    if x > y && x > z {
        0
    } else if y > z {
        1
    } else {
        2
    }
}

impl PreparedRay {
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let last = dominant(direction);
        let axes = [(last + 1) % 3, (last + 2) % 3, last];
        let inverse = direction.map(finite_recip::<f32>);
        let along = inverse[last];
        let shear = Vec3::new(direction[axes[0]] * along, direction[axes[1]] * along, along);
        let turned = |v: Vec3| Vec3::new(v[axes[0]], v[axes[1]], v[axes[2]]);
        let (turned_origin, turned_inverse) = (turned(origin), turned(inverse));
        PreparedRay { origin, direction, inverse, axes, shear, turned_origin, turned_inverse }
    }

    /// Coordinates in the order in which [`triangle`] wants them.
    #[inline(always)]
    pub fn turned(&self, v: Vec3) -> Vec3 {
        Vec3::new(v[self.axes[0]], v[self.axes[1]], v[self.axes[2]])
    }

    #[inline(always)]
    pub fn beam<L: Lanes>(&self) -> PreparedRayLanes<L> {
        PreparedRayLanes {
            origin: V3::splat(self.origin),
            direction: V3::splat(self.direction),
            inverse: V3::splat(self.inverse),
            axes: self.axes,
            turned_origin: V3::splat(self.turned_origin),
            turned_inverse: V3::splat(self.turned_inverse),
            shear: V3::splat(self.shear),
        }
    }
}

impl From<&Ray> for PreparedRay {
    fn from(ray: &Ray) -> Self {
        PreparedRay::new(ray.origin, ray.direction)
    }
}

/// A [`PreparedRay`] in every lane.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRayLanes<L> {
    pub origin: V3<L>,
    pub direction: V3<L>,
    pub inverse: V3<L>,
    /// The order in which [`triangle`] wants coordinates.
    pub axes: [usize; 3],
    turned_origin: V3<L>,
    turned_inverse: V3<L>,
    shear: V3<L>,
}

impl<L: Lanes> PreparedRayLanes<L> {
    /// A ray of its own in every lane, all running mostly along the last of the axes: coordinates in their order.
    #[inline(always)]
    pub fn of_rays(axes: [usize; 3], origin: [L; 3], direction: [L; 3]) -> Self {
        let [dx, dy, dz] = direction;
        let inverse = [finite_recip(dx), finite_recip(dy), finite_recip(dz)];
        PreparedRayLanes {
            origin: world_order(axes, origin),
            direction: world_order(axes, direction),
            inverse: world_order(axes, inverse),
            axes,
            turned_origin: V3 { x: origin[0], y: origin[1], z: origin[2] },
            turned_inverse: V3 { x: inverse[0], y: inverse[1], z: inverse[2] },
            shear: V3 { x: dx * inverse[2], y: dy * inverse[2], z: inverse[2] },
        }
    }
}

/// Coordinates in the order x, y, z that stand in a cyclic order of the axes.
#[inline(always)]
fn world_order<L: Lanes>(axes: [usize; 3], turned: [L; 3]) -> V3<L> {
    let first = 2 - axes[2];
    V3 { x: turned[first], y: turned[(first + 1) % 3], z: turned[(first + 2) % 3] }
}

/// Whether lines meet spheres, and the distances at which they enter and leave.
#[inline(always)]
pub fn intersect_sphere<L: Lanes>(ray: &PreparedRayLanes<L>, center: V3<L>, radius: L) -> (L::Mask, [L; 2]) {
    let zero = L::splat(0.0);
    let f = ray.origin - center;
    let b = zero - f.dot(ray.direction);
    // From the centre to the nearest point of the line: precise however far the origin is.
    let nearest = f + ray.direction.scale(b);
    let square = radius * radius;
    let discriminant = square - nearest.dot(nearest);
    let met = zero.le(discriminant);
    if !L::any(met) {
        return (met, [zero; 2]);
    }
    let root = discriminant.sqrt();
    let c = f.dot(f) - square;
    let ahead = zero.lt(b);
    let q = L::select(ahead, b + root, b - root);
    let other = L::select(q.ne(zero), c / q, zero);
    (met, [L::select(ahead, other, q), L::select(ahead, q, other)])
}

/// Hits of triangles: distance, weights of the second and third corner, whether from the front, whether at all.
pub struct TriangleHits<L: Lanes> {
    pub t: L,
    pub u: L,
    pub v: L,
    pub front: L::Mask,
    pub hit: L::Mask,
}

/// How far outside its triangle's bounds a hit may lie, relative to their distance from the origin.
const TRIANGLE_PAD: f32 = 2.0 * f32::EPSILON;

/// Corners counter-clockwise from the front, each with its coordinates in the order of the beam's axes.
#[inline(always)]
pub fn intersect_triangle<L: Lanes>(ray: &PreparedRayLanes<L>, corners: [V3<L>; 3]) -> Option<TriangleHits<L>> {
    let zero = L::splat(0.0);
    let a = corners[0] - ray.turned_origin;
    let b = corners[1] - ray.turned_origin;
    let c = corners[2] - ray.turned_origin;
    let V3 { x: sx, y: sy, z: sz } = ray.shear;
    let (ax, ay) = (a.x - sx * a.z, a.y - sy * a.z);
    let (bx, by) = (b.x - sx * b.z, b.y - sy * b.z);
    let (cx, cy) = (c.x - sx * c.z, c.y - sy * c.z);
    // Twice the area between each edge and the ray, seen along it: positive on one side of the edge.
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let inside = L::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero));
    if !L::any(inside) {
        return None;
    }
    let area = u + v + w;
    let per_area = L::splat(1.0) / area;
    let t = (u * a.z + v * b.z + w * c.z) * sz * per_area;
    // A sliver, or a ray that grazes, makes t rough and the signs too: hold both to the triangle's own bounds, where
    // an accelerator will look for it.
    let low = a.min(b).min(c);
    let high = a.max(b).max(c);
    let size = low.abs().max(high.abs());
    let doubt = doubt(ray, size, [ax, bx, cx], [ay, by, cy], per_area);
    let pad = size.max_element() * L::splat(TRIANGLE_PAD);
    let pad = V3 { x: pad, y: pad, z: pad };
    let low = (low - pad) * ray.turned_inverse;
    let high = (high + pad) * ray.turned_inverse;
    let near = low.min(high).max_element();
    let far = low.max(high).min_element();
    let t = t.max(near).min(far);
    let hit = L::and(L::and(inside, area.ne(zero)), L::and(near.le(far), doubt.lt(t)));
    Some(TriangleHits { t, u: v * per_area, v: w * per_area, front: zero.lt(area * sz), hit })
}

/// A bound of the error of a triangle's distance (pbrt-v4, section 6.8.4): a hit that is no farther may lie behind the
/// origin, on the surface that the ray leaves.
#[inline(always)]
fn doubt<L: Lanes>(
    ray: &PreparedRayLanes<L>,
    size: V3<L>,
    [ax, bx, cx]: [L; 3],
    [ay, by, cy]: [L; 3],
    per_area: L,
) -> L {
    let x = ax.abs().max(bx.abs()).max(cx.abs());
    let y = ay.abs().max(by.abs()).max(cy.abs());
    let edges = (L::splat(36.0) * x * y + L::splat(15.0) * size.z * (x + y)) * per_area.abs();
    size.z * ray.shear.z.abs() * (L::splat(9.0) + edges) * L::splat(f32::EPSILON)
}

/// Distances at which lines enter and leave axis-aligned boxes; near > far where they miss.
#[inline(always)]
pub fn intersect_box<L: Lanes>(ray: &PreparedRayLanes<L>, min: V3<L>, max: V3<L>) -> [L; 2] {
    let low = (min - ray.origin) * ray.inverse;
    let high = (max - ray.origin) * ray.inverse;
    [low.min(high).max_element(), low.max(high).min_element()]
}

/// A cone cut between two planes across its axis; a cylinder where the radii are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeFrustum {
    pub base: Vec3,
    /// Unit, from base to apex.
    pub axis: Vec3,
    pub height: f32,
    pub base_radius: f32,
    /// Change of the radius per unit of height.
    pub slope: f32,
    pub capped: bool,
}

/// Part of a frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConePart {
    Side,
    Base,
    Apex,
}

/// How much wider than its rim a cap is tested, so that no ray slips between cap and side.
const RIM: f32 = 1.0 + 8.0 * f32::EPSILON;

impl ConeFrustum {
    pub fn new(base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool) -> Self {
        let height = base.distance(apex);
        // Ends that differ in `f64` may fall together in `f32`: then only the caps are left.
        let axis = (apex - base).normalize_or(Vec3::Y);
        let slope = if height > 0.0 { (apex_radius - base_radius) / height } else { 0.0 };
        ConeFrustum { base, axis, height, base_radius, slope, capped }
    }

    pub fn radius_at(&self, z: f32) -> f32 {
        self.base_radius + self.slope * z
    }

    /// Every crossing at a distance above 0: distance, whether it enters, and the part. Unordered, at most four.
    #[inline]
    pub fn crossings(&self, probe: &PreparedRay, mut found: impl FnMut(f32, bool, ConePart)) {
        for (crossing, part) in intersect_cone::<f32>(&probe.beam(), &self.columns()).into_iter().zip(PARTS) {
            if crossing.met {
                found(crossing.t, crossing.enters, part);
            }
        }
    }

    #[inline]
    fn columns(&self) -> ConeLanes<f32> {
        ConeLanes {
            base: V3::splat(self.base),
            axis: V3::splat(self.axis),
            height: self.height,
            base_radius: self.base_radius,
            slope: self.slope,
            capped: f32::from(u8::from(self.capped)),
        }
    }
}

/// Frusta side by side.
#[derive(Clone, Copy, Debug)]
pub struct ConeLanes<L> {
    pub base: V3<L>,
    pub axis: V3<L>,
    pub height: L,
    pub base_radius: L,
    pub slope: L,
    /// 1 or 0.
    pub capped: L,
}

/// Where lines may cross frusta.
#[derive(Clone, Copy)]
pub struct ConeCrossing<L: Lanes> {
    pub t: L,
    pub enters: L::Mask,
    /// Whether they do, at a distance above 0.
    pub met: L::Mask,
}

/// What each of the four crossings of [`frustum`] lies on.
pub const PARTS: [ConePart; 4] = [ConePart::Side, ConePart::Side, ConePart::Base, ConePart::Apex];

/// Where lines cross the sides and the caps of frusta.
#[inline(always)]
pub fn intersect_cone<L: Lanes>(ray: &PreparedRayLanes<L>, cone: &ConeLanes<L>) -> [ConeCrossing<L>; 4] {
    let zero = L::splat(0.0);
    let d = ray.direction;
    let from_base = ray.origin - cone.base;
    // Solve from the point of the line nearest to the base: precise however far the origin is.
    let shift = zero - from_base.dot(d);
    let o = from_base + d.scale(shift);
    let (oz, dz) = (o.dot(cone.axis), d.dot(cone.axis));
    let (op, dp) = (o - cone.axis.scale(oz), d - cone.axis.scale(dz));
    let (ro, rd) = (cone.base_radius + cone.slope * oz, cone.slope * dz);
    let a = dp.dot(dp) - rd * rd;
    let b = op.dot(dp) - ro * rd;
    let c = op.dot(op) - ro * ro;
    let discriminant = b * b - a * c;
    let real = zero.le(discriminant);
    let root = discriminant.sqrt();
    let q = L::select(zero.lt(b), zero - b - root, root - b);
    let rounds = [(q / a, L::and(real, a.ne(zero))), (c / q, L::and(real, q.ne(zero)))];
    let capped = L::and(zero.lt(cone.capped), dz.ne(zero));
    let ends = [(zero, zero.lt(dz)), (cone.height, dz.lt(zero))];
    let mut crossings = [ConeCrossing { t: zero, enters: real, met: real }; 4];
    let (round, flat) = crossings.split_at_mut(2);
    for (crossing, (s, exists)) in round.iter_mut().zip(rounds) {
        let (z, t) = (oz + dz * s, s + shift);
        let between = L::and(zero.le(z), z.le(cone.height));
        let met = L::and(L::and(exists, between), L::and(zero.le(ro + rd * s), zero.lt(t)));
        *crossing = ConeCrossing { t, enters: (a * s + b).lt(zero), met };
    }
    for (crossing, (z, enters)) in flat.iter_mut().zip(ends) {
        let s = (z - oz) / dz;
        let radius = (cone.base_radius + cone.slope * z) * L::splat(RIM);
        let (t, across) = (s + shift, op + dp.scale(s));
        let met = L::and(capped, L::and(zero.lt(t), across.dot(across).le(radius * radius)));
        *crossing = ConeCrossing { t, enters, met };
    }
    crossings
}

/// Distance to a plane, and whether the ray comes from its front.
#[inline]
pub fn intersect_plane(probe: &PreparedRay, point: Vec3, normal: Vec3) -> Option<(f32, bool)> {
    let facing = normal.dot(probe.direction);
    let t = (point - probe.origin).dot(normal) / facing;
    (t > 0.0 && t < f32::INFINITY).then_some((t, facing < 0.0))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    fn vector(limit: f32) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-limit..limit).prop_map(Vec3::from_array)
    }

    fn probe(origin: Vec3, direction: Vec3) -> PreparedRay {
        PreparedRay::new(origin, direction.normalize_or(Vec3::Z))
    }

    fn sphere(probe: &PreparedRay, center: Vec3, radius: f32) -> Option<[f32; 2]> {
        let (met, hits) = super::intersect_sphere::<f32>(&probe.beam(), V3::splat(center), radius);
        met.then_some(hits)
    }

    fn triangle(probe: &PreparedRay, corners: &[Vec3; 3]) -> Option<(f32, f32, f32, bool)> {
        let turned = corners.map(|p| V3::splat(probe.turned(p)));
        let hits = super::intersect_triangle::<f32>(&probe.beam(), turned)?;
        hits.hit.then_some((hits.t, hits.u, hits.v, hits.front))
    }

    proptest! {
        #[test]
        fn sphere_hits_lie_on_the_sphere(o in vector(50.0), at in vector(1.0), c in vector(5.0), r in 0.01f32..5.0) {
            let probe = probe(o, c + at * r - o);
            if let Some(hits) = sphere(&probe, c, r) {
                prop_assert!(hits[0] <= hits[1]);
                for t in hits {
                    let p = o.as_dvec3() + probe.direction.as_dvec3() * f64::from(t);
                    let off = p.distance(c.as_dvec3()) - f64::from(r);
                    prop_assert!(off.abs() < 1e-4 * (1.0 + f64::from(r)), "{off}");
                }
            } else {
                let f = c.as_dvec3() - o.as_dvec3();
                let nearest = f.cross(probe.direction.as_dvec3()).length();
                prop_assert!(nearest > f64::from(r) * 0.9999 - 1e-4);
            }
        }

        #[test]
        fn triangle_hits_agree_with_double_precision(
            o in vector(10.0), a in vector(3.0), b in vector(3.0), c in vector(3.0), w in prop::array::uniform2(0.0f32..1.0)
        ) {
            let (w1, w2) = if w[0] + w[1] > 1.0 { (1.0 - w[0], 1.0 - w[1]) } else { (w[0], w[1]) };
            let target = a + (b - a) * w1 + (c - a) * w2;
            let normal = (b - a).cross(c - a);
            prop_assume!(normal.length() > 0.1 && (target - o).normalize().dot(normal.normalize()).abs() > 0.05);
            let edge = w1.min(w2).min(1.0 - w1 - w2);
            prop_assume!(edge > 1e-3);
            let probe = probe(o, target - o);
            let (t, u, v, front) = triangle(&probe, &[a, b, c]).unwrap();
            prop_assert!((t - o.distance(target)).abs() < 1e-3);
            prop_assert!((u - w1).abs() < 2e-3 && (v - w2).abs() < 2e-3);
            prop_assert_eq!(front, normal.dot(probe.direction) < 0.0);
        }

        /// Two triangles on either side of an edge: a ray aimed at the edge hits at least one of them.
        #[test]
        fn no_ray_slips_through_a_shared_edge(
            o in vector(10.0), p in vector(1.0), q in vector(1.0), s in 0.0f32..1.0, left in vector(1.0), right in vector(1.0)
        ) {
            let mut target = p + (q - p) * s;
            target += target * f32::EPSILON;
            let d = (target - o).normalize_or(Vec3::Z);
            let across = (q - p).cross(d);
            // Seen from the origin, the third corners lie on opposite sides of the edge.
            prop_assume!(across.length() > 1e-3);
            let away = across.normalize();
            let (l, r) = (p + (q - p) * left.x.abs() + away, p + (q - p) * right.x.abs() - away);
            let probe = probe(o, target - o);
            prop_assume!(s > 0.01 && s < 0.99);
            prop_assert!(triangle(&probe, &[p, q, l]).is_some() || triangle(&probe, &[q, p, r]).is_some());
        }

        #[test]
        fn cone_crossings_lie_on_the_cone(
            o in vector(20.0), at in vector(1.0), base in vector(3.0), apex in vector(3.0), r0 in 0.0f32..2.0, r1 in 0.0f32..2.0
        ) {
            prop_assume!(base.distance(apex) > 0.1 && r0 + r1 > 0.1);
            let cone = ConeFrustum::new(base, r0, apex, r1, true);
            let probe = probe(o, base + (apex - base) * at.x.abs() + at - o);
            let (mut count, mut net) = (0, 0);
            cone.crossings(&probe, |t, enters, part| {
                count += 1;
                net += if enters { 1 } else { -1 };
                let p = (o.as_dvec3() + probe.direction.as_dvec3() * f64::from(t)) - base.as_dvec3();
                let axis: DVec3 = (apex.as_dvec3() - base.as_dvec3()).normalize();
                let z = p.dot(axis);
                let radius = (p - axis * z).length();
                let expected = f64::from(r0) + f64::from(cone.slope) * z;
                match part {
                    ConePart::Side => assert!((radius - expected).abs() < 5e-3, "{radius} {expected}"),
                    ConePart::Base => assert!(z.abs() < 1e-3 && radius < expected + 1e-3),
                    ConePart::Apex => assert!((z - f64::from(cone.height)).abs() < 1e-3 && radius < expected + 1e-3),
                }
            });
            prop_assert!(count <= 4);
            prop_assert!(net == 0 || count == 1 || o.distance(base) < 12.0);
        }
    }

    #[test]
    fn giant_and_tiny_spheres_are_met_where_they_are() {
        let down = probe(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Y);
        let [t, _] = sphere(&down, Vec3::new(0.0, -1e5, 0.0), 1e5).unwrap();
        assert!((t - 3.0).abs() < 1e-2);
        let far = probe(Vec3::new(0.0, 0.0, 1e4), Vec3::NEG_Z);
        let [near, leave] = sphere(&far, Vec3::ZERO, 1e-2).unwrap();
        assert!(near <= leave && (near - 1e4).abs() < 0.02);
    }

    #[test]
    fn boxes_stand_rays_along_their_faces() {
        let (min, max) = (Vec3::ZERO, Vec3::ONE);
        let inside = |p: PreparedRay| {
            let [near, far] = intersect_box::<f32>(&p.beam(), V3::splat(min), V3::splat(max));
            near <= far && far > 0.0
        };
        assert!(inside(probe(Vec3::new(0.5, 0.5, -1.0), Vec3::Z)));
        assert!(!inside(probe(Vec3::new(0.5, 1.5, -1.0), Vec3::Z)));
        assert!(!inside(probe(Vec3::new(0.5, 0.5, -1.0), Vec3::NEG_Z)));
    }
}
