//! Single frames for somebody who looks on while a shot is written: quick ones, whole ones, and what their pixels show.
//!
//! An edit is a frame that differs: what is reused from frame to frame is reused from edit to edit, though the edits to come
//! are not known. [`LiveCache`] keeps the samples of a still camera in a window that goes on
//! ([`systems::ObjectStates::open`]), the photon maps of the last picture, and the films of light groups.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::fingerprint::Fingerprint;
use super::plan::PlannedFrame;
use super::reuse::{LightGroupFilms, ReusePolicy};
use super::{Shot, Slice, bands, files, moments, shutter};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, Subject};
use crate::base::digest::Digest;
use crate::components::{Aov, Edit, Filter, Integrator, Render, Scene};
use crate::film::Film;
use crate::systems::{self, FrameStats, ObjectStates, PartialFrame, Stage, StaticCameraCache, TileSink};
use crate::trace::integrator::photon::PhotonCache;

/// The picture of one frame in memory.
#[derive(Clone, Debug)]
pub struct LivePicture {
    /// Linear pixels and layers.
    pub film: Film,
    /// The settings that it was made with.
    pub render: Render,
    /// What it took to make it.
    pub stats: FrameStats,
}

/// How a quick picture differs from the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sketch {
    /// Width and height are divided by this.
    pub divisor: u32,
    /// Samples of a pixel at most.
    pub samples: u32,
}

/// Photons of a quick picture: enough to see where light gathers.
const SKETCH_PHOTONS: u32 = 20_000;

impl Sketch {
    fn settings(self, render: &Render) -> Render {
        let part = |[x, y, width, height]: [u32; 4]| {
            [x / self.divisor, y / self.divisor, (width / self.divisor).max(1), (height / self.divisor).max(1)]
        };
        Render {
            size: render.size.map(|side| side.div_ceil(self.divisor)),
            region: render.region.map(part),
            samples: render.samples.min(self.samples),
            aovs: Vec::new(),
            denoise: false,
            noise_threshold: None,
            filter: Filter::Box,
            filter_width: None,
            photons: render.photons.min(SKETCH_PHOTONS),
            photon_passes: 1,
            ..render.clone()
        }
    }
}

/// What is kept from one picture to the next, whether another frame is looked at or the shot was edited and opened anew.
pub struct LiveCache {
    policy: ReusePolicy,
    window: Option<LiveWindow>,
    photons: Option<(Digest, PhotonCache)>,
    light_groups: Option<LightGroupFilms>,
}

/// Samples of a still camera, and the frame that was added last.
struct LiveWindow {
    last: Fingerprint,
    tiles: StaticCameraCache,
}

impl LiveCache {
    /// A cache with nothing in it.
    pub fn new(policy: ReusePolicy) -> Self {
        LiveCache { policy, window: None, photons: None, light_groups: None }
    }

    /// Memory that is taken, in bytes, without photon maps.
    pub fn bytes(&self) -> usize {
        let groups = self.light_groups.as_ref().map_or(0, LightGroupFilms::bytes);
        groups + self.window.as_ref().map_or(0, |window| window.tiles.bytes())
    }

    /// The samples that this frame, which the World stands for, can use; and its number among those that they were taken
    /// for.
    fn lend_tiles(
        &mut self,
        fingerprint: &Fingerprint,
        stage: &mut Stage,
        base: &super::BaseFingerprint,
    ) -> Result<Option<(StaticCameraCache, usize)>, Diagnostics> {
        if !self.policy.reuse || !fingerprint.has_static_camera {
            return Ok(None);
        }
        systems::update_hierarchy(stage)?;
        let objects = systems::all_reuse_bounds(stage, &mut |value, hasher| base.feed_files(value, hasher));
        let kept = self.window.take().filter(|window| window.last.differs_in_objects_only(fingerprint));
        if let Some(LiveWindow { mut tiles, .. }) = kept
            && let Some(number) = tiles.push(&objects)
        {
            return Ok(Some((tiles, number)));
        }
        let states = ObjectStates::open(&objects);
        Ok(states.map(|states| (StaticCameraCache::new(states, self.policy.memory << 20), 0)))
    }
}

