//! What frames share, why that is safe, and where it is decided: the second promise, in one place.
//!
//! Nothing here decides what a frame looks like. Whatever is reused is what tracing the frame anew would give, to the
//! bit; with `--no-reuse` it is traced anew, and `tests/all/reuse.rs` compares the two.
//!
//! | what is reused | when | why it is safe | decided in |
//! |---|---|---|---|
//! | a frame's file from an earlier run | the manifest or the picture's metadata carry the frame's hash, and the bytes are whole | the hash covers all that decides pixels, the program's picture version included ([`fingerprint`](crate::shot::fingerprint)) | [`plan::Plan::inspect`](crate::shot::plan::Plan::inspect), [`output::inspect`](crate::output::inspect) |
//! | a frame of the same run or folder with the same pixels | two frames have one hash | as above; only frame number and source in the metadata differ | [`run`](mod@crate::shot::run), [`output::relabelled`](crate::output::relabelled) |
//! | films of light groups | only colours of emitters change, among the frames of a window of 64 | light adds up; units and probabilities are the same in all frames of the mix, and a frame that could be a sum always is one | [`light_mix`] |
//! | tiles, sample by sample | only objects of finite size change, seen from one camera | a sample depends on what its rays meet: it is traced again if one of them crossed the bounds of an object that changed, in its state before or now; what reaches everywhere ends the window | [`static_camera`], [`systems::reuse_bounds`](crate::systems::reuse_bounds()), [`systems::StaticCameraCache`]; what changed: [`systems::ObjectStates`]; what is stale: [`SampleHistory::stale`](crate::trace::reuse::SampleHistory::stale), asked by `systems::static_camera` when a frame begins |
//! | tiles, from edit to edit | as above, while a shot is written ([`live`](crate::shot::live)) | any object may change next: rays note which objects and which cells of a coarse grid they crossed; a state that an object takes is known by the cells that it touches | [`live`](crate::shot::live), [`systems::ObjectStates::open`] |
//! | states of a simulation | a checkpoint beside the frames is of the same script, scene and files | states are data, exact to the bit; all that they follow from is compared, and a damaged file counts as none | `shot::checkpoints` |
//! | photon maps | the camera, the film or the lens alone change | the digest `Fingerprint::photons` covers all that photons depend on | [`photons`] |
//! | accelerator | columns of primitives and settings of the accelerator are equal; fitted, not rebuilt, where primitives only moved | columns are compared value by value; pictures do not depend on the accelerator | `systems::accelerate` |
//! | columns of primitives, textures, environment | nothing that they are made of was edited, or the files are the same | they are keyed by what they are made of | `systems::extract`, `systems::textures` |
//!
//! What a field means to reuse (does it show, is it lens or film, is it the colour of a light) stands with the field's
//! declaration ([`FieldClass`](crate::components::FieldClass)).

pub mod light_mix;
pub mod photons;
pub mod static_camera;

use glam::Vec3;
use light_mix::LightMix;
use photons::PhotonReuse;
use static_camera::TileReuse;

use crate::base::digest::Digest;
use crate::components::Render;
use crate::film::Film;
use crate::shot::Shot;
use crate::shot::plan::PlannedFrame;
use crate::systems::{self, FrameStats, PartialFrame};

/// How far frames may be made from one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReusePolicy {
    /// Whether anything is kept from frame to frame.
    pub reuse: bool,
    /// Memory for what is kept, in MiB.
    pub memory: u64,
}

/// What is kept from frame to frame of one run.
pub struct ReuseCache {
    policy: ReusePolicy,
    light_groups: Option<LightGroupFilms>,
    tiles: TileReuse,
    photons: PhotonReuse,
}

/// The films of the light groups of a mix.
pub(super) struct LightGroupFilms {
    pub hash: Digest,
    pub films: Vec<Film>,
    pub render: Render,
    pub seed: u64,
}

impl LightGroupFilms {
    pub fn bytes(&self) -> usize {
        self.films.iter().map(|film| size_of_val(&*film.pixels)).sum()
    }

    /// A frame of their mix, with the settings of the frame that they were traced for.
    pub fn mixed(&self, mix: &LightMix, factors: &[Vec3]) -> Option<(Film, Render, FrameStats)> {
        let (first, others) = self.films.split_first().filter(|_| self.hash == mix.hash)?;
        let film = systems::weighted_sum(first, others, factors);
        let count = self.films.len();
        let stats = FrameStats {
            seed: self.seed,
            passes: count,
            passes_kept: count,
            reuse_bytes: self.bytes(),
            ..FrameStats::default()
        };
        Some((film, self.render.clone(), stats))
    }
}

impl ReuseCache {
    /// An empty cache.
    pub fn new(policy: ReusePolicy) -> Self {
        ReuseCache { policy, light_groups: None, tiles: TileReuse::default(), photons: PhotonReuse::default() }
    }

    /// A frame of a mix whose light groups are kept, with the settings of the frame that they were traced for: nothing
    /// needs to be traced for it.
    pub fn mixed(&self, mix: &LightMix, factors: &[Vec3]) -> Option<(Film, Render, FrameStats)> {
        self.light_groups.as_ref()?.mixed(mix, factors)
    }

    /// Keeps the films of the light groups of a frame, should another one of its mix be among those that `follow`.
    pub fn keep_light_groups(
        &mut self,
        mix: &LightMix,
        films: Vec<Film>,
        render: &Render,
        seed: u64,
        follow: &[Vec<&PlannedFrame>],
    ) {
        let is_used = follow.iter().any(|frames| frames[0].light_mix.as_ref().is_some_and(|m| m.hash == mix.hash));
        let kept = LightGroupFilms { hash: mix.hash, films, render: render.clone(), seed };
        let fits = kept.bytes() as u64 <= self.policy.memory << 20;
        self.light_groups = (self.policy.reuse && is_used && fits).then_some(kept);
    }

    /// Lends the frame at `index` of the run the tiles and photon maps that it can use, and room for those that later
    /// frames can use.
    pub fn lend(&mut self, shot: &mut Shot, run: &[Vec<&PlannedFrame>], index: usize, frame: &mut PartialFrame) {
        if run[index][0].light_mix.is_none() {
            self.tiles.lend(self.policy, shot, run, index, frame);
        }
        self.photons.lend(self.policy, run, index, frame);
    }

    /// Takes back from a frame that is whole what later frames can use.
    pub fn take_back(&mut self, run: &[Vec<&PlannedFrame>], index: usize, frame: &mut PartialFrame) {
        if run[index][0].light_mix.is_none() {
            self.tiles.take_back(frame, index);
        }
        self.photons.take_back(run, index, frame);
    }

    /// Forgets what a frame that failed may have spoilt.
    pub fn forget_tiles(&mut self) {
        self.tiles.forget();
    }
}
