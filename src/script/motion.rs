//! The motion library: interpolation, easing, keyframes, springs, orbits, aims and the rack of a focus ring.
//!
//! Easings are Penner's (2001); the cubic bezier is that of CSS; the spring is the closed form of the damped oscillator.

use std::f64::consts::{PI, TAU};

use ::rhai::{Array, Dynamic, Engine, Map, NativeCallContext};
use glam::{DMat3, DVec3};

use super::convert::{describe, is_vector, number, vector};
use super::errors::{Fallible, complain};
use super::handles::SceneHandle;
use crate::base::diagnostics::suggestion;
use crate::base::math::{euler_degrees, look_at_degrees, rotation_matrix, sin_cos_degrees};

/// Names of the easing curves; each comes as in_, out_ and in_out_.
const CURVES: [&str; 10] = ["quad", "cubic", "quart", "quint", "sine", "expo", "circ", "back", "elastic", "bounce"];

/// The way in of a curve: 0 at 0, 1 at 1.
fn ease_in(curve: &str, t: f64) -> Option<f64> {
    Some(match curve {
        "quad" => t * t,
        "cubic" => t * t * t,
        "quart" => t * t * t * t,
        "quint" => t * t * t * t * t,
        "sine" => 1.0 - libm::cos(t * PI / 2.0),
        "expo" if t <= 0.0 => 0.0,
        "expo" if t >= 1.0 => 1.0,
        "expo" => libm::exp2(10.0 * t - 10.0),
        "circ" => 1.0 - (1.0 - t * t).max(0.0).sqrt(),
        "back" => 2.70158 * t * t * t - 1.70158 * t * t,
        "elastic" if t <= 0.0 || t >= 1.0 => t.clamp(0.0, 1.0),
        "elastic" => -libm::exp2(10.0 * t - 10.0) * libm::sin((t * 10.0 - 10.75) * TAU / 3.0),
        "bounce" => 1.0 - bounce_out(1.0 - t),
        _ => return None,
    })
}

fn bounce_out(t: f64) -> f64 {
    let (n, d) = (7.5625, 2.75);
    let arc = |t: f64, lift: f64| n * t * t + lift;
    match t * d {
        x if x < 1.0 => arc(t, 0.0),
        x if x < 2.0 => arc(t - 1.5 / d, 0.75),
        x if x < 2.5 => arc(t - 2.25 / d, 0.9375),
        _ => arc(t - 2.625 / d, 0.984375),
    }
}

/// A named easing at t, held to 0..1.
fn ease(name: &str, t: f64) -> Fallible<f64> {
    let t = t.clamp(0.0, 1.0);
    let eased = if name == "linear" {
        Some(t)
    } else if let Some(curve) = name.strip_prefix("in_out_") {
        match t < 0.5 {
            true => ease_in(curve, 2.0 * t).map(|x| x / 2.0),
            false => ease_in(curve, 2.0 - 2.0 * t).map(|x| 1.0 - x / 2.0),
        }
    } else if let Some(curve) = name.strip_prefix("in_") {
        ease_in(curve, t)
    } else {
        name.strip_prefix("out_").and_then(|curve| ease_in(curve, 1.0 - t).map(|x| 1.0 - x))
    };
    match eased {
        Some(x) => Ok(x),
        None => {
            let all: Vec<String> =
                CURVES.iter().flat_map(|c| ["in_", "out_", "in_out_"].map(|side| format!("{side}{c}"))).collect();
            let known = all.iter().map(String::as_str).chain(["linear"]);
            let help =
                suggestion(name, known).or_else(|| Some(format!("in_, out_ or in_out_ and {}", CURVES.join(", "))));
            complain(format!("there is no easing `{name}`"), help)
        }
    }
}

/// The curve of CSS through (0, 0), (x1, y1), (x2, y2), (1, 1): y at a given x; x1 and x2 within 0..1.
fn bezier(x1: f64, y1: f64, x2: f64, y2: f64, x: f64) -> Fallible<f64> {
    if !(0.0..=1.0).contains(&x1) || !(0.0..=1.0).contains(&x2) {
        return complain(format!("bezier: x1 and x2 must be from 0 to 1, not {x1} and {x2}"), None);
    }
    let at = |a: f64, b: f64, s: f64| {
        let r = 1.0 - s;
        3.0 * r * r * s * a + 3.0 * r * s * s * b + s * s * s
    };
    let x = x.clamp(0.0, 1.0);
    // x grows with the parameter: halving finds it to the last bit that matters.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if at(x1, x2, middle) < x { low = middle } else { high = middle }
    }
    Ok(at(y1, y2, (low + high) / 2.0))
}

