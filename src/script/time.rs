//! The header of a script and the time of a frame.

use ::rhai::{Dynamic, Engine, Map};

use super::convert::{describe, number, to_value};
use super::errors::{Fallible, complain};
use super::random::Generator;
use crate::base::diagnostics::suggestion;
use crate::base::limits;
use crate::components::{FieldValue, Text};

/// How the frames divide time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeMode {
    /// t runs from 0 to 1, both reached.
    Clip,
    /// t runs from 0 up to 1, which is the first frame again.
    Loop,
}

/// What a script says of its sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// The scene as it is written.
    pub scene: Option<String>,
    /// Frames per second, above 0.
    pub fps: f64,
    /// Number of frames, from 1.
    pub frames: u32,
    /// How the frames divide time.
    pub mode: TimeMode,
    /// Seed of the script's random numbers.
    pub seed: u64,
}

const KEYS: [&str; 5] = ["scene", "fps", "frames", "mode", "seed"];

impl Header {
    /// Reads the map that `animation` was given.
    pub fn read(map: &Map) -> Fallible<Header> {
        let mut header = Header { scene: None, fps: 24.0, frames: 1, mode: TimeMode::Clip, seed: 0 };
        for (key, value) in map {
            match key.as_str() {
                "scene" => header.scene = Some(word(value, "scene")?.to_string()),
                "fps" => {
                    header.fps = number(value)?;
                    if !(header.fps > 0.0 && header.fps <= 1e6) {
                        return complain(format!("`fps` must be above 0, not {}", header.fps), None);
                    }
                }
                "frames" => header.frames = whole(value, "frames", 1, u64::from(limits::FRAMES))? as u32,
                "seed" => header.seed = whole(value, "seed", 0, i64::MAX as u64)?,
                "mode" => {
                    header.mode = match &*word(value, "mode")? {
                        "clip" => TimeMode::Clip,
                        "loop" => TimeMode::Loop,
                        other => {
                            return complain(format!("unknown mode `{other}`"), suggestion(other, ["clip", "loop"]));
                        }
                    }
                }
                other => return complain(format!("`animation` has no `{other}`"), suggestion(other, KEYS)),
            }
        }
        Ok(header)
    }
}

fn word(value: &Dynamic, key: &str) -> Fallible<Text> {
    match to_value(value).map(|v| Text::from_value(&v)) {
        Some(Ok(text)) => Ok(text),
        _ => complain(format!("`{key}`: expected a text, found {}", describe(value)), None),
    }
}

fn whole(value: &Dynamic, key: &str, low: u64, high: u64) -> Fallible<u64> {
    let found = to_value(value).and_then(|v| u64::from_value(&v).ok()).filter(|x| (low..=high).contains(x));
    match found {
        Some(x) => Ok(x),
        None => {
            complain(format!("`{key}`: expected a whole number from {low} to {high}, found {}", describe(value)), None)
        }
    }
}

/// The time of one moment of a frame.
#[derive(Clone)]
pub struct FrameTime {
    number: u32,
    /// Frames from the first one's time.
    at: f64,
    count: u32,
    fps: f64,
    t: f64,
    rng: Generator,
}

impl FrameTime {
    /// `offset` is in frames from the frame's own time. `t` stays in the range that its mode promises: a loop begins
    /// anew, a clip stands still at its ends.
    pub fn new(header: &Header, number: u32, offset: f64, seed: u64) -> Self {
        let at = f64::from(number - 1) + offset;
        let t = match header.mode {
            TimeMode::Loop => {
                let frames = f64::from(header.frames);
                // What a little before the start comes round to may be rounded up to a whole turn.
                let rest = at.rem_euclid(frames);
                if rest < frames { rest / frames } else { 0.0 }
            }
            TimeMode::Clip if header.frames > 1 => (at / f64::from(header.frames - 1)).clamp(0.0, 1.0),
            TimeMode::Clip => 0.0,
        };
        FrameTime { number, at, count: header.frames, fps: header.fps, t, rng: Generator::new(seed) }
    }

    /// 0 before a, 1 after b, and a straight ramp between.
    fn span(&mut self, a: &Dynamic, b: &Dynamic) -> Fallible<f64> {
        let (a, b) = (number(a)?, number(b)?);
        Ok(if b > a { ((self.t - a) / (b - a)).clamp(0.0, 1.0) } else { f64::from(u8::from(self.t >= b)) })
    }
}

pub fn register(engine: &mut Engine) {
    engine
        .register_type_with_name::<FrameTime>("Frame")
        .register_get("number", |f: &mut FrameTime| i64::from(f.number))
        .register_get("index", |f: &mut FrameTime| i64::from(f.number) - 1)
        .register_get("count", |f: &mut FrameTime| i64::from(f.count))
        .register_get("seconds", |f: &mut FrameTime| f.at / f.fps)
        .register_get("t", |f: &mut FrameTime| f.t)
        .register_get("fps", |f: &mut FrameTime| f.fps)
        .register_get("rng", |f: &mut FrameTime| f.rng.clone())
        .register_fn("span", |f: &mut FrameTime, a: Dynamic, b: Dynamic| f.span(&a, &b));
}
