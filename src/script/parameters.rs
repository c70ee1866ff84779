//! Parameters: what a script lets its user set with `-D`, each declared where it is read.

use std::fmt;

use ::rhai::{Array, Dynamic, Map};
use glam::DVec3;

use super::context::ScriptContext;
use super::convert::{describe, number, to_dynamic, to_value, vector};
use super::errors::{Fallible, complain};
use super::options::CallOptions;
use super::table::{Chapter, Function};
use crate::base::codec::{Codec, Decoder, Encoder, Malformed};
use crate::base::color::from_hex;
use crate::base::diagnostics::suggestion;
use crate::components::{Text, Value};

/// What values a parameter takes.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterKind {
    /// A number.
    Number(ParameterRange),
    /// A whole number.
    Whole(ParameterRange),
    /// `true` or `false`.
    Switch,
    /// One of these texts.
    Choice(Vec<Text>),
    /// Three numbers from 0, linear light.
    Color,
    /// Three numbers of any meaning.
    Vector,
    /// Any text.
    Text,
}

/// The range of a number, as far as it is given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ParameterRange {
    pub min: Option<f64>,
    pub max: Option<f64>,
    /// The step of a slider; values between are taken, too.
    pub step: Option<f64>,
}

/// One declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// What `-D` and `param` call it.
    pub name: Text,
    /// What values it takes.
    pub kind: ParameterKind,
    /// Its value unless `-D` gives another.
    pub default: Value,
    /// What a person reads beside it.
    pub label: Option<Text>,
}

impl ParameterKind {
    /// The kind as JSON and messages call it.
    pub fn word(&self) -> &'static str {
        match self {
            ParameterKind::Number(_) => "number",
            ParameterKind::Whole(_) => "whole",
            ParameterKind::Switch => "switch",
            ParameterKind::Choice(_) => "choice",
            ParameterKind::Color => "color",
            ParameterKind::Vector => "vector",
            ParameterKind::Text => "text",
        }
    }
}

/// What is allowed, in words: "a number from 0 to 1".
impl fmt::Display for ParameterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = |f: &mut fmt::Formatter<'_>, range: &ParameterRange| match (range.min, range.max) {
            (Some(min), Some(max)) => write!(f, " from {min} to {max}"),
            (Some(min), None) => write!(f, " from {min}"),
            (None, Some(max)) => write!(f, " up to {max}"),
            (None, None) => Ok(()),
        };
        match self {
            ParameterKind::Number(limits) => f.write_str("a number").and_then(|()| range(f, limits)),
            ParameterKind::Whole(limits) => f.write_str("a whole number").and_then(|()| range(f, limits)),
            ParameterKind::Switch => f.write_str("true or false"),
            ParameterKind::Choice(words) => write!(f, "one of {}", words.join(", ")),
            ParameterKind::Color => f.write_str("a colour, as in 1,0.5,0 or #ff8800"),
            ParameterKind::Vector => f.write_str("three numbers, as in 0,1.5,2"),
            ParameterKind::Text => f.write_str("a text"),
        }
    }
}

impl Parameter {
    /// The declaration in words, as an error message shows it.
    pub fn describe(&self) -> String {
        format!("{} with the default {}", self.kind, shown(&self.default))
    }

    /// One line of a list for people.
    pub fn line(&self) -> String {
        let step = match &self.kind {
            ParameterKind::Number(ParameterRange { step: Some(step), .. })
            | ParameterKind::Whole(ParameterRange { step: Some(step), .. }) => {
                format!(" in steps of {step}")
            }
            _ => String::new(),
        };
        let label = self.label.as_ref().map_or(String::new(), |label| format!("   {label}"));
        format!("{} = {}   {}{step}{label}", self.name, shown(&self.default), self.kind)
    }

