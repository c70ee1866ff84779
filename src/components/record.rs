//! One declaration per component: struct, defaults, serde form and access by field name.
//!
//! `record!` keeps the names of RON, Rhai and Rust the same by construction: a field exists once. `choice!` does the
//! same for settings that are one word out of a few.

use super::value::{Mismatch, Text, Value};
use crate::base::diagnostics::suggestion;

/// What a field means to those who reuse work from frame to frame; declared with the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldClass {
    /// It decides what a frame looks like, like most fields.
    General,
    /// It does not show in a picture, as the choice of an accelerator.
    Invisible,
    /// Of the camera: its lens and focus. The other fields are where it stands and what it sees.
    Lens,
    /// Of the camera: when its shutter is open, which photons depend on too.
    Shutter,
    /// A setting of the film: what becomes of light that has reached it. Photons do not depend on it.
    Film,
    /// The colour of emitted light: the picture is linear in it.
    EmittedColor,
    /// Part of data that has a digest of its own, or the name of the file that the data were read from.
    Data,
}

/// Why a field could not be read or set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FieldError {
    /// No field of that name; what the record has instead.
    Unknown {
        /// Names of all fields.
        known: &'static [&'static str],
    },
    /// A value of the wrong shape.
    Mismatch(Mismatch),
}

/// A value of the right shape that makes no sense: which field, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Invalid {
    /// Name of the field.
    pub field: &'static str,
    /// What was found, and what is allowed.
    pub message: String,
}

/// Access to a component's fields by name.
pub trait Record: Check {
    /// Field names in declared order.
    fn fields(&self) -> &'static [&'static str];
    /// The class of each field, in the order of [`Self::fields`].
    fn classes(&self) -> &'static [FieldClass];
    /// The value of a field; `None` if there is no such field.
    fn get(&self, field: &str) -> Option<Value>;
    /// Sets a field without judging ranges; call [`Check::check`] afterwards.
    ///
    /// # Errors
    /// [`FieldError`] if the field is unknown or the value has another shape.
    fn set(&mut self, field: &str, value: &Value) -> Result<(), FieldError>;
    /// Whether a field could be set, and the whole would make sense then.
    ///
    /// # Errors
    /// As [`Self::set`]; an [`Invalid`] whole as a mismatch.
    fn probe(&self, field: &str, value: &Value) -> Result<(), FieldError>;
    /// What the record is, as its documentation says.
    fn docs(&self) -> &'static str;
    /// What each field is, in the order of [`Self::fields`].
    fn field_docs(&self) -> &'static [&'static str];
}

/// A record that is the value of a field, as scripts read it: a map of its fields.
pub fn map_of(record: &dyn Record) -> Value {
    let entries = record.fields().iter().filter_map(|field| Some((Text::from(*field), record.get(field)?)));
    Value::Map(entries.collect())
}

/// Sets the fields of a record that is the value of a field, as scripts write it; `what` it is called.
///
/// # Errors
/// The value is no map, or one of its entries is no field or has another shape.
pub fn set_from_map(record: &mut dyn Record, what: &str, value: &Value) -> Result<(), Mismatch> {
    let Value::Map(entries) = value else {
        let mismatch = Mismatch::new(&format!("a map of the fields of {what}"), value);
        let mut help = None;
        if let Value::Text(file) = value
            && record.fields().contains(&"image")
        {
            help = Some(format!("write #{{ image: \"{file}\" }}"));
        }
        return Err(Mismatch { help, ..mismatch });
    };
    for (field, value) in entries {
        record.set(field, value).map_err(|error| match error {
            FieldError::Mismatch(m) => Mismatch { message: format!("`{field}`: {}", m.message), ..m },
            FieldError::Unknown { known } => Mismatch {
                message: format!("unknown field `{field}` in {what}"),
                help: suggestion(field, known.iter().copied()),
            },
        })?;
    }
    Ok(())
}

/// Sets a field of a copy.
///
/// # Errors
/// As [`Record::probe`].
pub(super) fn probe(mut copy: impl Record, field: &str, value: &Value) -> Result<(), FieldError> {
    copy.set(field, value)?;
    copy.check().map_err(|invalid| FieldError::Mismatch(Mismatch { message: invalid.message, help: None }))
}

