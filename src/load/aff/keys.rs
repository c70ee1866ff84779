//! Keys of transforms, and how they are read.

use glam::DVec3;

use super::curves::{CurveKey, positions, rotations};
use super::scan::{AffWord, Scan};
use super::{AffStop, Reader};
use crate::base::diagnostics::Place;
use crate::components::{KeyInterpolation, Text, Track, TrackProperty};

/// All keys of one name.
pub struct Keys {
    pub place: Place,
    translation: Vec<CurveKey<DVec3>>,
    rotation: Vec<CurveKey<(DVec3, f64)>>,
    scale: Vec<CurveKey<DVec3>>,
    /// Times and whether the thing shows from then on.
    visibility: Vec<(f64, bool)>,
}

impl Keys {
    /// The tracks of a node that they move.
    pub fn tracks(&self, node: &Text) -> Vec<Track> {
        let mut tracks = Vec::new();
        for (keys, property) in [(&self.translation, TrackProperty::Translation), (&self.scale, TrackProperty::Scale)] {
            if !keys.is_empty() {
                tracks.push(positions(node.clone(), property, keys));
            }
        }
        if !self.rotation.is_empty() {
            tracks.push(rotations(node.clone(), &self.rotation));
        }
        if let Some((first, _)) = self.visibility.first() {
            // Everything shows before its first key.
            let before = (first - 1.0, true);
            let all = || std::iter::once(&before).chain(&self.visibility);
            tracks.push(Track {
                node: node.clone(),
                property: TrackProperty::Visibility,
                interpolation: KeyInterpolation::Step,
                times: all().map(|(time, _)| *time as f32).collect(),
                values: all().map(|(_, shows)| f32::from(u8::from(*shows))).collect(),
                width: 1,
            });
        }
        tracks
    }
}

/// The unit quaternion of a turn about an axis by an angle in radians; none about no axis.
pub fn axis_angle(axis: DVec3, angle: f64) -> [f64; 4] {
    let Some(axis) = axis.try_normalize() else { return [0.0, 0.0, 0.0, 1.0] };
    let (sin, cos) = (libm::sin(angle / 2.0), libm::cos(angle / 2.0));
    [axis.x * sin, axis.y * sin, axis.z * sin, cos]
}

impl Reader {
    /// `k name { transl n ... rot n ... scale n ... visibility n ... }`
    pub fn keyed(&mut self, scan: &mut Scan) -> Result<(), AffStop> {
        let name = self.word(scan, "the name of what is keyed")?;
        self.expect(scan, "{")?;
        let mut keys = Keys {
            place: scan.place(name),
            translation: Vec::new(),
            rotation: Vec::new(),
            scale: Vec::new(),
            visibility: Vec::new(),
        };
        loop {
            let word = self.word(scan, "`}`")?;
            match word.text {
                "}" => break,
                "transl" => keys.translation = self.curve(scan, word)?,
                "scale" => keys.scale = self.curve(scan, word)?,
                "rot" => {
                    let count = self.curve_count(scan, word, 8)?;
                    let mut turns = Vec::new();
                    for _ in 0..count {
                        let [time, x, y, z, degrees, tension, continuity, bias] = self.numbers(scan)?;
                        let value = (DVec3::new(x, y, z), degrees.to_radians());
                        turns.push(CurveKey { time, value, tension, continuity, bias });
                    }
                    keys.rotation = self.rising(scan, word, turns, |key| key.time);
                    self.enough(scan, word, keys.rotation.len())?;
                }
                "visibility" => {
                    let count = self.count(scan, 2)?;
                    let mut shown = Vec::new();
                    for _ in 0..count {
                        let [time, shows] = self.numbers(scan)?;
                        shown.push((time, shows != 0.0));
                    }
                    keys.visibility = self.rising(scan, word, shown, |(time, _)| *time);
                }
                other => {
                    let message = format!("unknown keys `{other}`; known: transl, rot, scale, visibility");
                    return self.fail(scan, word, message);
                }
            }
        }
        self.keys.push((name.text.to_string(), keys));
        Ok(())
    }

    fn curve(&mut self, scan: &mut Scan, word: AffWord) -> Result<Vec<CurveKey<DVec3>>, AffStop> {
        let count = self.curve_count(scan, word, 7)?;
        let mut keys = Vec::new();
        for _ in 0..count {
            let [time, x, y, z, tension, continuity, bias] = self.numbers(scan)?;
            keys.push(CurveKey { time, value: DVec3::new(x, y, z), tension, continuity, bias });
        }
        let keys = self.rising(scan, word, keys, |key| key.time);
        self.enough(scan, word, keys.len())?;
        Ok(keys)
    }

    fn curve_count(&mut self, scan: &mut Scan, word: AffWord, each: usize) -> Result<usize, AffStop> {
        let count = self.count(scan, each)?;
        self.enough(scan, word, count)?;
        Ok(count)
    }

    fn enough(&mut self, scan: &Scan, word: AffWord, count: usize) -> Result<(), AffStop> {
        if count >= 4 {
            return Ok(());
        }
        self.fail(scan, word, format!("`{}` needs four keys at least, at rising times, and has {count}", word.text))
    }

    /// The keys whose times are not before that of a key above them. The robots of the benchmark have others: whoever looks
    /// for a time from the first key on does not come to them.
    pub(super) fn rising<T>(
        &mut self,
        scan: &Scan,
        word: AffWord,
        mut keys: Vec<T>,
        time: impl Fn(&T) -> f64,
    ) -> Vec<T> {
        let given = keys.len();
        let mut last = f64::NEG_INFINITY;
        keys.retain(|key| {
            let rises = time(key) >= last;
            last = last.max(time(key));
            rises
        });
        let left_out = given - keys.len();
        if left_out > 0 {
            let message =
                format!("{left_out} of {given} keys are not used: their times are before that of a key above them");
            self.warn(scan, word, message);
        }
        keys
    }
}