    /// Declares a parameter from what `param` was called with.
    fn declare(name: &str, default: &Dynamic, options: &Map) -> Fallible<Parameter> {
        let known = ["kind", "min", "max", "step", "label", "choices"];
        let options = CallOptions::new("param", options, &known)?;
        let kind = kind_of(&options, default)?;
        let text = |value: &Dynamic| value.clone().into_immutable_string().map(|text| Text::from(text.as_str())).ok();
        let label = match options.get("label") {
            Some(value) => match text(value) {
                Some(label) => Some(label),
                None => return options.wrong("label", "a text", value),
            },
            None => None,
        };
        let default = match (&kind, to_value(default)) {
            (ParameterKind::Number(_), Some(value)) => value.as_number().map(Value::Number),
            (ParameterKind::Color | ParameterKind::Vector, Some(_)) => vector(default).ok().map(Value::Vec3),
            (_, value) => value,
        };
        let Some(default) = default else { return complain(format!("param(\"{name}\"): this is no default"), None) };
        let parameter = Parameter { name: name.into(), kind, default, label };
        match parameter.allows(&parameter.default) {
            true => Ok(parameter),
            false => complain(
                format!("param(\"{name}\"): the default {} is not {}", shown(&parameter.default), parameter.kind),
                None,
            ),
        }
    }

    fn allows(&self, value: &Value) -> bool {
        let within = |x: f64, range: &ParameterRange| {
            x.is_finite() && range.min.is_none_or(|min| x >= min) && range.max.is_none_or(|max| x <= max)
        };
        match (&self.kind, value) {
            (ParameterKind::Number(range), value) => value.as_number().is_some_and(|x| within(x, range)),
            (ParameterKind::Whole(range), Value::Int(x)) => within(*x as f64, range),
            (ParameterKind::Switch, Value::Bool(_)) | (ParameterKind::Text, Value::Text(_)) => true,
            (ParameterKind::Choice(words), Value::Text(word)) => words.contains(word),
            (ParameterKind::Color, Value::Vec3(v)) => v.is_finite() && v.min_element() >= 0.0,
            (ParameterKind::Vector, Value::Vec3(v)) => v.is_finite(),
            _ => false,
        }
    }

    /// The declaration as programs read it: `name`, `kind`, `default`, and what else was said of it.
    pub fn to_json(&self) -> serde_json::Value {
        use serde_json::json;
        let mut out = serde_json::Map::new();
        out.insert("name".into(), json!(&*self.name));
        out.insert("kind".into(), json!(self.kind.word()));
        out.insert("default".into(), self.default.to_json());
        match &self.kind {
            ParameterKind::Number(range) | ParameterKind::Whole(range) => {
                for (name, limit) in [("min", range.min), ("max", range.max), ("step", range.step)] {
                    if let Some(x) = limit {
                        let is_whole = matches!(self.kind, ParameterKind::Whole(_));
                        out.insert(name.into(), if is_whole { json!(x as i64) } else { json!(x) });
                    }
                }
            }
            ParameterKind::Choice(words) => {
                let words: Vec<&str> = words.iter().map(|word| &**word).collect();
                out.insert("choices".into(), json!(words));
            }
            ParameterKind::Switch | ParameterKind::Color | ParameterKind::Vector | ParameterKind::Text => {}
        }
        if let Some(label) = &self.label {
            out.insert("label".into(), json!(&**label));
        }
        serde_json::Value::Object(out)
    }

    /// The value that is given on the command line.
    fn parse(&self, given: &str) -> Option<Value> {
        let value = match &self.kind {
            ParameterKind::Number(_) => Value::Number(given.trim().parse().ok()?),
            ParameterKind::Whole(_) => {
                let number: f64 = given.trim().parse().ok()?;
                Value::Int((number == number.trunc() && number.abs() < 9e15).then_some(number as i64)?)
            }
            ParameterKind::Switch => Value::Bool(match given.trim() {
                "true" | "on" | "yes" | "1" => true,
                "false" | "off" | "no" | "0" => false,
                _ => return None,
            }),
            ParameterKind::Choice(words) => {
                let same = |word: &&Text| word.eq_ignore_ascii_case(given.trim());
                Value::Text(words.iter().find(|word| ***word == *given).or(words.iter().find(same))?.clone())
            }
            ParameterKind::Color | ParameterKind::Vector => Value::Vec3(hex(given).or_else(|| three(given))?),
            ParameterKind::Text => Value::Text(given.into()),
        };
        self.allows(&value).then_some(value)
    }
}

