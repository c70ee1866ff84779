//! The nearest hit so far, and the rule for ties.

use super::tag::Sides;

/// The nearest hit so far.
#[derive(Clone, Copy, Debug)]
pub struct ClosestHit {
    /// Distance along the ray, in lengths of its direction; how far the ray goes while nothing is found.
    pub t: f32,
    /// The primitive's number.
    pub primitive: u32,
    /// Triangle of an instance.
    pub element: u32,
    /// The first parameter of the point on the primitive, as in `Hit`.
    pub u: f32,
    /// The second one.
    pub v: f32,
    /// Whether there is one.
    pub found: bool,
}

impl ClosestHit {
    /// Nothing found yet along a ray that goes so far.
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

    /// Offers where a line enters and leaves a convex solid; `u` keeps the distance for `Geometry::surface`.
    #[inline(always)]
    pub fn offer_span(&mut self, [near, far]: [f32; 2], sides: Sides, number: u32) {
        if near > 0.0 && sides != Sides::Back {
            self.offer(near, number, 0, near, 0.0);
        } else if far > 0.0 && sides != Sides::Front {
            self.offer(far, number, 0, far, 0.0);
        }
    }
}
