//! Triangles: those that stand alone, and what those of meshes share with them.
//!
//! The test is that of Woop, Benthin and Wald (Watertight Ray/Triangle Intersection, JCGT 2013): edge functions whose signs
//! are exactly opposite along a shared edge, so that no ray slips between two triangles.

use glam::{Vec2, Vec3};

use super::area::AreaSampling;
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveColumn;
use super::interaction::InteractionLanes;
use super::prepared_ray::{PreparedRay, PreparedRayLanes};
use super::sphere::globe;
use super::surface::{BarePoint, ROUNDING, SurfacePoint};
use super::tag::{Sides, Tag};
use super::terminator::SmoothFacet;
use super::uv::{ObjectSpace, SurfaceUv, UvPoint};
use crate::trace::sampler::in_triangle;
use crate::trace::simd::{LANES, Lanes, V3, lane, lanes};
use crate::trace::soa::{Hit, Ray};

/// Number of a flat triangle's shading normals.
const FLAT: u32 = u32::MAX;

/// Triangles that stand alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    corners: Vec<[Vec3; 3]>,
    tags: Vec<Tag>,
    /// Index into `normals` per triangle.
    shading: Vec<u32>,
    normals: Vec<[Vec3; 3]>,
    /// Texture coordinates of the triangles that have any, by their index, rising.
    uvs: Vec<(u32, [Vec2; 3])>,
}

impl Triangles {
    /// Corners are counter-clockwise seen from the front; `normals` of any length shade it smoothly.
    pub fn push(&mut self, tag: Tag, corners: [Vec3; 3], normals: Option<[Vec3; 3]>) {
        self.corners.push(corners);
        self.tags.push(tag);
        self.shading.push(normals.map_or(FLAT, |_| self.normals.len() as u32));
        self.normals.extend(normals);
    }

    /// Texture coordinates of the corners of the triangle that was pushed last.
    pub fn texture_last(&mut self, uvs: [Vec2; 3]) {
        if let Some(last) = self.corners.len().checked_sub(1) {
            self.uvs.push((last as u32, uvs));
        }
    }

    #[inline]
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.corners[i]
    }

    /// Direction of the shading normal, if it is smooth; any length.
    #[inline(always)]
    fn mixed_normal(&self, i: usize, [u, v]: [f32; 2]) -> Option<Vec3> {
        let [a, b, c] = self.normals.get(self.shading[i] as usize)?;
        Some(*a * (1.0 - u - v) + *b * u + *c * v)
    }
}

impl PrimitiveColumn for Triangles {
    const IS_SAMPLED: bool = true;
    type Area = AreaTriangle;

    fn len(&self) -> usize {
        self.corners.len()
    }

    #[inline]
    fn tag(&self, i: usize) -> Tag {
        self.tags[i]
    }

    fn bounds(&self, i: usize) -> Bounds {
        Bounds::around(&self.corners[i])
    }

    fn intersect(&self, i: usize, number: u32, ray: &PreparedRay, closest: &mut ClosestHit) {
        offer_triangle(ray, &self.corners[i], self.tags[i].sides, number, closest);
    }

    #[inline]
    fn surface_point(&self, i: usize, _: &Ray, _: impl Fn() -> Vec3, hit: &Hit) -> SurfacePoint {
        on_triangle(&self.corners[i], hit, self.mixed_normal(i, [hit.u, hit.v])).of(self.tags[i])
    }

    fn uv(&self, i: usize, hit: &Hit, surface: &SurfacePoint, space: &ObjectSpace) -> SurfaceUv {
        let at = self.uvs.binary_search_by_key(&(i as u32), |(triangle, _)| *triangle);
        let uvs = at.ok().map(|at| self.uvs[at].1);
        wrapped(surface, space).filter(|_| uvs.is_none()).unwrap_or_else(|| patch(self.corners[i], uvs, hit))
    }

