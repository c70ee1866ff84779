//! Texture coordinates of hits, and how they change along the surface. Asked for only where something is textured.
//!
//! What is what on each shape stands with the shapes in [`crate::components`]. All are functions of the point in local
//! space, so that a texture keeps its place on an entity that moves, turns or is stretched.

use glam::{Vec2, Vec3, Vec4};

use super::geometry::{Geometry, PrimitiveKind};
use super::shapes::{ConeFrustum, ConePart};
use super::surface::SurfacePoint;
use super::transformed::{AffineMap, PreparedShape};
use crate::trace::soa::Hit;

const TURN: f32 = std::f32::consts::TAU;

/// The local space of an entity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSpace {
    pub map: AffineMap,
    /// Middle of the mesh that has no texture coordinates and is wrapped like a sphere, local space.
    pub center: Option<Vec3>,
}

/// Texture coordinates at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceUv {
    pub uv: Vec2,
    /// Gradients of u and v in the tangent plane, world space, per world unit.
    pub gradients: [Vec3; 2],
    /// Which coordinates end at 0 and 1; others go round, or on.
    pub ends: [bool; 2],
}

impl Geometry {
    /// Texture coordinates of a hit. `surface` faces outwards; `frame` is that of its entity.
    pub fn surface_uv(&self, hit: &Hit, surface: &SurfacePoint, frame: &ObjectSpace) -> SurfaceUv {
        let n = hit.primitive;
        let kind = self.kind_of(n);
        let index = (n - self.range(kind).start) as usize;
        let map = &frame.map;
        let local = map.local(surface.point);
        let normal = (map.to_world.transpose() * surface.geometric_normal).normalize_or(Vec3::Y);
        let found = match kind {
            PrimitiveKind::Sphere => {
                let [x, y, z, _] = self.spheres[index];
                globe(map.to_local * (surface.point - Vec3::new(x, y, z)))
            }
            PrimitiveKind::Box => {
                let [a, b] = self.boxes[index].map(|p| map.local(p));
                cube(local, normal, a.min(b), a.max(b))
            }
            PrimitiveKind::Cone => tube(local, hit.v, &self.cones[index].carried(map)),
            PrimitiveKind::TransformedShape => match self.placed[index].shape {
                PreparedShape::Sphere { center, .. } => globe(local - center),
                PreparedShape::Box { min, max } => cube(local, normal, min, max),
                PreparedShape::Cone(cone) => tube(local, hit.v, &cone),
            },
            PrimitiveKind::Plane => plane(local - map.local(self.planes[index][0]), normal),
            PrimitiveKind::Triangle | PrimitiveKind::MeshTriangle | PrimitiveKind::Instance => {
                let (corners, uvs) = self.triangle(hit, kind, index);
                match (uvs, frame.center) {
                    (None, Some(center)) => globe(local - center),
                    (uvs, _) => {
                        let uvs = uvs.unwrap_or([Vec2::ZERO, Vec2::X, Vec2::Y]);
                        let found = patch(corners, uvs, hit);
                        return if kind == PrimitiveKind::Instance { found.carried(map, surface) } else { found };
                    }
                }
            }
        };
        found.carried(map, surface)
    }

    /// The colour that the vertices of a mesh give the point of a hit: red, green, blue, and alpha.
    pub fn vertex_color(&self, hit: &Hit) -> Vec4 {
        match self.kind_of(hit.primitive) {
            PrimitiveKind::MeshTriangle => {
                let part = self.part_of(hit.primitive);
                part.color(hit.primitive - part.first, hit.u, hit.v)
            }
            PrimitiveKind::Instance => {
                let instance = self.instance(hit.primitive);
                self.models[instance.model as usize].color(hit.element, hit.u, hit.v)
            }
            PrimitiveKind::Sphere
            | PrimitiveKind::Triangle
            | PrimitiveKind::Box
            | PrimitiveKind::Cone
            | PrimitiveKind::TransformedShape
            | PrimitiveKind::Plane => Vec4::ONE,
        }
    }

