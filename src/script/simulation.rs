//! Simulation: a state that goes on from step to step, and is the same for a frame whoever makes it.
//!
//! `start(s)` gives the first state, and `step(state, f)` the next one from each. States are plain data: they are made in
//! order, once, and kept; a frame is given the state of its time, so that it stays a pure function of its number. Between
//! steps, as while the shutter is open, numbers and vectors are interpolated.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::convert::{describe, to_value};
use super::errors::{Fallible, complain};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::components::{Scene, Value};

/// States by the numbers of their steps.
pub type NumberedStates = Vec<(u64, Value)>;

/// States of one script that were made so far.
#[derive(Default)]
pub struct Simulation(Mutex<States>);

#[derive(Default)]
struct States {
    /// The scene that the first state was made from.
    scene: Option<Arc<Scene>>,
    /// By their number.
    made: BTreeMap<u64, Arc<Value>>,
    bytes: usize,
    /// The step that failed, and why.
    failed: Option<(u64, Diagnostics)>,
}

impl States {
    /// The states of a scene; those of another one are forgotten.
    fn of(&mut self, scene: &Arc<Scene>) -> &mut States {
        if self.scene.as_ref().is_none_or(|known| !Arc::ptr_eq(known, scene)) {
            *self = States { scene: Some(scene.clone()), ..States::default() };
        }
        self
    }

    fn keep(&mut self, number: u64, state: Value) {
        self.bytes += size_of(&state);
        self.made.insert(number, Arc::new(state));
    }

    /// The state of a number, by way of those between it and the nearest one before it.
    fn reach(
        &mut self,
        number: u64,
        next: &mut impl FnMut(Option<(u64, &Value)>) -> Result<Value, Diagnostics>,
    ) -> Result<Arc<Value>, Diagnostics> {
        loop {
            let nearest = self.made.range(..=number).next_back().map(|(at, state)| (*at, state.clone()));
            let at = match &nearest {
                Some((at, state)) if *at == number => return Ok(state.clone()),
                Some((at, _)) => at + 1,
                None => 0,
            };
            if let Some((_, problems)) = self.failed.as_ref().filter(|(failed, _)| *failed == at) {
                return Err(problems.clone());
            }
            let made = next(nearest.as_ref().map(|(at, state)| (*at, &**state))).and_then(|state| {
                self.keep(at, state);
                self.check_room()
            });
            if let Err(problems) = made {
                self.made.remove(&at);
                self.failed = Some((at, problems.clone()));
                return Err(problems);
            }
        }
    }

    fn check_room(&self) -> Result<(), Diagnostics> {
        if self.bytes <= limits::SIMULATION_BYTES {
            return Ok(());
        }
        let most = limits::SIMULATION_BYTES >> 20;
        let message = format!("the {} states of the simulation take more than {most} MiB", self.made.len());
        let problem = Diagnostic::error(message);
        Err(problem.help("keep less in the state, or take fewer `steps_per_frame`").into())
    }
}

impl Simulation {
    fn lock(&self) -> MutexGuard<'_, States> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Goes on from states that were made before, from the same scene, by their numbers.
    pub fn resume(&self, scene: &Arc<Scene>, states: NumberedStates) {
        let mut known = self.lock();
        let known = known.of(scene);
        for (number, state) in states {
            if !known.made.contains_key(&number) {
                known.keep(number, state);
            }
        }
    }

    /// Those of the states with these numbers that were made from a scene.
    pub fn known(&self, scene: &Arc<Scene>, numbers: &[u64]) -> NumberedStates {
        let states = self.lock();
        if states.scene.as_ref().is_none_or(|known| !Arc::ptr_eq(known, scene)) {
            return Vec::new();
        }
        numbers.iter().filter_map(|number| Some((*number, Value::clone(states.made.get(number)?)))).collect()
    }

    /// The state at a time in steps from the start; before it, numbers go on backwards in straight lines.
    ///
    /// `next` makes the first state from none, and each further one from the one before and its number.
    ///
    /// # Errors
    /// Those of `next`, again for every time beyond the step that failed; states that take too much memory.
    pub fn at(
        &self,
        scene: &Arc<Scene>,
        time: f64,
        mut next: impl FnMut(Option<(u64, &Value)>) -> Result<Value, Diagnostics>,
    ) -> Result<Value, Diagnostics> {
        let whole = time.floor().max(0.0);
        let share = time - whole;
        let first = whole as u64;
        let mut states = self.lock();
        let states = states.of(scene);
        let a = states.reach(first, &mut next)?;
        let b = if share == 0.0 { None } else { Some(states.reach(first + 1, &mut next)?) };
        Ok(match b {
            Some(b) => between(&a, &b, share),
            None => Value::clone(&a),
        })
    }
}

