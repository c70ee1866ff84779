//! Primitives as columns, one set per kind, numbered through.
//!
//! After [`Geometry::finish`] numbers run over the kinds in a fixed order (spheres, triangles, boxes, cones, placed
//! shapes, planes), so that the kind of a primitive is a comparison of its number. Where two primitives are met at the
//! same distance the lower number wins, whatever finds them: pictures do not depend on the accelerator.

use glam::{DAffine3, Mat3, Vec3};

use super::ray::{Hit, Ray};
use super::shapes::{Frustum, Part, Probe, plane, slab, sphere, triangle};
use super::surface::{ROUNDING, Surface};

/// Which sides of a primitive are there for rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    #[default]
    Both,
    /// Only the outside.
    Front,
    /// Only the inside.
    Back,
}

impl Sides {
    #[inline]
    fn shows(self, front: bool) -> bool {
        match self {
            Sides::Both => true,
            Sides::Front => front,
            Sides::Back => !front,
        }
    }
}

/// What a primitive belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tag {
    /// Authored index of the entity.
    pub entity: u32,
    /// Index of the material.
    pub material: u32,
    pub sides: Sides,
}

/// A shape that stands in its own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalShape {
    Sphere { center: Vec3, radius: f32 },
    Box { min: Vec3, max: Vec3 },
    Cone { base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool },
}

/// A shape under an affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placed {
    shape: Solid,
    /// Where the local origin stands in the world.
    anchor: Vec3,
    to_world: Mat3,
    to_local: Mat3,
    /// Inverse transpose of `to_world`, up to a positive factor.
    normals: Mat3,
}

/// The shapes that have an inside, ready to be tested.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Solid {
    Sphere { center: Vec3, radius: f32 },
    Box { min: Vec3, max: Vec3 },
    Cone(Frustum),
}

/// An axis-aligned box that may be empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Bounds { min: Vec3::splat(f32::INFINITY), max: Vec3::splat(f32::NEG_INFINITY) }
    }
}

impl Bounds {
    pub fn around(points: &[Vec3]) -> Self {
        points.iter().fold(Bounds::default(), |b, p| Bounds { min: b.min.min(*p), max: b.max.max(*p) })
    }

    pub fn union(self, other: Bounds) -> Self {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Side lengths; zero if empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    pub fn center(&self) -> Vec3 {
        self.min + self.size() * 0.5
    }
}

/// Number of a flat triangle's shading normals.
const FLAT: u32 = u32::MAX;

/// All primitives of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Centre and radius.
    spheres: Vec<[f32; 4]>,
    triangles: Vec<[Vec3; 3]>,
    /// Index into `normals` per triangle.
    shading: Vec<u32>,
    normals: Vec<[Vec3; 3]>,
    boxes: Vec<[Vec3; 2]>,
    cones: Vec<Frustum>,
    placed: Vec<Placed>,
    /// Point and unit normal.
    planes: Vec<[Vec3; 2]>,
    /// Tags by kind while primitives are added; one column by number afterwards.
    pending: [Vec<Tag>; 6],
    tags: Vec<Tag>,
    /// Number at which each kind ends.
    ends: [u32; 6],
    bounds: Bounds,
    reach: f32,
}

/// The nearest hit so far.
#[derive(Clone, Copy, Debug)]
pub struct Best {
    pub t: f32,
    pub primitive: u32,
    pub u: f32,
    pub v: f32,
    pub found: bool,
}

impl Best {
    pub fn within(t_max: f32) -> Self {
        Best { t: t_max, primitive: 0, u: 0.0, v: 0.0, found: false }
    }

    #[inline]
    fn offer(&mut self, t: f32, primitive: u32, u: f32, v: f32) {
        if t < self.t || (t == self.t && self.found && primitive < self.primitive) {
            *self = Best { t, primitive, u, v, found: true };
        }
    }
}

