//! What the engine says, in our words: no name of a type, no token and no rule of Rhai's that a script's author never
//! wrote.

use ::rhai::{EvalAltResult, LexError, ParseErrorType};

use super::allowance::Limit;
use super::errors::Complaint;
use super::sandbox::Stopped;
use super::vocabulary::Vocabulary;
use super::{closures, rewrite, said, sandbox};
use crate::base::diagnostics::did_you_mean;
use crate::base::limits;

/// A message and what to do about it.
pub type Words = (String, Option<String>);

fn only(message: impl Into<String>) -> Words {
    (message.into(), None)
}

fn with(message: impl Into<String>, help: impl Into<String>) -> Words {
    (message.into(), Some(help.into()))
}

/// An error of the engine; `near` is the word at its place in the script.
pub fn of_error(error: &EvalAltResult, near: &str, vocabulary: &Vocabulary) -> Words {
    use EvalAltResult as E;
    match error {
        E::ErrorRuntime(payload, _) => match payload.clone().try_cast::<Complaint>() {
            Some(complaint) => (complaint.message, complaint.help),
            None => only(payload.to_string()),
        },
        E::ErrorParsing(kind, _) => of_grammar(kind, near),
        E::ErrorFunctionNotFound(signature, _) => vocabulary.unknown_function(signature),
        E::ErrorVariableNotFound(name, _) => vocabulary.unknown_variable(name),
        E::ErrorDotExpr(text, _) => vocabulary.unknown_property(text),
        E::ErrorIndexingType(text, _) => {
            let mut types = text.split([' ', '[', ']', '=']).filter(|part| !part.is_empty()).map(plain_type);
            let (value, index) = (types.next().unwrap_or_default(), types.next().unwrap_or_default());
            let message = format!("a {value} cannot be asked for [{index}]");
            match (value.as_str(), index.as_str()) {
                ("scene", "text") => with(message, "an entity is found by its name: s.get(\"name\")"),
                _ => only(message),
            }
        }
        E::ErrorPropertyNotFound(name, _) => only(format!("the map has no `{name}`")),
        E::ErrorIndexNotFound(index, _) => only(format!("there is nothing at `{index}`")),
        E::ErrorArrayBounds(0, index, _) => only(format!("the list is empty: there is no item {index}")),
        E::ErrorArrayBounds(count, index, _) => {
            let help = format!("items count from 0 to {}, or from -1, the last, down", count - 1);
            with(format!("the list has {count} items: there is no item {index}"), help)
        }
        E::ErrorStringBounds(count, index, _) => {
            only(format!("the text has {count} letters: there is no letter {index}"))
        }
        E::ErrorBitFieldBounds(count, index, _) => {
            only(format!("a whole number has {count} bits: there is no bit {index}"))
        }
        E::ErrorFor(_) => no_list(),
        E::ErrorMismatchDataType(expected, found, _) | E::ErrorMismatchOutputType(expected, found, _) => {
            let (expected, found) = (plain_type(expected), plain_type(found));
            match (expected.as_str(), found.as_str()) {
                ("bool", "whole number" | "number" | "text" | "()") => {
                    with(format!("expected true or false, found a {found}"), "compare it, as in `if x != 0`")
                }
                _ => only(format!("expected a {expected}, found {}", article(&found))),
            }
        }
        E::ErrorAssignmentToConstant(name, _) => with(
            format!("`{name}` is a constant"),
            format!("keep what changes in a variable: let my_{} = {name};", name.to_lowercase()),
        ),
        E::ErrorNonPureMethodCallOnConstant(name, _) => {
            with(format!("`{name}` would change a constant"), "copy it into a variable first: let copy = CONSTANT;")
        }
        E::ErrorArithmetic(text, _) => arithmetic(text),
        E::ErrorUnboundThis(_) => only("there is no `this` here"),
        E::ErrorModuleNotFound(name, _) => with(
            format!("there is no module `{name}`"),
            format!("import it at the top of the script: import \"{name}\" as {name};"),
        ),
        E::ErrorDataRace(name, _) => {
            // What it calls a value that has no name is nothing.
            let what = if name.is_empty() { "a value".to_string() } else { format!("`{name}`") };
            with(format!("{what} is used while a closure holds it"), "hand it to the closure as an argument")
        }
        E::ErrorVariableExists(name, _) => only(format!("there is already a variable `{name}`")),
        E::ErrorForbiddenVariable(name, _) => only(format!("`{name}` cannot be the name of a variable")),
        _ => of_limits(error),
    }
}

