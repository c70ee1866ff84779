//! What a field can hold while it travels between RON, Rhai and the component structs.

use std::fmt;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};

/// Shared text: names are repeated on many entities.
pub type Text = Arc<str>;

/// A field's value, free of the component that it came from.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// No value: an optional field that is not set.
    Unit,
    /// True or false.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Number(f64),
    /// A text, or one word out of a few.
    Text(Text),
    /// A vector, point or colour.
    Vec3(DVec3),
    /// Values in order.
    List(Vec<Value>),
    /// Fields of a nested record, by name.
    Map(Vec<(Text, Value)>),
}

impl Value {
    /// The value as a person would name it in an error message.
    pub fn describe(&self) -> String {
        match self {
            Value::Unit => "nothing".into(),
            Value::Bool(b) => format!("`{b}`"),
            Value::Int(i) => format!("the number {i}"),
            Value::Number(x) => format!("the number {x}"),
            Value::Text(t) => format!("the text \"{t}\""),
            Value::Vec3(v) => format!("the vector ({}, {}, {})", v.x, v.y, v.z),
            Value::List(items) => format!("a list of {}", items.len()),
            Value::Map(_) => "a map".into(),
        }
    }

    /// The value as programs read it: three numbers are a list, nothing is null.
    pub fn to_json(&self) -> serde_json::Value {
        use serde_json::json;
        match self {
            Value::Unit => serde_json::Value::Null,
            Value::Bool(b) => json!(b),
            Value::Int(i) => json!(i),
            Value::Number(x) => json!(x),
            Value::Text(text) => json!(&**text),
            Value::Vec3(v) => json!([v.x, v.y, v.z]),
            Value::List(items) => serde_json::Value::Array(items.iter().map(Value::to_json).collect()),
            Value::Map(entries) => {
                let entries = entries.iter().map(|(key, value)| (key.to_string(), value.to_json()));
                serde_json::Value::Object(entries.collect())
            }
        }
    }

    /// As [`Self::to_json`], back; numbers without a fraction are whole, and three numbers a list, which fields take too.
    pub fn from_json(json: &serde_json::Value) -> Value {
        match json {
            serde_json::Value::Null => Value::Unit,
            serde_json::Value::Bool(b) => Value::Bool(*b),
            serde_json::Value::Number(x) => x.as_i64().map_or(Value::Number(x.as_f64().unwrap_or(0.0)), Value::Int),
            serde_json::Value::String(text) => Value::Text(text.as_str().into()),
            serde_json::Value::Array(items) => Value::List(items.iter().map(Value::from_json).collect()),
            serde_json::Value::Object(entries) => {
                Value::Map(entries.iter().map(|(key, value)| (key.as_str().into(), Value::from_json(value))).collect())
            }
        }
    }

    /// The value as a number, integers included.
    pub fn as_number(&self) -> Option<f64> {
        match self {
            Value::Int(i) => Some(*i as f64),
            Value::Number(x) => Some(*x),
            Value::Unit | Value::Bool(_) | Value::Text(_) | Value::Vec3(_) | Value::List(_) | Value::Map(_) => None,
        }
    }
}

/// The value on one line without spaces, but for those in texts: `[1,2,3]`, `"a b"`, `{a=1}`; texts of one word stand
/// without quotes.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Unit => f.write_str("none"),
            Value::Bool(b) => write!(f, "{b}"),
            Value::Int(i) => write!(f, "{i}"),
            Value::Number(x) => write!(f, "{x}"),
            Value::Text(t) if t.chars().all(|c| c.is_alphanumeric() || "_-./".contains(c)) => f.write_str(t),
            Value::Text(t) => write!(f, "{t:?}"),
            Value::Vec3(v) => write!(f, "[{},{},{}]", v.x, v.y, v.z),
            Value::List(items) => {
                let items: Vec<String> = items.iter().map(Value::to_string).collect();
                write!(f, "[{}]", items.join(","))
            }
            Value::Map(entries) => {
                let entries: Vec<String> = entries.iter().map(|(key, value)| format!("{key}={value}")).collect();
                write!(f, "{{{}}}", entries.join(","))
            }
        }
    }
}

/// A value of the wrong shape: what was expected, what was found, and perhaps the nearest right word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// What was expected, and what was found.
    pub message: String,
    /// The nearest right word.
    pub help: Option<String>,
}

impl Mismatch {
    /// For a value that is not what was expected.
    pub fn new(expected: &str, found: &Value) -> Self {
        Mismatch { message: format!("expected {expected}, found {}", found.describe()), help: None }
    }
}

/// A type that a component field may have.
pub trait FieldValue: Sized {
    /// The value, free of its type.
    fn to_value(&self) -> Value;
    /// # Errors
    /// [`Mismatch`] if the value has another shape; ranges are checked by the component, not here.
    fn from_value(value: &Value) -> Result<Self, Mismatch>;
}

impl FieldValue for bool {
    fn to_value(&self) -> Value {
        Value::Bool(*self)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        if let Value::Bool(b) = value { Ok(*b) } else { Err(Mismatch::new("true or false", value)) }
    }
}

impl FieldValue for f64 {
    fn to_value(&self) -> Value {
        Value::Number(*self)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        value.as_number().ok_or_else(|| Mismatch::new("a number", value))
    }
}