impl Geometry {
    pub fn push_sphere(&mut self, tag: Tag, center: Vec3, radius: f32) {
        self.spheres.push([center.x, center.y, center.z, radius]);
        self.pending[0].push(tag);
    }

    /// Corners are counter-clockwise seen from the front; `normals` of any length shade it smoothly.
    pub fn push_triangle(&mut self, tag: Tag, corners: [Vec3; 3], normals: Option<[Vec3; 3]>) {
        self.triangles.push(corners);
        self.shading.push(normals.map_or(FLAT, |_| self.normals.len() as u32));
        self.normals.extend(normals);
        self.pending[1].push(tag);
    }

    /// A box along the world's axes.
    pub fn push_box(&mut self, tag: Tag, min: Vec3, max: Vec3) {
        self.boxes.push([min, max]);
        self.pending[2].push(tag);
    }

    pub fn push_cone(&mut self, tag: Tag, base: Vec3, base_radius: f32, apex: Vec3, apex_radius: f32, capped: bool) {
        self.cones.push(Frustum::new(base, base_radius, apex, apex_radius, capped));
        self.pending[3].push(tag);
    }

    /// Any shape under any invertible affine map.
    pub fn push_placed(&mut self, tag: Tag, shape: LocalShape, to_world: &DAffine3) {
        let m = to_world.matrix3;
        let inverse = m.inverse();
        let shape = match shape {
            LocalShape::Sphere { center, radius } => Solid::Sphere { center, radius },
            LocalShape::Box { min, max } => Solid::Box { min, max },
            LocalShape::Cone { base, base_radius, apex, apex_radius, capped } => {
                Solid::Cone(Frustum::new(base, base_radius, apex, apex_radius, capped))
            }
        };
        self.placed.push(Placed {
            shape,
            anchor: to_world.translation.as_vec3(),
            to_world: m.as_mat3(),
            to_local: inverse.as_mat3(),
            normals: inverse.transpose().as_mat3(),
        });
        self.pending[4].push(tag);
    }

    /// `normal` is unit.
    pub fn push_plane(&mut self, tag: Tag, point: Vec3, normal: Vec3) {
        self.planes.push([point, normal]);
        self.pending[5].push(tag);
    }

    /// Numbers the primitives and computes what is derived; to be called once, after the last push.
    pub fn finish(&mut self) {
        let mut end = 0;
        for (kind, tags) in self.pending.iter_mut().enumerate() {
            end += tags.len() as u32;
            self.ends[kind] = end;
            self.tags.append(tags);
            *tags = Vec::new();
        }
        self.bounds = (0..self.finite()).fold(Bounds::default(), |b, n| b.union(self.bounds_of(n)));
        self.reach = self.bounds.size().length();
    }

    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.tags.len() + self.pending.iter().map(Vec::len).sum::<usize>()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Primitives below this number have bounds; planes follow.
    pub fn finite(&self) -> u32 {
        self.ends[4]
    }

    /// Numbers of the planes.
    pub fn plane_numbers(&self) -> std::ops::Range<u32> {
        self.ends[4]..self.ends[5]
    }

    /// Bounds of all primitives but the planes.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Bounds of one finite primitive, exact up to rounding.
    pub fn bounds_of(&self, number: u32) -> Bounds {
        let n = number as usize;
        let e = self.ends.map(|e| e as usize);
        if n < e[0] {
            let [x, y, z, r] = self.spheres[n];
            let c = Vec3::new(x, y, z);
            Bounds { min: c - r, max: c + r }
        } else if n < e[1] {
            Bounds::around(&self.triangles[n - e[0]])
        } else if n < e[2] {
            let [min, max] = self.boxes[n - e[1]];
            Bounds { min, max }
        } else if n < e[3] {
            cone_bounds(&self.cones[n - e[2]])
        } else {
            let placed = &self.placed[n - e[3]];
            let local = match placed.shape {
                Solid::Sphere { center, radius } => Bounds { min: center - radius, max: center + radius },
                Solid::Box { min, max } => Bounds { min, max },
                Solid::Cone(cone) => cone_bounds(&cone),
            };
            let half = local.size() * 0.5;
            let m = placed.to_world;
            let center = m * local.center() + placed.anchor;
            let extent = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
            Bounds { min: center - extent, max: center + extent }
        }
    }

