//! One wave after the other: find hits, shade them, trace their shadow rays, go on with the rays they gave rise to.

use glam::Vec3;

use super::classic::{Classic, is_classic};
use super::errand::{CLEAR, Errand, Errands, Seeks, Shadows, Wave, place, sample_at};
use super::group::{Met, Place};
use super::matt::Matt;
use super::sift::Sift;
use super::{BATCH, View, feature, path, photon, recursive};
use crate::components::Integrator;
use crate::film::Feature;
use crate::trace::bsdf::Frame;
use crate::trace::sampler::{Sampler, Set};
use crate::trace::simd::{LANES, Lanes, V3, Wide};
use crate::trace::surfacing::Surfacing;
use crate::trace::texture::Cone;
use crate::trace::{Counters, Hit, Hits, Ray, Surface, Tag, Worker};

/// Cosine below which a smooth normal is not trusted.
pub const LEAST_FACING: f32 = 1e-3;

/// A sample's part in its pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lot {
    pub weight: f32,
    /// Square of its distance from the pixel's centre.
    pub off_center: f32,
}

/// Bins of shadow rays for lights that are chosen among: those to one light run alike.
const BINS: usize = 32;

/// Memory of the waves, kept from batch to batch.
#[derive(Debug, Default)]
pub struct Buffers {
    wave: Wave,
    next: Wave,
    hits: Hits,
    /// By eights of rays: which of them are to be looked at before they are shaded.
    special: Vec<u8>,
    blocked: Vec<bool>,
    /// By light.
    shadows: Vec<Shadows>,
    /// Hits that are shaded side by side.
    places: Vec<Place>,
    /// Colour of each sample, pass by pass: see [`place`].
    pub colors: Vec<Vec3>,
    /// Numbers of the samples, see [`Set`].
    pub numbers: Vec<u32>,
    /// Where each sample lies in its pixel.
    pub lots: Vec<Lot>,
    /// What the camera ray of each sample met; empty unless the film wants it.
    pub features: Vec<Option<Feature>>,
}

impl Buffers {
    pub fn begin(&mut self, samples: usize, passes: usize, features: bool) {
        self.wave.clear();
        self.lots.clear();
        self.features.clear();
        self.features.resize(if features { samples } else { 0 }, None);
        self.colors.clear();
        self.colors.resize((passes - 1) * BATCH + samples, Vec3::ZERO);
    }

    /// Adds the camera rays of the next samples, one for each lot.
    #[inline(always)]
    pub fn start<L: Wide>(&mut self, origin: V3<L>, direction: V3<L>, cone: Cone, lots: &[Lot]) {
        let first = self.lots.len() as u32;
        let mut samples = [0; LANES];
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample = first + i as u32;
        }
        self.wave.put((1 << lots.len()) - 1, origin, direction, &Errands::first(&samples, cone));
        for lot in lots {
            self.lots.push(*lot);
        }
    }
}

/// A ray, the surface that it met, and what the surface is of.
pub struct Encounter<'a> {
    pub direction: Vec3,
    pub errand: Errand,
    /// Faces the ray.
    pub surface: Surface,
    pub material: &'a Surfacing,
    /// Whether the ray comes from the outside.
    pub front: bool,
    pub sampler: Sampler,
}

impl Encounter<'_> {
    /// Axes of the surface, and the direction back along the ray in them; its z is positive.
    #[inline]
    pub fn frame(&self) -> (Frame, Vec3) {
        // A smooth normal may turn away from the ray: the true one does not.
        let facing = self.surface.shading_normal.dot(self.direction) < -LEAST_FACING;
        let normal = if facing { self.surface.shading_normal } else { self.surface.geometric_normal };
        let frame = Frame::new(normal);
        let wo = frame.to_local(-self.direction);
        (frame, Vec3::new(wo.x, wo.y, wo.z.max(1e-7)))
    }

    /// What the ray that goes through runs in.
    #[inline]
    pub fn medium_behind(&self) -> u32 {
        if self.front && self.material.absorption != Vec3::ZERO { self.surface.material } else { CLEAR }
    }
}

/// Traces the camera rays of these samples in the buffers and all that follow from them.
pub fn trace(view: View, samples: Set, buffers: &mut Buffers, worker: &mut Worker) {
    let bins = match view.settings.integrator {
        Integrator::Path | Integrator::Photon => view.lights.len().min(BINS),
        // One for what shines among the primitives.
        Integrator::Whitted | Integrator::Distribution => view.lights.lamps().len() + 1,
    };
    buffers.shadows.resize_with(bins, Shadows::default);
    for depth in 1..=view.settings.max_depth {
        if buffers.wave.rays().is_empty() {
            return;
        }
        find(view, buffers, worker);
        if depth == 1 {
            worker.counters.primary_hits += buffers.hits.found_count();
        }
        shade(view, samples, buffers, depth, worker);
        for shadows in &mut buffers.shadows {
            settle(view, shadows, &mut buffers.blocked, &mut buffers.colors, worker);
        }
        std::mem::swap(&mut buffers.wave, &mut buffers.next);
        buffers.next.clear();
    }
}

