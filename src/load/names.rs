//! Names that are given out, each once.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::components::Text;

/// Names that are taken.
#[derive(Default)]
pub struct Names {
    taken: FxHashSet<String>,
    /// The number that a word was given last.
    last: FxHashMap<String, usize>,
}

impl Names {
    /// The word, or the word with the next free number behind it.
    pub fn give(&mut self, word: &str) -> Text {
        let mut name = word.to_string();
        while !self.taken.insert(name.clone()) {
            let number = self.last.entry(word.to_string()).or_insert(1);
            *number += 1;
            name = format!("{word}.{number}");
        }
        name.into()
    }
}