    /// A ray that starts far from all finite primitives, moved up to them: distance moved, and the ray from there.
    ///
    /// Precision then does not depend on how far away the camera is. Whatever finds primitives goes through this.
    #[inline]
    pub fn approach(&self, ray: &Ray) -> (f32, Ray) {
        let to_center = self.bounds.center() - ray.origin;
        if self.bounds.is_empty() || to_center.length_squared() < 16.0 * self.reach * self.reach {
            return (0.0, *ray);
        }
        let skip = (to_center.dot(ray.direction) - self.reach).max(0.0);
        let origin = ray.origin + ray.direction * skip;
        (skip, Ray { origin, t_max: ray.t_max - skip, ..*ray })
    }

    /// Tests one primitive and keeps it if it is nearer than the best so far, or as near and lower in number.
    #[inline]
    pub fn test(&self, number: u32, probe: &Probe, best: &mut Best) {
        let sides = || self.tags[number as usize].sides;
        if number < self.ends[0] {
            let [x, y, z, r] = self.spheres[number as usize];
            if let Some(hits) = sphere(probe, Vec3::new(x, y, z), r) {
                offer_span(hits, sides(), number, best);
            }
        } else if number < self.ends[1] {
            let corners = &self.triangles[(number - self.ends[0]) as usize];
            if let Some((t, u, v, front)) = triangle(probe, corners)
                && sides().shows(front)
            {
                best.offer(t, number, u, v);
            }
        } else if number < self.ends[2] {
            let [min, max] = self.boxes[(number - self.ends[1]) as usize];
            let hits = slab(probe, min, max);
            if hits[0] <= hits[1] {
                offer_span(hits, sides(), number, best);
            }
        } else if number < self.ends[3] {
            let cone = &self.cones[(number - self.ends[2]) as usize];
            offer_cone(cone, probe, 1.0, sides(), number, best);
        } else if number < self.ends[4] {
            self.placed[(number - self.ends[3]) as usize].test(number, probe, sides(), best);
        } else {
            let [point, normal] = self.planes[(number - self.ends[4]) as usize];
            if let Some((t, front)) = plane(probe, point, normal)
                && sides().shows(front)
            {
                best.offer(t, number, 0.0, 0.0);
            }
        }
    }

    /// The point of a hit of this ray.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let n = hit.primitive;
        let tag = self.tags[n as usize];
        let (material, entity) = (tag.material, tag.entity);
        let flat = |(point, normal, error): (Vec3, Vec3, Vec3)| Surface {
            point,
            error,
            geometric_normal: normal,
            shading_normal: normal,
            material,
            entity,
        };
        let near = || {
            let (_, ray) = self.approach(ray);
            ray.origin + ray.direction * hit.u
        };
        if n < self.ends[0] {
            let [x, y, z, r] = self.spheres[n as usize];
            flat(on_sphere(near(), Vec3::new(x, y, z), r))
        } else if n < self.ends[1] {
            self.on_triangle((n - self.ends[0]) as usize, hit, tag)
        } else if n < self.ends[2] {
            let [min, max] = self.boxes[(n - self.ends[1]) as usize];
            flat(on_box(near(), min, max))
        } else if n < self.ends[3] {
            flat(on_cone(near(), &self.cones[(n - self.ends[2]) as usize], hit.v))
        } else if n < self.ends[4] {
            flat(self.placed[(n - self.ends[3]) as usize].surface(near(), hit.v))
        } else {
            let [point, normal] = self.planes[(n - self.ends[4]) as usize];
            let p = ray.origin + ray.direction * hit.t;
            let p = p - normal * (p - point).dot(normal);
            flat((p, normal, (p.abs() + point.abs()) * ROUNDING))
        }
    }

    fn on_triangle(&self, index: usize, hit: &Hit, tag: Tag) -> Surface {
        let [a, b, c] = self.triangles[index];
        let w = 1.0 - hit.u - hit.v;
        let point = a * w + b * hit.u + c * hit.v;
        let error = a.abs().max(b.abs()).max(c.abs()) * ROUNDING;
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let shading = match self.shading[index] {
            FLAT => normal,
            at => {
                let [na, nb, nc] = self.normals[at as usize];
                let mixed = (na * w + nb * hit.u + nc * hit.v).normalize_or(normal);
                if mixed.dot(normal) < 0.0 { -mixed } else { mixed }
            }
        };
        Surface {
            point,
            error,
            geometric_normal: normal,
            shading_normal: shading,
            material: tag.material,
            entity: tag.entity,
        }
    }
}

