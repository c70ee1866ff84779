//! Shapes: plain numbers in the local space of their entity.
//!
//! A shape stands where its fields put it; the entity's transform, if any, then carries it into the world. Lengths are
//! world units before that transform.

use glam::{DAffine3, DVec2, DVec3};

use super::record::ranges::{coordinate, direction, position};
use super::record::{Check, Invalid, record};

/// How far a shape reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// It has no point.
    Empty,
    /// It has bounds.
    Finite,
    /// It reaches everywhere.
    Infinite,
}

/// What every shape says of itself, whatever it is traced as.
pub trait Shape {
    /// How far it reaches.
    fn reach(&self) -> Reach {
        Reach::Finite
    }

    /// Its support function in local space: the greatest dot product of its points and a direction, which may have any
    /// length. It may be larger than that, for shapes whose points are many.
    fn support(&self, direction: DVec3) -> f64;

    /// Whether it encloses a point of local space; nothing does that has no inside.
    fn holds(&self, point: DVec3) -> bool;

    /// How many primitives rays are tested against.
    fn primitive_count(&self) -> usize {
        1
    }
}

/// Lower and upper corner of a box along the world's axes around a shape that a map carries into the world; `None` if the
/// shape has no bounds.
pub fn world_bounds(shape: &dyn Shape, map: &DAffine3) -> Option<[DVec3; 2]> {
    if shape.reach() != Reach::Finite {
        return None;
    }
    let to_local = map.matrix3.transpose();
    let reach = |d: DVec3| shape.support(to_local * d);
    let max = DVec3::new(reach(DVec3::X), reach(DVec3::Y), reach(DVec3::Z));
    let min = -DVec3::new(reach(DVec3::NEG_X), reach(DVec3::NEG_Y), reach(DVec3::NEG_Z));
    Some([map.translation + min, map.translation + max])
}

/// The support function of a box.
pub(super) fn support_of_box([min, max]: [DVec3; 2], direction: DVec3) -> f64 {
    (min * direction).max(max * direction).element_sum()
}

/// The support function of the convex hull of two disks across the line between their centres.
fn support_of_disks(ends: [(DVec3, f64); 2], direction: DVec3) -> f64 {
    let axis = (ends[1].0 - ends[0].0).normalize_or_zero();
    let across = (direction - axis * direction.dot(axis)).length();
    let support = |(center, radius): (DVec3, f64)| center.dot(direction) + radius.abs() * across;
    ends.into_iter().map(support).fold(f64::NEG_INFINITY, f64::max)
}

/// Whether a point lies in the frustum between two disks across the line between their centres.
fn is_between_disks([base, apex]: [(DVec3, f64); 2], point: DVec3) -> bool {
    let axis = apex.0 - base.0;
    let t = (point - base.0).dot(axis) / axis.length_squared();
    let radius = base.1.abs() + t * (apex.1.abs() - base.1.abs());
    t > 0.0 && t < 1.0 && point.distance(base.0 + axis * t) < radius
}

record! {
    /// A sphere.
    ///
    /// Texture coordinates, in local space: u is the angle around y as a share of a turn, to the east (from +z towards
    /// +x), with 0.5 at +z, so that the seam is at -z; v is the angle from -y (0) to +y (1).
    pub struct Sphere {
        /// Centre, local space.
        pub center: DVec3 = DVec3::ZERO,
        /// Radius, not 0; a negative one shows the inside only (as NFF has it).
        pub radius: f64 = 1.0,
    }
}

impl Check for Sphere {
    fn check(&self) -> Result<(), Invalid> {
        position("center", self.center)?;
        nonzero("radius", self.radius)
    }
}

impl Shape for Sphere {
    fn support(&self, direction: DVec3) -> f64 {
        self.center.dot(direction) + self.radius.abs() * direction.length()
    }
    fn holds(&self, point: DVec3) -> bool {
        self.center.distance(point) < self.radius.abs()
    }
}

