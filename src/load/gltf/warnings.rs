//! What of a file is not used: each kind is told once, at its first place.

use crate::load::resolve::Problem;

/// Kinds that are told apart: past this a file is no longer what its name says, and one more warning says nothing.
const KINDS: usize = 100;

/// Warnings by their kind, in the order in which they were met.
#[derive(Default)]
pub struct Warnings(Vec<(String, u64, Problem)>);

impl Warnings {
    /// Counts something of a kind; `told` is asked for the first of them.
    pub fn add(&mut self, kind: &str, told: impl FnOnce() -> Problem) {
        if let Some((_, count, _)) = self.0.iter_mut().find(|(known, ..)| known == kind) {
            *count += 1;
        } else if self.0.len() < KINDS {
            self.0.push((kind.to_string(), 1, told()));
        }
    }

    /// The warnings, with how often there was reason for them.
    pub fn into_problems(self) -> impl Iterator<Item = Problem> {
        self.0.into_iter().map(|(_, count, mut problem)| {
            if count > 1 {
                problem.message = format!("{} ({count} times in this file)", problem.message);
            }
            problem
        })
    }
}