    fn smooth_facet(&self, i: usize, _: &Hit) -> Option<SmoothFacet> {
        let normals = *self.normals.get(self.shading[i] as usize)?;
        Some(SmoothFacet { corners: self.corners[i], normals })
    }

    #[inline(always)]
    fn gather(&self, i: usize, uv: [f32; 2], lane: usize, lanes: &mut InteractionLanes) -> bool {
        lanes.add_triangle(lane, self.corners[i], self.mixed_normal(i, uv));
        true
    }

    fn area_shapes(&self, wanted: &dyn Fn(Tag) -> bool, visit: &mut dyn FnMut(usize, u32, Tag, AreaTriangle)) {
        for (i, (corners, tag)) in self.corners.iter().zip(&self.tags).enumerate() {
            if wanted(*tag) {
                visit(i, 0, *tag, AreaTriangle::new(*corners));
            }
        }
    }
}

/// Keeps the hit of a triangle whose element is its own number.
pub fn offer_triangle(ray: &PreparedRay, corners: &[Vec3; 3], sides: Sides, number: u32, closest: &mut ClosestHit) {
    if let Some((t, u, v, front)) = intersect_corners(ray, corners)
        && sides.shows(front)
    {
        closest.offer(t, number, number, u, v);
    }
}

/// Distance, weights of the second and third corner, and whether the front is hit.
pub fn intersect_corners(ray: &PreparedRay, corners: &[Vec3; 3]) -> Option<(f32, f32, f32, bool)> {
    let hits = intersect_triangle::<f32>(&ray.beam(), corners.map(|p| V3::splat(ray.turned(p))))?;
    hits.hit.then_some((hits.t, hits.u, hits.v, hits.front))
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
    let met = L::and(L::and(inside, area.ne(zero)), near.le(far));
    let front = zero.lt(area * sz);
    let sure = L::and(met, doubt.lt(t));
    let (mut hit, mut t) = (sure, t);
    // So near that the distance may have the wrong sign: whether the triangle lies ahead is then asked of the numbers as
    // they are, one by one where lanes cannot tell. A ray that starts in the corner of a room would slip through the
    // other wall otherwise.
    let unsure = L::and(L::and(met, L::not(sure)), (zero - doubt).le(t));
    if L::any(unsure) && !ray.is_mapped {
        let (mut ahead, unclear) = lie_ahead(unsure, front, a, corners);
        if L::any(unclear) {
            // As plain numbers: instructions of AVX would be calls out there.
            let [a, b, c] = &corners;
            let (corners, origin) = ([a.store(), b.store(), c.store()], ray.turned_origin.store());
            let found = which_are_ahead(L::bits(unclear), L::bits(front), &origin, &corners);
            ahead = L::or(ahead, L::mask(found));
        }
        hit = L::or(hit, ahead);
        t = L::select(ahead, t.max(L::splat(f32::MIN_POSITIVE)), t);
    }
    Some(TriangleHits { t, u: v * per_area, v: w * per_area, front, hit })
}

/// What the error of a height over a triangle's plane is at most, relative to the products that it is a sum of: eight
/// roundings by half of this on the way of each, and two to spare.
const HEIGHT_ROUNDING: f32 = 5.0 * f32::EPSILON;

/// Of these lanes, those where the plane of the triangle lies ahead of a ray that comes from its front or back, and those
/// where the height of the ray's start over it is too small for `f32` to tell. `a` is the first corner from that start.
#[inline(always)]
fn lie_ahead<L: Lanes>(which: L::Mask, front: L::Mask, a: V3<L>, corners: [V3<L>; 3]) -> (L::Mask, L::Mask) {
    let zero = L::splat(0.0);
    let (b, c) = (corners[1] - corners[0], corners[2] - corners[0]);
    let (plus, minus) =
        (V3 { x: b.y * c.z, y: b.z * c.x, z: b.x * c.y }, V3 { x: b.z * c.y, y: b.x * c.z, z: b.y * c.x });
    let height = zero - (plus - minus).dot(a);
    let far = a.abs();
    let least = L::splat(f32::MIN_POSITIVE);
    // Products may vanish, too.
    let error =
        (plus.abs() + minus.abs()).dot(far) * L::splat(HEIGHT_ROUNDING) + (far.x + far.y + far.z + least) * least;
    let (above, below) = (L::and(which, error.lt(height)), L::and(which, height.lt(zero - error)));
    let ahead = L::or(L::and(above, front), L::and(below, L::not(front)));
    (ahead, L::and(which, L::not(L::or(above, below))))
}