fn no_list() -> Words {
    with(
        "`for` goes through a list, a range, a map's keys or values, or a text",
        "write `for i in 0..10` to count, `for key in map.keys()` for a map",
    )
}

/// What a script may not have more of.
fn of_limits(error: &EvalAltResult) -> Words {
    use EvalAltResult as E;
    match error {
        E::ErrorTerminated(token, _) => stopped(token.clone().try_cast::<Stopped>()),
        E::ErrorSystem(what, why) => only(format!("{what}: {why}")),
        E::ErrorDataTooLarge(what, _) => {
            let (what, most) = match what.trim_start_matches("Size of ").trim_start_matches("Length of ") {
                "string" => ("a text", limits::SCRIPT_STRING_BYTES),
                "object map" => ("a map", limits::SCRIPT_MAP),
                _ => ("a list", limits::SCRIPT_ARRAY),
            };
            only(format!("{what} grows beyond {most} elements"))
        }
        E::ErrorStackOverflow(_) => with("functions call each other too deep", "look for a recursion that never ends"),
        E::ErrorTooManyVariables(_) => only(format!("more than {} variables at once", limits::SCRIPT_ITEMS)),
        E::ErrorTooManyModules(_) => only(format!("more than {} modules", limits::SCRIPT_MODULES)),
        other => {
            let text = other.to_string();
            let end = text.rfind(" (line ").unwrap_or(text.len());
            only(quoted(&text[..end]))
        }
    }
}

/// Why the watch has stopped a script, and how it may go further.
fn stopped(by: Option<Stopped>) -> Words {
    let allowance = sandbox::allowance();
    let raised = |limit: Limit, look: &str| format!("look for {look}, or {}", limit.how_to_raise(allowance.get(limit)));
    match by {
        Some(Stopped::Memory) => with(
            format!("the script holds more than {} MiB", allowance.get(Limit::Memory)),
            raised(Limit::Memory, "a list or text that grows without end"),
        ),
        Some(Stopped::Operations) => with(
            format!(
                "the script runs for too long: more than {} operations in one call",
                allowance.get(Limit::Operations)
            ),
            raised(Limit::Operations, "a loop that never ends"),
        ),
        Some(Stopped::Time | Stopped::Mark) | None => with(
            format!("the script runs for too long: more than {} s in one call", allowance.seconds()),
            raised(Limit::Seconds, "a loop that never ends"),
        ),
    }
}

fn arithmetic(text: &str) -> Words {
    let lower = text.to_lowercase();
    if lower.contains("zero") {
        return only("a division by 0");
    }
    if lower.contains("overflow") || lower.contains("underflow") {
        return with(
            "a whole number grows beyond what 64 bits hold",
            "numbers with a point go further: write 2.0 instead of 2",
        );
    }
    only(quoted(text))
}

