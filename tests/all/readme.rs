//! The pictures of the README are what its commands give.

use std::path::{Path, PathBuf};
use std::process::Command;

use anim::base::digest::Hasher;
use serde_json::Value;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn anim(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_anim")).args(arguments).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The first picture is a sheet, which knows the hashes of the frames that it was made of. Those of the script as it is
/// now, with the program as it is now, are the same: what stands beside the picture makes it.
#[test]
fn the_first_picture_is_what_the_command_below_it_gives() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let command =
        readme.lines().find_map(|line| line.trim().strip_prefix("anim sheet scripts/rackfocus.rhai")).unwrap();
    let words: Vec<&str> = command.split_whitespace().collect();
    let after = |option: &str| words.iter().skip_while(|word| **word != option).nth(1).copied().unwrap();
    let picture = after("-o");
    assert!(readme.contains(&format!("]({picture})")) && Path::new(&root().join(picture)).exists());
    let plan = anim(&["plan", "scripts/rackfocus.rhai", "--frames", after("--frames"), "--json"]);
    let mut hasher = Hasher::default();
    for line in plan.lines() {
        let frame: Value = serde_json::from_str(line).unwrap();
        hasher.text(frame["hash"].as_str().unwrap());
    }
    let expected = hasher.finish().to_string();
    let found = anim(&["info", picture]);
    assert!(found.contains(&expected), "make it again: anim sheet scripts/rackfocus.rhai{command}\n{found}");
}
