//! One wave after the other: find hits, shade them, trace their shadow rays, go on with the rays they gave rise to.

use glam::Vec3;

use super::classic::{Classic, is_classic};
use super::group::{Met, Place};
use super::matt::Matt;
use super::{BATCH, View, feature, path, photon, recursive};
use crate::components::Integrator;
use crate::film::Feature;
use crate::trace::bsdf::Frame;
use crate::trace::sampler::{Node, Sampler};
use crate::trace::simd::Lanes;
use crate::trace::surfacing::Surfacing;
use crate::trace::texture::Cone;
use crate::trace::{Counters, Hit, Ray, Surface, Worker};

/// What becomes of the light that a ray finds.
#[derive(Clone, Copy, Debug)]
pub struct Errand {
    pub node: Node,
    /// Index of its sample in the batch.
    pub sample: u32,
    /// Factor of its light in the colour of the sample.
    pub weight: Vec3,
    /// Of the ray where it starts; in an [`Encounter`] where it ends.
    pub cone: Cone,
    /// Density per steradian with which the direction was sampled; 0 if nothing else could have found it.
    pub pdf: f32,
    /// Material of the body that the ray runs in and that swallows light, or [`CLEAR`].
    pub medium: u32,
    pub seeks: Seeks,
}

/// Whose light a ray still brings home. Other rays than those of photon mapping seek all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seeks {
    All,
    /// What comes straight from a light, and then as `Unsent`: photons have told the rest.
    Direct,
    /// That of lights which send no photons.
    Unsent,
}

/// Cosine below which a smooth normal is not trusted.
pub const LEAST_FACING: f32 = 1e-3;

/// No medium that swallows light.
pub const CLEAR: u32 = u32::MAX;

/// How much wider the cones of rays get that a diffuse surface scatters, in radians: far less than they are apart, so
/// that what they find of a texture stays true to its place.
pub const DIFFUSE_SPREAD: f32 = 0.1;

impl Errand {
    /// The errand of a ray in the one possible direction.
    pub fn onward(&self, node: Node, weight: Vec3) -> Errand {
        Errand { node, weight: self.weight * weight, pdf: 0.0, ..*self }
    }

    /// The cone of a ray whose direction was sampled with this density, 0 for the one possible direction: the wider the
    /// lobe, the wider the cone.
    pub fn scattered_cone(&self, pdf: f32) -> Cone {
        if pdf > 0.0 { self.cone.widened((0.5 / pdf.sqrt()).min(DIFFUSE_SPREAD)) } else { self.cone }
    }
}

/// Rays on their way, and their errands.
#[derive(Debug, Default)]
pub struct Wave {
    rays: Vec<Ray>,
    errands: Vec<Errand>,
}

impl Wave {
    #[inline]
    pub fn push(&mut self, ray: Ray, errand: Errand) {
        self.rays.push(ray);
        self.errands.push(errand);
    }

    pub fn rays(&self) -> &[Ray] {
        &self.rays
    }

    pub fn errands(&self) -> &[Errand] {
        &self.errands
    }

    pub fn get(&self, i: usize) -> (Ray, Errand) {
        (self.rays[i], self.errands[i])
    }

    pub fn clear(&mut self) {
        self.rays.clear();
        self.errands.clear();
    }
}

/// Shadow rays towards one light, with what each adds if nothing stands in its way.
#[derive(Debug, Default)]
pub struct Shadows {
    rays: Vec<Ray>,
    /// Ends of the rays, where transparent surfaces do not stop them.
    targets: Vec<Vec3>,
    gains: Vec<(u32, Vec3)>,
}

/// A sample's part in its pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lot {
    pub weight: f32,
    /// Square of its distance from the pixel's centre.
    pub off_center: f32,
}

impl Shadows {
    /// Asks whether the way to `target` is free.
    #[inline]
    pub fn push(&mut self, view: View, ray: Ray, target: Vec3, sample: u32, gain: Vec3) {
        self.rays.push(ray);
        if view.settings.transparent_shadows {
            self.targets.push(target);
        }
        self.gains.push((sample, gain));
    }
}

/// Bins of shadow rays for lights that are chosen among: those to one light run alike.
const BINS: usize = 32;

/// Memory of the waves, kept from batch to batch.
#[derive(Debug, Default)]
pub struct Buffers {
    wave: Wave,
    next: Wave,
    hits: Vec<Option<Hit>>,
    blocked: Vec<bool>,
    /// By light.
    shadows: Vec<Shadows>,
    /// Hits that are shaded side by side.
    places: Vec<Place>,
    /// Colour of each sample, pass by pass: see [`place`].
    pub colors: Vec<Vec3>,
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

    /// Adds the camera ray of the next sample.
    #[inline(always)]
    pub fn start(&mut self, ray: Ray, cone: Cone, lot: Lot) {
        let sample = self.lots.len() as u32;
        self.lots.push(lot);
        let errand =
            Errand { sample, node: Node::CAMERA, weight: Vec3::ONE, cone, pdf: 0.0, medium: CLEAR, seeks: Seeks::All };
        self.wave.push(ray, errand);
    }
}