impl Codec for ParameterRange {
    fn encode(&self, to: &mut Encoder) {
        let ParameterRange { min, max, step } = self;
        to.put(min);
        to.put(max);
        to.put(step);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(ParameterRange { min: from.get()?, max: from.get()?, step: from.get()? })
    }
}

impl Codec for ParameterKind {
    fn encode(&self, to: &mut Encoder) {
        let number = |to: &mut Encoder, number: u8| to.put(&number);
        match self {
            ParameterKind::Number(range) => {
                number(to, 0);
                to.put(range);
            }
            ParameterKind::Whole(range) => {
                number(to, 1);
                to.put(range);
            }
            ParameterKind::Switch => number(to, 2),
            ParameterKind::Choice(words) => {
                number(to, 3);
                to.put(words);
            }
            ParameterKind::Color => number(to, 4),
            ParameterKind::Vector => number(to, 5),
            ParameterKind::Text => number(to, 6),
        }
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(match from.get::<u8>()? {
            0 => ParameterKind::Number(from.get()?),
            1 => ParameterKind::Whole(from.get()?),
            2 => ParameterKind::Switch,
            3 => ParameterKind::Choice(from.get()?),
            4 => ParameterKind::Color,
            5 => ParameterKind::Vector,
            6 => ParameterKind::Text,
            _ => return Err(Malformed),
        })
    }
}

impl Codec for Parameter {
    fn encode(&self, to: &mut Encoder) {
        let Parameter { name, kind, default, label } = self;
        to.put(name);
        to.put(kind);
        to.put(default);
        to.put(label);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Parameter { name: from.get()?, kind: from.get()?, default: from.get()?, label: from.get()? })
    }
}

