//! Where exactly a hit lies, which way is out, and what it belongs to.

use glam::Vec3;

use super::geometry::{Geometry, PrimitiveKind};
use super::shapes::{ConeFrustum, ConePart};
use super::surface::{ROUNDING, SurfacePoint, SurfacePointLanes};
use super::tag::Tag;
use super::transformed::{AffineMap, PreparedShape, TransformedShape};
use crate::trace::simd::{LANES, Lanes, V3, Wide, lane, lanes_to_bits, set_lane};
use crate::trace::soa::{Hit, HitLanes, Ray, RayLanes};

impl Geometry {
    /// The point of a hit of this ray.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let n = hit.primitive;
        let tag = self.tag(n);
        let kind = self.kind_of(n);
        let index = (n - self.range(kind).start) as usize;
        let near = || {
            let (_, ray) = self.approach(ray);
            ray.origin + ray.direction * hit.u
        };
        match kind {
            PrimitiveKind::Sphere => {
                let [x, y, z, r] = self.spheres[index];
                flat(tag, on_sphere(near(), Vec3::new(x, y, z), r))
            }
            PrimitiveKind::Triangle => {
                on_triangle(tag, &self.triangles[index], hit, self.mixed_normal(index, [hit.u, hit.v]))
            }
            PrimitiveKind::Box => {
                let [min, max] = self.boxes[index];
                flat(tag, on_box(near(), min, max))
            }
            PrimitiveKind::Cone => flat(tag, on_cone(near(), &self.cones[index], hit.v)),
            PrimitiveKind::TransformedShape => flat(tag, self.placed[index].surface(near(), hit.v)),
            PrimitiveKind::MeshTriangle => {
                let part = self.part_of(n);
                let triangle = n - part.first;
                let shading = part.shading_normal(triangle, hit.u, hit.v);
                on_triangle(tag, &part.corners(triangle), hit, shading)
            }
            PrimitiveKind::Instance => {
                let instance = &self.instances[index];
                let model = &self.models[instance.model as usize];
                let shading = model.shading_normal(hit.element, hit.u, hit.v);
                on_triangle(tag, &model.corners(hit.element), hit, shading).placed(&instance.map)
            }
            PrimitiveKind::Plane => {
                let [point, normal] = self.planes[index];
                let p = ray.origin + ray.direction * hit.t;
                let p = p - normal * (p - point).dot(normal);
                flat(tag, (p, normal, (p.abs() + point.abs()) * ROUNDING))
            }
        }
    }
}

impl Geometry {
    /// Direction of the shading normal of a triangle that stands alone, if it is smooth; any length.
    #[inline(always)]
    fn mixed_normal(&self, index: usize, [u, v]: [f32; 2]) -> Option<Vec3> {
        let [a, b, c] = self.normals.get(self.shading[index] as usize)?;
        Some(*a * (1.0 - u - v) + *b * u + *c * v)
    }
}

/// What points of hits are made from, column by column.
#[derive(Default)]
struct PointColumns {
    corners: [[[f32; LANES]; 3]; 3],
    mixed: [[f32; LANES]; 3],
    /// A bit for each lane with a triangle, with a smooth one, with a sphere.
    triangles: u32,
    smooth: u32,
    spheres: u32,
    center: [[f32; LANES]; 3],
    radius: [f32; LANES],
    /// Of all other shapes: point, error, geometric and shading normal.
    others: [[[f32; LANES]; 3]; 4],
}

impl PointColumns {
    #[inline(always)]
    fn triangle(&mut self, lane: usize, corners: [Vec3; 3], mixed: Option<Vec3>) {
        self.triangles |= 1 << lane;
        for (column, corner) in self.corners.iter_mut().zip(&corners) {
            set_lane(column, lane, *corner);
        }
        if let Some(mixed) = mixed {
            self.smooth |= 1 << lane;
            set_lane(&mut self.mixed, lane, mixed);
        }
    }

    fn other(&mut self, lane: usize, s: &SurfacePoint) {
        for (column, v) in self.others.iter_mut().zip([s.point, s.error, s.geometric_normal, s.shading_normal]) {
            set_lane(column, lane, v);
        }
    }
}