/// Of the lanes that have a bit, those where the plane of the triangle lies ahead of a ray that comes from its front or
/// back, by `f64` on the `f32` numbers that are given: the products are exact, and what is left of error is far below the
/// offset with which rays leave surfaces.
#[inline(never)]
fn which_are_ahead(unsure: u32, front: u32, origin: &[[f32; LANES]; 3], corners: &[[[f32; LANES]; 3]; 3]) -> u32 {
    let mut ahead = 0;
    for i in lanes(unsure) {
        let [a, b, c] = corners.each_ref().map(|corner| lane(corner, i).as_dvec3());
        let height = (b - a).cross(c - a).dot(lane(origin, i).as_dvec3() - a);
        let is_ahead = if front >> i & 1 == 1 { height > 0.0 } else { height < 0.0 };
        ahead |= u32::from(is_ahead) << i;
    }
    ahead
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

/// A point of a triangle, and its shading normal.
#[derive(Clone, Copy)]
pub struct ShadedPoint {
    pub bare: BarePoint,
    pub shading_normal: Vec3,
}

impl ShadedPoint {
    #[inline(always)]
    pub fn of(self, tag: Tag) -> SurfacePoint {
        SurfacePoint { shading_normal: self.shading_normal, ..self.bare.of(tag) }
    }
}

/// `shading` is the interpolated normal, of any length.
#[inline(always)]
pub fn on_triangle(corners: &[Vec3; 3], hit: &Hit, shading: Option<Vec3>) -> ShadedPoint {
    let (point, normal, error) = triangle_point(corners.map(V3::<f32>::from), [hit.u, hit.v]);
    let bare = BarePoint { point: point.into(), normal: normal.into(), error: error.into() };
    let shading_normal = shading.map_or(bare.normal, |mixed| smoothed(mixed.into(), normal).into());
    ShadedPoint { bare, shading_normal }
}

/// How far points of a triangle are drawn towards its middle, as a share of the way: so far that rounding does not push
/// one over an edge, and with it through a wall that stands on that edge.
const INWARDS: f32 = 8.0 * f32::EPSILON;

/// Point, normal and error at weights of the second and third corner.
#[inline(always)]
pub fn triangle_point<L: Lanes>([a, b, c]: [V3<L>; 3], [u, v]: [L; 2]) -> (V3<L>, V3<L>, V3<L>) {
    let (third, inwards) = (L::splat(1.0 / 3.0), L::splat(INWARDS));
    let (u, v) = (u + (third - u) * inwards, v + (third - v) * inwards);
    let w = L::splat(1.0) - u - v;
    let point = a.scale(w) + b.scale(u) + c.scale(v);
    let error = a.abs().max(b.abs()).max(c.abs()).scale(L::splat(ROUNDING));
    (point, (b - a).cross(c - a).normalize_or(V3::splat(Vec3::Y)), error)
}

/// The interpolated normal, of any length, as a unit vector on the side of the true one.
#[inline(always)]
pub fn smoothed<L: Lanes>(mixed: V3<L>, normal: V3<L>) -> V3<L> {
    let mixed = mixed.normalize_or(normal);
    V3::select(mixed.dot(normal).lt(L::splat(0.0)), -mixed, mixed)
}

/// Texture coordinates of a mesh without any that is wrapped like a sphere, if it is.
pub fn wrapped(surface: &SurfacePoint, space: &ObjectSpace) -> Option<SurfaceUv> {
    let at = UvPoint::new(surface, &space.map);
    space.center.map(|center| globe(at.local - center).carried(&space.map, surface))
}

/// Texture coordinates of a triangle; gradients lie in its plane, in the space of its corners.
pub fn patch([a, b, c]: [Vec3; 3], uvs: Option<[Vec2; 3]>, hit: &Hit) -> SurfaceUv {
    let [ta, tb, tc] = uvs.unwrap_or([Vec2::ZERO, Vec2::X, Vec2::Y]);
    let (u, v) = (hit.u, hit.v);
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let per_area = 1.0 / normal.length_squared();
    // Gradients of the weights of the second and third corner.
    let [gu, gv] = [ac.cross(normal) * per_area, normal.cross(ab) * per_area];
    let gradient = |b: f32, c: f32| {
        let g = gu * b + gv * c;
        if g.is_finite() { g } else { Vec3::ZERO }
    };
    let (tb, tc) = (tb - ta, tc - ta);
    SurfaceUv { uv: ta + tb * u + tc * v, gradients: [gradient(tb.x, tc.x), gradient(tb.y, tc.y)], ends: [false; 2] }
}

/// A triangle to be sampled by area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaTriangle {
    corner: Vec3,
    /// From the corner; counter-clockwise from the front.
    edges: [Vec3; 2],
}

