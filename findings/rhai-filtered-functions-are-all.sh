#!/usr/bin/env bash
# rhai 1.27.0: AST::clone_functions_only_filtered gives all functions of a script, whatever its filter says.
# One would expect: of `fn setup` and `fn frame`, a filter for "frame" keeps `frame`, as the documentation's example says.
# What happens: both are kept. The new module has no functions yet, and in that case those of the other are taken over
# without asking the filter; only a module that has some merges by it. The example of the documentation does not see it:
# the function that it asks for is the only one that it calls.
# AST::retain_functions with the same filter, on a copy, keeps `frame` alone.
# Consequence: bodies that are taken from "the" function of the result run together with those of all others.
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
use rhai::{Engine, AST};

fn names(ast: &AST) -> String {
    let mut names: Vec<&str> = ast.iter_functions().map(|function| function.name).collect();
    names.sort();
    names.join(" ")
}

fn main() {
    let ast = Engine::new().compile("fn setup(s) { s } fn frame(s, f) { f } fn helper() { 1 }").unwrap();
    println!("filtered: {}", names(&ast.clone_functions_only_filtered(|_, _, _, name, _| name == "frame")));
    let mut copy = ast.clone_functions_only();
    copy.retain_functions(|_, _, name, _| name == "frame");
    println!("retained: {}", names(&copy));
}
RUST
cargo run --quiet > seen.txt
cat seen.txt
diff seen.txt - <<'SEEN'
filtered: frame helper setup
retained: frame
SEEN
