//! The photons of one pass, by kind and by reach.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::Vec3;
use rayon::prelude::*;

use super::domain::SurfaceDomain;
use super::map::{Photon, PhotonMap, REACHES, shrinking, spacing};
use super::tracer::{StoredPhotons, trace_photons};
use crate::base::limits;
use crate::base::random::combine;
use crate::trace::accel::TraversalScratch;
use crate::trace::counters::Counters;
use crate::trace::integrator::path::HitBsdf;
use crate::trace::light::{Lamp, Lights};
use crate::trace::primitive::PrimitiveKind;
use crate::trace::sampler::Domain;
use crate::trace::wavefront::{RenderContext, Settings};

/// Photons that a disk of the first radius holds, where they lie as densely as at the median of them.
const DIFFUSE_COUNT: f32 = 48.0;

const CAUSTIC_COUNT: f32 = 24.0;

/// What the first pass tells the others.
#[derive(Clone)]
pub struct ProgressiveState {
    /// Radii of the first pass: of caustics where they are dense, and of what diffuse surfaces have scattered.
    pub radii: [f64; 2],
    /// Caustics of the first pass. How far a photon is spread follows from how dense they are where it lies, so that
    /// its power is spread in whole, and by photons that are mostly not its own pass's.
    pub caustic: Arc<PhotonMap>,
}

/// What one pass knows of the light.
pub struct PhotonPass {
    /// Caustics, by how far their photons reach.
    pub caustic: [PhotonMap; REACHES.len()],
    /// What diffuse surfaces have scattered.
    pub diffuse: PhotonMap,
    /// What its passes looked at.
    pub guide: ProgressiveState,
    /// Lamps that send no photons.
    pub non_photon: Lights,
    /// Whether any light is left to paths beyond the first diffuse surface.
    pub goes_on: bool,
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
fn radii_of(landed: &StoredPhotons, scene: f32) -> [f64; 2] {
    let diffuse = spacing(&landed.diffuse, DIFFUSE_COUNT);
    let caustic = spacing(&landed.caustic, CAUSTIC_COUNT);
    let either = diffuse.or(caustic).unwrap_or(scene / 40.0);
    [caustic, diffuse].map(|radius| radius.unwrap_or(either).into())
}

impl PhotonPass {
    /// Sends the photons of a pass, counted from 0; `None` if `cancel` was raised. The first pass makes the state of
    /// the others.
    pub fn new(
        context: RenderContext,
        pass: u32,
        guide: Option<&ProgressiveState>,
        cancel: &AtomicBool,
    ) -> Option<(PhotonPass, Counters)> {
        let Settings { photons, photon_seed, photon_radius, .. } = *context.settings;
        let count = if context.lights.power() > 0.0 { photons } else { 0 };
        let (landed, counters) = trace_photons(context, combine(photon_seed, u64::from(pass)), count, cancel)?;
        let radii = match (guide, photon_radius) {
            (Some(guide), _) => guide.radii,
            (None, Some(radius)) => [radius; 2],
            (None, None) => radii_of(&landed, context.geometry.bounds().size().length()),
        };
        let shrunk = shrinking(pass).sqrt();
        let [caustic, diffuse] = radii.map(|first| (first * shrunk) as f32);
        let guide = guide.cloned().unwrap_or_else(|| {
            let caustic = Arc::new(PhotonMap::new(landed.caustic.clone(), caustic));
            ProgressiveState { radii, caustic }
        });
        let mut parts = by_reach(landed.caustic, &guide.caustic);
        let caustic = std::array::from_fn(|i| PhotonMap::new(std::mem::take(&mut parts[i]), caustic * REACHES[i]));
        let lamps: Vec<Lamp> = context.lights.lamps().iter().filter(|lamp| !lamp.inverse_square).copied().collect();
        let sky = context.environment.is_some() || context.settings.background != Vec3::ZERO;
        let photons = PhotonPass {
            caustic,
            diffuse: PhotonMap::new(landed.diffuse, diffuse),
            guide,
            goes_on: sky || !lamps.is_empty() || shines_unasked(context),
            non_photon: Lights::new(lamps, context.geometry, &[])
                .under(context.environment, context.geometry)
                .linked(context.lights.links().cloned()),
        };
        Some((photons, counters))
    }

    /// What the passes so far looked at.
    pub fn guide(&self) -> &ProgressiveState {
        &self.guide
    }

    /// Memory that it takes, without the guide.
    pub fn bytes(&self) -> usize {
        self.caustic.iter().chain([&self.diffuse]).map(PhotonMap::bytes).sum()
    }

    /// Lights that send no photons.
    pub fn non_photon(&self) -> &Lights {
        &self.non_photon
    }

    /// Light that surfaces have sent to this one, scattered by its diffuse part towards the eye.
    pub fn gather(
        &self,
        context: RenderContext,
        seen: &HitBsdf,
        most_rays: u32,
        traversal: &mut TraversalScratch,
    ) -> Vec3 {
        let met = seen.met;
        let maps = || self.caustic.iter().chain([&self.diffuse]);
        let sums: Vec<Vec3> = maps().map(|map| light_of(map, seen, most_rays, |_| true)).collect();
        let whole: Vec3 = sums.iter().sum();
        if whole == Vec3::ZERO {
            return whole;
        }
        let reach = maps().zip(&sums).filter(|(_, sum)| **sum != Vec3::ZERO).map(|(map, _)| map.radius());
        let turn = met.sampler.extra(met.state.node, Domain::Gather);
        let domain = SurfaceDomain::new(context, met, reach.fold(0.0, f32::max), turn, traversal);
        if domain.is_whole() {
            return whole;
        }
        let inside = |map: &PhotonMap| {
            light_of(map, seen, most_rays, |photon| domain.contains(photon.position - met.surface.point))
                / domain.share(map.radius())
        };
        maps().zip(sums).filter(|(_, sum)| *sum != Vec3::ZERO).map(|(map, _)| inside(map)).sum()
    }
}

/// Light of the photons of a map that count, scattered by the diffuse part of a surface towards the eye.
fn light_of(map: &PhotonMap, seen: &HitBsdf, most_rays: u32, counts: impl Fn(&Photon) -> bool) -> Vec3 {
    let HitBsdf { met, bsdf, frame, wo } = seen;
    let normal = met.surface.geometric_normal;
    let mut sum = Vec3::ZERO;
    map.around(met.surface.point, normal, 1.0, |photon, share| {
        if photon.rays <= most_rays && counts(photon) {
            // Power is counted by the true normal, scattering by the smooth one.
            let cosine = normal.dot(photon.toward).max(LEAST_COSINE);
            let shown = met.surface.terminator(photon.toward);
            sum += bsdf.diffuse(*wo, frame.to_local(photon.toward)) * photon.power * (share * shown / cosine);
        }
    });
    sum
}

/// Photons that graze a surface are not trusted to tell their cosine.
const LEAST_COSINE: f32 = 1e-3;

/// Whether there are primitives that emit light and cannot be sampled.
fn shines_unasked(context: RenderContext) -> bool {
    let shines = |n: &u32| context.materials[context.geometry.tag(*n).material as usize].emission != Vec3::ZERO;
    let unsampled = PrimitiveKind::ALL.into_iter().filter(|kind| !kind.is_sampled());
    context.materials.iter().any(|material| material.emission != Vec3::ZERO)
        && (context.lights.emitters().len() >= limits::EMITTERS
            || unsampled.clone().any(|kind| context.geometry.range(kind).any(|n| shines(&n))))
}
