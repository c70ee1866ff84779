//! The header of a script and the time of a frame.

use ::rhai::{Dynamic, Map};

use super::allowance::{self, Allowance};
use super::context::ScriptContext;
use super::convert::{describe, number, to_value};
use super::errors::{Fallible, complain};
use super::random::Generator;
use super::table::{Chapter, Function};
use crate::base::diagnostics::suggestion;
use crate::base::limits;
use crate::base::rate::Rate;
use crate::components::{FieldValue, Text, Value};

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
    /// Frames per second.
    pub rate: Rate,
    /// Number of frames, from 1.
    pub frames: u32,
    /// How the frames divide time.
    pub mode: TimeMode,
    /// Seed of the script's random numbers.
    pub seed: u64,
    /// Steps of a simulation from one frame to the next, from 1.
    pub steps_per_frame: u32,
    /// What each call of the script's functions may use.
    pub limits: Allowance,
}

impl Default for Header {
    fn default() -> Self {
        Header {
            scene: None,
            rate: Rate::USUAL,
            frames: 1,
            mode: TimeMode::Clip,
            seed: 0,
            steps_per_frame: 1,
            limits: Allowance::default(),
        }
    }
}

const KEYS: [&str; 7] = ["scene", "fps", "frames", "mode", "seed", "steps_per_frame", "limits"];