    /// Corners of the triangle that was met, and their texture coordinates; those of an instance in local space.
    fn triangle(&self, hit: &Hit, kind: PrimitiveKind, index: usize) -> ([Vec3; 3], Option<[Vec2; 3]>) {
        match kind {
            PrimitiveKind::Triangle => {
                let at = self.uvs.binary_search_by_key(&(index as u32), |(triangle, _)| *triangle);
                (self.triangles[index], at.ok().map(|i| self.uvs[i].1))
            }
            PrimitiveKind::Instance => {
                let model = &self.models[self.instances[index].model as usize];
                (model.corners(hit.element), model.uvs(hit.element))
            }
            _ => {
                let part = self.part_of(hit.primitive);
                let triangle = hit.primitive - part.first;
                (part.corners(triangle), part.uvs(triangle))
            }
        }
    }
}

impl SurfaceUv {
    /// How u and v change along a step in the tangent plane. What goes round goes round once: around a pole a footprint
    /// has all of u in it, and no more.
    pub fn along(&self, step: Vec3) -> Vec2 {
        let [u, v] = self.gradients.map(|g| g.dot(step));
        Vec2::new(if self.ends == [false, true] { u.clamp(-1.0, 1.0) } else { u }, v)
    }

    /// Local gradients carried into the world's tangent plane.
    fn carried(self, map: &AffineMap, surface: &SurfacePoint) -> Self {
        let n = surface.geometric_normal;
        let gradients = self.gradients.map(|g| {
            let g = map.to_local.transpose() * g;
            let g = g - n * n.dot(g);
            if g.is_finite() { g } else { Vec3::ZERO }
        });
        SurfaceUv { gradients, ..self }
    }
}

impl AffineMap {
    pub fn local(&self, point: Vec3) -> Vec3 {
        self.to_local * (point - self.anchor)
    }
}

impl ConeFrustum {
    /// A frustum of the world in the local space of a map that keeps shapes similar.
    fn carried(&self, map: &AffineMap) -> ConeFrustum {
        let axis = map.to_local * self.axis;
        let scale = axis.length();
        ConeFrustum {
            base: map.local(self.base),
            axis: axis.normalize_or(Vec3::Y),
            height: self.height * scale,
            base_radius: self.base_radius * scale,
            ..*self
        }
    }
}

/// A sphere, from its centre.
fn globe(q: Vec3) -> SurfaceUv {
    let square = q.length_squared();
    let across = (q.x * q.x + q.z * q.z).max(1e-12 * square);
    let radius = across.sqrt();
    let angle = libm::atan2f(q.x, q.z);
    let height = libm::atan2f(radius, -q.y);
    let east = Vec3::new(q.z, 0.0, -q.x) / (TURN * across);
    let north = Vec3::new(-q.x * q.y / radius, radius, -q.z * q.y / radius) * (2.0 / (TURN * square));
    SurfaceUv { uv: Vec2::new(0.5 + angle / TURN, 2.0 * height / TURN), gradients: [east, north], ends: [false, true] }
}

/// A frustum, or one of its caps.
fn tube(q: Vec3, part: f32, cone: &ConeFrustum) -> SurfaceUv {
    let axis = cone.axis;
    let right = Vec3::Y.cross(axis).normalize_or(Vec3::X);
    let front = right.cross(axis);
    let q = q - cone.base;
    let (x, z) = (q.dot(right), q.dot(front));
    let cap = |radius: f32, up: Vec3| {
        let share = 0.5 / radius.max(f32::MIN_POSITIVE);
        SurfaceUv {
            uv: Vec2::new(0.5 + x * share, 0.5 + q.dot(up) * share),
            gradients: [right * share, up * share],
            ends: [true; 2],
        }
    };
    if part == ConePart::Base as u8 as f32 {
        return cap(cone.base_radius, front);
    }
    if part == ConePart::Apex as u8 as f32 {
        return cap(cone.radius_at(cone.height), -front);
    }
    let across = (x * x + z * z).max(1e-12 * cone.height * cone.height);
    let along = axis / cone.height.max(f32::MIN_POSITIVE);
    SurfaceUv {
        uv: Vec2::new(0.5 + libm::atan2f(x, z) / TURN, q.dot(along)),
        gradients: [(right * z - front * x) / (TURN * across), along],
        ends: [false, true],
    }
}

