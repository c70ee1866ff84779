//! Single frames for somebody who looks on while a shot is written: quick ones, whole ones, and what their pixels show.
//!
//! An edit is a frame that differs: what is reused from frame to frame is reused from edit to edit, though the edits to come
//! are not known. [`LiveCache`] keeps the samples of a still camera in a window that goes on
//! ([`systems::ObjectStates::open`]), the photon maps of the last picture, the films of light groups, the picture as it came
//! before noise was filtered out of it, and what each emitter gives (`relight`); and all of that twice:
//! of the frame that is looked at, and of those that are rendered ahead, which would drive it out else.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::fingerprint::Fingerprint;
use super::plan::PlannedFrame;
use super::relight::{EmitterFilms, LitPicture};
use super::reuse::{LightGroupFilms, ReusePolicy};
use super::{Shot, Slice, bands, files, moments, shutter};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place, Subject};
use crate::base::digest::Digest;
use crate::components::{Aov, Edit, Filter, Integrator, Render, Scene};
use crate::film::{DenoiseHistory, Film};
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
    /// Of frames that somebody looks at.
    seen: KeptWork,
    /// Of frames that are rendered ahead.
    ahead: KeptWork,
    emitters: Option<EmitterFilms>,
    /// An exact picture that was looked at, to be relit.
    lit: Option<LitPicture>,
    /// The one that was looked at last, which is to take its place.
    latest: Option<LitPicture>,
}

/// Whom a picture is for.
#[derive(Clone)]
pub enum LiveViewer {
    /// Somebody looks at it, and may look at tiles as they are done.
    Eye(Option<TileSink>),
    /// It may be looked at later.
    Ahead,
}

/// Work that the next picture may not have to do again.
#[derive(Default)]
struct KeptWork {
    window: Option<LiveWindow>,
    photons: Option<(Digest, PhotonCache)>,
    light_groups: Option<LightGroupFilms>,
    denoised: DenoiseHistory,
}

/// Samples of a still camera, and the frame that was added last.
struct LiveWindow {
    last: Fingerprint,
    tiles: StaticCameraCache,
}

impl KeptWork {
    fn bytes(&self) -> usize {
        let groups = self.light_groups.as_ref().map_or(0, LightGroupFilms::bytes);
        let window = self.window.as_ref().map_or(0, |window| window.tiles.bytes());
        groups + window + self.photons.as_ref().map_or(0, |(_, maps)| maps.bytes()) + self.denoised.bytes()
    }

    /// The samples that this frame, which the World stands for, can use; and its number among those that they were taken
    /// for. A new window may take `room` bytes.
    fn lend_tiles(
        &mut self,
        fingerprint: &Fingerprint,
        stage: &mut Stage,
        base: &super::BaseFingerprint,
        room: u64,
    ) -> Result<Option<(StaticCameraCache, usize)>, Diagnostics> {
        if !fingerprint.has_static_camera {
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
        Ok(states.map(|states| (StaticCameraCache::new(states, room), 0)))
    }
}

impl LiveCache {
    /// A cache with nothing in it.
    pub fn new(policy: ReusePolicy) -> Self {
        let (seen, ahead) = (KeptWork::default(), KeptWork::default());
        LiveCache { policy, seen, ahead, emitters: None, lit: None, latest: None }
    }

    /// Memory that is taken, in bytes.
    pub fn bytes(&self) -> usize {
        let emitters = self.emitters.as_ref().map_or(0, EmitterFilms::bytes);
        let lit = [&self.lit, &self.latest].into_iter().flatten().map(LitPicture::bytes).sum::<usize>();
        self.seen.bytes() + self.ahead.bytes() + emitters + lit
    }

    fn work(&mut self, viewer: &LiveViewer) -> &mut KeptWork {
        match viewer {
            LiveViewer::Eye(_) => &mut self.seen,
            LiveViewer::Ahead => &mut self.ahead,
        }
    }

    /// Bytes that are left to those who look on, beside all else that is kept, or to what is rendered ahead.
    fn room(&self, viewer: &LiveViewer) -> u64 {
        let all = if self.policy.reuse { self.policy.memory << 20 } else { 0 };
        let own = match viewer {
            LiveViewer::Eye(_) => self.seen.bytes(),
            LiveViewer::Ahead => self.ahead.bytes(),
        };
        all.saturating_sub((self.bytes() - own) as u64)
    }

    /// Whether the frame that is looked at can be shown under other colours of its lights without tracing it.
    pub fn can_relight(&self) -> bool {
        let known = self.emitters.as_ref().zip(self.lit.as_ref());
        // What is known of the frame before says nothing of the one that has taken its place.
        self.latest.is_none() && known.is_some_and(|(films, lit)| films.can_light(lit))
    }

    /// Whether [`Shot::know_emitters`] has something to do for the frame that is looked at.
    pub fn lacks_emitters(&self, planned: &PlannedFrame) -> bool {
        let Ok(fingerprint) = &planned.fingerprint else { return false };
        let is_known = self.emitters.as_ref().is_some_and(|known| known.are_of(fingerprint));
        // Without a picture of the frame there is nothing to relight.
        let can_be_lit = self.lit.as_ref().is_some_and(|lit| lit.is_like(fingerprint));
        self.policy.reuse && (self.latest.is_some() || (can_be_lit && !is_known))
    }
}

impl Shot {
    /// Takes over what the same shot has derived before it was edited and opened anew; images only if `keeps_files`, since
    /// none of them has changed.
    pub fn adopt(&mut self, before: Shot, keeps_files: bool) {
        self.stage.adopt(before.stage, keeps_files);
    }

