//! The words of one script and of the API: what a mistake is held against.

use std::collections::BTreeSet;

use ::rhai::Engine;

use super::closures;
use super::table::{self, Function};
use super::words::{Words, keyword, plain_name, plain_type};
use crate::base::diagnostics::{did_you_mean, nearest};
use crate::base::synonyms::by_meaning;
use crate::components::Material;

/// What a script can name.
#[derive(Clone, Debug, Default)]
pub struct Vocabulary {
    /// Functions of the API and of Rhai.
    functions: BTreeSet<String>,
    /// Functions of the script: name and arguments.
    own: Vec<(String, Vec<String>)>,
    /// Words that stand in the script.
    words: BTreeSet<String>,
    /// Names that the script, or the one that imports it, gives to something.
    pub declared: BTreeSet<String>,
}

/// Functions of Rhai that are its own business: operators, getters and what stands behind them.
fn is_callable(name: &str) -> bool {
    name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && !name.contains('$')
        && !name.starts_with("anim_")
}

impl Vocabulary {
    /// The functions that an engine has.
    pub fn of(engine: &Engine) -> Self {
        let names = engine.collect_fn_metadata(None, |info| Some(info.metadata.name.to_string()), true);
        let functions =
            names.into_iter().filter(|name| is_callable(name)).chain(["print", "debug"].map(str::to_string));
        Vocabulary { functions: functions.collect(), ..Vocabulary::default() }
    }

    /// Adds the words of a script or module, and its functions.
    pub fn read(&mut self, text: &str) {
        let words = text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| word.len() > 1);
        self.words.extend(words.map(str::to_string));
        for tail in text.split("fn ").skip(1) {
            let Some((name, rest)) = tail.split_once('(') else { continue };
            let arguments = rest.split(')').next().unwrap_or("");
            let arguments = arguments.split(',').map(|one| one.trim().to_string()).filter(|one| !one.is_empty());
            // A method is written with its type before it.
            let name = name.rsplit('.').next().unwrap_or(name);
            self.own.push((name.trim().to_string(), arguments.collect()));
        }
    }

    /// Whether there is a function of a name, whatever it takes.
    pub fn has_function(&self, name: &str) -> bool {
        self.functions.contains(name) || self.own.iter().any(|(own, _)| own == name)
    }

    fn own_function(&self, name: &str) -> Option<&(String, Vec<String>)> {
        self.own.iter().find(|(own, _)| own == name)
    }

    /// A function that there is not, or that does not take what it is given: `signature` as the engine writes it.
    pub fn unknown_function(&self, signature: &str) -> Words {
        let (name, arguments) = signature.split_once(" (").unwrap_or((signature, ")"));
        let arguments = arguments.strip_suffix(')').unwrap_or(arguments);
        let arguments: Vec<String> = match arguments {
            "" => Vec::new(),
            list => list.split(", ").map(plain_type).collect(),
        };
        if closures::is_closure(name) {
            let message = format!("a closure is called with {}, which it does not take", count(arguments.len()));
            return (message, Some("it is called with what stands between its bars: |a, b| takes two".into()));
        }
        let name = plain_name(name);
        if !name.starts_with(|c: char| c.is_alphabetic()) {
            return operator(name, &arguments);
        }
        if let Some((_, expected)) = self.own_function(name) {
            let message = format!("`{name}` takes {}, not {}", count(expected.len()), count(arguments.len()));
            return (message, Some(format!("it is called as {name}({})", expected.join(", "))));
        }
        if !self.functions.contains(name) {
            return self.no_function(name, &arguments);
        }
        let forms: Vec<&str> = forms(name);
        let message = format!("`{name}` does not take ({})", arguments.join(", "));
        let help = match forms.is_empty() {
            false => Some(format!("it is called as {}", forms.join(" or "))),
            // A function of lists or texts, most likely, and the word for another thing here.
            true => did_you_mean(name, &methods(arguments.first().map_or("", String::as_str))),
        };
        (message, help)
    }

    fn no_function(&self, name: &str, arguments: &[String]) -> Words {
        let receiver = arguments.first().map_or("", String::as_str);
        if properties(receiver).contains(&name) {
            let help = format!("`{name}` is a property: leave the brackets out");
            return (format!("a {receiver} has no function `{name}`"), Some(help));
        }
        (format!("there is no function `{name}`"), self.nearest_function(name))
    }

    /// The function that is meant by a name that there is not.
    pub fn nearest_function(&self, name: &str) -> Option<String> {
        if table::functions().any(|function| function.name == name) {
            return Some(format!("`{name}` is a property: leave the brackets out"));
        }
        // Ours before those of the engine, which a script rarely wants.
        let ours: Vec<&str> = self
            .own
            .iter()
            .map(|(own, _)| own.as_str())
            .chain(table::functions().map(|function| function.name))
            .collect();
        let all: Vec<&str> = self.functions.iter().map(String::as_str).collect();
        did_you_mean(name, &ours).or_else(|| did_you_mean(name, &all)).or_else(|| keyword(name))
    }

    pub fn unknown_variable(&self, name: &str) -> Words {
        let message = format!("there is no variable `{name}`");
        if let Some(help) = stands_for(name) {
            return (message, Some(help.into()));
        }
        let others: Vec<&str> = self.words.iter().map(String::as_str).filter(|word| *word != name).collect();
        if self.has_function(name) {
            let call = forms(name).first().map_or(format!("{name}(...)"), |form| form.to_string());
            return (message, Some(format!("`{name}` is a function: {call}")));
        }
        let help = did_you_mean(name, &others).or_else(|| keyword(name));
        (message, help.or_else(|| Some(format!("name it first: let {name} = ...;"))))
    }

    /// A property that a value does not have: `text` as the engine says it.
    pub fn unknown_property(&self, text: &str) -> Words {
        let mut quoted = text.split('\'').skip(1).step_by(2);
        let (name, kind) = (quoted.next().unwrap_or_default(), plain_type(quoted.next().unwrap_or_default()));
        let known = properties(&kind);
        if known.contains(&name) {
            return (format!("`{name}` of a {kind} cannot be written"), None);
        }
        let message = format!("a {kind} has no `{name}`");
        if let Some(form) = forms(name).into_iter().find(|form| form.contains('(')) {
            return (message, Some(format!("`{name}` is a function: {form}")));
        }
        (message, crate::base::diagnostics::suggestion(name, known))
    }
}

