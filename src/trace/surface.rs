//! The point that a ray met: where it is, how exactly that is known, and which way is out.

use glam::Vec3;

/// A bound for the rounding error of a handful of operations, relative to the size of their operands: twice the
/// gamma(4) of Higham that `pbrt` uses (pbrt-v4, section 6.8), since the test that a leaving ray meets errs too.
pub const ROUNDING: f32 = 8.0 * (f32::EPSILON / 2.0);

/// The point that a ray met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    pub point: Vec3,
    /// Bound of the rounding error of `point`, per axis.
    pub error: Vec3,
    /// Unit, towards the front (outside) whatever side the ray came from.
    pub geometric_normal: Vec3,
    /// Unit, on the same side as the geometric normal.
    pub shading_normal: Vec3,
    /// Whether a map has bent the shading normal.
    pub bent: bool,
    pub material: u32,
    pub entity: u32,
}

impl Surface {
    /// The same point seen from the other side: both normals turned round.
    #[inline(always)]
    pub fn flipped(self) -> Surface {
        Surface { geometric_normal: -self.geometric_normal, shading_normal: -self.shading_normal, ..self }
    }

    /// A start for a ray that leaves towards `direction`, off the surface by no more than the rounding error.
    #[inline(always)]
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        let n = self.geometric_normal;
        let distance = n.abs().dot(self.error);
        let offset = if n.dot(direction) < 0.0 { -n * distance } else { n * distance };
        // The sum is rounded: away from the surface, never back towards it.
        let away = |p: f32, o: f32| {
            if o > 0.0 {
                (p + o).next_up()
            } else if o < 0.0 {
                (p + o).next_down()
            } else {
                p
            }
        };
        Vec3::new(away(self.point.x, offset.x), away(self.point.y, offset.y), away(self.point.z, offset.z))
    }
}
