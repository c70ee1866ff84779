//! Vectors in scripts: a type of their own, and lists of three numbers wherever one is meant.

use ::rhai::{Array, Dynamic, Engine};
use glam::DVec3;

use super::convert::{describe, number, vector};
use super::errors::{Fallible, complain};
use super::rewrite::DIVIDE;
use super::table::{Chapter, Function};

/// Registers an operator between a vector and what may stand on its other side.
macro_rules! operators {
    ($engine:ident: $($symbol:tt $op:tt),*) => { $(
        $engine
            .register_fn($symbol, |a: DVec3, b: DVec3| a $op b)
            .register_fn($symbol, |a: DVec3, b: f64| a $op b)
            .register_fn($symbol, |a: DVec3, b: i64| a $op b as f64)
            .register_fn($symbol, |a: DVec3, b: Array| -> Fallible<DVec3> { Ok(a $op vector(&b.into())?) })
            .register_fn($symbol, |a: Array, b: DVec3| -> Fallible<DVec3> { Ok(vector(&a.into())? $op b) })
            .register_fn($symbol, |a: f64, b: DVec3| DVec3::splat(a) $op b)
            .register_fn($symbol, |a: i64, b: DVec3| DVec3::splat(a as f64) $op b);
    )* };
}

/// Registers an operator of lists of numbers with a number: a vector where they are three.
macro_rules! list_operators {
    ($engine:ident: $($symbol:tt $op:tt),*) => { $(
        $engine
            .register_fn($symbol, |a: Array, b: f64| each(&a, $symbol, |x| x $op b))
            .register_fn($symbol, |a: Array, b: i64| each(&a, $symbol, |x| x $op b as f64))
            .register_fn($symbol, |a: f64, b: Array| each(&b, $symbol, |x| a $op x))
            .register_fn($symbol, |a: i64, b: Array| each(&b, $symbol, |x| a as f64 $op x));
    )* };
}

fn shown(operator: &str) -> &str {
    if operator == DIVIDE { "/" } else { operator }
}

/// A list of numbers with something done to each of them.
fn each(list: &Array, operator: &str, with: impl Fn(f64) -> f64) -> Fallible<Dynamic> {
    let numbers = list.iter().map(|x| number(x).map(&with)).collect::<Fallible<Vec<f64>>>();
    match numbers {
        Ok(numbers) => Ok(match numbers[..] {
            [x, y, z] => Dynamic::from(DVec3::new(x, y, z)),
            _ => numbers.into_iter().map(Dynamic::from).collect::<Array>().into(),
        }),
        Err(_) => complain(
            format!("`{}` works on lists of numbers, and this is {}", shown(operator), describe(&list.clone().into())),
            None,
        ),
    }
}

/// Which coordinate an index means; from the end where it is negative.
fn axis(index: &Dynamic) -> Fallible<usize> {
    match number(index) {
        Ok(i) if i == i.trunc() && (-3.0..3.0).contains(&i) => Ok((i as i64).rem_euclid(3) as usize),
        _ => complain(format!("a vector has the coordinates 0, 1 and 2, not {}", describe(index)), None),
    }
}

fn operators(engine: &mut Engine) {
    engine.register_type_with_name::<DVec3>("Vec3");
    operators!(engine: "+" +, "-" -, "*" *, DIVIDE /);
    list_operators!(engine: "*" *, DIVIDE /);
    engine
        .register_fn("-", |v: DVec3| -v)
        .register_fn("-", |v: Array| each(&v, "-", |x| -x))
        .register_fn("-", |a: Array, b: Array| -> Fallible<DVec3> { Ok(vector(&a.into())? - vector(&b.into())?) })
        .register_fn("==", |a: DVec3, b: DVec3| a == b)
        .register_fn("!=", |a: DVec3, b: DVec3| a != b)
        .register_fn("to_string", |v: &mut DVec3| format!("({}, {}, {})", v.x, v.y, v.z))
        .register_fn("to_debug", |v: &mut DVec3| format!("({}, {}, {})", v.x, v.y, v.z));
    engine
        .register_get_set("x", |v: &mut DVec3| v.x, |v: &mut DVec3, x: f64| v.x = x)
        .register_get_set("y", |v: &mut DVec3| v.y, |v: &mut DVec3, y: f64| v.y = y)
        .register_get_set("z", |v: &mut DVec3| v.z, |v: &mut DVec3, z: f64| v.z = z)
        .register_set("x", |v: &mut DVec3, x: i64| v.x = x as f64)
        .register_set("y", |v: &mut DVec3, y: i64| v.y = y as f64)
        .register_set("z", |v: &mut DVec3, z: i64| v.z = z as f64)
        .register_indexer_get(|v: &mut DVec3, index: i64| -> Fallible<f64> { Ok(v[axis(&index.into())?]) })
        .register_indexer_set(|v: &mut DVec3, index: i64, x: Dynamic| -> Fallible<()> {
            v[axis(&index.into())?] = number(&x)?;
            Ok(())
        });
}

