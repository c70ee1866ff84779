//! Camera rays: a thin lens or a pinhole, parallel rays, and the sphere of all directions.
//!
//! The view plane of a perspective camera stands at distance 1 before the lens; the plane in focus at `focus_distance`.
//! All rays through the lens that belong to one film point meet on the plane in focus (Cook, Porter and Carpenter 1984);
//! those of an orthographic camera have a lens of their own around each point of the picture.

use std::f32::consts::{FRAC_2_PI, PI};

use glam::{DVec3, Vec2, Vec3};

use crate::components::{Camera, Lens, Projection};
use crate::trace::sampler::{Domain, Iris, RayNode, Sampler, concentric_disk, sin_cos_half_turns};
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::Ray;

/// A camera resolved for a picture of a given size.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraRays {
    projection: Projection,
    origin: Vec3,
    /// Unit, along the view.
    forward: Vec3,
    /// Across half of the picture, right and up: on the view plane for perspective, in the world for parallel rays, and
    /// unit for all directions.
    right: Vec3,
    up: Vec3,
    /// To the middle of the picture: on the view plane for perspective, where `shift` leads for parallel rays.
    middle: Vec3,
    /// How far the picture is shifted to the right and up, in halves of it.
    shift: [f32; 2],
    /// Lens radius (disk) or half side (square), as vectors along right and up.
    lens_right: Vec3,
    lens_up: Vec3,
    lens: Option<Lens>,
    iris: Option<Iris>,
    focus_distance: f32,
    pixel: [f32; 2],
}

/// What a camera ray stands for: how wide it starts, and how much it widens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelFootprint {
    /// World units.
    pub width: f32,
    /// Radians, taken as small.
    pub spread: f32,
}

impl CameraRays {
    /// `focus_distance` is measured along the view axis, in world units.
    pub fn new(camera: &Camera, size: [u32; 2], focus_distance: f64) -> Self {
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let axis = camera.axis();
        let right = axis.cross(camera.up).normalize_or(DVec3::X);
        let up = right.cross(axis);
        let radius = camera.lens_radius();
        let half = match camera.projection {
            Projection::Perspective => camera.half_height(aspect),
            Projection::Orthographic => camera.half_extent(aspect),
            Projection::Equirectangular => 1.0,
        };
        let half_width = if camera.projection == Projection::Equirectangular { 1.0 } else { half * aspect };
        let (half_right, half_up) = (right * half_width, up * half);
        let shift = camera.shift * 2.0;
        let shifted = half_right * shift.x + half_up * shift.y;
        let middle = match camera.projection {
            Projection::Perspective => axis + shifted,
            Projection::Orthographic => shifted,
            Projection::Equirectangular => axis,
        };
        CameraRays {
            projection: camera.projection,
            origin: camera.from.as_vec3(),
            forward: axis.as_vec3(),
            right: half_right.as_vec3(),
            up: half_up.as_vec3(),
            middle: middle.as_vec3(),
            shift: shift.as_vec2().to_array(),
            lens_right: (right * radius).as_vec3(),
            lens_up: (up * radius).as_vec3(),
            lens: (radius > 0.0).then_some(camera.lens),
            iris: (camera.blades > 2).then(|| Iris::new(camera.blades, camera.blade_angle)),
            focus_distance: focus_distance as f32,
            pixel: [2.0 / size[0] as f32, 2.0 / size[1] as f32],
        }
    }

    /// The same camera with the lens closed to a pinhole.
    pub fn pinhole(self) -> Self {
        CameraRays { lens: None, ..self }
    }

    /// Distance of a point along the view axis, from the middle of the lens; of all directions, the distance from the
    /// camera itself.
    pub fn depth(&self, point: Vec3) -> f32 {
        match self.projection {
            Projection::Perspective | Projection::Orthographic => (point - self.origin).dot(self.forward),
            Projection::Equirectangular => (point - self.origin).length(),
        }
    }

    /// Where a point is in the picture, seen from the middle of the lens: pixels from the top left corner, right and
    /// down; `None` for what is not before the camera.
    pub fn place_of(&self, point: Vec3) -> Option<Vec2> {
        let to = point - self.origin;
        let depth = to.dot(self.forward);
        let (across, down) = match self.projection {
            Projection::Perspective => (
                to.dot(self.right) / (self.right.length_squared() * depth) - self.shift[0],
                -to.dot(self.up) / (self.up.length_squared() * depth) + self.shift[1],
            ),
            Projection::Orthographic => (
                to.dot(self.right) / self.right.length_squared() - self.shift[0],
                -to.dot(self.up) / self.up.length_squared() + self.shift[1],
            ),
            Projection::Equirectangular => {
                let (aside, above) = (to.dot(self.right), to.dot(self.up));
                let level = (aside * aside + depth * depth).sqrt();
                (libm::atan2f(aside, depth) / PI, -libm::atan2f(above, level) * FRAC_2_PI)
            }
        };
        let is_seen = depth > 0.0 || self.projection == Projection::Equirectangular;
        is_seen.then(|| Vec2::new((across + 1.0) / self.pixel[0], (down + 1.0) / self.pixel[1]))
    }

    /// The way from one place in the picture to another, in pixels right and down: around the back where all directions
    /// are in the picture and that is shorter.
    pub fn way(&self, from: Vec2, to: Vec2) -> Vec2 {
        let way = to - from;
        let width = 2.0 / self.pixel[0];
        match self.projection {
            Projection::Equirectangular if way.x > width / 2.0 => Vec2::new(way.x - width, way.y),
            Projection::Equirectangular if way.x < -width / 2.0 => Vec2::new(way.x + width, way.y),
            Projection::Perspective | Projection::Orthographic | Projection::Equirectangular => way,
        }
    }