impl AreaTriangle {
    pub fn new([a, b, c]: [Vec3; 3]) -> Self {
        AreaTriangle { corner: a, edges: [b - a, c - a] }
    }
}

impl AreaSampling for AreaTriangle {
    const IS_CLOSED: bool = false;

    fn area(&self) -> f32 {
        let [a, b] = self.edges;
        0.5 * a.cross(b).length()
    }

    fn point(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        let ([a, b], [s, t]) = (self.edges, in_triangle(u));
        (self.corner + a * s + b * t, a.cross(b).normalize_or(Vec3::Y))
    }

    fn area_bounds(&self) -> Bounds {
        let ([a, b], corner) = (self.edges, self.corner);
        Bounds::around(&[corner, corner + a, corner + b])
    }

    fn extent(&self) -> Vec3 {
        let [a, b] = self.edges;
        self.corner.abs() + a.abs() + b.abs()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::{lie_ahead, which_are_ahead};
    use crate::base::random::{combine, unit_f32};
    use crate::trace::simd::{LANES, V3};

    #[test]
    fn lanes_that_tell_what_lies_ahead_agree_with_twice_the_digits() {
        let mut clear = [0; 2];
        for i in 0..20_000 {
            let random = |k| Vec3::from_array(std::array::from_fn(|c| unit_f32(combine(combine(i, k), c as u64))));
            let corners = [random(0), random(1), random(2)].map(|corner| corner * 4.0 - 2.0);
            let [a, b, c] = corners;
            // On the plane up to rounding, or a few roundings off it.
            let [u, v] = [random(3).x, random(3).y];
            let off = (b - a).cross(c - a).normalize() * ((random(4).x - 0.5) * 1e-5 * random(4).y);
            let origin = a + (b - a) * u + (c - a) * v + off;
            for front in [false, true] {
                let (ahead, unclear) = lie_ahead::<f32>(true, front, V3::splat(a - origin), corners.map(V3::splat));
                let all = corners.map(|corner| corner.to_array().map(|x| [x; LANES]));
                let exact = which_are_ahead(1, u32::from(front), &origin.to_array().map(|x| [x; LANES]), &all) == 1;
                assert!(unclear || ahead == exact, "{corners:?} {origin:?}");
                clear[usize::from(unclear)] += 1;
            }
        }
        assert!(clear[0] > 4_000 && clear[1] > 4_000, "{clear:?}");
    }
}