/// Offers where a line enters and leaves a convex solid; `u` keeps the distance for [`Geometry::surface`].
#[inline]
fn offer_span([near, far]: [f32; 2], sides: Sides, number: u32, best: &mut Best) {
    if near > 0.0 && sides != Sides::Back {
        best.offer(near, number, near, 0.0);
    } else if far > 0.0 && sides != Sides::Front {
        best.offer(far, number, far, 0.0);
    }
}

#[inline]
fn offer_cone(cone: &Frustum, probe: &Probe, per_unit: f32, sides: Sides, number: u32, best: &mut Best) {
    cone.crossings(probe, |t, enters, part| {
        if sides.shows(enters) {
            let code = part as u8 as f32;
            best.offer(t * per_unit, number, t * per_unit, code);
        }
    });
}

impl Placed {
    #[inline]
    fn test(&self, number: u32, probe: &Probe, sides: Sides, best: &mut Best) {
        let direction = self.to_local * probe.direction;
        let per_unit = direction.length().recip();
        let direction = direction * per_unit;
        let origin = self.to_local * (probe.origin - self.anchor);
        let local = Probe { origin, direction, inverse: direction.recip() };
        let span = match self.shape {
            Solid::Sphere { center, radius } => sphere(&local, center, radius),
            Solid::Box { min, max } => Some(slab(&local, min, max)).filter(|[near, far]| near <= far),
            Solid::Cone(cone) => return offer_cone(&cone, &local, per_unit, sides, number, best),
        };
        if let Some(hits) = span {
            offer_span(hits.map(|t| t * per_unit), sides, number, best);
        }
    }

    fn surface(&self, point: Vec3, part: f32) -> (Vec3, Vec3, Vec3) {
        let local = self.to_local * (point - self.anchor);
        let (p, n, e) = match self.shape {
            Solid::Sphere { center, radius } => on_sphere(local, center, radius),
            Solid::Box { min, max } => on_box(local, min, max),
            Solid::Cone(cone) => on_cone(local, &cone, part),
        };
        let m = self.to_world;
        let spread = |v: Vec3| m.x_axis.abs() * v.x + m.y_axis.abs() * v.y + m.z_axis.abs() * v.z;
        let point = m * p + self.anchor;
        // The local error, and that of the map and of the test from the other side of it.
        let error = spread(e + p.abs() * ROUNDING) * 2.0 + (point.abs() + self.anchor.abs()) * ROUNDING;
        (point, (self.normals * n).normalize_or(Vec3::Y), error)
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

fn cone_bounds(cone: &Frustum) -> Bounds {
    let apex = cone.base + cone.axis * cone.height;
    let (r0, r1) = (cone.base_radius, cone.radius_at(cone.height).max(0.0));
    // Half extent of a disk across the axis.
    let across = (Vec3::ONE - cone.axis * cone.axis).max(Vec3::ZERO).map(f32::sqrt);
    let base = Bounds { min: cone.base - across * r0, max: cone.base + across * r0 };
    base.union(Bounds { min: apex - across * r1, max: apex + across * r1 })
}

#[cfg(test)]
#[path = "geometry_tests.rs"]
mod tests;