/// Ranges of a component's fields, written by hand beside its declaration.
pub trait Check {
    /// # Errors
    /// [`Invalid`] for the first field whose value is out of its documented range.
    fn check(&self) -> Result<(), Invalid>;
}

/// Declares a component. Every field has a default, so that a scene states only what differs, and a [`FieldClass`]:
/// `General`, or the one after `=>`.
macro_rules! record {
    ($(#[doc = $doc:literal])* pub struct $name:ident {
        $( $(#[doc = $field_doc:literal])* pub $field:ident : $type:ty = $default:expr $(=> $class:ident)?, )*
    }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name { $( $(#[doc = $field_doc])* pub $field: $type, )* }

        impl Default for $name {
            fn default() -> Self {
                $name { $( $field: $default, )* }
            }
        }

        impl $name {
            /// Field names in declared order.
            pub const FIELDS: &'static [&'static str] = &[$( stringify!($field) ),*];
            /// The class of each field, in declared order.
            pub const CLASSES: &'static [$crate::components::FieldClass] =
                &[$( $crate::components::record::class!($($class)?) ),*];
        }

        impl $crate::components::Record for $name {
            fn fields(&self) -> &'static [&'static str] {
                Self::FIELDS
            }
            fn classes(&self) -> &'static [$crate::components::FieldClass] {
                Self::CLASSES
            }
            fn get(&self, field: &str) -> Option<$crate::components::Value> {
                match field {
                    $( stringify!($field) => Some($crate::components::FieldValue::to_value(&self.$field)), )*
                    _ => None,
                }
            }
            fn set(&mut self, field: &str, value: &$crate::components::Value) -> Result<(), $crate::components::FieldError> {
                use $crate::components::FieldError;
                match field {
                    $( stringify!($field) => {
                        self.$field = $crate::components::FieldValue::from_value(value).map_err(FieldError::Mismatch)?;
                        Ok(())
                    } )*
                    _ => Err(FieldError::Unknown { known: Self::FIELDS }),
                }
            }
            fn probe(&self, field: &str, value: &$crate::components::Value) -> Result<(), $crate::components::FieldError> {
                $crate::components::record::probe(self.clone(), field, value)
            }
            fn docs(&self) -> &'static str {
                concat!($($doc, "\n"),*)
            }
            fn field_docs(&self) -> &'static [&'static str] {
                &[$( concat!($($field_doc, "\n"),*) ),*]
            }
        }

        impl $crate::base::codec::Codec for $name {
            fn encode(&self, to: &mut $crate::base::codec::Encoder) {
                $( to.put(&self.$field); )*
            }
            fn decode(from: &mut $crate::base::codec::Decoder) -> Result<Self, $crate::base::codec::Malformed> {
                Ok($name { $( $field: from.get()?, )* })
            }
        }

        /// Only the fields that differ from their defaults are written.
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                use serde::ser::SerializeStruct;
                let default = Self::default();
                let count = 0 $( + usize::from(self.$field != default.$field) )*;
                let mut out = serializer.serialize_struct(stringify!($name), count)?;
                $( if self.$field != default.$field {
                    out.serialize_field(stringify!($field), &self.$field)?;
                } )*
                out.end()
            }
        }
    };
}
pub(crate) use record;

/// The class of a field as `record!` was given it.
macro_rules! class {
    () => {
        $crate::components::FieldClass::General
    };
    ($class:ident) => {
        $crate::components::FieldClass::$class
    };
}
pub(crate) use class;

