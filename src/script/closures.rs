//! Closures without the names that the engine gives them: these are hashes, which differ from build to build and from
//! processor to processor, and no picture may depend on them.

use ::rhai::{Dynamic, Engine, FnPtr, ImmutableString, Map, format_map_as_json};

use super::errors::{Complaint, Fallible, complain};

const NAME: &str = "closure";
/// How the engine's own names of closures begin; a hash follows.
const ANONYMOUS: &str = "anon$";
/// Hexadecimal digits of the hash.
const DIGITS: usize = 16;
/// The function that what a script catches goes through, see [`super::rewrite`].
pub const CAUGHT: &str = "anim_caught";
/// A function that does nothing: a block that calls one is no constant.
pub const NOTHING: &str = "anim_nothing";

fn name(function: &FnPtr) -> String {
    if function.is_anonymous() { NAME.into() } else { function.fn_name().into() }
}

/// A text of the engine's without the names of closures.
pub fn without_names(text: &str) -> String {
    let mut parts = text.split(ANONYMOUS);
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let is_hash = part.len() >= DIGITS && part.bytes().take(DIGITS).all(|byte| byte.is_ascii_hexdigit());
        out.push_str(if is_hash { NAME } else { ANONYMOUS });
        out.push_str(if is_hash { &part[DIGITS..] } else { part });
    }
    // In lists and maps the engine shows a closure as a structure of its own.
    out.replace("Fn*(\"closure\"", "Fn(closure")
}

/// Whether the engine speaks of a closure by this name, which may be followed by what it was called with.
pub fn is_closure(signature: &str) -> bool {
    signature.starts_with(ANONYMOUS)
}

/// What a script catches, without what differs between machines: names of closures, and where the script lies.
fn caught(error: Dynamic) -> Dynamic {
    let text_of = |value: &Dynamic| value.read_lock::<ImmutableString>().map(|text| text.to_string());
    // A map that a script has thrown is its own.
    let is_of_engine = |map: &Map| {
        let kind = map.get("error").and_then(text_of);
        kind.is_some_and(|kind| kind.starts_with("Error")) && map.contains_key("message")
    };
    let mut error = error;
    if let Some(mut map) = error.write_lock::<Map>().filter(|map| is_of_engine(map)) {
        map.remove("source");
        for value in map.values_mut() {
            let Some(text) = text_of(value) else { continue };
            // Who has called whom is told with the files that they are in.
            let text = text.split("\nin ").next().unwrap_or_default();
            *value = without_files(&without_names(text)).into();
        }
    }
    error
}

/// A message of the engine's without the file that it names, as in `... @ 'show.rhai' (line 3, position 5)`.
fn without_files(message: &str) -> String {
    match (message.find(" @ '"), message.rfind("' (line ")) {
        (Some(start), Some(end)) if start < end => format!("{}{}", &message[..start], &message[end + 1..]),
        _ => message.into(),
    }
}

pub fn register(engine: &mut Engine) {
    engine
        .register_get("name", |function: &mut FnPtr| name(function))
        .register_fn("name", |function: &mut FnPtr| name(function));
    // What lists all functions of a script lists closures with their names.
    engine
        .register_fn("get_fn_metadata_list", no_list)
        .register_fn("get_fn_metadata_list", |_: &str| no_list())
        .register_fn("get_fn_metadata_list", |_: &str, _: i64| no_list());
    engine.register_fn("to_json", |map: &mut Map| without_names(&format_map_as_json(map)));
    engine.register_fn(CAUGHT, caught).register_fn(NOTHING, || {});
    for word in ["to_string", "to_debug", "print", "debug"] {
        engine
            .register_fn(word, |function: &mut FnPtr| format!("Fn({})", name(function)))
            .register_fn(word, |complaint: &mut Complaint| complaint.message.clone());
    }
}

