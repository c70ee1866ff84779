//! Named sets of faces while they are read: faces belong to those that are active.

use rustc_hash::FxHashMap;

use crate::components::{FaceSet, Text};

/// The sets that faces belong to from now on.
#[derive(Default)]
pub struct Active {
    pub object: Option<Text>,
    pub groups: Vec<Text>,
    /// Whether the object stays what it was.
    pub keeps: bool,
}

impl Active {
    /// A new object; groups of the one before are not its own.
    pub fn object(name: &str) -> Active {
        Active { object: (!name.is_empty()).then(|| name.into()), groups: Vec::new(), keeps: false }
    }

    /// Groups inside of the object. Each word is one; so are all words together, for many programs write names with
    /// blanks.
    pub fn groups(names: &str) -> Active {
        let mut groups: Vec<Text> = names.split_whitespace().map(Text::from).collect();
        if groups.len() > 1 {
            groups.push(names.into());
        }
        groups.dedup();
        Active { object: None, groups, keeps: true }
    }
}

/// Sets in the order in which they are first named.
#[derive(Default)]
pub struct Sets {
    sets: Vec<FaceSet>,
    numbers: FxHashMap<Text, usize>,
    object: Option<usize>,
    groups: Vec<usize>,
    /// The first triangle that is in no set yet.
    since: u32,
}

impl Sets {
    /// Other sets are active from the triangle `now` on.
    pub fn switch(&mut self, active: Active, now: u32) {
        self.close(now);
        if !active.keeps {
            self.object = active.object.map(|name| self.number(name));
        }
        self.groups = active.groups.into_iter().map(|name| self.number(name)).collect();
        // A group of its object's name is the object.
        self.groups.retain(|group| Some(*group) != self.object);
        self.groups.sort_unstable();
        self.groups.dedup();
    }

    fn number(&mut self, name: Text) -> usize {
        let next = self.sets.len();
        let number = *self.numbers.entry(name.clone()).or_insert(next);
        if number == next {
            self.sets.push(FaceSet { name, runs: Vec::new() });
        }
        number
    }

    fn close(&mut self, now: u32) {
        for number in self.object.iter().chain(&self.groups) {
            self.sets[*number].push(self.since, now);
        }
        self.since = now;
    }

    /// The sets that have any faces.
    pub fn finish(mut self, now: u32) -> Vec<FaceSet> {
        self.close(now);
        self.sets.retain(|set| !set.runs.is_empty());
        self.sets
    }
}
