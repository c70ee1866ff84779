//! Exact mathematics: the same bits on every machine.
//!
//! IEEE 754 guarantees `+ - * / sqrt`; everything else comes from the `libm` crate, never from the system's library.
//! Angles are degrees at the surface (scenes, scripts) and become sines and cosines here.

use glam::{DAffine3, DMat3, DVec3};

/// Sine and cosine of an angle in degrees; exact at every multiple of 90.
pub fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turn = libm::fmod(degrees, 360.0);
    let quarter = libm::floor(turn / 90.0);
    let rest = (turn - quarter * 90.0).to_radians();
    let (s, c) = if rest == 0.0 { (0.0, 1.0) } else { (libm::sin(rest), libm::cos(rest)) };
    match (quarter as i64).rem_euclid(4) {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Rotation matrix of Euler angles in degrees: pitch about x, yaw about y, roll about z.
///
/// Roll is applied first, then pitch, then yaw (R = Ry Rx Rz), so that yaw turns the object as it stands.
pub fn rotation_matrix(pitch_yaw_roll: DVec3) -> DMat3 {
    let (sx, cx) = sin_cos_degrees(pitch_yaw_roll.x);
    let (sy, cy) = sin_cos_degrees(pitch_yaw_roll.y);
    let (sz, cz) = sin_cos_degrees(pitch_yaw_roll.z);
    let rx = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
    let ry = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
    let rz = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
    ry * rx * rz
}

/// Euler angles in degrees (pitch, yaw, roll) of a rotation matrix: the inverse of [`rotation_matrix`].
///
/// At the poles (pitch of +-90) roll is taken as zero.
pub fn euler_degrees(m: DMat3) -> DVec3 {
    let sin_pitch = (-m.z_axis.y).clamp(-1.0, 1.0);
    let pitch = libm::asin(sin_pitch);
    let (yaw, roll) = if sin_pitch.abs() < 1.0 - 1e-12 {
        (libm::atan2(m.z_axis.x, m.z_axis.z), libm::atan2(m.x_axis.y, m.y_axis.y))
    } else {
        (libm::atan2(-m.x_axis.z, m.x_axis.x), 0.0)
    };
    DVec3::new(pitch, yaw, roll).map(f64::to_degrees)
}

/// As far as this from 0, numbers in `f32` have steps of 1/8192 at most: near enough to count from 0.
const NEAR: f64 = 2_048.0;
/// Other origins stand on a lattice this far apart.
const LATTICE: f64 = 64.0;

/// An origin for numbers in `f32` around a point: 0 for what lies near 0, else the nearest point of a lattice; 0 also for
/// what is no point.
pub fn lattice_origin(point: DVec3) -> DVec3 {
    if !point.is_finite() {
        return DVec3::ZERO;
    }
    point.map(|x| if x.abs() < NEAR { 0.0 } else { (x / LATTICE).round() * LATTICE })
}

/// Rotation matrix of a unit quaternion x, y, z, w.
pub fn quaternion_matrix([x, y, z, w]: [f64; 4]) -> DMat3 {
    let (x2, y2, z2) = (x + x, y + y, z + z);
    DMat3::from_cols(
        DVec3::new(1.0 - (y * y2 + z * z2), x * y2 + w * z2, x * z2 - w * y2),
        DVec3::new(x * y2 - w * z2, 1.0 - (x * x2 + z * z2), y * z2 + w * x2),
        DVec3::new(x * z2 + w * y2, y * z2 - w * x2, 1.0 - (x * x2 + y * y2)),
    )
}

/// Unit quaternion x, y, z, w of a rotation matrix: the inverse of [`quaternion_matrix`], up to its sign.
///
/// The largest component is found first, so that nothing is divided by a small number (Shepperd 1978).
pub fn matrix_quaternion(m: DMat3) -> [f64; 4] {
    let (a, b, c) = (m.x_axis, m.y_axis, m.z_axis);
    let squares = [1.0 + a.x - b.y - c.z, 1.0 - a.x + b.y - c.z, 1.0 - a.x - b.y + c.z, 1.0 + a.x + b.y + c.z];
    let largest = (0..4).fold(3, |best, k| if squares[k] > squares[best] { k } else { best });
    let parts = match largest {
        0 => [squares[0], a.y + b.x, a.z + c.x, b.z - c.y],
        1 => [a.y + b.x, squares[1], b.z + c.y, c.x - a.z],
        2 => [a.z + c.x, b.z + c.y, squares[2], a.y - b.x],
        _ => [b.z - c.y, c.x - a.z, a.y - b.x, squares[3]],
    };
    let scale = 0.5 / squares[largest].max(f64::MIN_POSITIVE).sqrt();
    parts.map(|part| part * scale)
}

/// Rotation (pitch, yaw, roll in degrees) that turns the local axis -z from `from` towards `at`, +y staying near `up`.
///
/// Identical points give no rotation; an `up` parallel to the view is replaced by another axis.
pub fn look_at_degrees(from: DVec3, at: DVec3, up: DVec3) -> DVec3 {
    let back = (from - at).normalize_or_zero();
    if back == DVec3::ZERO {
        return DVec3::ZERO;
    }
    let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
    euler_degrees(DMat3::from_cols(right, back.cross(right), back))
}

/// Affine map of translation, rotation (degrees) and scale, applied to a point in the order scale, rotate, translate.
pub fn placement(translation: DVec3, rotation: DVec3, scale: DVec3) -> DAffine3 {
    let m = rotation_matrix(rotation) * DMat3::from_diagonal(scale);
    DAffine3 { matrix3: m, translation }
}

/// Translation, rotation (degrees) and scale of a map: the inverse of [`placement`]; `None` if no such three give it, for
/// it shears or flattens. A mirroring map has a negative scale along x.
pub fn decompose(map: &DAffine3) -> Option<(DVec3, DVec3, DVec3)> {
    let m = map.matrix3;
    let mut scale = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
    if !map.is_finite() || scale.min_element() <= 1e-12 * scale.max_element() {
        return None;
    }
    if m.x_axis.cross(m.y_axis).dot(m.z_axis) < 0.0 {
        scale.x = -scale.x;
    }
    let rotation = DMat3::from_cols(m.x_axis / scale.x, m.y_axis / scale.y, m.z_axis / scale.z);
    let [x, y, z] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
    let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs());
    (skew <= 1e-9).then(|| (map.translation, euler_degrees(rotation), scale))
}

