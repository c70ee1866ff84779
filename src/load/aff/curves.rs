//! Keys with tension, continuity and bias -> tracks.
//!
//! D. H. U. Kochanek and R. H. Bartels, Interpolating Splines with Local Tension, Continuity, and Bias Control, SIGGRAPH
//! 1984, with tangents adjusted for keys at uneven times; rotations go by the same tangents in the logarithms of unit
//! quaternions. The first and the last key only shape the tangents of their neighbours.

use glam::DVec3;

use crate::components::animation::unit;
use crate::components::{KeyInterpolation, Text, Track, TrackProperty};

/// One key of a position, a scale, or a rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveKey<T> {
    pub time: f64,
    pub value: T,
    pub tension: f64,
    pub continuity: f64,
    pub bias: f64,
}

impl<T> CurveKey<T> {
    /// Shares of the difference to the key before and to the one behind in the tangent out of the key, and in the one
    /// into it.
    fn shares(&self, before: f64, behind: f64) -> [[f64; 2]; 2] {
        let (t, c, b) = (self.tension, self.continuity, self.bias);
        let (span, into, out) = (behind - before, self.time - before, behind - self.time);
        // Tangents are per segment: those of a short one beside a long one are shortened.
        let adjusted = |part: f64| if span > 0.0 { 2.0 * part / span } else { 1.0 };
        let (out, into) = (0.5 * adjusted(out) * (1.0 - t), 0.5 * adjusted(into) * (1.0 - t));
        [
            [out * (1.0 + c) * (1.0 + b), out * (1.0 - c) * (1.0 - b)],
            [into * (1.0 - c) * (1.0 + b), into * (1.0 + c) * (1.0 - b)],
        ]
    }
}

/// A track of positions or scales; there are four keys at least, at rising times.
pub fn positions(node: Text, property: TrackProperty, keys: &[CurveKey<DVec3>]) -> Track {
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for three in keys.windows(3) {
        let [before, key, behind] = [three[0], three[1], three[2]];
        let (from, to) = (key.value - before.value, behind.value - key.value);
        let [out, into] = key.shares(before.time, behind.time);
        let per_second = |tangent: DVec3, length: f64| if length > 0.0 { tangent / length } else { DVec3::ZERO };
        let into = per_second(from * into[0] + to * into[1], key.time - before.time);
        let out = per_second(from * out[0] + to * out[1], behind.time - key.time);
        times.push(key.time as f32);
        // Keys that nearly share a time have tangents steeper than `f32` can say; the curve ends at its keys all the same.
        let most = DVec3::splat(f64::from(f32::MAX));
        values.extend([into, key.value, out].iter().flat_map(|v| v.clamp(-most, most).as_vec3().to_array()));
    }
    Track { node, property, interpolation: KeyInterpolation::CubicSpline, times, values, width: 3 }
}

/// A track of rotations, each about an axis by an angle in radians.
pub fn rotations(node: Text, keys: &[CurveKey<(DVec3, f64)>]) -> Track {
    let mut turns: Vec<[f64; 4]> = Vec::new();
    for key in keys {
        let (axis, angle) = key.value;
        let axis = axis.normalize_or_zero();
        let (sin, cos) = (libm::sin(angle / 2.0), libm::cos(angle / 2.0));
        let turn = [axis.x * sin, axis.y * sin, axis.z * sin, if axis == DVec3::ZERO { 1.0 } else { cos }];
        // Of the two that stand for a rotation the one nearer to the key before.
        let far = turns.last().is_some_and(|last| dot(*last, turn) < 0.0);
        turns.push(if far { turn.map(|x| -x) } else { turn });
    }
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for i in 1..keys.len().saturating_sub(1) {
        let key = &keys[i];
        let step = |a: usize| log(product(inverse(turns[a]), turns[a + 1]));
        let (from, to) = (step(i - 1), step(i));
        let [out, into] = key.shares(keys[i - 1].time, keys[i + 1].time);
        let (into, out) = (from * into[0] + to * into[1], from * out[0] + to * out[1]);
        let drawn = |by: DVec3| unit(product(turns[i], exp(by * 0.5)));
        times.push(key.time as f32);
        values.extend([drawn(from - into), turns[i], drawn(out - to)].iter().flatten().map(|x| *x as f32));
    }
    let (property, interpolation) = (TrackProperty::Rotation, KeyInterpolation::Squad);
    Track { node, property, interpolation, times, values, width: 4 }
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| a * b).sum()
}

