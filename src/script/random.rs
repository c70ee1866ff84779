//! Random numbers of a script: from a seed, never from the system.

use std::sync::{Arc, Mutex, PoisonError};

use ::rhai::{Array, Dynamic};
use glam::DVec3;
use rand::rngs::ChaCha8Rng;
use rand::{Rng, SeedableRng};

use super::convert::number;
use super::errors::{Fallible, complain};
use super::table::{Chapter, Function};
use crate::base::math::sin_cos_degrees;

/// A generator that handles share: each number is drawn once.
#[derive(Clone)]
pub struct Generator(Arc<Mutex<ChaCha8Rng>>);

impl Generator {
    pub fn new(seed: u64) -> Self {
        Generator(Arc::new(Mutex::new(ChaCha8Rng::seed_from_u64(seed))))
    }

    /// Uniform in [0, 1), from 53 bits.
    fn float(&mut self) -> f64 {
        let bits = self.0.lock().unwrap_or_else(PoisonError::into_inner).next_u64() >> 11;
        bits as f64 / (1u64 << 53) as f64
    }

    fn range(&mut self, a: &Dynamic, b: &Dynamic) -> Fallible<f64> {
        let (a, b) = (number(a)?, number(b)?);
        Ok(a + (b - a) * self.float())
    }

    /// Uniform over the whole numbers from a to b, both included.
    fn int(&mut self, a: i64, b: i64) -> Fallible<i64> {
        if a > b {
            return complain(format!("rng.int({a}, {b}): the first must not be above the second"), None);
        }
        let span = (i128::from(b) - i128::from(a) + 1) as f64;
        let offset = (self.float() * span) as i128;
        Ok((i128::from(a) + offset).min(i128::from(b)) as i64)
    }

    fn pick(&mut self, list: &Array) -> Fallible<Dynamic> {
        if list.is_empty() {
            return complain("rng.pick: the list is empty", None);
        }
        let index = (self.float() * list.len() as f64) as usize;
        Ok(list[index.min(list.len() - 1)].clone())
    }

    /// A number of the normal distribution with mean 0 and deviation 1 (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        // 1 - x is never 0, whose logarithm would be infinite.
        let radius = (-2.0 * libm::log(1.0 - self.float())).sqrt();
        radius * sin_cos_degrees(360.0 * self.float()).1
    }

    /// Fisher and Yates, from the end.
    fn shuffle(&mut self, mut list: Array) -> Array {
        for last in (1..list.len()).rev() {
            let index = (self.float() * (last + 1) as f64) as usize;
            list.swap(index.min(last), last);
        }
        list
    }

    fn unit_vector(&mut self) -> DVec3 {
        let z = 1.0 - 2.0 * self.float();
        let (sin, cos) = sin_cos_degrees(360.0 * self.float());
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

const RNG: (&str, &str) = ("rng", "a generator: `f.rng`, `s.rng`, or one made by `rng(seed)`");

pub const CHAPTER: Chapter = Chapter {
    title: "Random numbers",
    functions: &[
        Function {
            name: "rng",
            forms: &["rng(seed) -> generator"],
            text: "A generator of random numbers: the same seed gives the same numbers, on every machine. `s.rng` in `setup` \
                   and `f.rng` in `frame` are generators whose seed follows from that of `animation` and the frame.",
            arguments: &[("seed", "a whole number")],
            example: "rng(7).float() == rng(7).float()              // true",
            register: |engine| {
                engine
                    .register_type_with_name::<Generator>("Random")
                    .register_fn("rng", |seed: i64| Generator::new(seed as u64));
            },
        },
        Function {
            name: "float",
            forms: &["rng.float() -> number"],
            text: "A number from 0 up to, and without, 1; each as likely as any other.",
            arguments: &[RNG],
            example: "f.rng.float() < 1.0                           // true",
            register: |engine| {
                engine.register_fn("float", Generator::float);
            },
        },
        Function {
            name: "range",
            forms: &["rng.range(a, b) -> number"],
            text: "A number from a up to b.",
            arguments: &[RNG, ("a", "the least number"), ("b", "the largest number")],
            example: "f.rng.range(3, 4) >= 3.0                      // true",
            register: |engine| {
                engine.register_fn("range", |g: &mut Generator, a: Dynamic, b: Dynamic| g.range(&a, &b));
            },
        },
        Function {
            name: "int",
            forms: &["rng.int(a, b) -> whole number"],
            text: "A whole number from a to b, both included.",
            arguments: &[RNG, ("a", "the least whole number"), ("b", "the largest whole number, not below a")],
            example: "f.rng.int(3, 3)                               // 3",
            register: |engine| {
                engine.register_fn("int", Generator::int);
            },
        },
        Function {
            name: "normal",
            forms: &["rng.normal() -> number", "rng.normal(mean, deviation) -> number"],
            text: "A normally distributed number.",
            arguments: &[RNG, ("mean", "0 if left out"), ("deviation", "standard deviation, from 0; 1 if left out")],
            example: "f.rng.normal(5, 0)                            // 5.0",
            register: |engine| {
                engine.register_fn("normal", |g: &mut Generator| g.normal()).register_fn(
                    "normal",
                    |g: &mut Generator, mean: Dynamic, deviation: Dynamic| -> Fallible<f64> {
                        Ok(number(&mean)? + number(&deviation)? * g.normal())
                    },
                );
            },
        },
        Function {
            name: "pick",
            forms: &["rng.pick(list) -> value"],
            text: "One item of a list.",
            arguments: &[RNG, ("list", "a list with at least one item")],
            example: "f.rng.pick([4])                               // 4",
            register: |engine| {
                engine.register_fn("pick", |g: &mut Generator, list: Array| g.pick(&list));
            },
        },
        Function {
            name: "shuffle",
            forms: &["rng.shuffle(list) -> list"],
            text: "The items of a list in another order; the list itself stays as it is.",
            arguments: &[RNG, ("list", "any list")],
            example: "f.rng.shuffle([1, 2, 3, 4]).len()             // 4",
            register: |engine| {
                engine.register_fn("shuffle", |g: &mut Generator, list: Array| g.shuffle(list));
            },
        },
        Function {
            name: "unit_vector",
            forms: &["rng.unit_vector() -> vector"],
            text: "A direction, each as likely as any other: a vector of length 1.",
            arguments: &[RNG],
            example: "f.rng.unit_vector().length()                  // 1.0",
            register: |engine| {
                engine.register_fn("unit_vector", Generator::unit_vector);
            },
        },
    ],
};
