//! Where exactly a hit lies, which way is out, and what it belongs to.

use glam::Vec3;

use super::solid::{Map, Placed, Solid};
use super::{FLAT, Geometry, Kind, Tag};
use crate::trace::shapes::{Frustum, Part};
use crate::trace::surface::{ROUNDING, Surface};
use crate::trace::{Hit, Ray};

impl Geometry {
    /// The point of a hit of this ray.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let n = hit.primitive;
        let tag = self.tag(n);
        let kind = self.kind_of(n);
        let index = (n - self.range(kind).start) as usize;
        let near = || {
            let (_, ray) = self.approach(ray);
            ray.origin + ray.direction * hit.u
        };
        match kind {
            Kind::Sphere => {
                let [x, y, z, r] = self.spheres[index];
                flat(tag, on_sphere(near(), Vec3::new(x, y, z), r))
            }
            Kind::Triangle => {
                let mixed = || {
                    let [na, nb, nc] = self.normals[self.shading[index] as usize];
                    na * (1.0 - hit.u - hit.v) + nb * hit.u + nc * hit.v
                };
                on_triangle(tag, &self.triangles[index], hit, (self.shading[index] != FLAT).then(mixed))
            }
            Kind::Box => {
                let [min, max] = self.boxes[index];
                flat(tag, on_box(near(), min, max))
            }
            Kind::Cone => flat(tag, on_cone(near(), &self.cones[index], hit.v)),
            Kind::Placed => flat(tag, self.placed[index].surface(near(), hit.v)),
            Kind::MeshTriangle => {
                let part = self.part_of(n);
                let triangle = n - part.first;
                let shading = part.shading_normal(triangle, hit.u, hit.v);
                on_triangle(tag, &part.corners(triangle), hit, shading)
            }
            Kind::Instance => {
                let instance = &self.instances[index];
                let model = &self.models[instance.model as usize];
                let shading = model.shading_normal(hit.element, hit.u, hit.v);
                on_triangle(tag, &model.corners(hit.element), hit, shading).placed(&instance.map)
            }
            Kind::Plane => {
                let [point, normal] = self.planes[index];
                let p = ray.origin + ray.direction * hit.t;
                let p = p - normal * (p - point).dot(normal);
                flat(tag, (p, normal, (p.abs() + point.abs()) * ROUNDING))
            }
        }
    }
}

#[inline(always)]
fn flat(tag: Tag, (point, normal, error): (Vec3, Vec3, Vec3)) -> Surface {
    let Tag { material, entity, .. } = tag;
    Surface { point, error, geometric_normal: normal, shading_normal: normal, bent: false, material, entity }
}

/// `shading` is the interpolated normal, of any length.
#[inline(always)]
fn on_triangle(tag: Tag, [a, b, c]: &[Vec3; 3], hit: &Hit, shading: Option<Vec3>) -> Surface {
    let w = 1.0 - hit.u - hit.v;
    let point = *a * w + *b * hit.u + *c * hit.v;
    let error = a.abs().max(b.abs()).max(c.abs()) * ROUNDING;
    let normal = (*b - *a).cross(*c - *a).normalize_or(Vec3::Y);
    let mut surface = flat(tag, (point, normal, error));
    if let Some(mixed) = shading {
        let mixed = mixed.normalize_or(normal);
        surface.shading_normal = if mixed.dot(normal) < 0.0 { -mixed } else { mixed };
    }
    surface
}

/// A local point with its uncertainty carried into the world.
fn to_world(map: &Map, local: Vec3, error: Vec3) -> (Vec3, Vec3) {
    let point = map.to_world * local + map.anchor;
    // The local error, and that of the map and of the test from the other side of it.
    let error = map.spread(error + local.abs() * ROUNDING) * 2.0 + (point.abs() + map.anchor.abs()) * ROUNDING;
    (point, error)
}

impl Surface {
    fn placed(self, map: &Map) -> Surface {
        let (point, error) = to_world(map, self.point, self.error);
        let turned = |n: Vec3| (map.normals * n).normalize_or(Vec3::Y);
        let (geometric_normal, shading_normal) = (turned(self.geometric_normal), turned(self.shading_normal));
        Surface { point, error, geometric_normal, shading_normal, ..self }
    }
}

impl Placed {
    fn surface(&self, point: Vec3, part: f32) -> (Vec3, Vec3, Vec3) {
        let local = self.map.to_local * (point - self.map.anchor);
        let (p, n, e) = match self.shape {
            Solid::Sphere { center, radius } => on_sphere(local, center, radius),
            Solid::Box { min, max } => on_box(local, min, max),
            Solid::Cone(cone) => on_cone(local, &cone, part),
        };
        let (point, error) = to_world(&self.map, p, e);
        (point, (self.map.normals * n).normalize_or(Vec3::Y), error)
    }
}

fn on_sphere(near: Vec3, center: Vec3, radius: f32) -> (Vec3, Vec3, Vec3) {
    let normal = (near - center).normalize_or(Vec3::Y);
    let point = center + normal * radius;
    (point, normal, (center.abs() + radius) * ROUNDING)
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

fn on_cone(near: Vec3, cone: &Frustum, part: f32) -> (Vec3, Vec3, Vec3) {
    let from_base = near - cone.base;
    let z = from_base.dot(cone.axis).clamp(0.0, cone.height);
    let radial = from_base - cone.axis * from_base.dot(cone.axis);
    let widest = cone.base_radius.max(cone.radius_at(cone.height));
    let error = (cone.base.abs() + cone.height + widest) * ROUNDING;
    if part == Part::Base as u8 as f32 {
        return (cone.base + radial, -cone.axis, error);
    }
    if part == Part::Apex as u8 as f32 {
        return (cone.base + cone.axis * cone.height + radial, cone.axis, error);
    }
    let outward = radial.normalize_or(cone.axis.any_orthonormal_vector());
    let point = cone.base + cone.axis * z + outward * cone.radius_at(z);
    (point, (outward - cone.axis * cone.slope).normalize(), error)
}
