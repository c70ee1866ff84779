//! Clips: keyed motion that comes with an asset, and what it says at a time.
//!
//! Pure functions of data, with IEEE operations and `libm` alone: a clip gives the same bits on every machine. Values
//! between keys follow glTF 2.0 (section 3.11 and appendix C).

use glam::DVec3;

use super::Text;
use super::record::choice;
use crate::base::digest::Hasher;
use crate::base::math;

choice! {
    /// How values between two keys are found.
    pub enum KeyInterpolation {
        /// The value of the key before.
        Step,
        /// On the straight line, rotations on the shorter arc.
        Linear,
        /// By a cubic Hermite spline: each key has a tangent into it, a value, and a tangent out of it.
        CubicSpline,
        /// Rotations on a curve without corners (Shoemake, SIGGRAPH course notes 1987): each key has a rotation that draws
        /// the curve towards it on the way in, its own, and one that draws it on the way out.
        Squad,
    }
}

choice! {
    /// What of a node a track moves.
    pub enum TrackProperty {
        /// Three numbers.
        Translation,
        /// A unit quaternion x, y, z, w.
        Rotation,
        /// Three factors.
        Scale,
        /// Weights of morph targets, as many as there are.
        Weights,
        /// One number: 0 hides the node and all below it.
        Visibility,
    }
}

/// Keys of one property of one node.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The node by its name in the asset.
    pub node: Text,
    /// What of the node.
    pub property: TrackProperty,
    /// How values between keys are found.
    pub interpolation: KeyInterpolation,
    /// Seconds, rising.
    pub times: Vec<f32>,
    /// `width` numbers a key; three times as many for splines.
    pub values: Vec<f32>,
    /// Numbers of a value.
    pub width: usize,
}

/// Named motion of an asset's nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// The clip as scripts call it; unique within an asset.
    pub name: Text,
    /// In the order of the file.
    pub tracks: Vec<Track>,
}

impl Clip {
    /// Seconds of the first and last key of all tracks; both 0 without any.
    pub fn span(&self) -> [f64; 2] {
        let ends = self.tracks.iter().filter_map(|t| Some([*t.times.first()?, *t.times.last()?].map(f64::from)));
        ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or_default()
    }

    /// The time inside of the clip that stands for a time of the film: as it is up to the last key, behind that from
    /// the first key again. Without `repeat` the clip stays at its ends.
    pub fn wrapped(&self, seconds: f64, repeat: bool) -> f64 {
        let [start, end] = self.span();
        if !repeat || seconds <= end || end <= start {
            return seconds;
        }
        start + libm::fmod(seconds - start, end - start)
    }

    /// Feeds all that the clip is made of.
    pub fn feed(&self, hasher: &mut Hasher) {
        hasher.text(&self.name);
        hasher.word(self.tracks.len() as u64);
        for track in &self.tracks {
            hasher.text(&track.node);
            hasher.bytes(&[track.property as u8, track.interpolation as u8, track.width as u8]);
            for numbers in [&track.times, &track.values] {
                hasher.word(numbers.len() as u64);
                numbers.iter().for_each(|x| hasher.bytes(&x.to_bits().to_le_bytes()));
            }
        }
    }
}

impl Track {
    /// The value at a time: `width` numbers. Before the first key and behind the last one theirs.
    pub fn at(&self, seconds: f64) -> Vec<f64> {
        let Some(last) = self.times.len().checked_sub(1) else { return Vec::new() };
        let next = self.times.partition_point(|t| f64::from(*t) <= seconds);
        if next == 0 || next > last {
            return self.key(if next == 0 { 0 } else { last });
        }
        let (start, end) = (f64::from(self.times[next - 1]), f64::from(self.times[next]));
        let share = (seconds - start) / (end - start);
        let (a, b) = (self.key(next - 1), self.key(next));
        match self.interpolation {
            KeyInterpolation::Step => a,
            _ if share == 0.0 => a,
            KeyInterpolation::Linear if self.property == TrackProperty::Rotation => {
                slerp(quaternion(&a), quaternion(&b), share).to_vec()
            }
            KeyInterpolation::Linear => a.iter().zip(&b).map(|(a, b)| a + (b - a) * share).collect(),
            KeyInterpolation::Squad => {
                let [out, into] = [(next - 1) * 3 + 2, next * 3].map(|row| unit(quaternion(&self.numbers(row))));
                let (a, b) = (quaternion(&a), quaternion(&b));
                slerp(slerp(a, b, share), slerp(out, into, share), 2.0 * share * (1.0 - share)).to_vec()
            }
            KeyInterpolation::CubicSpline => {
                let length = end - start;
                let out = self.numbers((next - 1) * 3 + 2);
                let into = self.numbers(next * 3);
                let hermite = |k: usize| hermite([a[k], out[k] * length, b[k], into[k] * length], share);
                let value: Vec<f64> = (0..self.width).map(hermite).collect();
                if self.property == TrackProperty::Rotation { unit(quaternion(&value)).to_vec() } else { value }
            }
        }
    }