/// A plane through the origin.
fn plane(q: Vec3, normal: Vec3) -> SurfaceUv {
    let right = Vec3::Y.cross(normal).normalize_or(Vec3::X);
    let up = normal.cross(right);
    SurfaceUv { uv: Vec2::new(q.dot(right), q.dot(up)), gradients: [right, up], ends: [false; 2] }
}

/// A face of a box.
fn cube(p: Vec3, normal: Vec3, min: Vec3, max: Vec3) -> SurfaceUv {
    let a = normal.abs();
    let (right, up) = if a.y >= a.x && a.y >= a.z {
        (Vec3::X, Vec3::NEG_Z * normal.y.signum())
    } else if a.x >= a.z {
        (Vec3::NEG_Z * normal.x.signum(), Vec3::Y)
    } else {
        (Vec3::X * normal.z.signum(), Vec3::Y)
    };
    let (middle, size) = ((min + max) * 0.5, max - min);
    let share = |axis: Vec3| axis / axis.abs().dot(size).max(f32::MIN_POSITIVE);
    let gradients = [share(right), share(up)];
    let uv = gradients.map(|g| 0.5 + (p - middle).dot(g));
    SurfaceUv { uv: Vec2::from_array(uv), gradients, ends: [true; 2] }
}

/// A triangle; gradients lie in its plane, in the space of its corners.
fn patch([a, b, c]: [Vec3; 3], [ta, tb, tc]: [Vec2; 3], hit: &Hit) -> SurfaceUv {
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::base::math::placement;
    use crate::components::MeshData;
    use crate::trace::accel::{Accelerator, TraversalScratch};
    use crate::trace::primitive::{LocalShape, Tag};
    use crate::trace::soa::Ray;

    fn frame(map: &DAffine3) -> ObjectSpace {
        ObjectSpace { map: AffineMap::new(map), center: None }
    }

    /// Texture coordinates of the hit of a ray from a point towards another.
    fn meet(geometry: &Geometry, frame: &ObjectSpace, from: Vec3, to: Vec3) -> (SurfaceUv, SurfacePoint) {
        let accelerator = Accelerator::rebuild(geometry, crate::components::Accel::Brute, 2.0, f64::INFINITY, None);
        let ray = Ray::new(from, (to - from).normalize());
        let hit = accelerator.closest(geometry, &ray, &mut TraversalScratch::default()).unwrap();
        let surface = geometry.surface(&ray, &hit);
        (geometry.surface_uv(&hit, &surface, frame), surface)
    }

    /// One of each shape in a local space, under a map.
    fn shapes(map: &DAffine3, similar: bool) -> Vec<Geometry> {
        let m = |p: Vec3| map.transform_point3(p.as_dvec3()).as_vec3();
        let scale = map.matrix3.x_axis.length() as f32;
        let tag = Tag::default();
        let square = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.5, 0.0)];
        let uvs = vec![Vec2::new(0.1, 0.2), Vec2::new(0.9, 0.1), Vec2::new(0.4, 0.8)];
        let mesh = MeshData::new(square.to_vec(), vec![[0, 1, 2]], Vec::new()).with_uvs(uvs);
        let mesh = Arc::new(mesh);
        let mut all: Vec<Geometry> = (0..6).map(|_| Geometry::default()).collect();
        let cone =
            LocalShape::Cone { base: Vec3::NEG_Y, base_radius: 1.0, apex: Vec3::Y, apex_radius: 0.5, capped: true };
        if similar {
            all[0].push_sphere(tag, m(Vec3::ZERO), scale);
            all[1].push_cone(tag, m(Vec3::NEG_Y), scale, m(Vec3::Y), 0.5 * scale, true);
        } else {
            all[0].push_transformed(tag, LocalShape::Sphere { center: Vec3::ZERO, radius: 1.0 }, map);
            all[1].push_transformed(tag, cone, map);
        }
        all[2].push_transformed(tag, LocalShape::Box { min: -Vec3::ONE, max: Vec3::ONE }, map);
        all[3].push_mesh(tag, &mesh, false, map);
        all[4].push_instance(tag, &mesh, false, map);
        let normal = map.matrix3.inverse().transpose() * DVec3::Z;
        all[5].push_plane(tag, m(Vec3::ZERO), normal.normalize().as_vec3());
        all.iter_mut().for_each(Geometry::finish);
        all
    }

    /// Gradients against differences: a step along the surface changes u and v as they say.
    #[test]
    fn gradients_are_the_change_of_the_coordinates() {
        let similar = placement(DVec3::new(0.3, -0.2, 0.1), DVec3::new(20.0, 30.0, 40.0), DVec3::splat(1.5));
        let affine = placement(DVec3::new(0.3, -0.2, 0.1), DVec3::new(20.0, 30.0, 40.0), DVec3::new(1.0, 2.0, -0.7));
        for (map, keeps) in [(similar, true), (affine, false)] {
            for (which, geometry) in shapes(&map, keeps).iter().enumerate() {
                let m = |p: Vec3| map.transform_point3(p.as_dvec3()).as_vec3();
                let from = m(Vec3::new(0.5, 0.4, 4.0));
                for target in [Vec3::new(0.05, -0.1, 0.0), Vec3::new(-0.2, 0.3, 0.0)] {
                    let (here, surface) = meet(geometry, &frame(&map), from, m(target));
                    for step in [Vec3::X, Vec3::Y] {
                        let (there, other) = meet(geometry, &frame(&map), from, m(target + step * 2e-2));
                        let moved = other.point - surface.point;
                        let change = Vec2::from_array(here.gradients.map(|g| g.dot(moved)));
                        let error = (there.uv - here.uv - change).length();
                        assert!(error < 2e-2 * change.length() + 2e-5, "{which} {error} {change} {:?}", here.uv);
                    }
                }
            }
        }
    }

    #[test]
    fn globes_have_their_poles_and_seam_where_it_is_said() {
        let uv = |p: Vec3| globe(p).uv;
        assert!((uv(Vec3::Z) - Vec2::new(0.5, 0.5)).length() < 1e-6);
        assert!((uv(Vec3::X) - Vec2::new(0.75, 0.5)).length() < 1e-6);
        assert!((uv(Vec3::Y).y - 1.0).abs() < 1e-5 && uv(Vec3::NEG_Y).y.abs() < 1e-5);
        let seam = uv(Vec3::new(1e-6, 0.0, -1.0)).x - uv(Vec3::new(-1e-6, 0.0, -1.0)).x;
        assert!((seam - 1.0).abs() < 1e-5);
        for p in [Vec3::Y, Vec3::NEG_Y, Vec3::ZERO, Vec3::splat(1e-30)] {
            assert!(uv(p).is_finite(), "{p}");
        }
    }

    #[test]
    fn faces_and_floors_run_as_documented() {
        let face = |p: Vec3, n: Vec3| cube(p, n, -Vec3::ONE, Vec3::ONE).uv;
        // Right and up as seen from outside: the lower left corner of each side is (0, 0).
        assert_eq!(face(Vec3::new(-1.0, -1.0, 1.0), Vec3::Z), Vec2::ZERO);
        assert_eq!(face(Vec3::new(1.0, -1.0, 1.0), Vec3::X), Vec2::ZERO);
        assert_eq!(face(Vec3::new(1.0, -1.0, -1.0), Vec3::NEG_Z), Vec2::ZERO);
        assert_eq!(face(Vec3::new(-1.0, -1.0, -1.0), Vec3::NEG_X), Vec2::ZERO);
        assert_eq!(face(Vec3::new(-1.0, 1.0, 1.0), Vec3::Y), Vec2::ZERO);
        assert_eq!(face(Vec3::new(-1.0, -1.0, -1.0), Vec3::NEG_Y), Vec2::ZERO);
        let floor = plane(Vec3::new(2.0, 0.0, -3.0), Vec3::Y);
        assert_eq!(floor.uv, Vec2::new(2.0, 3.0));
        let cylinder = ConeFrustum::new(Vec3::ZERO, 1.0, Vec3::Y * 2.0, 1.0, true);
        let side = tube(Vec3::new(1.0, 0.5, 0.0), ConePart::Side as u8 as f32, &cylinder);
        assert!((side.uv - Vec2::new(0.75, 0.25)).length() < 1e-6);
        let top = tube(Vec3::new(0.5, 2.0, 0.5), ConePart::Apex as u8 as f32, &cylinder);
        assert!((top.uv - Vec2::new(0.75, 0.25)).length() < 1e-6);
    }
}
