//! Something in a scene that counts for nothing, as it is told.

use crate::base::diagnostics::{ScenePart, Subject};

/// Help for one of two settings of which the other takes the place.
pub(super) const LEAVE_OUT: &str = "leave one of the two out";

/// One thing that counts for nothing: what of the scene it is, what to say, and what to do about it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unused {
    /// Where in the scene.
    pub subject: Subject,
    /// What counts for nothing, and why.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// Another setting takes its place: in a sequence the script may have put that one there.
    pub is_hidden: bool,
}

/// A field that is idle: its name, whether it is so, why, and what to do about it.
pub(super) type IdleField = (&'static str, bool, String, &'static str);

/// The idle ones among fields of one part of a scene.
pub(super) fn idle_of(
    part: ScenePart,
    component: Option<&'static str>,
    owner: &str,
    fields: impl IntoIterator<Item = IdleField>,
) -> Vec<Unused> {
    let idle = fields.into_iter().filter(|(_, is_idle, ..)| *is_idle);
    let told = |(field, _, why, help): IdleField| Unused {
        subject: Subject { part, component, field: Some(field) },
        message: format!("{owner}: `{field}` {why}"),
        help: (!help.is_empty()).then(|| help.to_string()),
        is_hidden: help == LEAVE_OUT,
    };
    idle.map(told).collect()
}
