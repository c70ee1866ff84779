//! Closures without the names that the engine gives them: these are hashes, which differ from build to build and from
//! processor to processor, and no picture may depend on them.

use ::rhai::{Engine, FnPtr};

use super::errors::{Fallible, complain};

const NAME: &str = "closure";

fn name(function: &FnPtr) -> String {
    if function.is_anonymous() { NAME.into() } else { function.fn_name().into() }
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
    for word in ["to_string", "to_debug", "print", "debug"] {
        engine.register_fn(word, |function: &mut FnPtr| format!("Fn({})", name(function)));
    }
}

fn no_list() -> Fallible<()> {
    complain("a script cannot list its functions", None)
}
