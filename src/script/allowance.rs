//! What one call of a script may use: the usual limits, and how its header or the command line raises them.

use std::fmt::Display;

use ::rhai::{Dynamic, Map};

use super::convert::number;
use super::errors::{Fallible, complain};
use crate::base::codec::{Codec, Decoder, Encoder, Malformed};
use crate::base::diagnostics::{Cause, Diagnostic, suggestion};
use crate::base::limits;

/// What one call of a function of a script may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// In the order of [`Limit::ALL`].
    values: [u64; Limit::ALL.len()],
}

/// One of the limits that may be raised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Steps of the engine in one call.
    Operations,
    /// Processor time of one call.
    Seconds,
    /// Mebibytes that all values of a script hold.
    Memory,
    /// Entities that one frame may spawn.
    Spawns,
}

impl Limit {
    /// Every limit, in the order of the guide.
    pub const ALL: [Limit; 4] = [Limit::Operations, Limit::Seconds, Limit::Memory, Limit::Spawns];

    /// As it is written: `limits: #{ operations: 1e9 }`.
    pub fn name(self) -> &'static str {
        match self {
            Limit::Operations => "operations",
            Limit::Seconds => "seconds",
            Limit::Memory => "memory",
            Limit::Spawns => "spawns",
        }
    }

    /// What it is unless it is raised, and the most that it may be.
    pub fn range(self) -> [u64; 2] {
        match self {
            Limit::Operations => [limits::SCRIPT_OPERATIONS, limits::SCRIPT_OPERATIONS_RAISED],
            Limit::Seconds => [limits::SCRIPT_SECONDS, limits::SCRIPT_SECONDS_RAISED],
            Limit::Memory => [(limits::SCRIPT_BYTES >> 20) as u64, limits::SCRIPT_MEBIBYTES_RAISED],
            Limit::Spawns => [limits::SCRIPT_SPAWNS as u64, limits::ENTITIES as u64],
        }
    }

    /// How it is raised, for the help of an error.
    pub fn how_to_raise(self, now: u64) -> String {
        let [_, most] = self.range();
        let name = self.name();
        if now >= most {
            return format!("{most} are the most that `limits.{name}` may be");
        }
        let more = now.saturating_mul(10).min(most);
        format!("allow more with animation(#{{ limits: #{{ {name}: {more} }} }}) or -D limits.{name}={more}")
    }
}

/// What a limit is called on the command line: `-D limits.operations=1e9`.
const PREFIX: &str = "limits.";

impl Default for Allowance {
    fn default() -> Self {
        Allowance { values: Limit::ALL.map(|limit| limit.range()[0]) }
    }
}

impl Allowance {
    /// What a limit is for this script.
    pub fn get(&self, limit: Limit) -> u64 {
        self.values[limit as usize]
    }

    /// Processor time of a call.
    pub fn seconds(&self) -> u64 {
        // More operations are of no use without the time for them.
        let for_operations = self.get(Limit::Operations) / (limits::SCRIPT_OPERATIONS / limits::SCRIPT_SECONDS);
        self.get(Limit::Seconds).max(for_operations)
    }

    /// Bytes that a call may hold.
    pub fn bytes(&self) -> usize {
        (self.get(Limit::Memory) << 20) as usize
    }

    fn set(&mut self, name: &str, value: f64) -> Result<(), (String, Option<String>)> {
        let Some(limit) = Limit::ALL.into_iter().find(|limit| limit.name() == name) else {
            return Err((format!("there is no limit `{name}`"), suggestion(name, Limit::ALL.map(Limit::name))));
        };
        let [usual, most] = limit.range();
        if !(value >= 1.0 && value <= most as f64) {
            let message =
                format!("the limit `{name}` goes from 1 to {most} (it is {usual} unless it is given), not {value}");
            return Err((message, None));
        }
        self.values[limit as usize] = value as u64;
        Ok(())
    }

    /// Takes what the map `limits` of a header says.
    ///
    /// # Errors
    /// An unknown limit, a value out of its range.
    pub fn read(&mut self, map: &Map) -> Fallible<()> {
        for (name, value) in map {
            self.set(name, number(value)?).or_else(|(message, help)| complain(message, help))?;
        }
        Ok(())
    }

    /// Takes what the command line says, which has the last word.
    ///
    /// # Errors
    /// As [`Self::read`], and a value that is no number.
    pub fn define(&mut self, defines: &[(String, String)]) -> Result<(), Diagnostic> {
        for (key, value) in defines {
            let Some(name) = key.strip_prefix(PREFIX) else { continue };
            let refused = |message: &dyn Display, help: Option<String>| {
                let refused = Diagnostic::error(format!("-D {key}={value}: {message}")).because(Cause::Usage);
                help.into_iter().fold(refused, Diagnostic::help)
            };
            let number: f64 = value.parse().map_err(|_| refused(&"expected a number", None))?;
            self.set(name, number).map_err(|(message, help)| refused(&message, help))?;
        }
        Ok(())
    }
}

/// Whether a define is about a limit, and not a parameter of the script.
pub fn is_limit(name: &str) -> bool {
    name.starts_with(PREFIX)
}

/// The map `limits` of a header.
///
/// # Errors
/// Anything but a map.
pub fn map_of(value: &Dynamic) -> Fallible<Map> {
    match value.read_lock::<Map>() {
        Some(map) => Ok(map.clone()),
        None => complain("`limits`: expected a map, as in limits: #{ operations: 1e9 }", None),
    }
}

impl Codec for Allowance {
    fn encode(&self, to: &mut Encoder) {
        self.values.iter().for_each(|value| to.put(value));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let mut values = [0; Limit::ALL.len()];
        for value in &mut values {
            *value = from.get()?;
        }
        Ok(Allowance { values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_raised_by_name_within_their_ranges() {
        let mut allowance = Allowance::default();
        let define = |name: &str, value: &str| vec![(name.to_string(), value.to_string())];
        allowance.define(&define("limits.operations", "1e9")).unwrap();
        assert_eq!(allowance.get(Limit::Operations), 1_000_000_000);
        // Time goes with them.
        assert!(allowance.seconds() >= 400);
        allowance.define(&define("radius", "3")).unwrap();
        let said = |name: &str, value: &str| Allowance::default().define(&define(name, value)).unwrap_err().to_string();
        assert!(said("limits.operatoins", "5").contains("did you mean `operations`?"));
        assert!(said("limits.memory", "1e9").contains("the limit `memory` goes from 1 to"));
        assert!(said("limits.seconds", "long").contains("expected a number"));
        for limit in Limit::ALL {
            let [usual, most] = limit.range();
            assert!(usual < most && limit.how_to_raise(usual).contains(limit.name()));
            assert!(!limit.how_to_raise(most).contains("allow more"));
        }
    }
}