    /// The value of a key, without its tangents.
    fn key(&self, key: usize) -> Vec<f64> {
        let value = self.numbers(match self.interpolation {
            KeyInterpolation::Step | KeyInterpolation::Linear => key,
            KeyInterpolation::CubicSpline | KeyInterpolation::Squad => key * 3 + 1,
        });
        if self.property == TrackProperty::Rotation { unit(quaternion(&value)).to_vec() } else { value }
    }

    fn numbers(&self, row: usize) -> Vec<f64> {
        let at = row * self.width;
        self.values[at..at + self.width].iter().map(|x| f64::from(*x)).collect()
    }
}

fn quaternion(value: &[f64]) -> [f64; 4] {
    std::array::from_fn(|k| value[k])
}

/// A point on the curve from `from` to `to` with these tangents at its ends.
fn hermite([from, out, to, into]: [f64; 4], t: f64) -> f64 {
    let (t2, t3) = (t * t, t * t * t);
    from * (2.0 * t3 - 3.0 * t2 + 1.0) + out * (t3 - 2.0 * t2 + t) + to * (3.0 * t2 - 2.0 * t3) + into * (t3 - t2)
}

/// The quaternion at length 1; that of no turn if there is nothing to scale.
pub fn unit(q: [f64; 4]) -> [f64; 4] {
    let square: f64 = q.iter().map(|x| x * x).sum();
    // One that is as unit as its numbers can say stays as it is.
    if (square - 1.0).abs() < 1e-15 {
        return q;
    }
    let length = square.sqrt();
    if length > 0.0 && length.is_finite() { q.map(|x| x / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

/// Between two unit quaternions on the shorter arc, at constant speed: exactly the first at 0 and the second (or its
/// negative, which is the same rotation) at 1, and exactly both where they are equal.
pub fn slerp(a: [f64; 4], b: [f64; 4], t: f64) -> [f64; 4] {
    let dot: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    let b = if dot < 0.0 { b.map(|x| -x) } else { b };
    if a == b || t == 0.0 {
        return a;
    }
    if t == 1.0 {
        return b;
    }
    let cosine = dot.abs().min(1.0);
    // The sine from the chord: it keeps its precision where the two are close.
    let chord: f64 = a.iter().zip(&b).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt();
    let angle = 2.0 * libm::asin((0.5 * chord).min(1.0));
    let sine = libm::sin(angle);
    if sine < 1e-12 || cosine >= 1.0 {
        return unit(std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t));
    }
    let (wa, wb) = (libm::sin((1.0 - t) * angle) / sine, libm::sin(t * angle) / sine);
    unit(std::array::from_fn(|k| a[k] * wa + b[k] * wb))
}

/// Pitch, yaw and roll in degrees of a rotation.
pub fn euler_of(q: [f64; 4]) -> DVec3 {
    math::euler_degrees(math::quaternion_matrix(q))
}

/// The rotation of pitch, yaw and roll in degrees.
pub fn quaternion_of(euler: DVec3) -> [f64; 4] {
    math::matrix_quaternion(math::rotation_matrix(euler))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn track(property: TrackProperty, interpolation: KeyInterpolation, times: &[f32], values: &[f32]) -> Track {
        let each = if interpolation == KeyInterpolation::CubicSpline { 3 } else { 1 };
        let width = values.len() / times.len() / each;
        Track { node: "n".into(), property, interpolation, times: times.to_vec(), values: values.to_vec(), width }
    }

    #[test]
    fn steps_lines_and_splines_have_their_values() {
        let times = [1.0, 2.0, 4.0];
        let step = track(TrackProperty::Weights, KeyInterpolation::Step, &times, &[5.0, 6.0, 8.0]);
        let at = |t: &Track, s: f64| t.at(s)[0];
        assert_eq!([0.0, 1.0, 1.99, 2.0, 3.9, 4.0, 9.0].map(|s| at(&step, s)), [5.0, 5.0, 5.0, 6.0, 6.0, 8.0, 8.0]);
        let line = Track { interpolation: KeyInterpolation::Linear, ..step };
        assert_eq!([0.5, 1.0, 1.5, 2.0, 3.0, 4.0].map(|s| at(&line, s)), [5.0, 5.0, 5.5, 6.0, 7.0, 8.0]);
        // x^3 on 0..2 with its own tangents is met exactly, whatever the length between keys.
        let cube = [0.0, 0.0, 0.0, 12.0, 8.0, 12.0];
        let spline = track(TrackProperty::Weights, KeyInterpolation::CubicSpline, &[0.0, 2.0], &cube);
        for x in [0.0, 0.25, 1.0, 1.5, 2.0] {
            assert!((at(&spline, x) - x * x * x).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn rotations_take_the_shorter_arc() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        // From no turn to a quarter about y, the second key with the other sign.
        let keys = [0.0, 0.0, 0.0, 1.0, 0.0, -half, 0.0, -half];
        let turn = track(TrackProperty::Rotation, KeyInterpolation::Linear, &[0.0, 1.0], &keys);
        for share in [0.0, 0.1, 0.5, 0.9, 1.0] {
            let q = turn.at(share);
            let euler = euler_of(quaternion(&q));
            assert!((euler.y - 90.0 * share).abs() < 1e-5 && euler.x.abs() < 1e-9, "{share}: {euler}");
        }
    }

    #[test]
    fn clips_go_on_up_to_their_end_and_then_begin_again() {
        let line = track(TrackProperty::Weights, KeyInterpolation::Linear, &[0.25, 1.25], &[0.0, 1.0]);
        let clip = Clip { name: "c".into(), tracks: vec![line] };
        assert_eq!(clip.span(), [0.25, 1.25]);
        let at = |s| clip.wrapped(s, true);
        assert_eq!([at(0.0), at(1.25), at(1.5), at(2.5)], [0.0, 1.25, 0.5, 0.5]);
        assert_eq!(clip.wrapped(9.0, false), 9.0);
        assert_eq!(Clip { name: "e".into(), tracks: Vec::new() }.span(), [0.0; 2]);
    }

    fn any_unit() -> impl Strategy<Value = [f64; 4]> {
        prop::array::uniform4(-1.0f64..1.0)
            .prop_filter("long enough", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.01)
            .prop_map(unit)
    }

    proptest! {
        #[test]
        fn arcs_hold_their_ends_and_what_stands_still(a in any_unit(), b in any_unit(), t in 0.0f64..1.0) {
            prop_assert_eq!(slerp(a, a, t), a);
            prop_assert_eq!(slerp(a, b, 0.0), a);
            let end = slerp(a, b, 1.0);
            prop_assert!(end == b || end == b.map(|x| -x));
            let between = slerp(a, b, t);
            let length: f64 = between.iter().map(|x| x * x).sum();
            prop_assert!((length - 1.0).abs() < 1e-12);
            // Constant speed: the angle from the first grows with t.
            let cosine = |p: [f64; 4], q: [f64; 4]| p.iter().zip(&q).map(|(p, q)| p * q).sum::<f64>().abs().min(1.0);
            let (whole, part) = (libm::acos(cosine(a, b)), libm::acos(cosine(a, between)));
            prop_assert!((part - whole * t).abs() < 1e-6, "{} {}", part, whole * t);
        }

        #[test]
        fn angles_and_quaternions_tell_the_same_rotation(q in any_unit()) {
            let back = quaternion_of(euler_of(q));
            let dot: f64 = q.iter().zip(&back).map(|(a, b)| a * b).sum();
            prop_assert!((dot.abs() - 1.0).abs() < 1e-10, "{q:?} {back:?}");
        }
    }
}
