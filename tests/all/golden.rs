//! Frames of the shows against their goldens, to the last bit: every frame of the first three, every fourth of the
//! figures of the gallery.
//!
//! `ANIM_BLESS=1 cargo test golden` renews them. What differs is left as a picture in `target/golden`.

use std::path::PathBuf;

use anim::compare::golden;

use crate::tool::Desk;

/// Renders every `step`-th of the frames of a show, small, and compares each.
fn show(name: &str, frames: u32, step: u32, arguments: &str) {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let desk = Desk::new();
    let script = root.join("scripts").join(format!("{name}.rhai"));
    desk.anim(&format!("{} --size 64x36 -o frames --frames 1-{frames}x{step} {arguments}", script.display())).ok();
    let bless = std::env::var_os("ANIM_BLESS").is_some();
    let check = |frame: u32| {
        let file = format!("{name}.{frame:04}.png");
        let golden = root.join("tests/golden").join(&file);
        golden::check(&desk.path("frames").join(&file), &golden, &root.join("target/golden"), bless).err()
    };
    let wanted = || (1..=frames).step_by(step as usize);
    let failures: Vec<String> = wanted().filter_map(check).collect();
    let first = failures.iter().take(5).cloned().collect::<Vec<_>>().join("\n");
    assert!(failures.is_empty(), "{} of {} frames:\n{first}", failures.len(), wanted().count());
    assert!(!desk.exists(&format!("frames/{name}.{:04}.png", frames + 1)));
}

/// A figure of the gallery.
fn figure(name: &str, frames: u32, arguments: &str) {
    show(name, frames, 4, arguments);
}

#[test]
fn golden_rackfocus() {
    show("rackfocus", 48, 1, "--spp 4");
}

#[test]
fn golden_turntable() {
    show("turntable", 36, 1, "--spp 4");
}

#[test]
fn golden_lights() {
    show("lights", 48, 1, "--spp 4");
}

#[test]
fn golden_antialiasing() {
    figure("antialiasing", 8, "");
}

#[test]
fn golden_boxes() {
    figure("boxes", 24, "--spp 4");
}

#[test]
fn golden_bump_and_texture() {
    figure("bump", 24, "--spp 4");
    figure("texture", 24, "-D samples=4");
}

#[test]
fn golden_caustic() {
    figure("caustic", 24, "--spp 4 -D photons=4000");
}

#[test]
fn golden_cornell() {
    figure("cornell", 24, "--spp 4");
}

#[test]
fn golden_gloss_and_refraction() {
    figure("gloss", 24, "--spp 4");
    figure("refraction", 24, "--spp 4");
}

#[test]
fn golden_lens() {
    figure("lens", 24, "--spp 4");
}

#[test]
fn golden_shutter() {
    figure("shutter", 32, "--spp 4");
}

/// Shows of what is kept from frame to frame.
#[test]
fn golden_mixing_crossing_and_pedestal() {
    show("mixing", 48, 6, "--spp 4");
    show("crossing", 48, 6, "--spp 4");
    show("pedestal", 36, 6, "--spp 4");
}

#[test]
fn golden_softshadows() {
    figure("softshadows", 24, "-D samples=4");
}

#[test]
fn golden_stilllife() {
    figure("stilllife", 24, "--spp 4");
}
