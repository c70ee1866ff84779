//! The functions that a script is called by: whether they are there, take what they are given, and are called as they are
//! written.

use ::rhai::AST;

use super::errors::ScriptSource;
use crate::base::diagnostics::{Diagnostic, Diagnostics, nearest};

/// Their names, and what they are given.
const ENTRIES: [(&str, &[&str]); 4] =
    [("setup", &["s"]), ("frame", &["s", "f"]), ("start", &["s"]), ("step", &["state", "f"])];

/// What such functions are called in other programs.
const ELSEWHERE: [(&str, &[&str]); 2] = [
    (
        "frame",
        &["update", "draw", "main", "render", "animate", "tick", "run", "loop", "onframe", "on_update", "render_frame"],
    ),
    ("setup", &["init", "create", "build", "construct", "initialize", "on_start", "load", "preload"]),
];

/// The function that is meant by one that nothing calls.
fn meant(name: &str) -> Option<&'static str> {
    let plain = name.to_lowercase();
    let elsewhere = ELSEWHERE.iter().find(|(_, foreign)| foreign.contains(&plain.as_str())).map(|(ours, _)| *ours);
    elsewhere.or_else(|| nearest(&plain, ENTRIES.iter().map(|(name, _)| *name)))
}

/// Whether the script has a function of so many parameters.
pub fn has(ast: &AST, name: &str, count: usize) -> bool {
    ast.iter_functions().any(|f| f.name == name && f.params.len() == count)
}

/// Looks at all functions of a script that the program calls, and at those that nothing calls though their names are near.
///
/// # Errors
/// All mistakes, each at the name of its function.
pub fn check(ast: &AST, source: &ScriptSource) -> Result<(), Diagnostics> {
    let mut wrong = Vec::new();
    let signature = |name: &str, parameters: &[&str]| format!("{name}({})", parameters.join(", "));
    let is_there = |name: &str| ast.iter_functions().any(|f| f.name == name);
    for function in ast.iter_functions() {
        let place = || source.place_of_function(function.name);
        let written = signature(function.name, &function.params);
        if let Some((name, parameters)) = ENTRIES.iter().find(|(name, _)| *name == function.name) {
            if function.params.len() != parameters.len() && !has(ast, name, parameters.len()) {
                let expected = signature(name, parameters);
                let message = format!("`fn {written}` is called as `{expected}`");
                wrong.push(Diagnostic::error(message).at(place()).help(format!("write fn {expected} {{ ... }}")));
            }
            continue;
        }
        if let Some(near) = meant(function.name).filter(|near| !is_there(near))
            && source.mentions(function.name) == 1
        {
            let message = format!("nothing calls the function `{}`", function.name);
            wrong.push(Diagnostic::error(message).at(place()).help(format!("did you mean `{near}`?")));
        }
    }
    if !wrong.is_empty() {
        return Err(Diagnostics(wrong));
    }
    let missing = |message: &str, help: &str| Diagnostic::error(message).at(source.whole()).help(help).into();
    if !has(ast, "frame", 2) {
        return Err(missing("the script has no function `frame(s, f)`", "add fn frame(s, f) { ... }"));
    }
    if has(ast, "start", 1) && !has(ast, "step", 2) {
        let help = "add fn step(state, f) { ... state }, which gives the next state";
        return Err(missing("the script has `start(s)` and no `step(state, f)`", help));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::script::tests::open;

    #[test]
    fn functions_that_the_program_calls_take_what_it_gives() {
        let fails = |text: &str, words: &[&str]| {
            let message = open(&format!("animation(#{{ frames: 5 }});\n{text}"), &[]).map(drop).unwrap_err();
            words.iter().for_each(|word| assert!(message.contains(word), "{word}\n{message}"));
        };
        fails("fn frame(s) { }", &["show.rhai:2:4: error: `fn frame(s)` is called as `frame(s, f)`"]);
        fails("fn frame(s, f) { }\nfn setup() { }", &["show.rhai:3:4", "is called as `setup(s)`"]);
        fails("fn frame(s, f) { }\nfn start() { 1 }", &["show.rhai:3:4", "is called as `start(s)`"]);
        fails("fn start(s) { 1 }\nfn step(x) { x }\nfn frame(s, f) { }", &["show.rhai:3:4", "`step(state, f)`"]);
        fails("fn frame(s, f) { }\nfn setpu(s) { }", &["show.rhai:3:4: error: nothing calls", "did you mean `setup`?"]);
        fails("fn update(s, f) { }", &["show.rhai:2:4", "did you mean `frame`?"]);
        fails("fn frame(s, f) { }\nfn init(s) { }", &["show.rhai:3:4", "did you mean `setup`?"]);
        fails("fn Frame(s, f) { }", &["show.rhai:2:4", "did you mean `frame`?"]);
        // Functions of one's own may have any name that is used.
        for text in ["fn setup(s) { } fn setups(s) { }", "fn steps() { 3 } let n = steps();"] {
            open(&format!("animation(#{{ frames: 5 }}); fn frame(s, f) {{ }} {text}"), &[]).unwrap();
        }
        let inside =
            open("fn setup(s) {\n  animation(#{ frames: 5 });\n}\nfn frame(s, f) { }", &[]).map(drop).unwrap_err();
        assert!(inside.contains("show.rhai:2:3: error: the script does not call `animation` at its top"), "{inside}");
    }
}
