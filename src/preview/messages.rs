//! Mistakes, warnings and remarks as the page reads them.

use serde_json::{Value, json};

use crate::base::diagnostics::{Diagnostic, Severity};

/// A mistake or warning for the page.
pub fn diagnostic_json(one: &Diagnostic) -> Value {
    let severity = match one.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    };
    let place = one.place.as_ref();
    json!({
        "severity": severity,
        "message": one.message,
        "help": one.help,
        "file": place.map(|place| &*place.file),
        "line": place.map(|place| place.line),
        "column": place.map(|place| place.column),
        "width": place.map(|place| place.width),
        "source": place.map(|place| place.source.as_str()),
        "text": one.to_string(),
    })
}

/// A line without a place.
pub fn note_json(severity: &str, text: &str) -> Value {
    json!({ "severity": severity, "message": text, "text": format!("{severity}: {text}") })
}
