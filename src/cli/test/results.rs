//! What came of one golden frame.

use std::path::PathBuf;

use crate::base::diagnostics::{Diagnostics, Place};
use crate::compare::report::{ReportItem, SceneChange};

/// What a test of one golden frame found.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The golden carries the hash of the frame.
    Unchanged,
    /// Rendered, and every pixel is as it was.
    Equal,
    /// Different, and forgiven.
    Within,
    Different,
    /// There is no golden.
    Missing,
    /// The frame could not be made.
    Failed(Diagnostics),
    /// It failed or its golden was of an older making, and the user has made it golden.
    Accepted,
}

impl Outcome {
    pub fn word(&self) -> &'static str {
        match self {
            Outcome::Unchanged => "unchanged",
            Outcome::Equal => "equal",
            Outcome::Within => "within",
            Outcome::Different => "different",
            Outcome::Missing => "missing",
            Outcome::Failed(_) => "failed",
            Outcome::Accepted => "accepted",
        }
    }

    /// Whether it makes the test fail.
    pub fn fails(&self) -> bool {
        match self {
            Outcome::Different | Outcome::Missing | Outcome::Failed(_) => true,
            Outcome::Unchanged | Outcome::Equal | Outcome::Within | Outcome::Accepted => false,
        }
    }
}

/// One golden frame and what came of it.
#[derive(Clone, Debug)]
pub struct GoldenResult {
    /// Name of its entry.
    pub name: String,
    /// 0 where the frames of the entry are not known, since its script is wrong.
    pub frame: u32,
    /// Where its entry stands in the list.
    pub place: Place,
    pub script: PathBuf,
    pub golden: PathBuf,
    /// The new picture, where one was rendered.
    pub new: Option<PathBuf>,
    pub outcome: Outcome,
    /// What was found, a line each.
    pub lines: Vec<String>,
    /// The numbers of the comparison, if there was one.
    pub numbers: Option<serde_json::Value>,
    pub why: Vec<SceneChange>,
    /// What the golden says of its making once it is accepted.
    pub description: Option<String>,
    /// Its part of the page; only of what fails.
    pub item: Option<ReportItem>,
}

impl GoldenResult {
    /// As patterns and files name it, without the ending.
    pub fn id(&self) -> String {
        if self.frame == 0 { self.name.clone() } else { format!("{}.{:04}", self.name, self.frame) }
    }
}
