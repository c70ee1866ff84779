//! Photon mapping (Jensen 1996), in passes whose mean has no bias in the end (Knaus and Zwicker, "Progressive Photon
//! Mapping: A Probabilistic Approach", ACM TOG 2011).
//!
//! Each pass sends photons of its own from the lights and traces its share of every pixel's samples. A path from the
//! eye is traced as [`super::path`] does, through mirrors, glass and gloss, up to the matt part of a surface: there it
//! asks lights, and the light that reached the surface by way of others is read from how densely photons lie around.
//! From pass to pass the radius of that search shrinks, so that noise and blur of the mean both vanish. Photons of
//! caustics are spread farther where they are few, by what the first pass has seen.
//!
//! What sends no photons is left to the paths, which then go on: the sky, and lamps that do not fall off. Photons know
//! nothing of the camera: they stand still while it moves, and [`Shelf`] keeps them.

mod map;
mod shelf;
mod shoot;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::Vec3;
use rayon::prelude::*;

use super::errand::{Errand, Seeks, Shadows, Wave};
use super::path::{self, Seen};
use super::wave::Encounter;
use super::{Settings, View};
use crate::base::limits;
use crate::base::random::combine;
use crate::trace::Counters;
use crate::trace::bsdf::{Bsdf, Frame, Transport};
use crate::trace::geometry::Kind;
use crate::trace::lights::{Light, Lights};
use crate::trace::sampler::Domain;
use map::{Photon, PhotonMap, REACHES, shrinking, spacing};
pub use shelf::Shelf;
use shoot::{Landed, shoot};

/// Photons that a disk of the first radius holds, where they lie as densely as at the median of them.
const DIFFUSE_COUNT: f32 = 48.0;
const CAUSTIC_COUNT: f32 = 24.0;

/// What the first pass tells the others.
#[derive(Clone)]
pub struct Guide {
    /// Radii of the first pass: of caustics where they are dense, and of what matt surfaces have scattered.
    radii: [f64; 2],
    /// Caustics of the first pass. How far a photon is spread follows from how dense they are where it lies, so that its
    /// power is spread in whole, and by photons that are mostly not its own pass's.
    caustic: Arc<PhotonMap>,
}

/// What one pass knows of the light.
pub struct Photons {
    /// Caustics, by how far their photons reach.
    caustic: [PhotonMap; REACHES.len()],
    /// What matt surfaces have scattered.
    diffuse: PhotonMap,
    guide: Guide,
    /// Lamps that send no photons.
    unsent: Lights,
    /// Whether any light is left to paths beyond the first matt surface.
    goes_on: bool,
}

/// Photons by how far they reach, each list in their order.
fn by_reach(photons: Vec<Photon>, guide: &PhotonMap) -> [Vec<Photon>; REACHES.len()] {
    let reaches: Vec<usize> = photons.par_iter().map(|photon| guide.reach(photon.position, photon.normal)).collect();
    let mut parts: [Vec<Photon>; REACHES.len()] = Default::default();
    for (reach, photon) in reaches.into_iter().zip(photons) {
        parts[reach].push(photon);
    }
    parts
}

/// As dense as the photons of a pass lie; a fortieth of the scene where that cannot be told.
fn radii_of(landed: &Landed, scene: f32) -> [f64; 2] {
    let diffuse = spacing(&landed.diffuse, DIFFUSE_COUNT);
    let caustic = spacing(&landed.caustic, CAUSTIC_COUNT);
    let either = diffuse.or(caustic).unwrap_or(scene / 40.0);
    [caustic, diffuse].map(|radius| radius.unwrap_or(either).into())
}

impl Photons {
    /// Sends the photons of a pass, counted from 0; `None` if `cancel` was raised. The first pass makes the guide of the
    /// others.
    pub fn new(view: View, pass: u32, guide: Option<&Guide>, cancel: &AtomicBool) -> Option<(Photons, Counters)> {
        let Settings { photons, photon_seed, photon_radius, .. } = *view.settings;
        let count = if view.lights.power() > 0.0 { photons } else { 0 };
        let (landed, counters) = shoot(view, combine(photon_seed, u64::from(pass)), count, cancel)?;
        let radii = match (guide, photon_radius) {
            (Some(guide), _) => guide.radii,
            (None, Some(radius)) => [radius; 2],
            (None, None) => radii_of(&landed, view.geometry.bounds().size().length()),
        };
        let shrunk = shrinking(pass).sqrt();
        let [caustic, diffuse] = radii.map(|first| (first * shrunk) as f32);
        let guide = guide.cloned().unwrap_or_else(|| {
            let caustic = Arc::new(PhotonMap::new(landed.caustic.clone(), caustic));
            Guide { radii, caustic }
        });
        let mut parts = by_reach(landed.caustic, &guide.caustic);
        let caustic = std::array::from_fn(|i| PhotonMap::new(std::mem::take(&mut parts[i]), caustic * REACHES[i]));
        let lamps: Vec<Light> = view.lights.lamps().iter().filter(|lamp| !lamp.inverse_square).copied().collect();
        let sky = view.environment.is_some() || view.settings.background != Vec3::ZERO;
        let photons = Photons {
            caustic,
            diffuse: PhotonMap::new(landed.diffuse, diffuse),
            guide,
            goes_on: sky || !lamps.is_empty() || shines_unasked(view),
            unsent: Lights::new(lamps, view.geometry, &[]).under(view.environment, view.geometry),
        };
        Some((photons, counters))
    }

