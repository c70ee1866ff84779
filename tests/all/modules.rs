//! Modules stand on floors, import each other in no circle, and no type name has two meanings.
//!
//! Imports are read from the text: `use` trees and paths that begin with `crate`, `super`, `self` or the name of a
//! module. What a module passes on with `pub use` counts as an import of the module that declares it.

use std::collections::{BTreeMap, BTreeSet};

use crate::house::{Source, fail_on, sources};

/// Rooms of the kernel from the top floor down; rooms on one line do not import each other.
const KERNEL: &[&[&str]] = &[
    &["integrator"],
    &["wavefront"],
    &["light"],
    &["material", "reuse"],
    &["accel"],
    &["primitive", "camera"],
    &["soa", "sampler"],
    &["simd", "counters"],
];

/// Circles that are still there, by any one module of each: this list may only shrink.
const CIRCLES: &[(&str, &str)] = &[
    ("cli", "commands share the exit codes and the printing of the module that calls them"),
    ("load::ron", "errors are explained with the options that the reader was given"),
    ("script", "the engine and its functions share errors and conversions"),
    ("shot", "planning and running share the shot that they are parts of"),
    ("systems::stage", "the stage keeps values of the systems that work on it"),
];

type Path = Vec<String>;

/// One file of the crate as a module.
struct Module {
    /// Imports and other paths into the crate, as they are written.
    paths: BTreeSet<Path>,
    /// What is passed on under a name.
    exports: BTreeMap<String, Path>,
}

/// Every path of a `use` tree; the last word is the name that is imported.
fn flatten(tree: &str, prefix: &[String], found: &mut Vec<Path>) {
    let tree = tree.trim();
    let words =
        |text: &str| -> Path { text.split("::").map(str::trim).filter(|w| !w.is_empty()).map(String::from).collect() };
    if let Some((head, inner)) = tree.split_once('{') {
        let prefix: Path = prefix.iter().cloned().chain(words(head)).collect();
        let (mut depth, mut start) = (0, 0);
        let inner = inner.strip_suffix('}').unwrap_or(inner);
        for (i, c) in inner.char_indices().chain([(inner.len(), ',')]) {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    flatten(&inner[start..i], &prefix, found);
                    start = i + 1;
                }
                _ => {}
            }
        }
    } else if !tree.is_empty() {
        let path: Path = prefix.iter().cloned().chain(words(tree.split(" as ").next().unwrap_or(tree))).collect();
        found.push(if path.last().is_some_and(|word| word == "self") { path[..path.len() - 1].to_vec() } else { path });
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Paths of two words or more in code.
fn written_paths(code: &str) -> BTreeSet<Path> {
    let mut found = BTreeSet::new();
    for piece in code.split(|c| !is_word(c) && c != ':') {
        let words: Path = piece.split("::").map(String::from).collect();
        if words.len() > 1 && words.iter().all(|word| !word.is_empty() && word.chars().all(is_word)) {
            found.insert(words);
        }
    }
    found
}

fn module(source: &Source) -> Module {
    let text: String = source.code().flat_map(|(_, line)| [line, "\n"]).collect();
    let (mut rest, mut exports, mut imports) = (String::new(), BTreeMap::new(), Vec::new());
    for statement in text.split_inclusive(';') {
        let at = statement.rfind("use ").filter(|at| *at == 0 || statement[..*at].ends_with(['\n', ' ']));
        let Some(at) = at.filter(|_| statement.ends_with(';')) else {
            rest.push_str(statement);
            continue;
        };
        let line_start = statement[..at].rfind('\n').map_or(0, |i| i + 1);
        let before = statement[line_start..at].trim();
        if !before.is_empty() && !before.starts_with("pub") {
            rest.push_str(statement);
            continue;
        }
        rest.push_str(&statement[..line_start]);
        let mut paths = Vec::new();
        flatten(statement[at + 4..].trim_end_matches(';'), &[], &mut paths);
        if before.is_empty() {
            imports.extend(paths);
        } else {
            exports.extend(paths.into_iter().filter_map(|path| Some((path.last()?.clone(), path))));
        }
    }
    let names: BTreeMap<&String, &Path> = imports.iter().filter_map(|path| Some((path.last()?, path))).collect();
    let mut paths: BTreeSet<Path> = imports.iter().cloned().collect();
    for path in written_paths(&rest) {
        match names.get(&path[0]) {
            Some(imported) => paths.insert(imported.iter().chain(&path[1..]).cloned().collect()),
            None => paths.insert(path),
        };
    }
    Module { paths, exports }
}

/// The modules of the crate by their path, without those that hold nothing but tests.
fn modules() -> BTreeMap<Path, Module> {
    let mut modules = BTreeMap::new();
    for source in sources() {
        let text = source.path.to_string_lossy().replace('\\', "/");
        let below = text.rsplit_once("/src/").map_or(&*text, |(_, below)| below);
        let mut path: Path = below.trim_end_matches(".rs").split('/').map(String::from).collect();
        match path.last().map(String::as_str) {
            Some("mod" | "lib") => drop(path.pop()),
            Some("tests") => continue,
            _ => {}
        }
        modules.insert(path, module(&source));
    }
    modules
}

/// The module that declares what a path names.
fn resolve(modules: &BTreeMap<Path, Module>, from: &Path, path: &[String], depth: usize) -> Option<Path> {
    let supers = path.iter().take_while(|word| *word == "super").count();
    let is_module = |at: &[String]| modules.contains_key(at);
    let (mut at, mut rest) = match path.first()?.as_str() {
        "crate" => (Vec::new(), &path[1..]),
        "self" => (from.clone(), &path[1..]),
        "super" => (from[..from.len().checked_sub(supers)?].to_vec(), &path[supers..]),
        first if is_module(&[from.as_slice(), &[first.to_string()]].concat()) => (from.clone(), path),
        _ => return None,
    };
    while let Some(next) =
        rest.first().map(|word| [at.as_slice(), std::slice::from_ref(word)].concat()).filter(|at| is_module(at))
    {
        (at, rest) = (next, &rest[1..]);
    }
    let passed_on = rest.first().and_then(|name| modules.get(&at)?.exports.get(name));
    let further = passed_on.filter(|_| depth < 8).and_then(|to| {
        let to: Path = to.iter().chain(&rest[1..]).cloned().collect();
        resolve(modules, &at, &to, depth + 1)
    });
    Some(further.unwrap_or(at))
}

/// What each module imports.
fn imports() -> BTreeMap<Path, BTreeSet<Path>> {
    let modules = modules();
    let of = |(from, module): (&Path, &Module)| {
        let found = module.paths.iter().filter_map(|path| resolve(&modules, from, path, 0));
        (from.clone(), found.filter(|to| to != from).collect())
    };
    modules.iter().map(of).collect()
}

/// Modules that can be reached from each.
fn reachable(imports: &BTreeMap<Path, BTreeSet<Path>>) -> BTreeMap<&Path, BTreeSet<&Path>> {
    let from = |start| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(at) = open.pop() {
            open.extend(imports.get(at).into_iter().flatten().filter(|to| seen.insert(*to)));
        }
        seen
    };
    imports.keys().map(|start| (start, from(start))).collect()
}