impl Geometry {
    /// As [`Self::surface`] for eight hits.
    #[inline(always)]
    pub fn surfaces<L: Wide>(&self, rays: &RayLanes<L>, hits: &HitLanes<L>) -> SurfacePointLanes<L> {
        let mut columns = PointColumns::default();
        let (u, v) = (hits.u.store(), hits.v.store());
        let (primitives, elements) = (lanes_to_bits(hits.primitive), lanes_to_bits(hits.element));
        for lane in 0..LANES {
            if !self.gather(&mut columns, lane, primitives[lane], [u[lane], v[lane]]) {
                let ray = Ray::new(one_lane(&rays.origin, lane), one_lane(&rays.direction, lane));
                let (primitive, element) = (primitives[lane], elements[lane]);
                let hit = Hit { t: hits.t.store()[lane], u: u[lane], v: v[lane], primitive, element };
                columns.other(lane, &self.surface(&ray, &hit));
            }
        }
        let [point, error, geometric, shading] = &columns.others;
        let mut points = SurfacePointLanes {
            point: V3::load(point),
            error: V3::load(error),
            geometric_normal: V3::load(geometric),
            shading_normal: V3::load(shading),
        };
        if columns.triangles != 0 {
            let [a, b, c] = &columns.corners;
            let corners = [V3::load(a), V3::load(b), V3::load(c)];
            let (point, normal, error) = triangle_point(corners, [hits.u, hits.v]);
            let mut shading = normal;
            if columns.smooth != 0 {
                let smooth = smoothed(V3::load(&columns.mixed), normal);
                shading = V3::select(L::mask(columns.smooth), smooth, normal);
            }
            points.put(L::mask(columns.triangles), [point, error, normal, shading]);
        }
        if columns.spheres != 0 {
            let center = V3::load(&columns.center);
            let (_, origin) = self.approached(rays.origin, rays.direction);
            let near = origin + rays.direction.scale(hits.u);
            let (point, normal, error) = sphere_point(near, center, L::load(&columns.radius));
            points.put(L::mask(columns.spheres), [point, error, normal, normal]);
        }
        points
    }

    /// Puts the primitive that a ray met at these parameters into its lane; false for shapes without lanes.
    #[inline(always)]
    fn gather(&self, columns: &mut PointColumns, lane: usize, n: u32, [u, v]: [f32; 2]) -> bool {
        let kind = self.kind_of(n);
        let index = (n - self.range(kind).start) as usize;
        match kind {
            PrimitiveKind::MeshTriangle => {
                let part = self.part_of(n);
                let triangle = n - part.first;
                columns.triangle(lane, part.corners(triangle), part.shading_normal(triangle, u, v));
            }
            PrimitiveKind::Triangle => columns.triangle(lane, self.triangles[index], self.mixed_normal(index, [u, v])),
            PrimitiveKind::Sphere => {
                let [x, y, z, r] = self.spheres[index];
                columns.spheres |= 1 << lane;
                set_lane(&mut columns.center, lane, Vec3::new(x, y, z));
                columns.radius[lane] = r;
            }
            _ => return false,
        }
        true
    }
}

/// The vector of one lane.
fn one_lane<L: Wide>(lanes: &V3<L>, i: usize) -> Vec3 {
    lane(&lanes.store(), i)
}

#[inline(always)]
fn flat(tag: Tag, (point, normal, error): (Vec3, Vec3, Vec3)) -> SurfacePoint {
    let Tag { material, entity, .. } = tag;
    SurfacePoint { point, error, geometric_normal: normal, shading_normal: normal, bent: false, material, entity }
}

/// `shading` is the interpolated normal, of any length.
#[inline(always)]
fn on_triangle(tag: Tag, corners: &[Vec3; 3], hit: &Hit, shading: Option<Vec3>) -> SurfacePoint {
    let (point, normal, error) = triangle_point(corners.map(V3::<f32>::from), [hit.u, hit.v]);
    let mut surface = flat(tag, (point.into(), normal.into(), error.into()));
    if let Some(mixed) = shading {
        surface.shading_normal = smoothed(mixed.into(), normal).into();
    }
    surface
}

/// Point, normal and error at weights of the second and third corner.
#[inline(always)]
fn triangle_point<L: Lanes>([a, b, c]: [V3<L>; 3], [u, v]: [L; 2]) -> (V3<L>, V3<L>, V3<L>) {
    let w = L::splat(1.0) - u - v;
    let point = a.scale(w) + b.scale(u) + c.scale(v);
    let error = a.abs().max(b.abs()).max(c.abs()).scale(L::splat(ROUNDING));
    (point, (b - a).cross(c - a).normalize_or(V3::splat(Vec3::Y)), error)
}

