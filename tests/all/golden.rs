//! Frames of every show against their goldens, to the last bit, with `anim test` on `tests/golden/golden.ron`.
//!
//! What differs is left as a page and as pictures in the test's folder below `target`.

use std::path::Path;
use std::process::Command;

/// Renders all frames of a show and compares each.
fn show(name: &str, frames: u32) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let new = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden").join(name);
    let run = Command::new(env!("CARGO_BIN_EXE_anim"))
        .args(["test", "tests/golden", "--render", "--only", name, "--out"])
        .arg(&new)
        .current_dir(root)
        .output()
        .unwrap();
    let (said, errors) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success(), "{said}\n{errors}");
    assert_eq!(said.trim(), format!("{frames} equal"), "{errors}");
}

#[test]
fn golden_rackfocus() {
    show("rackfocus", 48);
}

#[test]
fn golden_turntable() {
    show("turntable", 36);
}

#[test]
fn golden_lights() {
    show("lights", 48);
}

#[test]
fn golden_antialiasing() {
    show("antialiasing", 8);
}

#[test]
fn golden_boxes() {
    show("boxes", 6);
}

#[test]
fn golden_bump_and_texture() {
    show("bump", 6);
    show("texture", 6);
}

#[test]
fn golden_caustic() {
    show("caustic", 24);
}

#[test]
fn golden_cornell() {
    show("cornell", 24);
}

#[test]
fn golden_gloss_and_refraction() {
    show("gloss", 24);
    show("refraction", 24);
}

#[test]
fn golden_lens() {
    show("lens", 24);
}

#[test]
fn golden_shutter() {
    show("shutter", 32);
}

/// Shows of what is kept from frame to frame.
#[test]
fn golden_mixing_crossing_and_pedestal() {
    show("mixing", 48);
    show("crossing", 48);
    show("pedestal", 36);
    show("edit", 6);
}

/// Shows that are looked at on one sheet.
#[test]
fn golden_study_and_dolls() {
    show("study", 9);
    show("dolls", 1);
}

#[test]
fn golden_softshadows() {
    show("softshadows", 24);
}

#[test]
fn golden_stilllife() {
    show("stilllife", 24);
}

/// Goldens whose frames would be rendered though nothing changed cost their users what the hash is there to save.
#[test]
fn goldens_carry_the_hashes_of_their_frames() {
    let new = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden/unchanged");
    let run = Command::new(env!("CARGO_BIN_EXE_anim"))
        .args(["test", "tests/golden", "--out"])
        .arg(&new)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stdout);
    let is_all = said.trim().strip_suffix(" unchanged").is_some_and(|count| count.parse::<u32>().is_ok());
    assert!(run.status.success() && is_all, "{said}\naccept them again: anim test tests/golden --render --accept");
}

/// A show that nobody tests, or a golden of a frame that is no more, would go unseen.
#[test]
fn every_show_and_every_golden_is_named() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = anim::load::golden::load_golden_list(&root.join("tests/golden/golden.ron")).unwrap();
    let source = include_str!("golden.rs");
    for entry in &list.entries {
        assert!(source.contains(&format!("show(\"{}\", ", entry.name)), "no test runs {}", entry.name);
    }
    let goldens = std::fs::read_dir(root.join("tests/golden")).unwrap();
    let names = goldens.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    for name in names.filter(|name| name.ends_with(".png")) {
        let show = name.split('.').next().unwrap();
        assert!(list.entries.iter().any(|entry| entry.name == show), "{name}");
    }
}