/// The factor of a map that keeps shapes similar (rotation, uniform scale, mirror); `None` if it shears or squashes.
pub fn uniform_scale(map: &DAffine3) -> Option<f64> {
    let m = map.matrix3;
    let (x, y, z) = (m.x_axis.length_squared(), m.y_axis.length_squared(), m.z_axis.length_squared());
    let largest = x.max(y).max(z);
    let skew = m.x_axis.dot(m.y_axis).abs().max(m.y_axis.dot(m.z_axis).abs()).max(m.z_axis.dot(m.x_axis).abs());
    let same = largest - x.min(y).min(z) <= 1e-12 * largest && skew <= 1e-12 * largest;
    (same && largest > 0.0).then(|| largest.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_angles_are_exact() {
        for (degrees, expected) in [
            (0.0, (0.0, 1.0)),
            (90.0, (1.0, 0.0)),
            (180.0, (0.0, -1.0)),
            (270.0, (-1.0, 0.0)),
            (-90.0, (-1.0, 0.0)),
            (720.0, (0.0, 1.0)),
        ] {
            assert_eq!(sin_cos_degrees(degrees), expected, "{degrees}");
        }
        let (s, c) = sin_cos_degrees(-30.0);
        assert!((s + 0.5).abs() < 1e-15 && (c - 0.75f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn euler_angles_come_back() {
        for angles in [[10.0, 20.0, 30.0], [-80.0, 170.0, -5.0], [0.0, 90.0, 0.0], [89.0, -45.0, 120.0]] {
            let angles = DVec3::from_array(angles);
            assert!((euler_degrees(rotation_matrix(angles)) - angles).length() < 1e-9, "{angles}");
        }
        let straight_down = rotation_matrix(DVec3::new(-90.0, 30.0, 0.0));
        assert!((rotation_matrix(euler_degrees(straight_down)).z_axis - straight_down.z_axis).length() < 1e-9);
    }

    #[test]
    fn look_at_points_minus_z_at_the_target() {
        let from = DVec3::new(3.0, 4.0, -5.0);
        let at = DVec3::new(-1.0, 0.5, 2.0);
        let axis = rotation_matrix(look_at_degrees(from, at, DVec3::Y)) * DVec3::NEG_Z;
        assert!((axis - (at - from).normalize()).length() < 1e-12);
        let down = rotation_matrix(look_at_degrees(DVec3::Y, DVec3::ZERO, DVec3::Y)) * DVec3::NEG_Z;
        assert!((down - DVec3::NEG_Y).length() < 1e-7);
    }

    #[test]
    fn what_a_map_is_made_of_gives_the_map_again() {
        for scale in [DVec3::ONE, DVec3::new(2.0, 0.5, 3.0), DVec3::new(-1.0, 2.0, 1.0), DVec3::new(1.0, -2.0, 1.0)] {
            let map = placement(DVec3::new(1.0, 2.0, 3.0), DVec3::new(20.0, -130.0, 75.0), scale);
            let (translation, rotation, scale) = decompose(&map).unwrap();
            let again = placement(translation, rotation, scale);
            assert!(again.abs_diff_eq(map, 1e-12), "{map:?} {again:?}");
        }
        let sheared = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::Z));
        assert_eq!(decompose(&sheared), None);
        assert_eq!(decompose(&placement(DVec3::ZERO, DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0))), None);
    }

    #[test]
    fn uniform_scale_tells_similarity_from_shear() {
        let spin = DVec3::new(12.0, 34.0, 56.0);
        assert!((uniform_scale(&placement(DVec3::ONE, spin, DVec3::splat(2.5))).unwrap() - 2.5).abs() < 1e-9);
        assert_eq!(uniform_scale(&placement(DVec3::ONE, spin, DVec3::new(1.0, 2.0, 1.0))), None);
        assert_eq!(uniform_scale(&placement(DVec3::ONE, spin, DVec3::ZERO)), None);
    }
}
