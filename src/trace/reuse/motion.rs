//! Where surfaces were in the picture of the frame before.

use glam::{DAffine3, Mat3, Vec2, Vec3};

use crate::trace::camera::CameraRays;

/// The frame before, as far as it tells where a point of this frame was.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionVectors {
    camera: CameraRays,
    /// Maps from now to then, in the world, of what stood elsewhere: by authored index, rising.
    moved: Vec<(u32, Mat3, Vec3)>,
}

impl MotionVectors {
    /// `camera` is resolved for the size of this frame's picture; `moved` holds maps from the world of now to that of
    /// then, by authored index, rising.
    pub fn new(camera: CameraRays, moved: impl Iterator<Item = (u32, DAffine3)>) -> Self {
        let moved = moved.map(|(entity, map)| (entity, map.matrix3.as_mat3(), map.translation.as_vec3())).collect();
        MotionVectors { camera, moved }
    }

    /// How far a point of an entity has come in the picture, in pixels to the right and up: its place now less its
    /// place then, both seen from the middle of the lens. Exactly zero for what stands still before a camera that does;
    /// zero also for what was not before the camera.
    pub fn motion(&self, now: &CameraRays, point: Vec3, entity: u32) -> Vec2 {
        let then = match self.moved.binary_search_by_key(&entity, |(index, ..)| *index) {
            Ok(i) => self.moved[i].1 * point + self.moved[i].2,
            Err(_) => point,
        };
        let places = now.place_of(point).zip(self.camera.place_of(then));
        let motion = places.map_or(Vec2::ZERO, |(here, there)| {
            let way = now.way(there, here);
            // Not `-way.y`, which would be -0 for what stands still.
            Vec2::new(way.x, there.y - here.y)
        });
        if motion.is_finite() { motion } else { Vec2::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::base::math;
    use crate::components::{Camera, Projection};

    /// Pixels are 0.02 units wide at distance 1.
    fn camera(from: DVec3, at: DVec3) -> CameraRays {
        CameraRays::new(&Camera { from, at, fov: 90.0, ..Camera::default() }, [200, 100], 1.0)
    }

    #[test]
    fn what_moves_points_the_way_it_goes() {
        let now = camera(DVec3::ZERO, DVec3::NEG_Z);
        let step = |by: DVec3| DAffine3::from_translation(-by);
        let before = MotionVectors::new(now.clone(), [(3, step(DVec3::new(0.4, 0.2, 0.0)))].into_iter());
        let point = Vec3::new(1.0, -0.5, -4.0);
        let motion = before.motion(&now, point, 3);
        assert!((motion - Vec2::new(5.0, 2.5)).length() < 1e-4, "{motion}");
        assert_eq!(before.motion(&now, point, 2), Vec2::ZERO);
        // It comes nearer: away from the middle of the picture, from (-10, 5) of depth 5 to (-12.5, 6.25) of depth 4.
        let before = MotionVectors::new(now.clone(), [(0, step(DVec3::Z))].into_iter());
        let motion = before.motion(&now, Vec3::new(-1.0, 0.5, -4.0), 0);
        assert!((motion - Vec2::new(-2.5, 1.25)).length() < 1e-4, "{motion}");
    }

    #[test]
    fn a_turn_of_the_camera_moves_the_world_the_other_way() {
        // By 10 degrees to the left: what is straight ahead was left of the middle.
        let (sin, cos) = math::sin_cos_degrees(10.0);
        let now = camera(DVec3::ZERO, DVec3::new(-sin, 0.0, -cos));
        let before = MotionVectors::new(camera(DVec3::ZERO, DVec3::NEG_Z), std::iter::empty());
        let motion = before.motion(&now, (DVec3::new(-sin, 0.0, -cos) * 7.0).as_vec3(), 0);
        assert!((f64::from(motion.x) - 50.0 * sin / cos).abs() < 1e-4 && motion.y.abs() < 1e-4, "{motion}");
    }

    #[test]
    fn what_goes_over_the_edge_of_all_directions_goes_on() {
        let around = Camera {
            projection: Projection::Equirectangular,
            from: DVec3::ZERO,
            at: DVec3::NEG_Z,
            ..Camera::default()
        };
        let now = CameraRays::new(&around, [360, 180], 1.0);
        let [here, there] = [179.0, -179.0].map(|degrees| {
            let (sin, cos) = math::sin_cos_degrees(degrees);
            DVec3::new(sin, 0.0, -cos)
        });
        let before = MotionVectors::new(now.clone(), [(0, DAffine3::from_translation(here - there))].into_iter());
        assert!((before.motion(&now, there.as_vec3(), 0) - Vec2::new(2.0, 0.0)).length() < 1e-3);
    }

    #[test]
    fn what_was_behind_the_camera_has_no_motion() {
        let now = camera(DVec3::ZERO, DVec3::NEG_Z);
        for was in [DVec3::Z, DVec3::ZERO] {
            let map = DAffine3 { matrix3: glam::DMat3::ZERO, translation: was };
            let before = MotionVectors::new(now.clone(), [(0, map)].into_iter());
            assert_eq!(before.motion(&now, Vec3::new(0.5, 0.5, -2.0), 0), Vec2::ZERO);
        }
    }
}
