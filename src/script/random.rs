//! Random numbers of a script: from a seed, never from the system.

use std::sync::{Arc, Mutex, PoisonError};

use ::rhai::{Array, Dynamic, Engine};
use glam::DVec3;
use rand::rngs::ChaCha8Rng;
use rand::{Rng, SeedableRng};

use super::convert::number;
use super::errors::{Fallible, complain};
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

    fn unit_vector(&mut self) -> DVec3 {
        let z = 1.0 - 2.0 * self.float();
        let (sin, cos) = sin_cos_degrees(360.0 * self.float());
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

pub fn register(engine: &mut Engine) {
    engine
        .register_type_with_name::<Generator>("Random")
        .register_fn("rng", |seed: i64| Generator::new(seed as u64))
        .register_fn("float", Generator::float)
        .register_fn("range", |g: &mut Generator, a: Dynamic, b: Dynamic| g.range(&a, &b))
        .register_fn("int", Generator::int)
        .register_fn("pick", |g: &mut Generator, list: Array| g.pick(&list))
        .register_fn("unit_vector", Generator::unit_vector);
}
