//! The Rhai engine, put together: packages, the API, the sandbox.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ::rhai::packages::{
    BasicArrayPackage, BasicMapPackage, BasicMathPackage, CorePackage, LogicPackage, MoreStringPackage, Package,
};
use ::rhai::{Dynamic, Engine, Map};
use rustc_hash::FxHashMap;

use super::errors::{Fallible, complain};
use super::{closures, rewrite, sandbox, table, tokens};

/// What the tops of a script and of its modules have named: their functions see it.
#[derive(Clone, Default)]
pub struct TopNames(Arc<Mutex<FilledNames>>);

#[derive(Default)]
struct FilledNames {
    of_script: Map,
    /// By the file.
    of_modules: FxHashMap<String, Map>,
}

impl TopNames {
    fn lock(&self) -> MutexGuard<'_, FilledNames> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Those of the script.
    pub fn of_script(&self, names: Map) {
        self.lock().of_script = names;
    }

    /// Those of a module.
    pub fn of_module(&self, file: &str, names: Map) {
        self.lock().of_modules.insert(file.to_string(), names);
    }

    /// A name as it is seen from a file.
    fn find(&self, file: Option<&str>, name: &str) -> Option<Dynamic> {
        let names = self.lock();
        let of_module = file.and_then(|file| names.of_modules.get(file));
        of_module.and_then(|module| module.get(name)).or_else(|| names.of_script.get(name)).cloned()
    }
}

/// An engine for one script. `names` are seen from every function, once they are filled in.
pub fn new(names: &TopNames) -> Engine {
    let mut engine = Engine::new_raw();
    CorePackage::new().register_into_engine(&mut engine);
    LogicPackage::new().register_into_engine(&mut engine);
    BasicMathPackage::new().register_into_engine(&mut engine);
    BasicArrayPackage::new().register_into_engine(&mut engine);
    BasicMapPackage::new().register_into_engine(&mut engine);
    MoreStringPackage::new().register_into_engine(&mut engine);
    table::register(&mut engine);
    tokens::register(&mut engine);
    arithmetic(&mut engine);
    closures::register(&mut engine);
    show_names(&mut engine, names.clone());
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

/// Division gives fractions, and whole numbers may come as `2.0` where a range or an index wants them.
fn arithmetic(engine: &mut Engine) {
    // It binds as `*` does; a fresh engine refuses no word.
    let _ = engine.register_custom_operator(rewrite::DIVIDE, 180);
    engine
        .register_fn(rewrite::DIVIDE, |a: i64, b: i64| quotient(a, b))
        .register_fn(rewrite::DIVIDE, |a: f64, b: f64| a / b)
        .register_fn(rewrite::DIVIDE, |a: f64, b: i64| a / b as f64)
        .register_fn(rewrite::DIVIDE, |a: i64, b: f64| a as f64 / b)
        .register_fn(rewrite::INDEX, |index: i64| index)
        .register_fn(rewrite::INDEX, |index: f64| whole(index, "an index"))
        .register_fn(rewrite::INDEX, |index: Dynamic| index);
    type Exclusive = std::ops::Range<i64>;
    type Inclusive = std::ops::RangeInclusive<i64>;
    let end = |x: f64| whole(x, "the end of a range");
    engine
        .register_fn("..", move |a: i64, b: f64| -> Fallible<Exclusive> { Ok(a..end(b)?) })
        .register_fn("..", move |a: f64, b: i64| -> Fallible<Exclusive> { Ok(end(a)?..b) })
        .register_fn("..", move |a: f64, b: f64| -> Fallible<Exclusive> { Ok(end(a)?..end(b)?) })
        .register_fn("..=", move |a: i64, b: f64| -> Fallible<Inclusive> { Ok(a..=end(b)?) })
        .register_fn("..=", move |a: f64, b: i64| -> Fallible<Inclusive> { Ok(end(a)?..=b) })
        .register_fn("..=", move |a: f64, b: f64| -> Fallible<Inclusive> { Ok(end(a)?..=end(b)?) });
    // What comes out even is a whole number, of which these are asked as well.
    for name in ["floor", "ceiling", "round", "int"] {
        engine.register_fn(name, |x: i64| x);
    }
    engine.register_fn("fraction", |_: i64| 0.0);
}

/// The quotient of whole numbers: whole where it comes out even, a fraction otherwise.
fn quotient(a: i64, b: i64) -> Fallible<Dynamic> {
    match (a.checked_rem(b), a.checked_div(b)) {
        (Some(0), Some(whole)) => Ok(whole.into()),
        (Some(_), Some(_)) => Ok((a as f64 / b as f64).into()),
        _ if b == 0 => complain(format!("{a} / {b}: a division by 0"), None),
        _ => Ok((a as f64 / b as f64).into()),
    }
}

fn whole(x: f64, what: &str) -> Fallible<i64> {
    // Beyond 2^53 floats skip whole numbers.
    if x == x.trunc() && x.abs() <= 9_007_199_254_740_992.0 {
        return Ok(x as i64);
    }
    let help = "`floor`, `round` and `div` give whole numbers".to_string();
    complain(format!("{what} must be a whole number, not {x}"), Some(help))
}

/// Lets functions see what the top level of their own text has named, unless a variable of their own hides it.
fn show_names(engine: &mut Engine, names: TopNames) {
    #[allow(
        deprecated,
        reason = "marked as volatile by Rhai, not as going away; nothing else makes top-level names visible in functions"
    )]
    engine.on_var(move |name, _, context| {
        if context.scope().contains(name) {
            return Ok(None);
        }
        Ok(names.find(context.source(), name))
    });
}
