//! Idioms of scripts, each as a test.
//!
//! A script is opened by [`shot::open`](crate::shot::open); `scene` below is what the World is in one of its frames.
//!
//! # Building by procedure
//!
//! `setup` runs once; every frame starts from what it left. A component is a map of its fields, and integers do where
//! numbers are meant.
//!
//! ```
//! # use anim::components::*;
//! # use anim::shot::{self, Overrides};
//! # use glam::DVec3;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let script = r#"
//!     animation(#{ frames: 2 });
//!     fn setup(s) {
//!         s.add_material("brass", #{ color: [0.9, 0.7, 0.4], specular: 0.6 });
//!         for i in 0..12 {
//!             s.spawn(#{ sphere: #{ radius: 0.2 }, translation: polar(3, i * 30), material: "brass", tags: ["ring"] });
//!         }
//!     }
//!     fn frame(s, f) {
//!         for ball in s.tagged("ring") { ball.translation.y = f.t; }
//!     }
//! "#;
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("show.rhai");
//! # std::fs::write(&path, script)?;
//! # let opened = shot::open(&path, &[], false, Overrides::default());
//! # let (mut shot, _) = opened.map_err(|problems| problems.to_string())?;
//! # let scene = shot.scene_of(2).map_err(|problems| problems.to_string())?;
//! assert_eq!((scene.entities.len(), scene.materials.len()), (12, 1));
//! let transform = scene.entities[3].component::<Transform>().unwrap();
//! assert_eq!(transform.translation, DVec3::new(0.0, 1.0, -3.0));
//! # Ok(())
//! # }
//! ```
//!
//! # Time
//!
//! A clip runs from `f.t` = 0 to 1, both reached; a loop comes round before it reaches 1. `f.span` is a ramp between two
//! times, `ease` bends it, `keys` holds values at times.
//!
//! ```
//! # use anim::components::*;
//! # use anim::shot::{self, Overrides};
//! # use glam::DVec3;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let script = r#"
//!     animation(#{ frames: 5, mode: "clip" });
//!     fn frame(s, f) {
//!         s.camera.fov = lerp(20, 40, ease("in_out_cubic", f.span(0.25, 0.75)));
//!         s.camera.from = orbit([0, 1, 0], 4.0, f.t);
//!         s.render.exposure = keys([[0.0, 0], [0.5, 2, "in_quad"], [1.0, 0]], f.t);
//!     }
//! "#;
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("show.rhai");
//! # std::fs::write(&path, script)?;
//! # let opened = shot::open(&path, &[], false, Overrides::default());
//! # let (mut shot, _) = opened.map_err(|problems| problems.to_string())?;
//! # let scene = shot.scene_of(3).map_err(|problems| problems.to_string())?;
//! assert!((scene.camera.fov - 30.0).abs() < 1e-12);
//! assert!(scene.camera.from.distance(DVec3::new(-4.0, 1.0, 0.0)) < 1e-9);
//! assert_eq!(scene.render.exposure, 2.0);
//! # Ok(())
//! # }
//! ```
//!
//! # Entities
//!
//! An entity is found by its name; its transform's fields, angles, light colour and components are its properties. Assigning
//! `()` takes a component off.
//!
//! ```
//! # use anim::components::*;
//! # use anim::shot::{self, Overrides};
//! # use glam::DVec3;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let script = r#"
//!     animation(#{ frames: 1 });
//!     fn setup(s) {
//!         s.spawn(#{ name: "key", area_light: #{ size: [1, 1] }, translation: [0, 3, 0] });
//!         s.spawn(#{ name: "hero", cone: #{} });
//!     }
//!     fn frame(s, f) {
//!         s.get("key").color = s.get("key").color * 3;
//!         s.get("hero").yaw = 90;
//!         s.get("hero").parent = "key";
//!         s.get("hero").cone = ();
//!         s.get("hero").sphere = #{ radius: 0.5 };
//!         if s.has("nobody") { s.despawn(s.get("nobody")); }
//!     }
//! "#;
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("show.rhai");
//! # std::fs::write(&path, script)?;
//! # let opened = shot::open(&path, &[], false, Overrides::default());
//! # let (mut shot, _) = opened.map_err(|problems| problems.to_string())?;
//! # let scene = shot.scene_of(1).map_err(|problems| problems.to_string())?;
//! let (key, hero) = (&scene.entities[0], &scene.entities[1]);
//! assert_eq!(key.component::<AreaLight>().unwrap().color, DVec3::splat(3.0));
//! assert_eq!(hero.component::<Transform>().unwrap().rotation.y, 90.0);
//! assert!(hero.get(Kind::Cone).is_none() && hero.get(Kind::Sphere).is_some());
//! # Ok(())
//! # }
//! ```
//!
//! # Focus
//!
//! A rack turns the focus ring: evenly in 1 / distance, from one subject to another.
//!
//! ```
//! # use anim::components::*;
//! # use anim::shot::{self, Overrides};
//! # use glam::DVec3;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let script = r#"
//!     animation(#{ frames: 3 });
//!     fn setup(s) {
//!         s.camera.from = [0, 0, 10];
//!         s.spawn(#{ name: "near", sphere: #{}, translation: [0, 0, 8] });
//!         s.spawn(#{ name: "far", sphere: #{}, translation: [0, 0, 2] });
//!     }
//!     fn frame(s, f) { s.camera.focus_distance = rack("near", "far", f.t); }
//! "#;
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("show.rhai");
//! # std::fs::write(&path, script)?;
//! # let opened = shot::open(&path, &[], false, Overrides::default());
//! # let (mut shot, _) = opened.map_err(|problems| problems.to_string())?;
//! # let scene = shot.scene_of(2).map_err(|problems| problems.to_string())?;
//! // 2 and 8 units away: half way lies 1 / ((1/2 + 1/8) / 2) away.
//! assert!((scene.camera.focus_distance.unwrap() - 3.2).abs() < 1e-12);
//! # Ok(())
//! # }
//! ```
//!
//! # Parameters and chance
//!
//! A parameter has a default and is given by `-D name=value`. Random numbers come from a generator of the script or the
//! frame; they are the same in every run.
//!
//! ```
//! # use anim::components::*;
//! # use anim::shot::{self, Overrides};
//! # use glam::DVec3;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let script = r#"
//!     animation(#{ frames: 1, seed: 7 });
//!     fn frame(s, f) {
//!         for i in 0..param("count", 5) {
//!             s.spawn(#{ sphere: #{ radius: f.rng.range(0.1, 0.3) }, translation: 3 * f.rng.unit_vector() });
//!         }
//!     }
//! "#;
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("show.rhai");
//! # std::fs::write(&path, script)?;
//! # let opened = shot::open(&path, &[("count".into(), "8".into())], false, Overrides::default());
//! # let (mut shot, _) = opened.map_err(|problems| problems.to_string())?;
//! # let scene = shot.scene_of(1).map_err(|problems| problems.to_string())?;
//! assert_eq!(scene.entities.len(), 8);
//! let again = shot.scene_of(1).map_err(|problems| problems.to_string())?;
//! assert_eq!(scene, again);
//! # Ok(())
//! # }
//! ```