    pub fn guide(&self) -> &Guide {
        &self.guide
    }

    /// Memory that it takes, without the guide.
    fn bytes(&self) -> usize {
        self.caustic.iter().chain([&self.diffuse]).map(PhotonMap::bytes).sum()
    }

    /// Lights that send no photons.
    pub fn unsent(&self) -> &Lights {
        &self.unsent
    }

    /// Light that surfaces have sent to this one, scattered by its matt part towards the eye.
    fn gather(&self, met: &Encounter, bsdf: &Bsdf, frame: &Frame, wo: Vec3, most_rays: u32) -> Vec3 {
        let normal = met.surface.geometric_normal;
        let mut sum = Vec3::ZERO;
        for map in self.caustic.iter().chain([&self.diffuse]) {
            map.around(met.surface.point, normal, 1.0, |photon, share| {
                if photon.rays <= most_rays {
                    // Power is counted by the true normal, scattering by the smooth one.
                    let cosine = normal.dot(photon.toward).max(LEAST_COSINE);
                    let shown = met.surface.terminator(photon.toward);
                    sum += bsdf.matt(wo, frame.to_local(photon.toward)) * photon.power * (share * shown / cosine);
                }
            });
        }
        sum
    }
}

/// Photons that graze a surface are not trusted to tell their cosine.
const LEAST_COSINE: f32 = 1e-3;

/// Whether there are primitives that shine and are no lights to ask.
fn shines_unasked(view: View) -> bool {
    let shines = |n: &u32| view.materials[view.geometry.tag(*n).material as usize].emission != Vec3::ZERO;
    let unasked = [Kind::Cone, Kind::Placed, Kind::Plane];
    view.materials.iter().any(|material| material.emission != Vec3::ZERO)
        && (view.lights.emitters().len() >= limits::EMITTERS
            || unasked.into_iter().any(|kind| view.geometry.range(kind).any(|n| shines(&n))))
}

/// Where light goes that a path finds, and rays that it asks for.
pub struct Sinks<'a> {
    /// Of the path's sample.
    pub color: &'a mut Vec3,
    pub shadows: &'a mut [Shadows],
    pub next: &'a mut Wave,
}

/// What a path does where it meets a surface.
pub fn shade(view: View, photons: &Photons, met: &Encounter, depth: u32, sinks: Sinks, counters: &mut Counters) {
    let bsdf = Bsdf::new(met.material, met.front, view.settings.fresnel, Transport::Radiance);
    let (frame, wo) = met.frame();
    let last = depth == view.settings.max_depth;
    let all = met.errand.seeks == Seeks::All;
    let lights = if all { view.lights } else { &photons.unsent };
    if !bsdf.is_specular() && !sinks.shadows.is_empty() && !lights.is_empty() {
        path::ask(view, lights, met, &Seen { bsdf, frame, wo, last }, sinks.shadows);
    }
    if all && bsdf.is_matt() {
        let most_rays = view.settings.max_depth + 1 - depth;
        *sinks.color += met.errand.weight * photons.gather(met, &bsdf, &frame, wo, most_rays);
    }
    if last || !(all || photons.goes_on) {
        return;
    }
    let Some((ray, mut errand)) = path::scatter(met, &bsdf, &frame, wo, depth, counters) else { return };
    if !all {
        errand.seeks = Seeks::Unsent;
    } else if errand.pdf > 0.0 && bsdf.is_matt() {
        divide(met, &bsdf, wo, frame.to_local(ray.direction), &mut errand);
    }
    if errand.weight != Vec3::ZERO {
        sinks.next.push(ray, errand);
    }
}

/// Of what a surface sends along a ray, photons have told the matt part but for what comes straight from lights; the
/// rest goes on in full. Chance decides which of the two the ray is for.
fn divide(met: &Encounter, bsdf: &Bsdf, wo: Vec3, wi: Vec3, errand: &mut Errand) {
    let (whole, matt) = (bsdf.eval(wo, wi), bsdf.matt(wo, wi));
    let rest = (whole - matt).max(Vec3::ZERO);
    let chance = rest.element_sum() / (rest + matt).element_sum();
    // Not so where nothing is left at all: the chance is no number.
    let followed = chance > 0.0 && met.sampler.random(errand.node, Domain::Part)[0] < chance;
    if !followed {
        errand.seeks = Seeks::Direct;
    }
    if chance > 0.0 {
        let (part, chance) = if followed { (rest, chance) } else { (matt, 1.0 - chance) };
        errand.weight *= Vec3::select(whole.cmpgt(Vec3::ZERO), part / whole, Vec3::ZERO) / chance;
    }
}
