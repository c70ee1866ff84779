//! All integration tests, in one binary.

#[path = "all/alpha.rs"]
mod alpha;
#[path = "all/assets.rs"]
mod assets;
#[path = "all/cameras.rs"]
mod cameras;
#[path = "all/diff.rs"]
mod diff;
#[path = "all/errors.rs"]
mod errors;
#[path = "all/exact.rs"]
mod exact;
#[path = "all/far.rs"]
mod far;
#[path = "all/farm.rs"]
mod farm;
#[path = "all/film.rs"]
mod film;
#[path = "all/films.rs"]
mod films;
#[path = "all/fog.rs"]
mod fog;
#[path = "all/geometry.rs"]
mod geometry;
#[path = "all/gltf.rs"]
mod gltf;
#[path = "all/gltf_file.rs"]
mod gltf_file;
#[path = "all/golden.rs"]
mod golden;
#[path = "all/hostile.rs"]
mod hostile;
#[path = "all/house.rs"]
mod house;
#[path = "all/light.rs"]
mod light;
#[path = "all/memory.rs"]
mod memory;
#[path = "all/mistakes.rs"]
mod mistakes;
#[path = "all/modules.rs"]
mod modules;
#[path = "all/motion.rs"]
mod motion;
#[path = "all/oracles.rs"]
mod oracles;
#[path = "all/photon.rs"]
mod photon;
#[path = "all/preview.rs"]
mod preview;
#[cfg(feature = "preview")]
#[path = "all/preview_page.rs"]
mod preview_page;
#[path = "all/readme.rs"]
mod readme;
#[path = "all/region.rs"]
mod region;
#[path = "all/reuse.rs"]
mod reuse;
#[path = "all/scripts.rs"]
mod scripts;
#[path = "all/sequence.rs"]
mod sequence;
#[path = "all/testing.rs"]
mod testing;
#[path = "all/textures.rs"]
mod textures;
#[path = "all/tool.rs"]
mod tool;
#[path = "all/touching.rs"]
mod touching;
#[path = "all/trust.rs"]
mod trust;
#[path = "all/vectors.rs"]
mod vectors;
#[path = "all/version.rs"]
mod version;
#[path = "all/visibility.rs"]
mod visibility;
#[path = "all/warnings.rs"]
mod warnings;
