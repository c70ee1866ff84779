//! Columns -> film: the accelerator is brought up to date, then tiles are traced on all threads.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::lights::LightGroups;
use super::stage::{DerivedCache, Stage};
use super::static_camera::{CachedTile, StaticCameraCache};
use super::tiles::TileGrid;
use super::visibility::RayVisibility;
use super::{accelerate, environment, extract, hierarchy, lens, lights, origin, textures};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::components::{Integrator, Render};
use crate::film::{
    AccumulatorOptions, CaughtShadow, CaughtSum, DenoiseHistory, DenoisePixel, Film, FilterTable, PixelAccumulator,
    PixelBounds,
};
use crate::trace::accel::Accelerator;
use crate::trace::counters::Counters;
use crate::trace::integrator;
use crate::trace::integrator::photon::{PhotonCache, PhotonPass, ProgressiveState};
use crate::trace::integrator::{Estimator, SampleSubset};
use crate::trace::light::Lights;
use crate::trace::simd::Width;
use crate::trace::wavefront::{RayAccelerators, RenderContext, Settings, Worker, any_has_holes};

/// What one frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Rays, hits and tests.
    pub counters: Counters,
    /// Name of the accelerator that was used.
    pub accel: &'static str,
    /// How often it was built; 0 if it was kept.
    pub builds: u32,
    /// Seed of the frame's sampling.
    pub seed: u64,
    /// Time before the first ray: columns, accelerator, lights.
    pub build_seconds: f64,
    /// Time of tracing.
    pub render_seconds: f64,
    /// Bands that the picture was made in, one after another; 0 if it was made at once.
    pub bands: u32,
    /// Tiles of the picture.
    pub tiles: usize,
    /// Tiles that were kept whole from an earlier frame.
    pub tiles_kept: usize,
    /// Share of all samples that were kept, 0 to 1.
    pub share_kept: f64,
    /// Light groups that the picture is the sum of, and how many of them were kept from an earlier frame.
    pub passes: usize,
    /// How many of the light groups were kept.
    pub passes_kept: usize,
    /// Photon maps that the picture was made with, and how many of them were kept.
    pub photon_maps: usize,
    /// How many of the photon maps were kept.
    pub photon_maps_kept: usize,
    /// Memory of what is kept for later frames.
    pub reuse_bytes: usize,
}

impl FrameStats {
    /// Adds what the next band of the same frame cost.
    pub fn add_band(&mut self, band: FrameStats) {
        let FrameStats { counters, builds, build_seconds, render_seconds, tiles, photon_maps, .. } = band;
        self.counters += counters;
        self.builds += builds;
        self.build_seconds += build_seconds;
        self.render_seconds += render_seconds;
        self.bands += 1;
        self.tiles += tiles;
        self.photon_maps += photon_maps;
        (self.accel, self.seed, self.passes) = (band.accel, band.seed, band.passes);
    }
}

/// A frame while its samples are traced: their sums, and what they cost so far.
#[derive(Default)]
pub struct PartialFrame {
    accumulators: Option<FrameAccumulators>,
    stats: FrameStats,
    /// Radii of photon searches, once the first pass has estimated them.
    guide: Option<ProgressiveState>,
    /// The part of the frame that is traced, where it is made in bands: noise is not filtered out of one alone.
    band: Option<PixelBounds>,
    /// The light groups that emitters are divided into.
    pub light_groups: LightGroups,
    /// Tiles that are kept over a window of frames, and the number of this frame in it.
    pub tile_cache: Option<(StaticCameraCache, usize)>,
    /// Photon maps that are kept, and room for more of them.
    pub photon_cache: Option<PhotonCache>,
    /// Who looks at tiles as they are done, where one light group is all of the picture.
    pub tile_sink: Option<TileSink>,
}

/// Called from any thread with the pixels of a tile, and their sums so far.
pub type TileSink = Arc<dyn Fn(&[[u32; 2]], &PixelAccumulator) + Send + Sync>;

/// The accumulators of a frame, set up with its first samples.
struct FrameAccumulators {
    grid: TileGrid,
    options: AccumulatorOptions,
    denoise: bool,
    passes: usize,
    /// One for each light group of each tile, those of a tile together.
    tiles: Vec<PixelAccumulator>,
}

