//! Between values: straight, by the shortest way round, through keys, and one after the other.

use ::rhai::{Array, Dynamic, Map, NativeCallContext};
use glam::DVec3;

use super::convert::{describe, is_vector, number, vector};
use super::easing::ease;
use super::errors::{Fallible, complain};
use super::options::CallOptions;
use super::subjects::point_of;
use super::table::{Chapter, Function};
use crate::base::rotation::{shortest_turn, slerp_degrees, slerp_direction};

/// Between two numbers, two vectors, or two lists of as many numbers.
pub fn lerp(a: &Dynamic, b: &Dynamic, t: f64) -> Fallible<Dynamic> {
    let lengths = [a, b].map(|v| v.read_lock::<Array>().map_or(3, |list| list.len()));
    if is_vector(a) && is_vector(b) && lengths[0] == lengths[1] && lengths[0] != 3 {
        let (a, b) = (a.clone().cast::<Array>(), b.clone().cast::<Array>());
        return Ok(a.iter().zip(&b).map(|(a, b)| lerp(a, b, t)).collect::<Fallible<Array>>()?.into());
    }
    if is_vector(a) || is_vector(b) {
        let (a, b) = (vector(a)?, vector(b)?);
        return Ok(Dynamic::from(a + (b - a) * t));
    }
    let (a, b) = (number(a)?, number(b)?);
    Ok((a + (b - a) * t).into())
}

/// Between two angles in degrees, or two rotations, by the shortest way.
pub fn slerp(a: &Dynamic, b: &Dynamic, t: f64) -> Fallible<Dynamic> {
    if is_vector(a) || is_vector(b) {
        return Ok(Dynamic::from(slerp_degrees(vector(a)?, vector(b)?, t)));
    }
    let (a, b) = (number(a)?, number(b)?);
    Ok((a + shortest_turn(a, b) * t).into())
}

/// One key: when, what, how it is reached, and how long it is kept.
struct Keyframe {
    time: f64,
    value: Dynamic,
    easing: Option<Dynamic>,
    hold: f64,
}

impl Keyframe {
    fn read(key: &Dynamic) -> Fallible<Keyframe> {
        let easing = |value: &Dynamic| Some(value.clone()).filter(|value| !value.is_unit());
        if let Some(parts) = key.read_lock::<Array>().filter(|parts| (2..=3).contains(&parts.len())) {
            let [time, value] = [&parts[0], &parts[1]];
            return Ok(Keyframe {
                time: number(time)?,
                value: value.clone(),
                easing: parts.get(2).and_then(easing),
                hold: 0.0,
            });
        }
        let Some(map) = key.read_lock::<Map>() else {
            let help = Some("write keys([[0.0, a], [0.5, b, \"in_out_cubic\"]], t)".into());
            return complain(format!("keys: expected [time, value], found {}", describe(key)), help);
        };
        let options = CallOptions::new("a key", &map, &["at", "value", "ease", "hold"])?;
        let (Some(at), Some(value)) = (options.get("at"), options.get("value")) else {
            return complain("keys: a key needs `at` and `value`", None);
        };
        Ok(Keyframe {
            time: number(at)?,
            value: value.clone(),
            easing: options.get("ease").and_then(easing),
            hold: options.between("hold", 0.0, 0.0, 1e9)?,
        })
    }

    fn holds(&self) -> bool {
        self.easing.as_ref().is_some_and(|easing| easing.clone().into_immutable_string().is_ok_and(|e| e == "hold"))
    }
}

