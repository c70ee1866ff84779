//! A ray with what every test of a primitive needs of it.

use glam::Vec3;

use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::Ray;

/// A ray with what every test needs of it.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Where the ray starts.
    pub origin: Vec3,
    /// Unit length.
    pub direction: Vec3,
    /// 1 / direction; very large, not infinite, where that is 0.
    pub inverse: Vec3,
    /// The axes in cyclic order, so that the ray runs mostly along the last.
    pub axes: [usize; 3],
    /// What moves the ray onto the last axis: x -= shear[0] z, y -= shear[1] z, and z shear[2] is the distance.
    shear: Vec3,
    turned_origin: Vec3,
    turned_inverse: Vec3,
    /// Whether it was carried into a local space: its origin is then known but roughly.
    pub is_mapped: bool,
}

/// 1 / x, finite: 0 times it is 0, and no test meets a NaN.
#[inline(always)]
pub fn finite_recip<L: Lanes>(x: L) -> L {
    const LEAST: f32 = 1e-18;
    let (zero, most) = (L::splat(0.0), L::splat(1.0 / LEAST));
    let most = L::select(x.lt(zero), zero - most, most);
    L::select(x.abs().lt(L::splat(LEAST)), most, L::splat(1.0) / x)
}

/// The axis along which a ray mostly runs.
#[inline(always)]
pub fn dominant(direction: Vec3) -> usize {
    let [x, y, z] = direction.abs().to_array();
    if x > y && x > z {
        0
    } else if y > z {
        1
    } else {
        2
    }
}

impl PreparedRay {
    /// All that the ray alone decides.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let inverse = Vec3::new(finite_recip(direction.x), finite_recip(direction.y), finite_recip(direction.z));
        Self::with_inverse(origin, direction, inverse)
    }

    /// `inverse` holds [`finite_recip`] of each coordinate of the direction.
    #[inline(always)]
    pub fn with_inverse(origin: Vec3, direction: Vec3, inverse: Vec3) -> Self {
        let last = dominant(direction);
        let axes = [(last + 1) % 3, (last + 2) % 3, last];
        let along = inverse[last];
        let shear = Vec3::new(direction[axes[0]] * along, direction[axes[1]] * along, along);
        let turned = |v: Vec3| Vec3::new(v[axes[0]], v[axes[1]], v[axes[2]]);
        let (turned_origin, turned_inverse) = (turned(origin), turned(inverse));
        PreparedRay { origin, direction, inverse, axes, shear, turned_origin, turned_inverse, is_mapped: false }
    }

    /// Coordinates in the order in which `triangle` wants them.
    #[inline(always)]
    pub fn turned(&self, v: Vec3) -> Vec3 {
        Vec3::new(v[self.axes[0]], v[self.axes[1]], v[self.axes[2]])
    }

    /// The same ray in every lane.
    #[inline(always)]
    pub fn beam<L: Lanes>(&self) -> PreparedRayLanes<L> {
        PreparedRayLanes {
            origin: V3::splat(self.origin),
            direction: V3::splat(self.direction),
            inverse: V3::splat(self.inverse),
            axes: self.axes,
            turned_origin: V3::splat(self.turned_origin),
            turned_inverse: V3::splat(self.turned_inverse),
            shear: V3::splat(self.shear),
            is_mapped: self.is_mapped,
        }
    }
}

impl From<&Ray> for PreparedRay {
    #[inline(always)]
    fn from(ray: &Ray) -> Self {
        PreparedRay::new(ray.origin, ray.direction)
    }
}

/// A [`PreparedRay`] in every lane.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRayLanes<L> {
    /// Where the rays start.
    pub origin: V3<L>,
    /// Not necessarily unit.
    pub direction: V3<L>,
    /// One over each coordinate of the direction; infinite over 0.
    pub inverse: V3<L>,
    /// The order in which `triangle` wants coordinates.
    pub axes: [usize; 3],
    pub(super) turned_origin: V3<L>,
    pub(super) turned_inverse: V3<L>,
    pub(super) shear: V3<L>,
    /// See [`PreparedRay::is_mapped`].
    pub(super) is_mapped: bool,
}

impl<L: Lanes> PreparedRayLanes<L> {
    /// A ray of its own in every lane, all running mostly along the last of the axes: coordinates in their order.
    #[inline(always)]
    pub fn of_rays(axes: [usize; 3], origin: [L; 3], direction: [L; 3]) -> Self {
        let [dx, dy, dz] = direction;
        let inverse = [finite_recip(dx), finite_recip(dy), finite_recip(dz)];
        PreparedRayLanes {
            origin: world_order(axes, origin),
            direction: world_order(axes, direction),
            inverse: world_order(axes, inverse),
            axes,
            turned_origin: V3 { x: origin[0], y: origin[1], z: origin[2] },
            turned_inverse: V3 { x: inverse[0], y: inverse[1], z: inverse[2] },
            shear: V3 { x: dx * inverse[2], y: dy * inverse[2], z: inverse[2] },
            is_mapped: false,
        }
    }
}

/// Coordinates in the order x, y, z that stand in a cyclic order of the axes.
#[inline(always)]
fn world_order<L: Lanes>(axes: [usize; 3], turned: [L; 3]) -> V3<L> {
    let first = 2 - axes[2];
    V3 { x: turned[first], y: turned[(first + 1) % 3], z: turned[(first + 2) % 3] }
}