macro_rules! whole_number {
    ($($type:ty),*) => { $(
        impl FieldValue for $type {
            fn to_value(&self) -> Value {
                i64::try_from(*self).map_or(Value::Number(*self as f64), Value::Int)
            }
            fn from_value(value: &Value) -> Result<Self, Mismatch> {
                let whole = match value {
                    Value::Int(i) => <$type>::try_from(*i).ok(),
                    Value::Number(x) if *x == x.trunc() && *x >= 0.0 && *x < 9e15 => <$type>::try_from(*x as i64).ok(),
                    _ => None,
                };
                whole.ok_or_else(|| Mismatch::new("a whole number from 0", value))
            }
        }
    )* };
}
whole_number!(u32, u64);

impl FieldValue for Text {
    fn to_value(&self) -> Value {
        Value::Text(self.clone())
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        if let Value::Text(text) = value { Ok(text.clone()) } else { Err(Mismatch::new("a text", value)) }
    }
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let Value::List(items) = value else { return None };
    let mut out = [0.0; N];
    if items.len() != N {
        return None;
    }
    for (slot, item) in out.iter_mut().zip(items) {
        *slot = item.as_number()?;
    }
    Some(out)
}

impl FieldValue for DVec3 {
    fn to_value(&self) -> Value {
        Value::Vec3(*self)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let vector = if let Value::Vec3(v) = value { Some(*v) } else { numbers(value).map(DVec3::from_array) };
        vector.ok_or_else(|| Mismatch::new("three numbers", value))
    }
}

impl FieldValue for Vec3 {
    fn to_value(&self) -> Value {
        Value::Vec3(self.as_dvec3())
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        DVec3::from_value(value).map(|v| v.as_vec3())
    }
}

impl FieldValue for DVec2 {
    fn to_value(&self) -> Value {
        Value::List(vec![Value::Number(self.x), Value::Number(self.y)])
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        numbers(value).map(DVec2::from_array).ok_or_else(|| Mismatch::new("two numbers", value))
    }
}

impl FieldValue for Vec2 {
    fn to_value(&self) -> Value {
        self.as_dvec2().to_value()
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        DVec2::from_value(value).map(|v| v.as_vec2())
    }
}

/// Red, green, blue, and alpha, which is 1 if it is not given.
impl FieldValue for Vec4 {
    fn to_value(&self) -> Value {
        Value::List(self.to_array().map(|x| Value::Number(x.into())).to_vec())
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let opaque = DVec3::from_value(value).ok().map(|v| v.as_vec3().extend(1.0));
        let all = || numbers::<4>(value).map(|rgba| Vec4::from_array(rgba.map(|x| x as f32)));
        opaque.or_else(all).ok_or_else(|| Mismatch::new("three or four numbers", value))
    }
}

impl<T: FieldValue, const N: usize> FieldValue for [T; N] {
    fn to_value(&self) -> Value {
        Value::List(self.iter().map(T::to_value).collect())
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let wrong = || Mismatch::new(&format!("a list of {N}"), value);
        let Value::List(items) = value else { return Err(wrong()) };
        let parts = items.iter().map(T::from_value).collect::<Result<Vec<T>, _>>()?;
        parts.try_into().map_err(|_| wrong())
    }
}

impl<T: FieldValue> FieldValue for Vec<T> {
    fn to_value(&self) -> Value {
        Value::List(self.iter().map(T::to_value).collect())
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let Value::List(items) = value else { return Err(Mismatch::new("a list", value)) };
        items.iter().map(T::from_value).collect()
    }
}

impl<T: FieldValue> FieldValue for Box<T> {
    fn to_value(&self) -> Value {
        T::to_value(self)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        T::from_value(value).map(Box::new)
    }
}

impl<T: FieldValue> FieldValue for Option<T> {
    fn to_value(&self) -> Value {
        self.as_ref().map_or(Value::Unit, T::to_value)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        if *value == Value::Unit { Ok(None) } else { T::from_value(value).map(Some) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_coerce_where_a_number_is_meant() {
        assert_eq!(f64::from_value(&Value::Int(3)), Ok(3.0));
        assert_eq!(u32::from_value(&Value::Number(4.0)), Ok(4));
        assert!(u32::from_value(&Value::Number(4.5)).is_err());
        assert!(u32::from_value(&Value::Int(-1)).is_err());
        let list = Value::List(vec![Value::Int(1), Value::Number(2.5), Value::Int(-3)]);
        assert_eq!(DVec3::from_value(&list), Ok(DVec3::new(1.0, 2.5, -3.0)));
    }

    #[test]
    fn a_mismatch_says_both_sides() {
        let error = DVec3::from_value(&Value::Text("red".into())).unwrap_err();
        assert_eq!(error.message, "expected three numbers, found the text \"red\"");
    }

    #[test]
    fn values_come_back() {
        let normals = Some(Box::new([DVec3::X, DVec3::Y, DVec3::Z]));
        assert_eq!(Option::<Box<[DVec3; 3]>>::from_value(&normals.to_value()), Ok(normals));
        assert_eq!(Option::<f64>::from_value(&Value::Unit), Ok(None));
        assert_eq!(u64::from_value(&(1u64 << 40).to_value()), Ok(1 << 40));
    }
}
