//! Primitives that shine.

use std::f32::consts::PI;

use glam::Vec3;

use crate::base::limits;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{Geometry, PrimitiveKind, ROUNDING, Sides, SurfacePoint};
use crate::trace::sampler::{Frame, around, in_triangle};

/// A primitive, or a triangle of an instance, that shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// As in the hits that meet it; the element counts for instances alone and is 0 elsewhere.
    pub primitive: u32,
    pub element: u32,
    pub radiance: Vec3,
    /// As that of its material.
    pub group: u32,
    sides: Sides,
    shape: EmitterShape,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum EmitterShape {
    Sphere {
        center: Vec3,
        radius: f32,
    },
    /// A corner and the edges from it; counter-clockwise from the front.
    Triangle {
        corner: Vec3,
        edges: [Vec3; 2],
    },
    Box {
        min: Vec3,
        max: Vec3,
    },
}

/// A point of an emitter, as seen from somewhere.
pub struct EmitterSample {
    pub point: Vec3,
    /// Unit, towards the outside.
    pub normal: Vec3,
    /// Per steradian.
    pub pdf: f32,
}

/// Every primitive that shines and can be sampled, in the order of hits (primitive, element).
pub fn emitters(geometry: &Geometry, materials: &[ShadingParams]) -> Vec<Emitter> {
    let mut found = Vec::new();
    if materials.iter().all(|m| m.emission == Vec3::ZERO) {
        return found;
    }
    let mut add = |primitive: u32, element: u32, shape: EmitterShape| {
        let tag = geometry.tag(primitive);
        let ShadingParams { emission: radiance, group, .. } = materials[tag.material as usize];
        let emitter = Emitter { primitive, element, radiance, group, sides: tag.sides, shape };
        if radiance != Vec3::ZERO && emitter.area() > 0.0 && found.len() < limits::EMITTERS {
            found.push(emitter);
        }
    };
    let shines = |primitive: u32| materials[geometry.tag(primitive).material as usize].emission != Vec3::ZERO;
    for n in geometry.range(PrimitiveKind::Sphere) {
        let [x, y, z, radius] = geometry.sphere(n);
        add(n, 0, EmitterShape::Sphere { center: Vec3::new(x, y, z), radius: radius.abs() });
    }
    for n in geometry.range(PrimitiveKind::Triangle) {
        add(n, 0, EmitterShape::triangle(geometry.corners(n)));
    }
    for n in geometry.range(PrimitiveKind::Box) {
        let [min, max] = geometry.aabox(n);
        add(n, 0, EmitterShape::Box { min, max });
    }
    for part in geometry.parts().iter().filter(|part| materials[part.tag.material as usize].emission != Vec3::ZERO) {
        for triangle in 0..part.mesh.triangles.len() as u32 {
            add(part.first + triangle, 0, EmitterShape::triangle(part.corners(triangle)));
        }
    }
    for n in geometry.range(PrimitiveKind::Instance).filter(|n| shines(*n)) {
        let instance = geometry.instance(n);
        let model = &geometry.models()[instance.model as usize];
        let map = &instance.map;
        for triangle in 0..model.mesh.triangles.len() as u32 {
            let [a, b, c] = model.corners(triangle);
            let outward = map.normals * (b - a).cross(c - a);
            let [a, b, c] = [a, b, c].map(|p| map.to_world * p + map.anchor);
            let turned = (b - a).cross(c - a).dot(outward) < 0.0;
            add(n, triangle, EmitterShape::triangle(if turned { [a, c, b] } else { [a, b, c] }));
        }
    }
    found
}

impl EmitterShape {
    fn triangle([a, b, c]: [Vec3; 3]) -> Self {
        EmitterShape::Triangle { corner: a, edges: [b - a, c - a] }
    }
}

impl Emitter {
    pub fn area(&self) -> f32 {
        match self.shape {
            EmitterShape::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            EmitterShape::Triangle { edges: [a, b], .. } => 0.5 * a.cross(b).length(),
            EmitterShape::Box { min, max } => {
                let s = max - min;
                2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
            }
        }
    }

    /// How many sides shine.
    pub fn sides(&self) -> f32 {
        // The inside of a closed shape lights nothing outside, and its outside nothing within.
        let closed = !matches!(self.shape, EmitterShape::Triangle { .. });
        if self.sides == Sides::Both && !closed { 2.0 } else { 1.0 }
    }

    /// Whether light leaves towards `direction` where the surface has this normal.
    pub fn shines(&self, normal: Vec3, direction: Vec3) -> bool {
        self.sides.shows(normal.dot(direction) > 0.0)
    }

    /// A point of it for light towards `from`.
    pub fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<EmitterSample> {
        if let EmitterShape::Sphere { center, radius } = self.shape
            && let Some(cone) = SphereCone::new(from, center, radius)
        {
            let point = cone.sample(u);
            let normal = (point - center).normalize_or(Vec3::Y);
            return Some(EmitterSample { point: center + normal * radius, normal, pdf: cone.pdf() });
        }
        let (point, normal) = match self.shape {
            EmitterShape::Box { min, max } => on_box(min, max, facing(min, max, from), u),
            EmitterShape::Sphere { .. } | EmitterShape::Triangle { .. } => self.point(u),
        };
        let pdf = self.by_area(from, point, normal);
        (pdf > 0.0 && pdf < f32::INFINITY).then_some(EmitterSample { point, normal, pdf })
    }