#[test]
fn no_modules_import_each_other_in_a_circle() {
    let imports = imports();
    let reachable = reachable(&imports);
    let mut circles: BTreeSet<Vec<String>> = BTreeSet::new();
    for (module, seen) in reachable.iter().filter(|(module, seen)| seen.contains(*module)) {
        let circle = seen.iter().filter(|other| reachable[**other].contains(module));
        circles.insert(circle.map(|path| path.join("::")).collect());
    }
    let is_known = |circle: &Vec<String>| CIRCLES.iter().any(|(name, _)| circle.iter().any(|module| module == name));
    let new =
        circles.iter().filter(|circle| !is_known(circle)).map(|circle| format!("a circle: {}", circle.join(", ")));
    let is_gone = |name: &str| !circles.iter().any(|circle| circle.iter().any(|module| module == name));
    let gone = CIRCLES.iter().filter(|(name, _)| is_gone(name)).map(|(name, _)| format!("no circle is left at {name}"));
    fail_on(new.chain(gone).collect());
}

#[test]
fn rooms_of_the_kernel_import_down_their_floors() {
    let floor = |room: &str| KERNEL.iter().position(|rooms| rooms.contains(&room));
    let room = |path: &Path| Some(path).filter(|path| path.len() > 1 && path[0] == "trace").map(|path| path[1].clone());
    let mut problems = Vec::new();
    for (from, to) in imports() {
        let Some(here) = room(&from) else { continue };
        let Some(below) = floor(&here) else {
            problems.push(format!("trace/{here} is on no floor"));
            continue;
        };
        for there in to.iter().filter_map(room).filter(|there| *there != here) {
            if floor(&there).is_none_or(|there| there <= below) {
                problems.push(format!("{} imports trace/{there}", from.join("::")));
            }
        }
    }
    fail_on(problems);
}
