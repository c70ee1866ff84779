#!/usr/bin/env bash
# rhai 1.27.0: with Engine::on_map_missing_property, maps take no new keys.
# The documentation gives the hook for reads: what a property is that a map does not have. One would expect that
# `m.a = 1` and `m["b"] = 2` go on adding keys, as they do without the hook.
# What happens: the hook is asked before each of the two. What it returns is taken for the place that is written to: a
# temporary value, which is thrown away. No error is raised, and the map stays as it was.
# Consequence: a hook that suggests the nearest key of a misspelt read silently loses every key that a script adds.
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
rhai = { version = "=1.27.0", default-features = false, features = ["std", "internals"] }
TOML
cat > src/main.rs <<'RUST'
use rhai::{Dynamic, Engine};

fn main() {
    let script = r#"let m = #{ old: 0 }; m.a = 1; m["b"] = 2; m.old = 3; `${m.keys().len()} keys, old is ${m.old}`"#;
    let mut engine = Engine::new();
    println!("without: {}", engine.eval::<String>(script).unwrap());
    engine.on_map_missing_property(|_, _, _| Ok(Dynamic::UNIT.into()));
    println!("with: {}", engine.eval::<String>(script).unwrap());
}
RUST
cargo run --quiet > seen.txt
cat seen.txt
diff seen.txt - <<'SEEN'
without: 3 keys, old is 3
with: 1 keys, old is 3
SEEN
