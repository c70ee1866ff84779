//! Boxes along the axes.

use glam::{Vec2, Vec3};

use super::area::{AreaSample, AreaSampling, area_pdf};
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveShape;
use super::prepared_ray::{PreparedRay, PreparedRayLanes};
use super::surface::BarePoint;
use super::tag::Sides;
use super::uv::{SurfaceUv, UvPoint};
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::{Hit, Ray};

/// A box along the axes of some space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxPrim {
    /// The corner of the least coordinates, in the space that is traced.
    pub min: Vec3,
    /// The opposite corner.
    pub max: Vec3,
}

impl BoxPrim {
    /// Distances at which a line enters and leaves it.
    pub fn span(&self, ray: &PreparedRay) -> Option<[f32; 2]> {
        let span = intersect_box::<f32>(&ray.beam(), V3::splat(self.min), V3::splat(self.max));
        Some(span).filter(|[near, far]| near <= far)
    }

    /// The nearest point of the nearest face, exactly on it.
    pub fn nearest(&self, near: Vec3) -> BarePoint {
        let BoxPrim { min, max } = *self;
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
        BarePoint { point, normal, error: Vec3::ZERO }
    }
}

impl PrimitiveShape for BoxPrim {
    const IS_SAMPLED: bool = true;
    type Area = BoxPrim;

    fn bounds(&self) -> Bounds {
        Bounds { min: self.min, max: self.max }
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides, number: u32, closest: &mut ClosestHit) {
        if let Some(span) = self.span(ray) {
            closest.offer_span(span, sides, number);
        }
    }

    fn locate(&self, _: &Ray, near: impl Fn() -> Vec3, _: &Hit) -> BarePoint {
        self.nearest(near())
    }

    fn uv(&self, at: &UvPoint, _: &Hit) -> SurfaceUv {
        let [a, b] = [self.min, self.max].map(|p| at.map.local(p));
        cube(at.local, at.normal, a.min(b), a.max(b))
    }

    fn area_shape(&self) -> Option<BoxPrim> {
        Some(*self)
    }
}

/// Distances at which lines enter and leave axis-aligned boxes; near > far where they miss.
#[inline(always)]
pub fn intersect_box<L: Lanes>(ray: &PreparedRayLanes<L>, min: V3<L>, max: V3<L>) -> [L; 2] {
    let low = (min - ray.origin) * ray.inverse;
    let high = (max - ray.origin) * ray.inverse;
    [low.min(high).max_element(), low.max(high).min_element()]
}

/// Texture coordinates of a face of a box.
pub fn cube(p: Vec3, normal: Vec3, min: Vec3, max: Vec3) -> SurfaceUv {
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

impl AreaSampling for BoxPrim {
    const IS_CLOSED: bool = true;

    fn area(&self) -> f32 {
        let s = self.max - self.min;
        2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
    }

    fn point(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        on_faces(self.min, self.max, [true; 6], u)
    }

    fn area_bounds(&self) -> Bounds {
        self.bounds()
    }

    fn extent(&self) -> Vec3 {
        self.min.abs().max(self.max.abs())
    }

    fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<AreaSample> {
        let faces = facing(self.min, self.max, from);
        let (point, normal) = on_faces(self.min, self.max, faces, u);
        AreaSample::by_area(from, point, normal, face_areas(self.min, self.max, faces).iter().sum())
    }

    fn pdf(&self, from: Vec3, point: Vec3, normal: Vec3) -> f32 {
        let faces = facing(self.min, self.max, from);
        area_pdf(from, point, normal, face_areas(self.min, self.max, faces).iter().sum())
    }
}

/// Faces of a box that a point sees: the lower and the upper one of each axis; all of them from within.
fn facing(min: Vec3, max: Vec3, from: Vec3) -> [bool; 6] {
    let seen = std::array::from_fn(|i| if i % 2 == 0 { from[i / 2] < min[i / 2] } else { from[i / 2] > max[i / 2] });
    if seen == [false; 6] { [true; 6] } else { seen }
}

/// Areas of these faces.
fn face_areas(min: Vec3, max: Vec3, faces: [bool; 6]) -> [f32; 6] {
    let s = max - min;
    let areas = [s.y * s.z, s.z * s.x, s.x * s.y];
    std::array::from_fn(|i| if faces[i] { areas[i / 2] } else { 0.0 })
}

/// A point of these faces by area, and the normal there.
fn on_faces(min: Vec3, max: Vec3, faces: [bool; 6], u: [f32; 2]) -> (Vec3, Vec3) {
    let areas = face_areas(min, max, faces);
    // The first number picks a face by area; what is left of it is uniform again.
    let mut rest = u[0] * areas.iter().sum::<f32>();
    let last = areas.iter().rposition(|area| *area > 0.0).unwrap_or(0);
    let mut face = 0;
    while face < last && rest >= areas[face] {
        rest -= areas[face];
        face += 1;
    }
    let axis = face / 2;
    let first = if areas[face] > 0.0 { (rest / areas[face]).min(1.0) } else { 0.0 };
    let mut normal = Vec3::ZERO;
    normal[axis] = if face % 2 == 0 { -1.0 } else { 1.0 };
    let mut point = Vec3::ZERO;
    point[axis] = if face % 2 == 0 { min[axis] } else { max[axis] };
    let size = max - min;
    for (k, at) in [((axis + 1) % 3, first), ((axis + 2) % 3, u[1])] {
        point[k] = min[k] + size[k] * at;
    }
    (point, normal)
}
