//! Easing curves: Penner's (2001), the cubic bezier of CSS, steps, and the closed form of a spring.

use std::f64::consts::{PI, TAU};

use ::rhai::{Array, Dynamic, Map};

use super::convert::{describe, number};
use super::errors::{Fallible, complain};
use super::options::CallOptions;
use super::table::{Chapter, Function};
use crate::base::diagnostics::suggestion;

/// Names of the easing curves; each comes as in_, out_ and in_out_.
pub const CURVES: [&str; 10] = ["quad", "cubic", "quart", "quint", "sine", "expo", "circ", "back", "elastic", "bounce"];

/// How far `back` swings over, and the factor of that in `in_out_back`.
const OVERSHOOT: f64 = 1.70158;
const OVERSHOOT_BOTH: f64 = OVERSHOOT * 1.525;

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
        "back" => 2.70158 * t * t * t - OVERSHOOT * t * t,
        "elastic" => elastic_in(t, 0.3),
        "bounce" => 1.0 - bounce_out(1.0 - t),
        _ => return None,
    })
}

/// The first half of a curve that goes in and out, over t from 0 to 1. Two of Penner's have numbers of their own there.
fn ease_in_of_both(curve: &str, t: f64) -> Option<f64> {
    match curve {
        "back" => Some(t * t * ((OVERSHOOT_BOTH + 1.0) * t - OVERSHOOT_BOTH)),
        "elastic" => Some(elastic_in(t, 0.45)),
        _ => ease_in(curve, t),
    }
}

