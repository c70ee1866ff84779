//! Columns -> film: the accelerator is brought up to date, then tiles are traced on all threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::stage::{AccelKey, Kept, Stage};
use super::{extract, hierarchy, lens, lights, skins};
use crate::base::diagnostics::Diagnostics;
use crate::components::{Integrator, Render, Transfer};
use crate::film::{Film, FilterTable, Gather, Tally, denoise};
use crate::load::image;
use crate::trace::environment::{Environment, Source};
use crate::trace::integrator::{self, Settings, Share, View};
use crate::trace::lights::Lights;
use crate::trace::{Accelerator, Counters, Worker};

/// Side of a tile in pixels: small enough to share out evenly, large enough for neighbours to share cells.
const TILE: u32 = 16;

/// What one frame cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    pub counters: Counters,
    /// Name of the accelerator that was used.
    pub accel: &'static str,
    /// Seed of the frame's sampling.
    pub seed: u64,
    pub build_seconds: f64,
    pub render_seconds: f64,
}

/// A frame while it is exposed: sums of samples, and what they cost so far.
#[derive(Default)]
pub struct Exposure {
    plate: Option<Plate>,
    stats: FrameStats,
}

/// What a frame's first share lays down for all of them.
struct Plate {
    size: [u32; 2],
    gather: Gather,
    denoise: bool,
    /// One for each tile.
    tallies: Vec<Tally>,
}

impl Exposure {
    /// The frame as means of its samples; `None` before its first share.
    pub fn develop(self) -> Option<(Film, FrameStats)> {
        let Plate { size, gather, denoise: wanted, tallies } = self.plate?;
        let mut film = develop(size, gather, &tallies);
        if wanted {
            denoise(&mut film);
        }
        Some((film, self.stats))
    }
}

impl Plate {
    fn new(settings: &Render, filter: &FilterTable) -> Self {
        let size = settings.size;
        let gather = Gather {
            clamp: settings.clamp.map(|c| c as f32),
            signed: filter.is_signed(),
            moments: settings.gathers_moments(),
            features: settings.gathers_features(),
        };
        let tally = |tile| Tally::new(places(tile, size).len(), gather);
        Plate { size, gather, denoise: settings.denoise, tallies: (0..tile_count(size)).map(tally).collect() }
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
    let whole = expose(stage, Share::WHOLE, &mut exposure, cancel, progress)?;
    Ok(exposure.develop().filter(|_| whole))
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
    share: Share,
    exposure: &mut Exposure,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<bool, Diagnostics> {
    let start = Instant::now();
    hierarchy::update(stage)?;
    let rebuilt = extract::update(stage)?;
    accelerate(stage, rebuilt);
    let settings = stage.settings();
    if exposure.plate.is_none() {
        exposure.stats.seed = settings.seed.unwrap_or_else(|| lens::pose_seed(&stage.camera()));
    }
    let resolved = Settings::new(&settings, exposure.stats.seed);
    let mut camera = lens::camera_rays(stage, settings.size)?;
    if !resolved.lens {
        camera = camera.pinhole();
    }
    let mut environment = surround(stage, &settings)?;
    if let Some(environment) = environment.as_mut().filter(|_| resolved.integrator == Integrator::Path) {
        environment.prepare();
    }
    let skins = skins::skins(stage)?;
    let materials = extract::materials(stage);
    let geometry = &stage.kept.geometry;
    let lights = Lights::new(lights::lights(stage), geometry, &materials).under(environment.as_ref(), geometry);
    let Some((_, accelerator)) = &stage.kept.accelerator else { return Ok(false) };
    let filter = FilterTable::new(settings.filter, settings.filter_width());
    let view = View {
        geometry: &stage.kept.geometry,
        accelerator,
        materials: &materials,
        lights: &lights,
        skins: &skins,
        camera: &camera,
        environment: environment.as_ref(),
        settings: &resolved,
        filter: &filter,
        width: settings.size[0],
    };
    let built = Instant::now();
    let plate = exposure.plate.get_or_insert_with(|| Plate::new(&settings, &filter));
    let Some(counters) = tiles(view, share, plate, cancel, progress) else { return Ok(false) };
    let stats = &mut exposure.stats;
    stats.counters += counters;
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

/// What surrounds the scene as the settings have it; a file is read unless it is the one that was read last.
fn surround(stage: &mut Stage, settings: &Render) -> Result<Option<Environment>, Diagnostics> {
    let Render { environment_intensity: intensity, environment_rotation: rotation, .. } = *settings;
    let Some(name) = &settings.environment else {
        let sky = settings.sky.map(|colors| Source::Sky(colors.map(|c| c.as_vec3())));
        return Ok(sky.map(|source| Environment::new(source, intensity, rotation)));
    };
    let key = (name.clone(), settings.transfer == Transfer::Srgb);
    let Kept { environment, pictures, .. } = &mut stage.kept;
    let kept = match environment.take() {
        Some((known, kept)) if known == key => kept.placed(intensity, rotation),
        _ => Environment::new(image::read_surroundings(pictures, &stage.base, name, key.1)?, intensity, rotation),
    };
    *environment = Some((key, kept.clone()));
    Ok(Some(kept))
}

/// Builds the accelerator if the columns or its settings changed.
fn accelerate(stage: &mut Stage, rebuilt: bool) {
    let settings = stage.settings();
    let key = AccelKey { choice: settings.accel, density: settings.grid_density };
    let fits = stage.kept.accelerator.as_ref().is_some_and(|(known, _)| *known == key);
    if rebuilt || !fits {
        let before = stage.kept.accelerator.as_ref().map(|(_, accelerator)| accelerator);
        let built = Accelerator::rebuild(&stage.kept.geometry, key.choice, key.density, before);
        stage.kept.accelerator = Some((key, built));
    }
}

/// Adds a share of all samples, each tile to the tally of its own.
fn tiles(
    view: View,
    share: Share,
    plate: &mut Plate,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Counters> {
    let (size, total) = (plate.size, plate.tallies.len());
    let done = AtomicUsize::new(total * share.index as usize);
    let trace = |worker: &mut Worker, (index, tally): (usize, &mut Tally)| -> Option<Counters> {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        worker.start_tile();
        integrator::expose(view, &places(index, size), share, tally, worker);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, total * share.of as usize);
        Some(std::mem::take(&mut worker.counters))
    };
    let traced: Option<Vec<Counters>> =
        plate.tallies.par_iter_mut().enumerate().map_init(Worker::default, trace).collect();
    let mut counters = Counters::default();
    traced?.into_iter().for_each(|cost| counters += cost);
    Some(counters)
}

/// The means of what the tiles of a picture add up to.
fn develop(size: [u32; 2], gather: Gather, tiles: &[Tally]) -> Film {
    let mut film = Film::new(size[0], size[1]);
    let count = film.pixels.len();
    if gather.features {
        film.layers.make_room_for_features(count);
    }
    if gather.moments {
        film.layers.variance = vec![0.0; count];
    }
    for (index, tally) in tiles.iter().enumerate() {
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

fn tile_count([width, height]: [u32; 2]) -> usize {
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
