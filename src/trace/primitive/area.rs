//! Sampling of the surface of a shape, by its area and as it is seen from a point.

use glam::Vec3;

use super::bounds::Bounds;

/// A point of a surface as it is seen from another point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSample {
    /// The point, in the space that is traced.
    pub point: Vec3,
    /// Unit, towards the outside.
    pub normal: Vec3,
    /// Per steradian.
    pub pdf: f32,
}

impl AreaSample {
    /// A point that was chosen evenly among this area; `None` if it is seen edge on.
    pub fn by_area(from: Vec3, point: Vec3, normal: Vec3, area: f32) -> Option<Self> {
        let square = (point - from).length_squared();
        let pdf = square / (area * normal.dot(point - from).abs() / square.sqrt());
        (pdf > 0.0 && pdf < f32::INFINITY).then_some(AreaSample { point, normal, pdf })
    }
}

/// The density of such a point per steradian; 0 if it is seen edge on.
pub fn area_pdf(from: Vec3, point: Vec3, normal: Vec3, area: f32) -> f32 {
    let offset = point - from;
    let square = offset.length_squared();
    let pdf = square / (area * normal.dot(offset).abs() / square.sqrt());
    if pdf < f32::INFINITY { pdf } else { 0.0 }
}

/// What sampling needs of a shape.
pub trait AreaSampling {
    /// Whether it has an inside, so that light of one side never reaches the other.
    const IS_CLOSED: bool;

    fn area(&self) -> f32;
    /// A point by area for a point of the unit square, and the normal there, unit, towards the outside.
    fn point(&self, u: [f32; 2]) -> (Vec3, Vec3);
    /// The box around all that is sampled.
    fn area_bounds(&self) -> Bounds;
    /// Bound of its coordinates.
    fn extent(&self) -> Vec3;

    /// A point of it for light towards `from`, for a point of the unit square; `None` if none is seen.
    fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<AreaSample> {
        let (point, normal) = self.point(u);
        AreaSample::by_area(from, point, normal, self.area())
    }

    /// Density of [`Self::sample`] per steradian at a point that a ray from `from` met.
    fn pdf(&self, from: Vec3, point: Vec3, normal: Vec3) -> f32 {
        area_pdf(from, point, normal, self.area())
    }
}

/// The area of shapes that are not sampled: there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoArea {}

impl AreaSampling for NoArea {
    const IS_CLOSED: bool = false;

    fn area(&self) -> f32 {
        match *self {}
    }
    fn point(&self, _: [f32; 2]) -> (Vec3, Vec3) {
        match *self {}
    }
    fn area_bounds(&self) -> Bounds {
        match *self {}
    }
    fn extent(&self) -> Vec3 {
        match *self {}
    }
}
