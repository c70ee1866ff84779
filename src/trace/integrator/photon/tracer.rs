//! Photons from the lights to where they come to rest.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::map::Photon;
use crate::base::limits;
use crate::base::random::combine;
use crate::trace::counters::Counters;
use crate::trace::integrator::path::{HitBsdf, scatter_one};
use crate::trace::material::texture::RayCone;
use crate::trace::material::{ShadingParams, TransportMode};
use crate::trace::sampler::{Sampler, sobol};
use crate::trace::soa::{Hit, Hits, Ray};
use crate::trace::wavefront::{
    Crossing, PathState, RayQueue, RenderContext, SurfaceInteraction, Worker, pass_surfaces,
};

/// Photons that are on their way together.
const CHUNK: u32 = 4096;

/// Photons at rest: those that came by mirrors and glass alone, and the rest. None of them comes straight from a light.
#[derive(Debug, Default)]
pub struct StoredPhotons {
    pub caustic: Vec<Photon>,
    pub diffuse: Vec<Photon>,
}

/// Sends `count` photons out; `None` if `cancel` was raised. The camera of the view plays no part.
///
/// Photon i is a function of the key, the count and i. They land in the order of chunks, and in each by the number of
/// their rays, then by i.
pub fn trace_photons(
    context: RenderContext,
    key: u64,
    count: u32,
    cancel: &AtomicBool,
) -> Option<(StoredPhotons, Counters)> {
    let chunk = |worker: &mut Worker, index: u32| {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        let first = index * CHUNK;
        worker.start_tile();
        let landed = PhotonTracer::new(context, key, count).run(first..(first + CHUNK).min(count), worker);
        Some((landed, worker.take_counters()))
    };
    let chunks: Option<Vec<_>> = (0..count.div_ceil(CHUNK)).into_par_iter().map_init(Worker::default, chunk).collect();
    let (mut all, mut counters) = (StoredPhotons::default(), Counters::default());
    for (landed, cost) in chunks? {
        all.caustic.extend(landed.caustic);
        all.diffuse.extend(landed.diffuse);
        counters += cost;
    }
    Some((all, counters))
}

struct PhotonTracer<'a> {
    context: RenderContext<'a>,
    key: u64,
    count: u32,
    wave: RayQueue,
    next: RayQueue,
    hits: Hits,
    /// Of each photon of the chunk: what it left the lights with, and whether a diffuse surface has scattered it since.
    powers: Vec<Vec3>,
    scattered: Vec<bool>,
    landed: StoredPhotons,
}

impl<'a> PhotonTracer<'a> {
    fn new(context: RenderContext<'a>, key: u64, count: u32) -> Self {
        PhotonTracer {
            context,
            key,
            count,
            wave: RayQueue::default(),
            next: RayQueue::default(),
            hits: Hits::default(),
            powers: Vec::new(),
            scattered: Vec::new(),
            landed: StoredPhotons::default(),
        }
    }

    fn run(mut self, photons: std::ops::Range<u32>, worker: &mut Worker) -> StoredPhotons {
        self.emit(photons.clone());
        let context = self.context;
        // So many that what comes to rest stays within bounds.
        let most = context.settings.max_depth.min(1 + limits::PHOTONS_AT_REST / self.count);
        for rays in 1..=most {
            let under_way = self.wave.rays().len();
            worker.traversal.counters.photon_rays += under_way as u64;
            context.accelerators.scattered.closest_all(
                context.geometry,
                self.wave.rays(),
                &mut worker.traversal,
                &mut self.hits,
            );
            let key = self.key;
            let sampler = |sample: u32| Sampler::new(key, photons.start + sample, 1);
            pass_surfaces((context, context.accelerators.scattered), &mut self.wave, &mut self.hits, sampler, worker);
            for i in 0..under_way {
                if let Some(hit) = self.hits.get(i) {
                    let (ray, state) = self.wave.get(i);
                    if let Some((ray, state)) = self.meet(photons.start, (ray, &hit), state, rays, rays == most) {
                        self.next.push(ray, state);
                    }
                }
            }
            std::mem::swap(&mut self.wave, &mut self.next);
            self.next.clear();
        }
        self.landed
    }

