//! Mathematics that gives the same bits everywhere, in place of what Rhai takes from the system.

use ::rhai::{Dynamic, Engine};

use super::convert::number;
use super::errors::{Fallible, complain};
use super::table::{Chapter, Function};
use crate::base::math::sin_cos_degrees;

type OfOne = fn(f64) -> f64;
type OfTwo = fn(f64, f64) -> f64;

fn one(engine: &mut Engine, name: &'static str, function: OfOne) {
    engine.register_fn(name, function);
    engine.register_fn(name, move |x: i64| function(x as f64));
}

fn two(engine: &mut Engine, name: &'static str, function: OfTwo) {
    engine.register_fn(name, move |x: Dynamic, y: Dynamic| -> Fallible<f64> { Ok(function(number(&x)?, number(&y)?)) });
}

/// Whole part of a quotient, towards 0, as the remainder `%` goes with it.
fn div(a: &Dynamic, b: &Dynamic) -> Fallible<Dynamic> {
    if let (Ok(a), Ok(b)) = (a.as_int(), b.as_int()) {
        return match a.checked_div(b) {
            Some(quotient) => Ok(quotient.into()),
            None => complain(format!("div({a}, {b}): there is no such whole number"), None),
        };
    }
    let (a, b) = (number(a)?, number(b)?);
    if b == 0.0 {
        return complain(format!("div({a}, {b}): there is no such whole number"), None);
    }
    Ok((a / b).trunc().into())
}

/// Declares a function of one number.
macro_rules! of_one {
    ($name:literal, $text:literal, $range:literal, $example:literal, $function:expr) => {
        Function {
            name: $name,
            forms: &[concat!($name, "(x) -> number")],
            text: $text,
            arguments: &[("x", $range)],
            example: $example,
            register: |engine| one(engine, $name, $function),
        }
    };
}

pub const CHAPTER: Chapter = Chapter {
    title: "Mathematics",
    functions: &[
        of_one!("sin", "Sine of an angle in radians.", "radians", "sin(0)        // 0.0", libm::sin),
        of_one!("cos", "Cosine of an angle in radians.", "radians", "cos(0)        // 1.0", libm::cos),
        of_one!("tan", "Tangent of an angle in radians.", "radians", "tan(0)        // 0.0", libm::tan),
        of_one!(
            "sind",
            "Sine of an angle in degrees, exact at right angles.",
            "degrees",
            "sind(90)      // 1.0",
            |x| { sin_cos_degrees(x).0 }
        ),
        of_one!(
            "cosd",
            "Cosine of an angle in degrees, exact at right angles.",
            "degrees",
            "cosd(180)     // -1.0",
            |x| { sin_cos_degrees(x).1 }
        ),
        of_one!("tand", "Tangent of an angle in degrees.", "degrees", "tand(45)      // 1.0", |x| {
            sin_cos_degrees(x).0 / sin_cos_degrees(x).1
        }),
        of_one!("asin", "The angle in radians whose sine it is.", "-1 to 1", "asin(0)       // 0.0", libm::asin),
        of_one!("acos", "The angle in radians whose cosine it is.", "-1 to 1", "acos(1)       // 0.0", libm::acos),
        Function {
            name: "atan",
            forms: &["atan(x) -> number", "atan(y, x) -> number"],
            text: "The angle in radians whose tangent it is; with two numbers the angle of the point (x, y), -pi to pi.",
            arguments: &[("x", "any number"), ("y", "any number")],
            example: "atan(0)             // 0.0\natan(1.0, 1.0) * 4  // PI()",
            register: |engine| {
                one(engine, "atan", libm::atan);
                two(engine, "atan", libm::atan2);
            },
        },
        of_one!("sinh", "Hyperbolic sine.", "any number", "sinh(0)       // 0.0", libm::sinh),
        of_one!("cosh", "Hyperbolic cosine.", "any number", "cosh(0)       // 1.0", libm::cosh),
        of_one!("tanh", "Hyperbolic tangent.", "any number", "tanh(0)       // 0.0", libm::tanh),
        of_one!("asinh", "The number whose hyperbolic sine it is.", "any number", "asinh(0)      // 0.0", libm::asinh),
        of_one!("acosh", "The number whose hyperbolic cosine it is.", "from 1", "acosh(1)      // 0.0", libm::acosh),
        of_one!("atanh", "The number whose hyperbolic tangent it is.", "-1 to 1", "atanh(0)      // 0.0", libm::atanh),
        of_one!("exp", "e to the power of x.", "any number", "exp(0)        // 1.0", libm::exp),
        of_one!("ln", "Natural logarithm.", "above 0", "ln(1)         // 0.0", libm::log),
        Function {
            name: "log",
            forms: &["log(x) -> number", "log(x, base) -> number"],
            text: "Logarithm to the base of 10, or to another.",
            arguments: &[("x", "above 0"), ("base", "above 0 and not 1; 10 if left out")],
            example: "log(1000)           // 3.0\nlog(8.0, 2.0)       // 3.0",
            register: |engine| {
                one(engine, "log", libm::log10);
                two(engine, "log", |x, base| libm::log(x) / libm::log(base));
            },
        },
        of_one!("sqrt", "Square root.", "from 0", "sqrt(16)      // 4.0", f64::sqrt),
        Function {
            name: "pow",
            forms: &["pow(x, y) -> number"],
            text: "x to the power of y.",
            arguments: &[("x", "any number; from 0 where y is not whole"), ("y", "any number")],
            example: "pow(2, 10)          // 1024.0",
            register: |engine| two(engine, "pow", libm::pow),
        },
        Function {
            name: "hypot",
            forms: &["hypot(x, y) -> number"],
            text: "Length of the vector (x, y).",
            arguments: &[("x", "any number"), ("y", "any number")],
            example: "hypot(3, 4)         // 5.0",
            register: |engine| two(engine, "hypot", libm::hypot),
        },
        Function {
            name: "div",
            forms: &["div(a, b) -> whole number"],
            text: "The whole part of a / b, cut towards 0; `a % b` is what remains. `/` itself gives the fraction, of whole \
                   numbers too.",
            arguments: &[("a", "any number"), ("b", "any number but 0")],
            example: "div(7, 2)           // 3\n7 / 2               // 3.5\ndiv(-7, 2)          // -3",
            register: |engine| {
                engine.register_fn("div", |a: Dynamic, b: Dynamic| div(&a, &b));
            },
        },
    ],
};