const V: (&str, &str) = ("v", "a vector");
const A: (&str, &str) = ("a", "a vector, or a list of three numbers");
const B: (&str, &str) = ("b", "a vector, or a list of three numbers");

pub const CHAPTER: Chapter = Chapter {
    title: "Vectors",
    functions: &[
        Function {
            name: "vec3",
            forms: &["vec3(x, y, z) -> vector", "vec3(list) -> vector"],
            text: "A vector. A list of three numbers does wherever a vector is meant; `+ - * /` work between vectors, with \
                   numbers and with such lists, coordinate by coordinate. Coordinates are `v.x`, `v.y`, `v.z`, or `v[0]`, \
                   `v[1]`, `v[2]`.",
            arguments: &[("x", "any number"), ("y", "any number"), ("z", "any number"), ("list", "three numbers")],
            example: "vec3(1, 2, 3) * 2 + [1, 0, 0]     // vec3(3, 4, 6)\n\
                      [1, 2, 3] * 0.5                   // vec3(0.5, 1, 1.5)\n\
                      vec3([4, 5, 6])[1]                // 5.0",
            register: |engine| {
                operators(engine);
                engine
                    .register_fn("vec3", |x: Dynamic, y: Dynamic, z: Dynamic| -> Fallible<DVec3> {
                        Ok(DVec3::new(number(&x)?, number(&y)?, number(&z)?))
                    })
                    .register_fn("vec3", |v: Dynamic| vector(&v));
            },
        },
        Function {
            name: "dot",
            forms: &["dot(a, b) -> number"],
            text: "The dot product.",
            arguments: &[A, B],
            example: "dot(vec3(1, 2, 3), [1, 1, 1])     // 6.0",
            register: |engine| {
                engine
                    .register_fn("dot", |a: Dynamic, b: Dynamic| -> Fallible<f64> { Ok(vector(&a)?.dot(vector(&b)?)) });
            },
        },
        Function {
            name: "cross",
            forms: &["cross(a, b) -> vector"],
            text: "The cross product, upright on both, by the right hand.",
            arguments: &[A, B],
            example: "cross([1, 0, 0], [0, 1, 0])       // vec3(0, 0, 1)",
            register: |engine| {
                engine.register_fn("cross", |a: Dynamic, b: Dynamic| -> Fallible<DVec3> {
                    Ok(vector(&a)?.cross(vector(&b)?))
                });
            },
        },
        Function {
            name: "distance",
            forms: &["distance(a, b) -> number"],
            text: "The distance between two points.",
            arguments: &[A, B],
            example: "distance([0, 0, 0], [3, 4, 0])    // 5.0",
            register: |engine| {
                engine.register_fn("distance", |a: Dynamic, b: Dynamic| -> Fallible<f64> {
                    Ok(vector(&a)?.distance(vector(&b)?))
                });
            },
        },
        Function {
            name: "length",
            forms: &["length(v) -> number", "v.length() -> number"],
            text: "The length of a vector. How many items a list has is `list.len()`.",
            arguments: &[V],
            example: "vec3(2, 3, 6).length()            // 7.0",
            register: |engine| {
                engine.register_fn("length", |v: DVec3| v.length());
            },
        },
        Function {
            name: "normalize",
            forms: &["normalize(v) -> vector"],
            text: "The vector of length 1 with the same direction; 0 stays 0.",
            arguments: &[("v", "a vector, or a list of three numbers")],
            example: "normalize([0, 5, 0])              // vec3(0, 1, 0)",
            register: |engine| {
                engine
                    .register_fn("normalize", |v: Dynamic| -> Fallible<DVec3> { Ok(vector(&v)?.normalize_or_zero()) });
            },
        },
    ],
};