impl Shot {
    /// The frame as it would be written, to the bit; `None` if `cancel` was raised. `sink` sees its tiles as they are done.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn live_picture(
        &mut self,
        planned: &PlannedFrame,
        cache: &mut LiveCache,
        sink: Option<TileSink>,
        cancel: &AtomicBool,
    ) -> Result<Option<LivePicture>, Diagnostics> {
        let fingerprint = planned.fingerprint.as_ref().map_err(Clone::clone)?;
        let mix = planned.light_mix.as_deref();
        let factors = mix.map(|mix| mix.factors(&self.input.base, fingerprint)).unwrap_or_default();
        let kept = mix.and_then(|mix| Some((mix, cache.light_groups.as_ref()?.mixed(mix, &factors)?)));
        if let Some((mix, (film, render, stats))) = kept {
            let render = mix.settings(&self.input.base, fingerprint, &render);
            return Ok(Some(LivePicture { film, render, stats }));
        }
        let mut partial = PartialFrame::default();
        partial.tile_sink = sink;
        if let Some(mix) = mix {
            partial.light_groups = mix.light_groups.clone();
        }
        partial.photon_cache = fingerprint.photons.filter(|_| cache.policy.reuse).map(|wanted| {
            let kept = cache.photons.take().filter(|(digest, _)| *digest == wanted);
            kept.map_or_else(|| PhotonCache::new(cache.policy.memory << 20), |(_, maps)| maps)
        });
        let (mut render, mut whole) = (Render::default(), true);
        let Shot { stage, input, .. } = self;
        let slices = input.slices(planned.frame)?;
        let parts = bands::settings_of(&slices, &input.settings).parts_of_moment();
        let slices = moments::refined(slices, parts);
        input.with_slices(stage, planned.frame, slices, |stage, share| {
            files::load_all(stage)?;
            render = stage.settings();
            if render.region.is_some() {
                // Who looks on puts tiles into a whole frame.
                partial.tile_sink = None;
            }
            if share.index == 0 && mix.is_none() {
                partial.tile_cache = cache.lend_tiles(fingerprint, stage, &input.base)?;
            }
            whole = systems::render_samples(stage, share, &mut partial, cancel, &|_, _| {})?;
            Ok(whole)
        })?;
        // What was traced before it was given up is good.
        if let Some((tiles, _)) = partial.tile_cache.take() {
            cache.window = Some(LiveWindow { last: fingerprint.clone(), tiles });
        }
        cache.photons = fingerprint.photons.zip(partial.photon_cache.take());
        if !whole {
            return Ok(None);
        }
        let (films, stats) = partial.resolve()?;
        let (first, others) = films.split_first().ok_or_else(|| Diagnostic::bug("a frame has a film at least"))?;
        let film = systems::weighted_sum(first, others, &factors);
        if let Some(mix) = mix {
            let kept = LightGroupFilms { hash: mix.hash, films, render: render.clone(), seed: stats.seed };
            let fits = kept.bytes() as u64 <= cache.policy.memory << 20;
            cache.light_groups = (cache.policy.reuse && fits).then_some(kept);
        }
        Ok(Some(LivePicture { film, render, stats }))
    }

    /// A quick look at a frame as it would be after `trial` edits; `None` if `cancel` was raised.
    ///
    /// # Errors
    /// The mistakes of the frame, and of the edits.
    pub fn sketch(
        &mut self,
        frame: u32,
        trial: &[Edit],
        sketch: Sketch,
        cancel: &AtomicBool,
    ) -> Result<Option<LivePicture>, Diagnostics> {
        self.render_as(frame, trial, cancel, |render| sketch.settings(render))
    }

    /// What the pixels of a frame show, at the middle of each: layers of a picture of at most so many pixels.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn seen_in(
        &mut self,
        frame: u32,
        pixels: u32,
        cancel: &AtomicBool,
    ) -> Result<Option<LivePicture>, Diagnostics> {
        self.render_as(frame, &[], cancel, |render| {
            let many = render.size[0] as f64 * f64::from(render.size[1]) / f64::from(pixels);
            let divisor = many.max(1.0).sqrt().ceil() as u32;
            let sketch = Sketch { divisor, samples: 1 };
            let aovs = vec![Aov::Depth, Aov::Normal, Aov::Position, Aov::Entity, Aov::Material];
            Render { integrator: Integrator::Whitted, max_depth: 1, aovs, ..sketch.settings(render) }
        })
    }

    /// A frame at its own time with other edits and settings.
    fn render_as(
        &mut self,
        frame: u32,
        more: &[Edit],
        cancel: &AtomicBool,
        settings: impl Fn(&Render) -> Render,
    ) -> Result<Option<LivePicture>, Diagnostics> {
        let Shot { stage, input, .. } = self;
        let mut edits = input.edits(frame)?;
        edits.extend(more.iter().cloned());
        let render = settings(shutter::last_render(&edits).unwrap_or(&input.settings));
        edits.push(Edit::Render(render.clone()));
        let slice = Slice { time: 0.0, edits, before: None };
        let (mut partial, mut whole) = (PartialFrame::default(), true);
        input.with_slices(stage, frame, vec![slice], |stage, share| {
            files::load_all(stage)?;
            whole = systems::render_samples(stage, share, &mut partial, cancel, &|_, _| {})?;
            Ok(whole)
        })?;
        if !whole {
            return Ok(None);
        }
        let (films, stats) = partial.resolve()?;
        Ok(films.into_iter().next().map(|film| LivePicture { film, render, stats }))
    }

    /// The scene as its file says it, where the shot was opened to keep it.
    pub fn authored(&self) -> Option<&Arc<Scene>> {
        self.authored.as_ref()
    }

    /// The file of the scene that is shown, if there is one.
    pub fn scene_file(&self) -> Option<&Path> {
        self.input.scene_file.as_ref().map(|(path, _)| path.as_path())
    }

    /// Whether an entity has the number that it has in the scene's text.
    pub fn is_as_written(&self, entity: usize) -> bool {
        self.input.entities_as_written && self.authored.as_ref().is_some_and(|scene| entity < scene.entities.len())
    }

    /// Where the script writes to something: in `frame`, or else in `setup`.
    pub fn script_place(&self, frame: u32, subject: Subject) -> Option<Place> {
        let (program, rest) = self.input.program.as_ref()?;
        let in_frame = program.place_of(rest, Some((frame, 0.0)), subject);
        in_frame.or_else(|| program.place_of(self.authored.as_ref()?, None, subject))
    }
}
