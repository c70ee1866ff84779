//! The map of options that many functions take last: read by name, with ranges, and refused where a name is unknown.

use ::rhai::{Dynamic, Map};
use glam::DVec3;

use super::convert::{describe, is_vector, number, vector};
use super::errors::{Fallible, complain};
use crate::base::diagnostics::suggestion;

/// CallOptions of one call.
pub struct CallOptions<'a> {
    function: &'static str,
    map: &'a Map,
}

impl<'a> CallOptions<'a> {
    /// # Errors
    /// An option that the function does not know, with the nearest one that it does.
    pub fn new(function: &'static str, map: &'a Map, known: &[&'static str]) -> Fallible<Self> {
        match map.keys().find(|key| !known.contains(&key.as_str())) {
            Some(key) => complain(format!("{function} has no option `{key}`"), suggestion(key, known.iter().copied())),
            None => Ok(CallOptions { function, map }),
        }
    }

    /// Who is called.
    pub fn function(&self) -> &'static str {
        self.function
    }

    /// The option itself, where it is given and not `()`.
    pub fn get(&self, name: &str) -> Option<&'a Dynamic> {
        self.map.get(name).filter(|value| !value.is_unit())
    }

    /// A finite number from `low` to `high`.
    pub fn between(&self, name: &str, default: f64, low: f64, high: f64) -> Fallible<f64> {
        let Some(value) = self.get(name) else { return Ok(default) };
        match number(value) {
            Ok(x) if (low..=high).contains(&x) => Ok(x),
            _ => self.wrong(name, &format!("a number from {low} to {high}"), value),
        }
    }

    /// A whole number from `low` to `high`.
    pub fn whole(&self, name: &str, default: u64, low: u64, high: u64) -> Fallible<u64> {
        let Some(value) = self.get(name) else { return Ok(default) };
        match number(value) {
            Ok(x) if x == x.trunc() && x >= low as f64 && x <= high as f64 => Ok(x as u64),
            _ => self.wrong(name, &format!("a whole number from {low} to {high}"), value),
        }
    }

    /// `true` or `false`.
    pub fn switch(&self, name: &str, default: bool) -> Fallible<bool> {
        let Some(value) = self.get(name) else { return Ok(default) };
        value.as_bool().or_else(|_| self.wrong(name, "true or false", value))
    }

    /// Which of some words is given.
    pub fn choice(&self, name: &str, words: &[&'static str]) -> Fallible<Option<usize>> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let Ok(word) = value.clone().into_immutable_string() else {
            return self.wrong(name, &format!("one of {}", quoted(words)), value);
        };
        match words.iter().position(|known| *known == word.as_str()) {
            Some(index) => Ok(Some(index)),
            None => complain(
                format!("`{name}` of {}: expected one of {}, found \"{word}\"", self.function, quoted(words)),
                suggestion(&word, words.iter().copied()),
            ),
        }
    }

    /// A vector.
    pub fn vector(&self, name: &str, default: DVec3) -> Fallible<DVec3> {
        let Some(value) = self.get(name) else { return Ok(default) };
        vector(value).or_else(|_| self.wrong(name, "a vector", value))
    }

    /// A vector, or a number for all three axes.
    pub fn vector_or_number(&self, name: &str, default: DVec3) -> Fallible<DVec3> {
        let Some(value) = self.get(name) else { return Ok(default) };
        if is_vector(value) {
            return self.vector(name, default);
        }
        number(value).map(DVec3::splat).or_else(|_| self.wrong(name, "a number or a vector", value))
    }

    /// Refuses the value of an option.
    pub fn wrong<T>(&self, name: &str, expected: &str, found: &Dynamic) -> Fallible<T> {
        complain(format!("`{name}` of {}: expected {expected}, found {}", self.function, describe(found)), None)
    }
}

fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}