/// Words of other languages that stand where this one has another.
pub fn foreign(word: &str) -> Option<&'static str> {
    Some(match word {
        "and" => "write `&&` for `and`",
        "or" => "write `||` for `or`",
        "not" => "write `!` for `not`",
        "elif" | "elseif" | "elsif" => "write `else if`",
        "then" | "do" | "begin" => "a block stands in braces: `if x > 1 { ... }`",
        "end" | "endif" | "done" => "a block stands in braces: `{ ... }`",
        "def" | "function" | "func" | "fun" | "sub" | "proc" | "lambda" => {
            "a function is written `fn name(a, b) { ... }`"
        }
        "var" | "local" | "int" | "float" | "double" | "auto" | "string" | "bool" | "vector" | "dim" => {
            "a variable is written `let name = ...;`"
        }
        "pass" => "an empty block is written `{ }`",
        "except" | "rescue" => "write `try { ... } catch (problem) { ... }`",
        "void" | "procedure" | "macro" | "method" => "a function is written `fn name(a, b) { ... }`",
        "uniform" | "varying" | "attribute" | "inout" => {
            "values from outside are parameters: `param(\"name\", 1.0)`, set by -D name=value"
        }
        "global" | "nonlocal" => "functions see what the top of the script names: `const NAME = 1;`",
        "del" | "delete" => "an entity is removed by `s.despawn(entity)`",
        "echo" | "puts" => "write `print(x)`",
        "unless" => "write `if !(...) { ... }`",
        "mut" => "every variable can change: leave this word out",
        "foreach" => "write `for item in list { ... }`",
        "until" => "write `while !(...) { ... }`",
        "class" | "struct" | "interface" => "maps hold what belongs together: `#{ name: 1, other: 2 }`",
        "null" | "nil" | "None" | "undefined" => "write `()` for nothing",
        "True" => "write `true`",
        "False" => "write `false`",
        "async" | "await" | "go" | "yield" | "spawn" | "thread" | "sync" => "a script has no threads",
        "case" | "match" => "write `switch x { 1 => ..., _ => ... }`",
        "new" => "write `s.spawn(#{ ... })` for a new entity",
        "goto" | "exit" => "write `return` or `break`",
        "static" | "public" | "private" | "protected" => "leave this word out",
        "use" | "include" | "require" | "from" | "using" => "write `import \"name\" as name;`",
        _ => return None,
    })
}

/// What is wrong with the grammar of a script; `near` is the word at the place.
fn of_grammar(kind: &ParseErrorType, near: &str) -> Words {
    use ParseErrorType as P;
    if let (P::PropertyExpected, "loop") = (kind, near) {
        return with("`loop` is a word of the language, and no key", "for a sequence that begins anew: mode: \"loop\"");
    }
    if let (P::PropertyExpected, true) = (kind, near.chars().any(char::is_alphabetic)) {
        return with(
            format!("`{near}` is a word of the language: as a key it stands in quotes"),
            format!("write \"{near}\": ..."),
        );
    }
    if let Some(help) = foreign(near) {
        return with(format!("`{near}` is not a word of this language"), help);
    }
    match kind {
        P::BadInput(error) => of_letters(error, near),
        P::UnexpectedEOF => with("the script ends too early", "a brace, bracket or quote is never closed"),
        P::UnknownOperator(symbol) => operator(symbol),
        P::MissingToken(token, why) => missing(token, why),
        P::MissingSymbol(_) => only("something is missing here"),
        P::Reserved(word) => match foreign(word) {
            Some(help) => with(format!("`{word}` is not a word of this language"), help),
            None if word.chars().all(|c| c.is_alphanumeric() || c == '_') => {
                only(format!("`{word}` cannot be used as a name"))
            }
            None => operator(word),
        },
        P::ExprExpected(_) => only("expected a value here"),
        P::PropertyExpected => {
            with("expected the name of a property", "maps are written #{ name: value, \"a name with blanks\": value }")
        }
        P::VariableExpected => only("expected the name of a variable"),
        P::ForbiddenVariable(name) => only(format!("`{name}` cannot be the name of a variable")),
        P::DuplicatedProperty(name) => only(format!("`{name}` is given twice in this map")),
        P::DuplicatedVariable(name) => only(format!("`{name}` is named twice")),
        P::MismatchedType(expected, _) if expected.contains("iterable") => no_list(),
        P::MismatchedType(expected, found) => {
            let bare = |name: &str| name.trim_start_matches("an ").trim_start_matches("a ").to_string();
            let (expected, found) = (bare(&plain_type(expected)), bare(&plain_type(found)));
            only(format!("expected {}, found {}", article(&expected), article(&found)))
        }
        P::WrongFnDefinition => with(
            "a function cannot stand inside another one",
            "move it out to the top of the script, or write a closure: let name = |x| x + 1;",
        ),
        P::FnDuplicatedDefinition(name, count) => {
            only(format!("there are two functions `{name}` of {count} arguments"))
        }
        P::FnMissingName => only("a function needs a name"),
        P::FnMissingParams(name) => {
            with(format!("`{name}` needs its arguments in brackets"), format!("fn {name}() {{ ... }}"))
        }
        P::FnDuplicatedParam(name, argument) => only(format!("`{argument}` is named twice in `{name}`")),
        P::FnMissingBody(name) => with(format!("`{name}` needs a body"), format!("fn {name}(...) {{ ... }}")),
        P::AssignmentToConstant(name) => only(format!("the constant `{name}` cannot be changed")),
        P::AssignmentToInvalidLHS(_) => with(
            "nothing can be assigned to this",
            "keep what a function gives in a variable first: let e = s.spawn(#{}); e.yaw = 90; and compare with ==",
        ),
        P::MalformedIndexExpr(_) => only("this cannot be an index"),
        P::WrongSwitchDefaultCase => only("`_` must be the last case of a `switch`"),
        P::WrongSwitchIntegerCase => only("cases of numbers must come before those of ranges"),
        P::WrongSwitchCaseCondition => only("this case cannot have a condition"),
        P::WrongExport => only("`export` belongs to the top of a module"),
        P::LoopBreak => only("`break` and `continue` belong into a loop"),
        P::ExprTooDeep => with("brackets nest too deep", "split the expression up with variables"),
        P::TooManyFunctions => only(format!("more than {} functions", limits::SCRIPT_ITEMS)),
        P::LiteralTooLarge(..) => only("this list, map or text is too long to be written out"),
        other => only(quoted(&other.to_string())),
    }
}

