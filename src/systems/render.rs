//! Columns -> film: the accelerator is brought up to date, then tiles are traced on all threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use super::lights::Passes;
use super::stage::{Kept, Stage};
use super::still::{Kept as KeptTile, Still};
use super::{accelerate, extract, hierarchy, lens, lights, skins};
use crate::base::diagnostics::Diagnostics;
use crate::components::{Integrator, Render, Transfer};
use crate::film::{Film, FilterTable, Gather, Tally, denoise};
use crate::load::image;
use crate::trace::counters::Counters;
use crate::trace::integrator;
use crate::trace::integrator::{Estimator, PhotonCache, PhotonPass, ProgressiveState, SampleSubset};
use crate::trace::light::Lights;
use crate::trace::light::environment::{Environment, EnvironmentMap};
use crate::trace::simd::Width;
use crate::trace::wavefront::{RenderContext, Settings, Worker};

/// Side of a tile in pixels: small enough to share out evenly, large enough for neighbours to share cells.
const TILE: u32 = 16;

/// What one frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    pub counters: Counters,
    /// Name of the accelerator that was used.
    pub accel: &'static str,
    /// How often it was built; 0 if it was kept.
    pub builds: u32,
    /// Seed of the frame's sampling.
    pub seed: u64,
    pub build_seconds: f64,
    pub render_seconds: f64,
    pub tiles: usize,
    /// Tiles that were kept whole from an earlier frame.
    pub tiles_kept: usize,
    /// Share of all samples that were kept, 0 to 1.
    pub share_kept: f64,
    /// Passes that the picture is the sum of.
    pub passes: usize,
    pub passes_kept: usize,
    /// Photon maps that the picture was made with.
    pub photon_maps: usize,
    pub photon_maps_kept: usize,
    /// Memory of what is kept for later frames.
    pub reuse_bytes: usize,
}

/// A frame while it is exposed: sums of samples, and what they cost so far.
#[derive(Default)]
pub struct Exposure {
    plate: Option<Plate>,
    stats: FrameStats,
    /// Of searches for photons, once the first pass has made it.
    guide: Option<ProgressiveState>,
    /// The passes that lights are divided into.
    pub passes: Passes,
    /// What is kept from picture to picture, and which of them this one is.
    pub still: Option<(Still, usize)>,
    /// Photons that are kept, and room for more of them.
    pub shelf: Option<PhotonCache>,
}

/// What a frame's first share lays down for all of them.
struct Plate {
    size: [u32; 2],
    gather: Gather,
    denoise: bool,
    passes: usize,
    /// One for each pass of each tile, those of a tile together.
    tallies: Vec<Tally>,
}

impl Exposure {
    /// The share of the samples that were traced, 0 to 1.
    pub fn share_traced(&self) -> f64 {
        1.0 - self.stats.share_kept
    }

    /// The frame as means of its samples, a film for each pass; `None` before its first share.
    pub fn develop(self) -> Option<(Vec<Film>, FrameStats)> {
        let Plate { size, gather, denoise: wanted, passes, tallies } = self.plate?;
        let of_pass = |pass: usize| develop(size, gather_of(gather, pass), tallies.iter().skip(pass).step_by(passes));
        let mut films: Vec<Film> = (0..passes).map(of_pass).collect();
        if wanted {
            films.iter_mut().for_each(denoise);
        }
        Some((films, FrameStats { passes, ..self.stats }))
    }
}

/// What is gathered beside the colours belongs to the first pass.
fn gather_of(gather: Gather, pass: usize) -> Gather {
    if pass == 0 { gather } else { Gather { moments: false, features: false, ..gather } }
}

/// The picture that passes add up to, each but the first by its factor, in their order.
pub fn sum_of(first: &Film, others: &[Film], factors: &[Vec3]) -> Film {
    let mut film = first.clone();
    for (other, factor) in others.iter().zip(factors) {
        for (sum, color) in film.pixels.iter_mut().zip(&other.pixels) {
            *sum = (Vec3::from(*sum) + Vec3::from(*color) * *factor).to_array();
        }
    }
    film
}

impl Plate {
    fn new(settings: &Render, filter: &FilterTable, passes: usize) -> Self {
        let size = settings.size;
        let gather = Gather {
            clamp: settings.clamp.map(|c| c as f32),
            signed: filter.is_signed(),
            moments: settings.gathers_moments(),
            features: settings.gathers_features(),
        };
        let tally = |i: usize| Tally::new(places(i / passes, size).len(), gather_of(gather, i % passes));
        let tallies = (0..tile_count(size) * passes).map(tally).collect();
        Plate { size, gather, denoise: settings.denoise, passes, tallies }
    }
}