/// The interpolated normal, of any length, as a unit vector on the side of the true one.
#[inline(always)]
fn smoothed<L: Lanes>(mixed: V3<L>, normal: V3<L>) -> V3<L> {
    let mixed = mixed.normalize_or(normal);
    V3::select(mixed.dot(normal).lt(L::splat(0.0)), -mixed, mixed)
}

/// A local point with its uncertainty carried into the world.
fn to_world(map: &AffineMap, local: Vec3, error: Vec3) -> (Vec3, Vec3) {
    let point = map.to_world * local + map.anchor;
    // The local error, and that of the map and of the test from the other side of it.
    let error = map.spread(error + local.abs() * ROUNDING) * 2.0 + (point.abs() + map.anchor.abs()) * ROUNDING;
    (point, error)
}

impl SurfacePoint {
    fn placed(self, map: &AffineMap) -> SurfacePoint {
        let (point, error) = to_world(map, self.point, self.error);
        let turned = |n: Vec3| (map.normals * n).normalize_or(Vec3::Y);
        let (geometric_normal, shading_normal) = (turned(self.geometric_normal), turned(self.shading_normal));
        SurfacePoint { point, error, geometric_normal, shading_normal, ..self }
    }
}

impl TransformedShape {
    fn surface(&self, point: Vec3, part: f32) -> (Vec3, Vec3, Vec3) {
        let local = self.map.to_local * (point - self.map.anchor);
        let (p, n, e) = match self.shape {
            PreparedShape::Sphere { center, radius } => on_sphere(local, center, radius),
            PreparedShape::Box { min, max } => on_box(local, min, max),
            PreparedShape::Cone(cone) => on_cone(local, &cone, part),
        };
        let (point, error) = to_world(&self.map, p, e);
        (point, (self.map.normals * n).normalize_or(Vec3::Y), error)
    }
}

fn on_sphere(near: Vec3, center: Vec3, radius: f32) -> (Vec3, Vec3, Vec3) {
    let (point, normal, error) = sphere_point::<f32>(near.into(), center.into(), radius);
    (point.into(), normal.into(), error.into())
}

/// Point, normal and error next to a point.
#[inline(always)]
fn sphere_point<L: Lanes>(near: V3<L>, center: V3<L>, radius: L) -> (V3<L>, V3<L>, V3<L>) {
    let normal = (near - center).normalize_or(V3::splat(Vec3::Y));
    let error = center.abs() + V3 { x: radius, y: radius, z: radius };
    (center + normal.scale(radius), normal, error.scale(L::splat(ROUNDING)))
}

/// The nearest face, with the point exactly on it.
fn on_box(near: Vec3, min: Vec3, max: Vec3) -> (Vec3, Vec3, Vec3) {
    let mut point = near.clamp(min, max);
    let (below, above) = ((near - min).abs().to_array(), (max - near).abs().to_array());
    let mut face = (0, below[0], -1.0);
    for axis in 0..3 {
        for (distance, side) in [(below[axis], -1.0), (above[axis], 1.0)] {
            if distance < face.1 {
                face = (axis, distance, side);
            }
        }
    }
    let (axis, _, side) = face;
    point[axis] = if side < 0.0 { min[axis] } else { max[axis] };
    let mut normal = Vec3::ZERO;
    normal[axis] = side;
    (point, normal, Vec3::ZERO)
}

fn on_cone(near: Vec3, cone: &ConeFrustum, part: f32) -> (Vec3, Vec3, Vec3) {
    let from_base = near - cone.base;
    let z = from_base.dot(cone.axis).clamp(0.0, cone.height);
    let radial = from_base - cone.axis * from_base.dot(cone.axis);
    let widest = cone.base_radius.max(cone.radius_at(cone.height));
    let error = (cone.base.abs() + cone.height + widest) * ROUNDING;
    if part == ConePart::Base as u8 as f32 {
        return (cone.base + radial, -cone.axis, error);
    }
    if part == ConePart::Apex as u8 as f32 {
        return (cone.base + cone.axis * cone.height + radial, cone.axis, error);
    }
    let outward = radial.normalize_or(cone.axis.any_orthonormal_vector());
    let point = cone.base + cone.axis * z + outward * cone.radius_at(z);
    (point, (outward - cone.axis * cone.slope).normalize(), error)
}
