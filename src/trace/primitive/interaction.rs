//! What points of hits are made from, side by side.

use glam::Vec3;

use super::surface::SurfacePoint;
use crate::trace::simd::{LANES, set_lane};

/// What points of hits are made from, lane by lane.
#[derive(Default)]
pub struct InteractionLanes {
    pub(super) corners: [[[f32; LANES]; 3]; 3],
    pub(super) mixed: [[f32; LANES]; 3],
    /// A bit for each lane with a triangle, with a smooth one, with a sphere.
    pub(super) triangles: u32,
    pub(super) smooth: u32,
    pub(super) spheres: u32,
    pub(super) center: [[f32; LANES]; 3],
    pub(super) radius: [f32; LANES],
    /// Of all other shapes: point, error, geometric and shading normal.
    pub(super) others: [[[f32; LANES]; 3]; 4],
}

impl InteractionLanes {
    /// `mixed` is the interpolated normal of a smooth triangle, of any length.
    #[inline(always)]
    pub fn add_triangle(&mut self, lane: usize, corners: [Vec3; 3], mixed: Option<Vec3>) {
        self.triangles |= 1 << lane;
        for (column, corner) in self.corners.iter_mut().zip(&corners) {
            set_lane(column, lane, *corner);
        }
        if let Some(mixed) = mixed {
            self.smooth |= 1 << lane;
            set_lane(&mut self.mixed, lane, mixed);
        }
    }

    #[inline(always)]
    pub fn add_sphere(&mut self, lane: usize, center: Vec3, radius: f32) {
        self.spheres |= 1 << lane;
        set_lane(&mut self.center, lane, center);
        self.radius[lane] = radius;
    }

    pub(super) fn add_other(&mut self, lane: usize, s: &SurfacePoint) {
        for (column, v) in self.others.iter_mut().zip([s.point, s.error, s.geometric_normal, s.shading_normal]) {
            set_lane(column, lane, v);
        }
    }
}