fn nonzero(field: &'static str, x: f64) -> Result<(), Invalid> {
    coordinate(field, x)?;
    if x == 0.0 { Err(Invalid { field, message: format!("`{field}` must not be 0") }) } else { Ok(()) }
}

record! {
    /// One triangle, counter-clockwise seen from its front.
    pub struct Triangle {
        /// Corners, local space.
        pub vertices: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y],
        /// Shading normals at the corners, of any length; flat without them.
        pub normals: Option<Box<[DVec3; 3]>> = None,
        /// Texture coordinates (u, v) at the corners; (0, 0), (1, 0), (0, 1) without them.
        pub uvs: Option<Box<[DVec2; 3]>> = None,
    }
}

impl Check for Triangle {
    fn check(&self) -> Result<(), Invalid> {
        self.vertices.iter().try_for_each(|v| position("vertices", *v))?;
        self.normals.iter().flat_map(|n| n.iter()).try_for_each(|n| position("normals", *n))?;
        self.uvs.iter().flat_map(|t| t.iter()).try_for_each(|t| position("uvs", t.extend(0.0)))
    }
}

impl Shape for Triangle {
    fn support(&self, direction: DVec3) -> f64 {
        self.vertices.iter().map(|v| v.dot(direction)).fold(f64::NEG_INFINITY, f64::max)
    }
    fn holds(&self, _: DVec3) -> bool {
        false
    }
}

record! {
    /// An infinite plane.
    ///
    /// Texture coordinates: local units from `point`, v upwards (towards local +y) and u to the right of it seen from
    /// the front; on a floor u runs along +x and v along -z.
    pub struct Plane {
        /// Any point of it, local space.
        pub point: DVec3 = DVec3::ZERO,
        /// Its front side, of any length but 0.
        pub normal: DVec3 = DVec3::Y,
    }
}

impl Check for Plane {
    fn check(&self) -> Result<(), Invalid> {
        position("point", self.point)?;
        direction("normal", self.normal)
    }
}

impl Shape for Plane {
    fn reach(&self) -> Reach {
        Reach::Infinite
    }
    fn support(&self, _: DVec3) -> f64 {
        f64::INFINITY
    }
    fn holds(&self, _: DVec3) -> bool {
        false
    }
}

record! {
    /// A solid box along the local axes.
    ///
    /// Texture coordinates run from 0 to 1 over each face: on the sides u to the right seen from outside and v along +y,
    /// on top u along +x and v along -z, at the bottom u along +x and v along +z.
    pub struct AABox {
        /// Lower corner, local space.
        pub min: DVec3 = DVec3::splat(-0.5),
        /// Upper corner, local space; not below `min` on any axis.
        pub max: DVec3 = DVec3::splat(0.5),
    }
}

impl Check for AABox {
    fn check(&self) -> Result<(), Invalid> {
        position("min", self.min)?;
        position("max", self.max)?;
        if self.min.cmple(self.max).all() {
            return Ok(());
        }
        let message = format!("`max` {} must not be below `min` {} on any axis", self.max, self.min);
        Err(Invalid { field: "max", message })
    }
}

impl Shape for AABox {
    fn support(&self, direction: DVec3) -> f64 {
        support_of_box([self.min.min(self.max), self.max.max(self.min)], direction)
    }
    fn holds(&self, point: DVec3) -> bool {
        point.cmpgt(self.min).all() && point.cmplt(self.max).all()
    }
}

record! {
    /// A cylinder between two points.
    ///
    /// Texture coordinates as those of a [`Cone`].
    pub struct Cylinder {
        /// Centre of one end, local space.
        pub base: DVec3 = DVec3::ZERO,
        /// Centre of the other end; not the same point.
        pub apex: DVec3 = DVec3::Y,
        /// Radius, not 0; negative shows the inside only.
        pub radius: f64 = 0.5,
        /// Whether disks close the ends.
        pub capped: bool = true,
    }
}