impl PartialFrame {
    /// A band of a frame of these light groups.
    pub fn of_band(band: PixelBounds, light_groups: LightGroups) -> Self {
        PartialFrame { band: Some(band), light_groups, ..PartialFrame::default() }
    }

    /// Share of the samples that were traced, 0 to 1.
    pub fn share_traced(&self) -> f64 {
        1.0 - self.stats.share_kept
    }

    /// The frame as means of its samples, a film for each light group, one at least.
    ///
    /// # Errors
    /// No samples were traced, which is a mistake of the program.
    pub fn resolve(self) -> Result<(Vec<Film>, FrameStats), Diagnostic> {
        let done = self.resolve_after(&mut DenoiseHistory::default(), &AtomicBool::new(false))?;
        done.ok_or_else(|| Diagnostic::bug("nobody gives this up"))
    }

    /// As [`Self::resolve`], where noise is filtered again as far as the picture differs from the one before in `history`;
    /// `None` if `cancel` was raised.
    ///
    /// # Errors
    /// As [`Self::resolve`].
    pub fn resolve_after(
        self,
        history: &mut DenoiseHistory,
        cancel: &AtomicBool,
    ) -> Result<Option<(Vec<Film>, FrameStats)>, Diagnostic> {
        let FrameAccumulators { grid, options, denoise: wanted, passes, tiles } =
            self.accumulators.ok_or_else(|| Diagnostic::bug("a frame without samples has no picture"))?;
        let of_pass = |pass: usize| resolve(grid, options_of(options, pass), tiles.iter().skip(pass).step_by(passes));
        let mut films: Vec<Film> = (0..passes).map(of_pass).collect();
        if wanted && !films.iter_mut().all(|film| history.denoise(film, cancel)) {
            return Ok(None);
        }
        // Bands are denoised together, later on.
        if wanted || !options.halves {
            films.iter_mut().for_each(Film::cast_shadows);
        }
        if grid.traced != grid.bounds {
            films = films.iter().map(|film| film.cropped(grid.traced, grid.bounds)).collect();
        }
        Ok(Some((films, FrameStats { passes, ..self.stats })))
    }
}

/// What is accumulated beside the colours belongs to the first light group.
fn options_of(options: AccumulatorOptions, pass: usize) -> AccumulatorOptions {
    if pass == 0 { options } else { AccumulatorOptions { moments: false, features: false, halves: false, ..options } }
}

impl FrameAccumulators {
    fn new(settings: &Render, filter: &FilterTable, passes: usize, band: Option<PixelBounds>) -> Self {
        let grid = band.map_or_else(|| TileGrid::new(settings), TileGrid::of_band);
        let options = accumulator_options(settings, filter.is_signed());
        let accumulator =
            |i: usize| PixelAccumulator::new(grid.pixels(i / passes).len(), options_of(options, i % passes));
        let tiles = (0..grid.count() * passes).map(accumulator).collect();
        let denoise = settings.denoise && band.is_none();
        FrameAccumulators { grid, options, denoise, passes, tiles }
    }
}

fn accumulator_options(settings: &Render, signed: bool) -> AccumulatorOptions {
    AccumulatorOptions {
        signed,
        moments: settings.gathers_moments(),
        features: settings.gathers_features(),
        halves: settings.denoise,
    }
}

/// Bytes that a pixel takes while a frame of so many light groups is made at once: sums and means of its samples, the
/// filter that takes out noise, and the values that are written.
pub fn bytes_of_pixel(settings: &Render, light_groups: usize) -> u64 {
    let options = accumulator_options(settings, false);
    let group =
        |pass| PixelAccumulator::new(1, options_of(options, pass)).bytes() as u64 + size_of::<[f32; 3]>() as u64;
    let layers = if options.features { LAYER_BYTES } else { 0 } + if options.moments { 4 } else { 0 };
    let denoise = if settings.denoise { DENOISE_BYTES } else { 0 };
    // Any material may turn out to catch shadows.
    let caught = (size_of::<CaughtSum>() + size_of::<CaughtShadow>()) as u64;
    // What is written is a copy of the layers and of one film.
    caught + (0..light_groups.max(1)).map(group).sum::<u64>() + 2 * (layers + 12) + denoise
}