fn of_letters(error: &LexError, near: &str) -> Words {
    match error {
        LexError::UnterminatedString => with("this text is never closed", "a text stands between two \" on one line"),
        LexError::MalformedChar(_) => with("a single letter stands in '...'", "texts stand in \"...\""),
        LexError::MalformedNumber(text) => with(format!("`{text}` is not a number"), "write 0.5, 1e-3 or 250"),
        LexError::MalformedEscapeSequence(text) => {
            with(format!("`{text}` stands for nothing in a text"), "write \\\\ for a backslash, \\n for a new line")
        }
        LexError::ImproperSymbol(symbol, _) => operator(symbol),
        LexError::UnexpectedInput(symbol) => operator(symbol),
        LexError::MalformedIdentifier(name) => only(format!("`{name}` cannot be a name")),
        _ if near.is_empty() => only("this cannot be read"),
        _ => only(format!("`{near}` cannot be read")),
    }
}

/// An operator that there is not.
fn operator(symbol: &str) -> Words {
    let help = match symbol {
        "++" => "write `x += 1`",
        "--" => "write `x -= 1`",
        "===" => "write `==`",
        "!==" | "<>" => "write `!=`",
        "**" | "**=" | "^" => "write pow(x, y)",
        "?" | ":" => "write `if a { b } else { c }`",
        "->" => "functions are written `fn name(a) { ... }`, closures `|x| x + 1`",
        ":=" => "write `=`",
        "=" => "write `==` to compare, and one assignment at a time",
        ";" | "," => {
            return with(format!("a value is missing before this `{symbol}`"), "write it in full, as in `x = 1;`");
        }
        "." => "a number has a digit before its point: 0.5",
        "\u{b0}" => "angles are plain numbers, in degrees",
        "#" | "@" | "$" => "comments begin with //",
        "# {" => "write #{ without a blank between",
        "//=" => "write div(x, y)",
        "..." => "write `..` or `..=`",
        "\u{201c}" | "\u{201d}" | "\u{201e}" | "\u{2018}" | "\u{2019}" => "texts stand in straight quotes: \"...\"",
        "\u{2212}" | "\u{2013}" => "this dash is no minus sign: write -",
        "\u{a0}" => "this is a no-break space: write a plain one",
        "}" | ")" | "]" => return only(format!("this `{symbol}` closes nothing: there is one too many")),
        "eval" | "timestamp" => return only(format!("a script has no `{symbol}`")),
        _ => return only(format!("`{symbol}` is not an operator of this language")),
    };
    with(format!("`{symbol}` is not an operator of this language"), help)
}