/// A spring let go at 0 with its rest at 1, after `t` seconds: `frequency` in turns a second, `damping` 1 is critical.
fn spring(frequency: f64, damping: f64, t: f64) -> Fallible<f64> {
    if !(frequency > 0.0 && damping >= 0.0 && frequency.is_finite() && damping.is_finite()) {
        return complain("spring: `frequency` must be above 0 and `damping` at least 0", None);
    }
    let (w, t) = (TAU * frequency, t.max(0.0));
    let decay = libm::exp(-damping * w * t);
    let off = if damping < 1.0 {
        let wd = w * (1.0 - damping * damping).sqrt();
        decay * (libm::cos(wd * t) + damping * w / wd * libm::sin(wd * t))
    } else if damping == 1.0 {
        decay * (1.0 + w * t)
    } else {
        let root = (damping * damping - 1.0).sqrt();
        let (a, b) = (-w * (damping - root), -w * (damping + root));
        (b * libm::exp(a * t) - a * libm::exp(b * t)) / (b - a)
    };
    Ok(1.0 - off)
}

/// Between two numbers or two vectors.
fn lerp(a: &Dynamic, b: &Dynamic, t: f64) -> Fallible<Dynamic> {
    if is_vector(a) || is_vector(b) {
        let (a, b) = (vector(a)?, vector(b)?);
        return Ok(Dynamic::from(a + (b - a) * t));
    }
    let (a, b) = (number(a)?, number(b)?);
    Ok((a + (b - a) * t).into())
}

/// The value at t of `[time, value]` or `[time, value, easing]` keys in order of time; held before and after.
fn keys(list: &Array, t: f64) -> Fallible<Dynamic> {
    let mut before: Option<(f64, Dynamic)> = None;
    for key in list {
        let Some(parts) = key.read_lock::<Array>().filter(|parts| (2..=3).contains(&parts.len())) else {
            let help = Some("write keys([[0.0, a], [0.5, b, \"in_out_cubic\"]], t)".into());
            return complain(format!("keys: expected [time, value], found {}", describe(key)), help);
        };
        let time = number(&parts[0])?;
        let value = parts[1].clone();
        match before {
            Some((earlier, _)) if time < earlier => {
                return complain(format!("keys: time {time} comes after {earlier}"), None);
            }
            Some((earlier, from)) if t < time => {
                let share = (t - earlier) / (time - earlier);
                let eased = match parts.get(2) {
                    Some(name) => ease(&name.to_string(), share)?,
                    None => share,
                };
                return lerp(&from, &value, eased);
            }
            None if t <= time => return lerp(&value, &value, 0.0),
            _ => before = Some((time, value)),
        }
    }
    match before {
        Some((_, last)) => lerp(&last, &last, 0.0),
        None => complain("keys: the list is empty", None),
    }
}

/// Distance of a subject along the view: the name of an entity, a point, or a distance.
fn subject_distance(scene: &SceneHandle, subject: &Dynamic) -> Fallible<f64> {
    let camera = scene.camera();
    let point = match subject.clone().into_immutable_string() {
        Ok(name) => scene.position(&name)?,
        Err(_) if is_vector(subject) => vector(subject)?,
        Err(_) => return number(subject),
    };
    Ok((point - camera.from).dot(camera.axis()))
}

/// From one subject to another as a focus ring turns: evenly in 1 / distance.
fn rack(scene: &SceneHandle, near: &Dynamic, far: &Dynamic, t: f64) -> Fallible<f64> {
    let (a, b) = (subject_distance(scene, near)?, subject_distance(scene, far)?);
    for (distance, subject) in [(a, near), (b, far)] {
        if distance <= 0.0 || distance.is_nan() {
            return complain(format!("rack: {} is not in front of the camera", describe(subject)), None);
        }
    }
    Ok(1.0 / (1.0 / a + (1.0 / b - 1.0 / a) * t.clamp(0.0, 1.0)))
}

fn scene_of(context: &NativeCallContext) -> Fallible<SceneHandle> {
    match context.tag().and_then(|tag| tag.clone().try_cast::<SceneHandle>()) {
        Some(scene) => Ok(scene),
        None => complain("`rack` measures in a scene: call it inside `setup` or `frame`", None),
    }
}