fn no_list() -> Fallible<()> {
    complain("a script cannot list its functions", None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::script::tests::{open, scene};

    /// What a frame with this body prints, and what is said of its mistake.
    fn said(body: &str) -> [String; 2] {
        let text = format!("animation(#{{ frames: 1 }});\nfn frame(s, f) {{\nlet c = |x| x;\n{body}\n}}");
        let program = open(&text, &[]).unwrap();
        let outcome = program.frame(&scene(), 1, 0.0);
        let mistake = outcome.map(|_| String::new()).unwrap_or_else(|problems| problems.to_string());
        [program.take_printed().join("\n"), mistake]
    }

    #[test]
    fn no_text_that_a_script_can_make_has_the_name_of_a_closure() {
        let closure = "in frame 1: Fn(closure)";
        let cases = [
            ("print(c);", closure),
            ("print(`${c}`);", closure),
            ("print(`${|x| x}`);", closure),
            ("print(`${[|x| x]} ${#{ a: |x| x }}`);", "[Fn(closure)] #{\"a\": Fn(closure)}"),
            ("let m = #{}; m[`${|x| x}`] = 1; print(m.keys());", "[\"Fn(closure)\"]"),
            ("print(c.to_debug() + [c].to_string());", "Fn(closure)[Fn(closure)]"),
            ("print(#{ a: [c] }.to_json());", "{\"a\":[\"closure\"]}"),
            ("try { c.call(1, 2); } catch (e) { print(e.function); }", "closure (i64, i64)"),
            ("try { c.call(1, 2); } catch (e) { print(e); }", "Function not found: closure (i64, i64)"),
            ("let d = |x| x - \"a\";\ntry { d.call(1); } catch (e) { print(e); }", "Function not found: - (i64,"),
            ("try { throw c; } catch (e) { print(`${e}`); }", closure),
        ];
        for (body, text) in cases {
            let [printed, mistake] = said(body);
            assert!(printed.contains(text) && mistake.is_empty(), "{body}\n{printed}\n{mistake}");
            // Nor does what is caught say where the script lies.
            let own_place = printed.matches("show.rhai").count();
            assert!(!printed.contains("anon$") && own_place <= 1, "{body}\n{printed}");
        }
        let mistakes = [
            ("throw c;", closure),
            ("throw [c, #{ a: c }];", "[Fn(closure), #{\"a\": Fn(closure)}]"),
            ("throw c.curry(1);", closure),
            ("c.call(1, 2);", "a closure is called with 2 arguments, which it does not take"),
            ("try { c.call(); } catch (e) { throw e; }", "Function not found: closure ()"),
            ("try { s.get(\"nobody\"); } catch (e) { throw `no: ${e}`; }", "no: there is no entity `nobody`"),
        ];
        for (body, text) in mistakes {
            let [_, mistake] = said(body);
            assert!(mistake.contains(text) && !mistake.contains("anon$"), "{body}\n{mistake}");
        }
    }

    #[test]
    fn what_a_script_has_thrown_is_caught_as_it_is() {
        let [printed, _] = said("try { throw #{ source: 5, message: \"m\" }; } catch (e) { print(e); }");
        assert!(printed.contains("#{\"message\": \"m\", \"source\": 5}"), "{printed}");
    }

    #[test]
    fn names_of_closures_are_taken_out_of_texts() {
        let hash = "0eb04eca473e0745";
        assert_eq!(without_names(&format!("no anon${hash} (i64)")), "no closure (i64)");
        assert_eq!(without_names(&format!("[Fn*(\"anon${hash}\", 1), 2]")), "[Fn(closure, 1), 2]");
        for other in ["anon$", "anon$é", "an anon$0eb04eca473e07", "anon$anon$", "Fn*(\"frame\")"] {
            assert_eq!(without_names(other), other);
        }
        assert_eq!(
            without_files("no f (i64) @ '/a/b (c).rhai' (line 4, position 2)"),
            "no f (i64) (line 4, position 2)"
        );
        assert_eq!(without_files("a @ 'b"), "a @ 'b");
    }
}
