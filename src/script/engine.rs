//! The Rhai engine, put together: packages, the API, the sandbox.

use std::sync::{Arc, Mutex, PoisonError};

use ::rhai::packages::{
    BasicArrayPackage, BasicMapPackage, BasicMathPackage, CorePackage, LogicPackage, MoreStringPackage, Package,
};
use ::rhai::{Dynamic, Engine, Map};

use super::convert::describe;
use super::errors::{Fallible, complain};
use super::time::Header;
use super::{closures, handles, motion, random, sandbox, time, tokens, vector};

/// Functions of the API, for the nearest right word.
pub const FUNCTIONS: &[&str] = &[
    "animation",
    "param",
    "get",
    "has",
    "material",
    "add_material",
    "spawn",
    "despawn",
    "entities",
    "tagged",
    "span",
    "vec3",
    "dot",
    "cross",
    "length",
    "normalize",
    "distance",
    "lerp",
    "clamp",
    "smoothstep",
    "remap",
    "ease",
    "bezier",
    "spring",
    "keys",
    "polar",
    "orbit",
    "look_at",
    "aim",
    "rack",
    "rng",
    "float",
    "range",
    "int",
    "pick",
    "unit_vector",
    "sin",
    "cos",
    "tan",
    "sind",
    "cosd",
    "tand",
    "asin",
    "acos",
    "atan",
    "exp",
    "ln",
    "log",
    "pow",
    "sqrt",
    "hypot",
    "abs",
    "sign",
    "min",
    "max",
    "floor",
    "ceiling",
    "round",
    "len",
    "push",
];

/// What the top level of a script has said.
#[derive(Default)]
pub struct TopLevel {
    pub header: Option<Header>,
    /// The top level has run: `animation` comes too late now.
    closed: bool,
}

/// An engine for one script. `constants` are seen from every function, once they are filled in.
pub fn new(defines: &[(String, String)], top: &Arc<Mutex<TopLevel>>, constants: &Arc<Mutex<Map>>) -> Engine {
    let mut engine = Engine::new_raw();
    CorePackage::new().register_into_engine(&mut engine);
    LogicPackage::new().register_into_engine(&mut engine);
    BasicMathPackage::new().register_into_engine(&mut engine);
    BasicArrayPackage::new().register_into_engine(&mut engine);
    BasicMapPackage::new().register_into_engine(&mut engine);
    MoreStringPackage::new().register_into_engine(&mut engine);
    vector::register(&mut engine);
    random::register(&mut engine);
    motion::register(&mut engine);
    time::register(&mut engine);
    handles::register(&mut engine);
    tokens::register(&mut engine);
    closures::register(&mut engine);
    let top = top.clone();
    engine.register_fn("animation", move |map: Map| animation(&top, &map));
    let defines: Vec<(String, String)> = defines.to_vec();
    engine.register_fn("param", move |name: &str, default: Dynamic| param(&defines, name, default));
    show_constants(&mut engine, constants.clone());
    sandbox::close(&mut engine);
    engine
}

/// Fixes the keys of Rhai's hashes for this process. They are drawn anew for every build otherwise, and the names of
/// closures are hashes.
///
/// A program that has used Rhai before on its own account has drawn them already, and keeps them: what a script can see
/// of closures does not depend on them.
pub fn fix_hashes() {
    let _ = ::rhai::config::hashing::set_hashing_seed(Some([0x616e_696d, 1, 2, 3]));
}

/// Nothing but the frame functions runs from here on.
pub fn freeze(engine: &mut Engine) {
    engine.register_fn("animation", |_: Map| -> Fallible<()> {
        complain("`animation` belongs to the top of the script, outside its functions", None)
    });
}

fn animation(top: &Mutex<TopLevel>, map: &Map) -> Fallible<()> {
    let header = Header::read(map)?;
    let mut top = top.lock().unwrap_or_else(PoisonError::into_inner);
    if top.header.is_some() || top.closed {
        return complain("`animation` is called once", None);
    }
    top.header = Some(header);
    Ok(())
}

/// The value given by `-D`, read like the default; the default itself if none is given.
fn param(defines: &[(String, String)], name: &str, default: Dynamic) -> Fallible<Dynamic> {
    let Some((_, given)) = defines.iter().rev().find(|(known, _)| known == name) else { return Ok(default) };
    let expected = |what: &str| complain(format!("-D {name}={given}: expected {what}"), None);
    if default.is_bool() {
        return given.parse::<bool>().map(Dynamic::from).or_else(|_| expected("true or false"));
    }
    if default.is_int() {
        let whole = given.parse::<i64>().map(Dynamic::from);
        return whole.or_else(|_| match given.parse::<f64>() {
            Ok(_) => expected("a whole number"),
            Err(_) => expected("a number"),
        });
    }
    if default.is_float() {
        let number = given.parse::<f64>().ok().filter(|x| x.is_finite()).map(Dynamic::from);
        return number.map_or_else(|| expected("a number"), Ok);
    }
    if default.is_string() {
        return Ok(given.clone().into());
    }
    complain(format!("param(\"{name}\", {}): the default must be a number, text or bool", describe(&default)), None)
}

/// Lets functions see what the top level of the script has named, unless a variable of their own hides it.
fn show_constants(engine: &mut Engine, constants: Arc<Mutex<Map>>) {
    #[allow(
        deprecated,
        reason = "marked as volatile by Rhai, not as going away; nothing else makes top-level names visible in functions"
    )]
    engine.on_var(move |name, _, context| {
        if context.scope().contains(name) {
            return Ok(None);
        }
        Ok(constants.lock().unwrap_or_else(PoisonError::into_inner).get(name).cloned())
    });
}