/// Renders the World as it stands, all samples at this one moment; `None` if `cancel` was raised.
///
/// `progress(done, total)` counts tiles and is called from any thread.
///
/// # Errors
/// What only shows once everything is placed: a focus behind the camera, too many primitives.
pub fn render(
    stage: &mut Stage,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Option<(Film, FrameStats)>, Diagnostics> {
    let mut exposure = Exposure::default();
    let whole = expose(stage, SampleSubset::WHOLE, &mut exposure, cancel, progress)?;
    let developed = exposure.develop().filter(|_| whole);
    Ok(developed.and_then(|(mut films, stats)| films.pop().map(|film| (film, stats))))
}

/// Adds a share of the samples of every pixel, at the moment at which the World stands; false if `cancel` was raised.
///
/// Shares are exposed in their order, under the same settings of the picture: sums are taken in that order, and the
/// seed that follows from the camera's pose is that of the first. Otherwise as [`render`].
///
/// # Errors
/// As [`render`].
pub fn expose(
    stage: &mut Stage,
    share: SampleSubset,
    exposure: &mut Exposure,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<bool, Diagnostics> {
    let start = Instant::now();
    hierarchy::update(stage)?;
    let rebuilt = extract::update(stage)?;
    exposure.stats.builds += u32::from(accelerate::update(stage, share, rebuilt));
    let mut settings = stage.settings();
    let surround_pass = exposure.passes.surround(&mut settings);
    if exposure.plate.is_none() {
        exposure.stats.seed = settings.seed.unwrap_or_else(|| lens::pose_seed(&stage.camera()));
    }
    let resolved = Settings::new(&settings, exposure.stats.seed);
    let mut camera = lens::camera_rays(stage, settings.size)?;
    if !resolved.lens {
        camera = camera.pinhole();
    }
    let environment = surround(stage, &settings, resolved.follows_paths())?;
    let before = stage.past.as_ref().map(|past| past.seen_from(stage, settings.size));
    let skins = skins::skins(stage)?;
    let mut materials = extract::materials(stage);
    exposure.passes.divide(&mut materials);
    let geometry = &stage.kept.geometry;
    let lights = Lights::new(lights::lights(stage, &exposure.passes), geometry, &materials)
        .under(environment.as_ref(), geometry)
        .environment_in_group(surround_pass);
    let Some((_, accelerator)) = &stage.kept.accelerator else { return Ok(false) };
    let filter = FilterTable::new(settings.filter, settings.filter_width());
    let context = RenderContext {
        geometry: &stage.kept.geometry,
        accelerator,
        materials: &materials,
        lights: &lights,
        textures: &skins,
        camera: &camera,
        motion: before.as_ref(),
        environment: environment.as_ref(),
        settings: &resolved,
        lanes: Width::detect(),
        filter: &filter,
        width: settings.size[0],
        light_groups: exposure.passes.count(),
        regions: None,
    };
    let built = Instant::now();
    let Exposure { plate, stats, guide, still, shelf, .. } = exposure;
    let plate = plate.get_or_insert_with(|| Plate::new(&settings, &filter, context.light_groups));
    let turns = settings.turns(share.of);
    for turn in 0..turns {
        let share = SampleSubset { index: share.index * turns + turn, of: share.of * turns };
        let kept = shelf.as_ref().and_then(|shelf| shelf.get(share.index));
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
        let counters = match still {
            None => tiles(estimator, share, plate, cancel, progress),
            Some((still, picture)) => stale_tiles(estimator, plate, still, *picture, stats, cancel, progress),
        };
        let Some(counters) = counters else { return Ok(false) };
        stats.counters += counters;
        if let Some((shelf, sent)) = shelf.as_mut().zip(sent) {
            shelf.put(share.index, sent);
        }
    }
    if let Some(shelf) = shelf {
        stats.reuse_bytes = shelf.bytes();
    }
    stats.tiles = plate.tallies.len() / plate.passes;
    stats.accel = accelerator.name();
    stats.build_seconds += (built - start).as_secs_f64();
    stats.render_seconds += built.elapsed().as_secs_f64();
    Ok(true)
}

/// Forgets what is kept between frames, as after work that fell over halfway.
pub fn forget(stage: &mut Stage) {
    stage.kept = Kept { stale_hierarchy: true, stale_geometry: true, ..Kept::default() };
}

/// Sees to it that the World as it stands can be rendered, without rendering it.
///
/// # Errors
/// A focus on an entity that does not exist or does not lie before the camera; a picture that cannot be read.
pub fn check(stage: &mut Stage) -> Result<(), Diagnostics> {
    lens::camera_rays(stage, stage.settings().size)?;
    skins::read_pictures(stage)
}

/// What surrounds the scene as the settings have it; a file is read unless it is the one that was read last, and what
/// sampling needs of it, if it is to be `sampled`, is kept with it.
fn surround(stage: &mut Stage, settings: &Render, sampled: bool) -> Result<Option<Environment>, Diagnostics> {
    let Render { environment_intensity: intensity, environment_rotation: rotation, .. } = *settings;
    let Some(name) = &settings.environment else {
        let sky = settings.sky.map(|colors| EnvironmentMap::Sky(colors.map(|c| c.as_vec3())));
        return Ok(sky.map(|source| {
            let mut sky = Environment::new(source, intensity, rotation);
            if sampled {
                sky.prepare();
            }
            sky
        }));
    };
    let key = (name.clone(), settings.transfer == Transfer::Srgb);
    let Kept { environment, pictures, .. } = &mut stage.kept;
    let mut kept = match environment.take() {
        Some((known, kept)) if known == key => kept.placed(intensity, rotation),
        _ => Environment::new(image::read_surroundings(pictures, &stage.base, name, key.1)?, intensity, rotation),
    };
    if sampled {
        kept.prepare();
    }
    *environment = Some((key, kept.clone()));
    Ok(Some(kept))
}

/// Takes again what may look otherwise than in the pictures before, and keeps the rest.
fn stale_tiles(
    estimator: Estimator,
    plate: &mut Plate,
    still: &mut Still,
    picture: usize,
    stats: &mut FrameStats,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Counters> {
    let context = estimator.context;
    let settings = context.settings;
    let draws = settings.integrator == Integrator::Path || !context.lights.emitters().is_empty();
    let changes =
        still.begin(picture, context.geometry.bounds(), if draws { context.lights.chances() } else { Vec::new() });
    let samples = (settings.rounds == 1 && !settings.features).then_some(settings.strata * settings.strata);
    let pixels = |tile: usize| places(tile, plate.size).len();
    if !still.make_room(&plate.tallies, pixels, samples) {
        return tiles(estimator, SampleSubset::WHOLE, plate, cancel, progress);
    }
    let (regions, kept) = still.parts(picture);
    let estimator = Estimator { context: RenderContext { regions: Some(regions), ..context }, ..estimator };
    let size = plate.size;
    let total = plate.tallies.len();
    let done = AtomicUsize::new(0);
    let trace = |worker: &mut Worker, (index, (tally, kept)): (usize, (&mut Tally, &mut KeptTile))| {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        worker.start_tile();
        let again =
            integrator::retrace(estimator, &places(index, size), &changes, &mut kept.trail, &mut kept.tally, worker);
        tally.clone_from(&kept.tally);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
        Some((worker.take_counters(), [again, kept.trail.len()]))
    };
    let both = plate.tallies.par_iter_mut().zip(kept.par_iter_mut()).enumerate();
    let traced: Option<Vec<_>> = both.map_init(Worker::default, trace).collect();
    let mut counters = Counters::default();
    let (mut again, mut all) = (0, 0);
    for (cost, [some, of]) in traced? {
        counters += cost;
        stats.tiles_kept += usize::from(some == 0);
        (again, all) = (again + some, all + of);
    }
    stats.share_kept = 1.0 - again as f64 / all.max(1) as f64;
    stats.reuse_bytes = still.bytes();
    Some(counters)
}

/// Adds a share of all samples, each tile to the tallies of its own; gives what they cost.
fn tiles(
    estimator: Estimator,
    share: SampleSubset,
    plate: &mut Plate,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Counters> {
    let size = plate.size;
    let total = plate.tallies.len() / plate.passes;
    let done = AtomicUsize::new(total * share.index as usize);
    let trace = |worker: &mut Worker, (index, tallies): (usize, &mut [Tally])| -> Option<Counters> {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        worker.start_tile();
        integrator::render_pixels(estimator, &places(index, size), share, tallies, worker);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, total * share.of as usize);
        Some(worker.take_counters())
    };
    let tiles = plate.tallies.par_chunks_mut(plate.passes).enumerate();
    let traced: Option<Vec<_>> = tiles.map_init(Worker::default, trace).collect();
    let mut counters = Counters::default();
    traced?.into_iter().for_each(|cost| counters += cost);
    Some(counters)
}

/// The means of what the tiles of a picture add up to.
fn develop<'a>(size: [u32; 2], gather: Gather, tiles: impl Iterator<Item = &'a Tally>) -> Film {
    let mut film = Film::new(size[0], size[1]);
    let count = film.pixels.len();
    if gather.features {
        film.layers.make_room_for_features(count);
    }
    if gather.moments {
        film.layers.variance = vec![0.0; count];
    }
    for (index, tally) in tiles.enumerate() {
        for (i, [x, y]) in places(index, size).into_iter().enumerate() {
            let pixel = y as usize * size[0] as usize + x as usize;
            film.pixels[pixel] = tally.color(i);
            if let Some(sum) = tally.feature(i) {
                film.layers.resolve(pixel, sum);
            }
            if let Some([_, variance]) = tally.spread(i) {
                film.layers.variance[pixel] = variance.min(f64::from(f32::MAX)) as f32;
            }
        }
    }
    film
}

pub fn tile_count([width, height]: [u32; 2]) -> usize {
    width.div_ceil(TILE) as usize * height.div_ceil(TILE) as usize
}

/// Pixels of a tile in squares of squares (Morton 1966), so that those that follow each other are neighbours.
fn places(tile: usize, size: [u32; 2]) -> Vec<[u32; 2]> {
    let across = size[0].div_ceil(TILE);
    let corner = [tile as u32 % across * TILE, tile as u32 / across * TILE];
    let every_second = |n: u32| (0..4).fold(0, |sum, bit| sum | (n >> (2 * bit) & 1) << bit);
    let place = |n: u32| [corner[0] + every_second(n), corner[1] + every_second(n >> 1)];
    (0..TILE * TILE).map(place).filter(|[x, y]| *x < size[0] && *y < size[1]).collect()
}
