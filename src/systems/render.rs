//! Columns -> film: the accelerator is brought up to date, then tiles are traced on all threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use super::stage::{AccelKey, Stage};
use super::{extract, hierarchy, lens, lights};
use crate::base::diagnostics::Diagnostics;
use crate::components::{Render, Transfer};
use crate::film::Film;
use crate::load::image;
use crate::trace::integrator::{Settings, Share, View, pixels};
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
    sums: Option<Film>,
    /// Samples of each pixel when all shares are in.
    samples: u32,
    stats: FrameStats,
}

impl Exposure {
    /// The frame as means of its samples; `None` before its first share.
    pub fn develop(self) -> Option<(Film, FrameStats)> {
        let mut film = self.sums?;
        for value in film.pixels.as_flattened_mut() {
            *value /= self.samples as f32;
        }
        Some((film, self.stats))
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
    if exposure.sums.is_none() {
        exposure.stats.seed = settings.seed.unwrap_or_else(|| lens::pose_seed(&stage.camera()));
        exposure.samples = settings.strata() * settings.strata();
    }
    let resolved = Settings::new(&settings, exposure.stats.seed);
    let mut camera = lens::camera_rays(stage, settings.size)?;
    if !resolved.lens {
        camera = camera.pinhole();
    }
    surround(stage, &settings)?;
    let (materials, lights) = (extract::materials(stage), lights::lights(stage));
    let Some((_, accelerator)) = &stage.kept.accelerator else { return Ok(false) };
    let view = View {
        geometry: &stage.kept.geometry,
        accelerator,
        materials: &materials,
        lights: &lights,
        camera: &camera,
        environment: settings.environment.as_ref().and(stage.kept.environment.as_ref().map(|(_, sky)| sky)),
        settings: &resolved,
        width: settings.size[0],
    };
    let built = Instant::now();
    let [width, height] = settings.size;
    let film = exposure.sums.get_or_insert_with(|| Film::new(width, height));
    let Some(counters) = tiles(view, share, film, cancel, progress) else { return Ok(false) };
    let stats = &mut exposure.stats;
    stats.counters += counters;
    stats.accel = accelerator.name();
    stats.build_seconds += (built - start).as_secs_f64();
    stats.render_seconds += built.elapsed().as_secs_f64();
    Ok(true)
}

/// Sees to it that the World as it stands can be rendered, without rendering it.
///
/// # Errors
/// A focus on an entity that does not exist or does not lie before the camera.
pub fn check(stage: &Stage) -> Result<(), Diagnostics> {
    lens::camera_rays(stage, stage.settings().size).map(|_| ())
}

/// Reads the sky that the settings name, unless it is the one that was read last.
fn surround(stage: &mut Stage, settings: &Render) -> Result<(), Diagnostics> {
    let Some(folder) = &settings.environment else { return Ok(()) };
    let key = (folder.clone(), settings.transfer == Transfer::Srgb);
    if stage.kept.environment.as_ref().is_none_or(|(known, _)| *known != key) {
        let sky = image::read_cube_map(&stage.base.join(&**folder), key.1)?;
        stage.kept.environment = Some((key, sky));
    }
    Ok(())
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

type Tile = (Vec<([u32; 2], Vec3)>, Counters);

/// Adds the sums of a share to the film, tile by tile.
fn tiles(
    view: View,
    share: Share,
    film: &mut Film,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Counters> {
    let [width, height] = [film.width, film.height];
    let across = width.div_ceil(TILE);
    let total = (across * height.div_ceil(TILE)) as usize;
    let (before, of_all) = (total * share.index as usize, total * share.of as usize);
    let done = AtomicUsize::new(before);
    let trace = |worker: &mut Worker, index: usize| -> Option<Tile> {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        let corner = [index as u32 % across * TILE, index as u32 / across * TILE];
        let places = places(corner, [width, height]);
        worker.start_tile();
        let sums = pixels(view, &places, share, worker);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, of_all);
        Some((places.into_iter().zip(sums).collect(), std::mem::take(&mut worker.counters)))
    };
    let traced: Option<Vec<Tile>> = (0..total).into_par_iter().map_init(Worker::default, trace).collect();
    let mut counters = Counters::default();
    for (tile, cost) in traced? {
        for ([x, y], sum) in tile {
            let pixel = &mut film.pixels[y as usize * width as usize + x as usize];
            *pixel = (Vec3::from_array(*pixel) + sum).to_array();
        }
        counters += cost;
    }
    Some(counters)
}

/// Pixels of a tile in squares of squares (Morton 1966), so that those that follow each other are neighbours.
fn places(corner: [u32; 2], size: [u32; 2]) -> Vec<[u32; 2]> {
    let every_second = |n: u32| (0..4).fold(0, |sum, bit| sum | (n >> (2 * bit) & 1) << bit);
    let place = |n: u32| [corner[0] + every_second(n), corner[1] + every_second(n >> 1)];
    (0..TILE * TILE).map(place).filter(|[x, y]| *x < size[0] && *y < size[1]).collect()
}
