//! Camera rays: pinhole and thin lens.
//!
//! The view plane stands at distance 1 before the lens; the plane in focus at `focus_distance`. All rays through the
//! lens that belong to one film point meet on the plane in focus (Cook, Porter and Carpenter 1984).

use glam::{DVec3, Vec2, Vec3};

use crate::components::{Camera, Lens};
use crate::trace::sampler::{Domain, RayNode, Sampler, concentric_disk};
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::Ray;

/// A camera resolved for a picture of a given size.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraRays {
    origin: Vec3,
    /// To the middle of the view plane, and across half of it, right and up.
    forward: Vec3,
    right: Vec3,
    up: Vec3,
    /// Lens radius (disk) or half side (square), as vectors along right and up.
    lens_right: Vec3,
    lens_up: Vec3,
    lens: Option<Lens>,
    focus_distance: f32,
    pixel: [f32; 2],
}

impl CameraRays {
    /// `focus_distance` is measured along the view axis, in world units.
    pub fn new(camera: &Camera, size: [u32; 2], focus_distance: f64) -> Self {
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let half_height = camera.half_height(aspect);
        let axis = camera.axis();
        let right = axis.cross(camera.up).normalize_or(DVec3::X);
        let up = right.cross(axis);
        let radius = camera.lens_radius();
        CameraRays {
            origin: camera.from.as_vec3(),
            forward: axis.as_vec3(),
            right: (right * (half_height * aspect)).as_vec3(),
            up: (up * half_height).as_vec3(),
            lens_right: (right * radius).as_vec3(),
            lens_up: (up * radius).as_vec3(),
            lens: (radius > 0.0).then_some(camera.lens),
            focus_distance: focus_distance as f32,
            pixel: [2.0 / size[0] as f32, 2.0 / size[1] as f32],
        }
    }

    /// The same camera with the lens closed to a pinhole.
    pub fn pinhole(self) -> Self {
        CameraRays { lens: None, ..self }
    }

    /// Distance of a point along the view axis, from the middle of the lens.
    pub fn depth(&self, point: Vec3) -> f32 {
        (point - self.origin).dot(self.forward)
    }

    /// Where a point is in the picture, seen from the middle of the lens: pixels from the top left corner, right and
    /// down; `None` for what is not before the camera.
    pub fn place_of(&self, point: Vec3) -> Option<Vec2> {
        let to = point - self.origin;
        let depth = to.dot(self.forward);
        let across = to.dot(self.right) / (self.right.length_squared() * depth);
        let down = -to.dot(self.up) / (self.up.length_squared() * depth);
        (depth > 0.0).then(|| Vec2::new((across + 1.0) / self.pixel[0], (down + 1.0) / self.pixel[1]))
    }

    /// The angle between neighbouring pixels in the middle of the picture, in radians.
    pub fn spread(&self) -> f32 {
        (self.right * self.pixel[0]).length().max((self.up * self.pixel[1]).length())
    }

    /// The ray of one sample through pixel (x, y), counted from the top left, at the given offset in the pixel.
    #[inline(always)]
    pub fn ray(&self, x: u32, y: u32, offset: [f32; 2], sampler: &Sampler) -> Ray {
        let place = [x as f32 + offset[0], y as f32 + offset[1]];
        let square = if self.has_lens() { sampler.stratified(RayNode::CAMERA, Domain::Lens) } else { [0.5; 2] };
        let (origin, direction) = self.aim::<f32>(place, square);
        Ray::new(origin.into(), direction.into())
    }

    /// Whether rays start anywhere else than in the middle of the lens.
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// Origin and direction of rays through places of the picture, in pixels from the top left, and through points of
    /// the lens, which those of the unit square stand for.
    #[inline(always)]
    pub fn aim<L: Lanes>(&self, [x, y]: [L; 2], [u, v]: [L; 2]) -> (V3<L>, V3<L>) {
        let (one, two) = (L::splat(1.0), L::splat(2.0));
        let (across, down) = (x * L::splat(self.pixel[0]) - one, y * L::splat(self.pixel[1]) - one);
        let (right, up) = (V3::splat(self.right), V3::splat(self.up));
        let direction = V3::splat(self.forward) + right.scale(across) - up.scale(down);
        let origin = V3::splat(self.origin);
        let Some(lens) = self.lens else {
            return (origin, direction.normalize());
        };
        let [lx, ly] = match lens {
            Lens::Disk => concentric_disk([u, v]),
            Lens::Square => [two * u - one, two * v - one],
        };
        let shift = V3::splat(self.lens_right).scale(lx) + V3::splat(self.lens_up).scale(ly);
        (origin + shift, (direction.scale(L::splat(self.focus_distance)) - shift).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera { from: DVec3::new(0.0, 0.0, 5.0), at: DVec3::ZERO, fov: 90.0, ..Camera::default() }
    }

    #[test]
    fn the_corners_of_the_picture_span_the_field_of_view() {
        let rays = CameraRays::new(&camera(), [200, 100], 5.0);
        let sampler = Sampler::new(0, 0, 1);
        let top_left = rays.ray(0, 0, [0.0, 0.0], &sampler).direction;
        assert!((top_left - Vec3::new(-2.0, 1.0, -1.0).normalize()).length() < 1e-6);
        let middle = rays.ray(100, 50, [0.0, 0.0], &sampler).direction;
        assert!((middle - Vec3::NEG_Z).length() < 1e-6);
    }

    #[test]
    fn a_point_along_a_ray_is_where_the_ray_started() {
        let tilted = Camera { at: DVec3::new(1.0, -2.0, 0.5), up: DVec3::new(0.3, 1.0, 0.0), ..camera() };
        let rays = CameraRays::new(&tilted, [200, 100], 5.0);
        for (x, y, along) in [(0, 0, 0.5), (37, 91, 3.0), (199, 50, 80.0)] {
            let ray = rays.ray(x, y, [0.25, 0.75], &Sampler::new(0, 0, 1));
            let place = rays.place_of(ray.origin + ray.direction * along).unwrap();
            assert!((place - Vec2::new(x as f32 + 0.25, y as f32 + 0.75)).length() < 1e-3, "{place}");
            assert_eq!(rays.place_of(ray.origin - ray.direction * along), None);
        }
    }

    #[test]
    fn rays_through_the_lens_meet_on_the_plane_in_focus() {
        for lens in [Lens::Disk, Lens::Square] {
            let camera = Camera { aperture: 0.5, lens, ..camera() };
            let rays = CameraRays::new(&camera, [200, 100], 3.0);
            let pinhole = rays.clone().pinhole().ray(30, 20, [0.5, 0.5], &Sampler::new(0, 0, 1));
            let meeting = pinhole.origin + pinhole.direction * (3.0 / -pinhole.direction.z);
            let mut widest = 0.0f32;
            for pixel in 0..200 {
                let ray = rays.ray(30, 20, [0.5, 0.5], &Sampler::new(9, pixel, 1));
                let there = ray.origin + ray.direction * (3.0 / -ray.direction.z);
                assert!((there - meeting).length() < 1e-4);
                let off = ray.origin - pinhole.origin;
                widest = widest.max(if lens == Lens::Disk { off.length() } else { off.abs().max_element() });
            }
            assert!(widest > 0.45 && widest < 0.5 + 1e-6, "{widest}");
        }
    }
}
