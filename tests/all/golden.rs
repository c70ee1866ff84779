//! Every frame of the three shows against its golden, to the last bit.
//!
//! `ANIM_BLESS=1 cargo test golden` renews them. What differs is left as a picture in `target/golden`.

use std::path::PathBuf;

use anim::compare::golden;

use crate::tool::Desk;

/// Renders all frames of a show, small, and compares each.
fn show(name: &str, frames: u32) {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let desk = Desk::new();
    let script = root.join("scripts").join(format!("{name}.rhai"));
    desk.anim(&format!("{} --size 64x36 --spp 4 -o frames", script.display())).ok();
    let bless = std::env::var_os("ANIM_BLESS").is_some();
    let check = |frame: u32| {
        let file = format!("{name}.{frame:04}.png");
        let golden = root.join("tests/golden").join(&file);
        golden::check(&desk.path("frames").join(&file), &golden, &root.join("target/golden"), bless).err()
    };
    let failures: Vec<String> = (1..=frames).filter_map(check).collect();
    let first = failures.iter().take(5).cloned().collect::<Vec<_>>().join("\n");
    assert!(failures.is_empty(), "{} of {frames} frames:\n{first}", failures.len());
    assert!(!desk.exists(&format!("frames/{name}.{:04}.png", frames + 1)));
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