    /// What the ray of a pixel in the middle of the picture stands for.
    pub fn footprint(&self) -> PixelFootprint {
        let [wide, high] = self.pixel;
        let side = (self.right * wide).length().max((self.up * high).length());
        match self.projection {
            Projection::Perspective => PixelFootprint { width: 0.0, spread: side },
            Projection::Orthographic => PixelFootprint { width: side, spread: 0.0 },
            Projection::Equirectangular => PixelFootprint { width: 0.0, spread: (wide * PI).max(high * PI / 2.0) },
        }
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
        let (origin, middle) = (V3::splat(self.origin), V3::splat(self.middle));
        let (origin, direction) = match self.projection {
            Projection::Perspective => (origin, middle + right.scale(across) - up.scale(down)),
            Projection::Orthographic => {
                (origin + (middle + right.scale(across) - up.scale(down)), V3::splat(self.forward))
            }
            Projection::Equirectangular => {
                let [east, ahead] = sin_cos_half_turns(across);
                let [below, level] = sin_cos_half_turns(down * L::splat(0.5));
                (origin, middle.scale(ahead * level) + right.scale(east * level) - up.scale(below))
            }
        };
        let Some(lens) = self.lens else {
            return (origin, direction.normalize());
        };
        let [lx, ly] = match (lens, self.iris) {
            (Lens::Disk, Some(iris)) => iris.point([u, v]),
            (Lens::Disk, None) => concentric_disk([u, v]),
            (Lens::Square, _) => [two * u - one, two * v - one],
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
    fn parallel_rays_start_where_their_points_are() {
        let wide = Camera { projection: Projection::Orthographic, height: Some(3.0), ..camera() };
        let rays = CameraRays::new(&wide, [200, 100], 5.0);
        let corner = rays.ray(0, 0, [0.0, 0.0], &Sampler::new(0, 0, 1));
        assert_eq!((corner.origin, corner.direction), (Vec3::new(-3.0, 1.5, 5.0), Vec3::NEG_Z));
        assert_eq!(rays.footprint(), PixelFootprint { width: 0.03, spread: 0.0 });
        // Without a height of its own it sees what perspective sees at the distance of `at`.
        let rays = CameraRays::new(&Camera { height: None, ..wide }, [200, 100], 5.0);
        assert!((rays.ray(0, 0, [0.0, 0.0], &Sampler::new(0, 0, 1)).origin.y - 5.0).abs() < 1e-6);
    }

    #[test]
    fn all_directions_have_their_longitudes_and_latitudes() {
        let around = Camera { projection: Projection::Equirectangular, ..camera() };
        let rays = CameraRays::new(&around, [360, 180], 5.0);
        // `at` is in the middle; degrees are pixels.
        for (east, above) in [(0.0, 0.0), (90.0, 0.0), (-90.0, 30.0), (179.0, -60.0), (10.0, 89.0), (-45.0, -89.5)] {
            let [(sin_e, cos_e), (sin_a, cos_a)] = [east, above].map(crate::base::math::sin_cos_degrees);
            let expected = DVec3::new(sin_e * cos_a, sin_a, -cos_e * cos_a).as_vec3();
            let (x, y) = (east as f32 + 180.0, 90.0 - above as f32);
            let ray = rays.ray(x as u32, y as u32, [x.fract(), y.fract()], &Sampler::new(0, 0, 1));
            assert!((ray.direction - expected).length() < 2e-6, "{east} {above}: {} {expected}", ray.direction);
            assert!((rays.place_of(ray.origin + ray.direction * 7.0).unwrap() - Vec2::new(x, y)).length() < 1e-3);
            assert!((rays.depth(ray.origin + ray.direction * 7.0) - 7.0).abs() < 1e-5);
        }
        assert_eq!(rays.way(Vec2::new(359.0, 5.0), Vec2::new(2.0, 4.0)), Vec2::new(3.0, -1.0));
        assert!((rays.footprint().spread - PI / 180.0).abs() < 1e-7);
    }

    #[test]
    fn a_shifted_lens_shows_what_lies_beside() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let plain = Camera { projection, ..camera() };
            let shifted = Camera { shift: glam::DVec2::new(0.25, 0.5), ..plain.clone() };
            let [plain, shifted] = [plain, shifted].map(|camera| CameraRays::new(&camera, [200, 100], 5.0));
            let sampler = Sampler::new(0, 0, 1);
            // A quarter of 200 pixels to the right, half of 100 up.
            let (a, b) = (plain.ray(150, 10, [0.5, 0.5], &sampler), shifted.ray(100, 60, [0.5, 0.5], &sampler));
            assert!((a.origin - b.origin).length() < 1e-5 && (a.direction - b.direction).length() < 1e-6);
            let place = shifted.place_of(b.origin + b.direction * 4.0).unwrap();
            assert!((place - Vec2::new(100.5, 60.5)).length() < 1e-3, "{place}");
        }
    }

    #[test]
    fn rays_through_the_lens_meet_on_the_plane_in_focus() {
        let shapes = [(Lens::Disk, 0), (Lens::Square, 0), (Lens::Disk, 6)];
        let projections = [Projection::Perspective, Projection::Orthographic];
        for ((lens, blades), projection) in shapes.into_iter().flat_map(|a| projections.map(|b| (a, b))) {
            let camera = Camera { aperture: 0.5, lens, blades, projection, ..camera() };
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
            // Corners of a hexagon are met by few.
            assert!(widest > 0.43 && widest < 0.5 + 1e-6, "{widest}");
        }
    }
}