/// The value of keys at t: held before the first and after the last.
fn keys(context: &NativeCallContext, list: &Array, t: f64, angles: bool) -> Fallible<Dynamic> {
    let keys = list.iter().map(Keyframe::read).collect::<Fallible<Vec<Keyframe>>>()?;
    if let Some([a, b]) = keys.windows(2).map(|w| [&w[0], &w[1]]).find(|[a, b]| b.time < a.time + a.hold) {
        return complain(format!("keys: time {} comes after {}", b.time, a.time + a.hold), None);
    }
    let (Some(first), Some(last)) = (keys.first(), keys.last()) else {
        return complain("keys: the list is empty", None);
    };
    // What is never between two values need not be anything that has a between: names, switches.
    let is_plain = keys.len() > 1 && keys[1..].iter().all(Keyframe::holds);
    let value = |key: &Keyframe| -> Fallible<Dynamic> {
        if is_plain || !key.value.is_string() {
            return Ok(key.value.clone());
        }
        point_of(context, &key.value).map(Dynamic::from)
    };
    let alone = |key: &Keyframe| {
        let value = value(key)?;
        if is_plain { Ok(value) } else { lerp(&value, &value, 0.0) }
    };
    if t <= first.time {
        return alone(first);
    }
    let Some(next) = keys.iter().position(|key| t < key.time) else { return alone(last) };
    let (from, to) = (&keys[next - 1], &keys[next]);
    let start = from.time + from.hold;
    if t < start || to.holds() {
        return alone(from);
    }
    let share = (t - start) / (to.time - start);
    let eased = to.easing.as_ref().map_or(Ok(share), |easing| ease(easing, share))?;
    let (a, b) = (value(from)?, value(to)?);
    if angles { slerp(&a, &b, eased) } else { lerp(&a, &b, eased) }
}

fn keys_with(context: &NativeCallContext, list: &Array, t: f64, options: &Map) -> Fallible<Dynamic> {
    let options = CallOptions::new("keys", options, &["angles"])?;
    keys(context, list, t, options.switch("angles", false)?)
}

fn remap(x: &Dynamic, a: &Dynamic, b: &Dynamic, c: &Dynamic, d: &Dynamic, easing: Option<&Dynamic>) -> Fallible<f64> {
    let [x, a, b, c, d] = [number(x)?, number(a)?, number(b)?, number(c)?, number(d)?];
    if a == b {
        return complain(format!("remap: the range from {a} to {b} is empty"), None);
    }
    // In this order, so that numbers come out as they always did.
    match easing {
        None => Ok(c + (d - c) * ((x - a) / (b - a))),
        Some(easing) => Ok(c + (d - c) * ease(easing, ((x - a) / (b - a)).clamp(0.0, 1.0))?),
    }
}

/// There and back again, in a straight line.
fn ping_pong(x: f64, length: f64) -> Fallible<f64> {
    if !(length > 0.0 && length.is_finite()) {
        return complain(format!("ping_pong: the length must be above 0, not {length}"), None);
    }
    Ok(length - (libm::fmod(libm::fmod(x, 2.0 * length) + 2.0 * length, 2.0 * length) - length).abs())
}

/// How far the i-th of n is when all together are at t: each starts a little after the one before.
fn stagger(t: f64, index: f64, count: f64, overlap: f64) -> Fallible<f64> {
    if !(count >= 1.0 && index >= 0.0 && (0.0..=1.0).contains(&overlap)) {
        return complain(
            format!("stagger: index {index} of {count} with an overlap of {overlap} makes no sense"),
            Some("the index counts from 0, the count from 1, and the overlap is from 0 to 1".into()),
        );
    }
    let delay = 1.0 - overlap;
    let whole = 1.0 + (count - 1.0) * delay;
    Ok((t * whole - index * delay).clamp(0.0, 1.0))
}

/// A critically damped spring, `seconds` after it was let go from `from` with some velocity: where it is, and how fast.
/// Pulled to `to`, it has gone about two thirds of the way after `smooth_time`.
fn damped(from: DVec3, to: DVec3, velocity: DVec3, smooth_time: f64, seconds: f64) -> (DVec3, DVec3) {
    let omega = 2.0 / smooth_time;
    let decay = libm::exp(-omega * seconds);
    let off = from - to;
    let pull = velocity + off * omega;
    (to + (off + pull * seconds) * decay, (velocity - pull * (omega * seconds)) * decay)
}

