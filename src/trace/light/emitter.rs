//! Primitives whose material emits light.

use glam::Vec3;

use super::linking::LightLinking;
use crate::base::limits;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{AreaSample, AreaShape, Bounds, Geometry, ROUNDING, Sides, SurfacePoint, Tag};

/// A primitive, or a triangle of an instance, that emits light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// As in the hits that meet it; the element counts for instances alone and is 0 elsewhere.
    pub primitive: u32,
    /// The triangle of an instance, as in the hits that meet it; 0 elsewhere.
    pub element: u32,
    /// Linear, W/(sr m2), the same in every direction.
    pub radiance: Vec3,
    /// As that of its material.
    pub group: u32,
    /// Authored index of its entity.
    pub entity: u32,
    /// What it lights, and how it is found.
    pub linking: LightLinking,
    sides: Sides,
    shape: AreaShape,
}

/// Every primitive that emits light and can be sampled, in the order of hits (primitive, element).
pub fn emitters(geometry: &Geometry, materials: &[ShadingParams]) -> Vec<Emitter> {
    let mut found: Vec<Emitter> = Vec::new();
    if materials.iter().all(|m| m.sampled_emission() == Vec3::ZERO) {
        return found;
    }
    let is_emissive = |tag: Tag| materials[tag.material as usize].sampled_emission() != Vec3::ZERO;
    geometry.area_shapes(&is_emissive, &mut |primitive, element, tag, shape| {
        let material = &materials[tag.material as usize];
        let (radiance, group) = (material.sampled_emission(), material.group);
        let (entity, linking, sides) = (tag.entity, LightLinking::default(), tag.sides);
        let emitter = Emitter { primitive, element, radiance, group, entity, linking, sides, shape };
        if emitter.area() > 0.0 && found.len() < limits::EMITTERS {
            found.push(emitter);
        }
    });
    found
}

impl Emitter {
    /// Area in the space that is traced, of one side.
    pub fn area(&self) -> f32 {
        self.shape.area()
    }

    /// The box around it, in the space that is traced.
    pub fn bounds(&self) -> Bounds {
        self.shape.area_bounds()
    }

    /// The normal of one that is flat, towards its front.
    pub fn flat_normal(&self) -> Option<Vec3> {
        (!self.shape.is_closed()).then(|| self.shape.point([0.5; 2]).1)
    }

    /// How many sides emit light.
    pub fn sides(&self) -> f32 {
        // The inside of a closed shape lights nothing outside, and its outside nothing within.
        if self.sides == Sides::Both && !self.shape.is_closed() { 2.0 } else { 1.0 }
    }

    /// Whether light leaves towards `direction` where the surface has this normal.
    pub fn emits_towards(&self, normal: Vec3, direction: Vec3) -> bool {
        self.sides.shows(normal.dot(direction) > 0.0)
    }

    /// A point of it for light towards `from`.
    pub fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<AreaSample> {
        self.shape.sample(from, u)
    }

    /// Density of [`Self::sample`] per steradian at a point that a ray from `from` met.
    pub fn pdf(&self, from: Vec3, point: Vec3, normal: Vec3) -> f32 {
        self.shape.pdf(from, point, normal)
    }

    /// The point as a surface that a photon leaves.
    pub fn surface(&self, u: [f32; 2]) -> SurfacePoint {
        let (point, normal) = self.shape.point(u);
        let error = self.shape.extent() * ROUNDING;
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
