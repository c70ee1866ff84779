//! The reference, for people: pages that the program prints, as text, HTML or JSON.
//!
//! Nothing in it is written twice: fields come from the `record!` tables with their documentation and defaults, functions
//! from the table that registers them ([`crate::script::CHAPTERS`]), foreign words from the list that mistakes are
//! answered with. Every example runs as a test.
//!
//! - `pages`: what there is, and in which order
//! - [`text`]: a page for the terminal
//! - [`html`]: all pages as a site that needs no server
//! - [`pictures`]: what can be chosen, as it looks
//! - [`json`]: all pages, and the schema of scenes, for editors
//! - [`definitions`]: functions of scripts for the language server of Rhai

mod coming_from;
pub mod definitions;
mod field_examples;
mod fields;
pub mod html;
pub mod json;
mod language;
mod many_machines;
mod markdown;
mod mistakes;
mod pages;
pub mod pictures;
pub mod text;

pub use fields::{FieldReference, RecordReference, entity_records, other_records};
pub use pages::{PAGES, Page, find};

/// A piece of a page.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A line above what follows.
    Heading(String),
    /// Sentences.
    Paragraph(String),
    /// Lines of a scene, a script or a command.
    Code(CodeKind, String),
    /// Something with a name: a field or a function.
    GuideEntry(GuideEntry),
    /// Words of another tool, and ours.
    Pair(String, String),
}

/// What a piece of code is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeKind {
    /// A scene in RON.
    Scene,
    /// A script in Rhai.
    Script,
    /// What is typed at a prompt.
    Command,
    /// What the program says.
    Answer,
}

/// A field or a function.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GuideEntry {
    /// How it is written: `fov`, or `lerp(a, b, t) -> value`.
    pub forms: Vec<String>,
    /// What its value is: "a number".
    pub kind: String,
    /// What it is without being given; empty for functions.
    pub default: String,
    /// What it means, in sentences.
    pub text: String,
    /// Arguments of a function, each with unit, range and default.
    pub arguments: Vec<(String, String)>,
    /// How it is used.
    pub example: Option<(CodeKind, String)>,
}

#[cfg(test)]
mod tests;