fn smooth_damp(from: &Dynamic, to: &Dynamic, smooth_time: &Dynamic, seconds: &Dynamic) -> Fallible<Dynamic> {
    let (smooth_time, seconds) = (number(smooth_time)?, number(seconds)?.max(0.0));
    if !(smooth_time > 0.0 && smooth_time.is_finite() && seconds.is_finite()) {
        return complain(format!("smooth_damp: `smooth_time` must be above 0, not {smooth_time}"), None);
    }
    let is_number = !is_vector(to);
    let read = |value: &Dynamic| if is_number { number(value).map(DVec3::splat) } else { vector(value) };
    let give = |v: DVec3| if is_number { Dynamic::from(v.x) } else { Dynamic::from(v) };
    let target = read(to)?;
    let Some(state) = from.read_lock::<Map>() else {
        return Ok(give(damped(read(from)?, target, DVec3::ZERO, smooth_time, seconds).0));
    };
    let options = CallOptions::new("the state of smooth_damp", &state, &["value", "velocity"])?;
    let start = options.get("value").map_or(Ok(target), &read)?;
    let speed = options.get("velocity").map_or(Ok(DVec3::ZERO), &read)?;
    let (value, velocity) = damped(start, target, speed, smooth_time, seconds);
    let entries = [("value", value), ("velocity", velocity)];
    Ok(entries.into_iter().map(|(name, v)| (name.into(), give(v))).collect::<Map>().into())
}

