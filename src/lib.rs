//! anim renders animated 3D sequences from text.
//!
//! A scene is a RON file, an animation is a Rhai script, a frame is a build product. Frame N is a pure function of
//! (scene, script, assets, settings, N): the same input gives the same bytes on any number of threads, in any order.
//!
//! # The map of this house
//!
//! One package, a library and a thin binary. Imports go down the page only; rooms on one floor do not import each
//! other. `tests/all/house.rs` and `tests/all/modules.rs` hold the code to this.
//!
//! | room | what happens there |
//! |---|---|
//! | [`cli`] | one file per command; raw flags are resolved once, here; the only place that prints |
//! | [`guide`] | the reference: pages from the tables of fields and functions, as text, HTML and JSON |
//! | [`farm`] | many machines: archives of shots, jobs for schedulers, claims of workers, what a folder of frames lacks |
//! | [`preview`] | files that are watched, and the page of `anim preview` (feature `preview`) |
//! | [`shot`] | a sequence: its frames as data and as digests, plan, what is kept, shared and copied, run |
//! | [`compare`] | image metrics (FLIP), golden frames, reports, the viewer of pictures for pages |
//! | [`systems`] | plain functions over the hecs World: spawn animate hierarchy lights extract accelerate render |
//! | [`script`] | Rhai engine and API; time, easing, keyframes; emits edits as data |
//! | [`load`] | RON, NFF, P3F, AFF, glTF, OBJ, PLY, STL, images -> one resolved scene, with diagnostics; scenes -> RON |
//! | [`output`] | PNG and EXR with metadata, films, sheets, frame names, manifests, what is there already, atomic writes |
//! | [`trace`] | the kernel: columns of primitives, accelerators, SIMD, materials, textures, lights, integrators, samplers |
//! | [`film`] | linear pixels and layers: accumulate, filter, denoise, expose and tone map |
//! | [`components`] | what an entity can carry; the scene and its edits as plain data |
//! | [`base`] | exact mathematics, random numbers, digests, colour, limits, diagnostics |
//!
//! # Data flow
//!
//! Once: files -> `load` -> [`components::Scene`] + diagnostics -> `systems::spawn` -> World; then all frames to digests
//! (`shot::plan`), so that it is known which of them are done, alike, or differ in little.
//! Per frame that is left, and per moment of an open shutter: rest values -> the script's `frame` ->
//! [`components::Edit`]s -> `animate` -> `hierarchy` -> `lights` -> `extract` (columns) -> `accelerate` -> `render`
//! (tiles) -> `film` -> `output`.
//!
//! `ARCHITECTURE.md` follows a frame phase by phase, says what always holds, and what to touch to add something.
//!
//! # Glossary
//!
//! Words of the field mean here what they mean in *Physically Based Rendering*. These are the others, or narrower.
//!
//! | word | meaning |
//! |---|---|
//! | accumulator | sums over the samples of pixels, before they are resolved into means ([`film::PixelAccumulator`]) |
//! | asset | a file that a scene names; it counts by its content |
//! | authored order | the order of entities and materials in the scene, spawned ones behind; an *authored index* counts in it |
//! | base scene | what `setup` leaves: every frame starts from it |
//! | column | one field of many work items or primitives, side by side in memory |
//! | edit | one change to a scene, as data ([`components::Edit`]) |
//! | fingerprint | a frame as digests of its parts, without rendering it ([`shot::fingerprint`]) |
//! | footprint | which tracked bounds the rays of a sample crossed ([`trace::reuse`]) |
//! | light group | the light of one emitter, or of all the rest, in a film of its own ([`systems::LightGroups`]) |
//! | light mix | frames that are weighted sums of the same light groups ([`shot::reuse::light_mix`]) |
//! | moment, slice | one instant of a frame with an open shutter, and its share of the samples ([`shot::Slice`]) |
//! | overlay | what a script has changed so far, over the base scene |
//! | picture version | a number that rises when the program makes other pixels or bytes ([`shot::fingerprint::PICTURES`]) |
//! | placement | the map from an entity's local space to the world |
//! | plan | every wanted frame as data, with what is there of it already ([`shot::plan`]) |
//! | provenance | what a picture's file says of its making ([`output::Provenance`]) |
//! | reuse window | frames in a row that differ in objects of finite size alone, before one camera ([`shot::reuse::static_camera`]) |
//! | shot | one input, a script with its scene or a scene alone, opened ([`shot::Shot`]) |
//! | stage | the hecs World with what goes with it ([`systems::Stage`]) |
//! | World | the single truth about the scene while a frame is made: entities with components |
//!
//! # An example
//!
//! A scene is data, wherever it comes from; [`systems`] make a picture of it.
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//!
//! use anim::components::{EntityDesc, PointLight, Render, Scene, Sphere};
//! use anim::systems;
//!
//! let render = Render { size: [16, 9], samples: 4, ..Render::default() };
//! let entities = vec![EntityDesc::new([Sphere::default().into()]), EntityDesc::new([PointLight::default().into()])];
//! let mut stage = systems::spawn(Scene { render, entities, ..Scene::default() })?;
//! let never = AtomicBool::new(false);
//! let (film, stats) = systems::render(&mut stage, &never, &|_done, _total| {})?.expect("nobody interrupts");
//! assert_eq!((film.width, film.height), (16, 9));
//! assert!(stats.counters.primary_hits > 0);
//! # Ok::<(), anim::base::diagnostics::Diagnostics>(())
//! ```

// Only `trace::simd`, the room with processor instructions in it, may.
#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod base;
pub mod cli;
#[warn(clippy::wildcard_enum_match_arm)]
pub mod compare;
#[warn(clippy::wildcard_enum_match_arm)] // What is added later must be named by the compiler, not forgotten.
pub mod components;
pub mod farm;
#[warn(clippy::wildcard_enum_match_arm)]
pub mod film;
pub mod guide;
pub mod load;
#[warn(clippy::wildcard_enum_match_arm)]
pub mod output;
#[cfg(feature = "preview")]
pub mod preview;
pub mod script;
#[warn(clippy::wildcard_enum_match_arm)]
pub mod shot;
#[warn(clippy::wildcard_enum_match_arm)]
pub mod systems;
pub mod trace;