/// Rotation that turns the local -y axis, the face of an area light, from one point towards another.
fn aim(from: DVec3, at: DVec3) -> DVec3 {
    let down = (at - from).normalize_or(DVec3::NEG_Y);
    let right = down.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
    // Local x, y, z go to right, -down and their cross product.
    euler_degrees(DMat3::from_cols(right, -down, right.cross(-down)))
}

fn polar(radius: f64, degrees: f64, y: f64) -> DVec3 {
    let (sin, cos) = sin_cos_degrees(degrees);
    DVec3::new(radius * cos, y, radius * sin)
}

pub fn register(engine: &mut Engine) {
    engine
        .register_fn("lerp", |a: Dynamic, b: Dynamic, t: Dynamic| lerp(&a, &b, number(&t)?))
        .register_fn("clamp", |x: Dynamic, low: Dynamic, high: Dynamic| -> Fallible<f64> {
            Ok(number(&x)?.max(number(&low)?).min(number(&high)?))
        })
        .register_fn("smoothstep", |a: Dynamic, b: Dynamic, x: Dynamic| -> Fallible<f64> {
            let (a, b, x) = (number(&a)?, number(&b)?, number(&x)?);
            let t = if b == a { f64::from(u8::from(x >= b)) } else { ((x - a) / (b - a)).clamp(0.0, 1.0) };
            Ok(t * t * (3.0 - 2.0 * t))
        })
        .register_fn("remap", |x: Dynamic, a: Dynamic, b: Dynamic, c: Dynamic, d: Dynamic| -> Fallible<f64> {
            let (a, c) = (number(&a)?, number(&c)?);
            Ok(c + (number(&d)? - c) * ((number(&x)? - a) / (number(&b)? - a)))
        })
        .register_fn("ease", |name: &str, t: Dynamic| ease(name, number(&t)?))
        .register_fn("bezier", |a: Dynamic, b: Dynamic, c: Dynamic, d: Dynamic, t: Dynamic| {
            bezier(number(&a)?, number(&b)?, number(&c)?, number(&d)?, number(&t)?)
        })
        .register_fn("spring", |t: Dynamic| spring(1.0, 0.5, number(&t)?))
        .register_fn("spring", |t: Dynamic, options: Map| {
            if let Some(other) = options.keys().find(|k| !["frequency", "damping"].contains(&k.as_str())) {
                return complain(format!("spring has no `{other}`"), suggestion(other, ["frequency", "damping"]));
            }
            let option = |name: &str, default: f64| options.get(name).map_or(Ok(default), number);
            spring(option("frequency", 1.0)?, option("damping", 0.5)?, number(&t)?)
        })
        .register_fn("keys", |list: Array, t: Dynamic| keys(&list, number(&t)?));
    engine
        .register_fn("polar", |r: Dynamic, a: Dynamic| -> Fallible<DVec3> { Ok(polar(number(&r)?, number(&a)?, 0.0)) })
        .register_fn("polar", |r: Dynamic, a: Dynamic, y: Dynamic| -> Fallible<DVec3> {
            Ok(polar(number(&r)?, number(&a)?, number(&y)?))
        })
        .register_fn("orbit", |center: Dynamic, radius: Dynamic, turns: Dynamic| -> Fallible<DVec3> {
            Ok(vector(&center)? + polar(number(&radius)?, 360.0 * number(&turns)?, 0.0))
        })
        .register_fn("orbit", |center: Dynamic, radius: Dynamic, turns: Dynamic, tilt: Dynamic| -> Fallible<DVec3> {
            let tilted = rotation_matrix(DVec3::X * number(&tilt)?);
            Ok(vector(&center)? + tilted * polar(number(&radius)?, 360.0 * number(&turns)?, 0.0))
        })
        .register_fn("look_at", |from: Dynamic, at: Dynamic| -> Fallible<DVec3> {
            Ok(look_at_degrees(vector(&from)?, vector(&at)?, DVec3::Y))
        })
        .register_fn("aim", |from: Dynamic, at: Dynamic| -> Fallible<DVec3> { Ok(aim(vector(&from)?, vector(&at)?)) })
        .register_fn("rack", |context: NativeCallContext, near: Dynamic, far: Dynamic, t: Dynamic| {
            rack(&scene_of(&context)?, &near, &far, number(&t)?)
        })
        .register_fn("rack", |scene: &mut SceneHandle, near: Dynamic, far: Dynamic, t: Dynamic| {
            rack(scene, &near, &far, number(&t)?)
        });
    trigonometry(engine);
}

