//! Every frame of every show against its golden, to the last bit.
//!
//! `ANIM_BLESS=1 cargo test golden` renews them. What differs is left as a picture in `target/golden`.

use std::path::PathBuf;

use anim::compare::golden;

use crate::tool::Sandbox;

/// Renders all frames of a show, small, and compares each.
fn show(name: &str, frames: u32, arguments: &str) {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let sandbox = Sandbox::new();
    let script = root.join("scripts").join(format!("{name}.rhai"));
    sandbox.anim(&format!("{} --size 64x36 -o frames {arguments}", script.display())).ok();
    let bless = std::env::var_os("ANIM_BLESS").is_some();
    let check = |frame: u32| {
        let file = format!("{name}.{frame:04}.png");
        let golden = root.join("tests/golden").join(&file);
        golden::check(&sandbox.path("frames").join(&file), &golden, &root.join("target/golden"), bless).err()
    };
    let failures: Vec<String> = (1..=frames).filter_map(check).collect();
    let first = failures.iter().take(5).cloned().collect::<Vec<_>>().join("\n");
    assert!(failures.is_empty(), "{} of {frames} frames:\n{first}", failures.len());
    assert!(!sandbox.exists(&format!("frames/{name}.{:04}.png", frames + 1)));
}

#[test]
fn golden_rackfocus() {
    show("rackfocus", 48, "--spp 4");
}

#[test]
fn golden_turntable() {
    show("turntable", 36, "--spp 4");
}

#[test]
fn golden_lights() {
    show("lights", 48, "--spp 4");
}

#[test]
fn golden_antialiasing() {
    show("antialiasing", 8, "");
}

#[test]
fn golden_boxes() {
    show("boxes", 24, "--spp 4");
}

#[test]
fn golden_bump_and_texture() {
    show("bump", 24, "--spp 4");
    show("texture", 24, "-D samples=4");
}

#[test]
fn golden_caustic() {
    show("caustic", 24, "--spp 4 -D photons=4000");
}

#[test]
fn golden_cornell() {
    show("cornell", 24, "--spp 4");
}

#[test]
fn golden_gloss_and_refraction() {
    show("gloss", 24, "--spp 4");
    show("refraction", 24, "--spp 4");
}

#[test]
fn golden_lens() {
    show("lens", 24, "--spp 4");
}

#[test]
fn golden_shutter() {
    show("shutter", 32, "--spp 4");
}

/// Shows of what is kept from frame to frame.
#[test]
fn golden_mixing_crossing_and_pedestal() {
    show("mixing", 48, "--spp 4");
    show("crossing", 48, "--spp 4");
    show("pedestal", 36, "--spp 4");
}

#[test]
fn golden_softshadows() {
    show("softshadows", 24, "-D samples=4");
}

#[test]
fn golden_stilllife() {
    show("stilllife", 24, "--spp 4");
}
