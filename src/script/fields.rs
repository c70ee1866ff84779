//! What handles check before they write: names that must be there, fields that must fit.

use ::rhai::{Dynamic, ImmutableString, Map};

use super::convert::{describe, number, to_value};
use super::elsewhere;
use super::errors::{Fallible, complain};
use super::overlay::Overlay;
use crate::base::diagnostics::suggestion;
use crate::base::limits;
use crate::components::*;

pub fn known_material(overlay: &Overlay, name: &str) -> Fallible<usize> {
    match overlay.find_material(name) {
        Some(index) => Ok(index),
        None => {
            let names = overlay.material_names();
            complain(format!("there is no material `{name}`"), suggestion(name, names.iter().map(|n| &**n)))
        }
    }
}

pub fn text(value: &Dynamic, what: &str) -> Fallible<Text> {
    match value.read_lock::<ImmutableString>() {
        Some(text) if text.len() <= limits::TEXT_BYTES => Ok(text.as_str().into()),
        _ => complain(format!("{what}: expected a text, found {}", describe(value)), None),
    }
}

pub fn checked(record: &dyn Record, owner: &str) -> Fallible<()> {
    record.check().or_else(|invalid| complain(format!("{owner}: {}", invalid.message), None))
}

/// Sets one field of a record and says what is wrong with it, if anything.
pub fn set_field(record: &mut dyn Record, field: &str, value: &Dynamic, owner: &str) -> Fallible<()> {
    let Some(value) = to_value(value) else {
        return complain(format!("`{field}` of {owner} cannot hold this"), None);
    };
    match record.set(field, &value) {
        Ok(()) => Ok(()),
        Err(FieldError::Unknown { known }) => {
            complain(format!("unknown field `{field}` of {owner}"), elsewhere::of_field(field, known.iter().copied()))
        }
        Err(FieldError::Mismatch(m)) => complain(format!("`{field}` of {owner}: {}", m.message), m.help),
    }
}

/// A number that a property is set to.
pub fn number_of(property: &str, owner: &str, value: &Dynamic) -> Fallible<f64> {
    let wrong = || complain(format!("`{property}` of {owner}: expected a number, found {}", describe(value)), None);
    number(value).or_else(|_| wrong())
}

/// The parts of a new entity without its name, components first: what is of a transform would be lost beneath a whole one.
pub fn parts_in_order(parts: &Map) -> Fallible<Vec<(&str, &Dynamic)>> {
    if let Some(whole) = parts.get("transform").and_then(|whole| whole.read_lock::<Map>()) {
        let is_angle = |key: &str| ["pitch", "yaw", "roll"].contains(&key) && whole.contains_key("rotation");
        if let Some(field) = parts.keys().find(|key| whole.contains_key(key.as_str()) || is_angle(key)) {
            let message = format!("`{field}` of a new entity is given beside `transform`, which has one too");
            return complain(message, Some("leave one of the two out".into()));
        }
    }
    let others = parts.iter().map(|(key, value)| (key.as_str(), value)).filter(|(key, _)| *key != "name");
    let (mut whole, rest): (Vec<_>, Vec<_>) = others.partition(|(key, _)| Kind::parse(key).is_some());
    whole.extend(rest);
    Ok(whole)
}

pub fn known_entity(overlay: &Overlay, name: &str) -> Fallible<()> {
    if overlay.find(name).is_some() {
        return Ok(());
    }
    unknown_entity(overlay, name)
}

pub fn unknown_entity<T>(overlay: &Overlay, name: &str) -> Fallible<T> {
    if overlay.was_removed(name) {
        return complain(format!("entity `{name}` was removed"), None);
    }
    let names = overlay.names();
    complain(format!("there is no entity `{name}`"), suggestion(name, names.iter().map(|n| &**n)))
}

pub fn known_parent(overlay: &Overlay, component: &Component) -> Fallible<()> {
    match Transform::of(component).and_then(|transform| transform.parent.as_ref()) {
        Some(parent) => known_entity(overlay, parent),
        None => Ok(()),
    }
}
