//! Closures without the names that the engine gives them: these are hashes, which differ from build to build and from
//! processor to processor, and no picture may depend on them.

use ::rhai::{Engine, FnPtr};

const NAME: &str = "closure";

fn name(function: &FnPtr) -> String {
    if function.is_anonymous() { NAME.into() } else { function.fn_name().into() }
}

pub fn register(engine: &mut Engine) {
    engine
        .register_get("name", |function: &mut FnPtr| name(function))
        .register_fn("name", |function: &mut FnPtr| name(function));
    for word in ["to_string", "to_debug", "print", "debug"] {
        engine.register_fn(word, |function: &mut FnPtr| format!("Fn({})", name(function)));
    }
}