fn missing(token: &str, why: &str) -> Words {
    let message = match (token, why) {
        (";", _) => "expected `;` at the end of the statement".to_string(),
        ("}", _) => "a `{` is never closed".to_string(),
        (")", _) => "expected `)`, or `,` between two arguments".to_string(),
        ("]", _) => "expected `]`, or `,` between two items".to_string(),
        (",", why) if why.contains("map") => "expected `,` between two entries of the map".to_string(),
        (",", why) if why.contains("array") => "expected `]`, or `,` between two items".to_string(),
        (",", why) if why.contains("call") => "expected `)`, or `,` between two arguments".to_string(),
        (",", _) => "expected `,` between the two".to_string(),
        (":", _) => "expected `:` between a name and its value".to_string(),
        ("{", _) => "expected `{`: a block stands in braces".to_string(),
        ("in", _) => "expected `in`: for item in list { ... }".to_string(),
        ("=>", _) => "expected `=>`: switch x { 1 => ..., _ => ... }".to_string(),
        ("=", _) => "expected `=`".to_string(),
        (token, _) => format!("expected `{token}`"),
    };
    only(message)
}

fn quoted(text: &str) -> String {
    let mut letters = text.replace('\'', "`").replace(rewrite::DIVIDE, "/");
    if let Some(first) = letters.get(..1).map(str::to_lowercase) {
        letters.replace_range(..1, &first);
    }
    letters
}

/// What a person calls a function of ours.
pub fn plain_name(name: &str) -> &str {
    match name {
        rewrite::DIVIDE => "/",
        rewrite::INDEX => "[]",
        said::PRINT => "print",
        said::DEBUG => "debug",
        // What nobody has written.
        closures::CAUGHT | closures::NOTHING => "{}",
        other => other,
    }
}

fn article(noun: &str) -> String {
    match noun {
        "nothing" | "()" => "nothing".into(),
        noun if noun.starts_with(['a', 'e', 'i', 'o', 'u']) => format!("an {noun}"),
        noun => format!("a {noun}"),
    }
}

/// What a person calls a type of the engine.
pub fn plain_type(name: &str) -> String {
    if name.contains("String") || name.contains("&str") {
        return "text".into();
    }
    let last = name.rsplit("::").next().unwrap_or(name).trim();
    match last {
        "i64" | "INT" | "integer" => "whole number",
        "f64" | "FLOAT" | "float" => "number",
        "string" => "text",
        "char" | "character" => "letter",
        "array" | "Array" => "list",
        "map" | "Map" => "map",
        "SceneHandle" | "Scene" => "scene",
        "EntityHandle" | "Entity" => "entity",
        "RecordHandle" | "Component" => "component",
        "DVec3" | "Vec3" => "vector",
        "FrameTime" | "Frame" => "frame",
        "PathHandle" | "Path" => "path",
        "Generator" | "Random" => "generator",
        "FnPtr" | "Fn" => "closure",
        "boolean" | "bool" => "bool",
        "range" | "Range<i64>" | "RangeInclusive<i64>" => "range",
        "()" => "nothing",
        other => other,
    }
    .to_string()
}

/// "did you mean ...?" for a word of the language.
pub fn keyword(found: &str) -> Option<String> {
    let words = [
        "let", "const", "if", "else", "for", "in", "while", "loop", "return", "fn", "switch", "true", "false", "import",
    ];
    foreign(found).map(str::to_string).or_else(|| did_you_mean(found, &words))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_have_names_that_people_use() {
        assert_eq!(plain_type("&str | ImmutableString | String"), "text");
        assert_eq!(plain_type("glam::f64::dvec3::DVec3"), "vector");
        assert_eq!(plain_type("i64"), "whole number");
    }
}