    fn emit(&mut self, photons: std::ops::Range<u32>) {
        let digits = sobol::digits(self.count);
        for photon in photons.clone() {
            let pair = |dimension: u64| sobol::pair(photon, digits, combine(self.key, dimension));
            let pick = sobol::single(photon, digits, combine(self.key, 0));
            let sent = self.context.lights.emit(pick, pair(1), pair(2));
            let power = sent.map_or(Vec3::ZERO, |sent| sent.power / self.count as f32);
            self.powers.push(power);
            self.scattered.push(false);
            if let Some(sent) = sent {
                self.wave.push(sent.ray, PathState::first(photon - photons.start, RayCone::default()));
            }
        }
    }

    /// What becomes of a photon where it meets a surface: it may come to rest there, and it may go on.
    fn meet(
        &mut self,
        first: u32,
        (ray, hit): (Ray, &Hit),
        mut state: PathState,
        rays: u32,
        last: bool,
    ) -> Option<(Ray, PathState)> {
        let context = self.context;
        let photon = state.sample as usize;
        if let Some(medium) = state.medium.material(context.materials) {
            state.throughput *= context.materials[medium as usize].transmittance(hit.t);
        } else if let Some(fog) = context.fog {
            state.throughput *= fog.transmittance(ray.origin, ray.direction, hit.t);
        }
        let mut surface = context.geometry.surface_point(&ray, hit);
        let mut material = &context.materials[surface.material as usize];
        state.cone = state.cone.at(hit.t);
        let textured = context.textures.evaluate(context.geometry, (&ray, hit), state.cone, &mut surface, material);
        if let Some(textured) = &textured {
            material = textured;
        }
        let front = ray.direction.dot(surface.geometric_normal) < 0.0;
        let surface = if front { surface } else { surface.flipped() };
        let sampler = Sampler::new(self.key, first + state.sample, 1);
        let crossing = Crossing::new(context.materials, state.medium, context.geometry.tag(hit.primitive), front);
        let nested = (crossing.ior != material.ior).then_some(ShadingParams { ior: crossing.ior, ..*material });
        let (material, behind) = (nested.as_ref().unwrap_or(material), crossing.behind);
        state.medium = crossing.before;
        let hit = *hit;
        let met =
            SurfaceInteraction { direction: ray.direction, state, surface, material, behind, hit, front, sampler };
        let seen = HitBsdf::new(context, &met, TransportMode::Power);
        if rays > 1 && seen.bsdf.is_diffuse() {
            let landed = Photon {
                position: surface.point,
                toward: -ray.direction,
                normal: surface.geometric_normal,
                power: self.powers[photon] * state.throughput,
                rays,
            };
            if self.scattered[photon] { &mut self.landed.diffuse } else { &mut self.landed.caustic }.push(landed);
        }
        if last {
            return None;
        }
        // Rays of photons are counted as such alone.
        let (onward, mut state) = scatter_one(context, &seen, rays, &mut Counters::default())?;
        self.scattered[photon] |= state.pdf > 0.0;
        // Light that is followed from the other end: smooth normals are not symmetric (Veach 1997, section 5.3.2).
        let [(true_in, smooth_in), (true_out, smooth_out)] = [-ray.direction, onward.direction]
            .map(|d| (surface.geometric_normal.dot(d).abs(), seen.frame.z.dot(d).abs()));
        let correction = smooth_in * true_out / (true_in * smooth_out).max(1e-6);
        state.throughput *= correction.min(MOST_CORRECTED);
        Some((onward, state))
    }
}

/// Where a smooth normal and the true one part widely, no photon becomes so strong that it shows as a spot.
const MOST_CORRECTED: f32 = 8.0;
