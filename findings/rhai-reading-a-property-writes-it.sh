#!/usr/bin/env bash
# rhai 1.27.0: a method that only reads, called on a property, writes the property back.
# One would expect: `e.list.len()` asks the getter (or the indexer that serves properties), counts, and is done.
# What happens: the value goes through the setter afterwards, changed or not, if there is one. A host whose indexer answers
# some properties for reading only, and refuses to write them, fails on `e.list.len()` while `let l = e.list; l.len()` works.
# With a registered getter and no setter nothing is written and nothing fails, so the same property behaves in two ways.
# Consequence: a read-only property that an indexer serves has to accept the value that it has given.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
mkdir src
cat > Cargo.toml <<'TOML'
[package]
name = "probe"
version = "0.0.0"
edition = "2021"
[dependencies]
rhai = { version = "=1.27.0", default-features = false, features = ["std"] }
TOML
cat > src/main.rs <<'RUST'
use rhai::{Array, Dynamic, Engine, ImmutableString, Scope};
use std::cell::RefCell;
use std::rc::Rc;

#[derive(Clone)]
struct ByIndexer(Rc<RefCell<Vec<String>>>);
#[derive(Clone)]
struct ByGetter(Rc<RefCell<Vec<String>>>);

fn main() {
    let log = Rc::new(RefCell::new(Vec::new()));
    let mut engine = Engine::new();
    engine
        .register_indexer_get(|e: &mut ByIndexer, name: ImmutableString| -> Array {
            e.0.borrow_mut().push(format!("read {name}"));
            vec![1.into(), 2.into()]
        })
        .register_indexer_set(|e: &mut ByIndexer, name: ImmutableString, _: Dynamic| {
            e.0.borrow_mut().push(format!("write {name}"));
        })
        .register_get("list", |e: &mut ByGetter| -> Array {
            e.0.borrow_mut().push("read list".into());
            vec![1.into(), 2.into()]
        });
    let mut scope = Scope::new();
    scope.push("a", ByIndexer(log.clone())).push("b", ByGetter(log.clone()));
    for text in ["a.list.len()", "let l = a.list; l.len()", "b.list.len()"] {
        log.borrow_mut().clear();
        let count: i64 = engine.eval_with_scope(&mut scope, text).unwrap();
        println!("{text} = {count}: {}", log.borrow().join(", "));
    }
}
RUST
cargo run --quiet > seen.txt
cat seen.txt
diff seen.txt - <<'SEEN'
a.list.len() = 2: read list, write list
let l = a.list; l.len() = 2: read list
b.list.len() = 2: read list
SEEN