    /// Density of [`Self::sample`] per steradian at a point that a ray from `from` met.
    pub fn pdf(&self, from: Vec3, point: Vec3, normal: Vec3) -> f32 {
        if let EmitterShape::Sphere { center, radius } = self.shape
            && let Some(cone) = SphereCone::new(from, center, radius)
        {
            return cone.pdf();
        }
        let pdf = self.by_area(from, point, normal);
        if pdf < f32::INFINITY { pdf } else { 0.0 }
    }

    /// Density per steradian of points by area, of a box those of the faces that are seen.
    fn by_area(&self, from: Vec3, point: Vec3, normal: Vec3) -> f32 {
        let area = match self.shape {
            EmitterShape::Box { min, max } => shares(min, max, facing(min, max, from)).iter().sum(),
            EmitterShape::Sphere { .. } | EmitterShape::Triangle { .. } => self.area(),
        };
        let offset = point - from;
        let square = offset.length_squared();
        square / (area * normal.dot(offset).abs() / square.sqrt())
    }

    /// A point by area, and the normal there.
    pub fn point(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        match self.shape {
            EmitterShape::Sphere { center, radius } => {
                let normal = around(1.0 - 2.0 * u[0], u[1]);
                (center + normal * radius, normal)
            }
            EmitterShape::Triangle { corner, edges: [a, b] } => {
                let [s, t] = in_triangle(u);
                (corner + a * s + b * t, a.cross(b).normalize_or(Vec3::Y))
            }
            EmitterShape::Box { min, max } => on_box(min, max, [true; 6], u),
        }
    }

    /// The point as a surface that a photon leaves.
    pub fn surface(&self, u: [f32; 2]) -> SurfacePoint {
        let (point, normal) = self.point(u);
        let extent = match self.shape {
            EmitterShape::Sphere { center, radius } => center.abs() + radius,
            EmitterShape::Triangle { corner, edges: [a, b] } => corner.abs() + a.abs() + b.abs(),
            EmitterShape::Box { min, max } => min.abs().max(max.abs()),
        };
        let error = extent * ROUNDING;
        SurfacePoint { point, error, geometric_normal: normal, shading_normal: normal, ..SurfacePoint::default() }
    }

    /// Which side a photon leaves from, for a number that chooses if both shine.
    pub fn side(&self, choice: f32) -> f32 {
        let back = match self.sides {
            Sides::Both => self.sides() > 1.0 && choice >= 0.5,
            Sides::Front => false,
            Sides::Back => true,
        };
        if back { -1.0 } else { 1.0 }
    }
}

/// Faces of a box that a point sees: the lower and the upper one of each axis; all of them from within.
fn facing(min: Vec3, max: Vec3, from: Vec3) -> [bool; 6] {
    let seen = std::array::from_fn(|i| if i % 2 == 0 { from[i / 2] < min[i / 2] } else { from[i / 2] > max[i / 2] });
    if seen == [false; 6] { [true; 6] } else { seen }
}

/// Areas of these faces.
fn shares(min: Vec3, max: Vec3, faces: [bool; 6]) -> [f32; 6] {
    let s = max - min;
    let areas = [s.y * s.z, s.z * s.x, s.x * s.y];
    std::array::from_fn(|i| if faces[i] { areas[i / 2] } else { 0.0 })
}

fn on_box(min: Vec3, max: Vec3, faces: [bool; 6], u: [f32; 2]) -> (Vec3, Vec3) {
    let areas = shares(min, max, faces);
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

/// The cone in which a sphere is seen from outside.
struct SphereCone {
    from: Vec3,
    axis: Vec3,
    distance: f32,
    radius: f32,
    /// 1 - cosine of the half angle, without cancellation for small spheres.
    height: f32,
}

impl SphereCone {
    fn new(from: Vec3, center: Vec3, radius: f32) -> Option<Self> {
        let offset = center - from;
        let distance = offset.length();
        // On the surface and within it there is no cone.
        if distance <= radius * (1.0 + 1e-5) {
            return None;
        }
        let sin = radius / distance;
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        Some(SphereCone { from, axis: offset / distance, distance, radius, height: sin * sin / (1.0 + cos) })
    }

    fn pdf(&self) -> f32 {
        1.0 / (2.0 * PI * self.height)
    }

    /// The nearer point of the sphere in a uniform direction of the cone.
    fn sample(&self, u: [f32; 2]) -> Vec3 {
        // 1 - cosine of the direction's angle to the axis.
        let h = u[0] * self.height;
        let sin2 = (h * (2.0 - h)).max(0.0);
        let local = {
            let (sin, cos) = libm::sincosf(2.0 * PI * u[1]);
            let r = sin2.sqrt();
            Vec3::new(r * cos, r * sin, 1.0 - h)
        };
        let direction = Frame::new(self.axis).to_world(local);
        let under = (self.radius * self.radius - self.distance * self.distance * sin2).max(0.0).sqrt();
        self.from + direction * (self.distance * (1.0 - h) - under)
    }
}
