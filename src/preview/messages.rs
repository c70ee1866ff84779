//! Remarks that have no place, as the page reads them.

use serde_json::{Value, json};

/// A line without a place.
pub fn note_json(severity: &str, text: &str) -> Value {
    json!({ "severity": severity, "message": text, "text": format!("{severity}: {text}") })
}
