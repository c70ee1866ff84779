//! A ray against one primitive, and the nearest hit so far.

use glam::Vec3;

use super::bounds::Bounds;
use super::geometry::{Geometry, PrimitiveKind};
use super::mesh::Instance;
use super::shapes::{ConeFrustum, PreparedRay, intersect_box, intersect_plane, intersect_sphere, intersect_triangle};
use super::tag::Sides;
use super::transformed::{AffineMap, PreparedShape, TransformedShape};
use crate::trace::simd::V3;

/// The nearest hit so far.
#[derive(Clone, Copy, Debug)]
pub struct ClosestHit {
    pub t: f32,
    pub primitive: u32,
    /// Triangle of an instance.
    pub element: u32,
    pub u: f32,
    pub v: f32,
    pub found: bool,
}

impl ClosestHit {
    pub fn within(t_max: f32) -> Self {
        ClosestHit { t: t_max, primitive: 0, element: 0, u: 0.0, v: 0.0, found: false }
    }

    /// Keeps a hit if it is nearer than the best so far, or as near and lower in number.
    #[inline(always)]
    pub fn offer(&mut self, t: f32, primitive: u32, element: u32, u: f32, v: f32) {
        let before = (primitive, element) < (self.primitive, self.element);
        if t < self.t || (t == self.t && self.found && before) {
            *self = ClosestHit { t, primitive, element, u, v, found: true };
        }
    }

    /// Offers where a line enters and leaves a convex solid; `u` keeps the distance for [`Geometry::surface`].
    #[inline(always)]
    pub fn offer_span(&mut self, [near, far]: [f32; 2], sides: Sides, number: u32) {
        if near > 0.0 && sides != Sides::Back {
            self.offer(near, number, 0, near, 0.0);
        } else if far > 0.0 && sides != Sides::Front {
            self.offer(far, number, 0, far, 0.0);
        }
    }
}

impl Geometry {
    /// Tests one primitive and keeps it if it is nearer than the best so far, or as near and lower in number.
    pub fn test(&self, number: u32, probe: &PreparedRay, best: &mut ClosestHit) {
        let kind = self.kind_of(number);
        let index = (number - self.range(kind).start) as usize;
        match kind {
            PrimitiveKind::Sphere => {
                let [x, y, z, r] = self.spheres[index];
                let (met, hits) = intersect_sphere::<f32>(&probe.beam(), V3 { x, y, z }, r);
                if met {
                    best.offer_span(hits, self.tag(number).sides, number);
                }
            }
            PrimitiveKind::Triangle | PrimitiveKind::MeshTriangle => {
                let sides = self.tag(number).sides;
                if let Some((t, u, v, front)) = intersect_corners(probe, &self.corners(number))
                    && sides.shows(front)
                {
                    best.offer(t, number, number, u, v);
                }
            }
            PrimitiveKind::Box => {
                let [min, max] = self.boxes[index].map(V3::splat);
                let hits = intersect_box::<f32>(&probe.beam(), min, max);
                if hits[0] <= hits[1] {
                    best.offer_span(hits, self.tag(number).sides, number);
                }
            }
            PrimitiveKind::Cone | PrimitiveKind::TransformedShape => {
                // Hits are held to the bounds of the whole, where an accelerator will look for them.
                let bounds = &self.solid_bounds[(number - self.range(PrimitiveKind::Cone).start) as usize];
                let [near, far] = within(bounds, probe);
                if near > far || far <= 0.0 || near > best.t {
                    return;
                }
                let sides = self.tag(number).sides;
                let mut keep = |t: f32, enters: bool, code: f32| {
                    if sides.shows(enters) {
                        let t = t.clamp(near, far);
                        best.offer(t, number, 0, t, code);
                    }
                };
                match kind {
                    PrimitiveKind::Cone => offer_cone(&self.cones[index], probe, 1.0, &mut keep),
                    _ => self.placed[index].test(probe, &mut keep),
                }
            }
            PrimitiveKind::Instance => {
                let instance = &self.instances[index];
                let model = &self.models[instance.model as usize];
                let sides = self.tag(number).sides;
                let Some((probe, per_unit, near)) = instance.enter(probe, best.t) else { return };
                for element in 0..model.mesh.triangles.len() as u32 {
                    if let Some((t, u, v, front)) = intersect_corners(&probe, &model.corners(element))
                        && sides.shows(front)
                    {
                        best.offer((t * per_unit).max(near), number, element, u, v);
                    }
                }
            }
            PrimitiveKind::Plane => {
                let [point, normal] = self.planes[index];
                if let Some((t, front)) = intersect_plane(probe, point, normal)
                    && self.tag(number).sides.shows(front)
                {
                    best.offer(t, number, 0, 0.0, 0.0);
                }
            }
        }
    }
}

fn intersect_corners(probe: &PreparedRay, corners: &[Vec3; 3]) -> Option<(f32, f32, f32, bool)> {
    let hits = intersect_triangle::<f32>(&probe.beam(), corners.map(|p| V3::splat(probe.turned(p))))?;
    hits.hit.then_some((hits.t, hits.u, hits.v, hits.front))
}

fn within(bounds: &Bounds, probe: &PreparedRay) -> [f32; 2] {
    intersect_box::<f32>(&probe.beam(), V3::splat(bounds.min), V3::splat(bounds.max))
}

#[inline]
fn offer_cone(cone: &ConeFrustum, probe: &PreparedRay, per_unit: f32, keep: &mut impl FnMut(f32, bool, f32)) {
    cone.crossings(probe, |t, enters, part| keep(t * per_unit, enters, part as u8 as f32));
}

impl AffineMap {
    /// The ray in local space, and the length in the world of one unit along it there.
    pub fn probe(&self, probe: &PreparedRay) -> (PreparedRay, f32) {
        let direction = self.to_local * probe.direction;
        let per_unit = direction.length().recip();
        (PreparedRay::new(self.to_local * (probe.origin - self.anchor), direction * per_unit), per_unit)
    }
}

impl Instance {
    /// The ray in the model's space, the length in the world of one unit along it there, and the distance in the world
    /// before which nothing of the instance is met: hits are held to its bounds, where an accelerator will look for
    /// them. `None` if it is not met before `limit`.
    pub fn enter(&self, probe: &PreparedRay, limit: f32) -> Option<(PreparedRay, f32, f32)> {
        let [near, far] = within(&self.bounds, probe);
        if near > far || far <= 0.0 || near > limit {
            return None;
        }
        let (local, per_unit) = self.map.probe(probe);
        Some((local, per_unit, near.max(0.0)))
    }
}

impl TransformedShape {
    fn test(&self, probe: &PreparedRay, keep: &mut impl FnMut(f32, bool, f32)) {
        let (local, per_unit) = self.map.probe(probe);
        let span = match self.shape {
            PreparedShape::Sphere { center, radius } => {
                let (met, hits) = intersect_sphere::<f32>(&local.beam(), V3::splat(center), radius);
                met.then_some(hits)
            }
            PreparedShape::Box { min, max } => {
                Some(intersect_box::<f32>(&local.beam(), V3::splat(min), V3::splat(max)))
                    .filter(|[near, far]| near <= far)
            }
            PreparedShape::Cone(cone) => return offer_cone(&cone, &local, per_unit, keep),
        };
        if let Some([near, far]) = span {
            if near > 0.0 {
                keep(near * per_unit, true, 0.0);
            }
            if far > 0.0 {
                keep(far * per_unit, false, 0.0);
            }
        }
    }
}
