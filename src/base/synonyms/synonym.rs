//! One row of the tables of words.

/// What some words elsewhere are called here, and what to say beside it.
pub struct Synonym {
    /// Lower case, without blanks, dashes and underscores.
    pub foreign: &'static [&'static str],
    /// Ours, the likeliest first.
    pub ours: &'static [&'static str],
    /// What the word alone does not tell.
    pub note: &'static str,
}

/// A row of the tables.
pub const fn meaning(foreign: &'static [&'static str], ours: &'static [&'static str], note: &'static str) -> Synonym {
    Synonym { foreign, ours, note }
}