type OfOne = fn(f64) -> f64;
type OfTwo = fn(f64, f64) -> f64;

/// Mathematics that gives the same bits everywhere, in place of what Rhai takes from the system.
fn trigonometry(engine: &mut Engine) {
    let functions: [(&str, OfOne); 18] = [
        ("sin", libm::sin),
        ("cos", libm::cos),
        ("tan", libm::tan),
        ("asin", libm::asin),
        ("acos", libm::acos),
        ("atan", libm::atan),
        ("sinh", libm::sinh),
        ("cosh", libm::cosh),
        ("tanh", libm::tanh),
        ("asinh", libm::asinh),
        ("acosh", libm::acosh),
        ("atanh", libm::atanh),
        ("exp", libm::exp),
        ("ln", libm::log),
        ("log", libm::log10),
        ("sind", |degrees| sin_cos_degrees(degrees).0),
        ("cosd", |degrees| sin_cos_degrees(degrees).1),
        ("tand", |degrees| sin_cos_degrees(degrees).0 / sin_cos_degrees(degrees).1),
    ];
    for (name, function) in functions {
        engine.register_fn(name, function);
        engine.register_fn(name, move |x: i64| function(x as f64));
    }
    let pairs: [(&str, OfTwo); 3] = [("pow", libm::pow), ("atan", libm::atan2), ("hypot", libm::hypot)];
    for (name, function) in pairs {
        engine.register_fn(name, move |x: Dynamic, y: Dynamic| -> Fallible<f64> {
            Ok(function(number(&x)?, number(&y)?))
        });
    }
    engine.register_fn("log", |x: f64, base: f64| libm::log(x) / libm::log(base));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn easings_start_at_0_and_end_at_1() {
        for curve in CURVES {
            for side in ["in_", "out_", "in_out_"] {
                let name = format!("{side}{curve}");
                assert!(ease(&name, 0.0).unwrap().abs() < 1e-9, "{name}");
                assert!((ease(&name, 1.0).unwrap() - 1.0).abs() < 1e-9, "{name}");
                let middle = (ease(&name, 0.5 - 1e-9).unwrap() - ease(&name, 0.5 + 1e-9).unwrap()).abs();
                assert!(middle < 1e-4, "{name} jumps");
            }
        }
        assert_eq!(ease("linear", 0.25).unwrap(), 0.25);
        assert!(ease("in_cubik", 0.5).is_err());
    }

    #[test]
    fn a_straight_bezier_is_the_identity() {
        for i in 0..=20 {
            let t = f64::from(i) / 20.0;
            assert!((bezier(1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, t).unwrap() - t).abs() < 1e-9);
        }
        assert!((bezier(0.42, 0.0, 0.58, 1.0, 0.5).unwrap() - 0.5).abs() < 1e-9);
        assert!(bezier(2.0, 0.0, 0.5, 1.0, 0.5).is_err());
    }

    #[test]
    fn springs_start_at_0_at_rest_and_settle_at_1() {
        for damping in [0.0, 0.3, 1.0, 2.5] {
            let at = |t: f64| spring(1.5, damping, t).unwrap();
            assert!(at(0.0).abs() < 1e-12 && at(1e-6).abs() < 1e-9, "{damping}");
            assert!(damping == 0.0 || (at(20.0) - 1.0).abs() < 1e-6, "{damping}");
        }
        let (below, above) = (spring(1.0, 1.0 - 1e-6, 0.4).unwrap(), spring(1.0, 1.0 + 1e-6, 0.4).unwrap());
        assert!((below - above).abs() < 1e-4);
    }

    #[test]
    fn an_aimed_light_faces_its_target() {
        for (from, at) in
            [([0.0, 3.0, 0.0], [0.0; 3]), ([1.0, 2.0, 3.0], [-1.0, 0.5, 0.0]), ([0.0, 0.0, -4.0], [0.0; 3])]
        {
            let (from, at) = (DVec3::from_array(from), DVec3::from_array(at));
            let face = rotation_matrix(aim(from, at)) * DVec3::NEG_Y;
            assert!((face - (at - from).normalize()).length() < 1e-6, "{from} {face}");
        }
    }
}