fn elastic_in(t: f64, period: f64) -> f64 {
    if t <= 0.0 || t >= 1.0 {
        return t.clamp(0.0, 1.0);
    }
    -libm::exp2(10.0 * t - 10.0) * libm::sin((t - 1.0 - period / 4.0) * TAU / period)
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
fn named(name: &str, t: f64) -> Fallible<f64> {
    let t = t.clamp(0.0, 1.0);
    let eased = match name {
        "linear" => Some(t),
        "smooth" => Some(t * t * (3.0 - 2.0 * t)),
        "hold" => Some(if t < 1.0 { 0.0 } else { 1.0 }),
        _ => {
            if let Some(curve) = name.strip_prefix("in_out_") {
                match t < 0.5 {
                    true => ease_in_of_both(curve, 2.0 * t).map(|x| x / 2.0),
                    false => ease_in_of_both(curve, 2.0 - 2.0 * t).map(|x| 1.0 - x / 2.0),
                }
            } else if let Some(curve) = name.strip_prefix("in_") {
                ease_in(curve, t)
            } else {
                name.strip_prefix("out_").and_then(|curve| ease_in(curve, 1.0 - t).map(|x| 1.0 - x))
            }
        }
    };
    match eased {
        Some(x) => Ok(x),
        None => {
            let all = names();
            let help = suggestion(name, all.iter().map(String::as_str));
            let help = help.or_else(|| Some(format!("in_, out_ or in_out_ and {}", CURVES.join(", "))));
            complain(format!("there is no easing `{name}`"), help)
        }
    }
}

/// Every name that an easing may have.
pub fn names() -> Vec<String> {
    let penner = CURVES.iter().flat_map(|c| ["in_", "out_", "in_out_"].map(|side| format!("{side}{c}")));
    ["linear", "smooth", "hold"].map(str::to_string).into_iter().chain(penner).collect()
}

/// An easing as scripts write it: a name, or the four numbers of a bezier of CSS.
pub fn ease(easing: &Dynamic, t: f64) -> Fallible<f64> {
    if let Ok(name) = easing.clone().into_immutable_string() {
        return named(&name, t);
    }
    let numbers = easing.read_lock::<Array>().filter(|list| list.len() == 4);
    match numbers {
        Some(list) => bezier(number(&list[0])?, number(&list[1])?, number(&list[2])?, number(&list[3])?, t),
        None => {
            let help = Some("write \"in_out_cubic\", or [0.42, 0, 0.58, 1] as CSS does".into());
            complain(format!("expected the name of an easing or four numbers, found {}", describe(easing)), help)
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

fn spring_with(t: &Dynamic, options: &Map) -> Fallible<f64> {
    let options = CallOptions::new("spring", options, &["frequency", "damping"])?;
    let option = |name: &str, default: f64| options.get(name).map_or(Ok(default), number);
    spring(option("frequency", 1.0)?, option("damping", 0.5)?, number(t)?)
}

fn smoothstep(a: f64, b: f64, x: f64) -> f64 {
    let t = if b == a { f64::from(u8::from(x >= b)) } else { ((x - a) / (b - a)).clamp(0.0, 1.0) };
    t * t * (3.0 - 2.0 * t)
}

pub const CHAPTER: Chapter = Chapter {
    title: "Easing",
    functions: &[
        Function {
            name: "ease",
            forms: &["ease(easing, t) -> number"],
            text: "Bends the way from 0 to 1. The curves are Penner's, to the digit: in_, out_ or in_out_ and quad, cubic, \
                   quart, quint, sine, expo, circ, back, elastic, bounce; \"linear\", \"smooth\" (3t^2 - 2t^3) and \"hold\" \
                   (0 until the end) stand beside them. back and elastic leave 0..1 on their way.",
            arguments: &[
                ("easing", "the name of a curve, or the four numbers of a bezier as CSS has them"),
                ("t", "0 to 1; held to it"),
            ],
            example: "ease(\"in_quad\", 0.5)                // 0.25\n\
                      ease(\"in_out_back\", 0.25)           // -0.09968184375\n\
                      ease([0.42, 0, 0.58, 1], 0.5)       // 0.5",
            register: |engine| {
                engine.register_fn("ease", |easing: Dynamic, t: Dynamic| ease(&easing, number(&t)?));
            },
        },
        Function {
            name: "bezier",
            forms: &["bezier(x1, y1, x2, y2, t) -> number"],
            text: "The timing curve of CSS, `cubic-bezier(x1, y1, x2, y2)`, at t.",
            arguments: &[
                ("x1", "0 to 1"),
                ("y1", "any number"),
                ("x2", "0 to 1"),
                ("y2", "any number"),
                ("t", "0 to 1; held to it"),
            ],
            example: "bezier(0.25, 0.25, 0.75, 0.75, 0.4)   // 0.4",
            register: |engine| {
                engine.register_fn("bezier", |a: Dynamic, b: Dynamic, c: Dynamic, d: Dynamic, t: Dynamic| {
                    bezier(number(&a)?, number(&b)?, number(&c)?, number(&d)?, number(&t)?)
                });
            },
        },
        Function {
            name: "spring",
            forms: &["spring(seconds) -> number", "spring(seconds, options) -> number"],
            text: "A spring that is let go at 0 and comes to rest at 1, in closed form: it may be asked for any time.",
            arguments: &[
                ("seconds", "time since it was let go, seconds; 0 before"),
                (
                    "options",
                    "a map: `frequency` in swings a second, above 0, default 1; `damping`, from 0 (swings for ever) over 1 \
                     (the fastest way without a swing) upwards, default 0.5",
                ),
            ],
            example: "spring(0)                                       // 0.0\n\
                      abs(spring(9, #{ damping: 1.0 }) - 1.0) < 1e-6  // true",
            register: |engine| {
                engine
                    .register_fn("spring", |t: Dynamic| spring_with(&t, &Map::new()))
                    .register_fn("spring", |t: Dynamic, options: Map| spring_with(&t, &options));
            },
        },
        Function {
            name: "smoothstep",
            forms: &["smoothstep(a, b, x) -> number"],
            text: "0 below a, 1 above b, and a smooth ramp between.",
            arguments: &[("a", "any number: where it begins"), ("b", "any number: where it ends"), ("x", "any number")],
            example: "smoothstep(2, 4, 3)      // 0.5",
            register: |engine| {
                engine.register_fn("smoothstep", |a: Dynamic, b: Dynamic, x: Dynamic| -> Fallible<f64> {
                    Ok(smoothstep(number(&a)?, number(&b)?, number(&x)?))
                });
            },
        },
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    fn eased(name: &str, t: f64) -> f64 {
        named(name, t).unwrap()
    }

    #[test]
    fn easings_start_at_0_and_end_at_1() {
        for name in names().iter().filter(|name| *name != "hold") {
            assert!(eased(name, 0.0).abs() < 1e-9, "{name}");
            assert!((eased(name, 1.0) - 1.0).abs() < 1e-9, "{name}");
            let middle = (eased(name, 0.5 - 1e-9) - eased(name, 0.5 + 1e-9)).abs();
            assert!(middle < 1e-4, "{name} jumps");
        }
        assert_eq!(eased("linear", 0.25), 0.25);
        assert_eq!((eased("hold", 0.99), eased("hold", 1.0)), (0.0, 1.0));
        assert!(named("in_cubik", 0.5).is_err());
    }

    /// Penner's own formulas, over a duration of d from b by c.
    #[test]
    fn curves_are_penners() {
        let (d, c) = (3.0f64, 1.0f64);
        let s = 1.70158f64;
        for i in 1..60 {
            let time = d * f64::from(i) / 60.0;
            let at = |name: &str| eased(name, time / d);
            let t = time / (d / 2.0);
            let both = s * 1.525;
            let back = match t < 1.0 {
                true => c / 2.0 * (t * t * ((both + 1.0) * t - both)),
                false => c / 2.0 * ((t - 2.0) * (t - 2.0) * ((both + 1.0) * (t - 2.0) + both) + 2.0),
            };
            assert!((at("in_out_back") - back).abs() < 1e-12, "{i}");
            let p = d * 0.45;
            let shift = p / 4.0;
            let u = t - 1.0;
            let wave = libm::sin((u * d - shift) * TAU / p);
            let elastic = match t < 1.0 {
                true => -0.5 * libm::exp2(10.0 * u) * wave,
                false => libm::exp2(-10.0 * u) * wave * 0.5 + 1.0,
            };
            assert!((at("in_out_elastic") - elastic).abs() < 1e-12, "{i}");
            let u = time / d - 1.0;
            let out_back = c * (u * u * ((s + 1.0) * u + s) + 1.0);
            assert!((at("out_back") - out_back).abs() < 1e-12, "{i}");
            let p = d * 0.3;
            let out_elastic = libm::exp2(-10.0 * time / d) * libm::sin((time - p / 4.0) * TAU / p) + 1.0;
            assert!((at("out_elastic") - out_elastic).abs() < 1e-12, "{i}");
        }
        assert!((eased("in_out_back", 0.25) + 0.0997).abs() < 5e-5);
        assert!((eased("in_out_elastic", 0.25) - 0.0120).abs() < 5e-5);
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
}