impl Header {
    /// Reads the map that `animation` was given.
    pub fn read(map: &Map) -> Fallible<Header> {
        let mut header = Header::default();
        for (key, value) in map {
            match key.as_str() {
                "scene" => header.scene = Some(word(value, "scene")?.to_string()),
                "fps" => header.rate = rate(value)?,
                "frames" => header.frames = whole(value, "frames", 1, u64::from(limits::FRAMES))? as u32,
                "steps_per_frame" => {
                    let most = u64::from(limits::STEPS_PER_FRAME);
                    header.steps_per_frame = whole(value, "steps_per_frame", 1, most)? as u32;
                }
                "limits" => header.limits.read(&allowance::map_of(value)?)?,
                "seed" => header.seed = whole(value, "seed", 0, i64::MAX as u64)?,
                "mode" => {
                    header.mode = match &*word(value, "mode")? {
                        "clip" => TimeMode::Clip,
                        "loop" => TimeMode::Loop,
                        other => {
                            return complain(
                                format!("`mode`: there is no mode `{other}`"),
                                suggestion(other, ["clip", "loop"]),
                            );
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

/// A number, or a fraction as a text.
fn rate(value: &Dynamic) -> Fallible<Rate> {
    let found = match to_value(value) {
        Some(Value::Text(text)) => Rate::parse(&text),
        _ => Rate::from_number(number(value)?),
    };
    match found.filter(|rate| rate.per_second() <= FASTEST) {
        Some(rate) => Ok(rate),
        None => {
            let help = "write a number above 0, or a fraction as in fps: \"24000/1001\"".to_string();
            complain(format!("`fps`: {} is no frame rate", describe(value)), Some(help))
        }
    }
}

/// Frames a second past which a rate is a mistake.
const FASTEST: f64 = 1e6;

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
    /// Seconds of one step of a simulation.
    dt: f64,
    rng: Generator,
    /// The state of a simulation; `()` where there is none.
    state: Dynamic,
}

impl FrameTime {
    /// How far the sequence has come, as its mode promises.
    pub fn share(&self) -> f64 {
        self.t
    }

    /// `offset` is in frames from the frame's own time. A loop begins anew; a clip goes on past its ends while the shutter
    /// is open, so that its first and last frames are blurred as all the others are.
    pub fn new(header: &Header, number: u32, offset: f64, seed: u64, state: Dynamic) -> Self {
        let at = f64::from(number - 1) + offset;
        let t = match header.mode {
            TimeMode::Loop => {
                let frames = f64::from(header.frames);
                // What a little before the start comes round to may be rounded up to a whole turn.
                let rest = at.rem_euclid(frames);
                if rest < frames { rest / frames } else { 0.0 }
            }
            TimeMode::Clip if header.frames > 1 => at / f64::from(header.frames - 1),
            TimeMode::Clip => 0.0,
        };
        let fps = header.rate.per_second();
        let dt = 1.0 / (fps * f64::from(header.steps_per_frame));
        // ScriptContext, so that asking for it copies nothing.
        let state = state.into_shared();
        FrameTime { number, at, count: header.frames, fps, t, dt, rng: Generator::new(seed), state }
    }

    /// 0 before a, 1 after b, and a straight ramp between.
    fn span(&mut self, a: &Dynamic, b: &Dynamic) -> Fallible<f64> {
        let (a, b) = (number(a)?, number(b)?);
        Ok(if b > a { ((self.t - a) / (b - a)).clamp(0.0, 1.0) } else { f64::from(u8::from(self.t >= b)) })
    }
}

/// Declares a property of the frame.
macro_rules! property {
    ($name:literal, $kind:literal, $text:literal, $example:literal, $get:expr) => {
        Function {
            name: $name,
            forms: &[concat!("f.", $name, " -> ", $kind)],
            text: $text,
            arguments: &[],
            example: $example,
            register: |engine| {
                engine.register_get($name, $get);
            },
        }
    };
}

pub const CHAPTER: Chapter = Chapter {
    title: "The sequence and its frames",
    functions: &[
        Function {
            name: "animation",
            forms: &["animation(header)"],
            text: "Says what the sequence is, once, at the top of the script.",
            arguments: &[(
                "header",
                "a map: `scene`, a file of the scene below the project's folder, beside the script or in `scenes`, none if left \
                 out; `frames`, their number, 1 to 1000000, default 1; `fps`, frames a second, above 0, default 24; `mode`, \
                 \"clip\" (t goes from 0 to 1, the default) or \"loop\" (t stops one frame before 1, which is the first \
                 again); `seed` of random numbers, whole, from 0, default 0; `steps_per_frame` of a \
                 simulation, 1 to 1000, default 1; `limits`, a map of what one call of a function may use: `operations` (default \
                 1e7), `seconds` of processor time (default 4), `memory` in MiB (default 512), `spawns` (entities, default \
                 300000); -D limits.operations=1e9 does the same",
            )],
            example: "// animation(#{ scene: \"chess.ron\", fps: 24, frames: 96, mode: \"clip\" });",
            register: |engine| {
                engine.register_type_with_name::<FrameTime>("Frame");
                engine.register_fn("animation", |map: Map| -> Fallible<()> {
                    ScriptContext::current("animation")?.set_header(Header::read(&map)?)
                });
            },
        },
        property!(
            "t",
            "number",
            "Time from 0 to 1: the first frame is 0; the last is 1 in a clip, and one frame before 1 in a \
            loop. While the shutter is open it is the time of the moment: at the ends of a clip it goes on a little below 0 \
            and above 1, so that these frames are blurred like all others.",
            "f.t >= 0.0     // true",
            |f: &mut FrameTime| f.t
        ),
        property!(
            "seconds",
            "number",
            "Seconds since the first frame, of the moment while the shutter is open.",
            "f.seconds >= 0.0     // true",
            |f: &mut FrameTime| f.at / f.fps
        ),
        property!(
            "number",
            "whole number",
            "The number of the frame, counted from 1.",
            "f.number - f.index     // 1",
            |f: &mut FrameTime| i64::from(f.number)
        ),
        property!(
            "index",
            "whole number",
            "The number of the frame, counted from 0. It is the same for all moments of an open \
            shutter: what moves by it is not blurred.",
            "f.index == f.number - 1     // true",
            |f: &mut FrameTime| { i64::from(f.number) - 1 }
        ),
        property!(
            "count",
            "whole number",
            "How many frames the sequence has.",
            "f.index < f.count     // true",
            |f: &mut FrameTime| i64::from(f.count)
        ),
        property!(
            "dt",
            "number",
            "Seconds of one step of a simulation: 1 / (fps * steps_per_frame).",
            "f.dt > 0.0     // true",
            |f: &mut FrameTime| f.dt
        ),
        Function {
            name: "state",
            forms: &["f.state -> value"],
            text: "The state of the simulation at the frame's time, between two steps interpolated. A script simulates where it \
                   has `fn start(s)`, which gives the first state, and `fn step(state, f)`, which gives the next one from each: \
                   plain data, as numbers, vectors, lists and maps. Steps are taken in order, `steps_per_frame` for each frame, \
                   and nothing else is kept from frame to frame. Some states stay beside the frames, in .anim-checkpoints, so that a run \
                   in the middle need not begin at the start; that folder may be removed at any time.",
            arguments: &[],
            example: "animation(#{ frames: 48, steps_per_frame: 4 });\n\
                      fn start(s) { #{ height: 3.0, speed: 0.0 } }\n\
                      fn step(state, f) {\n    \
                          state.speed -= 9.8 * f.dt;\n    \
                          state.height += state.speed * f.dt;\n    \
                          if state.height < 0.5 { state.height = 0.5; state.speed = -0.8 * state.speed; }\n    \
                          state\n\
                      }\n\
                      fn frame(s, f) { s.get(\"ball\").translation.y = f.state.height; }",
            register: |engine| {
                engine.register_get("state", |f: &mut FrameTime| -> Fallible<Dynamic> {
                    if f.state.is_unit() {
                        let help =
                            "write fn start(s) { ... } for the first state, and fn step(state, f) { ... } for the next";
                        return complain("there is no state", Some(help.into()));
                    }
                    Ok(f.state.clone())
                });
            },
        },
        property!("fps", "number", "Frames a second.", "f.fps > 0.0     // true", |f: &mut FrameTime| f.fps),
        property!(
            "rng",
            "generator",
            "Random numbers of this frame: each frame has its own, the same whenever it is made.",
            "f.rng.float() < 1.0     // true",
            |f: &mut FrameTime| f.rng.clone()
        ),
        Function {
            name: "span",
            forms: &["f.span(a, b) -> number"],
            text: "How far time has come between two others: 0 before a, 1 after b, and a straight ramp between.",
            arguments: &[("a", "a time, 0 to 1"), ("b", "a later time, 0 to 1")],
            example: "f.span(-2, -1)     // 1.0\n\
                      s.get(\"ball\").scale = lerp(1, 2, ease(\"out_back\", f.span(0.2, 0.8)));",
            register: |engine| {
                engine.register_fn("span", |f: &mut FrameTime, a: Dynamic, b: Dynamic| f.span(&a, &b));
            },
        },
    ],
};