fn inverse([x, y, z, w]: [f64; 4]) -> [f64; 4] {
    [-x, -y, -z, w]
}

fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// Half the rotation of a unit quaternion, about its axis.
fn log([x, y, z, w]: [f64; 4]) -> DVec3 {
    let v = DVec3::new(x, y, z);
    let sine = v.length();
    if sine < 1e-12 { v } else { v * (libm::atan2(sine, w) / sine) }
}

fn exp(v: DVec3) -> [f64; 4] {
    let angle = v.length();
    let share = if angle < 1e-12 { 1.0 } else { libm::sin(angle) / angle };
    [v.x * share, v.y * share, v.z * share, libm::cos(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::animation::euler_of;

    fn key<T>(time: f64, value: T) -> CurveKey<T> {
        CurveKey { time, value, tension: 0.0, continuity: 0.0, bias: 0.0 }
    }

    #[test]
    fn a_straight_even_motion_stays_one_and_starts_at_the_second_key() {
        let keys: Vec<_> = (0..5).map(|i| key(f64::from(i), DVec3::new(2.0 * f64::from(i), 1.0, 0.0))).collect();
        let track = positions("n".into(), TrackProperty::Translation, &keys);
        assert_eq!(track.times, [1.0, 2.0, 3.0]);
        for time in [1.0, 1.3, 2.5, 3.0] {
            let at = track.at(time);
            assert!((at[0] - 2.0 * time).abs() < 1e-6 && (at[1] - 1.0).abs() < 1e-6, "{time} {at:?}");
        }
        assert_eq!(track.at(0.0)[0], 2.0);
    }

    /// Catmull-Rom is what is left without tension, continuity and bias.
    #[test]
    fn tension_and_bias_shape_the_curve_as_in_the_paper() {
        let values = [0.0, 0.0, 1.0, 0.0];
        let plain: Vec<_> = values.iter().enumerate().map(|(i, v)| key(i as f64, DVec3::X * *v)).collect();
        let at = |keys: &[CurveKey<DVec3>], t: f64| positions("n".into(), TrackProperty::Scale, keys).at(t)[0];
        // Tangents (1 - 0) / 2 at the first end and 0 at the second: 0.5 + 0.125 / 2 half-way.
        assert!((at(&plain, 1.5) - 0.5625).abs() < 1e-6);
        let tense: Vec<_> = plain.iter().map(|k| CurveKey { tension: 1.0, ..*k }).collect();
        assert!((at(&tense, 1.5) - 0.5).abs() < 1e-6);
        let biased: Vec<_> = plain.iter().map(|k| CurveKey { bias: 1.0, ..*k }).collect();
        // All of the difference before: 0 out of the first, 1 into the second.
        assert!((at(&biased, 1.5) - (0.5 - 0.125)).abs() < 1e-6);
    }

    #[test]
    fn keys_that_nearly_share_a_time_leave_every_place_finite() {
        let times = [0.0, 1.0, 1.0 + 1e-7, 1.0 + 2e-7, 2.0];
        let keys: Vec<_> =
            times.iter().enumerate().map(|(i, t)| key(*t, DVec3::splat(3e38 * (i % 2) as f64))).collect();
        let track = positions("n".into(), TrackProperty::Translation, &keys);
        assert!(track.values.iter().all(|x| x.is_finite()), "{:?}", track.values);
        for time in [0.9, 1.0, 1.0 + 5e-8, 1.0 + 1e-7, 1.5] {
            assert!(track.at(time).iter().all(|x| x.is_finite()), "{time}");
        }
    }

    #[test]
    fn an_even_turn_stays_one() {
        let keys: Vec<_> = (0..5).map(|i| key(f64::from(i), (DVec3::Y * 3.0, f64::from(i) * 0.6))).collect();
        let track = rotations("n".into(), &keys);
        for time in [1.0, 1.25, 2.0, 2.9, 3.0] {
            let at = track.at(time);
            let euler = euler_of([at[0], at[1], at[2], at[3]]);
            assert!((euler.y - (time * 0.6).to_degrees()).abs() < 1e-4, "{time} {euler}");
        }
    }
}
