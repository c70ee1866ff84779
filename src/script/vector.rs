//! Vectors in scripts: a type of their own, and lists of three numbers wherever one is meant.

use ::rhai::{Dynamic, Engine};
use glam::DVec3;

use super::convert::{number, vector};
use super::errors::Fallible;

/// Registers an operator between a vector and what may stand on its other side.
macro_rules! operators {
    ($engine:ident: $($symbol:literal $op:tt),*) => { $(
        $engine
            .register_fn($symbol, |a: DVec3, b: DVec3| a $op b)
            .register_fn($symbol, |a: DVec3, b: f64| a $op b)
            .register_fn($symbol, |a: DVec3, b: i64| a $op b as f64)
            .register_fn($symbol, |a: DVec3, b: ::rhai::Array| -> Fallible<DVec3> { Ok(a $op vector(&b.into())?) })
            .register_fn($symbol, |a: ::rhai::Array, b: DVec3| -> Fallible<DVec3> { Ok(vector(&a.into())? $op b) })
            .register_fn($symbol, |a: f64, b: DVec3| DVec3::splat(a) $op b)
            .register_fn($symbol, |a: i64, b: DVec3| DVec3::splat(a as f64) $op b);
    )* };
}

pub fn register(engine: &mut Engine) {
    engine.register_type_with_name::<DVec3>("Vec3");
    engine
        .register_get_set("x", |v: &mut DVec3| v.x, |v: &mut DVec3, x: f64| v.x = x)
        .register_get_set("y", |v: &mut DVec3| v.y, |v: &mut DVec3, y: f64| v.y = y)
        .register_get_set("z", |v: &mut DVec3| v.z, |v: &mut DVec3, z: f64| v.z = z)
        .register_set("x", |v: &mut DVec3, x: i64| v.x = x as f64)
        .register_set("y", |v: &mut DVec3, y: i64| v.y = y as f64)
        .register_set("z", |v: &mut DVec3, z: i64| v.z = z as f64);
    operators!(engine: "+" +, "-" -, "*" *, "/" /);
    engine
        .register_fn("-", |v: DVec3| -v)
        .register_fn("==", |a: DVec3, b: DVec3| a == b)
        .register_fn("!=", |a: DVec3, b: DVec3| a != b)
        .register_fn("vec3", |x: Dynamic, y: Dynamic, z: Dynamic| -> Fallible<DVec3> {
            Ok(DVec3::new(number(&x)?, number(&y)?, number(&z)?))
        })
        .register_fn("vec3", |v: Dynamic| vector(&v))
        .register_fn("dot", |a: DVec3, b: Dynamic| -> Fallible<f64> { Ok(a.dot(vector(&b)?)) })
        .register_fn("cross", |a: DVec3, b: Dynamic| -> Fallible<DVec3> { Ok(a.cross(vector(&b)?)) })
        .register_fn("distance", |a: Dynamic, b: Dynamic| -> Fallible<f64> { Ok(vector(&a)?.distance(vector(&b)?)) })
        .register_fn("length", |v: DVec3| v.length())
        .register_fn("normalize", |v: DVec3| v.normalize_or_zero())
        .register_fn("to_string", |v: &mut DVec3| format!("({}, {}, {})", v.x, v.y, v.z))
        .register_fn("to_debug", |v: &mut DVec3| format!("({}, {}, {})", v.x, v.y, v.z));
}