impl Check for Cylinder {
    fn check(&self) -> Result<(), Invalid> {
        nonzero("radius", self.radius)?;
        axis(self.base, self.apex)
    }
}

impl Shape for Cylinder {
    fn support(&self, direction: DVec3) -> f64 {
        support_of_disks([(self.base, self.radius), (self.apex, self.radius)], direction)
    }
    fn holds(&self, point: DVec3) -> bool {
        self.capped && is_between_disks([(self.base, self.radius), (self.apex, self.radius)], point)
    }
}

fn axis(base: DVec3, apex: DVec3) -> Result<(), Invalid> {
    position("base", base)?;
    position("apex", apex)?;
    if base == apex {
        return Err(Invalid { field: "apex", message: "`apex` must not be the same point as `base`".into() });
    }
    Ok(())
}

record! {
    /// A cone, or the frustum of one, between two points.
    ///
    /// Texture coordinates, in local space: u is the angle around the axis as a share of a turn, as on a sphere with its
    /// north at the apex, v runs from 0 at the base to 1 at the apex. On the caps the unit square stands around the disk,
    /// u to the right and v up as the cap is seen from outside.
    pub struct Cone {
        /// Centre of the wide end, local space.
        pub base: DVec3 = DVec3::ZERO,
        /// Radius at the base; both radii negative show the inside only.
        pub base_radius: f64 = 0.5,
        /// Centre of the other end; not the same point.
        pub apex: DVec3 = DVec3::Y,
        /// Radius at the apex; 0 is a point.
        pub apex_radius: f64 = 0.0,
        /// Whether disks close the ends.
        pub capped: bool = true,
    }
}

impl Check for Cone {
    fn check(&self) -> Result<(), Invalid> {
        coordinate("base_radius", self.base_radius)?;
        coordinate("apex_radius", self.apex_radius)?;
        axis(self.base, self.apex)?;
        if self.base_radius == 0.0 && self.apex_radius == 0.0 {
            return Err(Invalid { field: "base_radius", message: "one of the radii must not be 0".into() });
        }
        if self.base_radius * self.apex_radius < 0.0 {
            let message = "`base_radius` and `apex_radius` must have the same sign".into();
            return Err(Invalid { field: "apex_radius", message });
        }
        Ok(())
    }
}

impl Shape for Cone {
    fn support(&self, direction: DVec3) -> f64 {
        support_of_disks([(self.base, self.base_radius), (self.apex, self.apex_radius)], direction)
    }
    fn holds(&self, point: DVec3) -> bool {
        self.capped && is_between_disks([(self.base, self.base_radius), (self.apex, self.apex_radius)], point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points inside and outside of each shape.
    #[test]
    fn shapes_hold_what_is_inside_of_them() {
        let cone = Cone { base_radius: 2.0, apex_radius: 1.0, apex: DVec3::Y * 2.0, ..Cone::default() };
        let open = Cylinder { capped: false, ..Cylinder::default() };
        let shapes: [(&dyn Shape, DVec3, DVec3); 4] = [
            (&Sphere { center: DVec3::X, radius: -2.0 }, DVec3::new(2.9, 0.0, 0.0), DVec3::new(-1.1, 0.0, 0.0)),
            (&AABox::default(), DVec3::splat(0.49), DVec3::new(0.0, 0.51, 0.0)),
            (&Cylinder::default(), DVec3::new(0.49, 0.5, 0.0), DVec3::new(0.4, 0.5, 0.4)),
            (&cone, DVec3::new(1.4, 1.0, 0.0), DVec3::new(1.6, 1.0, 0.0)),
        ];
        for (number, (shape, inside, outside)) in shapes.into_iter().enumerate() {
            assert_eq!([inside, outside].map(|point| shape.holds(point)), [true, false], "{number}");
        }
        let enclosing_nothing: [&dyn Shape; 3] = [&open, &Triangle::default(), &Plane::default()];
        assert!(enclosing_nothing.iter().all(|shape| !shape.holds(DVec3::new(0.1, 0.1, 0.0))));
    }
}