/// Three numbers between commas or blanks, brackets around them or not.
fn three(text: &str) -> Option<DVec3> {
    let inner = text.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
    let numbers = inner.split([',', ' ']).filter(|part| !part.is_empty()).map(|part| part.parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    <[f64; 3]>::try_from(numbers).ok().map(DVec3::from_array)
}

/// A colour of the screen as linear light.
fn hex(text: &str) -> Option<DVec3> {
    from_hex(text).map(|color| DVec3::from_array(color.map(f64::from)))
}

/// A value as it may be given with `-D`.
fn shown(value: &Value) -> String {
    match value {
        Value::Bool(b) => b.to_string(),
        Value::Int(i) => i.to_string(),
        Value::Number(x) => x.to_string(),
        Value::Text(text) => text.to_string(),
        Value::Vec3(v) => format!("{},{},{}", v.x, v.y, v.z),
        other => other.describe(),
    }
}

fn kind_of(options: &CallOptions, default: &Dynamic) -> Fallible<ParameterKind> {
    let limit = |name: &str| options.get(name).map(number).transpose();
    let range = ParameterRange { min: limit("min")?, max: limit("max")?, step: limit("step")? };
    if let (Some(min), Some(max)) = (range.min, range.max)
        && min > max
    {
        return complain(format!("param: `min` {min} is above `max` {max}"), None);
    }
    if let Some(step) = range.step.filter(|step| *step <= 0.0) {
        return complain(format!("param: `step` must be above 0, not {step}"), None);
    }
    let choices = match options.get("choices") {
        None => None,
        Some(list) => Some(words(options, list)?),
    };
    let is_whole = [range.min, range.max, range.step].iter().flatten().all(|x| *x == x.trunc());
    let named = options.choice("kind", &["number", "whole", "switch", "choice", "color", "vector", "text"])?;
    let kind = match named {
        Some(0) => ParameterKind::Number(range),
        Some(1) => ParameterKind::Whole(range),
        Some(2) => ParameterKind::Switch,
        Some(3) => match choices.clone() {
            Some(words) => ParameterKind::Choice(words),
            None => return complain("param: a choice needs `choices`, a list of texts", None),
        },
        Some(4) => ParameterKind::Color,
        Some(5) => ParameterKind::Vector,
        Some(_) => ParameterKind::Text,
        None if choices.is_some() => ParameterKind::Choice(choices.clone().unwrap_or_default()),
        None if default.is_bool() => ParameterKind::Switch,
        None if default.is_int() && is_whole => ParameterKind::Whole(range),
        None if default.is_int() || default.is_float() => ParameterKind::Number(range),
        None if default.is_string() => ParameterKind::Text,
        None if vector(default).is_ok() => ParameterKind::Color,
        None => {
            let found = describe(default);
            return complain(format!("param: the default must be a number, text, bool or colour, not {found}"), None);
        }
    };
    let takes_range = matches!(kind, ParameterKind::Number(_) | ParameterKind::Whole(_));
    let has_range = range != ParameterRange::default();
    match (takes_range || !has_range, matches!(kind, ParameterKind::Choice(_)) || choices.is_none()) {
        (true, true) => Ok(kind),
        (false, _) => complain(format!("param: `min`, `max` and `step` are for numbers, and this is {kind}"), None),
        (_, false) => complain(format!("param: `choices` are for texts, and this is {kind}"), None),
    }
}

fn words(options: &CallOptions, list: &Dynamic) -> Fallible<Vec<Text>> {
    let items = list.read_lock::<Array>().filter(|items| !items.is_empty());
    let text = |item: &Dynamic| item.clone().into_immutable_string().ok().map(|text| Text::from(text.as_str()));
    match items.and_then(|items| items.iter().map(text).collect::<Option<Vec<Text>>>()) {
        Some(words) => Ok(words),
        None => options.wrong("choices", "a list of texts", list),
    }
}

/// The value given by `-D`, read as the declaration says; the default if none is given.
fn param(name: &str, default: &Dynamic, options: &Map) -> Fallible<Dynamic> {
    let shared = ScriptContext::current("param")?;
    let parameter = Parameter::declare(name, default, options)?;
    shared.declare(&parameter)?;
    let Some((_, given)) = shared.defines.iter().rev().find(|(known, _)| known == name) else {
        return Ok(to_dynamic(parameter.default));
    };
    match parameter.parse(given) {
        Some(value) => Ok(to_dynamic(value)),
        None => {
            let help = match &parameter.kind {
                ParameterKind::Choice(words) => suggestion(given, words.iter().map(|word| &**word)),
                _ => None,
            };
            complain(format!("-D {name}={given}: expected {}", parameter.kind), help)
        }
    }
}

pub const CHAPTER: Chapter = Chapter {
    title: "Parameters",
    functions: &[Function {
        name: "param",
        forms: &["param(name, default) -> value", "param(name, default, options) -> value"],
        text: "A value that the user may set with `-D name=value`. Values outside of what is declared are refused, with the \
               range; `anim check --params` lists all parameters of a script.",
        arguments: &[
            ("name", "a text; each name is declared once, or always alike"),
            (
                "default",
                "what it is without `-D`: a number, a whole number, true or false, a text, or three numbers, which are a \
                 colour in linear light. `-D` takes a colour as 1,0.5,0 or as #ff8800, which is what the screen shows",
            ),
            (
                "options",
                "a map: `min`, `max` (the range of a number, both included), `step` (of a slider), `label` (what it is, for \
                 people), `choices` (a list of texts, one of which it is), `kind` (\"number\", \"whole\", \"switch\", \
                 \"choice\", \"color\", \"vector\" or \"text\"; follows from the default if left out)",
            ),
        ],
        example: "param(\"aperture\", 0.2, #{ min: 0, max: 1, step: 0.01, label: \"Lens opening\" })   // 0.2\n\
                  param(\"lens\", \"Disk\", #{ choices: [\"Disk\", \"Square\"] })                      // \"Disk\"\n\
                  param(\"tint\", [1, 0.5, 0])                                                  // vec3(1, 0.5, 0)",
        register: |engine| {
            engine
                .register_fn("param", |name: &str, default: Dynamic| param(name, &default, &Map::new()))
                .register_fn("param", |name: &str, default: Dynamic, options: Map| param(name, &default, &options));
        },
    }],
};

#[cfg(test)]
mod tests {
    use super::*;

    fn declared(default: impl Into<Dynamic>, options: &[(&str, Dynamic)]) -> Fallible<Parameter> {
        let options = options.iter().map(|(name, value)| ((*name).into(), value.clone())).collect();
        Parameter::declare("p", &default.into(), &options)
    }

    #[test]
    fn kinds_follow_from_defaults() {
        let word = |default: Dynamic| declared(default, &[]).unwrap().kind.word();
        assert_eq!(word(1.into()), "whole");
        assert_eq!(word(1.5.into()), "number");
        assert_eq!(word(true.into()), "switch");
        assert_eq!(word("x".into()), "text");
        assert_eq!(word(vec![Dynamic::from(1_i64), 0.into(), 0.into()].into()), "color");
        assert_eq!(declared(0, &[("max", 0.5.into())]).unwrap().kind.word(), "number");
        assert!(declared((), &[]).is_err());
    }

    #[test]
    fn values_outside_of_the_range_are_refused() {
        let number = declared(0.5, &[("min", 0.into()), ("max", 1.into())]).unwrap();
        assert_eq!(number.parse("1"), Some(Value::Number(1.0)));
        for wrong in ["1.1", "-0.1", "NaN", "inf", "x", ""] {
            assert_eq!(number.parse(wrong), None, "{wrong}");
        }
        assert_eq!(number.kind.to_string(), "a number from 0 to 1");
        let whole = declared(3, &[("min", 1.into())]).unwrap();
        assert_eq!((whole.parse("4"), whole.parse("4.5"), whole.parse("0")), (Some(Value::Int(4)), None, None));
        let words: Array = vec!["Disk".into(), "Square".into()];
        let choice = declared("Disk", &[("choices", words.into())]).unwrap();
        assert_eq!(choice.parse("square"), Some(Value::Text("Square".into())));
        assert_eq!(choice.parse("Round"), None);
    }

    #[test]
    fn colours_are_numbers_or_what_the_screen_shows() {
        let color = declared(vec![Dynamic::from(1.0), 1.0.into(), 1.0.into()], &[]).unwrap();
        assert_eq!(color.parse("0.5, 0.25,0"), Some(Value::Vec3(DVec3::new(0.5, 0.25, 0.0))));
        let Some(Value::Vec3(orange)) = color.parse("#ff8000") else { panic!() };
        assert!((orange - DVec3::new(1.0, 0.2158605, 0.0)).length() < 1e-6, "{orange}");
        assert!(color.parse("#ff80").is_none() && color.parse("-1,0,0").is_none() && color.parse("#äöü").is_none());
    }

    #[test]
    fn impossible_declarations_are_refused() {
        assert!(declared(2.0, &[("max", 1.into())]).is_err());
        assert!(declared(2.0, &[("min", 3.into()), ("max", 1.into())]).is_err());
        assert!(declared("x", &[("min", 3.into())]).is_err());
        assert!(declared("x", &[("kind", "choice".into())]).is_err());
        assert!(declared(1.0, &[("stepp", 3.into())]).is_err());
    }
}