/// Declares a setting that is one word out of a few.
macro_rules! choice {
    ($(#[$meta:meta])* pub enum $name:ident { $( $(#[doc = $doc:literal])* $variant:ident, )* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        pub enum $name { $( $(#[doc = $doc])* $variant, )* }

        impl $name {
            /// The words as they are written in a scene.
            pub const NAMES: &'static [&'static str] = &[$( stringify!($variant) ),*];

            /// What each of them means, in the same order.
            pub const DOCS: &'static [&'static str] = &[$( concat!($($doc, "\n"),*) ),*];

            /// The word of this choice.
            pub fn name(self) -> &'static str {
                match self { $( $name::$variant => stringify!($variant), )* }
            }

            /// The choice of a word, whatever its case.
            pub fn parse(word: &str) -> Option<Self> {
                let plain = word.replace(['_', '-'], "");
                $( if plain.eq_ignore_ascii_case(stringify!($variant)) { return Some($name::$variant); } )*
                None
            }
        }

        impl $crate::base::codec::Codec for $name {
            fn encode(&self, to: &mut $crate::base::codec::Encoder) {
                to.put(&(*self as u8));
            }
            fn decode(from: &mut $crate::base::codec::Decoder) -> Result<Self, $crate::base::codec::Malformed> {
                let all = [$( $name::$variant ),*];
                all.get(usize::from(from.get::<u8>()?)).copied().ok_or($crate::base::codec::Malformed)
            }
        }

        impl $crate::components::FieldValue for $name {
            fn to_value(&self) -> $crate::components::Value {
                $crate::components::Value::Text(self.name().into())
            }
            fn from_value(value: &$crate::components::Value) -> Result<Self, $crate::components::Mismatch> {
                use $crate::components::{Mismatch, Value};
                let Value::Text(word) = value else {
                    return Err(Mismatch::new(&format!("one of {}", Self::NAMES.join(", ")), value));
                };
                Self::parse(word).ok_or_else(|| Mismatch {
                    help: $crate::base::diagnostics::suggestion(word, Self::NAMES.iter().copied()),
                    ..Mismatch::new(&format!("one of {}", Self::NAMES.join(", ")), value)
                })
            }
        }
    };
}
pub(crate) use choice;

/// Range checks that say what is allowed.
pub mod ranges {
    use super::Invalid;
    use glam::DVec3;

    fn fail(field: &'static str, message: String) -> Result<(), Invalid> {
        Err(Invalid { field, message })
    }

    /// Not infinite and not NaN.
    pub fn finite(field: &'static str, x: f64) -> Result<(), Invalid> {
        if x.is_finite() { Ok(()) } else { fail(field, format!("`{field}` must be a finite number, not {x}")) }
    }

    /// The largest coordinate: its square, and the square of a square, must stay inside `f32` in the kernel.
    pub const FARTHEST: f64 = 1e9;

    /// Within +-[`FARTHEST`].
    pub fn coordinate(field: &'static str, x: f64) -> Result<(), Invalid> {
        finite(field, x)?;
        if x.abs() <= FARTHEST {
            Ok(())
        } else {
            fail(field, format!("`{field}` must lie within +-{FARTHEST:e}, not {x}"))
        }
    }

    /// Coordinates all three.
    pub fn position(field: &'static str, v: DVec3) -> Result<(), Invalid> {
        v.to_array().into_iter().try_for_each(|x| coordinate(field, x))
    }

    /// A position other than zero.
    pub fn direction(field: &'static str, v: DVec3) -> Result<(), Invalid> {
        position(field, v)?;
        if v == DVec3::ZERO { fail(field, format!("`{field}` must not be the zero vector")) } else { Ok(()) }
    }

    /// A coordinate from `low` up.
    pub fn at_least(field: &'static str, x: f64, low: f64) -> Result<(), Invalid> {
        coordinate(field, x)?;
        if x >= low { Ok(()) } else { fail(field, format!("`{field}` must be at least {low}, not {x}")) }
    }

    /// A coordinate above `low`.
    pub fn above(field: &'static str, x: f64, low: f64) -> Result<(), Invalid> {
        coordinate(field, x)?;
        if x > low { Ok(()) } else { fail(field, format!("`{field}` must be greater than {low}, not {x}")) }
    }

    /// From `low` to `high`, both included.
    pub fn between(field: &'static str, x: f64, low: f64, high: f64) -> Result<(), Invalid> {
        finite(field, x)?;
        if (low..=high).contains(&x) {
            Ok(())
        } else {
            fail(field, format!("`{field}` must be from {low} to {high}, not {x}"))
        }
    }

    /// As [`between`], of whole numbers.
    pub fn whole(field: &'static str, x: u64, low: u64, high: u64) -> Result<(), Invalid> {
        if (low..=high).contains(&x) {
            Ok(())
        } else {
            fail(field, format!("`{field}` must be a whole number from {low} to {high}, not {x}"))
        }
    }

    /// Channels from 0 up.
    pub fn color(field: &'static str, v: DVec3) -> Result<(), Invalid> {
        v.to_array().into_iter().try_for_each(|x| at_least(field, x, 0.0))
    }
}