fn find(view: View, buffers: &mut Buffers, worker: &mut Worker) {
    let Buffers { wave, hits, .. } = buffers;
    view.accelerator.closest_all(view.geometry, wave.rays(), worker, hits);
    if let Some(lookout) = view.lookout {
        let ended = |(i, hit): (usize, Option<Hit>)| {
            let (ray, errand) = wave.get(i);
            (ray, errand.sample, hit.map_or(ray.t_max, |hit| hit.t))
        };
        worker.footprint.add(lookout, hits.iter().enumerate().map(ended));
    }
}

fn shade(view: View, samples: Set, buffers: &mut Buffers, depth: u32, worker: &mut Worker) {
    let path = view.settings.follows_paths();
    // What the film is to know of a hit is found for each alone, and so is light of shining primitives in pictures that
    // look for it beside that of lamps.
    let alone = (view.settings.features && depth == 1) || view.photons.is_some();
    let side_by_side = !alone && (path || view.lights.emitters().is_empty());
    let Buffers { wave, hits, special, .. } = &mut *buffers;
    let lamps = path && view.lights.met(depth == 1).next().is_some();
    view.lanes.run(Sift { view, wave, hits, lamps, camera: depth == 1, special });
    let mut places = std::mem::take(&mut buffers.places);
    places.clear();
    // Neighbours are mostly on one primitive, or at least of one material.
    let (mut primitive, mut tag, mut usual) = (u32::MAX, Tag::default(), false);
    let mut known = u32::MAX;
    for i in 0..buffers.wave.rays().len() {
        if buffers.special[i / LANES] >> (i % LANES) & 1 == 1 && !arrive(view, i, buffers, depth, lamps) {
            continue;
        }
        let met = buffers.hits.primitive(i);
        if met != primitive {
            (primitive, tag) = (met, view.geometry.tag(met));
            if tag.material != known {
                known = tag.material;
                let material = &view.materials[known as usize];
                usual = side_by_side && if path { material.is_plain() } else { is_classic(view, material) };
            }
        }
        if usual && !view.skins.covers(tag.entity) {
            places.push([i as u32, tag.material]);
        } else {
            shade_alone(view, samples, i, buffers, depth, &mut worker.counters);
        }
    }
    let Buffers { wave, next, hits, shadows, .. } = &mut *buffers;
    let met = Met { view, wave, hits, places: &places, samples };
    let counters = &mut worker.counters;
    if path {
        view.lanes.run(Matt { met, depth, shadows, next, counters });
    } else {
        view.lanes.run(Classic { met, last: depth == view.settings.max_depth, shadows, next, counters });
    }
    buffers.places = places;
}

/// Adds the light that a ray meets on its way, and takes what the way swallows; false if it leaves the scene.
fn arrive(view: View, i: usize, buffers: &mut Buffers, depth: u32, lamps: bool) -> bool {
    let Buffers { wave, hits, colors, .. } = buffers;
    let ((ray, mut errand), hit) = (wave.get(i), hits.get(i));
    let met = hit.map_or(f32::INFINITY, |hit| hit.t);
    if lamps && errand.seeks != Seeks::Unsent {
        path::cross_lamps(view, &ray, met, &errand, depth == 1, colors);
    }
    if errand.medium != CLEAR {
        errand.weight *= view.materials[errand.medium as usize].left_after(met);
        wave.set_errand(i, &errand);
    }
    if hit.is_none() {
        let place = place(errand.sample, view.lights.surround_pass());
        colors[place as usize] += errand.weight * sky(view, ray.direction, &errand);
    }
    hit.is_some()
}