/// Bytes of a pixel of all layers of a film.
const LAYER_BYTES: u64 = 60;
/// Bytes of a pixel in the filter that takes out noise: what a pixel shows in two halves as it comes, and some 110 planes:
/// features, light and guides before and after a pass, and four levels to choose from.
const DENOISE_BYTES: u64 = 560;

/// Renders the World as it stands, all samples at this one moment; `None` if `cancel` was raised.
///
/// With a [`region`](Render::region) among the settings the film is that part of the frame, equal to the same part of the
/// whole. `progress(done, total)` counts tiles and is called from any thread.
///
/// # Errors
/// What only shows once everything is placed: a focus behind the camera, too many primitives.
pub fn render(
    stage: &mut Stage,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Option<(Film, FrameStats)>, Diagnostics> {
    let mut partial = PartialFrame::default();
    let whole = render_samples(stage, SampleSubset::WHOLE, &mut partial, cancel, progress)?;
    if !whole {
        return Ok(None);
    }
    let (films, stats) = partial.resolve()?;
    Ok(films.into_iter().next().map(|film| (film, stats)))
}

/// Adds a subset of the samples of every pixel, at the moment at which the World stands; false if `cancel` was raised.
///
/// The subsets of a frame are added in their order, under the same settings of the picture: sums are taken in that order,
/// and the seed that follows from the camera's pose is that of the first. Otherwise as [`render`].
///
/// # Errors
/// As [`render`].
pub fn render_samples(
    stage: &mut Stage,
    share: SampleSubset,
    partial: &mut PartialFrame,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<bool, Diagnostics> {
    let start = Instant::now();
    hierarchy::update(stage)?;
    let geometry = extract::update(stage)?;
    let mut settings = stage.settings();
    let environment_group = partial.light_groups.assign_environment(&mut settings);
    if partial.accumulators.is_none() {
        let camera = lens::placed_camera(stage)?;
        partial.stats.seed = settings.seed.unwrap_or_else(|| lens::pose_seed(&camera));
    }
    let resolved = Settings::new(&settings, partial.stats.seed);
    let environment = environment::update(stage, &settings, resolved.follows_paths())?;
    let [_, [width, height]] = settings.pixel_bounds();
    let of_picture = partial.band.map_or(1.0, |band| band.count() as f64 / (f64::from(width) * f64::from(height)));
    let visibility = RayVisibility::new(stage, &geometry)?;
    let (accelerators, built) = accelerate::update(stage, share, of_picture, &geometry, &visibility.hidden)?;
    let shadow: Vec<&Accelerator> = visibility.shadow.iter().map(|set| &*accelerators[*set]).collect();
    partial.stats.builds += built;
    let mut camera = lens::camera_rays(stage, settings.size)?;
    if !resolved.lens {
        camera = camera.pinhole();
    }
    let before = stage.previous.as_ref().map(|previous| previous.motion_to(stage, settings.size));
    let bindings = textures::texture_bindings(stage)?;
    let mut materials = extract::materials(stage);
    partial.light_groups.assign_materials(&mut materials);
    let lights = Lights::new(lights::lights(stage, &partial.light_groups, &visibility)?, &geometry, &materials)
        .under(environment.as_ref(), &geometry)
        .environment_in_group(environment_group)
        .linked(visibility.links.clone())
        .chosen_by(settings.light_sampler);
    let fog = environment::fog(stage, &settings);
    let filter = FilterTable::new(settings.filter, settings.filter_width());
    let context = RenderContext {
        geometry: &geometry,
        accelerators: RayAccelerators {
            camera: &accelerators[visibility.camera],
            scattered: &accelerators[visibility.scattered],
            shadow: &shadow,
        },
        materials: &materials,
        lights: &lights,
        textures: &bindings,
        camera: &camera,
        origin: origin::render_origin(stage).as_vec3(),
        motion: before.as_ref(),
        environment: environment.as_ref(),
        fog: fog.as_ref(),
        settings: &resolved,
        holes: any_has_holes(&materials),
        glass: materials.iter().any(|material| material.is_clear()),
        absorbs: materials.iter().any(|material| material.absorbs()),
        // Photons know of one scene alone.
        catchers: settings.integrator != Integrator::Photon && materials.iter().any(|material| material.shadow_catcher),
        lanes: Width::detect(),
        filter: &filter,
        width: settings.size[0],
        light_groups: partial.light_groups.count(),
        regions: None,
    };
    let built = Instant::now();
    let PartialFrame { accumulators, stats, guide, band, tile_cache, photon_cache, tile_sink, .. } = partial;
    let sink = tile_sink.as_deref().filter(|_| context.light_groups == 1);
    let accumulators =
        accumulators.get_or_insert_with(|| FrameAccumulators::new(&settings, &filter, context.light_groups, *band));
    let turns = settings.turns(share.of);
    for turn in 0..turns {
        let share = SampleSubset { index: share.index * turns + turn, of: share.of * turns };
        let kept = photon_cache.as_ref().and_then(|shelf| shelf.get(share.index));
        let sent = if settings.integrator == Integrator::Photon && kept.is_none() {
            let sent = PhotonPass::new(context, share.index, guide.as_ref(), cancel);
            let Some((photons, counters)) = sent else { return Ok(false) };
            stats.counters += counters;
            Some(photons)
        } else {
            None
        };
        let photons = kept.or(sent.as_ref());
        if let Some(photons) = photons {
            guide.get_or_insert_with(|| photons.guide().clone());
            stats.photon_maps += 1;
            stats.photon_maps_kept += usize::from(kept.is_some());
        }
        let estimator = Estimator { context, photons };
        let counters = match tile_cache {
            None => tiles(estimator, share, accumulators, sink, cancel, progress),
            Some((cache, of_window)) => {
                retrace_stale_tiles(estimator, accumulators, (cache, *of_window), stats, sink, cancel, progress)
            }
        };
        let Some(counters) = counters else { return Ok(false) };
        stats.counters += counters;
        if let Some((shelf, sent)) = photon_cache.as_mut().zip(sent) {
            shelf.put(share.index, sent);
        }
    }
    if let Some(shelf) = photon_cache {
        stats.reuse_bytes = shelf.bytes();
    }
    stats.tiles = accumulators.tiles.len() / accumulators.passes;
    stats.accel = accelerators[visibility.camera].name();
    stats.build_seconds += (built - start).as_secs_f64();
    stats.render_seconds += built.elapsed().as_secs_f64();
    Ok(true)
}

/// Forgets what is kept between frames, as after a panic halfway.
pub fn forget(stage: &mut Stage) {
    let unresolved = (0..stage.entities.len()).collect();
    stage.derived = DerivedCache { unresolved, ..DerivedCache::default() };
}

/// Sees to it that the World as it stands can be rendered, without rendering it.
///
/// # Errors
/// A focus on an entity that does not exist or does not lie before the camera.
pub fn check(stage: &Stage) -> Result<(), Diagnostics> {
    lens::camera_rays(stage, stage.settings().size)?;
    extract::check_placements(stage)
}

/// A sink while a frame is traced.
type SinkRef<'a> = Option<&'a (dyn Fn(&[[u32; 2]], &PixelAccumulator) + Send + Sync)>;

/// Traces samples again that may differ from those of the frames before, and keeps the others.
fn retrace_stale_tiles(
    estimator: Estimator,
    accumulators: &mut FrameAccumulators,
    (cache, of_window): (&mut StaticCameraCache, usize),
    stats: &mut FrameStats,
    sink: SinkRef,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Counters> {
    let context = estimator.context;
    let settings = context.settings;
    let draws = settings.integrator == Integrator::Path || !context.lights.emitters().is_empty();
    let changes =
        cache.begin(of_window, context.geometry.bounds(), if draws { context.lights.chances() } else { Vec::new() });
    let samples =
        (settings.rounds == 1 && !settings.features && !context.catchers).then_some(settings.strata * settings.strata);
    let pixels = |tile: usize| accumulators.grid.pixels(tile).len();
    if !cache.make_room(&accumulators.tiles, pixels, samples) {
        return tiles(estimator, SampleSubset::WHOLE, accumulators, sink, cancel, progress);
    }
    let (regions, kept) = cache.parts(of_window);
    let estimator = Estimator { context: RenderContext { regions: Some(regions), ..context }, ..estimator };
    let grid = accumulators.grid;
    let total = accumulators.tiles.len();
    let done = AtomicUsize::new(0);
    let trace = |worker: &mut Worker,
                 (index, (accumulator, kept)): (usize, (&mut PixelAccumulator, &mut CachedTile))| {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        worker.start_tile();
        let again = integrator::retrace(
            estimator,
            &grid.pixels(index),
            &changes,
            &mut kept.trail,
            &mut kept.accumulator,
            worker,
        );
        accumulator.clone_from(&kept.accumulator);
        if let Some(sink) = sink {
            sink(&grid.pixels(index), accumulator);
        }
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
        Some((worker.take_counters(), [again, kept.trail.len()]))
    };
    let both = accumulators.tiles.par_iter_mut().zip(kept.par_iter_mut()).enumerate();
    let traced: Option<Vec<_>> = both.map_init(Worker::default, trace).collect();
    let mut counters = Counters::default();
    let (mut again, mut all) = (0, 0);
    for (cost, [some, of]) in traced? {
        counters += cost;
        stats.tiles_kept += usize::from(some == 0);
        (again, all) = (again + some, all + of);
    }
    stats.share_kept = 1.0 - again as f64 / all.max(1) as f64;
    stats.reuse_bytes = cache.bytes();
    Some(counters)
}

/// Adds a subset of all samples, each tile to the accumulators of its own; returns what they cost.
fn tiles(
    estimator: Estimator,
    share: SampleSubset,
    accumulators: &mut FrameAccumulators,
    sink: SinkRef,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Counters> {
    let grid = accumulators.grid;
    let total = accumulators.tiles.len() / accumulators.passes;
    let done = AtomicUsize::new(total * share.index as usize);
    let trace = |worker: &mut Worker, (index, accumulators): (usize, &mut [PixelAccumulator])| -> Option<Counters> {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        worker.start_tile();
        let pixels = grid.pixels(index);
        integrator::render_pixels(estimator, &pixels, share, accumulators, worker);
        if let Some(sink) = sink {
            sink(&pixels, &accumulators[0]);
        }
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, total * share.of as usize);
        Some(worker.take_counters())
    };
    let tiles = accumulators.tiles.par_chunks_mut(accumulators.passes).enumerate();
    let traced: Option<Vec<_>> = tiles.map_init(Worker::default, trace).collect();
    let mut counters = Counters::default();
    traced?.into_iter().for_each(|cost| counters += cost);
    Some(counters)
}

/// Means of the samples of all tiles, over all that was traced.
fn resolve<'a>(grid: TileGrid, options: AccumulatorOptions, tiles: impl Iterator<Item = &'a PixelAccumulator>) -> Film {
    let [width, height] = grid.traced.size;
    let mut film = Film { origin: grid.traced.origin, ..Film::new(width, height) };
    let count = film.pixels.len();
    if options.features {
        film.layers.make_room_for_features(count);
    }
    if options.moments {
        film.layers.variance = vec![0.0; count];
    }
    if options.halves {
        film.layers.halves = vec![DenoisePixel::default(); count];
    }
    for (index, accumulator) in tiles.enumerate() {
        for (i, place) in grid.pixels(index).into_iter().enumerate() {
            let pixel = grid.traced.index(place);
            film.pixels[pixel] = accumulator.color(i);
            if let Some(sum) = accumulator.feature(i) {
                film.layers.resolve(pixel, sum);
            }
            if let Some([_, variance]) = accumulator.spread(i) {
                film.layers.variance[pixel] = variance.min(f64::from(f32::MAX)) as f32;
            }
            if let Some(shadow) = accumulator.caught(i) {
                if film.layers.caught.is_empty() {
                    film.layers.caught = vec![CaughtShadow::default(); count];
                }
                film.layers.caught[pixel] = shadow;
            }
            if let Some(halves) = accumulator.halves(i) {
                film.layers.halves[pixel] = halves;
            }
        }
    }
    film
}
