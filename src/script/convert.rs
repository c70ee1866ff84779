//! Values between Rhai and the components.

use ::rhai::{Array, Dynamic, ImmutableString, Map};
use glam::DVec3;

use super::errors::{Fallible, complain};
use crate::components::{Text, Value};

/// What a script wrote, as a value; `None` for what no field can hold.
pub fn to_value(value: &Dynamic) -> Option<Value> {
    Some(if value.is_unit() {
        Value::Unit
    } else if let Ok(b) = value.as_bool() {
        Value::Bool(b)
    } else if let Ok(i) = value.as_int() {
        Value::Int(i)
    } else if let Ok(x) = value.as_float() {
        Value::Number(x)
    } else if let Some(v) = value.clone().try_cast::<DVec3>() {
        Value::Vec3(v)
    } else if let Some(text) = value.read_lock::<ImmutableString>() {
        Value::Text(text.as_str().into())
    } else if let Some(items) = value.read_lock::<Array>() {
        Value::List(items.iter().map(to_value).collect::<Option<_>>()?)
    } else if let Some(map) = value.read_lock::<Map>() {
        let entries = map.iter().map(|(key, value)| Some((Text::from(key.as_str()), to_value(value)?)));
        Value::Map(entries.collect::<Option<_>>()?)
    } else {
        return None;
    })
}

pub fn to_dynamic(value: Value) -> Dynamic {
    match value {
        Value::Unit => Dynamic::UNIT,
        Value::Bool(b) => b.into(),
        Value::Int(i) => i.into(),
        Value::Number(x) => x.into(),
        Value::Text(text) => Dynamic::from(ImmutableString::from(&*text)),
        Value::Vec3(v) => Dynamic::from(v),
        Value::List(items) => items.into_iter().map(to_dynamic).collect::<Array>().into(),
        Value::Map(entries) => {
            entries.into_iter().map(|(key, value)| (key.as_ref().into(), to_dynamic(value))).collect::<Map>().into()
        }
    }
}

/// A number, whole or not.
pub fn number(value: &Dynamic) -> Fallible<f64> {
    match to_value(value).as_ref().and_then(Value::as_number) {
        Some(x) => Ok(x),
        None => complain(format!("expected a number, found {}", describe(value)), None),
    }
}

/// A vector, or a list of three numbers.
pub fn vector(value: &Dynamic) -> Fallible<DVec3> {
    use crate::components::FieldValue;
    match to_value(value).map(|v| DVec3::from_value(&v)) {
        Some(Ok(v)) => Ok(v),
        _ => complain(format!("expected a vector or a list of three numbers, found {}", describe(value)), None),
    }
}

pub fn is_vector(value: &Dynamic) -> bool {
    value.is::<DVec3>() || value.is_array()
}

/// A value as a message calls it.
pub fn describe(value: &Dynamic) -> String {
    to_value(value).map_or_else(|| "something that is no value".into(), |v| v.describe())
}