    /// The frame as it would be written, to the bit; `None` if `cancel` was raised.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn live_picture(
        &mut self,
        planned: &PlannedFrame,
        cache: &mut LiveCache,
        viewer: LiveViewer,
        cancel: &AtomicBool,
    ) -> Result<Option<LivePicture>, Diagnostics> {
        let fingerprint = planned.fingerprint.as_ref().map_err(Clone::clone)?;
        let mix = planned.light_mix.as_deref();
        let factors = mix.map(|mix| mix.factors(&self.input.base, fingerprint)).unwrap_or_default();
        let kept = [&cache.seen, &cache.ahead].into_iter().find_map(|work| {
            let (mix, known) = mix.zip(work.light_groups.as_ref())?;
            Some((mix, known.mixed(mix, &factors)?))
        });
        if let Some((mix, (film, render, stats))) = kept {
            let render = mix.settings(&self.input.base, fingerprint, &render);
            return Ok(Some(LivePicture { film, render, stats }));
        }
        let (room, reuse) = (cache.room(&viewer), cache.policy.reuse);
        let mut work = std::mem::take(cache.work(&viewer));
        let made = self.traced_picture(planned, (&mut work, room, reuse), &viewer, cancel);
        *cache.work(&viewer) = work;
        if let (Ok(Some(picture)), LiveViewer::Eye(_), true) = (&made, &viewer, reuse) {
            cache.latest = Some(LitPicture::new(fingerprint, &picture.film, &picture.render));
        }
        made
    }

    /// A frame as it is traced, with what is left of the work for one before.
    fn traced_picture(
        &mut self,
        planned: &PlannedFrame,
        (work, room, reuse): (&mut KeptWork, u64, bool),
        viewer: &LiveViewer,
        cancel: &AtomicBool,
    ) -> Result<Option<LivePicture>, Diagnostics> {
        let fingerprint = planned.fingerprint.as_ref().map_err(Clone::clone)?;
        let mix = planned.light_mix.as_deref();
        let mut partial = PartialFrame::default();
        if let LiveViewer::Eye(sink) = viewer {
            partial.tile_sink.clone_from(sink);
        }
        if let Some(mix) = mix {
            partial.light_groups = mix.light_groups.clone();
        }
        partial.photon_cache = fingerprint.photons.filter(|_| reuse).map(|wanted| {
            let kept = work.photons.take().filter(|(digest, _)| *digest == wanted);
            kept.map_or_else(|| PhotonCache::new(room), |(_, maps)| maps)
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
            if share.index == 0 && mix.is_none() && reuse {
                partial.tile_cache = work.lend_tiles(fingerprint, stage, &input.base, room)?;
            }
            whole = systems::render_samples(stage, share, &mut partial, cancel, &|_, _| {})?;
            Ok(whole)
        })?;
        // What was traced before it was given up is good.
        if let Some((tiles, _)) = partial.tile_cache.take() {
            work.window = Some(LiveWindow { last: fingerprint.clone(), tiles });
        }
        work.photons = fingerprint.photons.zip(partial.photon_cache.take());
        if !whole {
            return Ok(None);
        }
        let others = work.bytes() - work.denoised.bytes();
        work.denoised.set_room(usize::try_from(room).unwrap_or(usize::MAX).saturating_sub(others));
        let Some((films, stats)) = partial.resolve_after(&mut work.denoised, cancel)? else { return Ok(None) };
        let (first, others) = films.split_first().ok_or_else(|| Diagnostic::bug("a frame has a film at least"))?;
        let factors = mix.map(|mix| mix.factors(&input.base, fingerprint)).unwrap_or_default();
        let film = systems::weighted_sum(first, others, &factors);
        if let Some(mix) = mix {
            let kept = LightGroupFilms { hash: mix.hash, films, render: render.clone(), seed: stats.seed };
            let fits = kept.bytes() as u64 <= room;
            work.light_groups = (reuse && fits).then_some(kept);
        }
        Ok(Some(LivePicture { film, render, stats }))
    }

    /// Finds out what each emitter gives to the frame that is looked at, for [`Shot::relight`]; false if `cancel` was raised.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn know_emitters(
        &mut self,
        planned: &PlannedFrame,
        cache: &mut LiveCache,
        cancel: &AtomicBool,
    ) -> Result<bool, Diagnostics> {
        let fingerprint = planned.fingerprint.as_ref().map_err(Clone::clone)?;
        let scene = self.scene_of(planned.frame)?;
        if let Some(latest) = cache.latest.take() {
            cache.lit = latest.of(fingerprint, &scene);
        }
        let can_be_lit = cache.lit.as_ref().is_some_and(|lit| lit.is_like(fingerprint));
        if !can_be_lit || cache.emitters.as_ref().is_some_and(|known| known.are_of(fingerprint)) {
            return Ok(true);
        }
        cache.emitters = None;
        let room = (cache.policy.memory << 20).saturating_sub(cache.bytes() as u64);
        cache.emitters = self.emitter_films(planned, &scene, room, cancel)?;
        Ok(cache.emitters.is_some())
    }

    /// A frame with `trial` edits, mixed from what is known of each emitter, if it differs in colours of emitters alone from
    /// the one that was looked at last.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn relight(
        &mut self,
        frame: u32,
        trial: &[Edit],
        cache: &LiveCache,
    ) -> Result<Option<LivePicture>, Diagnostics> {
        match (&cache.emitters, &cache.lit) {
            (Some(films), Some(known)) => {
                let relit = self.relit(frame, trial, films, known)?;
                Ok(relit.map(|(film, render, stats)| LivePicture { film, render, stats }))
            }
            _ => Ok(None),
        }
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

#[cfg(test)]
mod tests;