pub const CHAPTER: Chapter = Chapter {
    title: "Between values",
    functions: &[
        Function {
            name: "lerp",
            forms: &["lerp(a, b, t) -> value"],
            text: "The value between a and b: a at 0, b at 1, and straight on beyond both.",
            arguments: &[
                ("a", "a number, a vector, or a list of numbers"),
                ("b", "a value of the same kind"),
                ("t", "share of the way; not held to 0..1"),
            ],
            example: "lerp(10, 20, 0.25)                     // 12.5\n\
                      lerp([0, 0, 0], [2, 4, 6], 0.5)        // vec3(1, 2, 3)",
            register: |engine| {
                engine.register_fn("lerp", |a: Dynamic, b: Dynamic, t: Dynamic| lerp(&a, &b, number(&t)?));
            },
        },
        Function {
            name: "slerp",
            forms: &["slerp(a, b, t) -> angle or rotation"],
            text: "Between two angles or two rotations by the shortest way and at a constant speed: from 350 to 10 degrees it \
                   goes through 360, which is 0. Rotations go through quaternions, so that no axis is favoured.",
            arguments: &[
                ("a", "an angle in degrees, or a rotation (pitch, yaw, roll in degrees)"),
                ("b", "a value of the same kind"),
                ("t", "share of the way, 0 to 1; straight on beyond both"),
            ],
            example: "slerp(350, 10, 0.5)                       // 360.0\n\
                      slerp([0, 0, 0], [0, 90, 0], 0.5)         // vec3(0, 45, 0)\n\
                      s.get(\"ball\").rotation = slerp([0, 170, 0], [0, -170, 0], f.t);",
            register: |engine| {
                engine.register_fn("slerp", |a: Dynamic, b: Dynamic, t: Dynamic| slerp(&a, &b, number(&t)?));
            },
        },
        Function {
            name: "slerp_direction",
            forms: &["slerp_direction(a, b, t) -> vector"],
            text: "Between two directions along the great circle, at a constant speed; the lengths are interpolated straight.",
            arguments: &[
                ("a", "a vector, not 0"),
                ("b", "a vector, not 0"),
                ("t", "share of the way, 0 to 1; straight on beyond both"),
            ],
            example: "slerp_direction([1, 0, 0], [0, 0, 1], 0.5).length()   // 1.0",
            register: |engine| {
                engine.register_fn("slerp_direction", |a: Dynamic, b: Dynamic, t: Dynamic| -> Fallible<DVec3> {
                    Ok(slerp_direction(vector(&a)?, vector(&b)?, number(&t)?))
                });
            },
        },
        Function {
            name: "keys",
            forms: &["keys(list, t) -> value", "keys(list, t, options) -> value"],
            text: "The value of keyframes at t: held before the first and after the last, interpolated between. A key is \
                   `[time, value]` or `[time, value, easing]`, where the easing is how it is reached; \"hold\" keeps the value \
                   before until then. Or it is a map: `at`, `value`, `ease`, and `hold`, how long it is kept. A text is the \
                   name of an entity and stands for where that is; where every key is reached by \"hold\", values may be \
                   anything and are given as they are.",
            arguments: &[
                ("list", "keys in order of time"),
                ("t", "a time, in whatever unit the keys are: `f.t`, `f.seconds`, `f.number`"),
                ("options", "a map: `angles`, whether values are angles that take the shortest way, default false"),
            ],
            example: "keys([[0, 1.0], [1, 3.0], [2, 3.0]], 0.5)                        // 2.0\n\
                      keys([[0, 0.0], [1, 8.0, \"in_cubic\"]], 0.5)                      // 1.0\n\
                      keys([#{ at: 0, value: 0, hold: 1 }, [2, 10]], 1.5)              // 5.0\n\
                      keys([[0, \"wide\"], [0.5, \"close\", \"hold\"]], 0.7)               // \"close\"\n\
                      s.camera.at = keys([[0.2, \"ball\"], [0.8, \"key\", \"in_out_sine\"]], f.t);",
            register: |engine| {
                engine
                    .register_fn("keys", |context: NativeCallContext, list: Array, t: Dynamic| {
                        keys(&context, &list, number(&t)?, false)
                    })
                    .register_fn("keys", |context: NativeCallContext, list: Array, t: Dynamic, options: Map| {
                        keys_with(&context, &list, number(&t)?, &options)
                    });
            },
        },
        Function {
            name: "remap",
            forms: &["remap(x, a, b, c, d) -> number", "remap(x, a, b, c, d, easing) -> number"],
            text: "Carries x from the range a..b to c..d. With an easing the result stays within c..d.",
            arguments: &[
                ("x", "any number"),
                ("a", "any number: start of the first range"),
                ("b", "any number but a: end of the first range"),
                ("c", "start of the second range"),
                ("d", "end of the second range"),
                ("easing", "an easing, as for `ease`; straight and unlimited if left out"),
            ],
            example: "remap(5, 0, 10, 100, 200)                     // 150.0\n\
                      remap(12, 0, 10, 0, 1, \"linear\")              // 1.0",
            register: |engine| {
                engine
                    .register_fn("remap", |x: Dynamic, a: Dynamic, b: Dynamic, c: Dynamic, d: Dynamic| {
                        remap(&x, &a, &b, &c, &d, None)
                    })
                    .register_fn("remap", |x: Dynamic, a: Dynamic, b: Dynamic, c: Dynamic, d: Dynamic, e: Dynamic| {
                        remap(&x, &a, &b, &c, &d, Some(&e))
                    });
            },
        },
        Function {
            name: "clamp",
            forms: &["clamp(x, low, high) -> number"],
            text: "x, held between low and high.",
            arguments: &[
                ("x", "any number"),
                ("low", "the least number"),
                ("high", "the largest number, not below low"),
            ],
            example: "clamp(7, 0, 5)     // 5.0",
            register: |engine| {
                engine.register_fn("clamp", |x: Dynamic, low: Dynamic, high: Dynamic| -> Fallible<f64> {
                    Ok(number(&x)?.max(number(&low)?).min(number(&high)?))
                });
            },
        },
        Function {
            name: "ping_pong",
            forms: &["ping_pong(x) -> number", "ping_pong(x, length) -> number"],
            text: "There and back in straight lines: 0 at 0, `length` at `length`, 0 again at twice that, and so on both ways.",
            arguments: &[("x", "any number"), ("length", "above 0; 1 if left out")],
            example: "ping_pong(0.25)        // 0.25\n\
                      ping_pong(1.75)        // 0.25\n\
                      ping_pong(7, 5)        // 3.0",
            register: |engine| {
                engine
                    .register_fn("ping_pong", |x: Dynamic| ping_pong(number(&x)?, 1.0))
                    .register_fn("ping_pong", |x: Dynamic, length: Dynamic| ping_pong(number(&x)?, number(&length)?));
            },
        },
        Function {
            name: "stagger",
            forms: &["stagger(t, index, count) -> number", "stagger(t, index, count, overlap) -> number"],
            text: "How far the one with this index has come while all of them together are at t: each starts a little after \
                   the one before, and the last is done at 1.",
            arguments: &[
                ("t", "how far all are, 0 to 1"),
                ("index", "which one, counted from 0"),
                ("count", "how many there are, from 1"),
                ("overlap", "0: one after the other, 1: all at once; 0.5 if left out"),
            ],
            example: "stagger(0.5, 0, 2, 0.0)       // 1.0\n\
                      stagger(0.5, 1, 2, 0.0)       // 0.0\n\
                      stagger(0.5, 3, 4, 1.0)       // 0.5",
            register: |engine| {
                engine
                    .register_fn("stagger", |t: Dynamic, i: Dynamic, n: Dynamic| {
                        stagger(number(&t)?, number(&i)?, number(&n)?, 0.5)
                    })
                    .register_fn("stagger", |t: Dynamic, i: Dynamic, n: Dynamic, overlap: Dynamic| {
                        stagger(number(&t)?, number(&i)?, number(&n)?, number(&overlap)?)
                    });
            },
        },
        Function {
            name: "smooth_damp",
            forms: &[
                "smooth_damp(from, to, smooth_time, seconds) -> value",
                "smooth_damp(state, to, smooth_time, seconds) -> state",
            ],
            text: "Follows a target without ever swinging over: the critically damped spring, exactly, however long the step. \
                   With a start it gives where one is `seconds` after setting off from rest; with a state, a map of `value` \
                   and `velocity`, it gives the next state, for `step`.",
            arguments: &[
                ("from", "a number or a vector"),
                ("state", "a map of `value` and `velocity`, as this function gives it; #{} is at rest on the target"),
                ("to", "the target, a value of the same kind"),
                ("smooth_time", "seconds that it takes for about two thirds of the way, above 0"),
                ("seconds", "time since then, from 0"),
            ],
            example: "smooth_damp(5.0, 9.0, 0.3, 0.0)                                   // 5.0\n\
                      abs(smooth_damp(5.0, 9.0, 0.3, 8.0) - 9.0) < 1e-9                 // true\n\
                      let half = smooth_damp(#{ value: 5.0, velocity: 0.0 }, 9.0, 0.3, 0.1);\n\
                      smooth_damp(half, 9.0, 0.3, 0.1).value                            // smooth_damp(5.0, 9.0, 0.3, 0.2)",
            register: |engine| {
                engine.register_fn("smooth_damp", |a: Dynamic, b: Dynamic, time: Dynamic, t: Dynamic| {
                    smooth_damp(&a, &b, &time, &t)
                });
            },
        },
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ping_pong_goes_there_and_back() {
        for (x, expected) in [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (1.5, 0.5), (2.0, 0.0), (-0.5, 0.5), (-1.5, 0.5)] {
            assert_eq!(ping_pong(x, 1.0).unwrap(), expected, "{x}");
        }
        assert!(ping_pong(1.0, 0.0).is_err());
    }

    #[test]
    fn the_first_of_a_stagger_starts_at_0_and_the_last_ends_at_1() {
        for overlap in [0.0, 0.3, 0.5, 1.0] {
            for count in 1..6 {
                let at = |t: f64, i: i32| stagger(t, f64::from(i), f64::from(count), overlap).unwrap();
                assert!(at(1e-9, 0) > 0.0 && at(0.0, 0) == 0.0);
                assert!((at(1.0, count - 1) - 1.0).abs() < 1e-12 && at(1.0 - 1e-6, count - 1) < 1.0);
                for i in 1..count {
                    assert!(at(0.4, i) <= at(0.4, i - 1));
                }
            }
        }
    }

    /// The spring's own equation, x'' = w^2 (to - x) - 2 w x', stepped in small steps.
    #[test]
    fn smooth_damp_solves_its_equation_and_steps_add_up() {
        let (from, to, v0, time) = (DVec3::splat(2.0), DVec3::splat(-1.0), DVec3::splat(7.0), 0.4);
        let omega = 2.0 / time;
        let (mut x, mut v) = (from, v0);
        let dt = 1e-5;
        for _ in 0..50_000 {
            let a = (to - x) * omega * omega - v * 2.0 * omega;
            v += a * dt;
            x += v * dt;
        }
        let (value, velocity) = damped(from, to, v0, time, 0.5);
        assert!((value - x).length() < 1e-3 && (velocity - v).length() < 1e-2, "{value} {x}");
        let mut state = (from, v0);
        for _ in 0..10 {
            state = damped(state.0, to, state.1, time, 0.05);
        }
        assert!((state.0 - value).length() < 1e-12);
    }
}