/// Shades what one ray met, of whatever material.
fn shade_alone(view: View, samples: Set, i: usize, buffers: &mut Buffers, depth: u32, counters: &mut Counters) {
    let Buffers { wave, hits, next, shadows, colors, features, .. } = buffers;
    let Some(hit) = &hits.get(i) else { return };
    let (ray, mut errand) = wave.get(i);
    let (ray, sampler) = (&ray, *samples.sampler(errand.sample));
    let mut surface = view.geometry.surface(ray, hit);
    let mut material = &view.materials[surface.material as usize];
    errand.cone = errand.cone.at(hit.t);
    let dressed = view.skins.dress(view.geometry, (ray, hit), errand.cone, &mut surface, material);
    if let Some(dressed) = &dressed {
        material = dressed;
    }
    if material.emission != Vec3::ZERO {
        let asked = match view.settings.integrator {
            _ if errand.pdf == 0.0 && errand.seeks != Seeks::Unsent => 0.0,
            Integrator::Path | Integrator::Photon => view.lights.pdf(ray, hit, &surface),
            Integrator::Whitted | Integrator::Distribution => view.lights.pdf_emitters(ray, hit, &surface),
        };
        // Photons come from where light is asked for.
        if errand.seeks != Seeks::Unsent || asked == 0.0 {
            let place = place(errand.sample, material.pass);
            colors[place as usize] += errand.weight * (material.emission * found(errand.pdf, asked));
        }
    }
    let front = ray.direction.dot(surface.geometric_normal) < 0.0;
    let surface = if front { surface } else { surface.flipped() };
    let met = Encounter { direction: ray.direction, errand, surface, material, front, sampler };
    if view.settings.features && depth == 1 {
        features[errand.sample as usize] = Some(feature::seen(view, &met));
    }
    if let Some(photons) = view.photons {
        let color = &mut colors[errand.sample as usize];
        photon::shade(view, photons, &met, depth, photon::Sinks { color, shadows, next }, counters);
    } else if view.settings.follows_paths() {
        path::shade(view, &met, depth, shadows, next, counters);
    } else {
        recursive::shade(view, &met, depth == view.settings.max_depth, shadows, next, counters);
    }
}

/// What a ray sees that leaves the scene, by its weight. Where it was asked for too, both ask the same point.
fn sky(view: View, direction: Vec3, errand: &Errand) -> Vec3 {
    match view.environment {
        None => view.settings.background,
        Some(sky) if errand.pdf == 0.0 => sky.lookup_wide(direction, errand.cone),
        Some(sky) => {
            let asked = match view.photons {
                Some(photons) if errand.seeks == Seeks::Unsent => photons.unsent(),
                _ => view.lights,
            };
            sky.lookup(direction) * found(errand.pdf, asked.sky_pdf(direction))
        }
    }
}

/// Weight of light that a ray found by itself, where lights were asked for it too: the power heuristic (Veach 1997,
/// section 9.2). 0 stands for a density of which there is none.
#[inline(always)]
pub fn found<L: Lanes>(pdf: L, asked: L) -> L {
    let one = L::splat(1.0);
    // The smaller one is divided: no square can overflow.
    let ratio = asked / pdf;
    L::select(pdf.ne(L::splat(0.0)), one / (one + ratio * ratio), one)
}

/// Traces the shadow rays towards a light and adds what gets through.
fn settle(view: View, shadows: &mut Shadows, blocked: &mut Vec<bool>, colors: &mut [Vec3], worker: &mut Worker) {
    let rays = &shadows.rays;
    worker.counters.shadow_rays += rays.len() as u64;
    if let Some(lookout) = view.lookout {
        let rays = rays.iter().enumerate().map(|(i, ray)| (ray, sample_at(shadows.gain(i).0), ray.t_max));
        worker.footprint.add(lookout, rays);
    }
    let mut hits = 0;
    if view.settings.transparent_shadows {
        for (i, ray) in rays.iter().enumerate() {
            let (place, gain) = shadows.gain(i);
            let share = visibility(view, ray, shadows.target(i), sample_at(place), worker);
            hits += u64::from(share == 0.0);
            colors[place as usize] += gain * share;
        }
    } else {
        view.accelerator.occluded_all(view.geometry, rays, worker, blocked);
        // In the order of the wave, whatever order the rays were traced in.
        for (i, blocked) in blocked.iter().enumerate() {
            hits += u64::from(*blocked);
            if !blocked {
                let (place, gain) = shadows.gain(i);
                colors[place as usize] += gain;
            }
        }
    }
    worker.counters.shadow_hits += hits;
    shadows.clear();
}

/// Share of light that gets along the ray to `target`, dimmed by each transparent surface on its way.
fn visibility(view: View, mut ray: Ray, target: Vec3, sample: u32, worker: &mut Worker) -> f32 {
    let mut share = 1.0;
    while let Some(hit) = view.accelerator.closest(view.geometry, &ray, worker) {
        let surface = view.geometry.surface(&ray, &hit);
        share *= view.materials[surface.material as usize].transmission;
        let origin = surface.leave(ray.direction);
        let rest = (target - origin).dot(ray.direction);
        // A ray that does not get ahead has reached the light, as far as `f32` can tell.
        if share == 0.0 || rest <= 0.0 || rest >= ray.t_max {
            break;
        }
        ray = Ray { origin, t_max: rest, ..ray };
        if let Some(lookout) = view.lookout {
            worker.footprint.add(lookout, std::iter::once((ray, sample, rest)));
        }
    }
    share
}
