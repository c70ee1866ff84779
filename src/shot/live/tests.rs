//! Edits, and what is kept from one to the next.

use super::*;
use crate::film::DisplayTransform;
use crate::output::names;
use crate::shot::{self, OpenOptions, plan};

const STAGE: &str = r#"(
    camera: (from: (0.0, 1.0, 5.0), at: (0.0, 0.5, 0.0)),
    render: (size: (48, 27), samples: 9, integrator: Path, max_depth: 3, background: (0.1, 0.1, 0.2)),
    materials: { "brass": (color: (0.9, 0.7, 0.4)), "slate": (color: (0.2, 0.3, 0.4)) },
    entities: [
        (name: "ball", sphere: (radius: 0.4), transform: (translation: (-1.0, 0.5, 0.0)), material: "brass"),
        (name: "cube", aabox: (min: (1.2, 0.0, -1.0), max: (2.0, 0.8, 0.0)), material: "slate"),
        (name: "floor", plane: (), material: "slate"),
        (name: "key", area_light: (size: (1.0, 1.0), color: (3.0, 2.5, 2.0)), transform: (translation: (3.0, 4.0, 2.0))),
    ],
)"#;

/// A scene on a disk, opened again after every edit by somebody who keeps what can be kept.
struct LiveDesk {
    folder: tempfile::TempDir,
    cache: LiveCache,
    shot: Option<Shot>,
}

impl LiveDesk {
    fn new() -> LiveDesk {
        let folder = tempfile::tempdir().unwrap();
        let script = "animation(#{ scene: \"stage.ron\", fps: 12, frames: 3, mode: \"clip\" });\n\
                      fn frame(s, f) { s.camera.from = [f.t, 1.0, 5.0]; }";
        std::fs::write(folder.path().join("show.rhai"), script).unwrap();
        LiveDesk { folder, cache: LiveCache::new(ReusePolicy { reuse: true, memory: 64 }), shot: None }
    }

    fn edit(&mut self, scene: &str) {
        std::fs::write(self.folder.path().join("stage.ron"), scene).unwrap();
        let input = self.folder.path().join("show.rhai");
        let (mut shot, _) = shot::open_with(&input, OpenOptions::default()).unwrap();
        if let Some(before) = self.shot.take() {
            shot.adopt(before, true);
        }
        self.shot = Some(shot);
    }

    fn planned(&mut self, frame: u32) -> PlannedFrame {
        let target = names::resolve(None, "show", Some(3), 3).unwrap();
        plan::make(self.shot.as_mut().unwrap(), &[1, 2, 3], target).unwrap().frames.swap_remove(frame as usize - 1)
    }

    fn picture(&mut self, frame: u32, viewer: LiveViewer) -> LivePicture {
        let planned = self.planned(frame);
        let never = AtomicBool::new(false);
        self.shot.as_mut().unwrap().live_picture(&planned, &mut self.cache, viewer, &never).unwrap().unwrap()
    }

    fn seen(&mut self) -> LivePicture {
        self.picture(1, LiveViewer::Eye(None))
    }

    /// As [`Self::seen`], with nothing that is known from before.
    fn fresh(scene: &str) -> LivePicture {
        let mut desk = LiveDesk::new();
        desk.edit(scene);
        desk.seen()
    }
}

#[test]
fn an_edit_costs_what_it_touches_whatever_was_rendered_ahead() {
    let mut desk = LiveDesk::new();
    desk.edit(STAGE);
    assert_eq!(desk.seen().stats.builds, 1);
    desk.picture(2, LiveViewer::Ahead);
    desk.picture(3, LiveViewer::Ahead);
    let painted = STAGE.replace("(0.9, 0.7, 0.4)", "(0.2, 0.8, 0.3)");
    desk.edit(&painted);
    let picture = desk.seen();
    assert!(picture.stats.share_kept > 0.4, "{}", picture.stats.share_kept);
    assert_eq!(picture.stats.builds, 0);
    assert!(picture.film == LiveDesk::fresh(&painted).film);
    let moved = painted.replace("(1.2, 0.0, -1.0)", "(1.3, 0.0, -1.0)");
    desk.edit(&moved);
    let picture = desk.seen();
    assert!(picture.stats.share_kept > 0.1 && picture.film == LiveDesk::fresh(&moved).film);
    assert!(desk.cache.bytes() > 0 && desk.cache.bytes() < 64 << 20);
}

#[test]
fn a_lamp_is_relit_from_what_each_emitter_gives() {
    let mut desk = LiveDesk::new();
    let never = AtomicBool::new(false);
    desk.edit(STAGE);
    desk.seen();
    let planned = desk.planned(1);
    assert!(desk.cache.lacks_emitters(&planned));
    assert!(desk.shot.as_mut().unwrap().know_emitters(&planned, &mut desk.cache, &never).unwrap());
    assert!(!desk.cache.lacks_emitters(&planned));
    let relit = STAGE.replace("(3.0, 2.5, 2.0)", "(1.0, 2.0, 4.0)").replace("(0.1, 0.1, 0.2)", "(0.3, 0.05, 0.1)");
    desk.edit(&relit);
    let mixed = desk.shot.as_mut().unwrap().relight(1, &[], &desk.cache).unwrap().unwrap();
    let exact = desk.seen();
    let bytes = |picture: &LivePicture| picture.film.to_rgb8(DisplayTransform::new(&picture.render));
    let apart = bytes(&mixed).iter().zip(bytes(&exact)).map(|(a, b)| a.abs_diff(b)).max();
    assert!(apart <= Some(1), "{apart:?}");
    // The same colours again, with the picture that is now known; and an edit of something else.
    desk.edit(STAGE);
    assert!(desk.shot.as_mut().unwrap().relight(1, &[], &desk.cache).unwrap().is_some());
    desk.edit(&relit.replace("radius: 0.4", "radius: 0.5"));
    assert!(desk.shot.as_mut().unwrap().relight(1, &[], &desk.cache).unwrap().is_none());
}
