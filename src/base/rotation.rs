//! Rotations between rotations: the shortest way, at a constant speed.

use glam::{DMat3, DQuat, DVec3};

use super::math::{euler_degrees, rotation_matrix};

/// Degrees from one angle to another by the shortest way, from -180 to 180.
pub fn shortest_turn(from: f64, to: f64) -> f64 {
    let turn = libm::fmod(to - from, 360.0);
    if turn > 180.0 {
        turn - 360.0
    } else if turn < -180.0 {
        turn + 360.0
    } else {
        turn
    }
}

/// Between two rotations (pitch, yaw, roll in degrees) about one axis, at a constant speed (Shoemake, SIGGRAPH 1985).
///
/// At 0 and 1 these are the angles themselves; between them angles are given from -180 to 180.
pub fn slerp_degrees(a: DVec3, b: DVec3, t: f64) -> DVec3 {
    if t == 0.0 || a == b {
        return a;
    }
    if t == 1.0 {
        return b;
    }
    let (from, to) = (quaternion(rotation_matrix(a)), quaternion(rotation_matrix(b)));
    euler_degrees(DMat3::from_quat(slerp(from, to, t)))
}

/// Between two directions along the great circle; lengths are interpolated straight.
///
/// Opposite directions have no shortest way: one of them is taken, always the same.
pub fn slerp_direction(a: DVec3, b: DVec3, t: f64) -> DVec3 {
    let (from, to) = (a.normalize_or_zero(), b.normalize_or_zero());
    let length = a.length() + (b.length() - a.length()) * t;
    let across = to - from * from.dot(to);
    let angle = libm::atan2(across.length(), from.dot(to));
    let across = across.try_normalize();
    let side = across.unwrap_or_else(|| if from.dot(to) < 0.0 { from.any_orthonormal_vector() } else { DVec3::ZERO });
    (from * libm::cos(angle * t) + side * libm::sin(angle * t)) * length
}

/// The unit quaternion of a rotation matrix, by the largest of its components: no division by what is nearly 0.
fn quaternion(m: DMat3) -> DQuat {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let trace = x.x + y.y + z.z;
    let q = if trace > 0.0 {
        DQuat::from_xyzw(y.z - z.y, z.x - x.z, x.y - y.x, 1.0 + trace)
    } else if x.x >= y.y && x.x >= z.z {
        DQuat::from_xyzw(1.0 + x.x - y.y - z.z, x.y + y.x, z.x + x.z, y.z - z.y)
    } else if y.y >= z.z {
        DQuat::from_xyzw(x.y + y.x, 1.0 + y.y - x.x - z.z, y.z + z.y, z.x - x.z)
    } else {
        DQuat::from_xyzw(z.x + x.z, y.z + z.y, 1.0 + z.z - x.x - y.y, x.y - y.x)
    };
    q.normalize()
}

fn slerp(a: DQuat, b: DQuat, t: f64) -> DQuat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let across = b - a * a.dot(b);
    let sine = across.length();
    if sine < 1e-12 {
        return a;
    }
    let angle = libm::atan2(sine, a.dot(b));
    (a * libm::cos(angle * t) + across * (libm::sin(angle * t) / sine)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_way_goes_through_0() {
        assert_eq!(shortest_turn(350.0, 10.0), 20.0);
        assert_eq!(shortest_turn(10.0, 350.0), -20.0);
        assert_eq!(shortest_turn(-720.0, 90.0), 90.0);
        assert_eq!(shortest_turn(0.0, 180.0), 180.0);
    }

    #[test]
    fn slerp_turns_at_a_constant_speed_about_one_axis() {
        let cases = [
            ([0.0, 350.0, 0.0], [0.0, 10.0, 0.0]),
            ([10.0, 20.0, 30.0], [-70.0, 160.0, -100.0]),
            ([80.0, 0.0, 0.0], [80.0, 180.0, 0.0]),
            ([0.0, 0.0, 0.0], [0.0, 0.0, 179.0]),
        ];
        for (a, b) in cases {
            let (a, b) = (DVec3::from_array(a), DVec3::from_array(b));
            let angle_between = |p: DVec3, q: DVec3| {
                let m = rotation_matrix(p).transpose() * rotation_matrix(q);
                libm::acos(((m.x_axis.x + m.y_axis.y + m.z_axis.z - 1.0) / 2.0).clamp(-1.0, 1.0))
            };
            let whole = angle_between(a, b);
            for i in 0..10 {
                let at = |i: i32| slerp_degrees(a, b, f64::from(i) / 10.0);
                assert!((angle_between(at(i), at(i + 1)) - whole / 10.0).abs() < 1e-6, "{a} {b} {i}");
            }
        }
        let half = slerp_degrees(DVec3::new(0.0, 350.0, 0.0), DVec3::new(0.0, 10.0, 0.0), 0.5);
        assert!(half.length() < 1e-9, "{half}");
    }

    #[test]
    fn directions_go_along_the_great_circle() {
        let half = slerp_direction(DVec3::X, DVec3::Y * 3.0, 0.5);
        assert!((half - DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0) * 2.0).length() < 1e-12);
        assert!(slerp_direction(DVec3::X, -DVec3::X, 0.5).dot(DVec3::X).abs() < 1e-12);
        assert_eq!(slerp_direction(DVec3::X, DVec3::X, 0.3), DVec3::X);
    }
}