/// What a script gives as its state.
///
/// # Errors
/// What is no plain data.
pub fn state_of(value: &::rhai::Dynamic) -> Fallible<Value> {
    match to_value(value) {
        Some(state) => Ok(state),
        None => complain(
            format!(
                "a state holds numbers, texts, vectors, lists and maps, and nothing else; this is {}",
                describe(value)
            ),
            Some("keep names of entities instead of entities".into()),
        ),
    }
}

/// Bytes that a state takes, about.
fn size_of(value: &Value) -> usize {
    let own = std::mem::size_of::<Value>();
    own + match value {
        Value::Text(text) => text.len(),
        Value::List(items) => items.iter().map(size_of).sum(),
        Value::Map(entries) => entries.iter().map(|(key, value)| 16 + key.len() + size_of(value)).sum(),
        Value::Unit | Value::Bool(_) | Value::Int(_) | Value::Number(_) | Value::Vec3(_) => 0,
    }
}

/// Between two states of the same shape; where they differ in shape, or are no numbers, the earlier one.
fn between(a: &Value, b: &Value, t: f64) -> Value {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => Value::Number(a + (b - a) * t),
        (Value::Vec3(a), Value::Vec3(b)) => Value::Vec3(*a + (*b - *a) * t),
        (Value::List(a), Value::List(b)) if a.len() == b.len() => {
            Value::List(a.iter().zip(b).map(|(a, b)| between(a, b, t)).collect())
        }
        (Value::Map(a), Value::Map(b)) if a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0) => {
            Value::Map(a.iter().zip(b).map(|(a, b)| (a.0.clone(), between(&a.1, &b.1, t))).collect())
        }
        _ => a.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counting(calls: &mut u32, before: Option<(u64, &Value)>) -> Result<Value, Diagnostics> {
        *calls += 1;
        Ok(match before {
            None => Value::Number(10.0),
            Some((number, Value::Number(x))) => Value::Number(x + number as f64 + 1.0),
            Some(_) => Value::Unit,
        })
    }

    #[test]
    fn states_are_made_once_and_in_order() {
        let (simulation, scene) = (Simulation::default(), Arc::new(Scene::default()));
        let mut calls = 0;
        let mut at = |time: f64| simulation.at(&scene, time, |before| counting(&mut calls, before)).unwrap();
        assert_eq!(at(3.0), Value::Number(16.0));
        assert_eq!(at(0.0), Value::Number(10.0));
        assert_eq!(at(1.5), Value::Number(12.0));
        assert_eq!(at(-0.5), Value::Number(9.5));
        assert_eq!(calls, 4);
    }

    #[test]
    fn a_state_that_was_kept_is_gone_on_from() {
        let (simulation, scene) = (Simulation::default(), Arc::new(Scene::default()));
        simulation.resume(&scene, vec![(2, Value::Number(13.0)), (5, Value::Number(25.0))]);
        let mut calls = 0;
        let mut at = |time: f64| simulation.at(&scene, time, |before| counting(&mut calls, before)).unwrap();
        assert_eq!((at(5.0), at(3.0), at(6.5)), (Value::Number(25.0), Value::Number(16.0), Value::Number(34.5)));
        // Before the first of them it starts anew.
        assert_eq!(at(1.0), Value::Number(11.0));
        assert_eq!(calls, 5);
        let numbers = |states: NumberedStates| states.into_iter().map(|(number, _)| number).collect::<Vec<_>>();
        assert_eq!(numbers(simulation.known(&scene, &[0, 4, 6, 9])), [0, 6]);
        assert!(simulation.known(&Arc::default(), &[0]).is_empty());
    }

    #[test]
    fn another_scene_starts_anew() {
        let simulation = Simulation::default();
        let mut calls = 0;
        for _ in 0..2 {
            let scene = Arc::new(Scene::default());
            simulation.at(&scene, 1.0, |before| counting(&mut calls, before)).unwrap();
        }
        assert_eq!(calls, 4);
    }

    #[test]
    fn what_has_no_between_stays_as_it_was() {
        let state = |x: f64, n: i64| Value::Map(vec![("x".into(), Value::Number(x)), ("n".into(), Value::Int(n))]);
        assert_eq!(between(&state(1.0, 1), &state(2.0, 2), 0.5), state(1.5, 1));
        let list = |n: usize| Value::List(vec![Value::Number(1.0); n]);
        assert_eq!(between(&list(2), &list(3), 0.5), list(2));
    }
}