/// A sample of a pixel, and its decisions.
pub type Sample = ([u32; 2], Sampler);

/// Where the light of a pass is added up for a sample.
#[inline]
pub fn place(sample: u32, pass: u32) -> u32 {
    sample + pass * BATCH as u32
}

/// The sample of such a place.
#[inline]
fn sample_at(place: u32) -> u32 {
    place % BATCH as u32
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
pub fn trace(view: View, samples: &[Sample], buffers: &mut Buffers, worker: &mut Worker) {
    let bins = match view.settings.integrator {
        Integrator::Path | Integrator::Photon => view.lights.len().min(BINS),
        // One for what shines among the primitives.
        Integrator::Whitted | Integrator::Distribution => view.lights.lamps().len() + 1,
    };
    buffers.shadows.resize_with(bins, Shadows::default);
    for depth in 1..=view.settings.max_depth {
        if buffers.wave.rays.is_empty() {
            return;
        }
        find(view, buffers, worker);
        if depth == 1 {
            worker.counters.primary_hits += buffers.hits.iter().flatten().count() as u64;
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
    buffers.hits.clear();
    buffers.hits.resize(buffers.wave.rays.len(), None);
    let hits = &mut buffers.hits;
    view.accelerator.closest_all(view.geometry, &buffers.wave.rays, worker, |i, hit| hits[i] = hit);
    if let Some(lookout) = view.lookout {
        let Wave { rays, errands } = &buffers.wave;
        let ends = rays.iter().zip(errands).zip(hits);
        let ends = ends.map(|((ray, errand), hit)| (errand.sample, hit.map_or(ray.t_max, |hit| hit.t)));
        worker.footprint.add(lookout, rays, ends);
    }
}

fn shade(view: View, samples: &[Sample], buffers: &mut Buffers, depth: u32, worker: &mut Worker) {
    let path = view.settings.follows_paths();
    // What the film is to know of a hit is found for each alone, and so is light of shining primitives in pictures that
    // look for it beside that of lamps.
    let alone = (view.settings.features && depth == 1) || view.photons.is_some();
    let side_by_side = !alone && (path || view.lights.emitters().is_empty());
    let mut places = std::mem::take(&mut buffers.places);
    places.clear();
    for i in 0..buffers.wave.rays.len() {
        let Buffers { wave, hits, colors, .. } = &mut *buffers;
        let (ray, errand, hit) = (&wave.rays[i], &mut wave.errands[i], hits[i]);
        let met = hit.map_or(f32::INFINITY, |hit| hit.t);
        if path && errand.seeks != Seeks::Unsent {
            path::cross_lamps(view, ray, met, errand, depth == 1, colors);
        }
        if errand.medium != CLEAR {
            errand.weight *= view.materials[errand.medium as usize].left_after(met);
        }
        let Some(hit) = hit else {
            let place = place(errand.sample, view.lights.surround_pass());
            colors[place as usize] += errand.weight * sky(view, ray.direction, errand);
            continue;
        };
        let tag = view.geometry.tag(hit.primitive);
        let material = &view.materials[tag.material as usize];
        let usual = side_by_side && if path { material.is_plain() } else { is_classic(view, material) };
        if usual && !view.skins.covers(tag.entity) {
            places.push([i as u32, tag.material]);
        } else {
            let sampler = samples[errand.sample as usize].1;
            shade_alone(view, (*ray, *errand, hit), sampler, buffers, depth, &mut worker.counters);
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

/// Shades one hit, of whatever material.
fn shade_alone(
    view: View,
    (ray, mut errand, hit): (Ray, Errand, Hit),
    sampler: Sampler,
    buffers: &mut Buffers,
    depth: u32,
    counters: &mut Counters,
) {
    let Buffers { next, shadows, colors, features, .. } = buffers;
    let (ray, hit) = (&ray, &hit);
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
    let Shadows { rays, targets, gains } = shadows;
    worker.counters.shadow_rays += rays.len() as u64;
    if let Some(lookout) = view.lookout {
        let ends = rays.iter().zip(&*gains).map(|(ray, (place, _))| (sample_at(*place), ray.t_max));
        worker.footprint.add(lookout, rays, ends);
    }
    let mut hits = 0;
    if view.settings.transparent_shadows {
        for ((ray, target), (sample, gain)) in rays.iter().zip(&*targets).zip(&*gains) {
            let share = visibility(view, *ray, *target, sample_at(*sample), worker);
            hits += u64::from(share == 0.0);
            colors[*sample as usize] += *gain * share;
        }
    } else {
        blocked.clear();
        blocked.resize(rays.len(), true);
        view.accelerator.occluded_all(view.geometry, rays, worker, |i, met| blocked[i] = met);
        // In the order of the wave, whatever order the rays were traced in.
        for ((sample, gain), blocked) in gains.iter().zip(&*blocked) {
            hits += u64::from(*blocked);
            if !blocked {
                colors[*sample as usize] += *gain;
            }
        }
    }
    worker.counters.shadow_hits += hits;
    rays.clear();
    targets.clear();
    gains.clear();
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
            worker.footprint.add(lookout, &[ray], std::iter::once((sample, rest)));
        }
    }
    share
}