/// The field of materials that is meant by a word, if one is.
pub fn field_of_material(word: &str) -> Option<&'static str> {
    let slip = nearest(word, Material::FIELDS.iter().copied());
    by_meaning(word, Material::FIELDS).map(|(field, _)| field).or(slip)
}

fn count(arguments: usize) -> String {
    match arguments {
        0 => "no arguments".into(),
        1 => "1 argument".into(),
        n => format!("{n} arguments"),
    }
}

/// An operator between what it does not work on.
fn operator(symbol: &str, arguments: &[String]) -> Words {
    match arguments {
        [a, b] => {
            let help = match (symbol, a.as_str(), b.as_str()) {
                (_, "nothing", _) | (_, _, "nothing") => Some("one of them is (): is a name or a property missing?"),
                ("+", ..) => Some("texts are joined as in `a ${b}`"),
                (_, "list", _) | (_, _, "list") => Some("three numbers are a vector: vec3(x, y, z)"),
                ("==" | "!=", ..) => None,
                _ => None,
            };
            (format!("`{symbol}` does not work between a {a} and a {b}"), help.map(str::to_string))
        }
        [a] => (format!("`{symbol}` does not work on a {a}"), None),
        _ => (format!("`{symbol}` does not work here"), None),
    }
}

/// How a function of the API is called.
fn forms(name: &str) -> Vec<&'static str> {
    let call = |form: &'static str| form.split(" ->").next().unwrap_or(form);
    table::functions()
        .filter(|function| function.name == name)
        .flat_map(|function| function.forms)
        .map(|f| call(f))
        .collect()
}

/// Properties of a value of some kind, as far as the table has them.
fn properties(kind: &str) -> Vec<&'static str> {
    let receiver = match kind {
        "frame" => "f.",
        "scene" => "s.",
        "vector" => return vec!["x", "y", "z"],
        "path" => return vec!["length"],
        _ => return Vec::new(),
    };
    let is_property =
        |function: &&Function| function.forms.iter().any(|form| form.starts_with(receiver) && !form.contains('('));
    table::functions().filter(is_property).map(|function| function.name).collect()
}

/// Functions that are called on a value of some kind.
fn methods(kind: &str) -> Vec<&'static str> {
    let receiver = match kind {
        "frame" => "f.",
        "scene" => "s.",
        "generator" => "rng.",
        "vector" => "v.",
        _ => return Vec::new(),
    };
    let is_method =
        |function: &&Function| function.forms.iter().any(|form| form.starts_with(receiver) && form.contains('('));
    table::functions().filter(is_method).map(|function| function.name).collect()
}

/// Variables that people expect to be there.
fn stands_for(name: &str) -> Option<&'static str> {
    Some(match name {
        "PI" | "pi" | "Math" | "math" | "M_PI" => "write PI(); sind, cosd and tand take degrees",
        "TAU" | "tau" => "write 2 * PI()",
        "t" | "time" => "write f.t, or f.seconds",
        "seconds" => "write f.seconds",
        "frame" | "frame_number" | "frameNumber" => "write f.number",
        "index" | "frame_index" => "write f.index",
        "fps" => "write f.fps",
        "frames" => "write f.count",
        "camera" | "cam" => "write s.camera",
        "render" | "settings" => "write s.render",
        "scene" | "world" | "stage" => "the scene is the first argument of `setup` and `frame`: s",
        "True" => "write true",
        "False" => "write false",
        "None" | "nil" | "null" | "undefined" | "NULL" => "write () for nothing",
        "self" => "write this, or hand it over as an argument",
        "rng" | "random" | "rand" => "write f.rng, or s.rng in setup",
        "x" | "y" | "z" => "coordinates belong to a vector: v.x",
        "_" => "`_` is for the last case of a switch",
        _ => return None,
    })
}
