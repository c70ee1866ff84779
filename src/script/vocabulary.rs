//! The words of one script and of the API: what a mistake is held against.

use std::collections::BTreeSet;

use ::rhai::Engine;

use super::closures;
use super::elsewhere;
use super::table::{self, Function};
use super::words::{Words, foreign, keyword, plain_name, plain_type};
use crate::base::diagnostics::{did_you_mean, nearest};
use crate::base::synonyms::by_meaning;
use crate::components::{Material, homes};

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
    /// Names that it gives to modules.
    pub modules: BTreeSet<String>,
    /// Names that it gives to variables and parameters.
    pub variables: BTreeSet<String>,
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
        if let Some((module, name)) = name.rsplit_once("::") {
            return self.not_in_module(module, name);
        }
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
        if let Some(help) = how_else(name, &arguments) {
            return (message, Some(help));
        }
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
        if let Some(slip) = self.own.iter().find(|(own, _)| own.eq_ignore_ascii_case(name)) {
            return Some(format!("did you mean `{}`?", slip.0));
        }
        if let Some(help) = elsewhere::of_function(name) {
            return Some(help);
        }
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
        let meant = by_meaning(name, &ours).is_some();
        let body = (!meant).then(|| elsewhere::of_body(name)).flatten();
        body.or_else(|| did_you_mean(name, &ours)).or_else(|| did_you_mean(name, &all)).or_else(|| keyword(name))
    }

    pub fn unknown_variable(&self, name: &str) -> Words {
        if let Some((module, name)) = name.rsplit_once("::") {
            return self.not_in_module(module, name);
        }
        let message = format!("there is no variable `{name}`");
        if self.modules.contains(name) {
            return (message, Some(format!("what a module gives stands behind two colons: {name}::NAME")));
        }
        if let Some(help) = elsewhere::of_variable(name).or_else(|| foreign(name)) {
            return (message, Some(help.into()));
        }
        if self.variables.contains(name) {
            let help = format!("`{name}` is named in another function or block: hand it over as an argument");
            return (message, Some(help));
        }
        let others: Vec<&str> = self.words.iter().map(String::as_str).filter(|word| *word != name).collect();
        if self.has_function(name) {
            let call = forms(name).first().map_or(format!("{name}(...)"), |form| form.to_string());
            return (message, Some(format!("`{name}` is a function: {call}")));
        }
        let help = did_you_mean(name, &others).or_else(|| keyword(name));
        (
            message,
            help.or_else(|| Some(format!("name it first: let {name} = ...; a text stands in quotes: \"{name}\""))),
        )
    }

    /// What a module does not give.
    fn not_in_module(&self, module: &str, name: &str) -> Words {
        let message = format!("module `{module}` gives no `{name}`");
        let others: Vec<&str> = self.words.iter().map(String::as_str).filter(|word| *word != name).collect();
        let near = nearest(name, others).map(|near| format!("did you mean `{near}`?"));
        (
            message,
            near.or_else(|| Some("a module gives its functions, and the constants of its top: const NAME = 1;".into())),
        )
    }

    /// A property that a value does not have: `text` as the engine says it.
    pub fn unknown_property(&self, text: &str) -> Words {
        let mut quoted = text.split('\'').skip(1).step_by(2);
        let (name, kind) = (quoted.next().unwrap_or_default(), plain_type(quoted.next().unwrap_or_default()));
        let known = properties(&kind);
        if kind == "vector" && known.contains(&name) {
            return (format!("`{name}` of a vector: expected a number"), None);
        }
        if known.contains(&name) {
            return (format!("`{name}` of a {kind} cannot be written"), None);
        }
        let message = format!("a {kind} has no `{name}`");
        if let Some(help) = property_elsewhere(&kind, name) {
            return (message, Some(help));
        }
        if let Some(form) = forms(name).into_iter().find(|form| form.contains('(')) {
            return (message, Some(format!("`{name}` is a function: {form}")));
        }
        (message, elsewhere::of_field(name, known))
    }
}

/// Help for arguments that a function of other languages takes and ours does not.
fn how_else(name: &str, arguments: &[String]) -> Option<String> {
    let kinds: Vec<&str> = arguments.iter().map(String::as_str).collect();
    Some(match (name, &kinds[..]) {
        ("range", [_]) => "counting is written 0..n, as in for i in 0..10".into(),
        ("length" | "size" | "count", ["list" | "text" | "map"]) => "write .len()".into(),
        ("len", []) => "it is called on a list, a map or a text: list.len()".into(),
        ("min" | "max", ["list"]) => format!("write list.reduce(|a, b| {name}(a, b))"),
        ("min" | "max", [_, _, _, ..]) => format!("it takes two: {name}(a, {name}(b, c))"),
        ("clip", [_, _, _]) => "write clamp(x, low, high)".into(),
        // A function of lists or texts that is called on a thing of ours is meant for that.
        (_, ["entity" | "scene" | "component" | "frame", ..]) if forms(name).is_empty() => {
            elsewhere::of_function(name)?
        }
        ("get" | "material", [.., "text", _]) => "fields are assigned: s.get(\"name\").yaw = 90".into(),
        ("look_at", ["component", ..]) => "the camera looks at a point: s.camera.at = [0, 1, 0]".into(),
        _ => return None,
    })
}

/// Help for a property that belongs to something that a value stands for, or leads to.
fn property_elsewhere(kind: &str, name: &str) -> Option<String> {
    let is_count = ["length", "size", "count", "len"].contains(&name);
    match kind {
        "list" | "text" | "map" if is_count => Some("write .len()".into()),
        "list" if ["x", "y", "z"].contains(&name) => {
            Some(format!("vec3(list).{name} is a coordinate; of a list itself it is list[0], list[1] or list[2]"))
        }
        "text" => field_of_material(name).map(|field| {
            format!("`material` is the name of one, and its fields are reached by that: s.material(\"name\").{field}")
        }),
        "scene" if ["entities", "objects", "children", "lights"].contains(&name) => {
            Some("all entities are s.entities(), one is s.get(\"name\"), those with a tag s.tagged(\"tag\")".into())
        }
        "scene" if !is_like(name, &properties(kind)) && homes::home_of(name).is_none() => {
            Some(format!("an entity is found by its name: s.get(\"{name}\"); a material by s.material(\"{name}\")"))
        }
        _ => None,
    }
}

/// Whether one of the words is meant by another.
fn is_like(word: &str, known: &[&str]) -> bool {
    did_you_mean(word, known).is_some()
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
                ("+" | ".." | "..=", ..) => Some("texts are joined as in `a ${b}`"),
                (_, "list", _) | (_, _, "list") => Some("three numbers are a vector: vec3(x, y, z)"),
                ("==" | "!=", ..) => None,
                _ => None,
            };
            (format!("`{symbol}` does not work between a {a} and a {b}"), help.map(str::to_string))
        }
        [a] if symbol == "!" => (
            format!("`!` does not work on a {a}: it turns true into false"),
            Some("compare a number, as in `if x == 0`".into()),
        ),
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
