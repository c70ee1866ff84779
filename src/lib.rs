//! anim renders animated 3D sequences from text.
//!
//! A scene is a RON file, an animation is a Rhai script, a frame is a build product. Frame N is a pure function of
//! (scene, script, assets, settings, N): the same input gives the same bytes on any number of threads, in any order.
//!
//! # The map of this house
//!
//! One package, a library and a thin binary. Imports go down the page only; rooms on one floor do not import each
//! other. `tests/house.rs` holds the code to this.
//!
//! | room | what happens there |
//! |---|---|
//! | [`cli`] | one file per command; raw flags are resolved once, here; the only place that prints |
//! | [`shot`] | a sequence: its frames as data and as digests, plan, what is kept, shared and copied, run |
//! | [`compare`] | image metrics (FLIP), golden frames, reports, the viewer of pictures for pages |
//! | [`systems`] | plain functions over the hecs World: spawn animate hierarchy lights extract accelerate render |
//! | [`script`] | Rhai engine and API; time, easing, keyframes; emits edits as data |
//! | [`load`] | RON, NFF, P3F, OBJ, PLY, images -> one resolved scene, with diagnostics; scenes -> RON |
//! | [`output`] | PNG and EXR with metadata, frame names, manifests, what is there already, atomic writes |
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

// Only `trace::simd`, the room with processor instructions in it, may.
#![deny(unsafe_code)]

pub mod base;
pub mod cli;
pub mod compare;
pub mod components;
pub mod film;
pub mod load;
pub mod output;
pub mod script;
pub mod shot;
pub mod systems;
pub mod trace;
