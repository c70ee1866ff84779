//! Records as digests: what two frames, or two runs, are compared by.
//!
//! A record is hashed field by field through [`Record`], so that a field that is added later is covered when it is
//! declared. Values go in as the bits they are, not as text: reformatting a scene changes nothing.

use super::{Component, FieldClass, Record, Value};
use crate::base::digest::Hasher;

impl Value {
    /// Feeds the value to a hasher, with its kind before it.
    pub fn feed(&self, hasher: &mut Hasher) {
        let kind = |hasher: &mut Hasher, kind: u8| hasher.bytes(&[kind]);
        match self {
            Value::Unit => kind(hasher, 0),
            Value::Bool(b) => hasher.bytes(&[1, u8::from(*b)]),
            Value::Int(i) => {
                kind(hasher, 2);
                hasher.word(*i as u64);
            }
            Value::Number(x) => {
                kind(hasher, 3);
                hasher.number(*x);
            }
            Value::Text(text) => {
                kind(hasher, 4);
                hasher.text(text);
            }
            Value::Vec3(v) => {
                kind(hasher, 5);
                v.to_array().into_iter().for_each(|x| hasher.number(x));
            }
            Value::List(items) => {
                kind(hasher, 6);
                hasher.word(items.len() as u64);
                items.iter().for_each(|item| item.feed(hasher));
            }
            Value::Map(entries) => {
                kind(hasher, 7);
                hasher.word(entries.len() as u64);
                for (key, value) in entries {
                    hasher.text(key);
                    value.feed(hasher);
                }
            }
        }
    }
}

/// Feeds the fields of a record that `wanted` chooses by name and class, each with its name; `visit` sees every value on
/// its way.
pub fn feed_record(
    record: &dyn Record,
    wanted: impl Fn(&str, FieldClass) -> bool,
    hasher: &mut Hasher,
    visit: &mut dyn FnMut(&Value, &mut Hasher),
) {
    let fields = record.fields().iter().zip(record.classes());
    for (field, _) in fields.filter(|(field, class)| wanted(field, **class)) {
        if let Some(value) = record.get(field) {
            hasher.text(field);
            value.feed(hasher);
            visit(&value, hasher);
        }
    }
}

/// Feeds a component field by field; a mesh by what it is made of, wherever that was read from.
pub fn feed_component(
    component: &Component,
    wanted: impl Fn(FieldClass) -> bool,
    hasher: &mut Hasher,
    visit: &mut dyn FnMut(&Value, &mut Hasher),
) {
    hasher.text(component.kind().name());
    feed_record(component.record(), |_, class| class != FieldClass::Data && wanted(class), hasher, visit);
    if let Some(data) = component.data_digest() {
        hasher.digest(data);
    }
}
